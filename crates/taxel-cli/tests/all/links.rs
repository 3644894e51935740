//! `taxel live` on links, `taxel device` and `taxel devices`, at the border of the process.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Command, Stdio};

#[path = "../../../taxel-board/tests/common/capture.rs"]
mod capture;
use capture::{BOARD, capture};

use crate::board::{self, Beside, device, objects, web_socket};
use crate::common::{Folder, done, refused, taxel};
use serde_json::Value;

/// Summary of a run that ends well.
#[track_caller]
fn summary(arguments: &[&str]) -> Value {
    let mut all = vec!["live", "three-axis-8x8", "--headless", "--format", "json"];
    all.extend(arguments);
    let output = taxel(&all);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{}\n{errors}", found["link"]);
    found
}

#[test]
fn a_virtual_device_is_read_over_each_link_without_loss() {
    let folder = Folder::new("links");
    let board = board::board(&folder);
    for place in ["pty", "tcp:0"] {
        let device = device(&board, place, &["--rate", "200 Hz"]);
        let source = match place {
            "pty" => format!("serial:{}", device.line),
            _ => device.line.clone(),
        };
        let found = summary(&["--board", &board, "--source", &source, "--frames", "200"]);
        assert_eq!(
            (&found["frames"], &found["lost"]),
            (&200.into(), &0.into()),
            "{place}"
        );
        assert_eq!(found["link"]["state"], "in_step");
        assert_eq!(found["link"]["wire"]["damaged"], 0);
    }
}

#[test]
fn the_bytes_of_a_device_can_be_piped_and_programs_can_be_sources() {
    let folder = Folder::new("pipes");
    let board = board::board(&folder);
    let program = env!("CARGO_BIN_EXE_taxel");
    let arguments = [
        "device",
        "three-axis-8x8",
        "--board",
        &board,
        "--on",
        "-",
        "--frames",
        "100",
    ];
    let mut bytes = Command::new(program)
        .args(arguments)
        .args(["--rate", "1 kHz"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let live = [
        "live",
        "three-axis-8x8",
        "--headless",
        "--format",
        "json",
        "--board",
        &board,
    ];
    let output = Command::new(program)
        .args(live)
        .args(["--source", "-"])
        .stdin(bytes.stdout.take().unwrap())
        .output()
        .unwrap();
    bytes.wait().unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["frames"], &found["lost"]), (&100.into(), &0.into()));

    let source = format!("exec:'{program}' {} --rate \"1 kHz\"", arguments.join(" "));
    let found = summary(&["--board", &board, "--source", &source]);
    assert_eq!(found["frames"], 100);
}

/// The bytes of every frame of a run are in its recording, however it ends.
#[test]
fn the_last_bytes_of_a_run_are_recorded() {
    let folder = Folder::new("last-bytes");
    let board = board::board(&folder);
    let device = device(&board, "tcp:0", &["--rate", "500 Hz"]);
    for run in 0..5 {
        let recording = folder.path(&format!("{run}.mcap"));
        let frames = (100 + run * 7).to_string();
        let found = summary(&[
            "--board",
            &board,
            "--source",
            &device.line,
            "--frames",
            &frames,
            "--record",
            &recording,
        ]);
        let decoded = folder.path(&format!("{run}.csv"));
        done(&[
            "recording",
            "decode",
            &recording,
            "--board",
            &board,
            "-o",
            &decoded,
        ]);
        let frames = rows(&decoded).len() as u64 - 1;
        assert!(
            frames >= found["frames"].as_u64().unwrap(),
            "{frames}: {found}"
        );
    }
}

#[test]
fn bytes_of_another_board_are_counted_and_are_exit_code_3() {
    let folder = Folder::new("another");
    let capture = folder.path("zeros.bin");
    fs::write(&capture, vec![0; 100_000]).unwrap();
    let source = format!("exec:cat '{capture}'");
    let output = taxel(&[
        "live",
        "--raw",
        "--headless",
        "--format",
        "json",
        "--board",
        "optoforce-16",
        "--source",
        &source,
    ]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["frames"], 0);
    let passed_over = found["link"]["wire"]["passed_over_bytes"].as_u64().unwrap();
    assert!(passed_over > 99_900, "{passed_over}");
    let frames = folder.path("frames.csv");
    let decode = [
        "recording",
        "decode",
        &capture,
        "--board",
        "optoforce-16",
        "-o",
        &frames,
    ];
    assert_eq!(taxel(&decode).status.code(), Some(3));
}

