//! Training of the map from channels to the force.

use faer::{Mat, Side};
use taxel::trained::{
    BetweenRuns, FeatureStream, ForceMap, Intervals, MemoryLaw, Mixed, Moments, Polynomial, Ridge,
    Standard, TrainingError,
};

use super::relation::OF_ONE_RUN;
use super::{NORMAL_95, Score, Series, Session, blocks_of_time, interval_factor};

/// Candidate: the form of a force map.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceOptions {
    /// Largest number of channels in a product, 1 to 3.
    pub polynomial: Polynomial,
    /// Memory of each channel.
    pub memory: MemoryLaw,
    /// True if the reciprocals of the readings are used; default false.
    pub reciprocal: bool,
    /// Number of directions whose products with their own creep are features; default none.
    pub mixed: usize,
    /// Strength λ of the prior (see [`Ridge`]) of products of channels.
    pub prior: f64,
    /// Strength of the prior of the channels themselves, of what each did lately, and of the
    /// products of both, over that of the products; default the same for all.
    pub prior_shares: [f64; 3],
    /// By how much the scale comes after the sensor, s.
    pub offset: f64,
    /// Blocks of time of each run; default 10.
    pub blocks: usize,
    /// Share of the blocks of a run that are only learned from, as slow creep shows in nearly all of
    /// it; each of the others is held out in turn. Default 0.7.
    pub learned_from: f64,
    /// True if whole runs are held out in turn instead, if there are several.
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
            reciprocal: false,
            mixed: 0,
            prior: 1.0,
            prior_shares: [1.0; 3],
            offset: 0.0,
            blocks: 10,
            learned_from: 0.7,
            whole_runs: false,
        }
    }
}

/// One run, as features at the times of its readings.
#[derive(Debug, Clone)]
pub struct TrainingRun {
    /// Features, one row per reading.
    pub features: Vec<Vec<f64>>,
    /// Features when the scale measured what it shows; none: the same.
    measured: Option<Vec<Vec<f64>>>,
    /// Force, N.
    pub force: Vec<f64>,
    /// Times of the readings, s.
    pub times: Vec<f64>,
}

impl TrainingRun {
    /// The features that a map learns from: those of the times when the scale measured.
    pub fn learned(&self) -> &[Vec<f64>] {
        self.measured.as_ref().unwrap_or(&self.features)
    }
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
    /// Deviation of one observation by the map that made it, N.
    pub(super) noises: Vec<f64>,
    /// What live adds to the deviation of the map, N.
    pub(super) beside: Vec<f64>,
    leverage: f64,
}

impl HeldOutForce {
    /// Appends the estimate of a reading with its deviation, by a map of this noise, and what live
    /// adds to the deviation.
    pub(super) fn push(
        &mut self,
        run: usize,
        [time, reading]: [f64; 2],
        [value, deviation]: [f64; 2],
        [noise, beside]: [f64; 2],
    ) {
        self.runs.push(run);
        self.times.push(time);
        self.estimates.push(value);
        self.errors.push(value - reading);
        self.deviations.push(deviation);
        self.noises.push(noise);
        self.beside.push(beside);
    }

    /// Appends all of `other`.
    pub(super) fn append(&mut self, other: Self) {
        self.runs.extend(other.runs);
        self.times.extend(other.times);
        self.estimates.extend(other.estimates);
        self.errors.extend(other.errors);
        self.deviations.extend(other.deviations);
        self.noises.extend(other.noises);
        self.beside.extend(other.beside);
        self.leverage = self.leverage.max(other.leverage);
    }

    /// Puts the deviation that a map states for an estimate and its deviation without factors, with
    /// what live adds, in place of the deviation.
    pub(super) fn widen(&mut self, stated: impl Fn(f64, f64) -> f64) {
        let known = self.estimates.iter().zip(&self.beside);
        for (deviation, (estimate, beside)) in self.deviations.iter_mut().zip(known) {
            *deviation = stated(*estimate, *deviation).hypot(*beside);
        }
    }
}

/// A leverage this much above the largest that was seen when held out is outside; the next run of a body
/// of which one run is known is farther from it, as in the relation of its channels.
const LEVERAGE_MARGIN: f64 = 2.0;
const LEVERAGE_MARGIN_OF_ONE: f64 = LEVERAGE_MARGIN * OF_ONE_RUN * OF_ONE_RUN;

/// Trains on whole runs, each beginning without contact.
///
/// # Errors
/// [`TrainingError`].
pub fn train_force(
    runs: &[Session],
    options: &ForceOptions,
) -> Result<(ForceMap, Score), TrainingError> {
    let (map, held_out) = trained_force(runs, options)?;
    Ok((map, Score::of(&held_out.errors, &held_out.deviations)))
}

