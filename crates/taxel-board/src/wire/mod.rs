//! Bytes to frames and back.

mod counts;
mod cut;
mod decoder;
mod encoder;
mod numbering;
mod packet;
mod steps;
mod stuffing;
mod times;

pub use counts::Counts;
pub use decoder::{Begin, Decoder};
pub use encoder::Encoder;
