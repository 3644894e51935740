//! Recordings: samples whose touch is known, cut and damaged ones, and our own format.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;

use proptest::prelude::*;
use taxel_recording::{ChannelWriter, Format, Recording, RecordingError, RecordingOptions};
use taxel_recording::{Frame, Quantity, SignalUnit, Stream};

const ISCAN: &str = include_str!("recordings/fingertip.csv");
const FSCAN: &str = include_str!("recordings/foot.asf");
const XSENSOR: &str = include_str!("recordings/insoles.csv");

#[path = "../examples/samples/recordings/mod.rs"]
mod samples;
use samples::{lattice, tekscan, xsensor, xsensor::MMHG};

fn open(text: &str) -> Recording<&[u8]> {
    Recording::open("test", text.as_bytes()).unwrap()
}

fn frames(text: &str) -> Vec<Frame> {
    open(text).collect::<Result<_, _>>().unwrap()
}

/// Frames before the end or the first error, and that error.
fn read_on(bytes: &[u8]) -> (Vec<Frame>, Option<RecordingError>) {
    let recording = match Recording::open("test", bytes) {
        Ok(recording) => recording,
        Err(error) => return (Vec::new(), Some(error)),
    };
    let mut frames = Vec::new();
    for frame in recording {
        match frame {
            Ok(frame) => frames.push(frame),
            Err(error) => return (frames, Some(error)),
        }
    }
    (frames, None)
}

/// The same bits, so that `NaN` equals `NaN`.
fn same(one: &Frame, other: &Frame) -> bool {
    let bits = |frame: &Frame| -> Vec<u64> { frame.values.iter().map(|v| v.to_bits()).collect() };
    (one.sequence, one.time_ns) == (other.sequence, other.time_ns) && bits(one) == bits(other)
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    let distance = (found - expected).abs();
    assert!(distance <= tolerance, "{found} is not {expected}");
}

#[test]
fn the_committed_samples_are_what_the_generator_writes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings");
    for (name, text) in samples::all() {
        let committed = fs::read_to_string(folder.join(name)).unwrap();
        // Not `assert_eq`: it would print both files.
        assert!(committed == text, "{name}: write it again (see its README)");
    }
}

#[test]
fn iscan_has_the_shape_its_header_states() {
    let recording = open(ISCAN);
    assert_eq!(recording.format(), Format::Tekscan);
    let stream = recording.stream().clone();
    assert_eq!(
        (stream.rows, stream.columns, stream.channels_per_taxel),
        (28, 28, 1)
    );
    assert_eq!(
        (stream.unit.quantity, stream.unit.symbol.as_str()),
        (Quantity::Raw, "raw")
    );
    // 0.127 cm, one rounding.
    assert_close(stream.pitch.unwrap()[0], tekscan::FINGER_PITCH, 1e-18);
    assert_close(stream.pitch.unwrap()[1], tekscan::FINGER_PITCH, 1e-18);
    assert_eq!((stream.period, stream.threshold), (Some(0.1), Some(3.0)));
    for (at, &present) in stream.present.iter().enumerate() {
        assert_eq!(present, tekscan::finger_has(at / 28, at % 28), "{at}");
    }
    let frames: Vec<_> = recording.map(Result::unwrap).collect();
    assert_eq!(frames.len(), tekscan::FINGER_FRAMES);
    for (number, frame) in frames.iter().enumerate() {
        // The frame line holds, not the stated period.
        let centiseconds = (100.0 * tekscan::finger_time(number)).round() as u64;
        assert_eq!(
            (frame.sequence, frame.time_ns),
            (number as u64 + 1, 10_000_000 * centiseconds)
        );
        for [row, column] in tekscan::STUCK {
            let above = frame.values[row * 28 + column] - tekscan::STUCK_READING;
            assert!([0.0, 1.0, 2.0].contains(&above), "{above}");
        }
        for (value, &present) in frame.values.iter().zip(&stream.present) {
            assert_eq!(value.is_nan(), !present);
        }
    }
    assert_eq!(frames[59].time_ns, 5_960_000_000);
}

