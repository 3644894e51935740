//! Force over runs: how much the next run differs from those that were seen.
//!
//! Within a run a body repeats itself; from run to run its rest and its
//! stiffness change. What a run shows of itself therefore says nothing of the
//! next one, and with several runs whole runs are held out. The error of run r
//! under a map of the others is split into a_r + b_r F and a rest; the variances
//! of a and b join those of the rest.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    ForceMap, ForceOptions, HeldOutForce, Intervals, MemoryLaw, Polynomial, Score, Session,
    TrainingError,
};

/// How the force of one run differs from that of others under one map.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BetweenRuns {
    /// Deviation of an offset, N.
    pub offset: f64,
    /// Relative deviation of the gain.
    pub gain: f64,
    /// Runs that told both; with one they are the usual ones of soft bodies.
    pub runs: usize,
}

/// What is known before any run is held out: deviation of the gain, and that
/// of the offset over the largest force. The public recordings of a printed
/// lattice, one run under the map of the other, have gains of 1 to 4 % and
/// offsets of 0 to 1 N of 32 N.
const USUAL: [f64; 2] = [0.04, 0.01];
/// As many runs as this knowledge counts for.
const USUAL_RUNS: f64 = 4.0;
/// t of 4 to 9 degrees of freedom that 95 % lie within, over that of the normal law.
const STUDENT: [f64; 6] = [1.417, 1.312, 1.249, 1.206, 1.177, 1.154];

impl BetweenRuns {
    /// From offset and gain of each run that was held out; `peak` is the
    /// largest force, N.
    fn of(lines: &[[f64; 2]], peak: f64) -> Self {
        let variance = |member: usize, usual: f64| {
            let squares: f64 = lines.iter().map(|line| line[member].powi(2)).sum();
            (USUAL_RUNS * usual * usual + squares) / (USUAL_RUNS + lines.len() as f64)
        };
        let student = STUDENT[lines.len().min(STUDENT.len() - 1)];
        Self {
            offset: student * variance(0, USUAL[1] * peak).sqrt(),
            gain: student * variance(1, USUAL[0]).sqrt(),
            runs: lines.len().max(1),
        }
    }

    /// Deviation at a force, N.
    pub fn at(&self, force: f64) -> f64 {
        self.offset.hypot(self.gain * force)
    }
}

/// A force map with what the held-out rows say of it.
#[derive(Debug, Clone)]
pub struct AcrossRuns {
    /// The chosen map.
    pub map: ForceMap,
    /// Its options.
    pub options: ForceOptions,
    /// Its held-out rows, with the deviations that the map would give; with
    /// one run without what lets the next run differ.
    pub held_out: HeldOutForce,
    /// Those of the best candidate without memory.
    pub without_memory: Option<HeldOutForce>,
    /// All candidates with their scores.
    pub tried: Vec<(ForceOptions, Score)>,
}

impl AcrossRuns {
    /// The best of `candidates` by the likelihood of whole runs that are held
    /// out in turn, or of blocks of time where there is one run.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn choose(runs: &[Session], candidates: &[ForceOptions]) -> Result<Self, TrainingError> {
        let trained: Vec<_> = candidates
            .par_iter()
            .map(|options| {
                let whole_runs = true;
                let options = ForceOptions {
                    whole_runs,
                    ..options.clone()
                };
                let (map, held_out) = ForceMap::trained(runs, &options)?;
                Ok(widened(map, held_out, options, runs.len()))
            })
            .collect::<Result<_, TrainingError>>()?;
        let scores = trained.iter().map(Self::score).collect::<Vec<_>>();
        let options = trained.iter().map(|one| one.options.clone());
        let tried = options.zip(scores.iter().copied()).collect();
        let order = |a: &(Self, Score), b: &(Self, Score)| {
            a.1.log_likelihood.total_cmp(&b.1.log_likelihood)
        };
        let memoryless = |one: &(Self, Score)| one.0.options.memory.creep_times.is_empty();
        let all: Vec<(Self, Score)> = trained.into_iter().zip(scores).collect();
        let without = all
            .iter()
            .filter(|one| memoryless(one))
            .max_by(|a, b| order(a, b));
        let without_memory = without.map(|(one, _)| one.held_out.clone());
        let best = all.into_iter().max_by(order);
        let none = TrainingError::TooFew {
            found: 0,
            needed: 1,
        };
        let (best, _) = best.ok_or(none)?;
        Ok(Self {
            without_memory,
            tried,
            ..best
        })
    }

    /// Score of the held-out rows.
    pub fn score(&self) -> Score {
        Score::of(&self.held_out.errors, &self.held_out.deviations)
    }
}

