//! The cross-section of an in-plane sensor that no table has: what was solved of it.

use serde::{Deserialize, Serialize};

use super::tilted_plate::VACUUM_PERMITTIVITY;
use crate::mechanics::{DeformedElectrodes, LARGEST_COMPRESSION, OutsideTable};

/// A solved cross-section: what the fast forms of its drawing are multiplied by or added to.
///
/// It is known for the drawn gap and for a narrower and a wider one, since made gaps
/// scatter and a calibration finds its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolvedSection {
    /// The drawn gap, m, and the gaps that were solved over it, rising.
    pub drawn_gap: f64,
    /// See `drawn_gap`.
    pub gaps: Vec<f64>,
    /// Step of compression between states.
    pub step: f64,
    /// States of each gap, the first at rest.
    pub states: Vec<Vec<[f64; NUMBERS]>>,
    /// Largest known errors.
    pub errors: SectionErrors,
    /// Why the solution ended before a compression of 0.4.
    pub ended: Option<String>,
}

/// Largest known errors of a solved cross-section: the differences of a coarser mesh, and
/// at least those that were seen against independent programs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionErrors {
    /// Of the capacitance at rest, as a share.
    pub capacitance: f64,
    /// Of its change under load, as a share.
    pub change: f64,
    /// Of the force, as a share; none where the end condition is a factor and no body.
    pub force: Option<f64>,
}

/// Gap, thickness and width over those at rest, capacitance beside the closed form over
/// ε₀ w_e, and force over that of the closed form.
const NUMBERS: usize = 5;
/// Places of these numbers.
const OFFSET: usize = 3;
const FORCE: usize = 4;
/// Fewest states for cubics, rest among them.
const FEWEST: usize = 4;
impl SectionErrors {
    /// Errors that are stated at least: those against the reference tables of the published
    /// sections (`docs/theory/in-plane-capacitive.md`).
    pub const LEAST: Self = Self {
        capacitance: 2e-3,
        change: 1e-2,
        force: Some(1e-2),
    };
}

impl SolvedSection {
    /// Numbers of a state: gap, thickness and width over those at rest, capacitance beside the
    /// closed form over ε₀ w_e, and force over that of the closed form.
    pub const NUMBERS: usize = NUMBERS;
    /// Index of the force among the numbers.
    pub const FORCE: usize = FORCE;

    /// Largest compression that was solved.
    pub fn largest_compression(&self) -> f64 {
        self.step * (self.states[0].len() - 1) as f64
    }

    /// Largest known errors.
    pub fn errors(&self) -> &SectionErrors {
        &self.errors
    }

    /// Why the solution ended before a compression of 0.4.
    pub fn ended(&self) -> Option<&str> {
        self.ended.as_deref()
    }

    /// Checks that a gap is among those that were solved.
    ///
    /// # Errors
    /// [`OutsideTable`].
    pub(super) fn check(&self, gap: f64) -> Result<(), OutsideTable> {
        let name = "gap over drawn gap";
        let range = [self.gaps[0], self.gaps[self.gaps.len() - 1]];
        OutsideTable::check(
            "the solved cross-section",
            name,
            gap / self.drawn_gap,
            range,
        )
    }

    /// Gap, thickness and width of `rest` at a compression.
    pub(super) fn deform(&self, rest: &DeformedElectrodes, compression: f64) -> DeformedElectrodes {
        let [gap, thickness, width, ..] = self.at(rest.gap, compression);
        DeformedElectrodes {
            gap: rest.gap * gap,
            thickness: rest.thickness * thickness,
            width: rest.width * width,
        }
    }

    /// Capacitance beside that of the closed form, F.
    pub(super) fn offset(&self, gap: f64, compression: f64, depth: f64) -> f64 {
        VACUUM_PERMITTIVITY * depth * self.at(gap, compression)[OFFSET]
    }

    /// Force over that of the closed form.
    pub(super) fn force_ratio(&self, gap: f64, compression: f64) -> f64 {
        self.at(gap, compression)[FORCE]
    }

    /// Numbers on cubics through the four nearest compressions, and on a parabola in the
    /// logarithm of the gap.
    pub fn at(&self, gap: f64, compression: f64) -> [f64; NUMBERS] {
        let place = compression.clamp(0.0, self.largest_compression()) / self.step;
        let count = self.states[0].len();
        let first = (place as usize).saturating_sub(1).min(count - FEWEST);
        let along: Vec<f64> = (first..first + FEWEST).map(|k| k as f64).collect();
        let by_compression = shares(&along, place);
        let logarithms: Vec<f64> = self.gaps.iter().map(|gap| gap.ln()).collect();
        let by_gap = shares(&logarithms, (gap / self.drawn_gap).ln());
        let mut numbers = [0.0; NUMBERS];
        for (states, of_gap) in self.states.iter().zip(by_gap) {
            for (state, share) in states[first..].iter().zip(&by_compression) {
                for (number, value) in numbers.iter_mut().zip(state) {
                    *number += of_gap * share * value;
                }
            }
        }
        numbers
    }

    /// True of numbers that make a model.
    pub(crate) fn is_sound(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let count = self.states.first().map_or(0, Vec::len);
        let state = |numbers: &[f64; NUMBERS]| {
            numbers.iter().all(|value| value.is_finite())
                && numbers[..OFFSET].iter().all(|value| positive(*value))
                && positive(numbers[FORCE])
        };
        let errors = [
            Some(self.errors.capacitance),
            Some(self.errors.change),
            self.errors.force,
        ];
        count >= FEWEST
            && self.states.len() == self.gaps.len()
            && self
                .states
                .iter()
                .all(|states| states.len() == count && states.iter().all(state))
            && self.gaps.iter().all(|gap| positive(*gap))
            && self.gaps.windows(2).all(|pair| pair[0] < pair[1])
            && self.gaps.len() >= 2
            && positive(self.step)
            && self.largest_compression() <= LARGEST_COMPRESSION * (1.0 + 1e-9)
            && positive(self.drawn_gap)
            && errors.into_iter().flatten().all(positive)
    }
}

/// Shares of the polynomial through `nodes` at a place.
fn shares(nodes: &[f64], place: f64) -> Vec<f64> {
    (0..nodes.len())
        .map(|own| {
            let others = (0..nodes.len()).filter(|other| *other != own);
            others
                .map(|other| (place - nodes[other]) / (nodes[own] - nodes[other]))
                .product()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_on_cubics_in_compression_and_parabolas_in_the_logarithm_of_the_gap() {
        let value = |gap: f64, e: f64| {
            let l = gap.ln();
            1.0 + e - 3.0 * e * e + 9.0 * e.powi(3) + 0.2 * l + 0.1 * l * l * e
        };
        let gaps = vec![0.5, 1.0, 2.0];
        let way = |gap: &f64| {
            (0..8)
                .map(|k| [value(*gap, 0.05 * f64::from(k)); NUMBERS])
                .collect()
        };
        let section = SolvedSection {
            drawn_gap: 20e-6,
            step: 0.05,
            states: gaps.iter().map(way).collect(),
            gaps,
            errors: SectionErrors::LEAST,
            ended: None,
        };
        assert!(section.is_sound());
        for (gap, e) in [(20e-6, 0.0), (21e-6, 0.013), (10e-6, 0.35), (37e-6, 0.2)] {
            let found = section.at(gap, e)[0];
            // Rounding of a few products.
            assert!((found - value(gap / 20e-6, e)).abs() < 1e-13, "{gap} {e}");
        }
        assert!(section.check(41e-6).is_err() && section.check(39e-6).is_ok());
    }
}