/// Sum of all readings of each frame that the file itself states.
fn raw_sums(text: &str) -> Vec<f64> {
    text.lines()
        .filter(|line| line.starts_with("Frame "))
        .map(|line| line.rsplit(',').next().unwrap().parse().unwrap())
        .collect()
}

#[test]
fn iscan_frames_add_up_to_the_sums_in_the_file() {
    let sum = |frame: &Frame| -> f64 { frame.values.iter().filter(|value| !value.is_nan()).sum() };
    let sums: Vec<_> = frames(ISCAN).iter().map(sum).collect();
    // Whole numbers: exact.
    assert_eq!(sums, raw_sums(ISCAN));
}

/// Force (in units of readings on an area of one sensel) and middle (in sensels) of the readings that `counts`.
fn load(stream: &Stream, frame: &Frame, counts: impl Fn([usize; 2]) -> bool) -> (f64, [f64; 2]) {
    let (mut sum, mut moments) = (0.0, [0.0; 2]);
    for (at, value) in frame.values.iter().enumerate() {
        let cell = [at / stream.columns, at % stream.columns];
        if counts(cell) && !value.is_nan() {
            sum += value;
            for axis in 0..2 {
                moments[axis] += value * (cell[axis] as f64 + 0.5);
            }
        }
    }
    (sum, moments.map(|moment| moment / sum))
}

/// The pressure at 8 x 8 points of each sensel adds up to the force within this share: the points are at most an 18th
/// of a radius apart, and midpoints err by that to the power of 1.5 where the pressure ends like a root.
const OF_POINTS: f64 = 0.013;

#[test]
fn a_fingertip_presses_where_and_as_it_was_pressed() {
    let recording = open(ISCAN);
    let stream = recording.stream().clone();
    let per_count = tekscan::FINGER_FORCE_PER_COUNT;
    let threshold = tekscan::LEAST_COUNTS * per_count / tekscan::FINGER_PITCH.powi(2);
    let mut held = 0;
    for frame in recording.map(Result::unwrap) {
        let truth = tekscan::finger(frame.time_ns as f64 * 1e-9);
        let touch = |cell| !tekscan::STUCK.contains(&cell);
        let (counts, middle) = load(&stream, &frame, touch);
        // The second touch is on the worn sensel.
        if truth.force < 2.0 || frame.time_ns > 4_200_000_000 {
            assert!(truth.force > 0.0 || counts == 0.0);
            continue;
        }
        held += 1;
        let suppressed = samples::below(threshold, &[truth], [28, 28], tekscan::FINGER_PITCH);
        let loaded = frame.values.iter().filter(|value| **value > 0.0).count();
        // Half a count of each, and five deviations of the noise of all.
        let noise = 5.0 * tekscan::FINGER_NOISE * (loaded as f64).sqrt();
        let rounding = (0.5 * loaded as f64 + noise) * per_count;
        let found = counts * per_count + suppressed;
        let tolerance = rounding + OF_POINTS * truth.force;
        assert_close(found, truth.force, tolerance);
        for (found, expected) in middle.iter().zip(truth.centre) {
            // All that is rounded or suppressed on one side of the contact.
            let lever = truth.radius / tekscan::FINGER_PITCH;
            let most = lever * (tolerance + suppressed) / truth.force;
            assert_close(*found, expected / tekscan::FINGER_PITCH, most);
        }
    }
    assert!(held > 20, "{held}");
}

