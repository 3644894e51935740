//! Damaged wires: nothing invented, and one packet lost for one damage. The long form, with ten
//! million faults: `cargo test --release -p taxel-board --test faults -- --ignored --nocapture`.

#![allow(clippy::print_stdout, reason = "the long form shows its figures")]

mod common;

use common::{DESCRIPTIONS, board, run};
use rand::SeedableRng;
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
    for (seed, (name, description)) in DESCRIPTIONS.into_iter().enumerate() {
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

/// Any bytes, on every shipped board: no panic, and no more kept than two packets.
#[test]
fn any_bytes_are_survived() {
    use rand::RngExt;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for name in Board::shipped_names() {
        let Some(board) = Board::shipped(name) else {
            panic!("{name}");
        };
        let mut decoder = Decoder::new(&board, Begin::Cut);
        let text: Vec<u8> = b"0123456789 ,.:-\r\nFDAT(p)C{}".to_vec();
        for round in 0..600 {
            let bytes: Vec<u8> = (0..500)
                .map(|_| match round % 3 {
                    0 => random.random(),
                    1 => text[random.random_range(0..text.len())],
                    // Many marks.
                    _ => [
                        0xaa, 0x55, 0, 0x0d, 0x0a, 0xc0, 7, 8, 0x66, 0x77, 0x88, 0xa0,
                    ][random.random_range(0..12)],
                })
                .collect();
            decoder.push(&bytes, Some(round * 1_000_000));
            while decoder.next().is_some() {}
            assert!(decoder.waiting() <= 2 * 65536, "{name}");
        }
        decoder.finish();
    }
}
