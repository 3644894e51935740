//! The pressure of a frictionless rigid sphere on a bonded incompressible layer.
//!
//! Pressures c₁(1 − ρ²)^½ + c₂(1 − ρ²)^(3/2) + … under the sphere, ρ = r/a, whose motion of the
//! surface is δ − r²/2R in the mean against each of them: `docs/theory/piezoelectric-array.md`,
//! section 12.

use taxel_numerics::dense::{cholesky, cholesky_solve, dot};
use taxel_numerics::special::gauss_panel;

/// Terms of the pressure.
const TERMS: usize = 6;

/// The pressure under a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpherePressure {
    /// Radius of the contact a, m.
    radius: f64,
    /// Share of the force in each term.
    shares: [f64; TERMS],
}

/// K(c) = (sinh c cosh c − c)/(cosh²c + c²): motion of the free surface of the layer over that
/// of a half space, for a pressure of wave number c over the thickness.
fn compliance(c: f64) -> f64 {
    let e = (-2.0 * c).exp();
    (1.0 - e * e - 4.0 * c * e) / ((1.0 + e) * (1.0 + e) + 4.0 * c * c * e)
}

/// (2n + 1)!! jₙ(x)/xⁿ, one at zero: the transform of the term (1 − ρ²)^(n − ½) of unit force.
fn transform(n: usize, x: f64) -> f64 {
    let odd = |n: usize| (2 * n + 1) as f64;
    if x < n as f64 + 2.0 {
        // Series: the terms fall from the start on.
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..40_usize {
            term *= -0.5 * x * x / (k as f64 * odd(n + k));
            sum += term;
        }
        return sum;
    }
    // Upwards, which is stable for x above n.
    let (mut before, mut here) = (x.cos() / x, x.sin() / x);
    for m in 0..n {
        (before, here) = (here, odd(m) / x * here - before);
    }
    (1..=n).fold(here, |value, m| value * odd(m) / x)
}

/// Where the integrals over wave numbers times a end on a thick layer: the terms fall as the
/// cube.
const END: f64 = 300.0;
/// How much farther they go for each radius over thickness: the compliance is one from 5 on.
const END_BY_ASPECT: f64 = 30.0;
/// Length of a panel: the products of two terms turn over within 3.
const PANEL: f64 = 2.0;

impl SpherePressure {
    /// A sphere that touches a layer of `thickness`, m, over a disc of `radius`, m.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::SpherePressure;
    /// // On a thin layer the pressure goes as (1 - r²/a²)², on a thick one as its root.
    /// let [thin, thick] = [0.1e-3, 1.0].map(|thickness| {
    ///     SpherePressure::on_layer(3e-3, thickness).unwrap().peak_over_mean()
    /// });
    /// assert!((2.7..3.0).contains(&thin) && (thick - 1.5).abs() < 1e-3);
    /// ```
    ///
    /// `None` for lengths that are not above zero.
    pub fn on_layer(radius: f64, thickness: f64) -> Option<Self> {
        if !(radius > 0.0 && thickness > 0.0) {
            return None;
        }
        let depth = thickness / radius;
        let product = |m: usize, n: usize| -> f64 {
            let panels = ((END + END_BY_ASPECT / depth) / PANEL) as usize;
            let integrand = |k: f64| compliance(k * depth) * transform(m, k) * transform(n, k);
            (0..panels)
                .map(|i| gauss_panel(i as f64 * PANEL, (i + 1) as f64 * PANEL, integrand))
                .sum()
        };
        let terms = 1..=TERMS;
        let matrix: Vec<Vec<f64>> = terms
            .clone()
            .map(|m| terms.clone().map(|n| product(m, n)).collect())
            .collect();
        let factor = cholesky(matrix)?;
        // Unit force in each term: the mean of one is one, that of ρ² is 2/(2n + 3).
        let square = |n: usize| 2.0 / (2 * n + 3) as f64;
        let flat = cholesky_solve(&factor, &[1.0; TERMS]);
        let curved: Vec<f64> = terms.clone().map(square).collect();
        let curved = cholesky_solve(&factor, &curved);
        // The rim carries nothing: the motion is right against a flat punch too.
        let punch: Vec<f64> = terms.map(|n| product(0, n)).collect();
        let depth = (square(0) - dot(&punch, &curved)) / (1.0 - dot(&punch, &flat));
        let forces: [f64; TERMS] = std::array::from_fn(|n| depth * flat[n] - curved[n]);
        let total: f64 = forces.iter().sum();
        Some(Self {
            radius,
            shares: forces.map(|force| force / total),
        })
    }

    /// Radius of the contact, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Pressure on the axis over the mean pressure under the sphere.
    pub fn peak_over_mean(&self) -> f64 {
        // (2n + 1)/2 (1 − ρ²)^(n − ½) has unit force over 2 ∫ρ dρ.
        let terms = self.shares.iter().zip(1_usize..);
        terms.map(|(share, n)| share * (n as f64 + 0.5)).sum()
    }

    /// Transform of the pressure of unit force at a wave number, 1/m.
    pub(super) fn transform(&self, k: f64) -> f64 {
        let terms = self.shares.iter().zip(1..);
        terms
            .map(|(share, n)| share * transform(n, k * self.radius))
            .sum()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn series_and_recurrence_join() {
        for n in 0..=TERMS {
            let join = n as f64 + 2.0;
            let step = transform(n, join + 1e-9) - transform(n, join - 1e-9);
            // The slope is below one.
            assert!(step.abs() < 1e-8, "{n} {step}");
        }
    }

    #[test]
    fn compliance_is_that_of_a_half_space_for_short_waves() {
        assert!((compliance(30.0) - 1.0).abs() < 1e-12);
        // 2c³/3 for long ones.
        assert!((compliance(0.01) / (2e-6 / 3.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_sphere_on_a_thick_layer_is_hertz() {
        let sphere = SpherePressure::on_layer(1.0, 300.0).unwrap();
        // The layer adds a/h of the motion, even over the contact.
        assert!((sphere.shares[0] - 1.0).abs() < 1e-3, "{:?}", sphere.shares);
        assert!((sphere.peak_over_mean() - 1.5).abs() < 1e-3);
    }
}
