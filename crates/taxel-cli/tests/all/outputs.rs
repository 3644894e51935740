//! Results and inputs: the program leaves alone what belongs to someone else, and waits for
//! nothing that never comes.

use std::fs;
use std::io::Read as _;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _, symlink};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Folder, done, refused, taxel};

const SENSOR: &str = "three-axis-unit";
/// What a run may take that does no work, on a slow and busy machine.
const QUICK: Duration = Duration::from_secs(10);

fn check<'a>(output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["check", SENSOR, "-o", output], more].concat()
}

#[test]
fn an_existing_file_is_replaced_only_by_force_and_keeps_its_mode() {
    let folder = Folder::new("existing");
    let file = folder.path("result.txt");
    fs::write(&file, "mine").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
    let message = refused(&check(&file, &[]));
    assert!(message.contains("the file exists") && message.contains("--force"));
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    done(&check(&file, &["--force"]));
    assert!(fs::read_to_string(&file).unwrap().contains("quantity"));
    assert_eq!(fs::metadata(&file).unwrap().mode() & 0o777, 0o640);
    fs::set_permissions(&file, fs::Permissions::from_mode(0o440)).unwrap();
    assert!(refused(&check(&file, &["--force"])).contains("read-only"));
}

#[test]
fn every_writing_command_refuses_an_existing_file() {
    let folder = Folder::new("every");
    let readings = folder.path("readings.csv");
    done(&[
        "twin",
        "in-plane-50um",
        "--calibration-data",
        "-o",
        &readings,
    ]);
    for ending in ["toml", "html", "json", "svg", "csv"] {
        fs::write(folder.path(&format!("old.{ending}")), "mine").unwrap();
    }
    let [toml, html, json, svg, csv] =
        ["toml", "html", "json", "svg", "csv"].map(|ending| folder.path(&format!("old.{ending}")));
    let live = ["live", "--headless", "--speed", "max", "--frames", "5"];
    for arguments in [
        &["check", SENSOR, "--plot", &svg][..],
        &["predict", SENSOR, "--load", "fz=1 mN", "-o", &csv],
        &["predict", SENSOR, "--load", "fz=1 mN", "--plot", &svg],
        &["sweep", "p4-sections", "-o", &csv],
        &["sweep", "p4-sections", "--plot", &svg],
        &["calibrate", "in-plane-50um", &readings, "-o", &toml],
        &["calibrate", "in-plane-50um", &readings, "--report", &html],
        &["twin", "in-plane-50um", "--calibration-data", "-o", &csv],
        &["reproduce", "P1", "-o", &json],
        &["verify", "A", "--short", "-o", &json],
        &[&live[..], &["--save", &csv]].concat(),
        &[&live[..], &["--events", &csv]].concat(),
    ] {
        let message = refused(arguments);
        assert!(message.contains("--force"), "{arguments:?}: {message}");
    }
    for file in [&toml, &html, &json, &svg, &csv] {
        assert_eq!(fs::read_to_string(file).unwrap(), "mine", "{file}");
    }
    taxel(&[&live[..], &["--save", &csv, "--force"]].concat());
    assert_ne!(fs::read_to_string(&csv).unwrap(), "mine");
}

#[test]
fn a_link_stays_a_link_and_its_target_is_written() {
    let folder = Folder::new("links");
    let (target, link) = (folder.path("target.txt"), folder.path("link.txt"));
    fs::write(&target, "mine").unwrap();
    symlink(&target, &link).unwrap();
    refused(&check(&link, &[]));
    done(&check(&link, &["--force"]));
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(fs::read_to_string(&target).unwrap().contains("quantity"));
    let nowhere = folder.path("nowhere.txt");
    symlink(folder.path("none.txt"), &nowhere).unwrap();
    let message = refused(&check(&nowhere, &["--force"]));
    assert!(message.contains("leads nowhere"), "{message}");
    assert!(fs::symlink_metadata(&nowhere).unwrap().is_symlink());
}

