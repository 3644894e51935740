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

/// Bytes that stand still while a board is listened to and move later: the draft goes on reading it.
#[test]
fn a_draft_reads_on_when_still_bytes_move() {
    let sequence = |kind: &str| format!("{{ is = \"sequence\", type = \"{kind}\" }}, ");
    let boards = [
        ("head", "u16", "big", 8, String::new()),
        ("head", "i16", "little", 5, String::new()),
        ("head", "i24", "big", 6, String::new()),
        ("head", "i32", "big", 4, sequence("u8")),
        ("head", "u16", "big", 6, sequence("u16")),
        ("tail", "u16", "little", 7, String::new()),
        ("tail", "i32", "little", 3, sequence("u16")),
        ("head", "i8", "little", 48, String::new()),
        ("tail", "i8", "little", 48, sequence("u8")),
    ];
    for (mark, kind, order, count, sequence) in boards {
        let bytes = kind[1..].parse::<usize>().expect("bits") / 8;
        let counter = match sequence.len() {
            0 => 0,
            _ if sequence.contains("u16") => 2,
            _ => 1,
        };
        let length = 2 + counter + count * bytes;
        let text = format!(
            "framing.fixed = {{ length = {length}, {mark} = \"a5 5a\" }}\npacket = {{ order = \"{order}\", fields = [{sequence}{{ is = \"value\", name = \"c{{1..{count}}}\", type = \"{kind}\" }}] }}"
        );
        let board = common::board(&text);
        // Readings near one number at first, and over all numbers of one byte or of two later.
        let wire = |from: u64, quiet: bool| {
            let mut random = SmallRng::seed_from_u64(from);
            let mut encoder = Encoder::new(&board);
            let mut wire = Vec::new();
            let middle = if bytes == 1 { 3.0 } else { f64::from(0x1240) };
            for sequence in from..from + 190 {
                let far = if quiet {
                    0.0
                } else {
                    8.0 * (sequence - from) as f64
                };
                let value = |_| {
                    let off = if bytes == 1 { far.min(90.0) } else { far };
                    middle + off + f64::from(random.random_range(-4..=4_i8))
                };
                let frame = Frame {
                    sequence,
                    time_ns: sequence * 10_000_000,
                    values: (0..count).map(value).collect(),
                    ..Frame::default()
                };
                encoder.encode(&frame, &mut wire);
            }
            wire
        };
        let found =
            draft(&wire(0x1203, true), None).unwrap_or_else(|why| panic!("{text}\n{why:?}"));
        let later = wire(0x12d0, false);
        let (sent, read) = (frames(&text_of(&text), &later), frames(&found.file, &later));
        assert!(read.len() + 2 >= sent.len(), "{text}\n{}", found.file);
        let sent: Vec<&[f64]> = sent.iter().map(|frame| &*frame.values).collect();
        let read: Vec<&[f64]> = read.iter().map(|frame| &*frame.values).collect();
        assert!(are_those(&sent, &read), "{text}\n{}", found.file);
    }
}

/// True if readings are those that were sent. The first packets may be cut, or be needed to find where
/// one begins.
fn are_those(sent: &[&[f64]], read: &[&[f64]]) -> bool {
    read.len() + 5 >= sent.len()
        && (0..4).any(|begin| {
            let pairs = sent[begin..].iter().zip(read);
            pairs.filter(|(sent, read)| sent == read).count() + 5 >= sent.len()
        })
}

/// A description as a whole file.
fn text_of(description: &str) -> String {
    format!("schema = 1\nname = \"any\"\n{description}\n")
}

