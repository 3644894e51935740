//! Points that fill a cube evenly.

use crate::split_mix;

/// Degree, coefficients and first direction numbers of Joe and Kuo (2008), file
/// new-joe-kuo-6.21201, of the dimensions from the second on.
const JOE_KUO: [(u32, u64, &[u64]); 41] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, 7, &[1, 1, 3, 13, 7, 35, 63]),
    (7, 8, &[1, 3, 5, 9, 1, 25, 53]),
    (7, 14, &[1, 3, 1, 13, 9, 35, 107]),
    (7, 19, &[1, 3, 1, 5, 27, 61, 31]),
    (7, 21, &[1, 1, 5, 11, 19, 41, 61]),
    (7, 28, &[1, 3, 5, 3, 3, 13, 69]),
    (7, 31, &[1, 1, 7, 13, 1, 19, 1]),
    (7, 32, &[1, 3, 7, 5, 13, 19, 59]),
    (7, 37, &[1, 1, 3, 9, 25, 29, 41]),
    (7, 41, &[1, 3, 5, 13, 23, 1, 55]),
    (7, 42, &[1, 3, 7, 3, 13, 59, 17]),
    (7, 50, &[1, 3, 1, 3, 5, 53, 69]),
    (7, 55, &[1, 1, 5, 5, 23, 33, 13]),
    (7, 56, &[1, 1, 7, 7, 1, 61, 123]),
    (7, 59, &[1, 1, 7, 9, 13, 61, 49]),
    (7, 62, &[1, 3, 3, 5, 3, 55, 33]),
    (8, 14, &[1, 3, 1, 15, 31, 13, 49, 245]),
    (8, 21, &[1, 3, 5, 15, 31, 59, 63, 97]),
    (8, 22, &[1, 3, 1, 11, 11, 11, 77, 249]),
    (8, 38, &[1, 3, 1, 11, 27, 43, 71, 9]),
    (8, 47, &[1, 1, 7, 15, 21, 11, 81, 45]),
];

/// Dimensions of the Sobol sequence.
pub const SOBOL_DIMENSIONS: usize = JOE_KUO.len() + 1;

/// Bits of a coordinate.
const BITS: usize = 64;

fn directions(dimension: usize) -> [u64; BITS] {
    let mut v = [0u64; BITS];
    if dimension == 0 {
        for (bit, one) in v.iter_mut().enumerate() {
            *one = 1 << (BITS - 1 - bit);
        }
        return v;
    }
    let (degree, coefficients, first) = JOE_KUO[dimension - 1];
    let degree = degree as usize;
    for bit in 0..BITS {
        v[bit] = if bit < degree {
            first[bit] << (BITS - 1 - bit)
        } else {
            let mut value = v[bit - degree] ^ (v[bit - degree] >> degree);
            for k in 1..degree {
                if coefficients >> (degree - 1 - k) & 1 == 1 {
                    value ^= v[bit - k];
                }
            }
            value
        };
    }
    v
}

/// The first `points` points of the Sobol sequence with Joe and Kuo's direction numbers in
/// the order of the Gray code; with a `seed` scrambled as Owen does, each bit by a hash of
/// the bits before it. At most [`SOBOL_DIMENSIONS`] dimensions.
///
/// # Example
/// ```
/// let plan = taxel_numerics::sobol(2, 4, None);
/// assert_eq!(plan, [[0.0, 0.0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.75]]);
/// ```
pub fn sobol(dimensions: usize, points: usize, seed: Option<u64>) -> Vec<Vec<f64>> {
    let directions: Vec<[u64; BITS]> = (0..dimensions.min(SOBOL_DIMENSIONS))
        .map(directions)
        .collect();
    let mut state = vec![0u64; directions.len()];
    (0..points)
        .map(|index| {
            if index > 0 {
                let bit = index.trailing_zeros() as usize;
                for (one, v) in state.iter_mut().zip(&directions) {
                    *one ^= v[bit];
                }
            }
            let share = |(dimension, bits): (usize, &u64)| {
                let bits = match seed {
                    None => *bits,
                    Some(seed) => scrambled(*bits, mix(seed ^ mix(dimension as u64 + 1))),
                };
                (bits >> 11) as f64 / (1u64 << 53) as f64
            };
            state.iter().enumerate().map(share).collect()
        })
        .collect()
}

/// Owen's nested scrambling of the first 32 bits, the others by one hash: each bit is turned
/// by a hash of all bits before it.
fn scrambled(bits: u64, seed: u64) -> u64 {
    let mut result = 0u64;
    for bit in 0..32 {
        let shift = BITS - 1 - bit;
        let before = if bit == 0 { 0 } else { bits >> (shift + 1) };
        let turn = mix(seed ^ mix(before ^ ((bit as u64) << 58))) & 1;
        result |= ((bits >> shift & 1) ^ turn) << shift;
    }
    let rest = mix(seed ^ mix(bits >> 32)) >> 32;
    result | (rest ^ (bits & 0xffff_ffff))
}

/// A hash of 64 bits.
fn mix(value: u64) -> u64 {
    split_mix(value, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dimension_of_sobol_is_a_net() {
        // 2^k points of each dimension fall one by one into 2^k equal parts.
        for seed in [None, Some(3)] {
            let plan = sobol(SOBOL_DIMENSIONS, 256, seed);
            for dimension in 0..SOBOL_DIMENSIONS {
                let mut parts: Vec<usize> = plan
                    .iter()
                    .map(|row| (row[dimension] * 256.0) as usize)
                    .collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..256).collect::<Vec<_>>(), "{dimension} {seed:?}");
            }
        }
    }

    #[test]
    fn pairs_of_the_first_dimensions_are_nets_in_two_dimensions() {
        // Elementary intervals of 16 x 16 hold one point of 256 each: dimensions 1 and 2.
        let plan = sobol(2, 256, Some(7));
        let mut cells: Vec<usize> = plan
            .iter()
            .map(|row| (row[0] * 16.0) as usize * 16 + (row[1] * 16.0) as usize)
            .collect();
        cells.sort_unstable();
        assert_eq!(cells, (0..256).collect::<Vec<_>>());
    }
}
