//! What a body may still show of a contact that has gone.
//!
//! A soft body that was held creeps back for as long as it was pressed. Slow means q of what
//! each channel showed, τ q′ = z − q, say how much there was lately. Of the empty body a channel
//! shows Σ wₖ qₖ, with weights that training fits where the scale reads nothing; what those
//! leave is a share of the largest of the means. A reading of the empty device that is no
//! farther from this is creep as likely as drift, and the baseline does not take it for drift.

use serde::{Deserialize, Serialize};

/// Times τ over which is looked back, s.
const TIMES: [f64; 5] = [3.0, 10.0, 30.0, 100.0, 300.0];

/// How one channel of the empty body recovers; in a file the weights, then what they leave.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(from = "[f64; TIMES.len() + 1]", into = "[f64; TIMES.len() + 1]")]
pub struct Creep {
    /// Weight of the slow mean of each time.
    pub weights: [f64; TIMES.len()],
    /// Share of the largest slow mean that the weights may leave.
    pub left: f64,
}

impl From<[f64; TIMES.len() + 1]> for Creep {
    fn from([one, two, three, four, five, left]: [f64; TIMES.len() + 1]) -> Self {
        let weights = [one, two, three, four, five];
        Self { weights, left }
    }
}

impl From<Creep> for [f64; TIMES.len() + 1] {
    fn from(creep: Creep) -> Self {
        let [one, two, three, four, five] = creep.weights;
        [one, two, three, four, five, creep.left]
    }
}

impl Creep {
    /// What the empty channel shows of these slow means, and by how much that may be wrong, in
    /// their unit.
    pub fn expected(&self, slow: &[f64; TIMES.len()]) -> [f64; 2] {
        let shown = self.weights.iter().zip(slow).map(|(w, q)| w * q).sum();
        [shown, self.left * lately(slow)]
    }

    /// True if the numbers of a file are some.
    pub(super) fn is_sound(&self) -> bool {
        self.weights.iter().all(|weight| weight.is_finite()) && self.left >= 0.0
    }
}

/// The largest of the slow means of a channel.
pub fn lately(slow: &[f64; TIMES.len()]) -> f64 {
    slow.iter().fold(0.0, |most: f64, q| most.max(q.abs()))
}

/// Slow means of the channels of a device, less their rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovery {
    slow: Vec<[f64; TIMES.len()]>,
}

impl Recovery {
    /// Channels that have been at rest for long.
    pub fn at_rest(channels: usize) -> Self {
        Self {
            slow: vec![[0.0; TIMES.len()]; channels],
        }
    }

    /// Takes the readings less those at rest, `elapsed` s after those before; one that is
    /// missing (`NaN`) changes nothing.
    pub fn push(&mut self, elapsed: f64, tared: impl IntoIterator<Item = f64>) {
        let weights = TIMES.map(|time| -(-elapsed / time).exp_m1());
        for (slow, reading) in self.slow.iter_mut().zip(tared) {
            if reading.is_finite() {
                for (slow, weight) in slow.iter_mut().zip(weights) {
                    *slow += weight * (reading - *slow);
                }
            }
        }
    }

    /// Slow means of each channel, in its unit.
    pub fn slow(&self) -> &[[f64; TIMES.len()]] {
        &self.slow
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_shown_fades_with_the_slowest_time() {
        let mut recovery = Recovery::at_rest(2);
        recovery.push(1e9, [5.0, f64::NAN]);
        recovery.push(300.0, [0.0, 0.0]);
        let [one, other] = [0, 1].map(|channel| recovery.slow()[channel]);
        assert!((lately(&one) - 5.0 * (-1.0_f64).exp()).abs() < 1e-12);
        assert_eq!(lately(&other), 0.0);
        let creep = Creep {
            weights: [0.0, 0.0, 0.0, 0.0, 0.5],
            left: 0.1,
        };
        let [shown, doubt] = creep.expected(&one);
        assert!((shown - 5.0 * doubt).abs() < 1e-12);
    }
}