#[test]
fn fscan_readings_are_pascals_and_times_follow_from_frame_numbers() {
    let recording = open(FSCAN);
    let stream = recording.stream().clone();
    assert_eq!([stream.rows, stream.columns], tekscan::FOOT_SHAPE);
    assert_eq!(stream.unit.symbol, "kPa");
    assert_eq!((stream.period, stream.threshold), (Some(0.032), None));
    assert_close(stream.pitch.unwrap()[0], tekscan::FOOT_PITCH, 1e-18);
    let area = tekscan::FOOT_PITCH * tekscan::FOOT_PITCH;
    let frames: Vec<_> = recording.map(Result::unwrap).collect();
    assert_eq!(frames.len(), tekscan::FOOT_FRAMES);
    assert_eq!((frames[0].sequence, frames[0].time_ns), (1, 0));
    assert_eq!((frames[19].sequence, frames[19].time_ns), (20, 608_000_000));
    for (number, frame) in frames.iter().enumerate() {
        for (at, value) in frame.values.iter().enumerate() {
            assert_eq!(value.is_nan(), !tekscan::foot_has(at / 21, at % 21));
            // Whole kilopascals.
            assert!(value.is_nan() || value % 1e3 == 0.0);
        }
        let truth: f64 = tekscan::foot_contacts(number)
            .iter()
            .map(|one| one.force)
            .sum();
        let (pressure, _) = load(&stream, frame, |_| true);
        let loaded = frame.values.iter().filter(|value| **value > 0.0).count();
        // A step of a count on a sensel, of which half is lost, and the kilopascals that are printed.
        let step = tekscan::SATURATION / 255.0;
        let rounding = 0.5 * loaded as f64 * (step + 1e3) * area;
        let contacts = tekscan::foot_contacts(number);
        let threshold = tekscan::LEAST_COUNTS * step;
        let suppressed = samples::below(
            threshold,
            &contacts,
            tekscan::FOOT_SHAPE,
            tekscan::FOOT_PITCH,
        );
        let tolerance = rounding + OF_POINTS * truth;
        assert_close(pressure * area + suppressed, truth, tolerance);
    }
}

#[test]
fn xsensor_delivers_the_sensor_that_is_asked_for() {
    let left = open(XSENSOR);
    assert_eq!(left.format(), Format::Xsensor);
    let names = xsensor::NAMES;
    assert_eq!(left.sensors(), names);
    let stream = left.stream().clone();
    assert_eq!(
        (stream.name.as_str(), [stream.rows, stream.columns]),
        (names[0], xsensor::SHAPE)
    );
    assert_eq!(stream.unit.symbol, "mmHg");
    assert_close(stream.pitch.unwrap()[0], xsensor::PITCH, 1e-17);
    assert_eq!(stream.threshold, Some(xsensor::THRESHOLD * MMHG));
    let right = Recording::open_sensor("x", XSENSOR.as_bytes(), names[1]).unwrap();
    assert_eq!(right.stream().name, names[1]);
    let area = xsensor::PITCH * xsensor::PITCH;
    for (side, recording) in [left, right].into_iter().enumerate() {
        let frames: Vec<_> = recording.map(Result::unwrap).collect();
        let numbers: Vec<_> = frames
            .iter()
            .map(|frame| (frame.sequence, frame.time_ns))
            .collect();
        // 09:59:59.990, 10:00:00.003 and 10:00:00.016.
        assert_eq!(numbers, [(1464, 0), (1465, 13_000_000), (1466, 26_000_000)]);
        for (number, frame) in frames.iter().enumerate() {
            let truth: f64 = xsensor::contacts(side, number)
                .iter()
                .map(|one| one.force)
                .sum();
            let (pressure, _) = load(&stream, frame, |_| true);
            let contacts = xsensor::contacts(side, number);
            let threshold = xsensor::THRESHOLD * MMHG;
            let suppressed = samples::below(threshold, &contacts, xsensor::SHAPE, xsensor::PITCH);
            assert!(truth > 100.0);
            // Hundredths of a mmHg are nothing beside the points.
            let tolerance = 1.1 * OF_POINTS * truth;
            assert_close(pressure * area + suppressed, truth, tolerance);
        }
    }
}

/// The entries `key` of the blocks of one sensor.
fn statistics(text: &str, sensor: &str, key: &str) -> Vec<f64> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.starts_with("SENSOR,") || line.starts_with("GROUP,") {
            inside = line.contains(sensor);
        }
        if let Some(rest) = line.strip_prefix(key).filter(|_| inside) {
            found.push(rest.trim_matches(',').parse().unwrap());
        }
    }
    found
}

