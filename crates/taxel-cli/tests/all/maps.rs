//! Maps of pressure: what is a contact on recordings of maps, and what a user may show.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{Folder, done, refused, taxel};
use serde_json::Value;
use taxel::acquisition::{Frame, Stream};
use taxel::estimation::{MOST_CONTACTS, MapOptions, TouchEventKind, TouchSession};
use taxel_recording::RecordingOptions;
use taxel_serve::{Next, ReplaySource, Source as _, Survey};

#[path = "../../../taxel-recording/examples/samples/recordings/mod.rs"]
mod samples;
use samples::{tekscan, xsensor};

/// A sample in the format of a vendor.
fn recording(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../taxel-recording/tests/recordings")
        .join(name)
}

/// A session of a recording, as the program has it, and its frames.
fn session(path: &Path, all_events: bool) -> (TouchSession, Stream, Vec<Frame>) {
    let open = || ReplaySource::open(path, &RecordingOptions::default()).unwrap();
    let (survey, end) = Survey::of(open());
    end.unwrap();
    let mut source = open().paced(&survey);
    let stream = source.stream().clone();
    let mut frames = Vec::new();
    while let Next::Frame(frame) = source.next().unwrap() {
        frames.push(frame);
    }
    let noise = survey.noise;
    let session = TouchSession::map(
        &stream,
        &MapOptions {
            noise,
            all_events,
            ..MapOptions::default()
        },
    );
    (session, stream, frames)
}

/// Regions above zero that hang together by sides or corners.
fn connected(stream: &Stream, values: &[f64]) -> usize {
    let mut open: Vec<bool> = values.iter().map(|value| *value > 0.0).collect();
    let mut regions = 0;
    for start in 0..values.len() {
        if !open[start] {
            continue;
        }
        regions += 1;
        let mut next = vec![start];
        open[start] = false;
        while let Some(at) = next.pop() {
            let (row, column) = (at / stream.columns, at % stream.columns);
            for r in row.saturating_sub(1)..=(row + 1).min(stream.rows - 1) {
                for c in column.saturating_sub(1)..=(column + 1).min(stream.columns - 1) {
                    if std::mem::take(&mut open[r * stream.columns + c]) {
                        next.push(r * stream.columns + c);
                    }
                }
            }
        }
    }
    regions
}

#[test]
fn a_fingertip_is_one_contact() {
    // Its second touch has a hole in it, and three sensels around it are stuck at 5 counts.
    let (mut session, stream, frames) = session(&recording("fingertip.csv"), false);
    let pitch = stream.pitch.unwrap();
    let mut ids = Vec::new();
    for frame in &frames {
        let truth = tekscan::finger(frame.time_ns as f64 * 1e-9);
        let observed = session.push(frame).unwrap();
        let contacts = &observed.touch.contacts;
        // A touch may be light where it lands and leaves.
        let most = usize::from(truth.force > 0.0);
        let least = usize::from(truth.force > 1.0);
        assert!(
            (least..=most).contains(&contacts.len()),
            "frame {}: {contacts:?}",
            frame.sequence
        );
        if let [contact] = contacts[..] {
            let [x, y] = contact.centre;
            // Rows go down from the middle of the map; the hole and the rim are less than half a sensel.
            let found = [14.0 - y / pitch[0], 14.0 + x / pitch[1]];
            for (found, truth) in found.iter().zip(truth.centre) {
                assert!((found - truth / pitch[0]).abs() < 0.5, "{contact:?}");
            }
        }
        ids.extend(session.observer().tracks().iter().map(|track| track.id));
    }
    ids.dedup();
    assert_eq!(ids, [1, 2]);
}

#[test]
fn a_walking_foot_has_no_more_contacts_than_regions_and_no_slips() {
    let path = recording("foot.asf");
    let (mut told, stream, frames) = session(&path, false);
    let mut kinds = Vec::new();
    for frame in &frames {
        let observed = told.push(frame).unwrap();
        let (contacts, regions) = (
            observed.touch.contacts.len(),
            connected(&stream, &frame.values),
        );
        assert!(
            contacts <= regions,
            "frame {}: {contacts} of {regions}",
            frame.sequence
        );
        kinds.extend(observed.events.iter().map(|event| event.kind.name()));
    }
    for kind in &kinds {
        assert!(
            ["touch", "release", "split", "merged"].contains(kind),
            "{kind}"
        );
    }
    // Whoever asks for them gets them.
    let (mut asked, _, frames) = session(&path, true);
    let slips = |kind: &TouchEventKind| matches!(kind, TouchEventKind::Slip { .. });
    let mut found = 0;
    for frame in &frames {
        let events = asked.push(frame).unwrap().events;
        found += events.iter().filter(|event| slips(&event.kind)).count();
    }
    assert!(found > 0);
}

