//! Deviations of gauge and capacitances: given, or estimated from the residuals.
//!
//! The gauge's error moves four capacitances in at most three directions; what
//! lies across them is noise of the capacitances alone, and separates
//! the two.

use super::checks;
use super::problem::{Reading, Whitening};
use crate::loads::range;
use taxel_numerics::least_squares::Fit;

/// Noise that is not given starts at this share of the largest force.
const FIRST: f64 = 0.01;
/// Most by which a variance changes in one round.
const MOST: f64 = 100.0;
/// Least noise of a capacitance over itself, and of a force over the largest:
/// readings without noise must not divide by zero.
const LEAST: f64 = 1e-9;

/// Deviations where the bench gives none: of a force in N, a capacitance in F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    pub(super) common: [f64; 2],
    least: [f64; 2],
}

impl Noise {
    pub(super) fn first(of: &[Reading], capacitance: f64) -> Self {
        let [low, high] = range(of.iter().flat_map(|r| r.force));
        let largest = high.max(-low).max(f64::MIN_POSITIVE);
        let rest = checks::rest_of(of).into_iter().fold(0.0, f64::max);
        Self {
            common: [FIRST * largest, capacitance],
            least: [LEAST * largest, LEAST * rest],
        }
    }

    /// Deviations of force and capacitance of each reading.
    pub(super) fn of(&self, of: &[Reading]) -> Vec<[f64; 2]> {
        let deviations =
            |r: &Reading| std::array::from_fn(|k| r.deviation[k].unwrap_or(self.common[k]));
        of.iter().map(deviations).collect()
    }

    /// Size of the misfit: χ² in the noise that was found, so that fits with their own
    /// noises can be compared.
    pub(super) fn size(&self, of: &[Reading], found: &Fit) -> f64 {
        if is_given(of) {
            found.chi_square
        } else {
            (self.common[0] / self.least[0]).ln() + (self.common[1] / self.least[1]).ln()
        }
    }

    /// Replaces what is not given by what the residuals show; the largest
    /// relative change of a deviation.
    pub(super) fn weigh_again(
        &mut self,
        of: &[Reading],
        whitening: &[Whitening],
        found: &Fit,
    ) -> f64 {
        // Rows that the gauge reaches, and those that it does not.
        let (mut square, mut freedom, mut count) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        let mut share = 0.0;
        for (index, (reading, whitening)) in of.iter().zip(whitening).enumerate() {
            let shares = whitening.share(reading.deviation[1].unwrap_or(self.common[1]));
            for (row, own) in shares.iter().enumerate() {
                let kind = usize::from(row >= whitening.gauged);
                if reading.deviation[kind].is_some() {
                    continue;
                }
                let place = 4 * index + row;
                square[kind] += found.residuals[place].powi(2);
                freedom[kind] += 1.0 - found.leverage[place];
                count[kind] += 1.0;
                if kind == 0 {
                    share += own;
                }
            }
        }
        let ratio = |kind: usize| {
            if freedom[kind] > 0.5 {
                square[kind] / freedom[kind]
            } else {
                1.0
            }
        };
        let capacitance = ratio(1);
        // Of the gauged rows, what the capacitances leave to the gauge.
        let by_gauge = if count[0] > 0.0 {
            let share: f64 = share / count[0];
            (ratio(0) - capacitance * share) / (1.0 - share).max(1e-3)
        } else {
            1.0
        };
        let mut changed = 0.0_f64;
        for (kind, factor) in [by_gauge, capacitance].into_iter().enumerate() {
            let before = self.common[kind];
            let after = before * factor.clamp(1.0 / MOST, MOST).sqrt();
            self.common[kind] = after.max(self.least[kind]);
            changed = changed.max((self.common[kind] / before - 1.0).abs());
        }
        changed
    }
}

/// True if the bench gives the deviations of all readings.
pub(super) fn is_given(of: &[Reading]) -> bool {
    let gauged = |r: &Reading| r.gauged.contains(&true);
    of.iter()
        .all(|r| r.deviation[1].is_some() && (r.deviation[0].is_some() || !gauged(r)))
}
