//! Rest capture (tare): the readings of the mounted, unloaded device.

use super::{ChannelFacts, ChannelState, RestRules};

/// Mean and scatter of every channel over the frames of a rest capture, of any
/// device.
#[derive(Debug, Clone)]
pub(super) struct RestReadings {
    wanted: usize,
    frames: usize,
    channels: Vec<Running>,
}

/// Running mean and sum of squared deviations of one channel (Welford).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Running {
    count: f64,
    mean: f64,
    squares: f64,
    last: Option<f64>,
    /// Sum of the squared differences of readings in a row, and the least of these that is not zero.
    jumps: f64,
    least_jump: f64,
    /// True once a reading was no whole number.
    broken: bool,
    /// Least and greatest reading.
    range: [f64; 2],
    /// Sum and number of the readings in each third of the capture.
    thirds: [[f64; 2]; 3],
}

impl RestReadings {
    /// Collects over `frames` frames (at least two) of `channels` channels.
    fn new(channels: usize, frames: usize) -> Self {
        Self {
            wanted: frames.max(2),
            frames: 0,
            channels: vec![Running::default(); channels],
        }
    }

    /// Adds one frame; `NaN` for no reading. Returns whether the capture is
    /// complete.
    fn push(&mut self, values: impl IntoIterator<Item = f64>) -> bool {
        let third = (3 * self.frames / self.wanted).min(2);
        for (running, value) in self.channels.iter_mut().zip(values) {
            running.push(value, third);
        }
        self.frames += 1;
        self.frames >= self.wanted
    }

    /// Readings of each channel.
    fn channels(&self) -> &[Running] {
        &self.channels
    }
}

/// Why a rest capture was refused; the rest values stay as they were.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RestRefused {
    /// Readings moved while they were captured.
    #[error(
        "rest capture refused: {moving} of {units} {unit}s moved during it ({name} by {ratio:.0} times its noise); \
         lift off and try again"
    )]
    Moving {
        /// Units that moved.
        moving: usize,
        /// Units of the device.
        units: usize,
        /// Name of a unit.
        unit: &'static str,
        /// The channel that moved most.
        name: String,
        /// Its scatter over its noise.
        ratio: f64,
    },
    /// The mean readings cannot belong to an unloaded device.
    #[error("rest capture refused: {reason}")]
    Impossible {
        /// The first such reading, and why it cannot be.
        reason: String,
    },
    /// Something presses: its force would be lost.
    #[error(
        "rest capture refused: contact {contact} presses at row {row}, column {column}{force}; lift off, or tare anyway"
    )]
    Touched {
        /// Number of the contact.
        contact: u64,
        /// Row of the taxel that carries most of it.
        row: usize,
        /// Column of that taxel.
        column: usize,
        /// Its force in words; empty where the device does not say newtons.
        force: String,
    },
    /// A taxel stands out from the others before any zero was taken.
    #[error(
        "no rest capture at the start: row {row}, column {column} reads {value} where the others read {others}: \
         something may press; lift off, then tare"
    )]
    StandsOut {
        /// Row of the taxel.
        row: usize,
        /// Column of the taxel.
        column: usize,
        /// Its value in words.
        value: String,
        /// Median of all and its scatter in words.
        others: String,
    },
    /// The device takes no rest capture.
    #[error("no rest capture: {reason}")]
    NotTaken {
        /// Why.
        reason: &'static str,
    },
}

impl RestRefused {
    /// Where something presses, and how much, in words; empty for other reasons.
    pub fn place(&self) -> String {
        match self {
            Self::Touched {
                row, column, force, ..
            } => format!("row {row}, column {column}{force}"),
            _ => String::new(),
        }
    }
}

/// Rest values in force, to be put back later bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Captured reading of each channel, SI, and the noise that the capture measured;
    /// none where the channel is as drawn.
    pub(super) captured: Vec<Option<[f64; 2]>>,
    /// True for a channel that read at the high end throughout the capture.
    pub(super) at_end: Vec<bool>,
    /// Reading of each channel at rest, SI.
    pub(super) values: Vec<f64>,
}

