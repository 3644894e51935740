//! Smooth functions of a position, from readings at scattered positions.
//!
//! f(x, y) = Σ c_ij B(x/h − i) B(y/h − j), uniform cubic B-splines; the
//! coefficients have the least Σ (f(xₖ, yₖ) − vₖ)² + λ Σ (second differences)²
//! (P. H. C. Eilers and B. D. Marx, Stat. Sci. 11, 89, 1996).

use serde::{Deserialize, Serialize};

use super::TrainingError;

/// Several functions on one rectangle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Corner of least x and y, m.
    pub corner: [f64; 2],
    /// Length of an interval along x and y, m.
    pub step: [f64; 2],
    /// Number of intervals along x and y.
    pub intervals: [usize; 2],
    /// Number of functions.
    pub width: usize,
    /// Coefficients: along x, then along y, then the functions.
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

impl Surface {
    /// Fits `values` (one row of functions each) at `positions` (m), with
    /// `intervals` along x and y. `smoothing` λ is relative to the number of
    /// readings for each coefficient.
    ///
    /// # Errors
    /// [`TrainingError`] when the positions span no area or leave a function open.
    pub fn fit(
        positions: &[[f64; 2]],
        values: &[Vec<f64>],
        intervals: [usize; 2],
        smoothing: f64,
    ) -> Result<Self, TrainingError> {
        let end = |axis: usize, of: fn(f64, f64) -> f64, start: f64| {
            positions
                .iter()
                .map(|position| position[axis])
                .fold(start, of)
        };
        let corner = [0, 1].map(|axis| end(axis, f64::min, f64::INFINITY));
        let far = [0, 1].map(|axis| end(axis, f64::max, f64::NEG_INFINITY));
        let span = [far[0] - corner[0], far[1] - corner[1]];
        if !(span[0] > 0.0 && span[1] > 0.0) {
            return Err(TrainingError::NoArea(span[0].max(0.0), span[1].max(0.0)));
        }
        let intervals = intervals.map(|count| count.max(1));
        let mut surface = Self {
            corner,
            step: [0, 1].map(|axis| span[axis] / intervals[axis] as f64),
            intervals,
            width: values.first().map_or(0, Vec::len),
            coefficients: Vec::new(),
        };
        surface.solve(positions, values, smoothing)?;
        Ok(surface)
    }

    fn solve(
        &mut self,
        positions: &[[f64; 2]],
        values: &[Vec<f64>],
        smoothing: f64,
    ) -> Result<(), TrainingError> {
        let unknowns = self.unknowns();
        let mut system = Banded::new(unknowns, 3 * self.columns() + 3);
        let mut right = vec![0.0; unknowns * self.width];
        for (position, value) in positions.iter().zip(values) {
            let (cell, [wx, wy], _) = self.local(*position);
            let terms = self.terms(cell);
            let weight = |k: usize| wx[k / 4] * wy[k % 4];
            for (k, at) in terms.iter().enumerate() {
                for (l, other) in terms.iter().enumerate().take(k + 1) {
                    system.add(*at, *other, weight(k) * weight(l));
                }
                let row = &mut right[at * self.width..(at + 1) * self.width];
                row.iter_mut()
                    .zip(value)
                    .for_each(|(r, v)| *r += weight(k) * v);
            }
        }
        self.penalise(
            &mut system,
            smoothing * positions.len() as f64 / unknowns as f64,
        );
        if !system.factorise() {
            return Err(TrainingError::Dependent { features: unknowns });
        }
        system.solve(&mut right, self.width);
        self.coefficients = right;
        Ok(())
    }

    /// Adds `weight` times the squares of all second differences.
    fn penalise(&self, system: &mut Banded, weight: f64) {
        let (rows, columns) = (self.intervals[0] + 3, self.columns());
        let mut second = |at: [usize; 3]| {
            for (a, x) in at.iter().zip([1.0, -2.0, 1.0]) {
                for (b, y) in at.iter().zip([1.0, -2.0, 1.0]) {
                    if a >= b {
                        system.add(*a, *b, weight * x * y);
                    }
                }
            }
        };
        for i in 0..rows {
            for j in 0..columns {
                if i + 2 < rows {
                    second([0, 1, 2].map(|k| (i + k) * columns + j));
                }
                if j + 2 < columns {
                    second([0, 1, 2].map(|k| i * columns + j + k));
                }
            }
        }
    }

    /// True if a surface from a file is one.
    pub(super) fn is_sound(&self) -> bool {
        let most = 1 << 12;
        self.intervals
            .iter()
            .all(|count| (1..=most).contains(count))
            && self.step.iter().all(|step| *step > 0.0 && step.is_finite())
            && self.corner.iter().all(|corner| corner.is_finite())
            && self.width > 0
            && self.coefficients.len() == self.unknowns() * self.width
            && self.coefficients.iter().all(|c| c.is_finite())
    }

    /// Number of coefficients of one function.
    pub fn unknowns(&self) -> usize {
        (self.intervals[0] + 3) * self.columns()
    }

