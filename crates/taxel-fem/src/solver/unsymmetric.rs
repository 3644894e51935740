//! Linear systems whose matrix is symmetric but for a few products.

use taxel_numerics::dense::dot;

use super::small::{axpy, determinant_is_negative};
use crate::assembly::unsymmetric::Unsymmetric;
use crate::sparse::{Cholesky, Definiteness, LinearError, Pattern, solve_checked};

/// Remaining share of the right side.
const ACCURACY: f64 = 1e-12;
/// The same, that is enough where rounding allows for no less.
const ENOUGH: f64 = 1e-8;
/// Directions of a search before it begins anew at what it has found: their number is limited by
/// the memory they take.
const DIRECTIONS: usize = 120;
/// Share of its residual that a search has to take away, or there won't be another.
const PROGRESS: f64 = 0.5;

/// Solves `(A + S) x = b` by the factor of the symmetric `A`: generalised minimal residuals
/// (Saad and Schultz 1986) of `(1 + A^-1 S) x = A^-1 b`. Each direction costs one solution with
/// the factor; as many are needed as `S` has distinct effects, which is few: it acts at free
/// edges and on points that touch another surface or slide.
///
/// # Errors
/// When the symmetric system has no good answer, and when a search comes no nearer.
pub(super) fn solve(
    factor: &mut Cholesky,
    (pattern, values, rest): (&Pattern, &[f64], &Unsymmetric),
    right: &[f64],
) -> Result<Vec<f64>, LinearError> {
    let start = solve_checked(factor, pattern, values, right)?;
    let size = length_of(&start);
    if rest.is_empty() || size == 0.0 {
        return Ok(start);
    }
    // (1 + A^-1 S) times a vector.
    let mut applied = |x: &[f64]| {
        let mut product = vec![0.0; x.len()];
        rest.add_product(x, &mut product);
        if product.iter().any(|x| *x != 0.0) {
            product = solve_checked(factor, pattern, values, &product)?;
        }
        axpy(1.0, x, &mut product);
        Ok(product)
    };
    let mut x = vec![0.0; right.len()];
    let (mut residual, mut left, mut directions) = (start.clone(), size, 0);
    loop {
        let found = search(&mut applied, &residual, ACCURACY * size)?;
        directions += found.directions;
        axpy(1.0, &found.x, &mut x);
        residual.clone_from(&start);
        axpy(-1.0, &applied(&x)?, &mut residual);
        let before = std::mem::replace(&mut left, length_of(&residual));
        // What is not a number comes no nearer.
        let nearer = left <= PROGRESS * before;
        if left <= ENOUGH * size && (found.left <= ACCURACY * size || !nearer) {
            return Ok(x);
        }
        if !nearer {
            return Err(LinearError::Unsymmetric {
                directions,
                residual: left / size,
            });
        }
    }
}

fn length_of(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// What one search has found.
struct Found {
    x: Vec<f64>,
    /// Length of the residual that is left.
    left: f64,
    directions: usize,
}

/// The vector whose product is nearest to `right`, among up to [`DIRECTIONS`] directions; ends
/// at a residual of `enough`.
fn search(
    applied: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, LinearError>,
    right: &[f64],
    enough: f64,
) -> Result<Found, LinearError> {
    let size = length_of(right);
    let mut basis: Vec<Vec<f64>> = vec![right.iter().map(|x| x / size).collect()];
    // Columns of the triangle, the rotations that made it, and the rotated right side.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut turns: Vec<(f64, f64)> = Vec::new();
    let mut reduced = vec![size];
    while let Some(direction) = basis.get(triangle.len()) {
        let mut next = applied(direction)?;
        let mut column = Vec::new();
        for known in &basis {
            let along = dot(known, &next);
            column.push(along);
            axpy(-along, known, &mut next);
        }
        let length = length_of(&next);
        for (k, (c, s)) in turns.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let last = column.len() - 1;
        let radius = column[last].hypot(length);
        if radius == 0.0 || radius.is_nan() {
            break;
        }
        let (c, s) = (column[last] / radius, length / radius);
        turns.push((c, s));
        column[last] = radius;
        triangle.push(column);
        let residual = reduced[last];
        reduced[last] = c * residual;
        reduced.push(-s * residual);
        if (s * residual).abs() <= enough || triangle.len() == DIRECTIONS {
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
        axpy(*weight, direction, &mut x);
    }
    Ok(Found {
        x,
        left: reduced[count].abs(),
        directions: count,
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Factorisation;

    /// A diagonal matrix, with products that change each unknown by a share of its neighbour.
    fn chain(count: usize, share: impl Fn(usize) -> f64) -> (Pattern, Vec<f64>, Unsymmetric) {
        let pattern = Pattern {
            column_starts: (0..=count as u32).collect(),
            rows: (0..count as u32).collect(),
        };
        let values = (0..count).map(|k| 1.0 + k as f64 / 10.0).collect();
        let mut rest = Unsymmetric::default();
        for k in 0..count {
            let next = (k + 1) % count;
            rest.push(vec![(k, share(k)), (next, 0.3)], vec![(next, 1.0)]);
        }
        (pattern, values, rest)
    }

    fn solved(
        (pattern, values, rest): &(Pattern, Vec<f64>, Unsymmetric),
    ) -> Result<f64, LinearError> {
        let count = values.len();
        let mut factor = Cholesky::analyse(pattern)?;
        factor.refactor(pattern, values)?;
        let right: Vec<f64> = (0..count).map(|k| (1.0 + 1.7 * k as f64).sin()).collect();
        let x = solve(&mut factor, (pattern, values, rest), &right)?;
        let mut off = pattern.multiply(values, &x);
        rest.add_product(&x, &mut off);
        axpy(-1.0, &right, &mut off);
        Ok(length_of(&off) / length_of(&right))
    }

    #[test]
    fn more_effects_than_directions_are_solved() {
        let problem = chain(400, |k| 0.95 * (1.0 + k as f64 / 10.0));
        let off = solved(&problem).unwrap();
        assert!(off < 1e-9, "{off:.1e}");
    }

    #[test]
    fn a_search_that_comes_no_nearer_is_an_error() {
        // A product takes the whole stiffness of one unknown, on which there is a force.
        let (pattern, values, _) = chain(400, |_| 1.0);
        let mut rest = Unsymmetric::default();
        rest.push(vec![(7, -values[7])], vec![(7, 1.0)]);
        let outcome = solved(&(pattern, values, rest));
        assert!(
            matches!(outcome, Err(LinearError::Unsymmetric { residual, .. }) if residual > 1e-3),
            "{outcome:?}"
        );
    }
}