#[test]
fn xsensor_readings_have_the_peak_and_average_in_the_file() {
    for name in xsensor::NAMES {
        let recording = Recording::open_sensor("x", XSENSOR.as_bytes(), name).unwrap();
        let frames: Vec<_> = recording.map(Result::unwrap).collect();
        let peaks = statistics(XSENSOR, name, "Peak Pressure (mmHg),");
        let averages = statistics(XSENSOR, name, "Average Pressure (mmHg),");
        let lowest = statistics(XSENSOR, name, "Minimum Pressure (mmHg),");
        assert_eq!(
            [peaks.len(), averages.len(), lowest.len()],
            [frames.len(); 3]
        );
        for (frame, ((peak, average), least)) in
            frames.iter().zip(peaks.iter().zip(&averages).zip(&lowest))
        {
            // XSENSOR counts sensels above zero only.
            let loaded: Vec<_> = frame
                .values
                .iter()
                .map(|v| v / MMHG)
                .filter(|&v| v > 0.0)
                .collect();
            let count = loaded.len().max(1) as f64;
            let largest = loaded.iter().fold(0.0, |a: f64, &b| a.max(b));
            let smallest = loaded.iter().copied().reduce(f64::min).unwrap_or(0.0);
            // Conversion to Pa and back, relative 2e-16 each way.
            assert_close(largest, *peak, 1e-11);
            assert_close(smallest, *least, 1e-11);
            // Printed with two digits: half a unit.
            assert_close(loaded.iter().sum::<f64>() / count, *average, 0.005 + 1e-11);
        }
    }
}

#[test]
fn rows_without_a_header_are_the_motion_of_the_stage() {
    let (run, truth) = lattice::force_run_and_truth();
    let frames: Vec<_> = Recording::open_with("states.csv", run.states.as_bytes(), &bare())
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(frames.len(), lattice::FORCE_ROWS);
    let mut last = 0.0;
    let mut compared = 0;
    for (frame, truth) in frames.iter().zip(&truth) {
        let grams = frame.values[3];
        if grams >= 0.0 {
            compared += 1;
            // What the scale shows is up to 0.2 s old: as much as the force changed since the reading before.
            let newtons = grams * lattice::NEWTONS_PER_GRAM;
            let change: f64 = truth - last;
            assert_close(newtons, *truth, change.abs() * 1.1 + 0.01);
            last = *truth;
        }
    }
    assert!(compared > lattice::FORCE_ROWS / 2);
    let sensor = Recording::open_with("sensor.csv", run.sensor.as_bytes(), &bare()).unwrap();
    assert_eq!(sensor.stream().columns, 15);
    assert_eq!(sensor.count(), lattice::FORCE_ROWS);
}

/// A small recording and the offsets at which its frames are complete.
struct Small {
    text: String,
    complete: Vec<usize>,
}

impl Small {
    fn of(parts: &[(&str, bool)]) -> Self {
        let mut small = Self {
            text: String::new(),
            complete: Vec::new(),
        };
        for (part, completes) in parts {
            small.text.push_str(part);
            if *completes {
                small.complete.push(small.text.len());
            }
        }
        small
    }
}

fn small_recordings() -> [Small; 3] {
    let sensor = "SENSOR,a b,,\nRows,2,,\nColumns,2,,\nSensel Width (cm),1,,\nSensel Height (cm),1,,\n,,,\nSENSELS,,,\n";
    [
        Small::of(&[
            (
                "# hand-made\nsequence,time [s],r0c0 [kPa],r0c1 [kPa]\n",
                false,
            ),
            ("3,0.1,1.5,2.25\n", true),
            ("4,0.2,,1e-3\n", true),
            ("6,0.3,nan,-4.5\n", true),
        ]),
        Small::of(&[
            (
                "DATA_TYPE MOVIE\nROWS 2\nCOLS 2\nSECONDS_PER_FRAME 0.1\nCOMMENTS:\ntwo\nSTART_FRAME 1\nUNITS raw\nASCII_DATA @@\n\n",
                false,
            ),
            ("Frame 1, 0,, x\nB,12\n13,14\n", true),
            ("\nFrame 2, 0.1,, x\nB,22\n23,24\n", true),
            ("@@\n", false),
        ]),
        Small::of(&[
            (
                "\u{feff}File:,\"a,b\",,\nUnits:,mmHg,,\n,,,\nFRAME,11,,\nTime, 08:00:00.100,,\n",
                false,
            ),
            (sensor, false),
            ("1.5,2.5,,\n,,,\n3.5,4.5,,\n", true),
            (
                "GROUP,1,,\nCells,3,,\nSENSELS,,,\n1.5,2.5\n3.5,\nFRAME,12,,\nTime, 08:00:00.200,,\n",
                false,
            ),
            (sensor, false),
            ("5.5,6.5,,\n,,,\n7.5,8.5,,\n", true),
            ("GROUP,1,,\nCells,3,,\nSENSELS,,,\n1.5,2.5\n3.5,\n", false),
        ]),
    ]
}

