//! Quantiles of Student's distribution.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::roots::ridders;

/// From here on the distribution is expanded about the normal one, to 1e-8.
const MANY: usize = 40;

/// The place below which Student's distribution of `freedom` (1 or more)
/// degrees of freedom has the share `probability`, from 0.5 to below 1; exact
/// to 1e-8. `usize::MAX` gives the normal distribution.
///
/// ```
/// let quantile = taxel_numerics::least_squares::student_quantile(0.975, 10);
/// assert!((quantile - 2.228138852).abs() < 1e-8);
/// ```
pub fn student_quantile(probability: f64, freedom: usize) -> f64 {
    if freedom < MANY {
        let misfit = |angle: f64| student(angle, freedom.max(1)) - probability;
        let angle = ridders([0.0, FRAC_PI_2 * (1.0 - 1e-15)], misfit);
        return angle.tan() * (freedom.max(1) as f64).sqrt();
    }
    // Cornish and Fisher.
    let (z, n) = (normal_quantile(probability), freedom as f64);
    let s = z * z;
    let first = z * (s + 1.0) / 4.0;
    let second = z * ((5.0 * s + 16.0) * s + 3.0) / 96.0;
    let third = z * (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0;
    let fourth = z * ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0;
    z + (first + (second + (third + fourth / n) / n) / n) / n
}

/// Share below t = tan(angle)·√ν: finite sums for whole ν.
fn student(angle: f64, freedom: usize) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let square = cosine * cosine;
    let odd = freedom % 2 == 1;
    let mut term = if odd { cosine } else { 1.0 };
    let mut sum = if freedom == 1 { 0.0 } else { term };
    let first = if odd { 3 } else { 2 };
    for k in (first..freedom - 1).step_by(2) {
        term *= square * (1.0 - 1.0 / k as f64);
        sum += term;
    }
    let both = if odd {
        (angle + sine * sum) / FRAC_PI_2
    } else {
        sine * sum
    };
    0.5 + 0.5 * both
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
            (1, 12.706204736),
            (2, 4.302652730),
            (3, 3.182446305),
            (4, 2.776445105),
            (5, 2.570581836),
            (10, 2.228138852),
            (30, 2.042272456),
            (39, 2.022690920),
            (40, 2.021075390),
            (120, 1.979930405),
            (usize::MAX, 1.959963985),
        ] {
            let found = student_quantile(0.975, freedom);
            assert!((found - expected).abs() < 2e-8, "{freedom}: {found}");
        }
        assert!((student_quantile(0.5, 7)).abs() < 1e-12);
    }
}
