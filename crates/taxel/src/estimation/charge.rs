//! Frames of an array of charge-giving elements to force changes: the
//! high-pass of the leak undone, with a guard against drift.

use std::sync::Arc;

use super::contact::{Cell, normal_only};
use super::localisation::Placing;
use super::placing_live::Placed;
use super::segmentation::Segmentation;
use super::{
    FrameError, Picture, RestEnd, RestState, Scale, SignalEstimator, SignalMeaning, SignalTouch,
    State, TaxelValue,
};
use crate::acquisition::Frame;
use crate::calibration::{MOVING, RestReadings};
use crate::layout::Layout;
use taxel_numerics::linear_chain::{Chain, Memory, Step, Transfer};

/// What is known of an array of elements whose signal is
/// V/F = g · τs/(1 + τs) · 1/(1 + τ_f s).
#[derive(Debug, Clone, PartialEq)]
pub struct ChargeModel {
    /// Where the elements are.
    pub layout: Layout,
    /// Voltage of code zero, V.
    pub volt_at_zero: f64,
    /// Voltage per count, V; above zero.
    pub volt_per_count: f64,
    /// The least and the greatest voltage that is not clipped, V.
    pub span: [f64; 2],
    /// Voltage at rest, V.
    pub rest: f64,
    /// Gain in the band g, V/N; not zero, negative where the stages invert.
    pub volt_per_newton: f64,
    /// Gain of each element over that, above zero; one where it is not known.
    pub gains: Vec<f64>,
    /// Time constant of the high-pass τ, s.
    pub high_pass: f64,
    /// Time constant of the low-pass τ_f, s, where there is one.
    pub low_pass: Option<f64>,
    /// Standard deviation of one reading, V.
    pub deviation: f64,
    /// Time between frames, s.
    pub period: f64,
    /// Elements that are not used.
    pub masked: Vec<bool>,
    /// Force on one element at the end of the colour scale, N.
    pub full_scale: f64,
}

/// Options of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChargeEstimatorOptions {
    /// The force of a held load fades with this time constant, s, so that the
    /// drift of an offset stays bounded; default 5 s.
    pub drift_guard: f64,
    /// Time constant of the smoothing that undoing the low-pass needs, s;
    /// default 5 ms.
    pub smoothing: f64,
    /// An element is touched above this many standard deviations; default 6.
    pub contact_deviations: f64,
    /// ... and above this share of the full scale; default 0.01.
    pub contact_share: f64,
}

impl Default for ChargeEstimatorOptions {
    fn default() -> Self {
        Self {
            drift_guard: 5.0,
            smoothing: 5e-3,
            contact_deviations: 6.0,
            contact_share: 0.01,
        }
    }
}

/// Turns frames of counts into the change of force on each element.
///
/// F = V/g · (1 + τs)T/(τ(1 + Ts)) · (1 + τ_f s)/(1 + T_s s): a pure
/// integral would be T → ∞, F = (V + ∫V dt/τ)/g. A force that is held fades with the
/// drift guard T; one that comes or goes faster is right.
#[derive(Debug, Clone)]
pub struct ChargeEstimator {
    model: ChargeModel,
    options: ChargeEstimatorOptions,
    meaning: SignalMeaning,
    inverse: Option<Chain>,
    /// A step of one period, prepared.
    step: Option<Step>,
    memories: Vec<Memory>,
    /// Voltage at rest of each element, V.
    rest: Vec<f64>,
    /// Time after which a clipped reading or a pause has faded, ns.
    wrong_until_ns: Vec<u64>,
    last_time_ns: Option<u64>,
    deviation: f64,
    capture: Option<RestReadings>,
    segmentation: Segmentation,
    placing: Option<Arc<dyn Placing>>,
    placed: Option<Placed>,
    touch: SignalTouch,
}

/// Places are looked for so often, ns: it takes up to some milliseconds.
const PLACE_EVERY_NS: u64 = 10_000_000;

/// Pause that counts, as a share of the time constant of the high-pass.
const PAUSE: f64 = 0.1;

impl ChargeEstimator {
    /// An estimator for the elements of `model`.
    pub fn new(model: ChargeModel, options: ChargeEstimatorOptions) -> Self {
        let taxels = model.layout.taxels();
        let inverse = Chain::new(&inverse(&model, &options)).ok();
        let step = inverse.as_ref().map(|chain| chain.step(model.period));
        let deviation = match (&inverse, &step) {
            (Some(chain), Some(step)) => model.deviation * noise_gain(chain, step),
            _ => f64::NAN,
        };
        let memory = inverse.as_ref().map(|chain| chain.settled(0.0));
        Self {
            meaning: meaning(&model),
            memories: memory.map_or(Vec::new(), |memory| vec![memory; taxels]),
            rest: vec![model.rest; taxels],
            wrong_until_ns: vec![0; taxels],
            last_time_ns: None,
            deviation,
            capture: None,
            segmentation: Segmentation::new(
                model.layout.rows,
                model.layout.columns,
                model.layout.pitch,
            ),
            placing: None,
            placed: None,
            touch: SignalTouch::default(),
            inverse,
            step,
            options,
            model,
        }
    }