#[test]
fn a_cut_recording_keeps_every_complete_frame() {
    for (which, small) in small_recordings().iter().enumerate() {
        let bytes = small.text.as_bytes();
        let (whole, error) = read_on(bytes);
        assert!(error.is_none(), "{error:?}");
        assert_eq!(whole.len(), small.complete.len());
        for cut in 0..bytes.len() {
            let (found, error) = read_on(&bytes[..cut]);
            // In raw channels a line with all its fields counts without its
            // end, although its last number may have lost digits; a row of
            // XSENSOR counts when the commas that pad it are there.
            let at_least = small.complete.iter().filter(|&&end| end <= cut).count();
            let at_most = small.complete.iter().filter(|&&end| end <= cut + 4).count();
            assert!(
                (at_least..=at_most).contains(&found.len()),
                "recording {which} cut at {cut}"
            );
            for (found, whole) in found.iter().zip(&whole).take(at_least) {
                assert!(same(found, whole), "recording {which} cut at {cut}");
            }
            match error {
                Some(RecordingError::Truncated {
                    complete_frames,
                    error,
                }) => {
                    assert_eq!(complete_frames, found.len() as u64);
                    assert!(!error.help.is_empty());
                }
                // Nothing that can be recognised is left.
                Some(RecordingError::Input(_)) => assert!(found.is_empty() && cut < 60, "{cut}"),
                Some(other) => panic!("{other}"),
                // The end mark may lack its line end; raw channels have no end
                // mark, and XSENSOR has none behind the last group.
                None => assert!(which != 1 || cut + 1 == bytes.len(), "{cut}"),
            }
        }
    }
}

#[test]
fn a_number_that_may_have_lost_digits_is_not_delivered_from_vendors_files() {
    for small in &small_recordings()[1..] {
        let (whole, _) = read_on(small.text.as_bytes());
        for cut in 0..small.text.len() {
            let (found, _) = read_on(&small.text.as_bytes()[..cut]);
            assert!(
                found
                    .iter()
                    .zip(&whole)
                    .all(|(found, whole)| same(found, whole)),
                "{cut}"
            );
        }
    }
}

#[test]
fn a_failing_reader_ends_the_recording_after_its_frames() {
    struct Fails;
    impl Read for Fails {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("unplugged"))
        }
    }
    let bytes = small_recordings()[0].text.clone();
    let reader = BufReader::new(bytes.as_bytes().chain(Fails));
    let mut recording = Recording::open("test", reader).unwrap();
    assert!(recording.by_ref().take(3).all(|frame| frame.is_ok()));
    assert!(matches!(recording.next(), Some(Err(RecordingError::Io(_)))));
    assert!(recording.next().is_none());
}

#[test]
fn small_reads_give_the_same_frames() {
    let whole = frames(FSCAN);
    let recording = Recording::open("test", BufReader::with_capacity(7, FSCAN.as_bytes())).unwrap();
    let pieces: Vec<_> = recording.map(Result::unwrap).collect();
    assert!(whole.iter().zip(&pieces).all(|(a, b)| same(a, b)));
    assert_eq!(whole.len(), pieces.len());
}

#[test]
fn a_recording_of_pressures_survives_the_way_through_raw_channels() {
    for text in [ISCAN, FSCAN, XSENSOR] {
        let mut recording = open(text);
        let mut writer =
            ChannelWriter::new(Vec::new(), recording.stream(), &["# a\nb".to_owned()]).unwrap();
        let mut before = Vec::new();
        for frame in &mut recording {
            let frame = frame.unwrap();
            writer.write(&frame).unwrap();
            before.push(frame);
        }
        let written = String::from_utf8(writer.into_inner()).unwrap();
        let again = open(&written);
        assert_eq!(again.stream().unit, recording.stream().unit);
        let after: Vec<_> = again.map(Result::unwrap).collect();
        assert_eq!(before.len(), after.len());
        // What was read in a unit comes back in it bit for bit.
        assert!(before.iter().zip(&after).all(|(a, b)| same(a, b)));
    }
}

