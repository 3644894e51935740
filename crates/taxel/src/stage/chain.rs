//! Five parts in a row, and what follows from their order alone.

use super::{
    Board, CellLaw, CellLoad, ChainPart, Cover, Memory, Network, OneToOne, PartParameter,
    ReadoutLaw,
};
use crate::electronics::{LastStage, Scan};
use crate::layout::Layout;
use crate::mechanics::ForceAxes;
use crate::signal::NumberScale;

/// Parts of an array of cells, from the load to the numbers of a frame.
///
/// # Example: from a pressure to a conductance to a voltage
/// ```
/// let sensor = taxel::sensor::Sensor::shipped("resistive-mat-8x8").unwrap();
/// let device = sensor.cells().unwrap();
/// let chain = device.chain();
/// let mut pressures = vec![0.0; 64];
/// pressures[27] = 50e3; // Pa
/// let response = chain.respond(&pressures);
/// assert!(response.values[27] > 10.0 * response.values[0]); // S
/// assert!(response.signals[27] > 10.0 * response.signals[0]); // A per V
/// ```
#[derive(Debug)]
pub struct Chain {
    /// Where the taxels are.
    pub layout: Layout,
    /// Which forces of a taxel have a cell; the pressing one alone of a chain with a cover.
    pub axes: ForceAxes,
    /// What spreads the pressure; none where each cell takes what acts on its own pitch.
    pub cover: Option<Box<dyn Cover>>,
    /// The law of each cell, or one for all.
    cells: Vec<Box<dyn CellLaw>>,
    /// What joins the cells to channels.
    pub network: Box<dyn Network>,
    /// What makes numbers of signals.
    pub readout: Box<dyn ReadoutLaw>,
    /// Stage that makes the numbers of a frame.
    pub last: LastStage,
    /// Order of reading.
    pub scan: Scan,
    /// Time between frames, s.
    pub period: f64,
    /// Memory of a cell that nothing has pressed; none where the cells follow a load at once.
    pub memory: Option<Box<dyn Memory>>,
    /// Load up to which the laws hold, Pa or N.
    pub full_scale: f64,
    /// Taxels that are not used.
    pub masked: Vec<bool>,
    /// Shares of [`Cover::share`] by the distance in rows and columns, as far as it reaches.
    spread: Vec<Vec<f64>>,
}

/// Response of all cells and channels.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainResponse {
    /// Load at each cell, Pa or N.
    pub cell_loads: Vec<f64>,
    /// Value of each cell, SI.
    pub values: Vec<f64>,
    /// Signal of each channel, SI.
    pub signals: Vec<f64>,
}

/// The parts of a [`Chain`] beside those of the board.
#[derive(Debug)]
pub struct Parts {
    /// What spreads the pressure.
    pub cover: Option<Box<dyn Cover>>,
    /// The law of all cells.
    pub cell: Box<dyn CellLaw>,
    /// Which forces of a taxel have a cell.
    pub axes: ForceAxes,
    /// What joins the cells to channels.
    pub network: Box<dyn Network>,
    /// Memory of a cell.
    pub memory: Option<Box<dyn Memory>>,
    /// Load up to which the laws hold, Pa or N.
    pub full_scale: f64,
}

impl Parts {
    /// Cells that are read one by one, without cover and memory.
    pub fn of_cell(cell: Box<dyn CellLaw>, full_scale: f64) -> Self {
        Self {
            cover: None,
            cell,
            axes: ForceAxes::Z,
            network: Box::new(OneToOne),
            memory: None,
            full_scale,
        }
    }
}

impl Clone for Chain {
    fn clone(&self) -> Self {
        Self {
            layout: self.layout.clone(),
            axes: self.axes,
            cover: self.cover.as_ref().map(|cover| cover.boxed()),
            cells: self.cells.iter().map(|cell| cell.boxed()).collect(),
            network: self.network.boxed(),
            readout: self.readout.boxed(),
            last: self.last,
            scan: self.scan,
            period: self.period,
            memory: self.memory.as_ref().map(|memory| memory.fresh()),
            full_scale: self.full_scale,
            masked: self.masked.clone(),
            spread: self.spread.clone(),
        }
    }
}

impl Chain {
    /// The chain of these parts on `layout`.
    pub fn new(layout: Layout, parts: Parts, board: Board, masked: Vec<bool>) -> Self {
        let mut chain = Self {
            layout,
            axes: parts.axes,
            cover: parts.cover,
            cells: parts.cell.each(),
            network: parts.network,
            readout: board.readout,
            last: board.last,
            scan: board.scan,
            period: board.period,
            memory: parts.memory,
            full_scale: parts.full_scale,
            masked,
            spread: Vec::new(),
        };
        chain.settle();
        chain
    }

