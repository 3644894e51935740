//! Training of the map from channels to the position and depth of a probe.

use faer::{Mat, Side};
use rayon::prelude::*;
use taxel::trained::{PositionEstimator, PositionMap, Standard, Surface, TrainingError, whiten};

use super::next_run::{self, USUAL};
use super::{Score, interval_factor};

/// Candidate: the form of a position map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionOptions {
    /// Smoothing of the surface along the plane (see [`Surface::fit`]); default 1e-4.
    pub smoothing: f64,
    /// Share of the presses that is left out at the beginning: a new body
    /// settles in its first presses; default none.
    pub run_in: f64,
    /// Share of the presses over which the weight of a press falls to 1/e of that of the last: a body
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
                for (spacing, smoothing) in OF_ONE_DEPTH {
                    all.push(Self {
                        smoothing,
                        run_in,
                        fading,
                        spacing,
                        ..Self::default()
                    });
                }
            }
        }
        all
    }
}

/// Rows of presses with their places, in the order of runs and time.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlacedRows {
    /// Readings of all channels.
    pub(crate) frames: Vec<Vec<f64>>,
    /// x, y (m) and the depth (m) or the force (N) of each row.
    pub(crate) places: Vec<[f64; 3]>,
    /// Number of the press of each row; the rows of one press follow each other.
    pub(crate) presses: Vec<usize>,
    /// True if the third of the places is a force.
    pub(crate) by_force: bool,
}

impl PlacedRows {
    /// Rows of one press each, of one depth.
    fn of_single(frames: &[Vec<f64>], places: &[[f64; 2]]) -> Self {
        Self {
            frames: frames.to_vec(),
            places: places.iter().map(|[x, y]| [*x, *y, 0.0]).collect(),
            presses: (0..frames.len()).collect(),
            by_force: false,
        }
    }

    /// Some of the rows.
    pub(crate) fn taken(&self, rows: &[usize]) -> Self {
        Self {
            frames: rows.iter().map(|row| self.frames[*row].clone()).collect(),
            places: rows.iter().map(|row| self.places[*row]).collect(),
            presses: rows.iter().map(|row| self.presses[*row]).collect(),
            by_force: self.by_force,
        }
    }

    /// True if the places lie on a grid.
    pub(crate) fn on_a_grid(&self) -> bool {
        grid(&self.places, self.of_presses().len()).is_some()
    }

    /// Rows of each press.
    pub(crate) fn of_presses(&self) -> Vec<std::ops::Range<usize>> {
        let mut all: Vec<std::ops::Range<usize>> = Vec::new();
        for (row, press) in self.presses.iter().enumerate() {
            match all.last_mut() {
                Some(last) if self.presses[last.start] == *press => last.end = row + 1,
                _ => all.push(row..row + 1),
            }
        }
        all
    }
}

/// Rows that train and rows that test.
#[derive(Debug, Clone, Default)]
pub(crate) struct Split {
    pub(crate) train: Vec<usize>,
    pub(crate) test: Vec<usize>,
}

impl Split {
    /// The rows of the last presses test those before.
    pub(crate) fn last(presses: &[std::ops::Range<usize>], rows: usize) -> Self {
        let begin = ((1.0 - HELD_OUT) * presses.len() as f64) as usize;
        let begin = presses.get(begin).map_or(rows, |press| press.start);
        Self {
            train: (0..begin).collect(),
            test: (begin..rows).collect(),
        }
    }
}

/// Errors with the deviations that a map gives them, and the force of each, N; zero where it is not a
/// coordinate of the map.
#[derive(Debug, Clone, PartialEq, Default)]
struct Judged {
    errors: Vec<f64>,
    deviations: Vec<f64>,
    forces: Vec<f64>,
}

impl Judged {
    fn push(&mut self, error: f64, deviation: f64, force: f64) {
        self.errors.push(error);
        self.deviations.push(deviation);
        self.forces.push(force);
    }