/// A recording of a map of `side` x `side` sensels.
fn map(head: &str, side: usize, unit: &str, frames: &[&dyn Fn(usize) -> f64]) -> String {
    let cells = side * side;
    let title = |at: usize| format!("r{}c{} [{unit}]", at / side, at % side);
    let titles: Vec<String> = (0..cells).map(title).collect();
    let mut text = format!("{head}time [ms],{}\n", titles.join(","));
    for (number, value) in frames.iter().enumerate() {
        let values: Vec<String> = (0..cells).map(|at| value(at).to_string()).collect();
        let _ = writeln!(text, "{},{}", 5 * number, values.join(","));
    }
    text
}

/// A run over a recording that must end well: its summary and its messages.
fn told(path: &str, more: &[&str]) -> (Value, String) {
    let source = format!("replay:{path}");
    let run = "live --headless --speed max --format json --source";
    let run: Vec<&str> = run.split(' ').chain([source.as_str()]).collect();
    let output = taxel(&[&run[..], more].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let summary = serde_json::from_slice(&output.stdout).unwrap();
    (summary, String::from_utf8(output.stderr).unwrap())
}

fn play(path: &str, more: &[&str]) -> Value {
    told(path, more).0
}

#[test]
fn contacts_of_a_frame_are_bounded_and_it_is_said() {
    let folder = Folder::new("bounded");
    let path = folder.path("many.csv");
    let peaks = |at: usize| {
        if (at / 64).is_multiple_of(3) && at.is_multiple_of(3) {
            9.0 + (at % 7) as f64
        } else {
            0.0
        }
    };
    fs::write(&path, map("", 64, "kPa", &[&peaks as _; 12])).unwrap();
    let (summary, told) = told(&path, &[]);
    assert_eq!(summary["last_contacts"], MOST_CONTACTS);
    assert_eq!(summary["merged_frames"], 12);
    assert!(
        told.contains("in 12 frames more than 64 regions stand out"),
        "{told}"
    );
}

#[test]
fn a_map_with_a_pitch_has_a_force_and_is_tared() {
    let folder = Folder::new("pitch");
    let path = folder.path("map.csv");
    // 2 kPa everywhere, then 3 kPa more on four sensels of 5 x 4 mm: 0.24 N.
    let rest = |_: usize| 2.0;
    let pressed = |at: usize| if [0, 1, 8, 9].contains(&at) { 5.0 } else { 2.0 };
    let frames: Vec<&dyn Fn(usize) -> f64> = (0..70)
        .map(|at| if at < 60 { &rest as _ } else { &pressed as _ })
        .collect();
    fs::write(&path, map("# pitch = 5 mm x 4 mm\n", 8, "kPa", &frames)).unwrap();
    let force = |summary: &Value| summary["last_force_n"][2].as_f64();
    // As it is: 64 sensels of 2 kPa more.
    let near = |found: Option<f64>, newtons: f64| (found.unwrap() - newtons).abs() < 1e-12;
    assert!(near(force(&play(&path, &[])), 2.56 + 0.24));
    let tared = play(&path, &["--tare"]);
    assert!(near(force(&tared), 0.24));
    assert_eq!(tared["last_contacts"], 1);
    // The rest of an earlier recording, which the program wrote.
    let empty = folder.path("empty.csv");
    play(&path, &["--frames", "60", "--save", &empty]);
    assert!(
        fs::read_to_string(&empty)
            .unwrap()
            .contains("# pitch = 5 mm x 4 mm\n")
    );
    assert!(near(force(&play(&path, &["--rest", &empty])), 0.24));
    // Counts become pressures by a line, and forces stand for themselves.
    fs::write(
        &path,
        map("# pitch = 5 mm\n# unit = 0.5 kPa\n", 8, "counts", &frames),
    )
    .unwrap();
    assert!(near(force(&play(&path, &["--tare"])), 4.0 * 1.5e3 * 25e-6));
    fs::write(&path, map("# quantity = force\n", 8, "mN", &frames)).unwrap();
    assert!(near(force(&play(&path, &["--tare"])), 12e-3));
    fs::write(&path, map("# pitch = 5\n", 8, "kPa", &frames)).unwrap();
    let message = refused(&["live", "--headless", "--source", &format!("replay:{path}")]);
    assert!(
        message.contains("map.csv:1:") && message.contains("such as `1.27 mm`"),
        "{message}"
    );
}

#[test]
fn channels_are_shown_raw_without_their_sensor() {
    let folder = Folder::new("raw");
    // Counts of an array that the program does not know: a bare map, tared at its start.
    let counts = folder.path("counts.csv");
    let scatter = |at: usize| 300.0 + at as f64;
    let pressed = |at: usize| if at == 27 { 400.0 } else { 300.0 + at as f64 };
    let frames: Vec<&dyn Fn(usize) -> f64> = (0..70)
        .map(|at| {
            if at < 60 {
                &scatter as _
            } else {
                &pressed as _
            }
        })
        .collect();
    fs::write(&counts, map("", 8, "counts", &frames)).unwrap();
    let summary = play(&counts, &[]);
    assert_eq!(
        (&summary["columns"], &summary["tare"]),
        (&Value::from(8), &Value::from("done"))
    );
    assert_eq!(
        (&summary["last_sum_si"], &summary["last_contacts"]),
        (&Value::from(73.0), &Value::from(1))
    );
    // Named with a sensor they are its counts, and --raw shows them all the same.
    let source = format!("replay:{counts}");
    let message = refused(&["live", "in-plane-50um", "--headless", "--source", &source]);
    assert!(message.contains("does not fit"), "{message}");
    assert_eq!(play(&counts, &["--raw"])["columns"], 8);
    // Four capacitors of a unit, a device that was not calibrated, the twin.
    let unit = folder.path("unit.csv");
    done(&[
        "live",
        "three-axis-unit",
        "--headless",
        "--speed",
        "max",
        "--frames",
        "60",
        "--save",
        &unit,
    ]);
    assert_eq!(play(&unit, &["--raw"])["columns"], 4);
    let bare = folder.path("bare.csv");
    let row = |row: i32| format!("{},1,2,{}", 0.01 * f64::from(row), row % 3);
    let rows: Vec<String> = (0..60).map(row).collect();
    fs::write(&bare, rows.join("\n")).unwrap();
    assert_eq!(play(&bare, &["--raw"])["channels"], 3);
    // A map of pressure is as it is: that is said, and nothing else changes.
    let pressures = folder.path("pressures.csv");
    fs::write(&pressures, map("", 8, "kPa", &frames)).unwrap();
    let [(plain, without), (raw, with)] = [&[][..], &["--raw"]].map(|more| {
        let (mut summary, told) = told(&pressures, more);
        // What took time took another time.
        for key in ["duration_s", "rate_hz", "latency_s"] {
            summary.as_object_mut().unwrap().remove(key);
        }
        (summary, told)
    });
    assert_eq!(plain, raw);
    let note = "note: --raw changes nothing: the frames are a map in kPa";
    assert!(with.contains(note) && !without.contains(note), "{with}");
    let twin = [
        "live",
        "--raw",
        "--headless",
        "--speed",
        "max",
        "--frames",
        "60",
    ];
    assert!(done(&twin).contains("channels                 256"));
    let message = refused(&["live", "--raw", "--calibration", "c.toml"]);
    assert!(message.contains("cannot be used with"), "{message}");
}

#[test]
fn each_sensor_of_a_recording_of_two_can_be_played() {
    let path = recording("insoles.csv");
    let path = path.to_str().unwrap();
    let name = |more: &[&str]| play(path, more)["name"].as_str().unwrap().to_owned();
    let [left, right] = xsensor::NAMES;
    assert_eq!(name(&[]), left);
    assert_eq!(name(&["--part", "1"]), left);
    assert_eq!(name(&["--part", "2"]), right);
    assert_eq!(name(&["--part", right]), right);
    let source = format!("replay:{path}");
    let output = taxel(&["live", "--headless", "--speed", "max", "--source", &source]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        told.contains("has 2 sensors") && told.contains("--part"),
        "{told}"
    );
    let message = refused(&["live", "--headless", "--source", &source, "--part", "3"]);
    assert!(
        message.contains("no sensor `3`") && message.contains(right),
        "{message}"
    );
}