/// The map with the deviations that runs ask for.
fn widened(
    mut map: ForceMap,
    mut held_out: HeldOutForce,
    options: ForceOptions,
    runs: usize,
) -> AcrossRuns {
    let (lines, rest) = if runs > 1 {
        split(&held_out, runs)
    } else {
        (Vec::new(), held_out.errors.clone())
    };
    map.intervals = Intervals::of(&held_out.estimates, &rest, &held_out.deviations);
    let between = BetweenRuns::of(&lines, map.range[1]);
    if runs > 1 {
        map.between_runs = between;
    }
    for (deviation, estimate) in held_out.deviations.iter_mut().zip(&held_out.estimates) {
        *deviation = map.deviation(*estimate, deviation.powi(2));
    }
    map.between_runs = between;
    AcrossRuns {
        map,
        options,
        held_out,
        without_memory: None,
        tried: Vec::new(),
    }
}

/// Offset and gain of the errors of each run, and what is left of the errors.
fn split(held_out: &HeldOutForce, runs: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
    let lines: Vec<[f64; 2]> = (0..runs)
        .map(|run| {
            let rows = || (0..held_out.runs.len()).filter(|i| held_out.runs[*i] == run);
            straight_line(rows().map(|i| [held_out.estimates[i], held_out.errors[i]]))
        })
        .collect();
    let left = (0..held_out.runs.len()).map(|i| {
        let [offset, gain] = lines[held_out.runs[i]];
        held_out.errors[i] - offset - gain * held_out.estimates[i]
    });
    let left = left.collect();
    (lines, left)
}

/// Offset and slope of the straight line of least squares through points x, y.
fn straight_line(points: impl Iterator<Item = [f64; 2]> + Clone) -> [f64; 2] {
    let count = points.clone().count().max(1) as f64;
    let mean = |axis: usize| points.clone().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let xx: f64 = points.clone().map(|point| (point[0] - x).powi(2)).sum();
    let xy: f64 = points.map(|point| (point[0] - x) * (point[1] - y)).sum();
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    [y - slope * x, slope]
}

/// Products, creep times and priors that are tried for a force after the scale
/// offset of least error among `offsets` (s), for a map without memory.
///
/// # Errors
/// [`TrainingError`].
pub(crate) fn usual_candidates(
    runs: &[Session],
    offsets: &[f64],
) -> Result<Vec<ForceOptions>, TrainingError> {
    const CREEP: [&[f64]; 3] = [&[], &[1.0, 10.0], &[1.0, 10.0, 100.0]];
    const PRIORS: [f64; 4] = [0.1, 1.0, 10.0, 100.0];
    let linear = |offset: f64| options(1, &[], 100.0, offset);
    let tried: Vec<(f64, f64)> = offsets
        .par_iter()
        .map(|offset| {
            let (_, held_out) = ForceMap::trained(runs, &linear(*offset))?;
            let error = held_out.errors.iter().map(|error| error * error);
            Ok((error.sum::<f64>() / held_out.errors.len() as f64, *offset))
        })
        .collect::<Result<_, TrainingError>>()?;
    let least = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let offset = least.map_or(0.0, |(_, offset)| *offset);
    let degrees = [1, 2].into_iter();
    let forms = degrees.flat_map(|degree| CREEP.map(|creep| (degree, creep)));
    let all =
        forms.flat_map(|(degree, creep)| PRIORS.map(|prior| options(degree, creep, prior, offset)));
    Ok(all.collect())
}

fn options(degree: u8, creep_times: &[f64], prior: f64, offset: f64) -> ForceOptions {
    ForceOptions {
        polynomial: Polynomial { degree },
        memory: MemoryLaw {
            creep_times: creep_times.to_vec(),
            play_thresholds: Vec::new(),
        },
        prior,
        offset,
        whole_runs: true,
        ..ForceOptions::default()
    }
}
