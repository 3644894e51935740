//! Frames and where they come from: the simulated twin, a recording.

mod frame;
pub mod recording;

pub use frame::{Frame, Quantity, SignalUnit, Stream};
