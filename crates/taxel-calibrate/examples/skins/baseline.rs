//! Plain regressions that a map must not be worse than.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Times of the memory of a ridge with creep, s.
const TIMES: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];
/// Rows of kernels at most.
const ROWS: usize = 1200;
/// Neighbours that are averaged.
const NEIGHBOURS: usize = 5;

/// Channels of a run less those at rest, and its times.
pub(crate) struct Inputs {
    pub(crate) times: Vec<f64>,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Inputs {
    /// The channels and what is left of them after following each over some times.
    fn with_creep(&self) -> Vec<Vec<f64>> {
        let width = self.rows.first().map_or(0, Vec::len);
        let mut states = vec![vec![0.0; width]; TIMES.len()];
        let mut last = self.times.first().copied().unwrap_or(0.0);
        let rows = self.times.iter().zip(&self.rows);
        rows.map(|(time, row)| {
            let mut all = row.clone();
            for (state, settles) in states.iter_mut().zip(TIMES) {
                let share = 1.0 - (-(time - last) / settles).exp();
                for (state, value) in state.iter_mut().zip(row) {
                    *state += share * (value - *state);
                    all.push(value - *state);
                }
            }
            last = *time;
            all
        })
        .collect()
    }
}

/// Estimates of targets (NaN: none) of a further run by each of the plain maps of runs.
pub(crate) fn estimates(
    runs: &[&Inputs],
    targets: &[Vec<f64>],
    further: &Inputs,
) -> Vec<(&'static str, Vec<f64>)> {
    let plain: Vec<Vec<Vec<f64>>> = runs.iter().map(|run| run.rows.clone()).collect();
    let creep: Vec<Vec<Vec<f64>>> = runs.iter().map(|run| run.with_creep()).collect();
    vec![
        ("ridge", ridge(&plain, targets, &further.rows)),
        (
            "ridge with creep",
            ridge(&creep, targets, &further.with_creep()),
        ),
        ("kernels", kernels(&plain, targets, &further.rows)),
        (
            "kernels with creep",
            kernels(&creep, targets, &further.with_creep()),
        ),
        ("nearest", nearest(&plain, targets, &further.rows)),
    ]
}

/// Rows of known targets over their deviation.
struct Scaled {
    rows: Vec<Vec<f64>>,
    known: Vec<f64>,
    /// Number of the run of each; of the fifth of the only one.
    of: Vec<usize>,
    /// Mean and deviation of each column.
    law: Vec<[f64; 2]>,
}

fn scaled(runs: &[Vec<Vec<f64>>], targets: &[Vec<f64>]) -> Scaled {
    let (mut rows, mut known, mut of) = (Vec::new(), Vec::new(), Vec::new());
    for (number, (run, target)) in runs.iter().zip(targets).enumerate() {
        for (row, target) in run
            .iter()
            .zip(target)
            .filter(|(_, target)| target.is_finite())
        {
            rows.push(row.clone());
            known.push(*target);
            of.push(number);
        }
    }
    if runs.len() == 1 {
        let count = of.len().max(1);
        for (at, of) in of.iter_mut().enumerate() {
            *of = 5 * at / count;
        }
    }
    let width = rows.first().map_or(0, Vec::len);
    let count = rows.len().max(1) as f64;
    let law = (0..width).map(|column| {
        let mean = rows.iter().map(|row| row[column]).sum::<f64>() / count;
        let square = rows
            .iter()
            .map(|row| (row[column] - mean).powi(2))
            .sum::<f64>();
        [mean, (square / count).sqrt() + 1e-9]
    });
    let law: Vec<[f64; 2]> = law.collect();
    for row in &mut rows {
        apply(&law, row);
    }
    Scaled {
        rows,
        known,
        of,
        law,
    }
}

fn apply(law: &[[f64; 2]], row: &mut [f64]) {
    for (value, [mean, deviation]) in row.iter_mut().zip(law) {
        *value = (*value - mean) / deviation;
    }
}

fn solved(gram: &Mat<f64>, moment: &Mat<f64>, prior: f64) -> Option<Mat<f64>> {
    let size = gram.nrows();
    let matrix = gram + prior * Mat::<f64>::identity(size, size);
    Some(matrix.llt(Side::Lower).ok()?.solve(moment))
}

/// A ridge whose prior predicts runs from the others best, or the fifths of the only one.
fn ridge(runs: &[Vec<Vec<f64>>], targets: &[Vec<f64>], further: &[Vec<f64>]) -> Vec<f64> {
    let Scaled {
        rows,
        known,
        of,
        law,
    } = scaled(runs, targets);
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let parts: Vec<(Mat<f64>, Mat<f64>)> = (0..=of.iter().copied().max().unwrap_or(0))
        .map(|group| {
            let own = |at: &usize| of[*at] == group;
            let at: Vec<usize> = (0..rows.len()).filter(own).collect();
            let x = Mat::from_fn(at.len(), law.len(), |i, j| rows[at[i]][j]);
            let y = Mat::from_fn(at.len(), 1, |i, _| known[at[i]] - mean);
            (x, y)
        })
        .collect();
    let zero = || {
        (
            Mat::<f64>::zeros(law.len(), law.len()),
            Mat::<f64>::zeros(law.len(), 1),
        )
    };
    let moments: Vec<_> = parts
        .iter()
        .map(|(x, y)| (x.transpose() * x, x.transpose() * y))
        .collect();
    let without = |out: Option<usize>| {
        let kept = moments
            .iter()
            .enumerate()
            .filter(|(group, _)| Some(*group) != out);
        kept.fold(zero(), |(g, m), (_, (gram, moment))| (g + gram, m + moment))
    };
    let error = |prior: f64| {
        let squares = parts.iter().enumerate().map(|(group, (x, y))| {
            let (gram, moment) = without(Some(group));
            solved(&gram, &moment, prior).map_or(f64::INFINITY, |w| (x * w - y).squared_norm_l2())
        });
        squares.sum::<f64>()
    };
    let priors = (-4..=4).map(|power| 10f64.powi(power));
    let best = priors
        .map(|prior| (error(prior), prior))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let (gram, moment) = without(None);
    let weights = best.and_then(|(_, prior)| solved(&gram, &moment, prior));
    let Some(weights) = weights else {
        return vec![f64::NAN; further.len()];
    };
    let estimate = |row: &Vec<f64>| {
        let mut row = row.clone();
        apply(&law, &mut row);
        mean + row
            .iter()
            .enumerate()
            .map(|(j, x)| x * weights[(j, 0)])
            .sum::<f64>()
    };
    further.iter().map(estimate).collect()
}

fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Gaussian kernels and a linear one of some rows; lengths and priors are those that predict the last run best.
fn kernels(runs: &[Vec<Vec<f64>>], targets: &[Vec<f64>], further: &[Vec<f64>]) -> Vec<f64> {
    let Scaled {
        rows,
        known,
        of,
        law,
    } = scaled(runs, targets);
    let last = of.iter().copied().max().unwrap_or(0);
    let step = rows.len().div_ceil(ROWS).max(1);
    let kept: Vec<usize> = (0..rows.len()).step_by(step).collect();
    let mut apart: Vec<f64> = kept
        .windows(8)
        .map(|w| square(&rows[w[0]], &rows[w[7]]).sqrt())
        .filter(|d| *d > 0.0)
        .collect();
    apart.sort_by(f64::total_cmp);
    let base = apart.get(apart.len() / 2).copied().unwrap_or(1.0);
    let width = law.len() as f64;
    let kernel = |a: &[f64], b: &[f64], length: f64| {
        let dot = a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        (-square(a, b) / (2.0 * length * length)).exp() + 0.3 * dot / width
    };
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let fitted = |centres: &[usize], length: f64, prior: f64| {
        let own: Vec<Vec<f64>> = centres.iter().map(|at| rows[*at].clone()).collect();
        let gram = Mat::from_fn(own.len(), own.len(), |i, j| {
            kernel(&own[i], &own[j], length)
        });
        let target = Mat::from_fn(own.len(), 1, |i, _| known[centres[i]] - mean);
        solved(&gram, &target, prior).map(|weights| {
            move |row: &[f64]| {
                mean + (0..own.len())
                    .map(|i| weights[(i, 0)] * kernel(row, &own[i], length))
                    .sum::<f64>()
            }
        })
    };
    let (learned, judged): (Vec<usize>, Vec<usize>) = kept.iter().partition(|at| of[**at] != last);
    let mut best = (f64::INFINITY, [base, 1e-2]);
    for length in [1.0, 3.0, 10.0].map(|times| times * base) {
        for prior in [1e-4, 1e-2, 1e-1] {
            let error = fitted(&learned, length, prior).map_or(f64::INFINITY, |map| {
                judged
                    .iter()
                    .map(|at| (map(&rows[*at]) - known[*at]).powi(2))
                    .sum()
            });
            if error < best.0 {
                best = (error, [length, prior]);
            }
        }
    }
    let [length, prior] = best.1;
    let Some(map) = fitted(&kept, length, prior) else {
        return vec![f64::NAN; further.len()];
    };
    let estimate = |row: &Vec<f64>| {
        let mut row = row.clone();
        apply(&law, &mut row);
        map(&row)
    };
    further.iter().map(estimate).collect()
}

/// Mean of the targets of the nearest rows.
fn nearest(runs: &[Vec<Vec<f64>>], targets: &[Vec<f64>], further: &[Vec<f64>]) -> Vec<f64> {
    let Scaled {
        rows, known, law, ..
    } = scaled(runs, targets);
    let step = rows.len().div_ceil(4 * ROWS).max(1);
    let estimate = |row: &Vec<f64>| {
        let mut row = row.clone();
        apply(&law, &mut row);
        let kept = rows.iter().zip(&known).step_by(step);
        let mut all: Vec<(f64, f64)> = kept
            .map(|(other, known)| (square(&row, other), *known))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let near = &all[..NEIGHBOURS.min(all.len())];
        near.iter().map(|(_, known)| known).sum::<f64>() / near.len().max(1) as f64
    };
    further.iter().map(estimate).collect()
}

/// The map that errs least, and its root mean square error.
pub(crate) fn best(
    estimates: &[(&'static str, Vec<f64>)],
    errs: impl Fn(&[f64]) -> f64,
) -> (&'static str, f64) {
    let all = estimates.iter().map(|(name, own)| (*name, errs(own)));
    all.min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or(("none", f64::NAN))
}
