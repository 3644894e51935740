//! Two layers of crossing channels to a map of touches (P4).
//!
//! A channel says that it is pressed, not where. The position is where an active
//! row crosses an active column, which is certain only while one of the two is
//! alone: two touches at (r, c) and (s, d) make the same readings as two at
//! (r, d) and (s, c).

use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{ChannelFacts, Wiring};
use crate::calibration::{
    ChannelScale, MicrochannelCalibration, MicrochannelModel, MicrochannelSignal,
};
use crate::mechanics::{ForceHysteresis, LoadHistory};
use taxel_numerics::OnCurve;

/// Load of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MicrochannelState {
    /// Its resistance is that of rest, or below: liquid came from elsewhere.
    Quiet,
    /// Pressed: the pressure on one taxel that makes this reading.
    Pressed {
        /// Pressure, Pa.
        pressure: f64,
        /// Its standard deviation from the noise, Pa.
        deviation: f64,
    },
    /// Closed somewhere along it, or further than the model is known.
    Saturated {
        /// The pressure is at least this, Pa.
        at_least: f64,
    },
    /// No reading, or one that no channel gives.
    Faulty,
}

/// One channel in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MicrochannelTouch {
    /// Resistance without leads and drift, Ω; `None` when saturated or faulty.
    pub resistance: Option<f64>,
    /// Relative change R/R₀ − 1 against the captured rest.
    pub change: Option<f64>,
    /// Its load.
    pub state: MicrochannelState,
}

/// Load of one taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TaxelPressure {
    /// Not touched.
    Quiet,
    /// Touched, with this pressure.
    Pressed {
        /// Pressure, Pa.
        pressure: f64,
        /// Its standard deviation from the noise, Pa.
        deviation: f64,
    },
    /// Touched; both channels say no more than a least pressure.
    AtLeast {
        /// Pressure, Pa.
        pressure: f64,
    },
    /// One of several positions that explain the readings equally well.
    Ambiguous,
    /// A channel of this taxel is faulty and the other one active.
    Unknown,
}

/// Options of the reader of crossing channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MicrochannelOptions {
    /// A channel is active above this many standard deviations of its
    /// reading; default 6.
    pub contact_deviations: f64,
}

impl Default for MicrochannelOptions {
    fn default() -> Self {
        Self {
            contact_deviations: 6.0,
        }
    }
}

/// Reads two layers of crossing channels.
///
/// A frame holds one value per channel, the rows from +y to -y, then the
/// columns from -x to +x.
#[derive(Debug, Clone)]
pub struct MicrochannelReader {
    calibration: MicrochannelCalibration,
    options: MicrochannelOptions,
    meaning: Meaning,
    facts: Vec<ChannelFacts>,
    /// Resistance of each channel at rest, Ω.
    rest: Vec<f64>,
    channels: Vec<MicrochannelTouch>,
    taxels: Vec<TaxelPressure>,
    /// True if a channel is or may be pressed.
    occupied: Vec<bool>,
    /// True if a channel reads less than at rest, by more than noise can do.
    below: Vec<bool>,
    /// Standard deviation of the pressure of a quiet taxel, Pa.
    quiet: f64,
    histories: Vec<LoadHistory>,
}

impl MicrochannelReader {
    /// A reader of these channels.
    pub fn new(calibration: MicrochannelCalibration, options: MicrochannelOptions) -> Self {
        let (rows, columns) = (calibration.rows.len(), calibration.columns.len());
        let quiet = [calibration.rows.first(), calibration.columns.first()]
            .into_iter()
            .flatten()
            .map(|model| model.rest_pressure_deviation(&calibration.scale))
            .fold(f64::INFINITY, f64::min);
        Self {
            quiet,
            rest: drawn(&calibration).collect(),
            histories: vec![LoadHistory::default(); rows + columns],
            meaning: meaning(&calibration),
            facts: facts(&calibration),
            channels: vec![without_resistance(MicrochannelState::Quiet); rows + columns],
            taxels: vec![TaxelPressure::Quiet; rows * columns],
            occupied: vec![false; rows + columns],
            below: vec![false; rows + columns],
            calibration,
            options,
        }
    }

    /// Load of each channel in the last frame, rows first.
    pub fn loads(&self) -> &[MicrochannelTouch] {
        &self.channels
    }

    /// Load of each taxel in the last frame, row by row.
    pub fn taxels(&self) -> &[TaxelPressure] {
        &self.taxels
    }

