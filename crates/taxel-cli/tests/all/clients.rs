//! The clients in Python and JavaScript against the program; left out with a word where an
//! interpreter is missing.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use crate::board::{self, Beside, device, objects};
use crate::common::Folder;
use serde_json::Value;

fn clients() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../clients")
}

/// Output of an interpreter; `None`, with a word, where it is missing.
fn interpreted(program: &str, arguments: &[&str]) -> Option<Output> {
    if Command::new(program).arg("--version").output().is_err() {
        eprintln!("left out: there is no {program} on this machine");
        return None;
    }
    let output = Command::new(program)
        .args(arguments)
        .env("PYTHONPATH", clients().join("python"))
        .output();
    Some(output.unwrap())
}

#[track_caller]
fn printed(output: &Output) -> Value {
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A page whose frames also go to a file, and that file.
fn live(folder: &Folder) -> (Beside, String) {
    let file = folder.path("run.jsonl");
    let out = format!("jsonl:{file}");
    let live = Beside::start(&["live", "three-axis-8x8", "--port", "0", "--out", &out]);
    (live, file)
}

/// What a client printed of one frame is what the program wrote of it.
#[track_caller]
fn agrees(client: &Value, file: &str) {
    // The file is written behind the socket.
    let mut found = None;
    board::wait_until(|| {
        let text = fs::read_to_string(file).unwrap();
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        let lines = objects(whole);
        found = lines
            .into_iter()
            .find(|line| line["sequence"] == client["sequence"]);
        found.is_some()
    });
    let line = found.unwrap();
    assert_eq!(client["force"][2], line["force_z_n"]);
    assert_eq!(client["time_ns"], line["time_ns"]);
    let number = |value: &Value| value.as_f64().unwrap() as f32;
    let values: Vec<f32> = client["values"]
        .as_array()
        .unwrap()
        .iter()
        .map(number)
        .collect();
    let written: Vec<f32> = line["values_n"]
        .as_array()
        .unwrap()
        .iter()
        .map(number)
        .collect();
    assert_eq!(values, written);
    assert_eq!(client["mark"], "from a client");
}

const PYTHON: &str = r#"
import json, sys
from taxel_live import TaxelLive, TaxelError
try:
    TaxelLive(sys.argv[1] + "0")
    sys.exit("a wrong token was taken")
except TaxelError as error:
    assert "token" in str(error), error
with TaxelLive(sys.argv[1]) as live:
    assert live.hello["rows"] == 8
    live.tare(force=True)
    live.mark("from a client")
    for frame in live.frames():
        marks = [event["text"] for event in live.events if event["kind"] == "mark"]
        if marks and live.status and live.status["tare"] == "done":
            break
    flat = [float(value) for row in frame.values for value in row]
    print(json.dumps({"sequence": frame.sequence, "time_ns": frame.time_ns, "force": list(frame.force),
                      "values": flat, "mark": marks[-1]}))
"#;

#[test]
fn the_python_client_reads_what_the_program_writes() {
    let folder = Folder::new("python-client");
    let (live, file) = live(&folder);
    let Some(output) = interpreted("python3", &["-c", PYTHON, &live.line]) else {
        return;
    };
    agrees(&printed(&output), &file);
}

const AFTER_THE_END: &str = r#"
import json, sys, time, urllib.request
from taxel_live import TaxelLive
address, sequence = sys.argv[1], None
for _ in range(100):
    with TaxelLive(address) as live:
        frame = next(iter(live.frames()))
        # Of a run that goes on it would be another one.
        if frame.sequence == sequence:
            break
        sequence = frame.sequence
    time.sleep(0.1)
history = json.load(urllib.request.urlopen(address.replace("/?", "/history?")))
print(json.dumps({"sequence": frame.sequence, "taxels": len(frame.values), "newest_ns": history["newest_ns"],
                  "trained": live.hello["trained_m"]}))
"#;

#[test]
fn a_client_after_the_end_gets_the_last_frame_and_the_history() {
    let recording = "../taxel-recording/tests/recordings/fingertip.csv";
    let source = format!("replay:{}/{recording}", env!("CARGO_MANIFEST_DIR"));
    let live = Beside::start(&["live", "--source", &source, "--speed", "max", "--port", "0"]);
    let Some(output) = interpreted("python3", &["-c", AFTER_THE_END, &live.line]) else {
        return;
    };
    let found = printed(&output);
    assert_eq!(
        found,
        serde_json::json!({ "sequence": 60, "taxels": 784, "newest_ns": 5_960_000_000_u64, "trained": null })
    );
}

const PYTHON_CONTROLS: &str = r#"
import json, sys, time
from taxel_live import TaxelLive
with TaxelLive(sys.argv[1]) as live:
    live.pause()
    live.seek(3.0)
    for frame in live.frames():
        replay = live.status and live.status["replay"]
        if replay and replay["paused"] and frame.time_ns >= 3_000_000_000:
            break
        live.step()
    print(json.dumps({"sought": frame.time_ns >= 3_000_000_000, "paused": replay["paused"]}))
"#;

const JAVASCRIPT_CONTROLS: &str = r"
const { TaxelLive } = await import(process.argv[2]);
const live = await TaxelLive.open(process.argv[3]);
live.pause();
live.seek(3);
for await (const frame of live) {
  const replay = live.status?.replay;
  if (replay?.paused && frame.timeNs >= 3_000_000_000n) {
    console.log(JSON.stringify({ sought: true, paused: replay.paused }));
    break;
  }
  live.step();
}
live.close();
";

/// Played at this speed the recording would reach 3 s after 300 s: a frame behind it was sought.
#[test]
fn clients_control_a_replay() {
    let folder = Folder::new("client-controls");
    let recording = "../taxel-recording/tests/recordings/fingertip.csv";
    let source = format!("replay:{}/{recording}", env!("CARGO_MANIFEST_DIR"));
    let script = folder.path("client.mjs");
    fs::write(&script, JAVASCRIPT_CONTROLS).unwrap();
    let module = clients().join("javascript/taxel-live.js");
    let module = module.canonicalize().unwrap();
    let begin = || {
        Beside::start(&[
            "live", "--source", &source, "--speed", "0.01", "--port", "0",
        ])
    };
    let (one, other) = (begin(), begin());
    for (program, arguments) in [
        ("python3", &["-c", PYTHON_CONTROLS, &one.line][..]),
        ("node", &[&script, &*module.to_string_lossy(), &other.line]),
    ] {
        if let Some(output) = interpreted(program, arguments) {
            let expected = serde_json::json!({ "sought": true, "paused": true });
            assert_eq!(printed(&output), expected, "{program}");
        }
    }
}

const PYTHON_SENSORS: &str = r#"
import json, os, sys, time
from taxel_live import TaxelLive, TaxelError
with TaxelLive(sys.argv[1]) as live:
    while not (live.status and live.status["sensors"]):
        live.next_frame()
    try:
        live.sensor("nobody")
        sys.exit("a sensor that is not there was found")
    except TaxelError as error:
        assert "names 0 sensors" in str(error), error
    with live.sensor(1) as other:
        # While a rest capture runs none begins.
        while not (other.status and other.status["tare"] == "done"):
            other.next_frame()
        other.start_recording("second.mcap")
        while not (other.status and other.status["recording"]):
            other.next_frame()
        other.stop_recording()
        while other.status["recording"]:
            other.next_frame()
        print(json.dumps({"first": live.hello["rows"], "second": other.hello["rows"]}))
"#;

const JAVASCRIPT_SENSORS: &str = r"
const { TaxelLive, TaxelError } = await import(process.argv[2]);
const live = await TaxelLive.open(process.argv[3]);
while (!live.status?.sensors?.length) await live.nextFrame();
try {
  live.sensor('nobody');
  throw new Error('a sensor that is not there was found');
} catch (error) {
  if (!(error instanceof TaxelError) || !error.message.includes('names 0 sensors')) throw error;
}
const other = await live.sensor(1);
// While a rest capture runs none begins.
while (other.status?.tare !== 'done') await other.nextFrame();
other.startRecording('second.mcap');
while (!other.status?.recording) await other.nextFrame();
other.stopRecording();
while (other.status.recording) await other.nextFrame();
console.log(JSON.stringify({ first: live.hello.rows, second: other.hello.rows }));
process.exit(0);
";

#[test]
fn clients_record_the_second_of_two_sensors() {
    let folder = Folder::new("client-sensors");
    let script = folder.path("client.mjs");
    fs::write(&script, JAVASCRIPT_SENSORS).unwrap();
    let module = clients().join("javascript/taxel-live.js");
    let module = module.canonicalize().unwrap();
    for program in ["python3", "node"] {
        let records = folder.path(program);
        fs::create_dir(&records).unwrap();
        let sensors = ["live", "three-axis-8x8", "three-axis-unit", "--port", "0"];
        let live = Beside::start(&[&sensors[..], &["--record-folder", &records]].concat());
        let arguments = match program {
            "node" => [&script, &*module.to_string_lossy(), &live.line],
            _ => ["-c", PYTHON_SENSORS, &live.line],
        };
        let Some(output) = interpreted(program, &arguments) else {
            continue;
        };
        assert_eq!(
            printed(&output),
            serde_json::json!({ "first": 8, "second": 1 }),
            "{program}"
        );
        let file = fs::metadata(format!("{records}/second.mcap")).unwrap();
        assert!(file.len() > 0, "{program}");
    }
}

const FROM_THE_START: &str = r#"
import json, sys, threading, time
from taxel_live import TaxelLive
with TaxelLive(sys.argv[1]) as live:
    frames, begun = [], time.monotonic()
    def read():
        frames.extend(live.frames())
    threading.Thread(target=read, daemon=True).start()
    while time.monotonic() < begun + 20:
        time.sleep(0.05)
        state = ((live.status or {}).get("link") or {}).get("state")
        wrong = (live.health or {}).get("wrong_channels", 0)
        if state in ("absent", "garbled") and live.status["stale"] or wrong > 100:
            break
    names = live.hello["certainties"]
    total = [names[frame.total_certainty] for frame in frames[-1:] if frame.zero_known]
    print(json.dumps({"state": state, "stale": live.status["stale"], "frames": len(frames) > 0, "wrong": wrong,
                      "health": live.health is not None, "tare": live.status["tare"], "total": total}))
"#;

/// All lines of the array are open from the start.
const OPEN: &str = r#"
schema = 1
name = "open"
duration = "60 s"
"#;

/// Without frames, behind a garbled link and with faulty channels nothing is called well: no
/// condition, no zero, no exact total.
#[test]
fn a_client_hears_of_nothing_that_is_well_before_it_is() {
    let folder = Folder::new("no-well");
    let board = board::board(&folder);
    let mut open = OPEN.to_owned();
    for taxel in 0..64 {
        let (row, column) = (taxel / 8, taxel % 8);
        let fault = format!("[[fault]]\nchannel = {{ taxel = [{row}, {column}] }}\n");
        open.push_str(&fault);
        open.push_str("reads = \"dead\"\nfrom = \"0 s\"\nto = \"60 s\"\n");
    }
    let script = folder.path("open.toml");
    fs::write(&script, open).unwrap();
    let twin = format!("sim:{script}");
    for (source, state, frames) in [
        ("tcp:127.0.0.1:9", "absent".into(), false),
        ("exec:yes", "garbled".into(), false),
        (&*twin, Value::Null, true),
    ] {
        let mut arguments = vec!["live", "three-axis-8x8", "--port", "0", "--source", source];
        if !frames {
            arguments.extend(["--board", &board]);
        }
        let live = Beside::start(&arguments);
        let Some(output) = interpreted("python3", &["-c", FROM_THE_START, &live.line]) else {
            return;
        };
        let found = printed(&output);
        assert_eq!(
            (&found["state"], &found["frames"]),
            (&state, &frames.into())
        );
        assert_eq!(found["stale"], !frames, "{source}: {found}");
        assert_eq!(found["health"], frames, "{source}: {found}");
        assert_eq!(found["wrong"], if frames { 256 } else { 0 }, "{found}");
        assert_ne!(found["tare"], "done", "{source}: {found}");
        assert!(!found["total"].to_string().contains("exact"), "{found}");
    }
}

/// Of a trained array the hello states the area in which it was pressed.
#[test]
fn a_client_hears_where_an_array_was_trained() {
    let folder = Folder::new("trained-area");
    let lattice = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../taxel-recording/tests/recordings/lattice"
    );
    let run = folder.path("run");
    fs::create_dir(&run).unwrap();
    for name in ["sensor", "states"] {
        fs::copy(
            format!("{lattice}/position_{name}.csv"),
            format!("{run}/{name}.csv"),
        )
        .unwrap();
    }
    let file = folder.path("c.toml");
    crate::common::done(&["calibrate", "eflesh-lattice", &run, "-o", &file]);
    let source = format!("replay:{run}/sensor.csv");
    let live = [
        "live",
        "eflesh-lattice",
        "--calibration",
        &file,
        "--source",
        &source,
    ];
    let live = Beside::start(&[&live[..], &["--speed", "max", "--port", "0"]].concat());
    let Some(output) = interpreted("python3", &["-c", AFTER_THE_END, &live.line]) else {
        return;
    };
    // The stage pressed from 282 to 292 and from -105 to -95 mm, about the middle of the array.
    let found = printed(&output)["trained"].clone();
    for axis in 0..2 {
        for (end, pressed) in [-5e-3, 5e-3].into_iter().enumerate() {
            let stated = found[axis][end].as_f64().unwrap();
            // Rounding of numbers that are written with all of their digits.
            assert!((stated - pressed).abs() < 1e-12, "{found}");
        }
    }
}

