//! Training of the maps from channels to forces: what predicts runs that were not seen decides.
//!
//! Each of a few maps from simple to rich is a ridge over blocks of features, with the prior that predicts
//! held-out groups of readings best; the shares of the maps are those of the convex mixture that does. Groups
//! are whole runs, or blocks of the only one. Settling scales, directions and centres takes readings alone.

use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;
use taxel::trained::{
    BetweenRuns, Block, Component, ComponentMap, ErrorLaw, FeatureLaw, FeatureStream, ForceMap,
    MemberMap, MixedMap, SUMS, Standard, TrainingError,
};
use taxel_numerics::split_mix;

use super::{Score, Session, interval_factor};

/// Times of the memory that are tried, s, if a run lasts this many times as long: slower creep is drift.
const TIMES: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
const SEEN: f64 = 3.5;
/// Rows that scales and directions are settled with at most, and readings that a map learns from: more
/// teach little, and time and memory grow with them.
const LAW_ROWS: usize = 5000;
const MOST_READINGS: usize = 12_000;
/// Directions that are kept, and components at most.
const DIRECTIONS: usize = 48;
const COMPONENTS: usize = 24;
/// Directions with less than this share of the variance of the first are rounding.
const ROUNDING: f64 = 1e-6;
/// A direction counts when frames vary along it by this many times the variance of noise.
const OVER_NOISE: f64 = 4.0;
/// Centres of kernels: of few components more, as they can fill their space.
const CENTRES: [usize; 2] = [400, 250];
const FEW_COMPONENTS: usize = 6;
/// Blocks of the only run.
const BLOCKS: usize = 5;
/// A distance this much above the largest of training is outside; the next run of a body of which one run
/// is known is farther, as in the relation of its channels.
const MARGIN: f64 = 2.0;
/// Priors that are tried first; then the neighbours of the best.
const PRIORS: [f64; 3] = [1e-2, 1.0, 1e2];
const NEIGHBOUR: f64 = 10.0;
/// Rows of the delay of a scale.
pub(crate) const DELAY_READINGS: usize = 3000;

/// The maps that are mixed, from simple to rich.
const CANDIDATES: [&[Block]; 7] = [
    &[Block::Channels],
    &[Block::Sums, Block::SlowSums],
    &[Block::Channels, Block::Sums, Block::SlowSums],
    &[Block::Channels, Block::Slow, Block::SlowSums],
    &[Block::Channels, Block::Powers, Block::Sums, Block::Slow, Block::SlowSums],
    &[
        Block::Channels,
        Block::Powers,
        Block::Sums,
        Block::Products,
        Block::Slow,
        Block::SlowSums,
        Block::SlowProducts,
        Block::Broad,
    ],
    &[
        Block::Channels,
        Block::Powers,
        Block::Sums,
        Block::Products,
        Block::Slow,
        Block::SlowSums,
        Block::SlowProducts,
        Block::Sharp,
    ],
];

/// What is left out of a training: a time of a run, or all of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fold {
    pub(crate) run: usize,
    /// From a time until before another, s.
    pub(crate) times: Range<f64>,
}

impl Fold {
    /// True if it has the reading or frame of a run at a time, s.
    pub(crate) fn has(&self, run: usize, time: f64) -> bool {
        self.run == run && self.times.contains(&time)
    }

    /// All folds: whole runs, or blocks of equal numbers of readings of the only one.
    pub(crate) fn all(runs: &[Session]) -> Vec<Self> {
        let times = match runs {
            [one] => one.force.iter().flat_map(|force| force.times()).copied().collect(),
            _ => Vec::new(),
        };
        if times.is_empty() {
            let whole = |run| Self {
                run,
                times: f64::NEG_INFINITY..f64::INFINITY,
            };
            return (0..runs.len()).map(whole).collect();
        }
        let begin = |block: usize| match block {
            0 => f64::NEG_INFINITY,
            BLOCKS => f64::INFINITY,
            block => times[block * times.len() / BLOCKS],
        };
        let block = |block| Self {
            run: 0,
            times: begin(block)..begin(block + 1),
        };
        (0..BLOCKS).map(block).collect()
    }
}

/// Held-out estimates in the order of runs and time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOut {
    /// Number of the run of each.
    pub runs: Vec<usize>,
    /// Time, s.
    pub times: Vec<f64>,
    /// Estimate, SI.
    pub estimates: Vec<f64>,
    /// Estimate less reading, SI.
    pub errors: Vec<f64>,
    /// By how much the maps differ, SI.
    pub differences: Vec<f64>,
    /// What live adds to the deviation of the map, SI.
    pub beside: Vec<f64>,
    /// Deviation of the estimate, SI.
    pub deviations: Vec<f64>,
}

impl HeldOut {
    pub(crate) fn push(
        &mut self,
        run: usize,
        [time, reading]: [f64; 2],
        [estimate, difference]: [f64; 2],
        beside: f64,
    ) {
        self.runs.push(run);
        self.times.push(time);
        self.estimates.push(estimate);
        self.errors.push(estimate - reading);
        self.differences.push(difference);
        self.beside.push(beside);
        self.deviations.push(f64::NAN);
    }

    pub(crate) fn append(&mut self, other: Self) {
        self.runs.extend(other.runs);
        self.times.extend(other.times);
        self.estimates.extend(other.estimates);
        self.errors.extend(other.errors);
        self.differences.extend(other.differences);
        self.beside.extend(other.beside);
        self.deviations.extend(other.deviations);
    }

