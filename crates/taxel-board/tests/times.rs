//! Times of the board's clock, and the rate of its frames, beside their arrival.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

mod common;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel_board::{Begin, Board, Counts, Decoder, board_file_of_hello};
use taxel_recording::{Frame, FrameFlags};

const PERIOD_NS: u64 = 10_000_000;

fn board(text: &str) -> Board {
    let text = format!("schema = 1\nname = \"board\"\n{text}\n");
    Board::parse("board.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

fn lines() -> Board {
    board("framing.lines = { template = \"T={time s} {value x}\" }")
}

/// The frames of these lines and when each arrived, ns.
fn decoded(board: &Board, wire: &[(String, Option<u64>)]) -> (Vec<Frame>, Counts) {
    let mut decoder = Decoder::new(board, Begin::Whole);
    let mut frames = Vec::new();
    for (line, host_ns) in wire {
        decoder.push(format!("{line}\n").as_bytes(), *host_ns);
        frames.extend(std::iter::from_fn(|| decoder.next()));
    }
    decoder.finish();
    frames.extend(std::iter::from_fn(|| decoder.next()));
    (frames, decoder.counts())
}

/// A line every 10 ms, with the time of `clock` in seconds.
fn sent(frames: u64, arrives: bool, clock: impl Fn(u64) -> String) -> Vec<(String, Option<u64>)> {
    let line = |number: u64| {
        let host_ns = 5_000_000_000 + number * PERIOD_NS + number * 7919 % 13 * 200_000;
        let line = format!("T={} {}", clock(number), number % 7);
        (line, arrives.then_some(host_ns))
    };
    (0..frames).map(line).collect()
}

fn seconds(number: u64) -> f64 {
    40.0 + 0.01 * number as f64
}

/// How far a time lies behind the right one, ns.
fn off_ns(time_ns: u64, right_ns: u64) -> i64 {
    time_ns.cast_signed() - right_ns.cast_signed()
}

fn right_ns(number: usize) -> u64 {
    40_000_000_000 + number as u64 * PERIOD_NS
}

/// Whatever one time says, those behind it are right, and its own frame has one between those
/// of its neighbours.
#[test]
fn a_wrong_time_is_a_fault_of_its_frame_alone() {
    let board = lines();
    for arrives in [true, false] {
        for wrong in [
            "99999999999999999999",
            "1e30",
            "0",
            "41.5",
            "140.3",
            "-7",
            "5000000",
        ] {
            for place in [0, 1, 2, 5, 300, 599] {
                let clock = |number| match number {
                    number if number == place => wrong.to_owned(),
                    number => format!("{:.3}", seconds(number)),
                };
                let (frames, counts) = decoded(&board, &sent(600, arrives, clock));
                let about = format!("{wrong} at {place}, arrives {arrives}");
                assert_eq!(frames.len(), 600, "{about}");
                let last = 599 - usize::from(place == 599);
                let base = off_ns(frames[last].time_ns, right_ns(last));
                // Nothing can be told of the first one, nor of the second where nobody knows
                // when they arrived.
                if !arrives && place < 2 {
                    continue;
                }
                let begins = if place == 0 { 4 } else { 0 };
                if place > 0 {
                    assert!(base.abs() < 1000, "{about}: {base}");
                }
                for (number, frame) in frames.iter().enumerate().skip(begins) {
                    let off = off_ns(frame.time_ns, right_ns(number)) - base;
                    let most = if number == place as usize {
                        15_000_000
                    } else {
                        1000
                    };
                    assert!(off.abs() <= most, "{about}: {number} is off by {off} ns");
                }
                let ordered = frames
                    .windows(2)
                    .all(|two| two[0].time_ns <= two[1].time_ns);
                assert!(ordered, "{about}");
                if place > 2 {
                    assert_eq!((counts.wrong_time, counts.restarts), (1, 0), "{about}");
                    let flags = frames[place as usize].flags;
                    assert!(flags.has(FrameFlags::INFERRED_TIME), "{about}");
                }
            }
        }
    }
}

/// The same damage twice is no clock that goes on.
#[test]
fn two_equal_wrong_times_are_two_faults() {
    for arrives in [true, false] {
        let clock = |number| match number {
            300 | 301 => "4294967.295".to_owned(),
            number => format!("{:.3}", seconds(number)),
        };
        let (frames, counts) = decoded(&lines(), &sent(600, arrives, clock));
        assert_eq!((counts.wrong_time, counts.restarts), (2, 0));
        assert_eq!(frames[599].time_ns, right_ns(599));
    }
}

/// A clock that begins again, or jumps for good, is a restart; the time in between is that of
/// the arrival.
#[test]
fn a_jump_that_goes_on_is_a_restart() {
    let board = lines();
    for jump in [-39.0, -1.0, 1000.0, 1e6] {
        let clock = |number| {
            let begins = if number < 300 { 0.0 } else { jump };
            format!("{:.3}", seconds(number) + begins)
        };
        let (frames, counts) = decoded(&board, &sent(600, true, clock));
        assert_eq!((frames.len(), counts.restarts), (600, 1), "{jump}");
        assert_eq!(counts.wrong_time, 0, "{jump}");
        for (number, frame) in frames.iter().enumerate() {
            let off = frame.time_ns.abs_diff(right_ns(number));
            assert!(off < 6_000_000, "{jump}: {number} is off by {off} ns");
        }
    }
    // Nobody knows when these arrived: the clock alone says how much time has passed.
    let clock = |number| {
        format!(
            "{:.3}",
            seconds(number) + if number < 300 { 0.0 } else { 1000.0 }
        )
    };
    let (frames, counts) = decoded(&board, &sent(600, false, clock));
    assert_eq!((counts.restarts, counts.wrong_time), (0, 0));
    assert_eq!(frames[599].time_ns, right_ns(599) + 1_000_000_000_000);
}

/// A link that waits a second, a board that is silent for a minute, and bytes that come out
/// of a store as fast as they are read: every time is the board's.
#[test]
fn pauses_and_stores_are_no_faults() {
    let board = lines();
    let clock = |number: u64| seconds(number) + if number < 400 { 0.0 } else { 60.0 };
    for link in ["waits", "store"] {
        let wire: Vec<_> = (0..800)
            .map(|number| {
                let now = (clock(number) * 1e9) as u64;
                let host_ns = match link {
                    "waits" if (200..300).contains(&number) => (clock(300) * 1e9) as u64,
                    "waits" => now,
                    _ => 7_000_000_000 + number * 20_000,
                };
                (format!("T={:.3} 1", clock(number)), Some(host_ns))
            })
            .collect();
        let (frames, counts) = decoded(&board, &wire);
        assert_eq!((counts.wrong_time, counts.restarts), (0, 0), "{link}");
        // The first frame behind a silence that only the clock knows has to wait for the next.
        for (number, frame) in frames
            .iter()
            .enumerate()
            .filter(|(number, _)| *number != 400)
        {
            let right = (clock(number as u64) * 1e9).round() as u64;
            assert!(frame.time_ns.abs_diff(right) < 1000, "{link}: {number}");
        }
    }
}

/// A whole clock of few steps, one that wraps, and delays of 16 ms.
#[test]
fn damaged_times_on_a_wire_without_a_check() {
    let board = board(
        "framing.fixed = { length = 6, tail = \"0d 0a\" }\npacket = { order = \"big\", fields = [
  { is = \"time\", type = \"u16\", unit = \"ms\" }, { is = \"value\", name = \"c\", type = \"u16\" },
] }",
    );
    for seed in 0..8 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut decoder = Decoder::new(&board, Begin::Whole);
        let (mut frames, mut wrong) = (Vec::new(), 0);
        let count = 20_000_u64;
        for number in 0..count {
            let milliseconds = 3 * number;
            let mut packet = [0, 0, 0, 9, 0x0d, 0x0a];
            packet[..2].copy_from_slice(&((milliseconds % 65536) as u16).to_be_bytes());
            if random.random::<f64>() < 0.01 {
                packet[..2].copy_from_slice(&random.random::<u16>().to_be_bytes());
                wrong += 1;
            }
            let polled = milliseconds.div_ceil(16) * 16 + 1;
            decoder.push(&packet, Some(polled * 1_000_000));
            frames.extend(std::iter::from_fn(|| decoder.next()));
        }
        let counts = decoder.counts();
        assert_eq!(
            (frames.len() as u64, counts.restarts),
            (count, 0),
            "seed {seed}"
        );
        assert!(
            counts.wrong_time.abs_diff(wrong) <= 8,
            "{wrong}: {counts:?}"
        );
        let off =
            |(number, frame): (usize, &Frame)| frame.time_ns.abs_diff(3_000_000 * number as u64);
        let most = frames.iter().enumerate().map(off).max().unwrap_or(0);
        let exact = frames.iter().enumerate().map(off).filter(|off| *off < 1000);
        println!(
            "seed {seed}: {wrong} damaged times of {count}, {} counted, {} frames exact, at most {:.0} ms off",
            counts.wrong_time,
            exact.count(),
            most as f64 / 1e6
        );
        assert!(most < 60_000_000, "seed {seed}: {most} ns");
        let last = frames[frames.len() - 1].time_ns;
        assert!(
            last.abs_diff(3_000_000 * (count - 1)) < 60_000_000,
            "{last}"
        );
    }
}

