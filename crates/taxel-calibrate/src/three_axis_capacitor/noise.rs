//! Deviations of the gauge along each axis and of the capacitances: given, or estimated from
//! the residuals.
//!
//! The covariance of the four misfits of a reading is V = Σ σ_k² D_k over the kinds k. The
//! residuals e of a fit have the covariance V − H, where H is what the fit follows; Fisher
//! scoring solves Σ_l tr(V⁻¹D_kV⁻¹D_l) σ_l² = eᵀV⁻¹D_kV⁻¹e + tr(V⁻¹D_kV⁻¹H) for all kinds
//! together, which is restricted maximum likelihood (Patterson and Thompson 1971). A gauge
//! moves four capacitances in three directions at most; the fourth is noise of the
//! capacitances alone and separates them.

use super::checks;
use super::problem::{Bench, CAPACITANCE, KINDS, Reading, Whitening};
use crate::loads::range;
use taxel_numerics::dense::{cholesky, cholesky_solve};
use taxel_numerics::least_squares::Fit;

/// Noise that is not given starts at this share of the largest force.
const FIRST: f64 = 0.01;
/// Most by which a variance changes in one step.
const MOST: f64 = 100.0;
/// Least noise of a capacitance over itself, and of a force over the largest:
/// readings without noise must not divide by zero.
const LEAST: f64 = 1e-9;
/// Steps of the scoring at most, and the relative change of a variance that ends it.
const STEPS: usize = 30;
const SETTLED: f64 = 1e-3;

type Matrix = [[f64; 4]; 4];

/// Deviations where the bench gives none, of each kind: N, F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Noise {
    pub(super) common: [f64; KINDS],
    least: [f64; KINDS],
}

/// One reading: whitened residuals, what the fit follows of their covariance, the covariance
/// that each kind of deviation one gives them, and the variances that are given.
struct Share {
    residuals: [f64; 4],
    followed: Matrix,
    by_kind: [Matrix; KINDS],
    given: [Option<f64>; KINDS],
}

impl Noise {
    pub(super) fn first(of: &[Reading], capacitance: f64) -> Self {
        let largest = |axis: usize| {
            let [low, high] = range(of.iter().map(|r| r.force[axis]));
            high.max(-low).max(f64::MIN_POSITIVE)
        };
        let force = [0, 1, 2].map(largest).into_iter().fold(0.0, f64::max);
        let rest = checks::rest_of(of).into_iter().fold(0.0, f64::max);
        let (mut common, mut least) = ([FIRST * force; KINDS], [LEAST * force; KINDS]);
        (common[CAPACITANCE], least[CAPACITANCE]) = (capacitance, LEAST * rest);
        Self { common, least }
    }

    /// Deviations of each kind of each reading.
    pub(super) fn of(&self, of: &[Reading]) -> Vec<[f64; KINDS]> {
        let deviations =
            |r: &Reading| std::array::from_fn(|k| r.deviation[k].unwrap_or(self.common[k]));
        of.iter().map(deviations).collect()
    }

    /// Size of the misfit: χ² in the noise that was found, so that fits with their own
    /// noises can be compared.
    pub(super) fn size(&self, of: &[Reading], found: &Fit) -> f64 {
        if is_given(of) {
            return found.chi_square;
        }
        let pairs = self.common.iter().zip(self.least);
        pairs.map(|(common, least)| (common / least).ln()).sum()
    }

    /// Replaces what is not given by what the residuals of a fit show; the largest
    /// relative change of a deviation.
    pub(super) fn weigh_again(&mut self, of: &[Reading], bench: &Bench, found: &Fit) -> f64 {
        let shares = shares(of, bench, found);
        let unknown: Vec<usize> = (0..KINDS)
            .filter(|kind| shares.iter().any(|share| share.reads(*kind)))
            .collect();
        let mut variances = self.common.map(|deviation| deviation * deviation);
        for _ in 0..STEPS {
            let Some(next) = scored(&shares, &unknown, variances) else {
                break;
            };
            let mut changed = 0.0_f64;
            for kind in &unknown {
                let before = variances[*kind];
                variances[*kind] = next[*kind].max(self.least[*kind].powi(2));
                changed = changed.max((variances[*kind] / before - 1.0).abs());
            }
            if changed < SETTLED {
                break;
            }
        }
        let mut changed = 0.0_f64;
        for kind in unknown {
            let before = self.common[kind];
            self.common[kind] = variances[kind].sqrt();
            changed = changed.max((self.common[kind] / before - 1.0).abs());
        }
        changed
    }
}

impl Share {
    /// True if the reading has a noise of this kind that is not given.
    fn reads(&self, kind: usize) -> bool {
        self.given[kind].is_none() && self.by_kind[kind] != [[0.0; 4]; 4]
    }
}

