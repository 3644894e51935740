//! Channels to the position and the depth of a probe, by inverting what each channel
//! answers over the plane and the depth.
//!
//! Fifteen channels of a press lie on a surface of two dimensions, or of three where the
//! depth or the force varies. That surface is what is learned: x(p) of the position and depth p
//! ([`Surface`]), and the covariance Σ of what readings do about it. A frame r
//! is then located where |L⁻¹(r − x(p))|² is least, Σ = L Lᵀ, as with a physical
//! model. Drift that moves channels together stands in Σ and weighs little,
//! which a map straight from channels to position cannot know.

use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};

use super::{SURELY, Standard, Support, Surface, TrainingError, USUAL};
use taxel_numerics::dense::{dot3, long_dot};

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
    /// Factor on the deviation of the position, from held-out errors.
    pub interval_factor: f64,
    /// Factor on the deviation of the depth, likewise.
    pub depth_factor: f64,
    /// Misfit |L⁻¹(r − x)|² above which a frame is unlike those of training.
    pub largest_misfit: f64,
    /// True if the third coordinate of the surface is the force, N, as presses of training had no
    /// recorded depth.
    #[serde(default)]
    pub by_force: bool,
    /// True if readings are moved from the rest of the device to that of training.
    #[serde(default)]
    pub tared: bool,
}

/// Where a probe presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionEstimate {
    /// Position (x, y), m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub covariance: [[f64; 2]; 2],
    /// Depth as the coordinate z of training and its standard deviation, m; none where all
    /// presses of training had one depth.
    pub depth: Option<[f64; 2]>,
    /// |L⁻¹(r − x)|², which has as many degrees of freedom as channels, less two or, with a depth,
    /// three.
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
    /// Readings of the channels in use of a press at `position` (x, y, z in m; z counts for
    /// presses of several depths).
    pub fn answer(&self, position: [f64; 3]) -> Vec<f64> {
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
        let positive = |factor: f64| factor > 0.0 && factor.is_finite();
        let factor = positive(self.interval_factor) && positive(self.depth_factor);
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
            long_dot(head, row)
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
    /// Where the search may begin, row by row: the corners of the intervals.
    nodes: Vec<[f64; 3]>,
    /// Number of nodes along each axis.
    counts: [usize; 3],
    /// Their whitened answers one after the other, each padded to registers.
    answers: Vec<f32>,
    value: Vec<f64>,
    slopes: [Vec<f64>; 3],
}

/// Steps of the search.
const STEPS: usize = 12;
/// The search ends below this share of an interval.
const SETTLED: f64 = 1e-4;
/// Halvings of a step that does not descend.
const HALVINGS: usize = 6;
/// Nodes for each interval of depth: there are few of them, and they are long.
const DEPTHS: usize = 2;

impl PositionEstimator {
    /// An estimator of positions.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`] for a map that was changed by hand.
    pub fn new(map: PositionMap) -> Result<Self, TrainingError> {
        map.check()?;
        let surface = &map.surface;
        let [rows, columns, layers] = surface.intervals;
        let counts = [rows + 1, columns + 1, DEPTHS * layers + 1];
        let node = |k: usize| {
            let at = [
                k / (counts[1] * counts[2]),
                k / counts[2] % counts[1],
                k % counts[2],
            ];
            let step = [
                surface.step[0],
                surface.step[1],
                surface.step[2] / DEPTHS as f64,
            ];
            [0, 1, 2].map(|a| surface.corner[a] + step[a] * at[a] as f64)
        };
        let nodes: Vec<[f64; 3]> = (0..counts.iter().product()).map(node).collect();
        let answer = |position: &[f64; 3]| padded(&surface.at(*position));
        let row = vec![0.0; surface.width];
        Ok(Self {
            answers: nodes.iter().flat_map(answer).collect(),
            nodes,
            counts,
            slopes: [row.clone(), row.clone(), row.clone()],
            value: row,
            map,
        })
    }

    /// The position that the frame speaks for.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading.
    pub fn estimate(&mut self, frame: &[f64]) -> Result<PositionEstimate, TrainingError> {
        self.estimate_open(frame, &[])
    }

