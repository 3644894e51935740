//! Calibration of in-plane capacitive sensors (P1) from test-bench data: force,
//! displacement or both, and capacitance, for one gap or several.
//!
//! Modulus and scale of the end factor are shared by all gaps; rest capacitance, q, γ,
//! t_min and n are each gap's own, as in P1 Table 1.

mod checks;
mod columns;
mod hysteresis;
mod problem;
mod result;
mod synthetic;

use crate::device_model::{
    Calibratable, DeviceModel, Fitted as FittedTo, Model as NamedModel, Task, best,
};
use crate::hysteresis::law_of;
use crate::options::{CalibrateOptions, NamedSensor, SyntheticOptions};
use taxel::predict::LoadColumn;
use taxel::sensor::{InPlaneCapacitor, Sensor};
use taxel::transduction::{CapacitanceLaw, InPlaneModel, PublishedFit};
use taxel_numerics::least_squares::{FitError, Parameter, Prior, Problem, fit};

use columns::COLUMNS;
use problem::{Bench, END_SCALE, FACTOR_BOUNDS, MODULUS, NAMES, OWN, Reading, SHARED, own};

/// Calibrates in-plane sensors that share a layer.
pub(super) struct InPlaneCalibrator<'a> {
    sensors: &'a [NamedSensor<'a>],
    models: Vec<InPlaneModel>,
    prefixes: Vec<String>,
}

/// Without force and displacement side by side modulus and end condition are taken from the drawing
/// with these deviations: 10 % of a cast elastomer's modulus, and the spread of
/// the end conditions.
const MODULUS_PRIOR: f64 = 0.1;
/// Key of the modulus of the layer.
const LAYER_MODULUS: &str = "layer.youngs_modulus";
const END_PRIOR: f64 = 0.1;
/// Rates n at which searches start, beside that of the sensor file.
const RATES: [f64; 3] = [10.0, 4.0, 25.0];
/// Noise that is not given is found by weighing again until it settles.
const MOST_ROUNDS: usize = 8;
const SETTLED: f64 = 1e-3;

static MODELS: [NamedModel; 3] = [
    NamedModel {
        name: "model-1",
        about: "change of parallel plates times q (U/D)^gamma, thickness by t_min and n",
    },
    NamedModel {
        name: "model-2",
        about: "change of parallel plates, thickness by t_min and n",
    },
    NamedModel {
        name: "first-principles",
        about: "mechanics and field of the drawing; no fitted change",
    },
];

/// Which parameters are free under which law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// P1 Eqs. 7 and 8.
    One,
    /// Parallel plates with the published thickness: q = 1, γ = 0.
    Two,
    /// Mechanics and fields; only the rest capacitance is free.
    FirstPrinciples,
}

impl Model {
    const ALL: [Self; 3] = [Self::One, Self::Two, Self::FirstPrinciples];

    fn law(self) -> CapacitanceLaw {
        match self {
            Self::FirstPrinciples => CapacitanceLaw::Mechanics,
            _ => CapacitanceLaw::Published,
        }
    }
}

/// One fitted model, with the standard deviations of force and capacitance of each
/// reading.
type Fitted = FittedTo<Reading, Vec<[f64; 2]>>;

/// The law of a fit.
fn law(fitted: &Fitted) -> CapacitanceLaw {
    Model::ALL[fitted.model].law()
}

