//! Any text as a board file and as the hello of a board: read or refused, and what is read
//! encodes nothing that its decoder does not survive.
#![no_main]

use libfuzzer_sys::fuzz_target;
use taxel_board::{Begin, Board, Decoder, board_file_of_hello};

fuzz_target!(|text: &str| {
    let said = board_file_of_hello(text).unwrap_or_default();
    for text in [text, &said] {
        let Ok(board) = Board::parse("fuzz.toml", text) else {
            continue;
        };
        let _ = board.facts();
        let _ = board.hello();
        let mut decoder = Decoder::new(&board, Begin::Whole);
        decoder.push(text.as_bytes(), None);
        decoder.finish();
    }
});
