//! How well a number is known.

use taxel_numerics::least_squares::student_quantile;

/// The 97.5 % point of Student's distribution of so many degrees of freedom.
pub(crate) fn student(freedom: f64) -> f64 {
    student_quantile(0.975, freedom)
}

/// Both ends of the profile of the shear modulus: where `misfit`, what is left after all other
/// constants were fitted again, reaches `most`.
pub(crate) fn of_shear_modulus(misfit: impl Fn(f64) -> f64, shear: f64, most: f64) -> [f64; 2] {
    [-1.0, 1.0].map(|side| {
        // A misfit without any rounding left has an interval without width.
        if most <= f64::EPSILON * f64::EPSILON {
            return shear;
        }
        let (mut inside, mut step) = (shear, 1e-3 * shear);
        let mut outside = loop {
            let tried = (shear + side * step).max(0.0);
            if tried == 0.0 || misfit(tried) > most {
                break tried;
            }
            inside = tried;
            step *= 2.0;
            if step > 1e3 * shear {
                break f64::INFINITY;
            }
        };
        if outside == 0.0 && misfit(0.0) <= most || outside.is_infinite() {
            return outside;
        }
        while (outside - inside).abs() > 1e-4 * (outside - shear).abs() {
            let middle = f64::midpoint(inside, outside);
            // Of exact data the interval is as narrow as a number.
            if middle == inside || middle == outside {
                break;
            }
            if misfit(middle) > most {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        f64::midpoint(inside, outside)
    })
}

/// What several specimens say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecimenInterval {
    /// Mean.
    pub mean: f64,
    /// 95 % of the mean.
    pub of_mean: [f64; 2],
    /// 95 % of the next specimen.
    pub of_next: [f64; 2],
}

/// Mean of the specimens and of the next one; none for fewer than three.
///
/// ```
/// let found = taxel_material::specimens(&[93.909, 101.136, 105.058]).unwrap();
/// assert!((found.of_mean[0] - 86.0).abs() < 0.05 && (found.of_next[1] - 128.1).abs() < 0.1);
/// ```
pub fn specimens(values: &[f64]) -> Option<SpecimenInterval> {
    let count = values.len() as f64;
    if values.len() < 3 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let wide = student(count - 1.0) * (square / (count - 1.0)).sqrt();
    let about = |half: f64| [mean - half, mean + half];
    Some(SpecimenInterval {
        mean,
        of_mean: about(wide / count.sqrt()),
        of_next: about(wide * (1.0 + 1.0 / count).sqrt()),
    })
}
