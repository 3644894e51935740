//! Scripted twins through the pump: events, identities, repeated frames, tares.

use std::sync::mpsc;

use serde_json::Value;
use taxel::acquisition::{Delivery, Frame, Stimulus, Stream, Twin};
use taxel::estimation::TouchSession;
use taxel::sensor::Sensor;
use taxel_recording::mcap::{
    EventMessage, FrameMessage, HealthMessage, McapReader, Message as _, RestMessage, Topic,
    TouchMessage,
};

use crate::history::History;
use crate::link::LinkHandle;
use crate::message::Tare;
use crate::pump::{Command, Pump, PumpOptions, StartTare, Summary};
use crate::record::{RecordFile, RecordFolder, RecordTo, WhenRecordingFails};
use crate::replay::{Replay, ReplayCommand};
use crate::shared::Shared;
use crate::source::{Next, Source, SourceError, TwinSource};
use crate::tare::{By, TareHistory};

fn twin(sensor: &str, script: &str) -> (Twin, TouchSession) {
    let sensor = Sensor::shipped(sensor).unwrap();
    let text = Stimulus::shipped_text(script).unwrap_or(script);
    let stimulus = Stimulus::parse("script", text).unwrap();
    let twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let device = sensor.device().unwrap();
    let session = device.session(&twin.stream()).unwrap();
    (twin, session)
}

/// All that is sent of a run: the summary, the events and the posted texts.
fn pumped(
    source: Box<dyn Source>,
    session: TouchSession,
    frames: u64,
) -> (Summary, Vec<Value>, Vec<String>) {
    let options = PumpOptions {
        speed: f64::INFINITY,
        frames: Some(frames),
        ..PumpOptions::default()
    };
    let shared = Shared::new();
    let (_sender, commands) = mpsc::sync_channel(1);
    let pump = Pump::new(source, session, options, shared.clone(), commands).unwrap();
    let summary = pump.run();
    let events = shared.events().since(0).map_or(Vec::new(), |(text, _)| {
        let message: Value = serde_json::from_str(&text).unwrap();
        message["events"].as_array().unwrap().clone()
    });
    let posts = shared
        .status()
        .posts
        .iter()
        .map(|post| post.text.to_string())
        .collect();
    (summary, events, posts)
}

fn events(sensor: &str, script: &str, frames: u64) -> Vec<Value> {
    let (twin, session) = twin(sensor, script);
    pumped(Box::new(TwinSource::new(twin)), session, frames).1
}

/// Kind, contact and time in s of each event.
fn kinds_and_times(events: &[Value]) -> Vec<(String, u64, f64)> {
    let one = |event: &Value| {
        let time = event["time_ns"].as_u64().unwrap() as f64 * 1e-9;
        let kind = event["kind"].as_str().unwrap().to_owned();
        (kind, event["contact"].as_u64().unwrap(), time)
    };
    events.iter().map(one).collect()
}

/// Each expected event is there once, at its time in s to `within`, in this
/// order of each contact; nothing else is.
#[track_caller]
fn assert_events(events: &[Value], expected: &[(&str, u64, f64)], within: f64) {
    let found = kinds_and_times(events);
    let sorted = |mut all: Vec<(String, u64, f64)>| {
        all.sort_by(|a, b| (a.1, a.2).partial_cmp(&(b.1, b.2)).unwrap());
        all
    };
    let expected = expected
        .iter()
        .map(|(kind, contact, time)| (kind.to_string(), *contact, *time));
    let (found, expected) = (sorted(found), sorted(expected.collect()));
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(
            (&found.0, found.1),
            (&expected.0, expected.1),
            "{found:?} {expected:?}"
        );
        assert!(
            (found.2 - expected.2).abs() < within,
            "{found:?} {expected:?}"
        );
    }
}

