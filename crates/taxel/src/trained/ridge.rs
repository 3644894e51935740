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
use faer::{Mat, Side};
use pulp::{Simd, WithSimd};
use serde::{Deserialize, Serialize};
use taxel_numerics::dense::dot;

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
    /// Rows of the lower triangle of L⁻¹, A = L Lᵀ, one after the other.
    /// Seven digits are more than a deviation needs.
    inverse_factor: Vec<f32>,
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
        let inverse = lower_inverse(&factor.L().to_owned());
        Ok(Self {
            weights,
            noise_variance: (rest / (moments.rows - 1.0)).max(f64::MIN_POSITIVE),
            inverse_factor: (0..size)
                .flat_map(|i| (0..=i).map(move |j| (i, j)))
                .map(|(i, j)| (inverse[(i, j)] * scale[j]) as f32)
                .collect(),
        })
    }

    /// True if a map from a file is one of `features` features.
    pub(super) fn is_sound(&self, features: usize) -> bool {
        self.weights.len() == features
            && self.inverse_factor.len() == features * (features + 1) / 2
            && self.weights.iter().all(|weight| weight.is_finite())
            && self.inverse_factor.iter().all(|entry| entry.is_finite())
            && self.noise_variance > 0.0
            && self.noise_variance.is_finite()
    }

    /// Mean of the target for one row of features.
    pub fn mean(&self, features: &[f64]) -> f64 {
        dot(&self.weights, features)
    }

    /// φᵀA⁻¹φ: how far the row is from the training rows, in units of the noise.
    pub fn leverage(&self, features: &[f64]) -> f64 {
        let features: Vec<f32> = features.iter().map(|f| *f as f32).collect();
        pulp::Arch::new().dispatch(Leverage {
            factor: &self.inverse_factor,
            features: &features[..features.len().min(self.weights.len())],
        })
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
fn lower_inverse(factor: &Mat<f64>) -> Mat<f64> {
    let size = factor.nrows();
    let mut inverse = Mat::zeros(size, size);
    for j in 0..size {
        inverse[(j, j)] = 1.0 / factor[(j, j)];
        for i in j + 1..size {
            let sum: f64 = (j..i).map(|k| factor[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = -sum / factor[(i, i)];
        }
    }
    inverse
}

/// |L⁻¹φ|², in the widest registers of the machine.
struct Leverage<'a> {
    /// Rows of the lower triangle.
    factor: &'a [f32],
    features: &'a [f32],
}

impl WithSimd for Leverage<'_> {
    type Output = f64;

    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the registers are those of the caller"
    )]
    fn with_simd<S: Simd>(self, _simd: S) -> f64 {
        let mut rest = self.factor;
        let mut sum = 0.0;
        for row in 1..=self.features.len() {
            let (head, tail) = rest.split_at(row.min(rest.len()));
            sum += f64::from(dot_short(head, &self.features[..row])).powi(2);
            rest = tail;
        }
        sum
    }
}

/// Σ aᵢ bᵢ in 32 independent sums, the same on every machine. Indices, because iterators are not
/// inlined across the crates here: they take ten times as long.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the registers are those of the caller"
)]
#[allow(clippy::needless_range_loop)]
fn dot_short(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; 32];
    let ((a_blocks, a_rest), (b_blocks, b_rest)) = (a.as_chunks::<32>(), b.as_chunks::<32>());
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        for i in 0..32 {
            sums[i] += a[i] * b[i];
        }
    }
    let mut sum: f32 = sums.iter().sum();
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a * b;
    }
    sum
}
