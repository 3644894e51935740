//! The least-squares engine against certified values of the NIST Statistical
//! Reference Datasets (nonlinear regression), from both of their starts.
#![allow(clippy::unwrap_used)]

use taxel_numerics::least_squares::{FitOptions, NoiseSize, Parameter, Problem, fit};

struct Certified {
    model: fn(&[f64], f64) -> f64,
    points: Vec<[f64; 2]>,
}

impl Problem for Certified {
    fn readings(&self) -> usize {
        self.points.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        for (residual, [x, y]) in residuals.iter_mut().zip(&self.points) {
            *residual = y - (self.model)(at, *x);
        }
        residuals.iter().all(|residual| residual.is_finite())
    }
}

/// Relative agreement asked for: the certified values have 11 digits; the
/// slopes here are differences of a relative error of 1e-10, and the columns
/// of these problems lose up to four more digits to one another.
const VALUES: f64 = 1e-6;
const DEVIATIONS: f64 = 1e-5;

fn check(text: &str, model: fn(&[f64], f64) -> f64) {
    let mut rows = Vec::new();
    let mut square_sum = 0.0;
    let mut points = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (head, rest) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = rest.split(',').map(|f| f.parse().unwrap()).collect();
        match head {
            "b" => rows.push(numbers),
            "rss" => square_sum = numbers[0],
            x => points.push([x.parse().unwrap(), numbers[0]]),
        }
    }
    let problem = Certified { model, points };
    let options = FitOptions {
        noise: NoiseSize::Estimated,
        iterations: 5000,
        ..FitOptions::default()
    };
    for start in [0, 1] {
        let parameters: Vec<_> = rows
            .iter()
            .map(|row| Parameter::new("b", row[start]))
            .collect();
        let found = fit(&problem, &parameters, &options).unwrap();
        let context = format!("start {start}, {:?} after {}", found.stop, found.iterations);
        let ratio = found.chi_square / square_sum;
        assert!((ratio - 1.0).abs() < 1e-8, "{context}: sum {ratio}");
        for (estimate, row) in found.estimates.iter().zip(&rows) {
            let value = estimate.value / row[2] - 1.0;
            let deviation = estimate.deviation / row[3] - 1.0;
            assert!(value.abs() < VALUES, "{context}: value {value:.1e}");
            assert!(
                deviation.abs() < DEVIATIONS,
                "{context}: deviation {deviation:.1e}"
            );
        }
    }
}

#[test]
fn misra1a() {
    check(include_str!("reference/nist/misra1a.csv"), |b, x| {
        b[0] * (1.0 - (-b[1] * x).exp())
    });
}

#[test]
fn thurber() {
    check(include_str!("reference/nist/thurber.csv"), |b, x| {
        (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1.0 + x * (b[4] + x * (b[5] + x * b[6])))
    });
}

#[test]
fn mgh09() {
    check(include_str!("reference/nist/mgh09.csv"), |b, x| {
        b[0] * (x * x + x * b[1]) / (x * x + x * b[2] + b[3])
    });
}

#[test]
fn rat43() {
    check(include_str!("reference/nist/rat43.csv"), |b, x| {
        b[0] / (1.0 + (b[1] - b[2] * x).exp()).powf(1.0 / b[3])
    });
}

#[test]
fn eckerle4() {
    check(include_str!("reference/nist/eckerle4.csv"), |b, x| {
        b[0] / b[1] * (-0.5 * ((x - b[2]) / b[1]).powi(2)).exp()
    });
}

#[test]
fn hahn1() {
    check(include_str!("reference/nist/hahn1.csv"), |b, x| {
        (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1.0 + x * (b[4] + x * (b[5] + x * b[6])))
    });
}
