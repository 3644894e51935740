//! Gauss-Legendre quadrature.

/// Positive abscissas and weights of the 16-point rule on [-1, 1].
const GAUSS: [(f64, f64); 8] = [
    (0.09501250983763744, 0.1894506104550685),
    (0.2816035507792589, 0.1826034150449236),
    (0.4580167776572274, 0.16915651939500254),
    (0.6178762444026438, 0.14959598881657673),
    (0.755404408355003, 0.12462897125553387),
    (0.8656312023878318, 0.09515851168249279),
    (0.9445750230732326, 0.062253523938647894),
    (0.9894009349916499, 0.027152459411754095),
];

/// ∫ f(x) dx from `from` to `to` by 16 points: exact for polynomials up to
/// degree 31, so to rounding for anything smooth over the panel.
#[inline]
pub fn gauss_panel(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let pair =
        |&(node, weight): &(f64, f64)| weight * (f(middle - half * node) + f(middle + half * node));
    half * GAUSS.iter().map(pair).sum::<f64>()
}

/// The points and weights of [`gauss_panel`].
pub fn gauss_points(from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let pair = move |&(node, weight): &(f64, f64)| {
        [middle - half * node, middle + half * node].map(|x| (x, half * weight))
    };
    GAUSS.iter().flat_map(pair)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_31_are_exact() {
        for degree in 0..=31 {
            let exact = 1.0 / f64::from(degree + 1);
            // The abscissas are rounded to 16 digits.
            assert!((gauss_panel(0.0, 1.0, |x| x.powi(degree)) - exact).abs() < 1e-15);
            let sum: f64 = gauss_points(0.0, 1.0)
                .map(|(x, w)| w * x.powi(degree))
                .sum();
            assert!((sum - exact).abs() < 1e-15);
        }
        assert!((gauss_panel(0.0, 1.0, |x| x.powi(40)) - 1.0 / 41.0).abs() > 1e-15);
    }
}