    fn join<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut all = Self::default();
        for part in parts {
            all.errors.extend(&part.errors);
            all.deviations.extend(&part.deviations);
            all.forces.extend(&part.forces);
        }
        all
    }

    /// The factor that holds 95 % of the errors; of light and hard touches each.
    fn factor(&self) -> f64 {
        let mut order: Vec<usize> = (0..self.errors.len()).collect();
        order.sort_by(|a, b| self.forces[*a].total_cmp(&self.forces[*b]));
        let varied = |ends: [usize; 2]| self.forces[ends[0]] < self.forces[ends[1]];
        let ends = order.first().zip(order.last());
        let kinds = ends.map_or(1, |(a, b)| if varied([*a, *b]) { FORCES } else { 1 });
        let of = |rows: &[usize]| {
            let [errors, deviations] = [&self.errors, &self.deviations]
                .map(|all| rows.iter().map(|row| all[*row]).collect::<Vec<_>>());
            interval_factor(&errors, &deviations)
        };
        let kinds = order.chunks(order.len().div_ceil(kinds).max(1));
        let largest = kinds.map(of).reduce(f64::max);
        largest.unwrap_or(1.0)
    }

    fn score(&self, factor: f64) -> Score {
        let deviations: Vec<f64> = self.deviations.iter().map(|d| factor * d).collect();
        Score::of(&self.errors, &deviations)
    }
}

/// What a map makes of the rows of one split that it has not seen.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    map: PositionMap,
    /// Of x and y together, and of the depth.
    judged: [Judged; 2],
    estimates: Vec<[f64; 3]>,
    misfit: f64,
}

/// Estimates of the maps of an option for the rows that they have not seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeldOutPlaces {
    /// Score along x and y, with deviations that hold 95 % of the errors.
    pub(crate) score: Score,
    /// Score of the depth, where it was learned.
    pub(crate) depth_score: Option<Score>,
    /// Factors on the deviations of the plane and of the depth.
    factors: [f64; 2],
    parts: Vec<Part>,
}

impl HeldOutPlaces {
    fn of(parts: Vec<Part>) -> Self {
        let [plane, depth] = [0, 1].map(|of| Judged::join(parts.iter().map(|p| &p.judged[of])));
        let factors = [plane.factor(), depth.factor()];
        Self {
            score: plane.score(factors[0]),
            depth_score: (!depth.errors.is_empty()).then(|| depth.score(factors[1])),
            factors,
            parts,
        }
    }

    /// Mean logarithm of the density of a held-out press.
    pub(crate) fn likelihood(&self) -> f64 {
        let depth = self.depth_score.map_or(0.0, |score| score.log_likelihood);
        2.0 * self.score.log_likelihood + depth
    }

    /// Estimated places and depths, m, split by split.
    pub(crate) fn estimates(&self) -> Vec<[f64; 3]> {
        let parts = self.parts.iter();
        parts.flat_map(|part| part.estimates.clone()).collect()
    }

    /// Factors of each split by itself: those of the plane, and those of the depth.
    fn of_splits(&self) -> [Vec<f64>; 2] {
        [0, 1].map(|of| self.parts.iter().map(|p| p.judged[of].factor()).collect())
    }
}

/// Ranges of the force, each of which the intervals hold.
const FORCES: usize = 4;
/// Share of the presses that the choice of options holds out, at the end.
pub(crate) const HELD_OUT: f64 = 0.25;
/// A misfit this much above the largest held-out one is outside.
const MISFIT_MARGIN: f64 = 2.0;
/// Distinct readings per coefficient when the presses are on no grid.
const ROWS_PER_COEFFICIENT: f64 = 3.0;
/// The same on a grid, which leaves no gaps.
const GRID_ROWS_PER_COEFFICIENT: f64 = 1.5;
/// Spacings of the surfaces of one depth, with smoothings that suit them: intervals shorter than the
/// grid need more.
const OF_ONE_DEPTH: [(f64, f64); 7] = [
    (1.0, 1e-6),
    (1.0, 1e-4),
    (1.0, 1e-2),
    (0.75, 1e-2),
    (0.75, 3e-2),
    (0.5, 3e-2),
    (0.5, 0.1),
];
/// Share of the rows over which presses fade.
const FADING: f64 = 1.0 / 3.0;
/// Smoothing along the depth, where readings bend little.
const DEPTH_SMOOTHING: f64 = 1e-3;

/// Rows from which the effect of that gain is taken.
const GAIN_ROWS: usize = 500;

