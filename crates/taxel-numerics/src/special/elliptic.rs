//! The complete elliptic integrals of the first and second kind.

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
    fn outside_its_range_there_is_no_number() {
        assert!(complete_elliptic_k(0.0).is_infinite());
        for complement in [-0.1, 1.1, f64::NAN] {
            assert!(complete_elliptic_k(complement).is_nan());
            assert!(complete_elliptic_e(complement).is_nan());
        }
    }
}