    /// The same of readings that are open by these standard deviations, in their unit, beyond what
    /// those of training were: they widen the estimate through the slopes of the map.
    ///
    /// # Errors
    /// As [`Self::estimate`].
    pub fn estimate_open(
        &mut self,
        frame: &[f64],
        open: &[f64],
    ) -> Result<PositionEstimate, TrainingError> {
        let white = whiten(&self.map.whitening, &self.map.standard.apply(frame)?);
        let mut position = self.nearest_node(&padded(&white));
        let mut misfit = self.misfit(&white, position);
        for _ in 0..STEPS {
            let (gradient, normal) = self.normal(&white);
            let held = self.held(position, gradient);
            let step = newton_step(gradient, normal, held);
            let small = |a: usize| step[a].abs() < SETTLED * self.map.surface.step[a];
            if (0..3).all(small) {
                break;
            }
            let Some((next, lower)) = self.descend(&white, position, step, misfit) else {
                // The answer that was evaluated last is that of a step which was not taken.
                self.misfit(&white, position);
                break;
            };
            (position, misfit) = (next, lower);
        }
        let (gradient, normal) = self.normal(&white);
        let opened = self.opened(normal, open);
        let outward = self.outward(position, gradient, normal);
        Ok(self.judged(position, normal, misfit, opened, outward))
    }

    /// The axes along which a position is at the end of the box and a frame speaks for one beyond.
    fn held(&self, position: [f64; 3], gradient: [f64; 3]) -> [bool; 3] {
        [0, 1, 2].map(|axis| {
            let [near, far] = self.map.surface.range(axis);
            (position[axis] <= near && gradient[axis] < 0.0)
                || (position[axis] >= far && gradient[axis] > 0.0)
        })
    }

    /// How far beyond the box a frame lies along each axis by the slopes at its end, m.
    fn outward(&self, position: [f64; 3], gradient: [f64; 3], normal: [[f64; 3]; 3]) -> [f64; 3] {
        let held = self.held(position, gradient);
        if held == [false; 3] {
            return [0.0; 3];
        }
        let step = newton_step(gradient, normal, [false; 3]);
        [0, 1, 2].map(|axis| {
            let same = step[axis] * gradient[axis] > 0.0;
            if held[axis] && same {
                step[axis].abs()
            } else {
                0.0
            }
        })
    }

    /// The node whose answer is nearest to a frame.
    fn nearest_node(&self, white: &[f32]) -> [f64; 3] {
        let [row, column, layer] = pulp::Arch::new().dispatch(Nearest {
            answers: &self.answers,
            counts: self.counts,
            white,
        });
        self.nodes[number(self.counts, [row, column, layer])]
    }

    /// |white − x(position)|², leaving the answer and its slopes.
    fn misfit(&mut self, white: &[f64], position: [f64; 3]) -> f64 {
        self.map
            .surface
            .evaluate(position, &mut self.value, &mut self.slopes);
        let terms = white.iter().zip(&self.value);
        terms.map(|(w, v)| (w - v).powi(2)).sum()
    }

    /// Jᵀr and JᵀJ where the answer was last evaluated.
    fn normal(&self, white: &[f64]) -> ([f64; 3], [[f64; 3]; 3]) {
        let (mut gradient, mut normal) = ([0.0; 3], [[0.0; 3]; 3]);
        for (function, (w, v)) in white.iter().zip(&self.value).enumerate() {
            let slope = [0, 1, 2].map(|axis: usize| self.slopes[axis][function]);
            for i in 0..3 {
                gradient[i] += slope[i] * (w - v);
                for j in 0..3 {
                    normal[i][j] += slope[i] * slope[j];
                }
            }
        }
        (gradient, normal)
    }

    /// The first of the step and its halves that lowers the misfit.
    fn descend(
        &mut self,
        white: &[f64],
        position: [f64; 3],
        step: [f64; 3],
        misfit: f64,
    ) -> Option<([f64; 3], f64)> {
        // Two intervals at once: farther away the slopes say nothing.
        let size = self.map.surface.step;
        let long = (0..3).fold(0.0, |most: f64, a| most.max((step[a] / size[a]).abs())) / 2.0;
        let mut share = 1.0 / long.max(1.0);
        for _ in 0..=HALVINGS {
            let next = [0, 1, 2].map(|a| position[a] + share * step[a]);
            let next = self.map.surface.clamp(next);
            let lower = self.misfit(white, next);
            if lower < misfit {
                return Some((next, lower));
            }
            share *= 0.5;
        }
        None
    }

