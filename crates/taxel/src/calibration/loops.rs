//! What unloading carries less than loading: the hysteresis of a device from
//! slow loops, beside the curve of its model.

use super::fit::{Estimate, FitOptions, NoiseSize, Parameter, Prior, Problem, fit};
use super::split::{Branch, branches, picked};
use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::mechanics::{ForceHysteresis, LoadHistory, REVERSALS};

/// Number of weights.
pub(super) const WEIGHTS: usize = REVERSALS.len();

/// Name of a weight in the calibration file behind `prefix`.
fn name(prefix: &str, weight: usize) -> String {
    format!("{prefix}hysteresis_{}", weight + 1)
}

/// The law of a calibration file whose weights are named behind `prefix`: of
/// one weight there are all, or none was told.
pub(super) fn law_of(prefix: &str, value: &dyn Fn(&str) -> Option<f64>) -> Option<ForceHysteresis> {
    let weights = (0..WEIGHTS).map(|j| value(&name(prefix, j)));
    let weights: Vec<f64> = weights.collect::<Option<_>>()?;
    Some(law(&weights))
}

/// The law of a synthetic bench whose loading carries more than unloading by
/// `hysteresis`: half of it is lost within 6 % of the load behind a turn, all
/// within 20 %.
pub(super) fn synthetic(hysteresis: f64) -> ForceHysteresis {
    let mut law = law(&[0.0; WEIGHTS]);
    for j in [1, 2] {
        law.weights[j] = 0.5 * hysteresis.ln_1p() / (2.0 * REVERSALS[j]);
    }
    law
}

/// A hysteresis that was found.
pub(super) struct Loops {
    pub(super) parameters: Vec<(Parameter, Estimate)>,
    pub(super) covariance: Vec<Vec<f64>>,
    pub(super) law: ForceHysteresis,
    /// What it is worth, in words.
    pub(super) about: String,
    pub(super) figure: Figure,
}

/// What the loads are called.
pub(super) struct Named<'a> {
    /// Before the names of the weights.
    pub(super) prefix: &'a str,
    /// Of the figure.
    pub(super) title: String,
    /// Such as `force`.
    pub(super) quantity: &'static str,
    /// Unit of the figure, and its size in SI.
    pub(super) unit: (&'static str, f64),
}

/// Which curve the model is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curve {
    /// That of loading, to which alone it was fitted.
    Loading,
    /// One between loading and unloading, to both of which it was fitted.
    Mean,
}

/// One reading: load by the model from the signal, lags, load of the gauge, and
/// whether it is of unloading.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    loading: f64,
    lags: [f64; WEIGHTS],
    load: f64,
    unloading: bool,
}

impl Sample {
    fn error(&self, law: &ForceHysteresis) -> f64 {
        self.load - self.loading * law.share(&self.lags)
    }

    /// The same beside a curve of this size.
    fn scaled(mut self, scale: f64) -> Self {
        self.loading *= scale;
        self
    }

    /// What its load would be on loading.
    pub(super) fn without(&self, law: &ForceHysteresis) -> f64 {
        self.load / law.share(&self.lags)
    }
}

/// Samples of one body in the order of its readings: loads by the model, those
/// of the gauge, and what tells loading from unloading.
pub(super) fn samples(loading: &[f64], loads: &[f64], driven: &[f64]) -> Vec<Sample> {
    let mut history = LoadHistory::default();
    let branches = branches(driven);
    let readings = loading.iter().zip(loads).zip(branches);
    readings
        .map(|((loading, load), branch)| Sample {
            lags: history.push(*loading),
            loading: loading.abs(),
            load: load * loading.signum(),
            unloading: branch == Branch::Unloading,
        })
        .collect()
}

/// Readings as a problem in the weights and the size of the model's curve;
/// errors are over the largest load.
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
            *residual = sample.scaled(at[WEIGHTS]).error(&law) / self.largest;
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
/// Within these factors the curve of loading lies about one of the mean.
const SCALES: [f64; 2] = [0.5, 2.0];

/// Weights and size of the curve with what the fit says of them.
struct Found {
    law: ForceHysteresis,
    scale: f64,
    parameters: Vec<(Parameter, Estimate)>,
    covariance: Vec<Vec<f64>>,
}

