//! Health of each channel of a device, with evidence and a reason.

/// Prior knowledge of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelFacts {
    /// Standard deviation of one reading, in the unit of the channel; `NaN`
    /// where it is not known.
    pub deviation: f64,
    /// Step of the converter in that unit, or zero where it is not known.
    pub resolution: f64,
    /// At or below the first a channel is dead, at or above the second
    /// saturated.
    pub span: [f64; 2],
    /// True if the channel is not used, or does not exist.
    pub masked: bool,
    /// At or below the first, and at or above the second, a reading repeats without a fault:
    /// the program that gives it cuts off there. `NaN` where it does not.
    pub cut_off: [f64; 2],
    /// True if `deviation` is the noise of the quietest channels of the device, not of this
    /// one: it says which readings must change, not which change too much.
    pub quietest: bool,
}

/// Options of the monitor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HealthOptions {
    /// A condition must last for this time before it counts, s; default 0.5.
    pub confirm: f64,
    /// ... and be absent for this time before the channel is well again, s;
    /// default 2.
    pub recover: f64,
    /// A reading that does not change for this time is stuck, s; default 1.
    pub still: f64,
    /// A channel of more than this many times its noise is noisy; default 4.
    pub noisy: f64,
    /// Bound of the consistency residual, in deviations; default 6.
    pub residual: f64,
}

impl Default for HealthOptions {
    fn default() -> Self {
        Self {
            confirm: 0.5,
            recover: 2.0,
            still: 1.0,
            noisy: 4.0,
            residual: 6.0,
        }
    }
}

/// Condition of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Nothing is against it.
    Well,
    /// Not used, so not watched.
    Masked,
    /// No reading, or one at the low end.
    Dead,
    /// At the high end while nothing touches it.
    Saturated,
    /// The same reading again and again, without the noise that it must have.
    Stuck,
    /// More noise than it should have while nothing touches it.
    Noisy,
    /// It contradicts the others that measure the same.
    Inconsistent,
}

impl Condition {
    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Well => "well",
            Self::Masked => "masked",
            Self::Dead => "dead",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
            Self::Noisy => "noisy",
            Self::Inconsistent => "inconsistent",
        }
    }

    /// True if something is against the channel.
    pub fn wrong(self) -> bool {
        !matches!(self, Self::Well | Self::Masked)
    }
}

/// Health of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelHealth {
    /// Its condition.
    pub condition: Condition,
    /// Since when, ns.
    pub since_ns: u64,
    /// Evidence: s without change, times its noise, residual in deviations, or the
    /// reading.
    pub evidence: f64,
    suspected: Condition,
    /// For how long something else than the condition has been suspected, s.
    against: f64,
    last: f64,
    /// True if a contact was there in the last frame.
    occupied: bool,
    still: f64,
    /// Readings in a row that were the same as the one before.
    repeats: f64,
    /// Mean square of the differences of readings in a row, over 2σ².
    noise: f64,
}

/// One reading of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelReading {
    /// The reading; `NaN` for none.
    pub value: f64,
    /// Consistency residual in deviations; `NaN` without redundancy.
    pub residual: f64,
    /// True if a contact is or may be there: then a changing reading is no
    /// noise, and one at the high end no fault.
    pub occupied: bool,
}

/// Watches the channels of a device.
#[derive(Debug, Clone)]
pub struct HealthMonitor {
    options: HealthOptions,
    facts: Vec<ChannelFacts>,
    channels: Vec<ChannelHealth>,
    last_time_ns: Option<u64>,
    changes: u64,
}

/// Time over which noise is averaged, s.
const NOISE_TIME: f64 = 0.5;
/// One difference of readings counts for no more than this, over 2σ².
const LARGEST_SQUARE: f64 = 100.0;
/// A channel whose noise is below this share of a step may well stand still.
const SHOWS_NOISE: f64 = 0.5;
/// A frame that repeats all readings by a smaller chance was sent again.
const CHANCE: f64 = 1e-9;
/// Longest step that counts as evidence, s: a pause shows nothing.
const LONGEST_STEP: f64 = 0.1;

