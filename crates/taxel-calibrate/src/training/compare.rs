//! Maps straight from channels to a target, as yardsticks of the maps in use.

use taxel::trained::{
    GaussianProcess, Kernel, Moments, Polynomial, Ridge, Standard, TrainingError,
};

use super::network::Network;
use super::{Nearest, PlacedRows, Score, Session, interval_factor};

/// A map beside others, with its held-out score.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// Name of the method.
    pub name: String,
    /// Score of the held-out rows.
    pub score: Score,
}

/// Rows a Gaussian process observes at most; its time grows with their cube.
const PROCESS_ROWS: usize = 600;
/// Products that a polynomial has at most.
const MOST_PRODUCTS: usize = 900;
/// Neighbours, and the prior of a polynomial.
const NEIGHBOURS: usize = 5;
const PRIOR: f64 = 1e-2;
/// Rows of a local polynomial for each channel.
const LOCAL_ROWS: usize = 4;
/// Rows that the lengths of a Gaussian process are found with.
const LENGTH_ROWS: usize = 200;
/// Seed of the neural network.
const SEED: u64 = 1;

/// Rows that train and rows that test.
struct Parts<'a> {
    frames: &'a [Vec<f64>],
    targets: &'a [Vec<f64>],
    tests: &'a [Vec<f64>],
    truth: &'a [Vec<f64>],
}

/// The yardsticks of a place: rows test those that the others trained.
///
/// # Errors
/// [`TrainingError`].
pub(crate) fn compared_places(
    train: &PlacedRows,
    test: &PlacedRows,
) -> Result<Vec<Compared>, TrainingError> {
    let targets = |rows: &PlacedRows| -> Vec<Vec<f64>> {
        rows.places
            .iter()
            .map(|place| place[..2].to_vec())
            .collect()
    };
    Parts {
        frames: &train.frames,
        targets: &targets(train),
        tests: &test.frames,
        truth: &targets(test),
    }
    .all(&[1, 2, 3])
}

/// The yardsticks of a force without memory: the last run tests those that the
/// others trained, or the last quarter of a single run. `offset` (s) is by how
/// much the scale comes after the sensor. Polynomials are among the candidates
/// of the map itself.
///
/// # Errors
/// [`TrainingError`].
pub fn compared_forces(runs: &[Session], offset: f64) -> Result<Vec<Compared>, TrainingError> {
    let (mut frames, mut forces) = (Vec::new(), Vec::new());
    let mut begin = 0;
    for run in runs {
        begin = frames.len();
        let baseline = run.baseline();
        let reach = run.sensor.longest_step();
        let readings = run
            .force
            .iter()
            .flat_map(|f| f.times().iter().zip(f.rows()));
        for (time, force) in readings {
            if let Some(frame) = run.sensor.at(time - offset, reach) {
                frames.push(frame.iter().zip(&baseline).map(|(x, b)| x - b).collect());
                forces.push(force.clone());
            }
        }
    }
    if begin == 0 {
        begin = frames.len() * 3 / 4;
    }
    Parts {
        frames: &frames[..begin],
        targets: &forces[..begin],
        tests: &frames[begin..],
        truth: &forces[begin..],
    }
    .all(&[])
}