/// taxel-wire-1: the hello of the board is all that is needed, on every kind of link.
#[test]
fn a_board_that_says_hello_needs_no_board_file() {
    let folder = Folder::new("hello");
    for place in ["pty", "tcp:0"] {
        let device = device("taxel-wire-1", place, &["--rate", "200 Hz"]);
        let source = match place {
            "pty" => format!("serial:{}", device.line),
            _ => device.line.clone(),
        };
        let recording = folder.path(&format!("{}.mcap", &place[..3]));
        let found = summary(&[
            "--source", &source, "--frames", "100", "--record", &recording,
        ]);
        assert_eq!(
            (&found["frames"], &found["lost"]),
            (&100.into(), &0.into()),
            "{place}"
        );
        assert_eq!(found["link"]["wire"]["damaged"], 0);
        // What the board said stands among the bytes.
        let decoded = folder.path(&format!("{}.csv", &place[..3]));
        let board = ["--board", "taxel-wire-1"];
        done(
            &[
                &["recording", "decode", &recording, "-o", &decoded][..],
                &board,
            ]
            .concat(),
        );
        assert!(rows(&decoded).len() > 100, "{place}");
        let named = summary(&[
            "--board",
            "taxel-wire-1",
            "--source",
            &source,
            "--frames",
            "50",
        ]);
        assert_eq!(named["lost"], 0);
    }
    // A program is started once, and what it said before is not lost.
    let program = env!("CARGO_BIN_EXE_taxel");
    let source = format!(
        "exec:'{program}' device three-axis-8x8 --board taxel-wire-1 --on - --frames 100 --rate \"1 kHz\""
    );
    let found = summary(&["--source", &source]);
    assert_eq!((&found["frames"], &found["lost"]), (&100.into(), &0.into()));
    let message = refused(&["live", "three-axis-8x8", "--source", "exec:echo no hello"]);
    assert!(
        message.contains("no hello") && message.contains("--board"),
        "{message}"
    );
}

/// Boards whose frames are several messages, from the device to the summary.
#[test]
fn messages_are_read_from_a_virtual_device() {
    let folder = Folder::new("messages");
    for (name, framing) in [
        (
            "can",
            "carrier = \"can\"\n[[message]]\nid_range = [0x100, 0x13f]\nfields = [{ is = \"value\", name = \"c{1..4}\", type = \"u16\" }]\n",
        ),
        (
            "json",
            "carrier = \"json\"\n[[message]]\nfields = [{ is = \"sequence\", key = \"n\" }, { is = \"time\", key = \"t\", unit = \"ms\" }, { is = \"value\", key = \"c\", name = \"c1..c256\" }]\n",
        ),
    ] {
        let board = folder.path(&format!("{name}.toml"));
        let text = format!("schema = 1\nname = \"{name}\"\n[framing.messages]\n{framing}");
        fs::write(&board, text).unwrap();
        let device = device(&board, "tcp:0", &["--rate", "100 Hz"]);
        let found = summary(&[
            "--board",
            &board,
            "--source",
            &device.line,
            "--frames",
            "100",
        ]);
        // Without a counter it is not known what was lost.
        let lost = if name == "can" { Value::Null } else { 0.into() };
        assert_eq!((&found["frames"], &found["lost"]), (&100.into(), &lost));
        let wire = &found["link"]["wire"];
        for count in ["damaged", "other", "incomplete"] {
            assert_eq!(wire[count], 0, "{name}: {wire}");
        }
        // Nor is it estimated without a rate.
        assert_eq!(wire["missing_estimate"], lost, "{name}: {wire}");
    }
}

/// Rows of a file of raw channels.
fn rows(path: &str) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(str::to_owned).collect()
}

