//! Bytes to frames and back.

mod assembly;
mod board_times;
mod can;
mod candidate;
mod counting;
mod counts;
mod cut;
mod decoder;
mod encoder;
mod json;
mod numbering;
mod pace;
mod packet;
mod remarks;
mod steps;
mod stuffing;
mod taxel_wire;
mod times;

pub use counts::Counts;
pub use decoder::{Begin, Decoder};
pub use encoder::Encoder;
pub(crate) use stuffing::{from_cobs, from_slip, to_cobs};
pub(crate) use taxel_wire::{HEADER, HELLO, content};