const JAVASCRIPT: &str = r#"
const { TaxelLive } = await import(process.argv[2]);
let refused = false;
await TaxelLive.open(process.argv[3] + "0").catch(() => { refused = true; });
if (!refused) throw new Error("a wrong token was taken");
const live = await TaxelLive.open(process.argv[3]);
live.tare(true);
live.mark("from a client");
for await (const frame of live) {
  const mark = live.events.filter(({ kind }) => kind === "mark").at(-1);
  if (mark === undefined || live.status?.tare !== "done") continue;
  console.log(JSON.stringify({ sequence: Number(frame.sequence), time_ns: Number(frame.timeNs),
    force: frame.force, values: [...frame.values], mark: mark.text }));
  break;
}
live.close();
"#;

#[test]
fn the_javascript_client_reads_what_the_program_writes() {
    let folder = Folder::new("javascript-client");
    let (live, file) = live(&folder);
    let script = folder.path("client.mjs");
    fs::write(&script, JAVASCRIPT).unwrap();
    let module = clients().join("javascript/taxel-live.js");
    let module = module.canonicalize().unwrap();
    let arguments = [&*script, &*module.to_string_lossy(), &live.line];
    let Some(output) = interpreted("node", &arguments) else {
        return;
    };
    agrees(&printed(&output), &file);
}

