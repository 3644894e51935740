//! `listen`: from bytes that nobody described to a board file that reads them.

mod common;

use common::DESCRIPTIONS;
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use taxel_board::{Begin, Board, Decoder, Encoder, draft, listen};
use taxel_recording::Frame;

/// Two seconds at 100 Hz of a board whose values wander, from the middle of a packet on.
fn two_seconds(board: &Board, seed: u64) -> Vec<u8> {
    let mut random = SmallRng::seed_from_u64(seed);
    let units: Vec<f64> = board
        .channels()
        .map(|value| value.unit.si_per_unit)
        .collect();
    let mut values: Vec<f64> = units
        .iter()
        .map(|unit| unit * random.random_range(20.0..60.0))
        .collect();
    let mut encoder = Encoder::new(board);
    let mut wire = Vec::new();
    for sequence in 0..201 {
        for (value, unit) in values.iter_mut().zip(&units) {
            *value = (*value + unit * random.random_range(-1.0..1.0_f64)).clamp(0.0, 100.0 * unit);
        }
        let frame = Frame {
            sequence,
            time_ns: sequence * 10_000_000 + random.random_range(0..200_000),
            values: values.clone(),
            ..Frame::default()
        };
        encoder.encode(&frame, &mut wire);
    }
    wire.drain(..random.random_range(1..wire.len() / 201));
    wire
}

/// Frames that a drafted file finds.
fn frames(file: &str, wire: &[u8]) -> Vec<Frame> {
    let board = Board::parse("draft", file).unwrap_or_else(|error| panic!("{file}\n{error}"));
    let mut decoder = Decoder::new(&board, Begin::Cut);
    decoder.push(wire, None);
    decoder.finish();
    std::iter::from_fn(|| decoder.next()).collect()
}

#[test]
fn shipped_boards_are_known_and_drafted() {
    for name in Board::shipped_names() {
        let board = Board::shipped(name).expect("shipped files are right");
        let wire = two_seconds(&board, 1);
        let found = listen(&wire, None).unwrap_or_else(|tried| panic!("{name}: {tried:?}"));
        assert!(found.shipped.is_some() || board.says_hello(), "{name}");
        assert!(frames(&found.file, &wire).len() >= 195, "{name}");
        // As if nobody had described it.
        let found = draft(&wire, None).unwrap_or_else(|tried| panic!("{name}: {tried:?}"));
        assert!(found.shipped.is_none());
        let count = frames(&found.file, &wire).len();
        assert!(
            (195..=201).contains(&count),
            "{name}: {count}\n{}",
            found.file
        );
    }
}

/// What a draft says of check and counter is what the board has.
#[test]
fn boards_of_every_framing_are_drafted() {
    for (name, description) in DESCRIPTIONS {
        let board = common::board(description);
        let wire = two_seconds(&board, 2);
        let found = draft(&wire, None).unwrap_or_else(|tried| panic!("{name}: {tried:?}"));
        let count = frames(&found.file, &wire).len();
        assert!(
            (195..=201).contains(&count),
            "{name}: {count}\n{}",
            found.file
        );
        let packets = !board.carries_text();
        if packets && description.contains("check = ") {
            assert!(
                found.file.contains("check = { kind = "),
                "{name}\n{}",
                found.file
            );
        }
        assert_eq!(
            found.file.contains("\"sequence\"") || found.file.contains("{sequence}"),
            description.contains("sequence") && !description.contains("carrier = \"can\""),
            "{name}\n{}",
            found.file
        );
    }
}