/// Trains on frames in the order of time with the place of each (m), one row for each press, with
/// that of `candidates` which best predicts the last quarter from the
/// rows before it. The intervals are those of the run. Returns the map and the score of each
/// candidate there.
///
/// # Errors
/// [`TrainingError`].
pub fn train_position(
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
    candidates: &[PositionOptions],
) -> Result<(PositionMap, Vec<Score>), TrainingError> {
    let rows = PlacedRows::of_single(frames, places);
    let split = Split::last(&rows.of_presses(), frames.len());
    let (map, tried) = trained_position(&rows, &[split], candidates)?;
    Ok((map, tried.scores))
}

/// What was tried of the candidates: the score of each, and what was held out of the best.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tried {
    pub(crate) scores: Vec<Score>,
    /// Number of the best, from 0.
    pub(crate) best: usize,
    pub(crate) held_out: HeldOutPlaces,
}

impl Tried {
    /// Of candidates that follow one another; the maps of the worse are forgotten.
    fn join(mut self, mut next: Self) -> Self {
        let first = self.scores.len();
        self.scores.append(&mut next.scores);
        if next.held_out.likelihood() >= self.held_out.likelihood() {
            (self.best, self.held_out) = (first + next.best, next.held_out);
        }
        self
    }
}

/// The same for any rows and splits of them. The deviations of the map hold 95 % of the errors of the held-out
/// rows.
pub(crate) fn trained_position(
    rows: &PlacedRows,
    splits: &[Split],
    candidates: &[PositionOptions],
) -> Result<(PositionMap, Tried), TrainingError> {
    let none = TrainingError::TooFew {
        found: 0,
        needed: 1,
    };
    let tried = candidates
        .par_iter()
        .map(|options| {
            let held_out = held_out(rows, splits, *options)?;
            Ok(Tried {
                scores: vec![held_out.score],
                best: 0,
                held_out,
            })
        })
        .try_reduce_with(|first, next| Ok(first.join(next)))
        .ok_or(none)??;
    let mut map = fit(rows, candidates[tried.best])?;
    [map.interval_factor, map.depth_factor] = tried.held_out.factors;
    let parts = tried.held_out.parts.iter().zip(splits);
    let misfits = parts.map(|(part, split)| largest_misfit(&map, part, &rows.frames, &split.test));
    map.largest_misfit = MISFIT_MARGIN * misfits.fold(0.0, f64::max);
    Ok((map, tried))
}

/// Largest misfit of rows that the map of `judged` has not seen, by the noise of `map`: a surface
/// that is close to its own rows makes their noise small.
fn largest_misfit(map: &PositionMap, judged: &Part, frames: &[Vec<f64>], rows: &[usize]) -> f64 {
    let standard = &map.standard;
    if standard.used != judged.map.standard.used {
        return judged.misfit;
    }
    let misfit = |(row, place): (&usize, &[f64; 3])| -> f64 {
        let frame = &frames[*row];
        let answer = judged.map.answer(*place);
        let readings = standard.used.iter().map(|channel| frame[*channel]);
        let off = readings.zip(answer).zip(&standard.scale);
        let off: Vec<f64> = off
            .map(|((x, answer), scale)| (x - answer) / scale)
            .collect();
        whiten(&map.whitening, &off).iter().map(|w| w * w).sum()
    };
    let rows = rows.iter().zip(&judged.estimates);
    rows.map(misfit).fold(0.0, f64::max)
}

/// Widens the intervals of a map to those of the next run.
///
/// `within` are the factors that rows of the same run need, `of_runs` those of each run under a map of
/// the others, for the plane and for the depth; none of a single run. What is beyond the former is the
/// difference between runs, in units of the variance that the map states ([`next_run::deviation`]).
fn widen(map: &mut PositionMap, within: [f64; 2], of_runs: &[Vec<f64>; 2], usual: [f64; 2]) {
    let factor = |axis: usize| {
        let runs = of_runs[axis].len().max(1);
        let share = next_run::share(runs);
        let own = of_runs[axis].iter().map(|factor| {
            let beyond = factor * factor - within[axis] * within[axis];
            share * share * beyond
        });
        within[axis].hypot(next_run::deviation(usual[axis], own.sum(), runs, runs))
    };
    (map.interval_factor, map.depth_factor) = (factor(0), factor(1));
}

