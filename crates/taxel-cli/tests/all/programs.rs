//! Outputs to other programs. Each is also tried with the library of the other side where the interpreter
//! has it; otherwise that part is left out, with a word.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::board::Beside;
use crate::common::{Folder, done, refused, taxel};
use crate::python::python;
use serde_json::Value;
use taxel_recording::mcap::{FrameMessage, MarkMessage, McapReader, Message as _, Topic};

/// Longest wait for what a busy machine sends.
const PATIENCE: Duration = Duration::from_secs(20);

/// A port that was free a moment ago.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

fn socket() -> (UdpSocket, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let address = socket.local_addr().unwrap().to_string();
    (socket, address)
}

/// A file of the clients.
fn clients(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../clients")
        .join(name)
}

/// One outlet of the lab streaming layer at a time: all have the same names.
static OUTLET: Mutex<()> = Mutex::new(());

/// The program with an output, until it is dropped.
fn with_output(output: &str) -> Beside {
    Beside::start(&["live", "three-axis-8x8", "--port", "0", "--out", output])
}

#[test]
fn datagrams_have_the_numbers_of_the_lines() {
    let folder = Folder::new("datagrams");
    let file = folder.path("run.jsonl");
    let [(osc, osc_to), (plot, plot_to)] = [socket(), socket()];
    // A frame behind the capture at the start, which has forces.
    let wanted = 110_u32;
    let curves = std::thread::spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        loop {
            let length = plot.recv(&mut buffer).unwrap();
            let curves: Value = serde_json::from_slice(&buffer[..length]).unwrap();
            if curves["taxel"]["sequence"] == wanted {
                return curves;
            }
        }
    });
    let force = std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        // A message with the number of a frame, then one with its force.
        let number = [&b"/taxel/frame\0\0\0\0,if\0"[..], &wanted.to_be_bytes()].concat();
        loop {
            let length = osc.recv(&mut buffer).unwrap();
            if buffer[..length].starts_with(&number) {
                break;
            }
        }
        let length = osc.recv(&mut buffer).unwrap();
        let head = b"/taxel/force\0\0\0\0,fff\0\0\0\0";
        assert_eq!(
            (&buffer[..head.len()], length),
            (&head[..], head.len() + 12)
        );
        f32::from_be_bytes(buffer[32..36].try_into().unwrap())
    });
    let output = taxel(&[
        "live",
        "three-axis-8x8",
        "--headless",
        "--frames",
        "120",
        "--out",
        &format!("jsonl:{file}"),
        "--out",
        &format!("osc:{osc_to}"),
        "--out",
        &format!("plotjuggler:{plot_to}"),
    ]);
    assert!(output.status.success(), "{output:?}");
    let lines = std::fs::read_to_string(&file).unwrap();
    let mut lines = crate::board::objects(&lines).into_iter();
    let line = lines.find(|line| line["sequence"] == wanted).unwrap();
    let z = line["force_z_n"].as_f64().unwrap();
    let curves = curves.join().unwrap();
    let taxel = &curves["taxel"];
    assert_eq!(taxel["force_n"]["z"], z);
    let seconds = line["time_ns"].as_f64().unwrap() * 1e-9;
    // Reading a decimal may round the last place: of 2 s that is below 1e-15.
    assert!((curves["timestamp"].as_f64().unwrap() - seconds).abs() < 1e-14);
    assert_eq!(taxel["readings_f"].as_object().unwrap().len(), 256);
    assert_eq!(taxel["deviations_z_n"].as_object().unwrap().len(), 64);
    // Each curve of the layout is a number of the datagrams.
    let layout = std::fs::read_to_string(clients("plotjuggler/taxel-layout.xml")).unwrap();
    let named = layout.split("<curve name=\"").skip(1);
    for curve in named.map(|rest| rest.split('"').next().unwrap()) {
        assert!(
            curves
                .pointer(&format!("/{curve}"))
                .is_some_and(Value::is_f64),
            "{curve}"
        );
    }
    assert_eq!(force.join().unwrap(), z as f32);
}