/// A counter in text that begins again says where.
#[test]
fn a_text_counter_that_begins_again_says_where() {
    let lines = |begin: u64, object: bool| -> Vec<u8> {
        let line = |n: u64| {
            let (count, value) = (n % begin, 500 + n * n % 7);
            if object {
                format!("{{\"n\":{count},\"a\":{value}}}\n")
            } else {
                format!("{count},{value}\n")
            }
        };
        (0..600).flat_map(|n| line(n).into_bytes()).collect()
    };
    for (begin, object) in [(256, false), (200, false), (100, true)] {
        let wire = lines(begin, object);
        let found = draft(&wire, None).expect("lines of numbers");
        assert!(
            found.file.contains(&format!("modulus = {begin}")),
            "{}",
            found.file
        );
        let board = Board::parse("draft", &found.file).expect("a draft is sound");
        let mut decoder = Decoder::new(&board, Begin::Whole);
        decoder.push(&wire, None);
        decoder.finish();
        while decoder.next().is_some() {}
        let counts = decoder.counts();
        assert_eq!(
            (counts.delivered, counts.lost, counts.restarts),
            (600, Some(0), 0),
            "{}",
            found.file
        );
    }
}

/// A reading that wanders between two numbers, as `n` goes on.
fn wandering(n: u64, channel: u64, [low, high]: [f64; 2]) -> f64 {
    let mut random = SmallRng::seed_from_u64(channel);
    let [phase, period] = [
        random.random_range(0.0..6.0_f64),
        random.random_range(31.0..83.0),
    ];
    let flicker = SmallRng::seed_from_u64(1000 * channel + n).random_range(-0.02..0.02);
    let wave = 0.5 + 0.45 * (phase + n as f64 / period).sin() + flicker;
    low + (high - low) * wave
}

/// A layout that was published with firmware, and what its readings are.
struct Published {
    name: &'static str,
    /// Bytes of the packet `n` and its readings.
    packet: fn(u64) -> (Vec<u8>, Vec<f64>),
}

