//! From the frames of a chain back to pressures, stage by stage.

use crate::acquisition::Quantity;
use crate::estimation::{
    ChannelFacts, ChannelReadings, ChannelState, Division, Drift, FrameError, Known, Meaning,
    Picture, Reader, RestRules, Rules, Scale, State, TaxelTouch, Threshold, Total, Touch, Wiring,
    convert_within, counting,
};
use crate::mechanics::ForceAxes;
use crate::quantity::CAPACITANCE;
use crate::signal::NumberScale;
use crate::stage::{CellEstimate, CellLoad, CellState, Chain, Inverted, Memory};

/// Capacitances that were recorded in the place of counts: without steps and a largest value.
const RECORDED_CAPACITANCES: NumberScale = NumberScale {
    ends: [0.0, f64::INFINITY],
    ..NumberScale::VALUES
};

/// A taxel is touched above this many standard deviations of its load: noise alone does so once in
/// 10⁹ frames.
pub(crate) const CONTACT_DEVIATIONS: f64 = 6.0;
/// ... and above this share of the full scale.
pub(crate) const CONTACT_SHARE: f64 = 0.01;
/// A crossing does not conduct if its value is so many standard deviations below half of what is usual
/// at rest: noise alone does that to one crossing in 1000, to a line of two once in 10⁶ frames.
const OPEN_DEVIATIONS: f64 = 3.0;

/// Reads the frames of any [`Chain`]: readout, network, cell and memory are undone one after the
/// other, each with its slope.
#[derive(Debug)]
pub struct ChainReader {
    /// The chain as drawn, and with what a capture at rest gave of its cells.
    drawn: Chain,
    chain: Chain,
    /// Numbers of a frame to signals.
    scale: NumberScale,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    memory: Vec<Box<dyn Memory>>,
    /// Signals of the empty device, and the values of its cells behind them.
    rest: Vec<f64>,
    at_rest: Inverted,
    /// Values of the last frame.
    found: Inverted,
    /// Signals of a frame as they are inverted, and their deviations.
    signals: Vec<f64>,
    noise: Vec<f64>,
    /// Signals at the end of the range that is nearer to each reading, of those that are there.
    ends: Vec<f64>,
    /// Distance between the signals at rest and at full scale of each channel.
    range: Vec<f64>,
    /// True if signals fall under pressure.
    falls: bool,
    /// Load per value of each cell, of the cells that count.
    weights: Vec<f64>,
    /// Cells of each line that several share, and true for each cell of a line that is broken.
    lines: Vec<Vec<usize>>,
    broken: Vec<bool>,
    /// Medians of the values and of the signals at rest, as captured: `NaN` before.
    usual: [f64; 2],
    /// Over the total force, the deviation of what the cells cannot see of it.
    sampling: f64,
    /// The chain with one number off by the deviation that it is made with, to either side, for each
    /// such number in turn, and whether each cell has its own: laws bend.
    made: Vec<(Chain, bool)>,
    /// True for each cell whose values are counted from that at rest.
    tared: Vec<bool>,
    /// What its values are less than those of its law.
    zeros: Vec<f64>,
    /// Load above each cell per load at it, in the last frame.
    gains: Vec<f64>,
    /// Deviation of each load by noise alone.
    by_noise: Vec<f64>,
    /// What the numbers that all cells share add to the sum of the loads, each.
    shared: Vec<f64>,
    /// What those of each cell add to its variance.
    own: Vec<f64>,
}

