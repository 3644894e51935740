//! Two layers of crossing channels to a map of touches (P4).
//!
//! A channel says that it is pressed, not where. The place is where an active
//! row crosses an active column, which is certain only while one of the two is
//! alone: two touches at (r, c) and (s, d) make the same readings as two at
//! (r, d) and (s, c).

use super::baseline::{Baseline, BaselineOptions};
use super::contact::{Cell, normal_only};
use super::segmentation::Segmentation;
use super::{
    FrameError, Picture, RestEnd, RestState, Scale, SignalEstimator, SignalMeaning, SignalTouch,
    State, TaxelValue,
};
use crate::acquisition::Frame;
use crate::calibration::{ChannelCalibration, ChannelModel, ChannelSignal, MOVING, RestReadings};
use crate::mechanics::{ForceHysteresis, LoadHistory};
use taxel_numerics::OnCurve;

/// What one channel feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChannelState {
    /// Its resistance is that of rest, or below: liquid came from elsewhere.
    Quiet,
    /// Pressed: the pressure on one taxel that makes this reading.
    Pressed {
        /// Pressure, Pa.
        pressure: f64,
        /// Its standard deviation from the noise, Pa.
        deviation: f64,
    },
    /// Closed at some place, or further than the model is known.
    Saturated {
        /// The pressure is at least this, Pa.
        at_least: f64,
    },
    /// No reading, or one that no channel gives.
    Faulty,
}

/// One channel in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelTouch {
    /// Resistance without leads, Ω; `None` when saturated or faulty.
    pub resistance: Option<f64>,
    /// Relative change R/R₀ − 1 against the captured rest.
    pub change: Option<f64>,
    /// What it feels.
    pub state: ChannelState,
}

/// What one taxel feels.
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
    /// One of several places that explain the readings equally well.
    Ambiguous,
    /// A channel of this taxel is faulty and the other one active.
    Unknown,
}

/// Options of the estimator of crossing channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossedOptions {
    /// A channel is active above this many standard deviations of its
    /// reading; default 6.
    pub contact_deviations: f64,
}

impl Default for CrossedOptions {
    fn default() -> Self {
        Self {
            contact_deviations: 6.0,
        }
    }
}

/// Why a rest capture was refused; the rest values stay as they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ChannelRestRefused {
    /// A channel moved while it was captured.
    #[error("rest capture refused: channel {channel} moved during it; lift off and try again")]
    Moving {
        /// The channel, rows first.
        channel: usize,
    },
    /// A channel gave no resistance.
    #[error("rest capture refused: channel {channel} is saturated or gives no reading")]
    NoReading {
        /// The channel, rows first.
        channel: usize,
    },
}

#[derive(Debug, Clone)]
struct Capture {
    readings: RestReadings,
    /// The first channel that gave no resistance.
    broken: Option<usize>,
}

/// Turns frames of channel readings into touches; the same frames give the
/// same touches.
///
/// A frame holds one value per channel, the rows from +y to -y, then the
/// columns from -x to +x.
#[derive(Debug, Clone)]
pub struct CrossedChannels {
    calibration: ChannelCalibration,
    options: CrossedOptions,
    meaning: SignalMeaning,
    channels: Vec<ChannelTouch>,
    taxels: Vec<TaxelPressure>,
    segmentation: Segmentation,
    touch: SignalTouch,
    /// Standard deviation of the pressure of a quiet taxel, Pa.
    quiet: f64,
    baseline: Baseline,
    histories: Vec<LoadHistory>,
    capture: Option<Capture>,
}