/// What the decoder advises after frames at `rate`, Hz, of a board file with `line`.
fn remark(
    line: &str,
    rate: f64,
    seconds: f64,
    delay: &mut dyn FnMut(f64) -> f64,
) -> Option<String> {
    let board = board(&format!(
        "{line}\nframing.lines = {{ template = \"{{value x}}\" }}"
    ));
    let mut decoder = Decoder::new(&board, Begin::Cut);
    let mut newest = 0.0_f64;
    for number in 0..(rate * seconds) as u64 {
        let now = number as f64 / rate;
        newest = newest.max(now + delay(now));
        decoder.push(b"1\n", Some((newest * 1e9) as u64));
    }
    decoder.remark()
}

#[test]
fn a_wrong_rate_is_told_with_the_line_to_change() {
    let on_time = &mut |_| 0.0;
    for (stated, rate, line) in [
        (100.0, 200.0, "rate = \"200 Hz\""),
        (200.0, 100.0, "rate = \"100 Hz\""),
        (60.0, 62.5, ""),
        (60.0, 66.6, "rate = \"66.6 Hz\""),
        (1.0, 4.0, "rate = \"4 Hz\""),
        (1000.0, 1000.0, ""),
    ] {
        let said = remark(&format!("rate = \"{stated} Hz\""), rate, 12.0, on_time);
        match line {
            "" => assert_eq!(said, None, "{stated} {rate}"),
            line => assert!(
                said.as_ref().is_some_and(|said| said.contains(line)),
                "{said:?}"
            ),
        }
    }
    // In the first seconds it is not known yet, and without a line there is nothing to compare.
    assert_eq!(remark("rate = \"100 Hz\"", 200.0, 3.0, on_time), None);
    assert_eq!(remark("", 200.0, 12.0, on_time), None);
}