    /// Length of the box along an axis, m.
    fn size(&self, axis: usize) -> f64 {
        let surface = &self.map.surface;
        surface.step[axis] * surface.intervals[axis].max(1) as f64
    }

    /// What is known of a position, which is never less than that it lies in the box.
    fn within_the_box(&self, mut known: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        for (axis, row) in known.iter_mut().enumerate() {
            row[axis] += self.size(axis).powi(-2);
        }
        known
    }

    /// Covariance of the position by readings that are open by these deviations, where the answer
    /// was last evaluated: G diag(open²) Gᵀ with G = (JᵀJ)⁻¹ Jᵀ L⁻¹ by the readings.
    fn opened(&self, normal: [[f64; 3]; 3], open: &[f64]) -> [[f64; 3]; 3] {
        let mut covariance = [[0.0; 3]; 3];
        if open.iter().all(|deviation| *deviation <= 0.0) {
            return covariance;
        }
        let width = self.value.len();
        let mut slopes = vec![[0.0; 3]; width];
        let mut rest = &self.map.whitening[..];
        for function in 0..width {
            let (row, others) = rest.split_at(function + 1);
            rest = others;
            let along = [0, 1, 2].map(|axis: usize| self.slopes[axis][function]);
            for (slopes, entry) in slopes.iter_mut().zip(row) {
                for (slope, along) in slopes.iter_mut().zip(along) {
                    *slope += along * entry;
                }
            }
        }
        let inverse = inverse(&self.within_the_box(normal));
        let standard = &self.map.standard;
        let channels = standard.used.iter().zip(&standard.scale);
        for ((channel, scale), slopes) in channels.zip(slopes) {
            let deviation = open.get(*channel).copied().unwrap_or(0.0) / scale;
            let moved = inverse.map(|row| deviation * dot3(row, slopes));
            for (row, a) in covariance.iter_mut().zip(moved) {
                for (entry, b) in row.iter_mut().zip(moved) {
                    *entry += a * b;
                }
            }
        }
        covariance
    }

    /// The estimate with its covariance: that of the noise, grown by the misfit, and that of
    /// readings that are open. A frame that lies beyond the box by more than errors do is known no
    /// better than that, and soon is unlike those of training.
    fn judged(
        &self,
        position: [f64; 3],
        normal: [[f64; 3]; 3],
        misfit: f64,
        opened: [[f64; 3]; 3],
        outward: [f64; 3],
    ) -> PositionEstimate {
        let surface = &self.map.surface;
        let unknowns = if surface.is_deep() { 3 } else { 2 };
        let freedom = surface.width.saturating_sub(unknowns).max(1) as f64;
        let plane = self.map.interval_factor.powi(2);
        let by_growth = |growth: f64| {
            let known = normal.map(|row| row.map(|n| n / (growth * plane)));
            inverse(&self.within_the_box(known))
        };
        let covariance = by_growth((misfit / freedom).max(1.0));
        let along = self.map.depth_factor / self.map.interval_factor;
        let factors = [1.0, 1.0, along * along];
        let mut variance =
            [0, 1, 2].map(|axis| factors[axis] * covariance[axis][axis] + opened[axis][axis]);
        let mut beyond = false;
        if outward != [0.0; 3] {
            // The misfit is what such a frame has because it is beyond: it makes it no likelier within.
            let certain = by_growth(1.0);
            for (axis, outward) in outward.into_iter().enumerate() {
                let usual = factors[axis] * certain[axis][axis] + opened[axis][axis];
                let square = outward * outward;
                beyond |= square > SURELY * SURELY * usual;
                variance[axis] += (square - USUAL * USUAL * usual).max(0.0);
            }
        }
        let [x, y, z] = position;
        let across = covariance[0][1] + opened[0][1];
        PositionEstimate {
            position: [x, y],
            covariance: [[variance[0], across], [across, variance[1]]],
            depth: (surface.is_deep() && !self.map.by_force)
                .then(|| [z, variance[2].sqrt().min(self.size(2))]),
            misfit,
            support: if beyond || misfit > self.map.largest_misfit {
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

/// (JᵀJ)⁻¹ Jᵀr along the axes that are not `held`, with a trace of damping where a slope vanishes.
fn newton_step(mut gradient: [f64; 3], mut normal: [[f64; 3]; 3], held: [bool; 3]) -> [f64; 3] {
    for axis in (0..3).filter(|axis| held[*axis]) {
        gradient[axis] = 0.0;
        for other in (0..3).filter(|other| *other != axis) {
            normal[axis][other] = 0.0;
            normal[other][axis] = 0.0;
        }
    }
    let trace: f64 = (0..3).map(|a| normal[a][a]).sum();
    for (axis, row) in normal.iter_mut().enumerate() {
        row[axis] += 1e-9 * trace + f64::MIN_POSITIVE;
    }
    inverse(&normal).map(|row| dot3(row, gradient))
}

/// Inverse of a symmetric positive definite matrix.
fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let [a, b] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(j + 1) % 3, (j + 2) % 3];
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| minor(j, i) / determinant))
}