impl CrossedChannels {
    /// An estimator for frames of counts.
    pub fn new(calibration: ChannelCalibration, options: CrossedOptions) -> Self {
        let (rows, columns) = (calibration.rows.len(), calibration.columns.len());
        let rest: Vec<f64> = rest(&calibration).collect();
        let quiet = [calibration.rows.first(), calibration.columns.first()]
            .into_iter()
            .flatten()
            .map(|model| model.rest_pressure_deviation(&calibration.scale))
            .fold(f64::INFINITY, f64::min);
        let noise = models(&calibration)
            .map(|model| model.deviation * calibration.scale.slope(model.rest_resistance));
        let mut baseline = Baseline::new(BaselineOptions::new(noise.collect()));
        baseline.tare(0, &rest);
        Self {
            quiet,
            baseline,
            histories: vec![LoadHistory::default(); rows + columns],
            meaning: meaning(&calibration),
            channels: vec![without_resistance(ChannelState::Quiet); rows + columns],
            taxels: vec![TaxelPressure::Quiet; rows * columns],
            segmentation: Segmentation::new(rows, columns, calibration.layout.pitch),
            touch: SignalTouch {
                signals: rest.clone(),
                rest,
                ..SignalTouch::default()
            },
            calibration,
            options,
            capture: None,
        }
    }

    /// What each channel felt in the last frame, rows first.
    pub fn channels(&self) -> &[ChannelTouch] {
        &self.channels
    }

    /// What each taxel felt in the last frame, row by row.
    pub fn taxels(&self) -> &[TaxelPressure] {
        &self.taxels
    }

    fn feel_channels(&mut self, values: &[f64]) {
        let scale = &self.calibration.scale;
        let channels = models(&self.calibration).zip(&self.touch.rest).zip(values);
        self.touch.clipped = 0;
        let slots = self.channels.iter_mut().zip(channels).enumerate();
        for (channel, (slot, ((model, rest), counts))) in slots {
            self.touch.clipped += usize::from(*counts <= 0.0 || *counts >= scale.highest_code);
            *slot = match scale.signal(*counts, model.saturation) {
                ChannelSignal::Resistance(resistance) => {
                    let noise = model.deviation * scale.slope(resistance);
                    let noise = noise.hypot(self.baseline.deviation(channel));
                    let least = self.options.contact_deviations * noise;
                    let expected = rest + self.baseline.drift(channel);
                    feel(model, [*rest, expected], resistance, noise, least)
                }
                ChannelSignal::Saturated => without_resistance(ChannelState::Saturated {
                    at_least: model.saturated_pressure(scale),
                }),
                ChannelSignal::Impossible => without_resistance(ChannelState::Faulty),
            };
        }
        if let Some(law) = &self.calibration.hysteresis {
            for (channel, history) in self.channels.iter_mut().zip(&mut self.histories) {
                channel.state.carry(law, history);
            }
        }
        let resistances = self.channels.iter().map(|channel| channel.resistance);
        self.touch.signals.clear();
        self.touch
            .signals
            .extend(resistances.map(|resistance| resistance.unwrap_or(f64::NAN)));
    }

    /// Values, contacts and totals from the places.
    fn sum_up(&mut self) {
        let layout = &self.calibration.layout;
        let area = layout.pitch[0] * layout.pitch[1];
        self.touch.taxels.clear();
        self.touch
            .taxels
            .extend(self.taxels.iter().map(|taxel| taxel.value(self.quiet)));
        let taxels = &self.touch.taxels;
        let certain = taxels.iter().all(|taxel| taxel.state == State::Ok);
        let total: f64 = taxels.iter().map(|taxel| taxel.value).sum();
        let variance: f64 = taxels.iter().map(|taxel| taxel.deviation.powi(2)).sum();
        self.touch.force = certain.then_some([total * area, variance.sqrt() * area]);
        let cell = |index: usize| {
            let taxel = &taxels[index];
            Cell {
                position: layout.flat_position(index),
                weight: taxel.value,
                deviation: taxel.deviation,
                threshold: 0.0,
                force: [0.0, 0.0, taxel.value * area],
                force_covariance: normal_only(taxel.deviation * area),
                state: taxel.state,
            }
        };
        self.touch.centre_of_pressure = self.segmentation.run(cell, &mut self.touch.contacts);
        self.segmentation.label(&mut self.touch.regions);
    }

