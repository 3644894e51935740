//! Reading the charge of a piezoelectric element: as the voltage on its own
//! capacitance, or moved to the capacitor of an amplifier.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{FirstOrderFilter, Output};
use crate::quantity::{
    self, Checked, OpenLoopGain, PositiveCapacitance, PositiveGain, PositiveResistance,
};
use taxel_numerics::linear_chain::Transfer;

/// A stage of high input impedance that follows the voltage of the element
/// (P3 Eq. 25, figure 7(b)), and the filter behind it, if there is one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VoltageAmplifier {
    /// Gain; 1 for a follower.
    #[serde(deserialize_with = "quantity::one::<PositiveGain, _>")]
    #[schemars(with = "Checked<PositiveGain>")]
    pub gain: f64,
    /// Filter behind it; none when the key is missing.
    #[serde(default)]
    pub filter: Option<FirstOrderFilter>,
    /// Output of the last stage.
    pub output: Output,
}

/// A charge amplifier: the element between ground and the inverting input,
/// R_f parallel to C_f as feedback (P3 Eq. 26), and the filter behind it, if
/// there is one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChargeMode {
    /// Feedback resistance R_f, Ω.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub feedback_resistance: f64,
    /// Feedback capacitance C_f, F.
    #[serde(deserialize_with = "quantity::one::<PositiveCapacitance, _>")]
    #[schemars(with = "Checked<PositiveCapacitance>")]
    pub feedback_capacitance: f64,
    /// Open-loop gain A₀; infinite for the ideal amplifier.
    #[serde(deserialize_with = "quantity::one::<OpenLoopGain, _>")]
    #[schemars(with = "Checked<OpenLoopGain>")]
    pub open_loop_gain: f64,
    /// Filter behind it; none when the key is missing.
    #[serde(default)]
    pub filter: Option<FirstOrderFilter>,
    /// Output of the last stage.
    pub output: Output,
}

/// Pass band of a front end for the charge of an element: V/q = gain · τs/(1 + τs) · 1/(1
/// + τ_f s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChargeBand {
    /// Gain in the middle of the band, V/C; negative where the stages invert.
    pub gain: f64,
    /// Time constant of the high-pass τ, s; infinite where no charge leaks.
    pub high_pass: f64,
    /// Time constant of the low-pass τ_f, s, where there is a filter.
    pub low_pass: Option<f64>,
}

impl ChargeBand {
    /// A charge meter: it holds the charge that has come.
    pub const METER: Self = Self {
        gain: 1.0,
        high_pass: f64::INFINITY,
        low_pass: None,
    };

    /// The open voltage of a source of `capacitance` C, F, with its leak `resistance` R, Ω:
    /// the charge stands on C and leaks with R C (P3 Eq. 8).
    pub fn open(capacitance: f64, resistance: f64) -> Self {
        Self {
            gain: 1.0 / capacitance,
            high_pass: resistance * capacitance,
            low_pass: None,
        }
    }

    /// The slowest time constant, s; zero where nothing fades.
    pub fn slowest(&self) -> f64 {
        let high_pass = Some(self.high_pass).filter(|time| time.is_finite());
        high_pass.unwrap_or(0.0).max(self.low_pass.unwrap_or(0.0))
    }

    /// Output per charge, V/C.
    pub fn transfer(&self) -> Transfer {
        let high_pass = if self.high_pass.is_finite() {
            Transfer::high_pass(self.gain, self.high_pass)
        } else {
            Transfer::constant(self.gain)
        };
        match self.low_pass {
            Some(time) => high_pass.then(&Transfer::low_pass(1.0, time)),
            None => high_pass,
        }
    }

    fn filtered(self, filter: Option<FirstOrderFilter>) -> Self {
        match filter {
            Some(filter) => Self {
                gain: self.gain * filter.gain(),
                low_pass: Some(filter.time_constant()),
                ..self
            },
            None => self,
        }
    }
}

impl VoltageAmplifier {
    /// The band for a source of `capacitance` C, F, with its leak `resistance`
    /// R, Ω: the charge stands on C and leaks with R C (P3 Eqs. 8, 27).
    pub fn band(&self, capacitance: f64, resistance: f64) -> ChargeBand {
        let open = ChargeBand::open(capacitance, resistance);
        let first = ChargeBand {
            gain: self.gain * open.gain,
            ..open
        };
        first.filtered(self.filter)
    }
}

impl ChargeMode {
    /// The band for a source of `capacitance` C, F, with its leak `resistance`
    /// R, Ω.
    ///
    /// V/q = −s/(s C_f′ + 1/R_f′) with C_f′ = C_f + (C + C_f)/A₀ and
    /// 1/R_f′ = 1/R_f + (1/R + 1/R_f)/A₀: Kirchhoff's law at the inverting
    /// input, which stays at −V/A₀. The ideal amplifier gives
    /// −s R_f/(1 + s R_f C_f), and −1/C_f above its corner (P3 Eq. 26).
    pub fn band(&self, capacitance: f64, resistance: f64) -> ChargeBand {
        let per_gain = 1.0 / self.open_loop_gain;
        let feedback =
            self.feedback_capacitance + (capacitance + self.feedback_capacitance) * per_gain;
        let leak = 1.0 / self.feedback_resistance;
        let leak = leak + (1.0 / resistance + leak) * per_gain;
        let first = ChargeBand {
            gain: -1.0 / feedback,
            high_pass: feedback / leak,
            low_pass: None,
        };
        first.filtered(self.filter)
    }
}