impl ChainReader {
    /// A reader of the frames of `chain` whose values are `quantity`; `made` has the same chain with
    /// one number off by the deviation that it is made with, to either side, for each such number, and
    /// whether each cell has its own.
    ///
    /// # Errors
    /// [`FrameError::Quantity`] when these cannot be frames of its board.
    pub fn new(
        chain: Chain,
        made: Vec<(Chain, bool)>,
        quantity: Quantity,
    ) -> Result<Self, FrameError> {
        let (count, channels) = (chain.count(), chain.channels());
        let rest = chain.rest();
        let at_full = chain.respond(&vec![chain.full_scale; count]).signals;
        let range: Vec<f64> = rest
            .iter()
            .zip(&at_full)
            // A network of more channels than cells does without a reading.
            .map(|(a, b)| {
                if channels == count {
                    (a - b).abs()
                } else {
                    f64::INFINITY
                }
            })
            .collect();
        let falls = at_full.iter().sum::<f64>() < rest.iter().sum::<f64>();
        let unit = chain.last.unit();
        let signal = chain.network.quantity(chain.cell(0).quantity());
        let recorded = quantity == Quantity::Capacitance;
        let scale = if quantity == unit.quantity {
            chain.scale()
        } else if recorded && signal.dimension == Some(&CAPACITANCE) {
            RECORDED_CAPACITANCES
        } else {
            return Err(FrameError::quantity(quantity, &unit));
        };
        let facts = |channel: usize| {
            let (taxel, axis) = chain.of_channel(channel);
            ChannelFacts {
                deviation: chain.deviation_along(axis) / scale.per_number.abs(),
                resolution: scale.step,
                span: scale.alive(),
                ..ChannelFacts::unknown(!chain.masked[taxel])
            }
        };
        let fresh = |memory: &dyn Memory| (0..count).map(|_| memory.fresh()).collect();
        let at_rest = Inverted {
            values: chain.values(&vec![0.0; count]),
            ..Inverted::default()
        };
        let sampling = chain.cover.as_ref().map_or(0.0, |cover| {
            cover.sampling(chain.cell_area(), chain.layout.pitch)
        });
        Ok(Self {
            meaning: meaning(&chain),
            channels: (0..channels).map(facts).collect(),
            memory: chain.memory.as_deref().map_or_else(Vec::new, fresh),
            found: at_rest.clone(),
            at_rest,
            rest,
            signals: vec![0.0; channels],
            noise: vec![0.0; channels],
            ends: vec![f64::NAN; channels],
            weights: vec![0.0; count],
            tared: vec![false; count],
            zeros: vec![0.0; count],
            lines: chain.network.lines(),
            broken: vec![false; count],
            usual: [f64::NAN; 2],
            gains: vec![1.0; count],
            by_noise: vec![f64::NAN; count],
            shared: vec![0.0; made.len()],
            own: vec![0.0; count],
            made,
            falls,
            range,
            scale,
            sampling,
            drawn: chain.clone(),
            chain,
        })
    }

    /// The chain that is inverted: as drawn, with what a capture at rest gave of its cells.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// What the signals of one frame, SI, say of the load at each cell, without a memory; the noise is
    /// that of the board.
    pub fn estimates(&mut self, signals: &[f64]) -> Vec<CellEstimate> {
        self.signals.copy_from_slice(signals);
        self.noise = self.noise();
        self.invert();
        let largest = self.chain.full_scale;
        let estimate = |cell: usize| {
            let (value, deviation) = (self.found.values[cell], self.found.deviations[cell]);
            let law = self.chain.cell(cell);
            law.estimate(value + self.zeros[cell], deviation, largest)
        };
        (0..self.chain.count()).map(estimate).collect()
    }

    fn invert(&mut self) {
        let network = &self.chain.network;
        network.invert(&self.signals, &self.noise, &mut self.found);
    }

    /// Signals of the readings less their drift. A reading that is missing, or no more than a
    /// bound, is one at its rest value whose deviation is the whole range of its channel: what it
    /// does not say is not known of the cells that share its lines either.
    fn take_signals(&mut self, known: &Known<'_>, channels: &ChannelReadings) {
        for channel in 0..self.signals.len() {
            if channels.states[channel] == ChannelState::Saturated {
                self.ends[channel] -= known.drift(channel);
            }
            let usable = channels.states[channel].usable();
            let reading = channels.readings[channel] - known.drift(channel);
            let variance = known.noise[channel].powi(2) + known.drift_variance(channel);
            (self.signals[channel], self.noise[channel]) = if usable && reading.is_finite() {
                (reading, variance.sqrt())
            } else {
                (self.rest[channel], self.range[channel])
            };
        }
    }

