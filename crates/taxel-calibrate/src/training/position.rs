//! Training of the map from channels to the place of a probe.

use faer::{Mat, Side};
use rayon::prelude::*;
use taxel::trained::{PositionEstimator, PositionMap, Standard, Surface, TrainingError, whiten};

use super::{Score, interval_factor};

/// Candidate: the form of a position map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionOptions {
    /// Smoothing of the surface (see [`Surface::fit`]).
    pub smoothing: f64,
    /// Share of the rows that is left out at the beginning: a new body
    /// settles in its first presses.
    pub run_in: f64,
}

/// Estimates of a map for the rows that it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOutPlaces {
    /// Score before the factor on the deviations.
    pub(crate) score: Score,
    /// Estimated places, m.
    pub(crate) estimates: Vec<[f64; 2]>,
    factor: f64,
    misfit: f64,
}

/// Share of the rows that the choice of options holds out, at the end.
pub(crate) const HELD_OUT: f64 = 0.25;
/// A misfit this much above the largest held-out one is outside.
const MISFIT_MARGIN: f64 = 2.0;
/// Distinct readings per coefficient when the presses are on no grid.
const ROWS_PER_COEFFICIENT: f64 = 3.0;

/// Trains on frames in the order of time with the place of each (m), with
/// that of `candidates` which best predicts the last quarter from the
/// rows before it. Returns the map and the score of each candidate there.
///
/// # Errors
/// [`TrainingError`].
pub fn train_position(
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
    candidates: &[PositionOptions],
) -> Result<(PositionMap, Vec<Score>), TrainingError> {
    let (map, scores, _) = trained_position(frames, places, candidates)?;
    Ok((map, scores))
}

/// The same with the held-out estimates of the candidate that was chosen.
pub(crate) fn trained_position(
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
    candidates: &[PositionOptions],
) -> Result<(PositionMap, Vec<Score>, HeldOutPlaces), TrainingError> {
    let begin = ((1.0 - HELD_OUT) * frames.len() as f64) as usize;
    let mut tried: Vec<HeldOutPlaces> = candidates
        .par_iter()
        .map(|options| {
            let map = fit(&frames[..begin], &places[..begin], *options)?;
            held_out(&map, &frames[begin..], &places[begin..])
        })
        .collect::<Result<_, TrainingError>>()?;
    let order = |a: &usize, b: &usize| {
        let likelihood = |i: &usize| tried[*i].score.log_likelihood;
        likelihood(a).total_cmp(&likelihood(b))
    };
    let Some(best) = (0..tried.len()).max_by(order) else {
        return Err(TrainingError::TooFew {
            found: 0,
            needed: 1,
        });
    };
    let mut map = fit(frames, places, candidates[best])?;
    map.interval_factor = tried[best].factor;
    map.largest_misfit = MISFIT_MARGIN * tried[best].misfit;
    let scores = tried.iter().map(|held_out| held_out.score).collect();
    Ok((map, scores, tried.swap_remove(best)))
}

fn fit(
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
    options: PositionOptions,
) -> Result<PositionMap, TrainingError> {
    let begin = (options.run_in.clamp(0.0, 0.9) * frames.len() as f64) as usize;
    let (frames, places) = (&frames[begin..], &places[begin..]);
    let standard = Standard::of(frames)?;
    let (rows, places): (Vec<_>, Vec<_>) = frames
        .iter()
        .zip(places)
        .filter_map(|(frame, place)| Some((standard.apply(frame).ok()?, *place)))
        .unzip();
    let intervals = intervals(&places);
    let mut surface = Surface::fit(&places, &rows, intervals, options.smoothing)?;
    let whitening = whitening(&surface, &places, &rows)?;
    let width = surface.width;
    for row in surface.coefficients.chunks_exact_mut(width) {
        let white = whiten(&whitening, row);
        row.copy_from_slice(&white);
    }
    Ok(PositionMap {
        standard,
        surface,
        whitening,
        interval_factor: 1.0,
        largest_misfit: f64::INFINITY,
    })
}

/// Score of the estimates of held-out rows, the factor on their
/// deviations, and the largest misfit among them.
fn held_out(
    map: &PositionMap,
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
) -> Result<HeldOutPlaces, TrainingError> {
    let mut estimator = PositionEstimator::new(map.clone())?;
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    let mut estimates = Vec::new();
    let mut misfit = 0.0f64;
    for (frame, place) in frames.iter().zip(places) {
        let estimate = estimator.estimate(frame)?;
        misfit = misfit.max(estimate.misfit);
        estimates.push(estimate.position);
        for (axis, truth) in place.iter().enumerate() {
            errors.push(estimate.position[axis] - truth);
            deviations.push(estimate.deviation()[axis]);
        }
    }
    let factor = interval_factor(&errors, &deviations);
    Ok(HeldOutPlaces {
        score: Score::of(&errors, &deviations),
        estimates,
        factor,
        misfit,
    })
}

/// Intervals along x and y: those of the grid that the places lie on, or as
/// many as scattered positions determine.
fn intervals(places: &[[f64; 2]]) -> [usize; 2] {
    let distinct = |axis: usize| {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        values.sort_by(f64::total_cmp);
        let span = values.last().unwrap_or(&0.0) - values.first().unwrap_or(&0.0);
        // A stage returns to a place within a thousandth of its way.
        values.dedup_by(|a, b| *a - *b <= 1e-3 * span);
        values.len()
    };
    let grid = [distinct(0), distinct(1)];
    if grid[0] * grid[1] <= places.len() {
        return grid.map(|count| count.saturating_sub(1).max(1));
    }
    let side = (places.len() as f64 / ROWS_PER_COEFFICIENT).sqrt();
    [(side as usize).saturating_sub(3).max(1); 2]
}

/// L⁻¹ of the covariance of the rows about the surface, by rows.
fn whitening(
    surface: &Surface,
    places: &[[f64; 2]],
    rows: &[Vec<f64>],
) -> Result<Vec<f64>, TrainingError> {
    let width = surface.width;
    let residuals: Vec<Vec<f64>> = places
        .iter()
        .zip(rows)
        .map(|(place, row)| {
            let fitted = surface.at(*place);
            row.iter().zip(fitted).map(|(r, f)| r - f).collect()
        })
        .collect();
    // Each coefficient takes one reading; half of them are always left.
    let freedom = (rows.len() as f64 - surface.unknowns() as f64).max(0.5 * rows.len() as f64);
    let covariance = Mat::from_fn(width, width, |i, j| {
        let sum: f64 = residuals.iter().map(|row| row[i] * row[j]).sum();
        // The channels have unit deviation; a thousandth of it is the least
        // that two presses at one place may differ.
        sum / freedom + if i == j { 1e-6 } else { 0.0 }
    });
    let factor = covariance
        .llt(Side::Lower)
        .map_err(|_| TrainingError::Dependent { features: width })?;
    let lower = factor.L();
    let mut inverse: Vec<Vec<f64>> = vec![vec![0.0; width]; width];
    for j in 0..width {
        inverse[j][j] = 1.0 / lower[(j, j)];
        for i in j + 1..width {
            let sum: f64 = (j..i).map(|k| lower[(i, k)] * inverse[k][j]).sum();
            inverse[i][j] = -sum / lower[(i, i)];
        }
    }
    Ok((0..width).flat_map(|i| inverse[i][..=i].to_vec()).collect())
}