#[test]
fn the_delays_of_a_link_are_no_wrong_rate() {
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut until = 0.0;
        let mut delay = |now: f64| {
            if random.random::<f64>() < 0.001 {
                until = now + 0.7 * random.random::<f64>();
            }
            let polled = (now / 0.016).ceil() * 0.016 - now;
            polled.max(until - now)
        };
        assert_eq!(
            remark("rate = \"100 Hz\"", 100.0, 60.0, &mut delay),
            None,
            "{seed}"
        );
    }
}

#[test]
fn a_clock_in_another_unit_is_told() {
    for (unit, factor) in [("ms", 1e-3), ("s", 1e3)] {
        let board = board(&format!(
            "framing.lines = {{ template = \"{{time {unit}}},{{value x}}\" }}"
        ));
        let mut decoder = Decoder::new(&board, Begin::Whole);
        for number in 0..1000_u64 {
            let shown = match unit {
                "ms" => 0.01 * number as f64,
                _ => 10.0 * number as f64,
            };
            let line = format!("{shown:.2},1\n");
            decoder.push(line.as_bytes(), Some(number * PERIOD_NS));
        }
        let said = decoder.remark().unwrap_or_default();
        assert!(
            said.contains(&format!(" {factor} times")) && said.contains("unit"),
            "{said}"
        );
    }
}