#[test]
fn lines_at_a_port_begin_whole_for_each_reader() {
    let port = free_port();
    let live = with_output(&format!("csv:tcp:{port}"));
    for _ in 0..2 {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut lines = BufReader::new(stream).lines().map(Result::unwrap);
        let names = lines.next().unwrap();
        assert!(names.starts_with("sequence,time [s],"), "{names}");
        let rows: Vec<String> = lines.take(20).collect();
        let sequence = |row: &String| row.split(',').next().unwrap().parse::<u64>().unwrap();
        for pair in rows.windows(2) {
            assert_eq!(sequence(&pair[1]), sequence(&pair[0]) + 1);
            assert_eq!(pair[0].split(',').count(), names.split(',').count());
        }
    }
    drop(live);
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let output = format!("csv:tcp:{}", taken.local_addr().unwrap());
    let arguments = ["live", "--headless", "--frames", "5", "--out", &output];
    let output = taxel(&arguments);
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("csv:tcp:127.0.0.1:"), "{message}");
    let message = refused(&[
        "live",
        "--headless",
        "--frames",
        "5",
        "--out",
        "osc:nowhere",
    ]);
    assert!(message.contains("osc:HOST:PORT"), "{message}");
}

/// Answers of an outlet to a question by datagram.
fn streams(query: &str) -> Vec<String> {
    let (socket, address) = socket();
    let port = address.rsplit_once(':').unwrap().1;
    let question = format!("LSL:shortinfo\r\n{query}\r\n{port} 77\r\n");
    // The first port of the range may be another outlet's; each answers for itself.
    for to in 16_571..16_604 {
        let _ = socket.send_to(question.as_bytes(), ("127.0.0.1", to));
    }
    // All answers to one datagram come at once.
    socket
        .set_read_timeout(Some(Duration::from_secs(2)))
        .unwrap();
    let mut buffer = vec![0; 1 << 16];
    let mut found = Vec::new();
    while let Ok(length) = socket.recv(&mut buffer) {
        let text = String::from_utf8_lossy(&buffer[..length]).into_owned();
        let xml = text.strip_prefix("77\r\n").unwrap().to_owned();
        if !found.contains(&xml) {
            found.push(xml);
        }
    }
    found
}

fn element<'a>(xml: &'a str, name: &str) -> &'a str {
    let begin = format!("<{name}>");
    let (_, rest) = xml.split_once(&begin).unwrap();
    rest.split_once('<').unwrap().0
}

/// The protocol of the lab streaming layer as its library speaks it.
#[test]
fn the_outlet_of_the_lab_layer_answers_and_feeds() {
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let live = with_output("lsl");
    let found = streams("session_id='default' and name='taxel force'");
    let [xml] = &found[..] else {
        panic!("{found:?}")
    };
    assert_eq!(element(xml, "channel_count"), "15");
    assert!(streams("type='EEG'").is_empty());
    let port: u16 = element(xml, "v4data_port").parse().unwrap();
    let ask = |request: &str| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    let mut full = String::new();
    ask("LSL:fullinfo\r\n").read_to_string(&mut full).unwrap();
    assert!(
        full.contains("<label>force_z</label><unit>N</unit>"),
        "{full}"
    );
    let mut other = String::new();
    ask("LSL:streamfeed/110 another\r\n\r\n")
        .read_to_string(&mut other)
        .unwrap();
    assert!(other.contains("404"), "{other}");
    let uid = element(xml, "uid");
    let mut feed = BufReader::new(ask(&format!(
        "LSL:streamfeed/110 {uid}\r\nNative-Byte-Order: 1234\r\n\r\n"
    )));
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        feed.read_line(&mut line).unwrap();
    }
    // Two patterns, then samples: a tag, a stamp and 15 numbers.
    let mut samples = vec![0; 6 * (1 + 8 + 15 * 4)];
    feed.read_exact(&mut samples).unwrap();
    let samples: Vec<&[u8]> = samples.chunks(69).collect();
    let number = |sample: &[u8], at: usize| {
        f32::from_le_bytes(sample[9 + 4 * at..13 + 4 * at].try_into().unwrap())
    };
    let stamp = |sample: &[u8]| f64::from_le_bytes(sample[1..9].try_into().unwrap());
    assert_eq!([0, 1, 2].map(|at| number(samples[0], at)), [4.0, -5.0, 6.0]);
    assert_eq!([0, 1, 2].map(|at| number(samples[1], at)), [2.0, -3.0, 4.0]);
    assert_eq!(stamp(samples[0]), 123_456.789);
    assert!(samples.iter().all(|sample| sample[0] == 2));
    assert!(
        samples[2..]
            .windows(2)
            .all(|pair| stamp(pair[0]) < stamp(pair[1]))
    );
    drop(live);
}

