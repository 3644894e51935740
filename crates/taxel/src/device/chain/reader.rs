//! From the frames of a chain back to pressures, stage by stage.

use crate::acquisition::SignalUnit;
use crate::estimation::{
    ChannelFacts, ChannelReadings, ChannelState, Division, Drift, Known, Meaning, Picture, Reader,
    RestRules, Rules, Scale, State, TaxelTouch, Threshold, Total, Touch, Wiring, convert_within,
    counting,
};
use crate::signal::NumberScale;
use crate::stage::{Chain, Inverted, Memory};

/// A taxel is touched above this many standard deviations of its pressure: noise alone does so
/// once in 10⁹ frames.
const CONTACT_DEVIATIONS: f64 = 6.0;
/// ... and above this share of the full scale.
const CONTACT_SHARE: f64 = 0.01;
/// Half a 95 % interval in standard deviations.
const HALF: f64 = 1.959963984540054;

/// Reads the frames of any [`Chain`]: readout, network, cell and memory are undone one after the
/// other, each with its slope.
#[derive(Debug)]
pub struct ChainReader {
    chain: Chain,
    /// Numbers of a frame to signals.
    scale: NumberScale,
    unit: SignalUnit,
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
    /// Distance between the signals at rest and at full scale of each channel.
    range: Vec<f64>,
    /// True if signals fall under pressure.
    falls: bool,
    /// Pressure per value of each cell, of the taxels that count.
    weights: Vec<f64>,
    /// Over the total force, the deviation of what the cells cannot see of it.
    sampling: f64,
    /// The chain with one number off by the deviation that it is made with, for each such number,
    /// and whether each cell has its own.
    made: Vec<(Chain, bool)>,
    /// True for each cell whose value at rest was captured.
    tared: Vec<bool>,
    /// Deviation of each pressure by noise alone, Pa.
    by_noise: Vec<f64>,
    /// What the numbers that all cells share add to the sum of the pressures, Pa, each.
    shared: Vec<f64>,
    /// What those of each cell add to its variance, Pa².
    own: Vec<f64>,
}

impl ChainReader {
    /// A reader of the frames of `chain`; `made` has the same chain with one number off by the
    /// deviation that it is made with, for each such number, and whether each cell has its own.
    pub fn new(chain: Chain, made: Vec<(Chain, bool)>) -> Self {
        let count = chain.count();
        let rest = chain.rest();
        let at_full = chain.respond(&vec![chain.full_scale; count]).signals;
        let range: Vec<f64> = rest
            .iter()
            .zip(&at_full)
            .map(|(a, b)| (a - b).abs())
            .collect();
        let falls = at_full.iter().sum::<f64>() < rest.iter().sum::<f64>();
        let [at_zero, gain] = chain.readout.line();
        let last = chain.last.scale();
        let scale = NumberScale {
            at_zero: (last.at_zero - at_zero) / gain,
            per_number: last.per_number / gain,
            ..last
        };
        let facts = |masked: &bool| ChannelFacts {
            deviation: chain.deviation() / scale.per_number.abs(),
            resolution: scale.step,
            span: scale.alive(),
            ..ChannelFacts::unknown(!masked)
        };
        let fresh = |memory: &dyn Memory| (0..count).map(|_| memory.fresh()).collect();
        let at_rest = Inverted {
            values: chain.values(&vec![0.0; count]),
            ..Inverted::default()
        };
        let sampling = chain.cover.as_ref().map_or(0.0, |cover| {
            cover.sampling(chain.cell(0).area(), chain.layout.pitch)
        });
        Self {
            unit: chain.last.unit(),
            meaning: meaning(&chain),
            channels: chain.masked.iter().map(facts).collect(),
            memory: chain.memory.as_deref().map_or_else(Vec::new, fresh),
            found: at_rest.clone(),
            at_rest,
            rest,
            signals: vec![0.0; count],
            noise: vec![0.0; count],
            weights: vec![0.0; count],
            tared: vec![false; count],
            by_noise: vec![f64::NAN; count],
            shared: vec![0.0; made.len()],
            own: vec![0.0; count],
            made,
            falls,
            range,
            scale,
            sampling,
            chain,
        }
    }

    /// Unit of the numbers of the frames.
    pub fn unit(&self) -> &SignalUnit {
        &self.unit
    }

