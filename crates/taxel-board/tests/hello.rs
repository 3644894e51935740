//! taxel-wire-1: a board that says itself what its frames hold, and firmware that does so.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

use proptest::prelude::*;
use taxel_board::{
    Begin, Board, Decoder, Encoder, HelloFinder, board_file_of_hello, hello_of_channels,
};
use taxel_recording::Frame;

type Outcome = Result<(), Box<dyn Error>>;

fn said(hello: &str) -> Result<Board, Box<dyn Error>> {
    Ok(Board::parse("hello", &board_file_of_hello(hello)?)?)
}

#[test]
fn a_hello_says_what_the_frames_hold() -> Outcome {
    let text = r#"
schema = 1
name = "glove \"left\""
rate = "250 Hz"
framing.cobs = { hello = true }
packet = { fields = [
  { is = "mark", equals = "01" }, { is = "mark", equals = "00" },
  { is = "sequence", type = "u32" }, { is = "time", type = "u64", unit = "us" },
  { is = "status", type = "u8", good = 0 },
  { is = "value", name = "f{1..2}.{x,y,z}", type = "i16", scale = 0.01, unit = "N", range = [-50, 50] },
  { is = "skip", bytes = 3 },
  { is = "value", name = "t1..t4", type = "u16", order = "big", mask = "0x0fff", missing = 4095, unit = "degC", offset = -40.0 },
], check = { kind = "CRC-32/ISO-HDLC" } }"#;
    let board = Board::parse("board.toml", text)?;
    let wire = board.hello().ok_or("no hello")?;
    let mut finder = HelloFinder::default();
    assert_eq!(finder.push(&[9, 9, 0, 1, 0]), None);
    let (first, second) = wire.split_at(20);
    assert_eq!(finder.push(first), None);
    let hello = finder.push(second).ok_or("no hello found")?;
    let back = said(&hello)?;
    assert_eq!(
        back.values()
            .iter()
            .map(|value| (&value.name, &value.unit))
            .collect::<Vec<_>>(),
        board
            .values()
            .iter()
            .map(|value| (&value.name, &value.unit))
            .collect::<Vec<_>>()
    );
    assert_eq!((back.rate, &back.name), (board.rate, &board.name));
    let frame = Frame {
        sequence: 9,
        time_ns: 5_000_000,
        values: vec![
            1.0,
            -2.0,
            3.25,
            0.0,
            49.9,
            -49.9,
            20.0,
            f64::NAN,
            -40.0,
            60.0,
        ],
        ..Frame::default()
    };
    let mut bytes = Vec::new();
    Encoder::new(&board).encode(&frame, &mut bytes);
    // A hello and a text in between are no damage.
    bytes.extend_from_slice(&wire);
    let decoded = |board: &Board| {
        let mut decoder = Decoder::new(board, Begin::Whole);
        decoder.push(&bytes, None);
        (decoder.next(), decoder.counts())
    };
    let (found, counts) = decoded(&back);
    let found = found.ok_or("no frame")?;
    assert_eq!((found.sequence, found.time_ns), (9, 5_000_000));
    for (found, sent) in found.values.iter().zip(&frame.values) {
        assert!((found - sent).abs() < 1e-9 || found.is_nan() && sent.is_nan());
    }
    assert_eq!((counts.damaged, counts.other), (0, 1));
    let own = decoded(&board).0.ok_or("no frame")?;
    assert_eq!(own.values[..7], found.values[..7]);
    Ok(())
}

