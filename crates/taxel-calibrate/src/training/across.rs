//! Forces over runs: how much the next run differs from those that were seen.
//!
//! Within a run a body repeats itself; from run to run its rest and its
//! stiffness change. What a run shows of itself therefore says nothing of the
//! next one, and with several runs whole runs are held out, from all that is learned. The error of run r
//! under maps of the others is split into a_r + b_r F and a rest; the variances
//! of a and b join those of the rest.

use rayon::prelude::*;
use taxel::acquisition::Frame;
use taxel::estimation::{ArrayEstimator, Scale, Touch, TrainedArea, TrainedReader};
use taxel::trained::{
    BetweenRuns, Block, Component, ForceEstimator, ForceMap, MixedMap, Relation, RestStatistics,
    TrainedMaps, TrainingError,
};

use super::design::{Candidate, HeldOutReadings, error_law};
use super::fold::Fold;
use super::force::{LearnedForces, Quick, learn};
use super::next_run::{self, USUAL};
use super::{Series, Session, rest_of, trained_relation};

/// Frames of the rest capture at the start of a run, as live takes it.
pub(crate) const REST_FRAMES: usize = 50;

/// Errors within another run beside those of blocks of the only one: a guess, with which each of the
/// two public force runs holds 96 to 97 % of the other.
pub(crate) const WITHIN_ANOTHER: f64 = 1.5;

/// Error of a run that was held out, over its estimates.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Offset, N, and gain.
    values: [f64; 2],
    /// Variances that the rest of the errors gives them.
    noise: [f64; 2],
}

/// From the lines of the runs that were held out; `peak` is the largest force, N.
///
/// `trained` runs made the map whose next run this is about. Runs that vary by s² about their mean
/// lie s² (1 + 1/R) from the mean of R others. Each run that was held out lies R/(R − 1) as far from
/// the mean of the others as from that of all, so the lines of R runs have R − 1 degrees of
/// freedom. What they have in common is no difference between runs, and what the rest of the
/// errors gives them is none either. Student's factor is in the deviations: the quantile of a sum of
/// Student's t and the normal error within a run is within 3 % of the root of the sum of the squares
/// of both.
fn between_runs(lines: &[Line], peak: f64, trained: usize) -> BetweenRuns {
    let runs = lines.len().max(1);
    let share = next_run::share(runs);
    let deviation = |member: usize, usual: f64| {
        let mean = common(lines)[member];
        let squares = lines.iter().map(|line| {
            let apart = share * (line.values[member] - mean);
            apart * apart - share * line.noise[member]
        });
        next_run::deviation(usual * usual, squares.sum(), runs, trained)
    };
    BetweenRuns {
        offset: deviation(0, USUAL[1] * peak),
        gain: deviation(1, USUAL[0]),
        runs,
    }
}

/// Mean of the lines: what maps of fewer runs do to all of them alike.
fn common(lines: &[Line]) -> [f64; 2] {
    let count = lines.len().max(1) as f64;
    [0, 1].map(|member| lines.iter().map(|line| line.values[member]).sum::<f64>() / count)
}

/// Forces of runs with what was held out of each.
#[derive(Debug, Clone)]
pub struct TrainedForces {
    /// The maps of all runs.
    pub map: ForceMap,
    /// Of the pressing force, then of each component, what the maps mix.
    pub candidates: Vec<Vec<Candidate>>,
    /// Of each what was held out, with the deviations that are stated.
    pub held_out: Vec<HeldOutReadings>,
    /// Root mean square of the errors of the pressing force on the readings of training, replayed as live, N.
    pub replayed: f64,
}

/// All that live knows of a device beside its places.
struct Learned {
    rest: RestStatistics,
    relation: Option<Relation>,
    forces: LearnedForces,
}

impl Learned {
    fn of(
        runs: &[Session],
        except: Option<&Fold>,
        (offset, tared): (f64, bool),
    ) -> Result<Self, TrainingError> {
        // The rest of the only run is no secret of one of its blocks.
        let kept = |number: usize| except.is_none_or(|fold| fold.run != number || runs.len() == 1);
        let others = runs.iter().enumerate().filter(|(number, _)| kept(*number));
        let others: Vec<&Session> = others.map(|(_, run)| run).collect();
        Ok(Self {
            rest: rest_of(&others),
            relation: trained_relation(runs, except, tared)?,
            forces: learn(runs, except, offset)?,
        })
    }

