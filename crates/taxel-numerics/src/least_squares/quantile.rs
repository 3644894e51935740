//! Quantiles of Student's distribution.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::roots::ridders;
use crate::special::gauss_panel;

/// Half the two-sided 95 % interval of the normal law, in standard deviations.
pub const NORMAL_95: f64 = 1.959963984540054;

/// From here on the distribution is expanded about the normal one, to 1e-8.
const MANY: f64 = 40.0;

/// The place below which Student's distribution of `freedom` (1 or more, and not
/// only whole) degrees of freedom has the share `probability`, from 0.5 to below 1;
/// exact to 1e-8. An infinite `freedom` gives the normal distribution.
///
/// ```
/// let quantile = taxel_numerics::least_squares::student_quantile(0.975, 10.0);
/// assert!((quantile - 2.228138852).abs() < 1e-8);
/// ```
pub fn student_quantile(probability: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    if n < MANY {
        let misfit = |angle: f64| 0.5 + central(angle, n) - probability;
        let angle = ridders([0.0, FRAC_PI_2 * (1.0 - 1e-15)], misfit);
        return angle.tan() * n.sqrt();
    }
    // Cornish and Fisher.
    let z = normal_quantile(probability);
    let s = z * z;
    let first = z * (s + 1.0) / 4.0;
    let second = z * ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let third = z * (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    let fourth = z * ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0;
    z + (first + (second + (third + fourth / n) / n) / n) / n
}

/// Share between 0 and t = tan(angle)·√ν: ∫ cos^(ν − 1) over the angle, over twice that of a right one.
fn central(angle: f64, freedom: f64) -> f64 {
    let scale = libm::lgamma(f64::midpoint(freedom, 1.0)) - libm::lgamma(freedom / 2.0);
    let density = |angle: f64| angle.cos().powf(freedom - 1.0);
    // One panel of polynomials of degree 31 for each eighth of a right angle; near that a broken power is not
    // smooth, so the panels before it halve.
    let panels = |from: f64, to: f64| -> f64 {
        let count = ((to - from) / (FRAC_PI_2 / 8.0)).ceil().max(1.0);
        let at = |k: u32| from + (to - from) * f64::from(k) / count;
        (0..count as u32)
            .map(|k| gauss_panel(at(k), at(k + 1), density))
            .sum()
    };
    let (mut sum, mut from, mut to) = (0.0, 0.0, FRAC_PI_2 / 2.0);
    while to < angle {
        sum += panels(from, to);
        (from, to) = (to, f64::midpoint(to, FRAC_PI_2));
    }
    (sum + panels(from, angle)) * scale.exp() / PI.sqrt()
}

fn normal_quantile(probability: f64) -> f64 {
    let below = |x: f64| 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2) - probability;
    let slope = |x: f64| (-0.5 * x * x).exp() / (2.0 * PI).sqrt();
    // Newton from the left of a convex branch does not leave it.
    let mut x = 0.0;
    for _ in 0..50 {
        let step = below(x) / slope(x);
        x -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::student_quantile;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, expected) in [
            (1.0, 12.706204736),
            (2.0, 4.302652730),
            (3.0, 3.182446305),
            (4.0, 2.776445105),
            (5.0, 2.570581836),
            (10.0, 2.228138852),
            (30.0, 2.042272456),
            (39.0, 2.022690920),
            (40.0, 2.021075390),
            (120.0, 1.979930405),
            (f64::INFINITY, 1.959963985),
            // Of broken ones, by `scipy.stats.t.ppf`.
            (1.5, 6.016663104428),
            (7.3, 2.345066736548),
        ] {
            let found = student_quantile(0.975, freedom);
            assert!((found - expected).abs() < 2e-8, "{freedom}: {found}");
        }
        assert!((student_quantile(0.5, 7.0)).abs() < 1e-12);
    }
}