#[test]
fn a_hello_names_no_command_and_no_path() -> Outcome {
    let hello = r#"{"name":"x\" \u001bstart = \"rm","fields":[{"is":"value","name":"a","type":"u8"}],
        "link":{"serial":{"baud":9600,"start":"stop"}},"wiring":["a"]}"#;
    let board = said(hello)?;
    assert_eq!(board.name, "x\"  start = \"rm");
    assert_eq!(board.link, taxel_board::Link::default());
    for wrong in [
        "",
        "[]",
        r#"{"name":"x"}"#,
        r#"{"name":"x","fields":[]}"#,
        r#"{"name":"","fields":[{"is":"value","name":"a","type":"u8"}]}"#,
        r#"{"name":"x","fields":[{"is":"value","name":"c{1..99999}","type":"u8"}]}"#,
        r#"{"name":"x","fields":[{"is":"value","name":"a","type":"u8","bytes":9999999999}]}"#,
        r#"{"name":"x","fields":[{"is":"value","name":"a","type":"u8","path":"/etc"}]}"#,
        r#"{"name":"x","rate":"1 furlong","fields":[{"is":"value","name":"a","type":"u8"}]}"#,
        r#"{"name":"x","fields":[{"is":"skip","bytes":1000000},{"is":"skip","bytes":1000000}]}"#,
    ] {
        assert!(said(wrong).is_err(), "{wrong}");
    }
    let deep = format!(r#"{{"name":"x","fields":[{{"is":{}"#, "[".repeat(60_000));
    assert!(said(&deep).is_err());
    Ok(())
}

#[test]
fn a_hello_of_any_number_of_channels() -> Outcome {
    for (channels, symbol) in [(1, "counts"), (48, "pF"), (4096, "N")] {
        let board = said(&hello_of_channels("twin", Some(100.0), channels, symbol))?;
        assert_eq!(board.names().count(), channels);
        assert!(
            board
                .values()
                .iter()
                .all(|value| value.unit.symbol == symbol)
        );
    }
    Ok(())
}