    fn capture_frame(&mut self, values: &[f64]) -> RestEnd {
        let capture = self.capture.as_mut()?;
        let scale = &self.calibration.scale;
        let resistance = |(model, counts): (&ChannelModel, &f64)| match scale
            .signal(*counts, model.saturation)
        {
            ChannelSignal::Resistance(resistance) => resistance,
            _ => f64::NAN,
        };
        let readings = models(&self.calibration).zip(values);
        let resistances: Vec<f64> = readings.map(resistance).collect();
        if let Some(channel) = resistances.iter().position(|value| value.is_nan()) {
            capture.broken.get_or_insert(channel);
        }
        if !capture.readings.push(resistances) {
            return None;
        }
        let capture = self.capture.take()?;
        Some(self.finish(&capture).map_err(|refused| refused.to_string()))
    }

    fn finish(&mut self, capture: &Capture) -> Result<(), ChannelRestRefused> {
        if let Some(channel) = capture.broken {
            return Err(ChannelRestRefused::NoReading { channel });
        }
        let scale = &self.calibration.scale;
        let channels = capture.readings.channels();
        for (channel, (model, running)) in models(&self.calibration).zip(channels).enumerate() {
            let noise = model.deviation * scale.slope(model.rest_resistance);
            if running.deviation() > MOVING * noise {
                return Err(ChannelRestRefused::Moving { channel });
            }
        }
        for (rest, running) in self.touch.rest.iter_mut().zip(channels) {
            *rest = running.mean_or_nan();
        }
        self.baseline.tare(self.touch.time_ns, &self.touch.rest);
        Ok(())
    }
}

impl SignalEstimator for CrossedChannels {
    fn meaning(&self) -> &SignalMeaning {
        &self.meaning
    }

    fn push(&mut self, frame: &Frame) -> Result<(&SignalTouch, RestEnd), FrameError> {
        let expected = self.channels.len();
        if frame.values.len() != expected {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected,
            });
        }
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        let captured = self.capture_frame(&frame.values);
        self.feel_channels(&frame.values);
        let (rows, columns) = self.channels.split_at(self.calibration.rows.len());
        locate(rows, columns, &mut self.taxels);
        self.sum_up();
        let channels = &self.channels;
        self.baseline
            .push(frame.time_ns, &self.touch.signals, |channel| {
                channels[channel].state != ChannelState::Quiet
            });
        Ok((&self.touch, captured))
    }

    fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some(Capture {
            readings: RestReadings::new(self.channels.len(), frames),
            broken: None,
        });
    }

    fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    fn clear_rest(&mut self) {
        self.touch.rest.clear();
        self.touch.rest.extend(rest(&self.calibration));
        self.baseline.tare(self.touch.time_ns, &self.touch.rest);
    }

    fn baseline(&self) -> Option<&Baseline> {
        Some(&self.baseline)
    }

    fn rest_state(&self) -> Option<RestState> {
        Some(RestState::Signals(self.touch.rest.clone()))
    }

    fn restore_rest(&mut self, rest: &RestState) {
        if let RestState::Signals(rest) = rest {
            self.touch.rest.clone_from(rest);
            self.baseline.tare(self.touch.time_ns, &self.touch.rest);
        }
    }
}

/// What the numbers of such an array are.
fn meaning(calibration: &ChannelCalibration) -> SignalMeaning {
    let layout = &calibration.layout;
    let rows = (0..layout.rows).map(|row| format!("row {row}"));
    let columns = (0..layout.columns).map(|column| format!("column {column}"));
    let highest = models(calibration).map(ChannelModel::highest_pressure);
    SignalMeaning {
        rows: layout.rows,
        columns: layout.columns,
        pitch: [layout.pitch[1], layout.pitch[0]],
        channels: rows.chain(columns).collect(),
        signal: Scale {
            quantity: "resistance",
            symbol: "ohm",
            si_per_unit: 1.0,
        },
        value: Scale {
            quantity: "pressure",
            symbol: "kPa",
            si_per_unit: 1e3,
        },
        full_scale: highest.fold(0.0, f64::max),
        signed: false,
        picture: Picture::Heat,
    }
}

