//! A linear system by products with its matrix alone.

use crate::dense::{add_scaled, dot};

/// Solution of A x = `right`, A given by its products, to a residual of the size `share` of `right`,
/// by van der Vorst's BiCGSTAB; `None` where `steps` are not enough or the directions end.
///
/// # Example: two equations
/// ```
/// let product = |x: &[f64]| vec![4.0 * x[0] + x[1], 2.0 * x[0] + 3.0 * x[1]];
/// let x = taxel_numerics::bicgstab(product, vec![1.0, 2.0], 1e-12, 10).unwrap();
/// assert!((x[0] - 0.1).abs() < 1e-12 && (x[1] - 0.6).abs() < 1e-12);
/// ```
pub fn bicgstab(
    product: impl Fn(&[f64]) -> Vec<f64>,
    right: Vec<f64>,
    share: f64,
    steps: usize,
) -> Option<Vec<f64>> {
    let mut x = vec![0.0; right.len()];
    let (first, mut direction, mut rest) = (right.clone(), right.clone(), right);
    let mut before = dot(&first, &rest);
    let enough = before * share.powi(2);
    for _ in 0..steps {
        let image = product(&direction);
        let alpha = before / dot(&first, &image);
        add_scaled(&mut x, alpha, &direction);
        add_scaled(&mut rest, -alpha, &image);
        if dot(&rest, &rest) <= enough {
            return Some(x);
        }
        let of_rest = product(&rest);
        let omega = dot(&of_rest, &rest) / dot(&of_rest, &of_rest);
        add_scaled(&mut x, omega, &rest);
        add_scaled(&mut rest, -omega, &of_rest);
        if dot(&rest, &rest) <= enough {
            return Some(x);
        }
        let now = dot(&first, &rest);
        let beta = now / before * alpha / omega;
        if !beta.is_finite() {
            return None;
        }
        before = now;
        add_scaled(&mut direction, -omega, &image);
        for (direction, rest) in direction.iter_mut().zip(&rest) {
            *direction = rest + beta * *direction;
        }
    }
    None
}
