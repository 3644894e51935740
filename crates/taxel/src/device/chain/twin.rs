//! One array of cells as it was made, under the loads of a script.

use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::device::stream_of;
use crate::stage::{Chain, Memory};
use taxel_numerics::Noise;

/// One array, with what each of its cells remembers.
#[derive(Debug)]
pub(super) struct Piece {
    chain: Chain,
    memory: Vec<Box<dyn Memory>>,
    /// Signals of the channels at rest.
    rest: Vec<f64>,
    last: Option<f64>,
}

impl Piece {
    pub(super) fn new(chain: Chain) -> Self {
        let fresh = |memory: &dyn Memory| (0..chain.count()).map(|_| memory.fresh()).collect();
        Self {
            memory: chain.memory.as_deref().map_or_else(Vec::new, fresh),
            rest: chain.rest(),
            last: None,
            chain,
        }
    }

    /// Mean pressure on the pitch of each cell when it is read, Pa.
    fn pressures(&self, script: &Script<'_>, start: f64) -> Vec<f64> {
        let area = self.chain.area();
        let cells = 0..self.chain.count();
        cells
            .map(|cell| script.force(cell, start + self.chain.delay(cell))[2] / area)
            .collect()
    }
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        let chain = &self.chain;
        stream_of(&chain.layout, 1, chain.period, chain.last.unit())
    }

    /// The network of a frame has each cell as it is when its own channel is read.
    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let mut cell_loads = self.chain.cell_loads(&self.pressures(script, start));
        let elapsed = self.last.map_or(0.0, |last| start - last);
        self.last = Some(start);
        for (load, memory) in cell_loads.iter_mut().zip(&mut self.memory) {
            *load = memory.respond(*load, elapsed);
        }
        let signals = self.chain.signals(&self.chain.values(&cell_loads));
        let noise_of_input = self.chain.readout.noise().hypot(self.chain.last.noise());
        let read = |(cell, signal): (usize, &f64)| {
            let off = noise_of_input * noise.normal();
            let time = start + self.chain.delay(cell);
            let signal = match script.fault(cell, 0, time) {
                Some(FaultReading::Dead) => return self.chain.last.dead(),
                // A line that hangs repeats what it read of nothing.
                Some(FaultReading::Stuck(_)) => {
                    return self
                        .chain
                        .last
                        .deliver(self.chain.input(self.rest[cell]))
                        .number;
                }
                None => *signal,
            };
            self.chain
                .last
                .deliver(self.chain.input(signal) + off)
                .number
        };
        signals.iter().enumerate().map(read).collect()
    }

    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        let cells = 0..self.chain.count();
        cells
            .map(|cell| script.force(cell, start + self.chain.delay(cell)))
            .collect()
    }
}
