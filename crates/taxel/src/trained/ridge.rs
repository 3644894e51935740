//! Bayesian linear regression: weights with a normal prior, and what a
//! prediction is worth.
//!
//! y = φᵀw + ε, ε ~ N(0, σ²), wⱼ ~ N(0, σ²/(λ vⱼ)) with vⱼ the variance of
//! feature j, so that the unit of a feature does not matter; the first feature
//! is the constant 1 and has no prior. Then (C. M. Bishop, *Pattern
//! Recognition and Machine Learning*, section 3.3)
//! w = A⁻¹ Φᵀy, A = ΦᵀΦ + λ diag(v), Var y = σ² (1 + φᵀA⁻¹φ).
//! All that is needed of the data are their second moments, and those of a
//! block of rows can be taken away again: leaving a block out is exact.

use faer::linalg::solvers::Solve;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Mat, MatRef, Par, Side};
use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};
use taxel_numerics::dense::long_dot;

use super::TrainingError;

/// Second moments of rows of features with their targets.
#[derive(Debug, Clone)]
pub struct Moments {
    rows: f64,
    gram: Mat<f64>,
    moment: Mat<f64>,
    square: f64,
}

impl Moments {
    /// Moments of the rows `features` (each as long as the first, beginning
    /// with 1) with one target each.
    ///
    /// # Errors
    /// [`TrainingError::TooFew`] without rows.
    pub fn of(features: &[Vec<f64>], target: &[f64]) -> Result<Self, TrainingError> {
        let Some(first) = features.first() else {
            return Err(TrainingError::TooFew {
                found: 0,
                needed: 1,
            });
        };
        let design = Mat::from_fn(features.len(), first.len(), |i, j| features[i][j]);
        let target = Mat::from_fn(features.len(), 1, |i, _| target[i]);
        Ok(Self {
            rows: features.len() as f64,
            gram: design.transpose() * &design,
            moment: design.transpose() * &target,
            square: target.squared_norm_l2(),
        })
    }

    /// Moments of the rows of both.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        Self {
            rows: self.rows + other.rows,
            gram: &self.gram + &other.gram,
            moment: &self.moment + &other.moment,
            square: self.square + other.square,
        }
    }

    /// Moments without the rows of `part`, which must be among them.
    #[must_use]
    pub fn without(&self, part: &Self) -> Self {
        Self {
            rows: self.rows - part.rows,
            gram: &self.gram - &part.gram,
            moment: &self.moment - &part.moment,
            square: self.square - part.square,
        }
    }

    /// Variance of feature `j`, or 1 for a constant one: its weight is then zero.
    fn spread(&self, j: usize) -> f64 {
        let mean_square = self.gram[(j, j)] / self.rows;
        let variance = mean_square - (self.gram[(0, j)] / self.rows).powi(2);
        // Below the rounding of the moments a feature is constant.
        if variance > 1e-12 * mean_square {
            variance
        } else {
            1.0
        }
    }
}

/// A fitted linear map with its posterior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ridge {
    weights: Vec<f64>,
    noise_variance: f64,
    /// L⁻¹ with A = L Lᵀ.
    inverse_factor: Triangle,
}

impl Ridge {
    /// Fits with the strength λ = `prior` of the prior, the same for all features.
    ///
    /// # Errors
    /// As [`Self::fit_with`].
    pub fn fit(moments: &Moments, prior: f64) -> Result<Self, TrainingError> {
        Self::fit_with(moments, |_| prior)
    }

