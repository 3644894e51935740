//! Quadratics through a few made devices, which answer for all others where one takes long.

use taxel_numerics::dense::dot;
use taxel_numerics::least_squares::linear;

/// Parts into which the devices are divided: each is predicted from the others once.
const PARTS: usize = 5;

/// A quadratic in several variables.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Quadratic {
    coefficients: Vec<f64>,
    /// Greatest difference from a device that was left out when it was fitted.
    pub(crate) error: f64,
}

/// Numbers of a quadratic in `variables`.
pub(crate) fn terms(variables: usize) -> usize {
    (variables + 1) * (variables + 2) / 2
}

/// 1, the variables and their products.
fn basis(at: &[f64]) -> Vec<f64> {
    let squares = (0..at.len()).flat_map(|i| (i..at.len()).map(move |j| at[i] * at[j]));
    [1.0]
        .into_iter()
        .chain(at.iter().copied())
        .chain(squares)
        .collect()
}

impl Quadratic {
    /// The least squares through `values` at places within about one of the middle; none where these
    /// do not say what it is.
    pub(crate) fn through(places: &[Vec<f64>], values: &[f64]) -> Option<Self> {
        let rows: Vec<Vec<f64>> = places.iter().map(|place| basis(place)).collect();
        let mut error: f64 = 0.0;
        for part in 0..PARTS {
            let each = rows.iter().zip(values).enumerate();
            let (out, kept): (Vec<_>, Vec<_>) = each.partition(|(index, _)| index % PARTS == part);
            let (kept, of_kept): (Vec<_>, Vec<f64>) = kept
                .into_iter()
                .map(|(_, (row, value))| (row.clone(), *value))
                .unzip();
            let coefficients = linear::solve(&kept, &of_kept)?.coefficients;
            for (_, (row, value)) in out {
                error = error.max((dot(&coefficients, row) - value).abs());
            }
        }
        Some(Self {
            coefficients: linear::solve(&rows, values)?.coefficients,
            error,
        })
    }

    pub(crate) fn at(&self, place: &[f64]) -> f64 {
        dot(&self.coefficients, &basis(place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plans::sobol;

    fn places(count: usize) -> Vec<Vec<f64>> {
        let shares = sobol(2, count, Some(1));
        let middle = |shares: Vec<f64>| shares.iter().map(|share| 2.0 * share - 1.0).collect();
        shares.into_iter().map(middle).collect()
    }

    #[test]
    fn a_quadratic_is_found_exactly_and_a_cubic_with_its_error() {
        let places = places(30);
        let fit = |of: fn(f64, f64) -> f64| {
            let values: Vec<f64> = places.iter().map(|place| of(place[0], place[1])).collect();
            Quadratic::through(&places, &values).unwrap_or_else(|| panic!("{values:?}"))
        };
        let exact = fit(|x, y| 3.0 - x + 2.0 * y + 0.5 * x * x - x * y);
        // Six numbers by orthogonal transformations of a matrix whose condition is below 30.
        assert!(exact.error < 1e-12, "{exact:?}");
        assert!((exact.at(&[0.3, -0.7]) - (3.0 - 0.3 - 1.4 + 0.045 + 0.21)).abs() < 1e-12);
        let cubic = fit(|x, _| x * x * x);
        // The best straight line differs from x^3 by a quarter at most between the ends; left-out ends by more.
        let worst = (-10..=10)
            .map(|step| f64::from(step) / 10.0)
            .map(|x| (cubic.at(&[x, 0.0]) - x * x * x).abs())
            .fold(0.0, f64::max);
        assert!(
            worst <= cubic.error && cubic.error < 1.0,
            "{worst} {cubic:?}"
        );
    }

    #[test]
    fn too_few_places_say_nothing() {
        let places = places(terms(2) - 1);
        assert_eq!(Quadratic::through(&places, &[1.0; 5]), None);
    }
}