/// Numbers that are compared at once.
const LANES: usize = 16;

fn padded(row: &[f64]) -> Vec<f32> {
    let mut padded: Vec<f32> = row.iter().map(|x| *x as f32).collect();
    padded.resize(row.len().next_multiple_of(LANES), 0.0);
    padded
}

/// Number of a node.
fn number(counts: [usize; 3], [row, column, layer]: [usize; 3]) -> usize {
    (row * counts[1] + column) * counts[2] + layer
}

/// Search for the node whose answer is nearest to a frame: every other one first, then
/// those round the best few, as a rough surface has more than one valley.
struct Nearest<'a> {
    answers: &'a [f32],
    counts: [usize; 3],
    white: &'a [f32],
}

/// Valleys that are looked into.
const VALLEYS: usize = 4;

impl WithSimd for Nearest<'_> {
    type Output = [usize; 3];

    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the registers are those of the caller"
    )]
    fn with_simd<S: Simd>(self, simd: S) -> [usize; 3] {
        let [rows, columns, layers] = self.counts;
        let mut valleys = [(f32::INFINITY, [0, 0, 0]); VALLEYS];
        for row in (0..rows).step_by(2) {
            for column in (0..columns).step_by(2) {
                for layer in 0..layers {
                    let at = [row, column, layer];
                    let found = (self.distance(simd, at), at);
                    if let Some(rank) = valleys.iter().position(|valley| found.0 < valley.0) {
                        valleys[rank..].rotate_right(1);
                        valleys[rank] = found;
                    }
                }
            }
        }
        let mut best = valleys[0];
        for (_, [row, column, layer]) in valleys {
            for row in around(row, rows) {
                for column in around(column, columns) {
                    let at = [row, column, layer];
                    let found = self.distance(simd, at);
                    if found < best.0 {
                        best = (found, at);
                    }
                }
            }
        }
        best.1
    }
}

impl Nearest<'_> {
    /// |answer − white|² at a node.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the registers are those of the caller"
    )]
    fn distance<S: Simd>(&self, simd: S, node: [usize; 3]) -> f32 {
        let width = self.white.len();
        let answer = &self.answers[number(self.counts, node) * width..][..width];
        let (answer, white) = (S::as_simd_f32s(answer).0, S::as_simd_f32s(self.white).0);
        let mut sum = simd.splat_f32s(0.0);
        for (answer, white) in answer.iter().zip(white) {
            let difference = simd.sub_f32s(*answer, *white);
            sum = simd.mul_add_e_f32s(difference, difference, sum);
        }
        simd.reduce_sum_f32s(sum)
    }
}

/// A node along an axis and its neighbours.
fn around(at: usize, count: usize) -> std::ops::Range<usize> {
    at.saturating_sub(1)..(at + 2).min(count)
}