    /// Fits with the strength λⱼ = `prior(j)` of the prior of feature j.
    ///
    /// The noise variance is that of largest marginal likelihood,
    /// σ² = (yᵀy − wᵀΦᵀy)/(n − 1).
    ///
    /// # Errors
    /// [`TrainingError`] for fewer than two rows or when features depend on
    /// each other and the prior is too weak to decide between them.
    pub fn fit_with(
        moments: &Moments,
        prior: impl Fn(usize) -> f64,
    ) -> Result<Self, TrainingError> {
        let size = moments.gram.ncols();
        if moments.rows < 2.0 {
            return Err(TrainingError::TooFew {
                found: moments.rows as usize,
                needed: 2,
            });
        }
        let mut matrix = moments.gram.clone();
        for j in 1..size {
            matrix[(j, j)] += prior(j) * moments.spread(j);
        }
        // Columns of unit length: features may differ by many orders.
        let scale: Vec<f64> = (0..size)
            .map(|j| 1.0 / matrix[(j, j)].sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let scaled = Mat::from_fn(size, size, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let factor = scaled
            .llt(Side::Lower)
            .map_err(|_| TrainingError::Dependent { features: size })?;
        let right = Mat::from_fn(size, 1, |i, _| moments.moment[(i, 0)] * scale[i]);
        let solution = factor.solve(right);
        let weights: Vec<f64> = (0..size).map(|j| solution[(j, 0)] * scale[j]).collect();
        let explained: f64 = (0..size).map(|j| weights[j] * moments.moment[(j, 0)]).sum();
        let rest = (moments.square - explained).max(1e-12 * moments.square);
        let inverse = lower_inverse(factor.L());
        Ok(Self {
            weights,
            noise_variance: (rest / (moments.rows - 1.0)).max(f64::MIN_POSITIVE),
            inverse_factor: Triangle::new(size, |i, j| (inverse[(i, j)] * scale[j]) as f32),
        })
    }

    /// True if a map from a file is one of `features` features.
    pub(super) fn is_sound(&self, features: usize) -> bool {
        self.weights.len() == features
            && self.inverse_factor.is_sound(features)
            && self.weights.iter().all(|weight| weight.is_finite())
            && self.noise_variance > 0.0
            && self.noise_variance.is_finite()
    }

    /// Mean of the target for one row of features.
    pub fn mean(&self, features: &[f64]) -> f64 {
        long_dot(&self.weights, features)
    }

    /// φᵀA⁻¹φ: how far the row is from the training rows, in units of the noise.
    pub fn leverage(&self, features: &[f64]) -> f64 {
        self.inverse_factor.squared_length(features)
    }

    /// σ², variance of one observation about its mean.
    pub fn noise_variance(&self) -> f64 {
        self.noise_variance
    }

    /// Weights of the features, the constant's first.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }
}

/// L⁻¹ of a lower triangular matrix.
fn lower_inverse(factor: MatRef<'_, f64>) -> Mat<f64> {
    let size = factor.nrows();
    let mut inverse = Mat::zeros(size, size);
    invert_lower_triangular(inverse.as_mut(), factor, Par::Seq);
    inverse
}

/// Rows of a panel, a register or a few of any machine.
const ROWS: usize = 64;

/// A lower triangular matrix in panels of rows; a file has its rows one after the other. Seven
/// digits are more than a deviation needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<f32>", into = "Vec<f32>")]
struct Triangle {
    size: usize,
    /// Panels one after the other, and of each its columns: products with a vector are then sums
    /// in as many places as a panel has rows. Rows beyond the last are zero.
    panels: Vec<[f32; ROWS]>,
}

impl Triangle {
    fn new(size: usize, entry: impl Fn(usize, usize) -> f32) -> Self {
        let within = |i: usize, j: usize| i < size && j <= i;
        let at = |i: usize, j: usize| if within(i, j) { entry(i, j) } else { 0.0 };
        let panel = |first: usize| {
            let column = move |j: usize| std::array::from_fn(|row| at(first + row, j));
            (0..size.min(first + ROWS)).map(column)
        };
        Self {
            size,
            panels: (0..size).step_by(ROWS).flat_map(panel).collect(),
        }
    }

    fn is_sound(&self, size: usize) -> bool {
        self.size == size && self.panels.as_flattened().iter().all(|x| x.is_finite())
    }

    /// |L φ|², in the widest registers of the machine.
    fn squared_length(&self, vector: &[f64]) -> f64 {
        let vector: Vec<f32> = vector.iter().map(|f| *f as f32).collect();
        pulp::Arch::new().dispatch(SquaredLength {
            triangle: self,
            vector: &vector,
        })
    }
}

/// From rows one after the other; those of no triangle become an empty one, which is not sound.
impl From<Vec<f32>> for Triangle {
    fn from(rows: Vec<f32>) -> Self {
        let size = (2.0 * rows.len() as f64).sqrt() as usize;
        if size * (size + 1) / 2 != rows.len() {
            return Self::new(0, |_, _| 0.0);
        }
        Self::new(size, |i, j| rows[i * (i + 1) / 2 + j])
    }
}

impl From<Triangle> for Vec<f32> {
    fn from(triangle: Triangle) -> Self {
        let (mut rows, mut first) = (Vec::new(), 0);
        for i in 0..triangle.size {
            if i > 0 && i % ROWS == 0 {
                first += i;
            }
            rows.extend((0..=i).map(|j| triangle.panels[first + j][i % ROWS]));
        }
        rows
    }
}

struct SquaredLength<'a> {
    triangle: &'a Triangle,
    vector: &'a [f32],
}

impl WithSimd for SquaredLength<'_> {
    type Output = f64;

