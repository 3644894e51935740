//! What boards of others send, each for its kind: keys that mean nothing, words among numbers,
//! counters that count otherwise, times that go below zero, values that are none.

use std::error::Error;

use taxel_board::{Begin, Board, Decoder, Encoder};
use taxel_recording::Frame;

type Outcome = Result<(), Box<dyn Error>>;

fn board(body: &str) -> Result<Board, String> {
    let text = format!("schema = 1\nname = \"board\"\n{body}\n");
    Board::parse("board.toml", &text).map_err(|error| error.to_string())
}

/// The frames of some bytes, and the decoder behind them.
fn decoded(board: &Board, wire: &[u8]) -> (Vec<Frame>, Decoder) {
    let mut decoder = Decoder::new(board, Begin::Whole);
    decoder.push(wire, None);
    decoder.finish();
    let frames = std::iter::from_fn(|| decoder.next()).collect();
    (frames, decoder)
}

/// The values of the frames of some lines.
fn of_lines(body: &str, lines: &str) -> Result<Vec<Vec<f64>>, String> {
    let (frames, _) = decoded(&board(body)?, lines.as_bytes());
    Ok(frames.into_iter().map(|frame| frame.values).collect())
}

/// Each key of a field, with values that are not its default.
const KEYS: [(&str, &[&str]); 25] = [
    ("name", &["\"other\""]),
    (
        "type",
        &[
            "\"i16\"",
            "\"u32\"",
            "\"f32\"",
            "\"u8\"",
            "\"bits(4)\"",
            "\"sevens(2)\"",
        ],
    ),
    ("bytes", &["2", "3"]),
    ("at", &["20"]),
    ("bit", &["3"]),
    ("order", &["\"big\""]),
    ("scale", &["0.25"]),
    ("offset", &["3.0"]),
    ("unit", &["\"N\"", "\"ms\""]),
    ("mask", &["15"]),
    ("shift", &["2"]),
    ("invert_from", &["100"]),
    ("range", &["[0, 50]"]),
    ("missing", &["77", "[[70, 90], 5]", "\"over\""]),
    ("good", &["1"]),
    ("bits", &["{ hot = 1 }"]),
    ("equals", &["\"aa 07\""]),
    ("count", &["3"]),
    ("first", &["4"]),
    ("counts", &["\"packets\""]),
    ("key", &["\"elsewhere\""]),
    ("digits", &["\"hexadecimal\""]),
    ("step", &["2"]),
    ("modulus", &["200"]),
    ("repeats", &["3"]),
];

/// A field of each kind in each carrier, without the key that is tried.
fn fields(carrier: &str) -> Vec<(&'static str, Vec<(&'static str, &'static str)>)> {
    let text = carrier != "bytes";
    let numeric = |mut keys: Vec<(&'static str, &'static str)>| {
        if !text {
            keys.push(("type", "\"u16\""));
        }
        if carrier == "json" {
            keys.push(("key", "\"there\""));
        }
        keys
    };
    vec![
        ("value", numeric(vec![("name", "\"v\"")])),
        ("sequence", numeric(vec![])),
        ("time", numeric(vec![("unit", "\"us\"")])),
        ("status", numeric(vec![])),
        ("address", numeric(vec![("count", "2")])),
        ("mark", vec![("equals", "\"bb 08\"")]),
        ("skip", if text { vec![] } else { vec![("bytes", "1")] }),
        ("check", vec![]),
    ]
}

/// A board with this field beside a value.
fn with(carrier: &str, is: &str, keys: &[(&str, &str)]) -> Result<Board, String> {
    let keys = keys
        .iter()
        .map(|(key, value)| format!(", {key} = {value}"))
        .collect::<Vec<_>>()
        .concat();
    let field = format!("{{ is = \"{is}\"{keys} }}");
    match carrier {
        "bytes" => {
            let check = if is == "check" {
                ", check = { kind = \"sum8\" }"
            } else {
                ""
            };
            board(&format!(
                "framing.cobs = {{}}\npacket = {{ fields = [{{ is = \"value\", name = \"w\", type = \"u8\" }}, {field}]{check} }}"
            ))
        }
        "lines" => board(&format!(
            "framing.lines = {{}}\npacket.fields = [{{ is = \"value\", name = \"w\" }}, {field}]"
        )),
        "template" => board(&format!(
            "framing.lines.template = \"{{value w}} {{value v}} {{value other}} {{sequence}} {{time ms}}\"\npacket.fields = [{field}]"
        )),
        _ => board(&format!(
            "framing.messages.carrier = \"json\"\n[[message]]\nfields = [{{ is = \"value\", name = \"w\", key = \"w\" }}, {field}]"
        )),
    }
}

/// Every key of every kind of field in every carrier either changes what is decoded, or is
/// refused at its word.
#[test]
fn no_key_is_accepted_that_means_nothing() {
    let mut tried = 0;
    for carrier in ["bytes", "lines", "template", "json"] {
        for (is, base) in fields(carrier) {
            for (key, values) in KEYS {
                let base: Vec<_> = base
                    .iter()
                    .copied()
                    .filter(|(own, _)| *own != key)
                    .collect();
                let without = with(carrier, is, &base);
                let mut means = false;
                for value in values {
                    let given = [&base[..], &[(key, *value)]].concat();
                    match with(carrier, is, &given) {
                        Err(message) => {
                            // At the key, or at what the field is where that is refused.
                            let at = format!(".{key}\n");
                            let there = message.contains(&at)
                                || message.contains(".is\n")
                                || message.contains("bits\n")
                                || message.contains("missing\n")
                                || message.contains("range\n")
                                || message.contains("type\n");
                            assert!(there, "{carrier} {is} {key} = {value}: {message}");
                            means = true;
                        }
                        Ok(board) => means |= without.as_ref() != Ok(&board),
                    }
                    tried += 1;
                }
                assert!(
                    means,
                    "{carrier} {is}: `{key}` is accepted and means nothing"
                );
            }
        }
    }
    assert!(tried > 800, "{tried}");
}

