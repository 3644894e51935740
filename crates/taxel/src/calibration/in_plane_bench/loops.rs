//! What unloading carries less than loading: the hysteresis of one sensor from
//! slow loops, beside the curve of loading.

use super::super::fit::{Fit, FitOptions, NoiseSize, Parameter, Prior, Problem, fit};
use super::super::split::{Branch, branches, picked};
use super::problem::Reading;
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{ForceHysteresis, LoadHistory, REVERSALS};
use crate::transduction::InPlaneModel;

/// Number of weights.
pub(super) const WEIGHTS: usize = REVERSALS.len();

/// Name of a weight in the calibration file, without the sensor's prefix.
pub(super) fn name(weight: usize) -> String {
    format!("hysteresis_{}", weight + 1)
}

/// A hysteresis that was found.
pub(super) struct Loops {
    pub(super) parameters: Vec<Parameter>,
    pub(super) fit: Fit,
    /// What it is worth, in words.
    pub(super) about: String,
    pub(super) figure: Figure,
}

/// One reading: force of loading by its capacitance, lags, gauge's force, N,
/// and whether it is of unloading.
#[derive(Debug, Clone, Copy)]
struct Sample {
    loading: f64,
    lags: [f64; WEIGHTS],
    force: f64,
    unloading: bool,
}

impl Sample {
    fn error(&self, law: &ForceHysteresis) -> f64 {
        self.force - self.loading * law.share(&self.lags)
    }
}

/// Readings as a problem in the weights; errors are over the largest force.
struct Weights<'a> {
    samples: &'a [Sample],
    largest: f64,
}

impl Problem for Weights<'_> {
    fn readings(&self) -> usize {
        self.samples.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let law = law(at);
        for (residual, sample) in residuals.iter_mut().zip(self.samples) {
            *residual = sample.error(&law) / self.largest;
        }
        true
    }
}

/// Fewer readings of unloading tell no loop.
const LEAST: usize = 16;
/// A hysteresis is kept when it leaves less than this share of the error of
/// readings that it has not seen.
const WORTH: f64 = 0.8;
/// A weight beyond this share lost per reversal belongs to no rubber.
const LARGEST_LOSS: f64 = 0.5;

/// The hysteresis of the sensor that reads as `model` does on loading, from
/// readings in their order; `None` when there is no unloading, or a hysteresis
/// does not explain it. `held` says which readings are held out.
pub(super) fn identify(
    model: &InPlaneModel,
    readings: &[Reading],
    held: &[bool],
    prefix: &str,
) -> Option<Loops> {
    let samples = samples(model, readings)?;
    let largest = samples.iter().map(|one| one.force).fold(0.0, f64::max);
    let of = |wanted| picked(&samples, held, wanted);
    let (seen, unseen) = (of(false), of(true));
    let [trained, all] = [&seen, &samples].map(|of| weights(of, largest, prefix));
    let ((_, trained), (parameters, found)) = (trained?, all?);
    let none = ForceHysteresis {
        weights: [0.0; WEIGHTS],
    };
    let judged = if width(&unseen, &none).is_some() {
        &unseen
    } else {
        &samples
    };
    let [before, after] = [&none, &law(&trained.values())].map(|law| width(judged, law));
    let [before, after] = [before? / largest, after? / largest];
    if after > WORTH * before {
        return None;
    }
    let kept = law(&found.values());
    let about = format!(
        "unloading carries less; without hysteresis the force of held-out unloading is off by {:.1} % of the largest \
         (root mean square), with it by {:.1} %",
        100.0 * before,
        100.0 * after
    );
    Some(Loops {
        figure: figure(&samples, &kept, prefix),
        parameters,
        fit: found,
        about,
    })
}

fn law(at: &[f64]) -> ForceHysteresis {
    ForceHysteresis {
        weights: std::array::from_fn(|j| at[j]),
    }
}

/// Root of the mean square error of the force on unloading, N.
fn width(samples: &[Sample], law: &ForceHysteresis) -> Option<f64> {
    let errors = samples.iter().filter(|one| one.unloading);
    let errors: Vec<f64> = errors.map(|one| one.error(law)).collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    (errors.len() >= LEAST / 2).then(|| (squares / errors.len() as f64).sqrt())
}

fn samples(model: &InPlaneModel, readings: &[Reading]) -> Option<Vec<Sample>> {
    let loads: Vec<f64> = readings
        .iter()
        .map(|one| one.displacement.unwrap_or(one.force))
        .collect();
    let branches = branches(&loads);
    let down = |branch: &&Branch| **branch == Branch::Unloading;
    if branches.iter().filter(down).count() < LEAST {
        return None;
    }
    let inverse = model.inverse().ok()?;
    let last = inverse.last().change;
    let mut history = LoadHistory::default();
    let sample = |(reading, branch): (&Reading, &Branch)| {
        let change = model.rest_capacitance() - reading.capacitance;
        let loading = inverse.force_from_change(change.min(last));
        Sample {
            loading,
            lags: history.push(loading),
            force: reading.force,
            unloading: *branch == Branch::Unloading,
        }
    };
    Some(readings.iter().zip(&branches).map(sample).collect())
}

fn weights(samples: &[Sample], largest: f64, prefix: &str) -> Option<(Vec<Parameter>, Fit)> {
    let parameter = |j: usize| {
        let most = LARGEST_LOSS / (2.0 * REVERSALS[j]);
        Parameter {
            // A body gives back no more than it took.
            bounds: [0.0, most],
            size: 0.01 * most,
            // No loop reaches a play that is wider than it: no loss there.
            prior: Some(Prior {
                value: 0.0,
                deviation: most,
            }),
            ..Parameter::new(format!("{prefix}{}", name(j)), 0.01 * most)
        }
    };
    let parameters: Vec<Parameter> = (0..WEIGHTS).map(parameter).collect();
    let options = FitOptions {
        noise: NoiseSize::Estimated,
        ..FitOptions::default()
    };
    let found = fit(&Weights { samples, largest }, &parameters, &options).ok()?;
    Some((parameters, found))
}

fn figure(samples: &[Sample], law: &ForceHysteresis, prefix: &str) -> Figure {
    let marks = |name: &str, law: ForceHysteresis| {
        let error = |one: &Sample| [one.force, -one.error(&law)];
        Series::new(name, samples.iter().map(error).collect(), Style::Marks)
    };
    let none = ForceHysteresis {
        weights: [0.0; WEIGHTS],
    };
    Figure {
        title: format!(
            "{}: hysteresis",
            prefix.trim_end_matches('.').replace('_', " ")
        ),
        charts: vec![Chart {
            title: "Error of the force".into(),
            x: Axis::new("force", "N"),
            y: Axis::new("error", "N"),
            series: vec![marks("loading curve", none), marks("with hysteresis", *law)],
        }],
        caption: "Force from the capacitance less that of the gauge, loading and unloading.".into(),
    }
}
