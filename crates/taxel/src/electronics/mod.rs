//! Response to signal: the board that reads the taxels, one file per stage.

mod charge_amplifier;
mod converter;
mod first_order_filter;
mod front_end;
mod noise;
mod scan;
mod voltage_amplifier;

pub use charge_amplifier::ChargeAmplifier;
pub use converter::{Code, Converter};
pub use first_order_filter::FirstOrderFilter;
pub use front_end::{Electronics, FrontEnd, Readout};
pub use noise::Noise;
pub use scan::{Multiplexed, RowParallel, Scan};
pub use voltage_amplifier::{ChargeMode, VoltageAmplifier};
