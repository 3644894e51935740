//! Capacitance-to-digital chips as a board.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Measured;
use crate::quantity::{self, AnyCapacitance, Checked, NonNegativeCapacitance};

/// Chips that give capacitances, counted from an offset that they take away first.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CapacitanceToDigital {
    /// Capacitances `[lowest, highest]` that the chip reads beyond its offset, F.
    #[serde(deserialize_with = "quantity::list::<2, AnyCapacitance, _>")]
    #[schemars(with = "[Checked<AnyCapacitance>; 2]")]
    pub range: [f64; 2],
    /// Capacitance that is taken away before the conversion, F; 0 by default. Its code is a part of the
    /// calibration: with another one a channel is another channel.
    #[serde(
        default,
        deserialize_with = "quantity::one::<NonNegativeCapacitance, _>"
    )]
    #[schemars(with = "Checked<NonNegativeCapacitance>")]
    pub offset: f64,
    /// Noise of one reading at this rate, F rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeCapacitance, _>")]
    #[schemars(with = "Checked<NonNegativeCapacitance>")]
    pub noise: f64,
    /// Step of its numbers, F; 0 by default.
    #[serde(
        default,
        deserialize_with = "quantity::one::<NonNegativeCapacitance, _>"
    )]
    #[schemars(with = "Checked<NonNegativeCapacitance>")]
    pub step: f64,
    /// True of a chip that drives both plates and reads the capacitance between them; false of one whose
    /// capacitors have a plate at ground.
    pub floating: bool,
}

impl CapacitanceToDigital {
    /// The chip as an instrument whose numbers have the offset in them: rounding to a step is a part of
    /// its noise.
    pub fn instrument(&self) -> Measured {
        let noise = self.noise.hypot(self.step / 12.0_f64.sqrt());
        Measured::of_capacitances(noise, self.range.map(|end| end + self.offset))
    }
}
