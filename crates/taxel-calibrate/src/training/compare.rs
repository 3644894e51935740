//! Maps straight from channels to a target, as yardsticks of the maps in use.

use taxel::trained::{
    GaussianProcess, Kernel, Moments, Polynomial, Ridge, Standard, TrainingError,
};

use super::{Nearest, Score, Session};

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

/// Rows that train and rows that test.
struct Split<'a> {
    frames: &'a [Vec<f64>],
    targets: &'a [Vec<f64>],
    tests: &'a [Vec<f64>],
    truth: &'a [Vec<f64>],
}

/// The yardsticks of a place: the last quarter of the frames tests those that
/// the rows before it trained.
///
/// # Errors
/// [`TrainingError`].
pub fn compared_places(
    frames: &[Vec<f64>],
    places: &[[f64; 2]],
) -> Result<Vec<Compared>, TrainingError> {
    let targets: Vec<Vec<f64>> = places.iter().map(|place| place.to_vec()).collect();
    let begin = frames.len() * 3 / 4;
    Split {
        frames: &frames[..begin],
        targets: &targets[..begin],
        tests: &frames[begin..],
        truth: &targets[begin..],
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
    Split {
        frames: &frames[..begin],
        targets: &forces[..begin],
        tests: &frames[begin..],
        truth: &forces[begin..],
    }
    .all(&[])
}

impl Split<'_> {
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

    /// A Gaussian process on rows evenly thinned.
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
        let process = GaussianProcess::observe(kernel, &thin(inputs), &thin(self.targets))?;
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        for (input, truth) in tests.iter().zip(self.truth) {
            let (means, variance) = process.estimate(input);
            for (mean, truth) in means.iter().zip(truth) {
                errors.push(mean - truth);
                deviations.push(variance.sqrt());
            }
        }
        Ok(compared("Gaussian process", &errors, &deviations))
    }
}

fn compared(name: &str, errors: &[f64], deviations: &[f64]) -> Compared {
    Compared {
        name: name.to_owned(),
        score: Score::of(errors, deviations),
    }
}
