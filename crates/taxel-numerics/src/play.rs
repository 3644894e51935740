//! The play operator: memory that follows its input at a distance.

/// State of a play of half-width `half_width` after the input `input`: the state
/// before, moved no farther than needed to stay within the half-width.
///
/// # Example
/// ```
/// use taxel_numerics::play::play;
///
/// let up = play(0.0, 5.0, 1.0);
/// assert_eq!(up, 4.0);
/// assert_eq!(play(up, 3.5, 1.0), 4.0); // within the play: nothing moves
/// ```
#[inline]
pub fn play(state: f64, input: f64, half_width: f64) -> f64 {
    state.max(input - half_width).min(input + half_width)
}
