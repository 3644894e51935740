//! Smooth functions of a position and of a depth, from readings at scattered positions.
//!
//! f(x, y, z) = Σ c_ijk B(x/h − i) B(y/h − j) B(z/h − k), uniform cubic B-splines; the
//! coefficients have the least Σ (f(pₙ) − vₙ)² + Σ λₐ (second differences along a)²
//! (P. H. C. Eilers and B. D. Marx, Stat. Sci. 11, 89, 1996). Of presses of one depth the
//! functions do not depend on z.

use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};

use super::TrainingError;

/// Several functions on one rectangle, or on one box of positions and depths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Corner of least x, y and z, m.
    pub corner: [f64; 3],
    /// Length of an interval along x, y and z, m; along z one where depth is none.
    pub step: [f64; 3],
    /// Number of intervals along x, y and z; none along z for one depth.
    pub intervals: [usize; 3],
    /// Number of functions.
    pub width: usize,
    /// Coefficients: along x, then along y, then along z, then the functions.
    pub coefficients: Vec<f64>,
}

/// Weights of the four B-splines at `u` of an interval, and their slopes.
fn basis(u: f64) -> ([f64; 4], [f64; 4]) {
    let v = 1.0 - u;
    let (uu, vv) = (u * u, v * v);
    let weights = [
        v * vv / 6.0,
        (3.0 * u * uu - 6.0 * uu + 4.0) / 6.0,
        (3.0 * v * vv - 6.0 * vv + 4.0) / 6.0,
        u * uu / 6.0,
    ];
    let slopes = [-0.5 * vv, 1.5 * uu - 2.0 * u, 2.0 * v - 1.5 * vv, 0.5 * uu];
    (weights, slopes)
}

/// The interval of a position along each axis, the weights of its splines and their slopes
/// (1/m).
struct Local {
    cell: [usize; 3],
    weights: [[f64; 4]; 3],
    slopes: [[f64; 4]; 3],
}

impl Surface {
    /// Fits `values` (one row of functions each, which counts by its share of `weights`) at
    /// `positions` (x, y, z in m), with `intervals` along x, y and z (none: one depth). The
    /// smoothings λ along the plane and along z are relative to the sum of the weights for each
    /// coefficient.
    ///
    /// # Errors
    /// [`TrainingError`] when the positions span no area or leave a function open.
    pub fn fit(
        positions: &[[f64; 3]],
        values: &[Vec<f64>],
        weights: &[f64],
        intervals: [usize; 3],
        smoothing: [f64; 2],
    ) -> Result<Self, TrainingError> {
        let end = |axis: usize, of: fn(f64, f64) -> f64, start: f64| {
            let along = positions.iter().map(|position| position[axis]);
            along.fold(start, of)
        };
        let corner = [0, 1, 2].map(|axis| end(axis, f64::min, f64::INFINITY));
        let span = [0, 1, 2].map(|axis| end(axis, f64::max, f64::NEG_INFINITY) - corner[axis]);
        if !(span[0] > 0.0 && span[1] > 0.0) {
            return Err(TrainingError::NoArea(span[0].max(0.0), span[1].max(0.0)));
        }
        let deep = intervals[2] > 0 && span[2] > 0.0;
        let intervals = [
            intervals[0].max(1),
            intervals[1].max(1),
            if deep { intervals[2] } else { 0 },
        ];
        let mut surface = Self {
            corner: [corner[0], corner[1], if deep { corner[2] } else { 0.0 }],
            step: [0, 1, 2].map(|axis| match intervals[axis] {
                0 => 1.0,
                count => span[axis] / count as f64,
            }),
            intervals,
            width: values.first().map_or(0, Vec::len),
            coefficients: Vec::new(),
        };
        surface.solve(positions, values, weights, smoothing)?;
        Ok(surface)
    }

    fn solve(
        &mut self,
        positions: &[[f64; 3]],
        values: &[Vec<f64>],
        weights: &[f64],
        smoothing: [f64; 2],
    ) -> Result<(), TrainingError> {
        let unknowns = self.unknowns();
        let [_, columns, layers] = self.counts();
        let band = 3 * columns * layers + 3 * layers + layers.min(4) - 1;
        let mut system = Banded::new(unknowns, band);
        let mut right = vec![0.0; unknowns * self.width];
        let mut terms = Vec::new();
        for ((position, value), counts) in positions.iter().zip(values).zip(weights) {
            self.terms(*position, &mut terms);
            for (k, (at, weight)) in terms.iter().enumerate() {
                let weight = counts * weight;
                for (other, beside) in &terms[..=k] {
                    system.add(*at, *other, weight * beside);
                }
                let row = &mut right[at * self.width..(at + 1) * self.width];
                for (sum, value) in row.iter_mut().zip(value) {
                    *sum += weight * value;
                }
            }
        }
        let share = weights.iter().sum::<f64>() / unknowns as f64;
        self.penalise(&mut system, smoothing.map(|smoothing| smoothing * share));
        if !system.factorise() {
            return Err(TrainingError::Dependent { features: unknowns });
        }
        system.solve(&mut right, self.width);
        self.coefficients = right;
        Ok(())
    }

