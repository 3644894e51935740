//! The output of an analogue stage: noise, offset, limits, settling.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{
    self, AnyVoltage, Checked, NonNegativeTime, NonNegativeVoltage, PositiveVoltage,
};

/// Offset, noise and limits of the last analogue stage.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Noise of one reading, V rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeVoltage, _>")]
    #[schemars(with = "Checked<NonNegativeVoltage>")]
    pub noise: f64,
    /// Voltage at rest, V.
    #[serde(deserialize_with = "quantity::one::<AnyVoltage, _>")]
    #[schemars(with = "Checked<AnyVoltage>")]
    pub offset: f64,
    /// The output stays between plus and minus this, V.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub limit: f64,
    /// Time constant with which a multiplexer settles to the next channel, s;
    /// without a multiplexer it has no effect.
    #[serde(deserialize_with = "quantity::one::<NonNegativeTime, _>")]
    #[schemars(with = "Checked<NonNegativeTime>")]
    pub settling: f64,
}

impl Output {
    /// No noise, no offset, no limit, settled at once.
    pub const IDEAL: Self = Self {
        noise: 0.0,
        offset: 0.0,
        limit: f64::INFINITY,
        settling: 0.0,
    };

    /// The ideal voltage with offset and limit, V, and whether it was cut.
    pub fn limited(&self, voltage: f64) -> (f64, bool) {
        let voltage = voltage + self.offset;
        let inside = voltage.abs() <= self.limit;
        (voltage.clamp(-self.limit, self.limit), !inside)
    }
}
