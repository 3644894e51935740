//! Stages that read the crossings of a matrix of lines.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, NonNegativeVoltage, PositiveResistance, PositiveVoltage};

/// Amplifier that holds a column at ground and turns its current into a voltage: V = supply x
/// conductance x feedback, the size of the output.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transimpedance {
    /// Voltage of the driven row, V.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub supply: f64,
    /// Feedback resistor, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub feedback: f64,
    /// Noise of one reading at the output, V rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeVoltage, _>")]
    #[schemars(with = "Checked<NonNegativeVoltage>")]
    pub noise: f64,
}

/// Resistor between each column and ground, across which the voltage is read.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceDivider {
    /// Voltage of the driven row, V.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub supply: f64,
    /// Reference resistor, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub reference: f64,
    /// Noise of one reading, V rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeVoltage, _>")]
    #[schemars(with = "Checked<NonNegativeVoltage>")]
    pub noise: f64,
}