/// The same of the keys of packets, messages, samples and boards: each changes what is decoded in some
/// value, or is refused at its word.
#[test]
#[allow(
    clippy::too_many_lines,
    reason = "most of them are the table of boards and keys"
)]
fn no_key_of_a_packet_or_a_board_means_nothing() -> Outcome {
    let bytes = "{ is = \"sequence\", type = \"u16\" }, { is = \"value\", name = \"r{0..1}c{0..1}\", type = \"u16\" }";
    let text = "{ is = \"sequence\" }, { is = \"value\", name = \"r{0..1}c{0..1}\" }";
    let lines = "{ is = \"value\", name = \"r{0..1}c{0..1}\" }";
    let json = "{ is = \"sequence\", key = \"n\" }, { is = \"value\", name = \"r{0..1}c{0..1}\", key = \"v\" }";
    let packet = |framing: &str, fields: &str| {
        format!("rate = \"50 Hz\"\nframing.{framing}\nTOP\n[packet]\nfields = [{fields}]\nKEY\n")
    };
    let message = |carrier: &str, more: &str, fields: &str| {
        format!(
            "rate = \"50 Hz\"\nframing.messages.carrier = \"{carrier}\"\nTOP\n[[message]]\n{more}\nfields = [{fields}]\nKEY\n"
        )
    };
    let boards = [
        (
            "fixed",
            packet("fixed = { length = 12, head = \"a5 5a\" }", bytes),
        ),
        (
            "marked",
            packet("marked = { head = \"aa 55\", tail = \"0d 0a\" }", bytes),
        ),
        (
            "length",
            packet(
                "length = { head = \"aa 55\", at = 2, type = \"u8\", counts = \"rest\" }",
                &format!("{{ is = \"skip\", bytes = 1 }}, {bytes}"),
            ),
        ),
        ("cobs", packet("cobs = {}", bytes)),
        ("slip", packet("slip = {}", bytes)),
        ("lines", packet("lines = {}", text)),
        ("rows", packet("lines = { rows = 3 }", lines)),
        (
            "template",
            packet(
                "lines.template = \"{sequence} {value r0c0} {value r0c1}\"",
                "",
            ),
        ),
        (
            "address",
            packet(
                "lines.template = \"{address} {value r0c0} {value r0c1}\"",
                "{ is = \"address\", count = 3 }",
            ),
        ),
        ("json", message("json", "", json)),
        (
            "json by id",
            message("json", "key = \"type\"\nid = \"a\"", json),
        ),
        (
            "can",
            message(
                "can",
                "id = 0x12",
                "{ is = \"value\", name = \"r0c{0..1}\", type = \"u16\" }",
            ),
        ),
    ];
    let of_board = [
        ("pressed", &["\"falls\""][..]),
        (
            "layout",
            &[
                "{ rows = 1, columns = 4 }",
                "{ rows = 2, columns = 1 }",
                "{ rows = 3, columns = 2 }",
            ],
        ),
    ];
    let of_packet = [
        ("order", &["\"big\""][..]),
        ("check", &["{ kind = \"sum8\" }"]),
        ("step_limit", &["3.0"]),
        (
            "samples",
            &["{ count = 2, every = \"1 ms\" }", "{ count = 2 }"],
        ),
        ("samples", &["{ key = \"list\" }"]),
        (
            "samples",
            &["{ count = 2, every = \"1 ms\", stamp = \"first\" }"],
        ),
        ("id", &["0x77"]),
        ("id_range", &["[1, 2]", "[0x20, 0x21]"]),
        ("first", &["2"]),
        ("extended", &["true"]),
        ("key", &["\"other\""]),
        ("length", &["8"]),
        ("rows", &["4"]),
    ];
    let mut silent = Vec::new();
    for (name, file) in &boards {
        let with = |top: &str, key: &str| board(&file.replace("TOP", top).replace("KEY", key));
        let plain = with("", "").map_err(|error| format!("{name}: {error}"))?;
        let given = of_board.iter().map(|of| (true, of));
        for (top, (key, values)) in given.chain(of_packet.iter().map(|of| (false, of))) {
            let means = values.iter().any(|value| {
                let line = format!("{key} = {value}");
                let changed = if top {
                    with(&line, "")
                } else {
                    with("", &line)
                };
                changed.map_or_else(
                    // A packet that is longer with it is refused at the length.
                    |why| why.contains(key) || why.contains("length"),
                    |board| board != plain,
                )
            });
            if !means {
                silent.push(format!("{name}: {key} = {values:?}"));
            }
        }
    }
    assert!(
        silent.is_empty(),
        "accepted, and means nothing: {silent:#?}"
    );
    Ok(())
}

/// A counter of packets has another number for each: `repeats` is refused at its word.
#[test]
fn packets_that_are_counted_do_not_repeat() {
    let fields = "{ is = \"address\", type = \"u8\", count = 2 }, { is = \"sequence\", type = \"u8\", counts = \"packets\", repeats = 2 }, { is = \"value\", name = \"a\", type = \"u8\" }";
    let message = board(&format!("framing.cobs = {{}}\npacket.fields = [{fields}]"));
    let message = message.err().unwrap_or_default();
    assert!(message.contains(".repeats\n"), "{message}");
}

#[test]
fn hexadecimal_text_is_hexadecimal() -> Outcome {
    let fields = |more: &str| {
        format!(
            "framing.lines = {{}}\npacket.fields = [{{ is = \"value\", name = \"c1..c3\", digits = \"hexadecimal\"{more} }}]"
        )
    };
    let found = of_lines(&fields(""), "0100 01E1 0010\n")?;
    assert_eq!(found, [[256.0, 481.0, 16.0]]);
    let found = of_lines(&fields(", type = \"i16\""), "0xffff 8000 7fff\n")?;
    assert_eq!(found, [[-1.0, -32768.0, 32767.0]]);
    // Five digits are no number of 16 bits.
    assert!(of_lines(&fields(", type = \"i16\""), "10000 0 0\n")?.is_empty());
    Ok(())
}

