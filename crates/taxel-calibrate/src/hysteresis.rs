//! Hysteresis of a device from slow loops, beside the curve of its model.
//!
//! The model is fitted to loading alone, and so its constants owe nothing to
//! the law of the loops.

use crate::remark::Remark;
use crate::split::{Branch, branches, picked};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::mechanics::{ForceHysteresis, LoadHistory, REVERSALS};
use taxel_numerics::dense::dot;
use taxel_numerics::least_squares::{
    Estimate, Fit, FitOptions, NoiseSize, Parameter, Prior, Problem, fit,
};

/// Number of weights.
pub(crate) const WEIGHTS: usize = REVERSALS.len();

/// Name of a weight in the calibration file behind `prefix`.
fn name(prefix: &str, weight: usize) -> String {
    format!("{prefix}hysteresis_{}", weight + 1)
}

/// The law of a calibration file whose weights are named behind `prefix`: of
/// one weight there are all, or none was identified.
pub(crate) fn law_of(prefix: &str, value: &dyn Fn(&str) -> Option<f64>) -> Option<ForceHysteresis> {
    let weights = (0..WEIGHTS).map(|j| value(&name(prefix, j)));
    let weights: Vec<f64> = weights.collect::<Option<_>>()?;
    Some(law(&weights))
}

/// Law of synthetic calibration data whose force on loading exceeds that on unloading by
/// `hysteresis`: half of it is lost within 6 % of the load behind a turn, all
/// within 20 %.
pub(crate) fn synthetic(hysteresis: f64) -> ForceHysteresis {
    let mut law = law(&[0.0; WEIGHTS]);
    for j in [1, 2] {
        law.weights[j] = 0.5 * hysteresis.ln_1p() / (2.0 * REVERSALS[j]);
    }
    law
}

/// A hysteresis that was found.
pub(crate) struct Loops {
    pub(crate) parameters: Vec<(Parameter, Estimate)>,
    pub(crate) covariance: Vec<Vec<f64>>,
    /// Remark on it, in words.
    pub(crate) about: String,
    pub(crate) figure: Figure,
}

/// Name of the loads.
pub(crate) struct Named<'a> {
    /// Before the names of the weights.
    pub(crate) prefix: &'a str,
    /// Title of the figure.
    pub(crate) title: String,
    /// Such as `force`.
    pub(crate) quantity: &'static str,
    /// Unit of the figure, and its size in SI.
    pub(crate) unit: (&'static str, f64),
}

/// Hysteresis loss in words; a negative share is no loss.
pub(crate) fn loss_in_words(share: f64, quantity: &str) -> String {
    let percent = 100.0 * share.abs();
    if share > 0.0 {
        format!("hysteresis loss {percent:.1} % of the {quantity}")
    } else {
        format!("no hysteresis loss: unloading carries {percent:.1} % more {quantity}")
    }
}

/// Readings of the body `name` whose load does not unload, with a remark on the
/// others, which says `note` behind their number.
pub(crate) fn on_loading<T: Copy>(
    name: &str,
    readings: &[T],
    unloading: &[bool],
    note: &str,
    remarks: &mut Vec<Remark>,
) -> Vec<T> {
    let kept = picked(readings, unloading, false);
    if kept.len() < readings.len() {
        remarks.push(Remark::whole(format!(
            "{name}: {} readings of loading are used, {} of unloading are left out{note}",
            kept.len(),
            readings.len() - kept.len()
        )));
    }
    kept
}

/// A load below this share of the largest is none: what it lost is noise.
const NONE: f64 = 0.05;

/// True if a load in the order of time, of either sign, goes back towards zero
/// at each reading, and is still there.
pub(crate) fn unloading(load: &[f64]) -> Vec<bool> {
    let largest = load.iter().fold(0.0_f64, |most, load| most.max(load.abs()));
    let size = |load: &f64| Some(load.abs()).filter(|size| *size > NONE * largest);
    let sizes: Vec<f64> = load.iter().map(|load| size(load).unwrap_or(0.0)).collect();
    let pairs = branches(&sizes).into_iter().zip(sizes);
    pairs
        .map(|(branch, size)| branch == Branch::Unloading && size > 0.0)
        .collect()
}

