//! Training of how the channels of an empty body recover from contacts.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use taxel::trained::{Creep, Recovery, lately};

use super::Session;

/// The scale reads nothing below this share of its peak.
const NOTHING: f64 = 2e-3;
/// Deviations of a reading that are noise, no creep; and how many a channel must have shown
/// lately to say anything of it.
const NOISE: f64 = 3.0;
const SHOWN: f64 = 30.0;
/// Frames of a channel that its recovery is learned from at least.
const LEAST: usize = 50;
/// Strength of the prior of the weights, over the mean square of the slow means.
const PRIOR: f64 = 1e-3;
/// Share of the frames that the doubt covers, and how much more the next contacts may leave than
/// those of training: of several runs, each predicted from the others, and of a single one.
const COVERED: f64 = 0.99;
const MORE: [f64; 2] = [2.0, 4.0];

/// Number of slow means of a channel.
const MEANS: usize = Creep {
    weights: [0.0; 5],
    left: 0.0,
}
.weights
.len();

/// One frame of a channel of the empty body: slow means, and what it shows.
type Shown = ([f64; MEANS], f64);

/// How each channel recovers over `runs`; `deviation` is that of one reading of each. What the
/// weights leave is that of each run under the weights of the others.
pub(crate) fn trained_creep(runs: &[Session], deviation: &[f64]) -> Vec<Creep> {
    let frames: Vec<Vec<Vec<Shown>>> = runs.iter().map(|run| empty(run, deviation)).collect();
    let mut creep: Vec<Creep> = (0..deviation.len())
        .map(|channel| {
            let of = |run: &Vec<Vec<Shown>>| run[channel].clone();
            let own: Vec<Vec<Shown>> = frames.iter().map(of).collect();
            recovery(&own, deviation[channel])
        })
        .collect();
    // A body recovers as one: quiet channels, which show little of it, may err by as much.
    let known = creep.iter().map(|one| one.left).filter(|left| *left > 0.0);
    let mut left: Vec<f64> = known.collect();
    left.sort_by(f64::total_cmp);
    let usual = left.get(left.len() / 2).copied().unwrap_or(0.0);
    for one in &mut creep {
        one.left = one.left.max(usual);
    }
    creep
}

/// The frames of a run in which the scale reads nothing, channel by channel.
fn empty(run: &Session, deviation: &[f64]) -> Vec<Vec<Shown>> {
    let mut found = vec![Vec::new(); deviation.len()];
    let Some(force) = &run.force else {
        return found;
    };
    let (rest, nothing) = (run.baseline(), NOTHING * run.peak_force());
    let mut recovery = Recovery::at_rest(deviation.len());
    let mut last = None;
    for (time, row) in run.sensor.times().iter().zip(run.sensor.rows()) {
        let tared: Vec<f64> = row.iter().zip(&rest).map(|(x, b)| x - b).collect();
        recovery.push(time - last.unwrap_or(*time), tared.iter().copied());
        last = Some(*time);
        let pressed = force.at(*time, f64::INFINITY);
        if pressed.is_none_or(|force| force[0] > nothing) {
            continue;
        }
        let channels = tared.iter().zip(recovery.slow()).zip(deviation);
        for (found, ((tared, slow), noise)) in found.iter_mut().zip(channels) {
            if tared.is_finite() && lately(slow) > SHOWN * noise {
                found.push((*slow, *tared));
            }
        }
    }
    found
}

fn recovery(runs: &[Vec<Shown>], noise: f64) -> Creep {
    let all: Vec<Shown> = runs.iter().flatten().copied().collect();
    let creep = fitted(&all);
    let several = runs.iter().filter(|run| run.len() >= LEAST).count() > 1;
    let mut left: Vec<f64> = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let others = (0..runs.len()).filter(|other| *other != number);
        let others: Vec<Shown> = others.flat_map(|other| runs[other].clone()).collect();
        let other = if several { fitted(&others) } else { creep };
        left.extend(run.iter().map(|(slow, shown)| {
            let [expected, _] = other.expected(slow);
            ((shown - expected).abs() - NOISE * noise).max(0.0) / lately(slow)
        }));
    }
    left.sort_by(f64::total_cmp);
    let at = (COVERED * left.len() as f64) as usize;
    let most = left.get(at.min(left.len().saturating_sub(1)));
    let more = MORE[usize::from(!several)];
    Creep {
        left: most.map_or(0.0, |share| (more * share).min(1.0)),
        ..creep
    }
}

/// The weights of least squares with a prior; zero for few frames.
fn fitted(frames: &[Shown]) -> Creep {
    let mut creep = Creep::default();
    if frames.len() < LEAST {
        return creep;
    }
    let design = Mat::from_fn(frames.len(), MEANS, |i, j| frames[i].0[j]);
    let shown = Mat::from_fn(frames.len(), 1, |i, _| frames[i].1);
    let mut matrix = design.transpose() * &design;
    let trace: f64 = (0..MEANS).map(|k| matrix[(k, k)]).sum();
    for k in 0..MEANS {
        matrix[(k, k)] += PRIOR * trace / MEANS as f64;
    }
    if let Ok(factor) = matrix.llt(Side::Lower) {
        let solution = factor.solve(design.transpose() * &shown);
        for (k, weight) in creep.weights.iter_mut().enumerate() {
            *weight = solution[(k, 0)];
        }
    }
    creep
}