    /// Adds the weights times the squares of all second differences along the plane and
    /// along z.
    fn penalise(&self, system: &mut Banded, [plane, along]: [f64; 2]) {
        let counts = self.counts();
        let strides = [counts[1] * counts[2], counts[2], 1];
        let mut second = |first: usize, stride: usize, weight: f64| {
            for (a, x) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                for (b, y) in [1.0, -2.0, 1.0].into_iter().enumerate().take(a + 1) {
                    system.add(first + a * stride, first + b * stride, weight * x * y);
                }
            }
        };
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                for k in 0..counts[2] {
                    let first = i * strides[0] + j * strides[1] + k;
                    for (axis, at) in [i, j, k].into_iter().enumerate() {
                        if at + 2 < counts[axis] {
                            let weight = if axis < 2 { plane } else { along };
                            second(first, strides[axis], weight);
                        }
                    }
                }
            }
        }
    }

    /// True if a surface from a file is one.
    pub(super) fn is_sound(&self) -> bool {
        let most = 1 << 12;
        let counted = |count: &usize| (1..=most).contains(count);
        self.intervals[..2].iter().all(counted)
            && self.intervals[2] <= most
            && self.step.iter().all(|step| *step > 0.0 && step.is_finite())
            && self.corner.iter().all(|corner| corner.is_finite())
            && self.width > 0
            && self.coefficients.len() == self.unknowns() * self.width
            && self.coefficients.iter().all(|c| c.is_finite())
    }

    /// True if the functions depend on the depth.
    pub fn is_deep(&self) -> bool {
        self.intervals[2] > 0
    }

    /// Number of coefficients of one function.
    pub fn unknowns(&self) -> usize {
        self.counts().iter().product()
    }

    /// Coefficients along each axis.
    fn counts(&self) -> [usize; 3] {
        let [rows, columns, layers] = self.intervals;
        let layers = if layers == 0 { 1 } else { layers + 3 };
        [rows + 3, columns + 3, layers]
    }

    fn local(&self, position: [f64; 3]) -> Local {
        let mut local = Local {
            cell: [0; 3],
            weights: [[1.0, 0.0, 0.0, 0.0]; 3],
            slopes: [[0.0; 4]; 3],
        };
        for (axis, position) in position.into_iter().enumerate() {
            let Some(last) = self.intervals[axis].checked_sub(1) else {
                continue;
            };
            let at = (position - self.corner[axis]) / self.step[axis];
            let cell = (at.max(0.0) as usize).min(last);
            let (weights, slopes) = basis(at - cell as f64);
            local.cell[axis] = cell;
            local.weights[axis] = weights;
            local.slopes[axis] = slopes.map(|slope| slope / self.step[axis]);
        }
        local
    }

    /// Numbers of the coefficients that a position needs, with their weights, in rising order.
    fn terms(&self, position: [f64; 3], terms: &mut Vec<(usize, f64)>) {
        let local = self.local(position);
        let [_, columns, layers] = self.counts();
        let [x, y, z] = &local.weights;
        terms.clear();
        for (i, wx) in x.iter().enumerate() {
            for (j, wy) in y.iter().enumerate() {
                let line = (local.cell[0] + i) * columns + local.cell[1] + j;
                for (k, wz) in z.iter().enumerate().take(layers.min(4)) {
                    terms.push((line * layers + local.cell[2] + k, wx * wy * wz));
                }
            }
        }
    }

    /// The functions at a position, with their slopes along x, y and z, into rows of
    /// `width` numbers. Outside of the box the outermost cubics go on.
    pub fn evaluate(&self, position: [f64; 3], value: &mut [f64], slopes: &mut [Vec<f64>; 3]) {
        let local = self.local(position);
        let [_, columns, layers] = self.counts();
        let deep = layers.min(4);
        let mut terms = [(0, [0.0; 4]); 64];
        let mut free = terms.iter_mut();
        for i in 0..4 {
            let [x, dx] = [local.weights[0][i], local.slopes[0][i]];
            for j in 0..4 {
                let [y, dy] = [local.weights[1][j], local.slopes[1][j]];
                let [xy, dxy, xdy] = [x * y, dx * y, x * dy];
                let line = (local.cell[0] + i) * columns + local.cell[1] + j;
                let first = line * layers + local.cell[2];
                for (k, (at, shares)) in free.by_ref().take(deep).enumerate() {
                    let [z, dz] = [local.weights[2][k], local.slopes[2][k]];
                    *at = (first + k) * self.width;
                    *shares = [xy * z, dxy * z, xdy * z, xy * dz];
                }
            }
        }
        let [along_x, along_y, along_z] = slopes;
        pulp::Arch::new().dispatch(Sums {
            coefficients: &self.coefficients,
            terms: &terms[..16 * deep],
            into: [value, along_x, along_y, along_z],
        });
    }

    /// The functions at a position.
    pub fn at(&self, position: [f64; 3]) -> Vec<f64> {
        let mut value = vec![0.0; self.width];
        let mut slopes = [value.clone(), value.clone(), value.clone()];
        self.evaluate(position, &mut value, &mut slopes);
        value
    }

    /// Where the box begins and ends along an axis, m.
    pub fn range(&self, axis: usize) -> [f64; 2] {
        let far = self.step[axis] * self.intervals[axis] as f64;
        [self.corner[axis], self.corner[axis] + far]
    }

    /// The position nearest to `position` in the box, m.
    pub fn clamp(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let [near, far] = self.range(axis);
            position[axis].max(near).min(far)
        })
    }
}