/// Resistances at rest as drawn, Ω.
fn rest(calibration: &ChannelCalibration) -> impl Iterator<Item = f64> {
    models(calibration).map(|channel| channel.rest_resistance)
}

impl TaxelPressure {
    /// The value of a taxel: nothing where it is quiet, the bound where it is
    /// saturated, none (`NaN`) where it is one of several places or unknown.
    /// `quiet` is the standard deviation at rest, Pa.
    fn value(&self, quiet: f64) -> TaxelValue {
        let (value, deviation, state) = match *self {
            Self::Quiet => (0.0, quiet, State::Ok),
            Self::Pressed {
                pressure,
                deviation,
            } => (pressure, deviation, State::Ok),
            Self::AtLeast { pressure } => (pressure, f64::NAN, State::Saturated),
            Self::Ambiguous => (f64::NAN, f64::NAN, State::Ambiguous),
            Self::Unknown => (f64::NAN, f64::NAN, State::Faulty),
        };
        TaxelValue {
            value,
            deviation,
            state,
        }
    }
}

fn models(calibration: &ChannelCalibration) -> impl Iterator<Item = &ChannelModel> {
    calibration.rows.iter().chain(&calibration.columns)
}

/// What the channel feels that reads `resistance` with the deviation `noise`
/// and is active above rest by `least`, all in Ω.
fn feel(
    model: &ChannelModel,
    [rest, empty]: [f64; 2],
    resistance: f64,
    noise: f64,
    least: f64,
) -> ChannelTouch {
    let change = (resistance - empty) / rest;
    let state = match model.pressure.at(change) {
        _ if resistance - empty <= least => ChannelState::Quiet,
        OnCurve::Inside { value, slope } => ChannelState::Pressed {
            pressure: value,
            deviation: slope * noise / rest,
        },
        OnCurve::Below(_) => ChannelState::Quiet,
        OnCurve::Above([_, at_least]) => ChannelState::Saturated { at_least },
    };
    ChannelTouch {
        resistance: Some(resistance),
        change: Some(change),
        state,
    }
}

fn without_resistance(state: ChannelState) -> ChannelTouch {
    ChannelTouch {
        resistance: None,
        change: None,
        state,
    }
}

impl ChannelState {
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

    /// Whether the channel is pressed.
    pub fn active(&self) -> bool {
        matches!(self, Self::Pressed { .. } | Self::Saturated { .. })
    }
}

