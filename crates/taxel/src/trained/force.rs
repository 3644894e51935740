//! Channels to force, with the memory of the body.
//!
//! Features are the products of the tared channels up to a degree, and for
//! each channel what it did lately ([`MemoryLaw`]); a Bayesian linear map
//! ([`Ridge`]) takes them to the force. All features follow the stream of
//! frames, so training and live use do the same.

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::{dot, long_dot};

use super::memory::Memory;
use super::{
    Estimate, MemoryLaw, Polynomial, Ridge, SURELY, Standard, Support, TrainingError, USUAL,
};

/// What a map errs by is known, from frames that were held out, up to this share of the leverage from
/// which on a frame is outside.
const FARTHEST: f64 = 0.5;

/// Touches like those of training let a body creep by up to this much more in hours than in the
/// minutes of training.
const BY_CHANCE: f64 = 1.5;

/// Factors on the deviation by the level of the estimate, from held-out errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intervals {
    /// Upper ends of all ranges but the last, rising, in the target's unit.
    pub levels: Vec<f64>,
    /// Factor in each range.
    pub factors: Vec<f64>,
}

impl Intervals {
    /// The factor at an estimate.
    pub fn at(&self, estimate: f64) -> f64 {
        let range = self.levels.partition_point(|level| *level <= estimate);
        self.factors.get(range).copied().unwrap_or(1.0)
    }
}

/// Difference of the force of one run from that of others under one map: deviations of which 1.96
/// hold 95 %, with Student's factor of few runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BetweenRuns {
    /// Deviation of an offset, N.
    pub offset: f64,
    /// Relative deviation of the gain.
    pub gain: f64,
    /// Runs that both were estimated from; with one they are the usual ones of soft
    /// bodies.
    pub runs: usize,
}

impl BetweenRuns {
    /// Deviation at a force, N.
    pub fn at(&self, force: f64) -> f64 {
        self.offset.hypot(self.gain * force)
    }
}

/// A component of force or moment beside the pressing force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Force along x, N.
    ForceX,
    /// Force along y, N.
    ForceY,
    /// Moment about x, N m.
    MomentX,
    /// Moment about y, N m.
    MomentY,
    /// Moment about z, N m.
    MomentZ,
}

impl Component {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::ForceX,
        Self::ForceY,
        Self::MomentX,
        Self::MomentY,
        Self::MomentZ,
    ];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ForceX => "force_x",
            Self::ForceY => "force_y",
            Self::MomentX => "moment_x",
            Self::MomentY => "moment_y",
            Self::MomentZ => "moment_z",
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForceX | Self::ForceY => "N",
            _ => "N m",
        }
    }
}

/// Map of the features of the pressing force to another component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentMap {
    /// The component.
    pub component: Component,
    /// Component from features, SI.
    pub ridge: Ridge,
    /// Factor on its deviation within a run, from held-out errors.
    pub interval_factor: f64,
    /// Differences between runs; files of before 2026-11-27 have none.
    #[serde(default)]
    pub between_runs: BetweenRuns,
    /// Least and largest component of training, SI; older files have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
}

impl ComponentMap {
    /// Deviation of an estimate, whose deviation within its run is `deviation` before the factor.
    pub fn deviation(&self, estimate: f64, deviation: f64) -> f64 {
        let within = self.interval_factor * deviation;
        within.hypot(self.between_runs.at(estimate))
    }
}

/// Products of what the whole body shows and what it did lately: creep depends on the load.
///
/// The directions are those in which the scaled channels of training vary most; a feature is the
/// product of one of them now, uᵢ = dᵢᵀz, and of the creep along another, dⱼᵀ(z − q).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mixed {
    /// Directions in the scaled channels, a row each; none: no products.
    pub directions: Vec<Vec<f64>>,
    /// Numbers of the creep times that are multiplied.
    pub times: Vec<usize>,
}

impl Mixed {
    /// Number of features.
    pub fn count(&self) -> usize {
        self.times.len() * self.directions.len().pow(2)
    }

    /// Along each direction, what the channels from `first` on show.
    fn along<'a>(&'a self, linear: &'a [f64], first: usize) -> impl Iterator<Item = f64> + 'a {
        let of =
            move |direction: &Vec<f64>| long_dot(direction, &linear[first..][..direction.len()]);
        self.directions.iter().map(of)
    }

    /// Appends the features of channels and memory.
    fn expand(&self, linear: &[f64], features: &mut Vec<f64>) {
        let width = self.directions.first().map_or(0, Vec::len);
        let now: Vec<f64> = self.along(linear, 0).collect();
        for time in &self.times {
            for creep in self.along(linear, (time + 1) * width) {
                features.extend(now.iter().map(|now| now * creep));
            }
        }
    }

