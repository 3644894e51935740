//! Shipped boards: their published vectors, and a capture with damage.

use std::error::Error;

use taxel_board::{Begin, Board, Class, Counts, Decoder};
use taxel_recording::Frame;

#[path = "common/capture.rs"]
mod capture;
use capture::{BOARD, SCALES, capture};

type Outcome = Result<(), Box<dyn Error>>;

fn board(name: &str) -> Result<Board, Box<dyn Error>> {
    let text = Board::shipped_text(name).ok_or("no such board")?;
    Ok(Board::parse(name, text)?)
}

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace()
        .filter_map(|byte| u8::from_str_radix(byte, 16).ok())
        .collect()
}

fn decode(board: &Board, wire: &[u8]) -> (Vec<Frame>, Counts) {
    let mut decoder = Decoder::new(board, Begin::Whole);
    decoder.push(wire, None);
    decoder.finish();
    let frames = std::iter::from_fn(|| decoder.next()).collect();
    (frames, decoder.counts())
}

fn one(name: &str, wire: &[u8]) -> Result<Frame, Box<dyn Error>> {
    let (frames, counts) = decode(&board(name)?, wire);
    match <[Frame; 1]>::try_from(frames) {
        Ok([frame]) => Ok(frame),
        Err(frames) => Err(format!("{name}: {} frames, {counts:?}", frames.len()).into()),
    }
}

const ANYSKIN: &str = "00 00 c8 41 33 33 17 44 66 66 1e 43 be 7f 13 46 cd cc c8 41 66 66 bf 44 cd cc b2 c3 79 99 30 46 9a 99 c9 41 cd cc 88 c3 9a 19 80 44 f2 b2 2b 46 66 66 ca 41 00 00 40 44 9a 99 55 43 48 e1 1a 46 33 33 cb 41 00 00 10 c3 00 80 fa 44 d7 d3 38 46 0d 0a";

#[test]
fn every_shipped_board_parses() -> Outcome {
    for name in Board::shipped_names() {
        board(name)?;
    }
    Ok(())
}

#[test]
fn anyskin_vector() -> Outcome {
    let frame = one("anyskin-5x", &bytes(ANYSKIN))?;
    assert_eq!(frame.values.len(), 15);
    let f32 = |value: f32| f64::from(value);
    assert_eq!(frame.values[..3], [f32(604.8), f32(158.4), f32(9439.936)]);
    assert_eq!(
        frame.values[12..],
        [f32(-144.0), f32(2004.0), f32(11828.96)]
    );
    assert_eq!(board("anyskin-5x")?.detection().class, Class::D);
    Ok(())
}

/// 800.157… is `0d 0a 48 44`: the bytes of the end, inside the packet.
#[test]
fn an_end_inside_the_packet_is_no_end() -> Outcome {
    let mut wire = bytes(ANYSKIN);
    wire[4..8].copy_from_slice(&[0x0d, 0x0a, 0x48, 0x44]);
    let three = [&wire[..], &wire, &wire].concat();
    let (frames, counts) = decode(&board("anyskin-5x")?, &three);
    assert_eq!(frames.len(), 3, "{counts:?}");
    assert!(counts.is_clean());
    let expected = f64::from(f32::from_le_bytes([0x0d, 0x0a, 0x48, 0x44]));
    assert!(frames.iter().all(|frame| frame.values[0] == expected));
    Ok(())
}

const PAPILLARRAY: &str = "55 66 77 88 02 01 00 0d 00 03 00 19 00 04 00 57 00 2a 00 00 00 b1 68 de 3a 00 00 00 00 01 00 04 00 02 00 06 00 20 00 02 00 00 00 80 3f 00 00 00 40 00 00 40 40 cd cc cc 3d cd cc 4c 3e 9a 99 99 3e 02 00 00 00 80 40 00 00 a0 40 00 00 c0 40 cd cc cc 3e 00 00 00 3f 9a 99 19 3f 01 00 04 00 02 00 00 00 e0 40 00 00 00 41 00 00 10 41 33 33 33 3f cd cc 4c 3f 66 66 66 3f 94 18 aa bb cc dd";