    /// Finds contacts and their places by `placing`; without, and where that
    /// finds no information, a contact is at the centre of its forces.
    #[must_use]
    pub fn with_placing(mut self, placing: Arc<dyn Placing>) -> Self {
        self.placing = Some(placing);
        self
    }

    /// Standard deviation of the force on one element by the noise of the
    /// readings, N.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// A pause after which the force is uncertain, s: what the signal did in it
    /// is missing in the integral.
    fn longest_pause(&self) -> f64 {
        (PAUSE * self.model.high_pass).max(1.5 * self.model.period)
    }

    /// Time in which a mistake fades, ns.
    fn guard_ns(&self) -> u64 {
        (self.options.drift_guard * 1e9) as u64
    }

    /// Takes the voltages of a frame `elapsed` s after the last one.
    fn follow(&mut self, counts: &[f64], elapsed: Option<f64>, time_ns: u64) {
        let guard_ns = self.guard_ns();
        let Self { model, touch, .. } = self;
        touch.clipped = 0;
        let usual = elapsed.is_some_and(|dt| (dt - model.period).abs() < 1e-3 * model.period);
        let other = match (&self.inverse, elapsed) {
            (Some(chain), Some(dt)) if !usual => Some(chain.step(dt)),
            _ => None,
        };
        for (index, count) in counts.iter().enumerate() {
            let volts = model.volt_at_zero + model.volt_per_count * count;
            touch.signals[index] = volts;
            let cut = self.wrong_until_ns[index] > time_ns;
            let half = 0.5 * model.volt_per_count;
            let inside = volts > model.span[0] + half && volts < model.span[1] - half;
            let state = match (model.masked[index], volts.is_finite(), inside) {
                (true, _, _) => State::Masked,
                (_, false, _) => State::Faulty,
                (_, _, false) => State::Saturated,
                _ if cut => State::Unchecked,
                _ => State::Ok,
            };
            if state == State::Saturated {
                touch.clipped += 1;
                self.wrong_until_ns[index] = time_ns + guard_ns;
            }
            let change = if volts.is_finite() {
                volts - self.rest[index]
            } else {
                0.0
            };
            let value = match (&self.inverse, elapsed) {
                (Some(chain), Some(_)) => {
                    let step = other.as_ref().or(self.step.as_ref());
                    step.map_or(f64::NAN, |step| {
                        chain.advance(&mut self.memories[index], step, change)
                    })
                }
                // The first frame: what was before it is not known.
                (Some(chain), None) => {
                    self.memories[index] = chain.settled(0.0);
                    let at_once = chain.step(0.0);
                    chain.advance(&mut self.memories[index], &at_once, change);
                    0.0
                }
                (None, _) => f64::NAN,
            };
            let usable = !matches!(state, State::Masked | State::Faulty);
            let gain = if usable { model.gains[index] } else { f64::NAN };
            touch.taxels[index] = TaxelValue {
                value: value / gain,
                deviation: self.deviation / gain,
                state,
            };
        }
    }

    fn find_contacts(&mut self) {
        let threshold = (self.options.contact_deviations * self.deviation)
            .max(self.options.contact_share * self.model.full_scale);
        let (layout, taxels) = (&self.model.layout, &self.touch.taxels);
        let cell = |index: usize| {
            let taxel = &taxels[index];
            let trusted = matches!(taxel.state, State::Ok | State::Saturated);
            Cell {
                position: layout.flat_position(index),
                weight: if trusted { taxel.value } else { f64::NAN },
                deviation: taxel.deviation,
                threshold,
                force: [0.0, 0.0, taxel.value],
                force_covariance: normal_only(taxel.deviation),
                state: taxel.state,
            }
        };
        let contacts = &mut self.touch.contacts;
        self.touch.centre_of_pressure = self.segmentation.run(cell, contacts);
        self.segmentation.label(&mut self.touch.regions);
        let cells: Vec<Cell> = (0..taxels.len()).map(cell).collect();
        self.place_contacts(&cells);
    }

    /// The profiles of contacts tell their places better than the centres of
    /// force do, and how many there are.
    fn place_contacts(&mut self, cells: &[Cell]) {
        let touch = &mut self.touch;
        let (Some(placing), regions @ 1..) = (&self.placing, touch.contacts.len()) else {
            self.placed = None;
            return;
        };
        if !matches!(&self.placed, Some(placed) if placed.holds(touch.time_ns, regions)) {
            let taxels = touch.taxels.iter();
            let (forces, deviations): (Vec<f64>, Vec<f64>) =
                taxels.map(|taxel| (taxel.value, taxel.deviation)).unzip();
            let until_ns = touch.time_ns.saturating_add(PLACE_EVERY_NS);
            let parts = placing.places(&forces, &deviations);
            self.placed = Some(Placed::new(parts, until_ns, regions));
        }
        let Some(placed) = &mut self.placed else {
            return;
        };
        let pitch = self.model.layout.pitch;
        placed.split(cells, pitch, &mut touch.contacts, &mut touch.regions);
        placed.apply(&mut touch.contacts);
        if let [contact] = &touch.contacts[..] {
            touch.centre_of_pressure = Some((contact.centre, contact.covariance));
        }
    }

