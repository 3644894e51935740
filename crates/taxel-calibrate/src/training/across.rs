//! Force over runs: how much the next run differs from those that were seen.
//!
//! Within a run a body repeats itself; from run to run its rest and its
//! stiffness change. What a run shows of itself therefore says nothing of the
//! next one, and with several runs whole runs are held out. The error of run r
//! under a map of the others is split into a_r + b_r F and a rest; the variances
//! of a and b join those of the rest.

use rayon::prelude::*;
use taxel::trained::{
    BetweenRuns, ForceMap, Intervals, MemoryLaw, Polynomial, Relation, RestStatistics, Ridge,
    TrainingError,
};
use taxel_numerics::split_mix;

use super::force::{Within, features_of, intervals_of, trained_force};
use super::next_run::{self, USUAL, of_mean};
use super::replay::{Live, Of, REST_FRAMES};
use super::{ForceOptions, HeldOutForce, Score, Session, blocks_of_time};

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
    /// Share of resamplings of the blocks of time in which no candidate of another degree or
    /// memory has a smaller error: how sure the choice is.
    pub certainty: f64,
    /// Root mean square of the errors of the chosen map on its own training readings, replayed as
    /// live, N; `NaN` before.
    pub replayed: f64,
    /// Mean square of the errors of blocks of time, N².
    blocks: f64,
}

/// Parts of a run whose errors are resampled: errors of neighbours move together.
const PARTS: usize = 5;
/// A stronger prior may have no more than this much of the mean square error of the best.
pub(super) const NO_WORSE: f64 = 1.05;
/// Resamplings.
const RESAMPLED: u64 = 400;

