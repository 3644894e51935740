//! One made array: force on each unit to the numbers of a frame.

use super::ThreeAxisArray;
use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::electronics::CapacitanceBoard;
use crate::layout::Layout;
use crate::mechanics::Relaxation;
use crate::transduction::ThreeAxisModel;
use taxel_numerics::Noise;

/// One piece of fabrication with the history of its rubber.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    layout: Layout,
    units: Vec<ThreeAxisModel>,
    /// Relaxation of each unit and the time of its last step, s.
    creep: Vec<(Relaxation<3>, f64)>,
    board: CapacitanceBoard,
}

impl Piece {
    pub(super) fn new(array: &ThreeAxisArray<'_>) -> Self {
        let relaxation = Relaxation::new(&array.element.relaxation);
        Self {
            layout: array.layout(),
            units: array.made(),
            creep: vec![(relaxation, 0.0); array.layout().taxels()],
            board: array.board.clone(),
        }
    }

    /// True capacitances of a unit at `time`, s.
    fn capacitance(&mut self, script: &Script<'_>, taxel: usize, time: f64) -> [f64; 4] {
        let force = script.force(taxel, time);
        let (creep, last) = &mut self.creep[taxel];
        let elastic = creep.push_total(force, time - *last);
        *last = time;
        self.units[taxel].predict(elastic).1.capacitance()
    }
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        crate::device::stream_of(&self.layout, 4, self.board.period(), self.board.last.unit())
    }

    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let taxels = self.layout.taxels();
        let mut values = Vec::with_capacity(4 * taxels);
        for taxel in 0..taxels {
            let mut sampled = f64::NAN;
            let mut capacitance = [0.0; 4];
            for capacitor in 0..4 {
                let time = start + self.board.delay(taxel, capacitor);
                if time != sampled {
                    capacitance = self.capacitance(script, taxel, time);
                    sampled = time;
                }
                let normal = noise.normal();
                let value = match script.fault(taxel, capacitor, time) {
                    Some(FaultReading::Dead) => self.board.last.dead(),
                    // A stuck line has no noise of its own.
                    Some(FaultReading::Stuck(stuck)) => self.board.read(stuck.at, 0.0).number,
                    None => self.board.read(capacitance[capacitor], normal).number,
                };
                values.push(value);
            }
        }
        values
    }

    /// Half way between the sampling of a unit's first and last capacitor.
    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        (0..self.layout.taxels())
            .map(|taxel| {
                let middle = 0.5 * (self.board.delay(taxel, 0) + self.board.delay(taxel, 3));
                script.force(taxel, start + middle)
            })
            .collect()
    }
}