/// One reading: load by the model from the signal, lags, load of the gauge, and
/// whether it is of unloading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    loading: f64,
    lags: [f64; WEIGHTS],
    load: f64,
    unloading: bool,
    /// Standard deviation of the load by the model, up to a factor that all
    /// samples share.
    noise: f64,
}

impl Sample {
    /// With a noise that other samples do not have.
    pub(crate) fn with_noise(self, noise: f64) -> Self {
        Self { noise, ..self }
    }

    fn error(&self, law: &ForceHysteresis) -> f64 {
        self.load - self.loading * law.share(&self.lags)
    }
}

/// Samples of one body in the order of its readings: loads by the model, those
/// of the gauge, and which are of unloading.
pub(crate) fn samples(loading: &[f64], loads: &[f64], driven: &[f64]) -> Vec<Sample> {
    let mut history = LoadHistory::default();
    let quiet = one_way(loading, driven);
    let readings = loading
        .iter()
        .zip(loads)
        .zip(quiet.iter().zip(unloading(driven)));
    readings
        .map(|((loading, load), (quiet, unloading))| Sample {
            lags: history.push(*quiet),
            loading: loading * quiet.signum(),
            load: load * quiet.signum(),
            unloading,
            noise: 1.0,
        })
        .collect()
}

/// Loads by the signal without the noise that turns them on their way from one
/// turn of `driven` to the next, and would fill the narrow plays: the nearest
/// ones that go one way in between.
fn one_way(loading: &[f64], driven: &[f64]) -> Vec<f64> {
    let sizes: Vec<f64> = driven.iter().map(|load| load.abs()).collect();
    let branches = branches(&sizes);
    let mut found = Vec::with_capacity(loading.len());
    for branch in branches.chunk_by(PartialEq::eq) {
        let run = found.len()..found.len() + branch.len();
        let side: f64 = driven[run.clone()].iter().sum();
        let way = match branch[0] {
            Branch::Loading => side.signum(),
            Branch::Unloading => -side.signum(),
        };
        let rising: Vec<f64> = loading[run].iter().map(|load| way * load).collect();
        found.extend(nearest_rising(&rising).iter().map(|load| way * load));
    }
    found
}

/// The values that never fall and are nearest to `values` by least squares:
/// neighbours that fall are pooled.
fn nearest_rising(values: &[f64]) -> Vec<f64> {
    // Sums and counts of the pools.
    let mut pools: Vec<(f64, usize)> = Vec::with_capacity(values.len());
    let mean = |pool: &(f64, usize)| pool.0 / pool.1 as f64;
    for value in values {
        let mut last = (*value, 1);
        while let Some(before) = pools.pop_if(|before| mean(before) > mean(&last)) {
            last = (before.0 + last.0, before.1 + last.1);
        }
        pools.push(last);
    }
    let spread = |pool: &(f64, usize)| std::iter::repeat_n(mean(pool), pool.1);
    pools.iter().flat_map(spread).collect()
}

/// Readings as a problem in the weights; errors are over their noise and the
/// largest load.
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
            *residual = sample.error(&law) / (sample.noise * self.largest);
        }
        true
    }
}

/// Constants are moved by this share of their deviations.
const STEP: f64 = 0.01;

/// The constants of a fit, moved along each of the independent directions, the
/// columns of a Cholesky factor, in which they are uncertain.
pub(crate) fn steps(found: &Fit) -> Vec<Vec<f64>> {
    let mut left = found.covariance.clone();
    let mut steps = Vec::new();
    for j in 0..left.len() {
        let pivot = left[j][j];
        // Fixed, or known from the ones before to within rounding.
        if pivot <= 1e-12 * found.covariance[j][j] {
            continue;
        }
        let column: Vec<f64> = left.iter().map(|row| row[j] / pivot.sqrt()).collect();
        for (row, own) in left.iter_mut().zip(&column) {
            let pairs = row.iter_mut().zip(&column);
            pairs.for_each(|(entry, other)| *entry -= own * other);
        }
        let values = found.values().into_iter().zip(column);
        steps.push(values.map(|(value, one)| value + STEP * one).collect());
    }
    steps
}

