//! Three-axis magnetometers as a board.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Measured;
use crate::quantity::{
    self, AnyFluxDensity, Checked, NonNegativeFluxDensity, NonNegativeTemperature, OneOrList,
};

/// Hall or magnetoresistive chips that give the field along three axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Magnetometer {
    /// Noise of one reading, T rms: one value, or a list of those along x, y and z.
    #[serde(deserialize_with = "quantity::one_or_list::<3, NonNegativeFluxDensity, _>")]
    #[schemars(with = "OneOrList<3, NonNegativeFluxDensity>")]
    pub noise: [f64; 3],
    /// Step of its numbers, T; 0 by default.
    #[serde(
        default,
        deserialize_with = "quantity::one::<NonNegativeFluxDensity, _>"
    )]
    #[schemars(with = "Checked<NonNegativeFluxDensity>")]
    pub step: f64,
    /// Fields `[lowest, highest]` that an axis reads, T.
    #[serde(deserialize_with = "quantity::list::<2, AnyFluxDensity, _>")]
    #[schemars(with = "[Checked<AnyFluxDensity>; 2]")]
    pub range: [f64; 2],
    /// Standard deviation of what an axis reads without any field, T; 0 by default.
    #[serde(
        default,
        deserialize_with = "quantity::one::<NonNegativeFluxDensity, _>"
    )]
    #[schemars(with = "Checked<NonNegativeFluxDensity>")]
    pub offset: f64,
    /// Standard deviation of each component of a field that is the same at all chips and may turn
    /// with the robot, T: that of the earth has 25 to 65 uT.
    #[serde(deserialize_with = "quantity::one::<NonNegativeFluxDensity, _>")]
    #[schemars(with = "Checked<NonNegativeFluxDensity>")]
    pub uniform_field: f64,
    /// Standard deviation of the temperature of the magnets from that at the capture of the rest, K;
    /// 0 by default.
    #[serde(
        default,
        deserialize_with = "quantity::one::<NonNegativeTemperature, _>"
    )]
    #[schemars(with = "Checked<NonNegativeTemperature>")]
    pub temperature: f64,
}

impl Magnetometer {
    /// The chip as an instrument: rounding to a step is a part of its noise.
    pub fn instrument(&self) -> Measured {
        let rounding = self.step / 12.0_f64.sqrt();
        Measured::of_fields(self.noise.map(|noise| noise.hypot(rounding)), self.range)
    }
}
