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

/// Along a combination in typical sizes the covariance is at most the square
/// of this.
const LARGEST_DEVIATION: f64 = 1e6;
/// Singular values below this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

impl Triangle {
    /// Triangle of columns of equal length, each with a factor, and one right-hand side,
    /// all with the same weights of rows; rows with one entry each (column, value,
    /// right-hand side) are appended.
    ///
    /// Readings of one kind touch few of the unknowns, so runs of rows that
    /// are zero in the same columns are factored by themselves first.
    pub(super) fn new(
        columns: &[(&[f64], f64)],
        target: &[f64],
        weights: &[f64],
        extra: &[(usize, f64, f64)],
    ) -> Self {
        let unknowns = columns.len();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for run in runs(columns, target.len()) {
            let used = |j: &usize| columns[*j].0[run.clone()].iter().any(|value| *value != 0.0);
            let used: Vec<usize> = (0..unknowns).filter(used).collect();
            let part = (0..=used.len()).map(|place| {
                let (values, factor) = used.get(place).map_or((target, 1.0), |j| columns[*j]);
                let pairs = values[run.clone()].iter().zip(&weights[run.clone()]);
                pairs
                    .map(|(value, weight)| value * weight * factor)
                    .collect()
            });
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
        Self::of_rows(rows)
    }

    /// Triangle of rows that end with their right-hand side.
    fn of_rows(mut rows: Vec<Vec<f64>>) -> Self {
        let width = rows.first().map_or(1, Vec::len);
        rows.resize(rows.len().max(width), vec![0.0; width]);
        let column = |j: usize| rows.iter().map(|row| row[j]).collect::<Vec<f64>>();
        let mut rows = triangle((0..width).map(column).collect());
        rows.truncate(width - 1);
        Self {
            target: rows.iter_mut().filter_map(Vec::pop).collect(),
            rows,
        }
    }

    /// |Qᵀr|: how far the residuals lie in the space of the slopes.
    pub(super) fn reach(&self) -> f64 {
        self.target.iter().map(|t| t * t).sum::<f64>().sqrt()
    }

    /// Decrease of the sum of squares by a step, if the slopes stay.
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

    /// The best step no longer than `radius`, to a tenth, with the damping λ of
    /// RᵀR + λ that makes it so short (Moré 1978).
    pub(super) fn bounded_step(&self, radius: f64) -> (f64, Vec<f64>) {
        let n = self.rows.len();
        let free = vec![None; n];
        let length = |step: &[f64]| norm(step.iter().copied());
        let plain = self.damped(0.0, &free);
        if let Some((_, step)) = &plain
            && length(step) <= (1.0 + SLACK) * radius
        {
            return (0.0, step.clone());
        }
        // The length falls with λ, which lies between these two.
        let steepest = (0..n).map(|j| {
            let pairs = self.rows.iter().zip(&self.target);
            pairs.map(|(row, target)| row[j] * target).sum::<f64>()
        });
        let (mut low, mut high) = (0.0, norm(steepest) / radius);
        let mut damping = match &plain {
            Some((matrix, step)) => matrix.newton(step, radius).clamp(low, high),
            None => 1e-3 * high,
        };
        let mut best = vec![0.0; n];
        for _ in 0..MOST_DAMPINGS {
            let Some((matrix, step)) = self.damped(damping, &free) else {
                damping *= 10.0;
                continue;
            };
            let length = length(&step);
            let near = (length - radius).abs() <= SLACK * radius;
            let next = damping + matrix.newton(&step, radius);
            best = step;
            if near {
                break;
            }
            if length > radius {
                low = damping;
            } else {
                high = damping;
            }
            damping = if next > low && next < high {
                next
            } else {
                (low * high).sqrt().max(1e-3 * high)
            };
        }
        (damping, best)
    }

    /// The step under a damping with some of its parts held.
    pub(super) fn step_beside(&self, damping: f64, held: &[Option<f64>]) -> Vec<f64> {
        let step = self.damped(damping, held).map(|(_, step)| step);
        // Singular beside the held ones: those alone.
        step.unwrap_or_else(|| held.iter().map(|part| part.unwrap_or(0.0)).collect())
    }

    /// Least squares with `damping` added on the diagonal of RᵀR, with the
    /// triangle of that; held parts are left out of it. `None` when it is
    /// singular to working precision.
    fn damped(&self, damping: f64, held: &[Option<f64>]) -> Option<(Self, Vec<f64>)> {
        let n = self.rows.len();
        let free: Vec<usize> = (0..n).filter(|j| held[*j].is_none()).collect();
        let row = |(row, target): (&Vec<f64>, &f64)| -> Vec<f64> {
            let moved: f64 = held
                .iter()
                .zip(row)
                .filter_map(|(h, r)| Some((*h)? * r))
                .sum();
            let kept = free.iter().map(|j| row[*j]);
            kept.chain([target - moved]).collect()
        };
        let mut rows: Vec<Vec<f64>> = self.rows.iter().zip(&self.target).map(row).collect();
        if damping > 0.0 {
            rows.extend((0..free.len()).map(|place| {
                let mut row = vec![0.0; free.len() + 1];
                row[place] = damping.sqrt();
                row
            }));
        }
        let whole = free.len() == n && damping == 0.0;
        let matrix = if whole {
            self.clone()
        } else {
            Self::of_rows(rows)
        };
        let part = matrix.solve()?;
        let mut step: Vec<f64> = held.iter().map(|part| part.unwrap_or(0.0)).collect();
        for (j, part) in free.iter().zip(part) {
            step[*j] = part;
        }
        Some((matrix, step))
    }

    /// Newton's change of λ for 1/|step| = 1/radius, which is nearly straight in
    /// λ; `self` is the triangle of RᵀR + λ.
    fn newton(&self, step: &[f64], radius: f64) -> f64 {
        let length = norm(step.iter().copied());
        // |R⁻ᵀ step/|step||²: the transposed triangle from the top.
        let mut solved: Vec<f64> = Vec::with_capacity(step.len());
        for (i, step) in step.iter().enumerate() {
            let known: f64 = (0..i).map(|k| self.rows[k][i] * solved[k]).sum();
            solved.push((step / length - known) / self.rows[i][i]);
        }
        let square: f64 = solved.iter().map(|x| x * x).sum();
        (length - radius) / (radius * square)
    }

    /// R⁻¹ Qᵀr; `None` for a pivot that is rounding beside its column.
    fn solve(&self) -> Option<Vec<f64>> {
        let n = self.rows.len();
        let mut solution = vec![0.0; n];
        for i in (0..n).rev() {
            let pivot = self.rows[i][i];
            let column = norm(self.rows[..=i].iter().map(|row| row[i]));
            if pivot.abs() <= 1e-15 * column {
                return None;
            }
            let known: f64 = (i + 1..n).map(|j| self.rows[i][j] * solution[j]).sum();
            solution[i] = (self.target[i] - known) / pivot;
        }
        Some(solution)
    }

    /// Singular values with their vectors.
    pub(super) fn spectrum(&self) -> Spectrum {
        let (values, vectors) = singular_values(&self.rows);
        Spectrum { values, vectors }
    }
}

/// Singular values of a triangle with the right singular vectors as columns.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    pub(super) values: Vec<f64>,
    pub(super) vectors: Vec<Vec<f64>>,
}

