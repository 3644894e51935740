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
    assert!(wire.windows(vector.len()).any(|bytes| bytes == vector));
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
    decoder.push(&wire, None);
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
