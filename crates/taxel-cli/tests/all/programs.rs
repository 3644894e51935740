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
import sys, time, pylsl
found = {}
for _ in range(10):
    found.update({stream.name(): stream for stream in pylsl.resolve_byprop("type", "Force", 1, 2)})
    found.update({stream.name(): stream for stream in pylsl.resolve_byprop("type", "Markers", 1, 2)})
    if "taxel force" in found and "taxel events" in found:
        break
inlet = pylsl.StreamInlet(found["taxel force"], max_buflen=60)
info, labels = inlet.info(10), []
channel = info.desc().child("channels").child("channel")
while not channel.empty():
    labels.append((channel.child_value("label"), channel.child_value("unit")))
    channel = channel.next_sibling("channel")
assert len(labels) == info.channel_count() == 15 and labels[2] == ("force_z", "N"), labels
assert abs(info.nominal_srate() - 60) < 1e-9
inlet.open_stream(10)
stamps, end = [], time.time() + float(sys.argv[1])
while time.time() < end:
    stamps += inlet.pull_chunk(timeout=0.1, max_samples=4096)[1]
ages = pylsl.local_clock() - stamps[-1]
gaps = [later - earlier for earlier, later in zip(stamps, stamps[1:])]
# One of the clock of the program and of the library: they are the same on Linux.
assert abs(inlet.time_correction(5)) < 1e-3
assert len(stamps) > 10 and ages < 2.0, (len(stamps), ages)
rate = len(gaps) / (stamps[-1] - stamps[0])
assert abs(rate - 60) < 1.0, rate
"#;

#[test]
fn the_library_of_the_lab_layer_loses_nothing() {
    let Some(python) = python(&["pylsl"]) else {
        return;
    };
    let _alone = OUTLET.lock().unwrap_or_else(PoisonError::into_inner);
    let live = with_output("lsl");
    let output = Command::new(python)
        .args(["-c", PYLSL, "5"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    drop(live);
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
}

const ROS_2: &str = r#"
import json, pathlib, struct, sys
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader
name, counts, last = sys.argv[1], {}, {}
for message in read_ros2_messages(name):
    topic = message.channel.topic
    counts[topic] = counts.get(topic, 0) + 1
    last[topic] = message.ros_msg
with AnyReader([pathlib.Path(name)]) as bag:
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

#[test]
fn recordings_open_in_the_tools_of_ros_2_with_standard_messages() {
    let folder = Folder::new("ros2");
    let [recording, bag] = ["run.mcap", "ros2.mcap"].map(|name| folder.path(name));
    let live = ["live", "three-axis-8x8", "--headless", "--speed", "max"];
    done(&[&live[..], &["--frames", "300", "--record", &recording]].concat());
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
    let output = Command::new(python)
        .args(["-c", ROS_2, &bag])
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
names = {"wrench": "WrenchStamped", "image": "Image", "readings": "Float32MultiArray"}
readers = {name: DataReader(participant, Topic(participant, "rt/taxel/" + name, kinds[kind])) for name, kind in names.items()}
print("ready", flush=True)
last, end = {}, time.time() + 30
while len(last) < 3 and time.time() < end:
    for name, reader in readers.items():
        for sample in reader.take(8):
            last[name] = sample
    time.sleep(0.02)
image = last["image"]
assert (image.height, image.width, image.encoding, len(image.data)) == (8, 8, "32FC3", 768), image
assert last["wrench"].header.frame_id == "taxel" and len(last["readings"].data) == 256
"#;

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
