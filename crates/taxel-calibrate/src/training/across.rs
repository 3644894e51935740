//! Force over runs: how much the next run differs from those that were seen.
//!
//! Within a run a body repeats itself; from run to run its rest and its
//! stiffness change. What a run shows of itself therefore says nothing of the
//! next one, and with several runs whole runs are held out. The error of run r
//! under a map of the others is split into a_r + b_r F and a rest; the variances
//! of a and b join those of the rest.

use rayon::prelude::*;
use taxel::trained::{BetweenRuns, ForceMap, MemoryLaw, Polynomial, TrainingError};

use super::force::{intervals_of, trained_force};
use super::{ForceOptions, HeldOutForce, Score, Session, blocks_of_time};

/// Knowledge before any run is held out: deviation of the gain, and that of the offset
/// over the largest force. The public recordings of a printed lattice, one run under the
/// best maps of the other, have gains of 1 to 2 % and offsets of 0 to 0.6 N of 32 N.
const USUAL: [f64; 2] = [0.02, 0.01];
/// As many runs as this knowledge counts for.
const USUAL_RUNS: f64 = 2.0;
/// t of 2 to 9 degrees of freedom that 95 % lie within, over that of the normal law.
const STUDENT: [f64; 8] = [2.195, 1.624, 1.417, 1.312, 1.249, 1.206, 1.177, 1.154];

