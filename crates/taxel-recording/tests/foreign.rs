//! Files that the libraries of other programs wrote (`tests/foreign/write.py` says how) give the
//! numbers that went into them.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use taxel_recording::foreign::{ForeignFile, Seekable};
use taxel_recording::mcap::{
    ContactMessage, McapReader, McapWriter, RecordingHead, Ros2Messages, TouchMessage,
    write_accompanied,
};
use taxel_recording::{
    Columns, ForeignFormat, Frame, Quantity, Recording, RecordingError, RecordingOptions, Stream,
};

/// Rows of every series, as in `write.py`.
const ROWS: usize = 40;
/// Time of the first row, ns of UTC.
const BEGIN: u64 = 1_700_000_000_000_000_000;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign")
}

/// Stamp of a row, ns; messages were recorded 500 ns later.
fn stamp(row: usize) -> u64 {
    BEGIN + row as u64 * 10_000_000 + (row as u64 % 3) * 1000
}

/// A force that went into the files, N.
fn force(row: usize) -> [f64; 3] {
    let at = row as f64;
    [(at / 9.0).sin(), (at / 7.0).cos(), at * 0.25]
}

/// An element of the map that went into the files.
fn map(row: usize) -> Vec<f64> {
    (0..12).map(|at| (row * 12 + at) as f64).collect()
}

fn opened(name: &str) -> Result<ForeignFile, RecordingError> {
    let path = folder().join(name);
    let paths = if path.is_dir() {
        let files = fs::read_dir(&path)
            .unwrap()
            .map(|entry| entry.unwrap().path());
        files
            .filter(|path| path.extension().unwrap() != "yaml")
            .collect()
    } else {
        vec![path]
    };
    let bytes: Vec<_> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
    let format = ForeignFormat::of(&bytes[0]).unwrap();
    let files = bytes.into_iter().map(|bytes| {
        let reader: Box<dyn Seekable> = Box::new(Cursor::new(bytes));
        (name.to_owned(), reader)
    });
    ForeignFile::open(name, format, files.collect())
}

fn options(part: &str, columns: &str) -> RecordingOptions {
    RecordingOptions {
        part: (!part.is_empty()).then(|| part.to_owned()),
        columns: if columns.is_empty() {
            Columns::default()
        } else {
            columns.parse().unwrap()
        },
        ..RecordingOptions::default()
    }
}

fn recording(
    name: &str,
    part: &str,
    columns: &str,
) -> Result<Recording<&'static [u8]>, RecordingError> {
    Recording::of_foreign(opened(name)?, &options(part, columns))
}

fn read(name: &str, part: &str, columns: &str) -> (Stream, Vec<Frame>, String) {
    let recording =
        recording(name, part, columns).unwrap_or_else(|error| panic!("{name}: {error}"));
    let stream = recording.stream().clone();
    let taken = recording.taken().unwrap().to_string();
    let frames: Vec<Frame> = recording
        .map(|frame| frame.unwrap_or_else(|error| panic!("{name}: {error}")))
        .collect();
    assert_eq!(frames.len(), ROWS, "{name}");
    (stream, frames, taken)
}

fn refusal(name: &str, part: &str, columns: &str) -> String {
    recording(name, part, columns)
        .map(|_| ())
        .unwrap_err()
        .to_string()
}

#[test]
fn a_wrench_is_a_force_of_three_axes_at_the_stamp_of_its_head() {
    let bags = ["bag_sqlite", "bag_sqlite_old", "bag_mcap"];
    let alone = [
        "bag_one",
        "lib_none.mcap",
        "lib_lz4.mcap",
        "lib_zstd.mcap",
        "ros1_none.bag",
        "ros1_lz4.bag",
        "ros1_bz2.bag",
    ];
    let all = bags
        .map(|name| (name, "/wrench"))
        .into_iter()
        .chain(alone.map(|name| (name, "")));
    for (name, part) in all {
        let (stream, frames, taken) = read(name, part, "");
        assert_eq!(
            (stream.rows, stream.columns, stream.channels_per_taxel),
            (1, 1, 3),
            "{name}"
        );
        assert_eq!(stream.unit.quantity, Quantity::Force);
        for (row, frame) in frames.iter().enumerate() {
            assert_eq!(
                (frame.time_ns, frame.values.as_slice()),
                (stamp(row), &force(row)[..]),
                "{name}"
            );
        }
        assert!(
            taken.contains("wrench.torque.x") && taken.contains("stamp in the head"),
            "{taken}"
        );
    }
}