#[test]
fn papillarray_vector() -> Outcome {
    let all: Vec<String> = board("papillarray-2")?
        .values()
        .iter()
        .map(|value| value.name.clone())
        .collect();
    let board = board("papillarray-2")?.wire(&all)?;
    let (frames, counts) = decode(&board, &bytes(PAPILLARRAY));
    let [frame] = &frames[..] else {
        return Err(format!("{counts:?}").into());
    };
    assert_eq!((frame.sequence, frame.time_ns), (42, 987_654_321_000));
    let milli = |value: f32| f64::from(value) * 1e-3;
    let value = |name: &str| {
        let place = all.iter().position(|other| other == name);
        place.map_or(f64::NAN, |place| frame.values[place])
    };
    for (name, expected) in [
        ("s1.p1.fx", 1.0),
        ("s1.p1.fz", 3.0),
        ("s1.p1.dx", milli(0.1)),
        ("s1.p2.fy", 5.0),
        ("s1.p2.dz", milli(0.6)),
        ("s1.fx", 7.0),
        ("s1.fz", 9.0),
        ("s1.tz", milli(0.9)),
    ] {
        assert_eq!(value(name), expected, "{name}");
    }
    assert!(value("s1.p3.fx").is_nan() && value("s2.fx").is_nan());
    // A place in a table that points elsewhere, with a check that holds.
    let mut wrong = bytes(PAPILLARRAY);
    wrong[31] += 1;
    let sum: u32 = wrong[4..113].iter().map(|byte| u32::from(*byte)).sum();
    wrong[113..115].copy_from_slice(&(sum as u16).to_le_bytes());
    assert_eq!(decode(&board, &wrong).0.len(), 0);
    Ok(())
}

#[test]
fn optoforce_vector() -> Outcome {
    let wire = bytes("aa 07 08 0a 2d 6a 00 00 ff f7 ff fb 00 07 05 51");
    let frame = one("optoforce-16", &wire)?;
    assert_eq!(frame.sequence, 11626);
    let counts: Vec<f64> = frame
        .values
        .iter()
        .zip([0.0378549, 0.0347182, 0.3306332])
        .map(|(value, scale)| (value / scale).round())
        .collect();
    assert_eq!(counts, [-9.0, -5.0, 7.0]);
    Ok(())
}

/// A capture with alien bytes, cut as a port may cut it.
#[test]
fn optoforce_capture() -> Outcome {
    let capture = capture();
    let board = board(BOARD)?;
    for chunk in [1, 7, 62, 4096, capture.bytes.len()] {
        let mut decoder = Decoder::new(&board, Begin::Cut);
        let mut frames = Vec::new();
        for bytes in capture.bytes.chunks(chunk) {
            decoder.push(bytes, None);
            frames.extend(std::iter::from_fn(|| decoder.next()));
            assert!(decoder.waiting() < 32);
        }
        decoder.finish();
        frames.extend(std::iter::from_fn(|| decoder.next()));
        let counts = decoder.counts();
        assert_eq!(counts.delivered, frames.len() as u64, "{counts:?}");
        assert_eq!(counts.lost, Some(capture.lost));
        assert_eq!(counts.wrong_number, 0);
        let found = frames.iter().map(|frame| {
            let count = |axis: usize| (frame.values[axis] / SCALES[axis]).round() as i64;
            (frame.sequence, std::array::from_fn(count))
        });
        assert!(found.eq(capture.whole.iter().copied()));
    }
    Ok(())
}

#[test]
fn touch_board_vector() -> Outcome {
    let wire = b"FDAT: 700 701 702 703 704 705 706 707 708 709 710 711 712\r\n";
    let frame = one("touch-board-mpr121", wire)?;
    let expected: Vec<f64> = (700..713).map(f64::from).collect();
    assert_eq!(frame.values, expected);
    Ok(())
}

#[test]
fn fdc1004_vector() -> Outcome {
    let board = board("fdc1004-facebook")?;
    let wire = b"Ready\r\nCapacitance (pF):  1.23 4.56 7.89 0.12\r\n";
    let mut decoder = Decoder::new(&board, Begin::Cut);
    decoder.push(wire, None);
    let frame = decoder.next().ok_or("no frame")?;
    for (value, expected) in frame
        .values
        .iter()
        .zip([1.23e-12, 4.56e-12, 7.89e-12, 0.12e-12])
    {
        assert!((value / expected - 1.0).abs() < 1e-12);
    }
    assert_eq!(decoder.counts().other, 1);
    assert_eq!(decoder.other_lines().collect::<Vec<_>>(), ["Ready"]);
    Ok(())
}

#[test]
fn openbci_vector() -> Outcome {
    let wire = bytes(
        "a0 07 00 00 01 ff ff ff 7f ff ff 80 00 00 00 01 00 ff ff 00 00 00 00 01 00 00 00 00 00 00 00 00 c0",
    );
    let frame = one("openbci-cyton", &wire)?;
    assert_eq!(frame.sequence, 7);
    assert_eq!(
        frame.values,
        [
            1.0,
            -1.0,
            8_388_607.0,
            -8_388_608.0,
            256.0,
            -256.0,
            0.0,
            65_536.0
        ]
    );
    Ok(())
}

#[test]
fn taxel_wire_vector() -> Outcome {
    let wire =
        bytes("02 01 02 07 01 01 03 e8 03 01 01 01 01 01 02 01 03 ff ff 06 01 b3 69 67 d6 00");
    let frame = one("taxel-wire-1", &wire)?;
    assert_eq!((frame.sequence, frame.time_ns), (7, 1_000_000));
    assert_eq!(frame.values, [1.0, -1.0, 256.0]);
    let mut back = Vec::new();
    let board = board("taxel-wire-1")?;
    taxel_board::Encoder::new(&board).encode(&frame, &mut back);
    assert_eq!(back, wire);
    assert_eq!(board.detection().class, Class::A);
    Ok(())
}