    /// By how much Σ wₖ fₖ of the features changes with each channel and with its creep, added to
    /// the rows of `slopes`: the channels, then one for each creep time.
    fn slopes(&self, weights: &[f64], linear: &[f64], slopes: &mut [f64]) {
        let count = self.directions.len();
        let width = self.directions.first().map_or(0, Vec::len);
        let now: Vec<f64> = self.along(linear, 0).collect();
        let mut add = |row: usize, direction: &[f64], slope: f64| {
            let row = slopes[row * width..][..width].iter_mut().zip(direction);
            row.for_each(|(sum, share)| *sum += slope * share);
        };
        for (time, weights) in self.times.iter().zip(weights.chunks(count.pow(2).max(1))) {
            let creep = self.along(linear, (time + 1) * width);
            let rows = self.directions.iter().zip(weights.chunks(count)).zip(creep);
            for ((direction, weights), creep) in rows {
                add(time + 1, direction, dot(&now, weights));
                for (direction, weight) in self.directions.iter().zip(weights) {
                    add(0, direction, weight * creep);
                }
            }
        }
    }

    fn is_sound(&self, channels: usize, times: usize) -> bool {
        let whole = |row: &Vec<f64>| row.len() == channels && row.iter().all(|x| x.is_finite());
        self.directions.len() <= channels
            && self.directions.iter().all(whole)
            && self.times.iter().all(|time| *time < times)
    }
}

/// A trained map from channels to force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceMap {
    /// Channels and their scale; the centre is the baseline's and stays zero.
    pub standard: Standard,
    /// True if the reciprocals of the readings are used, as of resistances that fall with 1/F.
    #[serde(default)]
    pub reciprocal: bool,
    /// Degree of the products.
    pub polynomial: Polynomial,
    /// Memory of each channel.
    pub memory: MemoryLaw,
    /// Root mean square of each memory feature of creep over training.
    pub memory_spread: Vec<f64>,
    /// For each creep time the largest slow part of the channels over training: the root sum square of
    /// all, in deviations of the channels; none of an older map.
    #[serde(default)]
    pub slow_reach: Vec<f64>,
    /// Products of the body's state and its creep.
    #[serde(default)]
    pub mixed: Mixed,
    /// Force from features, N.
    pub ridge: Ridge,
    /// Factors on its deviation.
    pub intervals: Intervals,
    /// Differences between runs.
    pub between_runs: BetweenRuns,
    /// Least and largest force of training, N.
    pub range: [f64; 2],
    /// Leverage above which a frame is unlike those of training.
    pub largest_leverage: f64,
    /// Longest step between frames over which memory is kept, s.
    pub longest_step: f64,
    /// By how much the scale of training came after the sensor, s.
    pub offset: f64,
    /// Maps of other components, of the same features.
    #[serde(default)]
    pub components: Vec<ComponentMap>,
}