#[test]
fn a_finger_on_the_array_is_touch_step_slip_and_release() {
    // A step is known when the force was held for 0.4 s; the drag of 7 mm/s is a
    // slip when its speed stands out of the noise of the positions.
    let expected = [
        ("touch", 1, 2.02),
        ("step", 1, 3.0),
        ("release", 1, 4.58),
        ("touch", 2, 5.02),
        ("step", 2, 5.8),
        ("release", 2, 7.58),
        ("touch", 3, 8.02),
        ("step", 3, 8.8),
        ("release", 3, 10.58),
        ("touch", 4, 11.02),
        ("step", 4, 11.8),
        ("slip", 4, 12.1),
        ("release", 4, 13.78),
        ("touch", 5, 14.42),
        ("step", 5, 15.3),
        ("release", 5, 17.18),
        ("touch", 6, 14.62),
        ("step", 6, 15.5),
        ("release", 6, 17.18),
    ];
    let found = events("three-axis-8x8", "finger", 1075);
    assert_events(&found, &expected, 0.25);
    let step = found.iter().find(|event| event["kind"] == "step").unwrap();
    // 90 mN, to the noise and to what reaches taxels below the threshold.
    assert!(
        (step["value"].as_f64().unwrap() - 0.09).abs() < 2e-3,
        "{step}"
    );
}

#[test]
fn taps_on_piezoelectric_elements_are_impacts() {
    let taps = [(1.0, 1), (3.0, 2), (5.0, 3), (7.0, 4)];
    let expected: Vec<_> = taps
        .iter()
        .flat_map(|(time, id)| {
            [
                ("touch", *id, *time),
                ("impact", *id, time + 0.177),
                ("release", *id, time + 0.187),
            ]
        })
        .collect();
    assert_events(&events("piezo-1.5mm", "piezo-tap", 7900), &expected, 0.02);
}

#[test]
fn a_ridge_along_the_row_is_one_slip_and_a_press_is_none() {
    let slide = events("piezo-1.5mm", "piezo-slide", 2390);
    let slips: Vec<_> = slide
        .iter()
        .filter(|event| event["kind"] == "slip")
        .collect();
    assert_eq!(slips.len(), 1, "{slide:?}");
    let slip = slips[0];
    // One ridge of 20 mm/s under a soft cover.
    let speed = slip["value"].as_f64().unwrap();
    assert!((0.016..0.026).contains(&speed), "{slip}");
    assert_eq!(slip["direction"], serde_json::json!([1.0, 0.0]));
    assert!(slip["score"].as_f64().unwrap() > 0.5);
    let press = events("piezo-1.5mm", "piezo-press", 5900);
    let kinds: Vec<_> = kinds_and_times(&press)
        .into_iter()
        .map(|event| event.0)
        .collect();
    assert_eq!(kinds, ["touch", "step", "release"], "{press:?}");
}

#[test]
fn a_cyclic_load_has_its_frequency_and_is_even_once_the_high_pass_is_undone() {
    let mut path = String::new();
    for cycle in 0..8 {
        for (share, force) in [(0.0, 0.0), (0.25, 0.5), (0.5, 0.0), (0.999, 0.0)] {
            let time = 1.0 + 0.35 * (f64::from(cycle) + share);
            let point = format!(
                "{{ time = \"{time} s\", at = [\"-2 mm\", \"2 mm\"], force = [\"0 N\", \"0 N\", \"{force} N\"] }},\n"
            );
            path.push_str(&point);
        }
    }
    let script = format!(
        "schema = 1\nname = \"cycles\"\nduration = \"5 s\"\n[[finger]]\nradius = \"1.5 mm\"\npath = [\n{path}]\n"
    );
    let found = events("piezo-1.5mm", &script, 4800);
    let cyclic: Vec<_> = found
        .iter()
        .filter(|event| event["kind"] == "cyclic")
        .collect();
    assert!(!cyclic.is_empty(), "{found:?}");
    for event in cyclic {
        // A period of 350 ms, to the step of 1 ms.
        assert!(
            (event["value"].as_f64().unwrap() * 0.35 - 1.0).abs() < 3e-3,
            "{event}"
        );
        // The signal itself has a second peak of about 0.6.
        assert!(event["symmetry"].as_f64().unwrap() > 0.95, "{event}");
    }
}

