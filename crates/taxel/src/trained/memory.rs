//! Memory of channels: features of creep and of play.

use serde::{Deserialize, Serialize};

use super::Play;

/// Which memory features are made of each channel.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemoryLaw {
    /// Times τ of creep, s: z − q with τ q′ = z − q.
    pub creep_times: Vec<f64>,
    /// Half-widths r of play, in deviations of the channel: z − P_r\[z\].
    pub play_thresholds: Vec<f64>,
}

/// The features of a stream of scaled channels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Memory {
    law: MemoryLaw,
    /// For each time, each channel's slow part q.
    slow: Vec<Vec<f64>>,
    /// For each time, the share of the slow part that is not known.
    unknown: Vec<f64>,
    /// For each threshold, each channel's play.
    plays: Vec<Vec<Play>>,
    last: Option<(f64, Vec<f64>)>,
}

impl Memory {
    /// A memory of `channels` channels that have been at rest for long.
    pub(super) fn at_rest(law: &MemoryLaw, channels: usize) -> Self {
        let plays = |r: &f64| vec![Play::at(*r, 0.0); channels];
        Self {
            slow: vec![vec![0.0; channels]; law.creep_times.len()],
            unknown: vec![0.0; law.creep_times.len()],
            plays: law.play_thresholds.iter().map(plays).collect(),
            last: None,
            law: law.clone(),
        }
    }

    /// Forgets the past, as after an outage.
    pub(super) fn forget(&mut self) {
        self.last = None;
        self.unknown.fill(1.0);
        self.plays.iter_mut().flatten().for_each(Play::forget);
    }

    /// Takes the channels `z` at `time` (s) and appends the features.
    ///
    /// Between samples the channels are straight lines, for which the step of
    /// q is exact whatever its length is.
    pub(super) fn push(&mut self, time: f64, z: &[f64], features: &mut Vec<f64>) {
        let step = self.last.as_ref().map_or(0.0, |(t, _)| (time - t).max(0.0));
        for ((tau, slow), unknown) in
            (self.law.creep_times.iter().zip(&mut self.slow)).zip(&mut self.unknown)
        {
            let x = step / tau;
            let decay = (-x).exp();
            let mean_decay = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
            if self.last.is_none() && *unknown > 0.0 {
                slow.copy_from_slice(z);
            }
            *unknown *= decay;
            for (channel, q) in slow.iter_mut().enumerate() {
                let before = self
                    .last
                    .as_ref()
                    .map_or(z[channel], |(_, last)| last[channel]);
                *q = decay * *q + (mean_decay - decay) * before + (1.0 - mean_decay) * z[channel];
                features.push(z[channel] - *q);
            }
        }
        for plays in &mut self.plays {
            features.extend(plays.iter_mut().zip(z).map(|(play, z)| z - play.push(*z)));
        }
        self.last = Some((time, z.to_vec()));
    }

    /// Root sum square of the slow parts of all channels, for each time.
    pub(super) fn slow_sizes(&self) -> impl Iterator<Item = f64> + '_ {
        let size = |slow: &Vec<f64>| slow.iter().map(|q| q * q).sum::<f64>().sqrt();
        self.slow.iter().map(size)
    }

    /// Deviation of each feature because the past is not known, for features
    /// whose deviation over training is `spread`.
    pub(super) fn unknown(&self, spread: &[f64]) -> Vec<f64> {
        let channels = self.slow.first().map_or(0, Vec::len);
        let creep = self.unknown.iter().flat_map(|share| vec![*share; channels]);
        let creep = creep.zip(spread).map(|(share, spread)| share * spread);
        // A state anywhere in a range has its length over √12 as deviation.
        let play = self.plays.iter().flatten();
        let play = play.map(|play| play.half_range().min(1e6) / 3f64.sqrt());
        creep.chain(play).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> MemoryLaw {
        MemoryLaw {
            creep_times: vec![0.5, 20.0],
            play_thresholds: vec![0.2],
        }
    }

    #[test]
    fn splitting_a_straight_step_changes_nothing() {
        let (mut one, mut many) = (Memory::at_rest(&law(), 1), Memory::at_rest(&law(), 1));
        let push = |memory: &mut Memory, time, z| {
            let mut features = Vec::new();
            memory.push(time, &[z], &mut features);
            features
        };
        push(&mut one, 0.0, 0.0);
        push(&mut many, 0.0, 0.0);
        let whole = push(&mut one, 2.0, 1.0);
        let mut split = Vec::new();
        for i in 1..=16 {
            split = push(&mut many, f64::from(i) / 8.0, f64::from(i) / 16.0);
        }
        for (a, b) in whole.iter().zip(&split) {
            assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn a_held_channel_is_forgotten_with_its_time() {
        let mut memory = Memory::at_rest(&law(), 1);
        let mut features = Vec::new();
        memory.push(0.0, &[0.0], &mut features);
        features.clear();
        memory.push(1e-9, &[1.0], &mut features);
        assert!((features[0] - 1.0).abs() < 1e-8);
        features.clear();
        memory.push(1.0 + 1e-9, &[1.0], &mut features);
        // exp(-1/0.5), exp(-1/20), and the threshold; the ramp lasted 1e-9 s.
        for (feature, expected) in features.iter().zip([(-2f64).exp(), (-0.05f64).exp(), 0.2]) {
            assert!((feature - expected).abs() < 1e-8);
        }
    }

    #[test]
    fn what_is_unknown_fades() {
        let mut memory = Memory::at_rest(&law(), 2);
        assert_eq!(memory.unknown(&[1.0; 4]), [0.0; 6]);
        memory.forget();
        memory.push(10.0, &[0.3, 0.4], &mut Vec::new());
        assert_eq!(memory.unknown(&[2.0; 4])[..4], [2.0; 4]);
        memory.push(30.0, &[0.9, 0.4], &mut Vec::new());
        let unknown = memory.unknown(&[2.0; 4]);
        assert!((unknown[2] - 2.0 * (-1f64).exp()).abs() < 1e-15);
        // The first channel moved by more than twice the threshold.
        assert_eq!(unknown[4], 0.0);
        assert!(unknown[5] > 0.1);
    }
}
