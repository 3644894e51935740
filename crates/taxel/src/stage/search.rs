//! Least squares over the forces of a frame and all else that moves its readings.

use taxel_numerics::dense::{cholesky, cholesky_solve};

/// A step of less than this share of a standard deviation ends the search, or one that lowers the sum
/// of squares by less than the square of it.
const CLOSE: f64 = 1e-4;
/// Steps after which it is given up: Newton's converges in four to six.
const MOST_STEPS: usize = 40;
/// Deviation of a force before the frame, in full scales: so large that it says nothing, and small
/// enough that the sums keep ten digits.
const UNKNOWN_FORCE: f64 = 1e3;

/// Predicted readings and their slopes by all unknowns, a row for each reading.
pub(super) struct Model {
    pub(super) signals: Vec<f64>,
    pub(super) slopes: Vec<Vec<f64>>,
}

/// The end of a search.
pub(super) struct Found {
    pub(super) unknowns: Vec<f64>,
    /// Cholesky's factor of the normal equations.
    pub(super) factor: Vec<Vec<f64>>,
    /// Residuals over their deviations.
    pub(super) residuals: Vec<f64>,
    /// Slopes of the readings there, a row for each.
    pub(super) slopes: Vec<Vec<f64>>,
    /// Sum of all squares, those of the unknowns that are known beforehand included.
    pub(super) square: f64,
}

impl Found {
    /// Deviation of the unknown that has the `row` of the covariance, by the `noise` of the first readings alone:
    /// what is known beforehand, and what lasts from frame to frame, is not in it.
    pub(super) fn by_noise(&self, row: &[f64], weights: &[f64], noise: &[f64]) -> f64 {
        let each = self.slopes.iter().zip(weights).zip(noise);
        let used = each.filter(|((_, weight), _)| **weight > 0.0);
        let squares = used.map(|((slopes, weight), noise)| {
            let along: f64 = slopes.iter().zip(row).map(|(a, b)| a * b).sum();
            (weight * weight * noise * along).powi(2)
        });
        squares.sum::<f64>().sqrt()
    }
}

/// Newton's method by Gauss from `start` on; a step that makes it worse is halved. The first unknowns
/// are the `forces` over the full scale, the others numbers over their deviations. None where it did
/// not end.
pub(super) fn search(
    model: impl Fn(&[f64]) -> Model,
    start: Vec<f64>,
    readings: &[f64],
    weights: &[f64],
    forces: usize,
) -> Option<Found> {
    let mut unknowns = start;
    let mut here = model(&unknowns);
    let (mut residuals, mut square) = weighed(&here, &unknowns, readings, weights, forces);
    for _ in 0..MOST_STEPS {
        let (factor, step, decrement) = step(&here, &unknowns, &residuals, weights, forces)?;
        // Of readings that contradict each other the forces need not be known any better.
        if decrement < CLOSE * CLOSE * (1.0 + square) {
            return Some(Found {
                unknowns,
                factor,
                residuals,
                slopes: here.slopes,
                square,
            });
        }
        let mut share = 1.0;
        loop {
            let tried: Vec<f64> = unknowns
                .iter()
                .zip(&step)
                .map(|(at, step)| at + share * step)
                .collect();
            let there = model(&tried);
            let (left, sum) = weighed(&there, &tried, readings, weights, forces);
            // What rounding leaves of a square of many deviations is no descent.
            if sum <= square * (1.0 + 1e-12) || share < CLOSE {
                (unknowns, here, residuals, square) = (tried, there, left, sum);
                break;
            }
            share *= 0.5;
        }
    }
    None
}

/// Weight of a reading; zero of none.
pub(super) fn weight((noise, signal): (&f64, &f64)) -> f64 {
    if noise.is_finite() && signal.is_finite() && *noise > 0.0 {
        1.0 / noise
    } else {
        0.0
    }
}

/// A sum of so many squares as a number of standard deviations (Wilson and Hilferty 1931); zero
/// without one to spare.
pub(super) fn misfit(sum: f64, freedom: f64) -> f64 {
    if freedom < 1.0 {
        return 0.0;
    }
    let spread = 2.0 / (9.0 * freedom);
    ((sum / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Weighted residuals and the sum of all squares, those of the unknowns included.
fn weighed(
    model: &Model,
    unknowns: &[f64],
    signals: &[f64],
    weights: &[f64],
    forces: usize,
) -> (Vec<f64>, f64) {
    let rows = signals.iter().zip(&model.signals).zip(weights);
    let residuals: Vec<f64> = rows
        .map(|((signal, predicted), weight)| {
            if *weight > 0.0 {
                weight * (signal - predicted)
            } else {
                0.0
            }
        })
        .collect();
    let known = unknowns[forces..].iter();
    let square = residuals.iter().chain(known).map(|r| r * r).sum::<f64>();
    (residuals, square)
}

/// Factor of the normal equations, Newton's step, and by how much it lowers the sum of squares.
fn step(
    model: &Model,
    unknowns: &[f64],
    residuals: &[f64],
    weights: &[f64],
    forces: usize,
) -> Option<(Vec<Vec<f64>>, Vec<f64>, f64)> {
    let count = unknowns.len();
    let mut normal = vec![vec![0.0; count]; count];
    let mut right = vec![0.0; count];
    for ((slopes, residual), weight) in model.slopes.iter().zip(residuals).zip(weights) {
        for (i, slope) in slopes.iter().enumerate() {
            let slope = weight * slope;
            right[i] += slope * residual;
            for (sum, other) in normal[i][..=i].iter_mut().zip(slopes) {
                *sum += slope * weight * other;
            }
        }
    }
    for i in 0..count {
        let known = if i < forces {
            UNKNOWN_FORCE.powi(-2)
        } else {
            right[i] -= unknowns[i];
            1.0
        };
        normal[i][i] += known;
    }
    let factor = cholesky(normal)?;
    let step = cholesky_solve(&factor, &right);
    let decrement = step.iter().zip(&right).map(|(a, b)| a * b).sum();
    Some((factor, step, decrement))
}