#[test]
fn words_of_a_template_are_not_found_inside_numbers() -> Outcome {
    let template = |text: &str| format!("framing.lines.template = \"{text}\"");
    let found = of_lines(
        &template("{skip} 1 {value a} {value b}"),
        "60 1 50 51\n61 1 50\n62 1 50 51\n71 1 50 51\n",
    )?;
    assert_eq!(found, [[50.0, 51.0], [50.0, 51.0], [50.0, 51.0]]);
    let found = of_lines(
        &template("x {value a} 2 {value b}"),
        "x 12 2 3\nx 1 22 3\nx 1 2 3\n",
    )?;
    assert_eq!(found, [[12.0, 3.0], [1.0, 3.0]]);
    // Nothing runs together where a blank is not there.
    let found = of_lines(&template("T: {value a} V"), "T:5V\nT:   7   V\n")?;
    assert_eq!(found, [[5.0], [7.0]]);
    Ok(())
}

#[test]
fn masks_take_the_bits_of_negative_text() -> Outcome {
    let body =
        "framing.lines = {}\npacket.fields = [{ is = \"value\", name = \"a\", mask = \"0xffff\" }]";
    assert_eq!(
        of_lines(body, "5\n-1\n-32525\n")?,
        [[5.0], [65535.0], [33011.0]]
    );
    Ok(())
}

#[test]
fn fields_over_head_or_tail_are_refused() {
    for (framing, fields) in [
        (
            "fixed = { length = 4, head = \"aa\", tail = \"0a\" }",
            "name = \"c{1..3}\", type = \"u8\"",
        ),
        (
            "fixed = { length = 4, head = \"aa\", tail = \"0a\" }",
            "name = \"c\", type = \"u16\", at = 2",
        ),
        (
            "fixed = { length = 3, head = \"aa bb\" }",
            "name = \"c\", type = \"u16\", at = 1",
        ),
        (
            "marked = { head = \"aa bb\", tail = \"0a\" }",
            "name = \"c\", type = \"u16\", at = 1",
        ),
    ] {
        let body = format!("framing.{framing}\npacket.fields = [{{ is = \"value\", {fields} }}]");
        let message = board(&body).err().unwrap_or_default();
        assert!(
            message.contains("where the head stands") || message.contains("where the tail stands"),
            "{body}: {message}"
        );
    }
}

/// One value that is none does not spoil its frame.
#[test]
fn a_value_that_is_none_is_missing() -> Outcome {
    let body = "framing.lines.template = \"{sequence},{value a},{value b}\"";
    for word in [
        "nan",
        "NaN",
        "-nan",
        "inf",
        "-Infinity",
        "ovf",
        "null",
        "None",
    ] {
        let found = of_lines(body, &format!("0,1,2\n1,{word},4\n2,5,6\n"))?;
        assert_eq!(found.len(), 3, "{word}");
        assert!(found[1][0].is_nan() && found[1][1] == 4.0, "{word}");
    }
    // A word that nobody writes for a number is no reading, unless the file says so.
    assert_eq!(of_lines(body, "0,1,2\n1,over,4\n")?.len(), 1);
    let missing = "framing.lines.template = \"{value a},{value b}\"\npacket.fields = [{ is = \"value\", name = \"a\", missing = [\"over\", -1, 999] }]";
    let found = of_lines(missing, "over,4\n-1,5\n999,6\n3,7\n")?;
    assert!(found[..3].iter().all(|values| values[0].is_nan()));
    assert_eq!(found[3], [3.0, 7.0]);
    let json = "framing.messages.carrier = \"json\"\n[[message]]\nfields = [{ is = \"value\", name = \"a\", key = \"a\" }, { is = \"value\", name = \"c{1..2}\", key = \"c\" }]";
    let found = of_lines(
        json,
        "{\"a\":NaN,\"c\":[1,2]}{\"a\":3,\"c\":[-Infinity,4],\"s\":\"a \\\" NaN\"}\n",
    )?;
    assert!(found.len() == 2 && found[0][0].is_nan() && found[1][1].is_nan());
    assert_eq!(
        [found[0][1], found[0][2], found[1][0], found[1][2]],
        [1.0, 2.0, 3.0, 4.0]
    );
    Ok(())
}

#[test]
fn lines_end_as_they_end() -> Outcome {
    let body = "framing.lines.template = \"{value a} {value b}\"";
    let all = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
    for lines in [
        "1 2\n3 4\n5 6\n",
        "1 2\r\n3 4\r\n5 6\r\n",
        "1 2\r3 4\r5 6\r",
        "\u{1b}[0;32m1 2\u{1b}[0m\n3 \u{1b}[1m4\n5 6",
    ] {
        assert_eq!(of_lines(body, lines)?, all, "{lines:?}");
    }
    let quoted = "framing.lines.template = \"{value a},{value b}\"";
    assert_eq!(
        of_lines(quoted, "\"51,72\",2\n\"3\",\"4.5\"\n")?,
        [[51.72, 2.0], [3.0, 4.5]]
    );
    Ok(())
}

/// A line that never ends is looked at once: eight times the bytes take not much more than
/// eight times the steps, which the time of a test cannot say; that it is read at all does.
#[test]
fn a_long_line_byte_by_byte_is_read() -> Outcome {
    let body = "framing.lines = { template = \"{value c1..c4096}\", longest = 70000 }";
    let board = board(body)?;
    let line = vec!["1"; 4096].join(" ") + "\n";
    let mut decoder = Decoder::new(&board, Begin::Whole);
    for byte in line.as_bytes() {
        decoder.push(&[*byte], None);
    }
    assert_eq!(decoder.next().ok_or("no frame")?.values.len(), 4096);
    Ok(())
}

