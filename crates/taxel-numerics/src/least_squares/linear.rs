//! Dense linear least squares with covariance, on a QR factorisation.

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

/// Solution of min |X·c − y|.
#[derive(Debug, Clone)]
pub struct Solution {
    /// c, in the units of the design.
    pub coefficients: Vec<f64>,
    /// (XᵀX)⁻¹: covariance for residuals of unit variance.
    pub covariance: Vec<Vec<f64>>,
    /// Σ (X·c − y)².
    pub misfit: f64,
}

/// Solves for the rows `design` (each as long as the first) and right-hand
/// sides `target`; columns are scaled to unit length first.
///
/// `None` when there are fewer rows than columns or the columns are linearly
/// dependent to working precision.
pub fn solve(design: &[Vec<f64>], target: &[f64]) -> Option<Solution> {
    let (rows, columns) = (design.len(), design.first()?.len());
    if rows < columns {
        return None;
    }
    let length = |j: usize| design.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
    let lengths: Vec<f64> = (0..columns).map(length).collect();
    if lengths
        .iter()
        .any(|length| !(*length > 0.0 && length.is_finite()))
    {
        return None;
    }
    let qr = Mat::from_fn(rows, columns, |i, j| design[i][j] / lengths[j]).qr();
    let inverse = upper_inverse(qr.thin_R())?;
    let solution = qr.solve_lstsq(Mat::from_fn(rows, 1, |i, _| target[i]));
    let coefficients: Vec<f64> = (0..columns)
        .map(|j| solution[(j, 0)] / lengths[j])
        .collect();
    let covariance = (0..columns)
        .map(|i| {
            (0..columns)
                .map(|j| {
                    let product = |k: usize| inverse[i][k] * inverse[j][k];
                    (i.max(j)..columns).map(product).sum::<f64>() / lengths[i] / lengths[j]
                })
                .collect()
        })
        .collect();
    let misfit = design
        .iter()
        .zip(target)
        .map(|(row, y)| {
            let value: f64 = row.iter().zip(&coefficients).map(|(x, c)| x * c).sum();
            (value - y).powi(2)
        })
        .sum();
    Some(Solution {
        coefficients,
        covariance,
        misfit,
    })
}

/// Inverse of an upper triangular matrix; `None` when a pivot is lost in
/// rounding (columns have unit length, so pivots compare with one).
fn upper_inverse(r: MatRef<'_, f64>) -> Option<Vec<Vec<f64>>> {
    let n = r.ncols();
    let mut inverse = vec![vec![0.0; n]; n];
    for j in 0..n {
        if r[(j, j)].abs() < 1e-14 {
            return None;
        }
        inverse[j][j] = 1.0 / r[(j, j)];
        for i in (0..j).rev() {
            let sum: f64 = (i + 1..=j).map(|k| r[(i, k)] * inverse[k][j]).sum();
            inverse[i][j] = -sum / r[(i, i)];
        }
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_line_has_its_textbook_covariance() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        let design: Vec<_> = x.iter().map(|x| vec![1.0, *x]).collect();
        let solution = solve(&design, &[1.0, 3.0, 5.0, 7.0, 9.0]).unwrap();
        assert!((solution.coefficients[0] - 1.0).abs() < 1e-14);
        assert!((solution.coefficients[1] - 2.0).abs() < 1e-14);
        assert!(solution.misfit < 1e-26);
        // Var(slope) = 1/Σ(x−x̄)² = 1/10, Var(intercept) = 1/5 + 4/10.
        assert!((solution.covariance[1][1] - 0.1).abs() < 1e-14);
        assert!((solution.covariance[0][0] - 0.6).abs() < 1e-14);
        assert!((solution.covariance[0][1] + 0.2).abs() < 1e-14);
    }

    #[test]
    fn dependent_columns_are_refused() {
        let design: Vec<_> = (0..5)
            .map(|i| vec![f64::from(i), 2.0 * f64::from(i)])
            .collect();
        assert!(solve(&design, &[0.0; 5]).is_none());
    }
}
