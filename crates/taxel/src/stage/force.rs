//! A taxel whose value is the force on it.

use super::{CellEstimate, CellLaw, CellLoad, CellQuantity, CellState, ChainPart};
use crate::quantity::FORCE;

/// One force of a taxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceCell {
    /// As a board with a computer of its own gives it.
    Measured,
    /// As a network finds it from more signals than one.
    Found,
}

impl ChainPart for ForceCell {}

impl CellLaw for ForceCell {
    fn boxed(&self) -> Box<dyn CellLaw> {
        Box::new(*self)
    }

    fn quantity(&self) -> CellQuantity {
        CellQuantity {
            name: "force",
            dimension: Some(&FORCE),
            unit: ("N", 1.0, "n"),
        }
    }

    fn load(&self) -> CellLoad {
        CellLoad::Force
    }

    fn area(&self) -> Option<[f64; 2]> {
        None
    }

    fn value(&self, load: f64) -> f64 {
        load
    }

    fn estimate(&self, value: f64, deviation: f64, _largest: f64) -> CellEstimate {
        CellEstimate {
            load: value,
            deviation,
            state: CellState::Ok,
        }
    }

    fn is_the_load(&self) -> bool {
        *self == Self::Measured
    }
}