impl Rest {
    /// Rest values that [`Rest::values`], [`Rest::captured`] and [`Rest::at_end`] gave before,
    /// such as those of a recording; `None` if they are not of equally many channels.
    pub fn of_parts(
        values: Vec<f64>,
        captured: Vec<Option<[f64; 2]>>,
        at_end: Vec<bool>,
    ) -> Option<Self> {
        let fit = values.len() == captured.len() && at_end.len() == captured.len();
        fit.then_some(Self {
            captured,
            at_end,
            values,
        })
    }

    /// Reading of each channel at rest, SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Captured reading of each channel, SI, and the noise that the capture measured; none
    /// where the channel is as drawn.
    pub fn captured(&self) -> &[Option<[f64; 2]>] {
        &self.captured
    }

    /// True for a channel that read at the high end throughout the capture.
    pub fn at_end(&self) -> &[bool] {
        &self.at_end
    }
}

/// Scatter over noise above which a unit counts as moving. With 50 readings
/// the ratio of a quiet channel stays below 1.4 in all but one of 10⁵ captures.
const MOVING: f64 = 3.0;
/// Where the noise is not known, a channel moves whose readings scatter by so many times the
/// differences from one to the next, and drift by so much of that scatter from one third of the
/// capture to another. A ramp drifts by 2.3 of it and a step in the last tenth by 1.0; white noise
/// by 0.41 and a hum of three periods or more in the capture by less than 0.4.
const DRIFTS: f64 = 0.75;
/// Units that may move or be impossible before the capture is refused: a few
/// broken ones must not block the others.
const TOLERATED_SHARE: f64 = 0.1;
/// Channels at the high end throughout a capture that are taken for broken, if this is
/// more than the share above: one shorted or open channel must not block a small device,
/// and a press reaches at least two channels where rows and columns cross.
const TOLERATED_AT_END: usize = 1;
/// Fewest frames of a rest capture that a touch has ended.
const LEAST_FRAMES: usize = 5;
/// A reading farther from the mean so far than this many standard deviations
/// is the beginning of a touch.
const TOUCHED: f64 = 6.0;

/// A rest capture under way.
#[derive(Debug, Clone)]
pub(super) struct RestCapture {
    readings: RestReadings,
    /// Channels that read at the high end in any frame.
    saturated: Vec<bool>,
    /// The frames so far, where a touch may end the capture.
    frames: Vec<Vec<f64>>,
    /// True if it is taken unasked: not where a taxel stands out.
    pub(super) unasked: bool,
}

/// Fewest values that say which one stands out.
const LEAST_VALUES: usize = 8;
/// A value this many deviations of their scatter above the median stands out.
const STANDS_OUT: f64 = 10.0;

/// The index of the greatest value that stands out of `values` by more than their scatter
/// and `threshold`, with their median and scatter (1.48 median absolute deviations, which a
/// few touched taxels do not change).
pub(super) fn standing_out(
    values: impl Iterator<Item = (usize, f64)>,
    threshold: impl Fn(usize) -> f64,
) -> Option<(usize, [f64; 2])> {
    let values: Vec<_> = values.filter(|(_, value)| value.is_finite()).collect();
    if values.len() < LEAST_VALUES {
        return None;
    }
    let middle = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let median = middle(values.iter().map(|(_, value)| *value).collect());
    let distances = values.iter().map(|(_, value)| (value - median).abs());
    let scatter = 1.4826 * middle(distances.collect());
    let (index, most) = values.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most - median > threshold(index).max(STANDS_OUT * scatter))
        .then_some((index, [median, scatter]))
}

/// A unit that stands against a capture.
pub(super) trait Judge {
    /// Name of a channel.
    fn name(&self, channel: usize) -> &str;
    /// Facts of a channel.
    fn facts(&self, channel: usize) -> &ChannelFacts;
    /// Why a unit cannot read this at rest.
    fn problem(&self, unit: usize, rest: &[f64]) -> Option<String>;
}

