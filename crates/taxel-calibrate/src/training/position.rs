//! Training of the map from channels to the position and depth of a probe.

use faer::{Mat, Side};
use rayon::prelude::*;
use taxel::trained::{PositionEstimator, PositionMap, Standard, Surface, TrainingError, whiten};

use super::{Score, interval_factor};

/// Candidate: the form of a position map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionOptions {
    /// Smoothing of the surface along the plane (see [`Surface::fit`]); default 1e-4.
    pub smoothing: f64,
    /// Share of the rows that is left out at the beginning: a new body
    /// settles in its first presses; default none.
    pub run_in: f64,
    /// Share of the rows over which the weight of a row falls to 1/e of that of the last: a body
    /// that drifts is best known by its newest presses; default infinite, all count the same.
    pub fading: f64,
    /// Length of an interval of the surface over the spacing of the positions; default 1.
    pub spacing: f64,
    /// Intervals of the depth; default none, for presses of one depth.
    pub depths: usize,
}

impl Default for PositionOptions {
    fn default() -> Self {
        Self {
            smoothing: 1e-4,
            run_in: 0.0,
            fading: f64::INFINITY,
            spacing: 1.0,
            depths: 0,
        }
    }
}

impl PositionOptions {
    /// Candidates for presses of one depth.
    pub fn of_one_depth() -> Vec<Self> {
        let mut all = Vec::new();
        for run_in in [0.0, 0.25, 0.5] {
            for fading in [f64::INFINITY, FADING] {
                for smoothing in [1e-6, 1e-4, 1e-2] {
                    all.push(Self {
                        smoothing,
                        run_in,
                        fading,
                        ..Self::default()
                    });
                }
            }
        }
        all
    }
}

/// Estimates of a map for the rows that it has not seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOutPlaces {
    /// Score along x and y, with the deviations that the map gives.
    pub(crate) score: Score,
    /// Score of the depth, where it was learned.
    pub(crate) depth_score: Option<Score>,
    /// Estimated places and depths, m.
    pub(crate) estimates: Vec<[f64; 3]>,
    factor: f64,
    depth_factor: f64,
    misfit: f64,
    map: PositionMap,
}

impl HeldOutPlaces {
    /// Mean logarithm of the density of a held-out press.
    pub(crate) fn likelihood(&self) -> f64 {
        let depth = self.depth_score.map_or(0.0, |score| score.log_likelihood);
        2.0 * self.score.log_likelihood + depth
    }
}

/// Share of the rows that the choice of options holds out, at the end.
pub(crate) const HELD_OUT: f64 = 0.25;
/// A misfit this much above the largest held-out one is outside.
const MISFIT_MARGIN: f64 = 2.0;
/// Distinct readings per coefficient when the presses are on no grid.
const ROWS_PER_COEFFICIENT: f64 = 3.0;
/// Share of the rows over which presses fade.
const FADING: f64 = 1.0 / 3.0;
/// Smoothing along the depth, where readings bend little.
const DEPTH_SMOOTHING: f64 = 1e-3;

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
    let places: Vec<[f64; 3]> = places.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let (map, tried, _) = trained_position(frames, &places, candidates)?;
    Ok((map, tried.iter().map(|one| one.score).collect()))
}

/// The same for places with their depth (x, y, z in m), with all candidates and the number of
/// the one that was chosen.
pub(crate) fn trained_position(
    frames: &[Vec<f64>],
    places: &[[f64; 3]],
    candidates: &[PositionOptions],
) -> Result<(PositionMap, Vec<HeldOutPlaces>, usize), TrainingError> {
    let begin = ((1.0 - HELD_OUT) * frames.len() as f64) as usize;
    let tried: Vec<HeldOutPlaces> = candidates
        .par_iter()
        .map(|options| {
            let map = fit(&frames[..begin], &places[..begin], *options)?;
            held_out(map, &frames[begin..], &places[begin..])
        })
        .collect::<Result<_, TrainingError>>()?;
    let order = |a: &usize, b: &usize| {
        let likelihood = |i: &usize| tried[*i].likelihood();
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
    map.depth_factor = tried[best].depth_factor;
    map.largest_misfit = MISFIT_MARGIN * largest_misfit(&map, &tried[best], &frames[begin..]);
    Ok((map, tried, best))
}

/// Largest misfit of rows that the map of `judged` has not seen, by the noise of `map`: a surface
/// that is close to its own rows makes their noise small.
fn largest_misfit(map: &PositionMap, judged: &HeldOutPlaces, frames: &[Vec<f64>]) -> f64 {
    let standard = &map.standard;
    if standard.used != judged.map.standard.used {
        return judged.misfit;
    }
    let misfit = |(frame, place): (&Vec<f64>, &[f64; 3])| -> f64 {
        let answer = judged.map.answer(*place);
        let readings = standard.used.iter().map(|channel| frame[*channel]);
        let off = readings.zip(answer).zip(&standard.scale);
        let off: Vec<f64> = off
            .map(|((x, answer), scale)| (x - answer) / scale)
            .collect();
        whiten(&map.whitening, &off).iter().map(|w| w * w).sum()
    };
    let rows = frames.iter().zip(&judged.estimates);
    rows.map(misfit).fold(0.0, f64::max)
}

fn fit(
    frames: &[Vec<f64>],
    places: &[[f64; 3]],
    options: PositionOptions,
) -> Result<PositionMap, TrainingError> {
    let begin = (options.run_in.clamp(0.0, 0.9) * frames.len() as f64) as usize;
    let fading = options.fading * frames.len() as f64;
    let (frames, places) = (&frames[begin..], &places[begin..]);
    let standard = Standard::of(frames)?;
    let (rows, places): (Vec<_>, Vec<_>) = frames
        .iter()
        .zip(places)
        .filter_map(|(frame, place)| Some((standard.apply(frame).ok()?, *place)))
        .unzip();
    let weights = faded(rows.len(), fading);
    let [x, y] = intervals(&places, options.spacing);
    let smoothing = [options.smoothing, DEPTH_SMOOTHING];
    let mut surface = Surface::fit(&places, &rows, &weights, [x, y, options.depths], smoothing)?;
    let whitening = whitening(&surface, &places, &rows, &weights)?;
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
        depth_factor: 1.0,
        largest_misfit: f64::INFINITY,
    })
}

