//! Memory of values: what they did lately.

/// What values did lately: of each, and of each time τ, z − q with τ q′ = z − q.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Memory {
    times: Vec<f64>,
    /// For each time, each value's slow part q.
    slow: Vec<Vec<f64>>,
    /// For each time, the share of the slow part that is not known.
    unknown: Vec<f64>,
    last: Option<(f64, Vec<f64>)>,
}

impl Memory {
    /// A memory of so many `values`, that have been zero for long, over `times`, s.
    pub(super) fn at_rest(times: &[f64], values: usize) -> Self {
        Self {
            slow: vec![vec![0.0; values]; times.len()],
            unknown: vec![0.0; times.len()],
            last: None,
            times: times.to_vec(),
        }
    }

    /// Forgets the past, as after an outage.
    pub(super) fn forget(&mut self) {
        self.last = None;
        self.unknown.fill(1.0);
    }

    /// Takes the values `z` at `time` (s) and appends what they did lately.
    ///
    /// Between samples the values are straight lines, for which the step of
    /// q is exact whatever its length is.
    pub(super) fn push(&mut self, time: f64, z: &[f64], features: &mut Vec<f64>) {
        let step = self.last.as_ref().map_or(0.0, |(t, _)| (time - t).max(0.0));
        for ((tau, slow), unknown) in (self.times.iter().zip(&mut self.slow)).zip(&mut self.unknown)
        {
            let x = step / tau;
            let decay = (-x).exp();
            let mean_decay = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
            if self.last.is_none() && *unknown > 0.0 {
                slow.copy_from_slice(z);
            }
            *unknown *= decay;
            for (at, q) in slow.iter_mut().enumerate() {
                let before = self.last.as_ref().map_or(z[at], |(_, last)| last[at]);
                *q = decay * *q + (mean_decay - decay) * before + (1.0 - mean_decay) * z[at];
                features.push(z[at] - *q);
            }
        }
        self.last = Some((time, z.to_vec()));
    }

    /// Root sum square of the slow parts of all values, for each time.
    pub(super) fn slow_sizes(&self) -> impl Iterator<Item = f64> + '_ {
        let size = |slow: &Vec<f64>| slow.iter().map(|q| q * q).sum::<f64>().sqrt();
        self.slow.iter().map(size)
    }

    /// Share of each feature that is not known because the past is not.
    pub(super) fn unknown(&self) -> impl Iterator<Item = f64> + '_ {
        let values = self.slow.first().map_or(0, Vec::len);
        self.unknown
            .iter()
            .flat_map(move |share| std::iter::repeat_n(*share, values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 2] = [0.5, 20.0];

    #[test]
    fn splitting_a_straight_step_changes_nothing() {
        let (mut one, mut many) = (Memory::at_rest(&TIMES, 1), Memory::at_rest(&TIMES, 1));
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
    fn a_held_value_is_forgotten_with_its_time() {
        let mut memory = Memory::at_rest(&TIMES, 1);
        let mut features = Vec::new();
        memory.push(0.0, &[0.0], &mut features);
        features.clear();
        memory.push(1e-9, &[1.0], &mut features);
        assert!((features[0] - 1.0).abs() < 1e-8);
        features.clear();
        memory.push(1.0 + 1e-9, &[1.0], &mut features);
        // exp(-1/0.5) and exp(-1/20); the ramp lasted 1e-9 s.
        for (feature, expected) in features.iter().zip([(-2f64).exp(), (-0.05f64).exp()]) {
            assert!((feature - expected).abs() < 1e-8);
        }
    }

    #[test]
    fn what_is_unknown_fades() {
        let mut memory = Memory::at_rest(&TIMES, 2);
        assert!(memory.unknown().all(|share| share == 0.0));
        memory.forget();
        memory.push(10.0, &[0.3, 0.4], &mut Vec::new());
        assert!(memory.unknown().all(|share| share == 1.0));
        memory.push(30.0, &[0.9, 0.4], &mut Vec::new());
        let unknown: Vec<f64> = memory.unknown().collect();
        assert!((unknown[2] - (-1f64).exp()).abs() < 1e-15);
    }
}
