//! One array of cells as it was made, under the loads of a script.

use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::device::stream_of;
use crate::quantity::CAPACITANCE;
use crate::stage::{Chain, Memory};
use taxel_numerics::Noise;

/// One array, with what each of its cells remembers.
#[derive(Debug)]
pub(crate) struct Piece {
    chain: Chain,
    memory: Vec<Box<dyn Memory>>,
    /// Signals of the channels at rest.
    rest: Vec<f64>,
    last: Option<f64>,
}

impl Piece {
    pub(crate) fn new(chain: Chain) -> Self {
        let fresh = |memory: &dyn Memory| (0..chain.count()).map(|_| memory.fresh()).collect();
        Self {
            memory: chain.memory.as_deref().map_or_else(Vec::new, fresh),
            rest: chain.rest(),
            last: None,
            chain,
        }
    }

    /// Load on each cell when it is read.
    fn loads(&self, script: &Script<'_>, start: f64) -> Vec<f64> {
        let (chain, area) = (&self.chain, self.chain.area());
        // A pull does not reach what is pressed; a board that gives forces gives pulls, too.
        let pulls = chain.cell(0).is_the_load();
        let load = |cell: usize| {
            let (taxel, axis) = chain.of_cell(cell);
            let least = if pulls || axis < 2 {
                f64::NEG_INFINITY
            } else {
                0.0
            };
            let force = script.force(taxel, start + chain.delay(taxel))[axis];
            (force / area).max(least)
        };
        (0..chain.count()).map(load).collect()
    }
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        let chain = &self.chain;
        let channels = chain.channels_per_taxel();
        stream_of(&chain.layout, channels, chain.period, chain.last.unit())
    }

    /// The network of a frame has each cell as it is when its own channel is read.
    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let mut cell_loads = self.chain.cell_loads(&self.loads(script, start));
        let elapsed = self.last.map_or(0.0, |last| start - last);
        self.last = Some(start);
        for (load, memory) in cell_loads.iter_mut().zip(&mut self.memory) {
            *load = memory.respond(*load, elapsed);
        }
        let signals = self.chain.signals(&self.chain.values(&cell_loads));
        let chain = &self.chain;
        let signal = chain.network.quantity(chain.cell(0).quantity());
        let is_capacitance = signal.dimension == Some(&CAPACITANCE);
        let read = |(channel, signal): (usize, &f64)| {
            let (taxel, axis) = chain.of_channel(channel);
            let (count, normal) = (chain.channels_per_taxel(), noise.normal());
            let fault = script.fault(taxel, channel % count, start + chain.delay(taxel));
            let of_last = chain.last.noise_along(axis);
            let (signal, off) = match fault {
                Some(FaultReading::Dead) => return chain.last.dead(),
                // A capacitor that is stuck has no noise of its own.
                Some(FaultReading::Stuck(stuck)) if is_capacitance => (stuck.at, 0.0),
                // A line that hangs repeats what it read of nothing.
                Some(FaultReading::Stuck(_)) => (self.rest[channel], 0.0),
                None => (*signal, chain.readout.noise().hypot(of_last) * normal),
            };
            chain.last.deliver(chain.input(signal) + off).number
        };
        signals.iter().enumerate().map(read).collect()
    }

    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        let taxels = 0..self.chain.layout.taxels();
        taxels
            .map(|taxel| script.force(taxel, start + self.chain.delay(taxel)))
            .collect()
    }
}