/// The map with its held-out estimates, whose deviations have no factors.
pub(super) fn trained_force(
    runs: &[Session],
    options: &ForceOptions,
) -> Result<(ForceMap, HeldOutForce), TrainingError> {
    let mut map = untrained(runs, options)?;
    let runs: Vec<TrainingRun> = runs
        .iter()
        .map(|run| features_of(&map, run))
        .collect::<Result<_, _>>()?;
    let rows = runs.iter().flat_map(|run| &run.features);
    let count = rows.clone().count().max(1) as f64;
    let first = map.products();
    map.memory_spread = (first..first + map.standard.used.len() * map.memory.creep_times.len())
        .map(|j| (rows.clone().map(|row| row[j].powi(2)).sum::<f64>() / count).sqrt())
        .collect();
    // The features of a channel are its reading z, after the constant, and z − q with its slow part q.
    let width = map.standard.used.len();
    let slow = |row: &[f64], time: usize| {
        let q = (0..width).map(|c| row[1 + c] - row[first + time * width + c]);
        q.map(|q| q * q).sum::<f64>().sqrt()
    };
    map.slow_reach = (0..map.memory.creep_times.len())
        .map(|time| {
            rows.clone()
                .fold(0.0, |most: f64, row| most.max(slow(row, time)))
        })
        .collect();
    let forces = || runs.iter().flat_map(|run| run.force.iter().copied());
    map.range = [
        forces().fold(f64::INFINITY, f64::min),
        forces().fold(f64::NEG_INFINITY, f64::max),
    ];
    let held_out = fit(&mut map, &runs, options)?;
    map.intervals = intervals_of(&Within::of_all(&held_out));
    let margin = if runs.len() > 1 {
        LEVERAGE_MARGIN
    } else {
        LEVERAGE_MARGIN_OF_ONE
    };
    map.largest_leverage = margin * held_out.leverage;
    Ok((map, held_out))
}

/// Everything but the weights and what follows from them.
fn untrained(runs: &[Session], options: &ForceOptions) -> Result<ForceMap, TrainingError> {
    let mut map = ForceMap {
        standard: Standard {
            channels: 0,
            used: Vec::new(),
            centre: Vec::new(),
            scale: Vec::new(),
        },
        reciprocal: options.reciprocal,
        polynomial: options.polynomial,
        memory: options.memory.clone(),
        memory_spread: Vec::new(),
        slow_reach: Vec::new(),
        mixed: Mixed::default(),
        ridge: Ridge::fit(&Moments::of(&[vec![1.0], vec![1.0]], &[0.0, 0.0])?, 1.0)?,
        intervals: Intervals {
            levels: Vec::new(),
            factors: Vec::new(),
        },
        between_runs: BetweenRuns::default(),
        range: [0.0; 2],
        largest_leverage: f64::INFINITY,
        longest_step: 0.0,
        offset: options.offset,
        components: Vec::new(),
    };
    let tared: Vec<Vec<f64>> = runs
        .iter()
        .flat_map(|run| {
            let baseline = run.baseline();
            let rows = run.sensor.rows().iter();
            let map = &map;
            let tared = move |row: &Vec<f64>| {
                let readings = row.iter().zip(&baseline);
                readings.map(|(x, b)| map.tared(*x, *b)).collect()
            };
            rows.map(tared)
        })
        .collect();
    let mut standard = Standard::of(&tared)?;
    standard.centre.fill(0.0);
    let longest = runs.iter().map(|run| run.sensor.longest_step());
    map.longest_step = longest.fold(0.0, f64::max);
    if options.mixed > 0 && !options.memory.creep_times.is_empty() {
        map.mixed = mixed(&standard, &tared, options);
    }
    map.standard = standard;
    Ok(map)
}

/// With more creep times than this every other one is multiplied.
const ALL_TIMES: usize = 3;

/// The directions in which the tared channels vary most, each with a mean square of one.
fn mixed(standard: &Standard, tared: &[Vec<f64>], options: &ForceOptions) -> Mixed {
    let scaled = tared.iter().filter_map(|row| standard.apply(row).ok());
    let scaled: Vec<Vec<f64>> = scaled.collect();
    let width = standard.used.len();
    let rows = Mat::from_fn(scaled.len(), width, |i, j| scaled[i][j]);
    let moments = rows.transpose() * &rows * faer::Scale(1.0 / scaled.len().max(1) as f64);
    let Ok(decomposed) = moments.self_adjoint_eigen(Side::Lower) else {
        return Mixed::default();
    };
    let (vectors, values) = (decomposed.U(), decomposed.S());
    // The largest come last.
    let largest = (0..width).rev().take(options.mixed);
    let directions = largest.filter(|at| values[*at] > 0.0).map(|at| {
        let scale = 1.0 / values[at].sqrt();
        (0..width).map(|j| scale * vectors[(j, at)]).collect()
    });
    let times = options.memory.creep_times.len();
    Mixed {
        directions: directions.collect(),
        times: (0..times)
            .step_by(1 + usize::from(times > ALL_TIMES))
            .collect(),
    }
}