    /// Score of the estimates with their deviations.
    pub fn score(&self) -> Score {
        Score::of(&self.errors, &self.deviations)
    }
}

/// A map of the mixture, as the report names it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Blocks of features.
    pub blocks: Vec<Block>,
    /// Strength of its prior.
    pub prior: f64,
    /// Error of held-out groups, SI rms.
    pub error: f64,
    /// Its share in the mixture.
    pub share: f64,
}

/// Maps that were learned of runs, without what is left out.
#[derive(Debug, Clone)]
pub struct LearnedForces {
    /// The maps; their deviations are those of the groups that this training held out.
    pub map: ForceMap,
    /// Of the pressing force, then of each component, the maps that were mixed.
    pub candidates: Vec<Vec<Candidate>>,
}

/// Readings of one target, at the times of a scale.
struct Target {
    /// `None`: the pressing force.
    component: Option<Component>,
    /// Of each run: times and values.
    readings: Vec<Vec<[f64; 2]>>,
}

impl Target {
    /// Targets that at least one run has; the pressing force is the first.
    fn all(runs: &[Session]) -> Vec<Self> {
        let of = |component: Option<Component>| {
            let series = |run: &Session| match component {
                None => run.force.clone(),
                Some(component) => {
                    let own = run.components.iter().find(|(other, _)| *other == component);
                    own.map(|(_, series)| series.clone())
                }
            };
            let readings = |run| {
                let series = series(run);
                let rows = series.iter().flat_map(|s| s.times().iter().zip(s.rows()));
                rows.map(|(time, row)| [*time, row[0]]).collect()
            };
            Self {
                component,
                readings: runs.iter().map(readings).collect(),
            }
        };
        let components = Component::ALL.into_iter().map(Some);
        let all = std::iter::once(None).chain(components).map(of);
        all.filter(|target| target.component.is_none() || target.readings.iter().any(|r| !r.is_empty()))
            .collect()
    }
}

/// Learns all forces of runs, each of which begins without contact; `offset` (s) is by how much the scale
/// comes after the sensor.
///
/// # Errors
/// [`TrainingError`].
pub(crate) fn learn(
    runs: &[Session],
    except: Option<&Fold>,
    offset: f64,
) -> Result<LearnedForces, TrainingError> {
    let (standard, law) = law_of(runs, except)?;
    let longest = runs.iter().map(|run| run.sensor.longest_step());
    let longest_step = longest.fold(0.0, f64::max);
    let mut map = ForceMap {
        spread: vec![1.0; law.components],
        slow_reach: vec![0.0; law.times.len() - 1],
        farthest: f64::INFINITY,
        pressing: empty(),
        components: Vec::new(),
        standard,
        law,
        longest_step,
        offset,
    };
    reach(&mut map, runs, except)?;
    let targets = Target::all(runs);
    let mut candidates = Vec::new();
    let mut designs: Vec<(usize, Design)> = Vec::new();
    for number in 0..targets.len() {
        let target = &targets[number];
        // Components are read with the pressing force, as a rule.
        let times = |target: &Target| -> Vec<Vec<f64>> {
            let of = |run: &Vec<[f64; 2]>| run.iter().map(|[time, _]| *time).collect();
            target.readings.iter().map(of).collect()
        };
        let same = |(other, _): &&(usize, Design)| times(&targets[*other]) == times(target);
        if designs.iter().find(same).is_none() {
            let design = Design::of(&map, runs, &times(target), except, Block::ALL.as_slice())?;
            designs.push((number, design));
        }
        let Some((_, design)) = designs.iter().find(same) else {
            continue;
        };
        let (mixed, tried) = design.mixed(&map.law, &target.readings)?;
        candidates.push(tried);
        match target.component {
            None => map.pressing = mixed,
            Some(component) => map.components.push(ComponentMap {
                component,
                map: mixed,
            }),
        }
    }
    Ok(LearnedForces { map, candidates })
}

fn empty() -> MixedMap {
    MixedMap {
        members: Vec::new(),
        error: ErrorLaw::default(),
        between_runs: BetweenRuns::default(),
        range: [0.0; 2],
    }
}

/// Frames of a run that are not left out, less the rest.
fn tared<'a>(
    (number, run): (usize, &'a Session),
    except: Option<&'a Fold>,
) -> impl Iterator<Item = Vec<f64>> + 'a {
    let rest = run.baseline();
    let frames = run.sensor.times().iter().zip(run.sensor.rows());
    let frames = frames.filter(move |(time, _)| except.is_none_or(|fold| !fold.has(number, **time)));
    frames.map(move |(_, row)| row.iter().zip(&rest).map(|(x, b)| x - b).collect())
}

