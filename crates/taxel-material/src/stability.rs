//! Where a law is stable, and whether it says something sane in a mode that nobody tested.

use std::fmt;

use crate::law::{Law, Mode};

/// The stretch from which on a law is not stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Loading.
    pub mode: Mode,
    /// Stretch of the first axis.
    pub stretch: f64,
    /// Criterion that does not hold any more.
    pub criterion: &'static str,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            mode,
            stretch,
            criterion,
        } = self;
        let mode = mode.name();
        write!(
            f,
            "{criterion} is lost at a stretch of {stretch:.3}, {mode}"
        )
    }
}

const DRUCKER: &str = "Drucker's stability";
const ELLIPTICITY: &str = "strong ellipticity";

/// Steps of the logarithmic stretch in which a loss is looked for: a loss within less than
/// half a per cent may be missed.
const STEP: f64 = 0.005;

/// The loss nearest to the undeformed state: uniaxial from `smallest` (at most 1) to `largest`
/// (at least 1), equibiaxial and planar from 1 to `largest`. Compression to 0.5 is
/// equibiaxial tension to 1.41.
pub fn first_loss(law: &Law, smallest: f64, largest: f64) -> Option<Loss> {
    let ways = [
        (Mode::Uniaxial, largest),
        (Mode::Uniaxial, smallest),
        (Mode::Equibiaxial, largest),
        (Mode::Planar, largest),
    ];
    let losses = ways
        .into_iter()
        .filter_map(|(mode, end)| along(law, mode, end));
    losses.min_by(|one, other| one.stretch.ln().abs().total_cmp(&other.stretch.ln().abs()))
}

fn along(law: &Law, mode: Mode, end: f64) -> Option<Loss> {
    let lost = |logarithm: f64| lost(law, mode.stretches(logarithm.exp()));
    let steps = (end.ln().abs() / STEP).ceil().max(1.0);
    let step = end.ln() / steps;
    let bad = (0..=steps as u32).find(|n| lost(f64::from(*n) * step).is_some())?;
    let mut bad = f64::from(bad) * step;
    let mut good = bad - if bad == 0.0 { 0.0 } else { step };
    // Halving to the last bits of the stretch.
    for _ in 0..50 {
        let middle = f64::midpoint(good, bad);
        if lost(middle).is_some() {
            bad = middle;
        } else {
            good = middle;
        }
    }
    Some(Loss {
        mode,
        stretch: bad.exp(),
        criterion: lost(bad)?,
    })
}

fn lost(law: &Law, l: [f64; 3]) -> Option<&'static str> {
    let slopes = law.slopes(l);
    let h = |i: usize, j: usize| {
        let own = if i == j {
            l[i] * slopes.first[i] + l[i] * l[i] * slopes.own[i]
        } else {
            0.0
        };
        own + 4.0 * slopes.curvature * (l[i] * l[j]).powi(2)
    };
    // In the orthonormal basis (1, -1, 0) / sqrt 2, (1, 1, -2) / sqrt 6.
    let a = f64::midpoint(h(0, 0), h(1, 1)) - h(0, 1);
    let b = (h(0, 0) + 2.0 * h(0, 1) + h(1, 1) - 4.0 * (h(0, 2) + h(1, 2) - h(2, 2))) / 6.0;
    let c = (h(0, 0) - h(1, 1) - 2.0 * (h(0, 2) - h(1, 2))) / 12.0_f64.sqrt();
    let least = f64::midpoint(a, b) - ((a - b) / 2.0).hypot(c);
    // Not a number is no stability.
    if !matches!(least.partial_cmp(&0.0), Some(std::cmp::Ordering::Greater)) {
        return Some(DRUCKER);
    }
    let elliptic = [(0, 1), (1, 2), (0, 2)].into_iter().all(|(i, j)| {
        let tau = |n: usize| l[n] * slopes.first[n];
        let w = |i: usize, j: usize| {
            let own = if i == j { slopes.own[i] } else { 0.0 };
            own + 4.0 * slopes.curvature * l[i] * l[j]
        };
        let (p, q) = (l[i] * l[i], l[j] * l[j]);
        // Where two stretches are equal, their quotient of differences is a derivative, and
        // Drucker's criterion has it already.
        if (p - q).abs() < 1e-6 * (p + q) {
            return true;
        }
        let al = (tau(i) - tau(j)) * p / (p - q);
        let ga = al * q / p;
        let cross = l[i] * l[j] * (l[i] * slopes.first[j] - l[j] * slopes.first[i]);
        let twice = p * w(i, i) - 2.0 * l[i] * l[j] * w(i, j) + q * w(j, j) + 2.0 * cross / (p - q);
        al > 0.0 && twice / 2.0 > -(al * ga).sqrt()
    });
    (!elliptic).then_some(ELLIPTICITY)
}

/// Ratios of [`equibiaxial_ratio`] that rubber has; they rest on natural rubber.
pub const SANE: std::ops::RangeInclusive<f64> = 0.8..=1.6;

/// Stress in equibiaxial over uniaxial tension at a stretch of 1.4, over that of a
/// neo-Hookean solid.
pub fn equibiaxial_ratio(law: &Law) -> f64 {
    let ratio = |law: &Law| {
        law.nominal_stress(Mode::Equibiaxial, 1.4) / law.nominal_stress(Mode::Uniaxial, 1.4)
    };
    ratio(law) / ratio(&Law::NeoHookean { shear: 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stable_pull_hides_an_unstable_or_absurd_law() {
        // A Yeoh law of Dragon Skin 30: stable in its range, lost beyond.
        let yeoh = Law::parse("yeoh 92.285 11.477 -0.861 kPa").expect("a law");
        assert_eq!(first_loss(&yeoh, 0.5, 2.0), None);
        let loss = first_loss(&yeoh, 0.5, 3.0).expect("a loss");
        assert_eq!((loss.mode, loss.criterion), (Mode::Equibiaxial, DRUCKER));
        // The reference looked on a grid of stretches, and the constants are rounded.
        assert!((loss.stretch - 2.231).abs() < 2e-3, "{loss}");
        // One Ogden term of Treloar's pull: stable, and absurd.
        let ogden = Law::parse("ogden -0.1659 -5.178 MPa").expect("a law");
        assert_eq!(first_loss(&ogden, 0.5, 7.6), None);
        // Printed to one decimal.
        assert!((equibiaxial_ratio(&ogden) - 10.7).abs() < 0.05);
    }

    #[test]
    fn a_negative_c01_is_lost_in_each_mode() {
        // The raw pull of Ecoflex 00-30; the reference looked on a grid of stretches.
        let law = Law::parse("mooney_rivlin 11.55728 -5.775444 kPa").expect("a law");
        let at = |mode, end| along(&law, mode, end).expect("a loss").stretch;
        for (mode, end, known) in [
            (Mode::Uniaxial, 2.0, 1.421),
            (Mode::Equibiaxial, 2.0, 1.198),
            (Mode::Planar, 2.0, 1.359),
            (Mode::Uniaxial, 0.5, 0.697),
        ] {
            assert!(
                (at(mode, end) - known).abs() < 8e-3,
                "{mode:?} {}",
                at(mode, end)
            );
        }
    }
}
