//! Board files: what is written comes back, and mistakes are shown at their word.

mod common;

use common::DESCRIPTIONS;
use proptest::prelude::*;
use taxel_board::{Begin, Board, Decoder, Encoder};
use taxel_recording::Frame;

fn decoded(board: &Board, wire: &[u8]) -> Vec<Frame> {
    let mut decoder = Decoder::new(board, Begin::Whole);
    decoder.push(wire, None);
    decoder.finish();
    std::iter::from_fn(|| decoder.next()).collect()
}

/// A packet of numbers of every type, orders, masks and scales, in any framing with a check.
fn any_board() -> impl Strategy<Value = (Board, Vec<f64>)> {
    let kinds = prop::sample::select(vec![
        "u8",
        "i8",
        "u16",
        "i16",
        "u24",
        "i24",
        "u32",
        "i32",
        "f32",
        "f64",
        "bits(12)",
        "signed_bits(5)",
        "bits(3)",
    ]);
    let fields = prop::collection::vec((kinds, any::<bool>(), 0.0..1.0_f64), 1..12);
    let framing = prop::sample::select(vec!["fixed", "marked", "length", "cobs", "slip"]);
    let check = prop::sample::select(vec![
        "CRC-16/ARC",
        "CRC-32/ISO-HDLC",
        "sum16",
        "CRC-8/SMBUS",
    ]);
    (fields, framing, check).prop_map(|(fields, framing, check)| {
        let mut bits = 0_usize;
        let mut lines = Vec::new();
        let mut values = Vec::new();
        for (place, (kind, big, share)) in fields.iter().enumerate() {
            let width: usize = match *kind {
                "f32" => 32,
                "f64" => 64,
                "bits(12)" => 12,
                "signed_bits(5)" => 5,
                "bits(3)" => 3,
                kind => kind[1..].parse().unwrap_or(0),
            };
            let packed = kind.ends_with(')');
            if !packed {
                bits = bits.next_multiple_of(8);
            }
            bits += width;
            let order = if packed { "little" } else if *big { "big" } else { "little" };
            let order = match width {
                8 => String::new(),
                _ => format!("order = \"{order}\", "),
            };
            lines.push(format!(
                "{{ is = \"value\", name = \"c{place}\", type = \"{kind}\", {order}scale = 0.5, offset = 3.0 }}"
            ));
            let signed = kind.starts_with('i') || kind.starts_with("signed");
            let top = if width >= 32 { 1e6 } else { f64::from(1 << (width - usize::from(signed))) - 1.0 };
            let number = (share * top).floor() * if signed && share * 100.0 % 2.0 < 1.0 { -1.0 } else { 1.0 };
            values.push(number * 0.5 + 3.0);
        }
        let payload = bits.div_ceil(8);
        let check_bytes = match check {
            "CRC-32/ISO-HDLC" => 4,
            "CRC-8/SMBUS" => 1,
            _ => 2,
        };
        let framing = match framing {
            "fixed" => format!("fixed = {{ length = {}, head = \"aa\" }}", 1 + payload + check_bytes),
            "marked" => "marked = { head = \"aa 55\", tail = \"0d 0a\" }".to_owned(),
            "length" => {
                lines.insert(0, "{ is = \"skip\", bytes = 1 }".into());
                "length = { head = \"aa\", at = 1, type = \"u8\", counts = \"payload\" }".to_owned()
            }
            "cobs" => "cobs = {}".to_owned(),
            _ => "slip = {}".to_owned(),
        };
        let text = format!(
            "schema = 1\nname = \"any\"\nframing.{framing}\npacket = {{ fields = [{}], check = {{ kind = \"{check}\" }} }}\n",
            lines.join(", ")
        );
        match Board::parse("any.toml", &text) {
            Ok(board) => (board, values),
            Err(error) => panic!("{text}\n{error}"),
        }
    })
}

proptest! {
    #[test]
    fn decode_inverts_encode((board, values) in any_board(), copies in 1..4_usize) {
        let frame = Frame { values: values.clone(), ..Frame::default() };
        let mut wire = Vec::new();
        for _ in 0..copies {
            Encoder::new(&board).encode(&frame, &mut wire);
        }
        let frames = decoded(&board, &wire);
        prop_assert_eq!(frames.len(), copies);
        for frame in frames {
            for (found, sent) in frame.values.iter().zip(&values) {
                prop_assert!((found - sent).abs() <= 1e-3 * (1.0 + sent.abs()) * 1e-3, "{} {}", found, sent);
            }
        }
    }

    /// Text of any kind is refused or read, never a panic.
    #[test]
    fn any_text_is_survived(text in "[a-z={}\\[\\]\" 0-9.\n#-]{0,200}") {
        let _ = Board::parse("any.toml", &text);
    }
}

