//! Shared by the tests of several calibrators.

use rayon::prelude::*;

use crate::hysteresis::{self, Loops};
use crate::split::HoldOut;
use crate::{CalibrateOptions, CalibrationFile, NamedSensor, Outcome, Provenance};
use taxel::mechanics::REVERSALS;
use taxel::sensor::Sensor;
use taxel_numerics::least_squares::{Estimate, Parameter, Problem, Status};

pub(crate) fn no_hold_out() -> CalibrateOptions {
    CalibrateOptions {
        hold_out: HoldOut::None,
        ..CalibrateOptions::default()
    }
}

/// The calibration file of an outcome, read back from its text.
pub(crate) fn file(outcome: &Outcome) -> CalibrationFile {
    let about = Provenance {
        version: "0",
        date: "2000-01-01",
        data: "bench.csv",
        data_hash: "00",
    };
    CalibrationFile::parse("calibration.toml", &outcome.to_toml(&about)).unwrap()
}

/// A sensor without a file.
pub(crate) fn unnamed(sensor: &Sensor) -> NamedSensor<'_> {
    NamedSensor {
        name: "sensor",
        text: "",
        sensor,
    }
}

/// `sensor` after the calibration, by way of its file.
pub(crate) fn calibrated(outcome: &Outcome, sensor: &Sensor) -> Sensor {
    let file = file(outcome);
    file.apply("calibration.toml", &unnamed(sensor)).unwrap()
}

/// Slopes of the residuals of a problem for the parameters `at` by differences over
/// `steps`, a column for each parameter beside that of the problem.
pub(crate) fn slopes_and_differences(
    problem: &dyn Problem,
    parameters: &[Parameter],
    at: &[f64],
    steps: &[f64],
) -> Vec<[Vec<f64>; 2]> {
    let mut columns = vec![vec![0.0; problem.readings()]; at.len()];
    assert!(problem.slopes(parameters, at, &mut columns));
    let differences = |j: usize| -> Vec<f64> {
        let side = |sign: f64| {
            let mut moved = at.to_vec();
            moved[j] += sign * steps[j];
            let mut residuals = vec![0.0; problem.readings()];
            assert!(problem.residuals(&moved, &mut residuals));
            residuals
        };
        let pairs = side(1.0).into_iter().zip(side(-1.0));
        pairs
            .map(|(high, low)| (high - low) / (2.0 * steps[j]))
            .collect()
    };
    let pairs = columns.into_iter().enumerate();
    pairs.map(|(j, column)| [column, differences(j)]).collect()
}

/// Number of `runs` intervals that hold each truth.
pub(crate) fn covered(
    runs: u64,
    truth: &[f64],
    run: impl Fn(u64) -> Vec<Estimate> + Sync,
) -> Vec<usize> {
    let held = |seed: u64| -> Vec<usize> {
        let pairs = run(seed).into_iter().zip(truth);
        pairs
            .map(|(found, truth)| {
                usize::from((found.interval[0]..=found.interval[1]).contains(truth))
            })
            .collect()
    };
    let add = |mut sum: Vec<usize>, held: Vec<usize>| {
        sum.iter_mut().zip(held).for_each(|(sum, one)| *sum += one);
        sum
    };
    let none = || vec![0; truth.len()];
    (0..runs).into_par_iter().map(held).reduce(none, add)
}

/// Shares of a load at which the width of a loop is asked for: far enough from the turn
/// that the noise of where it turned is small beside the way back.
pub(crate) const LEFT: [f64; 3] = [0.7, 0.5, 0.3];

/// Lags of the plays where a load has come back to this share of where it
/// turned.
fn lags(left: f64) -> [f64; REVERSALS.len()] {
    REVERSALS.map(|width| (2.0 * width).min(-f64::ln(left)))
}

/// Hysteresis loss of synthetic data at each of [`LEFT`], as a share on the logarithm.
pub(crate) fn lost_on_bench(hysteresis: f64) -> Vec<f64> {
    let law = hysteresis::synthetic(hysteresis);
    let lost = |left| -law.share(&lags(left)).ln();
    LEFT.into_iter().map(lost).collect()
}

/// Hysteresis loss there of the loops that were found, with the 95 % interval that their
/// covariance gives.
pub(crate) fn lost(found: &Loops) -> Vec<Estimate> {
    let lost = |left| {
        let lags = lags(left);
        let pairs = found.parameters.iter().zip(&lags);
        let value: f64 = pairs.map(|((_, weight), lag)| weight.value * lag).sum();
        let rows = found.covariance.iter().zip(&lags);
        let row = |row: &Vec<f64>| row.iter().zip(&lags).map(|(c, lag)| c * lag).sum::<f64>();
        let variance: f64 = rows.map(|(covariance, lag)| lag * row(covariance)).sum();
        let half = 1.96 * variance.sqrt();
        Estimate {
            value,
            deviation: variance.sqrt(),
            interval: [value - half, value + half],
            status: Status::Identified,
        }
    };
    LEFT.into_iter().map(lost).collect()
}