    fn read_channels(&mut self, known: &Known<'_>, channels: &ChannelReadings) {
        let scale = &self.calibration.scale;
        let models = models(&self.calibration).zip(&self.rest);
        for (channel, (model, rest)) in models.enumerate() {
            let resistance = channels.readings[channel];
            self.below[channel] = false;
            self.channels[channel] = match channels.states[channel] {
                ChannelState::Ok | ChannelState::Closed => {
                    let signal = &scale.signal;
                    // Drift is an offset of what is read, and a divider bends it under load.
                    let offset = signal.of(rest + known.drift(channel)) - signal.of(*rest);
                    let still = |ohm| signal.resistance_below_open(signal.of(ohm) - offset);
                    let end = still(model.saturated_resistance(scale));
                    still(resistance).map_or(closed(model, scale), |resistance| {
                        let [slope, at_rest] = [resistance, *rest].map(|ohm| scale.slope(ohm));
                        let variance = known.drift_variance(channel) * (slope / at_rest).powi(2);
                        let noise = (model.deviation * slope).hypot(variance.sqrt());
                        let least = self.options.contact_deviations * noise;
                        self.below[channel] = resistance < rest - least;
                        let end = end.unwrap_or(f64::INFINITY);
                        loaded(model, *rest, [resistance, end], noise, least)
                    })
                }
                ChannelState::Saturated => closed(model, scale),
                ChannelState::Faulty | ChannelState::Masked => {
                    without_resistance(MicrochannelState::Faulty)
                }
            };
        }
        if let Some(law) = &self.calibration.hysteresis {
            for (channel, history) in self.channels.iter_mut().zip(&mut self.histories) {
                channel.state.carry(law, history);
            }
        }
        for (occupied, channel) in self.occupied.iter_mut().zip(&self.channels) {
            *occupied = channel.state != MicrochannelState::Quiet;
        }
    }
}

impl MicrochannelReader {
    /// True where channels below their rest cross, or along one that is alone in it.
    fn below_zero(&self, taxel: usize) -> bool {
        let (rows, columns) = self.below.split_at(self.calibration.rows.len());
        let (row, column) = (rows[taxel / columns.len()], columns[taxel % columns.len()]);
        let alone = |side: &[bool]| !side.contains(&true);
        row && (column || alone(columns)) || column && alone(rows)
    }
}

impl Reader for MicrochannelReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.facts
    }

    fn rules(&self) -> Rules {
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Fixed(0.0),
            counted: counting(&[State::Ok, State::Saturated]),
            total: Total::Certain,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: 1,
                unit: "channel",
                measures_noise: false,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        let scale = &self.calibration.scale;
        models(&self.calibration)
            .map(|model| model.deviation * scale.slope(model.rest_resistance))
            .collect()
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        let scale = &self.calibration.scale;
        let mut clipped = 0;
        let slots = channels.readings.iter_mut().zip(&mut channels.states);
        let models = models(&self.calibration);
        for (((reading, state), number), model) in slots.zip(values).zip(models) {
            let signal = scale.read(*number, model.saturation);
            *reading = match signal {
                MicrochannelSignal::Resistance(resistance) => resistance,
                _ => f64::NAN,
            };
            if *state == ChannelState::Masked {
                continue;
            }
            let [low, high] = scale.numbers.ends;
            clipped += usize::from(*number <= low || *number >= high);
            *state = match signal {
                MicrochannelSignal::Resistance(_) => ChannelState::Ok,
                MicrochannelSignal::Saturated => ChannelState::Saturated,
                MicrochannelSignal::Impossible => ChannelState::Faulty,
            };
        }
        clipped
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        self.read_channels(known, &touch.channels);
        let (rows, columns) = self.channels.split_at(self.calibration.rows.len());
        locate(rows, columns, &mut self.taxels);
        let masked = &self.calibration.masked;
        for (index, (touch, taxel)) in touch.taxels.iter_mut().zip(&self.taxels).enumerate() {
            *touch = if masked[index] {
                TaxelTouch::without_value(State::Masked)
            } else if *taxel == TaxelPressure::Quiet && self.below_zero(index) {
                TaxelTouch::without_value(State::BelowZero)
            } else {
                taxel.touch(self.quiet)
            };
        }
    }

    fn occupied(&self) -> Option<&[bool]> {
        Some(&self.occupied)
    }

    /// A quiet taxel adds nothing, and its deviation is that of a touch that its channels would not
    /// show: of the errors of a sum that is the scatter only where nothing is pressed.
    fn sum_variance(&self, _sum: f64) -> Option<f64> {
        let pressed = self.taxels.iter().zip(&self.calibration.masked);
        let pressed = pressed.filter_map(|(taxel, masked)| match taxel {
            TaxelPressure::Pressed { deviation, .. } if !masked => Some(deviation * deviation),
            TaxelPressure::AtLeast { .. } if !masked => Some(f64::NAN),
            _ => None,
        });
        pressed.reduce(|sum, variance| sum + variance)
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        let drawn = drawn(&self.calibration);
        for ((own, rest), drawn) in self.rest.iter_mut().zip(rest).zip(drawn) {
            *own = if rest.is_nan() { drawn } else { *rest };
        }
        // The device that reads this is empty.
        self.occupied.fill(false);
        self.histories.fill(LoadHistory::default());
    }
}