/// Functions that are summed at once.
const LANES: usize = 8;

/// Sums of rows of coefficients, each with a share in the value and in each slope, in the widest
/// registers of the machine.
struct Sums<'a> {
    coefficients: &'a [f64],
    /// Where each row begins, and its shares.
    terms: &'a [(usize, [f64; 4])],
    into: [&'a mut [f64]; 4],
}

impl WithSimd for Sums<'_> {
    type Output = ();

    // Indices, because iterators are not inlined here.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the registers are those of the caller"
    )]
    #[allow(clippy::needless_range_loop)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = self.into[0].len();
        let registers = LANES / S::F64_LANES;
        for first in (0..width).step_by(LANES) {
            let mut sums = [[simd.splat_f64s(0.0); LANES]; 4];
            let mut last = [0.0; LANES];
            for (at, shares) in self.terms {
                let rest = &self.coefficients[at + first..];
                let row = if let Some(row) = rest.first_chunk::<LANES>() {
                    row
                } else {
                    last[..rest.len()].copy_from_slice(rest);
                    &last
                };
                let row = S::as_simd_f64s(row).0;
                for kind in 0..4 {
                    let share = simd.splat_f64s(shares[kind]);
                    for part in 0..registers {
                        sums[kind][part] = simd.mul_add_e_f64s(share, row[part], sums[kind][part]);
                    }
                }
            }
            let count = LANES.min(width - first);
            for kind in 0..4 {
                let mut lanes = [0.0; LANES];
                S::as_mut_simd_f64s(&mut lanes)
                    .0
                    .copy_from_slice(&sums[kind][..registers]);
                self.into[kind][first..first + count].copy_from_slice(&lanes[..count]);
            }
        }
    }
}

/// A symmetric positive definite matrix with few diagonals.
struct Banded {
    size: usize,
    band: usize,
    /// Row i holds the columns from i − band to i.
    rows: Vec<f64>,
}

impl Banded {
    fn new(size: usize, band: usize) -> Self {
        Self {
            size,
            band,
            rows: vec![0.0; size * (band + 1)],
        }
    }

    fn at(&self, i: usize, j: usize) -> usize {
        i * (self.band + 1) + self.band + j - i
    }

    /// Adds to the entry at row `i` and column `j` ≤ `i`.
    fn add(&mut self, i: usize, j: usize, value: f64) {
        let at = self.at(i, j);
        self.rows[at] += value;
    }

    /// Cholesky in place; false when the matrix is not positive definite.
    fn factorise(&mut self) -> bool {
        for i in 0..self.size {
            let first = i.saturating_sub(self.band);
            for j in first..=i {
                let from = first.max(j.saturating_sub(self.band));
                let (a, b) = (self.at(i, from), self.at(j, from));
                let sum: f64 = (0..j - from)
                    .map(|k| self.rows[a + k] * self.rows[b + k])
                    .sum();
                let at = self.at(i, j);
                let rest = self.rows[at] - sum;
                if i > j {
                    self.rows[at] = rest / self.rows[self.at(j, j)];
                } else if rest > 0.0 {
                    self.rows[at] = rest.sqrt();
                } else {
                    return false;
                }
            }
        }
        true
    }