impl HealthMonitor {
    /// All channels well.
    pub fn new(facts: Vec<ChannelFacts>, options: HealthOptions) -> Self {
        let begun = |facts: &ChannelFacts| ChannelHealth {
            condition: if facts.masked {
                Condition::Masked
            } else {
                Condition::Well
            },
            since_ns: 0,
            evidence: 0.0,
            suspected: Condition::Well,
            against: 0.0,
            last: f64::NAN,
            occupied: false,
            still: 0.0,
            repeats: 0.0,
            noise: 1.0,
        };
        Self {
            channels: facts.iter().map(begun).collect(),
            facts,
            options,
            last_time_ns: None,
            changes: 0,
        }
    }

    /// Takes the readings of a new frame.
    pub fn push(&mut self, time_ns: u64, reading: impl Fn(usize) -> ChannelReading) {
        let last = self.last_time_ns.replace(time_ns).unwrap_or(time_ns);
        let step = (time_ns.saturating_sub(last) as f64 * 1e-9).min(LONGEST_STEP);
        let weight = 1.0 - (-step / NOISE_TIME).exp();
        for (index, (channel, facts)) in self.channels.iter_mut().zip(&self.facts).enumerate() {
            if !facts.masked {
                let reading = reading(index);
                channel.measure(step, weight, &reading, facts);
                let before = channel.condition;
                channel.follow(time_ns, step, &reading, facts, &self.options);
                self.changes += u64::from(channel.condition != before);
            }
        }
    }

    /// Takes what is known of the channels now.
    pub(super) fn set_facts(&mut self, facts: &[ChannelFacts]) {
        self.facts.copy_from_slice(facts);
    }

    /// Number of changes of conditions.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// True if something is against any channel.
    pub fn wrong(&self) -> bool {
        self.channels
            .iter()
            .any(|channel| channel.condition.wrong())
    }

    /// Health of each channel.
    pub fn channels(&self) -> &[ChannelHealth] {
        &self.channels
    }

    /// True if a frame with a new number is the last one sent again: it repeats
    /// every reading, which noise does not allow. Such a frame must not be used,
    /// neither for estimation nor in [`HealthMonitor::push`].
    pub fn repeats(&self, values: &[f64]) -> bool {
        let mut chance = 1.0;
        for ((channel, facts), value) in self.channels.iter().zip(&self.facts).zip(values) {
            if facts.masked {
                continue;
            }
            if channel.last != *value && !(channel.last.is_nan() && value.is_nan()) {
                return false;
            }
            if facts.shows(*value) && channel.condition != Condition::Stuck {
                chance *= facts.repeat_chance();
            }
        }
        chance < CHANCE
    }
}

impl ChannelFacts {
    /// A channel of which nothing is known but whether it exists.
    pub fn unknown(exists: bool) -> Self {
        Self {
            deviation: f64::NAN,
            resolution: 0.0,
            span: [f64::NEG_INFINITY, f64::INFINITY],
            masked: !exists,
            cut_off: [f64::NAN; 2],
            quietest: false,
        }
    }

    /// Takes the steps of the wire for those channels whose own are finer.
    pub(crate) fn coarsen(facts: &mut [Self], steps: &[f64]) {
        for (facts, step) in facts.iter_mut().zip(steps) {
            facts.resolution = facts.resolution.max(*step);
        }
    }

    /// True if a reading shows what the channel does, and not where its range ends.
    fn shows(&self, value: f64) -> bool {
        let [low, high] = self.span;
        let [least, most] = self.cut_off;
        let cut_off = value <= least || value >= most;
        value > low && value < high && !cut_off
    }

    /// True if two readings in a row differ as a rule.
    fn shows_noise(&self) -> bool {
        self.deviation > SHOWS_NOISE * self.resolution
    }

    /// True if a reading that repeats so often in a row stands still: noise lets
    /// that happen by chance in one of 10⁹ cases at most, wherever in a step of
    /// the converter the true value lies. Of a channel whose noise is not known
    /// nothing is said.
    pub(super) fn stands_still(&self, value: f64, repeats: f64) -> bool {
        let [least, most] = self.cut_off;
        if value <= least || value >= most {
            return false;
        }
        let rounding = self.resolution * self.resolution / 12.0;
        let noise = (self.deviation * self.deviation - rounding).sqrt();
        // In the middle of a step a repeated reading is likeliest.
        let same = libm::erf(0.5 * self.resolution / (noise * std::f64::consts::SQRT_2));
        noise > 0.0 && repeats * same.ln() < CHANCE.ln()
    }

