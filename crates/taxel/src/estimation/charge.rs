//! Voltages of elements that give charge to changes of force: the high-pass of
//! the leak undone, with a guard against drift (P3).

use std::sync::Arc;

use super::charge_balance::{ChargeBalance, LEAK, Leak, Shown};
use super::contact::Cell;
use super::last_positions::LastPositions;
use super::localisation::Localiser;
use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{ChannelFacts, Wiring};
use crate::layout::Layout;
use crate::signal::{NumberScale, Position};
use taxel_numerics::linear_chain::{Chain, Memory, Step, Transfer};

/// Model of an array of elements whose signal is V/F = g · τs/(1 + τs) · 1/(1 + τ_f s).
#[derive(Debug, Clone, PartialEq)]
pub struct ChargeModel {
    /// Where the elements are.
    pub layout: Layout,
    /// Numbers of a frame to the output, V, or C of a charge that is measured.
    pub channel: NumberScale,
    /// The output for people.
    pub reading: Scale,
    /// The output stays between plus and minus this.
    pub limit: f64,
    /// Output at rest.
    pub rest: f64,
    /// Gain in the band g, V/N or C/N; not zero, negative where the stages invert.
    pub output_per_newton: f64,
    /// Gain of each element over that, above zero; one where it is not known.
    pub gains: Vec<f64>,
    /// Standard deviation of what a gain is not known, as a share of it.
    pub gain_deviation: f64,
    /// Time constant of the high-pass τ, s; infinite where no charge leaks.
    pub high_pass: f64,
    /// Time constant of the low-pass τ_f, s, where there is one.
    pub low_pass: Option<f64>,
    /// Standard deviation of one reading of the output.
    pub deviation: f64,
    /// Time between frames, s.
    pub period: f64,
    /// Elements that are not used.
    pub masked: Vec<bool>,
    /// Force on one element at the end of the colour scale, N.
    pub full_scale: f64,
}

/// Options of the reader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChargeOptions {
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

impl Default for ChargeOptions {
    fn default() -> Self {
        Self {
            drift_guard: 5.0,
            smoothing: 5e-3,
            contact_deviations: 6.0,
            contact_share: 0.01,
        }
    }
}

/// Reads arrays of elements that give charge: voltages to changes of force.
///
/// F = V/g · (1 + τs)T/(τ(1 + Ts)) · (1 + τ_f s)/(1 + T_s s): a pure
/// integral would be T → ∞, F = (V + ∫V dt/τ)/g. A force that is held fades with the
/// drift guard T; one that comes or goes faster is right.
#[derive(Debug, Clone)]
pub struct ChargeReader {
    model: ChargeModel,
    options: ChargeOptions,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    inverse: Option<Chain>,
    /// A step of one period, prepared.
    step: Option<Step>,
    memories: Vec<Memory>,
    /// Voltage at rest of each element, V.
    rest: Vec<f64>,
    /// Time after which a clipped reading or a pause has faded, ns.
    wrong_until_ns: Vec<u64>,
    /// Where charge leaks.
    balance: Option<ChargeBalance>,
    kept: Vec<Kept>,
    held: Vec<Held>,
    /// What the baseline takes, V, and where it takes nothing.
    empty: Vec<f64>,
    occupied: Vec<bool>,
    last_time_ns: Option<u64>,
    gains: Gains,
    /// Standard deviation of the force on each element by its readings alone, N.
    deviations: Vec<f64>,
    localiser: Option<Arc<dyn Localiser>>,
    located: Option<LastPositions>,
}

/// What becomes of a voltage in the force, N/V.
#[derive(Debug, Clone, Copy)]
struct Gains {
    /// Standard deviation of the force over that of readings whose noise is white.
    noise: f64,
    /// Force that an offset leaves.
    offset: f64,
}

/// Positions are looked for so often, ns: it takes up to some milliseconds.
const LOCATE_EVERY_NS: u64 = 10_000_000;

/// Pause that counts, as a share of the time constant of the high-pass.
const PAUSE: f64 = 0.1;

