//! Boards of every framing, and faults of a wire.

#![allow(dead_code, reason = "each test uses its part")]

use rand::{Rng, RngExt};
use taxel_board::{Board, Encoder};
use taxel_recording::Frame;

/// One description for each framing and check that the fault tests go over.
pub(crate) const DESCRIPTIONS: [(&str, &str); 12] = [
    (
        "fixed, CRC-32",
        r#"framing.fixed = { length = 28, head = "aa 55" }
packet = { fields = [
  { is = "mark", bytes = 2 }, { is = "sequence", type = "u32" },
  { is = "time", type = "u32", unit = "us" }, { is = "value", name = "c{1..7}", type = "i16" },
], check = { kind = "CRC-32/ISO-HDLC" } }"#,
    ),
    (
        "fixed, CRC-16",
        r#"framing.fixed = { length = 26, head = "aa 55" }
packet = { order = "big", fields = [
  { is = "mark", bytes = 2 }, { is = "sequence", type = "u32" },
  { is = "time", type = "u32", unit = "us" }, { is = "value", name = "c{1..7}", type = "i16" },
], check = { kind = "CRC-16/IBM-3740" } }"#,
    ),
    (
        "fixed, sum16",
        r#"framing.fixed = { length = 16, head = "aa 07 08 0a" }
packet = { order = "big", fields = [
  { is = "mark", bytes = 4 }, { is = "sequence", type = "u32" },
  { is = "value", name = "c{1..3}", type = "i16" },
], check = { kind = "sum16" } }"#,
    ),
    (
        "marked, CRC-16",
        r#"framing.marked = { head = "55 66", tail = "aa bb" }
packet = { fields = [
  { is = "mark", bytes = 2 }, { is = "sequence", type = "u32" }, { is = "value", name = "c{1..6}", type = "i16" },
], check = { kind = "CRC-16/MODBUS" } }"#,
    ),
    (
        "length, CRC-32",
        r#"framing.length = { head = "fe ed", at = 2, type = "u16", counts = "payload", longest = 64 }
packet = { fields = [
  { is = "mark", bytes = 2 }, { is = "skip", bytes = 2 }, { is = "sequence", type = "u32" },
  { is = "value", name = "c{1..6}", type = "f32" },
], check = { kind = "CRC-32/ISCSI" } }"#,
    ),
    (
        "cobs, CRC-32",
        r#"framing.cobs = {}
packet = { fields = [
  { is = "sequence", type = "u32" }, { is = "value", name = "c{1..6}", type = "f32" },
], check = { kind = "CRC-32/ISO-HDLC" } }"#,
    ),
    (
        "slip, CRC-16",
        r#"framing.slip = {}
packet = { fields = [
  { is = "sequence", type = "u32" }, { is = "value", name = "c{1..6}", type = "i24" },
], check = { kind = "CRC-16/XMODEM" } }"#,
    ),
    (
        "fixed, tail only",
        r#"framing.fixed = { length = 82, tail = "0d 0a" }
packet = { fields = [
  { is = "value", name = "c{1..20}", type = "f32", range = [-60000, 60000] },
] }"#,
    ),
    (
        "lines",
        r#"framing.lines = { template = "F {sequence}: {value c1..c4}" }"#,
    ),
    (
        "CAN, check in each message",
        r#"framing.messages = { carrier = "can" }
[[message]]
id_range = [0x100, 0x103]
order = "big"
fields = [{ is = "sequence", type = "u32" }, { is = "value", name = "c", type = "i16" }]
check = { kind = "CRC-16/IBM-3740" }"#,
    ),
    (
        "CAN",
        r#"framing.messages = { carrier = "can", frame = { ends_with = 0x18ff0002 } }
[[message]]
id_range = [0x18ff0000, 0x18ff0002]
fields = [{ is = "sequence", type = "u32" }, { is = "value", name = "{a,b}", type = "i16" }]"#,
    ),
    (
        "JSON",
        r#"framing.messages = { carrier = "json" }
[[message]]
key = "data"
fields = [
  { is = "sequence", key = "n" },
  { is = "time", key = "data/t", unit = "ms" },
  { is = "value", key = "data/c", name = "c{1..5}" },
  { is = "value", key = "data/h", name = "h{1..3}", type = "i16", digits = "hexadecimal" },
]"#,
    ),
];

