//! Board files that are wrong, and boards that begin anew, at the border of the process.

use std::fs;
use std::io::Write as _;
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::{Folder, done, refused, taxel};
use serde_json::Value;
use taxel_board::{Board, Encoder, board_file_of_hello};
use taxel_recording::Frame;
use taxel_recording::mcap::{LinkMessage, McapReader, Message as _, Topic};

/// A server that serves each of its connections so, and its address as a source.
fn server(serve: impl Fn(usize, &mut TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let source = format!("tcp:{}", listener.local_addr().unwrap());
    thread::spawn(move || {
        for (number, stream) in listener.incoming().enumerate() {
            serve(number, &mut stream.unwrap());
        }
    });
    source
}

/// Sends lines at a rate, Hz, until they or the client end.
fn send(stream: &mut TcpStream, rate: f64, lines: impl Iterator<Item = String>) {
    let begin = Instant::now();
    for (number, line) in lines.enumerate() {
        let due = begin + Duration::from_secs_f64(number as f64 / rate);
        thread::sleep(due.saturating_duration_since(Instant::now()));
        if stream.write_all(line.as_bytes()).is_err() {
            return;
        }
    }
}

fn written(folder: &Folder, name: &str, text: &str) -> String {
    let path = folder.path(name);
    fs::write(&path, format!("schema = 1\nname = \"board\"\n{text}\n")).unwrap();
    path
}

/// Summary and standard error of a run.
fn live(arguments: &[&str]) -> (Value, String) {
    let begin = ["live", "--raw", "--headless", "--format", "json"];
    let output = taxel(&[&begin[..], arguments].concat());
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (
        serde_json::from_slice(&output.stdout).unwrap_or_default(),
        errors,
    )
}

#[test]
fn a_wrong_rate_is_told_in_notice_summary_and_recording() {
    let folder = Folder::new("wrong-rate");
    for (stated, rate, frames) in [("100 Hz", 200.0, "1300"), ("200 Hz", 100.0, "650")] {
        let text = format!("rate = \"{stated}\"\nframing.lines = {{ template = \"{{value x}}\" }}");
        let board = written(&folder, "board.toml", &text);
        let source = server(move |_, stream| {
            let lines = (0..).map(|number| format!("{}\n", number % 9));
            send(stream, rate, lines);
        });
        let file = folder.path(&format!("{rate}.mcap"));
        let run = ["--board", &board, "--source", &source, "--frames", frames];
        let (found, errors) = live(&[&run[..], &["--record", &file]].concat());
        let line = |text: &str| {
            // To three digits of what this machine sends.
            let (_, said) = text.split_once("write rate = \"").unwrap_or_default();
            said.split(' ').next().unwrap_or_default().parse::<f64>()
        };
        let reason = || {
            let mut messages = McapReader::new(fs::File::open(&file).unwrap());
            let mut reason = String::new();
            while let Some(entry) = messages.next().unwrap() {
                let link = (entry.topic == Topic::Link).then(|| LinkMessage::decode(entry.bytes));
                if let Some(link) = link.flatten()
                    && link.reason.contains("rate")
                {
                    reason = link.reason;
                }
            }
            reason
        };
        for text in [
            errors.as_str(),
            found["link"]["remark"].as_str().unwrap(),
            found["notice"].as_str().unwrap(),
            &reason(),
        ] {
            let told = line(text).unwrap_or(f64::NAN);
            assert!((told / rate - 1.0).abs() < 0.05, "{stated}: {text}");
        }
    }
}

/// What is known of the wire holds on over a reconnect, in the decoding of a recording too.
#[test]
fn a_recording_with_reconnects_is_decoded_as_it_was_read() {
    let folder = Folder::new("decode-reconnect");
    let text = "framing.lines = { template = \"{value x}\" }\npacket.step_limit = 50.0";
    let board = written(&folder, "board.toml", text);
    // The first reading behind each reconnect is far from all others.
    let source = server(|connection, stream| {
        let first = 900 * connection.min(1);
        let lines = (0..80).map(|n| if n == 1 { first } else { n % 3 });
        send(stream, 400.0, lines.map(|value| format!("{value}\n")));
    });
    let (file, saved, decoded) = (
        folder.path("run.mcap"),
        folder.path("saved.csv"),
        folder.path("decoded.csv"),
    );
    let run = ["--board", &board, "--source", &source, "--frames", "200"];
    let (found, errors) = live(&[&run[..], &["--record", &file, "--save", &saved]].concat());
    assert!(found["link"]["connects"].as_u64() >= Some(3), "{errors}");
    taxel(&[
        "recording",
        "decode",
        &file,
        "--board",
        &board,
        "-o",
        &decoded,
    ]);
    let values = |path: &str| {
        let text = fs::read_to_string(path).unwrap();
        let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
        rows.filter_map(|row| Some(row.rsplit_once(',')?.1.to_owned()))
            .collect::<Vec<_>>()
    };
    let (saved, decoded) = (values(&saved), values(&decoded));
    assert!(decoded.len() >= 200, "{}", decoded.len());
    assert_eq!(saved[..200], decoded[..200]);
}

#[test]
fn restarts_are_counted_once() {
    let folder = Folder::new("restarts");
    let text = "rate = \"400 Hz\"\nframing.lines = { template = \"{sequence},{value x}\" }";
    let board = written(&folder, "board.toml", text);
    let source = server(|_, stream| {
        let lines = (0..600).map(|number| format!("{},{}\n", number % 200, number % 7));
        send(stream, 400.0, lines);
    });
    let run = ["--board", &board, "--source", &source, "--frames", "590"];
    let (found, errors) = live(&run);
    assert_eq!(found["link"]["wire"]["restarts"], 2, "{errors}");
    assert_eq!(found["restarts"], 2);
}

#[test]
fn a_virtual_device_says_the_rate_at_which_it_sends() {
    let device = ["device", "three-axis-unit", "--board", "taxel-wire-1"];
    let sent = taxel(
        &[
            &device[..],
            &["--on", "-", "--frames", "3", "--rate", "500 Hz"],
        ]
        .concat(),
    );
    let hello = String::from_utf8_lossy(&sent.stdout);
    assert!(hello.contains("500 Hz"), "{hello}");
    let refused = taxel(&[&device[..], &["--on", "-", "--rate", "500"]].concat());
    let errors = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{errors}");
    let message = "error: --rate: \"500\" has no unit; add one of: Hz, kHz, MHz\n";
    assert_eq!(errors, message);
}

/// A frame of which a message is missing is a loss: exit code 3.
#[test]
fn incomplete_frames_are_losses() {
    let folder = Folder::new("incomplete");
    let text = "framing.messages = { carrier = \"can\", frame = { ends_with = 0x102 } }\n\
                [[message]]\nid_range = [0x100, 0x102]\n\
                fields = [{ is = \"value\", name = \"c\", type = \"u8\" }]";
    let board = written(&folder, "can.toml", text);
    for (missing, code) in [(false, 0), (true, 3)] {
        let file = folder.path("can.txt");
        let mut wire = String::new();
        for frame in 0..50 {
            for id in 0..3 {
                if !(missing && frame == 20 && id == 1) {
                    wire.extend([
                        "t10",
                        &id.to_string(),
                        "1",
                        &format!("{:02x}\r", frame + id),
                    ]);
                }
            }
        }
        fs::write(&file, wire).unwrap();
        let source = format!("exec:cat {file}");
        let begin = ["live", "--raw", "--headless", "--board", &board];
        let output = taxel(&[&begin[..], &["--source", &source]].concat());
        assert_eq!(output.status.code(), Some(code), "{output:?}");
    }
}

/// A hello with three fields before frames of four values.
#[test]
fn frames_that_are_longer_than_the_hello_says_are_told() {
    let board = |fields: usize| {
        let hello = format!(
            r#"{{"name":"b","fields":[{{"is":"value","name":"c{{1..{fields}}}","type":"i16"}}]}}"#
        );
        Board::parse("hello", &board_file_of_hello(&hello).unwrap()).unwrap()
    };
    let source = server(move |_, stream| {
        let mut encoder = Encoder::new(&board(4));
        if stream.write_all(&board(3).hello().unwrap()).is_err() {
            return;
        }
        for sequence in 0..1000 {
            let frame = Frame {
                sequence,
                time_ns: sequence * 10_000_000,
                values: vec![1.0; 4],
                ..Frame::default()
            };
            let mut bytes = Vec::new();
            encoder.encode(&frame, &mut bytes);
            thread::sleep(Duration::from_millis(10));
            if stream.write_all(&bytes).is_err() {
                return;
            }
        }
    });
    let output = std::process::Command::new("timeout")
        .args(["-s", "INT", "5", env!("CARGO_BIN_EXE_taxel")])
        .args(["live", "--raw", "--headless", "--source", &source])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("2 bytes longer than the hello"), "{errors}");
}

