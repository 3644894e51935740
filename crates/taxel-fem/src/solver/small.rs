//! Algebra of the few parameters of a problem.

/// `y + factor x`.
pub(super) fn axpy(factor: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// Gauss elimination with pivoting; none when singular.
pub(super) fn solve_small(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if a[pivot][k] == 0.0 || a[pivot][k].is_nan() {
            return None;
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            b[k] -= a[k][j] * b[j];
        }
        b[k] /= a[k][k];
    }
    Some(b)
}

/// True if the determinant is negative, by elimination with pivoting.
pub(super) fn determinant_is_negative(mut a: Vec<Vec<f64>>) -> bool {
    let mut negative = false;
    for k in 0..a.len() {
        let rest = k..a.len();
        let pivot = rest.max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()));
        let pivot = pivot.unwrap_or(k);
        negative ^= (a[pivot][k] < 0.0) ^ (pivot != k);
        a.swap(k, pivot);
        for i in k + 1..a.len() {
            let factor = if a[k][k] == 0.0 {
                0.0
            } else {
                a[i][k] / a[k][k]
            };
            for j in k..a.len() {
                a[i][j] -= factor * a[k][j];
            }
        }
    }
    negative
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_of_a_determinant_survives_exchanged_rows() {
        let swapped = vec![vec![0.0, 1.0], vec![1.0, 0.0]];
        assert!(determinant_is_negative(swapped));
        let turned = vec![
            vec![0.0, -2.0, 0.1],
            vec![1.0, 0.0, 0.3],
            vec![0.0, 0.0, 3.0],
        ];
        assert!(!determinant_is_negative(turned));
    }
}