impl AcrossRuns {
    /// The candidate of least error on what is held out: blocks of time, and where there are
    /// several runs whole runs, too, both with the same weight; of its kind the one of the
    /// strongest prior whose mean square error is no more than 5 % above that. Few runs say little of
    /// how runs differ, and blocks nothing; a weak prior that gains next to nothing on a block
    /// loses much on the next run.
    ///
    /// Least error is the likelihood with one deviation for all readings of a kind. The one
    /// with the deviations of each candidate would not separate them: with few
    /// runs they are mostly what is usual between runs, and wider than the errors.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn choose(runs: &[Session], candidates: &[ForceOptions]) -> Result<Self, TrainingError> {
        let found: Vec<(Self, Vec<Vec<f64>>)> = candidates
            .par_iter()
            .map(|options| {
                let held = |whole_runs| {
                    let options = ForceOptions {
                        whole_runs,
                        ..options.clone()
                    };
                    trained_force(runs, &options).map(|found| (found, options))
                };
                let ((map, held_out), options) = held(true)?;
                let mut kinds = vec![squares(&held_out)];
                if runs.len() > 1 {
                    let ((_, blocks), _) = held(false)?;
                    kinds.push(squares(&blocks));
                }
                let blocks = kinds.last().map_or(0.0, |squares| mean(squares));
                Ok((widened(map, held_out, options, (runs.len(), blocks)), kinds))
            })
            .collect::<Result<_, TrainingError>>()?;
        let (mut trained, kinds): (Vec<Self>, Vec<Vec<Vec<f64>>>) = found.into_iter().unzip();
        let tried = trained.iter().map(|one| (one.options.clone(), one.score()));
        let tried = tried.collect();
        // Of each kind in units of the least: near it this is the logarithm of the likelihood.
        let least_of = |kind: usize| {
            let all = kinds.iter().map(|kinds| mean(&kinds[kind]));
            all.fold(f64::INFINITY, f64::min).max(f64::MIN_POSITIVE)
        };
        let units: Vec<f64> = (0..kinds.first().map_or(0, Vec::len))
            .map(least_of)
            .collect();
        let parts: Vec<Vec<f64>> = kinds
            .iter()
            .map(|kinds| {
                let scaled = kinds.iter().zip(&units);
                let scaled =
                    scaled.flat_map(|(squares, unit)| squares.iter().map(move |s| s / unit));
                scaled.collect()
            })
            .collect();
        let weak = |number: usize| runs.len() == 1 && trained[number].options.prior < OF_ONE[0].0;
        let error = |number: usize| {
            let share = if weak(number) { CLEARLY_LESS } else { 1.0 };
            mean(&parts[number]) / share
        };
        let least = |keep: &dyn Fn(usize) -> bool| {
            let kept = (0..parts.len()).filter(|number| keep(*number));
            kept.min_by(|a, b| error(*a).total_cmp(&error(*b)))
        };
        let memoryless = |one: &Self| one.options.memory.creep_times.is_empty();
        let without = least(&|number| memoryless(&trained[number]));
        let without_memory = without.map(|number| trained[number].held_out.clone());
        let best = least(&|_| true).ok_or(TrainingError::TooFew {
            found: 0,
            needed: 1,
        })?;
        let as_good = |number: usize| error(number) <= NO_WORSE * error(best);
        let options = |number: usize| &trained[number].options;
        let alike = |number: usize| {
            let (own, best) = (options(number), options(best));
            own.same_form(best) && own.prior_shares == best.prior_shares
        };
        let firmest = (0..trained.len())
            .filter(|number| alike(*number) && as_good(*number))
            .max_by(|a, b| options(*a).prior.total_cmp(&options(*b).prior));
        let chosen = firmest.unwrap_or(best);
        let others: Vec<&Vec<f64>> = (0..trained.len())
            .filter(|number| !options(*number).same_form(options(chosen)))
            .map(|number| &parts[number])
            .collect();
        let certainty = certainty(&parts[chosen], &others);
        Ok(Self {
            without_memory,
            tried,
            certainty,
            ..trained.swap_remove(chosen)
        })
    }

    /// The same with the held-out figures of the estimator that runs live, over the frames of
    /// the whole runs: with rest capture, baseline and health of channels.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn judged_live(
        self,
        runs: &[Session],
        rest: &RestStatistics,
        relation: Option<&Relation>,
    ) -> Result<Self, TrainingError> {
        let (map, options) = (&self.map, &self.options);
        let readings: Vec<_> = runs
            .iter()
            .map(|run| features_of(map, run))
            .collect::<Result<_, TrainingError>>()?;
        // Deviations without what the held-out rows have yet to say.
        let bare = |ridge| ForceMap {
            ridge,
            intervals: Intervals {
                levels: Vec::new(),
                factors: vec![1.0],
            },
            between_runs: BetweenRuns::default(),
            ..map.clone()
        };
        let live = Live {
            runs,
            rest,
            relation,
        };
        let force: Of<'_> = &|touch| touch.pressing_force().unwrap_or([f64::NAN; 2]);
        let held_out = live.held_out(&readings, (map, options), &bare, force)?;
        let mut squares = Vec::new();
        for (number, run) in readings.iter().enumerate() {
            let estimates = live.played(map.clone(), number, force)?;
            // Before the end of its rest capture live says no force.
            let known = runs[number].sensor.times().get(REST_FRAMES).copied();
            let known = known.unwrap_or(f64::NEG_INFINITY);
            for (time, force) in run.times.iter().zip(&run.force) {
                if *time - map.offset < known {
                    continue;
                }
                let estimate = estimates.at(time - map.offset, map.longest_step);
                let error = estimate.map_or(f64::NAN, |estimate| estimate[0] - force);
                squares.extend(error.is_finite().then_some(error * error));
            }
        }
        let replayed = mean(&squares).sqrt();
        let seen = (runs.len(), self.blocks);
        let judged = widened(self.map, held_out, self.options, seen);
        Ok(Self {
            without_memory: self.without_memory,
            tried: self.tried,
            certainty: self.certainty,
            replayed,
            ..judged
        })
    }

    /// Score of the held-out rows.
    pub fn score(&self) -> Score {
        Score::of(&self.held_out.errors, &self.held_out.deviations)
    }
}

/// Mean squares of the held-out errors of parts of time of each run, N².
fn squares(held_out: &HeldOutForce) -> Vec<f64> {
    let mut squares = Vec::new();
    let mut rest = &held_out.errors[..];
    for run in held_out.runs.chunk_by(|a, b| a == b) {
        let (own, after) = rest.split_at(run.len());
        rest = after;
        for part in blocks_of_time(own.len(), PARTS) {
            let part = &own[part];
            let sum: f64 = part.iter().map(|error| error * error).sum();
            squares.push(sum / part.len().max(1) as f64);
        }
    }
    squares
}