const PYLSL: &str = r#"
import time, pylsl
found, until = {}, time.time() + 20
while "taxel force" not in found or "taxel readings" not in found:
    assert time.time() < until, sorted(found)
    found.update({stream.name(): stream for stream in pylsl.resolve_streams(1)})
def channels(name):
    inlet = pylsl.StreamInlet(found[name])
    info, channel = inlet.info(10), None
    channel = info.desc().child("channels").child("channel")
    while not channel.empty():
        at = [channel.child("location").child_value(axis) for axis in "XYZ"]
        yield channel.child_value("label"), channel.child_value("unit"), [float(part) for part in at if part]
        channel = channel.next_sibling("channel")
force, readings = (list(channels(name)) for name in ("taxel force", "taxel readings"))
assert len(force) == 15 and force[2] == ("force_z", "N", []), force
assert len(readings) == 256, len(readings)
# The pitch of the array is 5 mm: its first taxel lies three and a half of them to the left and up, its last opposite.
(label, unit, first), (*_, last) = readings[0], readings[-1]
assert (label, unit) == ("r0c0.11", "F"), readings[0]
assert all(abs(one + other) < 1e-9 for one, other in zip(first[:2], last[:2])) and first[0] < 0 < first[1], (first, last)
assert len({tuple(at) for _, _, at in readings}) == 64
assert abs(found["taxel force"].nominal_srate() - 60) < 1e-9
"#;