/// Scales, directions and centres of the features of runs.
fn law_of(
    runs: &[Session],
    except: Option<&Fold>,
) -> Result<(Standard, FeatureLaw), TrainingError> {
    let rows: Vec<Vec<f64>> = runs
        .iter()
        .enumerate()
        .flat_map(|run| tared(run, except))
        .collect();
    let step = rows.len().div_ceil(LAW_ROWS).max(1);
    let rows: Vec<Vec<f64>> = rows.into_iter().step_by(step).collect();
    let mut standard = Standard::of(&rows)?;
    standard.centre.fill(0.0);
    let mut noise = rest_noise(runs, except, &standard);
    // A channel that shows at rest nearly all that it ever shows is noise: its prior is stronger.
    for (scale, noise) in standard.scale.iter_mut().zip(&mut noise) {
        *scale /= (1.0 - (*noise / *scale).powi(2)).max(0.01).sqrt();
        *noise /= *scale;
    }
    let common = median(standard.scale.clone());
    let scaled: Vec<Vec<f64>> = rows.iter().filter_map(|row| standard.apply(row).ok()).collect();
    if scaled.len() < 2 {
        return Err(TrainingError::TooFew {
            found: scaled.len(),
            needed: 2,
        });
    }
    let width = standard.used.len();
    let design = Mat::from_fn(scaled.len(), width, |i, j| scaled[i][j]);
    let moments = design.transpose() * &design * faer::Scale(1.0 / scaled.len() as f64);
    let decomposed = moments
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| TrainingError::Dependent { features: width })?;
    let (vectors, values) = (decomposed.U(), decomposed.S());
    // The largest come last.
    let kept: Vec<usize> = (0..width).rev().take(DIRECTIONS).collect();
    let first = values[width - 1];
    let floor = (OVER_NOISE * median(noise.iter().map(|n| n * n).collect())).max(ROUNDING * first);
    let components = kept.iter().filter(|at| values[**at] > floor).count();
    let relative: Vec<f64> = standard.scale.iter().map(|scale| scale / common).collect();
    let sizes = scaled.iter().flat_map(|row| row.iter().zip(&relative).map(|(x, r)| (x * r).abs()));
    let longest = runs.iter().map(|run| {
        let times = run.sensor.times();
        times[times.len() - 1] - times[0]
    });
    let longest = longest.fold(0.0, f64::max);
    let steps = runs.iter().map(|run| run.sensor.usual_step());
    let step = steps.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let slower = TIMES.into_iter().filter(|time| *time > step && SEEN * time <= longest);
    let mut law = FeatureLaw {
        most: sizes.fold(f64::MIN_POSITIVE, f64::max),
        soft: median(noise).max(ROUNDING),
        directions: kept
            .iter()
            .map(|at| (0..width).map(|j| vectors[(j, *at)]).collect())
            .collect(),
        components: components.clamp(2, COMPONENTS).min(kept.len()),
        size: first.sqrt(),
        tops: vec![1.0; SUMS],
        times: std::iter::once(step).chain(slower).collect(),
        slow_spread: Vec::new(),
        centres: Vec::new(),
        length: 1.0,
        relative,
    };
    let sums: Vec<[f64; SUMS]> = scaled.iter().map(|row| law.sums(row)).collect();
    for (at, top) in law.tops.iter_mut().enumerate() {
        *top = root_mean_square(sums.iter().map(|sums| sums[at])).max(f64::MIN_POSITIVE);
    }
    let components: Vec<Vec<f64>> = scaled.iter().map(|row| law.along(row)).collect();
    let count = CENTRES[usize::from(law.components > FEW_COMPONENTS)];
    law.centres = centres(&components, count);
    law.length = median_distance(&law.centres);
    Ok((standard, law))
}

/// Standard deviation of the channels in use before the first contact.
fn rest_noise(runs: &[Session], except: Option<&Fold>, standard: &Standard) -> Vec<f64> {
    let whole = |(number, _): &(usize, &Session)| {
        except.is_none_or(|fold| fold.run != *number || fold.times.start.is_finite())
    };
    let mut squares = vec![0.0; standard.used.len()];
    let mut count = 0.0_f64;
    for (_, run) in runs.iter().enumerate().filter(whole) {
        let frames = run.rest_frames();
        for (square, channel) in squares.iter_mut().zip(&standard.used) {
            let of = || frames.iter().map(|row| row[*channel]).filter(|x| x.is_finite());
            let mean = of().sum::<f64>() / of().count().max(1) as f64;
            *square += of().map(|x| (x - mean).powi(2)).sum::<f64>();
        }
        count += frames.len() as f64;
    }
    let deviation = |square: f64| (square / count.max(1.0)).sqrt();
    squares.into_iter().map(deviation).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Centres among rows: in turn the row that is farthest from all centres, and any.
fn centres(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let any = |number: usize| (split_mix(0, number as u64) % rows.len() as u64) as usize;
    let mut chosen = vec![any(0)];
    let mut nearest: Vec<f64> = rows.iter().map(|row| apart(row, &rows[chosen[0]])).collect();
    while chosen.len() < count.min(rows.len()) {
        let far = (0..rows.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b]));
        let next = match far {
            Some(far) if chosen.len() % 2 == 1 => far,
            _ => any(chosen.len()),
        };
        // A centre twice would say nothing.
        let next = if nearest[next] > 0.0 { next } else { far.unwrap_or(next) };
        if nearest[next] <= 0.0 {
            break;
        }
        chosen.push(next);
        for (nearest, row) in nearest.iter_mut().zip(rows) {
            *nearest = nearest.min(apart(row, &rows[next]));
        }
    }
    chosen.into_iter().map(|at| rows[at].clone()).collect()
}

fn median_distance(centres: &[Vec<f64>]) -> f64 {
    let pairs = centres.iter().enumerate();
    let distances = pairs.flat_map(|(i, a)| centres[..i].iter().map(|b| apart(a, b)));
    median(distances.collect()).sqrt().max(f64::MIN_POSITIVE)
}

