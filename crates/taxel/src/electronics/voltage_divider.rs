//! Voltage divider: resistance of a channel to voltage.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{
    self, Checked, NonNegativeResistance, NonNegativeVoltage, PositiveResistance, PositiveVoltage,
};
use crate::signal::ResistanceSignal;

/// A divider whose lower arm is a channel with its leads:
/// V = V_S R/(R_ref + R), R = channel + leads (P4 Eq. 3).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VoltageDivider {
    /// Supply V_S, V.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub supply: f64,
    /// Reference resistor R_ref, the upper arm, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub reference: f64,
    /// Resistance of the leads of a channel, in series with it, Ω.
    #[serde(deserialize_with = "quantity::one::<NonNegativeResistance, _>")]
    #[schemars(with = "Checked<NonNegativeResistance>")]
    pub lead: f64,
    /// Voltage from which a channel counts as saturated, V, below the supply.
    #[serde(deserialize_with = "quantity::one::<PositiveVoltage, _>")]
    #[schemars(with = "Checked<PositiveVoltage>")]
    pub saturation: f64,
    /// Noise of one reading, V rms.
    #[serde(deserialize_with = "quantity::one::<NonNegativeVoltage, _>")]
    #[schemars(with = "Checked<NonNegativeVoltage>")]
    pub noise: f64,
}

/// A voltage that no channel gives.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "{voltage} V is not from this divider: a channel gives more than {lowest} V and less than {supply} V"
)]
pub struct DividerError {
    /// The voltage, V.
    pub voltage: f64,
    /// Voltage of a channel without resistance, V.
    pub lowest: f64,
    /// Voltage of an open channel, V.
    pub supply: f64,
}

impl VoltageDivider {
    /// The divider without its limits and noise.
    pub fn signal(&self) -> ResistanceSignal {
        ResistanceSignal::Divider {
            supply: self.supply,
            reference: self.reference,
            lead: self.lead,
        }
    }

    /// Voltage for a channel of `resistance`, Ω:
    /// V = V_S R/(R_ref + R) (P4 Eq. 3). An open channel (infinite) reads V_S.
    ///
    /// Holds while no current is drawn from the output.
    pub fn voltage(&self, resistance: f64) -> f64 {
        self.signal().of(resistance)
    }

    /// Resistance of the channel that reads `voltage`, Ω:
    /// R = R_ref V/(V_S − V) − leads.
    ///
    /// # Errors
    /// [`DividerError`] unless the voltage lies between that of a channel
    /// without resistance and the supply.
    ///
    /// # Example
    /// ```
    /// use taxel::electronics::VoltageDivider;
    /// let divider =
    ///     VoltageDivider { supply: 2.0, reference: 10.0, lead: 0.0, saturation: 1.97, noise: 0.0 };
    /// assert!((divider.resistance(0.505)? - 3.378).abs() < 5e-4);
    /// assert!(divider.resistance(2.0).is_err());
    /// # Ok::<(), taxel::electronics::DividerError>(())
    /// ```
    pub fn resistance(&self, voltage: f64) -> Result<f64, DividerError> {
        let lowest = self.voltage(0.0);
        if voltage > lowest && voltage < self.supply {
            Ok(self.signal().resistance(voltage))
        } else {
            Err(DividerError {
                voltage,
                lowest,
                supply: self.supply,
            })
        }
    }

    /// dV/dR = V_S R_ref/(R_ref + R)² for a channel of `resistance`, V/Ω.
    pub fn slope(&self, resistance: f64) -> f64 {
        self.signal().slope(resistance)
    }

    /// True if `voltage` counts as saturated: the channel is closed at some
    /// place, and its resistance says no more than that.
    pub fn saturated(&self, voltage: f64) -> bool {
        voltage >= self.saturation
    }
}