const JSON_LINES: &str = r#"
schema = 1
name = "readings of a program"
[framing.lines]
template = '{{"t":{time s},"n":{sequence},"v":[{value c1..c256}]}}'
"#;

#[test]
fn a_program_in_python_is_a_source() {
    let folder = Folder::new("python-source");
    let script = clients().join("python/taxel_source.py");
    if interpreted("python3", &["--version"]).is_none() {
        return;
    }
    let board = folder.path("json-lines.toml");
    fs::write(&board, JSON_LINES).unwrap();
    let source = format!("exec:python3 '{}' 256", script.to_str().unwrap());
    let output = crate::common::taxel(&[
        "live",
        "three-axis-8x8",
        "--raw",
        "--headless",
        "--format",
        "json",
        "--board",
        &board,
        "--source",
        &source,
        "--frames",
        "50",
    ]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&found["frames"], &found["lost"]),
        (&50.into(), &0.into()),
        "{}",
        found["link"]
    );
    assert_eq!(found["link"]["wire"]["other"], 0);
}

/// Summary of frames that a program in Python sends as lines; `paths` are where it finds modules.
#[track_caller]
fn sent_by(python: &str, script: &str, arguments: &str, board: &str, paths: &str) -> Value {
    let script = clients().join("python").join(script);
    let source = format!("exec:{python} '{}' {arguments}", script.to_str().unwrap());
    let live = ["live", "--raw", "--headless", "--format", "json"];
    let output = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(live)
        .args(["--board", board, "--source", &source, "--frames", "100"])
        .env("PYTHONPATH", paths)
        .output()
        .unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    assert_eq!(found["frames"], 100, "{output:?}");
    assert_eq!(found["link"]["wire"]["other"], 0, "{}", found["link"]);
    found
}