/// Two fingers that move through each other.
const CROSSING: &str = r#"
schema = 1
name = "crossing"
duration = "5 s"
[[finger]]
radius = "2.6 mm"
path = [
  { time = "2.0 s", at = ["-5 mm", "1 mm"], force = ["0 N", "0 N", "0 mN"] },
  { time = "2.3 s", at = ["-5 mm", "1 mm"], force = ["0 N", "0 N", "45 mN"] },
  { time = "2.7 s", at = ["5 mm", "1 mm"], force = ["0 N", "0 N", "45 mN"] },
  { time = "3.5 s", at = ["5 mm", "1 mm"], force = ["0 N", "0 N", "45 mN"] },
]
[[finger]]
radius = "2.6 mm"
path = [
  { time = "2.1 s", at = ["5 mm", "-1 mm"], force = ["0 N", "0 N", "0 mN"] },
  { time = "2.3 s", at = ["5 mm", "-1 mm"], force = ["0 N", "0 N", "45 mN"] },
  { time = "2.7 s", at = ["-5 mm", "-1 mm"], force = ["0 N", "0 N", "45 mN"] },
  { time = "3.5 s", at = ["-5 mm", "-1 mm"], force = ["0 N", "0 N", "45 mN"] },
]
"#;

#[test]
fn fingers_that_cross_keep_their_numbers() {
    let (mut twin, mut session) = twin("three-axis-8x8", CROSSING);
    session.begin_rest_capture(50);
    let mut last = Vec::new();
    while last.is_empty() || last[0] < 3.0 {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        session.push(&frame).unwrap();
        let tracks = session.observer().tracks();
        let positions = tracks.iter().map(|track| (track.id, track.centre()[0]));
        last = vec![frame.time_ns as f64 * 1e-9];
        last.extend(positions.flat_map(|(id, x)| [id as f64, x]));
    }
    let [_, 1.0, first, 2.0, second] = last[..] else {
        panic!("{last:?}")
    };
    assert!(first > 4e-3 && second < -4e-3, "{last:?}");
}

/// A twin whose frames come as those of a link do.
struct Linked(TwinSource);

impl Source for Linked {
    fn stream(&self) -> &Stream {
        self.0.stream()
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        self.0.next()
    }

    fn is_live(&self) -> bool {
        true
    }
}