    fn maps(&self) -> TrainedMaps {
        let map = &self.forces.map;
        TrainedMaps {
            channels: map.standard.channels,
            rest: Some(self.rest.clone()),
            position: None,
            place: None,
            force: Some(map.clone()),
            relation: self.relation.clone(),
        }
    }
}

/// Maps of the map that a report names: the pressing force, then the components.
pub(crate) fn maps_of(map: &ForceMap) -> Vec<(Option<Component>, &MixedMap)> {
    let others = map
        .components
        .iter()
        .map(|one| (Some(one.component), &one.map));
    std::iter::once((None, &map.pressing))
        .chain(others)
        .collect()
}

/// Trains the forces of runs that each begin without contact, of a scale that comes `offset` s after the
/// sensor, and holds out whole runs in turn, or blocks of the only one, from all that is learned: maps, priors,
/// relation and rest. What is held out is judged by the estimator that runs live.
///
/// # Errors
/// [`TrainingError`].
pub fn train_forces(
    runs: &[Session],
    offset: f64,
    tared: bool,
) -> Result<TrainedForces, TrainingError> {
    let about = (offset, tared);
    let mut all = Learned::of(runs, None, about)?;
    let parts: Vec<Vec<HeldOutReadings>> = Fold::all(runs)
        .par_iter()
        .map(|fold| {
            let learned = Learned::of(runs, Some(fold), about)?;
            judged(runs, fold, &learned, maps_of(&all.forces.map).len())
        })
        .collect::<Result<_, TrainingError>>()?;
    let mut held_out: Vec<HeldOutReadings> = Vec::new();
    for part in parts {
        held_out.resize_with(part.len(), HeldOutReadings::default);
        for (all, own) in held_out.iter_mut().zip(part) {
            all.append(own);
        }
    }
    let map = &mut all.forces.map;
    let maps = std::iter::once(&mut map.pressing);
    let maps = maps.chain(map.components.iter_mut().map(|one| &mut one.map));
    for (map, held_out) in maps.zip(&mut held_out) {
        widen(map, held_out, runs.len());
    }
    // Live follows drift by the deviations that the maps now have.
    let replayed = replayed_error(runs, &all)?;
    let LearnedForces { map, candidates } = all.forces;
    Ok(TrainedForces {
        map,
        candidates,
        held_out,
        replayed,
    })
}

/// Gives a map the deviations that held-out readings ask for, and these their own.
fn widen(map: &mut MixedMap, held_out: &mut HeldOutReadings, runs: usize) {
    let (lines, rest) = if runs > 1 {
        split(held_out, runs)
    } else {
        (Vec::new(), held_out.errors.clone())
    };
    map.error = error_law(held_out, &rest);
    let peak = map.range[1].max(-map.range[0]);
    if runs > 1 {
        map.between_runs = between_runs(&lines, peak, runs - 1);
    }
    for row in 0..held_out.errors.len() {
        let own = map.deviation(held_out.estimates[row], held_out.differences[row]);
        held_out.deviations[row] = own.hypot(held_out.beside[row]);
    }
    map.between_runs = between_runs(&lines, peak, runs);
    if runs == 1 {
        map.error = map.error.times(WITHIN_ANOTHER);
    }
}