impl ChargeReader {
    /// A reader of the elements of `model`.
    pub fn new(model: ChargeModel, options: ChargeOptions) -> Self {
        let taxels = model.layout.taxels();
        let inverse = Chain::new(&inverse(&model, &options)).ok();
        let step = inverse.as_ref().map(|chain| chain.step(model.period));
        let gains = Gains {
            noise: match (&inverse, &step) {
                (Some(chain), Some(step)) => noise_gain(chain, step),
                _ => f64::NAN,
            },
            offset: if model.high_pass.is_finite() {
                options.drift_guard / (model.high_pass * model.output_per_newton)
            } else {
                0.0
            },
        };
        let memory = inverse.as_ref().map(|chain| chain.settled(0.0));
        Self {
            meaning: meaning(&model),
            channels: channels(&model),
            memories: memory.map_or(Vec::new(), |memory| vec![memory; taxels]),
            rest: vec![model.rest; taxels],
            wrong_until_ns: vec![0; taxels],
            balance: model.high_pass.is_finite().then(|| {
                let least = options.contact_share * model.full_scale;
                let volts = least * model.output_per_newton.abs();
                ChargeBalance::new(Leak {
                    high_pass: model.high_pass,
                    low_pass: model.low_pass.unwrap_or(0.0),
                    period: model.period,
                    deviation: model.deviation,
                    matters: model
                        .gains
                        .iter()
                        .map(|gain| [least, volts * gain])
                        .collect(),
                })
            }),
            kept: vec![Kept::default(); taxels],
            held: vec![Held::default(); taxels],
            empty: vec![f64::NAN; taxels],
            occupied: vec![false; taxels],
            last_time_ns: None,
            gains,
            deviations: vec![f64::NAN; taxels],
            localiser: None,
            located: None,
            inverse,
            step,
            options,
            model,
        }
    }

    /// Finds contacts and their positions by `localiser`; without, and where that
    /// finds no information, a contact is at the centre of its forces.
    #[must_use]
    pub fn with_localiser(mut self, localiser: Arc<dyn Localiser>) -> Self {
        self.localiser = Some(localiser);
        self
    }