/// Taxels from the states of rows and columns.
///
/// A faulty channel may be active. Where more than one row and more than one
/// column may be active, every crossing of active channels is a candidate.
fn locate(rows: &[ChannelTouch], columns: &[ChannelTouch], taxels: &mut [TaxelPressure]) {
    let possible = |side: &[ChannelTouch]| {
        side.iter()
            .filter(|channel| channel.state != ChannelState::Quiet)
            .count()
    };
    let (many_rows, many_columns) = (possible(rows) > 1, possible(columns) > 1);
    // A load that only one layer feels lies somewhere along its channel.
    let no_row = possible(rows) == 0;
    let no_column = possible(columns) == 0;
    for (r, row) in rows.iter().enumerate() {
        for (c, column) in columns.iter().enumerate() {
            let faulty = row.state == ChannelState::Faulty || column.state == ChannelState::Faulty;
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
fn unknown_or_quiet(row: &ChannelTouch, column: &ChannelTouch) -> TaxelPressure {
    if row.state == ChannelState::Quiet || column.state == ChannelState::Quiet {
        TaxelPressure::Quiet
    } else {
        TaxelPressure::Unknown
    }
}

/// The pressure of a taxel from a channel with no other touch.
fn alone(state: &ChannelState) -> TaxelPressure {
    match *state {
        ChannelState::Pressed {
            pressure,
            deviation,
        } => TaxelPressure::Pressed {
            pressure,
            deviation,
        },
        ChannelState::Saturated { at_least } => TaxelPressure::AtLeast { pressure: at_least },
        ChannelState::Quiet | ChannelState::Faulty => TaxelPressure::Quiet,
    }
}

/// The pressure of the only touch, from both of its channels: their mean
/// weighted by 1/σ², or the one that is not saturated.
fn both(row: &ChannelState, column: &ChannelState) -> TaxelPressure {
    use ChannelState::{Pressed, Saturated};
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

    fn channel(state: ChannelState) -> ChannelTouch {
        without_resistance(state)
    }

    fn pressed(pressure: f64) -> ChannelState {
        ChannelState::Pressed {
            pressure,
            deviation: 10.0,
        }
    }

    /// The map for given states of channels; all others are quiet.
    fn map(active: &[(usize, ChannelState)]) -> Vec<TaxelPressure> {
        let mut channels = [channel(ChannelState::Quiet); ROWS + COLUMNS];
        for (index, state) in active {
            channels[*index].state = *state;
        }
        let (rows, columns) = channels.split_at(ROWS);
        let mut taxels = vec![TaxelPressure::Quiet; ROWS * COLUMNS];
        locate(rows, columns, &mut taxels);
        taxels
    }

    fn places(taxels: &[TaxelPressure], wanted: TaxelPressure) -> Vec<usize> {
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
        assert_eq!(places(&taxels, TaxelPressure::Quiet).len(), 7);
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
        assert_eq!(places(&taxels, TaxelPressure::Quiet).len(), 6);
    }

    #[test]
    fn two_rows_and_two_columns_are_never_guessed() {
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, pressed(5e3)),
            (3, pressed(1e3)),
            (4, pressed(5e3)),
        ]);
        assert_eq!(places(&taxels, TaxelPressure::Ambiguous), [1, 2, 5, 6]);
        assert_eq!(places(&taxels, TaxelPressure::Quiet).len(), 4);
    }

    #[test]
    fn a_load_that_one_layer_feels_is_somewhere_on_its_channel() {
        let taxels = map(&[(3, pressed(1e3))]);
        assert_eq!(places(&taxels, TaxelPressure::Ambiguous), [1, 5]);
    }

    #[test]
    fn a_saturated_channel_leaves_the_pressure_to_the_other() {
        let saturated = ChannelState::Saturated { at_least: 30e3 };
        let taxels = map(&[(0, pressed(40e3)), (3, saturated)]);
        assert_eq!(
            taxels[1],
            TaxelPressure::Pressed {
                pressure: 40e3,
                deviation: 10.0
            }
        );
        let taxels = map(&[
            (0, ChannelState::Saturated { at_least: 25e3 }),
            (3, saturated),
        ]);
        assert_eq!(taxels[1], TaxelPressure::AtLeast { pressure: 30e3 });
    }

    #[test]
    fn a_faulty_channel_may_be_active() {
        // Row 1 is dead: a touch on column 3 that row 0 feels is certain there
        // and unknown on row 1; with two columns nothing is certain.
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, ChannelState::Faulty),
            (3, pressed(1e3)),
        ]);
        assert!(matches!(taxels[1], TaxelPressure::Pressed { .. }));
        assert_eq!(places(&taxels, TaxelPressure::Unknown), [5]);
        let taxels = map(&[
            (0, pressed(1e3)),
            (1, ChannelState::Faulty),
            (3, pressed(1e3)),
            (4, pressed(1e3)),
        ]);
        assert_eq!(places(&taxels, TaxelPressure::Ambiguous), [1, 2]);
        assert_eq!(places(&taxels, TaxelPressure::Unknown), [5, 6]);
    }
}