    fn capture_frame(&mut self) -> RestEnd {
        let capture = self.capture.as_mut()?;
        if !capture.push(self.touch.signals.iter().copied()) {
            return None;
        }
        let ended = self.capture.take()?;
        Some(self.end_capture(&ended))
    }

    fn end_capture(&mut self, capture: &RestReadings) -> Result<(), String> {
        let channels = capture.channels();
        for (index, running) in channels.iter().enumerate() {
            let ratio = running.deviation() / self.model.deviation;
            if ratio > MOVING && !self.model.masked[index] {
                return Err(format!(
                    "rest capture refused: element {index} moved by {ratio:.0} times its noise; lift off and try again"
                ));
            }
        }
        for (rest, running) in self.rest.iter_mut().zip(channels) {
            let mean = running.mean_or_nan();
            // A channel without readings keeps its rest.
            if mean.is_finite() {
                *rest = mean;
            }
        }
        self.forget();
        Ok(())
    }

    /// Begins again from rest.
    fn forget(&mut self) {
        self.last_time_ns = None;
        self.wrong_until_ns.fill(0);
    }
}

impl SignalEstimator for ChargeEstimator {
    fn meaning(&self) -> &SignalMeaning {
        &self.meaning
    }

    fn push(&mut self, frame: &Frame) -> Result<(&SignalTouch, RestEnd), FrameError> {
        let expected = self.rest.len();
        if frame.values.len() != expected {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected,
            });
        }
        let before = self.last_time_ns;
        if before.is_some_and(|last| frame.time_ns <= last) {
            // Late or doubled: the history has already gone on.
            return Ok((&self.touch, None));
        }
        let elapsed = before.map(|last| (frame.time_ns - last) as f64 * 1e-9);
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        self.touch.signals.resize(expected, f64::NAN);
        self.touch.rest.clone_from(&self.rest);
        self.touch.taxels.resize(expected, NOTHING);
        if elapsed.is_some_and(|dt| dt > self.longest_pause()) {
            let until = frame.time_ns + self.guard_ns();
            self.wrong_until_ns.fill(until);
        }
        self.follow(&frame.values, elapsed, frame.time_ns);
        self.last_time_ns = Some(frame.time_ns);
        let captured = self.capture_frame();
        self.find_contacts();
        Ok((&self.touch, captured))
    }

    fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some(RestReadings::new(self.rest.len(), frames));
    }

    fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    fn clear_rest(&mut self) {
        self.rest.fill(self.model.rest);
        self.forget();
    }

    fn rest_state(&self) -> Option<RestState> {
        Some(RestState::Signals(self.rest.clone()))
    }

    fn restore_rest(&mut self, rest: &RestState) {
        if let RestState::Signals(rest) = rest {
            self.rest.clone_from(rest);
            self.forget();
        }
    }
}

const NOTHING: TaxelValue = TaxelValue {
    value: f64::NAN,
    deviation: f64::NAN,
    state: State::Faulty,
};

/// Force per voltage, as [`ChargeEstimator`] states it.
fn inverse(model: &ChargeModel, options: &ChargeEstimatorOptions) -> Transfer {
    let guard = options.drift_guard;
    let high_pass = Transfer::lead(
        guard / (model.high_pass * model.volt_per_newton),
        model.high_pass,
        guard,
    );
    match model.low_pass {
        Some(time) => high_pass.then(&Transfer::lead(1.0, time, options.smoothing)),
        None => high_pass,
    }
}

/// Root of the sum of squares of the response to one reading of 1 V: what
/// white noise of the readings grows to.
fn noise_gain(chain: &Chain, step: &Step) -> f64 {
    let mut memory = chain.settled(0.0);
    let first = chain.advance(&mut memory, step, 1.0);
    let mut squares = first * first;
    let mut quiet = 0;
    // The slowest mode decides; a bound keeps a device with a long guard and a
    // high rate cheap.
    for _ in 0..MOST_STEPS {
        let value = chain.advance(&mut memory, step, 0.0);
        squares += value * value;
        quiet = if value * value < 1e-12 * squares {
            quiet + 1
        } else {
            0
        };
        if quiet > 100 {
            break;
        }
    }
    squares.sqrt()
}

/// Steps after which [`noise_gain`] stops.
const MOST_STEPS: usize = 200_000;

fn meaning(model: &ChargeModel) -> SignalMeaning {
    let layout = &model.layout;
    SignalMeaning {
        rows: layout.rows,
        columns: layout.columns,
        pitch: [layout.pitch[1], layout.pitch[0]],
        channels: (1..=layout.taxels())
            .map(|number| format!("sensel {number}"))
            .collect(),
        signal: Scale {
            quantity: "voltage",
            symbol: "mV",
            si_per_unit: 1e-3,
        },
        value: Scale {
            quantity: "change of force",
            symbol: "mN",
            si_per_unit: 1e-3,
        },
        full_scale: model.full_scale,
        signed: true,
        picture: Picture::Grayscale,
    }
}