impl<'a> InPlaneCalibrator<'a> {
    /// `None` when a sensor is of another kind.
    pub(super) fn new(sensors: &'a [NamedSensor<'a>]) -> Option<Self> {
        let element = |named: &NamedSensor<'a>| Some(named.sensor.in_plane().ok()?.element);
        let elements: Vec<&InPlaneCapacitor> =
            sensors.iter().map(element).collect::<Option<_>>()?;
        let models: Vec<InPlaneModel> = elements.iter().map(|element| element.model()).collect();
        let prefix = |model: &InPlaneModel| {
            let gap = checks::micrometres(model).to_string();
            format!("gap_{}um.", gap.replace('.', "_"))
        };
        Some(Self {
            sensors,
            prefixes: models.iter().map(prefix).collect(),
            models,
        })
    }

    /// Name of a sensor, as in `prefixes`.
    fn name(&self, sensor: usize) -> &str {
        self.prefixes[sensor].trim_end_matches('.')
    }

    /// Name of a sensor in figures.
    fn title(&self, sensor: usize) -> String {
        self.name(sensor).replace('_', " ")
    }

    /// `with_force`: forces were read beside displacements.
    fn parameters(&self, model: Model, at: &[f64], with_force: bool) -> Vec<Parameter> {
        let drawn = self.models[0].layer;
        let prior =
            |value: f64, deviation: f64| (!with_force).then_some(Prior { value, deviation });
        let modulus = drawn.youngs_modulus;
        let [expected, deviation] = self.expected_modulus(modulus);
        let mut parameters = vec![
            Parameter {
                unit: "Pa",
                bounds: [0.05 * modulus, 20.0 * modulus],
                size: 0.1 * modulus,
                prior: prior(expected, deviation),
                ..Parameter::new(MODULUS, at[0])
            },
            Parameter {
                bounds: FACTOR_BOUNDS.map(|factor| factor / self.largest_factor()),
                size: 0.1,
                prior: prior(1.0, END_PRIOR),
                ..Parameter::new(END_SCALE, at[1])
            },
        ];
        for (sensor, drawn) in self.models.iter().enumerate() {
            let at = &at[own(sensor)..own(sensor) + OWN];
            let rest = drawn.rest_capacitance();
            // Least and largest value, and a difference that matters.
            let ranges = [
                ([0.1 * rest, 10.0 * rest], 0.01 * rest),
                ([1e-3, 100.0], 0.3 * at[1]),
                ([-0.95, 3.0], 0.1),
                ([0.05, 1.0], 0.1),
                ([0.05, 100.0], 0.3 * at[4]),
            ];
            for (k, (bounds, size)) in ranges.into_iter().enumerate() {
                let held = match model {
                    Model::One => false,
                    Model::Two => k == 1 || k == 2,
                    Model::FirstPrinciples => k > 0,
                };
                parameters.push(Parameter {
                    unit: if k == 0 { "F" } else { "" },
                    bounds: if held { [at[k]; 2] } else { bounds },
                    size,
                    ..Parameter::new(format!("{}{}", self.prefixes[sensor], NAMES[k]), at[k])
                });
            }
        }
        parameters
    }

    /// Mean and standard deviation of the modulus before anything is measured, Pa: those of the
    /// material that the sensor file names, if it has an interval, or those of a cast elastomer.
    fn expected_modulus(&self, drawn: f64) -> [f64; 2] {
        let first = &self.sensors[0];
        // A text without a sensor file behind it names no material.
        let used = taxel_material::used(first.name, first.text).unwrap_or_default();
        let of_layer = used.iter().find(|used| used.key.ends_with(LAYER_MODULUS));
        let scatter = of_layer.and_then(|used| used.material.scatter());
        let [median, width] = scatter.unwrap_or([0.0, MODULUS_PRIOR]);
        let expected = drawn * median.exp();
        [expected, expected * width]
    }

    /// The largest χ of the drawing.
    fn largest_factor(&self) -> f64 {
        let layer = self.models[0].closed_layer();
        let at = |e: &f64| layer.end_condition.factor(layer.aspect(), *e).ok();
        let found = [0.01, 0.1, 0.2, 0.3, 0.4].iter().filter_map(at);
        found.reduce(f64::max).unwrap_or(1.0)
    }

    /// Starts of a search: as in the sensor file, and plain ones.
    fn starts(&self, model: Model, readings: &[Reading]) -> Vec<Vec<f64>> {
        let start = |own: &dyn Fn(&InPlaneModel) -> [f64; OWN - 1]| {
            let modulus = self.models[0].layer.youngs_modulus;
            let mut at = vec![modulus, 1.0];
            for (sensor, drawn) in self.models.iter().enumerate() {
                at.push(checks::rest_of(readings, sensor));
                at.extend(own(drawn));
            }
            at
        };
        let plain = |rate: f64| start(&move |_| [1.0, 0.0, 0.8, rate]);
        let published = |model: &InPlaneModel| match model.published_fit {
            Some(PublishedFit { thinning, fringe }) => {
                let [least, rate] = [thinning.least_thickness, thinning.rate];
                [fringe.scale, fringe.exponent, least, rate.max(0.1)]
            }
            None => [1.0, 0.0, 0.8, RATES[0]],
        };
        match model {
            Model::One => {
                let mut starts = vec![start(&published)];
                starts.extend(RATES.map(plain));
                starts
            }
            Model::Two => RATES.map(plain).to_vec(),
            Model::FirstPrinciples => vec![plain(RATES[0])],
        }
    }

    /// The best fit over all starts, with the noise that the readings show.
    fn fit_from(
        &self,
        model: Model,
        readings: &[Reading],
        options: &CalibrateOptions,
        starts: &[Vec<f64>],
    ) -> Result<Fitted, FitError> {
        let with_force = readings.iter().any(Reading::has_both);
        let (mut noise, given) = checks::noise(readings, self.models.len());
        let fit_options = options.fitting(given);
        let once = |at: &[f64], noise: &[[f64; 2]]| {
            let parameters = self.parameters(model, at, with_force);
            let bench = Bench::new(&self.models, readings, model.law(), noise.to_vec());
            fit(&bench, &parameters, &fit_options).map(|fit| (parameters, fit))
        };
        let none = FitError::TooFew {
            readings: readings.len(),
            unknowns: SHARED + OWN * self.models.len(),
        };
        let from = |start: &Vec<f64>| once(start, &noise);
        let (mut parameters, mut found) = best(starts, none, from, |(_, fit)| fit.chi_square)?;
        for _ in 0..MOST_ROUNDS {
            let changed = checks::weigh_again(readings, &found, &mut noise);
            // Again from here, with sizes that fit the values.
            (parameters, found) = once(&found.values(), &noise)?;
            if changed < SETTLED {
                break;
            }
        }
        Ok(Fitted {
            model: model as usize,
            parameters,
            fit: found,
            readings: readings.to_vec(),
            options: fit_options,
            given,
            noise,
        })
    }

    /// The problem of `readings` at the noise 1, for what a fit predicts.
    fn bench_of<'b>(&'b self, fitted: &Fitted, readings: &'b [Reading]) -> Bench<'b> {
        let noise = vec![[1.0; 2]; readings.len()];
        Bench::new(&self.models, readings, law(fitted), noise)
    }
}

