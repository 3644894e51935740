//! The reading of an empty device as a state: it follows a slow drift and never
//! a contact, and its changes are on record.

use std::collections::VecDeque;

use super::drift_rate::{DriftRate, Seen};

/// Options of the baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct BaselineOptions {
    /// Standard deviation of one reading of each channel, in its unit.
    pub deviations: Vec<f64>,
    /// The fastest drift, in deviations of a reading per second; default 0.06. What
    /// changes faster is a contact, and so is what changes much faster than the device
    /// was seen to drift.
    pub fastest_drift: f64,
    /// Time over which a drift is followed, s; default 20.
    pub follow: f64,
    /// Time over which readings are averaged to detect a contact, s; default 1.
    pub smoothing: f64,
    /// Time after a contact until the readings of the empty channel count, s;
    /// default 0.25.
    pub settling: f64,
    /// A pause between frames after which the average begins anew, and the time without a
    /// reading after which a channel is held, s; default 1.
    pub longest_pause: f64,
    /// True if every contact is known by other means: then no reading is held because it left
    /// the baseline, and the baseline comes after it at no more than the fastest drift;
    /// default false.
    pub contacts_known: bool,
    /// True if a channel stays held as long as a contact is known there, also where it comes back
    /// to where it was; default false.
    pub held_by_contact: bool,
    /// Time between readings whose noise is independent, s, 0.1 at most: the level is an
    /// average of so many; default 0.1, of frames that may be slow.
    pub period: f64,
}

impl BaselineOptions {
    /// The defaults for channels of this noise.
    pub fn new(deviations: Vec<f64>) -> Self {
        Self {
            deviations,
            fastest_drift: FASTEST_DRIFT,
            follow: 20.0,
            smoothing: 1.0,
            settling: 0.25,
            longest_pause: 1.0,
            contacts_known: false,
            held_by_contact: false,
            period: LONGEST_STEP,
        }
    }
}

/// Why a baseline changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// A tare: the reading was declared empty.
    Tare,
    /// The empty channel drifted.
    Drift,
    /// A contact came: what was followed since shortly before is taken back.
    Contact,
    /// A contact went, and the channel had drifted meanwhile.
    AfterContact,
}

impl Why {
    /// The reason in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Tare => "tare",
            Self::Drift => "slow drift of the empty channel",
            Self::Contact => "a contact came; what was followed just before is taken back",
            Self::AfterContact => "drift during a contact that has gone",
        }
    }
}

/// One change of the baseline of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Device time, ns.
    pub time_ns: u64,
    /// The channel.
    pub channel: usize,
    /// Baseline before, in the unit of the channel.
    pub from: f64,
    /// Baseline after.
    pub to: f64,
    /// Why it changed.
    pub why: Why,
}

/// The baselines of all channels of a device.
///
/// An empty channel is followed in level and rate, the rate bounded by the
/// fastest drift. A channel is held as soon as a contact is known there, or its
/// averaged reading leaves the baseline by more than noise and drift can do; a
/// held baseline does not move however long the contact lasts. So is a channel that has no
/// reading: it drifts on unseen. Between contacts
/// the empty channel is measured anew, each pause weighed with what drift may have
/// hidden before it. The hold ends when the reading stays back, or has come down to
/// what drift can have done since.
///
/// What a hold hides follows from the drift of the channels that can be observed
/// meanwhile ([`Self::drift_rate`]).
#[derive(Debug, Clone)]
pub struct Baseline {
    options: BaselineOptions,
    channels: Vec<Channel>,
    /// The last changes, the oldest first, and how many there were in all.
    history: VecDeque<Change>,
    changes: u64,
    rate: DriftRate,
    last_time_ns: Option<u64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    level: f64,
    /// Level of the last tare: what the model takes for rest.
    declared: f64,
    /// Per second.
    rate: f64,
    /// Level on record.
    recorded: f64,
    /// Average of reading less level, and its variance over that of a reading.
    average: f64,
    spread: f64,
    /// Level, rate and age, s, at two earlier times.
    earlier: [Earlier; 2],
    /// What is known of level and rate while they are held, then when the hold ended.
    known: Known,
    /// For how long the channel has been followed, s.
    followed: f64,
    /// For how long it has had no reading, s.
    absent: f64,
    held: Option<Held>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Earlier {
    level: f64,
    rate: f64,
    age: f64,
}

/// Variance of level and rate, and their covariance, over the variance of a reading.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    level: f64,
    both: f64,
    rate: f64,
}