#[test]
fn without_counter_and_rate_nothing_is_estimated() {
    let none = board("framing.lines = { template = \"{value x}\" }");
    let rate = board("rate = \"100 Hz\"\nframing.lines = { template = \"{value x}\" }");
    let missing = |board: &Board, host_ns: [Option<u64>; 2]| {
        let (_, counts) = decoded(board, &host_ns.map(|at| ("1".to_owned(), at)));
        counts.missing_estimate
    };
    assert_eq!(missing(&none, [Some(0), Some(1_000_000_000)]), None);
    assert_eq!(missing(&rate, [Some(0), Some(1_000_000_000)]), Some(99));
}

#[test]
fn captured_frames_without_any_time_are_told() {
    let said = |text: &str, host_ns| {
        let board = board(text);
        let mut decoder = Decoder::new(&board, Begin::Whole);
        decoder.push(b"1,1\n2,2\n", host_ns);
        decoder.remark()
    };
    let counted = "framing.lines = { template = \"{sequence},{value x}\" }";
    assert!(said(counted, None).is_some_and(|said| said.contains("1 ms apart")));
    assert_eq!(said(counted, Some(5)), None);
    assert_eq!(said(&format!("rate = \"50 Hz\"\n{counted}"), None), None);
    assert_eq!(
        said(
            "framing.lines = { template = \"{time ms},{value x}\" }",
            None
        ),
        None
    );
}

/// A hello that names three values of a board that sends four.
#[test]
fn a_hello_with_too_few_fields_is_told() {
    let hello = |fields: usize| {
        format!(
            r#"{{"name":"b","fields":[{{"is":"value","name":"c{{1..{fields}}}","type":"i16"}}]}}"#
        )
    };
    let of_hello =
        |fields| Board::parse("hello", &board_file_of_hello(&hello(fields)).unwrap()).unwrap();
    let wire = common::packets(&of_hello(4), 0..20).concat();
    let mut decoder = Decoder::new(&of_hello(3), Begin::Whole);
    decoder.push(&wire, Some(0));
    let said = decoder.remark().unwrap_or_default();
    assert!(said.contains("2 bytes longer than the hello"), "{said}");
    assert_eq!(decoder.counts().delivered, 0);
}

/// Hostile times of any kind never move others back or end the decoder.
#[test]
fn any_times_are_survived() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for board in [
        lines(),
        board("framing.lines = { template = \"T={time ns} {value x}\" }"),
    ] {
        for arrives in [true, false] {
            let clock = |random: &mut ChaCha8Rng| match random.random_range(0..5) {
                0 => format!("{}", random.random::<u64>()),
                1 => format!("-{}", random.random::<u32>()),
                2 => format!(
                    "{}e{}",
                    random.random::<u8>(),
                    random.random_range(-30..300)
                ),
                3 => "0".into(),
                _ => format!("{}", random.random::<u8>()),
            };
            let wire: Vec<_> = (0..5000_u64)
                .map(|number| {
                    let line = format!("T={} 1", clock(&mut random));
                    (line, arrives.then_some(number * PERIOD_NS))
                })
                .collect();
            let (frames, _) = decoded(&board, &wire);
            assert!(
                frames
                    .windows(2)
                    .all(|two| two[0].time_ns <= two[1].time_ns)
            );
            assert!(frames.iter().all(|frame| frame.time_ns <= 1 << 62));
        }
    }
}
