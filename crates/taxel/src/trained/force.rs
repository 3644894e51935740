//! Channels to force, with the memory of the body.
//!
//! Features are the products of the tared channels up to a degree, and for
//! each channel what it did lately ([`MemoryLaw`]); a Bayesian linear map
//! ([`Ridge`]) takes them to the force. All features follow the stream of
//! frames, so training and live use do the same.

use serde::{Deserialize, Serialize};

use super::memory::Memory;
use super::{
    BetweenRuns, Estimate, MemoryLaw, Moments, Polynomial, Ridge, Score, Series, Session, Standard,
    Support, TrainingError, blocks_of_time, interval_factor,
};

/// What is tried: the form of a force map.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceOptions {
    /// Largest number of channels in a product, 1 to 3.
    pub polynomial: Polynomial,
    /// Memory of each channel.
    pub memory: MemoryLaw,
    /// Strength λ of the prior (see [`Ridge`]).
    pub prior: f64,
    /// By how much the scale comes after the sensor, s.
    pub offset: f64,
    /// Blocks of time of each run that are held out in turn.
    pub blocks: usize,
    /// Whether whole runs are held out in turn instead, if there are several.
    pub whole_runs: bool,
}

impl Default for ForceOptions {
    fn default() -> Self {
        Self {
            polynomial: Polynomial { degree: 2 },
            memory: MemoryLaw {
                creep_times: vec![1.0, 10.0, 100.0],
                play_thresholds: Vec::new(),
            },
            prior: 1.0,
            offset: 0.0,
            blocks: 5,
            whole_runs: false,
        }
    }
}

/// Factors on the deviation by the level of the estimate, from held-out errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intervals {
    /// Upper ends of all ranges but the last, rising, in the target's unit.
    pub levels: Vec<f64>,
    /// Factor in each range.
    pub factors: Vec<f64>,
}

/// Ranges of equal numbers of held-out estimates.
const RANGES: usize = 4;

impl Intervals {
    /// Factors after which 95 % of `errors` are covered in each quarter of the
    /// estimates.
    pub fn of(estimates: &[f64], errors: &[f64], deviations: &[f64]) -> Self {
        let mut sorted = estimates.to_vec();
        sorted.sort_by(f64::total_cmp);
        let quantile = |i: usize| sorted.get(i * sorted.len() / RANGES).copied();
        let mut levels: Vec<f64> = (1..RANGES).filter_map(quantile).collect();
        levels.dedup();
        let range_of = |estimate: f64| levels.partition_point(|level| *level <= estimate);
        let factors = (0..=levels.len()).map(|range| {
            let members = (0..estimates.len()).filter(|i| range_of(estimates[*i]) == range);
            let (e, d): (Vec<_>, Vec<_>) = members.map(|i| (errors[i], deviations[i])).unzip();
            interval_factor(&e, &d)
        });
        Self {
            factors: factors.collect(),
            levels,
        }
    }

    /// The factor at an estimate.
    pub fn at(&self, estimate: f64) -> f64 {
        let range = self.levels.partition_point(|level| *level <= estimate);
        self.factors.get(range).copied().unwrap_or(1.0)
    }
}

/// A trained map from channels to force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceMap {
    /// Channels and their scale; the centre is the baseline's and stays zero.
    pub standard: Standard,
    /// Degree of the products.
    pub polynomial: Polynomial,
    /// Memory of each channel.
    pub memory: MemoryLaw,
    /// Root mean square of each memory feature of creep over training.
    pub memory_spread: Vec<f64>,
    /// Force from features, N.
    pub ridge: Ridge,
    /// Factors on its deviation.
    pub intervals: Intervals,
    /// How runs differ.
    pub between_runs: BetweenRuns,
    /// Least and largest force of training, N.
    pub range: [f64; 2],
    /// Leverage above which a frame is unlike those of training.
    pub largest_leverage: f64,
    /// Longest step between frames over which memory is kept, s.
    pub longest_step: f64,
    /// By how much the scale of training came after the sensor, s.
    pub offset: f64,
}

/// One run, as features at the times of its readings.
#[derive(Debug, Clone)]
pub struct TrainingRun {
    /// Features, one row per reading.
    pub features: Vec<Vec<f64>>,
    /// Force, N.
    pub force: Vec<f64>,
    /// Times of the readings, s.
    pub times: Vec<f64>,
}

/// Held-out estimates in the order of runs and time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOutForce {
    /// Number of the run of each.
    pub runs: Vec<usize>,
    /// Time, s.
    pub times: Vec<f64>,
    /// Estimate, N.
    pub estimates: Vec<f64>,
    /// Estimate less reading, N.
    pub errors: Vec<f64>,
    /// Deviation of the estimate, N.
    pub deviations: Vec<f64>,
    leverage: f64,
}

/// A leverage this much above the largest that was seen when held out is outside.
const LEVERAGE_MARGIN: f64 = 2.0;

