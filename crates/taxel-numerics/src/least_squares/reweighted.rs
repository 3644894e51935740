//! Searches whose weights depend on how large the noise turns out to be.

use super::iteration::{Minimum, minimise};
use super::{FitError, FitOptions, Loss, NoiseSize, Parameter, Problem};

/// The noise has settled when it changes by less than this share.
const SETTLED: f64 = 1e-6;
const MOST_ROUNDS: usize = 30;
/// Median of |x| to standard deviation, for normal noise.
const MEDIAN_TO_DEVIATION: f64 = 1.482_602_218_505_602;

/// The minimum and the size of the noise.
///
/// Noise of unknown size matters to the search only where it is weighed
/// against something: a prior, or the threshold of a loss.
pub(super) fn search(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    freedom: usize,
) -> Result<(Minimum, f64), FitError> {
    let start: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    if options.noise == NoiseSize::Given {
        return Ok((minimise(problem, parameters, options, &start, 1.0)?, 1.0));
    }
    let plain = FitOptions {
        loss: Loss::Square,
        ..*options
    };
    let size = |minimum: &Minimum, noise: f64| match options.loss {
        Loss::Square => (minimum.square_sum(parameters, noise) / freedom as f64).sqrt(),
        _ => robust_deviation(&minimum.residuals, freedom),
    };
    let begun = initial_noise(problem, parameters, &start);
    let mut minimum = minimise(problem, parameters, &plain, &start, begun)?;
    let mut noise = size(&minimum, begun).max(f64::MIN_POSITIVE);
    let weighed = options.loss != Loss::Square || parameters.iter().any(|p| p.prior.is_some());
    for _ in 0..if weighed { MOST_ROUNDS } else { 0 } {
        let from = minimum.at.clone();
        minimum = minimise(problem, parameters, options, &from, noise)?;
        let before = noise;
        noise = size(&minimum, noise).max(f64::MIN_POSITIVE);
        if (noise - before).abs() <= SETTLED * noise {
            break;
        }
    }
    Ok((minimum, noise))
}

/// The size of the residuals at the start: priors are then weak at first.
fn initial_noise(problem: &dyn Problem, parameters: &[Parameter], start: &[f64]) -> f64 {
    if parameters.iter().all(|p| p.prior.is_none()) {
        return 1.0;
    }
    let mut residuals = vec![0.0; problem.readings()];
    problem.residuals(start, &mut residuals);
    let square: f64 = residuals.iter().map(|r| r * r).sum();
    let size = (square / residuals.len() as f64).sqrt();
    if size > 0.0 && size.is_finite() {
        size
    } else {
        1.0
    }
}

fn robust_deviation(residuals: &[f64], freedom: usize) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let lost = (residuals.len() as f64 / freedom as f64).sqrt();
    MEDIAN_TO_DEVIATION * lost * sizes[sizes.len() / 2]
}