#[test]
fn captured_bytes_are_played_as_they_are_decoded() {
    let folder = Folder::new("capture");
    let made = capture();
    let capture = &folder.path("capture.bin");
    fs::write(capture, &made.bytes).unwrap();
    let (frames, lost) = (made.whole.len(), made.lost);
    let (last_sequence, _) = made.whole[frames - 1];
    let (played, decoded) = (folder.path("played.csv"), folder.path("decoded.csv"));
    let source = format!("replay:{capture}");
    let live = |more: &[&str]| {
        let mut all = vec!["live", "--raw", "--board", BOARD];
        all.extend(["--source", &source, "--format", "json"]);
        all.extend(more);
        let output = taxel(&all);
        let found: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code(), found)
    };
    let (code, found) = live(&["--headless", "--speed", "max", "--save", &played]);
    // Frames are missing.
    assert_eq!(code, Some(3));
    let wire = &found["link"]["wire"];
    assert_eq!(
        (&found["frames"], &found["lost"], &wire["lost"]),
        (&frames.into(), &lost.into(), &lost.into())
    );
    assert_eq!(
        (&found["link"]["state"], &found["last_sequence"]),
        (&"ended".into(), &last_sequence.into())
    );
    let output = taxel(&[
        "recording",
        "decode",
        capture,
        "--board",
        BOARD,
        "-o",
        &decoded,
    ]);
    let told = String::from_utf8(output.stdout).unwrap();
    for count in [
        format!("{frames} frames, lost {lost}"),
        format!("damaged {}", wire["damaged"]),
        format!("bytes passed over {}", wire["passed_over_bytes"]),
    ] {
        assert!(told.contains(&count), "{count}: {told}");
    }
    assert_eq!(rows(&played), rows(&decoded));

    // 100 Hz, four times as fast.
    let (_, found) = live(&["--headless", "--speed", "4", "--frames", "201"]);
    let took = found["duration_s"].as_f64().unwrap();
    assert!(took > 0.49, "{took} s");

    // The page stays after the end; the status says that the file is over.
    let page = Beside::start(&[
        "live", "--raw", "--board", BOARD, "--source", &source, "--speed", "max", "--port", "0",
    ]);
    let mut socket = BufReader::new(web_socket(&page.line));
    let status = std::iter::from_fn(|| {
        let mut until = Vec::new();
        socket.read_until(b'}', &mut until).unwrap();
        Some(String::from_utf8_lossy(&until).into_owned())
    });
    let ended = |text: &String| text.contains(r#""state":"ended""#);
    let status = status.take(100_000).find(ended).unwrap();
    assert!(
        status.contains(&format!(r#""delivered":{frames},"lost":{lost}"#)),
        "{status}"
    );
}

#[test]
fn a_capture_of_a_board_with_a_clock_has_its_times() {
    let folder = Folder::new("capture-clock");
    let (board, capture) = (board::board(&folder), folder.path("capture.bin"));
    let device = ["device", "three-axis-8x8", "--board", &board, "--on", "-"];
    let bytes = taxel(&[&device[..], &["--frames", "100", "--rate", "1 kHz"]].concat()).stdout;
    fs::write(&capture, &bytes).unwrap();
    let source = format!("replay:{capture}");
    let found = summary(&["--board", &board, "--source", &source, "--speed", "max"]);
    assert_eq!((&found["frames"], &found["lost"]), (&100.into(), &0.into()));
    assert_eq!(found["last_time_ns"], 99_000_000);

    // Neither a recording nor the bytes of another board are played.
    let message = refused(&[
        "live",
        "three-axis-8x8",
        "--board",
        "taxel-wire-1-256",
        "--source",
        &source,
    ]);
    assert!(
        message.contains("no frame of taxel-wire-1-256"),
        "{message}"
    );
    let recording = folder.path("run.csv");
    done(&[
        "recording",
        "decode",
        &capture,
        "--board",
        &board,
        "-o",
        &recording,
    ]);
    let source = format!("replay:{recording}");
    let message = refused(&[
        "live",
        "three-axis-8x8",
        "--board",
        &board,
        "--source",
        &source,
    ]);
    assert!(message.contains("leave --board out"), "{message}");
}

#[test]
fn damage_is_counted_and_is_exit_code_3() {
    let folder = Folder::new("damage");
    let board = board::board(&folder);
    let (faults, truth) = (folder.path("faults.toml"), folder.path("truth.jsonl"));
    fs::write(&faults, "[wire]\nflip = 2e-5\n[frames]\nlose = 0.02\n").unwrap();
    let device = device(
        &board,
        "tcp:0",
        &[
            "--rate", "500 Hz", "--faults", &faults, "--truth", &truth, "--seed", "3",
        ],
    );
    let output = taxel(&[
        "live",
        "three-axis-8x8",
        "--headless",
        "--format",
        "json",
        "--board",
        &board,
        "--source",
        &device.line,
        "--frames",
        "500",
    ]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(found["link"]["wire"]["damaged"].as_u64().unwrap() > 0);
    assert!(found["lost"].as_u64().unwrap() > 0);
    drop(device);
    assert!(!fs::read_to_string(&truth).unwrap().is_empty());
}

#[test]
fn what_does_not_fit_is_refused_with_what_to_do() {
    let folder = Folder::new("links-refused");
    let board = board::board(&folder);
    let message = refused(&["live", "three-axis-8x8", "--source", "serial:/dev/ttyACM0"]);
    assert!(
        message.contains("--board") && message.contains("anyskin-5x"),
        "{message}"
    );
    let message = refused(&["live", "three-axis-8x8", "--board", &board]);
    assert!(message.contains("is no link"), "{message}");
    let message = refused(&["live", "--board", &board, "--source", "tcp:localhost:1"]);
    assert!(message.contains("--raw"), "{message}");
    let source = ["--source", "tcp:localhost:1"];
    let message = refused(&[
        "live",
        "three-axis-8x8",
        "--board",
        "optoforce-16",
        source[0],
        source[1],
    ]);
    assert!(
        message.contains("256 channels") && message.contains("fx, fy, fz"),
        "{message}"
    );
    let message = refused(&[
        "live",
        "three-axis-8x8",
        "--board",
        &board,
        "--source",
        "udp:x",
    ]);
    assert!(message.contains("1 to 65535"), "{message}");
    let message = refused(&["device", "three-axis-8x8", "--board", &board, "--on", "usb"]);
    assert!(
        message.contains("pty") && message.contains("tcp:PORT"),
        "{message}"
    );
    let faults = folder.path("faults.toml");
    fs::write(&faults, "[wire]\nflip = 3\n").unwrap();
    let message = refused(&[
        "device",
        "three-axis-8x8",
        "--board",
        &board,
        "--on",
        "pty",
        "--faults",
        &faults,
    ]);
    assert!(
        message.contains("flip = 3") && message.contains('^'),
        "{message}"
    );
    let message = refused(&["live", "--headless", "--frames", "1", "--out", "xml"]);
    assert!(message.contains("jsonl:FILE"), "{message}");
    let message = refused(&[
        "live",
        "--headless",
        "--frames",
        "1",
        "--out",
        "csv",
        "--out",
        "jsonl",
    ]);
    assert!(message.contains("only one"), "{message}");
}

#[test]
fn each_frame_is_a_line_in_si_with_its_unit() {
    let folder = Folder::new("lines");
    let file = folder.path("run.csv");
    let csv = format!("csv:{file}");
    let text = done(&[
        "live",
        "three-axis-8x8",
        "--headless",
        "--speed",
        "max",
        "--frames",
        "300",
        "--out",
        "jsonl",
        "--out",
        &csv,
    ]);
    let lines = objects(&text);
    assert_eq!(lines.len(), 300);
    let last = &lines[299];
    assert_eq!(
        (&last["sequence"], &last["lost"], &last["link"]),
        (&299.into(), &0.into(), &Value::Null)
    );
    assert!(last["force_z_n"].is_number() && last["host_ns"].is_null());
    let certain = |line: &Value| (line["total_certainty"].clone(), line["zero_known"].clone());
    assert_eq!(certain(last), ("exact".into(), true.into()));
    assert_eq!(certain(&lines[0]), ("unknown".into(), false.into()));
    assert_eq!(last["readings_f"].as_array().unwrap().len(), 256);
    assert_eq!(last["values_n"].as_array().unwrap().len(), 192);
    let table = fs::read_to_string(&file).unwrap();
    let mut rows = table.lines();
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    assert!(header.contains(&"force_z_deviation [N]") && header.contains(&"total_certainty"));
    let rows: Vec<&str> = rows.collect();
    assert_eq!(rows.len(), 300);
    assert!(
        rows.iter()
            .all(|row| row.split(',').count() == header.len())
    );
    // An existing file is left alone.
    let message = refused(&["live", "--headless", "--frames", "1", "--out", &csv]);
    assert!(message.contains("--force"), "{message}");
    assert_eq!(fs::read_to_string(&file).unwrap(), table);
}

#[test]
fn a_reader_that_goes_ends_the_run_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["live", "--headless", "--out", "jsonl"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    output.read_line(&mut line).unwrap();
    drop(output);
    let mut errors = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut errors)
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{errors}");
    assert!(
        line.starts_with("{\"sequence\":") && !errors.contains("error"),
        "{errors}"
    );
}

#[test]
fn lines_of_the_standard_input_are_marks() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args([
            "live",
            "three-axis-8x8",
            "--headless",
            "--frames",
            "60",
            "--marks",
            "-",
        ])
        .args(["--format", "json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(b"the \"first\" grasp\n")
        .unwrap();
    let output = child.wait_with_output().unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["events"]["mark"], 1);
    let events = found["last_events"].as_array().unwrap();
    assert!(
        events
            .iter()
            .any(|event| event["text"] == "the \"first\" grasp"),
        "{events:?}"
    );
}

#[test]
fn a_port_with_a_name_of_its_own_comes_and_goes_with_the_device() {
    let folder = Folder::new("pty-link");
    let (board, port) = (board::board(&folder), folder.path("port"));
    let faults = folder.path("faults.toml");
    fs::write(
        &faults,
        "[link]\nleave = [{ at = \"1 s\", for = \"300 ms\" }]\n",
    )
    .unwrap();
    let device = device(
        &board,
        &format!("pty:{port}"),
        &["--faults", &faults, "--rate", "200 Hz"],
    );
    assert_eq!(device.line, port);
    let found = summary(&[
        "--board",
        &board,
        "--source",
        &format!("serial:{port}"),
        "--frames",
        "400",
    ]);
    assert_eq!(found["link"]["connects"], 2);
    assert_eq!(found["frames"], 400);
}

#[test]
fn a_recording_can_be_played_on_a_wire() {
    let folder = Folder::new("played");
    let (board, recording) = (board::board(&folder), folder.path("run.csv"));
    done(&[
        "live",
        "three-axis-8x8",
        "--headless",
        "--frames",
        "50",
        "--speed",
        "max",
        "--save",
        &recording,
    ]);
    let device = Beside::start(&[
        "device",
        "three-axis-8x8",
        "--board",
        &board,
        "--on",
        "tcp:0",
        "--replay",
        &recording,
        "--rate",
        "50 Hz",
    ]);
    let found = summary(&[
        "--board",
        &board,
        "--source",
        &device.line,
        "--frames",
        "10",
    ]);
    assert_eq!(found["frames"], 10);
}

#[test]
fn a_recording_of_several_segments_plays_byte_for_byte() {
    let folder = Folder::new("segments");
    let (board, faults) = (board::board(&folder), folder.path("faults.toml"));
    let leaves = "[link]\nleave = [{ at = \"1 s\", for = \"200 ms\" }, { at = \"2 s\", for = \"300 ms\" }]\n\
                  [frames]\nlose = 0.01\n";
    fs::write(&faults, leaves).unwrap();
    let device = device(&board, "tcp:0", &["--rate", "200 Hz", "--faults", &faults]);
    let (file, again) = (folder.path("run.mcap"), folder.path("again.mcap"));
    let live = ["live", "three-axis-8x8", "--headless", "--format", "json"];
    let more = ["--board", &board, "--source", &device.line];
    let more = [&more[..], &["--frames", "500", "--record", &file]].concat();
    let output = taxel(&[&live[..], &more].concat());
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["link"]["connects"], 3, "{output:?}");
    let inspected: Value =
        serde_json::from_slice(&taxel(&["recording", "inspect", &file, "--format", "json"]).stdout)
            .unwrap();
    assert_eq!(inspected["segments"], 3);
    let same = "same touch in 500 frames";
    assert!(done(&["recording", "compare", &file]).contains(same));
    let source = format!("replay:{file}");
    let replay = ["live", "--headless", "--speed", "max", "--format", "json"];
    let output = taxel(&[&replay[..], &["--source", &source, "--record", &again]].concat());
    let replayed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(done(&["recording", "compare", &file, &again]).contains(same));
    for count in ["frames", "lost", "late", "duplicate", "last_taxel_forces_n"] {
        assert_eq!(replayed[count], found[count], "{count}");
    }
}