/// Layouts of firmware of strangers, by their published descriptions.
const PUBLISHED: [Published; 12] = [
    Published {
        name: "glove of ten bend sensors of 7 bits and a battery between 0xf0 and 0xf7",
        packet: |n| {
            let bends = (0..10).map(|c| wandering(n, c, [0.0, 127.0]).round());
            let values: Vec<f64> = bends.collect();
            let bytes = values.iter().map(|value| *value as u8);
            // A battery moves more slowly than is listened.
            let bytes = [0xf0, 1, 11].into_iter().chain(bytes).chain([94, 0xf7]);
            (bytes.collect(), values)
        },
    },
    Published {
        name: "glove of angles between bars, tilde and semicolon",
        packet: |n| {
            let values: Vec<f64> = (0..8)
                .map(|c| (100.0 * wandering(n, c, [-50.0, 90.0])).round() / 100.0)
                .collect();
            let text = |of: &[f64]| {
                of.iter()
                    .map(|v| format!("{v:.2}"))
                    .collect::<Vec<_>>()
                    .join("|")
            };
            (
                format!("{}~{};\r\n", text(&values[..5]), text(&values[5..])).into_bytes(),
                values,
            )
        },
    },
    Published {
        name: "glove of an attitude, raw and smoothed bends with letters between them",
        packet: |n| {
            let values: Vec<f64> = (0..13)
                .map(|c| match c {
                    0..3 => (10.0 * wandering(n, c, [-90.0, 90.0])).round() / 10.0,
                    3..8 => wandering(n, c, [500.0, 3500.0]).round(),
                    _ => (100.0 * wandering(n, c, [0.0, 1.0])).round() / 100.0,
                })
                .collect();
            let text = |of: &[f64]| of.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
            let line = format!(
                "IMU,{},S,{},N,{}\n",
                text(&values[..3]),
                text(&values[3..8]),
                text(&values[8..])
            );
            (line.into_bytes(), values)
        },
    },
    Published {
        name: "mat of 15 x 14, one line of blanks",
        packet: |n| {
            let values: Vec<f64> = (0..210)
                .map(|c| wandering(n, c, [0.0, 1023.0]).round())
                .collect();
            let text = values
                .iter()
                .map(f64::to_string)
                .collect::<Vec<_>>()
                .join(" ");
            (format!("{text}\r\n").into_bytes(), values)
        },
    },
    Published {
        name: "hand of 181 numbers behind 55 aa, and a CRC",
        packet: |n| {
            let values: Vec<f64> = (0..181)
                .map(|c| wandering(n, c, [0.0, 4000.0]).round())
                .collect();
            let mut bytes = vec![0x55, 0xaa];
            bytes.extend(
                values
                    .iter()
                    .flat_map(|value| (*value as u16).to_le_bytes()),
            );
            let sum = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(&bytes);
            bytes.extend(sum.to_le_bytes());
            (bytes, values)
        },
    },
    Published {
        name: "barometer behind three start bytes and its type",
        packet: |n| {
            let value = f32::to_bits(wandering(n, 1, [98_000.0, 104_000.0]) as f32);
            let warm = f32::to_bits(wandering(n, 2, [18.0, 31.0]) as f32);
            let mut bytes = vec![0xaa, 0xaa, 0xaa, 0x01];
            bytes.extend(warm.to_le_bytes());
            bytes.extend(value.to_le_bytes());
            (
                bytes,
                vec![
                    f64::from(f32::from_bits(warm)),
                    f64::from(f32::from_bits(value)),
                ],
            )
        },
    },
    Published {
        name: "object of nested lists and numbers with a time",
        packet: |n| {
            let bends: Vec<f64> = (0..5)
                .map(|c| wandering(n, c, [1800.0, 2300.0]).round())
                .collect();
            let angles: Vec<f64> = (5..9)
                .map(|c| (10.0 * wandering(n, c, [-20.0, 20.0])).round() / 10.0)
                .collect();
            let line = format!(
                "{{\"flex_sensors\": {bends:?}, \"mpu6050\": {{\"accel_x\": {:?}, \"accel_y\": {:?}, \"pitch\": {:?}, \"roll\": {:?}}}, \"timestamp\": {}}}\n",
                angles[0],
                angles[1],
                angles[2],
                angles[3],
                123_456 + 10 * n
            );
            (line.into_bytes(), [bends, angles].concat())
        },
    },
    Published {
        name: "four smoothed bends, one line of blanks",
        packet: |n| {
            let values: Vec<f64> = (0..4)
                .map(|c| wandering(n, c, [32.0, 127.0]).round())
                .collect();
            let text = values
                .iter()
                .map(f64::to_string)
                .collect::<Vec<_>>()
                .join(" ");
            (format!("{text}\r\n").into_bytes(), values)
        },
    },
    Published {
        name: "48 signed bytes behind two start bytes",
        packet: |n| {
            let values: Vec<f64> = (0..48)
                .map(|c| wandering(n / 7, c, [-9.0, 9.0]).round())
                .collect();
            let bytes = values.iter().map(|value| (*value as i8) as u8);
            ([0xaa, 0x55].into_iter().chain(bytes).collect(), values)
        },
    },
    Published {
        name: "forces of 12 bits, high byte first and hardly moving, behind a letter and a counter",
        packet: |n| {
            let values: Vec<f64> = (0..6)
                .map(|c| wandering(n, c, [2060.0, 2290.0]).round())
                .collect();
            let mut bytes = vec![b'S', 0x01, n as u8];
            bytes.extend(
                values
                    .iter()
                    .flat_map(|value| (*value as u16).to_be_bytes()),
            );
            (bytes, values)
        },
    },
    Published {
        name: "labels as a plotter has them",
        packet: |n| {
            let values: Vec<f64> = (0..3)
                .map(|c| wandering(n, c, [0.0, 1023.0]).round())
                .collect();
            (
                format!(
                    "thumb:{},index:{},middle:{}\r\n",
                    values[0], values[1], values[2]
                )
                .into_bytes(),
                values,
            )
        },
    },
    Published {
        name: "counts of a load cell with its time in ms and a word",
        packet: |n| {
            let value = wandering(n, 3, [-400.0, 90_000.0]).round();
            (
                format!("[{} ms] weight {value} raw\n", 5000 + 12 * n).into_bytes(),
                vec![value],
            )
        },
    },
];