/// Counters that do not go from 0 to 2^n - 1 one by one: read with the keys that say so, and
/// proposed without them.
#[test]
fn counters_that_count_otherwise_are_said_and_proposed() -> Outcome {
    type Count = fn(u64) -> u64;
    let cases: [(&str, &str, Count); 4] = [
        ("modulus = 201", "write modulus = 201", |n| n % 201),
        ("step = 2", "write step = 2", |n| 2 * n % 256),
        ("repeats = 2", "write repeats = 2", |n| n / 2 % 256),
        ("modulus = 200, step = 2", "write modulus = 200", |n| {
            2 * n % 200
        }),
    ];
    for (keys, proposed, count) in cases {
        for text in [false, true] {
            let body = |keys: &str| {
                if text {
                    let comma = if keys.is_empty() { "" } else { ", " };
                    format!(
                        "rate = \"100 Hz\"\nframing.lines.template = \"{{sequence}} {{value a}}\"\npacket.fields = [{{ is = \"sequence\", type = \"u8\"{comma}{keys} }}]"
                    )
                } else {
                    let comma = if keys.is_empty() { "" } else { ", " };
                    format!(
                        "rate = \"100 Hz\"\nframing.cobs = {{}}\npacket = {{ fields = [{{ is = \"sequence\", type = \"u8\"{comma}{keys} }}, {{ is = \"value\", name = \"a\", type = \"u16\" }}], check = {{ kind = \"CRC-16/ARC\" }} }}"
                    )
                }
            };
            // The bytes by a board that counts plainly: the encoder of the keys is tried below.
            let plain = board(&body(""))?;
            let mut wire = Vec::new();
            for n in 0..1000 {
                let frame = Frame {
                    sequence: count(n),
                    values: vec![(n % 60_000) as f64],
                    ..Frame::default()
                };
                Encoder::new(&plain).encode(&frame, &mut wire);
            }
            let stated = board(&body(keys))?;
            let (frames, decoder) = decoded(&stated, &wire);
            assert_eq!(frames.len(), 1000, "{keys}");
            let counts = decoder.counts();
            assert_eq!(
                (counts.lost, counts.duplicate, counts.restarts),
                (Some(0), 0, 0),
                "{keys}"
            );
            assert!(
                frames
                    .iter()
                    .enumerate()
                    .all(|(n, frame)| frame.sequence == n as u64)
            );
            assert!(
                !decoder.remark().unwrap_or_default().contains("write"),
                "{:?}",
                decoder.remark()
            );
            // Two that are lost are two.
            let gap = if text {
                wire.split(|byte| *byte == b'\n')
                    .take(500)
                    .map(|line| line.len() + 1)
                    .sum()
            } else {
                wire.len() / 2 / (wire.len() / 1000) * (wire.len() / 1000)
            };
            if !text {
                let packet = wire.len() / 1000;
                let cut = [&wire[..gap], &wire[gap + 2 * packet..]].concat();
                let (frames, decoder) = decoded(&stated, &cut);
                assert_eq!(
                    (frames.len(), decoder.counts().lost),
                    (998, Some(2)),
                    "{keys}"
                );
            }
            // What the keys say is what the encoder of the board writes.
            let mut own = Vec::new();
            let mut encoder = Encoder::new(&stated);
            for n in 0..1000 {
                let values = vec![(n % 60_000) as f64];
                encoder.encode(
                    &Frame {
                        sequence: n,
                        values,
                        ..Frame::default()
                    },
                    &mut own,
                );
            }
            assert!(own == wire, "{keys}");
            let (_, decoder) = decoded(&plain, &wire);
            let remark = decoder.remark().unwrap_or_default();
            assert!(remark.contains(proposed), "{keys}: {remark}");
        }
    }
    Ok(())
}

#[test]
fn clocks_run_below_zero_and_wrap_as_text() -> Outcome {
    let body = "rate = \"100 Hz\"\nframing.lines.template = \"{time us},{value c1..c2}\"";
    let lines = |first: i64, modulus: i64| -> String {
        (0..40)
            .map(|n| first + 10_000 * n)
            .map(|time| {
                if modulus > 0 {
                    time.rem_euclid(modulus)
                } else {
                    time
                }
            })
            .map(|time| format!("{time},1,2\n"))
            .collect::<Vec<_>>()
            .concat()
    };
    for (more, first, modulus) in [
        ("", -30_000, 0),
        ("", (1_i64 << 32) - 155_000, 1 << 32),
        (
            "\npacket.fields = [{ is = \"time\", type = \"u32\" }]",
            (1_i64 << 32) - 155_000,
            1 << 32,
        ),
        (
            "\npacket.fields = [{ is = \"time\", type = \"i32\" }]",
            -30_000,
            0,
        ),
    ] {
        let (frames, decoder) = decoded(
            &board(&format!("{body}{more}"))?,
            lines(first, modulus).as_bytes(),
        );
        let steps: Vec<u64> = frames
            .windows(2)
            .map(|pair| pair[1].time_ns - pair[0].time_ns)
            .collect();
        assert_eq!(steps, vec![10_000_000; 39], "{more} {first}");
        let counts = decoder.counts();
        assert_eq!(
            (counts.wrong_time, counts.restarts),
            (0, 0),
            "{more} {first}"
        );
    }
    Ok(())
}