    // Indices, because iterators are not inlined here: they take ten times as long.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the registers are those of the caller"
    )]
    #[allow(clippy::needless_range_loop)]
    fn with_simd<S: Simd>(self, _simd: S) -> f64 {
        let mut rest = &self.triangle.panels[..];
        let mut square = 0.0;
        for first in (0..self.triangle.size).step_by(ROWS) {
            let (panel, others) = rest.split_at(self.triangle.size.min(first + ROWS));
            let mut sums = [0.0f32; ROWS];
            for (column, entry) in panel.iter().zip(self.vector) {
                for row in 0..ROWS {
                    sums[row] += column[row] * entry;
                }
            }
            for sum in sums {
                square += f64::from(sum).powi(2);
            }
            rest = others;
        }
        square
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_its_rows_and_its_product_that_of_them() {
        for size in [1, 5, 63, 64, 65, 128, 200] {
            let count = size * (size + 1) / 2;
            let rows: Vec<f32> = (0..count).map(|k| (k as f32 * 0.7).cos()).collect();
            let triangle = Triangle::from(rows.clone());
            assert!(triangle.is_sound(size) && !triangle.is_sound(size + 1));
            let vector: Vec<f64> = (0..size).map(|j| (j as f64).cos()).collect();
            let product = |i: usize| -> f64 {
                let row = &rows[i * (i + 1) / 2..][..=i];
                let terms = row.iter().zip(&vector);
                terms.map(|(a, b)| f64::from(*a) * b).sum()
            };
            let expected: f64 = (0..size).map(|i| product(i).powi(2)).sum();
            let found = triangle.squared_length(&vector);
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{size}: {found} {expected}"
            );
            assert_eq!(Vec::from(triangle), rows);
        }
        assert!(!Triangle::from(vec![1.0; 4]).is_sound(2));
    }

    /// Features that hang together and differ by orders of size, as channels and their creep:
    /// the leverage is that of the exact inverse to a thousandth, for rows of training and for
    /// others ten times as large.
    #[test]
    fn a_leverage_is_that_of_the_exact_inverse() {
        let size = 150;
        let mut noise = taxel_numerics::Noise::seeded(1);
        let unit = |j: usize| 10f64.powf((j % 7) as f64 - 3.0);
        let mut row = |far: f64| -> Vec<f64> {
            let common: Vec<f64> = (0..6).map(|_| far * noise.normal()).collect();
            let of = |j: usize| unit(j) * (common[j % 6] + 0.01 * far * noise.normal());
            let features = (1..size).map(of);
            std::iter::once(1.0).chain(features).collect()
        };
        let rows: Vec<Vec<f64>> = (0..1000).map(|_| row(1.0)).collect();
        let targets: Vec<f64> = rows.iter().map(|row| row[1] + row[2]).collect();
        let moments = Moments::of(&rows, &targets).unwrap();
        for prior in [0.1, 10.0] {
            let ridge = Ridge::fit(&moments, prior).unwrap();
            let mut matrix = moments.gram.clone();
            for j in 1..size {
                matrix[(j, j)] += prior * moments.spread(j);
            }
            let factor = matrix.llt(Side::Lower).unwrap();
            for far in [1.0, 10.0] {
                let row = row(far);
                let right = Mat::from_fn(size, 1, |i, _| row[i]);
                let solved = factor.solve(&right);
                let exact: f64 = (0..size).map(|j| row[j] * solved[(j, 0)]).sum();
                let found = ridge.leverage(&row);
                assert!(
                    (found / exact - 1.0).abs() < 1e-3,
                    "{prior}: {found} {exact}"
                );
            }
        }
    }
}