    fn columns(&self) -> usize {
        self.intervals[1] + 3
    }

    /// The interval of a position along x and y, its weights and their slopes (1/m).
    fn local(&self, position: [f64; 2]) -> ([usize; 2], [[f64; 4]; 2], [[f64; 4]; 2]) {
        let [x, y] = [0, 1].map(|axis| {
            let last = self.intervals[axis] - 1;
            let at = (position[axis] - self.corner[axis]) / self.step[axis];
            let cell = (at.max(0.0) as usize).min(last);
            let (weights, slopes) = basis(at - cell as f64);
            (cell, weights, slopes.map(|slope| slope / self.step[axis]))
        });
        ([x.0, y.0], [x.1, y.1], [x.2, y.2])
    }

    /// Numbers of the sixteen coefficients of an interval.
    fn terms(&self, cell: [usize; 2]) -> [usize; 16] {
        std::array::from_fn(|k| (cell[0] + k / 4) * self.columns() + cell[1] + k % 4)
    }

    /// The functions at a position, with their slopes along x and y, into rows of
    /// `width` numbers. Outside of the rectangle the outermost cubics go on.
    pub fn evaluate(&self, position: [f64; 2], value: &mut [f64], slope: [&mut [f64]; 2]) {
        let (cell, [wx, wy], [sx, sy]) = self.local(position);
        let [slope_x, slope_y] = slope;
        value.fill(0.0);
        slope_x.fill(0.0);
        slope_y.fill(0.0);
        for (k, at) in self.terms(cell).into_iter().enumerate() {
            let (i, j) = (k / 4, k % 4);
            let (w, x, y) = (wx[i] * wy[j], sx[i] * wy[j], wx[i] * sy[j]);
            let row = &self.coefficients[at * self.width..(at + 1) * self.width];
            for (function, c) in row.iter().enumerate() {
                value[function] += w * c;
                slope_x[function] += x * c;
                slope_y[function] += y * c;
            }
        }
    }

    /// The functions at a position.
    pub fn at(&self, position: [f64; 2]) -> Vec<f64> {
        let mut value = vec![0.0; self.width];
        let (mut x, mut y) = (value.clone(), value.clone());
        self.evaluate(position, &mut value, [&mut x, &mut y]);
        value
    }

    /// Where the rectangle begins and ends along an axis, m.
    pub fn range(&self, axis: usize) -> [f64; 2] {
        let far = self.step[axis] * self.intervals[axis] as f64;
        [self.corner[axis], self.corner[axis] + far]
    }

    /// The position nearest to `position` in the rectangle, m.
    pub fn clamp(&self, position: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let [near, far] = self.range(axis);
            position[axis].max(near).min(far)
        })
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

    fn positions(count: usize) -> Vec<[f64; 2]> {
        // A sequence that fills the square evenly.
        let fill = |k: usize| {
            [
                (k as f64 * 0.7548776662) % 1.0,
                (k as f64 * 0.5698402910) % 1.0,
            ]
        };
        let corners = [[0.0, 0.0], [1.0, 1.0]];
        corners.into_iter().chain((1..count).map(fill)).collect()
    }

    #[test]
    fn a_bicubic_function_is_reproduced_with_its_slopes() {
        let f = |p: &[f64; 2]| {
            vec![
                p[0].powi(3) * p[1] - p[1].powi(2),
                1.0 + p[0] * p[1].powi(3),
            ]
        };
        let positions = positions(400);
        let values: Vec<_> = positions.iter().map(f).collect();
        let surface = Surface::fit(&positions, &values, [4, 5], 0.0).unwrap();
        let (mut v, mut x, mut y) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for p in [[0.0, 1.0], [0.31, 0.77], [1.0, 0.5]] {
            surface.evaluate(p, &mut v, [&mut x, &mut y]);
            // Rounding, times the condition of splines at the edge.
            for (a, b) in v.iter().zip(f(&p)) {
                assert!((a - b).abs() < 1e-10);
            }
            assert!((x[0] - 3.0 * p[0].powi(2) * p[1]).abs() < 1e-9);
            assert!((y[0] - p[0].powi(3) + 2.0 * p[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn strong_smoothing_leaves_a_plane() {
        let positions = positions(300);
        let plane = |p: &[f64; 2]| vec![2.0 - p[0] + 3.0 * p[1]];
        let values: Vec<_> = positions.iter().map(plane).collect();
        let surface = Surface::fit(&positions, &values, [9, 9], 1e6).unwrap();
        assert!((surface.at([0.2, 0.9])[0] - plane(&[0.2, 0.9])[0]).abs() < 1e-6);
    }

    #[test]
    fn presses_along_a_line_are_refused() {
        let line: Vec<_> = (0..9).map(|i| [f64::from(i), 2.0]).collect();
        let found = Surface::fit(&line, &vec![vec![0.0]; 9], [3, 3], 1.0);
        assert_eq!(found, Err(TrainingError::NoArea(8.0, 0.0)));
    }
}