/// Each reading comes back under some name, with its number and in its order.
#[test]
fn published_layouts_are_drafted() {
    let mut wrong = Vec::new();
    for Published { name, packet } in PUBLISHED {
        let (mut wire, mut sent) = (Vec::new(), Vec::new());
        for n in 0..300 {
            let (bytes, values) = packet(n);
            wire.extend(bytes);
            sent.push(values);
        }
        // From the middle of a packet on.
        let wire = &wire[3..];
        let found = match draft(wire, None) {
            Ok(found) => found,
            Err(tried) => {
                wrong.push(format!("{name}: not drafted: {tried:?}"));
                continue;
            }
        };
        let read = frames(&found.file, wire);
        let sent: Vec<&[f64]> = sent.iter().map(|values| &**values).collect();
        let values: Vec<&[f64]> = read.iter().map(|frame| &*frame.values).collect();
        let same = are_those(&sent, &values);
        if !same {
            wrong.push(format!(
                "{name}: {} frames, {:?}\n{}",
                read.len(),
                read.first(),
                found.file
            ));
        }
    }
    for wrong in &wrong {
        println!("{wrong}");
    }
    assert!(wrong.is_empty(), "{} of {}", wrong.len(), PUBLISHED.len());
}

/// Cells that nothing touches all read the same: they are readings, and no long mark.
#[test]
fn a_mat_that_nothing_touches_is_no_mark() {
    for (kind, bytes, rest) in [("u8", 1, 3.0), ("u16", 2, 259.0), ("u16", 2, 521.0)] {
        for order in ["little", "big"] {
            for count in [12, 20, 384] {
                let text = format!(
                    "framing.fixed = {{ length = {}, head = \"aa 55\" }}\npacket = {{ order = \"{order}\", fields = [{{ is = \"sequence\", type = \"u16\" }}, {{ is = \"value\", name = \"c{{1..{count}}}\", type = \"{kind}\" }}] }}",
                    4 + bytes * count
                );
                let board = common::board(&text);
                let mut encoder = Encoder::new(&board);
                let mut wire = Vec::new();
                for sequence in 0..300 {
                    let frame = Frame {
                        sequence,
                        time_ns: sequence * 20_000_000,
                        values: vec![rest; count],
                        ..Frame::default()
                    };
                    encoder.encode(&frame, &mut wire);
                }
                let found = draft(&wire[5..], None).unwrap_or_else(|why| panic!("{text}\n{why:?}"));
                let read = frames(&found.file, &wire);
                let values = read.last().map(|frame| &frame.values[..]);
                assert_eq!(
                    values,
                    Some(&vec![rest; count][..]),
                    "{text}\n{}",
                    found.file
                );
            }
        }
    }
}

/// Every reading ends with the same byte, as the packets begin: the check says which of them is the mark.
#[test]
fn a_mark_of_one_byte_is_told_from_the_still_ends_of_readings() {
    let mut random = SmallRng::seed_from_u64(4);
    let mut wire = Vec::new();
    let packets = 200;
    for _ in 0..packets {
        let mut packet = vec![0xcb];
        for channel in 0..6_u8 {
            // From 1100 on a number of 32 bits begins with 0x44.
            let value = 1100.0 + 100.0 * f32::from(channel) + random.random_range(-50.0..50.0_f32);
            packet.extend(value.to_le_bytes());
        }
        packet.push(packet.iter().fold(0, |sum, byte| sum.wrapping_add(*byte)));
        wire.extend(packet);
    }
    let found = draft(&wire[9..], None).unwrap_or_else(|tried| panic!("{tried:?}"));
    assert!(found.file.contains("kind = \"sum8\""), "{}", found.file);
    assert!(found.file.contains("head = \"cb\""), "{}", found.file);
    let frames = frames(&found.file, &wire[9..]);
    // The first packet is cut.
    assert_eq!((frames.len(), frames[0].values.len()), (packets - 1, 6));
}