    /// Computes what follows from the numbers of the parts.
    fn settle(&mut self) {
        let layout = &self.layout;
        // A cover that does not fit is refused by the check of the device.
        let cover = self
            .cover
            .as_ref()
            .filter(|cover| cover.fits(layout.pitch).is_ok());
        self.spread = cover.map_or_else(Vec::new, |cover| {
            let offsets = |pitch: f64, lines: usize| -> Vec<f64> {
                let reached = ((cover.reach() / pitch) as usize).min(lines - 1);
                (0..=reached).map(|line| line as f64 * pitch).collect()
            };
            let x = offsets(layout.pitch[0], layout.columns);
            let y = offsets(layout.pitch[1], layout.rows);
            let shares = cover.shares(self.cell_area(), layout.pitch, [&x, &y]);
            shares.chunks(x.len()).map(<[f64]>::to_vec).collect()
        });
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.axes.count() * self.layout.taxels()
    }

    /// Taxel of a cell, and the axis of its load among x, y and z.
    pub fn of_cell(&self, cell: usize) -> (usize, usize) {
        let count = self.axes.count();
        (cell / count, self.axes.first() + cell % count)
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.network.channels(self.count())
    }

    /// Number of channels of a taxel.
    pub fn channels_per_taxel(&self) -> usize {
        self.channels() / self.layout.taxels()
    }

    /// Taxel of a channel, and its axis among x, y and z.
    pub fn of_channel(&self, channel: usize) -> (usize, usize) {
        let axis = self.axes.first() + channel % self.axes.count();
        (channel / self.channels_per_taxel(), axis)
    }

    /// The channel of a cell; none where a network makes more channels than it has cells.
    pub fn channel_of(&self, cell: usize) -> Option<usize> {
        (self.channels() == self.count()).then_some(cell)
    }

    /// The chain whose channels read these signals without a load, where its network has a law of
    /// that.
    #[must_use]
    pub fn at_rest(&self, signals: &[f64]) -> Option<Self> {
        let network = self.network.at_rest(signals)?;
        Some(Self {
            network,
            ..self.clone()
        })
    }

    /// Gives a cell a law of its own.
    pub fn set_cell(&mut self, index: usize, law: Box<dyn CellLaw>) {
        if self.cells.len() == 1 && self.count() > 1 {
            self.cells = (0..self.count()).map(|_| self.cells[0].boxed()).collect();
        }
        self.cells[index] = law;
    }

    /// Number of laws: one for all cells, or that of the cells.
    pub fn laws(&self) -> usize {
        self.cells.len()
    }

    /// The law of a cell.
    pub fn cell(&self, index: usize) -> &dyn CellLaw {
        self.cells[index.min(self.cells.len() - 1)].as_ref()
    }

    /// Sides of the area that the load of a cell acts on, m; where it is not known the pitch, which is
    /// the most.
    pub fn cell_area(&self) -> [f64; 2] {
        self.cells[0].area().unwrap_or(self.layout.pitch)
    }

    /// Factors that turn a load of a cell into the force on its taxel: the sides of its pitch, m, or 1.
    pub fn sides(&self) -> [f64; 2] {
        match self.cells[0].load() {
            CellLoad::Pressure => self.layout.pitch,
            CellLoad::Force => [1.0; 2],
        }
    }

    /// Force on a taxel per load of its cell: the area of its pitch, m², or 1.
    pub fn area(&self) -> f64 {
        let [x, y] = self.sides();
        x * y
    }

    /// Load at each cell under the loads on the surface, in the same unit.
    pub fn cell_loads(&self, loads: &[f64]) -> Vec<f64> {
        let Some(last_row) = self.spread.len().checked_sub(1) else {
            return loads.to_vec();
        };
        let (columns, last_column) = (self.layout.columns, self.spread[0].len() - 1);
        let mut cell_loads = vec![0.0; loads.len()];
        for (source, load) in loads.iter().enumerate().filter(|(_, p)| **p != 0.0) {
            let (row, column) = (source / columns, source % columns);
            let rows = row.saturating_sub(last_row)..(row + last_row + 1).min(self.layout.rows);
            for at in rows {
                let shares = &self.spread[at.abs_diff(row)];
                let first = column.saturating_sub(last_column);
                for to in first..(column + last_column + 1).min(columns) {
                    cell_loads[at * columns + to] += load * shares[to.abs_diff(column)];
                }
            }
        }
        cell_loads
    }

