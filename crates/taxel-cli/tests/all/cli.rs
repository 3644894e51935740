//! The program at its boundary: what it prints, and how it ends.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

const SENSOR: &str = include_str!("../../../taxel/sensors/three-axis-8x8.toml");

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .unwrap()
        .to_owned()
}

fn recording(name: &str) -> PathBuf {
    repository()
        .join("crates/taxel-recording/tests/recordings")
        .join(name)
}

/// A folder of its own for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn file(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn taxel(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(arguments: &[&str]) -> Value {
    let output = taxel(arguments);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| {
        panic!("{error}: {} {}", text(&output.stdout), text(&output.stderr))
    })
}

/// Asserts exit code 2, nothing on the standard output, and every part in one
/// message.
#[track_caller]
fn refused(arguments: &[&str], parts: &[&str]) {
    let output = taxel(arguments);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} wrote a result");
    for part in parts {
        assert!(
            message.contains(part),
            "{arguments:?}: no \"{part}\" in: {message}"
        );
    }
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn check_prints_what_follows_from_the_file() {
    let facts = json(&["check", "three-axis-8x8", "--format", "json"]);
    let rest = facts["transduction"]["rest_capacitance_11_f"]
        .as_f64()
        .unwrap();
    // The specification has 204.0 to 204.5 fF with all other electrodes grounded.
    assert!((204.0e-15..204.5e-15).contains(&rest), "{rest}");
    let of = |name: &str| facts["transduction"][name].as_f64().unwrap();
    assert!((of("plate_capacitance_11_f") - 172.297_708_906e-15).abs() < 1e-23);
    assert!((of("capacitance_with_edges_least_11_f") - 199.6e-15).abs() < 0.05e-15);
    assert!((of("capacitance_with_edges_greatest_11_f") - 213.65e-15).abs() < 0.05e-15);
    assert!((of("capacitance_by_air_gap_11_f_per_m") + 22.3e-9).abs() < 0.2e-9);
    assert_eq!(facts["mechanics"]["stiffness_from"], "typed in");
    assert_eq!(facts["sensor_hash"].as_str().unwrap().len(), 64);
    let table = taxel(&["check", "three-axis-unit"]);
    assert_eq!(table.status.code(), Some(0));
    assert!(text(&table.stdout).contains("rest_capacitance_12"));
}

#[test]
fn bad_sensor_files_are_refused_at_the_very_word() {
    let folder = folder("bad_sensors");
    for (from, to, parts) in [
        (
            "air_gap = \"6 um\"",
            "air_gap = \"6 uN\"",
            ["air_gap", "unit of force", "nm, um, mm", "^^^^^^"].as_slice(),
        ),
        (
            "air_gap = \"6 um\"",
            "air_gap = 6",
            &["plates.air_gap", "has no unit"],
        ),
        (
            "air_gap = \"6 um\"",
            "air_gap = \"-6 um\"",
            &["plates.air_gap", "greater than 0 m"],
        ),
        (
            "pitch = \"2 mm\"",
            "pich = \"2 mm\"",
            &["array.pich", "unknown field", "pitch"],
        ),
        ("rows = 8", "rows = 0", &["array.rows", "from 1 to 256"]),
        (
            "tile_tilt = 1.0",
            "tile_tilt = 1.5",
            &["tile_tilt", "at most 1"],
        ),
        (
            "pitch = \"2 mm\"",
            "pitch = \"1 mm\"",
            &["array.pitch", "overlap"],
        ),
        (
            "frame_rate = \"60 Hz\"",
            "frame_rate = \"120 Hz\"",
            &["electronics.frame_rate", "one scan takes 16.0000 ms"],
        ),
        (
            "mount = \"flat\"",
            "mount = { cylinder = { radius = \"2 mm\" } }",
            &["array.mount.cylinder.radius", "more than once round"],
        ),
        (
            "mount = \"flat\"",
            "mount = \"bent\"",
            &["array.mount", "is not known here", "cylinder"],
        ),
        ("schema = 2", "schema = 3", &["schema 3 is not known"]),
        (
            "schema = 2",
            "schema = 1",
            &["schema 1 is not known", "write schema = 2"],
        ),
        ("[array]", "[array", &[":8:7", "[array"]),
        (
            "bits = 16",
            "bits = 99",
            &["electronics.converter.bits", "1 to 32"],
        ),
        (
            "range = [\"0 V\", \"1 V\"]",
            "range = [\"0 V\", \"0.1 V\"]",
            &["electronics.converter.range", "172.30 fF"],
        ),
        (
            "full_scale = \"20 mN\"",
            "full_scale = \"70 mN\"",
            &["full_scale", "closes a gap", "give less than 62.4 mN"],
        ),
    ] {
        assert!(SENSOR.contains(from), "{from}");
        let path = file(&folder, "bad.toml", SENSOR.replacen(from, to, 1));
        let parts: Vec<&str> = ["bad.toml:"]
            .into_iter()
            .chain(parts.iter().copied())
            .collect();
        refused(&["check", &path], &parts);
    }
    refused(
        &["check", "no-such-file.toml"],
        &["no-such-file.toml", "cannot be read", "three-axis-8x8"],
    );
    refused(&["check", folder.to_str().unwrap()], &["is a folder"]);
    let path = file(&folder, "latin.toml", b"schema = 1\nname = \"M\xfcller\"\n");
    refused(&["check", &path], &["line 2 is not UTF-8"]);
}