/// Three frames whose time lies half a second back: behind them the clock is where it was.
#[test]
fn a_clock_that_jumps_back_and_returns_is_where_it_was() -> Outcome {
    let board = board("rate = \"100 Hz\"\nframing.lines.template = \"{time us},{value a}\"")?;
    let lines = (0..300_i64)
        .map(|n| 10_000 * n - if (100..103).contains(&n) { 500_000 } else { 0 })
        .map(|time| format!("{time},1\n"))
        .collect::<Vec<_>>()
        .concat();
    let (frames, decoder) = decoded(&board, lines.as_bytes());
    assert_eq!(frames.len(), 300);
    for n in [99, 110, 299] {
        assert_eq!(frames[n].time_ns, 10_000_000 * n as u64, "{n}");
    }
    let counts = decoder.counts();
    assert!(counts.wrong_time + counts.restarts > 0, "{counts:?}");
    Ok(())
}

/// Frames through the encoder and back: the same values, none lost.
fn there_and_back(board: &Board, frames: u64) -> Result<Vec<u8>, String> {
    let values = board.values().len();
    let mut encoder = Encoder::new(board);
    let (mut wire, mut sent) = (Vec::new(), Vec::new());
    for n in 0..frames {
        let values = (0..values as u64).map(|value| ((7 * n + 3 * value) % 100) as f64);
        sent.push(values.collect::<Vec<_>>());
        let frame = Frame {
            sequence: n,
            time_ns: n * 10_000_000,
            values: sent[n as usize].clone(),
            ..Frame::default()
        };
        encoder.encode(&frame, &mut wire);
    }
    let (back, decoder) = decoded(board, &wire);
    let counts = decoder.counts();
    if !counts.is_clean() || counts.duplicate + counts.late + counts.restarts > 0 {
        return Err(format!("{counts:?}"));
    }
    let back: Vec<Vec<f64>> = back.into_iter().map(|frame| frame.values).collect();
    if back != sent {
        return Err(format!("{} frames of {} came back", back.len(), sent.len()));
    }
    Ok(wire)
}

/// What `missing` says may be numbers, and all from one to another: the ends of a converter.
#[test]
fn ends_of_the_range_may_be_missing() -> Outcome {
    let missing = "missing = [[4090, 4095], [0, 2], 77]";
    let lines = format!(
        "framing.lines = {{}}\npacket.fields = [{{ is = \"value\", name = \"a\", {missing} }}]"
    );
    let found = of_lines(&lines, "4090\n4095\n4089\n0\n2\n3\n77\n78\n")?;
    let is_missing: Vec<bool> = found.iter().map(|values| values[0].is_nan()).collect();
    let expected = [true, true, false, true, true, false, true, false];
    assert_eq!(is_missing, expected);
    let bytes = board(&format!(
        "framing.cobs = {{}}\npacket.fields = [{{ is = \"value\", name = \"a\", type = \"u16\", {missing} }}]"
    ))?;
    // COBS of 0x0fff and 0x0102, little-endian.
    let (frames, _) = decoded(&bytes, &[3, 0xff, 0x0f, 0, 3, 2, 1, 0]);
    assert!(frames[0].values[0].is_nan() && frames[1].values[0] == 258.0);
    for (wrong, word) in [
        ("[[9, 3]]", "no stretch"),
        ("[[70000, 80000]]", "never comes"),
    ] {
        let message = board(&format!(
            "framing.cobs = {{}}\npacket.fields = [{{ is = \"value\", name = \"a\", type = \"u16\", missing = {wrong} }}]"
        ));
        let message = message.err().unwrap_or_default();
        assert!(
            message.contains(word) && message.contains("missing"),
            "{message}"
        );
    }
    Ok(())
}

/// Numbers in halves of seven bits: high half first behind a byte with the highest bit, as
/// amplifiers of muscles send them, and low half first, as MIDI does.
#[test]
fn values_come_in_halves_of_seven_bits() -> Outcome {
    let high_first = board(
        "framing.fixed = { length = 4, head = \"80-ff 00-7f 00-7f 00-7f\" }\npacket = { order = \"big\", fields = [{ is = \"value\", name = \"c{1..2}\", type = \"sevens(2)\", at = 0 }] }",
    )?;
    // 0x87 0x7f is 7 x 128 + 127. Behind a packet that lost two bytes the one before it is not
    // believed either: only the head of the next shows that none is missing.
    let packets: [&[u8]; 5] = [
        &[0x87, 0x7f, 0x03, 0x01],
        &[0x87, 0x7f, 0x03, 0x01],
        &[0x80, 0x05],
        &[0x83, 0x00, 0x01, 0x02],
        &[0x80, 0, 0, 0],
    ];
    let (frames, decoder) = decoded(&high_first, &packets.concat());
    let values: Vec<_> = frames.iter().map(|frame| frame.values.clone()).collect();
    assert_eq!(values, [[1023.0, 385.0], [384.0, 130.0], [0.0, 0.0]]);
    assert_eq!(decoder.counts().damaged, 2);
    there_and_back(&high_first, 300)?;
    let midi = board(
        "framing.marked = { head = \"f0 7d\", tail = \"f7\" }\npacket.fields = [{ is = \"value\", name = \"c1..c3\", type = \"sevens(2)\" }]",
    )?;
    let (frames, _) = decoded(&midi, &[0xf0, 0x7d, 0x7f, 0x7f, 1, 0, 0, 1, 0xf7]);
    assert_eq!(frames[0].values, [16383.0, 1.0, 128.0]);
    there_and_back(&midi, 300)?;
    Ok(())
}

/// Blocks of a mat: the index of the first reading, and a number for each packet.
fn blocks(more: &str) -> Result<Board, String> {
    board(&format!(
        "rate = \"100 Hz\"\nframing.cobs = {{}}\npacket = {{ fields = [{{ is = \"address\", type = \"u16\", count = 4, step = 30 }}, {{ is = \"sequence\", type = \"u16\"{more} }}, {{ is = \"value\", name = \"p{{0..29}}\", type = \"u16\" }}], check = {{ kind = \"CRC-16/ARC\" }} }}"
    ))
}

