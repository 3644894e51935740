//! The reading of an empty device as a state: it follows a slow drift and never
//! a contact, and every change of it is on record and can be undone.

/// Options of the baseline.
#[derive(Debug, Clone, PartialEq)]
pub struct BaselineOptions {
    /// Standard deviation of one reading of each channel, in its unit.
    pub deviations: Vec<f64>,
    /// The fastest drift, in deviations per second; default 0.01. What
    /// changes faster is a contact.
    pub fastest_drift: f64,
    /// Time over which a drift is followed, s; default 20.
    pub follow: f64,
    /// Time over which readings are averaged to detect a contact, s; default 1.
    pub smoothing: f64,
    /// A pause between frames after which the average begins anew, s; default 1.
    pub longest_pause: f64,
}

impl BaselineOptions {
    /// The defaults for channels of this noise.
    pub fn new(deviations: Vec<f64>) -> Self {
        Self {
            deviations,
            fastest_drift: 0.01,
            follow: 20.0,
            smoothing: 1.0,
            longest_pause: 1.0,
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
    /// An earlier baseline was restored.
    Undone,
}

impl Why {
    /// The reason in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Tare => "tare",
            Self::Drift => "slow drift of the empty channel",
            Self::Contact => "a contact came; what was followed just before is taken back",
            Self::AfterContact => "drift during a contact that has gone",
            Self::Undone => "an earlier baseline was restored",
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
/// held baseline does not move however long the contact lasts. It is released
/// when the reading is back, or has come down to what drift can have done
/// since.
#[derive(Debug, Clone)]
pub struct Baseline {
    options: BaselineOptions,
    channels: Vec<Channel>,
    history: Vec<Change>,
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
    /// Level and age, s, at two earlier times.
    earlier: [(f64, f64); 2],
    held: Option<Held>,
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
}

impl Pace {
    fn of(elapsed: f64, options: &BaselineOptions) -> Self {
        let step = elapsed.min(LONGEST_STEP);
        Self {
            elapsed,
            step,
            weight: 1.0 - (-step.max(1e-9) / options.smoothing).exp(),
            stay: (-step / options.follow).exp(),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Held {
    /// For how long, s.
    age: f64,
    /// The largest average so far.
    most: f64,
    /// For how long the contact seems to have gone, s.
    gone: f64,
}

/// The average leaves the baseline when it differs by this many deviations.
const LEAVES: f64 = 5.0;
/// A contact that came down to this share of its most has gone.
const GONE: f64 = 0.25;
/// ... when it stays there for this many times of smoothing: of the contact the
/// average keeps exp(-8), 3e-4.
const SETTLED: f64 = 8.0;
/// Longest step of the filter, s: one reading after a pause weighs no more.
const LONGEST_STEP: f64 = 0.1;
/// A drift goes on record when it has moved by this many deviations.
const RECORDED: f64 = 1.0;

impl Baseline {
    /// Baselines at zero.
    pub fn new(options: BaselineOptions) -> Self {
        Self {
            channels: vec![Channel::default(); options.deviations.len()],
            options,
            history: Vec::new(),
            last_time_ns: None,
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
        for (index, reading) in readings.iter().enumerate().take(self.channels.len()) {
            let channel = &mut self.channels[index];
            let deviation = self.options.deviations[index];
            let change = if reading.is_finite() {
                channel.follow(*reading, &pace, occupied(index), deviation, &self.options)
            } else {
                None
            };
            let moved = (channel.level - channel.recorded).abs() > RECORDED * deviation;
            if let Some(why) = change.or(moved.then_some(Why::Drift)) {
                self.record(time_ns, index, why);
            }
        }
    }

    /// Baseline of a channel, in its unit.
    pub fn level(&self, channel: usize) -> f64 {
        self.channels[channel].level
    }

    /// Drift of the empty channel since the last tare, in its unit: to be taken from a
    /// reading before the model is asked what it means.
    pub fn drift(&self, channel: usize) -> f64 {
        let channel = &self.channels[channel];
        channel.level - channel.declared
    }

    /// Standard deviation of the baseline of a channel, in its unit.
    pub fn deviation(&self, channel: usize) -> f64 {
        self.variance(channel).sqrt()
    }

    /// Variance of the baseline of a channel, in its unit squared: the noise that
    /// it follows, and the drift that a hold hides, as likely anything up to the
    /// fastest.
    #[inline]
    pub fn variance(&self, channel: usize) -> f64 {
        let options = &self.options;
        let held = self.channels[channel].held.map_or(0.0, |held| held.age);
        let hidden = options.fastest_drift * (held + options.follow);
        // Of readings averaged over the time of following.
        let noise = 1.25 * LONGEST_STEP.min(options.smoothing) / options.follow;
        let deviation = options.deviations[channel];
        deviation * deviation * (noise + hidden * hidden / 3.0)
    }

    /// True if a channel is held.
    pub fn held(&self, channel: usize) -> bool {
        self.channels[channel].held.is_some()
    }

    /// All changes, the oldest first.
    pub fn history(&self) -> &[Change] {
        &self.history
    }

    /// Restores the baselines as they were when the history had `length`
    /// changes; the way back is on record too.
    pub fn undo_to(&mut self, time_ns: u64, length: usize) {
        let mut back: Vec<(usize, f64)> = Vec::new();
        for change in self.history.iter().skip(length) {
            if back.iter().all(|(channel, _)| *channel != change.channel) {
                back.push((change.channel, change.from));
            }
        }
        for (channel, level) in back {
            self.set(time_ns, channel, level, Why::Undone);
        }
    }

    fn set(&mut self, time_ns: u64, channel: usize, level: f64, why: Why) {
        let Channel {
            declared, recorded, ..
        } = self.channels[channel];
        self.channels[channel] = Channel {
            level,
            declared,
            recorded,
            earlier: [(level, 0.0); 2],
            ..Channel::default()
        };
        self.record(time_ns, channel, why);
    }

    fn record(&mut self, time_ns: u64, channel: usize, why: Why) {
        let state = &mut self.channels[channel];
        let from = std::mem::replace(&mut state.recorded, state.level);
        self.history.push(Change {
            time_ns,
            channel,
            from,
            to: state.level,
            why,
        });
    }
}

impl Channel {
    fn follow(
        &mut self,
        reading: f64,
        pace: &Pace,
        occupied: bool,
        deviation: f64,
        options: &BaselineOptions,
    ) -> Option<Why> {
        let fastest = options.fastest_drift * deviation;
        let &Pace {
            elapsed,
            step,
            weight,
            ..
        } = pace;
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
        let leaves = self.average.abs() > noise + fastest * options.follow;
        match &mut self.held {
            None if occupied || leaves => self.hold(elapsed),
            None => {
                self.learn(off, pace, fastest, options);
                None
            }
            Some(held) => {
                held.age += elapsed;
                if self.average.abs() > held.most.abs() {
                    held.most = self.average;
                }
                let drifted = fastest * (held.age + options.follow) + noise;
                let came_down = self.average.abs() < drifted.min(GONE * held.most.abs());
                let gone = came_down || !leaves && !occupied;
                held.gone = if gone { held.gone + elapsed } else { 0.0 };
                if held.gone < SETTLED * options.smoothing {
                    return None;
                }
                self.held = None;
                // After a contact what is left is drift.
                came_down.then(|| {
                    self.level += self.average;
                    (self.average, self.spread) = (0.0, 0.0);
                    self.earlier = [(self.level, 0.0); 2];
                    Why::AfterContact
                })
            }
        }
    }

    /// Holds the level of some time ago: a slow touch was followed meanwhile.
    fn hold(&mut self, elapsed: f64) -> Option<Why> {
        let before = std::mem::replace(&mut self.level, self.earlier[1].0);
        self.average += before - self.level;
        self.rate = 0.0;
        self.held = Some(Held {
            age: elapsed,
            most: self.average,
            gone: 0.0,
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
        self.earlier.iter_mut().for_each(|(_, age)| *age += step);
        if self.earlier[0].1 > 2.0 * options.smoothing {
            self.earlier = [(self.level, 0.0), self.earlier[0]];
        }
    }
}

#[cfg(test)]
mod tests;