/// From offset and gain of each run that was held out; `peak` is the
/// largest force, N.
///
/// `trained` runs made the map whose next run this is about. Runs that vary
/// by s² about their mean lie s² (1 + 1/R) from the mean of R others, and
/// each of those that were held out from that of one less.
fn between_runs(lines: &[[f64; 2]], peak: f64, trained: usize) -> BetweenRuns {
    let from = |runs: usize| 1.0 + 1.0 / runs.max(1) as f64;
    let share = from(trained) / from(lines.len().saturating_sub(1));
    let variance = |member: usize, usual: f64| {
        let squares: f64 = lines.iter().map(|line| line[member].powi(2)).sum();
        (USUAL_RUNS * usual * usual + share * squares) / (USUAL_RUNS + lines.len() as f64)
    };
    let student = STUDENT[lines.len().min(STUDENT.len() - 1)];
    BetweenRuns {
        offset: student * variance(0, USUAL[1] * peak).sqrt(),
        gain: student * variance(1, USUAL[0]).sqrt(),
        runs: lines.len().max(1),
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
    /// The candidate of least error on whole runs that are held out in turn, or
    /// on blocks of time where there is one run; of its kind the one of the
    /// strongest prior whose error is within one standard error of that. A weak
    /// prior that gains next to nothing on a run loses much on the next.
    ///
    /// Least error is the likelihood with one deviation for all readings. The one
    /// with the deviations of each candidate would not separate them: with few
    /// runs they are mostly what is usual between runs, and wider than the errors.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn choose(runs: &[Session], candidates: &[ForceOptions]) -> Result<Self, TrainingError> {
        let mut trained: Vec<Self> = candidates
            .par_iter()
            .map(|options| {
                let whole_runs = true;
                let options = ForceOptions {
                    whole_runs,
                    ..options.clone()
                };
                let (map, held_out) = trained_force(runs, &options)?;
                Ok(widened(map, held_out, options, runs.len()))
            })
            .collect::<Result<_, TrainingError>>()?;
        let tried = trained.iter().map(|one| (one.options.clone(), one.score()));
        let tried = tried.collect();
        let errors: Vec<[f64; 2]> = trained.iter().map(Self::mean_square).collect();
        let least = |keep: &dyn Fn(usize) -> bool| {
            let kept = (0..errors.len()).filter(|number| keep(*number));
            kept.min_by(|a, b| errors[*a][0].total_cmp(&errors[*b][0]))
        };
        let memoryless = |one: &Self| one.options.memory.creep_times.is_empty();
        let without = least(&|number| memoryless(&trained[number]));
        let without_memory = without.map(|number| trained[number].held_out.clone());
        let best = least(&|_| true).ok_or(TrainingError::TooFew {
            found: 0,
            needed: 1,
        })?;
        let form = |number: usize| {
            let options = &trained[number].options;
            (options.polynomial.degree, &options.memory)
        };
        let enough = errors[best].iter().sum::<f64>();
        let firmest = (0..trained.len())
            .filter(|number| form(*number) == form(best) && errors[*number][0] <= enough)
            .max_by(|a, b| {
                let prior = |number: usize| trained[number].options.prior;
                prior(*a).total_cmp(&prior(*b))
            });
        Ok(Self {
            without_memory,
            tried,
            ..trained.swap_remove(firmest.unwrap_or(best))
        })
    }

    /// Mean square of the held-out errors, and its standard error over the runs
    /// (blocks of one run), N².
    fn mean_square(&self) -> [f64; 2] {
        let (errors, runs) = (&self.held_out.errors, &self.held_out.runs);
        let several = runs.first() != runs.last();
        let parts: Vec<_> = if several {
            runs.chunk_by(|a, b| a == b).map(<[usize]>::len).collect()
        } else {
            let blocks = blocks_of_time(errors.len(), self.options.blocks);
            blocks.iter().map(ExactSizeIterator::len).collect()
        };
        let mut rest = &errors[..];
        let squares: Vec<f64> = parts
            .iter()
            .map(|count| {
                let (part, after) = rest.split_at(*count);
                rest = after;
                part.iter().map(|error| error * error).sum::<f64>() / (*count).max(1) as f64
            })
            .collect();
        let count = squares.len().max(1) as f64;
        let mean = squares.iter().sum::<f64>() / count;
        let scatter = squares.iter().map(|square| (square - mean).powi(2));
        let variance = scatter.sum::<f64>() / (count - 1.0).max(1.0);
        [mean, (variance / count).sqrt()]
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
    map.intervals = intervals_of(&held_out.estimates, &rest, &held_out.deviations);
    if runs > 1 {
        map.between_runs = between_runs(&lines, map.range[1], runs - 1);
    }
    for (deviation, estimate) in held_out.deviations.iter_mut().zip(&held_out.estimates) {
        *deviation = map.deviation(*estimate, deviation.powi(2));
    }
    map.between_runs = between_runs(&lines, map.range[1], runs);
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

/// Products, creep times and priors that are tried for a force, at the offset of
/// the scale (-0.5 s to 1.5 s after the sensor) of least error of a linear map
/// without memory.
///
/// # Errors
/// [`TrainingError`].
pub fn usual_candidates(runs: &[Session]) -> Result<Vec<ForceOptions>, TrainingError> {
    const CREEP: [&[f64]; 4] = [
        &[],
        &[1.0, 10.0],
        &[1.0, 10.0, 100.0],
        &[1.0, 3.0, 10.0, 30.0, 100.0],
    ];
    // Blocks of one run resemble each other more than the next run does: they
    // would choose a prior too weak for it.
    let priors: &[f64] = if runs.len() > 1 {
        &[0.1, 1.0, 10.0, 100.0]
    } else {
        &[10.0, 100.0]
    };
    let linear = |offset: f64| options(1, &[], 100.0, offset);
    let tried: Vec<(f64, f64)> = (-5..=15)
        .into_par_iter()
        .map(|tenths| {
            let offset = 0.1 * f64::from(tenths);
            let (_, held_out) = trained_force(runs, &linear(offset))?;
            let error = held_out.errors.iter().map(|error| error * error);
            Ok((error.sum::<f64>() / held_out.errors.len() as f64, offset))
        })
        .collect::<Result<_, TrainingError>>()?;
    let least = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let offset = least.map_or(0.0, |(_, offset)| *offset);
    let degrees = [1, 2].into_iter();
    let forms = degrees.flat_map(|degree| CREEP.map(|creep| (degree, creep)));
    let all = forms.flat_map(|(degree, creep)| {
        let priors = priors.iter();
        priors.map(move |prior| options(degree, creep, *prior, offset))
    });
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

#[cfg(test)]
mod tests {
    use super::super::NORMAL_95;
    use super::*;
    use taxel_numerics::Noise;

    /// Two runs give the interval of a third where gains differ as is usual; where
    /// they differ more, what is usual is not quite forgotten.
    #[test]
    fn two_runs_cover_the_gain_of_a_third() {
        let mut noise = Noise::seeded(1);
        for (scatter, expected) in [(0.01, 0.999), (0.02, 0.954), (0.03, 0.884), (0.04, 0.836)] {
            let trials = 20_000;
            let covered = (0..trials).filter(|_| {
                let [one, two, third] = [(); 3].map(|()| scatter * noise.normal());
                let lines = [[0.0, one - two], [0.0, two - one]];
                let gain = between_runs(&lines, 1.0, 2).gain;
                (third - 0.5 * (one + two)).abs() < NORMAL_95 * gain
            });
            let share = covered.count() as f64 / f64::from(trials);
            // Three deviations of the count of 20 000.
            assert!((share - expected).abs() < 0.008, "{scatter}: {share}");
        }
    }
}