    /// Standard deviation of the force on one element by the noise of the
    /// readings, N.
    pub fn deviation(&self) -> f64 {
        self.model.deviation * self.gains.noise
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

    /// Begins again from rest.
    fn forget(&mut self) {
        self.last_time_ns = None;
        self.wrong_until_ns.fill(0);
        if let Some(balance) = &mut self.balance {
            balance.forget();
        }
        self.kept.fill(Kept::default());
        self.held.fill(Held::default());
    }

    /// Change of force on an element after a change of its voltage; `other` is
    /// a step of another length than the usual one.
    fn follow(&mut self, index: usize, change: f64, first: bool, other: Option<&Step>) -> f64 {
        let Some(chain) = &self.inverse else {
            return f64::NAN;
        };
        let memory = &mut self.memories[index];
        if first {
            // What was before the first frame is not known.
            *memory = chain.settled(0.0);
            chain.advance(memory, &chain.step(0.0), change);
            return 0.0;
        }
        let step = other.or(self.step.as_ref());
        step.map_or(f64::NAN, |step| chain.advance(memory, step, change))
    }

    /// A frame begins, `elapsed` seconds after the one before.
    fn begin(&mut self, elapsed: f64) {
        if let Some(balance) = &mut self.balance {
            balance.begin(elapsed);
            let stays = (-elapsed / self.options.drift_guard).exp();
            self.kept.iter_mut().for_each(|kept| kept.force *= stays);
        }
    }

    /// The force on an element less what (19) keeps of touches that have gone; and what its
    /// output says of the offset.
    fn since_rest(
        &mut self,
        index: usize,
        output: Option<f64>,
        known: &Known<'_>,
        estimated: f64,
    ) -> f64 {
        let guard = self.options.drift_guard;
        let Some(balance) = &mut self.balance else {
            return estimated;
        };
        let kept = &mut self.kept[index];
        let offset = self.rest[index] + known.drift(index);
        let offset = [offset, known.drift_variance(index)];
        let held = &mut self.held[index];
        let force = estimated - kept.force + held.taken;
        let shown = balance.push(index, output, offset, force);
        let (offset, rest) = match shown {
            Shown::Nothing => (None, None),
            Shown::Faded => (output, None),
            Shown::Same { offset, rest } => (offset, rest),
        };
        self.occupied[index] = offset.is_none();
        self.empty[index] = offset.or(output).unwrap_or(f64::NAN);
        let Some([force, age]) = rest else {
            kept.frames = 0.0;
            return estimated - kept.force;
        };
        kept.learn(estimated, force * (-age / guard).exp());
        *held = Held::default();
        estimated - kept.force
    }

    /// Takes what the guard takes in `elapsed` seconds of the force on an element, of which `offset`
    /// and noise of the readings are deviations, N: F = F̂ + ∫F̂ dt/T. What was held fades as
    /// well once the touch is over.
    fn hold(
        &mut self,
        index: usize,
        touched: bool,
        elapsed: f64,
        [force, offset, noise]: [f64; 3],
    ) {
        let share = elapsed / self.options.drift_guard;
        let held = &mut self.held[index];
        if !touched {
            let stays = (-share).exp();
            held.taken *= stays;
            held.offset *= stays;
            held.walk *= stays * stays;
            return;
        }
        held.taken += share * force;
        if self.model.high_pass.is_finite() {
            held.offset += share * offset;
            let step = self.gains.offset / self.options.drift_guard * noise;
            held.walk += self.model.period * elapsed * step * step;
        } else {
            // The guard is there because nobody knows how such a meter drifts: all that it takes
            // may be drift.
            held.offset += share * force.abs();
        }
    }

    /// Number and positions of the contacts by their profiles, better than by centres
    /// of force.
    fn locate_contacts(&mut self, cells: &[Cell], touch: &mut Touch) {
        let (Some(localiser), regions @ 1..) = (&self.localiser, touch.contacts.len()) else {
            self.located = None;
            return;
        };
        if !matches!(&self.located, Some(located) if located.holds(touch.time_ns, regions)) {
            let forces: Vec<f64> = touch.taxels.iter().map(TaxelTouch::pressed).collect();
            let until_ns = touch.time_ns.saturating_add(LOCATE_EVERY_NS);
            // What gains are not known by is part of the localiser.
            let parts = localiser.positions(&forces, &self.deviations);
            self.located = Some(LastPositions::new(parts, until_ns, regions));
        }
        let Some(located) = &mut self.located else {
            return;
        };
        let pitch = self.model.layout.pitch;
        located.split(cells, pitch, &mut touch.contacts, &mut touch.regions);
        located.apply(&mut touch.contacts);
        if let [contact] = &touch.contacts[..] {
            touch.centre_of_pressure = Some((contact.centre, contact.covariance));
        }
    }
}

impl Reader for ChargeReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn rules(&self) -> Rules {
        let options = &self.options;
        let least = options.contact_share * self.model.full_scale;
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(options.contact_deviations, least),
            counted: counting(&[State::Ok, State::Saturated]),
            // Forces that fade do not add up.
            total: Total::Unknown,
            // Where no charge leaks an offset fades with the drift guard.
            drift: if self.model.high_pass.is_finite() {
                Drift::WithoutContact {
                    period: self.model.period,
                }
            } else {
                Drift::None
            },
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: 1,
                unit: "element",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        vec![self.model.deviation; self.rest.len()]
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    /// A late or doubled frame is not taken: the history has already gone on.
    fn takes(&self, time_ns: u64) -> bool {
        self.last_time_ns
            .is_none_or(|last| time_ns > last || last - time_ns > self.guard_ns())
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        let model = &self.model;
        let scale = &model.channel;
        let half = 0.5 * scale.per_number * scale.step;
        let mut clipped = 0;
        let slots = channels.readings.iter_mut().zip(&mut channels.states);
        for ((reading, state), number) in slots.zip(values) {
            let output = scale.input(*number);
            *reading = output;
            let at_limit = output.abs() >= model.limit - half;
            let position = scale.position(*number);
            let inside = position == Position::Inside && !at_limit;
            if inside || *state == ChannelState::Masked {
                continue;
            }
            clipped += usize::from(output.is_finite());
            // No output gives what lies beyond its limits; code zero is an open line.
            let possible = position != Position::Dead && output.abs() < model.limit + 3.0 * half;
            *state = if possible {
                ChannelState::Saturated
            } else {
                ChannelState::Faulty
            };
        }
        clipped
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        let time_ns = touch.time_ns;
        let guard_ns = self.guard_ns();
        // Long before the last frame the device has begun anew.
        let last = self.last_time_ns.filter(|last| time_ns > *last);
        let elapsed = last.map(|last| (time_ns - last) as f64 * 1e-9);
        let missed = elapsed.is_some_and(|dt| dt > self.longest_pause());
        if missed {
            self.wrong_until_ns.fill(time_ns + guard_ns);
        }
        self.begin(elapsed.unwrap_or(0.0));
        let period = self.model.period;
        let usual = elapsed.is_some_and(|dt| (dt - period).abs() < 1e-3 * period);
        let other = match (&self.inverse, elapsed) {
            (Some(chain), Some(dt)) if !usual => Some(chain.step(dt)),
            _ => None,
        };
        for index in 0..self.rest.len() {
            let volts = touch.channels.readings[index];
            let state = match touch.channels.states[index] {
                ChannelState::Masked => State::Masked,
                ChannelState::Faulty => State::Faulty,
                ChannelState::Saturated => State::Saturated,
                _ if self.wrong_until_ns[index] > time_ns => State::Unchecked,
                _ => State::Ok,
            };
            if state == State::Saturated {
                self.wrong_until_ns[index] = time_ns + guard_ns;
            }
            let change = if state == State::Faulty || !volts.is_finite() {
                0.0
            } else {
                volts - self.rest[index] - known.drift(index)
            };
            let value = self.follow(index, change, elapsed.is_none(), other.as_ref());
            let usable = !matches!(state, State::Masked | State::Faulty);
            let gain = if usable {
                self.model.gains[index]
            } else {
                f64::NAN
            };
            let offset = self.gains.offset * known.drift_variance(index).sqrt();
            let deviation = (self.gains.noise * known.noise[index]).hypot(offset) / gain;
            self.deviations[index] = deviation;
            let whole = usable && !missed && state != State::Saturated && volts.is_finite();
            let output = whole.then_some(volts);
            let force = self.since_rest(index, output, known, value / gain);
            if let (Some(elapsed), State::Ok) = (elapsed, state) {
                let touched = touch.regions[index].is_some();
                let noise = known.noise[index] / gain;
                self.hold(index, touched, elapsed, [force, offset / gain, noise]);
            } else {
                self.held[index] = Held::default();
            }
            let deviation = deviation.hypot(self.model.gain_deviation * force);
            touch.taxels[index] = TaxelTouch::pressing(force, deviation, state);
        }
        self.last_time_ns = Some(time_ns);
    }

