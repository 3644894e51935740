//! A drag on every unknown.

use crate::assembly::state::State;
use crate::assembly::system::{Assembled, System};

/// Forces against the way of the unknowns from a state.
#[derive(Clone, Debug)]
pub(super) struct Drag {
    pub(super) from: Vec<f64>,
    /// N/m.
    pub(super) stiffness: f64,
}

impl Drag {
    /// Adds the forces in a state, and their slope.
    pub(super) fn add(&self, system: &System, state: &State, out: &mut Assembled) {
        let now = system.unknown_part(&state.displacement);
        for (k, (now, from)) in now.iter().zip(&self.from).enumerate() {
            out.residual[k] += self.stiffness * (now - from);
            let diagonal = system.unknowns.pattern.column(k).start;
            out.values[diagonal] += self.stiffness;
        }
    }
}
