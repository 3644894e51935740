//! Whether each channel of a device can be trusted, with evidence and a reason.

/// What is known beforehand of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelFacts {
    /// Standard deviation of one reading, in the unit of the channel.
    pub deviation: f64,
    /// Step of the converter in that unit, or zero.
    pub resolution: f64,
    /// At or below the first a channel is dead, at or above the second
    /// saturated.
    pub span: [f64; 2],
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
    /// No reading, or one at the low end.
    Dead,
    /// At the high end.
    Saturated,
    /// The same reading again and again, without the noise that it must have.
    Stuck,
    /// More noise than it should have while nothing touches it.
    Noisy,
    /// It contradicts the others that measure the same.
    Inconsistent,
}

/// Health of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelHealth {
    /// Its condition.
    pub condition: Condition,
    /// Since when, ns.
    pub since_ns: u64,
    /// What shows it: s without change, times its noise, residual in
    /// deviations, or the reading.
    pub evidence: f64,
    suspected: Condition,
    /// For how long something else than the condition has been suspected, s.
    against: f64,
    last: f64,
    still: f64,
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
    /// Whether a contact is there: then a changing reading is no noise.
    pub occupied: bool,
}

/// Watches the channels of a device.
#[derive(Debug, Clone)]
pub struct HealthMonitor {
    options: HealthOptions,
    facts: Vec<ChannelFacts>,
    channels: Vec<ChannelHealth>,
    last_time_ns: Option<u64>,
    /// Frames that repeat all readings of the last one under a new number.
    pub repeated: u64,
}

/// Time over which noise is averaged, s.
const NOISE_TIME: f64 = 0.5;
/// A channel whose noise is below this share of a step may well stand still.
const SHOWS_NOISE: f64 = 0.5;
/// A frame that repeats all readings by a smaller chance was sent again.
const CHANCE: f64 = 1e-9;
/// Longest step that counts as evidence, s: a pause shows nothing.
const LONGEST_STEP: f64 = 0.1;

impl HealthMonitor {
    /// All channels well.
    pub fn new(facts: Vec<ChannelFacts>, options: HealthOptions) -> Self {
        let well = ChannelHealth {
            condition: Condition::Well,
            since_ns: 0,
            evidence: 0.0,
            suspected: Condition::Well,
            against: 0.0,
            last: f64::NAN,
            still: 0.0,
            noise: 1.0,
        };
        Self {
            channels: vec![well; facts.len()],
            facts,
            options,
            last_time_ns: None,
            repeated: 0,
        }
    }

    /// Takes the readings of a frame with a new number, and says whether they
    /// are new data: a frame that repeats every reading, which noise does not
    /// allow, is the old one sent again, and only counted.
    pub fn push(&mut self, time_ns: u64, readings: &[ChannelReading]) -> bool {
        let last = self.last_time_ns.unwrap_or(time_ns);
        let step = (time_ns.saturating_sub(last) as f64 * 1e-9).min(LONGEST_STEP);
        self.last_time_ns = Some(time_ns);
        if self.repeats(readings) {
            self.repeated += 1;
            return false;
        }
        for (index, reading) in readings.iter().enumerate().take(self.channels.len()) {
            self.channels[index].follow(time_ns, step, reading, &self.facts[index], &self.options);
        }
        true
    }

    /// Health of each channel.
    pub fn channels(&self) -> &[ChannelHealth] {
        &self.channels
    }

    fn repeats(&self, readings: &[ChannelReading]) -> bool {
        let mut chance = 1.0;
        for ((channel, facts), reading) in self.channels.iter().zip(&self.facts).zip(readings) {
            if channel.last != reading.value && !(channel.last.is_nan() && reading.value.is_nan()) {
                return false;
            }
            let alive = reading.value > facts.span[0] && reading.value < facts.span[1];
            if alive && channel.condition != Condition::Stuck {
                chance *= facts.repeat_chance();
            }
        }
        chance < CHANCE
    }
}

impl ChannelFacts {
    /// Whether two readings in a row differ as a rule.
    fn shows_noise(&self) -> bool {
        self.deviation > SHOWS_NOISE * self.resolution
    }

    /// Chance that two readings in a row are the same: the density of their
    /// difference at zero, 1/(2√π σ), times a step.
    fn repeat_chance(&self) -> f64 {
        if self.shows_noise() {
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
        self.measure(step, reading, facts);
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

    fn measure(&mut self, step: f64, reading: &ChannelReading, facts: &ChannelFacts) {
        let change = reading.value - self.last;
        self.still = if change == 0.0 {
            self.still + step
        } else {
            0.0
        };
        // Touched, or with a reading at an end: no evidence of noise.
        let alive = |value: f64| value > facts.span[0] && value < facts.span[1];
        if alive(reading.value) && alive(self.last) && !reading.occupied {
            let square = change * change / (2.0 * facts.deviation * facts.deviation);
            let weight = 1.0 - (-step / NOISE_TIME).exp();
            self.noise += weight * (square - self.noise);
        }
        self.last = reading.value;
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
            value if value >= high => (Condition::Saturated, value),
            _ if self.still >= options.still && facts.shows_noise() => {
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
            assert!(monitor.push(frame * 10_000_000, &readings));
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
        };
        let mut monitor = HealthMonitor::new(vec![facts; 16], HealthOptions::default());
        let frame = |value: f64| [sound(value); 16];
        assert!(monitor.push(0, &frame(500.0)));
        assert!(monitor.push(1, &frame(503.0)));
        assert!(!monitor.push(2, &frame(503.0)));
        assert!(!monitor.push(3, &frame(503.0)));
        assert!(monitor.push(4, &frame(501.0)));
        assert_eq!(monitor.repeated, 2);
    }
}