    /// The load at a cell of `chain` at a value, counted from that at rest where it was captured.
    fn cell_load(&self, chain: &Chain, cell: usize, value: f64) -> f64 {
        let law = chain.cell(cell);
        let zero = if self.tared[cell] {
            law.value(0.0) - self.at_rest.values[cell]
        } else {
            0.0
        };
        law.inverse(value + zero, chain.full_scale)
    }

    /// Variance of a load at a cell by what is made otherwise than drawn, of the cell alone: of each
    /// number the mean of what either side is off by, or what one is where the other is beyond the law.
    fn variance_as_made(&self, cell: usize, cell_load: f64) -> f64 {
        let value = self.found.values[cell];
        let off =
            |(chain, _): &(Chain, bool)| (self.cell_load(chain, cell, value) - cell_load).abs();
        let sides = self.made.chunks(2);
        let own = sides.filter(|sides| sides.iter().all(|(_, per_cell)| *per_cell));
        let of_number = |sides: &[(Chain, bool)]| {
            let within = sides.iter().map(off).filter(|off| !off.is_nan());
            let [sum, count] = within.fold([0.0; 2], |[sum, count], off| [sum + off, count + 1.0]);
            if count > 0.0 {
                sum / count
            } else {
                // At least as far as the end of the law.
                self.chain.full_scale - cell_load
            }
        };
        own.map(of_number).map(|off| off * off).sum()
    }

    /// What the reading of a cell says of the load at it.
    fn estimate(&self, cell: usize, state: ChannelState) -> (CellEstimate, State) {
        let (law, largest) = (self.chain.cell(cell), self.chain.full_scale);
        let nothing = |state| (CellEstimate::nothing(CellState::Impossible), state);
        let saturated = |load| {
            let bound = CellEstimate::bound(load, CellState::Saturated);
            (bound, State::Saturated)
        };
        let value = self.found.values[cell];
        match state {
            ChannelState::Masked => nothing(State::Masked),
            ChannelState::Faulty => nothing(State::Faulty),
            _ if self.broken[cell] => nothing(State::Faulty),
            ChannelState::Saturated if !law.saturates() => nothing(State::Faulty),
            ChannelState::Saturated if law.is_the_load() => {
                saturated(self.ends[cell] + self.zeros[cell])
            }
            // A signal that falls under load is at its high end where nothing presses.
            ChannelState::Saturated if self.falls => nothing(State::Saturated),
            ChannelState::Saturated => saturated(largest),
            _ if !self.found.converged => nothing(State::NotConverged),
            _ if value.is_nan() => nothing(State::Inconsistent),
            _ if self
                .found
                .states
                .get(cell)
                .is_some_and(|of| *of != CellState::Ok) =>
            {
                let (of, deviation) = (self.found.states[cell], self.found.deviations[cell]);
                let estimate = match of {
                    CellState::Inconsistent => CellEstimate {
                        load: value + self.zeros[cell],
                        deviation,
                        state: of,
                    },
                    _ => CellEstimate::bound(value + self.zeros[cell], of),
                };
                (estimate, state_of(of))
            }
            _ => {
                let value = value + self.zeros[cell];
                let estimate = law.estimate(value, self.found.deviations[cell], largest);
                (estimate, state_of(estimate.state))
            }
        }
    }

    /// Finds the lines that are broken: no crossing of theirs has, within its noise, half of what is
    /// usual at rest. A load adds to that, wherever it is. Where no values read like this frame, the
    /// signals are asked in their place, and the frame is read without those lines.
    fn find_broken(&mut self, channels: &ChannelReadings) {
        self.broken.fill(false);
        let (found, [usual, usual_signal]) = (&self.found, self.usual);
        let is_open = |cell: &usize| match channels.states[*cell] {
            ChannelState::Masked | ChannelState::Faulty => true,
            // A resistance is at its high end where nothing conducts.
            ChannelState::Saturated => self.falls,
            _ if found.converged => {
                found.values[*cell] + OPEN_DEVIATIONS * found.deviations[*cell] < 0.5 * usual
            }
            _ => {
                let (signal, off) = (self.signals[*cell], OPEN_DEVIATIONS * self.noise[*cell]);
                if self.falls {
                    signal - off > 2.0 * usual_signal
                } else {
                    signal + off < 0.5 * usual_signal
                }
            }
        };
        let mut any = false;
        for line in self.lines.iter().filter(|line| line.iter().all(is_open)) {
            any = true;
            for cell in line {
                self.broken[*cell] = true;
            }
        }
        if any && !self.found.converged {
            for (signal, broken) in self.signals.iter_mut().zip(&self.broken) {
                if *broken {
                    *signal = f64::NAN;
                }
            }
            self.found.values.clone_from(&self.at_rest.values);
            self.invert();
        }
    }