/// Meaning of the numbers of such an array.
fn meaning(calibration: &MicrochannelCalibration) -> Meaning {
    let layout = &calibration.layout;
    let rows = (0..layout.rows).map(|row| format!("row {row}"));
    let columns = (0..layout.columns).map(|column| format!("column {column}"));
    let highest = models(calibration).map(MicrochannelModel::highest_pressure);
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: rows.chain(columns).collect(),
        wiring: Wiring::Crossing {
            rows: layout.rows,
            columns: layout.columns,
        },
        reading: Scale::of(
            &calibration.scale.unit,
            Scale::new("resistance", "ohm", 1.0),
        ),
        value: Scale::new("pressure", "kPa", 1e3),
        components: 1,
        signed: false,
        full_scale: Some(highest.fold(0.0, f64::max)),
        verified: None,
        picture: Picture::Heat,
        newtons: Some([layout.pitch[0] * layout.pitch[1], 1.0]),
        total_known: true,
    }
}

/// Facts of each channel, in the numbers of a frame. A channel all of whose taxels are masked is not
/// used.
fn facts(calibration: &MicrochannelCalibration) -> Vec<ChannelFacts> {
    let scale = &calibration.scale;
    let wiring = Wiring::Crossing {
        rows: calibration.rows.len(),
        columns: calibration.columns.len(),
    };
    let channel = |(channel, model): (usize, &MicrochannelModel)| {
        let numbers = &scale.numbers;
        let highest = numbers.number(model.saturation.min(scale.signal.open()));
        let [low, high] = numbers.alive();
        let exists = wiring
            .taxels(channel)
            .any(|taxel| !calibration.masked[taxel]);
        ChannelFacts {
            deviation: model.deviation / numbers.per_number,
            resolution: numbers.step,
            span: [low, high.min(highest)],
            ..ChannelFacts::unknown(exists)
        }
    };
    models(calibration).enumerate().map(channel).collect()
}

/// Resistances at rest as drawn, Ω.
fn drawn(calibration: &MicrochannelCalibration) -> impl Iterator<Item = f64> {
    models(calibration).map(|channel| channel.rest_resistance)
}

impl TaxelPressure {
    /// The value of a taxel: nothing where it is quiet, the bound where it is
    /// saturated, none (`NaN`) where it is one of several positions or unknown.
    /// `quiet` is the standard deviation at rest, Pa.
    fn touch(&self, quiet: f64) -> TaxelTouch {
        match *self {
            Self::Quiet => TaxelTouch::pressing(0.0, quiet, State::Ok),
            Self::Pressed {
                pressure,
                deviation,
            } => TaxelTouch::pressing(pressure, deviation, State::Ok),
            Self::AtLeast { pressure } => {
                TaxelTouch::pressing(pressure, f64::NAN, State::Saturated)
            }
            Self::Ambiguous => TaxelTouch::without_value(State::Ambiguous),
            Self::Unknown => TaxelTouch::without_value(State::Faulty),
        }
    }
}

fn models(calibration: &MicrochannelCalibration) -> impl Iterator<Item = &MicrochannelModel> {
    calibration.rows.iter().chain(&calibration.columns)
}

/// A reading nearer to the end of what a channel can show than this many standard
/// deviations may be one at the end: its pressure is a lower bound.
const AT_END: f64 = 3.0;

/// Load of the channel that reads `resistance` without its drift, with the deviation `noise`,
/// and is active above rest by `least`; its readings end at `end`, all in Ω.
fn loaded(
    model: &MicrochannelModel,
    rest: f64,
    [resistance, end]: [f64; 2],
    noise: f64,
    least: f64,
) -> MicrochannelTouch {
    let change = (resistance - rest) / rest;
    let may_be = resistance + AT_END * noise;
    let at_end = || {
        let curve = model.pressure.at((may_be - rest) / rest);
        may_be >= end || matches!(curve, OnCurve::Above(_))
    };
    let state = match model.pressure.at(change) {
        _ if resistance - rest <= least => MicrochannelState::Quiet,
        OnCurve::Inside { value, .. } if at_end() => {
            MicrochannelState::Saturated { at_least: value }
        }
        OnCurve::Inside { value, slope } => MicrochannelState::Pressed {
            pressure: value,
            deviation: slope * noise / rest,
        },
        OnCurve::Below(_) => MicrochannelState::Quiet,
        OnCurve::Above([_, at_least]) => MicrochannelState::Saturated { at_least },
    };
    MicrochannelTouch {
        resistance: Some(resistance),
        change: Some(change),
        state,
    }
}