#[cfg(unix)]
#[test]
fn a_name_that_is_no_text_is_named() {
    let name: &std::ffi::OsStr = std::os::unix::ffi::OsStrExt::from_bytes(b"no\xff.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .arg("check")
        .arg(name)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).starts_with("error: no\u{fffd}.toml: cannot be read"));
}

/// A name of several lines is shown on one: the message stays one line.
#[test]
fn a_name_of_two_lines_is_shown_on_one() {
    for command in [
        &["check"][..],
        &["recording", "inspect"],
        &["live", "--raw"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(command)
            .arg("two\nlines.toml")
            .output()
            .unwrap();
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(
            message.starts_with("error: two\\nlines.toml: "),
            "{message}"
        );
    }
}

/// Nothing that a command reads is overwritten, and no work is done for an output that
/// cannot be written.
#[test]
fn outputs_are_checked_before_anything_is_done() {
    let folder = folder("outputs");
    let sensor = file(&folder, "sensor.toml", SENSOR);
    let loads = "force_z [mN]\n10\n";
    let table = file(&folder, "loads.csv", loads);
    let new = folder.join("new.csv").to_str().unwrap().to_owned();
    let nowhere = folder.join("none/x.svg").to_str().unwrap().to_owned();
    let inside = folder.to_str().unwrap();
    let predict = ["predict", &sensor, "--loads", &table];
    for (arguments, parts) in [
        (
            vec!["check", &sensor, "-o", &sensor],
            ["would be overwritten", "sensor.toml"],
        ),
        (
            vec!["calibrate", &sensor, &table, "-o", &table],
            ["would be overwritten", "loads.csv"],
        ),
        (
            vec!["twin", &sensor, "--calibration-data", "-o", &sensor],
            ["would be overwritten", "--output"],
        ),
        (
            [&predict[..], &["-o", &table]].concat(),
            ["would be overwritten", "loads.csv"],
        ),
        (
            [&predict[..], &["-o", &new, "--plot", &new]].concat(),
            ["--plot", "also the file of --output"],
        ),
        (
            [&predict[..], &["-o", &new, "--plot", &nowhere]].concat(),
            ["there is no folder", "make it first"],
        ),
        (
            [&predict[..], &["-o", inside]].concat(),
            ["is a folder", "name a file"],
        ),
        (
            vec!["sweep", "p4-sections", "-o", &nowhere],
            ["there is no folder", "none"],
        ),
    ] {
        refused(&arguments, &parts);
    }
    assert_eq!(fs::read_to_string(&sensor).unwrap(), SENSOR);
    assert_eq!(fs::read_to_string(&table).unwrap(), loads);
    assert!(!Path::new(&new).exists());
}

#[test]
fn predict_answers_row_by_row_in_three_formats() {
    let folder = folder("predict");
    let loads =
        "name,force_x [mN],force_y [mN],force_z [mN]\npress,0,0,10\npush,15,0,0\nhard,0,0,70\n";
    let loads = file(&folder, "loads.csv", loads);
    let answer = json(&[
        "predict",
        "three-axis-8x8",
        "--loads",
        &loads,
        "--format",
        "json",
    ]);
    let rows = answer["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    assert_eq!(rows[0]["name"], "press");
    let ratio = rows[0]["plate_11_f"].as_f64().unwrap() / 172.297_708_906_378e-15;
    assert!((ratio - 1.132_430_841_671_57).abs() < 1e-9);
    assert_eq!(rows[2]["state"], "closed");
    assert_eq!(rows[2]["closed"], "11 12 21 22");
    let csv = text(
        &taxel(&[
            "predict",
            "three-axis-8x8",
            "--loads",
            &loads,
            "--format",
            "csv",
        ])
        .stdout,
    );
    assert!(
        csv.starts_with("name,force_x [mN],force_y [mN],force_z [mN],displacement_x [nm]"),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 4);
    let output = folder.join("out.csv");
    let done = taxel(&[
        "predict",
        "three-axis-8x8",
        "--loads",
        &loads,
        "--format",
        "csv",
        "-o",
        output.to_str().unwrap(),
    ]);
    assert_eq!(done.status.code(), Some(0));
    assert_eq!(fs::read_to_string(&output).unwrap(), csv);
    let one = text(&taxel(&["predict", "three-axis-8x8", "--load", "fx=-2 mN, fz=5 mN"]).stdout);
    assert!(one.contains("capacitance_11 [fF]"), "{one}");
}

#[test]
fn bad_loads_are_refused_and_nothing_is_written() {
    let folder = folder("bad_loads");
    let output = folder.join("out.csv");
    for (table, parts) in [
        (
            "force_x [mN],force_y [mN],force_z [mN]\n0,nan,5\n",
            [
                "loads.csv:2:3",
                "force_y [mN]",
                "nan",
                "from -1000 to 1000 N",
            ]
            .as_slice(),
        ),
        (
            "force_x [mN],force_y [mN],force_z [mm]\n0,0,5\n",
            &["force_z [mm]", "not a unit of force", "mN"],
        ),
        ("force_x [mN],force_y [mN]\n0,0\n", &["force_z is missing"]),
        (
            "force_x [mN],force_y [mN],force_z [mN]\n0,0\n",
            &["loads.csv:2", "2 fields; the header has 3"],
        ),
        ("force_x [mN],force_y [mN],force_z [mN]\n", &["no loads"]),
        ("", &["missing"]),
    ] {
        let loads = file(&folder, "loads.csv", table);
        refused(
            &[
                "predict",
                "three-axis-8x8",
                "--loads",
                &loads,
                "-o",
                output.to_str().unwrap(),
            ],
            parts,
        );
        assert!(!output.exists());
    }
    refused(&["predict", "three-axis-8x8"], &["--loads"]);
    refused(
        &["predict", "three-axis-8x8", "--load", "fz=5"],
        &["--load", "no unit"],
    );
    refused(
        &[
            "predict",
            "three-axis-8x8",
            "--load",
            "fz=5 mN",
            "--loads",
            "x.csv",
        ],
        &["cannot be used with"],
    );
}

#[test]
fn headless_finger_script_is_complete() {
    let summary = json(&[
        "live",
        "--headless",
        "--frames",
        "240",
        "--speed",
        "max",
        "--format",
        "json",
    ]);
    assert_eq!(summary["frames"], 240);
    assert_eq!(summary["lost"], 0);
    assert_eq!(summary["tare"], "done");
    assert_eq!(summary["last_states"]["ok"], 64);
    // 240 frames at 60 Hz end at 3.98 s, in the middle of the press of 90 mN.
    let force = summary["last_force_n"][2].as_f64().unwrap();
    assert!((force - 90e-3).abs() < 2e-3, "{force}");
    assert!(summary["latency_s"]["p99"].as_f64().unwrap() > 0.0);
    assert_eq!(summary["last_taxel_forces_n"].as_array().unwrap().len(), 64);
}

#[test]
fn the_summary_is_one_row_of_csv() {
    let arguments = [
        "live",
        "--headless",
        "--frames",
        "5",
        "--speed",
        "max",
        "--format",
        "csv",
    ];
    let text = text(&taxel(&arguments).stdout);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{text}");
    assert!(lines[0].starts_with("name,source,rows,columns"), "{text}");
    assert!(
        lines[1].starts_with("three-axis capacitive array 8x8,sim:,8,8"),
        "{text}"
    );
}

#[test]
fn the_twin_keeps_its_frame_rate() {
    let started = Instant::now();
    let summary = json(&["live", "--headless", "--frames", "61", "--format", "json"]);
    assert!(started.elapsed() >= Duration::from_millis(990));
    let rate = summary["rate_hz"].as_f64().unwrap();
    assert!((rate - 60.0).abs() < 3.0, "{rate}");
}

#[test]
fn replay_is_identical() {
    let folder = folder("replay");
    let saved = folder.join("run.csv");
    let saved = saved.to_str().unwrap();
    let first = json(&[
        "live",
        "--headless",
        "--frames",
        "200",
        "--speed",
        "max",
        "--format",
        "json",
        "--save",
        saved,
    ]);
    let source = format!("replay:{saved}");
    let second = json(&[
        "live",
        "--headless",
        "--speed",
        "max",
        "--format",
        "json",
        "--source",
        &source,
    ]);
    for key in [
        "frames",
        "last_sequence",
        "last_time_ns",
        "last_force_n",
        "last_taxel_forces_n",
        "last_centre_of_pressure_m",
    ] {
        assert_eq!(first[key], second[key], "{key}");
    }
    assert_eq!(second["frames"], 200);
    refused(
        &["live", "--headless", "--frames", "5", "--save", saved],
        &["the file exists"],
    );
}

#[test]
fn events_are_counted_and_written_to_a_new_file_in_both_formats() {
    let folder = folder("events");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let run = [
        "live",
        "--headless",
        "--speed",
        "max",
        "--frames",
        "240",
        "--format",
        "json",
    ];
    for name in ["events.csv", "events.jsonl"] {
        let file = path(name);
        let summary = json(&[&run[..], &["--events", &file]].concat());
        assert_eq!(
            summary["events"],
            serde_json::json!({ "touch": 1, "step": 1 })
        );
        assert_eq!(summary["last_events"][0]["kind"], "touch");
        let written = fs::read_to_string(&file).unwrap();
        let lines: Vec<&str> = written.lines().collect();
        assert_eq!(
            lines.len(),
            if name == "events.csv" { 3 } else { 2 },
            "{written}"
        );
        assert!(lines[lines.len() - 1].contains("step"));
        refused(
            &[&run[..], &["--events", &file]].concat(),
            &["--events", "the file exists"],
        );
    }
    let unknown = path("events.txt");
    refused(
        &[&run[..], &["--events", &unknown]].concat(),
        &["--events", ".csv or .jsonl"],
    );
    assert!(!Path::new(&unknown).exists());
    // One file for both is refused, and nothing is written.
    let (frames, both) = (path("frames.csv"), path("frames.csv"));
    refused(
        &[&run[..], &["--save", &frames, "--events", &both]].concat(),
        &["--events", "also the file of --save"],
    );
    assert!(!Path::new(&frames).exists());
}

#[test]
fn vendor_recordings_are_recognised_by_content() {
    let folder = folder("vendors");
    for (name, rows, columns, unit, pitch) in [
        ("fingertip.csv", 28, 28, "raw", 1.27e-3),
        ("foot.asf", 60, 21, "kPa", 5.08e-3),
        ("insoles.csv", 31, 11, "mmHg", 8.6e-3),
    ] {
        // Under another name: the content decides.
        let renamed = folder.join(format!("{rows}.data"));
        fs::copy(recording(name), &renamed).unwrap();
        let source = format!("replay:{}", renamed.to_str().unwrap());
        let summary = json(&[
            "live",
            "--headless",
            "--speed",
            "max",
            "--format",
            "json",
            "--source",
            &source,
        ]);
        assert_eq!(
            (&summary["rows"], &summary["columns"]),
            (&Value::from(rows), &Value::from(columns)),
            "{name}"
        );
        assert_eq!(
            summary["channel_unit"].as_str().unwrap().to_lowercase(),
            unit.to_lowercase()
        );
        assert!((summary["pitch_m"][0].as_f64().unwrap() - pitch).abs() < 1e-9);
        assert!(summary["frames"].as_u64().unwrap() >= 3);
        let known = summary["last_force_n"][2].is_number();
        assert_eq!(
            known,
            unit != "raw",
            "{name}: total force only with a unit of pressure"
        );
    }
}

#[test]
fn cut_and_foreign_recordings_are_refused() {
    let folder = folder("recordings");
    let whole = fs::read_to_string(recording("fingertip.csv")).unwrap();
    let cut = file(&folder, "cut.csv", &whole[..whole.len() / 2]);
    let source = format!("replay:{cut}");
    refused(
        &["live", "--headless", "--speed", "max", "--source", &source],
        &["cut.csv", "--salvage"],
    );
    let salvaged = taxel(&[
        "live",
        "--headless",
        "--speed",
        "max",
        "--format",
        "json",
        "--salvage",
        "--source",
        &source,
    ]);
    assert_eq!(
        salvaged.status.code(),
        Some(3),
        "{}",
        text(&salvaged.stderr)
    );
    let summary: Value = serde_json::from_slice(&salvaged.stdout).unwrap();
    assert!(summary["frames"].as_u64().unwrap() >= 25);

    let numbers = file(
        &folder,
        "numbers.csv",
        "1743486221.59,604.8,158.4\n1743486221.62,602.4,151.2\n",
    );
    refused(
        &[
            "live",
            "--headless",
            "--source",
            &format!("replay:{numbers}"),
        ],
        &["numbers.csv", "time [s]"],
    );
    let ragged = file(
        &folder,
        "ragged.csv",
        "time [s],r0c0 [kPa],r0c1 [kPa]\n0,1,2\n1,2\n2,3,4\n",
    );
    refused(
        &[
            "live",
            "--headless",
            "--source",
            &format!("replay:{ragged}"),
        ],
        &["ragged.csv:3"],
    );
    refused(
        &["live", "--headless", "--source", "replay:nowhere.csv"],
        &["nowhere.csv", "cannot be opened"],
    );
    let other = "time [s],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],r0c0.22 [fF]\n0,172,172,172,172\n";
    let other = file(&folder, "unit.csv", other);
    let source = format!("replay:{other}");
    refused(
        &["live", "--headless", "--source", &source],
        &["does not fit", "1 x 1"],
    );
    let fits = json(&[
        "live",
        "three-axis-unit",
        "--headless",
        "--speed",
        "max",
        "--format",
        "json",
        "--source",
        &source,
    ]);
    assert_eq!(fits["frames"], 1);
}

#[test]
fn lost_and_clipped_frames_end_with_exit_code_3() {
    let folder = folder("losses");
    let script = "schema = 1\nname = \"l\"\nduration = \"10 s\"\n";
    let lossy = file(
        &folder,
        "lossy.toml",
        format!("{script}[link]\nlose_every = 10\ndouble_every = 7\n"),
    );
    let run = |script: &str| {
        taxel(&[
            "live",
            "--headless",
            "--frames",
            "100",
            "--speed",
            "max",
            "--format",
            "json",
            "--source",
            &format!("sim:{script}"),
        ])
    };
    let output = run(&lossy);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["lost"], 11);
    assert!(summary["duplicate"].as_u64().unwrap() > 10);
    let dead = "[[fault]]\nchannel = { taxel = [0, 0], capacitor = \"11\" }\nreads = \"dead\"\nfrom = \"0 s\"\nto = \"9 s\"\n";
    let clipped = file(&folder, "clipped.toml", format!("{script}{dead}"));
    let output = run(&clipped);
    assert_eq!(output.status.code(), Some(3));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["clipped_frames"], 100);
    assert_eq!(summary["last_states"]["faulty"], 1);
}