impl Found {
    /// Adds to the covariance what is not known of the model's curve: each of
    /// `moved` are loads by a curve that is off by [`STEP`].
    fn beside(
        mut self,
        samples: &[Sample],
        largest: f64,
        moved: &mut dyn Iterator<Item = Vec<f64>>,
    ) -> Self {
        let alone = self.covariance.clone();
        for moved in moved {
            // The normal equations for the change of the errors.
            let mut sides = [0.0; WEIGHTS];
            for (one, moved) in samples.iter().zip(moved) {
                let size = one.noise * largest * self.scale;
                let left = self.law.share(&one.lags) / size;
                let off = left * (moved.abs() - one.loading.abs()) / STEP;
                for (side, lag) in sides.iter_mut().zip(&one.lags) {
                    *side += left * one.loading * lag * off;
                }
            }
            let step: Vec<f64> = alone.iter().map(|row| dot(row, &sides)).collect();
            for (row, own) in self.covariance.iter_mut().zip(&step) {
                let pairs = row.iter_mut().zip(&step);
                pairs.for_each(|(entry, other)| *entry += own * other);
            }
        }
        for (j, (parameter, estimate)) in self.parameters.iter_mut().enumerate() {
            let deviation = self.covariance[j][j].sqrt();
            let wider = if estimate.deviation > 0.0 {
                deviation / estimate.deviation
            } else {
                1.0
            };
            let [low, high] = parameter.bounds;
            let end = |end: f64| estimate.value + wider * (end - estimate.value);
            estimate.interval = estimate.interval.map(|at| end(at).clamp(low, high));
            estimate.deviation = deviation;
        }
        self
    }
}

/// Fewer readings of unloading identify no loop.
const LEAST: usize = 16;
/// A hysteresis is kept when it leaves less than this share of the error of
/// readings that it has not seen.
const WORTH: f64 = 0.8;
/// A weight beyond this share lost per reversal belongs to no rubber.
const LARGEST_LOSS: f64 = 0.5;
/// Weights with what the fit says of them.
struct Found {
    law: ForceHysteresis,
    parameters: Vec<(Parameter, Estimate)>,
    covariance: Vec<Vec<f64>>,
    /// Scale of the noise.
    scale: f64,
}

/// The hysteresis of the device whose readings are `samples`; `None` when there
/// is no unloading, or a hysteresis does not explain it. `moved` are the loads by
/// the model with its constants at each of [`steps`]; `held` says which readings
/// are held out.
pub(crate) fn identify(
    samples: &[Sample],
    moved: &mut dyn Iterator<Item = Vec<f64>>,
    held: &[bool],
    named: &Named<'_>,
) -> Option<Loops> {
    if samples.iter().filter(|one| one.unloading).count() < LEAST {
        return None;
    }
    let largest = samples.iter().map(|one| one.load).fold(0.0, f64::max);
    let of = |wanted| picked(samples, held, wanted);
    let (seen, unseen) = (of(false), of(true));
    let fitted = |samples: &[Sample]| weights(samples, largest, named.prefix);
    let (trained, kept) = (fitted(&seen)?, fitted(samples)?);
    let none = law(&[0.0; WEIGHTS]);
    let judged: &[Sample] = if width(&unseen, &none).is_some() {
        &unseen
    } else {
        samples
    };
    let before = width(judged, &none)? / largest;
    let after = width(judged, &trained.law)? / largest;
    if after > WORTH * before {
        return None;
    }
    let about = format!(
        "{}hysteresis: without it the {} of held-out unloading is off by {:.1} % of the largest (root mean square), \
         with it by {:.1} %",
        named.prefix.replace('.', ": "),
        named.quantity,
        100.0 * before,
        100.0 * after
    );
    let kept = kept.beside(samples, largest, moved);
    Some(Loops {
        figure: figure(samples, &kept, named),
        parameters: kept.parameters,
        covariance: kept.covariance,
        about,
    })
}

fn law(at: &[f64]) -> ForceHysteresis {
    ForceHysteresis {
        weights: std::array::from_fn(|j| at[j]),
    }
}

