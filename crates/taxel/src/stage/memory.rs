//! Creep: a cell that yields under a held pressure.

use super::Memory;
use crate::mechanics::{Relaxation, RelaxationTerm};

/// The creep of relaxing springs beside the long-time one: under a sudden pressure that at the cell is
/// p/(1 + Σ rⱼ), and p in the long run.
#[derive(Debug, Clone)]
pub struct Creep {
    terms: Vec<RelaxationTerm>,
    state: Relaxation<1>,
}

impl Creep {
    /// A cell that nothing has pressed; none without terms.
    pub fn new(terms: &[RelaxationTerm]) -> Option<Self> {
        let mut state = Relaxation::new(terms);
        // At rest before the first load.
        state.push([0.0], 0.0);
        (!terms.is_empty()).then(|| Self {
            terms: terms.to_vec(),
            state,
        })
    }
}

impl Memory for Creep {
    fn respond(&mut self, pressure: f64, elapsed: f64) -> f64 {
        let [cell_load] = self.state.push_total([pressure], elapsed);
        cell_load
    }

    fn recover(&mut self, cell_load: f64, elapsed: f64) -> [f64; 2] {
        if cell_load.is_nan() {
            return [f64::NAN, 1.0];
        }
        let gain = self.state.instant_gain(elapsed);
        let [pressure] = self.state.push([cell_load], elapsed);
        [pressure, gain]
    }

    fn times(&self) -> Vec<f64> {
        self.terms.iter().map(|term| term.time).collect()
    }

    fn fresh(&self) -> Box<dyn Memory> {
        let mut state = Relaxation::new(&self.terms);
        state.push([0.0], 0.0);
        Box::new(Self {
            terms: self.terms.clone(),
            state,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovering_the_load_at_a_cell_gives_that_above_it() {
        let terms = [
            RelaxationTerm {
                ratio: 0.3,
                time: 0.5,
            },
            RelaxationTerm {
                ratio: 0.1,
                time: 20.0,
            },
        ];
        let creep = Creep::new(&terms).unwrap();
        let (mut cell, mut reader) = (creep.fresh(), creep.fresh());
        for step in 0..1000 {
            let pressure = 1e4 * (f64::from(step) * 0.03).sin();
            let cell_load = cell.respond(pressure, 0.01);
            // Rounding of sums of two exponentials.
            assert!((reader.recover(cell_load, 0.01)[0] - pressure).abs() < 1e-9);
        }
        let mut cell = creep.fresh();
        assert!((cell.respond(1.4e4, 0.0) - 1e4).abs() < 1e-9);
        // 50 of the longest time: exp(-50) is left. Between samples the cell goes on a straight line.
        for _ in 0..10_000 {
            cell.respond(1.4e4, 0.1);
        }
        assert!((cell.respond(1.4e4, 0.1) - 1.4e4).abs() < 1e-9);
    }
}
