//! What a step goes on from.

use crate::assembly::state::State;

/// The state before the accepted one.
pub(super) struct Previous {
    pub(super) state: State,
    pub(super) targets: Vec<f64>,
}

impl Previous {
    /// Number of times the step from here to `now` has to be repeated to come from `now`
    /// to `target`; none when the path turns.
    pub(super) fn ratio(&self, now: &[f64], target: &[f64]) -> Option<f64> {
        let last = (0..now.len()).map(|k| now[k] - self.targets[k]);
        let next = (0..now.len()).map(|k| target[k] - now[k]);
        let mut ratio: Option<f64> = None;
        for (last, next) in last.zip(next) {
            if last == 0.0 && next == 0.0 {
                continue;
            }
            let own = next / last;
            if own.is_nan()
                || own <= 0.0
                || ratio.is_some_and(|known| (known / own - 1.0).abs() > 1e-6)
            {
                return None;
            }
            ratio = ratio.or(Some(own)).filter(|ratio| ratio.is_finite());
            ratio?;
        }
        ratio
    }
}
