//! Ridges over blocks of features, and the mixture of them that predicts held-out groups best.

use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use rayon::prelude::*;
use taxel::trained::{Block, ErrorLaw, FeatureLaw, MemberMap, TrainingError};

use super::fold::BLOCKS;
use super::{Score, interval_factor};

/// Priors that are tried first; then the neighbours of the best.
const PRIORS: [f64; 3] = [1e-2, 1.0, 1e2];
const NEIGHBOUR: f64 = 10.0;
/// Prior of the only run for each reading. Its blocks are alike and would choose a prior that gains next to nothing
/// on them and loses much on the next run: of the decades the one that errs least on next runs, in the geometric
/// mean over kinds of skins (`cargo run --release -p taxel-calibrate --example skins -- --one-run FOLDER…`).
const OF_ONE_RUN: f64 = 1e-3;
/// Features with less than this share of the deviation of the largest of their block are rounding.
const ROUNDING: f64 = 1e-6;

/// A map: the law whose features it takes, and the blocks of them.
pub(super) type Form = (usize, &'static [Block]);

/// Held-out estimates in the order of runs and time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeldOutReadings {
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

impl HeldOutReadings {
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

/// Maps with their shares, and what the mixture makes of groups that neither they nor the shares have seen.
pub(super) struct Mixture {
    pub(super) members: Vec<MemberMap>,
    /// Share of the map beside them.
    pub(super) beside: f64,
    pub(super) candidates: Vec<Candidate>,
    pub(super) held_out: HeldOutReadings,
    /// Least and largest reading.
    pub(super) range: [f64; 2],
}

/// Deviation of estimates from their mean.
fn difference(estimates: &[f64]) -> f64 {
    let count = estimates.len().max(1) as f64;
    let mean = estimates.iter().sum::<f64>() / count;
    let square = estimates
        .iter()
        .map(|own| (own - mean).powi(2))
        .sum::<f64>();
    (square / count).sqrt()
}

/// Features of some blocks at the times of readings, in groups that are held out in turn.
pub(super) struct Design {
    /// Run and number of the reading of each row, by group.
    pub(super) places: Vec<Vec<[usize; 2]>>,
    /// Rows of each group: features less their mean over their scale, kernels whitened.
    pub(super) rows: Vec<Mat<f64>>,
    /// Mean and scale of each feature, kernels whitened.
    mean: Vec<f64>,
    scale: Vec<f64>,
    /// Of features of the memory the square of what a touch that comes at once has of them, over their scale; of
    /// others zero.
    memory: Vec<f64>,
    /// Number of times of the memory.
    times: f64,
    /// Inverse roots of the kernels of the centres, of broad and of sharp ones.
    whitenings: Vec<((usize, Block), Mat<f64>)>,
    /// Range of each block of each law among the columns.
    ranges: Vec<((usize, Block), Range<usize>)>,
}

impl Design {
    /// Of the features of blocks of some laws one after the other, of readings whose run and number `places` has.
    pub(super) fn of(
        parts: &[(&FeatureLaw, &[Block])],
        mut rows: Vec<Vec<f64>>,
        places: &[[usize; 2]],
    ) -> Result<Self, TrainingError> {
        if rows.len() < 2 * BLOCKS {
            return Err(TrainingError::TooFew {
                found: rows.len(),
                needed: 2 * BLOCKS,
            });
        }
        let mut ranges = Vec::new();
        let mut whitenings = Vec::new();
        let mut start = 0;
        let blocks = parts.iter().enumerate();
        let blocks = blocks
            .flat_map(|(of, (law, blocks))| blocks.iter().map(move |block| (of, *law, *block)));
        for (of, law, block) in blocks {
            let raw = law.count(block);
            let mut range = start..start + raw;
            if matches!(block, Block::Broad | Block::Sharp) {
                let root = whitening(law, block);
                let columns = root.ncols();
                let kernels = Mat::from_fn(rows.len(), raw, |i, j| rows[i][start + j]);
                let white = kernels * &root;
                for (i, row) in rows.iter_mut().enumerate() {
                    row.splice(range.clone(), (0..columns).map(|j| white[(i, j)]));
                }
                range = start..start + columns;
                whitenings.push(((of, block), root));
            }
            start = range.end;
            ranges.push(((of, block), range));
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
        let mut memory = vec![0.0; start];
        for ((of, block), range) in &ranges {
            let own: Vec<f64> = deviation[range.clone()].iter().map(|v| v.sqrt()).collect();
            let most = |own: &mut dyn Iterator<Item = &f64>| own.copied().fold(0.0, f64::max);
            let all = most(&mut own.iter()) + f64::MIN_POSITIVE;
            let each = parts[*of].0.memory(*block).filter(|each| *each > 0);
            for (at, column) in range.clone().enumerate() {
                scale[column] = match block {
                    Block::Broad | Block::Sharp => all,
                    _ => own[at].max(ROUNDING * all),
                };
                // A touch that comes at once has all of the memory, of which the slowest shows most.
                if let Some(each) = each {
                    let slowest = most(&mut own.iter().skip(at % each).step_by(each));
                    memory[column] = (slowest / scale[column]).max(1.0).powi(2);
                }
            }
        }
        let groups = groups(places);
        let mut of_groups = Vec::new();
        for group in &groups {
            of_groups.push(Mat::from_fn(group.len(), start, |i, j| {
                (rows[group[i]][j] - mean[j]) / scale[j]
            }));
        }
        Ok(Self {
            places: groups
                .iter()
                .map(|group| group.iter().map(|at| places[*at]).collect())
                .collect(),
            rows: of_groups,
            mean,
            scale,
            memory,
            times: parts
                .iter()
                .map(|(law, _)| law.times.len())
                .max()
                .unwrap_or(0) as f64,
            whitenings,
            ranges,
        })
    }

    /// True if the groups are blocks of the only run.
    fn of_one_run(&self) -> bool {
        let mut runs = self.places.iter().flatten().map(|[run, _]| run);
        let first = runs.next();
        runs.all(|run| Some(run) == first)
    }

    /// Columns of all features.
    pub(super) fn all(&self) -> Vec<usize> {
        (0..self.mean.len()).collect()
    }

    pub(super) fn columns(&self, (of, blocks): (usize, &[Block])) -> Vec<usize> {
        let own = self
            .ranges
            .iter()
            .filter(|((law, block), _)| *law == of && blocks.contains(block));
        own.flat_map(|(_, range)| range.clone()).collect()
    }

    /// Readings of each group, less their mean over all of it; and the mean.
    pub(super) fn targets(&self, readings: &[Vec<[f64; 2]>]) -> (Vec<Vec<f64>>, f64) {
        let of = |group: &Vec<[usize; 2]>| -> Vec<f64> {
            group
                .iter()
                .map(|[run, at]| readings[*run][*at][1])
                .collect()
        };
        let mut targets: Vec<Vec<f64>> = self.places.iter().map(of).collect();
        let count: usize = targets.iter().map(Vec::len).sum();
        let mean = targets.iter().flatten().sum::<f64>() / count.max(1) as f64;
        targets
            .iter_mut()
            .flatten()
            .for_each(|value| *value -= mean);
        (targets, mean)
    }

    /// The mixture of maps of some forms that predicts held-out groups best; `beside` are estimates by another
    /// map of each group from the others.
    pub(super) fn mixed(
        &self,
        forms: &[Form],
        readings: &[Vec<[f64; 2]>],
        beside: Option<&[Vec<f64>]>,
    ) -> Result<Mixture, TrainingError> {
        let (targets, mean) = self.targets(readings);
        let solver = Solver::of(self, &targets);
        let fitted: Vec<Fitted> = forms
            .par_iter()
            .map(|form| self.fitted(&solver, *form))
            .collect::<Result<_, _>>()?;
        let mut members: Vec<Vec<Vec<f64>>> =
            fitted.iter().map(|one| one.held_out.clone()).collect();
        let less = |rows: &Vec<f64>| rows.iter().map(|value| value - mean).collect();
        members.extend(beside.map(|groups| groups.iter().map(less).collect()));
        let shares_without = |out: Option<usize>| {
            let kept = |rows: &[Vec<f64>]| -> Vec<f64> {
                let rows = rows
                    .iter()
                    .enumerate()
                    .filter(|(group, _)| Some(*group) != out);
                rows.flat_map(|(_, rows)| rows.iter().copied()).collect()
            };
            let all: Vec<Vec<f64>> = members.iter().map(|one| kept(one)).collect();
            simplex(&all, &kept(&targets))
        };
        // The shares, too, have not seen what they are judged by.
        let mut held_out = HeldOutReadings::default();
        for (group, target) in targets.iter().enumerate() {
            let shares = shares_without(Some(group));
            for (row, truth) in target.iter().enumerate() {
                let own: Vec<f64> = members.iter().map(|one| one[group][row]).collect();
                let estimate = own
                    .iter()
                    .zip(&shares)
                    .map(|(own, share)| own * share)
                    .sum::<f64>();
                let difference = difference(&own);
                held_out.push(
                    group,
                    [row as f64, truth + mean],
                    [estimate + mean, difference],
                    0.0,
                );
            }
        }
        let shares = shares_without(None);
        let values = || targets.iter().flatten().map(|value| value + mean);
        let range = [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ];
        let maps = forms.iter().zip(&fitted).zip(&shares);
        let candidates = maps.clone().map(|((form, one), share)| Candidate {
            blocks: form.1.to_vec(),
            prior: one.prior,
            error: one.error.sqrt(),
            share: *share,
        });
        Ok(Mixture {
            candidates: candidates.collect(),
            members: maps
                .map(|((form, one), share)| MemberMap {
                    share: *share,
                    ..self.member(*form, one, mean)
                })
                .collect(),
            beside: shares.get(forms.len()).copied().unwrap_or(0.0),
            held_out,
            range,
        })
    }

    /// The map of some features that predicts held-out groups best.
    ///
    /// Of touches of one speed the memory of the present is nearly a sum of what is present, and a map may take either
    /// for the force; one that comes faster, or rests, then reads anything. What the memory does to a touch that
    /// comes at once is expected to be what the map of the present alone errs by, in equal parts of its times.
    fn fitted(&self, solver: &Solver<'_>, form: Form) -> Result<Fitted, TrainingError> {
        let columns = self.columns(form);
        let present = columns.iter().filter(|column| self.memory[**column] == 0.0);
        let present: Vec<usize> = present.copied().collect();
        let joint = solver.fitted(&columns, None, 0.0)?;
        if present.len() == columns.len() || present.is_empty() || self.of_one_run() {
            return Ok(joint);
        }
        let alone = solver.fitted(&present, None, 0.0)?;
        let share = (joint.error / alone.error.max(f64::MIN_POSITIVE)).min(1.0);
        solver.fitted(&columns, None, self.times * share)
    }

    /// A fitted map of the features as they come.
    fn member(&self, form: Form, fitted: &Fitted, mean: f64) -> MemberMap {
        let columns = self.columns(form);
        let mut constant = mean;
        let mut by_column = vec![0.0; self.mean.len()];
        for (column, weight) in columns.iter().zip(&fitted.weights) {
            by_column[*column] = weight / self.scale[*column];
            constant -= by_column[*column] * self.mean[*column];
        }
        let mut weights = Vec::new();
        let mut own = Vec::new();
        // In the order of the features.
        let (of, blocks) = form;
        let ranges = self.ranges.iter();
        for (key, range) in ranges.filter(|((law, block), _)| *law == of && blocks.contains(block))
        {
            own.push(key.1);
            let values = &by_column[range.clone()];
            match self.whitenings.iter().find(|(other, _)| other == key) {
                None => weights.extend_from_slice(values),
                Some((_, root)) => {
                    let white = Mat::from_fn(values.len(), 1, |i, _| values[i]);
                    let raw = root * white;
                    weights.extend((0..raw.nrows()).map(|i| raw[(i, 0)]));
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
    let kernels = Mat::from_fn(count, count, |i, j| {
        law.kernel(block, &law.centres[i], &law.centres[j])
    });
    let Ok(decomposed) = kernels.self_adjoint_eigen(Side::Lower) else {
        return Mat::zeros(count, 0);
    };
    let (vectors, values) = (decomposed.U(), decomposed.S());
    // Less is rounding.
    let kept: Vec<usize> = (0..count)
        .filter(|at| values[*at] > 1e-7 * values[count - 1])
        .collect();
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

/// Moments of the groups of a design with one target.
pub(super) struct Solver<'a> {
    design: &'a Design,
    targets: &'a [Vec<f64>],
    grams: Vec<Mat<f64>>,
    moments: Vec<Mat<f64>>,
}

/// A fitted map.
pub(super) struct Fitted {
    prior: f64,
    /// Mean square of the errors of the groups, each with the same weight.
    pub(super) error: f64,
    /// Estimates of each group from the others.
    held_out: Vec<Vec<f64>>,
    pub(super) weights: Vec<f64>,
}

impl<'a> Solver<'a> {
    pub(super) fn of(design: &'a Design, targets: &'a [Vec<f64>]) -> Self {
        let column = |target: &Vec<f64>| Mat::from_fn(target.len(), 1, |i, _| target[i]);
        let rows = design.rows.iter().zip(targets);
        Self {
            design,
            targets,
            grams: design
                .rows
                .iter()
                .map(|rows| rows.transpose() * rows)
                .collect(),
            moments: rows
                .map(|(rows, target)| rows.transpose() * column(target))
                .collect(),
        }
    }

    /// The ridge over some columns with the prior that predicts groups best, or with `prior`; that of the memory is
    /// stronger by `memory`.
    pub(super) fn fitted(
        &self,
        columns: &[usize],
        prior: Option<f64>,
        memory: f64,
    ) -> Result<Fitted, TrainingError> {
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
        let sums: Vec<(Mat<f64>, Mat<f64>)> =
            (0..grams.len()).map(|group| sum(Some(group))).collect();
        let solve = |(gram, moment): &(Mat<f64>, Mat<f64>),
                     prior: f64|
         -> Result<Mat<f64>, TrainingError> {
            let mut matrix = gram.clone();
            for (j, column) in columns.iter().enumerate() {
                matrix[(j, j)] += prior + memory * self.design.memory[*column];
            }
            let factor = matrix
                .llt(Side::Lower)
                .map_err(|_| TrainingError::Dependent { features: size })?;
            Ok(factor.solve(moment))
        };
        let tried = |prior: f64| -> Result<Fitted, TrainingError> {
            let (mut squares, mut held_out) = (Vec::new(), Vec::new());
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
                let own = estimates.iter().zip(target).map(|(a, b)| (a - b) * (a - b));
                squares.push(own.sum::<f64>() / target.len().max(1) as f64);
                held_out.push(estimates);
            }
            let count = squares.len().max(1) as f64;
            let error = squares.iter().sum::<f64>() / count;
            Ok(Fitted {
                prior,
                error,
                held_out,
                weights: Vec::new(),
            })
        };
        let mut best = match prior {
            Some(prior) => tried(prior)?,
            None if self.design.of_one_run() => {
                let rows: usize = self.targets.iter().map(Vec::len).sum();
                tried(OF_ONE_RUN * rows as f64)?
            }
            None => {
                let all = PRIORS
                    .map(tried)
                    .into_iter()
                    .collect::<Result<Vec<_>, _>>()?;
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
    let gram: Vec<Vec<f64>> = (0..count)
        .map(|i| (0..count).map(|j| product(i, j)).collect())
        .collect();
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
        let (Some(low), Some(high)) = (low, high) else {
            break;
        };
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
pub(crate) fn error_law(found: &HeldOutReadings, errors: &[f64]) -> ErrorLaw {
    let count = errors.len();
    let mean =
        |values: &[f64]| values.iter().map(|v| v.abs()).sum::<f64>() / values.len().max(1) as f64;
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
        .map(|row| {
            law.at(found.estimates[row], found.differences[row])
                .max(f64::MIN_POSITIVE)
        })
        .collect();
    law.times(interval_factor(&own, &deviations))
}