#[test]
fn every_framing_comes_back() {
    for (name, description) in DESCRIPTIONS {
        let board = common::board(description);
        let wire = common::packets(&board, 0..50).concat();
        let frames = decoded(&board, &wire);
        assert_eq!(frames.len(), 50, "{name}");
        for (sequence, frame) in frames.iter().enumerate() {
            let sent = common::frame(&board, sequence as u64);
            assert_eq!(frame.values, sent.values, "{name}");
        }
    }
}

/// A taxel of 64 in packets of five bytes each: twelve bits, counted down from 4095.
#[test]
fn several_packets_make_a_frame() {
    let board = common::board(
        r#"framing.fixed = { length = 5, tail = "00" }
packet = { order = "big", fields = [
  { is = "address", type = "u8", first = 60, count = 64, at = 0 },
  { is = "mark", equals = "01" },
  { is = "value", name = "p", type = "u16", mask = "0x0fff", invert_from = 4095 },
] }"#,
    );
    assert_eq!(board.names().take(2).collect::<Vec<_>>(), ["p.60", "p.61"]);
    let mut wire = Vec::new();
    for round in 0..3_u16 {
        for taxel in 0..64_u8 {
            // The tenth taxel of the second round does not come.
            if round == 1 && taxel == 10 {
                continue;
            }
            let raw = 4095 - (u16::from(taxel) * 7 + round);
            wire.extend_from_slice(&[60 + taxel, 1, (raw >> 8) as u8 | 0xf0, raw as u8, 0]);
        }
    }
    let mut decoder = Decoder::new(&board, Begin::Whole);
    decoder.push(&wire, None);
    decoder.finish();
    let frames: Vec<Frame> = std::iter::from_fn(|| decoder.next()).collect();
    assert_eq!(frames.len(), 2);
    assert_eq!(frames[0].values[9], 63.0);
    assert_eq!(frames[1].values[63], 63.0 * 7.0 + 2.0);
    assert_eq!(decoder.counts().incomplete, 1);
}

/// Modules that send their own messages, told apart by the id in the object; a slow message
/// that is kept; two pages under one CAN id; a counter that must agree.
#[test]
fn other_boards_of_messages() {
    let json = common::board(
        r#"[framing.messages]
carrier = "json"
frame = { all_of = ["left", "right"] }
[[message]]
key = "node"
id = ["left", "right"]
first = 1
fields = [
  { is = "sequence", key = "n" },
  { is = "value", key = "v/0", name = "fx", unit = "N", scale = 0.001 },
  { is = "value", key = "v/1", name = "fz", unit = "N", scale = 0.001, range = [-50, 50] },
]
[[message]]
key = "temperature"
fields = [{ is = "value", key = "temperature", name = "t", unit = "degC" }]"#,
    );
    let names: Vec<_> = json.names().collect();
    assert_eq!(names, ["fx.1", "fz.1", "fx.2", "fz.2", "t"]);
    let wire = br#"{"node":"left","n":1,"v":[100,-200]}
{"temperature":21.5}{"node":"right","n":1,"v":[300,"4e2"]}
{"node":"left","n":2,"v":[1,2]}{"node":"right","n":3,"v":[5,6]}{"node":"left","n":3,"v":[7,8]}
{"node":"left","n":4,"v":[1,99000]}{"node":"up","n":4,"v":[1,2]}{"log":[{"v":{}}]}
"#;
    let mut decoder = Decoder::new(&json, Begin::Whole);
    decoder.push(wire, None);
    decoder.finish();
    let frames: Vec<Frame> = std::iter::from_fn(|| decoder.next()).collect();
    let counts = decoder.counts();
    assert_eq!(frames.len(), 2, "{counts:?}");
    assert_eq!(frames[0].values, [0.1, -0.2, 0.3, 0.4, 21.5]);
    assert_eq!(frames[1].values, [0.007, 0.008, 0.005, 0.006, 21.5]);
    assert_eq!(frames[1].sequence, 3);
    assert_eq!((counts.incomplete, counts.damaged, counts.other), (1, 1, 2));

    let pages = common::board(
        r#"[framing.messages]
carrier = "can"
frame = { within = "2 ms" }
[[message]]
id = "0x181"
extended = true
fields = [{ is = "mark", equals = "01" }, { is = "value", name = "a", type = "i24", order = "big" }]
[[message]]
id = "0x181"
extended = true
fields = [{ is = "mark", equals = "02" }, { is = "value", name = "b", type = "f32", missing = -1 }]
[[message]]
id = [0x201, 0x211]
fields = [{ is = "address", type = "u8", count = 2, first = 5 }, { is = "value", name = "p", type = "bits(12)" }]"#,
    );
    let names: Vec<_> = pages.names().collect();
    assert_eq!(names, ["a", "b", "p.5.0", "p.6.0", "p.5.1", "p.6.1"]);
    let frame = Frame {
        values: vec![-70_000.0, f64::NAN, 1.0, 2.0, 3.0, 4095.0],
        ..Frame::default()
    };
    let mut wire = Vec::new();
    Encoder::new(&pages).encode(&frame, &mut wire);
    let found = decoded(&pages, &wire);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].values[0], -70_000.0);
    assert!(found[0].values[1].is_nan());
    assert_eq!(found[0].values[2..], frame.values[2..]);
    // The first message comes 3 ms before the others: another frame.
    let mut decoder = Decoder::new(&pages, Begin::Whole);
    let second = wire.iter().position(|byte| *byte == b'\r').unwrap_or(0) + 1;
    decoder.push(&wire[..second], Some(0));
    decoder.push(&wire[second..], Some(3_000_000));
    assert_eq!((decoder.next(), decoder.counts().incomplete), (None, 1));
    // The same, after 1 ms.
    decoder.push(&wire[..second], Some(4_000_000));
    assert!(decoder.next().is_some());
}