/// Scores of the estimates of held-out rows with the factors that their deviations need, and
/// the largest misfit among them.
fn held_out(
    map: PositionMap,
    frames: &[Vec<f64>],
    places: &[[f64; 3]],
) -> Result<HeldOutPlaces, TrainingError> {
    let mut estimator = PositionEstimator::new(map.clone())?;
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    let (mut depth_errors, mut depth_deviations) = (Vec::new(), Vec::new());
    let mut estimates = Vec::new();
    let mut misfit = 0.0f64;
    for (frame, place) in frames.iter().zip(places) {
        let estimate = estimator.estimate(frame)?;
        misfit = misfit.max(estimate.misfit);
        let [x, y] = estimate.position;
        let [depth, deviation] = estimate.depth.unwrap_or([0.0; 2]);
        estimates.push([x, y, depth]);
        for (axis, truth) in place[..2].iter().enumerate() {
            errors.push(estimate.position[axis] - truth);
            deviations.push(estimate.deviation()[axis]);
        }
        if estimate.depth.is_some() {
            depth_errors.push(depth - place[2]);
            depth_deviations.push(deviation);
        }
    }
    let scaled = |errors: &[f64], deviations: &[f64]| {
        let factor = interval_factor(errors, deviations);
        let deviations: Vec<f64> = deviations.iter().map(|d| factor * d).collect();
        (factor, Score::of(errors, &deviations))
    };
    let (factor, score) = scaled(&errors, &deviations);
    let depth = (!depth_errors.is_empty()).then(|| scaled(&depth_errors, &depth_deviations));
    Ok(HeldOutPlaces {
        score,
        depth_score: depth.map(|(_, score)| score),
        estimates,
        factor,
        depth_factor: depth.map_or(1.0, |(factor, _)| factor),
        misfit,
        map,
    })
}

/// Intervals along x and y, each `spacing` times as long as those of the grid that the places
/// lie on; or as many as scattered positions determine.
fn intervals(places: &[[f64; 3]], spacing: f64) -> [usize; 2] {
    let distinct = |axis: usize| {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        values.sort_by(f64::total_cmp);
        let span = values.last().unwrap_or(&0.0) - values.first().unwrap_or(&0.0);
        // A stage returns to a place within a thousandth of its way.
        values.dedup_by(|a, b| *a - *b <= 1e-3 * span);
        values.len()
    };
    let grid = [distinct(0), distinct(1)];
    let longer = |count: usize| ((count as f64 / spacing).round() as usize).max(1);
    if grid[0] * grid[1] <= places.len() {
        return grid.map(|count| longer(count.saturating_sub(1)));
    }
    let side = (places.len() as f64 / ROWS_PER_COEFFICIENT).sqrt();
    [longer((side as usize).saturating_sub(3)); 2]
}

/// Weights of rows in the order of time that fade over so many of them, one on average.
fn faded(rows: usize, fading: f64) -> Vec<f64> {
    let weights = (0..rows).rev().map(|age| (-(age as f64) / fading).exp());
    let weights: Vec<f64> = weights.collect();
    let mean = weights.iter().sum::<f64>() / rows.max(1) as f64;
    weights.into_iter().map(|weight| weight / mean).collect()
}

/// L⁻¹ of the covariance of the rows about the surface, by rows.
fn whitening(
    surface: &Surface,
    places: &[[f64; 3]],
    rows: &[Vec<f64>],
    weights: &[f64],
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
        let products = residuals.iter().zip(weights);
        let sum: f64 = products.map(|(row, w)| w * row[i] * row[j]).sum();
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