#[test]
fn what_cannot_be_read_back_is_not_written() {
    let stream = stream(1, 1, 1, "kPa", Quantity::Pressure, 1e3);
    let frame = |values: Vec<f64>| Frame {
        sequence: 0,
        time_ns: 0,
        values,
        ..Frame::default()
    };
    let mut writer = ChannelWriter::new(Vec::new(), &stream, &[]).unwrap();
    assert!(writer.write(&frame(vec![f64::INFINITY])).is_err());
    assert!(writer.write(&frame(vec![1.0, 2.0])).is_err());
    writer.write(&frame(vec![f64::NAN])).unwrap();
    assert_eq!(
        writer.into_inner(),
        b"sequence,time [ns],r0c0 [kPa]\n0,0,nan\n"
    );
    let other_scale = self::stream(1, 1, 1, "kPa", Quantity::Pressure, 1e4);
    assert!(ChannelWriter::new(Vec::new(), &other_scale, &[]).is_err());
    let two = self::stream(1, 1, 2, "kPa", Quantity::Pressure, 1e3);
    assert!(ChannelWriter::new(Vec::new(), &two, &[]).is_err());
}

/// Three forces of a taxel are named by their axes, in any order of the columns; one that is
/// missing, or a capacitor among them, is named.
#[test]
fn forces_of_a_taxel_are_named_by_their_axes() {
    let stream = stream(1, 2, 3, "mN", Quantity::Force, 1e-3);
    let writer = ChannelWriter::new(Vec::new(), &stream, &[]).unwrap();
    let header = String::from_utf8(writer.into_inner()).unwrap();
    assert!(
        header.ends_with("r0c0.z [mN],r0c1.x [mN],r0c1.y [mN],r0c1.z [mN]\n"),
        "{header}"
    );
    let read = |text: &str| Recording::open("f.csv", Cursor::new(text.as_bytes().to_vec()));
    let shuffled = "time [ns],r0c0.z [N],r0c0.x [N],r0c0.y [N]\n0,3,1,2\n";
    let mut recording = read(shuffled).unwrap();
    assert_eq!(recording.stream().channels_per_taxel, 3);
    assert_eq!(recording.next().unwrap().unwrap().values, [1.0, 2.0, 3.0]);
    for (header, part) in [
        ("r0c0.x [N],r0c0.y [N]", "r0c0.z is missing"),
        ("r0c0.x [N],r0c0.11 [N]", "an axis"),
    ] {
        let Err(error) = read(&format!("time [ns],{header}\n0,1,2\n")) else {
            panic!("{header}")
        };
        assert!(error.to_string().contains(part), "{error}");
    }
}

fn stream(
    rows: usize,
    columns: usize,
    channels_per_taxel: usize,
    symbol: &str,
    quantity: Quantity,
    si_per_unit: f64,
) -> Stream {
    Stream {
        name: "test".to_owned(),
        rows,
        columns,
        channels_per_taxel,
        unit: SignalUnit {
            quantity,
            symbol: symbol.to_owned(),
            si_per_unit,
        },
        pitch: None,
        period: None,
        threshold: None,
        present: vec![true; rows * columns * channels_per_taxel],
    }
}

