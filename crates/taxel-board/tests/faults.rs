//! Damaged wires: nothing invented, and one packet lost for one damage. The long form, with ten
//! million faults and a thousand million bytes:
//! `cargo test --release -p taxel-board --test faults -- --ignored --nocapture`; with
//! `TAXEL_FRAMING=lines` the faults of this description alone.

#![allow(clippy::print_stdout, reason = "the long form shows its figures")]

mod common;

use common::{DESCRIPTIONS, board, run};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel_board::{Begin, Board, Class, Decoder};

/// Faults of each framing here; ten million over all in the long form.
const FAULTS: u64 = 700;

#[test]
fn one_damage_costs_one_packet_and_nothing_is_invented() {
    survive(FAULTS);
}

#[test]
#[ignore = "takes minutes: ten million faults"]
fn ten_million_faults() {
    survive(10_000_000 / DESCRIPTIONS.len() as u64 + 1);
}

/// So many faults of each framing.
fn survive(faults: u64) {
    let only = std::env::var("TAXEL_FRAMING").ok();
    for (seed, (name, description)) in DESCRIPTIONS.into_iter().enumerate() {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let board = board(description);
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let outcome = run(&board, 5e-4, faults, &mut random);
        let detection = board.detection();
        println!("{name}: {outcome:?}, {detection:?}");
        // A delimiter that is hit joins two packets; a length that is hit waits for its end.
        let most = match name {
            "cobs, CRC-32" | "slip, CRC-16" | "lines" => 1.1,
            "length, CRC-32" => 1.2,
            _ => 1.0,
        };
        assert!(outcome.lost_per_fault() <= most, "{name}: {outcome:?}");
        let allowed = match (detection.class, name) {
            (Class::A, name) if name.ends_with("32") => 0.0,
            // Sums and checks of 16 bits: at most 2 in 65536 damaged packets.
            (Class::A, _) => 2.0 / 65536.0 + 3.0 / faults as f64,
            _ => 0.35,
        };
        assert!(outcome.wrong_per_fault() <= allowed, "{name}: {outcome:?}");
    }
}

#[test]
fn without_faults_nothing_is_lost() {
    for (name, description) in DESCRIPTIONS {
        let board = board(description);
        let wire = common::packets(&board, 0..2000).concat();
        for chunk in [1, 13, 4096] {
            let mut decoder = Decoder::new(&board, Begin::Whole);
            let mut frames = 0;
            for bytes in wire.chunks(chunk) {
                decoder.push(bytes, None);
                while let Some(frame) = decoder.next() {
                    assert_eq!(frame.sequence, frames, "{name}");
                    frames += 1;
                }
            }
            decoder.finish();
            frames += std::iter::from_fn(|| decoder.next()).count() as u64;
            assert_eq!(frames, 2000, "{name}: {:?}", decoder.counts());
            assert!(
                decoder.counts().is_clean(),
                "{name}: {:?}",
                decoder.counts()
            );
        }
    }
}

/// Bytes of each board here; a thousand million over all in the long form.
const BYTES: u64 = 150_000;

#[test]
fn any_bytes_are_survived() {
    survive_any_bytes(BYTES);
}

#[test]
#[ignore = "takes half a minute in release: a thousand million bytes"]
fn a_thousand_million_bytes() {
    let boards = (Board::shipped_names().count() + DESCRIPTIONS.len()) as u64;
    survive_any_bytes(1_000_000_000 / boards + 1);
}

/// So many random bytes, marks, characters and damaged packets, on every board: no panic, and
/// no more kept than two packets.
fn survive_any_bytes(bytes: u64) {
    let shipped = Board::shipped_names().filter_map(|name| Some((name, Board::shipped(name)?)));
    let described = DESCRIPTIONS.map(|(name, description)| (name, board(description)));
    for (seed, (name, board)) in shipped.chain(described).enumerate() {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let mut decoder = Decoder::new(&board, Begin::Cut);
        let packets = common::packets(&board, 0..64);
        let (mut pushed, mut round, mut delivered) = (0, 0_u64, 0_u64);
        while pushed < bytes {
            let chunk = hostile(&packets, &mut random);
            pushed += chunk.len() as u64;
            round += 1;
            decoder.push(&chunk, Some(round * 1_000_000));
            delivered += std::iter::from_fn(|| decoder.next()).count() as u64;
            assert!(decoder.waiting() <= 2 * 65536, "{name}");
            if random.random_range(0..500) == 0 {
                decoder.reconnect(Begin::Cut);
            }
        }
        decoder.finish();
        println!(
            "{name}: {pushed} bytes, {delivered} frames, {:?}",
            decoder.counts()
        );
    }
}

/// Random bytes, characters, marks, or damaged packets.
fn hostile(packets: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    const TEXT: &[u8] = b"0123456789 ,.:-\r\nFDAT(p)C{}[]\"\\tTr#";
    const MARKS: [u8; 12] = [
        0xaa, 0x55, 0, 0x0d, 0x0a, 0xc0, 7, 8, 0x66, 0x77, 0x88, 0xa0,
    ];
    let kind = random.random_range(0..5);
    let mut bytes: Vec<u8> = Vec::new();
    match kind {
        0 => bytes.extend((0..500).map(|_| random.random::<u8>())),
        1 => bytes.extend((0..500).map(|_| TEXT[random.random_range(0..TEXT.len())])),
        2 => bytes.extend((0..500).map(|_| MARKS[random.random_range(0..MARKS.len())])),
        _ => {
            let rate = if kind == 3 { 1e-3 } else { 5e-2 };
            for _ in 0..4 {
                let packet = &packets[random.random_range(0..packets.len())];
                common::damaged(packet, rate, random, &mut bytes);
            }
        }
    }
    bytes
}