#[test]
fn the_library_of_the_lab_layer_reads_labels_units_and_places() {
    let Some(python) = python(&["pylsl"]) else {
        return;
    };
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let live = with_output("lsl");
    let output = Command::new(python).args(["-c", PYLSL]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    drop(live);
}

/// Ten seconds of `bench/lsl.py`, which also does ten minutes: it holds losses and stamps itself.
#[test]
fn the_library_of_the_lab_layer_loses_nothing_and_stamps_are_those_of_the_device() {
    let Some(python) = python(&["pylsl", "numpy"]) else {
        return;
    };
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../bench/lsl.py");
    let output = Command::new(python)
        .args([script, env!("CARGO_BIN_EXE_taxel"), "--seconds", "10"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
}

/// More connections than an outlet serves wait for nothing, and nothing of the run waits for them.
#[test]
fn strangers_of_the_lab_layer_are_bounded() {
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let live = with_output("lsl");
    let found = streams("name='taxel force'");
    let port: u16 = element(&found[0], "v4data_port").parse().unwrap();
    let mut silent: Vec<_> = (0..100)
        .map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap())
        .collect();
    // Each gets a second to say what it wants, or is closed at once.
    for stream in &mut silent {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let mut nothing = Vec::new();
        stream.read_to_end(&mut nothing).unwrap();
        assert!(nothing.is_empty());
    }
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(b"LSL:fullinfo\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    assert!(text.contains("force_z"), "{text}");
    drop(live);
}

/// Events of one run are marks of another: outlet and inlet of the program itself.
#[test]
fn samples_of_a_stream_of_the_lab_layer_are_marks() {
    let folder = Folder::new("lsl-marks");
    let events = folder.path("events.jsonl");
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let live = with_output("lsl");
    let arguments = ["live", "three-axis-8x8", "--headless", "--frames", "900"];
    let marks = ["--marks", "lsl:taxel events", "--events", &events];
    let output = taxel(&[&arguments[..], &marks].concat());
    drop(live);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("lsl:taxel events: connected"), "{said}");
    let text = std::fs::read_to_string(&events).unwrap();
    let events = crate::board::objects(&text);
    let is_mark = |event: &&Value| {
        let text = event["text"].as_str().unwrap_or_default();
        event["kind"] == "mark" && text.starts_with("{\"index\":")
    };
    assert!(events.iter().any(|event| is_mark(&event)), "{text}");
    let message = refused(&["live", "--headless", "--marks", "lsl:"]);
    assert!(message.contains("lsl:NAME"), "{message}");
}

const MARKERS: &str = r#"
import sys, time, pylsl
outlet = pylsl.StreamOutlet(pylsl.StreamInfo("taxel test markers", "Markers", 1, 0, pylsl.cf_string, "taxel-test"))
assert outlet.wait_for_consumers(30)
time.sleep(1)
# When the two clocks of the mark were read one right after the other.
before = after = 0
while not 0 < after - before < 1e-4:
    before, now, after = pylsl.local_clock(), time.time_ns(), pylsl.local_clock()
# The moment lies in the past, as that of a stimulus whose marker is pushed late.
outlet.push_sample(["grasp begins"], after - 0.5)
print(now - 500_000_000, flush=True)
time.sleep(10)
"#;

#[test]
fn markers_of_the_library_of_the_lab_layer_come_into_the_recording_at_their_time() {
    let Some(python) = python(&["pylsl"]) else {
        return;
    };
    let folder = Folder::new("lsl-markers");
    let recording = folder.path("run.mcap");
    let mut markers = Command::new(python)
        .args(["-c", MARKERS])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let arguments = [
        "live",
        "--headless",
        "--frames",
        "420",
        "--marks",
        "lsl:taxel test markers",
        "--record",
        &recording,
    ];
    done(&arguments);
    let mut said = String::new();
    let _ = markers.kill();
    let mut output = markers.stdout.take().unwrap();
    output.read_to_string(&mut said).unwrap();
    let _ = markers.wait();
    let at: i64 = said.trim().parse().unwrap();
    let mut reader = McapReader::new(std::fs::File::open(&recording).unwrap());
    let (mut marks, mut frames) = (Vec::new(), Vec::new());
    while let Some(entry) = reader.next().unwrap() {
        match entry.topic {
            Topic::Marks => marks.push(MarkMessage::decode(entry.bytes).unwrap()),
            Topic::Raw => frames.push(FrameMessage::decode(entry.bytes).unwrap()),
            _ => {}
        }
    }
    let [mark] = &marks[..] else {
        panic!("{marks:?}")
    };
    assert_eq!(
        (&*mark.text, &*mark.by),
        ("grasp begins", "lsl:taxel test markers")
    );
    let apart = mark.utc_ns.cast_signed() - at;
    // The clocks were read within 0.1 ms, and are compared by datagrams of this machine.
    assert!(apart.abs() < 2_000_000, "{apart} ns");
    // The device time is that of the frame of this moment: frames are 17 ms apart, and wait a while for the pump.
    let nearest = frames
        .iter()
        .min_by_key(|frame| frame.utc_ns.abs_diff(mark.utc_ns));
    let device = mark.device_time_ns.unwrap();
    let apart = nearest.unwrap().frame.time_ns.abs_diff(device);
    assert!(apart < 100_000_000, "{apart} ns");
}

const FOXGLOVE: &str = r#"
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");
const address = process.argv[2].replace("http://", "ws://").replace("/?", "/foxglove?");
const socket = new WebSocket(address, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws: socket });
const kinds = new Map(), found = {};
client.on("error", (error) => { console.error(error); process.exit(1); });
client.on("advertise", (channels) => channels.forEach((channel) => {
  JSON.parse(channel.schema);
  kinds.set(client.subscribe(channel.id), channel);
}));
client.on("message", ({ subscriptionId, data }) => {
  const { topic, schemaName } = kinds.get(subscriptionId);
  found[topic] = [schemaName, JSON.parse(new TextDecoder().decode(data))];
  const needed = ["/taxel/frame", "/taxel/grid", "/taxel/image", "/taxel/scene", "/tf"];
  if (needed.every((name) => name in found)) { console.log(JSON.stringify(found)); process.exit(0); }
});
setTimeout(() => { console.error(Object.keys(found)); process.exit(1); }, 20000);
"#;

#[test]
fn the_client_of_foxglove_reads_all_topics() {
    let folder = Folder::new("foxglove");
    let modules = "require('@foxglove/ws-protocol'); require('ws')";
    let found = Command::new("node")
        .args(["-e", modules])
        .stderr(Stdio::null())
        .status();
    if !found.is_ok_and(|status| status.success()) {
        eprintln!("left out: node has no @foxglove/ws-protocol and ws (NODE_PATH names a folder)");
        return;
    }
    let script = folder.path("client.cjs");
    std::fs::write(&script, FOXGLOVE).unwrap();
    let live = Beside::start(&["live", "three-axis-8x8", "--port", "0"]);
    let output = Command::new("node")
        .args([&script, &live.line])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let [name, grid] = [0, 1].map(|at| &found["/taxel/grid"][at]);
    assert_eq!(name, "foxglove.Grid");
    assert_eq!(
        (&grid["column_count"], &grid["cell_stride"]),
        (&8.into(), &20.into())
    );
    // 64 taxels of five numbers of four bytes, in letters of six bits.
    assert_eq!(
        grid["data"].as_str().unwrap().len(),
        (64_usize * 20).div_ceil(3) * 4
    );
    assert_eq!(found["/taxel/image"][1]["encoding"], "32FC1");
    let arrows = &found["/taxel/scene"][1]["entities"][0]["arrows"];
    assert_eq!(arrows.as_array().unwrap().len(), 64);
    assert_eq!(found["/tf"][1]["child_frame_id"], "taxel");
    // While the zero is not taken there is no force, but a key for it.
    assert!(found["/taxel/frame"][1].get("force_z_n").is_some());
    // What the layout shows is what is sent; of a recording it shows fields of `/taxel/touch`.
    let layout = std::fs::read_to_string(clients("foxglove/taxel-layout.json")).unwrap();
    let layout: Value = serde_json::from_str(&layout).unwrap();
    let panels = &layout["configById"];
    let image = panels["Image!taxel"]["imageMode"]["imageTopic"].as_str();
    let topics = panels["3D!taxel"]["topics"].as_object().unwrap().keys();
    for topic in topics.map(String::as_str).chain(image) {
        assert!(found.get(topic).is_some(), "{topic}");
    }
    for path in panels["Plot!taxel"]["paths"].as_array().unwrap() {
        let (topic, field) = path["value"].as_str().unwrap().split_once('.').unwrap();
        match topic {
            "/taxel/touch" => assert!(["force[0]", "force[1]", "force[2]"].contains(&field)),
            topic => assert!(found[topic][1].get(field).is_some(), "{field}"),
        }
    }
}

const ROS_2: &str = r#"
import json, pathlib, struct, sys
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
name, counts, last = sys.argv[1], {}, {}
# The package of messages is read by its tools, and is what the recording carries.
known, package = get_typestore(Stores.ROS2_HUMBLE), pathlib.Path(sys.argv[2])
for file in sorted(package.glob("msg/*.msg")):
    known.register(get_types_from_msg(file.read_text(), "taxel_msgs/msg/" + file.stem))
for message in read_ros2_messages(name):
    topic = message.channel.topic
    counts[topic] = counts.get(topic, 0) + 1
    last[topic] = message.ros_msg
with AnyReader([pathlib.Path(name)]) as bag:
    for connection in bag.connections:
        if connection.msgtype in known.types:
            assert known.hash_rihs01(connection.msgtype) == bag.typestore.hash_rihs01(connection.msgtype), connection.msgtype
    for connection, _, raw in bag.messages():
        bag.deserialize(raw, connection.msgtype)
        counts[connection.topic] -= 1
assert set(counts.values()) == {0}, counts
image, touch, wrench = (last["/taxel/" + topic] for topic in ("image", "touch", "wrench"))
assert (image.height, image.width, image.encoding, image.step) == (8, 8, "32FC3", 96)
assert list(struct.unpack("<192f", bytes(image.data))) == list(touch.values)
force = wrench.wrench.force
assert [force.x, force.y, -force.z] == list(touch.force)
points = last["/taxel/contacts"]
assert points.width == len(touch.contacts) and points.point_step == 32
print(len(touch.values))
"#;

/// A recording of 300 frames with the messages of a program, which is a recording like any other.
fn recorded_for(program: &str, recording: &str) {
    let live = ["live", "three-axis-8x8", "--headless", "--speed", "max"];
    let record = ["--frames", "300", "--record", recording];
    done(&[&live[..], &record, &["--record-for", program]].concat());
    let text = done(&["recording", "inspect", recording]);
    let lines: Vec<_> = text.split_whitespace().collect();
    assert!(
        lines.windows(2).any(|pair| pair == ["state", "whole"]),
        "{text}"
    );
    let text = done(&["recording", "compare", recording]);
    assert!(text.contains("same touch in 300 frames"), "{text}");
}

#[test]
fn recordings_open_in_the_tools_of_ros_2_with_standard_messages() {
    let folder = Folder::new("ros2");
    let [recording, bag] = ["run.mcap", "ros2.mcap"].map(|name| folder.path(name));
    recorded_for("ros2", &recording);
    let text = done(&["recording", "export", &recording, "-o", &bag]);
    assert!(text.contains("300 frames"), "{text}");
    // It is a bag like any other.
    let parts = done(&["recording", "inspect", &bag]);
    for topic in [
        "/taxel/wrench",
        "/taxel/image",
        "/taxel/contacts",
        "/taxel/touch",
    ] {
        assert!(parts.contains(topic), "{parts}");
    }
    let Some(python) = python(&["mcap_ros2", "rosbags"]) else {
        return;
    };
    let package = concat!(env!("CARGO_MANIFEST_DIR"), "/../../clients/ros2/taxel_msgs");
    // Written as it came, and made of it afterwards.
    for file in [&recording, &bag] {
        let output = Command::new(&python)
            .args(["-c", ROS_2, file, package])
            .output()
            .unwrap();
        assert!(output.status.success(), "{file}: {output:?}");
    }
}

const FOXGLOVE_FILE: &str = r#"
import json, sys
from mcap.reader import make_reader, NonSeekingReader
def messages(reader):
    found = {}
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        assert schema.encoding == {"json": "jsonschema", "cdr": "ros2msg"}[channel.message_encoding]
        found.setdefault((channel.topic, schema.name), []).append((message.log_time, message.sequence, message.data))
    return found
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    recorded, summary = messages(reader), reader.get_summary()
    for number, channel in summary.channels.items():
        kind = channel.topic, summary.schemas[channel.schema_id].name
        assert summary.statistics.channel_message_counts.get(number, 0) == len(recorded.get(kind, [])), channel
with open(sys.argv[2], "rb") as file:
    exported = messages(NonSeekingReader(file))
kinds = "/taxel/grid foxglove.Grid", "/taxel/image foxglove.RawImage", "/taxel/scene foxglove.SceneUpdate", "/tf foxglove.FrameTransform"
for kind in map(tuple, map(str.split, kinds)):
    assert len(recorded[kind]) == 300 and recorded[kind] == exported[kind], kind
    assert [number for _, number, _ in recorded[kind]] == list(range(300))
assert recorded == exported
grid, scene = (json.loads(recorded[kind][-1][2]) for kind in (("/taxel/grid", "foxglove.Grid"), ("/taxel/scene", "foxglove.SceneUpdate")))
assert (grid["column_count"], grid["cell_stride"]) == (8, 20) and len(scene["entities"][0]["arrows"]) == 64
"#;

#[test]
fn recordings_have_the_types_of_foxglove() {
    let folder = Folder::new("foxglove-file");
    let [recording, file] = ["run.mcap", "foxglove.mcap"].map(|name| folder.path(name));
    recorded_for("foxglove", &recording);
    let export = ["recording", "export", &recording, "--for", "foxglove"];
    let text = done(&[&export[..], &["-o", &file]].concat());
    assert!(text.contains("300 frames"), "{text}");
    let message = refused(&[&export[..], &["-o", &folder.path("run.csv")]].concat());
    assert!(message.contains(".mcap"), "{message}");
    let message = refused(&[
        "live",
        "--headless",
        "--frames",
        "5",
        "--record-for",
        "ros2",
    ]);
    assert!(message.contains("--record FILE.mcap"), "{message}");
    let Some(python) = python(&["mcap"]) else {
        return;
    };
    let output = Command::new(python)
        .args(["-c", FOXGLOVE_FILE, &recording, &file])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
}

const DDS: &str = r#"
import sys, time
from taxel_ros2 import kinds
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
participant, kinds = DomainParticipant(0), kinds()
names = {"wrench": "WrenchStamped", "image": "Image", "contacts": "PointCloud2", "readings": "Float32MultiArray", "frame": "Frame"}
readers = {name: DataReader(participant, Topic(participant, "rt/taxel/" + name, kinds[kind])) for name, kind in names.items()}
print("ready", flush=True)
last, end = {}, time.time() + 30
while len(last) < 5 and time.time() < end:
    for name, reader in readers.items():
        for sample in reader.take(8):
            last[name] = sample
    time.sleep(0.02)
image = last["image"]
assert (image.height, image.width, image.encoding, len(image.data)) == (8, 8, "32FC3", 768), image
assert last["wrench"].header.frame_id == "taxel" and len(last["readings"].data) == 256
points, frame = last["contacts"], last["frame"]
assert (points.point_step, len(points.fields), len(points.data)) == (32, 8, 32 * points.width), points
assert len(frame.values) == 256 and frame.arrival_ns == 2**64 - 1 and frame.stamp.sec > 0, frame
"#;

/// A stand-in for the interface of `rclpy` and of the types that ROS 2 builds: attributes as their definitions name
/// them, and no others. There is no ROS 2 on this machine.
const RCLPY: &str = r#"
import sys, types
def kind(name, /, **fields):
    def start(self):
        for field, value in fields.items():
            object.__setattr__(self, field, value() if callable(value) else value)
    def put(self, field, value):
        assert field in fields, (name, field)
        object.__setattr__(self, field, value)
    return type(name, (), {"__slots__": tuple(fields), "__init__": start, "__setattr__": put})
Time = kind("Time", sec=0, nanosec=0)
Header = kind("Header", stamp=Time, frame_id="")
Vector3 = kind("Vector3", x=0.0, y=0.0, z=0.0)
Wrench = kind("Wrench", force=Vector3, torque=Vector3)
def module(name, **members):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(members)
module("geometry_msgs.msg", WrenchStamped=kind("WrenchStamped", header=Header, wrench=Wrench))
module("sensor_msgs.msg",
       Image=kind("Image", header=Header, height=0, width=0, encoding="", is_bigendian=0, step=0, data=list),
       PointField=kind("PointField", name="", offset=0, datatype=0, count=0),
       PointCloud2=kind("PointCloud2", header=Header, height=0, width=0, fields=list, is_bigendian=False, point_step=0,
                        row_step=0, data=list, is_dense=False))
module("std_msgs.msg", Float32MultiArray=kind("Float32MultiArray", layout=list, data=list))
published = {}
class Publisher:
    def __init__(self, kind, name, depth):
        self.kind, self.name = kind, name
    def publish(self, message):
        assert type(message) is self.kind
        published[self.name] = message
class Node:
    def create_publisher(self, kind, name, depth):
        return Publisher(kind, name, depth)
module("rclpy", init=lambda: None, create_node=lambda name: Node())
import taxel_ros2
sys.argv = ["taxel_ros2.py", sys.argv[1], "--once", "60"]
taxel_ros2.main()
assert sorted(published) == ["/taxel/contacts", "/taxel/image", "/taxel/readings", "/taxel/wrench"], sorted(published)
assert published["/taxel/image"].width == 8 and published["/taxel/wrench"].header.frame_id == "taxel"
"#;

#[test]
fn the_bridge_uses_rclpy_where_there_is_one() {
    let Some(python) = python(&["json"]) else {
        return;
    };
    let clients = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../clients/ros2");
    let live = Beside::start(&["live", "three-axis-8x8", "--port", "0"]);
    let output = Command::new(python)
        .args(["-c", RCLPY, &live.line])
        .env("PYTHONPATH", clients)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("taxel_msgs is not built"), "{said}");
}