impl ForceMap {
    /// Checks that the parts of a map from a file belong together.
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let channels = self.standard.used.len();
        let (times, thresholds) = (&self.memory.creep_times, &self.memory.play_thresholds);
        let sound = |least: f64| move |value: &f64| *value >= least && value.is_finite();
        let memory =
            times.iter().all(sound(f64::MIN_POSITIVE)) && thresholds.iter().all(sound(0.0));
        let degree = (1..=3).contains(&self.polynomial.degree);
        let features = if degree { self.products() } else { 0 };
        let features = features + channels * (times.len() + thresholds.len());
        let features = features + self.mixed.count();
        let intervals = self.intervals.factors.len() == self.intervals.levels.len() + 1;
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let positive = |values: &[f64]| finite(values) && values.iter().all(|value| *value >= 0.0);
        let between = [self.between_runs.offset, self.between_runs.gain];
        for (sound, table) in [
            (self.standard.is_sound(), "standard"),
            (degree, "polynomial"),
            (memory, "memory"),
            (
                self.memory_spread.len() == channels * times.len() && positive(&self.memory_spread),
                "memory_spread",
            ),
            (
                [0, times.len()].contains(&self.slow_reach.len()) && positive(&self.slow_reach),
                "slow_reach",
            ),
            (self.mixed.is_sound(channels, times.len()), "mixed"),
            (self.ridge.is_sound(features), "ridge"),
            (
                intervals && finite(&self.intervals.levels) && positive(&self.intervals.factors),
                "intervals",
            ),
            (positive(&between), "between_runs"),
            (finite(&self.range), "range"),
            (self.largest_leverage > 0.0, "largest_leverage"),
            (positive(&[self.longest_step]), "longest_step"),
            (
                self.components.iter().all(|map| {
                    let between = [map.between_runs.offset, map.between_runs.gain];
                    map.ridge.is_sound(features)
                        && map.range.is_none_or(|range| finite(&range))
                        && positive(&[map.interval_factor])
                        && positive(&between)
                }),
                "components",
            ),
        ] {
            if !sound {
                return Err(TrainingError::Unsound { table });
            }
        }
        Ok(())
    }

    /// A reading less the one at rest; of reciprocals r − r²/x, which is the same for small
    /// changes.
    pub fn tared(&self, reading: f64, rest: f64) -> f64 {
        if self.reciprocal {
            rest - rest * rest / reading
        } else {
            reading - rest
        }
    }

    /// Number of products, the constant among them.
    pub fn products(&self) -> usize {
        self.polynomial.count(self.standard.used.len())
    }

    /// Products of the channels, then the memory features and their products.
    pub fn complete(&self, linear: &[f64]) -> Vec<f64> {
        let (channels, memory) = linear.split_at(self.standard.used.len());
        let mut features = Vec::with_capacity(self.ridge.weights().len());
        self.polynomial.expand(channels, &mut features);
        features.extend_from_slice(memory);
        self.mixed.expand(linear, &mut features);
        features
    }

    /// By how much a map of the features changes with each channel, then with each memory feature.
    fn slopes(&self, ridge: &Ridge, linear: &[f64]) -> Vec<f64> {
        let width = self.standard.used.len();
        let (products, others) = ridge.weights().split_at(self.products());
        let (memory, mixed) = others.split_at(others.len() - self.mixed.count());
        let mut slopes = vec![0.0; width];
        slopes.extend_from_slice(memory);
        let (channels, _) = linear.split_at(width);
        self.polynomial
            .slopes(products, channels, &mut slopes[..width]);
        self.mixed.slopes(mixed, linear, &mut slopes);
        slopes
    }

    /// Estimate, variance without the factors, and leverage.
    pub fn raw(&self, features: &[f64]) -> (f64, f64, f64) {
        let leverage = self.ridge.leverage(features);
        let variance = self.ridge.noise_variance() * (1.0 + leverage);
        // A scale that never showed less than zero will not do so now.
        let estimate = self.ridge.mean(features).max(self.range[0]);
        (estimate, variance, leverage)
    }

    /// Deviation of an estimate whose variance within its run is `variance`
    /// before the factors.
    pub fn deviation(&self, estimate: f64, variance: f64) -> f64 {
        let within = variance.sqrt() * self.intervals.at(estimate);
        within.hypot(self.between_runs.at(estimate))
    }

    /// The estimate for one row of features.
    pub fn estimate(&self, features: &[f64]) -> Estimate {
        self.estimate_with_leverage(features).0
    }

    fn estimate_with_leverage(&self, features: &[f64]) -> (Estimate, f64) {
        let (value, variance, leverage) = self.raw(features);
        let outside = leverage > self.largest_leverage;
        let estimate = Estimate {
            value,
            deviation: self.deviation(value, variance),
            support: if outside {
                Support::Outside
            } else {
                Support::Trained
            },
        };
        (estimate, leverage)
    }
}

/// Scaled channels and their memory, frame by frame.
#[derive(Debug, Clone)]
pub struct FeatureStream {
    baseline: Vec<f64>,
    memory: Memory,
    last: Option<f64>,
    linear: Vec<f64>,
    /// By how much each tared reading changes with the reading.
    slopes: Vec<f64>,
}

impl FeatureStream {
    /// A stream of a device at rest with the readings `baseline`.
    pub fn new(map: &ForceMap, baseline: Vec<f64>) -> Self {
        Self {
            memory: Memory::at_rest(&map.memory, map.standard.used.len()),
            baseline,
            last: None,
            linear: Vec::new(),
            slopes: Vec::new(),
        }
    }

    /// Scaled channels and their memory, after the last frame.
    pub fn linear(&self) -> &[f64] {
        &self.linear
    }