/// Held-out errors, divided into the differences between runs and the rest within each.
///
/// A new body settles in its first run, and none that follows does it again: where there are
/// several, the errors within a run are those of the later ones. A map of all runs errs by less
/// than one that has seen one less, as their mean does; but for what blocks of time err by, too:
/// more runs do not take that away.
pub(super) struct Divided {
    runs: usize,
    /// Mean square of the errors of blocks of time.
    blocks: f64,
    /// Of each run; none with one run.
    lines: Vec<Line>,
    rest: Vec<f64>,
    /// The first row of the later runs.
    later: usize,
}

impl Divided {
    pub(super) fn of(held_out: &HeldOutForce, (runs, blocks): (usize, f64)) -> Self {
        let (lines, rest) = if runs > 1 {
            split(held_out, runs)
        } else {
            (Vec::new(), held_out.errors.clone())
        };
        Self {
            runs,
            blocks,
            lines,
            rest,
            later: held_out.runs.partition_point(|run| runs > 1 && *run == 0),
        }
    }

    pub(super) fn within<'a>(&'a self, held_out: &'a HeldOutForce) -> Within<'a> {
        Within {
            estimates: &held_out.estimates[self.later..],
            errors: &self.rest[self.later..],
            deviations: &held_out.deviations[self.later..],
            beside: &held_out.beside[self.later..],
        }
    }

    /// Differences of a run that was held out; none of blocks of the only one.
    pub(super) fn of_held_out(&self, peak: f64) -> BetweenRuns {
        if self.runs > 1 {
            between_runs(&self.lines, peak, self.runs - 1)
        } else {
            BetweenRuns::default()
        }
    }

    /// Differences of the next run.
    pub(super) fn of_next(&self, peak: f64) -> BetweenRuns {
        between_runs(&self.lines, peak, self.runs)
    }

    /// Factor on the deviations within a run for `ridge`, the map of all runs: those of the maps that
    /// were held out have another noise, as the prior weighs more beside fewer rows. The next run differs
    /// from the only one by more than a line.
    pub(super) fn of_all(&self, held_out: &HeldOutForce, ridge: &Ridge) -> f64 {
        let errors = &self.rest[self.later..];
        let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
        let (own, stays) = (mean(&squares), self.blocks.min(mean(&squares)));
        if self.runs > 1 && own > 0.0 {
            let share = of_mean(self.runs) / of_mean(self.runs - 1);
            let noise = mean(&held_out.noises[self.later..]) / ridge.noise_variance().sqrt();
            noise * ((stays + share * (own - stays)) / own).sqrt()
        } else if self.runs == 1 {
            WITHIN_ANOTHER
        } else {
            1.0
        }
    }
}