/// A description behind two lines, the line of its mistake, and a part of the message.
const MISTAKES: [(&str, usize, &str); 28] = [
    (
        "framing.fixed = { length = 4 }\npacket = { fields = [{ is = \"value\", name = \"c{1..4}\", type = \"u8\" }] }",
        3,
        "cannot be decided",
    ),
    (
        "framing.fixed = { length = 5, head = \"aa\" }\npacket = { fields = [{ is = \"value\", name = \"c{1..3}\", type = \"u8\" }] }",
        3,
        "cover 4 bytes of 5",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"value\", name = \"a\", type = \"u16\" }, { is = \"value\", name = \"b\", type = \"u16\", at = 1 }] }",
        4,
        "lies over bytes 1 to 2",
    ),
    (
        "framing.lines = {}\npacket = { fields = [{ is = \"mark\", equals = \"aa\" }] }",
        4,
        "a line has no head",
    ),
    ("framing.lines = { head = \"aa\" }", 3, "unknown field"),
    (
        "framing.fixed = { length = 4, head = \"aa\" }\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u8\" }], check = { kind = \"sum16\", over = [0, 4] } }",
        4,
        "covers itself",
    ),
    (
        "framing.fixed = { length = 4, head = \"aa\" }\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u8\" }], check = { kind = \"sum17\" } }",
        4,
        "sum17",
    ),
    (
        "framing.marked = { head = \"aa\", tail = \"bb\", longest = 8 }\npacket = { fields = [{ is = \"value\", name = \"c{1..9}\", type = \"u8\" }] }",
        3,
        "more than 8",
    ),
    (
        "rate = \"100 Hz\"\nlink.serial = { baud = 1200 }\nframing.fixed = { length = 11, head = \"aa\" }\npacket = { fields = [{ is = \"value\", name = \"c{1..10}\", type = \"u8\" }] }",
        3,
        "1100 bytes in a second",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u12\" }] }",
        4,
        "is no type",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\", unit = \"furlong\" }] }",
        4,
        "no known unit",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\", range = [5, 1] }] }",
        4,
        "the range is empty",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\", unit = \"pF\", range = [\"1 N\", 2] }] }",
        4,
        "is in N",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"sequence\", type = \"f32\" }] }",
        4,
        "whole number without sign",
    ),
    (
        "framing.cobs = {}\npacket = { fields = [{ is = \"skip\", bytes = 2 }] }",
        4,
        "no field is a value",
    ),
    (
        "framing.cobs = {}\nwiring = [\"d\"]\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\" }] }",
        4,
        "no value is called \"d\"",
    ),
    (
        "framing.lines = { template = \"A {volts x}\" }",
        3,
        "none of",
    ),
    (
        "framing.lines = { template = [\"A {value x}\", \"B {value y}\"] }",
        3,
        "several lines",
    ),
    (
        "framing.length = { head = \"aa\", at = 0, type = \"u8\", counts = \"all\" }\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\" }] }",
        3,
        "behind the head",
    ),
    (
        "framing.cobs = {}\nlink.serial = { baud = 1 }\npacket = { fields = [{ is = \"value\", name = \"c\", type = \"u16\" }] }",
        4,
        "at least 50",
    ),
    (
        "framing.messages = { carrier = \"can\" }",
        3,
        "no message is described",
    ),
    (
        "framing.messages = { carrier = \"can\" }\n[[message]]\nid = 0x713\nfields = [{ is = \"value\", name = \"c{1..33}\", type = \"u16\" }]",
        6,
        "at most 64",
    ),
    (
        "framing.messages = { carrier = \"can\" }\n[[message]]\nid = 0x20000000\nfields = [{ is = \"value\", name = \"c\", type = \"u16\" }]",
        5,
        "is no id",
    ),
    (
        "framing.messages = { carrier = \"can\", frame = { ends_with = 0x7 } }\n[[message]]\nid = 8\nfields = [{ is = \"value\", name = \"c\", type = \"u16\" }]",
        3,
        "no message has the id 0x7",
    ),
    (
        "framing.messages = { carrier = \"can\" }\n[[message]]\nid = 8\nfields = [{ is = \"value\", name = \"c\", type = \"u16\", unit = \"furlong\" }]",
        6,
        "no known unit",
    ),
    (
        "framing.messages = { carrier = \"json\" }\n[[message]]\nid = 8\nfields = [{ is = \"value\", name = \"c\", key = \"c\" }]",
        5,
        "where does the id stand",
    ),
    (
        "framing.messages = { carrier = \"json\" }\n[[message]]\nfields = [{ is = \"value\", name = \"c\" }]",
        5,
        "where does it stand",
    ),
    (
        "framing.cobs = {}\n[[message]]\nid = 8\nfields = [{ is = \"value\", name = \"c\", type = \"u16\" }]",
        5,
        "told apart by marks",
    ),
];

