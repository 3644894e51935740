//! What one frame says of a load: the slopes of the channels, their noise, and what both
//! imply for what is estimated.

use crate::quantity::Dimension;
use taxel_numerics::dense::{cholesky, cholesky_solve};

/// One thing that is estimated from a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    /// Name, such as `force_z`.
    pub name: &'static str,
    /// Dimension of its values.
    pub dimension: &'static Dimension,
    /// Its full scale, SI: what the condition number is scaled by.
    pub full_scale: f64,
    /// True for what must be estimated too but is not what is asked for: the criteria leave
    /// it out.
    pub beside: bool,
}

/// Information of one frame about a load.
///
/// # Example
/// ```
/// use taxel::information::InformationOptions;
/// use taxel::predict::Loads;
/// let sensor = taxel::sensor::Sensor::shipped("in-plane-50um").unwrap();
/// let device = sensor.device().unwrap();
/// let load = Loads::one("fz=5 N", device.information_loads())?;
/// let options = InformationOptions { noise: Some(1e-16), ..InformationOptions::default() };
/// let found = device.information(&load.load(0), &options).unwrap();
/// let deviation = found.deviation("force_z").unwrap();
/// assert!(deviation > 1e-3 && deviation < 20e-3);
/// # Ok::<(), taxel::InputError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// What is estimated.
    pub unknowns: Vec<Unknown>,
    /// ∂channel/∂unknown, SI: one row for each channel, one column for each unknown.
    pub jacobian: Vec<Vec<f64>>,
    /// Standard deviation of a reading of each channel, SI.
    pub noise: Vec<f64>,
    /// 1/variance that is known of each unknown before the frame, SI; zero for nothing.
    pub prior: Vec<f64>,
}

/// What a question for [`Information`] says beside the load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InformationOptions {
    /// Standard deviation of a reading in the place of that of the board, SI.
    pub noise: Option<f64>,
    /// Radius of the contact.
    pub radius: RadiusKnowledge,
}

/// What is known of the radius of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum RadiusKnowledge {
    /// It is that of the load.
    #[default]
    Known,
    /// Nothing: it is one more unknown.
    Unknown,
    /// It lies between these, m, evenly.
    Between([f64; 2]),
}

/// Why there is no [`Information`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoInformation {
    /// Nothing of this kind of device is computed.
    #[error("no information is computed for this kind of device")]
    Kind,
    /// The load lies beyond the model.
    #[error("the load lies beyond the model: {0}")]
    Beyond(String),
}

/// A pivot of the Fisher matrix, scaled to a unit diagonal, below which it is singular:
/// rounding of the slopes alone leaves 1e-13.
const SINGULAR: f64 = 1e-11;

impl Information {
    /// One channel that reads one unknown: `slope` per unknown, with `noise`, both SI.
    pub fn of_one(unknown: Unknown, slope: f64, noise: f64) -> Self {
        Self {
            unknowns: vec![unknown],
            jacobian: vec![vec![slope]],
            noise: vec![noise],
            prior: vec![0.0],
        }
    }

    /// Fisher matrix Σ J Jᵀ/σ² of one frame, with what was known before: unknowns x unknowns.
    pub fn fisher(&self) -> Vec<Vec<f64>> {
        let count = self.unknowns.len();
        let mut matrix = vec![vec![0.0; count]; count];
        for (row, noise) in self.jacobian.iter().zip(&self.noise) {
            for (sums, a) in matrix.iter_mut().zip(row) {
                for (sum, b) in sums.iter_mut().zip(row) {
                    *sum += a / noise * (b / noise);
                }
            }
        }
        for (i, prior) in self.prior.iter().enumerate() {
            matrix[i][i] += prior;
        }
        matrix
    }

