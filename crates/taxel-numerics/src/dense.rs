//! Small dense vectors and matrices, as rows.

/// Σ aᵢ bᵢ of vectors in space.
#[inline]
pub fn dot3(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Solution of the 3 x 3 system `m` x = `right` by Cramer's rule, exact for a diagonal
/// matrix up to rounding; `None` when it is singular.
#[inline]
pub fn solve3(m: [[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let (c0, c1, c2) = (cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    let determinant = dot3(m[0], c0);
    let solution = std::array::from_fn(|i| {
        (c0[i] * right[0] + c1[i] * right[1] + c2[i] * right[2]) / determinant
    });
    solution
        .iter()
        .all(|value| value.is_finite())
        .then_some(solution)
}

/// Σ aᵢ bᵢ.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Σ aᵢ bᵢ of long rows, in eight sums: one after the other each addition waits for the one before.
#[inline]
pub fn long_dot(a: &[f64], b: &[f64]) -> f64 {
    const SUMS: usize = 8;
    let count = a.len().min(b.len());
    let (a, a_rest) = a[..count].as_chunks::<SUMS>();
    let (b, b_rest) = b[..count].as_chunks::<SUMS>();
    let mut sums = [0.0; SUMS];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + dot(a_rest, b_rest)
}

/// A dense matrix as rows.
pub type Rows = Vec<Vec<f64>>;

/// Adds `factor` times `values` to `sum`.
#[inline]
pub fn add_scaled(sum: &mut [f64], factor: f64, values: &[f64]) {
    sum.iter_mut()
        .zip(values)
        .for_each(|(sum, value)| *sum += factor * value);
}

/// The square matrix of these entries.
pub fn square(count: usize, entry: impl Fn(usize, usize) -> f64) -> Rows {
    (0..count)
        .map(|i| (0..count).map(|j| entry(i, j)).collect())
        .collect()
}

/// The transposed of a matrix with at least one row.
pub fn transposed(rows: &[Vec<f64>]) -> Rows {
    (0..rows[0].len())
        .map(|j| rows.iter().map(|row| row[j]).collect())
        .collect()
}

/// The product a b of matrices with at least one row.
pub fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Rows {
    let row = |factors: &Vec<f64>| {
        let mut sum = vec![0.0; b[0].len()];
        for (factor, row) in factors.iter().zip(b) {
            add_scaled(&mut sum, *factor, row);
        }
        sum
    };
    a.iter().map(row).collect()
}

/// Removes from `row` its projections on the orthonormal rows `basis`.
pub fn remove_projections(row: &mut [f64], basis: &[Vec<f64>]) {
    for one in basis {
        let part = dot(row, one);
        for (value, along) in row.iter_mut().zip(one) {
            *value -= part * along;
        }
    }
}

/// Lower factor of a symmetric matrix (Cholesky); none if it is not positive.
pub fn cholesky(mut matrix: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
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

/// Solution of L Lᵀ x = `right` for the lower triangle L = `factor`.
pub fn cholesky_solve(factor: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let mut x = right.to_vec();
    for i in 0..x.len() {
        x[i] = (x[i] - dot(&factor[i][..i], &x[..i])) / factor[i][i];
    }
    solve_transposed(factor, x)
}

/// Solves with the transposed factor alone: normal deviates become those with
/// the inverse of the matrix as covariance.
pub fn solve_transposed(factor: &[Vec<f64>], mut x: Vec<f64>) -> Vec<f64> {
    for i in (0..x.len()).rev() {
        x[i] /= factor[i][i];
        let known = x[i];
        for (value, entry) in x[..i].iter_mut().zip(&factor[i][..i]) {
            *value -= entry * known;
        }
    }
    x
}
