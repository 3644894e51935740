//! Channels to the place of a probe of one depth, by inverting what each
//! channel answers over the plane.
//!
//! Fifteen channels of a press at one depth lie on a surface of two
//! dimensions. That surface is what is learned: x(p) of the place p
//! ([`Surface`]), and the covariance Σ of what readings do about it. A frame r
//! is then placed where |L⁻¹(r − x(p))|² is least, Σ = L Lᵀ, as with a physical
//! model. Drift that moves channels together stands in Σ and weighs little,
//! which a map straight from channels to place cannot know.

use faer::{Mat, Side};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Score, Standard, Support, Surface, TrainingError, interval_factor};

/// What is tried: the form of a position map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionOptions {
    /// Smoothing of the surface (see [`Surface::fit`]).
    pub smoothing: f64,
    /// Share of the rows that is left out at the beginning: a new body
    /// settles in its first presses.
    pub run_in: f64,
}

/// A trained map from channels to place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionMap {
    /// Channels and their scale.
    pub standard: Standard,
    /// What the scaled channels answer, whitened: L⁻¹ x(p).
    pub surface: Surface,
    /// L⁻¹, rows of the lower triangle one after the other.
    pub whitening: Vec<f64>,
    /// Factor on the deviation, from held-out errors.
    pub interval_factor: f64,
    /// Misfit |L⁻¹(r − x)|² above which a frame is unlike those of training.
    pub largest_misfit: f64,
}

/// Where a probe presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionEstimate {
    /// Place (x, y), m.
    pub place: [f64; 2],
    /// Covariance of the place, m².
    pub covariance: [[f64; 2]; 2],
    /// |L⁻¹(r − x)|², which has as many degrees of freedom as channels, less two.
    pub misfit: f64,
    /// Whether training saw such frames.
    pub support: Support,
}

impl PositionEstimate {
    /// Deviation along x and y, m.
    pub fn deviation(&self) -> [f64; 2] {
        [self.covariance[0][0].sqrt(), self.covariance[1][1].sqrt()]
    }
}

/// What a map makes of the rows that it has not seen.
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