#[test]
fn mistakes_are_shown_at_their_word() {
    let head = "schema = 1\nname = \"b\"\n";
    for (text, line, part) in MISTAKES {
        let text = format!("{head}{text}\n");
        match Board::parse("b.toml", &text) {
            Ok(_) => panic!("accepted:\n{text}"),
            Err(error) => {
                let shown = error.to_string();
                assert!(shown.contains(part), "{part}: {shown}");
                assert_eq!(
                    error.place.as_ref().map(|place| place.line),
                    Some(line),
                    "{shown}"
                );
            }
        }
    }
}

/// A description behind two lines, the very words that are marked, and a part of the message.
const MARKED: [(&str, &str, &str); 22] = [
    (
        "framing.lines = { template = \"A {value x},{volts y}\" }",
        "{volts y}",
        "none of",
    ),
    (
        "framing.lines = { template = [\"A {value x}\", \"B {time s}{time s}\"] }",
        "{time s}",
        "a second time",
    ),
    (
        "framing.lines = { template = \"{sequence},{value µ},{sequence}\" }",
        "{sequence}",
        "a second sequence",
    ),
    (
        "framing.lines = { template = \"A {value x furlong}\" }",
        "{value x furlong}",
        "no known unit",
    ),
    (
        "framing.lines = { template = \"A {time ms}\" }",
        "\"A {time ms}\"",
        "no line has a value",
    ),
    (
        "framing.lines = {}\npacket.fields = [{ is = \"time\", unit = \"s\" }, { is = \"time\", unit = \"s\" }, { is = \"value\", name = \"x\" }]",
        "\"time\"",
        "a second time",
    ),
    ("framing.cobs = {}", "framing", "no field is a value"),
    (
        "framing.fixed = { length = 4, head = \"aa\" }\npacket.fields = [{ is = \"value\", name = \"c{1..5}\", type = \"u8\" }]",
        "4",
        "write length = 6",
    ),
    (
        "framing.fixed = { length = 9, head = \"aa\" }\npacket.fields = [{ is = \"value\", name = \"c{1..5}\", type = \"u8\" }]",
        "9",
        "bytes = 3 }",
    ),
    (
        "framing.fixed = { length = -9, head = \"aa\" }",
        "-9",
        "a whole number of 0 or more",
    ),
    (
        "framing.lines = {}\nlink.serial = { baud = \"fast\" }",
        "\"fast\"",
        "a whole number from 0 to 4294967295 is needed here, not the text \"fast\"",
    ),
    (
        "framing.cobs = {}\npacket.order = \"middle\"",
        "\"middle\"",
        "write one of: \"little\"; \"big\"",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"sequence\", type = \"u8\", range = [5, 2] }]",
        "[5, 2]",
        "`range` says nothing of a sequence",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"u16\", missing = 70000 }]",
        "70000",
        "from 0 to 65535",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"i16\", missing = -1.5 }]",
        "-1.5",
        "from -32768 to 32767",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"u16\", mask = \"0x1ffff\" }]",
        "\"0x1ffff\"",
        "from 0x1 to 0xffff",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"u16\", mask = -1 }]",
        "-1",
        "a whole number of 0 or more",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"u8\", shift = 8 }]",
        "8",
        "at most 7",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"status\", type = \"u8\", good = 256 }, { is = \"value\", name = \"c\", type = \"u8\" }]",
        "256",
        "never comes",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"value\", name = \"c\", type = \"u8\", scale = 0.5, range = [200, 300] }]",
        "[200, 300]",
        "from 0 to 127.5",
    ),
    (
        "framing.cobs = {}\npacket.fields = [{ is = \"address\", type = \"u8\", first = 250, count = 64 }, { is = \"value\", name = \"c\", type = \"u8\" }]",
        "64",
        "never come all",
    ),
    (
        "framing.messages = { carrier = \"json\" }\n[[message]]\nfields = [{ is = \"time\", key = \"t\", unit = \"s\" }, { is = \"time\", key = \"u\", unit = \"s\" }, { is = \"value\", name = \"c\", key = \"c\" }]",
        "\"time\"",
        "one of each",
    ),
];