    /// Takes the frame at `time`, s.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing
    /// reading; the frame then leaves no trace.
    pub fn push(&mut self, map: &ForceMap, time: f64, frame: &[f64]) -> Result<(), TrainingError> {
        let expected = map.standard.channels;
        let found = frame.len().min(self.baseline.len());
        if found != expected {
            return Err(TrainingError::Channels { found, expected });
        }
        let tared: Vec<f64> = frame
            .iter()
            .zip(&self.baseline)
            .map(|(x, b)| map.tared(*x, *b))
            .collect();
        let channels = map.standard.apply(&tared)?;
        self.slopes.clear();
        let readings = frame.iter().zip(&self.baseline);
        self.slopes.extend(readings.map(
            |(x, b)| {
                if map.reciprocal { (b / x).powi(2) } else { 1.0 }
            },
        ));
        // Steps of training are kept over; half as much again is an outage.
        if self
            .last
            .is_some_and(|last| time - last > 1.5 * map.longest_step)
        {
            self.memory.forget();
        }
        self.last = Some(time);
        self.linear.clear();
        self.linear.extend_from_slice(&channels);
        self.memory.push(time, &channels, &mut self.linear);
        Ok(())
    }
}

/// By how much an estimate changes with the reading of a channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ChannelSlope {
    /// With one that came so slowly that creep has followed it.
    pub slow: f64,
    /// With one that came at once.
    pub fast: f64,
}

/// What estimates may be off by because a frame is unlike those of training.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BeyondTraining {
    /// Standard deviations beside those stated: of the pressing force, then of each other component, SI.
    pub deviations: Vec<f64>,
    /// True if an estimate is beyond all of training by more than chance.
    pub surely: bool,
    /// True if it is the pressing force, and greater.
    pub pressed_harder: bool,
}

/// Frames to forces, in real time.
#[derive(Debug, Clone)]
pub struct ForceEstimator {
    map: ForceMap,
    stream: FeatureStream,
    /// Features of the last frame, and their leverage.
    features: Vec<f64>,
    leverage: f64,
}

impl ForceEstimator {
    /// An estimator for a device that rests, with its readings `baseline`.
    ///
    /// # Errors
    /// [`TrainingError`] for a baseline of another length or with a missing
    /// reading, or for a map that was changed by hand.
    pub fn new(map: ForceMap, baseline: Vec<f64>) -> Result<Self, TrainingError> {
        map.check()?;
        map.standard.apply(&baseline)?;
        Ok(Self {
            stream: FeatureStream::new(&map, baseline),
            features: Vec::new(),
            leverage: 0.0,
            map,
        })
    }

    /// Takes the frame at `time` (s) and estimates the force.
    ///
    /// After an outage the memory is unknown, and the deviation says so until
    /// it has faded.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing
    /// reading; the frame then leaves no trace.
    pub fn push(&mut self, time: f64, frame: &[f64]) -> Result<Estimate, TrainingError> {
        self.stream.push(&self.map, time, frame)?;
        self.features = self.map.complete(&self.stream.linear);
        let (mut estimate, leverage) = self.map.estimate_with_leverage(&self.features);
        self.leverage = leverage;
        let unknown = self.stream.memory.unknown(&self.map.memory_spread);
        if unknown.iter().any(|unknown| *unknown > 0.0) {
            let slopes = self.map.slopes(&self.map.ridge, &self.stream.linear);
            let memory = &slopes[self.map.standard.used.len()..];
            let terms = unknown.iter().zip(memory).map(|(u, w)| (u * w).powi(2));
            estimate.deviation = estimate.deviation.hypot(terms.sum::<f64>().sqrt());
        }
        Ok(estimate)
    }

    /// The other components of the last frame, each with its standard deviation, SI.
    pub fn components(&self) -> Vec<(Component, [f64; 2])> {
        let maps = &self.map.components;
        let features = &self.features;
        if features.is_empty() {
            return Vec::new();
        }
        let estimate = |map: &ComponentMap| {
            let leverage = map.ridge.leverage(features);
            let deviation = (map.ridge.noise_variance() * (1.0 + leverage)).sqrt();
            let value = map.ridge.mean(features);
            (map.component, [value, map.deviation(value, deviation)])
        };
        maps.iter().map(estimate).collect()
    }

    /// The last estimate as the map gives it, also where it is less than any force of training, N.
    pub fn unbounded(&self) -> f64 {
        self.map.ridge.mean(&self.features)
    }

