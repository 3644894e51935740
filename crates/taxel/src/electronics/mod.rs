//! Response to signal: the board that reads the taxels, one file per stage.

mod charge_amplifier;
mod converter;
mod divider_board;
mod front_end;
mod noise;
mod scan;
mod voltage_divider;

pub use charge_amplifier::ChargeAmplifier;
pub use converter::{Code, Converter};
pub use divider_board::DividerBoard;
pub use front_end::{Electronics, FrontEnd, Readout};
pub use noise::Noise;
pub use scan::{Multiplexed, RowParallel, Scan};
pub use voltage_divider::{DividerError, VoltageDivider};