impl ForceMap {
    /// Trains on whole runs, each beginning without contact.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn train(runs: &[Session], options: &ForceOptions) -> Result<(Self, Score), TrainingError> {
        let (map, held_out) = Self::trained(runs, options)?;
        Ok((map, Score::of(&held_out.errors, &held_out.deviations)))
    }

    /// The map with its held-out estimates, whose deviations have no factors.
    pub(super) fn trained(
        runs: &[Session],
        options: &ForceOptions,
    ) -> Result<(Self, HeldOutForce), TrainingError> {
        let mut map = Self::untrained(runs, options)?;
        let runs: Vec<TrainingRun> = runs
            .iter()
            .map(|run| map.features_of(run))
            .collect::<Result<_, _>>()?;
        let rows = runs.iter().flat_map(|run| &run.features);
        let count = rows.clone().count().max(1) as f64;
        let first = map.products();
        map.memory_spread = (first..first + map.standard.used.len() * map.memory.creep_times.len())
            .map(|j| (rows.clone().map(|row| row[j].powi(2)).sum::<f64>() / count).sqrt())
            .collect();
        let forces = || runs.iter().flat_map(|run| run.force.iter().copied());
        map.range = [
            forces().fold(f64::INFINITY, f64::min),
            forces().fold(f64::NEG_INFINITY, f64::max),
        ];
        let held_out = map.fit(&runs, options)?;
        map.intervals = Intervals::of(&held_out.estimates, &held_out.errors, &held_out.deviations);
        map.largest_leverage = LEVERAGE_MARGIN * held_out.leverage;
        Ok((map, held_out))
    }

    /// Everything but the weights and what follows from them.
    fn untrained(runs: &[Session], options: &ForceOptions) -> Result<Self, TrainingError> {
        let tared: Vec<Vec<f64>> = runs
            .iter()
            .flat_map(|run| {
                let baseline = run.baseline();
                let rows = run.sensor.rows().iter();
                rows.map(move |row| row.iter().zip(&baseline).map(|(x, b)| x - b).collect())
            })
            .collect();
        let mut standard = Standard::of(&tared)?;
        standard.centre.fill(0.0);
        let longest = runs.iter().map(|run| run.sensor.longest_step());
        Ok(Self {
            standard,
            polynomial: options.polynomial,
            memory: options.memory.clone(),
            memory_spread: Vec::new(),
            ridge: Ridge::fit(&Moments::of(&[vec![1.0], vec![1.0]], &[0.0, 0.0])?, 1.0)?,
            intervals: Intervals {
                levels: Vec::new(),
                factors: Vec::new(),
            },
            between_runs: BetweenRuns::default(),
            range: [0.0; 2],
            largest_leverage: f64::INFINITY,
            longest_step: longest.fold(0.0, f64::max),
            offset: options.offset,
        })
    }

    /// Whether the parts of a map from a file belong together.
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let channels = self.standard.used.len();
        let (times, thresholds) = (&self.memory.creep_times, &self.memory.play_thresholds);
        let sound = |least: f64| move |value: &f64| *value >= least && value.is_finite();
        let memory =
            times.iter().all(sound(f64::MIN_POSITIVE)) && thresholds.iter().all(sound(0.0));
        let degree = (1..=3).contains(&self.polynomial.degree);
        let features = if degree { self.products() } else { 0 };
        let features = features + channels * (times.len() + thresholds.len());
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
            (self.ridge.is_sound(features), "ridge"),
            (
                intervals && finite(&self.intervals.levels) && positive(&self.intervals.factors),
                "intervals",
            ),
            (positive(&between), "between_runs"),
            (finite(&self.range), "range"),
            (self.largest_leverage > 0.0, "largest_leverage"),
            (positive(&[self.longest_step]), "longest_step"),
        ] {
            if !sound {
                return Err(TrainingError::Unsound { table });
            }
        }
        Ok(())
    }

    /// Number of products, the constant among them.
    fn products(&self) -> usize {
        let mut features = Vec::new();
        self.polynomial
            .expand(&vec![0.0; self.standard.used.len()], &mut features);
        features.len()
    }

    /// Features of a session at the times of its force readings, brought to
    /// the sensor's time. Readings far from any frame are left out.
    ///
    /// # Errors
    /// [`TrainingError`] for other channels than those of the map.
    pub fn features_of(&self, run: &Session) -> Result<TrainingRun, TrainingError> {
        let mut states = FeatureStream::new(self, run.baseline());
        let mut times = Vec::new();
        let mut rows = Vec::new();
        for (time, frame) in run.sensor.times().iter().zip(run.sensor.rows()) {
            // A frame with a missing reading is no training frame.
            if states.push(self, *time, frame).is_ok() {
                times.push(*time);
                rows.push(states.linear.clone());
            }
        }
        let none = || TrainingError::TooFew {
            found: 0,
            needed: 2,
        };
        let linear = Series::new(times, rows).ok_or_else(none)?;
        let force = run.force.as_ref().ok_or_else(none)?;
        let mut found = TrainingRun {
            features: Vec::new(),
            force: Vec::new(),
            times: Vec::new(),
        };
        for (time, reading) in force.times().iter().zip(force.rows()) {
            if let Some(row) = linear.at(time - self.offset, self.longest_step) {
                found.features.push(self.complete(&row));
                found.force.push(reading[0]);
                found.times.push(*time);
            }
        }
        Ok(found)
    }

    /// Products of the channels, then the memory features.
    fn complete(&self, linear: &[f64]) -> Vec<f64> {
        let (channels, memory) = linear.split_at(self.standard.used.len());
        let mut features = Vec::new();
        self.polynomial.expand(channels, &mut features);
        features.extend_from_slice(memory);
        features
    }

    /// Fits the weights, and estimates each block of time without itself.
    fn fit(
        &mut self,
        runs: &[TrainingRun],
        options: &ForceOptions,
    ) -> Result<HeldOutForce, TrainingError> {
        let whole = options.whole_runs && runs.len() > 1;
        let count = if whole { 1 } else { options.blocks };
        let of = |(number, run): (usize, &TrainingRun)| {
            let blocks = blocks_of_time(run.force.len(), count).into_iter();
            blocks.map(move |rows| (number, rows)).collect::<Vec<_>>()
        };
        let blocks = runs.iter().enumerate().flat_map(of);
        let blocks: Vec<_> = blocks.filter(|(_, rows)| !rows.is_empty()).collect();
        let parts: Vec<Moments> = blocks
            .iter()
            .map(|(run, rows)| {
                let run = &runs[*run];
                Moments::of(&run.features[rows.clone()], &run.force[rows.clone()])
            })
            .collect::<Result<_, _>>()?;
        let Some((first, rest)) = parts.split_first() else {
            return Err(TrainingError::TooFew {
                found: 0,
                needed: 2,
            });
        };
        let all = rest.iter().fold(first.clone(), |sum, part| sum.with(part));
        let mut held_out = HeldOutForce::default();
        for ((number, rows), part) in blocks.iter().zip(&parts) {
            self.ridge = Ridge::fit(&all.without(part), options.prior)?;
            let run = &runs[*number];
            for row in rows.clone() {
                let (estimate, variance, leverage) = self.raw(&run.features[row]);
                held_out.runs.push(*number);
                held_out.times.push(run.times[row]);
                held_out.estimates.push(estimate);
                held_out.errors.push(estimate - run.force[row]);
                held_out.deviations.push(variance.sqrt());
                held_out.leverage = held_out.leverage.max(leverage);
            }
        }
        self.ridge = Ridge::fit(&all, options.prior)?;
        Ok(held_out)
    }

    /// Estimate, variance without the factors, and leverage.
    fn raw(&self, features: &[f64]) -> (f64, f64, f64) {
        let leverage = self.ridge.leverage(features);
        let variance = self.ridge.noise_variance() * (1.0 + leverage);
        // A scale that never showed less than zero will not do so now.
        let estimate = self.ridge.mean(features).max(self.range[0]);
        (estimate, variance, leverage)
    }

    /// Deviation of an estimate whose variance within its run is `variance`
    /// before the factors.
    pub(super) fn deviation(&self, estimate: f64, variance: f64) -> f64 {
        let within = variance.sqrt() * self.intervals.at(estimate);
        within.hypot(self.between_runs.at(estimate))
    }

    /// The estimate for one row of features.
    pub fn estimate(&self, features: &[f64]) -> Estimate {
        let (value, variance, leverage) = self.raw(features);
        let outside = leverage > self.largest_leverage;
        Estimate {
            value,
            deviation: self.deviation(value, variance),
            support: if outside {
                Support::Outside
            } else {
                Support::Trained
            },
        }
    }
}