    /// Load on a cell with its standard deviation.
    fn load(&mut self, cell: usize, channel: ChannelState, elapsed: f64) -> ([f64; 2], State) {
        let (estimate, state) = self.estimate(cell, channel);
        let [load, gain] = match self.memory.get_mut(cell) {
            // Without a reading the load at the cell is taken not to have changed.
            Some(memory) if channel.usable() => memory.recover(estimate.load, elapsed),
            _ => [estimate.load, 1.0],
        };
        self.gains[cell] = gain;
        let by_noise = gain * estimate.deviation.abs();
        if self.is_independent() {
            return ([load, by_noise], state);
        }
        // What the network knows of its make stays the same from frame to frame.
        let of_frame = self.found.by_noise.get(cell);
        self.by_noise[cell] = of_frame.map_or(by_noise, |of_frame| gain * of_frame);
        (self.weights[cell], self.own[cell]) = (0.0, 0.0);
        if state == State::Ok {
            self.own[cell] = gain * gain * self.variance_as_made(cell, estimate.load);
            self.weights[cell] = gain * estimate.deviation / self.found.deviations[cell];
        }
        ([load, by_noise.hypot(self.own[cell].sqrt())], state)
    }

    /// Touch on a taxel from the values of its cells.
    fn taxel(&mut self, taxel: usize, channels: &mut ChannelReadings, elapsed: f64) -> TaxelTouch {
        let axes = self.chain.axes;
        let mut touch = TaxelTouch::without_value(State::Ok);
        if axes == ForceAxes::Xyz {
            touch.covariance = [[0.0; 3]; 3];
        }
        let cells = axes.count() * taxel..axes.count() * (taxel + 1);
        for cell in cells.clone() {
            let channel = self.chain.channel_of(cell);
            let reading = match channel {
                Some(channel) => channels.states[channel],
                None if self.chain.masked[taxel] => ChannelState::Masked,
                None => ChannelState::Ok,
            };
            let ([mut load, mut deviation], mut state) = self.load(cell, reading, elapsed);
            match channel {
                Some(channel) if state == State::Faulty && reading.usable() => {
                    channels.states[channel] = ChannelState::Faulty;
                }
                // Too few of its readings are there to tell: what is expected of any load is no value.
                None if state == State::Ambiguous => {
                    state = self.missing(taxel, channels);
                    (load, deviation) = (f64::NAN, f64::NAN);
                }
                _ => {}
            }
            let (_, axis) = self.chain.of_cell(cell);
            touch.value[axis] = load;
            touch.covariance[axis][axis] = deviation * deviation;
            if severity(state) > severity(touch.state) {
                touch.state = state;
            }
        }
        if axes == ForceAxes::Xyz && !self.found.spread.is_empty() {
            for (one, other) in cells
                .clone()
                .flat_map(|a| cells.clone().map(move |b| (a, b)))
            {
                let [i, j] = [one, other].map(|cell| self.chain.of_cell(cell).1);
                if i != j {
                    touch.covariance[i][j] =
                        self.found.covariance(one, other) * self.gains[one] * self.gains[other];
                }
            }
        }
        if let Some(misfit) = self.found.misfits.get(taxel) {
            touch.residual = *misfit;
        }
        touch
    }

    /// Why the readings of a taxel do not tell its load.
    fn missing(&self, taxel: usize, channels: &ChannelReadings) -> State {
        let count = self.chain.channels_per_taxel();
        let of_taxel = &channels.states[count * taxel..count * (taxel + 1)];
        match of_taxel.iter().max_by_key(|state| **state as u8) {
            Some(ChannelState::Saturated) => State::Saturated,
            Some(ChannelState::Faulty) => State::Faulty,
            _ => State::Ambiguous,
        }
    }

