//! The complete elliptic integrals of the first, second and third kind.

use std::f64::consts::FRAC_PI_2;

/// Complete elliptic integral of the first kind for the **complementary**
/// modulus k′ = √(1 − k²).
///
/// K(k) = ∫₀^{π/2} dθ/√(1 − k² sin²θ) = π / (2·agm(1, k′))   (Gauss)
///
/// k′ is the argument because it keeps its digits where k is close to 1, and
/// K grows there as ln(4/k′). Range 0 < k′ ≤ 1; at k′ = 0 the integral is
/// infinite, and for other arguments the result is NaN.
///
/// ```
/// use taxel_numerics::special::complete_elliptic_k;
/// assert_eq!(complete_elliptic_k(1.0), std::f64::consts::FRAC_PI_2);
/// let far = complete_elliptic_k(1e-200);
/// assert!((far - (4.0 / 1e-200_f64).ln()).abs() < 1e-12 * far);
/// ```
pub fn complete_elliptic_k(complementary_modulus: f64) -> f64 {
    if !(0.0..=1.0).contains(&complementary_modulus) {
        return f64::NAN;
    }
    if complementary_modulus == 0.0 {
        return f64::INFINITY;
    }
    FRAC_PI_2 / arithmetic_geometric_mean(1.0, complementary_modulus)
}