    /// Chance that two readings in a row are the same: the density of their
    /// difference at zero, 1/(2√π σ), times a step; one where the step is not
    /// known, as of a recording that may have been rounded.
    fn repeat_chance(&self) -> f64 {
        if self.shows_noise() && self.resolution > 0.0 {
            self.resolution / (2.0 * std::f64::consts::PI.sqrt() * self.deviation)
        } else {
            1.0
        }
    }
}

impl ChannelHealth {
    /// The condition in words, with its evidence.
    pub fn reason(&self) -> String {
        let evidence = self.evidence;
        match self.condition {
            Condition::Well => "nothing is against it".into(),
            Condition::Masked => "masked: not used".into(),
            Condition::Dead => "no reading, or one at the low end of the range".into(),
            Condition::Saturated => "the reading is at the high end of the range".into(),
            Condition::Stuck => format!("the same reading for {evidence:.1} s, without noise"),
            Condition::Noisy => format!("{evidence:.1} times its noise while untouched"),
            Condition::Inconsistent => {
                format!("contradicts the readings beside it by {evidence:.1} standard deviations")
            }
        }
    }

    fn follow(
        &mut self,
        time_ns: u64,
        step: f64,
        reading: &ChannelReading,
        facts: &ChannelFacts,
        options: &HealthOptions,
    ) {
        let (found, evidence) = self.judge(reading, facts, options);
        if found == self.condition {
            self.against = 0.0;
            self.evidence = evidence;
            return;
        }
        self.against = if found == self.suspected {
            self.against + step
        } else {
            0.0
        };
        self.suspected = found;
        let needed = match found {
            Condition::Well => options.recover,
            // It has stood still for long enough already.
            Condition::Stuck => 0.0,
            _ => options.confirm,
        };
        if self.against >= needed {
            (self.condition, self.since_ns) = (found, time_ns);
            (self.evidence, self.against) = (evidence, 0.0);
        }
    }

    /// `weight` is that of this step in the average of the noise.
    fn measure(&mut self, step: f64, weight: f64, reading: &ChannelReading, facts: &ChannelFacts) {
        let change = reading.value - self.last;
        (self.still, self.repeats) = if change == 0.0 {
            (self.still + step, self.repeats + 1.0)
        } else {
            (0.0, 0.0)
        };
        // Touched, or with a reading at an end: no evidence of noise.
        let unknown = facts.deviation.is_nan() || facts.quietest;
        let touched = reading.occupied || self.occupied || unknown;
        if facts.shows(reading.value) && facts.shows(self.last) && !touched {
            // A contact that has not been found yet is no noise either.
            let square = change * change / (2.0 * facts.deviation * facts.deviation);
            self.noise += weight * (square.min(LARGEST_SQUARE) - self.noise);
        }
        (self.last, self.occupied) = (reading.value, reading.occupied);
    }