/// A channel that reads what it does at its end or beyond.
fn closed(model: &MicrochannelModel, scale: &ChannelScale) -> MicrochannelTouch {
    let at_least = model.saturated_pressure(scale);
    without_resistance(MicrochannelState::Saturated { at_least })
}

fn without_resistance(state: MicrochannelState) -> MicrochannelTouch {
    MicrochannelTouch {
        resistance: None,
        change: None,
        state,
    }
}

impl MicrochannelState {
    /// Leaves of the pressure of loading what is left on unloading.
    fn carry(&mut self, law: &ForceHysteresis, history: &mut LoadHistory) {
        match self {
            Self::Pressed {
                pressure,
                deviation,
            } => {
                let share = law.share(&history.push(*pressure));
                *pressure *= share;
                *deviation *= share;
            }
            Self::Saturated { at_least } => {
                *at_least *= law.share(&history.push(*at_least));
            }
            Self::Quiet | Self::Faulty => *history = LoadHistory::default(),
        }
    }

    /// True if the channel is pressed.
    pub fn active(&self) -> bool {
        matches!(self, Self::Pressed { .. } | Self::Saturated { .. })
    }
}

/// Taxels from the states of rows and columns.
///
/// A faulty channel may be active. Where more than one row and more than one
/// column may be active, every crossing of active channels is a candidate.
fn locate(rows: &[MicrochannelTouch], columns: &[MicrochannelTouch], taxels: &mut [TaxelPressure]) {
    let possible = |side: &[MicrochannelTouch]| {
        side.iter()
            .filter(|channel| channel.state != MicrochannelState::Quiet)
            .count()
    };
    let (many_rows, many_columns) = (possible(rows) > 1, possible(columns) > 1);
    // A load that only one layer shows lies somewhere along its channel.
    let no_row = possible(rows) == 0;
    let no_column = possible(columns) == 0;
    for (r, row) in rows.iter().enumerate() {
        for (c, column) in columns.iter().enumerate() {
            let faulty =
                row.state == MicrochannelState::Faulty || column.state == MicrochannelState::Faulty;
            let active = [row, column].map(|channel| channel.state.active());
            taxels[r * columns.len() + c] = match active {
                _ if faulty => unknown_or_quiet(row, column),
                [true, true] if many_rows && many_columns => TaxelPressure::Ambiguous,
                // The channel that is alone in its layer carries all touches;
                // each of the others carries one.
                [true, true] if many_columns => alone(&column.state),
                [true, true] if many_rows => alone(&row.state),
                [true, true] => both(&row.state, &column.state),
                [false, true] if no_row => TaxelPressure::Ambiguous,
                [true, false] if no_column => TaxelPressure::Ambiguous,
                _ => TaxelPressure::Quiet,
            };
        }
    }
}

/// A taxel with a faulty channel: untouched only if the other one is quiet.
fn unknown_or_quiet(row: &MicrochannelTouch, column: &MicrochannelTouch) -> TaxelPressure {
    if row.state == MicrochannelState::Quiet || column.state == MicrochannelState::Quiet {
        TaxelPressure::Quiet
    } else {
        TaxelPressure::Unknown
    }
}

/// The pressure of a taxel from a channel with no other touch.
fn alone(state: &MicrochannelState) -> TaxelPressure {
    match *state {
        MicrochannelState::Pressed {
            pressure,
            deviation,
        } => TaxelPressure::Pressed {
            pressure,
            deviation,
        },
        MicrochannelState::Saturated { at_least } => TaxelPressure::AtLeast { pressure: at_least },
        MicrochannelState::Quiet | MicrochannelState::Faulty => TaxelPressure::Quiet,
    }
}

