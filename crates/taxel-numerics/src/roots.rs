//! Roots and turning points of functions of one variable.

/// The root of an increasing function in [`low`, `high`] by Newton's method,
/// kept in the bracket by bisection.
///
/// `function` gives value and slope. Stops after the step that is smaller than
/// 1e-8 of `x`: the error of a Newton step is of the order of its square.
pub fn newton(
    mut x: f64,
    [mut low, mut high]: [f64; 2],
    function: impl Fn(f64) -> (f64, f64),
) -> f64 {
    for _ in 0..200 {
        let (value, slope) = function(x);
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let step = x - value / slope;
        let next = if low <= step && step <= high {
            step
        } else {
            0.5 * (low + high)
        };
        let moved = (next - x).abs();
        x = next;
        if moved <= 1e-8 * x.abs() {
            break;
        }
    }
    x
}

/// The root of a continuous function that is not positive at `low` and not
/// negative at `high`, by the method of Ridders: to the last bits of `x`.
pub fn ridders([mut low, mut high]: [f64; 2], function: impl Fn(f64) -> f64) -> f64 {
    let (mut at_low, mut at_high) = (function(low), function(high));
    if at_low >= 0.0 {
        return low;
    }
    if at_high <= 0.0 {
        return high;
    }
    let mut before = f64::NAN;
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let at_middle = function(middle);
        // at_low < 0 < at_high, so the root of the sum is positive.
        let x =
            middle - (middle - low) * at_middle / (at_middle * at_middle - at_low * at_high).sqrt();
        let at_x = function(x);
        if at_x == 0.0 || (x - before).abs() <= 2.0 * f64::EPSILON * x.abs() {
            return x;
        }
        before = x;
        for (x, value) in [(middle, at_middle), (x, at_x)] {
            if value <= 0.0 && x > low {
                (low, at_low) = (x, value);
            } else if value > 0.0 && x < high {
                (high, at_high) = (x, value);
            }
        }
        if at_low == 0.0 {
            return low;
        }
    }
    before
}

/// Where a curve over [0, `end`] can be inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneToOne {
    /// The curve takes each of its values on [0, `end`] only there.
    pub end: f64,
    /// The first maximum, if the curve turns.
    pub first_maximum: Option<f64>,
    /// The lowest point behind that maximum.
    pub later_minimum: Option<f64>,
}

/// Points at which a curve is looked at for turning: features narrower than
/// 1/400 of the range would be missed.
const LOOKS: usize = 400;

/// The range from 0 over which `curve`, rising at first, can be inverted.
///
/// Up to the end if the curve never falls. Otherwise up to where it first
/// passes the value of its lowest point behind the first maximum: from there
/// on a value belongs to more than one `x`.
pub fn one_to_one(end: f64, curve: impl Fn(f64) -> f64) -> OneToOne {
    let place = |i: usize| end * i as f64 / LOOKS as f64;
    let values: Vec<f64> = (0..=LOOKS).map(|i| curve(place(i))).collect();
    let Some(top) = (0..LOOKS).find(|&i| values[i + 1] < values[i]) else {
        return OneToOne {
            end,
            first_maximum: None,
            later_minimum: None,
        };
    };
    let around = |i: usize| [place(i.saturating_sub(1)), place((i + 1).min(LOOKS))];
    let maximum = lowest(around(top), |x| -curve(x));
    let bottom = (top..=LOOKS)
        .min_by(|&a, &b| values[a].total_cmp(&values[b]))
        .unwrap_or(top);
    let minimum = lowest(around(bottom), &curve);
    let level = curve(minimum);
    OneToOne {
        end: ridders([0.0, maximum], |x| curve(x) - level),
        first_maximum: Some(maximum),
        later_minimum: Some(minimum),
    }
}

/// The lowest point between two places by the golden section.
fn lowest([mut low, mut high]: [f64; 2], curve: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (3.0 - 5.0_f64.sqrt());
    // A minimum is flat: its place is known to the root of the rounding only.
    while high - low > 1e-9 * high {
        let (left, right) = (low + share * (high - low), high - share * (high - low));
        if curve(left) < curve(right) {
            high = right;
        } else {
            low = left;
        }
    }
    // The end of the range may itself be the lowest point.
    if curve(high) < curve(low) { high } else { low }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found_from_any_bracket() {
        let newton = newton(1.9, [0.0, 2.0], |x: f64| (x.powi(3) - 2.0, 3.0 * x * x));
        // One unit in the last place.
        assert!((newton - 2.0_f64.cbrt()).abs() < 3e-16);
        for high in [1.3, 2.0, 1e3] {
            let root = ridders([0.0, high], |x| x.powi(3) - 2.0);
            assert!((root - 2.0_f64.cbrt()).abs() < 1e-15, "{root}");
        }
        assert_eq!(ridders([0.0, 1.0], |x| x), 0.0);
        // Newton's step from a flat place leaves the bracket.
        let steep = super::newton(5.0, [0.0, 10.0], |x: f64| {
            ((x - 1.0).atan(), 1.0 / (1.0 + (x - 1.0).powi(2)))
        });
        assert!((steep - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_curve_that_turns_is_inverted_below_its_later_minimum() {
        // x³/3 − 3x²/2 + 2x turns at 1 (5/6) and 2 (2/3); it first passes 2/3
        // at 1/2.
        let range = one_to_one(4.0, |x| x.powi(3) / 3.0 - 1.5 * x * x + 2.0 * x);
        // The value at the minimum is known to 1e-16, its place to 1e-8.
        assert!((range.end - 0.5).abs() < 1e-14, "{range:?}");
        assert!((range.first_maximum.unwrap() - 1.0).abs() < 1e-7);
        assert!((range.later_minimum.unwrap() - 2.0).abs() < 1e-7);
        assert_eq!(one_to_one(3.0, |x| x * x).end, 3.0);
        // Falls back to its start: nothing is left.
        assert!(one_to_one(2.0, |x| x * (2.0 - x)).end < 1e-8);
    }
}