#[test]
fn a_tare_that_had_to_wait_plays_byte_for_byte() {
    let folder = Folder::new("owed-tare");
    let (board, script) = (board::board(&folder), folder.path("lying.toml"));
    fs::write(
        &script,
        "schema = 1\nname = \"lying\"\nduration = \"20 s\"\n[[finger]]\nradius = \"2.6 mm\"\npath = [\n\
         { time = \"0 s\", at = [\"0 mm\", \"0 mm\"], force = [\"0 N\", \"0 N\", \"60 mN\"] },\n\
         { time = \"3 s\", at = [\"0 mm\", \"0 mm\"], force = [\"0 N\", \"0 N\", \"60 mN\"] },\n\
         { time = \"3.1 s\", at = [\"0 mm\", \"0 mm\"], force = [\"0 N\", \"0 N\", \"0 mN\"] },\n]\n",
    )
    .unwrap();
    let device = device(&board, "tcp:0", &["--script", &script, "--rate", "120 Hz"]);
    let file = folder.path("run.mcap");
    let source = ["--board", &board, "--source", &device.line];
    let found = summary(&[&source[..], &["--frames", "400", "--record", &file]].concat());
    assert_eq!(found["tare"], "done", "{}", found["notice"]);
    let compared = done(&["recording", "compare", &file]);
    assert!(compared.contains("same touch in 400 frames"), "{compared}");
}

