//! Channels to the position of a probe of one depth, by inverting what each
//! channel answers over the plane.
//!
//! Fifteen channels of a press at one depth lie on a surface of two
//! dimensions. That surface is what is learned: x(p) of the position p
//! ([`Surface`]), and the covariance Σ of what readings do about it. A frame r
//! is then located where |L⁻¹(r − x(p))|² is least, Σ = L Lᵀ, as with a physical
//! model. Drift that moves channels together stands in Σ and weighs little,
//! which a map straight from channels to position cannot know.

use serde::{Deserialize, Serialize};

use super::{Standard, Support, Surface, TrainingError};

/// A trained map from channels to position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionMap {
    /// Channels and their scale.
    pub standard: Standard,
    /// Scaled channels over the position, whitened: L⁻¹ x(p).
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
    /// Position (x, y), m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub covariance: [[f64; 2]; 2],
    /// |L⁻¹(r − x)|², which has as many degrees of freedom as channels, less two.
    pub misfit: f64,
    /// Support of the frame by the training.
    pub support: Support,
}

impl PositionEstimate {
    /// Deviation along x and y, m.
    pub fn deviation(&self) -> [f64; 2] {
        [self.covariance[0][0].sqrt(), self.covariance[1][1].sqrt()]
    }
}

impl PositionMap {
    /// Readings of the channels in use of a press at `position` (m).
    pub fn answer(&self, position: [f64; 2]) -> Vec<f64> {
        let mut scaled = self.surface.at(position);
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

    /// Checks that the parts of a map from a file belong together.
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
}

/// L⁻¹ r, with the rows of the lower triangle of L⁻¹ one after the other.
pub fn whiten(whitening: &[f64], row: &[f64]) -> Vec<f64> {
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

/// Frames to positions.
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
    /// An estimator of positions.
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
        let answer = |position: &[f64; 2]| padded(&surface.at(*position));
        Ok(Self {
            answers: nodes.iter().flat_map(answer).collect(),
            nodes,
            value: vec![0.0; surface.width],
            slope: [vec![0.0; surface.width], vec![0.0; surface.width]],
            map,
        })
    }

    /// The position that the frame speaks for.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading.
    pub fn estimate(&mut self, frame: &[f64]) -> Result<PositionEstimate, TrainingError> {
        let white = whiten(&self.map.whitening, &self.map.standard.apply(frame)?);
        let mut position = self.nearest_node(&padded(&white));
        let mut misfit = self.misfit(&white, position);
        for _ in 0..STEPS {
            let (gradient, normal) = self.normal(&white);
            let step = newton_step(gradient, normal);
            let small = |a: usize| step[a].abs() < SETTLED * self.map.surface.step[a];
            if small(0) && small(1) {
                break;
            }
            let Some((next, lower)) = self.descend(&white, position, step, misfit) else {
                break;
            };
            (position, misfit) = (next, lower);
        }
        self.misfit(&white, position);
        let (_, normal) = self.normal(&white);
        Ok(self.judged(position, normal, misfit))
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
                if let Some(rank) = valleys.iter().position(|valley| found.0 < valley.0) {
                    valleys[rank..].rotate_right(1);
                    valleys[rank] = found;
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

    /// |white − x(position)|², leaving the answer and its slopes.
    fn misfit(&mut self, white: &[f64], position: [f64; 2]) -> f64 {
        let [x, y] = &mut self.slope;
        self.map.surface.evaluate(position, &mut self.value, [x, y]);
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
        position: [f64; 2],
        step: [f64; 2],
        misfit: f64,
    ) -> Option<([f64; 2], f64)> {
        // Two intervals at once: farther away the slopes say nothing.
        let size = &self.map.surface.step;
        let long = (step[0] / size[0]).abs().max((step[1] / size[1]).abs()) / 2.0;
        let mut share = 1.0 / long.max(1.0);
        for _ in 0..=HALVINGS {
            let next = [0, 1].map(|a| position[a] + share * step[a]);
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
    fn judged(&self, position: [f64; 2], normal: [f64; 3], misfit: f64) -> PositionEstimate {
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
            position,
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