/// Streams of all units and shapes.
fn streams() -> impl Strategy<Value = Stream> {
    let units = prop_oneof![
        Just(("counts", Quantity::Counts, 1.0)),
        Just(("raw", Quantity::Raw, 1.0)),
        Just(("fF", Quantity::Capacitance, 1e-15)),
        Just(("pF", Quantity::Capacitance, 1e-12)),
        Just(("F", Quantity::Capacitance, 1.0)),
        Just(("kPa", Quantity::Pressure, 1e3)),
        Just(("mmHg", Quantity::Pressure, MMHG)),
        Just(("GPa", Quantity::Pressure, 1e9)),
        Just(("mN", Quantity::Force, 1e-3)),
        Just(("uN", Quantity::Force, 1e-6)),
        Just(("mV", Quantity::Voltage, 1e-3)),
        Just(("pC", Quantity::Charge, 1e-12)),
        Just(("mohm", Quantity::Resistance, 1e-3)),
        Just(("Mohm", Quantity::Resistance, 1e6)),
        Just(("Gohm", Quantity::Resistance, 1e9)),
    ];
    (
        1..4_usize,
        1..4_usize,
        prop_oneof![Just(1_usize), Just(3), Just(4)],
        units,
    )
        .prop_map(|(rows, columns, per_taxel, (symbol, quantity, scale))| {
            stream(rows, columns, per_taxel, symbol, quantity, scale)
        })
}

/// Readings of any size in shown units, some missing.
fn readings() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1e6..1e6_f64,
        2 => (-1_000_000..1_000_000_i32).prop_map(|n| f64::from(n) / 1000.0),
        1 => -1e200..1e200_f64,
        1 => -1e-200..1e-200_f64,
        1 => Just(f64::NAN),
        1 => Just(-0.0),
    ]
}

fn recordings() -> impl Strategy<Value = (Stream, Vec<Frame>)> {
    streams().prop_flat_map(|stream| {
        let channels = stream.channels();
        let scale = stream.unit.si_per_unit;
        let values =
            prop::collection::vec(readings().prop_map(move |shown| shown * scale), channels);
        let frame =
            (any::<u64>(), any::<u64>(), values).prop_map(|(sequence, time_ns, values)| Frame {
                sequence,
                time_ns,
                values,
                ..Frame::default()
            });
        (Just(stream), prop::collection::vec(frame, 0..4))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn decode_inverts_encode((stream, written) in recordings()) {
        let mut writer = ChannelWriter::new(Vec::new(), &stream, &["seed 1".to_owned()]).unwrap();
        for frame in &written {
            writer.write(frame).unwrap();
        }
        let bytes = writer.into_inner();
        let recording = Recording::open("test", bytes.as_slice()).unwrap();
        prop_assert_eq!(recording.stream(), &Stream { ..stream.clone() });
        let read: Vec<_> = recording.collect::<Result<_, _>>().unwrap();
        prop_assert_eq!(read.len(), written.len());
        for (read, written) in read.iter().zip(&written) {
            // All values here are readings in the stream's unit: bit for bit.
            prop_assert!(same(read, written));
        }
    }

    #[test]
    fn any_double_comes_back_within_one_unit_in_the_last_place(value in 1e-18..1e-9_f64) {
        let stream = stream(1, 1, 1, "fF", Quantity::Capacitance, 1e-15);
        let mut writer = ChannelWriter::new(Vec::new(), &stream, &[]).unwrap();
        writer.write(&Frame { sequence: 0, time_ns: 0, values: vec![value], ..Frame::default() }).unwrap();
        let bytes = writer.into_inner();
        let read = Recording::open("test", bytes.as_slice()).unwrap().next().unwrap().unwrap();
        let near = [value, value.next_up(), value.next_down()];
        prop_assert!(near.contains(&read.values[0]), "{value:e} {:e}", read.values[0]);
    }

    #[test]
    fn damaged_recordings_never_panic(
        which in 0..6_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 1..12),
    ) {
        let small = small_recordings();
        let mut bytes = match which {
            0..=2 => small[which].text.clone().into_bytes(),
            3 => ISCAN.as_bytes()[..4000].to_vec(),
            4 => FSCAN.as_bytes()[..7000].to_vec(),
            _ => XSENSOR.as_bytes()[..20000].to_vec(),
        };
        for (at, byte, kind) in changes {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                // The bytes that mean something.
                2 => bytes[at] = b",;\n\"B0-.@[]\t"[usize::from(byte) % 12],
                _ => { bytes.remove(at); }
            }
        }
        let (_, error) = read_on(&bytes);
        if let Some(error) = error {
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_on(&bytes);
    }
}

/// Rows without names are the channels of a device.
fn bare() -> RecordingOptions {
    RecordingOptions {
        bare: true,
        ..RecordingOptions::default()
    }
}