impl Spectrum {
    /// The smallest singular value that is taken at its word.
    pub(super) fn floor(&self) -> f64 {
        let largest = self.values.iter().copied().fold(0.0, f64::max);
        (ROUNDING * largest).max(1.0 / LARGEST_DEVIATION)
    }

    /// B with B·Bᵀ = (RᵀR)⁻¹: right singular vectors over singular values, the
    /// smallest of them raised until the deviation along them is finite.
    pub(super) fn bounded_inverse(&self) -> Vec<Vec<f64>> {
        let floor = self.floor();
        let over = |row: &Vec<f64>| {
            let pairs = row.iter().zip(&self.values);
            pairs.map(|(v, s)| v / s.max(floor)).collect()
        };
        self.vectors.iter().map(over).collect()
    }

    /// Standard deviation of each unknown.
    pub(super) fn deviations(&self) -> Vec<f64> {
        let inverse = self.bounded_inverse();
        inverse
            .iter()
            .map(|row| norm(row.iter().copied()))
            .collect()
    }
}

/// A step may be this share longer or shorter than the radius.
const SLACK: f64 = 0.1;
const MOST_DAMPINGS: usize = 20;

/// Length of a vector.
pub(super) fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|x| x * x).sum::<f64>().sqrt()
}

/// Longest run: what fits in the cache next to the processor.
const RUN: usize = 512;

/// Rows that follow one another and are zero in the same columns.
fn runs(columns: &[(&[f64], f64)], count: usize) -> Vec<Range<usize>> {
    let mut patterns = vec![0_u64; count];
    for (j, (column, _)) in columns.iter().enumerate() {
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
        let length = dot(mirror, mirror).sqrt();
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

/// Eight sums side by side: one would wait for each addition.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks(8), b.chunks(8));
    for (a, b) in a.zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

/// Singular values of a square matrix with their right singular vectors as
/// columns, by one-sided rotations: small values keep their digits.
pub fn singular_values(matrix: &[Vec<f64>]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = matrix.len();
    // Each column of the matrix with its vector below it.
    let mut columns: Vec<Vec<f64>> = (0..n)
        .map(|j| {
            let unit = (0..n).map(|i| f64::from(u8::from(i == j)));
            matrix.iter().map(|row| row[j]).chain(unit).collect()
        })
        .collect();
    // Convergence is quadratic at the end; 8 sweeps are usual.
    for _ in 0..60 {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let (left, right) = columns.split_at_mut(q);
                rotated |= rotate(&mut left[p], &mut right[0], n);
            }
        }
        if !rotated {
            break;
        }
    }
    let length = |column: &Vec<f64>| norm(column[..n].iter().copied());
    let vectors = (0..n).map(|i| columns.iter().map(|column| column[n + i]).collect());
    (columns.iter().map(length).collect(), vectors.collect())
}

/// Makes the first `n` entries of two columns orthogonal; whether they were not.
fn rotate(p: &mut [f64], q: &mut [f64], n: usize) -> bool {
    let (a, b, c) = (
        dot(&p[..n], &p[..n]),
        dot(&q[..n], &q[..n]),
        dot(&p[..n], &q[..n]),
    );
    if c.abs() <= 1e-15 * (a * b).sqrt() {
        return false;
    }
    let zeta = (b - a) / (2.0 * c);
    let tangent = 1.0_f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = cosine * tangent;
    for (x, y) in p.iter_mut().zip(q) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
    true
}
