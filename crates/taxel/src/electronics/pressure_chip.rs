//! Pressure chips as a board.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Measured;
use crate::quantity::{self, Checked, NonNegativeStress, PositiveStress};

/// Chips that give absolute pressures.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureChip {
    /// Absolute pressures `[lowest, highest]` that the chip reads, Pa.
    #[serde(deserialize_with = "quantity::list::<2, PositiveStress, _>")]
    #[schemars(with = "[Checked<PositiveStress>; 2]")]
    pub range: [f64; 2],
    /// Step of its numbers, Pa.
    #[serde(deserialize_with = "quantity::one::<NonNegativeStress, _>")]
    #[schemars(with = "Checked<NonNegativeStress>")]
    pub step: f64,
    /// Noise of one reading, Pa rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeStress, _>")]
    #[schemars(with = "Checked<NonNegativeStress>")]
    pub noise: f64,
    /// Pressure of the air, Pa: what the chips read at rest.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub ambient: f64,
}

impl PressureChip {
    /// The chip as an instrument: rounding to a step is a part of its noise.
    pub fn instrument(&self) -> Measured {
        let noise = self.noise.hypot(self.step / 12.0_f64.sqrt());
        Measured::of_pressures(noise, self.range)
    }
}