impl Parts<'_> {
    fn all(&self, degrees: &[u8]) -> Result<Vec<Compared>, TrainingError> {
        let standard = Standard::of(self.frames)?;
        let scaled = |rows: &[Vec<f64>]| -> Result<Vec<Vec<f64>>, TrainingError> {
            rows.iter().map(|row| standard.apply(row)).collect()
        };
        let (inputs, tests) = (scaled(self.frames)?, scaled(self.tests)?);
        let mut all = vec![self.neighbours()?];
        for degree in degrees {
            all.extend(self.polynomial(*degree, &inputs, &tests)?);
        }
        all.push(self.process(&inputs, &tests)?);
        all.push(self.local(&inputs, &tests)?);
        all.push(self.network(&inputs, &tests));
        Ok(all)
    }

    /// Mean and deviation of the targets: what is known without any channel.
    fn spread(&self) -> f64 {
        let width = self.targets.first().map_or(1, Vec::len);
        let count = self.targets.len() as f64;
        let variance = |j: usize| {
            let mean = self.targets.iter().map(|row| row[j]).sum::<f64>() / count;
            self.targets
                .iter()
                .map(|row| (row[j] - mean).powi(2))
                .sum::<f64>()
                / count
        };
        ((0..width).map(variance).sum::<f64>() / width as f64).sqrt()
    }

    fn neighbours(&self) -> Result<Compared, TrainingError> {
        let nearest = Nearest::train(self.frames, self.targets, NEIGHBOURS)?;
        // Neighbours at one place have no spread.
        let least = 0.01 * self.spread();
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        for (frame, truth) in self.tests.iter().zip(self.truth) {
            for ([mean, variance], truth) in nearest.estimate(frame)?.iter().zip(truth) {
                errors.push(mean - truth);
                deviations.push(variance.sqrt().max(least));
            }
        }
        Ok(compared("five nearest neighbours", &errors, &deviations))
    }

    /// `None` for more products than rows determine.
    fn polynomial(
        &self,
        degree: u8,
        inputs: &[Vec<f64>],
        tests: &[Vec<f64>],
    ) -> Result<Option<Compared>, TrainingError> {
        let expand = |row: &Vec<f64>| {
            let mut features = Vec::new();
            Polynomial { degree }.expand(row, &mut features);
            features
        };
        let features: Vec<Vec<f64>> = inputs.iter().map(expand).collect();
        let count = features.first().map_or(0, Vec::len);
        if count > MOST_PRODUCTS.min(features.len()) {
            return Ok(None);
        }
        let tests: Vec<Vec<f64>> = tests.iter().map(expand).collect();
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        for axis in 0..self.truth.first().map_or(0, Vec::len) {
            let target: Vec<f64> = self.targets.iter().map(|row| row[axis]).collect();
            let ridge = Ridge::fit(&Moments::of(&features, &target)?, PRIOR)?;
            for (row, truth) in tests.iter().zip(self.truth) {
                errors.push(ridge.mean(row) - truth[axis]);
                let variance = ridge.noise_variance() * (1.0 + ridge.leverage(row));
                deviations.push(variance.sqrt());
            }
        }
        let name = format!("polynomial ridge of degree {degree}");
        Ok(Some(compared(&name, &errors, &deviations)))
    }

    /// A polynomial of first degree through the nearest rows.
    fn local(&self, inputs: &[Vec<f64>], tests: &[Vec<f64>]) -> Result<Compared, TrainingError> {
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        let with_one = |row: &[f64]| [&[1.0], row].concat();
        for (input, truth) in tests.iter().zip(self.truth) {
            let distance = |row: &Vec<f64>| -> f64 {
                row.iter().zip(input).map(|(a, b)| (a - b).powi(2)).sum()
            };
            let mut order: Vec<(f64, usize)> = inputs.iter().map(distance).zip(0..).collect();
            let count = (LOCAL_ROWS * input.len()).min(order.len());
            order.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
            let near = &order[..count];
            let features: Vec<Vec<f64>> = near
                .iter()
                .map(|(_, row)| with_one(&inputs[*row]))
                .collect();
            let at = with_one(input);
            for (axis, truth) in truth.iter().enumerate() {
                let target: Vec<f64> = near
                    .iter()
                    .map(|(_, row)| self.targets[*row][axis])
                    .collect();
                let ridge = Ridge::fit(&Moments::of(&features, &target)?, PRIOR)?;
                errors.push(ridge.mean(&at) - truth);
                let variance = ridge.noise_variance() * (1.0 + ridge.leverage(&at));
                deviations.push(variance.sqrt());
            }
        }
        Ok(compared(
            "local polynomial of degree 1",
            &errors,
            &deviations,
        ))
    }

    /// A neural network on scaled targets; one deviation for all.
    fn network(&self, inputs: &[Vec<f64>], tests: &[Vec<f64>]) -> Compared {
        let width = self.targets.first().map_or(1, Vec::len);
        let count = self.targets.len() as f64;
        let mean = |j: usize| self.targets.iter().map(|row| row[j]).sum::<f64>() / count;
        let means: Vec<f64> = (0..width).map(mean).collect();
        let spread = self.spread();
        let scaled = |row: &Vec<f64>| -> Vec<f64> {
            row.iter()
                .zip(&means)
                .map(|(y, mean)| (y - mean) / spread)
                .collect()
        };
        let targets: Vec<Vec<f64>> = self.targets.iter().map(scaled).collect();
        let network = Network::train(inputs, &targets, SEED);
        let mut errors = Vec::new();
        for (input, truth) in tests.iter().zip(self.truth) {
            let estimates = network.estimate(input);
            for ((estimate, mean), truth) in estimates.iter().zip(&means).zip(truth) {
                errors.push(mean + spread * estimate - truth);
            }
        }
        let deviations = vec![spread; errors.len()];
        compared("neural network of two layers", &errors, &deviations)
    }

    /// Lengths of the channels of a Gaussian process, over one for all: by steps that raise the
    /// likelihood of few rows.
    fn lengths(&self, kernel: Kernel, inputs: &[Vec<f64>]) -> Result<Vec<f64>, TrainingError> {
        let step = inputs.len().div_ceil(LENGTH_ROWS).max(1);
        let rows: Vec<&Vec<f64>> = inputs.iter().step_by(step).collect();
        let targets: Vec<Vec<f64>> = self.targets.iter().step_by(step).cloned().collect();
        let width = inputs.first().map_or(0, Vec::len);
        let likelihood = |lengths: &[f64]| -> Result<f64, TrainingError> {
            let rows: Vec<Vec<f64>> = rows.iter().map(|row| over(row, lengths)).collect();
            Ok(GaussianProcess::observe(kernel, &rows, &targets)?.log_likelihood())
        };
        let mut lengths = vec![1.0; width];
        let mut best = likelihood(&lengths)?;
        for factor in [3.0, 1.7, 1.7] {
            for channel in 0..width {
                for change in [factor, 1.0 / factor] {
                    let mut tried = lengths.clone();
                    tried[channel] *= change;
                    let found = likelihood(&tried)?;
                    if found > best {
                        (best, lengths) = (found, tried);
                    }
                }
            }
        }
        Ok(lengths)
    }

    /// A Gaussian process with a length for each channel, on rows evenly thinned.
    fn process(&self, inputs: &[Vec<f64>], tests: &[Vec<f64>]) -> Result<Compared, TrainingError> {
        let step = inputs.len().div_ceil(PROCESS_ROWS).max(1);
        let thin =
            |rows: &[Vec<f64>]| -> Vec<Vec<f64>> { rows.iter().step_by(step).cloned().collect() };
        let spread = self.spread();
        let kernel = Kernel {
            deviation: spread,
            length: 2.0,
            slope: 0.1 * spread,
            noise: 0.03 * spread,
        };
        let lengths = self.lengths(kernel, inputs)?;
        let rows: Vec<Vec<f64>> = thin(inputs).iter().map(|row| over(row, &lengths)).collect();
        let process = GaussianProcess::observe(kernel, &rows, &thin(self.targets))?;
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        for (input, truth) in tests.iter().zip(self.truth) {
            let (means, variance) = process.estimate(&over(input, &lengths));
            for (mean, truth) in means.iter().zip(truth) {
                errors.push(mean - truth);
                deviations.push(variance.sqrt());
            }
        }
        Ok(compared(
            "Gaussian process with a length for each channel",
            &errors,
            &deviations,
        ))
    }
}

fn over(row: &[f64], lengths: &[f64]) -> Vec<f64> {
    row.iter()
        .zip(lengths)
        .map(|(z, length)| z / length)
        .collect()
}

/// The score with intervals that hold 95 % of the errors, as those of the maps in use.
fn compared(name: &str, errors: &[f64], deviations: &[f64]) -> Compared {
    let factor = interval_factor(errors, deviations);
    let deviations: Vec<f64> = deviations.iter().map(|one| factor * one).collect();
    Compared {
        name: name.to_owned(),
        score: Score::of(errors, &deviations),
    }
}