    /// Signals of the readings less their drift. A reading that is missing, or no more than a
    /// bound, is one at its rest value whose deviation is the whole range of its channel: what it
    /// does not say is not known of the cells that share its lines either.
    fn take_signals(&mut self, known: &Known<'_>, channels: &ChannelReadings) {
        for channel in 0..self.signals.len() {
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

    /// The load at a cell of `chain` at a value, Pa; counted from its value at rest
    /// where that was captured.
    fn cell_load(&self, chain: &Chain, taxel: usize, value: f64) -> f64 {
        let law = chain.cell(taxel);
        let zero = if self.tared[taxel] {
            law.value(0.0) - self.at_rest.values[taxel]
        } else {
            0.0
        };
        law.pressure(value + zero, chain.full_scale)
    }

    /// Variance of a load at a cell by what is made otherwise than drawn, of the cell alone, Pa².
    fn variance_as_made(&self, taxel: usize, cell_load: f64) -> f64 {
        let own = self.made.iter().filter(|(_, per_cell)| *per_cell);
        own.map(|(chain, _)| {
            let off = self.cell_load(chain, taxel, self.found.values[taxel]) - cell_load;
            // Beyond the range of the law on that side: at least as far as its end.
            if off.is_nan() {
                self.chain.full_scale - cell_load
            } else {
                off
            }
        })
        .map(|off| off * off)
        .sum()
    }

    /// Touch on a taxel from the value of its cell.
    fn taxel(&mut self, taxel: usize, state: ChannelState, elapsed: f64) -> TaxelTouch {
        let (value, deviation) = (self.found.values[taxel], self.found.deviations[taxel]);
        let cell_load = self.cell_load(&self.chain, taxel, value);
        // Where the curve is steep at rest its slope says nothing: the interval is the image of
        // that of the value.
        let ends =
            [-HALF, HALF].map(|side| self.cell_load(&self.chain, taxel, value + side * deviation));
        let half = match ends.map(f64::is_nan) {
            [false, false] => 0.5 * (ends[1] - ends[0]),
            [false, true] => cell_load - ends[0],
            [true, false] => ends[1] - cell_load,
            [true, true] => f64::NAN,
        };
        let [pressure, gain] = match self.memory.get_mut(taxel) {
            // Without a reading the load at the cell is taken not to have changed.
            Some(memory) if state.usable() && cell_load.is_finite() => {
                memory.recover(cell_load, elapsed)
            }
            _ => [cell_load, 1.0],
        };
        (self.weights[taxel], self.own[taxel]) = (0.0, 0.0);
        self.by_noise[taxel] = gain * half.abs() / HALF;
        let (law, largest) = (self.chain.cell(taxel), self.chain.full_scale);
        let rises = law.value(largest) > law.value(0.0);
        match state {
            ChannelState::Masked => TaxelTouch::without_value(State::Masked),
            ChannelState::Faulty => TaxelTouch::without_value(State::Faulty),
            // A signal that falls under pressure is at its high end where nothing presses.
            ChannelState::Saturated if self.falls => TaxelTouch::without_value(State::Saturated),
            ChannelState::Saturated => TaxelTouch::pressing(largest, f64::NAN, State::Saturated),
            _ if !self.found.converged => TaxelTouch::without_value(State::NotConverged),
            _ if value.is_nan() => TaxelTouch::without_value(State::Inconsistent),
            _ if cell_load.is_nan() && (value > law.value(0.0)) == rises => {
                TaxelTouch::pressing(largest, f64::NAN, State::OutOfRange)
            }
            _ if cell_load.is_nan() => TaxelTouch::without_value(State::BelowZero),
            _ => {
                self.own[taxel] = gain * gain * self.variance_as_made(taxel, cell_load);
                self.weights[taxel] = gain * half / (HALF * deviation);
                let deviation = self.by_noise[taxel].hypot(self.own[taxel].sqrt());
                TaxelTouch::pressing(pressure, deviation, State::Ok)
            }
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
                    touch.covariance[2][2] += off * off;
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

    fn rules(&self) -> Rules {
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(
                CONTACT_DEVIATIONS,
                CONTACT_SHARE * self.chain.full_scale,
            ),
            counted: counting(&[State::Ok]),
            total: Total::Counted,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: 1,
                unit: "taxel",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        vec![self.chain.deviation(); self.rest.len()]
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        convert_within(&self.scale, values, channels)
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        self.take_signals(known, &touch.channels);
        self.chain
            .network
            .invert(&self.signals, &self.noise, &mut self.found);
        let elapsed = known.elapsed.unwrap_or(0.0);
        for taxel in 0..touch.taxels.len() {
            touch.taxels[taxel] = self.taxel(taxel, touch.channels.states[taxel], elapsed);
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
        let by_noise = self.found.variance_of_sum(&self.weights);
        let as_made =
            self.own.iter().sum::<f64>() + self.shared.iter().map(|off| off * off).sum::<f64>();
        Some(by_noise + as_made + (self.sampling * sum).powi(2))
    }

    fn by_noise(&self, taxel: usize) -> Option<f64> {
        Some(self.by_noise[taxel])
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        self.tared = rest.iter().map(|rest| !rest.is_nan()).collect();
        let drawn = self.chain.rest();
        let taken = rest.iter().zip(drawn);
        self.rest = taken
            .map(|(rest, drawn)| if rest.is_nan() { drawn } else { *rest })
            .collect();
        let noise = self.noise();
        let empty = vec![0.0; self.rest.len()];
        self.at_rest.values = self.chain.values(&empty);
        let network = &self.chain.network;
        network.invert(&self.rest, &noise, &mut self.at_rest);
        for (value, drawn) in self
            .at_rest
            .values
            .iter_mut()
            .zip(self.chain.values(&empty))
        {
            if !value.is_finite() {
                *value = drawn;
            }
        }
        self.found.values.clone_from(&self.at_rest.values);
        for memory in &mut self.memory {
            *memory = memory.fresh();
        }
    }
}

fn meaning(chain: &Chain) -> Meaning {
    let layout = &chain.layout;
    let signal = chain.network.quantity(chain.cell(0).quantity());
    let (unit, si_per_unit, _) = signal.unit;
    let name = |taxel: usize| {
        let (row, column) = (taxel / layout.columns, taxel % layout.columns);
        format!("row {row}, column {column}")
    };
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (0..layout.taxels()).map(name).collect(),
        wiring: Wiring::PerTaxel(1),
        reading: Scale::new(signal.name, unit, si_per_unit),
        value: Scale::new("pressure", "kPa", 1e3),
        components: 1,
        signed: false,
        full_scale: Some(chain.full_scale),
        verified: None,
        picture: Picture::Heat,
        newtons: Some(layout.pitch),
        total_known: true,
    }
}
