//! Linear systems whose matrix is symmetric but for a few products.

use super::small::{determinant_is_negative, dot};
use crate::assembly::unsymmetric::Unsymmetric;
use crate::sparse::{Cholesky, Definiteness, LinearError, Pattern, solve_checked};

/// Remaining share of the right side.
const ACCURACY: f64 = 1e-12;
/// Most directions of a search.
const DIRECTIONS: usize = 120;

/// Solves `(A + S) x = b` by the factor of the symmetric `A`: generalised minimal residuals
/// (Saad and Schultz 1986) of `(1 + A^-1 S) x = A^-1 b`. Each direction costs one solution with
/// the factor; as many are needed as `S` has distinct effects, which is few: it acts at free
/// edges and on sliding points only.
///
/// # Errors
/// When the symmetric system has no good answer.
pub(super) fn solve(
    factor: &mut Cholesky,
    (pattern, values, rest): (&Pattern, &[f64], &Unsymmetric),
    right: &[f64],
) -> Result<Vec<f64>, LinearError> {
    let start = solve_checked(factor, pattern, values, right)?;
    let size = dot(&start, &start).sqrt();
    if rest.is_empty() || size == 0.0 {
        return Ok(start);
    }
    let mut basis: Vec<Vec<f64>> = vec![start.iter().map(|x| x / size).collect()];
    // Columns of the triangle, the rotations that made it, and the rotated right side.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut turns: Vec<(f64, f64)> = Vec::new();
    let mut reduced = vec![size];
    while let Some(direction) = basis.get(triangle.len()) {
        let mut product = vec![0.0; right.len()];
        rest.add_product(direction, &mut product);
        let mut next = if product.iter().all(|x| *x == 0.0) {
            product
        } else {
            solve_checked(factor, pattern, values, &product)?
        };
        for (next, direction) in next.iter_mut().zip(direction) {
            *next += direction;
        }
        let mut column = Vec::new();
        for known in &basis {
            let along = dot(known, &next);
            column.push(along);
            for (next, known) in next.iter_mut().zip(known) {
                *next -= along * known;
            }
        }
        let length = dot(&next, &next).sqrt();
        for (k, (c, s)) in turns.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let last = column.len() - 1;
        let radius = column[last].hypot(length);
        if radius == 0.0 {
            return Err(LinearError::Singular);
        }
        let (c, s) = (column[last] / radius, length / radius);
        turns.push((c, s));
        column[last] = radius;
        triangle.push(column);
        let residual = reduced[last];
        reduced[last] = c * residual;
        reduced.push(-s * residual);
        let done = (s * residual).abs() <= ACCURACY * size;
        if done || length == 0.0 || triangle.len() == DIRECTIONS {
            break;
        }
        basis.push(next.iter().map(|x| x / length).collect());
    }
    // Back substitution.
    let count = triangle.len();
    let mut weights = reduced[..count].to_vec();
    for k in (0..count).rev() {
        for j in k + 1..count {
            weights[k] -= triangle[j][k] * weights[j];
        }
        weights[k] /= triangle[k][k];
    }
    let mut x = vec![0.0; right.len()];
    for (weight, direction) in weights.iter().zip(&basis) {
        for (x, direction) in x.iter_mut().zip(direction) {
            *x += weight * direction;
        }
    }
    Ok(x)
}

/// Most products for which the determinant is computed: each costs a solution.
const PRODUCTS: usize = 400;

/// True if an equilibrium is not shown to be stable. For a symmetric tangent it is stable where
/// the factor is positive definite. With loads that have no energy that is enough and not
/// necessary; on the way from a stable state the body diverges first where the determinant of
/// the whole tangent changes its sign,
/// `det(A + F M') = det A det(1 + M' A^-1 F)`.
///
/// # Errors
/// When the symmetric system has no good answer.
pub(super) fn diverges(
    factor: &mut Cholesky,
    (pattern, values, rest): (&Pattern, &[f64], &Unsymmetric),
    definiteness: Definiteness,
) -> Result<bool, LinearError> {
    if definiteness == Definiteness::Positive {
        return Ok(false);
    }
    let count = rest.count();
    if count == 0 || count > PRODUCTS {
        return Ok(true);
    }
    let mut small = vec![vec![0.0; count]; count];
    for column in 0..count {
        let forces = rest.forces(column, pattern.size());
        let moved = solve_checked(factor, pattern, values, &forces)?;
        for (row, entries) in small.iter_mut().enumerate() {
            entries[column] = f64::from(u8::from(row == column)) + rest.motion(row, &moved);
        }
    }
    let of_factor = factor.negative_eigenvalues() % 2 == 1;
    Ok(of_factor != determinant_is_negative(small))
}