#[test]
fn the_very_words_are_marked() {
    for (text, words, part) in MARKED {
        let text = format!("schema = 1\nname = \"b\"\n{text}\n");
        let Err(error) = Board::parse("b.toml", &text) else {
            panic!("accepted:\n{text}");
        };
        let shown = error.to_string();
        assert!(shown.contains(part), "{part}: {shown}");
        let place = error.place.as_ref().map(|place| {
            let marked = place.text.chars().skip(place.column - 1);
            marked.take(place.width).collect::<String>()
        });
        assert_eq!(place.as_deref(), Some(words), "{shown}");
    }
    let error = Board::parse("b.toml", "schema = 1\nframing.lines = {}\n").map(|_| ());
    let shown = error.map_or_else(|error| error.to_string(), |()| String::new());
    assert!(shown.contains("`taxel schema board`"), "{shown}");
}

#[test]
fn committed_schema_and_reference_are_current() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (of, file, printed) in [
        (
            "board",
            "crates/taxel-board/boards/board.schema.json",
            Board::json_schema(),
        ),
        (
            "board-reference",
            "docs/book/board-file-reference.md",
            Board::reference(),
        ),
    ] {
        let committed = std::fs::read_to_string(root.join(file)).unwrap_or_default();
        assert!(
            committed.replace("\r\n", "\n") == printed,
            "{file} is stale: run `cargo run -- schema {of} > {file}`"
        );
    }
}

#[test]
fn channels_are_a_grid_where_the_file_or_their_names_say_so() {
    let board = |names: &str, layout: &str| {
        let text = format!(
            "schema = 1\nname = \"mat\"\n{layout}\n[framing.lines]\ntemplate = \"{{value {names}}}\"\n"
        );
        Board::parse("mat.toml", &text)
    };
    let grid = |names: &str, layout: &str| {
        let stream = board(names, layout).map(|board| board.stream());
        stream.map(|stream| (stream.rows, stream.columns, stream.present.len()))
    };
    let stated = "layout = { rows = 2, columns = 3 }";
    assert_eq!(grid("c{1..6}", stated).unwrap(), (2, 3, 6));
    assert_eq!(grid("r{0..11}c{0..31}", "").unwrap(), (12, 32, 384));
    assert_eq!(grid("{thumb,index,palm}", "").unwrap(), (1, 3, 3));
    let wrong = board("c{1..5}", stated)
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(
        wrong.contains("2 x 3 is not the number of channels, 5"),
        "{wrong}"
    );
    assert!(
        wrong.contains("layout = { rows = 12, columns = 32 }"),
        "{wrong}"
    );
}
