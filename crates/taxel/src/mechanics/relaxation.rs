//! Linear viscoelastic relaxation: what a slow rubber adds to its spring.
//!
//! F(t) = f(t) + Σ rⱼ qⱼ(t),  qⱼ(t) = ∫ exp(−(t−s)/τⱼ) f′(s) ds (P2 section 9),
//! where f = k∞ d is the elastic force of the long-time spring and rⱼ = kⱼ/k∞.
//! The capacitors measure displacement, so the force follows by this causal
//! and stable operator: compensating creep needs no inversion.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, PositiveTime, Ratio};

/// One relaxing spring beside the long-time spring.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RelaxationTerm {
    /// Its stiffness over the long-time stiffness, kⱼ/k∞.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    #[schemars(with = "Checked<Ratio>")]
    pub ratio: f64,
    /// Its relaxation time τⱼ, s.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "Checked<PositiveTime>")]
    pub time: f64,
}

/// The relaxation operator with its memory, for `N` signals at once.
///
/// The signals are joined by straight lines between samples, for which the
/// recursion is exact whatever the time steps are.
#[derive(Debug, Clone, PartialEq)]
pub struct Relaxation<const N: usize> {
    terms: Vec<RelaxationTerm>,
    memory: Vec<[f64; N]>,
    last: Option<[f64; N]>,
}

/// Factors of one step of length `dt` of a term: q ← decay·q + gain·Δf.
fn step_factors(term: &RelaxationTerm, dt: f64) -> (f64, f64) {
    let x = dt / term.time;
    // (τ/dt)(1 − exp(−dt/τ)) → 1 for a step of no length.
    let gain = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
    ((-x).exp(), gain)
}

impl<const N: usize> Relaxation<N> {
    /// An operator without history; the first sample is a sudden load, q(0) = f(0).
    pub fn new(terms: &[RelaxationTerm]) -> Self {
        Self {
            terms: terms.to_vec(),
            memory: vec![[0.0; N]; terms.len()],
            last: None,
        }
    }

    /// Adds the elastic sample `elastic`, `dt` seconds after the one before,
    /// and returns the total.
    ///
    /// A `dt` that is negative or not a number counts as zero.
    pub fn push(&mut self, elastic: [f64; N], dt: f64) -> [f64; N] {
        let dt = dt.max(0.0);
        let change = match self.last {
            Some(last) => std::array::from_fn(|i| elastic[i] - last[i]),
            None => elastic,
        };
        let first = self.last.is_none();
        let mut total = elastic;
        for (term, q) in self.terms.iter().zip(&mut self.memory) {
            let (decay, gain) = if first {
                (1.0, 1.0)
            } else {
                step_factors(term, dt)
            };
            for i in 0..N {
                q[i] = decay * q[i] + gain * change[i];
                total[i] += term.ratio * q[i];
            }
        }
        self.last = Some(elastic);
        total
    }

    /// The elastic part for which [`Relaxation::push`] returns `total` after
    /// `dt`, and pushes it: creep under a given force.
    pub fn push_total(&mut self, total: [f64; N], dt: f64) -> [f64; N] {
        let dt = dt.max(0.0);
        let first = self.last.is_none();
        let last = self.last.unwrap_or([0.0; N]);
        // total = f + Σ r (decay q + gain (f − last)) is linear in f.
        let mut slope = 1.0;
        let mut constant = [0.0; N];
        for (term, q) in self.terms.iter().zip(&self.memory) {
            let (decay, gain) = if first {
                (1.0, 1.0)
            } else {
                step_factors(term, dt)
            };
            slope += term.ratio * gain;
            for i in 0..N {
                constant[i] += term.ratio * (decay * q[i] - gain * last[i]);
            }
        }
        let elastic = std::array::from_fn(|i| (total[i] - constant[i]) / slope);
        self.push(elastic, dt);
        elastic
    }

    /// ∂total/∂elastic of the next step of length `dt`: how noise in the
    /// elastic part grows.
    pub fn instant_gain(&self, dt: f64) -> f64 {
        let gain = |term| term_gain(term, dt, self.last.is_none());
        1.0 + self.terms.iter().map(gain).sum::<f64>()
    }

    /// The longest relaxation time, s; zero without terms.
    pub fn longest_time(&self) -> f64 {
        self.terms.iter().map(|term| term.time).fold(0.0, f64::max)
    }

    /// The internal variables qⱼ, one row per term.
    pub fn memory(&self) -> &[[f64; N]] {
        &self.memory
    }
}

fn term_gain(term: &RelaxationTerm, dt: f64, first: bool) -> f64 {
    term.ratio
        * if first {
            1.0
        } else {
            step_factors(term, dt.max(0.0)).1
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERMS: [RelaxationTerm; 2] = [
        RelaxationTerm {
            ratio: 0.1,
            time: 0.05,
        },
        RelaxationTerm {
            ratio: 0.3,
            time: 2.0,
        },
    ];

    #[test]
    fn push_total_inverts_push() {
        let (mut creep, mut relax) = (Relaxation::<1>::new(&TERMS), Relaxation::<1>::new(&TERMS));
        for (i, dt) in [0.0, 0.01, 0.5, 0.0, 3.0, 1e-6].into_iter().enumerate() {
            let total = (i as f64 * 1.7).sin();
            let elastic = creep.push_total([total], dt);
            assert!((relax.push(elastic, dt)[0] - total).abs() < 1e-15);
        }
    }

    #[test]
    fn a_held_load_relaxes_to_the_long_time_spring() {
        let mut relax = Relaxation::<1>::new(&TERMS);
        assert!((relax.push([1.0], 0.0)[0] - 1.4).abs() < 1e-15);
        // After 40 of the longest time the rest is exp(-40) = 4e-18.
        assert!((relax.push([1.0], 80.0)[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn splitting_a_straight_step_changes_nothing() {
        let (mut one, mut many) = (Relaxation::<1>::new(&TERMS), Relaxation::<1>::new(&TERMS));
        one.push([0.0], 0.0);
        many.push([0.0], 0.0);
        let whole = one.push([1.0], 0.4)[0];
        let split = (1..=8)
            .map(|i| many.push([f64::from(i) / 8.0], 0.05)[0])
            .last()
            .unwrap();
        assert!((whole - split).abs() < 1e-14);
    }
}