/// With the synthetic board of the library itself.
#[test]
fn a_board_of_brainflow_is_a_source() {
    let Some(python) = crate::python::python(&["brainflow"]) else {
        return;
    };
    let folder = Folder::new("brainflow");
    let script = clients().join("python/brainflow_source.py");
    let described = Command::new(&python)
        .args([script.to_str().unwrap(), "--board-file"])
        .output()
        .unwrap();
    let board = folder.path("brainflow.toml");
    fs::write(&board, &described.stdout).unwrap();
    let found = sent_by(&python, "brainflow_source.py", "--board -1", &board, "");
    assert_eq!(
        (&found["lost"], &found["channels"]),
        (&0.into(), &16.into())
    );
}

const CARD: &str = "\
schema = 1
name = \"card\"
[framing.lines]
template = '{{\"t\":{time s},\"n\":{sequence},\"v\":[{value c1..c4 V}]}}'
";

/// The library of the cards at its own interface: it needs a driver that is not here.
const FAKE_CARD: &str = "
import time
class Task:
    def __enter__(self):
        self.ai_channels, self.timing = Channels(), self
        return self
    def __exit__(self, *_): pass
    def cfg_samp_clk_timing(self, rate, sample_mode): self.rate, self.mode = rate, sample_mode
    def read(self, number_of_samples_per_channel):
        time.sleep(number_of_samples_per_channel / self.rate)
        return [[0.25 * channel] * number_of_samples_per_channel for channel in range(4)]