#[test]
fn bad_command_lines_are_refused() {
    refused(
        &["live", "--source", "tape:x"],
        &["tape:x", "sim:", "replay:"],
    );
    refused(&["live", "--source", "replay:"], &["replay:"]);
    refused(
        &["live", "--headless", "--speed", "0"],
        &["--speed", "above 0"],
    );
    refused(&["live", "--headless", "--speed", "fast"], &["--speed"]);
    refused(&["live", "--headless", "--speed", "max"], &["--frames"]);
    refused(&["live", "--frames", "0"], &["--frames"]);
    refused(&["live", "--port", "70000"], &["--port"]);
    refused(&["live", "--host", "nowhere"], &["--host"]);
    refused(&["fly"], &["fly"]);
    refused(&[], &["Usage"]);
    assert_eq!(taxel(&["--help"]).status.code(), Some(0));
    assert_eq!(taxel(&["--version"]).status.code(), Some(0));
}

/// At least 200 broken files: never a panic, never exit 0.
#[test]
fn two_hundred_broken_files_are_refused() {
    let folder = folder("broken");
    let mut tried = 0;
    let mut refuse = |arguments: &[&str], what: &str| {
        let output = taxel(arguments);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{what}: {message}");
        assert!(
            !message.contains("panicked") && !message.is_empty(),
            "{what}: {message}"
        );
        tried += 1;
    };
    // Sensor files: every line with a value loses it, gets nonsense, is
    // doubled, gets another key, or its quote is not closed.
    for (number, line) in SENSOR.lines().enumerate() {
        let Some((key, _)) = line.split_once(" = ").filter(|_| !line.starts_with('#')) else {
            continue;
        };
        for broken in [
            format!("{key} ="),
            format!("{key} = \"1 furlong\""),
            format!("{line}\n{line}"),
            format!("{key}_ = 1"),
            format!("{key} = \"1"),
        ] {
            if broken.contains("furlong") && key == "name" {
                continue;
            }
            let lines: Vec<&str> = SENSOR
                .lines()
                .enumerate()
                .map(|(n, l)| if n == number { broken.as_str() } else { l })
                .collect();
            let path = file(&folder, "sensor.toml", lines.join("\n"));
            refuse(&["check", &path], &broken);
        }
    }
    // Scripts cut at every tenth byte inside their last table.
    let script = include_str!("../../../taxel/sensors/stimuli/finger.toml");
    for cut in (script.len() - 300..script.len() - 10).step_by(10) {
        let path = file(&folder, "script.toml", &script[..cut]);
        refuse(
            &[
                "live",
                "--headless",
                "--frames",
                "1",
                "--source",
                &format!("sim:{path}"),
            ],
            &format!("script cut at {cut}"),
        );
    }
    // Recordings: a broken field in each of many places.
    let whole = fs::read_to_string(recording("insoles.csv")).unwrap();
    let digits: Vec<usize> = whole
        .match_indices(",0,0,0,0,")
        .map(|(at, _)| at + 1)
        .step_by(7)
        .take(40)
        .collect();
    for at in digits {
        let broken = format!("{}x{}", &whole[..at], &whole[at + 1..]);
        let path = file(&folder, "recording.csv", broken);
        refuse(
            &[
                "live",
                "--headless",
                "--speed",
                "max",
                "--source",
                &format!("replay:{path}"),
            ],
            &format!("x at {at}"),
        );
    }
    assert!(tried >= 200, "{tried}");
}

