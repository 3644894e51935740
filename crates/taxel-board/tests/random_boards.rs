//! Boards by chance: framing x fields x counter x clock, encoded, damaged, decoded. Nothing is
//! invented, and what does not come is counted.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::too_many_lines,
    reason = "a panic is how a test fails, what was not drafted is printed, and one choice follows the other"
)]

use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use taxel_board::{Begin, Board, Decoder, Encoder, draft};
use taxel_recording::Frame;

/// Packets of a run.
const PACKETS: usize = 240;

/// A board, and what its bytes may suffer so that it must show.
#[derive(Debug)]
struct Made {
    text: String,
    board: Board,
    /// True if one changed byte of a packet is always seen, and if any damage is.
    checked: bool,
    well_checked: bool,
    counted: bool,
    /// Frames of a packet, and the framing as a draft writes it, where a draft can find it.
    frames: usize,
    drafted: Option<&'static str>,
}

fn one_of<T: Copy>(random: &mut SmallRng, choices: &[T]) -> T {
    choices[random.random_range(0..choices.len())]
}

fn made(seed: u64) -> Made {
    let mut random = SmallRng::seed_from_u64(seed);
    let framing = one_of(
        &mut random,
        &[
            "fixed", "tailed", "marked", "length", "cobs", "slip", "lines", "json",
        ],
    );
    let text = matches!(framing, "lines" | "json");
    let values = random.random_range(1..25);
    let kinds: &[(&str, usize)] = &[
        ("u8", 1),
        ("i16", 2),
        ("u16", 2),
        ("u24", 3),
        ("i32", 4),
        ("f32", 4),
        ("sevens(2)", 2),
    ];
    let (kind, bytes) = one_of(&mut random, kinds);
    let order = one_of(&mut random, &["little", "big"]);
    let check = one_of(
        &mut random,
        &["", "sum8", "xor8", "CRC-16/ARC", "CRC-32/ISO-HDLC"],
    );
    // A packet between head and tail, or of a length that it says, is told by its check.
    let check = match framing {
        "marked" | "length" if check.is_empty() => "CRC-16/MODBUS",
        _ if text => "",
        _ => check,
    };
    let check_bytes = match check {
        "" => 0,
        "sum8" | "xor8" => 1,
        "CRC-32/ISO-HDLC" => 4,
        _ => 2,
    };
    let counter = one_of(&mut random, &["", "u8", "u16", "u32"]);
    let counting = one_of(&mut random, &["", ", step = 2", ", modulus = 200"]);
    let clock = one_of(&mut random, &["", "u32", "u64"]);
    let unit = one_of(&mut random, &["us", "ms"]);
    let frames = if text || counter.is_empty() {
        1
    } else {
        one_of(&mut random, &[1, 1, 1, 4])
    };
    let mut fields = Vec::new();
    let mut length = check_bytes;
    let key = |key: &str| {
        if framing == "json" {
            format!(", key = \"{key}\"")
        } else {
            String::new()
        }
    };
    if framing == "length" {
        fields.push("{ is = \"skip\", bytes = 1 }".to_owned());
        length += 1;
    }
    if !counter.is_empty() {
        fields.push(format!(
            "{{ is = \"sequence\", type = \"{counter}\"{counting}{} }}",
            key("n")
        ));
        length += counter[1..].parse::<usize>().unwrap() / 8;
    }
    if !clock.is_empty() {
        fields.push(format!(
            "{{ is = \"time\", type = \"{clock}\", unit = \"{unit}\"{} }}",
            key("t")
        ));
        length += clock[1..].parse::<usize>().unwrap() / 8;
    }
    let own = if text {
        String::new()
    } else {
        format!(", type = \"{kind}\"")
    };
    fields.push(format!(
        "{{ is = \"value\", name = \"c{{1..{values}}}\"{own}{} }}",
        key("v")
    ));
    length += frames * values * bytes;
    let fields = fields.join(", ");
    let (framing, drafted) = match framing {
        "fixed" => (
            format!("fixed = {{ length = {}, head = \"a5 5a\" }}", length + 2),
            Some(format!("length = {}", length + 2)),
        ),
        "tailed" => (
            format!("fixed = {{ length = {}, tail = \"0d 0a\" }}", length + 2),
            Some(format!("length = {}", length + 2)),
        ),
        "marked" => ("marked = { head = \"aa 55 01\", tail = \"0d 0a\" }".to_owned(), None),
        "length" => (
            "length = { head = \"aa 55\", at = 2, type = \"u8\", counts = \"rest\", longest = 600 }".to_owned(),
            None,
        ),
        "cobs" => ("cobs = {}".to_owned(), Some("[framing.cobs]".to_owned())),
        "slip" => ("slip = {}".to_owned(), Some("[framing.slip]".to_owned())),
        "lines" => ("lines = {}".to_owned(), Some("[framing.lines]".to_owned())),
        _ => ("messages.carrier = \"json\"".to_owned(), Some("json".to_owned())),
    };
    let samples = if frames > 1 {
        format!("\nsamples = {{ count = {frames} }}")
    } else {
        String::new()
    };
    let check_of_packet = if check.is_empty() {
        String::new()
    } else {
        format!("\ncheck = {{ kind = \"{check}\" }}")
    };
    let head =
        format!("schema = 1\nname = \"board {seed}\"\nrate = \"100 Hz\"\nframing.{framing}\n");
    let file = if framing.contains("json") {
        format!("{head}[[message]]\nfields = [{fields}]\n")
    } else if text {
        format!("{head}[packet]\nfields = [{fields}]\n")
    } else {
        format!(
            "{head}[packet]\norder = \"{order}\"\nfields = [{fields}]{check_of_packet}{samples}\n"
        )
    };
    let too_long = framing.starts_with("length") && length > 250;
    if too_long {
        // A length of one byte cannot say it.
        return made(seed + 1_000_003);
    }
    let board = Board::parse("board", &file).unwrap_or_else(|error| panic!("{file}\n{error}"));
    let stuffed = file.contains("cobs") || file.contains("slip");
    let draftable = frames == 1 && kind != "sevens(2)";
    Made {
        text: file,
        board,
        // One changed byte of a stuffed packet may change others too.
        checked: check.contains("CRC") || (!check.is_empty() && !stuffed),
        well_checked: check.contains("CRC"),
        counted: !counter.is_empty(),
        frames,
        drafted: drafted.filter(|_| draftable).map(|words| &*words.leak()),
    }
}

