//! Training of the maps from channels to forces: what predicts runs that were not seen decides.
//!
//! Each of a few maps from simple to rich is a ridge over blocks of features, with the prior that predicts
//! held-out groups of readings best; the shares of the maps are those of the convex mixture that does. Groups
//! are whole runs, or blocks of the only one. Settling scales, directions and centres takes readings alone.

use faer::Mat;
use taxel::trained::{
    BetweenRuns, Block, Component, ComponentMap, ErrorLaw, FeatureStream, ForceMap, MixedMap, SLOW,
    SUMS, TrainingError,
};

use super::Session;
use super::design::{Candidate, Design, Form, Mixture, Solver, error_law};
use super::fold::Fold;
use super::law::{apart, law_of};

/// Readings that a map learns from at most: more teach little, and time and memory grow with them.
const MOST_READINGS: usize = 12_000;
/// A distance this much above the largest of training is outside; the next run of a body of which one run
/// is known is farther, as in the relation of its channels.
pub(super) const MARGIN: f64 = 2.0;
/// Delays that are looked for, s.
pub(super) const LONGEST_DELAY: f64 = 1.5;
/// Readings that the delay of a scale is looked for with.
pub(crate) const DELAY_READINGS: usize = 3000;

/// The maps that are mixed, from simple to rich.
const FORMS: [Form; 9] = [
    (0, &[Block::Channels]),
    (0, &[Block::Sums, Block::SlowSums]),
    (0, &[Block::Channels, Block::Sums, Block::SlowSums]),
    (0, &[Block::Channels, Block::Slow, Block::SlowSums]),
    (0, &[Block::Channels, Block::Broad]),
    (0, &[Block::Channels, Block::Slow, Block::Broad]),
    (
        0,
        &[
            Block::Channels,
            Block::Powers,
            Block::Sums,
            Block::Slow,
            Block::SlowSums,
        ],
    ),
    (
        0,
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
    ),
    (
        0,
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
    ),
];

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
        all.filter(|target| {
            target.component.is_none() || target.readings.iter().any(|r| !r.is_empty())
        })
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
            let design = design_of(&map, runs, &times(target), except, &Block::ALL)?;
            designs.push((number, design));
        }
        let Some((_, design)) = designs.iter().find(same) else {
            continue;
        };
        let Mixture {
            members,
            candidates: tried,
            held_out,
            range,
            ..
        } = design.mixed(&FORMS, &target.readings, None)?;
        candidates.push(tried);
        let mixed = MixedMap {
            members,
            error: error_law(&held_out, &held_out.errors),
            between_runs: BetweenRuns::default(),
            range,
        };
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

/// How far frames of training go: the spread of the memory and the largest of it, and how far the frames of a run
/// are from those of the others at most, or of the only run from its centres.
fn reach(map: &mut ForceMap, runs: &[Session], except: Option<&Fold>) -> Result<(), TrainingError> {
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
            for (reach, size) in slow_reach.iter_mut().zip(stream.slow_sizes()) {
                *reach = reach.max(size);
            }
            all.push((run.0, stream.components().to_vec()));
        })?;
    }
    map.slow_reach = slow_reach;
    let root = |sum: f64| (sum / frames.max(1.0)).sqrt();
    map.law.slow_spread = slow.into_iter().map(root).collect();
    // A centre is a frame of its run.
    let centres = &map.law.centres;
    let mut runs_of = vec![usize::MAX; centres.len()];
    for (run, row) in &all {
        let own = centres
            .iter()
            .zip(&mut runs_of)
            .filter(|(centre, _)| *centre == row);
        own.for_each(|(_, of)| *of = *run);
    }
    let several = runs.len() > 1;
    let mut farthest = 0.0_f64;
    for (run, row) in &all {
        let others = centres
            .iter()
            .zip(&runs_of)
            .filter(|(_, of)| !several || *of != run);
        let nearest = others
            .map(|(centre, _)| apart(centre, row))
            .fold(f64::INFINITY, f64::min);
        farthest = if nearest.is_finite() {
            farthest.max(nearest)
        } else {
            farthest
        };
    }
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

/// Features of some blocks at the times of readings, without those that are left out.
fn design_of(
    map: &ForceMap,
    runs: &[Session],
    times: &[Vec<f64>],
    except: Option<&Fold>,
    blocks: &[Block],
) -> Result<Design, TrainingError> {
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
            ranges
                .flat_map(|range| features[range].iter().copied())
                .collect()
        };
        let mut stream = FeatureStream::new(&map.law, run.baseline(), map.longest_step);
        let found = interpolated(run, map.longest_step, &kept, |time, frame| {
            stream.push((&map.standard, &map.law), time, frame).ok()?;
            Some(stream.features().to_vec())
        });
        for (at, row) in found {
            places.push([number, at]);
            rows.push(pick(&row));
        }
    }
    Design::of(&[(&map.law, blocks)], rows, &places)
}