/// Makes the intervals of a map those of the next run. `whole_runs` are the rows that were held out in
/// turn if those were whole runs; `rest` are readings of the empty body. Returns the factor by which
/// the intervals of the plane are wider than those within a run.
///
/// # Errors
/// [`TrainingError`].
pub(crate) fn for_the_next_run(
    map: &mut PositionMap,
    rows: &PlacedRows,
    options: PositionOptions,
    whole_runs: Option<(&HeldOutPlaces, &Split)>,
    rest: &[f64],
) -> Result<f64, TrainingError> {
    let (within, of_runs) = match whole_runs {
        Some((runs, within)) => {
            let within = held_out(rows, std::slice::from_ref(within), options)?;
            (within.factors, runs.of_splits())
        }
        None => ([map.interval_factor, map.depth_factor], Default::default()),
    };
    let usual = usual_difference(map, rows, rest)?;
    widen(map, within, &of_runs, usual);
    Ok(map.interval_factor / within[0])
}

/// Mean square of what the usual gain moves estimates of the plane and of the depth by, over the mean of
/// the variances that the map states without its factors.
fn usual_difference(
    map: &PositionMap,
    rows: &PlacedRows,
    rest: &[f64],
) -> Result<[f64; 2], TrainingError> {
    let mut plain = map.clone();
    (plain.interval_factor, plain.depth_factor) = (1.0, 1.0);
    let mut estimator = PositionEstimator::new(plain)?;
    // Squares of the moves, and variances.
    let mut sums = [[0.0; 2]; 2];
    let mut add = |of: usize, moved: f64, deviation: f64| {
        sums[of][0] += moved * moved;
        sums[of][1] += deviation * deviation;
    };
    let step = rows.frames.len().div_ceil(GAIN_ROWS).max(1);
    for frame in rows.frames.iter().step_by(step) {
        let gained = frame.iter().zip(rest);
        let gained: Vec<f64> = gained.map(|(x, r)| x + USUAL[0] * (x - r)).collect();
        let own = estimator.estimate(frame)?;
        let other = estimator.estimate(&gained)?;
        for (axis, deviation) in own.deviation().into_iter().enumerate() {
            add(0, other.position[axis] - own.position[axis], deviation);
        }
        if let Some(([own, deviation], [other, _])) = own.depth.zip(other.depth) {
            add(1, other - own, deviation);
        }
    }
    Ok(sums.map(|[moved, variance]| {
        if variance > 0.0 {
            moved / variance
        } else {
            0.0
        }
    }))
}

fn fit(rows: &PlacedRows, options: PositionOptions) -> Result<PositionMap, TrainingError> {
    let presses = rows.of_presses();
    let first = (options.run_in.clamp(0.0, 0.9) * presses.len() as f64) as usize;
    let fading = options.fading * presses.len() as f64;
    let weights = faded(&presses[first..], fading);
    let begin = presses.get(first).map_or(0, |press| press.start);
    let standard = Standard::of(&rows.frames[begin..])?;
    let readings = rows.frames[begin..].iter();
    let readings: Vec<Vec<f64>> = readings
        .map(|frame| standard.apply(frame))
        .collect::<Result<_, _>>()?;
    let places = &rows.places[begin..];
    let count = presses.len() - first;
    let [x, y] = intervals(places, count, options.spacing);
    let smoothing = [options.smoothing, DEPTH_SMOOTHING];
    let mut surface = Surface::fit(
        places,
        &readings,
        &weights,
        [x, y, options.depths],
        smoothing,
    )?;
    let whitening = whitening(&surface, places, &readings, &weights, count)?;
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
        by_force: rows.by_force,
        tared: false,
    })
}

/// The rows of each split, estimated by a map of those that train it.
fn held_out(
    rows: &PlacedRows,
    splits: &[Split],
    options: PositionOptions,
) -> Result<HeldOutPlaces, TrainingError> {
    let part = |split: &Split| {
        let map = fit(&rows.taken(&split.train), options)?;
        judged(map, &rows.taken(&split.test))
    };
    let parts = splits.iter().map(part);
    Ok(HeldOutPlaces::of(parts.collect::<Result<_, _>>()?))
}