    /// Covariance of the unknowns, SI: the inverse of the Fisher matrix; none where the frame
    /// does not determine them.
    pub fn covariance(&self) -> Option<Vec<Vec<f64>>> {
        let fisher = self.fisher();
        let count = fisher.len();
        let scale: Vec<f64> = (0..count).map(|i| fisher[i][i].sqrt()).collect();
        if !scale.iter().all(|scale| *scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let scaled = (0..count).map(|i| {
            let row = (0..count).map(|j| fisher[i][j] / (scale[i] * scale[j]));
            row.collect::<Vec<_>>()
        });
        let factor = cholesky(scaled.collect())?;
        if (0..count).any(|i| factor[i][i] * factor[i][i] < SINGULAR) {
            return None;
        }
        let mut inverse = vec![vec![0.0; count]; count];
        for j in 0..count {
            let unit: Vec<f64> = (0..count).map(|i| f64::from(u8::from(i == j))).collect();
            let column = cholesky_solve(&factor, &unit);
            for (i, value) in column.into_iter().enumerate() {
                inverse[i][j] = value / (scale[i] * scale[j]);
            }
        }
        Some(inverse)
    }

    /// The unknowns by changes of the channels, SI, along the slopes: what a linear read-out with
    /// these slopes makes of a frame. None where the frame does not determine them.
    pub fn linear(&self, changes: &[f64]) -> Option<Vec<f64>> {
        let covariance = self.covariance()?;
        let weighed = |unknown: usize| -> f64 {
            let channels = self.jacobian.iter().zip(&self.noise).zip(changes);
            channels
                .map(|((row, noise), change)| row[unknown] / noise * (change / noise))
                .sum()
        };
        let sums: Vec<f64> = (0..self.unknowns.len()).map(weighed).collect();
        let row = |row: &Vec<f64>| row.iter().zip(&sums).map(|(a, b)| a * b).sum();
        Some(covariance.iter().map(row).collect())
    }

    /// Standard deviation of the unknown called `name`, SI; none without that unknown or
    /// without information.
    pub fn deviation(&self, name: &str) -> Option<f64> {
        let index = self.unknowns.iter().position(|one| one.name == name)?;
        Some(self.covariance()?[index][index].sqrt())
    }

    /// Standard deviation of the place, m: √(cov_xx + cov_yy), all other unknowns beside it.
    pub fn place_deviation(&self) -> Option<f64> {
        let place = |name: &str| self.unknowns.iter().position(|one| one.name == name);
        let (x, y) = (place("x")?, place("y")?);
        let covariance = self.covariance()?;
        Some((covariance[x][x] + covariance[y][y]).sqrt())
    }

    /// Covariance of the unknowns that are asked for.
    fn asked(&self) -> Option<Vec<Vec<f64>>> {
        let covariance = self.covariance()?;
        let asked: Vec<usize> = (0..self.unknowns.len())
            .filter(|i| !self.unknowns[*i].beside)
            .collect();
        let row = |i: &usize| asked.iter().map(|j| covariance[*i][*j]).collect();
        Some(asked.iter().map(row).collect())
    }

    /// Trace of the covariance of what is asked for, in the square of its SI unit.
    pub fn a_criterion(&self) -> Option<f64> {
        let covariance = self.asked()?;
        Some((0..covariance.len()).map(|i| covariance[i][i]).sum())
    }

    /// Determinant of the covariance of what is asked for, SI.
    pub fn d_criterion(&self) -> Option<f64> {
        let covariance = self.asked()?;
        let scale: Vec<f64> = (0..covariance.len()).map(|i| covariance[i][i]).collect();
        let factor = cholesky(scaled(&covariance, &scale))?;
        let part = |i: usize| factor[i][i] * factor[i][i] * scale[i];
        Some((0..scale.len()).map(part).product())
    }

    /// Largest eigenvalue of the covariance of what is asked for, SI.
    pub fn e_criterion(&self) -> Option<f64> {
        eigenvalues(self.asked()?).into_iter().reduce(f64::max)
    }

    /// Condition number of the Fisher matrix of all unknowns, each scaled by its full scale;
    /// infinite for a singular one.
    pub fn condition(&self) -> f64 {
        let mut fisher = self.fisher();
        for (i, row) in fisher.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value *= self.unknowns[i].full_scale * self.unknowns[j].full_scale;
            }
        }
        let values = eigenvalues(fisher);
        let greatest = values.iter().copied().fold(0.0, f64::max);
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        if least > 0.0 {
            greatest / least
        } else {
            f64::INFINITY
        }
    }
}