    /// Adds what the numbers that all cells share are made otherwise than drawn: each moves all
    /// pressures together.
    fn add_shared(&mut self, touch: &mut Touch) {
        for index in 0..self.made.len() {
            self.shared[index] = 0.0;
            let (chain, per_cell) = &self.made[index];
            if *per_cell {
                continue;
            }
            let mut moved = self.found.clone();
            chain.network.invert(&self.signals, &self.noise, &mut moved);
            if !moved.converged {
                continue;
            }
            for (taxel, touch) in touch.taxels.iter_mut().enumerate() {
                let cell_load = |value| self.cell_load(&self.chain, taxel, value);
                let off = cell_load(moved.values[taxel]) - cell_load(self.found.values[taxel]);
                if touch.state == State::Ok && off.is_finite() {
                    touch.covariance[2][2] += 0.5 * off * off;
                    self.shared[index] += off;
                }
            }
        }
    }
}

impl Reader for ChainReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn set_steps(&mut self, steps: &[f64]) {
        ChannelFacts::coarsen(&mut self.channels, steps);
    }

    fn rules(&self) -> Rules {
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(
                CONTACT_DEVIATIONS,
                CONTACT_SHARE * self.chain.full_scale,
            ),
            counted: if self.chain.cell(0).is_the_load() {
                counting(&[State::Ok, State::Saturated])
            } else {
                counting(&[State::Ok])
            },
            total: Total::Counted,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: self.chain.channels_per_taxel(),
                unit: "taxel",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        let along = |channel| self.chain.deviation_along(self.chain.of_channel(channel).1);
        (0..self.rest.len()).map(along).collect()
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        let clipped = convert_within(&self.scale, values, channels);
        if clipped > 0 {
            let [low, high] = self.scale.ends;
            for (end, value) in self.ends.iter_mut().zip(values) {
                *end = self.scale.input(if *value <= low { low } else { high });
            }
        }
        clipped
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        self.take_signals(known, &touch.channels);
        self.invert();
        self.find_broken(&touch.channels);
        let elapsed = known.elapsed.unwrap_or(0.0);
        for taxel in 0..touch.taxels.len() {
            touch.taxels[taxel] = self.taxel(taxel, &mut touch.channels, elapsed);
        }
        self.add_shared(touch);
        // The next search begins where this one ended, unless that is nowhere.
        for (value, rest) in self.found.values.iter_mut().zip(&self.at_rest.values) {
            if !value.is_finite() {
                *value = *rest;
            }
        }
    }

    fn sum_variance(&self, sum: f64) -> Option<f64> {
        if self.is_independent() {
            return None;
        }
        let by_noise = self.found.variance_of_sum(&self.weights);
        let as_made = self.own.iter().sum::<f64>()
            + self.shared.iter().map(|off| 0.5 * off * off).sum::<f64>();
        Some(by_noise + as_made + (self.sampling * sum).powi(2))
    }

    fn spreads_loads(&self) -> bool {
        self.sampling > 0.0
    }

    fn by_noise(&self, taxel: usize) -> Option<f64> {
        let pressing = self.chain.axes.count() * (taxel + 1) - 1;
        (!self.is_independent()).then(|| self.by_noise[pressing])
    }

    fn rest_problem(&self, unit: usize, rest: &[f64]) -> Option<String> {
        let cells = self.drawn.channels_per_taxel() * unit..;
        let of_each = cells.zip(rest).filter(|(_, rest)| !rest.is_nan());
        let mut problems =
            of_each.filter_map(|(channel, rest)| self.drawn.cell(channel).rest_problem(*rest));
        problems
            .next()
            .map(|problem| format!("taxel {unit} {problem}"))
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        self.chain = self.drawn.clone();
        self.tared = rest.iter().map(|rest| !rest.is_nan()).collect();
        let taken = rest.iter().zip(self.drawn.rest());
        self.rest = taken
            .map(|(rest, drawn)| if rest.is_nan() { drawn } else { *rest })
            .collect();
        let at_rest = self.drawn.values(&vec![0.0; self.drawn.count()]);
        self.usual = [f64::NAN; 2];
        if let Some(chain) = self.drawn.at_rest(rest) {
            self.chain = chain;
            self.tared.fill(false);
            self.at_rest.values = at_rest;
            self.begin_anew();
            return;
        }
        let noise = self.noise();
        self.at_rest.values.clone_from(&at_rest);
        let network = &self.drawn.network;
        network.invert(&self.rest, &noise, &mut self.at_rest);
        for (cell, drawn) in at_rest.into_iter().enumerate() {
            let value = &mut self.at_rest.values[cell];
            if !value.is_finite() {
                *value = drawn;
            }
            let law = self.drawn.cell(cell).at_rest(*value);
            if let Some(law) = law.filter(|_| self.tared[cell]) {
                self.tared[cell] = false;
                self.chain.set_cell(cell, law);
            }
            self.zeros[cell] = if self.tared[cell] {
                drawn - self.at_rest.values[cell]
            } else {
                0.0
            };
        }
        self.usual = [&self.at_rest.values, &self.rest].map(|of| {
            let captured = of.iter().zip(rest).filter(|(_, rest)| !rest.is_nan());
            let mut captured: Vec<f64> = captured.map(|(of, _)| *of).collect();
            captured.sort_by(f64::total_cmp);
            captured
                .get(captured.len() / 2)
                .copied()
                .unwrap_or(f64::NAN)
        });
        self.begin_anew();
    }
}