#[test]
fn any_message_is_read_by_the_text_of_its_definition() {
    for name in ["bag_sqlite", "bag_mcap"] {
        let (stream, frames, _) = read(name, "/skin", "value=cells[0]..cells[3],ignore=kind");
        assert_eq!((stream.rows, stream.columns), (1, 4));
        assert_eq!(frames[7].values, [7.0, 1.0, 2.0, 3.0]);
        let (_, frames, _) = read(name, "/skin", "");
        let [x, y, z] = force(7);
        // In the order of the definition: kind, cells, raw, forces, on, ticks.
        let expected = [
            3.0, 7.0, 1.0, 2.0, 3.0, 7.0, 8.0, 7.0, x, y, z, 1.0, 2.0, 3.0, 1.0, -7.0,
        ];
        assert_eq!(frames[7].values, expected);
        let (stream, frames, taken) = read(name, "/multi", "");
        assert_eq!((stream.rows, stream.columns), (2, 3));
        assert_eq!(frames[5].values, [5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        assert_eq!(frames[5].time_ns, stamp(5) + 500);
        assert!(taken.contains("no stamp of its own"), "{taken}");
        let (_, frames, _) = read(name, "/joints", "value=effort.b,position.a");
        // In the order of the message.
        assert_eq!(frames[9].values, [9.0, 4.5]);
        let (stream, frames, _) = read(name, "/image", "");
        assert_eq!((stream.rows, stream.columns), (3, 4));
        assert_eq!(frames[2].values, (2..14).map(f64::from).collect::<Vec<_>>());
    }
}

/// Each field of the points is a map, by its name.
#[test]
fn fields_of_point_clouds_are_named_channels() {
    for name in ["bag_points", "bag_points_old"] {
        let (stream, frames, _) = read(name, "/points", "value=f[1].r0c0..f[1].r1c2");
        assert_eq!((stream.rows, stream.columns), (1, 6));
        // The field `f` has two numbers: the row, and 3 + 10 x row + column.
        let (_, all, _) = read(name, "/points", "");
        assert_eq!(all[3].values.len(), 24);
        assert_eq!(all[3].values[..6], [0.0, 0.5, 1.0, 0.0, 0.5, 1.0]);
        assert_eq!(all[3].values[6..12], [3.0; 6]);
        assert_eq!(all[3].values[12..18], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let second = [3.0, 4.0, 5.0, 13.0, 14.0, 15.0];
        assert_eq!(all[3].values[18..], second);
        assert_eq!(frames[3].values, second);
        assert_eq!(frames[3].time_ns, stamp(3));
    }
}

#[test]
fn arrays_of_matlab_4_are_read_in_both_orders_of_bytes() {
    for (name, scale) in [("v4.mat", 1.5), ("v4_big.mat", 1.0)] {
        let (_, frames, _) = read(name, "small", "");
        assert_eq!(frames[7].values, [14.0 * scale, 15.0 * scale], "{name}");
        assert_eq!(frames[7].time_ns, 70_000_000, "{name}");
    }
    assert!(refusal("v4.mat", "name", "").contains("text"));
    assert!(refusal("v4.mat", "z", "").contains("complex"));
}

#[test]
fn a_file_lists_what_it_holds_and_asks_for_one_of_several() {
    let found = opened("bag_mcap").unwrap();
    let parts: Vec<_> = found
        .parts()
        .iter()
        .map(|part| (part.name.as_str(), part.count, part.unread.is_some()))
        .collect();
    let rows = ROWS as u64;
    assert_eq!(
        parts,
        [
            ("/wrench", rows, false),
            ("/skin", rows, false),
            ("/multi", rows, false),
            ("/joints", rows, false),
            ("/image", rows, false),
            ("/text", rows, true)
        ]
    );
    // Rows of 10 ms, and up to 2 us.
    assert!((found.parts()[0].rate.unwrap() - 100.0).abs() < 0.01);
    assert!(refusal("bag_mcap", "", "").contains("--part"));
    assert!(refusal("bag_mcap", "/none", "").contains("/wrench"));
    assert!(
        refusal("bag_one", "", "value=wrench.force.x,wrench.torque.x")
            .contains("different quantities")
    );
    assert!(refusal("bag_one", "", "value=wrench.force.w").contains("no column"));
}

#[test]
fn a_stream_of_the_lab_layer_has_its_clock_offsets() {
    let (stream, frames, taken) = read("lab.xdf", "Force", "");
    assert_eq!((stream.columns, stream.unit.quantity), (3, Quantity::Force));
    // Times and values as pyxdf reads them without its smoothing of times.
    let expected = fs::read_to_string(folder().join("lab_expected.csv")).unwrap();
    for (frame, line) in frames.iter().zip(expected.lines()) {
        let numbers: Vec<f64> = line
            .split(',')
            .map(|number| number.parse().unwrap())
            .collect();
        // pyxdf fits a line that is robust; both are exact here but for the rounding of times of
        // 5000 s in doubles, 1e-12 s, through a fit of a slope of 1e-5.
        assert!(
            (frame.time_ns as f64 * 1e-9 - numbers[0]).abs() < 2e-9,
            "{frame:?} {line}"
        );
        assert_eq!(frame.values, numbers[1..]);
    }
    assert!(taken.contains("clock offsets"), "{taken}");
    assert!(refusal("lab.xdf", "Marks", "").contains("no numbers"));
}

#[test]
fn arrays_are_maps_with_their_times() {
    for (name, part) in [
        ("maps.npz", ""),
        ("maps_z.npz", ""),
        ("maps_earliest.h5", ""),
        ("maps_latest.h5", ""),
        ("lzf.h5", ""),
        ("v5.mat", "maps"),
        ("v7.mat", "maps"),
    ] {
        let (stream, frames, taken) = read(name, part, "");
        assert_eq!((stream.rows, stream.columns), (3, 4), "{taken}");
        for (row, frame) in frames.iter().enumerate() {
            assert_eq!(
                (frame.time_ns, &frame.values),
                (row as u64 * 10_000_000, &map(row)),
                "{name}"
            );
        }
        let (_, frames, _) = read(name, part, "rate=50 Hz");
        assert_eq!(frames[3].time_ns, 60_000_000);
    }
    for name in ["v5.mat", "v7.mat"] {
        let (_, frames, _) = read(name, "small", "");
        assert_eq!(frames[7].values, [14.0, 15.0]);
        assert!(refusal(name, "name", "").contains("text"));
        assert!(refusal(name, "cells", "").contains("cells"));
        assert!(refusal(name, "z", "").contains("complex"));
    }
    for name in ["plain.npy", "fortran.npy", "plain.h5", "userblock.mat"] {
        let (_, frames, taken) = read(name, "", "");
        // The Unix times of `plain.h5` are doubles of seconds, whole to 0.24 us.
        let time = if name == "plain.h5" {
            stamp(8)
        } else {
            80_000_000
        };
        assert!(frames[8].time_ns.abs_diff(time) <= 240, "{name} {taken}");
        assert_eq!(frames[8].values, force(8), "{name} {taken}");
    }
    let (_, frames, _) = read("big.npy", "", "time=1[s]");
    assert_eq!(
        frames[8].values,
        force(8).map(|value| f64::from(value as f32))
    );
    for name in ["struct.npy", "compound.h5"] {
        let (_, frames, taken) = read(name, "", "value=p[0]..n");
        // Stamps are whole microseconds here.
        assert_eq!(frames[8].time_ns, stamp(8) / 1000 * 1000, "{taken}");
        assert_eq!(frames[8].values, [32.0, 33.0, 34.0, 35.0, 3.0]);
    }
    for name in ["series.npz", "series.h5"] {
        let (_, frames, taken) = read(name, "", "");
        assert_eq!(frames[8].time_ns, 80_000_000, "{taken}");
        assert_eq!(frames[8].values[..2], force(8)[..2]);
    }
    let (_, frames, taken) = read("grow.h5", "v", "");
    // Whole numbers beyond 2^53 are rounded to 256.
    assert!(frames[8].time_ns.abs_diff(stamp(8)) <= 256, "{taken}");
    assert_eq!(frames[8].values, [40.0, 41.0, 42.0, 43.0, 44.0]);
    let (_, frames, _) = read("two.npz", "right", "");
    assert_eq!(frames[1].values[1], 26.0);
    assert!(refusal("two.npz", "", "").contains("left, right"));
}

/// Each index of the chunks that `libver="latest"` writes; one that grows along two axes is refused with
/// its remedy.
#[test]
fn chunks_are_found_by_the_newer_indices() {
    let frames = |part: &str| -> Vec<Frame> {
        let found = recording("latest.h5", part, "rate=100 Hz").unwrap();
        found.collect::<Result<_, _>>().unwrap()
    };
    let values = frames("pages").into_iter().map(|frame| frame.values[0]);
    assert!(values.eq((0..1100).map(f64::from)));
    let frames = frames("grow");
    assert_eq!(frames.len(), 600);
    for (row, frame) in (0_u32..).zip(&frames) {
        let first = 3 * row;
        let expected = [first, first + 1, first + 2].map(f64::from);
        assert_eq!(frame.values, expected);
    }
    let (_, frames, _) = read("latest.h5", "plain", "");
    let maps = frames.iter().map(|frame| frame.values.clone());
    assert!(maps.eq((0..ROWS).map(map)));
    assert!(refusal("latest.h5", "both", "").contains("h5repack"));
}

/// Every beginning of every file gives frames of the whole one or a refusal, and so does every
/// file with damaged bytes: nothing ends the program.
#[test]
fn files_that_are_cut_or_damaged_end_nothing() {
    let entries = fs::read_dir(folder()).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| {
            ForeignFormat::of(&fs::read(folder().join(name)).unwrap_or_default()).is_some()
        })
        .chain(["bag_one/bag_one.mcap", "bag_sqlite_old/bag_sqlite_old.db3"].map(str::to_owned))
        .collect();
    names.sort();
    assert!(names.len() > 20, "{names:?}");
    let mut state = 1_u64;
    let mut random = move |below: usize| {
        // The generator of Knuth's MMIX.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for name in &names {
        let name = name.as_str();
        let began = std::time::Instant::now();
        let whole = fs::read(folder().join(name)).unwrap();
        let format = ForeignFormat::of(&whole).unwrap();
        let frames_of = |bytes: Vec<u8>| {
            let files: Vec<(String, Box<dyn Seekable>)> =
                vec![(name.to_owned(), Box::new(Cursor::new(bytes)))];
            let found = ForeignFile::open(name, format, files).ok()?;
            let part = found
                .parts()
                .iter()
                .find(|part| part.unread.is_none())?
                .name
                .clone();
            let recording: Recording<&[u8]> =
                Recording::of_foreign(found, &options(&part, "")).ok()?;
            Some(
                recording
                    .map_while(Result::ok)
                    .take(2 * ROWS)
                    .collect::<Vec<_>>(),
            )
        };
        let all = frames_of(whole.clone());
        for _ in 0..60 {
            let cut = whole[..random(whole.len())].to_vec();
            if let (Some(all), Some(some)) = (&all, frames_of(cut)) {
                assert!(some.len() <= all.len(), "{name}");
                // Of what has its times elsewhere in the file, these may be cut.
                let is_bag = ["mcap", "db3", "bag"]
                    .iter()
                    .any(|ending| name.ends_with(ending));
                assert!(
                    !is_bag || some.iter().zip(all).all(|(some, all)| some == all),
                    "{name}"
                );
            }
            let mut damaged = whole.clone();
            for _ in 0..=random(8) {
                // Heads are hit as often as all the rest.
                let reach = if random(2) == 0 {
                    whole.len()
                } else {
                    whole.len().min(600)
                };
                damaged[random(reach)] = random(256) as u8;
            }
            if random(3) == 0 {
                // Longer, by bytes of its own or of nothing.
                let from = random(whole.len());
                damaged.extend_from_slice(&whole[from..]);
                damaged.resize(damaged.len() + random(5000), 0);
            }
            drop(frames_of(damaged));
        }
        // A file takes some ms: 120 of them on a busy machine less than this, one that hangs more.
        let taken = began.elapsed();
        assert!(taken.as_secs() < 60, "{name}: {taken:?}");
    }
}

/// What files of others hold, in the folder that the variable TAXEL_FOREIGN names:
/// `TAXEL_FOREIGN=FOLDER cargo test -p taxel-recording --test foreign -- --ignored --nocapture`.
#[test]
#[ignore = "needs files of others"]
#[allow(clippy::print_stdout)]
fn files_of_others_are_listed_and_read() {
    let folder = std::env::var("TAXEL_FOREIGN").unwrap();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.to_str().unwrap().to_owned();
        let bytes = fs::read(&path).unwrap();
        let Some(format) = ForeignFormat::of(&bytes) else {
            continue;
        };
        let open = || {
            let reader: Box<dyn Seekable> = Box::new(Cursor::new(bytes.clone()));
            ForeignFile::open(&name, format, vec![(name.clone(), reader)])
        };
        println!("{name}: {format}");
        let found = match open() {
            Ok(found) => found,
            Err(error) => {
                println!("  {error}");
                continue;
            }
        };
        for part in found.parts() {
            println!("  {part:?}");
            let recording = Recording::of_foreign(open().unwrap(), &options(&part.name, ""));
            match recording {
                Err(error) => println!("    {}", error.to_string().lines().next().unwrap()),
                Ok(recording) => {
                    let recording: Recording<&[u8]> = recording;
                    println!("    {}", recording.taken().unwrap());
                    let (frames, errors): (Vec<_>, Vec<_>) = recording.partition(Result::is_ok);
                    let times: Vec<u64> =
                        frames.iter().flatten().map(|frame| frame.time_ns).collect();
                    println!(
                        "    {} frames, {:?} to {:?}, {errors:?}",
                        frames.len(),
                        times.first(),
                        times.last()
                    );
                }
            }
        }
    }
}

/// Read again by what reads bags of others.
#[test]
fn standard_messages_are_those_of_any_bag() {
    let mut writer = McapWriter::new(Vec::new(), &RecordingHead::default()).unwrap();
    let contact = ContactMessage {
        id: 3,
        centre: [0.001, -0.002],
        force: [0.25, 0.0, 1.5],
        ..ContactMessage::default()
    };
    let touch = |sequence: u64| TouchMessage {
        sequence,
        components: 3,
        values: (0..18).map(|value| value as f32).collect(),
        force: [1.0, 2.0, 3.5],
        contacts: vec![contact.clone()],
        ..TouchMessage::default()
    };
    for sequence in 0..4 {
        writer
            .message(1_000_000_000 + 10_000_000 * sequence, &touch(sequence))
            .unwrap();
    }
    let file = writer.finish().unwrap();
    let mut bag = Vec::new();
    let standard = Ros2Messages { columns: 3 };
    let reader = McapReader::new(&*file);
    let frames = write_accompanied(reader, &standard, "a test", &mut bag).unwrap();
    assert_eq!(frames, 4);
    let read = |part: &str, columns: Columns| {
        let files = vec![(
            "bag.mcap".to_owned(),
            Box::new(Cursor::new(bag.clone())) as _,
        )];
        let found = ForeignFile::open("bag.mcap", ForeignFormat::Mcap, files).unwrap();
        let options = RecordingOptions {
            part: Some(part.into()),
            columns,
            ..RecordingOptions::default()
        };
        let recording: Recording<&[u8]> = Recording::of_foreign(found, &options).unwrap();
        let stream = recording.stream().clone();
        let frames: Vec<_> = recording.map(Result::unwrap).collect();
        (stream, frames)
    };
    let (_, frames) = read("/taxel/wrench", Columns::default());
    assert_eq!((frames.len(), frames[2].time_ns), (4, 1_020_000_000));
    assert_eq!(frames[2].values, [1.0, 2.0, -3.5]);
    let (stream, frames) = read("/taxel/image", Columns::default());
    assert_eq!(
        (stream.rows, stream.columns, stream.channels_per_taxel),
        (2, 3, 3)
    );
    assert_eq!(frames[0].values, (0..18).map(f64::from).collect::<Vec<_>>());
    let (_, frames) = read("/taxel/contacts", "value=force_z.r0c0".parse().unwrap());
    assert_eq!(frames[3].values, [1.5]);
}