#[test]
fn the_bridge_to_ros_2_is_read_by_another_program() {
    let Some(python) = python(&["cyclonedds"]) else {
        return;
    };
    let clients = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../clients/ros2");
    let live = Beside::start(&["live", "three-axis-8x8", "--port", "0"]);
    let mut reader = Command::new(&python)
        .args(["-c", DDS])
        .env("PYTHONPATH", &clients)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut ready = String::new();
    let said = reader.stdout.as_mut().unwrap();
    BufReader::new(said).read_line(&mut ready).unwrap();
    let script = clients.join("taxel_ros2.py");
    let bridge = Command::new(&python)
        .arg(&script)
        .args([&*live.line, "--once", "300"])
        .output()
        .unwrap();
    let output = reader.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?} {bridge:?}");
    assert!(bridge.status.success(), "{bridge:?}");
}

/// The script for MATLAB and Octave, by Octave, where there is one with `instrument-control`.
#[test]
fn octave_reads_and_draws_lines() {
    let octave = |code: &str| {
        let path = clients("octave");
        let arguments = [
            "--no-gui",
            "--path",
            &path.to_string_lossy(),
            "--eval",
            code,
        ];
        Command::new("octave").args(arguments).output()
    };
    let found = octave("pkg load instrument-control; disp(\"loaded\")");
    if !found.is_ok_and(|found| String::from_utf8_lossy(&found.stdout).contains("loaded")) {
        eprintln!("left out: there is no octave with instrument-control on this machine");
        return;
    }
    let port = free_port();
    let live = with_output(&format!("csv:tcp:{port}"));
    // The picture is left out: it needs fonts and a printer that a machine for tests has not.
    let code = format!("taxel_lines({port}, 2, \"\")");
    let output = octave(&code).unwrap();
    drop(live);
    let said = String::from_utf8_lossy(&output.stdout);
    let frames = said
        .split_whitespace()
        .next()
        .and_then(|count| count.parse().ok());
    // Two seconds at 60 Hz, and the frame that ends them.
    assert_eq!(frames, Some(121), "{output:?}");
}