impl Calibratable for InPlaneCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        "gap"
    }

    fn models(&self) -> &'static [NamedModel] {
        &MODELS
    }

    fn synthetic(&self, options: &SyntheticOptions) -> String {
        synthetic::table(&self.models, options)
    }
}

impl DeviceModel for InPlaneCalibrator<'_> {
    type Noise = Vec<[f64; 2]>;

    const CURVED: bool = true;

    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)> {
        let prefixes = self.prefixes.iter().map(String::as_str);
        self.sensors.iter().zip(prefixes).collect()
    }

    fn fit(&self, task: &Task<'_, Self>) -> Result<Fitted, FitError> {
        let model = Model::ALL[task.model];
        let starts = match task.from {
            Some(found) => vec![found.fit.values()],
            None => self.starts(model, task.readings),
        };
        self.fit_from(model, task.readings, task.options, &starts)
    }

    fn problem<'b>(&'b self, (): &'b (), fitted: &'b Fitted) -> Option<Box<dyn Problem + 'b>> {
        let noise = fitted.noise.clone();
        let bench = Bench::new(&self.models, &fitted.readings, law(fitted), noise);
        Some(Box::new(bench))
    }
}

/// Puts calibrated values in the place of a sensor file's constants; `value`
/// looks a parameter up, `prefix` is that of the sensor.
///
/// # Errors
/// The name of a parameter that is missing.
pub(super) fn apply(
    sensor: &mut Sensor,
    model: &str,
    prefix: &str,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    let find = |name: String| value(&name).ok_or(name);
    let shared = [find(MODULUS.into())?, find(END_SCALE.into())?];
    let mut own = [0.0; OWN];
    for (place, name) in own.iter_mut().zip(NAMES) {
        *place = find(format!("{prefix}{name}"))?;
    }
    let place = MODELS.iter().position(|known| known.name == model);
    let law = Model::ALL[place.ok_or("model")?].law();
    if let taxel::sensor::Element::InPlaneCapacitor(element) = &mut sensor.element {
        let found = problem::with_values(&element.model(), law, shared, own);
        element.layer = found.layer;
        element.electrodes = found.electrodes;
        element.law = found.law;
        // The published constants stay those of the drawing beside mechanics.
        if law == CapacitanceLaw::Published {
            element.published_fit = found.published_fit;
        }
        element.stray_capacitance = found.stray_capacitance;
        element.hysteresis = law_of(prefix, value);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
