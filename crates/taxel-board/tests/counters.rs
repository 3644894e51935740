//! Counters of 8, 16 and 32 bits with gaps, bad numbers and a rate that is off.

mod common;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel_board::{Begin, Board, Decoder, Encoder};
use taxel_recording::Frame;

fn board(bits: u32) -> Board {
    let text = format!(
        "schema = 1\nname = \"b\"\nrate = \"100 Hz\"\n[framing.fixed]\nlength = {}\nhead = \"aa 55\"\n[packet]\nfields = [{{ is = \"sequence\", type = \"u{bits}\" }}, {{ is = \"value\", name = \"c\", type = \"u32\" }}]\ncheck = {{ kind = \"CRC-16/ARC\" }}\n",
        8 + bits / 8
    );
    match Board::parse("b.toml", &text) {
        Ok(board) => board,
        Err(error) => panic!("{error}"),
    }
}

struct Run {
    sent: u64,
    lost: u64,
    bad: u64,
}

/// Frames at 100 Hz times `off`, lost one in 200 and in gaps of up to `longest`, with a wrong
/// number in one of 500. The value of a frame is its true number.
fn run(
    bits: u32,
    off: f64,
    longest: u64,
    frames: u64,
    random: &mut impl Rng,
) -> (Run, Decoder, Vec<Frame>) {
    let board = board(bits);
    let mut encoder = Encoder::new(&board);
    let mut decoder = Decoder::new(&board, Begin::Whole);
    let mut out = Vec::new();
    let mut truth = Run {
        sent: 0,
        lost: 0,
        bad: 0,
    };
    let mut number = 0;
    let mut since_bad = 0;
    while number < frames {
        let gap = match random.random::<f64>() {
            u if u < 0.005 => random.random_range(1..8),
            u if u < 0.006 => random.random_range(1..=longest),
            _ => 0,
        };
        // The ends of a run are known, and no two oddities stand beside each other.
        let gap = if number > 100 && number + 800 < frames && since_bad > 40 {
            gap
        } else {
            0
        };
        truth.lost += gap;
        number += gap;
        let bad = gap == 0 && number > 100 && since_bad > 40 && random.random::<f64>() < 0.002;
        if gap > 0 || bad {
            since_bad = 0;
        }
        since_bad += 1;
        truth.bad += u64::from(bad);
        let sequence = if bad {
            random.random_range(0..u64::from(u32::MAX))
        } else {
            number
        };
        // A wrong number may be the right one.
        let bad_is_right = bad && (sequence ^ number) & ((1 << bits.min(63)) - 1) == 0;
        truth.bad -= u64::from(bad_is_right);
        let frame = Frame {
            sequence,
            values: vec![number as f64],
            ..Frame::default()
        };
        let mut wire = Vec::new();
        encoder.encode(&frame, &mut wire);
        let jitter = random.random_range(0.0..0.004);
        let time = 1.0 + number as f64 / (100.0 * off) + jitter;
        decoder.push(&wire, Some((time * 1e9) as u64));
        out.extend(std::iter::from_fn(|| decoder.next()));
        truth.sent += 1;
        number += 1;
    }
    decoder.finish();
    out.extend(std::iter::from_fn(|| decoder.next()));
    (truth, decoder, out)
}

#[test]
fn losses_are_exact_and_no_number_is_wrong() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for off in [1.0, 1.001, 0.999] {
        for bits in [8, 16, 32] {
            let (truth, decoder, frames) = run(bits, off, 700, 60_000, &mut random);
            let counts = decoder.counts();
            let wrong = frames
                .iter()
                .filter(|frame| frame.sequence as f64 != frame.values[0])
                .count();
            assert_eq!(wrong, 0, "{bits} bits, rate x {off}");
            assert_eq!(
                counts.delivered,
                truth.sent - truth.bad,
                "no good frame is refused"
            );
            assert_eq!(counts.lost, Some(truth.lost), "{counts:?}");
            // A wrong number of 8 bits may be one that is missing: such a frame counts as late.
            assert_eq!(
                counts.wrong_number + counts.late + counts.duplicate,
                truth.bad
            );
            assert_eq!(counts.ambiguous, 0);
        }
    }
}

/// One wrong number is one frame, not thousands of millions lost.
#[test]
fn one_wrong_number_costs_one_frame() {
    let board = board(32);
    let mut encoder = Encoder::new(&board);
    let mut decoder = Decoder::new(&board, Begin::Whole);
    for number in 0..200_u64 {
        let sequence = if number == 90 { 3_999_999_980 } else { number };
        let frame = Frame {
            sequence,
            values: vec![1.0],
            ..Frame::default()
        };
        let mut wire = Vec::new();
        encoder.encode(&frame, &mut wire);
        decoder.push(&wire, None);
    }
    let counts = decoder.counts();
    assert_eq!(
        (counts.delivered, counts.lost, counts.wrong_number),
        (199, Some(0), 1),
        "{counts:?}"
    );
}