/// Features of a session at the times of its force readings, brought to
/// the sensor's time. Readings far from any frame are left out.
///
/// # Errors
/// [`TrainingError`] for other channels than those of the map.
pub fn features_of(map: &ForceMap, run: &Session) -> Result<TrainingRun, TrainingError> {
    features_at(map, run, run.force.as_ref())
}

/// The same at the times of the readings of one component.
pub(super) fn features_at(
    map: &ForceMap,
    run: &Session,
    readings: Option<&Series>,
) -> Result<TrainingRun, TrainingError> {
    let mut states = FeatureStream::new(map, run.baseline());
    let mut times = Vec::new();
    let mut rows = Vec::new();
    for (time, frame) in run.sensor.times().iter().zip(run.sensor.rows()) {
        // A frame with a missing reading is no training frame.
        if states.push(map, *time, frame).is_ok() {
            times.push(*time);
            rows.push(states.linear().to_vec());
        }
    }
    let none = || TrainingError::TooFew {
        found: 0,
        needed: 2,
    };
    let linear = Series::new(times, rows).ok_or_else(none)?;
    let force = readings.ok_or_else(none)?;
    let mut found = TrainingRun {
        features: Vec::new(),
        measured: run.scale_clock.map(|_| Vec::new()),
        force: Vec::new(),
        times: Vec::new(),
    };
    for (time, reading) in force.times().iter().zip(force.rows()) {
        let at = time - map.offset;
        if let Some(row) = linear.at(at, map.longest_step) {
            let features = map.complete(&row);
            if let (Some(clock), Some(rows)) = (&run.scale_clock, &mut found.measured) {
                let measured = linear.at(at - clock.age(*time), map.longest_step);
                rows.push(measured.map_or_else(|| features.clone(), |row| map.complete(&row)));
            }
            found.features.push(features);
            found.force.push(reading[0]);
            found.times.push(*time);
        }
    }
    Ok(found)
}

impl ForceOptions {
    /// True if the features are the same, whatever the prior.
    pub(super) fn same_form(&self, other: &Self) -> bool {
        self.polynomial == other.polynomial
            && self.reciprocal == other.reciprocal
            && self.memory == other.memory
            && self.mixed == other.mixed
    }

    /// Strength of the prior of a feature, where those of the channels, their products and their
    /// memory end at `ends`.
    fn prior_of(&self, feature: usize, ends: [usize; 3]) -> f64 {
        let [own, memory, mixed] = self.prior_shares;
        self.prior
            * match ends.iter().position(|end| feature < *end) {
                Some(0) => own,
                Some(1) => 1.0,
                Some(_) => memory,
                None => mixed,
            }
    }

    /// The map of the moments of readings.
    pub(super) fn ridge(&self, moments: &Moments, map: &ForceMap) -> Result<Ridge, TrainingError> {
        let (channels, products) = (map.standard.used.len(), map.products());
        let law = &map.memory;
        let memory = channels * (law.creep_times.len() + law.play_thresholds.len());
        let ends = [channels + 1, products, products + memory];
        Ridge::fit_with(moments, |feature| self.prior_of(feature, ends))
    }
}

/// Readings of one run that are held out together.
pub(super) struct Block {
    /// Number of the run.
    pub(super) run: usize,
    /// Its readings.
    pub(super) rows: std::ops::Range<usize>,
}

/// The blocks that are held out in turn, whole runs or parts of each.
pub(super) fn blocks_of(runs: &[TrainingRun], options: &ForceOptions) -> Vec<Block> {
    let whole = options.whole_runs && runs.len() > 1;
    let count = if whole { 1 } else { options.blocks };
    let of = |(run, readings): (usize, &TrainingRun)| {
        let blocks = blocks_of_time(readings.force.len(), count).into_iter();
        blocks
            .map(move |rows| Block { run, rows })
            .collect::<Vec<_>>()
    };
    let blocks = runs.iter().enumerate().flat_map(of);
    blocks.filter(|block| !block.rows.is_empty()).collect()
}