impl RestCapture {
    pub(super) fn new(channels: usize, frames: usize, unasked: bool) -> Self {
        Self {
            readings: RestReadings::new(channels, frames),
            saturated: vec![false; channels],
            frames: Vec::new(),
            unasked,
        }
    }

    /// Takes the usable readings of a frame; returns whether the capture ends.
    pub(super) fn push(
        &mut self,
        readings: &[f64],
        states: &[ChannelState],
        noise: &[f64],
        rules: &RestRules,
    ) -> bool {
        let usable =
            readings.iter().zip(states).map(
                |(reading, state)| {
                    if state.usable() { *reading } else { f64::NAN }
                },
            );
        for (saturated, state) in self.saturated.iter_mut().zip(states) {
            *saturated |= *state == ChannelState::Saturated;
        }
        if rules.ends_at_touch {
            let so_far = self
                .readings
                .channels()
                .iter()
                .zip(noise)
                .zip(usable.clone());
            let touched = self.frames.len() >= LEAST_FRAMES
                && so_far.into_iter().any(|((running, noise), reading)| {
                    (reading - running.mean_or_nan()).abs() > TOUCHED * noise
                });
            if touched {
                self.readings = self.before_touch();
                return true;
            }
            self.frames.push(usable.clone().collect());
        }
        self.readings.push(usable)
    }

    /// The readings of a capture that a touch has ended. It began before it was
    /// seen: the later half of the frames is left out.
    fn before_touch(&self) -> RestReadings {
        let kept = self.frames.len().div_ceil(2).max(LEAST_FRAMES);
        let mut rest = RestReadings::new(self.saturated.len(), kept);
        for frame in self.frames.iter().take(kept) {
            rest.push(frame.iter().copied());
        }
        rest
    }

    /// True if a channel had no reading.
    pub(super) fn has_none(&self, channel: usize) -> bool {
        self.readings.channels()[channel].count == 0.0
    }