#[test]
fn a_kill_in_a_silence_costs_no_byte_before_it() {
    let folder = Folder::new("silence");
    let board = board::board(&folder);
    // The silence is that from one frame to the next: shorter than what changes the state.
    let device = device(&board, "tcp:0", &["--rate", "3 Hz"]);
    let (file, decoded) = (folder.path("run.mcap"), folder.path("decoded.csv"));
    let mut live = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["live", "three-axis-8x8", "--headless", "--board", &board])
        .args(["--source", &device.line, "--record", &file])
        .args(["--out", "jsonl"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let frames = BufReader::new(live.stdout.take().unwrap()).lines();
    assert_eq!(frames.take(4).map(Result::unwrap).count(), 4);
    std::thread::sleep(std::time::Duration::from_millis(200));
    live.kill().unwrap();
    live.wait().unwrap();
    let output = taxel(&[
        "recording",
        "decode",
        &file,
        "--board",
        &board,
        "-o",
        &decoded,
    ]);
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("4 frames, lost 0"), "{told}");
}

#[test]
fn commands_move_what_presses() {
    let folder = Folder::new("control");
    let (board, truth) = (board::board(&folder), folder.path("quiet.toml"));
    fs::write(&truth, "schema = 1\nname = \"quiet\"\nduration = \"9 s\"\n").unwrap();
    let mut device = device(
        &board,
        "tcp:0",
        &["--control", "-", "--script", &truth, "--rate", "100 Hz"],
    );
    let mut input = device.input.take().unwrap();
    let source = device.line.clone();
    let press = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(1200));
        input
            .write_all(b"{\"move\":{\"force_n\":[0,0,0.3]}}\n")
            .unwrap();
        input.flush().unwrap();
        input
    });
    let found = summary(&["--board", &board, "--source", &source, "--frames", "250"]);
    let _input = press.join().unwrap();
    let force = found["last_force_n"][2].as_f64().unwrap();
    assert!((force - 0.3).abs() < 0.03, "{force} N");
}