/// Estimates of what a fold has, by maps that were learned without it: of the pressing force, then of each of
/// the components, of which there are `count` together.
fn judged(
    runs: &[Session],
    fold: &Fold,
    learned: &Learned,
    count: usize,
) -> Result<Vec<HeldOutReadings>, TrainingError> {
    let run = &runs[fold.run];
    let map = &learned.forces.map;
    let maps = maps_of(map);
    let components: Vec<Option<Component>> = maps.iter().map(|(component, _)| *component).collect();
    let touches = replayed(learned.maps(), &run.sensor, |touch| {
        components
            .iter()
            .flat_map(|component| of_touch(*component, touch))
            .collect()
    })?;
    // The maps alone, for what their members differ by.
    let mut alone = ForceEstimator::new(map.clone(), run.baseline())?;
    let frames = run.sensor.times().iter().zip(run.sensor.rows());
    let differences: Vec<Vec<f64>> = frames
        .map(|(time, frame)| match alone.push(*time, frame) {
            Ok(_) => alone.differences().collect(),
            Err(_) => vec![f64::NAN; maps.len()],
        })
        .collect();
    let rows = touches.into_iter().zip(differences);
    let rows: Vec<Vec<f64>> = rows
        .map(|(touch, differences)| [touch, differences].concat())
        .collect();
    let estimates =
        Series::new(run.sensor.times().to_vec(), rows).ok_or(TrainingError::TooFew {
            found: 0,
            needed: 2,
        })?;
    let mut found = vec![HeldOutReadings::default(); count];
    for (number, (component, own)) in maps.iter().enumerate() {
        let readings = match component {
            None => run.force.as_ref(),
            Some(wanted) => {
                let mut components = run.components.iter();
                components
                    .find(|(other, _)| other == wanted)
                    .map(|(_, series)| series)
            }
        };
        let rows = readings
            .iter()
            .flat_map(|series| series.times().iter().zip(series.rows()));
        for (time, reading) in rows.filter(|(time, _)| fold.has(fold.run, **time)) {
            let Some(row) = estimates.at(time - map.offset, map.longest_step) else {
                continue;
            };
            let [value, deviation] = [row[2 * number], row[2 * number + 1]];
            let difference = row[2 * maps.len() + number];
            if value.is_finite() && difference.is_finite() {
                // Before its zero is known live states no deviation, and nothing is beside that of the map.
                let stated = own.deviation(value, difference);
                let beside = (deviation * deviation - stated * stated).max(0.0).sqrt();
                found[number].push(fold.run, [*time, reading[0]], [value, difference], beside);
            }
        }
    }
    Ok(found)
}

/// Error of the pressing force on the readings of training after the rest capture, N rms.
fn replayed_error(runs: &[Session], learned: &Learned) -> Result<f64, TrainingError> {
    let map = &learned.forces.map;
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for run in runs {
        let rows = replayed(learned.maps(), &run.sensor, |touch| {
            of_touch(None, touch).to_vec()
        })?;
        let times = run.sensor.times();
        let Some(estimates) = Series::new(times.to_vec(), rows) else {
            continue;
        };
        // Before the end of its rest capture live says no force.
        let known = times.get(REST_FRAMES).copied().unwrap_or(f64::NEG_INFINITY);
        let readings = run
            .force
            .iter()
            .flat_map(|f| f.times().iter().zip(f.rows()));
        for (time, reading) in readings.filter(|(time, _)| **time - map.offset >= known) {
            let estimate = estimates.at(time - map.offset, map.longest_step);
            let error = estimate.map_or(f64::NAN, |estimate| estimate[0] - reading[0]);
            if error.is_finite() {
                sum += error * error;
                count += 1.0;
            }
        }
    }
    Ok((sum / count.max(1.0)).sqrt())
}

/// What `of` takes of every touch of a run, as `taxel live` and `taxel estimate` give it: with their rest
/// capture, baseline and health of channels.
fn replayed(
    maps: TrainedMaps,
    sensor: &Series,
    of: impl Fn(&Touch) -> Vec<f64>,
) -> Result<Vec<Vec<f64>>, TrainingError> {
    let area = TrainedArea {
        rows: 1,
        columns: 1,
        pitch: [1.0; 2],
    };
    let names = (1..=maps.channels).map(|number| number.to_string());
    let reading = Scale::new("reading", "counts", 1.0);
    let reader = TrainedReader::new(maps, area, names.collect(), reading, 1.0)?;
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    estimator.begin_unasked_rest_capture(REST_FRAMES);
    let start = sensor.times().first().copied().unwrap_or(0.0);
    let frames = (0..).zip(sensor.times()).zip(sensor.rows());
    let mut width = 0;
    let mut found = Vec::new();
    for ((sequence, time), values) in frames {
        let frame = Frame {
            sequence,
            time_ns: ((time - start) * 1e9).round() as u64,
            values: values.clone(),
            ..Frame::default()
        };
        // Every frame of a recording has as many channels.
        let own = estimator
            .push(&frame)
            .map(|(touch, _)| of(touch))
            .unwrap_or_default();
        width = width.max(own.len());
        found.push(own);
    }
    for row in &mut found {
        row.resize(width, f64::NAN);
    }
    Ok(found)
}

