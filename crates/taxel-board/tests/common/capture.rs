//! Bytes as a three-axis force sensor sends them and a program has saved them.

use taxel_board::{Board, Encoder};
use taxel_recording::Frame;

/// Name of the shipped board that sent them, and what one count of x, y and z is, N.
pub(crate) const BOARD: &str = "optoforce-16";
pub(crate) const SCALES: [f64; 3] = [0.0378549, 0.0347182, 0.3306332];

/// Bytes, and what is to be found in them.
pub(crate) struct Capture {
    pub(crate) bytes: Vec<u8>,
    /// Number and counts of the packets that are whole.
    pub(crate) whole: Vec<(u64, [i64; 3])>,
    pub(crate) lost: u64,
}

/// A capture of nearly 5000 packets. It begins inside a packet, its counter of 16 bits starts again, and every 625th packet
/// has four alien bytes in it, as of a file that was saved in blocks of text.
pub(crate) fn capture() -> Capture {
    let board = Board::shipped(BOARD).expect("shipped files are right");
    let mut encoder = Encoder::new(&board);
    let mut capture = Capture {
        bytes: Vec::new(),
        whole: Vec::new(),
        lost: 0,
    };
    let mut packet = Vec::new();
    for number in 0..5000_u64 {
        let phase = number as f64 / 300.0;
        let press = -2000.0 * (1.0 - phase.cos());
        let counts = [0.3 * press * phase.sin(), 50.0 * phase.sin(), press].map(f64::round);
        let frame = Frame {
            // The counter starts again at 65536.
            sequence: 63_000 + number,
            values: counts
                .iter()
                .zip(SCALES)
                .map(|(n, scale)| n * scale)
                .collect(),
            ..Frame::default()
        };
        packet.clear();
        encoder.encode(&frame, &mut packet);
        if number == 0 {
            // Nobody sees the packet in which a capture begins.
            packet.drain(..7);
        } else if number % 625 == 0 {
            let inside = 1 + (number / 625) as usize % (packet.len() - 1);
            packet.splice(inside..inside, *b"\nb'\xf3");
            capture.lost += 1;
        } else {
            capture
                .whole
                .push((frame.sequence, counts.map(|n| n as i64)));
        }
        capture.bytes.extend_from_slice(&packet);
    }
    capture
}
