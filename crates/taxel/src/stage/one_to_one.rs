//! The network of cells that are read one by one.

use super::{CellQuantity, ChainPart, Inverted, Network};

/// Each cell has a channel of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OneToOne;

impl ChainPart for OneToOne {}

impl Network for OneToOne {
    fn boxed(&self) -> Box<dyn Network> {
        Box::new(*self)
    }

    fn quantity(&self, of_cell: CellQuantity) -> CellQuantity {
        of_cell
    }

    fn read(&self, values: &[f64], signals: &mut [f64]) {
        signals.copy_from_slice(values);
    }

    fn invert(&self, signals: &[f64], noise: &[f64], found: &mut Inverted) {
        found.values.clear();
        found.values.extend_from_slice(signals);
        found.deviations.clear();
        found.deviations.extend_from_slice(noise);
        found.spread.clear();
        found.converged = true;
    }
}