/// A board that is reset begins anew: that is no loss of thousands of frames.
#[test]
fn a_restart_is_told_apart_from_a_loss() {
    let board = board(16);
    let mut encoder = Encoder::new(&board);
    let mut decoder = Decoder::new(&board, Begin::Whole);
    let mut last = None;
    for number in 0..3000_u64 {
        let sequence = if number < 2000 {
            30_000 + number
        } else {
            number - 2000
        };
        let frame = Frame {
            sequence,
            values: vec![1.0],
            ..Frame::default()
        };
        let mut wire = Vec::new();
        encoder.encode(&frame, &mut wire);
        decoder.push(&wire, Some(number * 10_000_000));
        while let Some(frame) = decoder.next() {
            if let Some((sequence, time)) = last {
                assert!(
                    frame.sequence == sequence + 1 && frame.time_ns > time,
                    "frame {number}"
                );
            }
            last = Some((frame.sequence, frame.time_ns));
        }
    }
    let counts = decoder.counts();
    assert_eq!(
        (counts.delivered, counts.lost, counts.restarts),
        (3000, Some(0), 1),
        "{counts:?}"
    );
}

/// The same damage in two numbers in a row looks like a jump that goes on: with the time of the
/// frames neither the way there nor the way back is a loss. A short jump is one that may have
/// happened; then the frames up to it come too late.
#[test]
fn two_wrong_numbers_in_a_row_do_not_shift_those_behind_them() {
    let cases = [
        (-1_000_000_i64, 0, 0),
        (1_000_000, 0, 0),
        (-1_000_000, 0, 1),
        (1_000_000, 0, 1),
        (8, 8, 0),
    ];
    for (wrong, late, lost) in cases {
        let board = board(32);
        let mut encoder = Encoder::new(&board);
        let mut decoder = Decoder::new(&board, Begin::Whole);
        for number in 0..3000_u64 {
            if number == 1502 && lost == 1 {
                continue;
            }
            let shift = if [1500, 1501].contains(&number) {
                wrong
            } else {
                0
            };
            let frame = Frame {
                sequence: (5_000_000 + number).saturating_add_signed(shift),
                values: vec![(number % 100) as f64],
                ..Frame::default()
            };
            let mut wire = Vec::new();
            encoder.encode(&frame, &mut wire);
            decoder.push(&wire, Some(number * 10_000_000));
        }
        decoder.finish();
        let last = std::iter::from_fn(|| decoder.next()).last().unwrap();
        let counts = decoder.counts();
        assert_eq!(
            (last.sequence, counts.delivered, counts.late, counts.lost),
            (5_002_999, 3000 - late - lost, late, Some(lost)),
            "{wrong}: {counts:?}"
        );
    }
}

/// Frames that were swapped on the way come in order, or are counted as late.
#[test]
fn swapped_frames_are_late() {
    let board = board(16);
    let mut encoder = Encoder::new(&board);
    let mut decoder = Decoder::new(&board, Begin::Whole);
    let mut order: Vec<u64> = (0..400).collect();
    for at in (20..380).step_by(17) {
        order.swap(at, at + 1);
    }
    let swaps = (20..380).step_by(17).count() as u64;
    for (place, number) in order.iter().enumerate() {
        let frame = Frame {
            sequence: *number,
            values: vec![1.0],
            ..Frame::default()
        };
        let mut wire = Vec::new();
        encoder.encode(&frame, &mut wire);
        decoder.push(&wire, Some(place as u64 * 10_000_000));
    }
    decoder.finish();
    let counts = decoder.counts();
    assert_eq!(
        (counts.late, counts.delivered, counts.lost),
        (swaps, 400, Some(0)),
        "{counts:?}"
    );
}

/// A link that waits, and a board that does: the numbers go on, so nothing began anew, and the
/// times stay those of the board.
#[test]
fn a_pause_is_no_restart() {
    for kind in ["u8", "u16", "u32"] {
        let board = common::board(&format!(
            "framing.fixed = {{ length = {}, head = \"aa 55\" }}
packet = {{ fields = [
  {{ is = \"mark\", bytes = 2 }}, {{ is = \"sequence\", type = \"{kind}\" }},
  {{ is = \"time\", type = \"u32\", unit = \"us\" }}, {{ is = \"value\", name = \"c\", type = \"i16\" }},
], check = {{ kind = \"CRC-32/ISO-HDLC\" }} }}",
            12 + match kind {
                "u8" => 1,
                "u16" => 2,
                _ => 4,
            }
        ));
        let packets = common::packets(&board, 0..900);
        for pause in [0.3, 0.9, 2.0] {
            for waits in ["link", "board"] {
                let mut decoder = Decoder::new(&board, Begin::Whole);
                let mut frames = Vec::new();
                for (number, packet) in packets.iter().enumerate() {
                    let due = 1.0 + 0.01 * number as f64;
                    let resumes = 4.0 + pause;
                    let now = match waits {
                        "link" if due >= 4.0 => due.max(resumes),
                        "board" if due >= 4.0 => due + pause,
                        _ => due,
                    };
                    decoder.push(packet, Some((now * 1e9) as u64));
                    frames.extend(std::iter::from_fn(|| decoder.next()));
                }
                let counts = decoder.counts();
                let about = format!("{kind}, the {waits} waits {pause} s: {counts:?}");
                assert_eq!((frames.len(), counts.restarts), (900, 0), "{about}");
                assert_eq!((counts.lost, counts.wrong_time), (Some(0), 0), "{about}");
                for (number, frame) in frames.iter().enumerate() {
                    assert_eq!(frame.time_ns, 10_000_000 * number as u64, "{about}");
                }
            }
        }
    }
}
