//! What a body may still show of a contact that has gone.
//!
//! A soft body that was held creeps back for as long as it was pressed. Slow means q of what
//! each channel showed, τ q′ = z − q, say how much there was lately; of it a share that training
//! measures may be left. A reading of the empty device within that share of its rest is creep as
//! likely as drift, and the baseline does not take it for drift.

/// Times over which is looked back, s.
const TIMES: [f64; 3] = [10.0, 30.0, 100.0];

/// Slow means of the channels of a device, less their rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovery {
    slow: Vec<[f64; 3]>,
}

impl Recovery {
    /// Channels that have been at rest for long.
    pub fn at_rest(channels: usize) -> Self {
        Self {
            slow: vec![[0.0; 3]; channels],
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

    /// The most that each channel has shown lately, in its unit.
    pub fn lately(&self) -> impl Iterator<Item = f64> + '_ {
        let most = |slow: &[f64; 3]| slow.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
        self.slow.iter().map(most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_shown_fades_with_the_slowest_time() {
        let mut recovery = Recovery::at_rest(2);
        recovery.push(1e6, [5.0, f64::NAN]);
        recovery.push(100.0, [0.0, 0.0]);
        let lately: Vec<f64> = recovery.lately().collect();
        assert!((lately[0] - 5.0 * (-1.0_f64).exp()).abs() < 1e-12);
        assert_eq!(lately[1], 0.0);
    }
}
