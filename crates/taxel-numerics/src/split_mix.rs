//! Whole numbers well mixed, without a state.

/// The number `number`, from 0, of the generator SplitMix64 (Steele, Lea and Flood 2014) that
/// begins with `seed`: a hash of 64 bits of both. Not for secrets.
///
/// # Example
/// ```
/// use taxel_numerics::split_mix;
/// assert_eq!(split_mix(1234567, 0), 6457827717110365317);
/// assert_eq!(split_mix(1234567, 1), 3203168211198807973);
/// ```
pub fn split_mix(seed: u64, number: u64) -> u64 {
    let steps = number.wrapping_add(1);
    let mut z = seed.wrapping_add(steps.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
