//! A channel of liquid metal (P4): its cross-sections to its resistance.

use crate::mechanics::{ChannelSection, SectionClosure, Stretch};

/// The conductor in one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductor {
    /// Resistivity ρ of the liquid metal, Ω m.
    pub resistivity: f64,
    /// Length L of the channel from lead to lead, m.
    pub length: f64,
    /// Cross-section at rest.
    pub section: ChannelSection,
}

impl Conductor {
    /// Resistance at rest R₀ = ρ L/A₀, Ω.
    ///
    /// # Example: eGaIn, 29.4e-8 Ω m, in 400 um x 20 um
    /// ```
    /// use taxel::{mechanics::ChannelSection, transduction::Conductor};
    /// let section = ChannelSection { width: 400e-6, height: 20e-6 };
    /// let metre = Conductor { resistivity: 29.4e-8, length: 1.0, section };
    /// assert!((metre.rest_resistance() - 36.75).abs() < 1e-12);
    /// ```
    pub fn rest_resistance(&self) -> f64 {
        self.resistivity * self.length / self.section.area()
    }

    /// Resistance R = ρ ∫ ds/A(s) = R₀ · mean(A₀/A), Ω.
    ///
    /// `stretches` and `sections` belong together, as in
    /// [`ClosingCurve::settle`](crate::mechanics::ClosingCurve::settle). Holds
    /// for slender channels: not where A changes within about one width.
    pub fn resistance(&self, stretches: &[Stretch], sections: &[SectionClosure]) -> f64 {
        let parts = stretches.iter().zip(sections);
        self.rest_resistance()
            * mean_inverse_area_ratio(parts.map(|(part, at)| (part.share, at.area_ratio)))
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