/// Complete elliptic integral of the second kind for the **complementary** modulus
/// k′ = √(1 − k²), 0 ≤ k′ ≤ 1; for other arguments the result is NaN.
///
/// E(k) = ∫₀^{π/2} √(1 − k² sin²θ) dθ = K(k) (1 − Σ 2ⁿ⁻¹ cₙ²), c₀ = k, cₙ the half differences of
/// the means that lead to K (Gauss)
///
/// ```
/// use taxel_numerics::special::complete_elliptic_e;
/// assert_eq!(complete_elliptic_e(1.0), std::f64::consts::FRAC_PI_2);
/// assert_eq!(complete_elliptic_e(0.0), 1.0);
/// ```
pub fn complete_elliptic_e(complementary_modulus: f64) -> f64 {
    if complementary_modulus == 0.0 {
        return 1.0;
    }
    let (mut a, mut b) = (1.0, complementary_modulus);
    let mut rest = 1.0 - 0.5 * (1.0 - b) * (1.0 + b);
    let mut factor = 1.0;
    // The terms are squared in each step: below 1e-8 of a, the next one is below the rounding.
    while a - b > 1e-8 * a {
        let half = 0.5 * (a - b);
        rest -= factor * half * half;
        factor *= 2.0;
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    complete_elliptic_k(complementary_modulus) * rest
}

/// K(k) for the **complementary** modulus k′, 0 < k′ ≤ 1, and (K(k)(1 − m/2) − E(k))/(m² K(k)) with
/// m = k² = 1 − k′²: what is left of E where both integrals are nearly the same, without the
/// cancellation of their difference. It is Σ 2ⁿ⁻¹ (cₙ/m)² over n ≥ 1 with the cₙ of
/// [`complete_elliptic_e`], 1/16 at k = 0. For other arguments both are NaN.
///
/// ```
/// use taxel_numerics::special::complete_elliptic_remainder;
/// assert_eq!(complete_elliptic_remainder(1.0), [std::f64::consts::FRAC_PI_2, 1.0 / 16.0]);
/// ```
pub fn complete_elliptic_remainder(complementary_modulus: f64) -> [f64; 2] {
    let k = complete_elliptic_k(complementary_modulus);
    if !k.is_finite() {
        return [f64::NAN; 2];
    }
    let (mut a, mut b) = (1.0, complementary_modulus);
    let m = (1.0 - b) * (1.0 + b);
    // c₁/m, and then cₙ₊₁ = cₙ²/(4 aₙ₊₁).
    let (mut c, mut factor, mut sum) = (0.5 / (1.0 + b), 1.0, 0.0);
    loop {
        sum += factor * c * c;
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        let next = m * c * c / (2.0 * (a + b));
        // The terms are squared in each step.
        if next * m <= 1e-16 * a {
            return [k, sum];
        }
        factor *= 2.0;
        c = next;
    }
}

/// Bulirsch's general complete elliptic integral for the complementary modulus `kc` above zero and
/// `p` above zero; for other arguments the result is NaN.
///
/// cel(kc, p, c, s) = ∫₀^{π/2} (c cos²φ + s sin²φ) / ((cos²φ + p sin²φ) √(cos²φ + kc² sin²φ)) dφ
///
/// (Bulirsch 1965, by Bartky's transformation.)
///
/// ```
/// use taxel_numerics::special::{cel, complete_elliptic_k};
/// assert!((cel(0.3, 1.0, 1.0, 1.0) - complete_elliptic_k(0.3)).abs() < 1e-15);
/// ```
pub fn cel(kc: f64, p: f64, c: f64, s: f64) -> f64 {
    if !(kc > 0.0 && p > 0.0 && kc.is_finite() && p.is_finite()) {
        return f64::NAN;
    }
    let mut p = p.sqrt();
    let (mut c, mut s) = (c, s / p);
    let (mut mean, mut k, mut product) = (1.0, kc, kc);
    loop {
        let shift = product / p;
        (c, s) = (c + s / p, 2.0 * (s + c * shift));
        p += shift;
        let before = mean;
        mean += k;
        // The difference is squared in each step.
        if (before - k).abs() <= 1e-8 * before {
            return FRAC_PI_2 * (s + c * mean) / (mean * (mean + p));
        }
        k = 2.0 * product.sqrt();
        product = k * mean;
    }
}

/// Common limit of the means of `a` ≥ `b` > 0.
fn arithmetic_geometric_mean(mut a: f64, mut b: f64) -> f64 {
    // The difference is squared in each step: below 1e-8 of a, the next mean
    // is exact to rounding.
    while a - b > 1e-8 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_forty_digits() {
        // K(k) by mpmath 1.3 with 40 digits, as printed with 20.
        for (k, expected) in [
            (0.0, FRAC_PI_2),
            (0.1, 1.574_745_561_517_356),
            (0.5, 1.685_750_354_812_596),
            (0.9, 2.280_549_138_422_770_2),
            (0.99, 3.356_600_523_361_192_4),
        ] {
            let found = complete_elliptic_k(f64::sqrt((1.0 - k) * (1.0 + k)));
            // k′ is rounded, and K(0.99) passes that on undiminished.
            assert!((found / expected - 1.0).abs() < 1e-15, "{k}: {found}");
        }
    }

    #[test]
    fn agrees_with_quadrature() {
        // Second method: the trapezoidal rule on a periodic analytic integrand
        // converges exponentially; 200 points are exact to rounding for k′ ≥ 0.2.
        for complement in [0.2, 0.5, 0.8] {
            let sum: f64 = (0..200)
                .map(|i| std::f64::consts::PI * f64::from(i) / 200.0)
                .map(|angle| (angle.cos().powi(2) + (complement * angle.sin()).powi(2)).sqrt())
                .map(f64::recip)
                .sum();
            let quadrature = sum / 200.0 * FRAC_PI_2;
            assert!((complete_elliptic_k(complement) / quadrature - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn legendre_relation_holds() {
        // E K' + E' K - K K' = π/2; near k' = 0 the terms that cancel are ln(4/k') = 10 at most.
        for complement in [1e-4, 0.1, 0.4, 0.8, 0.999] {
            let other = f64::sqrt((1.0 - complement) * (1.0 + complement));
            let [k, k_other] = [complement, other].map(complete_elliptic_k);
            let [e, e_other] = [complement, other].map(complete_elliptic_e);
            let found = e * k_other + e_other * k - k * k_other;
            assert!((found - FRAC_PI_2).abs() < 1e-14, "{complement}: {found}");
        }
    }

    #[test]
    fn the_remainder_is_that_of_the_integrals_and_has_all_digits_at_small_moduli() {
        for complement in [1e-3, 0.1, 0.5, 0.9] {
            let [k, e] = [
                complete_elliptic_k(complement),
                complete_elliptic_e(complement),
            ];
            let m = 1.0 - complement * complement;
            let [found_k, found] = complete_elliptic_remainder(complement);
            assert_eq!(found_k, k);
            // The difference loses what m²/16 is below 1.
            let expected = (k * (1.0 - 0.5 * m) - e) / (m * m * k);
            assert!(
                (found / expected - 1.0).abs() < 1e-14 / (m * m),
                "{complement}"
            );
        }
        // 1/16 + m/32 + 41 m²/2048 + …, from the series of K and E; m = 2e-6 leaves 1e-17 of the cube.
        let complement = 1.0 - 1e-6;
        let m = 1.0 - complement * complement;
        let series = 1.0 / 16.0 + m / 32.0 + 41.0 * m * m / 2048.0;
        let [_, found] = complete_elliptic_remainder(complement);
        assert!((found / series - 1.0).abs() < 1e-14, "{found} {series}");
        assert!(complete_elliptic_remainder(0.0)[0].is_nan());
    }

    #[test]
    fn the_general_integral_agrees_with_quadrature() {
        // The trapezoidal rule, as above.
        for (kc, p, c, s) in [
            (0.3, 0.2, 1.0, -0.4),
            (0.8, 1.0, 1.0, -1.0),
            (1.0, 3.0, 0.5, 2.0),
            (0.25, 0.16, 1.0, 0.4),
        ] {
            let points = 400;
            let sum: f64 = (0..points)
                .map(|i| std::f64::consts::PI * f64::from(i) / f64::from(points))
                .map(|angle| (angle.cos().powi(2), angle.sin().powi(2)))
                .map(|(x, y)| (c * x + s * y) / ((x + p * y) * f64::sqrt(x + kc * kc * y)))
                .sum();
            let quadrature = sum / f64::from(points) * FRAC_PI_2;
            let found = cel(kc, p, c, s);
            assert!(
                (found - quadrature).abs() < 1e-13,
                "{kc} {p}: {found} {quadrature}"
            );
        }
        assert!(cel(0.0, 1.0, 1.0, 1.0).is_nan());
        assert!(cel(0.5, 0.0, 1.0, 1.0).is_nan());
    }

    #[test]
    fn outside_its_range_there_is_no_number() {
        assert!(complete_elliptic_k(0.0).is_infinite());
        for complement in [-0.1, 1.1, f64::NAN] {
            assert!(complete_elliptic_k(complement).is_nan());
            assert!(complete_elliptic_e(complement).is_nan());
        }
    }
}