/// The readings with the share of each kind in the covariance of their residuals.
fn shares(of: &[Reading], bench: &Bench, found: &Fit) -> Vec<Share> {
    let slopes = bench.whitened_slopes(&found.values());
    let covariance = &found.covariance;
    let scale = found.scale.powi(-2);
    let one = |(index, (reading, whitening)): (usize, (&Reading, &Whitening))| {
        let rows = |k: usize| slopes.iter().map(move |column| column[4 * index + k]);
        let followed = std::array::from_fn(|a| {
            let by_parameters: Vec<f64> = covariance
                .iter()
                .map(|row| row.iter().zip(rows(a)).map(|(c, slope)| c * slope).sum())
                .collect();
            std::array::from_fn(|b| {
                let pairs = by_parameters.iter().zip(rows(b));
                scale * pairs.map(|(x, slope)| x * slope).sum::<f64>()
            })
        });
        Share {
            residuals: std::array::from_fn(|k| found.residuals[4 * index + k]),
            followed,
            by_kind: whitening.unit_covariances(),
            given: reading.deviation.map(|given| Some(given?.powi(2))),
        }
    };
    let pairs = of.iter().zip(bench.whitening());
    pairs.enumerate().map(one).collect()
}

/// Variances of the kinds `unknown` after one step from `variances`; `None` where they
/// cannot be separated.
fn scored(shares: &[Share], unknown: &[usize], variances: [f64; KINDS]) -> Option<[f64; KINDS]> {
    let mut information = [[0.0; KINDS]; KINDS];
    let mut score = [0.0; KINDS];
    for share in shares {
        let of = |kind: usize| share.given[kind].unwrap_or(variances[kind]);
        let mut all = [[0.0; 4]; 4];
        for kind in 0..KINDS {
            add(&mut all, of(kind), &share.by_kind[kind]);
        }
        let inverse = inverse(&all)?;
        for kind in (0..KINDS).filter(|kind| share.reads(*kind)) {
            let inner = times(&inverse, &times(&share.by_kind[kind], &inverse));
            let mut seen = share.followed;
            add(&mut seen, 1.0, &outer(share.residuals));
            score[kind] += trace(&inner, &seen);
            let others = share.by_kind.iter().zip(share.given);
            for (entry, (by_other, given)) in information[kind].iter_mut().zip(others) {
                let part = trace(&inner, by_other);
                match given {
                    Some(given) => score[kind] -= part * given,
                    None => *entry += part,
                }
            }
        }
    }
    // A variance that would fall too far stays at the least one, and the others follow.
    let (mut next, mut open) = (variances, unknown.to_vec());
    while !open.is_empty() {
        let entry = |row: usize, column: usize| {
            let scale = variances[row] * variances[column];
            information[row][column] * scale
        };
        let matrix = open
            .iter()
            .map(|a| open.iter().map(|b| entry(*a, *b)).collect());
        let right = |kind: &usize| {
            let closed = unknown.iter().filter(|other| !open.contains(other));
            let known: f64 = closed
                .map(|other| information[*kind][*other] * next[*other])
                .sum();
            variances[*kind] * (score[*kind] - known)
        };
        let right: Vec<f64> = open.iter().map(right).collect();
        let ratios = cholesky_solve(&cholesky(matrix.collect())?, &right);
        let pairs: Vec<(usize, f64)> = open.iter().copied().zip(ratios).collect();
        let low = pairs.iter().find(|(_, ratio)| ratio * MOST < 1.0);
        if let Some((kind, _)) = low {
            next[*kind] = variances[*kind] / MOST;
            open.retain(|other| other != kind);
            continue;
        }
        for (kind, ratio) in pairs {
            next[kind] = variances[kind] * ratio.min(MOST);
        }
        break;
    }
    Some(next)
}

fn add(sum: &mut Matrix, factor: f64, of: &Matrix) {
    for (sum, of) in sum.as_flattened_mut().iter_mut().zip(of.as_flattened()) {
        *sum += factor * of;
    }
}

fn outer(of: [f64; 4]) -> Matrix {
    of.map(|a| of.map(|b| a * b))
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| std::array::from_fn(|k| (0..4).map(|i| row[i] * b[i][k]).sum()))
}

/// Trace of the product of two symmetric matrices.
fn trace(a: &Matrix, b: &Matrix) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| a * b).sum()
}

fn inverse(of: &Matrix) -> Option<Matrix> {
    let factor = cholesky(of.iter().map(|row| row.to_vec()).collect())?;
    let column = |k: usize| {
        let unit: Vec<f64> = (0..4).map(|i| f64::from(u8::from(i == k))).collect();
        let column = cholesky_solve(&factor, &unit);
        std::array::from_fn(|i| column[i])
    };
    Some([0, 1, 2, 3].map(column))
}

/// True if the bench gives the deviations of all readings.
pub(super) fn is_given(of: &[Reading]) -> bool {
    let gauged = |r: &Reading, axis: usize| !r.gauged[axis] || r.deviation[axis].is_some();
    of.iter()
        .all(|r| r.deviation[CAPACITANCE].is_some() && (0..3).all(|axis| gauged(r, axis)))
}
