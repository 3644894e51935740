//! Response to signal: the board that reads the taxels, one file per stage.

mod capacitance_to_digital;
mod charge_amplifier;
mod charge_board;
mod converter;
mod divider_board;
mod first_order_filter;
mod front_end;
mod last_stage;
mod magnetometer;
mod measured;
mod output;
mod pressure_chip;
mod scan;
mod transimpedance;
mod voltage_amplifier;
mod voltage_divider;

pub use capacitance_to_digital::CapacitanceToDigital;
pub use charge_amplifier::ChargeAmplifier;
pub use charge_board::{ChargeBoard, OutputUnit};
pub use converter::{Code, Converter};
pub use divider_board::DividerBoard;
pub use first_order_filter::FirstOrderFilter;
pub use front_end::{
    CapacitanceBoard, Digital, DigitalUnit, Electronics, Readout, Stage, times_in_another_unit,
};
pub use last_stage::{Delivered, LastStage};
pub use magnetometer::Magnetometer;
pub use measured::{Measured, MeasuredUnit, NUMBER, Noises, Stated};
pub use output::Output;
pub use pressure_chip::PressureChip;
pub use scan::{Multiplexed, RowParallel, Scan};
pub use transimpedance::{ReferenceDivider, Transimpedance};
pub use voltage_amplifier::{ChargeBand, ChargeMode, VoltageAmplifier};
pub use voltage_divider::{DividerError, VoltageDivider};