/// A running service, ended when dropped.
struct Service {
    child: Child,
    address: String,
    token: String,
}

impl Service {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(["live", "--port", "0"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        let (address, token) = line
            .trim()
            .strip_prefix("http://")
            .unwrap()
            .split_once("/?token=")
            .unwrap();
        Self {
            address: address.to_owned(),
            token: token.to_owned(),
            child,
        }
    }

    /// Sends a request and returns the status line and what followed.
    fn get(&self, path: &str, headers: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(5)))
            .unwrap();
        let request = format!(
            "GET {path} HTTP/1.1\r\nHost: {}\r\n{headers}\r\n",
            self.address
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = vec![0; 400];
        let mut read = 0;
        while read < answer.len() {
            match stream.read(&mut answer[read..]) {
                Ok(more) if more > 0 => read += more,
                _ => break,
            }
        }
        text(&answer[..read])
    }

    fn socket(&self, token: &str, origin: &str) -> String {
        let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                       Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        self.get(&format!("/ws?token={token}"), &format!("{upgrade}{origin}"))
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn only_holders_of_the_token_get_page_and_data() {
    let service = Service::start(&[]);
    assert!(service.address.starts_with("127.0.0.1:"));
    assert_eq!(service.token.len(), 32);
    let close = "Connection: close\r\n";
    let page = service.get(&format!("/?token={}", service.token), close);
    assert!(
        page.starts_with("HTTP/1.1 200") && page.contains("content-security-policy"),
        "{page}"
    );
    for wrong in ["/", "/?token=", "/?token=wrong"] {
        assert!(
            service.get(wrong, close).starts_with("HTTP/1.1 401"),
            "{wrong}"
        );
    }
    assert!(
        service
            .get("/etc/passwd", close)
            .starts_with("HTTP/1.1 404")
    );
    assert!(service.socket("wrong", "").starts_with("HTTP/1.1 401"));
    assert!(
        service
            .socket(&service.token, "Origin: http://evil.example\r\n")
            .starts_with("HTTP/1.1 403")
    );
    let own = format!("Origin: http://{}\r\n", service.address);
    let answer = service.socket(&service.token, &own);
    assert!(
        answer.starts_with("HTTP/1.1 101") && answer.contains("\"type\":\"hello\""),
        "{answer}"
    );
    assert!(
        service
            .socket(&service.token, "")
            .starts_with("HTTP/1.1 101")
    );
}

/// A client that never reads must not hold up the source: 2000 frames of 1 ms
/// come to more bytes than the system buffers.
#[test]
fn a_stalled_client_slows_nobody() {
    let folder = folder("stalled");
    let fast = SENSOR
        .replace("frame_rate = \"60 Hz\"", "frame_rate = \"1 kHz\"")
        .replace("row_time = \"1 ms\"", "row_time = \"50 us\"");
    let sensor = file(&folder, "fast.toml", fast);
    let mut service = Service::start(&[&sensor, "--frames", "2000", "--format", "json"]);
    let mut stalled = TcpStream::connect(&service.address).unwrap();
    let request = format!(
        "GET /ws?token={} HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        service.token, service.address
    );
    stalled.write_all(request.as_bytes()).unwrap();
    let mut rest = String::new();
    service
        .child
        .stdout
        .as_mut()
        .unwrap()
        .read_to_string(&mut rest)
        .unwrap();
    assert_eq!(service.child.wait().unwrap().code(), Some(0));
    let summary: Value = serde_json::from_str(&rest).unwrap();
    assert_eq!(
        (&summary["frames"], &summary["lost"]),
        (&Value::from(2000), &Value::from(0))
    );
    // A source that waited for the client would never have come to the end.
    let duration = summary["duration_s"].as_f64().unwrap();
    assert!(duration < 4.0, "{duration}");
}

#[test]
fn a_taken_port_is_one_clear_message() {
    let service = Service::start(&[]);
    let port = service.address.split_once(':').unwrap().1;
    refused(
        &["live", "--port", port],
        &["cannot listen on", port, "--port 0"],
    );
}

#[test]
fn each_start_has_another_token() {
    let (first, second) = (Service::start(&[]), Service::start(&[]));
    assert_ne!(first.token, second.token);
}

#[cfg(unix)]
#[test]
fn interruption_ends_with_a_summary_and_exit_code_0() {
    let folder = folder("interrupted");
    let saved = folder.join("run.csv");
    let child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args([
            "live",
            "--headless",
            "--format",
            "json",
            "--save",
            saved.to_str().unwrap(),
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Frames must have come before; the file grows when they did.
    let deadline = Instant::now() + Duration::from_secs(20);
    while fs::metadata(&saved).map_or(0, |about| about.len()) < 20_000 {
        assert!(Instant::now() < deadline, "no frames were saved");
        std::thread::sleep(Duration::from_millis(50));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let frames = summary["frames"].as_u64().unwrap();
    assert!(frames > 3);
    // What was saved is whole and can be replayed to the last frame.
    let source = format!("replay:{}", saved.to_str().unwrap());
    let again = json(&[
        "live",
        "--headless",
        "--speed",
        "max",
        "--format",
        "json",
        "--source",
        &source,
    ]);
    assert_eq!(again["frames"].as_u64().unwrap(), frames);
}