/// How far frames of training go: spreads of the components and of the memory, and the largest of each.
fn reach(map: &mut ForceMap, runs: &[Session], except: Option<&Fold>) -> Result<(), TrainingError> {
    let mut components = vec![0.0; map.law.components];
    let mut slow: Vec<f64> = Vec::new();
    let mut frames = 0.0_f64;
    let mut all = Vec::new();
    let mut slow_reach = vec![0.0_f64; map.slow_reach.len()];
    for run in runs.iter().enumerate() {
        streamed(map, run, |time, stream| {
            if except.is_some_and(|fold| fold.has(run.0, time)) {
                return;
            }
            frames += 1.0;
            let own: Vec<f64> = stream.slow().collect();
            slow.resize(own.len(), 0.0);
            for (sum, value) in slow.iter_mut().zip(own) {
                *sum += value * value;
            }
            for (sum, value) in components.iter_mut().zip(stream.components()) {
                *sum += value * value;
            }
            for (reach, size) in slow_reach.iter_mut().zip(stream.slow_sizes()) {
                *reach = reach.max(size);
            }
            all.push(stream.components().to_vec());
        })?;
    }
    map.slow_reach = slow_reach;
    let root = |sum: f64| (sum / frames.max(1.0)).sqrt();
    map.law.slow_spread = slow.into_iter().map(root).collect();
    map.spread = components.into_iter().map(|sum| root(sum).max(f64::MIN_POSITIVE)).collect();
    let farthest = all.iter().map(|row| map.distance(row)).fold(0.0, f64::max);
    let margin = match runs {
        [_] => MARGIN * super::relation::OF_ONE_RUN.powi(2),
        _ => MARGIN,
    };
    map.farthest = (margin * farthest).max(f64::MIN_POSITIVE);
    Ok(())
}

/// Calls `of` after each frame of a run that has all readings.
fn streamed(
    map: &ForceMap,
    (_, run): (usize, &Session),
    mut of: impl FnMut(f64, &FeatureStream),
) -> Result<(), TrainingError> {
    let mut stream = FeatureStream::new(&map.law, run.baseline(), map.longest_step);
    let mut frames = 0;
    for (time, frame) in run.sensor.times().iter().zip(run.sensor.rows()) {
        // A frame with a missing reading is no training frame.
        if stream.push((&map.standard, &map.law), *time, frame).is_ok() {
            of(*time, &stream);
            frames += 1;
        }
    }
    if frames < 2 {
        return Err(TrainingError::TooFew {
            found: frames,
            needed: 2,
        });
    }
    Ok(())
}

/// Features of some blocks at the times of readings, in groups that are held out in turn.
struct Design {
    /// Blocks in the order of the features.
    blocks: Vec<Block>,
    /// Run and number of the reading of each row, by group.
    places: Vec<Vec<[usize; 2]>>,
    /// Rows of each group: features less their mean over their scale, kernels whitened.
    rows: Vec<Mat<f64>>,
    /// Mean and scale of each feature, kernels whitened.
    mean: Vec<f64>,
    scale: Vec<f64>,
    /// Inverse roots of the kernels of the centres, of broad and of sharp ones.
    whitenings: Vec<(Block, Mat<f64>)>,
    /// Range of each block among the columns.
    ranges: Vec<(Block, Range<usize>)>,
}

impl Design {
    fn of(
        map: &ForceMap,
        runs: &[Session],
        times: &[Vec<f64>],
        except: Option<&Fold>,
        blocks: &[Block],
    ) -> Result<Self, TrainingError> {
        let count: usize = times.iter().map(Vec::len).sum();
        let step = count.div_ceil(MOST_READINGS).max(1);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let mut places = Vec::new();
        for (number, run) in runs.iter().enumerate() {
            let times = times[number].iter().enumerate().step_by(step);
            let kept = times.filter(|(_, time)| except.is_none_or(|fold| !fold.has(number, **time)));
            let clock = run.scale_clock;
            let kept: Vec<(usize, f64)> = kept
                .map(|(at, time)| {
                    let age = clock.map_or(0.0, |clock| clock.age(*time));
                    (at, time - map.offset - age)
                })
                .collect();
            let pick = |features: &[f64]| -> Vec<f64> {
                let ranges = blocks.iter().map(|block| map.law.range(*block));
                ranges.flat_map(|range| features[range].iter().copied()).collect()
            };
            for (at, row) in interpolated(map, (number, run), &kept, &pick)? {
                places.push([number, at]);
                rows.push(row);
            }
        }
        if rows.len() < 2 * BLOCKS {
            return Err(TrainingError::TooFew {
                found: rows.len(),
                needed: 2 * BLOCKS,
            });
        }
        Ok(Self::standardised(&map.law, blocks, rows, places))
    }