    /// Value of each cell under the load at it.
    pub fn values(&self, cell_loads: &[f64]) -> Vec<f64> {
        let each = cell_loads.iter().enumerate();
        each.map(|(index, p)| self.cell(index).value(*p)).collect()
    }

    /// Signal of each channel at the values of the cells.
    pub fn signals(&self, values: &[f64]) -> Vec<f64> {
        let mut signals = vec![0.0; self.network.channels(values.len())];
        self.network.read(values, &mut signals);
        signals
    }

    /// The whole way at rest of all memory, from the loads on the surface: of each cell the mean
    /// pressure on its pitch, Pa, or the force on its taxel, N.
    pub fn respond(&self, loads: &[f64]) -> ChainResponse {
        let cell_loads = self.cell_loads(loads);
        let values = self.values(&cell_loads);
        let signals = self.signals(&values);
        ChainResponse {
            cell_loads,
            values,
            signals,
        }
    }

    /// Signals of all channels at rest.
    pub fn rest(&self) -> Vec<f64> {
        self.respond(&vec![0.0; self.count()]).signals
    }

    /// Slopes of all signals by the loads along `direction` at `loads`: a central
    /// difference over a thousandth of the full scale, which every law resolves.
    pub fn slopes(&self, loads: &[f64], direction: &[f64]) -> Vec<f64> {
        let step = 1e-3 * self.full_scale;
        let [low, high] = [-step, step].map(|step| {
            let moved = loads.iter().zip(direction).map(|(p, d)| p + step * d);
            self.respond(&moved.collect::<Vec<_>>()).signals
        });
        let pairs = high.iter().zip(&low);
        pairs
            .map(|(high, low)| (high - low) / (2.0 * step))
            .collect()
    }

    /// Standard deviation of one reading of a pressing load as a signal, SI: noise, and rounding to
    /// counts.
    pub fn deviation(&self) -> f64 {
        self.deviation_along(2)
    }

    /// The same of a load along x, y or z.
    pub fn deviation_along(&self, axis: usize) -> f64 {
        let of_last = self.last.deviation_along(axis);
        self.readout.deviation(self.readout.noise().hypot(of_last))
    }

    /// Input of the last stage at a signal.
    pub fn input(&self, signal: f64) -> f64 {
        self.readout.input(signal)
    }

    /// Numbers of a frame to signals.
    pub fn scale(&self) -> NumberScale {
        self.readout.scale(self.last.scale())
    }

    /// Sampling time of a taxel after the start of the frame, s.
    pub fn delay(&self, taxel: usize) -> f64 {
        let columns = self.layout.columns;
        self.scan.delay(taxel / columns, taxel % columns, columns)
    }

    /// The parts with the keys by which `check` names them, in the order of the signal.
    pub fn stages(&self) -> Vec<&dyn ChainPart> {
        let cover = self.cover.as_deref().map(|cover| cover as &dyn ChainPart);
        let cell: &dyn ChainPart = self.cells[0].as_ref();
        let (network, readout): (&dyn ChainPart, &dyn ChainPart) =
            (self.network.as_ref(), self.readout.as_ref());
        cover.into_iter().chain([cell, network, readout]).collect()
    }

    /// Shows each number of the parts to `each`, which may change it: numbers of cells once, for
    /// all cells together.
    pub fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        if let Some(cover) = &mut self.cover {
            cover.parameters(each);
        }
        for cell in &mut self.cells {
            cell.parameters(each);
        }
        self.network.parameters(each);
        self.readout.parameters(each);
        self.settle();
    }

    /// The same chain as it may have been made: every number whose deviation `fabrication` states,
    /// over its value as drawn, is off by that times a number of `normal`; numbers of a cell for
    /// each cell anew.
    #[must_use]
    pub fn scattered(
        &self,
        fabrication: &dyn Fn(&str) -> Option<f64>,
        normal: &mut dyn FnMut() -> f64,
    ) -> Self {
        let mut chain = self.clone();
        let scattered_cells = {
            let mut any = false;
            chain.cells[0]
                .parameters(&mut |parameter, _| any |= fabrication(parameter.name).is_some());
            any
        };
        if scattered_cells && chain.cells.len() == 1 {
            chain.cells = (0..chain.count()).map(|_| chain.cells[0].boxed()).collect();
        }
        chain.parameters(&mut |parameter, value| {
            if let Some(share) = fabrication(parameter.name) {
                *value += parameter.off(*value, share) * normal();
            }
        });
        chain
    }
}