/// From a capture that nobody described to its channels, by two commands.
#[test]
fn a_board_is_drafted_and_read_by_its_draft() {
    let folder = Folder::new("listen");
    let text = "schema = 1\nname = \"glove\"\nframing.fixed = { length = 25, head = \"a5 5a\" }\npacket = { order = \"big\", fields = [{ is = \"sequence\", type = \"u8\" }, { is = \"value\", name = \"c{1..10}\", type = \"u16\" }], check = { kind = \"sum16\" } }\n";
    let board = taxel_board::Board::parse("glove", text).unwrap();
    let mut encoder = taxel_board::Encoder::new(&board);
    let mut wire = Vec::new();
    for sequence in 0..300 {
        let values = (0..10).map(|channel| f64::from(500 + 7 * channel) + (sequence % 13) as f64);
        let frame = taxel_recording::Frame {
            sequence,
            values: values.collect(),
            ..taxel_recording::Frame::default()
        };
        encoder.encode(&frame, &mut wire);
    }
    let [capture, file, noise] =
        ["capture.bin", "board.toml", "noise.bin"].map(|name| folder.path(name));
    fs::write(&capture, &wire[25..]).unwrap();
    let report = done(&["listen", &capture, "-o", &file]);
    assert!(
        report.contains("sum16 holds in all of 299 packets"),
        "{report}"
    );
    assert!(
        report.contains(&format!("--board {file} --source replay:{capture}")),
        "{report}"
    );
    let source = format!("replay:{capture}");
    let live = [
        "live",
        "--raw",
        "--board",
        &file,
        "--source",
        &source,
        "--headless",
        "--speed",
        "max",
    ];
    let summary = done(&live);
    assert!(
        summary.contains("frames                   299"),
        "{summary}"
    );
    assert!(summary.contains("channels                 10"), "{summary}");
    // To the standard output; nothing is replaced unasked; nothing is made of noise.
    assert!(done(&["listen", &capture]).contains("[framing.fixed]"));
    assert!(refused(&["listen", &capture, "-o", &file]).contains("--force"));
    fs::write(&noise, [7_u8, 1, 255, 3].repeat(9)).unwrap();
    assert!(refused(&["listen", &noise]).contains("a claim needs 50 packets"));
    assert!(refused(&["listen", &folder.path("nowhere.bin")]).contains("give a link"));
    assert!(refused(&["listen", &capture, "--live"]).contains("-o board.toml"));
}

