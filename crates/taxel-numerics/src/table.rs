//! Tables of one variable, with straight lines between their points.

/// Straight lines between the points of a table; its end values outside it.
#[inline]
pub fn interpolate(places: &[f64], values: &[f64], x: f64) -> f64 {
    let above = places.partition_point(|place| *place <= x);
    if above == 0 {
        return values[0];
    }
    if above == places.len() {
        return values[above - 1];
    }
    let share = (x - places[above - 1]) / (places[above] - places[above - 1]);
    values[above - 1] + share * (values[above] - values[above - 1])
}

/// Straight lines between the points of a table of at least two; beyond them
/// the first and last lines go on.
#[inline]
pub fn extrapolate(places: &[f64], values: &[f64], x: f64) -> f64 {
    let above = places.partition_point(|place| *place <= x);
    let right = above.clamp(1, places.len() - 1);
    let share = (x - places[right - 1]) / (places[right] - places[right - 1]);
    values[right - 1] + share * (values[right] - values[right - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_end_flat_or_go_on() {
        let (places, values) = ([1.0, 2.0, 4.0], [10.0, 20.0, 0.0]);
        for (x, flat, on) in [
            (0.0, 10.0, 0.0),
            (1.0, 10.0, 10.0),
            (1.5, 15.0, 15.0),
            (3.0, 10.0, 10.0),
            (4.0, 0.0, 0.0),
            (5.0, 0.0, -10.0),
        ] {
            assert_eq!(interpolate(&places, &values, x), flat);
            assert_eq!(extrapolate(&places, &values, x), on);
        }
    }
}
