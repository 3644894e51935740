//! Points that fill a cube evenly.

use crate::split_mix;

/// Primitive polynomials and first direction numbers of the dimensions after the first (Joe and Kuo
/// 2008): degree, inner coefficients, m.
const DIRECTIONS: [(u32, u32, [u32; 3]); 3] =
    [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

/// Point `number` of Sobol's sequence in one to four dimensions, in the open unit cube, moved by a
/// digital shift of `seed` (Sobol 1967; Owen 1998 for shifts): any first 2ⁿ of them lie evenly.
///
/// # Panics
/// With none or more than four dimensions.
///
/// # Example
/// ```
/// // One of the first two points lies in each half of each axis.
/// let [a, b] = [0, 1].map(|number| taxel_numerics::sobol(2, number, 1));
/// assert!((a[0] < 0.5) != (b[0] < 0.5) && (a[1] < 0.5) != (b[1] < 0.5));
/// ```
pub fn sobol(dimensions: usize, number: u32, seed: u64) -> Vec<f64> {
    assert!(
        (1..=4).contains(&dimensions),
        "Sobol's sequence of {dimensions} dimensions"
    );
    let of = |dimension: usize| {
        let shift = (split_mix(seed, dimension as u64) >> 32) as u32;
        let bits = (0..32)
            .filter(|bit| number >> bit & 1 == 1)
            .fold(0, |sum, bit| sum ^ direction(dimension, bit));
        // In the middle of its cell: never at an end.
        (f64::from(bits ^ shift) + 0.5) / 2.0_f64.powi(32)
    };
    (0..dimensions).map(of).collect()
}

/// Direction number of a bit, as 32 binary places.
fn direction(dimension: usize, bit: u32) -> u32 {
    let Some((degree, inner, first)) = dimension.checked_sub(1).map(|at| DIRECTIONS[at]) else {
        return 1 << (31 - bit);
    };
    if bit < degree {
        return first[bit as usize] << (31 - bit);
    }
    let earlier = direction(dimension, bit - degree);
    (1..degree)
        .filter(|k| inner >> (degree - 1 - k) & 1 == 1)
        .fold(earlier ^ earlier >> degree, |sum, k| {
            sum ^ direction(dimension, bit - k)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pair_of_dimensions_has_one_point_in_each_box() {
        for seed in 0..5 {
            let points: Vec<_> = (0..64).map(|number| sobol(4, number, seed)).collect();
            for dimension in 0..4 {
                let mut cells: Vec<u32> = points
                    .iter()
                    .map(|x| (64.0 * x[dimension]) as u32)
                    .collect();
                cells.sort_unstable();
                assert_eq!(cells, (0..64).collect::<Vec<_>>(), "{dimension}");
            }
            // The first two dimensions are a (0, 2)-sequence: one point in each of 8 x 8 squares.
            let mut squares: Vec<u32> = points
                .iter()
                .map(|x| 8 * (8.0 * x[0]) as u32 + (8.0 * x[1]) as u32)
                .collect();
            squares.sort_unstable();
            assert_eq!(squares, (0..64).collect::<Vec<_>>());
        }
    }
}
