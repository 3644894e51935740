//! Charge amplifier: capacitance to voltage.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{
    self, AnyVoltage, Checked, NonNegativeCapacitance, NonNegativeVoltage, PositiveCapacitance,
    PositiveVoltage, RelativeError,
};

/// A charge amplifier with its drive: V = V_drive (C + C_parasitic)/C_feedback,
/// with gain error, offset and noise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChargeAmplifier {
    /// Amplitude of the drive on the capacitor, V.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub drive: f64,
    /// Feedback capacitor, F.
    #[serde(deserialize_with = "quantity::one::<PositiveCapacitance, _>")]
    #[schemars(with = "Checked<PositiveCapacitance>")]
    pub feedback: f64,
    /// Known capacitance of the lines, parallel to every capacitor, F.
    #[serde(deserialize_with = "quantity::one::<NonNegativeCapacitance, _>")]
    #[schemars(with = "Checked<NonNegativeCapacitance>")]
    pub parasitic: f64,
    /// Noise of one reading at the output, V rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeVoltage, _>")]
    #[schemars(with = "Checked<NonNegativeVoltage>")]
    pub noise: f64,
    /// Relative gain error of the real board, unknown to the estimator.
    #[serde(deserialize_with = "quantity::one::<RelativeError, _>")]
    #[schemars(with = "Checked<RelativeError>")]
    pub gain_error: f64,
    /// Offset of the real board at the output, V, unknown to the estimator.
    #[serde(deserialize_with = "quantity::one::<AnyVoltage, _>")]
    #[schemars(with = "Checked<AnyVoltage>")]
    pub offset: f64,
}

impl ChargeAmplifier {
    /// Output without noise for a capacitance, V.
    pub fn voltage(&self, capacitance: f64) -> f64 {
        let ideal = self.drive * (capacitance + self.parasitic) / self.feedback;
        ideal * (1.0 + self.gain_error) + self.offset
    }

    /// Capacitance that the ideal board would have read as `voltage`, F.
    pub fn capacitance(&self, voltage: f64) -> f64 {
        voltage * self.farad_per_volt() - self.parasitic
    }

    /// Capacitance per output voltage, F/V.
    pub fn farad_per_volt(&self) -> f64 {
        self.feedback / self.drive
    }
}