/// Scaled channels and their memory, frame by frame.
#[derive(Debug, Clone)]
struct FeatureStream {
    baseline: Vec<f64>,
    memory: Memory,
    last: Option<f64>,
    linear: Vec<f64>,
}

impl FeatureStream {
    fn new(map: &ForceMap, baseline: Vec<f64>) -> Self {
        Self {
            memory: Memory::at_rest(&map.memory, map.standard.used.len()),
            baseline,
            last: None,
            linear: Vec::new(),
        }
    }

    fn push(&mut self, map: &ForceMap, time: f64, frame: &[f64]) -> Result<(), TrainingError> {
        let expected = map.standard.channels;
        let found = frame.len().min(self.baseline.len());
        if found != expected {
            return Err(TrainingError::Channels { found, expected });
        }
        let tared: Vec<f64> = frame
            .iter()
            .zip(&self.baseline)
            .map(|(x, b)| x - b)
            .collect();
        let channels = map.standard.apply(&tared)?;
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

/// Frames to forces, in real time.
#[derive(Debug, Clone)]
pub struct ForceEstimator {
    map: ForceMap,
    stream: FeatureStream,
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
        let features = self.map.complete(&self.stream.linear);
        let mut estimate = self.map.estimate(&features);
        let unknown = self.stream.memory.unknown(&self.map.memory_spread);
        let weights = self.map.ridge.weights();
        let memory = &weights[weights.len() - unknown.len().min(weights.len())..];
        let terms = unknown.iter().zip(memory).map(|(u, w)| (u * w).powi(2));
        estimate.deviation = estimate.deviation.hypot(terms.sum::<f64>().sqrt());
        Ok(estimate)
    }

    /// The map.
    pub fn map(&self) -> &ForceMap {
        &self.map
    }
}