/// Moments of each block.
pub(super) fn moments_of(
    runs: &[TrainingRun],
    blocks: &[Block],
) -> Result<Vec<Moments>, TrainingError> {
    let of = |block: &Block| {
        let run = &runs[block.run];
        let rows = block.rows.clone();
        Moments::of(&run.learned()[rows.clone()], &run.force[rows])
    };
    blocks.iter().map(of).collect()
}

/// Moments of all blocks together.
pub(super) fn moments_of_all(parts: &[Moments]) -> Result<Moments, TrainingError> {
    let (first, rest) = parts.split_first().ok_or(TrainingError::TooFew {
        found: 0,
        needed: 2,
    })?;
    Ok(rest.iter().fold(first.clone(), |sum, part| sum.with(part)))
}

/// The moments that a block is predicted from: those of all other runs, and of its own run of the
/// blocks before. A live device comes after its training, too. None for the first blocks of a
/// run; a run that is one block is predicted from the others.
pub(super) fn known_before(
    blocks: &[Block],
    parts: &[Moments],
    all: &Moments,
    (number, learned_from): (usize, f64),
) -> Option<Moments> {
    let run = blocks[number].run;
    let own: Vec<usize> = (0..blocks.len())
        .filter(|at| blocks[*at].run == run)
        .collect();
    let first = (learned_from * own.len() as f64) as usize;
    if own.len() > 1 && own[..first.max(1)].contains(&number) {
        return None;
    }
    let unseen = own.into_iter().filter(|at| *at >= number);
    Some(unseen.fold(all.clone(), |known, at| known.without(&parts[at])))
}

/// Fits the weights, and estimates the blocks of time that are held out.
fn fit(
    map: &mut ForceMap,
    runs: &[TrainingRun],
    options: &ForceOptions,
) -> Result<HeldOutForce, TrainingError> {
    let blocks = blocks_of(runs, options);
    let parts = moments_of(runs, &blocks)?;
    let all = moments_of_all(&parts)?;
    let mut held_out = HeldOutForce::default();
    for (number, block) in blocks.iter().enumerate() {
        let Some(known) = known_before(&blocks, &parts, &all, (number, options.learned_from))
        else {
            continue;
        };
        map.ridge = options.ridge(&known, map)?;
        let run = &runs[block.run];
        for row in block.rows.clone() {
            let (estimate, variance, leverage) = map.raw(&run.features[row]);
            let found = [estimate, variance.sqrt()];
            let noise = map.ridge.noise_variance().sqrt();
            let reading = [run.times[row], run.force[row]];
            held_out.push(block.run, reading, found, [noise, 0.0]);
            held_out.leverage = held_out.leverage.max(leverage);
        }
    }
    map.ridge = options.ridge(&all, map)?;
    Ok(held_out)
}

/// Ranges of equal numbers of held-out estimates.
const RANGES: usize = 4;

/// Held-out rows that tell the errors within a run.
pub(super) struct Within<'a> {
    pub(super) estimates: &'a [f64],
    pub(super) errors: &'a [f64],
    pub(super) deviations: &'a [f64],
    /// What live adds to them.
    pub(super) beside: &'a [f64],
}

impl<'a> Within<'a> {
    fn of_all(held_out: &'a HeldOutForce) -> Self {
        Self {
            estimates: &held_out.estimates,
            errors: &held_out.errors,
            deviations: &held_out.deviations,
            beside: &held_out.beside,
        }
    }

    /// Factor on the deviations of some rows, beside what live adds, after which 95 % of their
    /// errors are covered.
    pub(super) fn factor(&self, rows: impl Iterator<Item = usize>) -> f64 {
        let own = |row: usize| {
            let error = self.errors[row].powi(2) - (NORMAL_95 * self.beside[row]).powi(2);
            (error.max(0.0).sqrt(), self.deviations[row])
        };
        let (errors, deviations): (Vec<_>, Vec<_>) = rows.map(own).unzip();
        interval_factor(&errors, &deviations)
    }
}

/// Factors after which 95 % of the errors are covered in each quarter of the
/// estimates.
pub(super) fn intervals_of(within: &Within<'_>) -> Intervals {
    let estimates = within.estimates;
    let mut sorted = estimates.to_vec();
    sorted.sort_by(f64::total_cmp);
    let quantile = |i: usize| sorted.get(i * sorted.len() / RANGES).copied();
    let mut levels: Vec<f64> = (1..RANGES).filter_map(quantile).collect();
    levels.dedup();
    let range_of = |estimate: f64| levels.partition_point(|level| *level <= estimate);
    let factors = (0..=levels.len()).map(|range| {
        let members = (0..estimates.len()).filter(|i| range_of(estimates[*i]) == range);
        within.factor(members)
    });
    Intervals {
        factors: factors.collect(),
        levels,
    }
}