impl Known {
    /// A frame later; rates change to others of the variance `usual`.
    fn later(self, pace: &Pace, usual: f64) -> Self {
        let (step, forgotten) = (pace.elapsed, 1.0 - pace.steady * pace.steady);
        let level = self.level + step * (2.0 * self.both + step * self.rate);
        let rate = self.rate + forgotten * (usual - self.rate);
        // A rate that is forgotten takes what it shares with the level along.
        let most = (level * rate).sqrt();
        Self {
            level,
            both: (self.both + step * self.rate).min(most),
            rate,
        }
    }

    /// When a drift at a rate of the deviation `rate` may have begun `age` seconds ago.
    fn drifted(&mut self, rate: f64, age: f64) {
        let hidden = rate * age;
        self.level += hidden * hidden;
        // The rate before is not the one that the drift has.
        self.both = rate * hidden;
        self.rate = rate * rate;
    }

    /// After a measurement of the level with this noise, and the gains of level and
    /// rate.
    fn measured(self, noise: f64) -> (Self, [f64; 2]) {
        let [level, rate] = [self.level, self.both].map(|value| value / (self.level + noise));
        let known = Self {
            level: self.level - level * self.level,
            both: self.both - level * self.both,
            rate: self.rate - rate * self.both,
        };
        (known, [level, rate])
    }
}

/// Coefficients of the filters for the time since the last frame.
struct Pace {
    elapsed: f64,
    /// The same, bounded.
    step: f64,
    /// Weight of a reading in the average.
    weight: f64,
    /// Share of a level that stays.
    stay: f64,
    /// Share of a rate that stays while it is held.
    steady: f64,
}