/// The hello of two axes with these fields.
fn axes(about: &str, fields: &str) -> String {
    format!(r#"{{{about}"fields":[{fields}]}}"#)
}

/// A board of two axes, its first hello, and five frames of it.
fn begun(first: &str) -> Result<(Board, Decoder), Box<dyn Error>> {
    let board = said(first)?;
    let mut decoder = Decoder::new(&board, Begin::Whole);
    decoder.push(&board.hello().ok_or("no hello")?, None);
    decoder.push(&frames(&board, 0..5), None);
    assert_eq!(std::iter::from_fn(|| decoder.next()).count(), 5);
    Ok((board, decoder))
}

/// The bytes of frames of `board` with these numbers, its values being 1, 2, …
fn frames(board: &Board, numbers: std::ops::Range<u64>) -> Vec<u8> {
    let mut encoder = Encoder::new(board);
    let mut bytes = Vec::new();
    for sequence in numbers {
        let values = (1..=board.values().len()).map(|value| value as f64);
        let frame = Frame {
            sequence,
            time_ns: sequence * 10_000_000,
            values: values.collect(),
            ..Frame::default()
        };
        encoder.encode(&frame, &mut bytes);
    }
    bytes
}

const XZ: &str = r#"{"is":"value","name":"f.{x,z}","type":"i16","scale":0.01,"unit":"N"}"#;

#[test]
fn frames_of_another_meaning_are_not_read() -> Outcome {
    let first = axes(r#""name":"a","#, XZ);
    for (fields, difference) in [
        (XZ.replace("0.01", "1.0"), "scale"),
        (XZ.replace("{x,z}", "{z,x}"), "f.z"),
        (XZ.replace("i16", "u16"), "u16"),
        (XZ.replace("i16", "f32"), "f32"),
        (XZ.replace(r#""N""#, r#""mN""#), "mN"),
        (XZ.replace("{x,z}", "{x,y,z}"), "3 values, before 2"),
        (XZ.replace("{x,z}", "{x,y}"), "f.y"),
        (XZ.replace(r#""unit""#, r#""offset":1.0,"unit""#), "offset"),
        (XZ.replace(r#""unit""#, r#""order":"big","unit""#), "order"),
        (format!(r#"{{"is":"skip","bytes":1}},{XZ}"#), ""),
        ("{}".into(), "cannot be read"),
    ] {
        // In the same connection, and after the next one.
        for reconnects in [false, true] {
            let (_, mut decoder) = begun(&first)?;
            let other = axes(r#""name":"a","#, &fields);
            let mut wire = hello_packet(&other);
            if let Ok(board) = said(&other) {
                wire.extend(frames(&board, 5..9));
            }
            if reconnects {
                decoder.reconnect(Begin::Cut);
            }
            decoder.push(&wire, None);
            assert_eq!(decoder.next(), None, "{other}");
            let changed = decoder.changed().ok_or("nothing said")?;
            assert!(changed.contains(difference), "{other}: {changed}");
        }
    }
    Ok(())
}

#[test]
fn another_name_firmware_or_rate_is_the_same_board() -> Outcome {
    let first = axes(r#""name":"a","#, XZ);
    for about in [
        r#""name":"b","#,
        r#""name":"a","firmware":"2","#,
        r#""name":"a","rate":"50 Hz","#,
    ] {
        let (board, mut decoder) = begun(&first)?;
        decoder.push(&hello_packet(&axes(about, XZ)), None);
        decoder.push(&frames(&board, 5..9), None);
        assert_eq!(std::iter::from_fn(|| decoder.next()).count(), 4);
        assert_eq!(decoder.changed(), None);
    }
    Ok(())
}

#[test]
fn after_a_new_connection_the_hello_comes_first() -> Outcome {
    let (board, mut decoder) = begun(&axes(r#""name":"a","#, XZ))?;
    assert!(!decoder.awaits_hello());
    decoder.reconnect(Begin::Whole);
    decoder.push(&frames(&board, 0..3), None);
    assert_eq!(decoder.next(), None);
    assert!(decoder.awaits_hello());
    decoder.push(&board.hello().ok_or("no hello")?, None);
    assert!(!decoder.awaits_hello());
    decoder.push(&frames(&board, 3..6), None);
    assert_eq!(std::iter::from_fn(|| decoder.next()).count(), 3);
    Ok(())
}

#[test]
fn a_board_that_never_said_hello_is_read_as_its_file_says() -> Outcome {
    let board = said(&axes(r#""name":"a","#, XZ))?;
    let mut decoder = Decoder::new(&board, Begin::Whole);
    decoder.push(&frames(&board, 0..3), None);
    decoder.reconnect(Begin::Whole);
    decoder.push(&frames(&board, 0..3), None);
    assert_eq!(std::iter::from_fn(|| decoder.next()).count(), 6);
    assert!(!decoder.awaits_hello());
    // A hello that comes late and says something else.
    let other = axes(r#""name":"a","#, &XZ.replace("0.01", "1.0"));
    decoder.push(&hello_packet(&other), None);
    assert!(decoder.changed().is_some());
    Ok(())
}

/// A restart of the board without a new connection: as over UDP.
#[test]
fn a_board_that_begins_anew_is_asked_again() -> Outcome {
    let (board, mut decoder) = begun(&axes(r#""name":"a","#, XZ))?;
    decoder.push(&frames(&board, 5..500), None);
    decoder.push(&frames(&board, 0..10), None);
    while decoder.next().is_some() {}
    assert_eq!(decoder.counts().restarts, 1);
    assert!(decoder.awaits_hello());
    decoder.push(&board.hello().ok_or("no hello")?, None);
    assert!(!decoder.awaits_hello());
    Ok(())
}

/// The packet of a hello with this JSON.
fn hello_packet(json: &str) -> Vec<u8> {
    let mut packet = vec![2];
    packet.resize(14, 0);
    packet.extend_from_slice(json.as_bytes());
    let mut check = u32::MAX;
    for byte in &packet {
        check ^= u32::from(*byte);
        for _ in 0..8 {
            check = check >> 1 ^ 0xedb8_8320 & (check & 1).wrapping_neg();
        }
    }
    packet.extend_from_slice(&(!check).to_le_bytes());
    let (mut wire, mut run) = (Vec::new(), Vec::new());
    for byte in packet {
        if byte != 0 {
            run.push(byte);
        }
        if byte == 0 || run.len() == 254 {
            wire.push(run.len() as u8 + 1);
            wire.append(&mut run);
        }
    }
    wire.push(run.len() as u8 + 1);
    wire.append(&mut run);
    wire.push(0);
    wire
}

proptest! {
    #[test]
    fn any_hello_is_read_or_refused(text in "\\PC{0,200}", bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        let _ = said(&text);
        let _ = said(&format!(r#"{{"name":"x","fields":[{{"is":"value","name":{text:?}}}]}}"#));
        let mut finder = HelloFinder::default();
        prop_assert_eq!(finder.push(&bytes), None);
    }
}

/// The Arduino header on this computer: its bytes are those of the specification, and its
/// frames come back by its own hello.
#[test]
fn arduino_header_writes_taxel_wire_1() -> Outcome {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../clients/arduino");
    let Some(wire) = run_sketch(&folder, "tests/vector.cpp")? else {
        return Ok(());
    };
    // A hello, then the frame of the specification, then text.
    let hex = "02 01 02 07 01 01 03 e8 03 01 01 01 01 01 02 01 03 ff ff 06 01 b3 69 67 d6 00";
    let vector: Vec<u8> = hex
        .split(' ')
        .filter_map(|byte| u8::from_str_radix(byte, 16).ok())
        .collect();
    let mut windows = wire.windows(vector.len());
    let behind_hello = windows
        .position(|bytes| bytes == vector)
        .ok_or("no frame")?;
    let hello = HelloFinder::default().push(&wire).ok_or("no hello")?;
    let board = said(&hello)?;
    assert_eq!(board.names().collect::<Vec<_>>(), ["c1", "c2", "c3"]);
    let mut decoder = Decoder::new(&board, Begin::Whole);
    decoder.push(&wire, None);
    let frame = decoder.next().ok_or("no frame")?;
    assert_eq!((frame.sequence, frame.time_ns), (7, 1_000_000));
    assert_eq!(frame.values, [1.0, -1.0, 256.0]);
    assert_eq!(decoder.counts().damaged, 0);
    // A long frame, with more than 254 bytes without a zero.
    let long = r#"{"name":"long","fields":[{"is":"value","name":"c1..c150","type":"i32"}]}"#;
    let mut decoder = Decoder::new(&said(long)?, Begin::Whole);
    decoder.push(&wire[behind_hello..], None);
    let frame = decoder.next().ok_or("no long frame")?;
    let expected: Vec<f64> = (0..150)
        .map(|n| f64::from(0x0101_0101 * (n % 100 + 1)))
        .collect();
    assert_eq!(frame.values, expected);
    Ok(())
}

/// The example sketch, with what Arduino gives stood in for.
#[test]
fn arduino_example_says_hello_and_sends_frames() -> Outcome {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../clients/arduino");
    let Some(wire) = run_sketch(&folder, "tests/example.cpp")? else {
        return Ok(());
    };
    let hello = HelloFinder::default().push(&wire).ok_or("no hello")?;
    let mut decoder = Decoder::new(&said(&hello)?, Begin::Whole);
    decoder.push(&wire, None);
    let frames: Vec<Frame> = std::iter::from_fn(|| decoder.next()).collect();
    assert_eq!(frames.len(), 300);
    assert_eq!(frames[0].values, [0.0, 1.0, 2.0, 3.0]);
    assert!(decoder.counts().is_clean());
    Ok(())
}

/// What a program of the folder prints; `None` without a compiler.
fn run_sketch(folder: &Path, source: &str) -> Result<Option<Vec<u8>>, Box<dyn Error>> {
    let compilers = ["c++", "g++", "clang++"];
    let is_there = |name: &&str| {
        let tried = Command::new(name).arg("--version").output();
        tried.is_ok_and(|output| output.status.success())
    };
    let Some(compiler) = compilers.into_iter().find(is_there) else {
        #[allow(clippy::print_stderr, reason = "a test that is skipped says so")]
        {
            eprintln!("skipped: no C++ compiler here (c++, g++, clang++)");
        }
        return Ok(None);
    };
    let name = source.replace(['/', '.'], "-");
    let program: PathBuf =
        std::env::temp_dir().join(format!("taxel-{}-{name}", std::process::id()));
    let built = Command::new(compiler)
        .args(["-std=c++11", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(folder)
        .arg("-o")
        .arg(&program)
        .arg(folder.join(source))
        .output()?;
    if !built.status.success() {
        return Err(String::from_utf8_lossy(&built.stderr).into_owned().into());
    }
    let ran = Command::new(&program).output();
    std::fs::remove_file(&program)?;
    let ran = ran?;
    assert!(ran.status.success());
    Ok(Some(ran.stdout))
}