impl ChainReader {
    /// Nothing has pressed any cell.
    fn begin_anew(&mut self) {
        self.found.values.clone_from(&self.at_rest.values);
        for memory in &mut self.memory {
            *memory = memory.fresh();
        }
    }

    /// True if the errors of the loads are those of the noise of their own channels.
    fn is_independent(&self) -> bool {
        self.made.is_empty() && self.found.spread.is_empty() && self.sampling == 0.0
    }
}

fn state_of(state: CellState) -> State {
    match state {
        CellState::Ok => State::Ok,
        CellState::BelowRest => State::BelowZero,
        CellState::Beyond => State::OutOfRange,
        CellState::Ambiguous => State::Ambiguous,
        CellState::Saturated => State::Saturated,
        CellState::Impossible => State::Faulty,
        CellState::Inconsistent => State::Inconsistent,
    }
}

/// Order in which the states of the forces of a taxel become that of the taxel.
fn severity(state: State) -> u8 {
    match state {
        State::Masked => 4,
        State::Faulty => 3,
        State::Saturated => 2,
        State::Ok => 0,
        _ => 1,
    }
}

fn meaning(chain: &Chain) -> Meaning {
    let (layout, axes) = (&chain.layout, chain.axes);
    let signal = chain.network.quantity(chain.cell(0).quantity());
    let board = chain.last.unit();
    let (unit, si_per_unit, _) = signal.unit;
    let name = |channel: usize| {
        let taxel = chain.of_channel(channel).0;
        let (row, column) = (taxel / layout.columns, taxel % layout.columns);
        let along = axes.names()[channel % axes.count()];
        let per_taxel = chain.channels_per_taxel();
        if let Some(name) = chain.network.channel_name(channel % per_taxel) {
            format!("r{row}c{column}.{name}")
        } else if per_taxel > axes.count() {
            let sensor = channel % per_taxel / axes.count();
            format!("r{row}c{column}.s{sensor}.{along}")
        } else if chain.cell(channel).is_the_load() {
            format!("r{row}c{column}.{along}")
        } else {
            format!("row {row}, column {column}")
        }
    };
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (0..chain.channels()).map(name).collect(),
        wiring: Wiring::PerTaxel(chain.channels_per_taxel()),
        reading: Scale::of(&board, Scale::new(signal.name, unit, si_per_unit)),
        value: match chain.cell(0).load() {
            CellLoad::Pressure => Scale::new("pressure", "kPa", 1e3),
            CellLoad::Force => Scale::of(&board, Scale::new("force", "N", 1.0)),
        },
        components: axes.count(),
        signed: axes == ForceAxes::Xyz,
        full_scale: Some(chain.full_scale),
        verified: None,
        picture: Picture::Heat,
        newtons: Some(chain.sides()),
        total_known: true,
    }
}