    fn standardised(
        law: &FeatureLaw,
        blocks: &[Block],
        mut rows: Vec<Vec<f64>>,
        places: Vec<[usize; 2]>,
    ) -> Self {
        let mut ranges = Vec::new();
        let mut whitenings = Vec::new();
        let mut start = 0;
        for block in blocks {
            let raw = law.count(*block);
            let mut range = start..start + raw;
            if matches!(block, Block::Broad | Block::Sharp) {
                let root = whitening(law, *block);
                let columns = root.ncols();
                let kernels = Mat::from_fn(rows.len(), raw, |i, j| rows[i][start + j]);
                let white = kernels * &root;
                for (i, row) in rows.iter_mut().enumerate() {
                    row.splice(range.clone(), (0..columns).map(|j| white[(i, j)]));
                }
                range = start..start + columns;
                whitenings.push((*block, root));
            }
            start = range.end;
            ranges.push((*block, range));
        }
        let count = rows.len() as f64;
        let mut mean = vec![0.0; start];
        let mut deviation = vec![0.0; start];
        for row in &rows {
            for (sum, value) in mean.iter_mut().zip(row) {
                *sum += value / count;
            }
        }
        for row in &rows {
            for ((sum, value), mean) in deviation.iter_mut().zip(row).zip(&mean) {
                *sum += (value - mean).powi(2) / count;
            }
        }
        // Features of one kind keep their sizes to each other where these say how smooth a map is.
        let mut scale = vec![1.0; start];
        for (block, range) in &ranges {
            let own = deviation[range.clone()].iter().map(|v| v.sqrt());
            let most = own.clone().fold(0.0, f64::max) + f64::MIN_POSITIVE;
            let own: Vec<f64> = match block {
                Block::Broad | Block::Sharp => vec![most; range.len()],
                Block::Channels => own.map(|v| v.max(ROUNDING * most) / 3.0).collect(),
                _ => own.map(|v| v.max(ROUNDING * most)).collect(),
            };
            scale[range.clone()].copy_from_slice(&own);
        }
        let groups = groups(&places);
        let mut of_groups = Vec::new();
        for group in &groups {
            of_groups.push(Mat::from_fn(group.len(), start, |i, j| {
                (rows[group[i]][j] - mean[j]) / scale[j]
            }));
        }
        Self {
            blocks: blocks.to_vec(),
            places: groups.iter().map(|group| group.iter().map(|at| places[*at]).collect()).collect(),
            rows: of_groups,
            mean,
            scale,
            whitenings,
            ranges,
        }
    }

    fn columns(&self, blocks: &[Block]) -> Vec<usize> {
        let own = self.ranges.iter().filter(|(block, _)| blocks.contains(block));
        own.flat_map(|(_, range)| range.clone()).collect()
    }

    /// Readings of each group, less their mean over all of it; and the mean.
    fn targets(&self, readings: &[Vec<[f64; 2]>]) -> (Vec<Vec<f64>>, f64) {
        let of = |group: &Vec<[usize; 2]>| -> Vec<f64> {
            group.iter().map(|[run, at]| readings[*run][*at][1]).collect()
        };
        let mut targets: Vec<Vec<f64>> = self.places.iter().map(of).collect();
        let count: usize = targets.iter().map(Vec::len).sum();
        let mean = targets.iter().flatten().sum::<f64>() / count.max(1) as f64;
        targets.iter_mut().flatten().for_each(|value| *value -= mean);
        (targets, mean)
    }

    /// The mixture of the maps that predicts held-out groups best, with its deviations there, and the maps.
    fn mixed(
        &self,
        law: &FeatureLaw,
        readings: &[Vec<[f64; 2]>],
    ) -> Result<(MixedMap, Vec<Candidate>), TrainingError> {
        let (targets, mean) = self.targets(readings);
        let solver = Solver::of(self, &targets);
        let fitted: Vec<Fitted> = CANDIDATES
            .par_iter()
            .map(|blocks| solver.fitted(self.columns(blocks), None))
            .collect::<Result<_, _>>()?;
        let truth: Vec<f64> = targets.iter().flatten().copied().collect();
        let held_out: Vec<Vec<f64>> = fitted
            .iter()
            .map(|one| one.held_out.iter().flatten().copied().collect())
            .collect();
        let shares = simplex(&held_out, &truth);
        let rows = 0..truth.len();
        let estimates: Vec<f64> = rows
            .clone()
            .map(|row| held_out.iter().zip(&shares).map(|(own, share)| own[row] * share).sum())
            .collect();
        let differences: Vec<f64> = rows
            .clone()
            .map(|row| {
                let count = held_out.len() as f64;
                let mean = held_out.iter().map(|own| own[row]).sum::<f64>() / count;
                let square = held_out.iter().map(|own| (own[row] - mean).powi(2)).sum::<f64>();
                (square / count).sqrt()
            })
            .collect();
        let mut found = HeldOut::default();
        for row in rows {
            let reading = [0.0, truth[row] + mean];
            found.push(0, reading, [estimates[row] + mean, differences[row]], 0.0);
        }
        let range = [
            truth.iter().copied().fold(f64::INFINITY, f64::min) + mean,
            truth.iter().copied().fold(f64::NEG_INFINITY, f64::max) + mean,
        ];
        let members = CANDIDATES.iter().zip(&fitted).zip(&shares);
        let members = members.map(|((blocks, one), share)| MemberMap {
            share: *share,
            ..self.member(law, blocks, one, mean)
        });
        let candidates = CANDIDATES.iter().zip(&fitted).zip(&shares);
        let candidates = candidates.map(|((blocks, one), share)| Candidate {
            blocks: blocks.to_vec(),
            prior: one.prior,
            error: one.error.sqrt(),
            share: *share,
        });
        let mixed = MixedMap {
            members: members.collect(),
            error: error_law(&found, &found.errors),
            between_runs: BetweenRuns::default(),
            range,
        };
        Ok((mixed, candidates.collect()))
    }