    fn locate(&mut self, cells: &[Cell], touch: &mut Touch) {
        self.locate_contacts(cells, touch);
    }

    fn occupied(&self) -> Option<&[bool]> {
        Some(&self.occupied)
    }

    fn empty(&self) -> Option<&[f64]> {
        Some(&self.empty)
    }

    /// Without what the gain is not known by, which stays the same.
    fn by_noise(&self, taxel: usize) -> Option<f64> {
        let held = &self.held[taxel];
        let leak = if self.model.high_pass.is_finite() {
            LEAK * held.taken
        } else {
            0.0
        };
        let parts = [self.deviations[taxel], held.offset, held.walk.sqrt(), leak];
        Some(parts.into_iter().fold(0.0, f64::hypot))
    }

    fn held(&self, taxel: usize, value: f64) -> Option<[f64; 2]> {
        let force = value + self.held[taxel].taken;
        let gain = self.model.gain_deviation * force;
        Some([force, self.by_noise(taxel)?.hypot(gain)])
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        for (own, rest) in self.rest.iter_mut().zip(rest) {
            *own = if rest.is_nan() {
                self.model.rest
            } else {
                *rest
            };
        }
        self.forget();
    }
}

/// What (19) keeps of touches that have gone: the guard takes back what they held.
#[derive(Debug, Clone, Copy, Default)]
struct Kept {
    /// Force, N, and how many frames it is the mean of.
    force: f64,
    frames: f64,
}

impl Kept {
    /// A frame in which the force is known to be `force` and (19) says `estimated`.
    fn learn(&mut self, estimated: f64, force: f64) {
        self.frames += 1.0;
        self.force += (estimated - force - self.force) / self.frames;
    }
}

/// What the guard has taken of the force on an element since it was touched, and how well that is
/// known: the less, the longer it is held.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    /// Force, N.
    taken: f64,
    /// Standard deviation of what was taken by the offset, N, which is the same all the time.
    offset: f64,
    /// Its variance by noise, N².
    walk: f64,
}

/// Facts of each channel, in the numbers of a frame.
fn channels(model: &ChargeModel) -> Vec<ChannelFacts> {
    let scale = &model.channel;
    let [low, high] = scale.alive();
    // As far as a reading at the limit of the output may be rounded.
    let limits = [-model.limit, model.limit].map(|limit| scale.number(limit));
    let half = 0.5 * scale.step;
    let channel = |masked: &bool| ChannelFacts {
        deviation: model.deviation / scale.per_number,
        resolution: scale.step,
        span: [low.max(limits[0] + half), high.min(limits[1] - half)],
        ..ChannelFacts::unknown(!*masked)
    };
    model.masked.iter().map(channel).collect()
}

/// Force per voltage, as [`ChargeReader`] states it.
fn inverse(model: &ChargeModel, options: &ChargeOptions) -> Transfer {
    let guard = options.drift_guard;
    let high_pass = if model.high_pass.is_finite() {
        let gain = guard / (model.high_pass * model.output_per_newton);
        Transfer::lead(gain, model.high_pass, guard)
    } else {
        Transfer::high_pass(1.0 / model.output_per_newton, guard)
    };
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

fn meaning(model: &ChargeModel) -> Meaning {
    let layout = &model.layout;
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (1..=layout.taxels())
            .map(|number| format!("sensel {number}"))
            .collect(),
        wiring: Wiring::PerTaxel(1),
        reading: model.reading.clone(),
        value: Scale::new("change of force", "mN", 1e-3),
        components: 1,
        signed: true,
        full_scale: Some(model.full_scale),
        verified: None,
        picture: Picture::Grayscale,
        newtons: Some([1.0; 2]),
        total_known: false,
    }
}
