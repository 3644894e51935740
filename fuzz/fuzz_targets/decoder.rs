//! Any bytes, in any chunks, on any shipped board: no panic, and no more kept than two packets
//! of the longest length.
#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use taxel_board::{Begin, Board, Decoder, HelloFinder};

static BOARDS: OnceLock<Vec<Board>> = OnceLock::new();

fuzz_target!(|data: &[u8]| {
    let boards = BOARDS.get_or_init(|| {
        let names = Board::shipped_names();
        names.filter_map(Board::shipped).collect()
    });
    // The first byte chooses the board, the second the chunks.
    let [board, chunk, bytes @ ..] = data else {
        return;
    };
    let board = &boards[usize::from(*board) % boards.len()];
    let mut decoder = Decoder::new(board, Begin::Cut);
    let mut finder = HelloFinder::default();
    for (place, bytes) in bytes.chunks(usize::from(*chunk) + 1).enumerate() {
        decoder.push(bytes, Some(place as u64 * 1_000_000));
        while decoder.next().is_some() {}
        assert!(decoder.waiting() <= 2 * 65536);
        finder.push(bytes);
    }
    decoder.finish();
});
