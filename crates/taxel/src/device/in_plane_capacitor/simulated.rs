//! One made array: force on each taxel to the numbers of a frame.

use super::InPlaneArray;
use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::electronics::FrontEnd;
use crate::layout::Layout;
use crate::transduction::InPlaneModel;
use taxel_numerics::Noise;

/// One piece of fabrication. Rubber without memory: the model has no rates.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    layout: Layout,
    models: Vec<InPlaneModel>,
    board: FrontEnd,
}

impl Piece {
    pub(super) fn new(array: &InPlaneArray<'_>) -> Self {
        let layout = array.layout();
        Self {
            models: array.element.fabricate(layout.taxels()),
            layout,
            board: array.board.clone(),
        }
    }
}

/// Capacitance under a pressing force, F. A pull does not reach the layer, and
/// beyond the range of the model the capacitance stays at its end.
fn capacitance(model: &InPlaneModel, force: f64) -> f64 {
    let last = model.largest_compression();
    let compression = if force > 0.0 {
        model.compression_from_force(force).unwrap_or(last)
    } else {
        0.0
    };
    model
        .respond(compression.min(last))
        .map_or_else(|_| model.rest_capacitance(), |state| state.capacitance)
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        crate::device::stream_of(&self.layout, 1, self.board.period(), self.board.last.unit())
    }

    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let models = self.models.iter().enumerate();
        models
            .map(|(taxel, model)| {
                let time = start + self.board.delay(taxel, 0);
                let normal = noise.normal();
                match script.fault(taxel, 0, time) {
                    Some(FaultReading::Dead) => self.board.last.dead(),
                    // A stuck line has no noise of its own.
                    Some(FaultReading::Stuck(stuck)) => self.board.read(stuck.at, 0.0).number,
                    None => {
                        let [_, _, force] = script.force(taxel, time);
                        self.board.read(capacitance(model, force), normal).number
                    }
                }
            })
            .collect()
    }

    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        (0..self.layout.taxels())
            .map(|taxel| script.force(taxel, start + self.board.delay(taxel, 0)))
            .collect()
    }
}