    /// The least difference of two readings in a row that any channel shows; zero where none differs.
    fn least_jump(&self) -> f64 {
        let jumps = self
            .readings
            .channels()
            .iter()
            .map(|running| running.least_jump);
        let least = jumps
            .filter(|jump| *jump > 0.0)
            .fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// Writes what noise the capture saw for sure into the facts of channels of which none is known: one that
    /// has it no longer stands still. Readings that go to and fro between two steps may as well rest
    /// in the middle of one; those that take three have noise wherever they are.
    pub(super) fn learn(&self, facts: &mut [ChannelFacts]) {
        let least_jump = self.least_jump();
        for (facts, running) in facts.iter_mut().zip(self.readings.channels()) {
            let step = running.step(facts.resolution, least_jump);
            let [low, high] = running.range;
            if facts.deviation.is_nan() && high - low >= 2.0 * step && step > 0.0 {
                *facts = ChannelFacts {
                    deviation: running.deviation() * surely(running.count),
                    resolution: step,
                    quietest: true,
                    ..*facts
                };
            }
        }
    }

    /// Writes what the capture found into `captured`.
    ///
    /// A unit that moved or is impossible keeps its old values, unless there
    /// are so many that the device cannot have been at rest. A channel without
    /// a reading, or with one that never changed though its noise must show,
    /// keeps its own and stands against nothing.
    ///
    /// Returns which channels read at the high end throughout: broken, not at rest.
    ///
    /// # Errors
    /// [`RestRefused`], and then nothing has changed.
    pub(super) fn finish(
        &self,
        captured: &mut [Option<[f64; 2]>],
        noise: &[f64],
        rules: &RestRules,
        judge: &impl Judge,
    ) -> Result<Vec<bool>, RestRefused> {
        let per_unit = rules.channels_per_unit.max(1);
        let units = noise.len() / per_unit;
        let tolerated = (TOLERATED_SHARE * units as f64) as usize;
        let mut found = captured.to_vec();
        let (mut moving, mut most) = (0, (0, 0.0));
        let (mut impossible, mut first) = (0, None);
        let at_end = |channel: usize| {
            let readings = &self.readings.channels()[channel];
            self.saturated[channel] && readings.count == 0.0 && !judge.facts(channel).masked
        };
        let ends: Vec<bool> = (0..noise.len()).map(at_end).collect();
        let broken = ends.iter().filter(|at_end| **at_end).count();
        let many = broken > tolerated.max(TOLERATED_AT_END);
        let least_jump = self.least_jump();
        for unit in 0..units {
            let channels = unit * per_unit..(unit + 1) * per_unit;
            let running = |channel: usize| &self.readings.channels()[channel];
            let used = |channel: &usize| {
                let facts = judge.facts(*channel);
                let running = running(*channel);
                !facts.masked && running.count > 0.0 && !running.stands_still(facts)
            };
            let ratio = |channel: usize| {
                let step = judge.facts(channel).resolution;
                (
                    channel,
                    running(channel).motion(noise[channel], step, least_jump),
                )
            };
            let largest = (channels.clone().filter(used).map(ratio))
                .fold((channels.start, 0.0), |a, b| if b.1 > a.1 { b } else { a });
            if largest.1 > MOVING {
                moving += 1;
                if largest.1 > most.1 {
                    most = largest;
                }
                continue;
            }
            let rest: Vec<f64> = channels
                .clone()
                .map(|channel| {
                    if used(&channel) {
                        running(channel).mean
                    } else {
                        f64::NAN
                    }
                })
                .collect();
            let saturated = channels.clone().find(|channel| {
                self.saturated[*channel]
                    && !judge.facts(*channel).masked
                    && (many || !ends[*channel])
            });
            let problem = match saturated {
                Some(channel) => Some(format!(
                    "{} is at the end of what can be read; lift off and try again, or mask it",
                    judge.name(channel)
                )),
                None => judge.problem(unit, &rest),
            };
            if problem.is_some() {
                impossible += 1;
                first = first.or(problem);
                continue;
            }
            for channel in channels.filter(used) {
                let measured = if rules.measures_noise {
                    measured_noise(running(channel), noise[channel])
                } else {
                    noise[channel]
                };
                found[channel] = Some([running(channel).mean, measured]);
            }
        }
        if moving > tolerated {
            return Err(RestRefused::Moving {
                moving,
                units,
                unit: rules.unit,
                name: judge.name(most.0).to_owned(),
                ratio: most.1,
            });
        }
        match first {
            Some(reason) if many || impossible > tolerated => {
                Err(RestRefused::Impossible { reason })
            }
            _ => {
                captured.copy_from_slice(&found);
                Ok(ends)
            }
        }
    }
}

/// Mean readings of the first of `frames` of a device that nothing touches yet, as the rest
/// capture of `wanted` frames at the start of a run takes them: a reading that leaves the mean
/// by more than its `noise` ends it, as the beginning of a touch.
pub fn rest_at_start(frames: &[Vec<f64>], noise: &[f64], wanted: usize) -> Vec<f64> {
    let rules = RestRules {
        refused: None,
        at_start: true,
        channels_per_unit: 1,
        unit: "channel",
        measures_noise: false,
        ends_at_touch: true,
    };
    let mut capture = RestCapture::new(noise.len(), wanted, true);
    let states = vec![ChannelState::Ok; noise.len()];
    for frame in frames {
        if capture.push(frame, &states, noise, &rules) {
            break;
        }
    }
    let channels = capture.readings.channels().iter();
    channels.map(Running::mean_or_nan).collect()
}

/// Noise of a reading: what was measured, but not less than half of what the
/// board promises (a reading that does not toggle a count hides it), with the
/// uncertainty of the rest value itself.
pub(super) fn measured_noise(running: &Running, promised: f64) -> f64 {
    if running.count < 2.0 {
        return promised;
    }
    let mut measured = running.deviation().max(0.5 * promised);
    if promised.is_nan() {
        measured *= doubt(running.count);
    }
    measured * (1.0 + 1.0 / running.count).sqrt()
}

/// By how much a deviation of `count` readings must be enlarged so that another reading is farther
/// than six of them from the mean as rarely as normal noise of a known deviation: Student's t with
/// count - 1 degrees of freedom, by Wallace's approximation (1959, Ann. Math. Stat. 30, 1124).
fn doubt(count: f64) -> f64 {
    let freedom = count - 1.0;
    let normal = TOUCHED * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0);
    (freedom * (normal * normal / freedom).exp_m1()).sqrt() / TOUCHED
}

