//! Training of the map from channels to the force.

use taxel::trained::{
    BetweenRuns, FeatureStream, ForceMap, Intervals, MemoryLaw, Moments, Polynomial, Ridge,
    Standard, TrainingError,
};

use super::{Score, Series, Session, blocks_of_time, interval_factor};

/// Candidate: the form of a force map.
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
            prior: 1.0,
            offset: 0.0,
            blocks: 5,
            whole_runs: false,
        }
    }
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
    let forces = || runs.iter().flat_map(|run| run.force.iter().copied());
    map.range = [
        forces().fold(f64::INFINITY, f64::min),
        forces().fold(f64::NEG_INFINITY, f64::max),
    ];
    let held_out = fit(&mut map, &runs, options)?;
    map.intervals = intervals_of(&held_out.estimates, &held_out.errors, &held_out.deviations);
    map.largest_leverage = LEVERAGE_MARGIN * held_out.leverage;
    Ok((map, held_out))
}

/// Everything but the weights and what follows from them.
fn untrained(runs: &[Session], options: &ForceOptions) -> Result<ForceMap, TrainingError> {
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
    Ok(ForceMap {
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

/// Features of a session at the times of its force readings, brought to
/// the sensor's time. Readings far from any frame are left out.
///
/// # Errors
/// [`TrainingError`] for other channels than those of the map.
pub fn features_of(map: &ForceMap, run: &Session) -> Result<TrainingRun, TrainingError> {
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
    let force = run.force.as_ref().ok_or_else(none)?;
    let mut found = TrainingRun {
        features: Vec::new(),
        force: Vec::new(),
        times: Vec::new(),
    };
    for (time, reading) in force.times().iter().zip(force.rows()) {
        if let Some(row) = linear.at(time - map.offset, map.longest_step) {
            found.features.push(map.complete(&row));
            found.force.push(reading[0]);
            found.times.push(*time);
        }
    }
    Ok(found)
}

/// Fits the weights, and estimates each block of time without itmap.
fn fit(
    map: &mut ForceMap,
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
        map.ridge = Ridge::fit(&all.without(part), options.prior)?;
        let run = &runs[*number];
        for row in rows.clone() {
            let (estimate, variance, leverage) = map.raw(&run.features[row]);
            held_out.runs.push(*number);
            held_out.times.push(run.times[row]);
            held_out.estimates.push(estimate);
            held_out.errors.push(estimate - run.force[row]);
            held_out.deviations.push(variance.sqrt());
            held_out.leverage = held_out.leverage.max(leverage);
        }
    }
    map.ridge = Ridge::fit(&all, options.prior)?;
    Ok(held_out)
}

/// Ranges of equal numbers of held-out estimates.
const RANGES: usize = 4;

/// Factors after which 95 % of `errors` are covered in each quarter of the
/// estimates.
pub(super) fn intervals_of(estimates: &[f64], errors: &[f64], deviations: &[f64]) -> Intervals {
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
    Intervals {
        factors: factors.collect(),
        levels,
    }
}