/// A finger that lies on the array when the run begins, and leaves it at 3 s.
const LYING: &str = r#"
schema = 1
name = "lying"
duration = "20 s"
[[finger]]
radius = "2.6 mm"
path = [
  { time = "0 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "60 mN"] },
  { time = "3.0 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "60 mN"] },
  { time = "3.1 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "0 mN"] },
]
"#;

/// Kinds in the history of the rest values.
fn tare_kinds(posts: &[String]) -> Vec<String> {
    let tares: Value = serde_json::from_str(&posts[1]).unwrap();
    let entries = tares["entries"].as_array().unwrap().iter();
    entries
        .map(|entry| entry["kind"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn a_tare_that_a_touch_prevented_is_taken_when_it_ends() {
    let run = |frames: u64| {
        let (twin, session) = twin("three-axis-8x8", LYING);
        let source = Box::new(Linked(TwinSource::new(twin)));
        let (summary, _, posts) = pumped(source, session, frames);
        (summary, tare_kinds(&posts))
    };
    // 60 frames a second: refused after 50, and the finger still lies there.
    let (summary, kinds) = run(150);
    assert_eq!(summary.tare, Tare::Waiting);
    assert!(
        summary.notice.contains("not taken yet") && summary.notice.contains("may press"),
        "{}",
        summary.notice
    );
    assert_eq!(kinds, ["begun", "refused"]);
    let (summary, kinds) = run(400);
    assert_eq!((summary.tare, summary.notice.as_str()), (Tare::Done, ""));
    assert_eq!(kinds, ["begun", "refused", "captured"]);
    let force = summary.last.unwrap().force[2];
    assert!(force.abs() < 2e-3, "{force} N");
}

#[test]
fn what_the_operator_says_comes_before_a_tare_that_is_owed() {
    let (twin, session) = twin("three-axis-8x8", LYING);
    let source = Box::new(Linked(TwinSource::new(twin)));
    let options = PumpOptions {
        speed: f64::INFINITY,
        frames: Some(400),
        ..PumpOptions::default()
    };
    let shared = Shared::new();
    let (sender, commands) = mpsc::sync_channel(1);
    let pump = Pump::new(source, session, options, shared.clone(), commands).unwrap();
    let running = std::thread::spawn(move || pump.run());
    while shared.status().tare != Tare::Waiting {
        std::thread::yield_now();
    }
    sender.send(Command::ClearTare).unwrap();
    let summary = running.join().unwrap();
    assert_eq!((summary.tare, summary.notice.as_str()), (Tare::None, ""));
}

/// What begins under a touch is no source without forces: its zero is taken in the first quiet window,
/// and that is said.
#[test]
fn a_recording_that_begins_under_a_touch_takes_its_zero_later_and_says_so() {
    let (twin, session) = twin("three-axis-8x8", LYING);
    let (summary, _, posts) = pumped(Box::new(TwinSource::new(twin)), session, 400);
    assert_eq!(summary.tare, Tare::Done);
    assert_eq!(tare_kinds(&posts), ["begun", "refused", "captured"]);
    assert!(
        summary.notice.contains("the zero was taken at") && summary.notice.contains("no forces"),
        "{}",
        summary.notice
    );
    let last = summary.last.unwrap();
    assert!(last.zero_known && last.force[2].abs() < 2e-3, "{last:?}");
}

/// Sends each frame of the twin twice, the second time under a new number.
struct Stutter {
    source: TwinSource,
    again: Option<Frame>,
}

impl Source for Stutter {
    fn stream(&self) -> &Stream {
        self.source.stream()
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        if let Some(frame) = self.again.take() {
            return Ok(Next::Frame(frame));
        }
        let mut next = self.source.next()?;
        if let Next::Frame(frame) = &mut next {
            frame.sequence *= 2;
            let mut again = frame.clone();
            again.sequence += 1;
            again.time_ns += 1_000_000;
            self.again = Some(again);
        }
        Ok(next)
    }
}

#[test]
fn frames_sent_again_under_a_new_number_are_not_estimated_again() {
    let plain = twin("three-axis-8x8", "finger");
    let (summary, events, _) = pumped(Box::new(TwinSource::new(plain.0)), plain.1, 300);
    assert_eq!(summary.continuity.repeated, 0);
    let (twin, session) = twin("three-axis-8x8", "finger");
    let source = Stutter {
        source: TwinSource::new(twin),
        again: None,
    };
    let (stuttered, same, _) = pumped(Box::new(source), session, 300);
    assert_eq!(stuttered.continuity.repeated, 299);
    assert_eq!(stuttered.continuity.lost, 0);
    assert!(!events.is_empty());
    assert_eq!(events, same);
    assert_eq!(stuttered.last.unwrap().force, summary.last.unwrap().force);
}

#[test]
fn undoing_a_tare_restores_the_rest_values_bit_for_bit() {
    for sensor in [
        "three-axis-8x8",
        "in-plane-50um",
        "piezo-1.5mm",
        "liquid-metal-2x4",
    ] {
        let quiet = "schema = 1\nname = \"quiet\"\nduration = \"9 s\"\n";
        let (mut twin, mut session) = twin(sensor, quiet);
        let mut tares = TareHistory::new(&session, None);
        let mut capture = |session: &mut TouchSession, tares: &mut TareHistory| {
            session.begin_rest_capture(20);
            tares.begin(By::Page, false);
            loop {
                let Delivery::Frame(frame) = twin.next_delivery() else {
                    continue;
                };
                let captured = session.push(&frame).unwrap().captured;
                if let Some(captured) = captured {
                    captured.unwrap();
                    tares.captured(Some(frame.time_ns), None, session);
                    return session.rest();
                }
            }
        };
        let drawn = session.rest();
        let first = capture(&mut session, &mut tares);
        let second = capture(&mut session, &mut tares);
        assert!(drawn != first && first != second, "{sensor}");
        for (to, rest) in [(1, &first), (0, &drawn), (2, &second)] {
            assert!(tares.undo(to, None, &mut session), "{sensor}");
            assert_eq!(session.rest(), *rest, "{sensor}");
            assert_eq!(tares.captured_ns().is_some(), to > 0, "{sensor}");
        }
        assert!(!tares.undo(99, None, &mut session));
        let message: Value = serde_json::from_str(&tares.message()).unwrap();
        let kinds: Vec<_> = message["entries"]
            .as_array()
            .unwrap()
            .iter()
            .map(|entry| &entry["kind"])
            .collect();
        assert_eq!(
            kinds,
            [
                "begun", "captured", "captured", "undone", "undone", "undone"
            ]
        );
        let change = message["entries"][1]["largest_change"]["change"]
            .as_f64()
            .unwrap();
        let values = drawn.values().iter().zip(first.values());
        let most = values
            .map(|(before, after)| (after - before).abs())
            .fold(0.0, f64::max);
        assert_eq!(change.abs(), most, "{sensor}");
    }
}

#[test]
fn what_a_late_client_receives_begins_with_the_start() {
    let (twin, session) = twin("three-axis-8x8", "finger");
    let (_, events, posts) = pumped(Box::new(TwinSource::new(twin)), session, 200);
    assert_eq!(events[0]["index"], 0);
    let message = |place: usize| serde_json::from_str::<Value>(&posts[place]).unwrap();
    assert_eq!(message(0)["type"], "rest");
    let tares = message(1);
    assert_eq!(tares["type"], "tares");
    let entries = tares["entries"].as_array().unwrap();
    assert_eq!(
        (&entries[0]["kind"], &entries[0]["by"]),
        (&"begun".into(), &"start".into())
    );
    assert_eq!(
        (&entries[1]["kind"], &entries[1]["by"]),
        (&"captured".into(), &"start".into())
    );
    let health = message(2);
    assert_eq!(
        (&health["type"], &health["wrong_channels"]),
        (&"health".into(), &0.into())
    );
}

#[test]
fn a_command_that_cannot_be_done_says_why_and_changes_nothing() {
    let (twin, session) = twin("three-axis-8x8", "finger");
    let shared = Shared::new();
    let (sender, commands) = mpsc::sync_channel(4);
    sender.send(Command::UndoTare { to: 7 }).unwrap();
    let options = PumpOptions {
        speed: f64::INFINITY,
        frames: Some(100),
        ..PumpOptions::default()
    };
    let source = Box::new(TwinSource::new(twin));
    let summary = Pump::new(source, session, options, shared, commands)
        .unwrap()
        .run();
    assert!(
        summary.notice.contains("a rest capture is running"),
        "{}",
        summary.notice
    );
    assert_eq!(summary.tare, Tare::Done);
}

#[test]
fn a_zero_that_was_forced_under_load_is_named_once_the_load_has_gone() {
    let script = "schema = 1\nname = \"press\"\nduration = \"9 s\"\n[[probe]]\ntaxel = [2, 5]\npath = [\
        { time = \"2 s\", force = [\"0 N\", \"0 N\", \"5 mN\"] },\
        { time = \"4 s\", force = [\"0 N\", \"0 N\", \"5 mN\"] },\
        { time = \"4.1 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }]\n";
    let (twin, session) = twin("three-axis-8x8", script);
    let shared = Shared::new();
    let (sender, commands) = mpsc::sync_channel(4);
    let options = PumpOptions {
        speed: f64::INFINITY,
        frames: Some(400),
        ..PumpOptions::default()
    };
    let source = PressedAt {
        source: TwinSource::new(twin),
        command: Some((2_500_000_000, sender)),
    };
    let summary = Pump::new(Box::new(source), session, options, shared, commands)
        .unwrap()
        .run();
    let below = summary.below_zero.unwrap();
    assert_eq!(below.taxels, 1);
    assert_eq!(below.cause, "the zero was taken under load");
    assert!(below.zero_time_ns.unwrap() > 2_500_000_000 && below.zero_unix_s.is_some());
}

#[test]
fn the_history_of_a_run_has_its_totals_its_channels_and_its_taxels() {
    for (sensor, script, expected, signals) in [
        (
            "three-axis-8x8",
            "finger",
            ["force_x", "force_z", "moment_z", "contacts", "taxel r7c7"],
            3 + 3 + 1 + 64,
        ),
        (
            "liquid-metal-2x4",
            "pad-b",
            [
                "force_z",
                "contacts",
                "channel row 0",
                "channel column 3",
                "taxel r1c3",
            ],
            1 + 1 + 6 + 8,
        ),
    ] {
        let (twin, session) = twin(sensor, script);
        let shared = Shared::new();
        let (_sender, commands) = mpsc::sync_channel(1);
        let options = PumpOptions {
            speed: f64::INFINITY,
            frames: Some(400),
            ..PumpOptions::default()
        };
        let source = Box::new(TwinSource::new(twin));
        *shared.history() = History::new(session.meaning());
        let pump = Pump::new(source, session, options, shared.clone(), commands).unwrap();
        let summary = pump.run();
        let history = shared.history();
        let names: Vec<&str> = history
            .signals()
            .iter()
            .map(|signal| &*signal.name)
            .collect();
        assert_eq!(names.len(), signals, "{names:?}");
        for name in expected {
            assert!(names.contains(&name), "{name} of {names:?}");
        }
        let [oldest, newest] = history.extent_ns().unwrap();
        assert_eq!(newest, summary.last.unwrap().time_ns);
        let force = names.iter().position(|name| *name == "force_z").unwrap();
        let rows = history.section([oldest, newest], 10_000, &[force]).rows;
        let largest = rows
            .iter()
            .map(|row| row.stats[0].maximum)
            .fold(0.0, f32::max);
        assert!(largest > 1e-3, "{sensor}: {largest} N at most");
        assert_eq!(
            history.marks(oldest, newest).len(),
            1,
            "the tare at the start"
        );
    }
}

/// A source that forces a tare at a device time, ns.
struct PressedAt {
    source: TwinSource,
    command: Option<(u64, mpsc::SyncSender<Command>)>,
}

impl Source for PressedAt {
    fn stream(&self) -> &Stream {
        self.source.stream()
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        let next = self.source.next()?;
        if let Next::Frame(frame) = &next
            && let Some((_, sender)) = self.command.take_if(|(at, _)| frame.time_ns > *at)
        {
            let (by, force) = (By::Page, true);
            sender.send(Command::Tare { by, force }).unwrap();
        }
        Ok(next)
    }
}

/// Every message of a recording of 300 frames of the finger script, begun by a command before the first
/// frame or with the run, less what follows from the clock of this computer: times of day, the rate of
/// frames, and how many losses and conditions there are, of which the last stands for all. Messages go
/// into chunks by that clock too, so that files as wholes differ.
fn recorded(folder: &std::path::Path, name: &str, by_command: bool) -> Vec<String> {
    let (twin, session) = twin("three-axis-8x8", "finger");
    let file = RecordFile {
        path: folder.join(format!("{name}.mcap")),
        library: "test".into(),
        attachments: Vec::new(),
        metadata: Vec::new(),
        companion: None,
        when_failing: WhenRecordingFails::GoOn,
        told: |_| (),
    };
    let path = file.path.clone();
    let options = PumpOptions {
        speed: f64::INFINITY,
        frames: Some(300),
        start_tare: StartTare::Never,
        record: (!by_command).then(|| RecordTo::File(Box::new(file.clone()))),
        record_folder: Some(RecordFolder {
            folder: folder.to_owned(),
            file,
        }),
        ..PumpOptions::default()
    };
    let (sender, commands) = mpsc::sync_channel(4);
    if by_command {
        let name = name.to_owned();
        sender.send(Command::StartRecording { name }).unwrap();
    }
    let source = Box::new(TwinSource::new(twin));
    let summary = Pump::new(source, session, options, Shared::new(), commands)
        .unwrap()
        .run();
    let recording = summary.recording.unwrap();
    assert_eq!(
        (&recording.path, recording.lost, recording.failure),
        (&path, 0, None)
    );
    let bytes = std::fs::read(&path).unwrap();
    let mut reader = McapReader::new(bytes.as_slice());
    let (mut messages, mut health_at_end) = (Vec::new(), String::new());
    while let Some(entry) = reader.next().unwrap() {
        messages.push(match entry.topic {
            Topic::Raw => format!("{:?}", FrameMessage::decode(entry.bytes).unwrap().frame),
            Topic::Touch => format!("{:?}", TouchMessage::decode(entry.bytes).unwrap()),
            Topic::Rest => format!(
                "{:?}",
                RestMessage {
                    utc_ns: 0,
                    ..RestMessage::decode(entry.bytes).unwrap()
                }
            ),
            Topic::Events => format!("{:?}", EventMessage::decode(entry.bytes).unwrap()),
            // One a second of this computer, with the rate by its clock.
            Topic::Health => {
                let health = HealthMessage {
                    utc_ns: 0,
                    rate: 0.0,
                    ..HealthMessage::decode(entry.bytes).unwrap()
                };
                health_at_end = format!("{health:?}");
                continue;
            }
            topic => panic!("{topic:?}"),
        });
    }
    messages.push(health_at_end);
    messages
}

#[test]
fn a_recording_begun_by_a_client_is_that_of_the_whole_run() {
    let folder = std::env::temp_dir().join(format!("taxel-begun-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir(&folder).unwrap();
    let (whole, begun) = (
        recorded(&folder, "whole", false),
        recorded(&folder, "begun", true),
    );
    // Two messages a frame, the rest values at the beginning, a touch, and the losses.
    let events = whole
        .iter()
        .filter(|message| message.starts_with("EventMessage"))
        .count();
    assert!(events > 0);
    assert_eq!(whole.len(), 602 + events);
    assert_eq!(whole, begun);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A replay of 300 frames of the finger script, from the twin, whose clients ask for `asked` once `after`
/// frames were sent: device times of the frames that were sent until it ended, in their order, at least
/// `least`.
fn replayed(asked: &[(usize, ReplayCommand)], least: usize) -> Vec<u64> {
    struct Cut(TwinSource, u64);
    impl Source for Cut {
        fn stream(&self) -> &Stream {
            self.0.stream()
        }

        fn next(&mut self) -> Result<Next, SourceError> {
            if self.1 == 0 {
                return Ok(Next::End);
            }
            self.1 -= 1;
            self.0.next()
        }
    }
    let open = || -> (Box<dyn Source>, TouchSession) {
        let (twin, session) = twin("three-axis-8x8", "finger");
        (Box::new(Cut(TwinSource::new(twin), 300)), session)
    };
    let (source, session) = open();
    let shared = Shared::new();
    let mut messages = shared.messages.subscribe();
    let (sender, commands) = mpsc::sync_channel(16);
    let options = PumpOptions {
        speed: f64::INFINITY,
        ..PumpOptions::default()
    };
    let mut pump = Pump::new(source, session, options, shared.clone(), commands).unwrap();
    pump.control(Replay {
        from_ns: 0,
        to_ns: 4_983_333_333,
        reopen: Box::new(move || Ok(open())),
    });
    let run = std::thread::spawn(|| pump.run());
    let mut times = Vec::new();
    let mut asked = asked.iter();
    let mut next = asked.next();
    let begun = std::time::Instant::now();
    loop {
        assert!(
            begun.elapsed().as_secs() < 60,
            "{} frames came",
            times.len()
        );
        match messages.try_recv() {
            Ok(outgoing) => times.push(u64::from_le_bytes(
                outgoing.bytes[16..24].try_into().unwrap(),
            )),
            Err(_) => std::thread::sleep(std::time::Duration::from_millis(2)),
        }
        if let Some((after, command)) = next
            && times.len() >= *after
        {
            sender.send(Command::Replay(*command)).unwrap();
            next = asked.next();
        }
        let ended = shared.status().replay.as_ref().is_some_and(|now| now.ended);
        if next.is_none() && ended && messages.is_empty() && times.len() >= least {
            break;
        }
    }
    shared
        .stop
        .store(true, std::sync::atomic::Ordering::Relaxed);
    run.join().unwrap();
    times
}

#[test]
fn a_replay_goes_back_to_a_time_and_shows_what_it_showed() {
    let plain = replayed(&[], 300);
    assert_eq!(plain.len(), 300);
    // From the end back to 4 s: what is before is estimated, and not shown.
    let back = replayed(&[(300, ReplayCommand::Seek(4_000_000_000))], 301);
    let from = plain
        .iter()
        .position(|time| *time >= 4_000_000_000)
        .unwrap();
    assert_eq!(back[..300], plain);
    assert_eq!(back[300..], plain[from..]);
}

#[test]
fn a_loop_begins_again_at_the_end() {
    let looped = replayed(
        &[
            (1, ReplayCommand::Loop(true)),
            (700, ReplayCommand::Loop(false)),
        ],
        701,
    );
    assert_eq!(looped.len() % 300, 0);
    assert!(
        looped.len() >= 900 && looped[300] == looped[0],
        "{}",
        looped.len()
    );
}

/// A finger that rests on the array, while frames are missing for two seconds.
const MISSING: &str = r#"
schema = 1
name = "missing"
duration = "20 s"
[[finger]]
radius = "2.6 mm"
path = [
  { time = "2.0 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "0 mN"] },
  { time = "2.5 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "60 mN"] },
  { time = "5.0 s", at = ["0 mm", "0 mm"], force = ["0 N", "0 N", "60 mN"] },
  { time = "5.5 s", at = ["1 mm", "0 mm"], force = ["0 N", "0 N", "30 mN"] },
  { time = "9.0 s", at = ["1 mm", "0 mm"], force = ["0 N", "0 N", "30 mN"] },
]
[[outage]]
from = "4 s"
to = "6 s"
"#;

/// What changed while nothing came is no step, impact or slip: nobody saw it.
#[test]
fn no_event_follows_from_frames_that_are_missing() {
    let found = events("three-axis-8x8", MISSING, 400);
    let kinds = kinds_and_times(&found);
    let after = kinds.iter().filter(|(_, _, time)| *time > 3.9);
    let after: Vec<_> = after.map(|(kind, ..)| kind.as_str()).collect();
    assert!(
        after.iter().all(|kind| ["touch", "release"].contains(kind)),
        "{kinds:?}"
    );
    // What came before was seen.
    assert!(kinds.iter().any(|(kind, ..)| kind == "step"), "{kinds:?}");
}

/// A source behind a link that lost three frames; its numbers show more.
struct Counted(TwinSource, LinkHandle);

impl Source for Counted {
    fn stream(&self) -> &Stream {
        self.0.stream()
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        self.0.next()
    }

    fn link(&self) -> Option<LinkHandle> {
        Some(self.1.clone())
    }
}

/// The frame for those who come after the end, with its number and how many were lost before it.
fn last_frame(shared: &Shared) -> [u64; 2] {
    let bytes = shared.status().last_frame.clone().unwrap();
    [8, 24].map(|at| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()))
}

/// How many frames were lost is one number: that of the link, where there is one that can tell, else
/// that of the gaps in the numbers; the same in the summary and in the frames. Whoever comes after the
/// end gets the last frame and the history.
#[test]
fn after_the_end_there_are_the_last_frame_the_history_and_one_count_of_the_lost() {
    let lossy = format!("{MISSING}\n[link]\nlose_every = 10\n");
    for by_link in [false, true] {
        let (twin, session) = twin("three-axis-8x8", &lossy);
        let source = TwinSource::new(twin);
        let source: Box<dyn Source> = if by_link {
            let link = LinkHandle::new("test".into(), "board".into(), 'A');
            link.lock().wire.lost = Some(3);
            Box::new(Counted(source, link))
        } else {
            Box::new(source)
        };
        let shared = Shared::new();
        *shared.history() = History::new(session.meaning());
        let (_sender, commands) = mpsc::sync_channel(1);
        let options = PumpOptions {
            speed: f64::INFINITY,
            frames: Some(200),
            ..PumpOptions::default()
        };
        let pump = Pump::new(source, session, options, shared.clone(), commands).unwrap();
        let summary = pump.run();
        // 200 frames of ten in a row of which one is lost.
        let lost = if by_link { 3 } else { summary.continuity.lost };
        assert_eq!(summary.continuity.lost, 22);
        assert_eq!(summary.lost, Some(lost));
        assert_eq!(
            last_frame(&shared),
            [summary.last.as_ref().unwrap().sequence, lost]
        );
        let last_ns = summary.last.as_ref().unwrap().time_ns;
        let [_, newest_ns] = shared.history().extent_ns().unwrap();
        assert_eq!(newest_ns, last_ns);
    }
}