impl Pace {
    fn of(elapsed: f64, options: &BaselineOptions) -> Self {
        let step = elapsed.min(LONGEST_STEP);
        Self {
            elapsed,
            step,
            weight: 1.0 - (-step.max(1e-9) / options.smoothing).exp(),
            stay: (-step / options.follow).exp(),
            steady: (-elapsed / STEADY).exp(),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Held {
    /// For how long the level was not measured, s.
    age: f64,
    /// A contact is or was known there.
    known: bool,
    /// It had no reading while no contact was known: where it comes back, within what
    /// drift can have done, is empty.
    unseen: bool,
    /// The largest average so far.
    most: f64,
    /// For how long the contact seems to have gone, s.
    gone: f64,
    pause: Pause,
    /// The last pause; the level as it was held before the first.
    last: Measured,
    /// The last look at what no contact is known to hold.
    looked: Option<Measured>,
    /// Rate of drift from the pause before to the last one, and its variances over that of
    /// a reading; until it is learned from.
    seen: Option<[f64; 3]>,
}

/// What a pause measured.
#[derive(Debug, Clone, Copy)]
struct Measured {
    reading: f64,
    /// Its variance over that of a reading, and that of readings whose noise is independent.
    noise: [f64; 2],
    /// Since then, s.
    age: f64,
}

impl Measured {
    /// Rate from then to a later pause, and its variances over that of a reading.
    fn rate_to(&self, later: &Self) -> [f64; 3] {
        let elapsed = self.age - later.age;
        let noise = |kind: usize| (self.noise[kind] + later.noise[kind]) / (elapsed * elapsed);
        let rate = (later.reading - self.reading) / elapsed;
        [rate, noise(0), noise(1)]
    }
}

/// What a pause says of the level: by how much it and its rate differ, and what is known of
/// them with it.
struct Measurement {
    known: Known,
    level: f64,
    rate: f64,
}

/// The empty channel between two contacts: sum of the readings less the level over
/// time, the time, s, and the sum of the squared times between readings. The end is looked
/// at only once it is not the beginning of the next contact.
#[derive(Debug, Clone, Copy, Default)]
struct Pause {
    /// Since the contact went, s.
    age: f64,
    sum: [f64; 3],
    /// The same at two earlier times.
    earlier: [[f64; 3]; 2],
    /// Since the newer of them, s.
    since: f64,
}

impl Pause {
    fn push(&mut self, off: f64, step: f64, settling: f64) {
        self.age += step;
        if self.age < settling {
            return;
        }
        let [sum, time, squares] = self.sum;
        self.sum = [sum + off * step, time + step, squares + step * step];
        self.since += step;
        if self.since >= settling {
            self.since = 0.0;
            self.earlier = [self.sum, self.earlier[0]];
        }
    }

    /// Time since its middle, s.
    fn since_middle(&self) -> f64 {
        self.age - 0.5 * self.earlier[1][1]
    }

    /// Mean of the readings less the level with its variance over that of a reading, as
    /// large as noise that lasts for the longest step makes it.
    fn mean(&self) -> Option<[f64; 2]> {
        let [sum, time, _] = self.earlier[1];
        (time > 0.0).then(|| [sum / time, LONGEST_STEP / time])
    }

    /// The same variance of readings whose noise is independent. Less noise than this makes
    /// a sample of the rates too large, more would make it too small.
    fn least_noise(&self) -> f64 {
        let [_, time, squares] = self.earlier[1];
        squares / (time * time)
    }
}

/// The fastest drift, in deviations of a reading per second.
pub(super) const FASTEST_DRIFT: f64 = 0.06;
/// A rate of drift holds for about this time, s.
pub(super) const STEADY: f64 = 300.0;
/// The average leaves the baseline when it differs by this many deviations.
const LEAVES: f64 = 5.0;
/// Following a drift that begins, the level is behind by at most this share, 1/e, of what
/// the drift does in the time of following.
const BEHIND: f64 = 0.37;
/// A contact that came down to this share of its most has gone.
const GONE: f64 = 0.25;
/// ... when it stays there for this many times of smoothing: of the contact the
/// average keeps exp(-8), 3e-4.
const SETTLED: f64 = 8.0;
/// Followed for this many times of following a rate is one of the channel alone.
const FOLLOWED: f64 = 2.0;
/// Longest step of the filter, s: one reading after a pause weighs no more.
const LONGEST_STEP: f64 = 0.1;
/// A drift goes on record when it has moved by this many deviations.
const RECORDED: f64 = 1.0;
/// Changes that are kept.
const KEPT: usize = 256;
/// A pause whose mean is this many deviations from what is expected measured no empty
/// channel.
const EMPTY: f64 = 3.0;

impl Baseline {
    /// Baselines at zero.
    pub fn new(options: BaselineOptions) -> Self {
        Self {
            channels: vec![Channel::default(); options.deviations.len()],
            history: VecDeque::new(),
            changes: 0,
            rate: DriftRate::new(options.fastest_drift),
            last_time_ns: None,
            options,
        }
    }

    /// Declares `readings` empty; a channel without a reading (not a number)
    /// keeps its baseline.
    pub fn tare(&mut self, time_ns: u64, readings: &[f64]) {
        for (channel, reading) in readings.iter().enumerate().take(self.channels.len()) {
            if reading.is_finite() {
                self.channels[channel].declared = *reading;
                self.set(time_ns, channel, *reading, Why::Tare);
            }
        }
    }

    /// Replaces the standard deviations of the readings, as a rest capture
    /// measured them.
    pub fn set_noise(&mut self, deviations: Vec<f64>) {
        self.options.deviations = deviations;
        self.channels
            .resize(self.options.deviations.len(), Channel::default());
    }

    /// Takes the readings of a frame; `occupied` says of a channel that a
    /// contact is known there. A frame that is not newer than the last one
    /// changes nothing.
    pub fn push(&mut self, time_ns: u64, readings: &[f64], occupied: impl Fn(usize) -> bool) {
        let last = self.last_time_ns.unwrap_or(time_ns);
        if time_ns < last {
            return;
        }
        let pace = Pace::of((time_ns - last) as f64 * 1e-9, &self.options);
        self.last_time_ns = Some(time_ns);
        let rate = self.rate.deviation();
        let fastest = self.rate.fastest();
        let mut seen = false;
        for (index, reading) in readings.iter().enumerate().take(self.channels.len()) {
            let channel = &mut self.channels[index];
            let deviation = self.options.deviations[index];
            let change = if reading.is_finite() {
                channel.follow(
                    *reading,
                    &pace,
                    occupied(index),
                    [deviation, rate, fastest * deviation],
                    &self.options,
                )
            } else {
                channel.miss(&pace, occupied(index), [deviation, rate], &self.options)
            };
            seen |= channel.held.is_some_and(|held| held.seen.is_some());
            let moved = (channel.level - channel.recorded).abs() > RECORDED * deviation;
            if let Some(why) = change.or(moved.then_some(Why::Drift)) {
                self.record(time_ns, index, why);
            }
        }
        if self.rate.is_due(pace.step, seen) {
            let options = &self.options;
            let channels = self.channels.iter_mut().zip(&options.deviations);
            let channels = channels.filter(|(_, deviation)| **deviation > 0.0);
            let rates = channels.filter_map(|(channel, deviation)| {
                if channel.followed > FOLLOWED * options.follow {
                    return Some(Seen {
                        rate: channel.rate / deviation,
                        noise: [rate_noise(options); 2],
                        followed: true,
                    });
                }
                let [rate, noise, least] = channel.held.as_mut()?.seen.take()?;
                Some(Seen {
                    rate: rate / deviation,
                    noise: [noise, least],
                    followed: false,
                })
            });
            if self.rate.learn(rates, rate_noise(options)) {
                let begun = self.rate.deviation();
                let channels = self.channels.iter_mut().zip(&options.deviations);
                channels.for_each(|(channel, deviation)| {
                    channel.drift_began(begun, options.fastest_drift * deviation, options);
                });
            }
        }
    }

    /// Standard deviation of the rates at which the empty channels drift, in deviations
    /// of a reading per second: what is expected of the device before it was observed,
    /// then what the channels that nothing touches show.
    pub fn drift_rate(&self) -> f64 {
        self.rate.deviation()
    }

    /// Baseline of a channel, in its unit.
    pub fn level(&self, channel: usize) -> f64 {
        let (deviation, options) = (self.options.deviations[channel], &self.options);
        self.channels[channel].level_now(deviation, options)
    }

    /// Drift of the empty channel since the last tare, in its unit: to be taken from a
    /// reading before the model is asked what it means.
    pub fn drift(&self, channel: usize) -> f64 {
        self.level(channel) - self.channels[channel].declared
    }

    /// Standard deviation of the baseline of a channel, in its unit.
    pub fn deviation(&self, channel: usize) -> f64 {
        self.variance(channel).sqrt()
    }

    /// Variance of the baseline of a channel, in its unit squared: the noise that
    /// it follows, and the drift that a hold hides.
    #[inline]
    pub fn variance(&self, channel: usize) -> f64 {
        let options = &self.options;
        let deviation = options.deviations[channel];
        let hidden = self.channels[channel].variance(deviation, self.rate.deviation(), options);
        deviation * deviation * hidden
    }

    /// True if a channel is held.
    pub fn held(&self, channel: usize) -> bool {
        self.channels[channel].held.is_some()
    }

    /// The last changes, the oldest first.
    pub fn history(&self) -> impl DoubleEndedIterator<Item = &Change> + ExactSizeIterator {
        self.history.iter()
    }

    /// Number of all changes, also of those that are no longer kept.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    fn set(&mut self, time_ns: u64, channel: usize, level: f64, why: Why) {
        let Channel {
            declared, recorded, ..
        } = self.channels[channel];
        self.channels[channel] = Channel {
            level,
            declared,
            recorded,
            earlier: [Earlier {
                level,
                ..Earlier::default()
            }; 2],
            ..Channel::default()
        };
        self.record(time_ns, channel, why);
    }

    fn record(&mut self, time_ns: u64, channel: usize, why: Why) {
        let state = &mut self.channels[channel];
        let from = std::mem::replace(&mut state.recorded, state.level);
        self.changes += 1;
        if self.history.len() == KEPT {
            self.history.pop_front();
        }
        self.history.push_back(Change {
            time_ns,
            channel,
            from,
            to: state.level,
            why,
        });
    }
}

/// By how much an average leaves the baseline when neither its noise nor a drift that
/// begins at the `fastest` rate can have done it.
fn gate(noise: f64, fastest: f64, options: &BaselineOptions) -> f64 {
    noise + BEHIND * fastest * options.follow
}

/// Variance of a level that is followed without a drift, over that of a reading: of
/// readings averaged over the time of following.
fn level_noise(options: &BaselineOptions) -> f64 {
    let period = options.period.min(LONGEST_STEP);
    1.25 * period.min(options.smoothing) / options.follow
}

/// Variance of a rate that is followed, over that of a reading, 1/s².
fn rate_noise(options: &BaselineOptions) -> f64 {
    0.25 * LONGEST_STEP.min(options.smoothing) / options.follow.powi(3)
}

/// Variance of a level that follows rates of drift of this deviation, which change within
/// the time for which a rate holds, over that of a reading.
fn lag(rate: f64, options: &BaselineOptions) -> f64 {
    rate * rate * options.follow.powi(3) / (2.0 * STEADY)
}

impl Channel {
    /// Variance of the level, over that of a reading; `rate` is that of drifts.
    fn variance(&self, deviation: f64, rate: f64, options: &BaselineOptions) -> f64 {
        let Some(held) = &self.held else {
            return self.known.level + level_noise(options) + lag(rate, options);
        };
        match self.between_contacts(held, deviation, options) {
            Some(pause) => pause.known.level,
            None => self.known.level,
        }
    }

    /// The level with what the pause so far measured.
    fn level_now(&self, deviation: f64, options: &BaselineOptions) -> f64 {
        let held = self.held.as_ref();
        let pause = held.and_then(|held| self.between_contacts(held, deviation, options));
        self.level + pause.map_or(0.0, |pause| pause.level)
    }

    /// What the pause so far measured; what no contact is known to hold is measured once it
    /// has stayed.
    fn between_contacts(
        &self,
        held: &Held,
        deviation: f64,
        options: &BaselineOptions,
    ) -> Option<Measurement> {
        held.known
            .then(|| self.measurement(held, deviation, options))
            .flatten()
    }

    fn follow(
        &mut self,
        reading: f64,
        pace: &Pace,
        occupied: bool,
        [deviation, rate, fastest]: [f64; 3],
        options: &BaselineOptions,
    ) -> Option<Why> {
        let &Pace {
            elapsed,
            step,
            weight,
            ..
        } = pace;
        self.absent = 0.0;
        if elapsed > options.longest_pause {
            (self.average, self.spread) = (0.0, 0.0);
        }
        if self.held.is_none() {
            self.level += self.rate * step;
        }
        let off = reading - self.level;
        self.average += weight * (off - self.average);
        self.spread = (1.0 - weight).powi(2) * self.spread + weight * weight;
        let noise = LEAVES * deviation * self.spread.sqrt();
        let leaves = !options.contacts_known && self.average.abs() > gate(noise, fastest, options);
        let Some(mut held) = self.held else {
            if occupied || leaves {
                return self.hold(elapsed, [deviation, rate], options);
            }
            self.followed += step;
            // What was not known when the hold ended.
            self.known.level *= pace.stay;
            self.known.rate *= pace.stay;
            let off = if options.contacts_known {
                let most = options.fastest_drift * deviation * options.follow;
                off.clamp(-most, most)
            } else {
                off
            };
            self.learn(off, pace, fastest, options);
            return None;
        };
        let ahead = self.wait(&mut held, pace, rate);
        self.average -= ahead;
        let off = off - ahead;
        if self.average.abs() > held.most.abs() {
            held.most = self.average;
        }
        held.known |= occupied;
        if occupied {
            self.measure(&mut held, deviation, options);
        } else {
            // In a long contact the doubt about the level grows until it may pass for none; what
            // is as large as a contact that is known is no pause.
            let large = off.abs() > GONE * held.most.abs() + LEAVES * deviation;
            if large && held.known && !held.unseen {
                held.pause = Pause::default();
            } else {
                held.pause.push(off, step, options.settling);
            }
            let known = held.known || held.unseen;
            if !known && held.pause.age > SETTLED * options.smoothing {
                self.look(&mut held, options);
            }
        }
        let hidden = options.fastest_drift * deviation * held.age;
        let drifted = hidden + fastest * options.follow + noise;
        let may_be_gone = !(occupied && options.held_by_contact);
        let came_down = may_be_gone && self.average.abs() < drifted.min(GONE * held.most.abs());
        let gone = came_down || !occupied && (!leaves || held.unseen);
        held.gone = if gone { held.gone + elapsed } else { 0.0 };
        if held.gone < SETTLED * options.smoothing {
            self.held = Some(held);
            return None;
        }
        let measured = self.measure(&mut held, deviation, options);
        if leaves && held.unseen && !measured {
            self.held = Some(held);
            return None;
        }
        (self.held, self.followed) = (None, 0.0);
        self.earlier = [self.now(); 2];
        if !measured && came_down {
            self.empty();
        }
        (measured || came_down).then_some(Why::AfterContact)
    }

    /// A frame without a reading of this channel.
    fn miss(
        &mut self,
        pace: &Pace,
        occupied: bool,
        known @ [_, rate]: [f64; 2],
        options: &BaselineOptions,
    ) -> Option<Why> {
        self.absent += pace.elapsed;
        let absent = self.absent > options.longest_pause;
        let Some(mut held) = self.held else {
            self.level += self.rate * pace.step;
            return if absent {
                self.hold(self.absent, known, options)
            } else {
                None
            };
        };
        self.wait(&mut held, pace, rate);
        held.known |= occupied;
        if absent {
            held.unseen |= !occupied;
            (held.pause, held.gone) = (Pause::default(), 0.0);
            (self.average, self.spread) = (0.0, 0.0);
        }
        self.held = Some(held);
        None
    }

    /// Time passes for a channel that is held: by how much its level goes on.
    fn wait(&mut self, held: &mut Held, pace: &Pace, rate: f64) -> f64 {
        held.age += pace.elapsed;
        held.last.age += pace.elapsed;
        if let Some(looked) = &mut held.looked {
            looked.age += pace.elapsed;
        }
        self.known = self.known.later(pace, rate * rate);
        let ahead = self.rate * pace.elapsed;
        self.rate *= pace.steady;
        self.level += ahead;
        ahead
    }

    /// A drift at rates of the deviation `rate`, of at most `fastest`, began while the
    /// channel was held.
    fn drift_began(&mut self, rate: f64, fastest: f64, options: &BaselineOptions) {
        let Some(held) = &self.held else {
            return;
        };
        let drifted = fastest * (held.age + options.follow);
        if held.known || self.average.abs() > drifted {
            self.known.drifted(rate, held.age);
        } else {
            // It was the drift that was taken for a contact.
            self.held = None;
            self.empty();
        }
    }

    /// The channel is empty: what is left of its average is drift.
    fn empty(&mut self) {
        self.followed = 0.0;
        self.level += self.average;
        self.known.level = self.spread;
        (self.average, self.spread) = (0.0, 0.0);
        self.earlier = [self.now(); 2];
    }

    /// Level and rate to go back to.
    fn now(&self) -> Earlier {
        Earlier {
            level: self.level,
            rate: self.rate,
            age: 0.0,
        }
    }

    /// What no contact is known to hold is looked at again and again: a light touch that
    /// stays keeps its reading, and a drift goes on. The first look may see it come.
    fn look(&self, held: &mut Held, options: &BaselineOptions) {
        let pause = std::mem::take(&mut held.pause);
        let came = held.age < 1.5 * SETTLED * options.smoothing;
        let Some(now) = self.read(&pause).filter(|_| !came) else {
            return;
        };
        let last = held.looked.replace(now);
        held.seen = last.map(|last| last.rate_to(&now));
    }

    /// What a pause read.
    fn read(&self, pause: &Pause) -> Option<Measured> {
        let [mean, noise] = pause.mean()?;
        Some(Measured {
            reading: self.level + mean,
            noise: [noise, pause.least_noise()],
            age: pause.since_middle(),
        })
    }

    /// What the pause so far says of level and rate: it, and the drift that was hidden
    /// before it, weigh as they are known. None where it is more than drift explains, or a
    /// light touch that has stayed.
    fn measurement(
        &self,
        held: &Held,
        deviation: f64,
        options: &BaselineOptions,
    ) -> Option<Measurement> {
        let fastest = options.fastest_drift * deviation;
        let [mean, noise] = held.pause.mean()?;
        let mut known = self.known;
        let explained = EMPTY * deviation * (known.level + noise).sqrt();
        let back = if held.unseen {
            f64::INFINITY
        } else {
            (EMPTY * deviation * noise.sqrt()).max(GONE * held.most.abs())
        };
        if mean.abs() > back.min(explained + fastest * held.age) {
            return None;
        }
        if mean.abs() > explained {
            // More than was known to be possible: a drift has begun since.
            known.drifted(options.fastest_drift, held.age);
        }
        let (known, [level, rate]) = known.measured(noise);
        Some(Measurement {
            known,
            level: level * mean,
            rate: rate * mean,
        })
    }

    /// A pause has ended. False when the channel was not measured.
    fn measure(&mut self, held: &mut Held, deviation: f64, options: &BaselineOptions) -> bool {
        let found = self.measurement(held, deviation, options);
        let pause = std::mem::take(&mut held.pause);
        let Some(now) = self.read(&pause) else {
            return false;
        };
        held.seen = Some(std::mem::replace(&mut held.last, now).rate_to(&now));
        let Some(found) = found else {
            return false;
        };
        let fastest = options.fastest_drift * deviation;
        self.known = found.known;
        self.level += found.level;
        self.average -= found.level;
        self.rate = (self.rate + found.rate).clamp(-fastest, fastest);
        held.age = 0.0;
        true
    }

    /// Holds level and rate of some time ago: a slow touch was followed meanwhile.
    fn hold(
        &mut self,
        elapsed: f64,
        [deviation, drift]: [f64; 2],
        options: &BaselineOptions,
    ) -> Option<Why> {
        let before = self.level;
        let earlier = self.earlier[1];
        self.level = earlier.level;
        self.average += before - self.level;
        // The rate that was followed, as far as it stands out of its noise.
        let noise = rate_noise(options) + self.known.rate;
        let share = drift * drift / (drift * drift + noise);
        self.rate = share * earlier.rate;
        self.known = Known {
            level: self.variance(deviation, drift, options),
            both: 0.0,
            rate: share * noise,
        };
        self.followed = 0.0;
        self.held = Some(Held {
            age: elapsed,
            known: false,
            unseen: false,
            most: self.average,
            gone: 0.0,
            pause: Pause::default(),
            last: Measured {
                reading: self.level,
                noise: [self.variance(deviation, drift, options); 2],
                age: elapsed,
            },
            looked: None,
            seen: None,
        });
        (before != self.level).then_some(Why::Contact)
    }

    /// A critically damped filter of level and rate.
    fn learn(&mut self, off: f64, pace: &Pace, fastest: f64, options: &BaselineOptions) {
        let &Pace { step, stay, .. } = pace;
        self.level += (1.0 - stay * stay) * off;
        if step > 0.0 {
            let rate = self.rate + (1.0 - stay).powi(2) / step * off;
            self.rate = rate.clamp(-fastest, fastest);
        }
        // Two levels, each kept for twice the smoothing.
        self.earlier.iter_mut().for_each(|one| one.age += step);
        if self.earlier[0].age > 2.0 * options.smoothing {
            self.earlier = [self.now(), self.earlier[0]];
        }
    }
}

#[cfg(test)]
mod tests;
