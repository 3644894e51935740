//! Rate-independent hysteresis: the play operator and weighted sums of it
//! (Prandtl-Ishlinskii), with their exact inverse.
//!
//! P_r\[x\]: z ← max(x − r, min(x + r, z)), and y = w₀ x + Σ wⱼ P_rⱼ\[x\]
//! (M. A. Krasnosel'skii and A. V. Pokrovskii, *Systems with Hysteresis*, 1989).
//! Only the order of the samples counts, so uneven steps need no care. After
//! an outage the state is unknown; two plays started at the ends of what is
//! possible bound it, because the operator keeps the order of its states.

use serde::{Deserialize, Serialize};
use taxel_numerics::play::play;

use super::TrainingError;
use super::ridge::{Moments, Ridge};

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

    /// A play of which nothing is known.
    pub fn unknown(threshold: f64) -> Self {
        Self {
            threshold,
            state: None,
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

/// The law y = w₀ x + Σ wⱼ P_rⱼ\[x\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrandtlIshlinskii {
    /// w₀, the part without memory.
    pub elastic: f64,
    /// Thresholds rⱼ, rising and positive, in the unit of the input.
    pub thresholds: Vec<f64>,
    /// Weights wⱼ, one per threshold.
    pub weights: Vec<f64>,
}

/// A law with its plays.
#[derive(Debug, Clone, PartialEq)]
pub struct HysteresisOperator {
    law: PrandtlIshlinskii,
    plays: Vec<Play>,
}

impl PrandtlIshlinskii {
    /// The law whose operator undoes this one, both starting from rest:
    /// w₀′ = 1/w₀, wⱼ′ = −wⱼ/(Wⱼ Wⱼ₋₁), rⱼ′ = Σ_{i<j} wᵢ (rⱼ − rᵢ), with
    /// Wⱼ = Σ_{i≤j} wᵢ and r₀ = 0 (K. Kuhnen, Eur. J. Control 9, 407, 2003).
    ///
    /// # Errors
    /// [`TrainingError::NoInverse`] unless all Wⱼ are positive.
    pub fn inverse(&self) -> Result<Self, TrainingError> {
        let mut sum = self.elastic;
        let mut offset = 0.0;
        let positive = |sum: f64| {
            if sum > 0.0 && sum.is_finite() {
                Ok(sum)
            } else {
                Err(TrainingError::NoInverse { slope: sum })
            }
        };
        let mut inverse = Self {
            elastic: 1.0 / positive(sum)?,
            thresholds: Vec::new(),
            weights: Vec::new(),
        };
        for (threshold, weight) in self.thresholds.iter().zip(&self.weights) {
            let next = positive(sum + weight)?;
            inverse.thresholds.push(sum * threshold - offset);
            inverse.weights.push(-weight / (next * sum));
            offset += weight * threshold;
            sum = next;
        }
        Ok(inverse)
    }

    /// The operator at rest at zero.
    pub fn at_rest(&self) -> HysteresisOperator {
        let plays = self.thresholds.iter().map(|r| Play::at(*r, 0.0));
        HysteresisOperator {
            plays: plays.collect(),
            law: self.clone(),
        }
    }

    /// The law of the given `thresholds` nearest to the samples `output` of an
    /// operator that started at rest, in least squares.
    ///
    /// # Errors
    /// [`TrainingError`] when there are fewer samples than weights.
    pub fn identify(
        thresholds: &[f64],
        input: &[f64],
        output: &[f64],
    ) -> Result<Self, TrainingError> {
        let mut plays: Vec<Play> = thresholds.iter().map(|r| Play::at(*r, 0.0)).collect();
        let rows: Vec<Vec<f64>> = input
            .iter()
            .map(|x| {
                let states = plays.iter_mut().map(|play| play.push(*x));
                [1.0, *x].into_iter().chain(states).collect()
            })
            .collect();
        // A prior too weak to be seen keeps thresholds that were never
        // reached from making the equations singular.
        let ridge = Ridge::fit(&Moments::of(&rows, output)?, 1e-12)?;
        Ok(Self {
            elastic: ridge.weights()[1],
            thresholds: thresholds.to_vec(),
            weights: ridge.weights()[2..].to_vec(),
        })
    }
}

impl HysteresisOperator {
    /// Takes one sample of the input and returns the output.
    pub fn push(&mut self, input: f64) -> f64 {
        let memory = self.plays.iter_mut().zip(&self.law.weights);
        self.law.elastic * input + memory.map(|(play, w)| w * play.push(input)).sum::<f64>()
    }

    /// How far the output may be off because the state is not known, to
    /// either side.
    pub fn half_range(&self) -> f64 {
        let parts = self.plays.iter().zip(&self.law.weights);
        parts.map(|(play, w)| w.abs() * play.half_range()).sum()
    }

    /// Forgets all states, as after an outage.
    pub fn forget(&mut self) {
        self.plays.iter_mut().for_each(Play::forget);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> PrandtlIshlinskii {
        PrandtlIshlinskii {
            elastic: 0.7,
            thresholds: vec![0.1, 0.35, 0.6],
            weights: vec![0.4, -0.2, 0.5],
        }
    }

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

    fn run(operator: &mut HysteresisOperator, inputs: &[f64]) -> Vec<f64> {
        inputs.iter().map(|x| operator.push(*x)).collect()
    }

    #[test]
    fn a_repeated_cycle_closes_its_loop() {
        let mut operator = law().at_rest();
        run(&mut operator, &path(&[0.0, 1.0], 50));
        let first = run(&mut operator, &path(&[1.0, -0.3, 1.0], 50));
        let second = run(&mut operator, &path(&[1.0, -0.3, 1.0], 50));
        assert_eq!(first, second);
    }

    #[test]
    fn a_larger_excursion_wipes_out_the_smaller_ones() {
        let (mut short, mut long) = (law().at_rest(), law().at_rest());
        run(&mut short, &path(&[0.0, 2.0], 9));
        run(&mut long, &path(&[0.0, 0.8, 0.2, 0.7, 0.3, 2.0], 7));
        assert_eq!(short, long);
    }

    #[test]
    fn loops_between_the_same_inputs_are_congruent() {
        let loop_after = |start: f64| {
            let mut operator = law().at_rest();
            // The first passage still carries what came before.
            run(&mut operator, &path(&[0.0, start, 0.5, 1.1, 0.5], 40));
            let outputs = run(&mut operator, &path(&[0.5, 1.1, 0.5], 40));
            let last = outputs[outputs.len() - 1];
            outputs.iter().map(|y| y - last).collect::<Vec<_>>()
        };
        // The same numbers are added in another order of magnitude.
        for (a, b) in loop_after(5.0).iter().zip(loop_after(-4.0)) {
            assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn the_inverse_undoes_the_operator() {
        let (mut forward, mut back) = (law().at_rest(), law().inverse().unwrap().at_rest());
        for x in path(&[0.0, 1.3, -0.4, 0.9, 0.1, 0.2, -2.0, 0.0], 37) {
            assert!((back.push(forward.push(x)) - x).abs() < 1e-14);
        }
        // The inverse of the inverse is the law.
        let twice = law().inverse().unwrap().inverse().unwrap();
        for (a, b) in twice.thresholds.iter().zip(&law().thresholds) {
            assert!((a - b).abs() < 1e-14);
        }
        for (a, b) in twice.weights.iter().zip(&law().weights) {
            assert!((a - b).abs() < 1e-14);
        }
    }

    #[test]
    fn a_falling_law_has_no_inverse() {
        let mut law = law();
        law.weights[0] = -0.8;
        assert!(matches!(
            law.inverse(),
            Err(TrainingError::NoInverse { slope }) if (slope + 0.1).abs() < 1e-12
        ));
    }

    #[test]
    fn identification_recovers_the_weights() {
        let inputs = path(&[0.0, 1.5, -1.0, 1.0, -0.5, 0.4, 0.0], 60);
        let outputs = run(&mut law().at_rest(), &inputs);
        let found = PrandtlIshlinskii::identify(&law().thresholds, &inputs, &outputs).unwrap();
        // The prior of 1e-12 and the squared condition of the moments.
        assert!((found.elastic - 0.7).abs() < 1e-8, "{found:?}");
        for (a, b) in found.weights.iter().zip(&law().weights) {
            assert!((a - b).abs() < 1e-8, "{found:?}");
        }
    }

    #[test]
    fn an_unknown_state_is_bounded_until_it_is_driven() {
        let inputs = path(&[0.0, 0.3, -0.2, 0.9, -0.9, 0.1], 20);
        let mut known = law().at_rest();
        let mut unknown = law().at_rest();
        unknown.forget();
        assert_eq!(unknown.half_range(), f64::INFINITY);
        let mut last = f64::INFINITY;
        for x in inputs {
            let (truth, guess) = (known.push(x), unknown.push(x));
            let bound = unknown.half_range();
            assert!((truth - guess).abs() <= bound + 1e-14);
            assert!(bound <= last);
            last = bound;
        }
        assert_eq!(last, 0.0);
    }
}