/// The packets of a run, each with its bytes, and the frames that were sent.
fn sent(made: &Made) -> (Vec<Vec<u8>>, Vec<Vec<f64>>) {
    let mut encoder = Encoder::new(&made.board);
    let (mut packets, mut frames) = (Vec::new(), Vec::new());
    for n in 0..(PACKETS * made.frames) as u64 {
        // Up and down by one, so that no step is unusual.
        let wave = |n: u64| n.abs_diff(n / 100 * 100 + 50);
        let values = (0..made.board.values().len() as u64).map(|value| (wave(n) + value) as f64);
        let frame = Frame {
            sequence: n,
            time_ns: n * 10_000_000,
            values: values.collect(),
            ..Frame::default()
        };
        frames.push(frame.values.clone());
        let mut packet = Vec::new();
        encoder.encode(&frame, &mut packet);
        if !packet.is_empty() {
            packets.push(packet);
        }
    }
    (packets, frames)
}

fn try_board(seed: u64) {
    let made = made(seed);
    let (packets, frames) = sent(&made);
    let mut random = SmallRng::seed_from_u64(seed ^ 0x5eed);
    let mut wire = Vec::new();
    let mut gone = Vec::new();
    let mut next = 5;
    for (n, packet) in packets.iter().enumerate() {
        // Some whole packets between two faults: which packet a fault costs is then known.
        if n != next || n + 6 > PACKETS {
            wire.extend_from_slice(packet);
            continue;
        }
        next = n + random.random_range(6..12);
        gone.push(n);
        // Without a check only a packet that is not there must show, by the counter; one of 8 bits
        // passes a packet that goes on with another one time in 256.
        let faults = match (made.checked, made.well_checked) {
            (_, true) => 3,
            (true, false) => 2,
            (false, false) => 1,
        };
        let fault = random.random_range(0..faults);
        let mut packet = packet.clone();
        let at = random.random_range(0..packet.len());
        match fault {
            0 => packet.clear(),
            1 => packet[at] ^= 1 << random.random_range(0..8),
            _ => packet.truncate(at),
        }
        wire.extend_from_slice(&packet);
    }
    let mut decoder = Decoder::new(&made.board, Begin::Whole);
    // In pieces of any size, as a port gives them.
    let mut rest = &wire[..];
    while !rest.is_empty() {
        let (piece, behind) = rest.split_at(random.random_range(1..=rest.len().min(700)));
        decoder.push(piece, None);
        rest = behind;
    }
    decoder.finish();
    let found: Vec<Frame> = std::iter::from_fn(|| decoder.next()).collect();
    let counts = decoder.counts();
    let case = format!("seed {seed}\n{}\n{counts:?}", made.text);
    // Nothing is invented: every frame was sent, in this order.
    let mut at = 0;
    for frame in &found {
        let sent = if made.counted {
            frame.sequence as usize
        } else {
            let sent = frames[at..]
                .iter()
                .position(|values| *values == frame.values);
            at + sent.unwrap_or_else(|| panic!("{frame:?} was not sent\n{case}"))
        };
        assert!(
            sent >= at && frames[sent] == frame.values,
            "{frame:?}\n{case}"
        );
        at = sent + 1;
    }
    // A fault may cost the packet beside it where only the next one shows where one begins.
    let least = frames.len() - 3 * made.frames * gone.len();
    assert!(
        (least..=frames.len()).contains(&found.len()),
        "{} of {}\n{case}",
        found.len(),
        frames.len()
    );
    // Everything is counted.
    let missing = (frames.len() - found.len()) as u64;
    if made.counted {
        assert_eq!(counts.lost, Some(missing), "{case}");
        assert_eq!(
            (counts.duplicate, counts.late, counts.restarts),
            (0, 0, 0),
            "{case}"
        );
    } else if made.checked {
        assert!(missing == 0 || counts.damaged > 0, "{case}");
    }
}