    /// By how much the last estimate, then each other component, changes with the reading of each
    /// channel, SI per unit of a reading.
    pub fn slopes(&self) -> impl Iterator<Item = Vec<ChannelSlope>> + '_ {
        let others = self.map.components.iter().map(|map| &map.ridge);
        let ridges = std::iter::once(&self.map.ridge).chain(others);
        ridges.map(|ridge| self.slopes_of(ridge))
    }

    fn slopes_of(&self, ridge: &Ridge) -> Vec<ChannelSlope> {
        let standard = &self.map.standard;
        let mut found = vec![ChannelSlope::default(); standard.channels];
        if self.stream.linear.is_empty() {
            return found;
        }
        let slopes = self.map.slopes(ridge, &self.stream.linear);
        let width = standard.used.len();
        let times = self.map.memory.creep_times.len();
        for (at, (channel, scale)) in standard.used.iter().zip(&standard.scale).enumerate() {
            let per_reading = self.stream.slopes[*channel] / scale;
            let creep: f64 = (1..=times).map(|time| slopes[time * width + at]).sum();
            found[*channel] = ChannelSlope {
                slow: per_reading * slopes[at],
                fast: per_reading * (slopes[at] + creep),
            };
        }
        found
    }

    /// What the last estimate, then each other component, may be off by beyond its deviation because
    /// the frame is unlike those of training.
    ///
    /// `unexplained` is the size of a change of the channels over their scale that no frame of training
    /// explains; it counts as if it lay in the direction in which the estimate changes most. Farther
    /// from the frames of training than any that was held out a map errs by what it does not know of the
    /// body, which grows with the square of the distance. After contacts so long that the body has crept
    /// clearly more than ever in training it errs by as many of its deviations as the creep is greater.
    /// Nothing of this is off by more than the range of the forces of training and what the estimate is
    /// beyond it, times the distance, or as much in proportion. An estimate beyond all of training is off
    /// by the square of what is beyond over the range, or by all of it. `estimates` are those of the
    /// frame, as the map gives them, with their deviations; `slopes` gives [`slopes`](Self::slopes), if
    /// they are needed.
    pub fn beyond_training<'a>(
        &self,
        unexplained: f64,
        estimates: &[[f64; 2]],
        slopes: impl FnOnce() -> &'a [Vec<ChannelSlope>],
    ) -> BeyondTraining {
        let map = &self.map;
        let others = map.components.iter().map(|map| &map.ridge);
        let ridges: Vec<&Ridge> = std::iter::once(&map.ridge).chain(others).collect();
        let mut beyond = BeyondTraining {
            deviations: vec![0.0; ridges.len()],
            ..BeyondTraining::default()
        };
        if self.features.is_empty() {
            return beyond;
        }
        let leverage = self.leverage;
        let farther = (leverage / (FARTHEST * map.largest_leverage)).max(1.0);
        let slow = self.stream.memory.slow_sizes().zip(&map.slow_reach);
        let slow = slow.filter(|(_, reach)| **reach > 0.0);
        let crept = slow.fold(BY_CHANCE, |most: f64, (size, reach)| most.max(size / reach));
        let distance = ((farther * farther - 1.0) * (1.0 + leverage)).sqrt();
        let distance = distance.hypot((crept * crept - BY_CHANCE * BY_CHANCE).sqrt());
        if unexplained > 0.0 || distance > 0.0 {
            let standard = &map.standard;
            let found = ridges.iter().zip(slopes()).map(|(ridge, slopes)| {
                let used = standard.used.iter().zip(&standard.scale);
                let squares = used.map(|(channel, scale)| (slopes[*channel].fast * scale).powi(2));
                let of_channels = unexplained * squares.sum::<f64>().sqrt();
                of_channels.hypot(distance * ridge.noise_variance().sqrt())
            });
            beyond.deviations = found.collect();
            let [low, high] = map.range;
            let value = estimates.first().map_or(low, |[value, _]| *value);
            let reach = (high.max(value) - low.min(value)) * farther.sqrt();
            let share = (reach / beyond.deviations[0]).min(1.0);
            beyond.deviations.iter_mut().for_each(|own| *own *= share);
        }
        let others = map.components.iter().map(|map| map.range);
        let ranges = std::iter::once(Some(map.range)).chain(others);
        let all = beyond.deviations.iter_mut().zip(ranges).zip(estimates);
        for (number, ((own, range), [value, deviation])) in all.enumerate() {
            let Some([low, high]) = range else { continue };
            let excess = (value - high).max(low - value);
            if excess > USUAL * deviation {
                *own = own.hypot(excess * (excess / (high - low)).min(1.0));
                let surely = excess > SURELY * deviation;
                beyond.surely |= surely;
                beyond.pressed_harder |= surely && number == 0 && *value > high;
            }
        }
        beyond
    }

    /// The map.
    pub fn map(&self) -> &ForceMap {
        &self.map
    }
}