/// A symmetric matrix with rows and columns over the roots of `diagonal`.
fn scaled(matrix: &[Vec<f64>], diagonal: &[f64]) -> Vec<Vec<f64>> {
    let one = |i: usize, j: usize| matrix[i][j] / (diagonal[i] * diagonal[j]).sqrt();
    let count = diagonal.len();
    (0..count)
        .map(|i| (0..count).map(|j| one(i, j)).collect())
        .collect()
}

/// Eigenvalues of a symmetric matrix of a few rows, by Jacobi's rotations.
fn eigenvalues(mut m: Vec<Vec<f64>>) -> Vec<f64> {
    let count = m.len();
    // Each sweep squares what is left: eight leave nothing of any matrix of this size.
    for _ in 0..16 {
        for p in 0..count {
            for q in p + 1..count {
                if m[p][q] == 0.0 {
                    continue;
                }
                let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let t = if theta == 0.0 { 1.0 } else { t };
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                for row in &mut m {
                    let (a, b) = (row[p], row[q]);
                    (row[p], row[q]) = (c * a - s * b, s * a + c * b);
                }
                // p is below q.
                let (above, below) = m.split_at_mut(q);
                for (a, b) in above[p].iter_mut().zip(&mut below[0]) {
                    (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
                }
            }
        }
    }
    (0..count).map(|i| m[i][i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::FORCE;

    fn unknown(name: &'static str) -> Unknown {
        Unknown {
            name,
            dimension: &FORCE,
            full_scale: 1.0,
            beside: false,
        }
    }

    /// Two channels of noise 1 that read a and a + b: covariance [[1, -1], [-1, 2]].
    fn two() -> Information {
        Information {
            unknowns: vec![unknown("a"), unknown("b")],
            jacobian: vec![vec![1.0, 0.0], vec![1.0, 1.0]],
            noise: vec![1.0; 2],
            prior: vec![0.0; 2],
        }
    }

    #[test]
    fn criteria_are_those_of_the_inverse() {
        let found = two();
        // Rounding of a 2 x 2 inverse.
        let near = |a: Option<f64>, b: f64| (a.unwrap_or(f64::NAN) - b).abs() < 1e-13;
        assert!(near(found.deviation("a"), 1.0) && near(found.deviation("b"), 2f64.sqrt()));
        assert!(near(found.a_criterion(), 3.0) && near(found.d_criterion(), 1.0));
        assert!(near(found.e_criterion(), 0.5 * (3.0 + 5f64.sqrt())));
        let condition = (3.0 + 5f64.sqrt()) / (3.0 - 5f64.sqrt());
        assert!(near(Some(found.condition()), condition));
    }

    #[test]
    fn a_linear_read_out_inverts_the_slopes() {
        // Channels that read a and a + b: 3 and 5 are of a = 3, b = 2. Rounding of a 2 x 2 inverse.
        let found = two().linear(&[3.0, 5.0]).unwrap_or_default();
        assert!((found[0] - 3.0).abs() < 1e-13 && (found[1] - 2.0).abs() < 1e-13);
    }

    #[test]
    fn what_is_not_determined_has_no_deviation() {
        let mut found = two();
        found.jacobian[1] = vec![2.0, 0.0];
        assert_eq!(found.deviation("a"), None);
        assert_eq!(found.condition(), f64::INFINITY);
        // Knowledge of b before the frame makes both known.
        found.prior[1] = 4.0;
        assert_eq!(found.deviation("b"), Some(0.5));
    }

    #[test]
    fn what_is_beside_is_left_out_of_the_criteria() {
        let mut found = two();
        found.unknowns[1].beside = true;
        assert!((found.a_criterion().unwrap_or(0.0) - 1.0).abs() < 1e-14);
    }
}
