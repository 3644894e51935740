//! One made array: forces on the cover to charge, output and the numbers of a frame.

use super::PiezoelectricArray;
use crate::acquisition::{FaultReading, Script, Simulated, Stream};
use crate::electronics::ChargeBoard;
use crate::layout::Layout;
use crate::mechanics::{Base, ContactPressure, ShareTable, ShearTable, SoftCover};
use taxel_numerics::Noise;
use taxel_numerics::linear_chain::{Chain, Memory, Step};

/// One piece of fabrication with the charge on its elements.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    layout: Layout,
    side: f64,
    depth: f64,
    gains: Vec<f64>,
    board: ChargeBoard,
    /// Output voltage per force on an element; none for a board that is no
    /// stable chain, which the check of the sensor file refuses.
    chain: Option<Chain>,
    step: Option<Step>,
    /// Memory of each element and the time of its last sample, s.
    elements: Vec<(Memory, f64)>,
    /// Shares of the contact radii that have occurred, m.
    tables: Vec<(f64, ShareTable)>,
    /// The same of those that came with a shear force.
    shear_tables: Vec<(f64, ShearTable)>,
    /// Output of the channel read last, V: a multiplexer may still hold it.
    held: f64,
}

impl Piece {
    pub(super) fn new(array: &PiezoelectricArray<'_>) -> Self {
        let chain = Chain::new(&array.output_per_force()).ok();
        let taxels = array.layout().taxels();
        let rest = chain.as_ref().map(|chain| (chain.settled(0.0), 0.0));
        Self {
            layout: array.layout(),
            side: array.description.ceramic.side,
            depth: array.description.depth(),
            gains: array.description.fabricate(taxels),
            step: chain.as_ref().map(|chain| chain.step(array.board.period())),
            elements: rest.map_or(Vec::new(), |rest| vec![rest; taxels]),
            board: array.board.clone(),
            chain,
            tables: Vec::new(),
            shear_tables: Vec::new(),
            held: 0.0,
        }
    }

    /// Makes the tables for all contacts at `time`, s.
    fn prepare(&mut self, script: &Script<'_>, time: f64) {
        for patch in script.patches(time) {
            if self
                .tables
                .iter()
                .all(|(radius, _)| *radius != patch.radius)
            {
                let table = self.cover(patch.radius).table();
                self.tables.push((patch.radius, table));
            }
            let known = |(radius, _): &(f64, ShearTable)| *radius == patch.radius;
            if shears(patch.force) && !self.shear_tables.iter().any(known) {
                let table = self.cover(patch.radius).shear_table();
                self.shear_tables.push((patch.radius, table));
            }
        }
    }

    fn cover(&self, radius: f64) -> SoftCover {
        SoftCover {
            thickness: self.depth,
            base: Base::Rigid,
            contact: ContactPressure::Hertz(radius),
        }
    }

    /// Normal force on an element at `time`, s, N: probes stand on it, of a
    /// patch the cover passes on its share. The shear of a patch is spread like its pressure,
    /// as by sliding friction.
    fn force(&self, script: &Script<'_>, taxel: usize, time: f64) -> f64 {
        let [x, y] = self.layout.flat_position(taxel);
        let mut force = script.probe_force(taxel, time)[2];
        for patch in script.patches(time) {
            let offset = [x - patch.centre[0], y - patch.centre[1]];
            let table = self
                .tables
                .iter()
                .find(|(radius, _)| *radius == patch.radius);
            let share = match table {
                Some((_, table)) => table.share(offset, self.side),
                None => self.cover(patch.radius).share(offset, self.side),
            };
            force += share * patch.force[2];
            if shears(patch.force) {
                let table = self
                    .shear_tables
                    .iter()
                    .find(|(radius, _)| *radius == patch.radius);
                let [along_x, along_y] = match table {
                    Some((_, table)) => table.shares(offset, self.side),
                    None => self.cover(patch.radius).shear_shares(offset, self.side),
                };
                force += along_x * patch.force[0] + along_y * patch.force[1];
            }
        }
        force
    }

    /// Ideal output of an element at `time`, s, V.
    fn output(&mut self, script: &Script<'_>, taxel: usize, time: f64) -> f64 {
        let force = self.force(script, taxel, time) * self.gains[taxel];
        let (Some(chain), Some(usual)) = (&self.chain, &self.step) else {
            return 0.0;
        };
        let (memory, last) = &mut self.elements[taxel];
        let elapsed = time - *last;
        *last = time;
        let period = self.board.period();
        if (elapsed - period).abs() < 1e-9 * period {
            chain.advance(memory, usual, force)
        } else {
            chain.advance(memory, &chain.step(elapsed.max(0.0)), force)
        }
    }
}

/// True if a force has a part along the surface.
fn shears(force: [f64; 3]) -> bool {
    force[0] != 0.0 || force[1] != 0.0
}

impl Simulated for Piece {
    fn stream(&self) -> Stream {
        crate::device::stream_of(&self.layout, 1, self.board.period(), self.board.last.unit())
    }

    fn scan(&mut self, script: &Script<'_>, start: f64, noise: &mut Noise) -> Vec<f64> {
        let carried = self.board.carried_over();
        let mut values = Vec::with_capacity(self.layout.taxels());
        for taxel in 0..self.layout.taxels() {
            let time = start + self.board.delay(taxel);
            self.prepare(script, time);
            let settled = self.output(script, taxel, time);
            let voltage = settled + carried * (self.held - settled);
            self.held = voltage;
            let number = self.board.read(voltage, noise.normal()).number;
            values.push(match script.fault(taxel, 0, time) {
                Some(FaultReading::Dead) => self.board.last.dead(),
                // No signal comes: the rest voltage without noise.
                Some(FaultReading::Stuck(_)) => self.board.read(0.0, 0.0).number,
                None => number,
            });
        }
        values
    }

    fn true_forces(&self, script: &Script<'_>, start: f64) -> Vec<[f64; 3]> {
        (0..self.layout.taxels())
            .map(|taxel| {
                let time = start + self.board.delay(taxel);
                [0.0, 0.0, self.force(script, taxel, time)]
            })
            .collect()
    }
}
