//! Response to signal: the board that reads the capacitors.

mod charge_amplifier;
mod converter;
mod front_end;
mod scan;
mod voltage_divider;

pub use charge_amplifier::ChargeAmplifier;
pub use converter::{Code, Converter};
pub use front_end::{Electronics, FrontEnd};
pub use scan::{Multiplexed, RowParallel, Scan};
pub use voltage_divider::{DividerError, VoltageDivider};