#[test]
fn blocks_with_a_number_for_each_packet_make_frames() -> Outcome {
    let stated = blocks(", counts = \"packets\"")?;
    assert_eq!(stated.values()[31].name, "p1.30");
    // 20 000 frames of four packets pass the end of the counter once.
    let wire = there_and_back(&stated, 20_000)?;
    // A packet that is lost costs its frame and no other.
    let packets: Vec<&[u8]> = wire.split_inclusive(|byte| *byte == 0).collect();
    let cut: Vec<u8> = [&packets[..42], &packets[43..400]].concat().concat();
    let (frames, decoder) = decoded(&stated, &cut);
    let counts = decoder.counts();
    assert_eq!(
        (frames.len(), counts.lost, counts.incomplete),
        (99, Some(1), 1)
    );
    // Without the key no frame is whole, and the reason is said.
    let (frames, decoder) = decoded(&blocks("")?, &wire);
    assert!(frames.is_empty());
    let remark = decoder.remark().unwrap_or_default();
    assert!(remark.contains("counts = \"packets\""), "{remark}");
    // The same where addresses never come.
    let few: Vec<u8> = packets
        .iter()
        .enumerate()
        .filter(|(n, _)| n % 4 < 2)
        .flat_map(|(_, bytes)| *bytes)
        .copied()
        .collect();
    let (_, decoder) = decoded(&stated, &few);
    let remark = decoder.remark().unwrap_or_default();
    assert!(remark.contains("0, 30 came, 60, 90 never"), "{remark}");
    Ok(())
}

/// One line a row, which says which row it is.
#[test]
fn lines_with_an_address_make_frames() -> Outcome {
    let body = "framing.lines.template = \"R{address}: {value c0..c2}\"\npacket.fields = [{ is = \"address\", count = 2 }]";
    let found = of_lines(
        body,
        "R1: 9 9 9\nR0: 1 2 3\nR1: 4 5 6\nR0: 7 8 9\nR2: 0 0 0\nR1: 1 1 1\n",
    )?;
    // The first row is what is left of a frame before; without a number the first address begins one.
    assert_eq!(
        found,
        [
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            [7.0, 8.0, 9.0, 1.0, 1.0, 1.0]
        ]
    );
    let fields = "rate = \"100 Hz\"\nframing.lines = {}\npacket.fields = [{ is = \"address\", count = 8, first = 16, step = 16, digits = \"hexadecimal\", type = \"u8\" }, { is = \"sequence\" }, { is = \"value\", name = \"c{0..3}\" }]";
    let rows = board(fields)?;
    let wire = there_and_back(&rows, 100)?;
    assert!(
        wire.starts_with(b"10 0 0 3 6 9\r\n20 0 "),
        "{:?}",
        String::from_utf8_lossy(&wire[..40])
    );
    there_and_back(
        &board(&fields.replace("\"sequence\"", "\"sequence\", counts = \"packets\""))?,
        100,
    )?;
    let message = board("framing.lines.template = \"{address} {value a}\"");
    assert!(message.err().unwrap_or_default().contains("how many lines"));
    Ok(())
}

/// Rows up or down, from the middle of a frame and with a row that is lost: no frame has rows of two.
#[test]
fn rows_that_fall_make_frames_as_those_that_rise() -> Outcome {
    let body = "framing.lines.template = \"R{address}: {value c}\"\npacket.fields = [{ is = \"address\", count = 4 }]";
    for (falls, missing) in [(false, 2), (true, 2), (true, 3), (false, 4), (true, 4)] {
        let rows = (0..40_u32)
            .flat_map(|frame| (0..4).map(move |at| [frame, if falls { 3 - at } else { at }]));
        // The first rows are missing, and one of the eleventh frame.
        let sent = rows.skip(missing).filter(|row| *row != [10, 1]);
        let lines: Vec<String> = sent
            .map(|[frame, row]| format!("R{row}: {frame}\n"))
            .collect();
        let found = of_lines(body, &lines.concat())?;
        // Of falling rows the first packets show the order, which costs the frame that they are of.
        let first = if falls && missing == 4 { 2 } else { 1 };
        let whole: Vec<f64> = (first..40)
            .filter(|frame| *frame != 10)
            .map(f64::from)
            .collect();
        let expected: Vec<Vec<f64>> = whole.iter().map(|frame| vec![*frame; 4]).collect();
        assert_eq!(found, expected, "falls: {falls}, {missing} missing");
    }
    Ok(())
}

/// Several frames in one packet: between number and check their values stand one behind the other.
#[test]
fn a_packet_may_hold_several_frames() -> Outcome {
    let body = |stamp: &str| {
        format!(
            "framing.fixed = {{ length = 25, head = \"aa 55\" }}\n[packet]\nfields = [{{ is = \"sequence\", type = \"u8\" }}, {{ is = \"time\", type = \"u32\", unit = \"us\" }}, {{ is = \"value\", name = \"c{{1..2}}\", type = \"u16\" }}, {{ is = \"skip\", bytes = 1 }}, {{ is = \"value\", name = \"d\", type = \"u8\" }}, {{ is = \"status\", type = \"u8\" }}]\nsamples = {{ count = 2, every = \"10 ms\"{stamp} }}\ncheck = {{ kind = \"sum8\", at = 20 }}"
        )
        .replace("length = 25", "length = 21")
    };
    for (stamp, times) in [
        ("", [0, 10, 20, 30]),
        (", stamp = \"first\"", [0, 10, 20, 30]),
    ] {
        let board = board(&body(stamp))?;
        assert_eq!(board.values().len(), 3);
        let wire = there_and_back(&board, 2000)?;
        assert_eq!(wire.len(), 1000 * 21);
        let (frames, decoder) = decoded(&board, &wire);
        let found: Vec<u64> = frames
            .iter()
            .take(4)
            .map(|frame| frame.time_ns / 1_000_000)
            .collect();
        assert_eq!(found, times, "{stamp}");
        assert_eq!(decoder.remark(), None);
        // One packet less is two frames less.
        let cut = [&wire[..210], &wire[231..]].concat();
        let (frames, decoder) = decoded(&board, &cut);
        assert_eq!(
            (frames.len(), decoder.counts().lost),
            (1998, Some(2)),
            "{stamp}"
        );
        assert_eq!(
            (frames[20].sequence, frames[20].time_ns),
            (22, 220_000_000),
            "{stamp}"
        );
    }
    Ok(())
}