class Channels:
    def add_ai_voltage_chan(self, name): assert name == 'Dev1/ai0:3', name
    def __len__(self): return 4
";

#[test]
fn a_daq_card_is_a_source() {
    if interpreted("python3", &["--version"]).is_none() {
        return;
    }
    let folder = Folder::new("daq-card");
    let package = folder.path("nidaqmx");
    fs::create_dir(&package).unwrap();
    fs::write(format!("{package}/__init__.py"), FAKE_CARD).unwrap();
    let constants = "class AcquisitionType: CONTINUOUS = 10123\n";
    fs::write(format!("{package}/constants.py"), constants).unwrap();
    let board = folder.path("card.toml");
    fs::write(&board, CARD).unwrap();
    let paths = std::path::Path::new(&package).parent().unwrap();
    let paths = paths.to_str().unwrap();
    let card = "nidaqmx_source.py";
    let found = sent_by("python3", card, "Dev1/ai0:3", &board, paths);
    assert_eq!((&found["lost"], &found["channels"]), (&0.into(), &4.into()));
    let last: Vec<f64> = found["last_signals_si"]
        .as_array()
        .unwrap()
        .iter()
        .map(|value| value.as_f64().unwrap())
        .collect();
    assert_eq!(last, [0.0, 0.25, 0.5, 0.75]);
}

#[test]
fn a_controller_holds_a_force_on_the_twin() {
    let folder = Folder::new("hold-force");
    let board = board::board(&folder);
    // A port that was free a moment ago.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = free.local_addr().unwrap().port();
    drop(free);
    let control = format!("tcp:{port}");
    let device = device(&board, "tcp:0", &["--control", &control]);
    let live = Beside::start(&[
        "live",
        "three-axis-8x8",
        "--port",
        "0",
        "--board",
        &board,
        "--source",
        &device.line,
    ]);
    let script = clients().join("python/hold_force.py");
    let address = format!("localhost:{port}");
    let arguments = [
        &*script.to_string_lossy(),
        &live.line,
        &address,
        "--seconds",
        "4",
    ];
    let Some(output) = interpreted("python3", &arguments) else {
        return;
    };
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let held: f64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(
        (held - 0.2).abs() < 0.02 && text.contains("round trip"),
        "{text}"
    );
}
