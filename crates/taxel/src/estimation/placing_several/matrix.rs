//! Small symmetric matrices.

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Takes from a row its part along rows of unit length that stand upright on
/// each other.
pub(super) fn without(row: &mut [f64], basis: &[Vec<f64>]) {
    for one in basis {
        let part = dot(row, one);
        for (value, along) in row.iter_mut().zip(one) {
            *value -= part * along;
        }
    }
}

/// Lower factor of a symmetric matrix (Cholesky); none if it is not positive.
pub(super) fn factor(mut matrix: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    for i in 0..matrix.len() {
        for j in 0..=i {
            let (row, other) = (&matrix[i], &matrix[j]);
            let rest = row[j] - dot(&row[..j], &other[..j]);
            if i != j {
                matrix[i][j] = rest / matrix[j][j];
            } else if rest > 0.0 {
                matrix[i][j] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(matrix)
}

pub(super) fn solve(factor: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let mut x = right.to_vec();
    for i in 0..x.len() {
        x[i] = (x[i] - dot(&factor[i][..i], &x[..i])) / factor[i][i];
    }
    transposed(factor, x)
}

/// Solves with the transposed factor alone: normal deviates become those with
/// the inverse of the matrix as covariance.
pub(super) fn transposed(factor: &[Vec<f64>], mut x: Vec<f64>) -> Vec<f64> {
    for i in (0..x.len()).rev() {
        x[i] /= factor[i][i];
        let known = x[i];
        for (value, entry) in x[..i].iter_mut().zip(&factor[i][..i]) {
            *value -= entry * known;
        }
    }
    x
}