/// A board whose frames come in packets with an address.
#[derive(Debug, Clone, Copy)]
struct Rows {
    first: u8,
    step: u8,
    count: u8,
    /// Values of a packet, and bytes of each.
    values: [usize; 2],
    /// The address before the marks, behind them, or behind the values and before a tail.
    place: usize,
    /// Bytes of a counter of the packets behind the address, if there is one.
    counter: usize,
}

impl Rows {
    /// Bytes of a frame, and its values in the order of their addresses.
    fn frame(&self, n: u64) -> (Vec<u8>, Vec<f64>) {
        let (mut bytes, mut all) = (Vec::new(), Vec::new());
        for row in 0..self.count {
            let address = self.first + self.step * row;
            let packet = n * u64::from(self.count) + u64::from(row);
            let [count, size] = self.values;
            let most = if size == 1 { 255.0 } else { 4095.0 };
            let channel = |c: usize| 1000 * u64::from(row) + c as u64;
            let values: Vec<f64> = (0..count)
                .map(|c| wandering(n, channel(c), [0.0, most]).round())
                .collect();
            // What stands before the marks is the address of what is behind them, but for lines.
            let marks = if self.place == 2 {
                [b'\r', b'\n']
            } else {
                [0xa7, 0x31]
            };
            let counter = &packet.to_le_bytes()[..self.counter];
            let payload = values
                .iter()
                .flat_map(|value| (*value as u16).to_le_bytes().into_iter().take(size));
            let payload: Vec<u8> = payload.collect();
            match self.place {
                0 => bytes.extend([&[address], &marks[..], counter, &payload].concat()),
                1 => bytes.extend([&marks[..], &[address], counter, &payload].concat()),
                _ => bytes.extend([counter, &payload, &[address], &marks[..]].concat()),
            }
            all.extend(values);
        }
        (bytes, all)
    }
}

/// Packets with the address of a row, a finger or a module are drafted as parts of a frame, wherever the address
/// stands; the address is taken for no counter.
#[test]
fn addresses_are_no_counters() {
    let mut boards = Vec::new();
    for (place, count) in [(0, 64), (1, 5), (2, 16), (1, 24), (0, 9), (2, 3), (1, 40)] {
        for (at, (first, step)) in [(0x3c, 1), (0, 1), (1, 2)].into_iter().enumerate() {
            let counter = [0, 1, 2][(at + place) % 3];
            let values = [[1, 1], [4, 2], [3, 1]][(at + count as usize) % 3];
            boards.push(Rows {
                first,
                step,
                count,
                values,
                place,
                counter,
            });
        }
    }
    for board in &boards {
        let mut wire = Vec::new();
        let mut sent = Vec::new();
        for n in 0..60 {
            let (bytes, values) = board.frame(n);
            wire.extend(bytes);
            sent.push(values);
        }
        // From the middle of a frame on.
        wire.drain(..7);
        let found = draft(&wire, None).unwrap_or_else(|why| panic!("{board:?}\n{why:?}"));
        let count = format!("\"address\", type = \"u8\", count = {}", board.count);
        assert!(found.file.contains(&count), "{board:?}\n{}", found.file);
        let has_counter = found.file.contains("counts = \"packets\"");
        assert_eq!(has_counter, board.counter > 0, "{board:?}\n{}", found.file);
        let read = frames(&found.file, &wire);
        let read: Vec<&[f64]> = read.iter().map(|frame| &*frame.values).collect();
        let sent: Vec<&[f64]> = sent.iter().map(Vec::as_slice).collect();
        assert!(
            are_those(&sent, &read),
            "{board:?}\n{}\n{:?}\n{:?}",
            found.file,
            sent[3],
            read[3]
        );
    }
}