#[test]
fn an_unknown_name_is_answered_with_sensors_and_boards() {
    let message = refused(&["check", "nope-board"]);
    for name in ["three-axis-8x8", "optoforce-16"] {
        assert!(message.contains(name), "{message}");
    }
    assert!(done(&["check", "optoforce-16"]).contains("bytes"));
}

#[test]
fn captured_frames_of_which_nothing_tells_the_time_are_told() {
    let folder = Folder::new("untimed");
    let board = written(
        &folder,
        "b.toml",
        "framing.lines = { template = \"{value x}\" }",
    );
    let (capture, csv) = (folder.path("capture.txt"), folder.path("frames.csv"));
    fs::write(&capture, "1\n2\n3\n".repeat(50)).unwrap();
    let source = format!("replay:{capture}");
    let (found, errors) = live(&["--board", &board, "--source", &source, "--speed", "max"]);
    assert_eq!(found["frames"], 150, "{errors}");
    let remark = found["link"]["remark"].as_str().unwrap();
    assert!(remark.contains("1 ms apart"), "{remark}");
    assert!(errors.contains("1 ms apart"), "{errors}");
    let output = taxel(&[
        "recording",
        "decode",
        &capture,
        "--board",
        &board,
        "-o",
        &csv,
    ]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("1 ms apart"), "{errors}");
    // A table is no recording, whatever its name says; the way to one that the help names works.
    let recording = folder.path("frames.mcap");
    let decode = ["recording", "decode", &capture, "--board", &board, "-o"];
    let told = refused(&[&decode[..], &[&recording]].concat());
    assert!(
        told.contains("frames.mcap: must end in .csv") && told.contains("--record"),
        "{told}"
    );
    assert!(!fs::exists(&recording).unwrap());
    let source = format!("replay:{csv}");
    let record = [
        "--source", &source, "--speed", "max", "--record", &recording,
    ];
    let (found, errors) = live(&record);
    assert_eq!(found["frames"], 150, "{errors}");
    let told = done(&["recording", "inspect", &recording]);
    assert!(told.contains("\"/taxel/raw\":150"), "{told}");
}