    fn judge(
        &self,
        reading: &ChannelReading,
        facts: &ChannelFacts,
        options: &HealthOptions,
    ) -> (Condition, f64) {
        let [low, high] = facts.span;
        let noise = self.noise.sqrt();
        match reading.value {
            value if value.is_nan() || value <= low => (Condition::Dead, low),
            value if value >= high && reading.occupied => (Condition::Well, 0.0),
            value if value >= high => (Condition::Saturated, value),
            value if self.still >= options.still && facts.stands_still(value, self.repeats) => {
                (Condition::Stuck, self.still)
            }
            _ if noise > options.noisy => (Condition::Noisy, noise),
            _ if reading.residual.abs() > options.residual => {
                (Condition::Inconsistent, reading.residual.abs())
            }
            _ => (Condition::Well, 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Conditions of the first of four channels over three seconds of `first`
    /// and five of sound readings, in the order they came.
    fn conditions(first: impl Fn(f64, f64) -> ChannelReading) -> Vec<(Condition, String)> {
        let facts = ChannelFacts {
            deviation: 2.0,
            resolution: 1.0,
            span: [0.0, 1000.0],
            ..ChannelFacts::unknown(true)
        };
        let mut monitor = HealthMonitor::new(vec![facts; 4], HealthOptions::default());
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut found: Vec<(Condition, String)> = Vec::new();
        for frame in 0..800_u64 {
            let time = frame as f64 * 0.01;
            let mut readings: Vec<ChannelReading> = (0..4)
                .map(|_| (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>())
                .map(|noise| sound((500.0 + 2.0 * noise).round()))
                .collect();
            if time < 3.0 {
                readings[0] = first(time, readings[0].value);
            }
            let values: Vec<f64> = readings.iter().map(|reading| reading.value).collect();
            assert!(!monitor.repeats(&values));
            monitor.push(frame * 10_000_000, |channel| readings[channel]);
            let health = monitor.channels()[0];
            if found.last().map(|last| last.0) != Some(health.condition) {
                found.push((health.condition, health.reason()));
            }
        }
        assert!(
            monitor.channels()[1..]
                .iter()
                .all(|other| other.condition == Condition::Well)
        );
        found
    }

    fn sound(value: f64) -> ChannelReading {
        ChannelReading {
            value,
            residual: 0.5,
            occupied: false,
        }
    }

    #[test]
    fn each_condition_is_found_says_why_and_recovers() {
        let expect = |found: Vec<(Condition, String)>, condition: Condition, word: &str| {
            let order: Vec<Condition> = found.iter().map(|one| one.0).collect();
            assert_eq!(
                order,
                [Condition::Well, condition, Condition::Well],
                "{found:?}"
            );
            assert!(found[1].1.contains(word), "{found:?}");
        };
        expect(conditions(|_, _| sound(0.0)), Condition::Dead, "low end");
        expect(
            conditions(|_, _| sound(f64::NAN)),
            Condition::Dead,
            "no reading",
        );
        expect(
            conditions(|_, _| sound(1000.0)),
            Condition::Saturated,
            "high end",
        );
        expect(
            conditions(|_, _| sound(510.0)),
            Condition::Stuck,
            "same reading",
        );
        let noisy = |_, value: f64| sound(500.0 + 8.0 * (value - 500.0));
        expect(conditions(noisy), Condition::Noisy, "times its noise");
        let contradicts = |_, value| ChannelReading {
            residual: -9.0,
            ..sound(value)
        };
        expect(
            conditions(contradicts),
            Condition::Inconsistent,
            "9.0 standard",
        );
    }

    #[test]
    fn a_contact_is_no_noise_and_a_short_fault_no_condition() {
        let touched = |time: f64, value: f64| ChannelReading {
            occupied: true,
            ..sound(value + 200.0 * (20.0 * time).sin())
        };
        assert_eq!(conditions(touched).len(), 1);
        let short = |time, value| {
            sound(if (1.0..1.3).contains(&time) {
                0.0
            } else {
                value
            })
        };
        assert_eq!(conditions(short).len(), 1);
    }

    #[test]
    fn a_frame_sent_again_is_not_new() {
        let facts = ChannelFacts {
            deviation: 2.0,
            resolution: 1.0,
            span: [0.0, 1000.0],
            ..ChannelFacts::unknown(true)
        };
        let mut monitor = HealthMonitor::new(vec![facts; 16], HealthOptions::default());
        let mut new = |time_ns, value: f64| {
            let new = !monitor.repeats(&[value; 16]);
            if new {
                monitor.push(time_ns, |_| sound(value));
            }
            new
        };
        let values = [500.0, 503.0, 503.0, 503.0, 501.0];
        let found: Vec<bool> = (0..)
            .zip(values)
            .map(|(time, value)| new(time, value))
            .collect();
        assert_eq!(found, [true, true, false, false, true]);
    }

    #[test]
    fn readings_of_unknown_noise_may_repeat_and_a_masked_channel_is_not_judged() {
        let facts = [true, true, false].map(ChannelFacts::unknown);
        let mut monitor = HealthMonitor::new(facts.to_vec(), HealthOptions::default());
        for frame in 0..200_u64 {
            let values = [7.0 * (frame / 20 % 2) as f64, f64::NAN, f64::NAN];
            assert!(!monitor.repeats(&values));
            monitor.push(frame * 10_000_000, |channel| sound(values[channel]));
        }
        let conditions: Vec<_> = monitor.channels().iter().map(|one| one.condition).collect();
        let expected = [Condition::Well, Condition::Dead, Condition::Masked];
        assert_eq!(conditions, expected);
    }

    #[test]
    fn a_reading_at_the_high_end_under_a_contact_is_no_fault() {
        let pressed = |_, _| ChannelReading {
            occupied: true,
            ..sound(1000.0)
        };
        assert_eq!(conditions(pressed).len(), 1);
    }
}
