//! An inverting first-order low-pass with an operational amplifier.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, PositiveCapacitance, PositiveResistance};
use taxel_numerics::linear_chain::Transfer;

/// An inverting amplifier whose feedback is R_f parallel to C_f, behind R_i′
/// (P3 Eq. 27).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FirstOrderFilter {
    /// Input resistance R_i′, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub input_resistance: f64,
    /// Feedback resistance R_f, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub feedback_resistance: f64,
    /// Feedback capacitance C_f, F.
    #[serde(deserialize_with = "quantity::one::<PositiveCapacitance, _>")]
    #[schemars(with = "Checked<PositiveCapacitance>")]
    pub feedback_capacitance: f64,
}

impl FirstOrderFilter {
    /// Static gain −R_f/R_i′.
    pub fn gain(&self) -> f64 {
        -self.feedback_resistance / self.input_resistance
    }

    /// R_f C_f, s.
    pub fn time_constant(&self) -> f64 {
        self.feedback_resistance * self.feedback_capacitance
    }

    /// Output per input voltage: −(R_f/R_i′)/(1 + s R_f C_f) (P3 Eq. 27).
    pub fn transfer(&self) -> Transfer {
        Transfer::low_pass(self.gain(), self.time_constant())
    }
}
