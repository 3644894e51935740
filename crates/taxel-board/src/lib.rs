//! Boards of tactile sensors: the description of a board, its bytes to frames and back, its
//! counters and clocks.
//!
//! Nothing here opens a port, reads a clock or starts a thread: bytes and the times of their
//! arrival go in, frames and counts come out.
//!
//! ```
//! use taxel_board::{Begin, Board, Decoder};
//!
//! let board = Board::shipped("optoforce-16").expect("shipped files are right");
//! let mut decoder = Decoder::new(&board, Begin::Whole);
//! let wire = [0xaa, 7, 8, 0x0a, 0x2d, 0x6a, 0, 0, 0xff, 0xf7, 0xff, 0xfb, 0, 7, 5, 0x51];
//! decoder.push(&wire, None);
//! let frame = decoder.next().expect("one packet is one frame");
//! assert_eq!(frame.sequence, 11626);
//! assert!((frame.values[0] - -9.0 * 0.0378549).abs() < 1e-12);
//! ```

mod board;
mod check;
mod clock;
mod hello;
mod listen;
mod names;
mod papillarray;
mod pattern;
mod wire;
mod wiring;

pub use board::{
    Amount, Board, BoardFile, BuiltIn, Carrier, Check, Class, Cobs, Counted, CountedBySequence,
    Decimal, Detection, Digits, Empty, Field, Fixed, FrameEnd, Framing, Id, Is, Length, Lines,
    Link, Marked, Message, MessageFrame, Messages, Missing, Missings, Network, Order, Packet, Poll,
    Pressed, SCHEMA_VERSION, Samples, Serial, Stamped, Stuffed, Texts, Type, Usb, UsbName,
    ValueOfBoard, Whole, Wholes,
};
pub use check::CheckKind;
pub use clock::{ClockEvent, DeviceClockMap, HostTime};
pub use hello::{HELLO_QUESTION, HelloFinder, board_file_of_hello, hello_of_channels};
pub use listen::{Draft, LEAST as LEAST_PACKETS, draft, listen};
pub use pattern::{BytePattern, Sent};
pub use wire::{Begin, Counts, Decoder, Encoder};
pub use wiring::{Mismatch, Wiring};