/// A fabric glove: an address from 0x3c to 0x7b, two bytes that stay, a count and a zero; nothing in its counts says
/// which packets belong together.
#[test]
fn the_address_of_a_glove_is_no_counter() {
    let mut random = SmallRng::seed_from_u64(2);
    let mut wire: Vec<u8> = (0..40 * 64_u64)
        .flat_map(|n| {
            [
                0x3c + (n % 64) as u8,
                1,
                0x0f,
                random.random_range(200..=255),
                0,
            ]
        })
        .collect();
    wire.drain(..13);
    let found = draft(&wire, None).expect("packets of five bytes");
    assert!(
        found
            .file
            .contains("is = \"address\", type = \"u8\", count = 64, first = 60"),
        "{}",
        found.file
    );
    assert!(!found.file.contains("sequence"), "{}", found.file);
    // The packet of 0x3e is cut; its frame and the last one are not whole, or the first is.
    let read = frames(&found.file, &wire);
    assert!(
        read.len() >= 38 && read[0].values.len() == 64,
        "{}",
        read.len()
    );
    // What stands behind the address of the second frame is its reading.
    let at = wire.iter().enumerate().position(|(at, byte)| {
        at > 64 * 5 && *byte == 0x3c && wire[at + 1..].starts_with(&[1, 0x0f])
    });
    let at = at.expect("the second frame begins");
    let second: Vec<f64> = (0..64)
        .map(|row| f64::from(wire[at + 5 * row + 3]))
        .collect();
    assert!(
        read.iter().any(|frame| frame.values == second),
        "{}\n{second:?}\n{:?}",
        found.file,
        read[1].values
    );
}

/// Counters of packets that begin again from 0 before their type does.
#[test]
fn a_counter_of_packets_that_begins_again_says_where() {
    for (modulus, step) in [(200, 1), (16, 1), (100, 2)] {
        let wire: Vec<u8> = (0..6000_u64)
            .flat_map(|n| {
                let values = (0..3).map(move |c| wandering(n, c, [0.0, 255.0]) as u8);
                let count = (n * step % modulus) as u8;
                [0xa5, 0x5a, count].into_iter().chain(values)
            })
            .collect();
        let found = draft(&wire, None).expect("packets with marks");
        let said = format!("modulus = {modulus}");
        assert!(found.file.contains(&said), "{}", found.file);
        assert!(!found.file.contains("address"), "{}", found.file);
        let board = Board::parse("draft", &found.file).expect("a draft is sound");
        let mut decoder = Decoder::new(&board, Begin::Whole);
        decoder.push(&wire, None);
        decoder.finish();
        while decoder.next().is_some() {}
        let counts = decoder.counts();
        assert_eq!(
            (counts.delivered, counts.lost),
            (6000, Some(0)),
            "{}",
            found.file
        );
    }
}

/// Values that all follow one periodic signal, of any period, step and width, are no addresses.
#[test]
fn values_in_step_are_no_addresses() {
    for (period, step, width) in [(3, 1, 2), (7, 2, 1), (13, 1, 2), (24, 3, 2), (40, 1, 1)] {
        let packet = |n: u64| {
            let values = (0..6).flat_map(move |channel| {
                let value = 20 + 7 * channel + step * (n % period);
                value.to_be_bytes()[8 - width..].to_vec()
            });
            let mut packet: Vec<u8> = [0xa5, 0x5a, n as u8].into_iter().chain(values).collect();
            let sum: u16 = packet.iter().map(|byte| u16::from(*byte)).sum();
            packet.extend(sum.to_be_bytes());
            packet
        };
        let wire: Vec<u8> = (0..1500).flat_map(packet).collect();
        let found = draft(&wire, None).expect("packets with a check");
        assert!(!found.file.contains("address"), "{period}: {}", found.file);
        let count = frames(&found.file, &wire).len();
        assert_eq!(count, 1500, "{period}: {}", found.file);
    }
}