    /// A fitted map of the features as they come.
    fn member(&self, law: &FeatureLaw, blocks: &[Block], fitted: &Fitted, mean: f64) -> MemberMap {
        let columns = self.columns(blocks);
        let mut constant = mean;
        let mut by_column = vec![0.0; self.mean.len()];
        for (column, weight) in columns.iter().zip(&fitted.weights) {
            by_column[*column] = weight / self.scale[*column];
            constant -= by_column[*column] * self.mean[*column];
        }
        let mut weights = Vec::new();
        let mut own = Vec::new();
        // In the order of the features.
        for (block, range) in self.ranges.iter().filter(|(block, _)| blocks.contains(block)) {
            own.push(*block);
            let values = &by_column[range.clone()];
            match self.whitenings.iter().find(|(other, _)| other == block) {
                None => weights.extend_from_slice(values),
                Some((_, root)) => {
                    let white = Mat::from_fn(values.len(), 1, |i, _| values[i]);
                    let raw = root * white;
                    weights.extend((0..law.count(*block)).map(|i| raw[(i, 0)]));
                }
            }
        }
        MemberMap {
            share: 0.0,
            blocks: own,
            constant,
            weights,
        }
    }
}

/// Three: the prior of a kernel beside that of a channel.
const KERNEL_SCALE: f64 = 3.0;

/// Inverse root of the kernels of the centres with each other: with it the ridge is that of the kernels.
fn whitening(law: &FeatureLaw, block: Block) -> Mat<f64> {
    let count = law.centres.len();
    let kernels = Mat::from_fn(count, count, |i, j| law.kernel(block, &law.centres[i], &law.centres[j]));
    let Ok(decomposed) = kernels.self_adjoint_eigen(Side::Lower) else {
        return Mat::zeros(count, 0);
    };
    let (vectors, values) = (decomposed.U(), decomposed.S());
    // Less is rounding.
    let kept: Vec<usize> = (0..count).filter(|at| values[*at] > 1e-7 * values[count - 1]).collect();
    Mat::from_fn(count, kept.len(), |i, j| {
        KERNEL_SCALE * vectors[(i, kept[j])] / values[kept[j]].sqrt()
    })
}

/// Numbers of the rows of each group: those of each run, or blocks of the only one.
fn groups(places: &[[usize; 2]]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (at, [run, _]) in places.iter().enumerate() {
        match groups.last_mut() {
            Some(group) if places[group[0]][0] == *run => group.push(at),
            _ => groups.push(vec![at]),
        }
    }
    match &groups[..] {
        [one] => {
            let blocks = super::blocks_of_time(one.len(), BLOCKS);
            blocks.into_iter().map(|rows| one[rows].to_vec()).collect()
        }
        _ => groups,
    }
}

/// Features of frames at some times, on straight lines between those of the frames beside; farther than the
/// longest step from a frame there are none.
fn interpolated(
    map: &ForceMap,
    run: (usize, &Session),
    times: &[(usize, f64)],
    pick: &dyn Fn(&[f64]) -> Vec<f64>,
) -> Result<Vec<(usize, Vec<f64>)>, TrainingError> {
    let mut found = Vec::new();
    let mut next = times.iter().peekable();
    let mut before: Option<(f64, Vec<f64>)> = None;
    streamed(map, run, |time, stream| {
        let mut own = None;
        while let Some((at, wanted)) = next.next_if(|(_, wanted)| *wanted <= time) {
            let features = own.get_or_insert_with(|| pick(stream.features()));
            let row = match &before {
                Some((last, row)) => {
                    let near = (wanted - last).min(time - wanted) <= map.longest_step;
                    let share = (wanted - last) / (time - last);
                    let between = row.iter().zip(features.iter());
                    near.then(|| between.map(|(a, b)| a + share * (b - a)).collect())
                }
                None => (time - wanted <= map.longest_step).then(|| features.clone()),
            };
            found.extend(row.map(|row| (*at, row)));
        }
        if next.peek().is_some() {
            before = Some((time, own.unwrap_or_else(|| pick(stream.features()))));
        }
    })?;
    // After the last frame.
    if let Some((last, row)) = before {
        for (at, wanted) in next {
            if wanted - last <= map.longest_step {
                found.push((*at, row.clone()));
            }
        }
    }
    Ok(found)
}

/// Moments of the groups of a design with one target.
struct Solver<'a> {
    design: &'a Design,
    targets: &'a [Vec<f64>],
    grams: Vec<Mat<f64>>,
    moments: Vec<Mat<f64>>,
}

/// A fitted map.
struct Fitted {
    prior: f64,
    /// Mean square of the errors of the groups, each with the same weight.
    error: f64,
    /// Estimates of each group from the others.
    held_out: Vec<Vec<f64>>,
    weights: Vec<f64>,
}

impl<'a> Solver<'a> {
    fn of(design: &'a Design, targets: &'a [Vec<f64>]) -> Self {
        let column = |target: &Vec<f64>| Mat::from_fn(target.len(), 1, |i, _| target[i]);
        let rows = design.rows.iter().zip(targets);
        Self {
            design,
            targets,
            grams: design.rows.iter().map(|rows| rows.transpose() * rows).collect(),
            moments: rows.map(|(rows, target)| rows.transpose() * column(target)).collect(),
        }
    }