/// Boards of other lengths, types and orders: framing, length and the numbers come back.
#[test]
fn boards_that_were_made_up_are_drafted() {
    let framings = [
        "fixed = { length = LENGTH, head = \"a5 5a\" }",
        "fixed = { length = LENGTH, tail = \"0d 0a\" }",
        "cobs = {}",
        "slip = {}",
    ];
    let types = [
        ("u8", 1, ""),
        ("i16", 2, ""),
        ("u16", 2, ", order = \"big\""),
        ("i24", 3, ", order = \"big\""),
        ("f32", 4, ""),
    ];
    let (mut tried, mut right) = (0, 0);
    for (index, framing) in framings.into_iter().enumerate() {
        for (kind, bytes, order) in types {
            for counter in ["u8", "u16", ""] {
                let channels = 3 + 5 * (tried % 4);
                let own = match counter {
                    "u8" => 1,
                    "u16" => 2,
                    _ => 0,
                };
                let checked = index > 1;
                let marks = if checked { 0 } else { 2 };
                let length = marks + own + channels * bytes;
                let framing = framing.replace("LENGTH", &length.to_string());
                let sequence = match counter {
                    "" => String::new(),
                    kind => format!("{{ is = \"sequence\", type = \"{kind}\" }}, "),
                };
                let check = if checked {
                    ", check = { kind = \"CRC-16/ARC\" }"
                } else {
                    ""
                };
                let text = format!(
                    "schema = 1\nname = \"any\"\nframing.{framing}\npacket = {{ fields = [{sequence}{{ is = \"value\", name = \"c{{1..{channels}}}\", type = \"{kind}\"{order} }}]{check} }}\n"
                );
                let board =
                    Board::parse("any", &text).unwrap_or_else(|error| panic!("{text}\n{error}"));
                let wire = two_seconds(&board, 100 + tried as u64);
                let found = draft(&wire, None).unwrap_or_else(|why| panic!("{text}\n{why:?}"));
                let count = frames(&found.file, &wire).len();
                assert!(
                    (195..=201).contains(&count),
                    "{text}\n{count}\n{}",
                    found.file
                );
                let numbers = Board::parse("draft", &found.file).map(|board| board.values().len());
                let is_right = numbers.is_ok_and(|numbers| numbers == channels);
                if !is_right {
                    println!("{text}{}", found.file);
                }
                right += usize::from(is_right);
                tried += 1;
            }
        }
    }
    println!("{right} of {tried} drafts have the channels and the type");
    assert!(tried == 60 && right >= 57, "{right} of {tried}");
}

/// Noise is nothing, and few packets hold no claim.
#[test]
fn nothing_is_claimed_of_noise_and_of_few_packets() {
    let mut random = SmallRng::seed_from_u64(7);
    for length in [0, 1, 1000, 40_000] {
        let noise: Vec<u8> = (0..length).map(|_| random.random()).collect();
        assert!(listen(&noise, None).is_err(), "{length}");
    }
    let board = common::board(DESCRIPTIONS[0].1);
    let wire = two_seconds(&board, 3);
    let short = &wire[..40 * wire.len() / 200];
    if let Ok(draft) = draft(short, None) {
        assert!(!draft.file.contains("check = {"), "{}", draft.file);
    }
}

/// Rows between blank lines, and a check with a byte behind it.
#[test]
fn rows_and_a_byte_behind_the_check_are_drafted() {
    let rows =
        "framing.lines = { rows = 4 }\npacket.fields = [{ is = \"value\", name = \"c{0..7}\" }]";
    let behind = "framing.fixed = { length = 23, head = \"05\" }\npacket = { fields = [{ is = \"value\", name = \"f{1..10}\", type = \"u16\" }, { is = \"check\" }, { is = \"skip\", bytes = 1 }], check = { kind = \"CRC-8/SMBUS\" } }";
    for (description, words, values) in [(rows, "rows = 4", 32), (behind, "CRC-8/SMBUS", 10)] {
        let board = common::board(description);
        let wire = two_seconds(&board, 5);
        let found = draft(&wire, None).unwrap_or_else(|tried| panic!("{tried:?}"));
        assert!(found.file.contains(words), "{}", found.file);
        let count = frames(&found.file, &wire).len();
        assert!((195..=201).contains(&count), "{count}\n{}", found.file);
        let drafted = Board::parse("draft", &found.file).map(|board| board.values().len());
        assert_eq!(drafted.ok(), Some(values), "{}", found.file);
    }
}