/// The pressure of the only touch, from both of its channels: their mean
/// weighted by 1/σ², or the one that is not saturated.
fn both(row: &MicrochannelState, column: &MicrochannelState) -> TaxelPressure {
    use MicrochannelState::{Pressed, Saturated};
    match (*row, *column) {
        (
            Pressed {
                pressure: p,
                deviation: s,
            },
            Pressed {
                pressure: q,
                deviation: t,
            },
        ) if s > 0.0 && t > 0.0 => {
            let (u, v) = (1.0 / (s * s), 1.0 / (t * t));
            TaxelPressure::Pressed {
                pressure: (u * p + v * q) / (u + v),
                deviation: 1.0 / (u + v).sqrt(),
            }
        }
        (Saturated { at_least: p }, Saturated { at_least: q }) => {
            TaxelPressure::AtLeast { pressure: p.max(q) }
        }
        (Saturated { .. }, one) | (one, _) => alone(&one),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 2;
    const COLUMNS: usize = 4;

    fn channel(state: MicrochannelState) -> MicrochannelTouch {
        without_resistance(state)
    }

    fn pressed(pressure: f64) -> MicrochannelState {
        MicrochannelState::Pressed {
            pressure,
            deviation: 10.0,
        }
    }

    /// The map for given states of channels; all others are quiet.
    fn map(active: &[(usize, MicrochannelState)]) -> Vec<TaxelPressure> {
        let mut channels = [channel(MicrochannelState::Quiet); ROWS + COLUMNS];
        for (index, state) in active {
            channels[*index].state = *state;
        }
        let (rows, columns) = channels.split_at(ROWS);
        let mut taxels = vec![TaxelPressure::Quiet; ROWS * COLUMNS];
        locate(rows, columns, &mut taxels);
        taxels
    }

    fn taxels_that_are(taxels: &[TaxelPressure], wanted: TaxelPressure) -> Vec<usize> {
        (0..taxels.len()).filter(|i| taxels[*i] == wanted).collect()
    }

    #[test]
    fn one_row_and_one_column_are_one_place() {
        let taxels = map(&[(0, pressed(1e3)), (3, pressed(2e3))]);
        // Equal deviations: the plain mean, and 1/√2 of the deviation.
        let TaxelPressure::Pressed {
            pressure,
            deviation,
        } = taxels[1]
        else {
            panic!()
        };
        assert!((pressure - 1.5e3).abs() < 1e-9 && (deviation - 50.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Quiet).len(), 7);
    }

    #[test]
    fn several_columns_of_one_row_are_certain() {
        let taxels = map(&[(1, pressed(9e3)), (2, pressed(1e3)), (5, pressed(2e3))]);
        assert_eq!(
            taxels[4],
            TaxelPressure::Pressed {
                pressure: 1e3,
                deviation: 10.0
            }
        );
        assert_eq!(
            taxels[7],
            TaxelPressure::Pressed {
                pressure: 2e3,
                deviation: 10.0
            }
        );
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Quiet).len(), 6);
    }

    #[test]
    fn two_rows_and_two_columns_are_never_guessed() {
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, pressed(5e3)),
            (3, pressed(1e3)),
            (4, pressed(5e3)),
        ]);
        assert_eq!(
            taxels_that_are(&taxels, TaxelPressure::Ambiguous),
            [1, 2, 5, 6]
        );
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Quiet).len(), 4);
    }

    #[test]
    fn a_load_that_one_layer_feels_is_somewhere_on_its_channel() {
        let taxels = map(&[(3, pressed(1e3))]);
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Ambiguous), [1, 5]);
    }

    #[test]
    fn a_saturated_channel_leaves_the_pressure_to_the_other() {
        let saturated = MicrochannelState::Saturated { at_least: 30e3 };
        let taxels = map(&[(0, pressed(40e3)), (3, saturated)]);
        assert_eq!(
            taxels[1],
            TaxelPressure::Pressed {
                pressure: 40e3,
                deviation: 10.0
            }
        );
        let taxels = map(&[
            (0, MicrochannelState::Saturated { at_least: 25e3 }),
            (3, saturated),
        ]);
        assert_eq!(taxels[1], TaxelPressure::AtLeast { pressure: 30e3 });
    }

    #[test]
    fn a_faulty_channel_may_be_active() {
        // Row 1 is dead: a touch on column 3 that row 0 shows is certain there
        // and unknown on row 1; with two columns nothing is certain.
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, MicrochannelState::Faulty),
            (3, pressed(1e3)),
        ]);
        assert!(matches!(taxels[1], TaxelPressure::Pressed { .. }));
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Unknown), [5]);
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, MicrochannelState::Faulty),
            (3, pressed(1e3)),
            (4, pressed(1e3)),
        ]);
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Ambiguous), [1, 2]);
        assert_eq!(taxels_that_are(&taxels, TaxelPressure::Unknown), [5, 6]);
    }
}
