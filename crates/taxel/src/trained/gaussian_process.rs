//! Gaussian process regression, exact: for small training sets, and as the
//! yardstick of maps that are fast.
//!
//! f ~ GP(0, k), y = f + ε, ε ~ N(0, σ²): mean kᵀ(K + σ²I)⁻¹y, variance
//! k(x, x) + σ² − kᵀ(K + σ²I)⁻¹k (C. E. Rasmussen and C. K. I. Williams,
//! *Gaussian Processes for Machine Learning*, equations 2.25, 2.26, 2.30).

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::TrainingError;
use taxel_numerics::dense::dot;

/// k(a, b) = s² m(|a − b|/ℓ) + t² a·b with the Matérn function of order 5/2,
/// m(r) = (1 + √5 r + 5r²/3) exp(−√5 r).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// Deviation s of the smooth part.
    pub deviation: f64,
    /// Length ℓ over which it changes, in the unit of the inputs.
    pub length: f64,
    /// Deviation t of the slopes of the linear part.
    pub slope: f64,
    /// Deviation σ of the noise.
    pub noise: f64,
}

impl Kernel {
    /// Covariance of the function at two inputs, without noise.
    pub fn covariance(&self, a: &[f64], b: &[f64]) -> f64 {
        let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        let r = (5.0 * squared).sqrt() / self.length;
        self.deviation.powi(2) * (1.0 + r + r * r / 3.0) * (-r).exp()
            + self.slope.powi(2) * dot(a, b)
    }
}

/// A Gaussian process after its observations.
#[derive(Debug, Clone)]
pub struct GaussianProcess {
    kernel: Kernel,
    inputs: Vec<Vec<f64>>,
    factor: faer::linalg::solvers::Llt<f64>,
    means: Vec<f64>,
    solution: Mat<f64>,
    log_likelihood: f64,
}

impl GaussianProcess {
    /// Observes `targets` (one row each, every column a function of its own
    /// with the same kernel) at `inputs`; the mean of a column is taken off.
    ///
    /// # Errors
    /// [`TrainingError`] without rows, or when the noise is too small for
    /// inputs that repeat.
    pub fn observe(
        kernel: Kernel,
        inputs: &[Vec<f64>],
        targets: &[Vec<f64>],
    ) -> Result<Self, TrainingError> {
        let rows = inputs.len();
        let (found, needed) = (rows, 1);
        let Some(first) = targets.first().filter(|_| rows > 0) else {
            return Err(TrainingError::TooFew { found, needed });
        };
        let mean = |j: usize| targets.iter().map(|row| row[j]).sum::<f64>() / rows as f64;
        let means: Vec<f64> = (0..first.len()).map(mean).collect();
        let noise = kernel.noise.powi(2);
        let covariance = Mat::from_fn(rows, rows, |i, j| {
            kernel.covariance(&inputs[i], &inputs[j]) + if i == j { noise } else { 0.0 }
        });
        let factor = covariance
            .llt(Side::Lower)
            .map_err(|_| TrainingError::Dependent { features: rows })?;
        let centred = Mat::from_fn(rows, means.len(), |i, j| targets[i][j] - means[j]);
        let solution = factor.solve(&centred);
        let half_determinant: f64 = (0..rows).map(|i| factor.L()[(i, i)].ln()).sum();
        let constant = half_determinant + 0.918938533204673 * rows as f64;
        let fit = |j: usize| -> f64 { (0..rows).map(|i| centred[(i, j)] * solution[(i, j)]).sum() };
        Ok(Self {
            log_likelihood: (0..means.len()).map(|j| -0.5 * fit(j) - constant).sum(),
            kernel,
            inputs: inputs.to_vec(),
            factor,
            means,
            solution,
        })
    }

    /// Mean of each column at `input`.
    pub fn mean(&self, input: &[f64]) -> Vec<f64> {
        self.mean_of(&self.near(input))
    }

    fn near(&self, input: &[f64]) -> Mat<f64> {
        Mat::from_fn(self.inputs.len(), 1, |i, _| {
            self.kernel.covariance(&self.inputs[i], input)
        })
    }

    fn mean_of(&self, near: &Mat<f64>) -> Vec<f64> {
        let rows = self.inputs.len();
        let sum = |j: usize| -> f64 {
            (0..rows)
                .map(|i| near[(i, 0)] * self.solution[(i, j)])
                .sum()
        };
        let means = self.means.iter().enumerate();
        means.map(|(j, mean)| mean + sum(j)).collect()
    }

    /// Mean of each column at `input`, and the variance of an observation there.
    pub fn estimate(&self, input: &[f64]) -> (Vec<f64>, f64) {
        let rows = self.inputs.len();
        let near = self.near(input);
        let solved = self.factor.solve(&near);
        let known: f64 = (0..rows).map(|i| near[(i, 0)] * solved[(i, 0)]).sum();
        let prior = self.kernel.covariance(input, input);
        let variance = (prior - known).max(0.0) + self.kernel.noise.powi(2);
        (self.mean_of(&near), variance)
    }

    /// Logarithm of the marginal likelihood of the targets less their means.
    pub fn log_likelihood(&self) -> f64 {
        self.log_likelihood
    }
}
