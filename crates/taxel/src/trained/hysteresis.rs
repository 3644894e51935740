//! The play operator of rate-independent hysteresis.
//!
//! P_r\[x\]: z ← max(x − r, min(x + r, z)) (M. A. Krasnosel'skii and
//! A. V. Pokrovskii, *Systems with Hysteresis*, 1989).
//! Only the order of the samples counts, so uneven steps need no care. After
//! an outage the state is unknown; two plays started at the ends of what is
//! possible bound it, because the operator keeps the order of its states.

use taxel_numerics::play::play;

/// A play of half-width `threshold` with the range its state may be in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Play {
    threshold: f64,
    state: Option<[f64; 2]>,
}

impl Play {
    /// A play at rest at `state`; `threshold` in the unit of the input, not
    /// negative.
    pub fn at(threshold: f64, state: f64) -> Self {
        Self {
            threshold,
            state: Some([state; 2]),
        }
    }

    /// Takes one sample and returns the state: the middle of what is possible.
    pub fn push(&mut self, input: f64) -> f64 {
        let (low, high) = (input - self.threshold, input + self.threshold);
        let state = match self.state {
            Some(state) => state.map(|state| play(state, input, self.threshold)),
            None => [low, high],
        };
        self.state = Some(state);
        0.5 * (state[0] + state[1])
    }

    /// Half the range that the state may be in; infinite before the first
    /// sample, zero once the play was driven through twice its threshold.
    pub fn half_range(&self) -> f64 {
        self.state
            .map_or(f64::INFINITY, |[low, high]| 0.5 * (high - low))
    }

    /// Forgets the state.
    pub fn forget(&mut self) {
        self.state = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Straight pieces between the turning points, `steps` samples each.
    fn path(turns: &[f64], steps: usize) -> Vec<f64> {
        let piece = |pair: &[f64]| {
            let (from, to) = (pair[0], pair[1]);
            (1..=steps)
                .map(move |i| from + (to - from) * i as f64 / steps as f64)
                .collect::<Vec<_>>()
        };
        turns.windows(2).flat_map(piece).collect()
    }

    fn run(play: &mut Play, inputs: &[f64]) -> Vec<f64> {
        inputs.iter().map(|x| play.push(*x)).collect()
    }

    #[test]
    fn a_repeated_cycle_closes_its_loop() {
        let mut play = Play::at(0.35, 0.0);
        run(&mut play, &path(&[0.0, 1.0], 50));
        let first = run(&mut play, &path(&[1.0, -0.3, 1.0], 50));
        let second = run(&mut play, &path(&[1.0, -0.3, 1.0], 50));
        assert_eq!(first, second);
    }

    #[test]
    fn a_larger_excursion_wipes_out_the_smaller_ones() {
        let (mut short, mut long) = (Play::at(0.2, 0.0), Play::at(0.2, 0.0));
        run(&mut short, &path(&[0.0, 2.0], 9));
        run(&mut long, &path(&[0.0, 0.8, 0.2, 0.7, 0.3, 2.0], 7));
        assert_eq!(short, long);
    }

    #[test]
    fn an_unknown_state_is_bounded_until_it_is_driven() {
        let (mut known, mut unknown) = (Play::at(0.6, 0.0), Play::at(0.6, 0.0));
        unknown.forget();
        assert_eq!(unknown.half_range(), f64::INFINITY);
        let mut last = f64::INFINITY;
        for x in path(&[0.0, 0.3, -0.2, 0.9, -0.9, 0.1], 20) {
            let (truth, guess) = (known.push(x), unknown.push(x));
            let bound = unknown.half_range();
            assert!((truth - guess).abs() <= bound + 1e-14);
            assert!(bound <= last);
            last = bound;
        }
        assert_eq!(last, 0.0);
    }
}
