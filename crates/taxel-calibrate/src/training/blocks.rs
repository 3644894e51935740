//! Blocks of time: held-out scores, and intervals that cover what they claim.
//!
//! Neighbouring frames are nearly the same measurement. A random split puts
//! one of them into training and the other into the test, and flatters; only
//! whole blocks of time outside the training show what a map is worth.

use serde::Serialize;
use taxel_numerics::least_squares::NORMAL_95;

/// The rows of each of `count` blocks of consecutive rows, as even as can be.
pub fn blocks_of_time(rows: usize, count: usize) -> Vec<std::ops::Range<usize>> {
    let count = count.clamp(1, rows.max(1));
    let start = |block: usize| block * rows / count;
    (0..count).map(|b| start(b)..start(b + 1)).collect()
}

/// Agreement of predictions and their deviations with the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Score {
    /// Number of values.
    pub values: usize,
    /// Root of the mean square error, in the unit of the target.
    pub rms: f64,
    /// Mean logarithm of the predictive density, normal law.
    pub log_likelihood: f64,
    /// Share of the values within 1.96 deviations.
    pub coverage: f64,
}

impl Score {
    /// The score of errors with the deviations that were predicted for them.
    ///
    /// All zero without values.
    pub fn of(errors: &[f64], deviations: &[f64]) -> Self {
        let values = errors.len().min(deviations.len());
        let count = values.max(1) as f64;
        let mut score = Self {
            values,
            rms: 0.0,
            log_likelihood: 0.0,
            coverage: 0.0,
        };
        for (error, deviation) in errors.iter().zip(deviations) {
            let ratio = error / deviation;
            score.rms += error * error / count;
            score.log_likelihood -=
                (0.5 * ratio * ratio + deviation.ln() + 0.918938533204673) / count;
            score.coverage += f64::from(u8::from(ratio.abs() <= NORMAL_95)) / count;
        }
        score.rms = score.rms.sqrt();
        score
    }
}

/// Factor on the deviations after which 1.96 of them hold 95 % of the held-out
/// errors (split conformal: the ⌈0.95 (n + 1)⌉-th smallest ratio).
///
/// One without errors.
pub fn interval_factor(errors: &[f64], deviations: &[f64]) -> f64 {
    let mut ratios: Vec<f64> = errors
        .iter()
        .zip(deviations)
        .map(|(error, deviation)| (error / deviation).abs())
        .collect();
    if ratios.is_empty() {
        return 1.0;
    }
    ratios.sort_by(f64::total_cmp);
    let rank = (0.95 * (ratios.len() + 1) as f64).ceil() as usize;
    (ratios[rank.min(ratios.len()) - 1] / NORMAL_95).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_each_row_once() {
        for (rows, count) in [(10, 3), (7, 7), (3, 5), (0, 4)] {
            let blocks = blocks_of_time(rows, count);
            let all: Vec<usize> = blocks.into_iter().flatten().collect();
            assert_eq!(all, (0..rows).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_score_is_the_normal_density() {
        let score = Score::of(&[1.0, -3.0], &[1.0, 1.0]);
        assert!((score.rms - 5f64.sqrt()).abs() < 1e-15);
        assert_eq!(score.coverage, 0.5);
        let expected = -0.5 * (2.0 * std::f64::consts::PI).ln() - 2.5;
        assert!((score.log_likelihood - expected).abs() < 1e-14);
    }

    #[test]
    fn the_factor_makes_intervals_cover() {
        let errors: Vec<f64> = (1..=99).map(|i| f64::from(i) * 0.1).collect();
        let factor = interval_factor(&errors, &[1.0; 99]);
        // The 95th of 99 errors lies on the edge.
        assert!((factor * NORMAL_95 - 9.5).abs() < 1e-12);
    }
}