/// `t71380081f679d0753c00` among the messages of the other taxels, as an adapter and as
/// `candump` give them.
#[test]
fn xela_uskin_can_vector() -> Outcome {
    let mut wire = Vec::new();
    for taxel in 0..16 {
        let line = match taxel {
            3 => "t71380081f679d0753c00\r".to_owned(),
            // Another message of the bus, in between.
            7 => "t70120102\rt71780000010002000300\r".to_owned(),
            11 => "(1436509052.249713) can0 71B#0000010002000300\n".to_owned(),
            12 => "  can0  71C   [8]  00 00 01 00 02 00 03 00\n".to_owned(),
            taxel => format!("t{:03x}80000010002000300\r", 0x710 + taxel),
        };
        wire.extend_from_slice(line.as_bytes());
    }
    let frame = one("xela-uskin-can", &wire)?;
    assert_eq!(frame.values.len(), 48);
    for (taxel, values) in frame.values.chunks(3).enumerate() {
        let expected = match taxel {
            3 => [33270.0, 31184.0, 30012.0],
            _ => [1.0, 2.0, 3.0],
        };
        assert_eq!(values, expected, "taxel {taxel}");
    }
    let board = board("xela-uskin-can")?;
    assert_eq!(board.names().nth(9), Some("x.3"));
    assert_eq!(decode(&board, &wire).1.other, 1);
    // Each message of 8 bytes has 22 characters.
    assert_eq!(board.bytes_per_frame(), Some(16 * 22));
    let mut back = Vec::new();
    taxel_board::Encoder::new(&board).encode(&frame, &mut back);
    let text = String::from_utf8(back)?;
    assert!(text.contains("\rt71380081f679d0753c00\r"), "{text}");
    assert_eq!(board.detection().class, Class::C);
    Ok(())
}

/// A message that is lost makes its frame incomplete; the next one is whole and not mixed.
#[test]
fn frames_of_messages_are_not_mixed() -> Outcome {
    for (lost, incomplete) in [(0x710, 1), (0x713, 1), (0x71f, 1)] {
        let round = |round| {
            let ids = (0x710..=0x71f).filter(move |id| round != 1 || *id != lost);
            ids.map(move |id| format!("t{id:03x}800{round:04x}{round:04x}{round:04x}00\r"))
        };
        let wire: String = (0..4).flat_map(round).collect();
        let (frames, counts) = decode(&board("xela-uskin-can")?, wire.as_bytes());
        assert_eq!(frames.len(), 3, "{lost:x} {counts:?}");
        assert_eq!(counts.incomplete, incomplete, "{lost:x}");
        for frame in frames {
            assert!(frame.values.iter().all(|value| *value == frame.values[0]));
        }
    }
    Ok(())
}

const XELA_SERVER: &str = r#"{"message":4507,"1":{"sensor":"1","model":"uSPa44","time":1696911224.9756384,"taxels":2,"data":"81F6,79D0,753C,81F7,79D1,753D"}}"#;

#[test]
fn xela_server_vector() -> Outcome {
    let board = board("xela-server")?;
    let welcome = r#"{"message":"Welcome"}"#;
    // With line feeds, with nothing between them, and with an object that is cut.
    for wire in [
        format!("{welcome}\n{XELA_SERVER}\n"),
        format!("{welcome}{XELA_SERVER}"),
        format!("{welcome}\n{}\n{XELA_SERVER}\n", &XELA_SERVER[..100]),
    ] {
        for chunk in [1, 17, wire.len()] {
            let mut decoder = Decoder::new(&board, Begin::Whole);
            for bytes in wire.as_bytes().chunks(chunk) {
                decoder.push(bytes, None);
            }
            decoder.finish();
            let frame = decoder.next().ok_or("no frame")?;
            assert_eq!(decoder.next(), None);
            assert_eq!(frame.sequence, 4507);
            // To the 256 ns that a number of 64 bits holds at this time.
            assert!(frame.time_ns.abs_diff(1_696_911_224_975_638_400) <= 256);
            let (read, missing) = frame.values.split_at(6);
            assert_eq!(read, [33270.0, 31184.0, 30012.0, 33271.0, 31185.0, 30013.0]);
            assert!(missing.len() == 42 && missing.iter().all(|value| value.is_nan()));
            let counts = decoder.counts();
            assert!(counts.other >= 1, "{counts:?}");
            let other = decoder.other_lines().next();
            assert_eq!(other, Some(welcome));
        }
    }
    // A digit that is none: damage, not data.
    let wrong = XELA_SERVER.replace("79D1", "79G1");
    let (frames, counts) = decode(&board, wrong.as_bytes());
    assert_eq!((frames.len(), counts.damaged), (0, 1));
    Ok(())
}