#[test]
fn an_input_is_never_written_whatever_name_it_has() {
    let folder = Folder::new("inputs");
    let text = include_str!("../../../taxel/sensors/three-axis-unit.toml");
    let sensor = folder.path("sensor.toml");
    fs::write(&sensor, text).unwrap();
    let (link, hard) = (folder.path("link.toml"), folder.path("hard.toml"));
    symlink(&sensor, &link).unwrap();
    fs::hard_link(&sensor, &hard).unwrap();
    for output in [&sensor, &link, &hard] {
        let message = refused(&["check", &sensor, "-o", output, "--force"]);
        assert!(message.contains("would be overwritten"), "{message}");
    }
    let live = ["live", &sensor, "--headless", "--frames", "5", "--force"];
    let message = refused(&[&live[..], &["--save", &sensor]].concat());
    assert!(message.contains("would be overwritten"), "{message}");
    assert_eq!(fs::read_to_string(&sensor).unwrap(), text);
}

#[test]
fn devices_pipes_and_folders_are_left_alone() {
    let folder = Folder::new("devices");
    let pipe = pipe(&folder);
    for output in ["/dev/null", &pipe] {
        let message = refused(&check(output, &["--force"]));
        assert!(message.contains("device, pipe or socket"), "{message}");
    }
    assert!(
        fs::metadata("/dev/null")
            .unwrap()
            .file_type()
            .is_char_device()
    );
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    assert!(refused(&check(&folder.path(""), &["--force"])).contains("folder"));
}

#[test]
fn files_beside_an_output_are_left_alone() {
    let folder = Folder::new("beside");
    let (file, part) = (folder.path("x.txt"), folder.path("x.txt.part"));
    fs::write(&part, "mine").unwrap();
    done(&check(&file, &[]));
    assert_eq!(fs::read_to_string(&part).unwrap(), "mine");
    assert_eq!(fs::read_dir(folder.path("")).unwrap().count(), 2);
}

#[test]
fn a_dash_is_the_standard_output() {
    assert_eq!(done(&check("-", &[])), done(&["check", SENSOR]));
    let folder = Folder::new("dash");
    let readings = folder.path("readings.csv");
    done(&[
        "twin",
        "in-plane-50um",
        "--calibration-data",
        "-o",
        &readings,
    ]);
    let output = taxel(&["calibrate", "in-plane-50um", &readings, "-o", "-"]);
    assert_eq!(output.status.code(), Some(0));
    let (result, summary) = (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    );
    assert!(
        result.contains("schema =") && !summary.contains("schema ="),
        "{result}"
    );
    assert!(summary.contains("youngs_modulus"), "{summary}");
    assert!(refused(&["check", SENSOR, "--plot", "-"]).contains("only -o"));
}