const TERMINAL: &str = r#"
import os, pty, select, signal, sys, time
child, terminal = pty.fork()
if child == 0:
    os.execv(sys.argv[1], sys.argv[1:])
text, end = "", time.time() + 60
while time.time() < end and not any(word in text for word in ("token=", "cannot listen on", "error")):
    if select.select([terminal], [], [], 1)[0]:
        try:
            text += os.read(terminal, 65536).decode()
        except OSError:
            break
print(text)
os.kill(child, signal.SIGTERM)
"#;

/// Of a link, and on a terminal alone, the page follows the draft; whether its usual port is free or not.
#[test]
fn on_a_terminal_a_draft_of_a_link_is_shown_on_the_page() {
    let folder = Folder::new("listen-terminal");
    let shown = |more: &[&str]| {
        let program = env!("CARGO_BIN_EXE_taxel");
        let source = "exec:sh -c 'i=0; while true; do i=$((i+1)); echo \"$i,5$((i % 7)),900\"; sleep 0.01; done'";
        let listen = [program, "listen", source, "--seconds", "2"];
        let output = Command::new("python3")
            .args(["-c", TERMINAL])
            .args([&listen[..], more].concat())
            .output();
        let Ok(output) = output else {
            eprintln!("left out: there is no python3 on this machine");
            return None;
        };
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let is_page = |text: &str| text.contains("token=") || text.contains("cannot listen on");
    let board = folder.path("board.toml");
    for more in [&["-o", &*board][..], &[]] {
        if let Some(text) = shown(more) {
            assert!(is_page(&text) && text.contains("frames"), "{text}");
        }
    }
    let board = folder.path("another.toml");
    if let Some(text) = shown(&["-o", &board, "--no-page"]) {
        assert!(!is_page(&text) && text.contains("--raw"), "{text}");
        assert!(fs::metadata(&board).is_ok());
    }
}

#[test]
fn devices_lists_ports_or_says_that_there_are_none() {
    let list: Value = serde_json::from_str(&done(&["devices", "--format", "json"])).unwrap();
    let text = done(&["devices"]);
    match list["ports"].as_array().unwrap().as_slice() {
        [] => assert!(text.contains("no serial port is plugged in"), "{text}"),
        [first, ..] => assert!(text.contains(first["path"].as_str().unwrap()), "{text}"),
    }
}

#[test]
fn what_a_client_never_reads_is_no_latency() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["live", "three-axis-8x8", "--port", "0", "--format", "json"])
        .args(["--speed", "40", "--frames", "9600"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    let mut address = String::new();
    output.read_line(&mut address).unwrap();
    let mut reader = web_socket(address.trim());
    let read = std::thread::spawn(move || std::io::copy(&mut reader, &mut std::io::sink()));
    // Its buffers are full long before it goes.
    let stalled = web_socket(address.trim());
    std::thread::sleep(std::time::Duration::from_secs(3));
    drop(stalled);
    let mut text = String::new();
    output.read_to_string(&mut text).unwrap();
    child.wait().unwrap();
    read.join().unwrap().unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    let largest = found["sent_latency_s"]["largest"].as_f64().unwrap();
    assert!(largest < 1.0, "{largest} s");
}