/// The list of a JSON message, as amplifiers with WiFi send it: each entry with its own number, or
/// all with the time of the message.
#[test]
fn a_json_message_may_hold_a_list_of_frames() -> Outcome {
    let own = "framing.messages.carrier = \"json\"\n[[message]]\nsamples = { key = \"chunk\", every = \"4 ms\" }\nfields = [{ is = \"sequence\", key = \"sampleNumber\" }, { is = \"time\", key = \"timestamp\", unit = \"ms\" }, { is = \"value\", key = \"data\", name = \"c1..c2\" }]";
    let entry = |n: u64| {
        format!(
            "{{\"timestamp\":{},\"data\":[{n},{}],\"sampleNumber\":{n}}}",
            4 * n,
            10 * n
        )
    };
    let chunk = |range: std::ops::Range<u64>| {
        let entries: Vec<String> = range.map(entry).collect();
        format!("{{\"chunk\":[{}],\"count\":3}}\r\n", entries.join(","))
    };
    let wire = [chunk(0..3), chunk(3..7), chunk(7..8), chunk(9..12)].concat();
    let (frames, decoder) = decoded(&board(own)?, wire.as_bytes());
    assert_eq!((frames.len(), decoder.counts().lost), (11, Some(1)));
    assert_eq!(
        (frames[10].values[1], frames[10].time_ns),
        (110.0, 44_000_000)
    );
    there_and_back(&board(own)?, 100)?;
    let shared = "framing.messages.carrier = \"json\"\n[[message]]\nsamples = { key = \"s\", count = 2, every = \"5 ms\" }\nfields = [{ is = \"sequence\", key = \"n\" }, { is = \"time\", key = \"t\", unit = \"ms\" }, { is = \"value\", key = \"\", name = \"c1..c2\" }]";
    let wire: Vec<String> = (0..50)
        .map(|n| {
            format!(
                "{{\"n\":{n},\"t\":{},\"s\":[[{n},1],[{n},2]]}}\n",
                10 * n + 5
            )
        })
        .collect();
    let (frames, decoder) = decoded(&board(shared)?, wire.concat().as_bytes());
    assert_eq!((frames.len(), decoder.counts().lost), (100, Some(0)));
    assert!(
        frames
            .windows(2)
            .all(|pair| pair[1].time_ns - pair[0].time_ns == 5_000_000)
    );
    Ok(())
}

/// Packets of different length in one framing: blocks of a mat whose last is shorter.
#[test]
fn packets_of_several_kinds_make_a_frame() -> Outcome {
    let check = "check = { kind = \"CRC-16/ARC\" }";
    let messages = format!(
        "[[message]]\nfields = [{{ is = \"address\", type = \"u16\", count = 2, step = 20 }}, {{ is = \"sequence\", type = \"u16\", counts = \"packets\" }}, {{ is = \"value\", name = \"p{{0..19}}\", type = \"u16\" }}]\n{check}\n[[message]]\nfields = [{{ is = \"mark\", equals = \"28 00\" }}, {{ is = \"sequence\", type = \"u16\", counts = \"packets\" }}, {{ is = \"value\", name = \"q{{0..7}}\", type = \"u16\" }}]\n{check}\n"
    );
    for framing in [
        "framing.cobs = {}",
        "framing.slip = {}",
        "framing.marked = { head = \"55 aa\", tail = \"0d 0a\" }",
        "framing.length = { head = \"55 aa\", at = 2, type = \"u8\", counts = \"rest\" }",
    ] {
        let messages = if framing.contains("length") {
            messages.replace("fields = [", "fields = [{ is = \"skip\", bytes = 1 }, ")
        } else {
            messages.clone()
        };
        let board = board(&format!("rate = \"100 Hz\"\n{framing}\n{messages}"))?;
        assert_eq!(board.values().len(), 48);
        let wire = there_and_back(&board, 500).map_err(|error| format!("{framing}: {error}"))?;
        // A byte that is wrong costs its frame.
        let mut damaged = wire.clone();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 0x10;
        let (frames, decoder) = decoded(&board, &damaged);
        assert_eq!(frames.len(), 499, "{framing}");
        assert_eq!(decoder.counts().lost, Some(1), "{framing}");
    }
    let alike = "framing.cobs = {}\n[[message]]\nfields = [{ is = \"value\", name = \"a\", type = \"u8\" }]\n[[message]]\nfields = [{ is = \"value\", name = \"b\", type = \"u8\" }]\n";
    let message = board(alike).err().unwrap_or_default();
    assert!(
        message.contains("nothing tells it from another"),
        "{message}"
    );
    Ok(())
}

/// Keys of several frames in one packet are refused where they say nothing.
#[test]
fn samples_are_refused_where_they_say_nothing() {
    let value = "{ is = \"value\", name = \"a\", type = \"u8\" }";
    let (cobs, every) = ("framing.cobs = {}\npacket", "every = \"1 ms\"");
    for (framing, samples, word) in [
        (cobs, "every = \"1 ms\"", "how many"),
        (cobs, "count = 3", "how far apart"),
        (cobs, "count = 3, key = \"x\", every = \"1 ms\"", "no keys"),
        (cobs, "count = 3000, every = \"1 ms\"", "out of range"),
        (
            "framing.lines = {}\npacket",
            "count = 3, every = \"1 ms\"",
            "each line",
        ),
        (
            "framing.messages.carrier = \"can\"\npacket",
            every,
            "JSON message",
        ),
    ] {
        let body = format!("{framing} = {{ fields = [{value}], samples = {{ {samples} }} }}");
        let message = board(&body).err().unwrap_or_default();
        assert!(message.contains(word), "{body}: {message}");
    }
}

