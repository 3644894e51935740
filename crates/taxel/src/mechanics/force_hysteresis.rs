//! Hysteresis of rubber: less force on unloading than on loading, however slow.
//!
//! The shape of a soft layer is measured, and on loading its force follows from the
//! shape. On unloading the same shape gives less force, by a share that grows from
//! the turning point on and then stays: f = F·exp(−Σ wⱼ lⱼ), F the force of
//! loading and lⱼ the lag of a play of half-width ρⱼ behind ln F, from 0 on
//! loading to 2ρⱼ. On the logarithm loops are alike at all forces and close at
//! zero, as those of filled rubbers do; otherwise it is the sum of plays of
//! Prandtl and Ishlinskii, with its memory of turning points.

use taxel_numerics::play::play;

/// Half-widths ρⱼ of the plays, as parts of a force: full at twice that.
pub const REVERSALS: [f64; 5] = [0.01, 0.03, 0.1, 0.3, 1.0];

/// Weights wⱼ of the plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceHysteresis {
    /// One for each of [`REVERSALS`].
    pub weights: [f64; REVERSALS.len()],
}

/// Where the plays of one body are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadHistory {
    /// States of the plays; none before the first load.
    plays: Option<[f64; REVERSALS.len()]>,
    /// True if the load pulls, or pushes to the other side.
    negative: bool,
}

impl LoadHistory {
    /// Lags after a step to the force `loading` that the shape has on loading,
    /// N, of either sign. Without a force the body forgets: the next touch
    /// begins anew, and so does a force to the other side.
    pub fn push(&mut self, loading: f64) -> [f64; REVERSALS.len()] {
        if self.negative != (loading < 0.0) {
            *self = Self::default();
        }
        if loading == 0.0 || loading.is_nan() {
            self.plays = None;
            return [0.0; REVERSALS.len()];
        }
        self.negative = loading < 0.0;
        let at = loading.abs().ln();
        let ahead = REVERSALS.map(|width| at - width);
        let plays = self.plays.get_or_insert(ahead);
        std::array::from_fn(|j| {
            plays[j] = play(plays[j], at, REVERSALS[j]);
            plays[j] - ahead[j]
        })
    }
}

impl ForceHysteresis {
    /// The share of the force of loading that is left at these lags.
    pub fn share(&self, lags: &[f64; REVERSALS.len()]) -> f64 {
        let lost: f64 = self.weights.iter().zip(lags).map(|(w, lag)| w * lag).sum();
        (-lost).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: ForceHysteresis = ForceHysteresis {
        weights: [0.5, 0.2, 0.1, 0.05, 0.01],
    };

    fn run(history: &mut LoadHistory, path: &[f64]) -> Vec<f64> {
        let force = |f: &f64| f * LAW.share(&history.push(*f));
        path.iter().map(force).collect()
    }

    fn ramp(from: f64, to: f64) -> Vec<f64> {
        (1..=200)
            .map(|i| from + (to - from) * f64::from(i) / 200.0)
            .collect()
    }

    #[test]
    fn loading_is_the_curve_of_loading_and_unloading_carries_less() {
        let mut history = LoadHistory::default();
        let up = ramp(0.0, 10.0);
        assert_eq!(run(&mut history, &up), up);
        let down = ramp(10.0, 0.001);
        let carried = run(&mut history, &down);
        assert!(carried.iter().zip(&down).all(|(f, loading)| f < loading));
        // Falling all the way: a loop, not a dent.
        assert!(carried.windows(2).all(|pair| pair[1] < pair[0]));
        // Far down all plays are full.
        let full: f64 = LAW
            .weights
            .iter()
            .zip(REVERSALS)
            .map(|(w, r)| 2.0 * w * r)
            .sum();
        assert!((carried[199] / down[199] / (-full).exp() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn loops_are_alike_at_all_forces_and_larger_ones_wipe_out_smaller_ones() {
        let path = |size: f64| {
            let mut path = ramp(0.0, size);
            path.extend(ramp(size, 0.3 * size));
            path.extend(ramp(0.3 * size, 0.6 * size));
            path
        };
        let [small, large] = [1.0, 7.0].map(|size| run(&mut LoadHistory::default(), &path(size)));
        for (a, b) in small.iter().zip(&large) {
            assert!((7.0 * a - b).abs() < 1e-12, "{a} {b}");
        }
        let (mut inner, mut plain) = (LoadHistory::default(), LoadHistory::default());
        run(&mut inner, &path(1.0));
        // Past the last turning point by more than the widest play.
        run(&mut inner, &ramp(0.6, 10.0));
        run(&mut plain, &ramp(0.0, 10.0));
        assert_eq!(inner, plain);
    }

    #[test]
    fn a_body_that_was_let_go_begins_anew() {
        let mut history = LoadHistory::default();
        run(&mut history, &[1.0, 5.0, 2.0, 0.0]);
        assert_eq!(history, LoadHistory::default());
        assert_eq!(run(&mut history, &[2.0, f64::NAN])[0], 2.0);
        // To the other side it begins anew, and is the same there.
        let mirrored = run(&mut history, &[3.0, 2.0, -1.0, -3.0, -2.0]);
        assert_eq!(mirrored[2..4], [-1.0, -3.0]);
        assert_eq!(mirrored[4], -mirrored[1]);
    }
}