/// Root of the mean square error of the load on unloading.
fn width(samples: &[Sample], law: &ForceHysteresis) -> Option<f64> {
    let errors = samples.iter().filter(|one| one.unloading);
    let errors: Vec<f64> = errors.map(|one| one.error(law)).collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    (errors.len() >= LEAST / 2).then(|| (squares / errors.len() as f64).sqrt())
}

fn weights(samples: &[Sample], largest: f64, prefix: &str) -> Option<Found> {
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
    let parameters: Vec<Parameter> = (0..WEIGHTS).map(parameter).collect();
    let options = FitOptions {
        noise: NoiseSize::Estimated,
        ..FitOptions::default()
    };
    let found = fit(&Weights { samples, largest }, &parameters, &options).ok()?;
    Some(Found {
        law: law(&found.values()),
        scale: found.scale,
        covariance: found.covariance,
        parameters: parameters.into_iter().zip(found.estimates).collect(),
    })
}

fn figure(samples: &[Sample], kept: &Found, named: &Named<'_>) -> Figure {
    let (unit, size) = named.unit;
    let marks = |title: &str, law: ForceHysteresis| {
        let error = |one: &Sample| [one.load / size, -one.error(&law) / size];
        Series::new(title, samples.iter().map(error).collect(), Style::Marks)
    };
    Figure {
        title: named.title.clone(),
        charts: vec![Chart {
            title: format!("Error of the {}", named.quantity),
            x: Axis::new(named.quantity, unit),
            y: Axis::new("error", unit),
            series: vec![
                marks("without hysteresis", law(&[0.0; WEIGHTS])),
                marks("with hysteresis", kept.law),
            ],
        }],
        caption: format!(
            "{} from the signal less that of the gauge, loading and unloading.",
            named.quantity
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rising_values_pool_neighbours_that_fall() {
        let found = nearest_rising(&[1.0, 3.0, 2.0, 2.5, 5.0, 4.0]);
        assert_eq!(found, [1.0, 2.5, 2.5, 2.5, 4.5, 4.5]);
        assert_eq!(nearest_rising(&[]), [0.0; 0]);
    }

    #[test]
    fn a_load_near_none_unloads_no_more_and_either_side_counts() {
        let load = [0.0, 10.0, 6.0, 0.4, 0.0, -0.4, -8.0, -4.0, 0.0];
        let found = unloading(&load);
        let places = (0..load.len()).filter(|i| found[*i]);
        assert_eq!(places.collect::<Vec<_>>(), [2, 7]);
        // Noise does not fill plays: it goes the way of its branch.
        let noisy = [0.0, 10.0, 6.0, 6.2, 0.0, 0.0, -8.0, -8.2, -4.0];
        let driven = [0.0, 10.0, 7.0, 6.0, 0.0, 0.0, -7.0, -8.0, -4.0];
        let quiet = [0.0, 10.0, 6.1, 6.1, 0.0, 0.0, -8.0, -8.2, -4.0];
        assert_eq!(one_way(&noisy, &driven), quiet);
    }

    /// The steps of a fit are columns of a factor of its covariance.
    #[test]
    fn steps_have_the_covariance_of_the_fit() {
        struct Line;
        impl Problem for Line {
            fn readings(&self) -> usize {
                4
            }
            fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
                for (i, residual) in residuals.iter_mut().enumerate() {
                    *residual = (i * i) as f64 - at[0] - at[1] * i as f64;
                }
                true
            }
        }
        let parameters = ["offset", "slope"].map(|name| Parameter::new(name, 0.5));
        let found = fit(&Line, &parameters, &FitOptions::default()).unwrap();
        let steps = steps(&found);
        let at = found.values();
        let off = |step: &Vec<f64>, j: usize| (step[j] - at[j]) / STEP;
        for (i, row) in found.covariance.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let sum: f64 = steps.iter().map(|step| off(step, i) * off(step, j)).sum();
                // Differences over a hundredth of a deviation.
                assert!((sum - entry).abs() < 1e-12, "{sum} {entry}");
            }
        }
    }
}