    /// The ridge over some columns with the prior that predicts groups best, or with `prior`.
    fn fitted(&self, columns: Vec<usize>, prior: Option<f64>) -> Result<Fitted, TrainingError> {
        let size = columns.len();
        let sub = |of: &Mat<f64>| Mat::from_fn(size, size, |i, j| of[(columns[i], columns[j])]);
        let part = |of: &Mat<f64>| Mat::from_fn(size, 1, |i, _| of[(columns[i], 0)]);
        let grams: Vec<Mat<f64>> = self.grams.iter().map(sub).collect();
        let moments: Vec<Mat<f64>> = self.moments.iter().map(part).collect();
        let zero = || (Mat::<f64>::zeros(size, size), Mat::<f64>::zeros(size, 1));
        let sum = |except: Option<usize>| {
            let parts = grams.iter().zip(&moments).enumerate();
            let parts = parts.filter(|(group, _)| Some(*group) != except);
            parts.fold(zero(), |(gram, moment), (_, (g, m))| (gram + g, moment + m))
        };
        let sums: Vec<(Mat<f64>, Mat<f64>)> = (0..grams.len()).map(|group| sum(Some(group))).collect();
        let solve = |(gram, moment): &(Mat<f64>, Mat<f64>), prior: f64| -> Result<Mat<f64>, TrainingError> {
            let mut matrix = gram.clone();
            for j in 0..size {
                matrix[(j, j)] += prior;
            }
            let factor = matrix
                .llt(Side::Lower)
                .map_err(|_| TrainingError::Dependent { features: size })?;
            Ok(factor.solve(moment))
        };
        let tried = |prior: f64| -> Result<Fitted, TrainingError> {
            let (mut error, mut held_out) = (0.0, Vec::new());
            for (group, sums) in sums.iter().enumerate() {
                let weights = solve(sums, prior)?;
                let rows = &self.design.rows[group];
                let mut all = Mat::<f64>::zeros(rows.ncols(), 1);
                for (i, column) in columns.iter().enumerate() {
                    all[(*column, 0)] = weights[(i, 0)];
                }
                let estimates = rows * all;
                let estimates: Vec<f64> = (0..rows.nrows()).map(|i| estimates[(i, 0)]).collect();
                let target = &self.targets[group];
                let squares = estimates.iter().zip(target).map(|(a, b)| (a - b) * (a - b));
                error += squares.sum::<f64>() / target.len().max(1) as f64 / sums_len(self.targets);
                held_out.push(estimates);
            }
            Ok(Fitted {
                prior,
                error,
                held_out,
                weights: Vec::new(),
            })
        };
        let mut best = match prior {
            Some(prior) => tried(prior)?,
            None => {
                let all = PRIORS.map(tried).into_iter().collect::<Result<Vec<_>, _>>()?;
                let best = least(all);
                let beside = [best.prior / NEIGHBOUR, best.prior * NEIGHBOUR].map(tried);
                let all = beside.into_iter().collect::<Result<Vec<_>, _>>()?;
                least(all.into_iter().chain([best]).collect())
            }
        };
        let weights = solve(&sum(None), best.prior)?;
        best.weights = (0..size).map(|i| weights[(i, 0)]).collect();
        Ok(best)
    }
}

fn sums_len(targets: &[Vec<f64>]) -> f64 {
    targets.len().max(1) as f64
}

fn least(all: Vec<Fitted>) -> Fitted {
    let least = all.into_iter().min_by(|a, b| a.error.total_cmp(&b.error));
    least.unwrap_or(Fitted {
        prior: 1.0,
        error: f64::INFINITY,
        held_out: Vec::new(),
        weights: Vec::new(),
    })
}

/// Shares, none below zero and one together, of the least mean square error of a mixture: steps of exact
/// length between two members.
fn simplex(members: &[Vec<f64>], truth: &[f64]) -> Vec<f64> {
    let count = members.len();
    let product = |i: usize, j: usize| {
        let rows = members[i].iter().zip(&members[j]).zip(truth);
        rows.map(|((a, b), y)| (a - y) * (b - y)).sum::<f64>()
    };
    let gram: Vec<Vec<f64>> = (0..count).map(|i| (0..count).map(|j| product(i, j)).collect()).collect();
    let mut shares = vec![0.0; count];
    let best = (0..count).min_by(|a, b| gram[*a][*a].total_cmp(&gram[*b][*b]));
    if let Some(best) = best {
        shares[best] = 1.0;
    }
    // Each step lessens the error; a hundred for each member are more than were ever needed.
    for _ in 0..100 * count {
        let slope = |i: usize| gram[i].iter().zip(&shares).map(|(g, s)| g * s).sum::<f64>();
        let slopes: Vec<f64> = (0..count).map(slope).collect();
        let low = (0..count).min_by(|a, b| slopes[*a].total_cmp(&slopes[*b]));
        let used = (0..count).filter(|i| shares[*i] > 0.0);
        let high = used.max_by(|a, b| slopes[*a].total_cmp(&slopes[*b]));
        let (Some(low), Some(high)) = (low, high) else { break };
        let curve = gram[low][low] + gram[high][high] - 2.0 * gram[low][high];
        let gain = slopes[high] - slopes[low];
        if curve <= 0.0 || gain <= 1e-9 * slopes[high].abs() {
            break;
        }
        let step = (gain / curve).min(shares[high]);
        shares[low] += step;
        shares[high] -= step;
    }
    shares
}

