//! Small dense linear algebra of a fit.

use std::ops::Range;

/// The triangle R of a weighted design with Qᵀr, from one QR factorisation of
/// the design with the residuals as its last column.
#[derive(Debug, Clone)]
pub(super) struct Triangle {
    /// Rows of R, full length.
    pub(super) rows: Vec<Vec<f64>>,
    /// Qᵀ times the right-hand side.
    pub(super) target: Vec<f64>,
}

/// Along a combination of sensible sizes the covariance is at most the square
/// of this.
const LARGEST_DEVIATION: f64 = 1e6;
/// Singular values below this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

impl Triangle {
    /// Of columns of equal length, one right-hand side among them; rows with
    /// one entry each (column, value, right-hand side) are appended.
    ///
    /// Readings of one kind touch few of the unknowns, so runs of rows that
    /// are zero in the same columns are factored by themselves first.
    pub(super) fn new(columns: &[&[f64]], target: &[f64], extra: &[(usize, f64, f64)]) -> Self {
        let unknowns = columns.len();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for run in runs(columns, target.len()) {
            let used = |j: &usize| columns[*j][run.clone()].iter().any(|value| *value != 0.0);
            let used: Vec<usize> = (0..unknowns).filter(used).collect();
            let of = |j: usize| used.get(j).map_or(target, |&column| columns[column]);
            let part = (0..=used.len()).map(|j| of(j)[run.clone()].to_vec());
            for row in triangle(part.collect()) {
                let mut whole = vec![0.0; unknowns + 1];
                for (place, value) in row.iter().enumerate() {
                    whole[used.get(place).copied().unwrap_or(unknowns)] = *value;
                }
                rows.push(whole);
            }
        }
        for (column, value, target) in extra {
            let mut row = vec![0.0; unknowns + 1];
            row[*column] = *value;
            row[unknowns] = *target;
            rows.push(row);
        }
        rows.resize(rows.len().max(unknowns + 1), vec![0.0; unknowns + 1]);
        let column = |j: usize| rows.iter().map(|row| row[j]).collect::<Vec<f64>>();
        let mut rows = triangle((0..=unknowns).map(column).collect());
        rows.truncate(unknowns);
        Self {
            target: rows.iter_mut().filter_map(Vec::pop).collect(),
            rows,
        }
    }

    /// |Qᵀr|: how far the residuals lie in the space of the slopes.
    pub(super) fn reach(&self) -> f64 {
        self.target.iter().map(|t| t * t).sum::<f64>().sqrt()
    }

    /// How much of the sum of squares a step removes, if the slopes stay.
    pub(super) fn decrease(&self, step: &[f64]) -> f64 {
        let left: f64 = self
            .rows
            .iter()
            .zip(&self.target)
            .map(|(row, target)| {
                let moved: f64 = row.iter().zip(step).map(|(r, s)| r * s).sum();
                (target - moved).powi(2)
            })
            .sum();
        self.reach().powi(2) - left
    }

    /// The least-squares step with `damping`·lengthⱼ² added on the diagonal of
    /// RᵀR; `None` when that is singular to working precision.
    pub(super) fn step(&self, damping: f64, lengths: &[f64]) -> Option<Vec<f64>> {
        let column =
            |j: usize| -> Vec<f64> { self.rows.iter().map(|row| row[j]).collect::<Vec<f64>>() };
        let columns: Vec<Vec<f64>> = (0..self.rows.len()).map(column).collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let extra: Vec<_> = lengths
            .iter()
            .enumerate()
            .map(|(j, length)| (j, damping.sqrt() * length, 0.0))
            .collect();
        Self::new(&columns, &self.target, &extra).solve(lengths)
    }

    /// R⁻¹ Qᵀr.
    fn solve(&self, lengths: &[f64]) -> Option<Vec<f64>> {
        let n = self.rows.len();
        let mut solution = vec![0.0; n];
        for i in (0..n).rev() {
            let pivot = self.rows[i][i];
            if pivot.abs() < 1e-15 * lengths[i] || pivot == 0.0 {
                return None;
            }
            let known: f64 = (i + 1..n).map(|j| self.rows[i][j] * solution[j]).sum();
            solution[i] = (self.target[i] - known) / pivot;
        }
        Some(solution)
    }