/// One line a row without a number, and a blank line between two frames.
#[test]
fn rows_between_blank_lines_make_frames() -> Outcome {
    let body =
        "framing.lines = { rows = 2 }\npacket.fields = [{ is = \"value\", name = \"c0..c1\" }]";
    // The third frame has a row too few, the fourth one too many, the fifth a row that is none.
    let lines =
        "1\t2\t\r\n3\t4\t\r\n\r\n5 6\n7 8\n\n1 1\n\n2 2\n3 3\n4 4\n\n5 5\nready\n6 6\n\n7 7\n8 8\n";
    let (frames, decoder) = decoded(&board(body)?, lines.as_bytes());
    let values: Vec<_> = frames.iter().map(|frame| frame.values.clone()).collect();
    let all = [
        [1.0, 2.0, 3.0, 4.0],
        [5.0, 6.0, 7.0, 8.0],
        [2.0, 2.0, 3.0, 3.0],
        [7.0, 7.0, 8.0, 8.0],
    ];
    assert_eq!(values, all);
    let counts = decoder.counts();
    assert_eq!((counts.incomplete, counts.other), (2, 3), "{counts:?}");
    there_and_back(&board(body)?, 100)?;
    let both = "framing.lines = { rows = 2 }\npacket.fields = [{ is = \"address\", count = 2 }, { is = \"value\", name = \"a\" }]";
    assert!(
        board(both)
            .err()
            .unwrap_or_default()
            .contains("without an address")
    );
    Ok(())
}

/// What published firmware of gloves and mats sends, one packet or line each with its values.
#[test]
fn published_firmware_is_read() -> Outcome {
    let glove = "framing.marked = { head = \"f0 01 0b\", tail = \"f7\" }\npacket.fields = [{ is = \"value\", name = \"{thumb,index,middle,ring,pinky}.{1,2}\", type = \"u8\", range = [0, 127] }, { is = \"value\", name = \"battery\", type = \"u8\" }]";
    let wire = [0xf0, 1, 11, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 99, 0xf7];
    let (frames, _) = decoded(&board(glove)?, &wire);
    assert_eq!(frames[0].values[9..], [10.0, 99.0]);
    let start_and_end = "framing.length = { head = \"53 01\", at = 2, type = \"u8\", counts = \"all\" }\npacket = { order = \"big\", fields = [{ is = \"skip\", bytes = 1 }, { is = \"value\", name = \"f{1..5}\", type = \"u16\" }, { is = \"mark\", equals = \"45\" }] }";
    let wire = [0x53, 1, 14, 1, 0, 0, 2, 3, 4, 0, 5, 0xff, 0xff, 0x45];
    let (frames, _) = decoded(&board(start_and_end)?, &[wire, wire].concat());
    assert_eq!(frames[1].values, [256.0, 2.0, 772.0, 5.0, 65535.0]);
    let nested = "framing.messages.carrier = \"json\"\n[[message]]\nfields = [{ is = \"value\", key = \"e/x\", name = \"ex\" }, { is = \"value\", key = \"l/x\", name = \"lx\" }, { is = \"value\", key = \"mf\", name = \"mf\" }]";
    let found = of_lines(
        nested,
        "{\"e\":{\"x\":1.5,\"y\":2},\"l\":{\"x\":-3},\"mf\":512}\n",
    )?;
    assert_eq!(found, [[1.5, -3.0, 512.0]]);
    let matrix = "framing.lines.template = \"{value c0..c209}\"";
    let line = (0..210)
        .map(|n| n.to_string())
        .collect::<Vec<_>>()
        .join(" ");
    assert_eq!(of_lines(matrix, &format!("{line} \r\n"))?[0][209], 209.0);
    let named = "framing.marked = { head = \"44 41 54 41\", tail = \"43 59 4e 0a\" }\npacket.fields = [{ is = \"value\", name = \"f{1..2}\", type = \"i16\" }, { is = \"value\", name = \"q{1..2}\", type = \"f32\" }, { is = \"skip\", bytes = 2 }]";
    there_and_back(&board(named)?, 200)?;
    Ok(())
}

/// Rows with an address and without a number: after a row that did not come, and on a wire that begins within a frame,
/// no frame has rows of two.
#[test]
fn frames_of_rows_are_not_torn() -> Outcome {
    let board = board(
        "framing.fixed = { length = 4, head = \"a5\", tail = \"0a\" }\npacket.fields = [{ is = \"mark\", bytes = 1 }, { is = \"address\", type = \"u8\", count = 4 }, { is = \"value\", name = \"c\", type = \"u8\" }]",
    )?;
    for lost in 0..4 {
        // The first row of a wire that begins anywhere may be any; of the tenth frame one row is lost.
        let wire: Vec<u8> = (2..120_u8)
            .filter(|packet| *packet != 40 + lost)
            .flat_map(|packet| [0xa5, packet % 4, packet / 4, 0x0a])
            .collect();
        let mut decoder = Decoder::new(&board, Begin::Cut);
        decoder.push(&wire, None);
        decoder.finish();
        let frames: Vec<Frame> = std::iter::from_fn(|| decoder.next()).collect();
        let of_one = |frame: &Frame| frame.values.iter().all(|value| *value == frame.values[0]);
        assert!(frames.iter().all(of_one), "{lost}: {frames:?}");
        // Of 30 frames the first is cut and one has lost a row.
        assert_eq!(frames.len(), 28, "{lost}");
    }
    Ok(())
}
