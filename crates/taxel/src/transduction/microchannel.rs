//! A channel of liquid metal (P4): its cross-sections to its resistance.

use schemars::JsonSchema;
use serde::Deserialize;
use taxel_numerics::{MonotoneCurve, OnCurve};

use crate::mechanics::{
    ClosingCurve, MicrochannelError, MicrochannelSection, PressureLaw, SectionClosure,
    SettledChannel, Stretch,
};
use crate::quantity::{self, Checked, PositiveFraction};

/// The conductor in one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductor {
    /// Resistivity ρ of the liquid metal, Ω m.
    pub resistivity: f64,
    /// Length L of the channel from lead to lead, m.
    pub length: f64,
    /// Cross-section at rest.
    pub section: MicrochannelSection,
}

impl Conductor {
    /// Resistance at rest R₀ = ρ L/A₀, Ω.
    ///
    /// # Example: eGaIn, 29.4e-8 Ω m, in 400 um x 20 um
    /// ```
    /// use taxel::{mechanics::MicrochannelSection, transduction::Conductor};
    /// let section = MicrochannelSection::rectangle(400e-6, 20e-6);
    /// let metre = Conductor { resistivity: 29.4e-8, length: 1.0, section };
    /// assert!((metre.rest_resistance() - 36.75).abs() < 1e-12);
    /// ```
    pub fn rest_resistance(&self) -> f64 {
        self.resistivity * self.length / self.section.area()
    }

    /// Resistance R = ρ ∫ ds/A(s) = R₀ · mean(A₀/A), Ω, by the conductance of each part.
    ///
    /// `stretches` and `sections` belong together, as in
    /// [`ClosingCurve::settle`](crate::mechanics::ClosingCurve::settle). Holds
    /// for slender channels: not where A changes within about one width.
    pub fn resistance(&self, stretches: &[Stretch], sections: &[SectionClosure]) -> f64 {
        let parts = stretches.iter().zip(sections);
        self.rest_resistance()
            * mean_inverse_area_ratio(parts.map(|(part, at)| (part.share, at.conductance)))
    }
}

/// The channels of one layer: load to resistance.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelLayer {
    /// Closing curve of a cross-section.
    pub closing: ClosingCurve,
    /// Law of the pressure of the liquid.
    pub liquid: PressureLaw,
    /// The conductor in one channel.
    pub conductor: Conductor,
    /// Gauge pressure of the liquid at rest, Pa: pressures of the liquid count from it.
    pub initial_pressure: f64,
    /// 1 − mean area ratio to thinnest area ratio, both over the drawn area.
    thinnest: Option<MonotoneCurve>,
    /// Area at rest over the drawn one.
    bulged: f64,
}

/// The thinnest section of a channel that has a mean one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThinnestPoint {
    /// Mean area ratio V/V₀.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub mean: f64,
    /// Area ratio of the thinnest section.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub thinnest: f64,
}

/// One channel under load.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelResponse {
    /// Pressure of the liquid, volume and sections.
    pub channel: SettledChannel,
    /// Resistance without leads, Ω. Where a section is beyond its closing
    /// curve this is a lower bound.
    pub resistance: f64,
    /// Relative change R/R₀ − 1.
    pub change: f64,
}

impl MicrochannelLayer {
    /// A layer; `thinnest` from slightly to strongly closed, rest is not among
    /// them and an empty list is unknown.
    ///
    /// # Errors
    /// [`MicrochannelError`] when the pressure law or the thinnest sections are not
    /// in order.
    pub fn new(
        closing: ClosingCurve,
        liquid: PressureLaw,
        conductor: Conductor,
        thinnest: &[ThinnestPoint],
    ) -> Result<Self, MicrochannelError> {
        liquid.check()?;
        let given = thinnest
            .iter()
            .map(|point| [1.0 - point.mean, point.thinnest]);
        let points = std::iter::once([0.0, 1.0]).chain(given).collect();
        let thinnest = match thinnest {
            [] => None,
            _ => Some(MonotoneCurve::new(points, None)?),
        };
        Ok(Self {
            closing,
            liquid,
            conductor,
            initial_pressure: 0.0,
            thinnest,
            bulged: 1.0,
        })
    }

    /// The same layer over-filled to a gauge pressure, Pa: its rest is the filled state.
    ///
    /// # Errors
    /// As [`ClosingCurve::filled`].
    pub fn filled(mut self, pressure: f64) -> Result<Self, MicrochannelError> {
        let (closing, bulged) = self.closing.filled(pressure)?;
        self.closing = closing;
        self.liquid = self.liquid.filled(pressure);
        self.conductor.section.height *= bulged;
        self.initial_pressure = pressure;
        self.bulged = bulged;
        Ok(self)
    }

    /// The same layer with the closing curve of a load path that knows the sections along the channel.
    pub fn along(&mut self, closing: ClosingCurve) {
        self.closing = closing;
        self.thinnest = None;
    }

    /// Area ratio of the thinnest section of a part, where it is known.
    pub fn thinnest_of(&self, part: &SectionClosure) -> Option<f64> {
        if self.closing.knows_sections() {
            part.thinnest
        } else {
            self.thinnest(part.area_ratio)
        }
    }

    /// Area at rest over the drawn one: 1 without a pressure of filling.
    pub fn bulged(&self) -> f64 {
        self.bulged
    }

    /// A channel of this layer whose parts are loaded by `stretches`.
    ///
    /// # Errors
    /// [`MicrochannelError`] for shares or pressures that make no sense.
    pub fn respond(
        &self,
        stretches: &[Stretch],
    ) -> Result<MicrochannelResponse, MicrochannelError> {
        let channel = self.closing.settle(&self.liquid, stretches)?;
        let resistance = self.conductor.resistance(stretches, &channel.sections);
        Ok(MicrochannelResponse {
            resistance,
            change: resistance / self.conductor.rest_resistance() - 1.0,
            channel,
        })
    }

    /// Area ratio of the thinnest section where the mean is `area_ratio`;
    /// `None` where it is not known.
    pub fn thinnest(&self, area_ratio: f64) -> Option<f64> {
        match self.thinnest.as_ref()?.at(1.0 - area_ratio * self.bulged) {
            OnCurve::Inside { value, .. } => Some(value / self.bulged),
            OnCurve::Below(_) | OnCurve::Above(_) => None,
        }
    }
}

/// Mean of A₀/A along a channel of parts (share of the length, A/A₀).
///
/// For one part it is 1/a; for several never the inverse of the mean of a.
///
/// # Example: half of a channel pressed to half its area
/// ```
/// let mean = taxel::transduction::mean_inverse_area_ratio([(0.5, 1.0), (0.5, 0.5)]);
/// assert_eq!(mean, 1.5);
/// ```
pub fn mean_inverse_area_ratio(parts: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    parts.into_iter().map(|(share, ratio)| share / ratio).sum()
}