    /// B with B·Bᵀ = (RᵀR)⁻¹: right singular vectors over singular values, the
    /// smallest of them raised until the deviation along them is finite.
    pub(super) fn bounded_inverse(&self) -> Vec<Vec<f64>> {
        let (values, vectors) = singular_values(&self.rows);
        let floor = floor(&values);
        vectors
            .iter()
            .map(|row| {
                let pairs = row.iter().zip(&values);
                pairs.map(|(v, s)| v / s.max(floor)).collect()
            })
            .collect()
    }

    /// Standard deviation of each unknown.
    pub(super) fn deviations(&self) -> Vec<f64> {
        let inverse = self.bounded_inverse();
        let length = |row: &Vec<f64>| row.iter().map(|x| x * x).sum::<f64>().sqrt();
        inverse.iter().map(length).collect()
    }
}

/// Longest run: what fits in the cache next to the processor.
const RUN: usize = 512;

/// Rows that follow one another and are zero in the same columns.
fn runs(columns: &[&[f64]], count: usize) -> Vec<Range<usize>> {
    let mut patterns = vec![0_u64; count];
    for (j, column) in columns.iter().enumerate() {
        for (pattern, value) in patterns.iter_mut().zip(*column) {
            // Columns beyond 64 share a mark, which only makes runs shorter.
            *pattern |= u64::from(*value != 0.0) << (j % 64);
        }
    }
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (i, pattern) in patterns.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if patterns[run.start] == *pattern && run.len() < RUN => run.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}

/// Rows of the triangle R of the matrix with these columns, by reflections
/// (Householder): for a few columns quicker than a blocked factorisation.
fn triangle(mut columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let height = columns.first().map_or(0, Vec::len).min(columns.len());
    for k in 0..height {
        let (done, rest) = columns.split_at_mut(k + 1);
        let mirror = &mut done[k][k..];
        let length = mirror.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let pivot = -length.copysign(mirror[0]);
        mirror[0] -= pivot;
        // |v|² of the mirror v, half of it.
        let half = -pivot * mirror[0];
        for column in rest {
            let share = dot(mirror, &column[k..]) / half;
            for (x, v) in column[k..].iter_mut().zip(mirror.iter()) {
                *x -= share * v;
            }
        }
        mirror[0] = pivot;
    }
    let above = |i: usize, j: usize| if i <= j { columns[j][i] } else { 0.0 };
    (0..height)
        .map(|i| (0..columns.len()).map(|j| above(i, j)).collect())
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The smallest singular value that is taken at its word.
pub(super) fn floor(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(0.0, f64::max);
    (ROUNDING * largest).max(1.0 / LARGEST_DEVIATION)
}

/// Singular values of a square matrix with their right singular vectors as
/// columns, by one-sided rotations: small values keep their digits.
pub(crate) fn singular_values(matrix: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = matrix.len();
    let mut work = matrix.to_vec();
    let mut vectors: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    // Convergence is quadratic at the end; 8 sweeps are usual.
    for _ in 0..60 {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                rotated |= rotate(&mut work, &mut vectors, p, q);
            }
        }
        if !rotated {
            break;
        }
    }
    let values = (0..n)
        .map(|j| work.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt())
        .collect();
    (values, vectors)
}

/// Makes the columns `p` and `q` of `work` orthogonal; whether they were not.
fn rotate(work: &mut [Vec<f64>], vectors: &mut [Vec<f64>], p: usize, q: usize) -> bool {
    let sum = |f: fn(&Vec<f64>, usize, usize) -> f64| -> f64 {
        work.iter().map(|row| f(row, p, q)).sum()
    };
    let (a, b) = (
        sum(|row, p, _| row[p] * row[p]),
        sum(|row, _, q| row[q] * row[q]),
    );
    let c = sum(|row, p, q| row[p] * row[q]);
    if c.abs() <= 1e-15 * (a * b).sqrt() {
        return false;
    }
    let zeta = (b - a) / (2.0 * c);
    let tangent = 1.0_f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    for row in work.iter_mut().chain(vectors) {
        let (x, y) = (row[p], row[q]);
        row[p] = cosine * x - sine * y;
        row[q] = sine * x + cosine * y;
    }
    true
}