/// What a map makes of rows.
fn judged(map: PositionMap, rows: &PlacedRows) -> Result<Part, TrainingError> {
    let mut estimator = PositionEstimator::new(map.clone())?;
    let mut judged = [Judged::default(), Judged::default()];
    let mut estimates = Vec::new();
    let mut misfit = 0.0f64;
    for (frame, place) in rows.frames.iter().zip(&rows.places) {
        let estimate = estimator.estimate(frame)?;
        misfit = misfit.max(estimate.misfit);
        let [x, y] = estimate.position;
        let [depth, deviation] = estimate.depth.unwrap_or([0.0; 2]);
        let force = if rows.by_force { place[2] } else { 0.0 };
        estimates.push([x, y, depth]);
        for (axis, truth) in place[..2].iter().enumerate() {
            judged[0].push(
                estimate.position[axis] - truth,
                estimate.deviation()[axis],
                force,
            );
        }
        if estimate.depth.is_some() {
            judged[1].push(depth - place[2], deviation, force);
        }
    }
    Ok(Part {
        map,
        judged,
        estimates,
        misfit,
    })
}

/// Intervals along x and y, each `spacing` times as long as those of the grid that the places
/// lie on; or as many as so many presses at scattered positions determine.
fn intervals(places: &[[f64; 3]], presses: usize, spacing: f64) -> [usize; 2] {
    let longer = |count: usize| ((count as f64 / spacing).round() as usize).max(1);
    let determined = |rows_per_coefficient: f64| {
        let side = (presses as f64 / rows_per_coefficient).sqrt() as usize;
        side.saturating_sub(3).max(1)
    };
    match grid(places, presses) {
        Some(grid) => grid.map(|count| {
            let most = determined(GRID_ROWS_PER_COEFFICIENT);
            longer(count.saturating_sub(1).min(most))
        }),
        None => [longer(determined(ROWS_PER_COEFFICIENT)); 2],
    }
}

/// Positions along x and y of the grid that the places of so many presses lie on; `None` of scattered
/// ones.
fn grid(places: &[[f64; 3]], presses: usize) -> Option<[usize; 2]> {
    let distinct = |axis: usize| {
        let mut values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        values.sort_by(f64::total_cmp);
        let span = values.last().unwrap_or(&0.0) - values.first().unwrap_or(&0.0);
        // A stage returns to a place within a thousandth of its way.
        values.dedup_by(|a, b| *a - *b <= 1e-3 * span);
        values.len()
    };
    let grid = [distinct(0), distinct(1)];
    (grid[0] * grid[1] <= presses).then_some(grid)
}

/// Weights of the rows of presses in the order of time: those of one press count as one, and fade over
/// so many of them; one on average.
fn faded(presses: &[std::ops::Range<usize>], fading: f64) -> Vec<f64> {
    let ages = (0..presses.len())
        .rev()
        .map(|age| (-(age as f64) / fading).exp());
    let weights = presses
        .iter()
        .zip(ages)
        .flat_map(|(press, weight)| std::iter::repeat_n(weight / press.len() as f64, press.len()));
    let weights: Vec<f64> = weights.collect();
    let mean = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    weights.into_iter().map(|weight| weight / mean).collect()
}

/// L⁻¹ of the covariance of the rows of so many presses about the surface, by rows.
fn whitening(
    surface: &Surface,
    places: &[[f64; 3]],
    rows: &[Vec<f64>],
    weights: &[f64],
    presses: usize,
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
    // Each coefficient takes one reading; half of them are always left. A press has as many of its
    // own as the surface has functions of the depth.
    let layers = if surface.is_deep() {
        surface.intervals[2] + 3
    } else {
        1
    };
    let own = rows.len().min(presses * layers) as f64;
    let freedom = rows.len() as f64 * (1.0 - surface.unknowns() as f64 / own).max(0.5);
    let weighted = Mat::from_fn(rows.len(), width, |k, i| {
        residuals[k][i] * weights[k].sqrt()
    });
    let mut covariance = weighted.transpose() * &weighted * faer::Scale(1.0 / freedom);
    for i in 0..width {
        // The channels have unit deviation; a thousandth of it is the least
        // that two presses at one place may differ.
        covariance[(i, i)] += 1e-6;
    }
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