/// The pressing force of a touch, or a component, with its standard deviation, SI.
fn of_touch(component: Option<Component>, touch: &Touch) -> [f64; 2] {
    let force = |axis: usize| {
        let variance = touch.total_covariance[axis][axis];
        [touch.total.force[axis], variance.sqrt()]
    };
    let moment = |axis: usize| [touch.total.moment[axis], touch.moment_deviation[axis]];
    match component {
        None => touch.pressing_force().unwrap_or([f64::NAN; 2]),
        Some(Component::ForceX) => force(0),
        Some(Component::ForceY) => force(1),
        Some(Component::MomentX) => moment(0),
        Some(Component::MomentY) => moment(1),
        Some(Component::MomentZ) => moment(2),
    }
}

/// Another time between scale and sensor than none must leave less than this share of the mean
/// square error: a map with memory makes up for a scale that is a little late, and its force is
/// then what the scale shows at the time of the frame.
const CLEARLY_LATE: f64 = 0.7;
/// Features, and priors of their memory for each reading, with all of which a delay must show: channels alone leave
/// what creeps to the delay, and the weaker its prior the more a memory makes up for one.
const SHOWN_BY: [(&[Block], f64); 5] = [
    (&[Block::Channels], 0.0),
    (&WITH_MEMORY, 1.0),
    (&WITH_MEMORY, 0.1),
    (&WITH_MEMORY, 0.01),
    (&WITH_MEMORY, 0.001),
];
const WITH_MEMORY: [Block; 4] = [Block::Channels, Block::Sums, Block::SlowSums, Block::Slow];
/// Step of the times that are tried, s.
const DELAY_STEP: f64 = 0.1;

/// By how much the scale comes after the sensor, s: none, unless with all features and priors a time from −0.5 s to
/// 1.5 s leaves clearly less error, and less by more than half a step of these times changes the readings; then the
/// time that has the least of these errors.
///
/// # Errors
/// [`TrainingError`].
pub fn delay_of_scale(runs: &[Session]) -> Result<f64, TrainingError> {
    let quick = Quick::of(runs)?;
    let seen = quick.change_within(0.5 * DELAY_STEP);
    let tried: Vec<(f64, Vec<f64>)> = (-5..=15)
        .into_par_iter()
        .map(|steps| {
            let offset = DELAY_STEP * f64::from(steps);
            Ok((offset, quick.errors(offset, &SHOWN_BY)?.0))
        })
        .collect::<Result<_, TrainingError>>()?;
    let mut best = (f64::INFINITY, 0.0);
    for setting in 0..SHOWN_BY.len() {
        let prompt = tried.iter().find(|(offset, _)| *offset == 0.0);
        let prompt = prompt.map_or(0.0, |(_, errors)| errors[setting]);
        let own = tried
            .iter()
            .map(|(offset, errors)| (errors[setting], *offset));
        let least = own.min_by(|a, b| a.0.total_cmp(&b.0));
        match least.filter(|(least, _)| *least < CLEARLY_LATE * prompt && prompt - least > seen) {
            Some(least) if least.0 < best.0 => best = least,
            Some(_) => {}
            None => return Ok(0.0),
        }
    }
    Ok(best.1)
}

/// Lines through the errors of each run, and what is left of the errors without what the lines of
/// the runs differ by.
fn split(held_out: &HeldOutReadings, runs: usize) -> (Vec<Line>, Vec<f64>) {
    let lines: Vec<Line> = (0..runs)
        .map(|run| {
            let rows = || (0..held_out.runs.len()).filter(|i| held_out.runs[*i] == run);
            straight_line(rows().map(|i| [held_out.estimates[i], held_out.errors[i]]))
        })
        .collect();
    let common = common(&lines);
    let left = (0..held_out.runs.len()).map(|i| {
        let [offset, gain] = lines[held_out.runs[i]].values;
        held_out.errors[i] - (offset - common[0]) - (gain - common[1]) * held_out.estimates[i]
    });
    let left = left.collect();
    (lines, left)
}