/// What `of` makes of the frames of a run at some times, on straight lines between those of the frames beside;
/// farther than the longest step from a frame there is nothing. A frame of which `of` makes nothing is none.
pub(super) fn interpolated(
    run: &Session,
    longest_step: f64,
    times: &[(usize, f64)],
    mut of: impl FnMut(f64, &[f64]) -> Option<Vec<f64>>,
) -> Vec<(usize, Vec<f64>)> {
    let mut found = Vec::new();
    let mut next = times.iter().peekable();
    let mut before: Option<(f64, Vec<f64>)> = None;
    for (time, frame) in run.sensor.times().iter().zip(run.sensor.rows()) {
        let Some(own) = of(*time, frame) else {
            continue;
        };
        while let Some((at, wanted)) = next.next_if(|(_, wanted)| wanted <= time) {
            let row = match &before {
                Some((last, row)) => {
                    let near = (wanted - last).min(time - wanted) <= longest_step;
                    let share = (wanted - last) / (time - last);
                    let between = row.iter().zip(&own);
                    near.then(|| between.map(|(a, b)| a + share * (b - a)).collect())
                }
                None => (time - wanted <= longest_step).then(|| own.clone()),
            };
            found.extend(row.map(|row| (*at, row)));
        }
        before = Some((*time, own));
    }
    // After the last frame.
    if let Some((last, row)) = before {
        for (at, wanted) in next {
            if wanted - last <= longest_step {
                found.push((*at, row.clone()));
            }
        }
    }
    found
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
        let (standard, mut law) = law_of(runs, None)?;
        // Kernels are not among its features.
        law.centres.clear();
        // A memory shorter than the delays that are looked for makes up for them.
        law.times.retain(|time| *time > LONGEST_DELAY);
        law.times.insert(0, LONGEST_DELAY);
        law.slow_spread =
            vec![0.0; (law.times.len() - 1) * law.components.min(SLOW) + law.times.len() * SUMS];
        let longest = runs.iter().map(|run| run.sensor.longest_step());
        let count: usize = runs
            .iter()
            .filter_map(|run| run.force.as_ref())
            .map(|f| f.times().len())
            .sum();
        let step = count.div_ceil(DELAY_READINGS).max(1);
        let readings: Vec<Vec<[f64; 2]>> = runs
            .iter()
            .map(|run| {
                let rows = run
                    .force
                    .iter()
                    .flat_map(|f| f.times().iter().zip(f.rows()));
                rows.map(|(time, row)| [*time, row[0]])
                    .step_by(step)
                    .collect()
            })
            .collect();
        Ok(Self {
            runs,
            map: ForceMap {
                slow_reach: vec![0.0; law.times.len() - 1],
                farthest: f64::INFINITY,
                pressing: empty(),
                components: Vec::new(),
                standard,
                law,
                longest_step: longest.fold(0.0, f64::max),
                offset: 0.0,
            },
            times: readings
                .iter()
                .map(|r| r.iter().map(|[time, _]| *time).collect())
                .collect(),
            readings,
        })
    }

    /// Mean square errors over the variance of the readings, of a scale that comes `offset` s after the sensor, of
    /// maps of some features with a prior of their memory for each reading; and the number of readings.
    pub(crate) fn errors(
        &self,
        offset: f64,
        settings: &[(&[Block], f64)],
    ) -> Result<(Vec<f64>, usize), TrainingError> {
        let map = ForceMap {
            offset,
            ..self.map.clone()
        };
        let all = settings.iter().max_by_key(|(blocks, _)| blocks.len());
        let all = all.map_or(&[][..], |(blocks, _)| *blocks);
        let design = design_of(&map, self.runs, &self.times, None, all)?;
        let (targets, _) = design.targets(&self.readings);
        let solver = Solver::of(&design, &targets);
        let count: usize = targets.iter().map(Vec::len).sum();
        let variance = targets.iter().flatten().map(|t| t * t).sum::<f64>() / count.max(1) as f64;
        let error = |(blocks, memory): &(&[Block], f64)| {
            let columns = design.columns((0, blocks));
            let fitted = solver.fitted(&columns, None, memory * count as f64)?;
            Ok(fitted.error / variance.max(f64::MIN_POSITIVE))
        };
        let errors = settings
            .iter()
            .map(error)
            .collect::<Result<_, TrainingError>>()?;
        Ok((errors, count))
    }

    /// Mean square of the change of the readings within `time`, s, over their variance.
    pub(crate) fn change_within(&self, time: f64) -> f64 {
        let (mut changes, mut count) = (0.0, 0.0_f64);
        let all: Vec<f64> = self
            .readings
            .iter()
            .flatten()
            .map(|[_, force]| *force)
            .collect();
        for pair in self.readings.iter().flat_map(|run| run.windows(2)) {
            let slope = (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]);
            changes += (slope * time).powi(2);
            count += 1.0;
        }
        let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
        let variance =
            all.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / all.len().max(1) as f64;
        changes / count.max(1.0) / variance.max(f64::MIN_POSITIVE)
    }

    /// Times, readings and errors of a map of the readings themselves, N.
    pub(crate) fn own_errors(&self, blocks: &[Block]) -> Result<Vec<[f64; 3]>, TrainingError> {
        let design = design_of(&self.map, self.runs, &self.times, None, blocks)?;
        let (targets, _) = design.targets(&self.readings);
        let fitted = Solver::of(&design, &targets).fitted(&design.all(), Some(1.0), 0.0)?;
        let weights = Mat::from_fn(fitted.weights.len(), 1, |i, _| fitted.weights[i]);
        let mut found = Vec::new();
        for ((rows, places), target) in design.rows.iter().zip(&design.places).zip(&targets) {
            let estimates = rows * &weights;
            for (i, [run, at]) in places.iter().enumerate() {
                let [time, reading] = self.readings[*run][*at];
                found.push([time, reading, estimates[(i, 0)] - target[i]]);
            }
        }
        Ok(found)
    }
}