/// The hysteresis of the device whose readings are `samples`; `None` when there
/// is no unloading, or a hysteresis does not explain it. `held` says which
/// readings are held out.
pub(super) fn identify(
    samples: &[Sample],
    held: &[bool],
    curve: Curve,
    named: &Named<'_>,
) -> Option<Loops> {
    if samples.iter().filter(|one| one.unloading).count() < LEAST {
        return None;
    }
    let largest = samples.iter().map(|one| one.load).fold(0.0, f64::max);
    let of = |wanted| picked(samples, held, wanted);
    let (seen, unseen) = (of(false), of(true));
    let fitted = |samples: &[Sample]| weights(samples, largest, curve, named.prefix);
    let (trained, kept) = (fitted(&seen)?, fitted(samples)?);
    let none = law(&[0.0; WEIGHTS]);
    let judged: &[Sample] = if width(&unseen, &none, 1.0).is_some() {
        &unseen
    } else {
        samples
    };
    let before = width(judged, &none, 1.0)? / largest;
    let after = width(judged, &trained.law, trained.scale)? / largest;
    if after > WORTH * before {
        return None;
    }
    let about = format!(
        "{}unloading carries less; without hysteresis the {} of held-out unloading is off by {:.1} % of the largest \
         (root mean square), with it by {:.1} %",
        named.prefix.replace('.', ": "),
        named.quantity,
        100.0 * before,
        100.0 * after
    );
    Some(Loops {
        figure: figure(samples, &kept, named),
        parameters: kept.parameters,
        covariance: kept.covariance,
        law: kept.law,
        about,
    })
}

fn law(at: &[f64]) -> ForceHysteresis {
    ForceHysteresis {
        weights: std::array::from_fn(|j| at[j]),
    }
}

/// Root of the mean square error of the load on unloading.
fn width(samples: &[Sample], law: &ForceHysteresis, scale: f64) -> Option<f64> {
    let errors = samples.iter().filter(|one| one.unloading);
    let errors: Vec<f64> = errors.map(|one| one.scaled(scale).error(law)).collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    (errors.len() >= LEAST / 2).then(|| (squares / errors.len() as f64).sqrt())
}

fn weights(samples: &[Sample], largest: f64, curve: Curve, prefix: &str) -> Option<Found> {
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
            ..Parameter::new(name(prefix, j), 0.01 * most)
        }
    };
    let mut parameters: Vec<Parameter> = (0..WEIGHTS).map(parameter).collect();
    parameters.push(Parameter {
        bounds: match curve {
            Curve::Loading => [1.0; 2],
            Curve::Mean => SCALES,
        },
        size: 0.01,
        ..Parameter::new("", 1.0)
    });
    let options = FitOptions {
        noise: NoiseSize::Estimated,
        ..FitOptions::default()
    };
    let found = fit(&Weights { samples, largest }, &parameters, &options).ok()?;
    // The size of the curve is no constant of the body.
    parameters.truncate(WEIGHTS);
    let own = |row: &Vec<f64>| row[..WEIGHTS].to_vec();
    Some(Found {
        law: law(&found.values()),
        scale: found.estimates[WEIGHTS].value,
        covariance: found.covariance[..WEIGHTS].iter().map(own).collect(),
        parameters: parameters.into_iter().zip(found.estimates).collect(),
    })
}

fn figure(samples: &[Sample], kept: &Found, named: &Named<'_>) -> Figure {
    let (unit, size) = named.unit;
    let marks = |title: &str, law: ForceHysteresis, scale: f64| {
        let error = |one: &Sample| {
            let off = one.scaled(scale).error(&law);
            [one.load / size, -off / size]
        };
        Series::new(title, samples.iter().map(error).collect(), Style::Marks)
    };
    Figure {
        title: named.title.clone(),
        charts: vec![Chart {
            title: format!("Error of the {}", named.quantity),
            x: Axis::new(named.quantity, unit),
            y: Axis::new("error", unit),
            series: vec![
                marks("without hysteresis", law(&[0.0; WEIGHTS]), 1.0),
                marks("with hysteresis", kept.law, kept.scale),
            ],
        }],
        caption: format!(
            "{} from the signal less that of the gauge, loading and unloading.",
            named.quantity
        ),
    }
}