/// The straight line of least squares through points x, y.
fn straight_line(points: impl Iterator<Item = [f64; 2]> + Clone) -> Line {
    let count = points.clone().count().max(1) as f64;
    let mean = |axis: usize| points.clone().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let xx: f64 = points.clone().map(|point| (point[0] - x).powi(2)).sum();
    let xy: f64 = points
        .clone()
        .map(|point| (point[0] - x) * (point[1] - y))
        .sum();
    let per_xx = if xx > 0.0 { 1.0 / xx } else { 0.0 };
    let slope = xy * per_xx;
    let rest: f64 = points
        .map(|point| (point[1] - y - slope * (point[0] - x)).powi(2))
        .sum();
    let variance = rest / (count - 2.0).max(1.0);
    Line {
        values: [y - slope * x, slope],
        noise: [variance * (1.0 / count + x * x * per_xx), variance * per_xx],
    }
}

#[cfg(test)]
mod tests {
    use super::super::NORMAL_95;
    use super::super::next_run::of_mean;
    use super::*;
    use taxel_numerics::Noise;
    use taxel_numerics::least_squares::student_quantile;

    /// Two runs give the interval of a third where gains differ as is usual; where
    /// they differ more, what is usual is not quite forgotten.
    #[test]
    fn two_runs_cover_the_gain_of_a_third() {
        let mut noise = Noise::seeded(1);
        for (scatter, expected) in [(0.005, 1.0), (0.01, 0.970), (0.015, 0.904), (0.02, 0.851)] {
            let trials = 20_000;
            let covered = (0..trials).filter(|_| {
                let [one, two, third] = [(); 3].map(|()| scatter * noise.normal());
                let deviation = between_runs(&[gain(one - two), gain(two - one)], 0.0, 2);
                (third - 0.5 * (one + two)).abs() < NORMAL_95 * deviation.gain
            });
            let share = covered.count() as f64 / f64::from(trials);
            // Three deviations of the count of 20 000.
            assert!((share - expected).abs() < 0.008, "{scatter}: {share}");
        }
    }

    /// Over all scatters that are expected, two runs hold 95 % of the gains of a third. Six
    /// components of one body have one stiffness: counted as six differences they would hold 86 %.
    #[test]
    fn over_the_expected_scatter_two_runs_hold_a_third() {
        let mut noise = Noise::seeded(2);
        let trials = 20_000;
        let (mut own, mut pooled) = (0, 0);
        for _ in 0..trials {
            let scatter = USUAL[0] / noise.normal().hypot(noise.normal());
            let [one, two, third] = [(); 3].map(|()| scatter * noise.normal());
            let error = (third - 0.5 * (one + two)).abs();
            let found = between_runs(&[gain(one - two), gain(two - one)], 0.0, 2);
            own += u32::from(error < NORMAL_95 * found.gain);
            let square = 0.5 * (one - two).powi(2);
            let variance = (USUAL[0].powi(2) + 6.0 * square) / 8.0;
            let reach = student_quantile(0.975, 8.0) * (of_mean(2) * variance).sqrt();
            pooled += u32::from(error < reach);
        }
        for (held, expected) in [(own, 0.950), (pooled, 0.863)] {
            let share = f64::from(held) / f64::from(trials);
            // Three deviations of the count.
            assert!((share - expected).abs() < 0.008, "{expected}: {share}");
        }
    }

    fn gain(gain: f64) -> Line {
        Line {
            values: [0.0, gain],
            noise: [0.0; 2],
        }
    }

    /// What all runs have in common, and what noise makes of alike runs, is no difference.
    #[test]
    fn only_differences_of_runs_are_between_runs() {
        let alike = between_runs(&[gain(0.0), gain(0.0)], 0.0, 2);
        let common = between_runs(&[gain(-0.05), gain(-0.05)], 0.0, 2);
        assert_eq!(alike, common);
        let mut noisy = [gain(0.01), gain(-0.01)];
        for line in &mut noisy {
            line.noise[1] = 2e-4;
        }
        assert_eq!(alike, between_runs(&noisy, 0.0, 2));
    }
}