/// Share of the deviation of `count` readings that normal noise has at least, but for one chance in 10⁹: the
/// root of the degrees of freedom over that quantile of χ², by Wilson and Hilferty's approximation (1931, PNAS
/// 17, 684).
fn surely(count: f64) -> f64 {
    // The normal quantile of the same chance.
    const QUANTILE: f64 = 5.998;
    let spread = 2.0 / (9.0 * (count - 1.0).max(1.0));
    (1.0 - spread + QUANTILE * spread.sqrt()).powf(-1.5)
}

impl Running {
    fn push(&mut self, value: f64, third: usize) {
        if value.is_finite() {
            if let Some(last) = self.last.replace(value) {
                let jump = (value - last).abs();
                self.jumps += jump * jump;
                if jump > 0.0 && (self.least_jump == 0.0 || jump < self.least_jump) {
                    self.least_jump = jump;
                }
            }
            self.broken |= value.fract() != 0.0;
            self.range = if self.count > 0.0 {
                [self.range[0].min(value), self.range[1].max(value)]
            } else {
                [value; 2]
            };
            self.thirds[third][0] += value;
            self.thirds[third][1] += 1.0;
            self.count += 1.0;
            let before = value - self.mean;
            self.mean += before / self.count;
            self.squares += before * (value - self.mean);
        }
    }

    /// Standard deviation of the readings; `NaN` for fewer than two.
    fn deviation(&self) -> f64 {
        (self.squares / (self.count - 1.0)).sqrt()
    }

    /// Scatter over noise; where that is not known, over what readings in a row differ by, if they
    /// drift. A reading goes by a `step`, or where that is not known by `least_jump`.
    fn motion(&self, noise: f64, step: f64, least_jump: f64) -> f64 {
        let deviation = self.deviation();
        if !noise.is_nan() {
            return deviation / noise;
        }
        let step = self.step(step, least_jump);
        if self.drift() < DRIFTS * deviation {
            0.0
        } else {
            deviation / self.rough_noise(step)
        }
    }

    /// The step of the readings, where it is known; else the least that was seen.
    fn step(&self, known: f64, least_jump: f64) -> f64 {
        match self.broken {
            _ if known > 0.0 => known,
            true => least_jump,
            // Counts go by one.
            false => 1.0,
        }
    }

    /// Noise by the differences of readings in a row, which a drift hardly changes; no less than a
    /// `step` of the readings.
    fn rough_noise(&self, step: f64) -> f64 {
        (0.5 * self.jumps / (self.count - 1.0)).sqrt().max(step)
    }

    /// Largest difference between the means of the thirds of the capture.
    fn drift(&self) -> f64 {
        let means = self.thirds.iter().filter(|[_, count]| *count > 0.0);
        let [low, high] = means
            .map(|[sum, count]| sum / count)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], mean| {
                [low.min(mean), high.max(mean)]
            });
        high - low
    }

    /// True if the readings were all the same although their noise must show.
    fn stands_still(&self, facts: &ChannelFacts) -> bool {
        self.squares == 0.0 && facts.stands_still(self.mean, self.count - 1.0)
    }

    /// Mean of the readings; `NaN` without any.
    fn mean_or_nan(&self) -> f64 {
        if self.count > 0.0 {
            self.mean
        } else {
            f64::NAN
        }
    }
}