impl PositionMap {
    /// Trains on frames in the order of time with the place of each (m), with
    /// that of `candidates` which best foretells the last quarter from the
    /// rows before it. Returns the map and the score of each candidate there.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn train(
        frames: &[Vec<f64>],
        places: &[[f64; 2]],
        candidates: &[PositionOptions],
    ) -> Result<(Self, Vec<Score>), TrainingError> {
        let (map, scores, _) = Self::trained(frames, places, candidates)?;
        Ok((map, scores))
    }

    /// The same with the held-out estimates of the candidate that was chosen.
    pub(crate) fn trained(
        frames: &[Vec<f64>],
        places: &[[f64; 2]],
        candidates: &[PositionOptions],
    ) -> Result<(Self, Vec<Score>, HeldOutPlaces), TrainingError> {
        let begin = ((1.0 - HELD_OUT) * frames.len() as f64) as usize;
        let mut tried: Vec<HeldOutPlaces> = candidates
            .par_iter()
            .map(|options| {
                let map = Self::fit(&frames[..begin], &places[..begin], *options)?;
                map.held_out(&frames[begin..], &places[begin..])
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
        let mut map = Self::fit(frames, places, candidates[best])?;
        map.interval_factor = tried[best].factor;
        map.largest_misfit = MISFIT_MARGIN * tried[best].misfit;
        let scores = tried.iter().map(|held_out| held_out.score).collect();
        Ok((map, scores, tried.swap_remove(best)))
    }

    fn fit(
        frames: &[Vec<f64>],
        places: &[[f64; 2]],
        options: PositionOptions,
    ) -> Result<Self, TrainingError> {
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
        Ok(Self {
            standard,
            surface,
            whitening,
            interval_factor: 1.0,
            largest_misfit: f64::INFINITY,
        })
    }

    /// Readings of the channels in use of a press at `place` (m).
    pub fn answer(&self, place: [f64; 2]) -> Vec<f64> {
        let mut scaled = self.surface.at(place);
        unwhiten(&self.whitening, &mut scaled);
        let standard = self.standard.centre.iter().zip(&self.standard.scale);
        let readings = scaled.iter().zip(standard);
        readings
            .map(|(z, (centre, scale))| centre + scale * z)
            .collect()
    }

    /// Standard deviation of such a reading about [`Self::answer`].
    pub fn deviation(&self) -> Vec<f64> {
        let width = self.surface.width;
        let mut variance = vec![0.0; width];
        for j in 0..width {
            let mut column = vec![0.0; width];
            column[j] = 1.0;
            unwhiten(&self.whitening, &mut column);
            for (sum, entry) in variance.iter_mut().zip(&column) {
                *sum += entry * entry;
            }
        }
        let scaled = variance.iter().zip(&self.standard.scale);
        scaled.map(|(v, scale)| v.sqrt() * scale).collect()
    }

    /// Whether the parts of a map from a file belong together.
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let width = self.surface.width;
        let whitening = self.whitening.len() == width * (width + 1) / 2
            && self.whitening.iter().all(|entry| entry.is_finite())
            && (1..=width).all(|i| self.whitening[i * (i + 1) / 2 - 1] > 0.0);
        let standard = self.standard.is_sound() && self.standard.used.len() == width;
        let factor = self.interval_factor > 0.0 && self.interval_factor.is_finite();
        for (sound, table) in [
            (self.surface.is_sound(), "surface"),
            (standard, "standard"),
            (whitening, "whitening"),
            (factor, "interval_factor"),
            (self.largest_misfit > 0.0, "largest_misfit"),
        ] {
            if !sound {
                return Err(TrainingError::Unsound { table });
            }
        }
        Ok(())
    }

    /// Score of the estimates of held-out rows, the factor on their
    /// deviations, and the largest misfit among them.
    fn held_out(
        &self,
        frames: &[Vec<f64>],
        places: &[[f64; 2]],
    ) -> Result<HeldOutPlaces, TrainingError> {
        let mut estimator = PositionEstimator::new(self.clone())?;
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        let mut estimates = Vec::new();
        let mut misfit = 0.0f64;
        for (frame, place) in frames.iter().zip(places) {
            let estimate = estimator.estimate(frame)?;
            misfit = misfit.max(estimate.misfit);
            estimates.push(estimate.place);
            for (axis, truth) in place.iter().enumerate() {
                errors.push(estimate.place[axis] - truth);
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
}

/// Intervals along x and y: those of the grid that the places lie on, or as
/// many as scattered places can tell.
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

/// L⁻¹ r.
fn whiten(whitening: &[f64], row: &[f64]) -> Vec<f64> {
    let mut rest = whitening;
    (1..=row.len())
        .map(|count| {
            let (head, tail) = rest.split_at(count.min(rest.len()));
            rest = tail;
            taxel_numerics::dense::dot(head, row)
        })
        .collect()
}

/// L r, in place.
fn unwhiten(whitening: &[f64], row: &mut [f64]) {
    let mut rest = whitening;
    for i in 0..row.len() {
        let (head, tail) = rest.split_at((i + 1).min(rest.len()));
        rest = tail;
        let known: f64 = (0..i).map(|k| head[k] * row[k]).sum();
        row[i] = (row[i] - known) / head[i];
    }
}

/// Frames to places.
#[derive(Debug, Clone)]
pub struct PositionEstimator {
    map: PositionMap,
    /// Corners of the intervals.
    nodes: Vec<[f64; 2]>,
    /// Their whitened answers one after the other, each padded to eights.
    answers: Vec<f32>,
    value: Vec<f64>,
    slope: [Vec<f64>; 2],
}

/// Steps of the search.
const STEPS: usize = 12;
/// The search ends below this share of an interval.
const SETTLED: f64 = 1e-4;
/// Halvings of a step that does not descend.
const HALVINGS: usize = 6;

impl PositionEstimator {
    /// An estimator of places.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`] for a map that was changed by hand.
    pub fn new(map: PositionMap) -> Result<Self, TrainingError> {
        map.check()?;
        let surface = &map.surface;
        let node = |k: usize| {
            let columns = surface.intervals[1] + 1;
            let at = [k / columns, k % columns];
            [0, 1].map(|a| surface.corner[a] + surface.step[a] * at[a] as f64)
        };
        let count = (surface.intervals[0] + 1) * (surface.intervals[1] + 1);
        let nodes: Vec<[f64; 2]> = (0..count).map(node).collect();
        let answer = |place: &[f64; 2]| padded(&surface.at(*place));
        Ok(Self {
            answers: nodes.iter().flat_map(answer).collect(),
            nodes,
            value: vec![0.0; surface.width],
            slope: [vec![0.0; surface.width], vec![0.0; surface.width]],
            map,
        })
    }

    /// The place that the frame speaks for.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading.
    pub fn estimate(&mut self, frame: &[f64]) -> Result<PositionEstimate, TrainingError> {
        let white = whiten(&self.map.whitening, &self.map.standard.apply(frame)?);
        let mut place = self.nearest_node(&padded(&white));
        let mut misfit = self.misfit(&white, place);
        for _ in 0..STEPS {
            let (gradient, normal) = self.normal(&white);
            let step = newton_step(gradient, normal);
            let small = |a: usize| step[a].abs() < SETTLED * self.map.surface.step[a];
            if small(0) && small(1) {
                break;
            }
            let Some((next, lower)) = self.descend(&white, place, step, misfit) else {
                break;
            };
            (place, misfit) = (next, lower);
        }
        self.misfit(&white, place);
        let (_, normal) = self.normal(&white);
        Ok(self.judged(place, normal, misfit))
    }

    /// The node whose answer is nearest to a frame: every other one first, then
    /// those round the best few, as a rough surface has more than one valley.
    fn nearest_node(&self, white: &[f32]) -> [f64; 2] {
        const VALLEYS: usize = 4;
        let [rows, columns] = self.map.surface.intervals.map(|count| count + 1);
        let distance = |[row, column]: [usize; 2]| {
            let node = row * columns + column;
            squared_distance(&self.answers[node * white.len()..][..white.len()], white)
        };
        let mut valleys = [(f32::INFINITY, [0, 0]); VALLEYS];
        for row in (0..rows).step_by(2) {
            for column in (0..columns).step_by(2) {
                let found = (distance([row, column]), [row, column]);
                if let Some(place) = valleys.iter().position(|valley| found.0 < valley.0) {
                    valleys[place..].rotate_right(1);
                    valleys[place] = found;
                }
            }
        }
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let mut best = valleys[0];
        for (_, [row, column]) in valleys {
            for row in around(row, rows) {
                for column in around(column, columns) {
                    let found = distance([row, column]);
                    if found < best.0 {
                        best = (found, [row, column]);
                    }
                }
            }
        }
        let (_, [row, column]) = best;
        self.nodes[row * columns + column]
    }

    /// |white − x(place)|², leaving the answer and its slopes.
    fn misfit(&mut self, white: &[f64], place: [f64; 2]) -> f64 {
        let [x, y] = &mut self.slope;
        self.map.surface.evaluate(place, &mut self.value, [x, y]);
        let terms = white.iter().zip(&self.value);
        terms.map(|(w, v)| (w - v).powi(2)).sum()
    }

    /// Jᵀr and JᵀJ (xx, xy, yy) where the answer was last evaluated.
    fn normal(&self, white: &[f64]) -> ([f64; 2], [f64; 3]) {
        let (mut gradient, mut normal) = ([0.0; 2], [0.0; 3]);
        let slopes = self.slope[0].iter().zip(&self.slope[1]);
        for ((w, v), (x, y)) in white.iter().zip(&self.value).zip(slopes) {
            gradient[0] += x * (w - v);
            gradient[1] += y * (w - v);
            normal[0] += x * x;
            normal[1] += x * y;
            normal[2] += y * y;
        }
        (gradient, normal)
    }

    /// The first of the step and its halves that lowers the misfit.
    fn descend(
        &mut self,
        white: &[f64],
        place: [f64; 2],
        step: [f64; 2],
        misfit: f64,
    ) -> Option<([f64; 2], f64)> {
        // Two intervals at once: farther away the slopes say nothing.
        let size = &self.map.surface.step;
        let long = (step[0] / size[0]).abs().max((step[1] / size[1]).abs()) / 2.0;
        let mut share = 1.0 / long.max(1.0);
        for _ in 0..=HALVINGS {
            let next = [0, 1].map(|a| place[a] + share * step[a]);
            let next = self.map.surface.clamp(next);
            let lower = self.misfit(white, next);
            if lower < misfit {
                return Some((next, lower));
            }
            share *= 0.5;
        }
        None
    }

    /// The estimate with its covariance: that of the noise, grown by the misfit.
    fn judged(&self, place: [f64; 2], normal: [f64; 3], misfit: f64) -> PositionEstimate {
        let surface = &self.map.surface;
        let freedom = surface.width.saturating_sub(2).max(1) as f64;
        let growth = (misfit / freedom).max(1.0) * self.map.interval_factor.powi(2);
        // Nothing is known worse than by the size of the rectangle.
        let prior = [0, 1].map(|a| (surface.step[a] * surface.intervals[a] as f64).powi(-2));
        let [xx, xy, yy] = normal.map(|n| n / growth);
        let (xx, yy) = (xx + prior[0], yy + prior[1]);
        let determinant = xx * yy - xy * xy;
        let off = -xy / determinant;
        PositionEstimate {
            place,
            covariance: [[yy / determinant, off], [off, xx / determinant]],
            misfit,
            support: if misfit > self.map.largest_misfit {
                Support::Outside
            } else {
                Support::Trained
            },
        }
    }

    /// The map.
    pub fn map(&self) -> &PositionMap {
        &self.map
    }
}

/// (JᵀJ)⁻¹ Jᵀr, with a trace of damping where a slope vanishes.
fn newton_step(gradient: [f64; 2], [xx, xy, yy]: [f64; 3]) -> [f64; 2] {
    let damping = 1e-9 * (xx + yy) + f64::MIN_POSITIVE;
    let (xx, yy) = (xx + damping, yy + damping);
    let determinant = xx * yy - xy * xy;
    [
        (yy * gradient[0] - xy * gradient[1]) / determinant,
        (xx * gradient[1] - xy * gradient[0]) / determinant,
    ]
}

fn padded(row: &[f64]) -> Vec<f32> {
    let mut padded: Vec<f32> = row.iter().map(|x| *x as f32).collect();
    padded.resize(row.len().next_multiple_of(8), 0.0);
    padded
}

/// |a − b|² in eight independent sums, which the compiler keeps in one
/// register. Indices, because iterators are not inlined across the crates
/// here: they take ten times as long.
#[allow(clippy::needless_range_loop)]
fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 8];
    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
        for i in 0..8 {
            let difference = a[i] - b[i];
            sums[i] += difference * difference;
        }
    }
    sums.iter().sum()
}