fn pipe(folder: &Folder) -> String {
    let pipe = folder.path("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    pipe
}

#[test]
fn inputs_that_never_end_or_never_begin_are_refused_quickly() {
    let folder = Folder::new("endless");
    let pipe = pipe(&folder);
    for input in ["/dev/zero", &pipe] {
        let replay = format!("replay:{input}");
        for arguments in [
            &["check", input][..],
            &["predict", SENSOR, "--loads", input],
            &[
                "predict",
                SENSOR,
                "--load",
                "fz=1 mN",
                "--calibration",
                input,
            ],
            &["calibrate", "in-plane-50um", input],
            &["sweep", input],
            &["live", "--headless", "--source", &replay],
            &["live", "--headless", "--source", &format!("sim:{input}")],
        ] {
            let start = Instant::now();
            let message = refused(arguments);
            assert!(message.contains("device, pipe or socket"), "{message}");
            assert!(start.elapsed() < QUICK, "{arguments:?}");
        }
    }
    // The standard input is a pipe as it should be.
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["check", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let text = include_bytes!("../../../taxel/sensors/three-axis-unit.toml");
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), text).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

/// Starts the program, sends it `signal` after `wait`, and returns the time until it ended,
/// its code and its standard error.
fn ended_by(signal: &str, arguments: &[&str], wait: Duration) -> (Duration, Option<i32>, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(wait);
    assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
    let start = Instant::now();
    let id = child.id().to_string();
    Command::new("kill").args([signal, &id]).status().unwrap();
    let code = child.wait().unwrap().code();
    let elapsed = start.elapsed();
    let mut message = String::new();
    child.stderr.unwrap().read_to_string(&mut message).unwrap();
    (elapsed, code, message)
}

/// The goal is half a second; the tests run beside others.
const SOON: Duration = Duration::from_secs(2);

#[test]
fn signals_end_long_work_soon() {
    let wait = Duration::from_millis(700);
    for signal in ["-INT", "-TERM", "-HUP"] {
        let (elapsed, code, message) = ended_by(signal, &["sweep", "p4-sections"], wait);
        assert!(
            elapsed < SOON && code == Some(3),
            "{signal} {elapsed:?} {code:?}"
        );
        assert!(message.contains("what is done is kept"), "{message}");
        let (elapsed, code, message) = ended_by(signal, &["verify", "B"], wait);
        assert!(
            elapsed < SOON && code == Some(3),
            "{signal} {elapsed:?} {code:?}"
        );
        let said = message.contains("note: stopped after") && message.contains(" cases");
        assert!(said, "{message}");
        let (elapsed, code, _) = ended_by(signal, &["live", "--headless"], wait);
        assert!(
            elapsed < SOON && code == Some(0),
            "{signal} {elapsed:?} {code:?}"
        );
    }
}

#[test]
fn a_closed_pipe_ends_quietly() {
    for arguments in [
        &["check", SENSOR][..],
        &["live", "--port", "0"],
        &["live", "--headless", "--speed", "max", "--frames", "60"],
        &["--help"],
    ] {
        // A pipe whose reader has gone.
        let mut head = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
        let closed = head.stdin.take().unwrap();
        head.wait().unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(arguments)
            .stdout(closed)
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
        assert!(!message.contains("panicked"), "{message}");
    }
    // Nor is the standard error needed.
    let mut head = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
    let closed = head.stdin.take().unwrap();
    head.wait().unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["check", "no-such-file"])
        .stderr(closed)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn files_cannot_steer_the_terminal() {
    let folder = Folder::new("controls");
    let table = folder.path("loads.csv");
    fs::write(
        &table,
        "force_z [mN],\u{1b}]0;title\u{7}\n1,2\n\u{1b}[2J,2\n",
    )
    .unwrap();
    let sensor = folder.path("sensor.toml");
    let text = include_str!("../../../taxel/sensors/three-axis-unit.toml");
    let wrong = text.replacen("schema = 2", "schema = 2\n\"\\u001B[31m\" = 1", 1);
    fs::write(&sensor, wrong).unwrap();
    for arguments in [
        &["predict", SENSOR, "--loads", &table][..],
        &["check", &sensor],
        &["check", "\u{1b}[31mred"],
    ] {
        let message = refused(arguments);
        let control = message.chars().find(|c| c.is_control() && *c != '\n');
        assert_eq!(control, None, "{message:?}");
    }
}

#[test]
fn a_number_that_is_missing_is_null_in_json() {
    let one = ["--frames", "1", "--speed", "max", "--format", "json"];
    let text = done(&[&["live", "--headless"], &one[..]].concat());
    assert!(text.contains("\"rate_hz\": null"), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}

/// Requests in the name of another host are not answered.
#[test]
fn other_hosts_are_refused() {
    use std::io::{BufRead as _, BufReader, Write as _};
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["live", "--port", "0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    let (address, token) = line.trim()["http://".len()..].split_once("/?").unwrap();
    let answer = |host: &str| {
        let mut stream = std::net::TcpStream::connect(address).unwrap();
        let request =
            format!("GET /?{token} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    };
    for host in [address, "localhost:1", "[::1]:7117"] {
        assert!(answer(host).starts_with("HTTP/1.1 200"), "{host}");
    }
    for host in ["evil.example", "evil.example:7117", "192.0.2.7"] {
        assert!(answer(host).starts_with("HTTP/1.1 421"), "{host}");
    }
    child.kill().unwrap();
    child.wait().unwrap();
}