/// Weights that are not below zero of |error| as a sum of a constant, the size of the estimate and the
/// difference of the maps, of which 1.96 hold 95 % of `errors`; what live adds is taken off first.
pub(crate) fn error_law(found: &HeldOut, errors: &[f64]) -> ErrorLaw {
    let count = errors.len();
    let mean = |values: &[f64]| values.iter().map(|v| v.abs()).sum::<f64>() / values.len().max(1) as f64;
    let units = [1.0, mean(&found.estimates), mean(&found.differences)];
    let units = units.map(|unit| unit.max(f64::MIN_POSITIVE));
    let parts = |row: usize| {
        let own = [1.0, found.estimates[row].abs(), found.differences[row]];
        [0, 1, 2].map(|k| own[k] / units[k])
    };
    let own: Vec<f64> = (0..count)
        .map(|row| {
            let beside = super::NORMAL_95 * found.beside[row];
            (errors[row].powi(2) - beside * beside).max(0.0).sqrt()
        })
        .collect();
    let mut weights = [mean(&own) / 3.0; 3];
    // Multiplicative steps keep the signs; they have settled long before.
    for _ in 0..300 {
        let (mut up, mut down) = ([0.0; 3], [0.0; 3]);
        for (row, error) in own.iter().enumerate() {
            let parts = parts(row);
            let law: f64 = parts.iter().zip(&weights).map(|(p, w)| p * w).sum();
            for k in 0..3 {
                up[k] += parts[k] * error;
                down[k] += parts[k] * law;
            }
        }
        for k in 0..3 {
            weights[k] *= up[k] / down[k].max(f64::MIN_POSITIVE);
        }
    }
    let law = ErrorLaw {
        constant: weights[0] / units[0],
        of_size: weights[1] / units[1],
        of_difference: weights[2] / units[2],
    };
    let deviations: Vec<f64> = (0..count)
        .map(|row| law.at(found.estimates[row], found.differences[row]).max(f64::MIN_POSITIVE))
        .collect();
    law.times(interval_factor(&own, &deviations))
}

/// Errors of linear maps with memory of a few thousand readings, held out by groups: what a delay of the
/// scale, and its clock, are looked for with.
pub(crate) struct Quick<'a> {
    runs: &'a [Session],
    map: ForceMap,
    times: Vec<Vec<f64>>,
    readings: Vec<Vec<[f64; 2]>>,
}

impl<'a> Quick<'a> {
    /// Of all readings of runs.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub(crate) fn of(runs: &'a [Session]) -> Result<Self, TrainingError> {
        let (standard, law) = law_of(runs, None)?;
        let longest = runs.iter().map(|run| run.sensor.longest_step());
        let count: usize = runs.iter().filter_map(|run| run.force.as_ref()).map(|f| f.times().len()).sum();
        let step = count.div_ceil(DELAY_READINGS).max(1);
        let readings: Vec<Vec<[f64; 2]>> = runs
            .iter()
            .map(|run| {
                let rows = run.force.iter().flat_map(|f| f.times().iter().zip(f.rows()));
                rows.map(|(time, row)| [*time, row[0]]).step_by(step).collect()
            })
            .collect();
        let slow = (law.times.len() - 1) * law.components.min(16) + law.times.len() * SUMS;
        Ok(Self {
            runs,
            map: ForceMap {
                spread: vec![1.0; law.components],
                slow_reach: vec![0.0; law.times.len() - 1],
                farthest: f64::INFINITY,
                pressing: empty(),
                components: Vec::new(),
                standard,
                law: FeatureLaw {
                    slow_spread: vec![0.0; slow],
                    ..law
                },
                longest_step: longest.fold(0.0, f64::max),
                offset: 0.0,
            },
            times: readings.iter().map(|r| r.iter().map(|[time, _]| *time).collect()).collect(),
            readings,
        })
    }

    /// Mean square error over the variance of the readings, of a scale that comes `offset` s after the
    /// sensor, and the number of readings.
    pub(crate) fn error(&self, offset: f64, blocks: &[Block]) -> Result<(f64, usize), TrainingError> {
        let map = ForceMap {
            offset,
            ..self.map.clone()
        };
        let design = Design::of(&map, self.runs, &self.times, None, blocks)?;
        let (targets, _) = design.targets(&self.readings);
        let solver = Solver::of(&design, &targets);
        let fitted = solver.fitted(design.columns(&design.blocks), None)?;
        let count: usize = targets.iter().map(Vec::len).sum();
        let variance = targets.iter().flatten().map(|t| t * t).sum::<f64>() / count.max(1) as f64;
        Ok((fitted.error / variance.max(f64::MIN_POSITIVE), count))
    }

    /// Times, readings and errors of a map of the readings themselves, N.
    pub(crate) fn own_errors(&self, blocks: &[Block]) -> Result<Vec<[f64; 3]>, TrainingError> {
        let design = Design::of(&self.map, self.runs, &self.times, None, blocks)?;
        let (targets, _) = design.targets(&self.readings);
        let columns = design.columns(&design.blocks);
        let fitted = Solver::of(&design, &targets).fitted(columns.clone(), Some(1.0))?;
        let mut all = Mat::<f64>::zeros(design.mean.len(), 1);
        for (i, column) in columns.iter().enumerate() {
            all[(*column, 0)] = fitted.weights[i];
        }
        let mut found = Vec::new();
        for ((rows, places), target) in design.rows.iter().zip(&design.places).zip(&targets) {
            let estimates = rows * &all;
            for (i, [run, at]) in places.iter().enumerate() {
                let [time, reading] = self.readings[*run][*at];
                found.push([time, reading, estimates[(i, 0)] - target[i]]);
            }
        }
        Ok(found)
    }
}