    /// Solves for `width` right-hand sides, one row of them per unknown.
    fn solve(&self, right: &mut [f64], width: usize) {
        let mut row = vec![0.0; width];
        for i in 0..self.size {
            row.copy_from_slice(&right[i * width..(i + 1) * width]);
            for j in i.saturating_sub(self.band)..i {
                subtract(&mut row, &right[j * width..], self.rows[self.at(i, j)]);
            }
            divide(&mut row, self.rows[self.at(i, i)]);
            right[i * width..(i + 1) * width].copy_from_slice(&row);
        }
        for i in (0..self.size).rev() {
            row.copy_from_slice(&right[i * width..(i + 1) * width]);
            for j in i + 1..(i + self.band + 1).min(self.size) {
                subtract(&mut row, &right[j * width..], self.rows[self.at(j, i)]);
            }
            divide(&mut row, self.rows[self.at(i, i)]);
            right[i * width..(i + 1) * width].copy_from_slice(&row);
        }
    }
}

fn divide(row: &mut [f64], divisor: f64) {
    for value in row {
        *value /= divisor;
    }
}

fn subtract(row: &mut [f64], other: &[f64], factor: f64) {
    row.iter_mut()
        .zip(other)
        .for_each(|(r, o)| *r -= factor * o);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions(count: usize) -> Vec<[f64; 3]> {
        // A sequence that fills the cube evenly.
        let fill =
            |k: usize| [0.8191725134, 0.6710436067, 0.5497004779].map(|a| k as f64 * a % 1.0);
        let corners = [[0.0; 3], [1.0; 3]];
        corners.into_iter().chain((1..count).map(fill)).collect()
    }

    #[test]
    fn a_cubic_function_is_reproduced_with_its_slopes() {
        for deep in [false, true] {
            let depth = |p: &[f64; 3]| if deep { p[2] } else { 0.0 };
            let f = |p: &[f64; 3]| {
                vec![
                    p[0].powi(3) * p[1] - p[1].powi(2) + depth(p) * p[0],
                    1.0 + p[0] * p[1].powi(3) + depth(p).powi(3),
                ]
            };
            let positions = positions(900);
            let values: Vec<_> = positions.iter().map(f).collect();
            let intervals = [4, 5, usize::from(deep) * 2];
            let surface =
                Surface::fit(&positions, &values, &[1.0; 900], intervals, [0.0; 2]).unwrap();
            assert_eq!(surface.is_deep(), deep);
            let (mut v, mut slopes) = ([0.0; 2], [vec![0.0; 2], vec![0.0; 2], vec![0.0; 2]]);
            for p in [[0.0, 1.0, 0.2], [0.31, 0.77, 0.9], [1.0, 0.5, 0.0]] {
                surface.evaluate(p, &mut v, &mut slopes);
                // Rounding, times the condition of splines at the edge.
                for (a, b) in v.iter().zip(f(&p)) {
                    assert!((a - b).abs() < 1e-9, "{a} {b}");
                }
                let [x, y, z] = &slopes;
                assert!((x[0] - 3.0 * p[0].powi(2) * p[1] - depth(&p)).abs() < 1e-8);
                assert!((y[0] - p[0].powi(3) + 2.0 * p[1]).abs() < 1e-8);
                let along = if deep { 3.0 * p[2].powi(2) } else { 0.0 };
                assert!((z[1] - along).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn strong_smoothing_leaves_a_plane() {
        let positions = positions(300);
        let plane = |p: &[f64; 3]| vec![2.0 - p[0] + 3.0 * p[1] + p[2]];
        let values: Vec<_> = positions.iter().map(plane).collect();
        let surface = Surface::fit(&positions, &values, &[1.0; 300], [9, 9, 2], [1e6; 2]).unwrap();
        let at = [0.2, 0.9, 0.4];
        assert!((surface.at(at)[0] - plane(&at)[0]).abs() < 1e-6);
    }

    #[test]
    fn presses_along_a_line_are_refused() {
        let line: Vec<_> = (0..9).map(|i| [f64::from(i), 2.0, 0.0]).collect();
        let found = Surface::fit(&line, &vec![vec![0.0]; 9], &[1.0; 9], [3, 3, 0], [1.0; 2]);
        assert_eq!(found, Err(TrainingError::NoArea(8.0, 0.0)));
    }
}