pub(crate) fn board(description: &str) -> Board {
    let text = format!("schema = 1\nname = \"board\"\nrate = \"100 Hz\"\n{description}\n");
    match Board::parse("board.toml", &text) {
        Ok(board) => board,
        Err(error) => panic!("{error}"),
    }
}

/// A frame whose values follow from its number.
pub(crate) fn frame(board: &Board, sequence: u64) -> Frame {
    let values = (0..board.channels().len())
        .map(|channel| {
            let phase = 0.01 * sequence as f64 + channel as f64;
            (200.0 * phase.sin() + 10.0 * channel as f64).round()
        })
        .collect();
    Frame {
        sequence,
        time_ns: sequence * 10_000_000,
        values,
        ..Frame::default()
    }
}

/// The bytes of each frame.
pub(crate) fn packets(board: &Board, frames: impl Iterator<Item = u64>) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::new(board);
    frames
        .map(|sequence| {
            let mut bytes = Vec::new();
            encoder.encode(&frame(board, sequence), &mut bytes);
            bytes
        })
        .collect()
}

/// Appends `packet`, each byte flipped in one bit, left out, or with another before it, with
/// probability `rate`; gives the number of faults.
pub(crate) fn damaged(packet: &[u8], rate: f64, random: &mut impl Rng, wire: &mut Vec<u8>) -> u64 {
    let mut faults = 0;
    for byte in packet {
        if random.random::<f64>() >= rate {
            wire.push(*byte);
            continue;
        }
        faults += 1;
        match random.random_range(0..3) {
            0 => wire.push(byte ^ 1 << random.random_range(0..8)),
            1 => {}
            _ => {
                wire.push(random.random());
                wire.push(*byte);
            }
        }
    }
    faults
}

/// Losses of a run over a damaged wire.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outcome {
    pub(crate) frames: u64,
    pub(crate) faults: u64,
    pub(crate) delivered: u64,
    /// Delivered with a value that was not sent.
    pub(crate) wrong: u64,
    pub(crate) lost: u64,
}

impl Outcome {
    pub(crate) fn lost_per_fault(&self) -> f64 {
        self.lost as f64 / self.faults.max(1) as f64
    }

    pub(crate) fn wrong_per_fault(&self) -> f64 {
        self.wrong as f64 / self.faults.max(1) as f64
    }
}

/// Sends frames over a wire with faults until there were so many; compares with what was sent.
pub(crate) fn run(board: &Board, rate: f64, faults: u64, random: &mut impl Rng) -> Outcome {
    use taxel_board::{Begin, Decoder};
    let mut decoder = Decoder::new(board, Begin::Whole);
    let counted = board.detection().counter.is_some();
    let sent: Vec<Frame> = (0..4096).map(|sequence| frame(board, sequence)).collect();
    let mut encoder = Encoder::new(board);
    let mut outcome = Outcome::default();
    let (mut packet, mut wire) = (Vec::new(), Vec::new());
    let mut good = 0_u64;
    let mut sequence = 0_u64;
    while outcome.faults < faults {
        let mut next = sent[(sequence % 4096) as usize].clone();
        next.sequence = sequence;
        next.time_ns = sequence * 10_000_000;
        packet.clear();
        encoder.encode(&next, &mut packet);
        wire.clear();
        outcome.faults += damaged(&packet, rate, random, &mut wire);
        decoder.push(&wire, Some(sequence * 10_000_000));
        outcome.frames += 1;
        sequence += 1;
        while let Some(found) = decoder.next() {
            let is_sent = |sequence: u64| {
                let values = &sent[(sequence % 4096) as usize].values;
                let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-3;
                values.iter().zip(&found.values).all(close)
            };
            // Without a counter a frame is right if it is one of those just sent.
            let right = if counted {
                is_sent(found.sequence)
            } else {
                (sequence.saturating_sub(6)..sequence).any(is_sent)
            };
            outcome.delivered += 1;
            if right {
                good += 1;
            } else {
                outcome.wrong += 1;
            }
        }
    }
    decoder.finish();
    while decoder.next().is_some() {
        good += 1;
    }
    outcome.lost = outcome.frames.saturating_sub(good);
    outcome
}