/// Whether a draft of the undamaged bytes finds framing and length, where it is made to.
fn is_drafted(seed: u64) -> Option<bool> {
    let made = made(seed);
    let words = made.drafted?;
    let wire = sent(&made).0.concat();
    let found = draft(&wire, None);
    let file = found.as_ref().map_or("", |found| found.file.as_str());
    let whole = Board::parse("draft", file).is_ok_and(|board| {
        let mut decoder = Decoder::new(&board, Begin::Whole);
        decoder.push(&wire, None);
        decoder.finish();
        // The first packet, or one at a turn of a counter, may be none of the draft's.
        std::iter::from_fn(|| decoder.next()).count() + 2 >= PACKETS
    });
    let right = whole && file.contains(words);
    if !right {
        let why = found.as_ref().err();
        println!("seed {seed}\n{}\n{file}\n{why:?}", made.text);
    }
    Some(right)
}

#[test]
fn fifty_boards_invent_nothing_and_count_everything() {
    (0..50).for_each(try_board);
}

#[test]
#[ignore = "takes a minute: two thousand boards"]
fn two_thousand_boards_invent_nothing_and_count_everything() {
    (1000..3000).for_each(try_board);
}

/// Of thirty of them framing and length are found by their bytes alone.
#[test]
fn thirty_boards_are_drafted() {
    let found: Vec<bool> = (0..).filter_map(is_drafted).take(30).collect();
    assert!(found.iter().all(|right| *right), "{found:?}");
}