/// The map with the deviations that runs ask for.
fn widened(
    mut map: ForceMap,
    mut held_out: HeldOutForce,
    options: ForceOptions,
    seen: (usize, f64),
) -> AcrossRuns {
    let divided = Divided::of(&held_out, seen);
    let within = divided.within(&held_out);
    map.intervals = intervals_of(&within);
    map.between_runs = divided.of_held_out(map.range[1]);
    held_out.widen(|estimate, deviation| map.deviation(estimate, deviation.powi(2)));
    map.between_runs = divided.of_next(map.range[1]);
    let share = divided.of_all(&held_out, &map.ridge);
    for factor in &mut map.intervals.factors {
        *factor *= share;
    }
    AcrossRuns {
        map,
        options,
        held_out,
        without_memory: None,
        tried: Vec::new(),
        certainty: f64::NAN,
        replayed: f64::NAN,
        blocks: seen.1,
    }
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Share of resamplings of the parts in which `chosen` has the least error.
fn certainty(chosen: &[f64], others: &[&Vec<f64>]) -> f64 {
    let mut wins = 0;
    for number in 0..RESAMPLED {
        let drawn: Vec<usize> = (0..chosen.len() as u64)
            .map(|place| (split_mix(0, number << 16 | place) % chosen.len() as u64) as usize)
            .collect();
        let error = |parts: &[f64]| drawn.iter().map(|part| parts[*part]).sum::<f64>();
        let own = error(chosen);
        wins += u32::from(others.iter().all(|other| own <= error(other)));
    }
    f64::from(wins) / RESAMPLED as f64
}

/// Lines through the errors of each run, and what is left of the errors without what the lines of
/// the runs differ by.
fn split(held_out: &HeldOutForce, runs: usize) -> (Vec<Line>, Vec<f64>) {
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

/// Times of creep that are tried, s.
const CREEP: [&[f64]; 5] = [
    &[],
    &[1.0, 10.0],
    &[1.0, 10.0, 100.0],
    &[1.0, 3.0, 10.0, 30.0, 100.0],
    &[1.0, 3.0, 10.0, 30.0, 100.0, 300.0],
];
/// Directions of the body whose products with their creep are tried.
const DIRECTIONS: usize = 3;
/// A prior of the products, and the shares of it of the channels, of the memory and of the
/// products with it.
type Prior = (f64, [f64; 3]);
/// Priors that differ in strength alone.
const fn alike(strength: f64) -> Prior {
    (strength, [1.0; 3])
}
/// Priors of one run, that of all forms first, and those beside it for the best forms. Runs agree more
/// in what the body did lately than in the products of its channels. Blocks of one run resemble each
/// other more than the next run does: of one run the weakest would be chosen, and err on the next.
const OF_ONE: [Prior; 5] = [
    (2.0, [1.0, 0.3, 1.0]),
    alike(0.1),
    (10.0, [1.0, 0.3, 1.0]),
    (30.0, [1.0, 0.3, 1.0]),
    alike(100.0),
];
/// A prior of one run that is weaker than the first must leave less than this share of the mean
/// square error: then the body is as simple as the map, and the prior is what errs.
pub(super) const CLEARLY_LESS: f64 = 0.5;
/// Those of several runs.
const OF_SEVERAL: [Prior; 9] = [
    (10.0, [1.0, 0.1, 1.0]),
    (1.0, [1.0, 0.1, 1.0]),
    (3.0, [1.0, 0.1, 1.0]),
    (30.0, [1.0, 0.1, 1.0]),
    (100.0, [1.0, 0.1, 1.0]),
    (3.0, [1.0, 0.03, 1.0]),
    (10.0, [1.0, 0.03, 1.0]),
    (30.0, [1.0, 0.1, 0.1]),
    alike(10.0),
];
/// Forms whose other priors are tried.
const BEST_FORMS: usize = 2;
/// Forms that are compared to the end.
const KEPT_FORMS: usize = 6;
/// Another time between scale and sensor than none must leave less than this share of the mean
/// square error: a map with memory makes up for a scale that is a little late, and its force is
/// then what the scale shows at the time of the frame.
const CLEARLY_LATE: f64 = 0.7;

/// Products, creep times and priors that are tried for a force: all forms with one prior, the
/// best six and the best without memory to the end, and the best two with more priors. The scale is
/// taken to show the force of its time, unless a time from −0.5 s to 1.5 s after the sensor leaves
/// clearly less error of maps with memory, of a strong and of a weak prior.
///
/// # Errors
/// [`TrainingError`].
pub fn usual_candidates(runs: &[Session]) -> Result<Vec<ForceOptions>, TrainingError> {
    let error = |options: &ForceOptions| -> Result<f64, TrainingError> {
        let (_, held_out) = trained_force(runs, options)?;
        let squares: Vec<f64> = held_out.errors.iter().map(|error| error * error).collect();
        Ok(mean(&squares))
    };
    let late = |prior: Prior| -> Result<f64, TrainingError> {
        let tried: Vec<(f64, f64)> = (-5..=15)
            .into_par_iter()
            .map(|tenths| {
                let offset = 0.1 * f64::from(tenths);
                // A delay shows anywhere, slow creep or not.
                let options = ForceOptions {
                    blocks: 5,
                    learned_from: 0.4,
                    ..options(1, CREEP[2], prior, offset)
                };
                Ok((error(&options)?, offset))
            })
            .collect::<Result<_, TrainingError>>()?;
        let least = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let prompt = tried.iter().find(|(_, offset)| *offset == 0.0);
        Ok(match (least, prompt) {
            (Some((least, offset)), Some((prompt, _))) if *least < CLEARLY_LATE * prompt => *offset,
            _ => 0.0,
        })
    };
    // What a strong prior keeps back, and what a weak one makes of noise, are no delay.
    let [one, other] = [late(alike(10.0))?, late(alike(0.1))?];
    let offset = if one.abs() < other.abs() { one } else { other };
    let shapes: &[(u8, bool)] = if one_sided(runs) {
        &[(1, false), (2, false), (1, true), (2, true)]
    } else {
        &[(1, false), (2, false)]
    };
    // What takes longer than a run is not seen in it.
    let length = |run: &Session| {
        let times = run.sensor.times();
        times[times.len() - 1] - times[0]
    };
    let longest = runs.iter().map(length).fold(0.0, f64::max);
    let seen = |creep: &[f64]| -> Vec<f64> {
        creep
            .iter()
            .copied()
            .filter(|time| *time <= longest)
            .collect()
    };
    let mut creep_times: Vec<Vec<f64>> = CREEP.map(seen).to_vec();
    creep_times.dedup();
    let memories = creep_times.iter().flat_map(|creep| {
        let directions = [0, if creep.is_empty() { 0 } else { DIRECTIONS }];
        let count = 1 + usize::from(!creep.is_empty());
        directions
            .into_iter()
            .take(count)
            .map(move |mixed| (creep, mixed))
    });
    let (first, more) = if runs.len() > 1 {
        OF_SEVERAL.split_at(1)
    } else {
        OF_ONE.split_at(1)
    };
    let first = &first[0];
    let forms: Vec<ForceOptions> = memories
        .flat_map(|(creep, mixed)| {
            shapes.iter().map(move |(degree, reciprocal)| ForceOptions {
                reciprocal: *reciprocal,
                mixed,
                ..options(*degree, creep, *first, offset)
            })
        })
        .collect();
    let mut order: Vec<(f64, ForceOptions)> = forms
        .into_par_iter()
        .map(|form| Ok((error(&form)?, form)))
        .collect::<Result<_, TrainingError>>()?;
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let memoryless = |form: &ForceOptions| form.memory.creep_times.is_empty();
    let without = order.iter().position(|(_, form)| memoryless(form));
    let mut all = Vec::new();
    for (rank, (_, form)) in order.into_iter().enumerate() {
        if rank >= KEPT_FORMS && Some(rank) != without {
            continue;
        }
        let more = if rank < BEST_FORMS { more } else { &[] };
        let others = more.iter().map(|(prior, prior_shares)| ForceOptions {
            prior: *prior,
            prior_shares: *prior_shares,
            ..form.clone()
        });
        let others: Vec<ForceOptions> = others.collect();
        all.push(form);
        all.extend(others);
    }
    Ok(all)
}

/// Readings stay this far from zero, over those at rest, where reciprocals are tried.
const FROM_ZERO: f64 = 0.02;

/// True if no reading of any channel that changes comes near to zero or changes its sign.
fn one_sided(runs: &[Session]) -> bool {
    runs.iter().all(|run| {
        let rest = run.baseline();
        let far = |row: &Vec<f64>| {
            let mut channels = row.iter().zip(&rest);
            channels.all(|(x, b)| x.is_nan() || (*x == 0.0 && *b == 0.0) || x / b > FROM_ZERO)
        };
        run.sensor.rows().iter().all(far)
    })
}

fn options(degree: u8, creep_times: &[f64], prior: Prior, offset: f64) -> ForceOptions {
    let (prior, prior_shares) = prior;
    ForceOptions {
        polynomial: Polynomial { degree },
        memory: MemoryLaw {
            creep_times: creep_times.to_vec(),
            play_thresholds: Vec::new(),
        },
        prior,
        prior_shares,
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
            let reach = student_quantile(0.975, 8) * (of_mean(2) * variance).sqrt();
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
