//! Calibration of in-plane capacitive sensors (P1) from a bench: force,
//! displacement if there is one, and capacitance, for one gap or several.
//!
//! Modulus and scale of the end factor are shared by all gaps; rest capacitance, q, γ,
//! t_min and n are each gap's own, as in P1 Table 1.

mod checks;
mod columns;
mod hysteresis;
mod model;
mod problem;
mod result;
mod synthetic;

use std::borrow::Cow;

use crate::hysteresis::{Loops, law_of, on_loading, steps};
use crate::outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, ModelComparison,
    NamedSensor, Outcome, open_in_words, paired, search_in_words, wanted,
};
use crate::readings::BenchData;
use crate::remark::Remark;
use crate::split::{Branch, branches, picked, turns};
use taxel::predict::LoadColumn;
use taxel::sensor::{InPlaneCapacitor, Sensor};
use taxel::transduction::{CapacitanceLaw, InPlaneModel, PublishedFit};
use taxel_numerics::least_squares::{
    Fit, FitError, FitOptions, Parameter, Prior, fit, profile_interval,
};
use taxel_recording::InputError;

use columns::COLUMNS;
use model::{MODELS, Model};
use problem::{Bench, END_SCALE, FACTOR_BOUNDS, MODULUS, NAMES, OWN, Reading, SHARED, own};

/// Key of the element in the sensor file.
pub(super) const ELEMENT: &str = "in_plane_capacitor";

/// Calibrates in-plane sensors that share a layer.
pub(super) struct InPlaneCalibrator<'a> {
    sensors: &'a [NamedSensor<'a>],
    models: Vec<InPlaneModel>,
    prefixes: Vec<String>,
}

/// Without displacements modulus and end condition are taken from the drawing
/// with these deviations: 10 % of a cast elastomer's modulus, and the spread of
/// the end conditions.
const MODULUS_PRIOR: f64 = 0.1;
const END_PRIOR: f64 = 0.1;
/// Rates n at which searches start, beside that of the sensor file.
const RATES: [f64; 3] = [10.0, 4.0, 25.0];
/// Noise that is not given is found by weighing again until it settles.
const MOST_ROUNDS: usize = 8;
const SETTLED: f64 = 1e-3;

/// One fitted model.
struct Fitted {
    model: Model,
    parameters: Vec<Parameter>,
    fit: Fit,
    noise: Vec<[f64; 2]>,
    options: FitOptions,
}

impl Fitted {
    fn bench<'b>(&self, models: &'b [InPlaneModel], readings: &'b [Reading]) -> Bench<'b> {
        let noise = vec![[1.0; 2]; readings.len()];
        Bench::new(models, readings, self.model.law(), noise)
    }
}

impl<'a> InPlaneCalibrator<'a> {
    /// `None` when a sensor is of another kind.
    pub(super) fn new(sensors: &'a [NamedSensor<'a>]) -> Option<Self> {
        let element = |named: &NamedSensor<'a>| Some(named.sensor.in_plane().ok()?.element);
        let elements: Vec<&InPlaneCapacitor> =
            sensors.iter().map(element).collect::<Option<_>>()?;
        let models: Vec<InPlaneModel> = elements.iter().map(|element| element.model()).collect();
        let prefix = |model: &InPlaneModel| {
            let micrometres = (model.electrodes.gap * 1e9).round() / 1e3;
            format!("gap_{}um.", micrometres.to_string().replace('.', "_"))
        };
        Some(Self {
            sensors,
            prefixes: models.iter().map(prefix).collect(),
            models,
        })
    }

    fn parameters(&self, model: Model, at: &[f64], with_displacement: bool) -> Vec<Parameter> {
        let drawn = self.models[0].layer;
        let prior =
            |value: f64, deviation: f64| (!with_displacement).then_some(Prior { value, deviation });
        let modulus = drawn.youngs_modulus;
        let mut parameters = vec![
            Parameter {
                unit: "Pa",
                bounds: [0.05 * modulus, 20.0 * modulus],
                size: 0.1 * modulus,
                prior: prior(modulus, MODULUS_PRIOR * modulus),
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

    /// The largest χ of the drawing.
    fn largest_factor(&self) -> f64 {
        let layer = &self.models[0].layer;
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
    fn fit(
        &self,
        model: Model,
        readings: &[Reading],
        options: &CalibrateOptions,
        starts: &[Vec<f64>],
    ) -> Result<Fitted, FitError> {
        let with_displacement = readings.iter().any(|r| r.displacement.is_some());
        let (mut noise, given) = checks::noise(readings, self.models.len());
        let fit_options = options.fitting(given);
        let once = |at: &[f64], noise: &[[f64; 2]]| {
            let parameters = self.parameters(model, at, with_displacement);
            let bench = Bench::new(&self.models, readings, model.law(), noise.to_vec());
            fit(&bench, &parameters, &fit_options).map(|fit| (parameters, fit))
        };
        let mut best: Option<(Vec<Parameter>, Fit)> = None;
        let mut failure = None;
        for start in starts {
            match once(start, &noise) {
                Ok(found)
                    if best
                        .as_ref()
                        .is_none_or(|best| found.1.chi_square < best.1.chi_square) =>
                {
                    best = Some(found);
                }
                Ok(_) => {}
                Err(error) => failure = Some(error),
            }
        }
        let Some((_, mut found)) = best else {
            return Err(failure.unwrap_or(FitError::TooFew {
                readings: readings.len(),
                unknowns: SHARED + OWN * self.models.len(),
            }));
        };
        let mut parameters = Vec::new();
        for _ in 0..MOST_ROUNDS {
            let changed = checks::weigh_again(readings, &found, &mut noise);
            // Again from here, with sizes that fit the values.
            (parameters, found) = once(&found.values(), &noise)?;
            if changed < SETTLED {
                break;
            }
        }
        Ok(Fitted {
            model,
            parameters,
            fit: found,
            noise,
            options: fit_options,
        })
    }

    /// Takes the readings of the loading branch; remarks on the rest.
    fn loading(&self, readings: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
        let mut kept = Vec::new();
        for (sensor, prefix) in self.prefixes.iter().enumerate() {
            let of: Vec<Reading> = readings
                .iter()
                .filter(|r| r.sensor == sensor)
                .copied()
                .collect();
            let load = |r: &Reading| r.displacement.unwrap_or(r.force);
            let loads: Vec<f64> = of.iter().map(load).collect();
            let branches = branches(&loads);
            let name = prefix.trim_end_matches('.');
            if of.iter().all(|r| r.time.is_none()) && turns(&branches) * 8 > of.len() {
                let message = "the rows are in no order of loading; all are used as one branch";
                remarks.push(Remark::whole(format!("{name}: {message}")));
                kept.extend(of);
                continue;
            }
            let note = checks::hysteresis(&of, &branches).map_or_else(String::new, |share| {
                format!("; unloading carries {:.1} % less force", 100.0 * share)
            });
            let unloading: Vec<bool> = branches.iter().map(|b| *b == Branch::Unloading).collect();
            kept.extend(on_loading(name, &of, &unloading, &note, remarks));
        }
        kept
    }

    /// The hysteresis of each sensor whose readings tell one.
    fn loops(
        &self,
        best: &Fitted,
        all: &[Reading],
        options: &CalibrateOptions,
        remarks: &mut Vec<Remark>,
    ) -> Vec<Loops> {
        let mut found = Vec::new();
        for (sensor, (drawn, prefix)) in self.models.iter().zip(&self.prefixes).enumerate() {
            let model = |at: Vec<f64>| {
                let values = std::array::from_fn(|k| at[own(sensor) + k]);
                problem::calibrated(drawn, best.model.law(), [at[0], at[1]], values)
            };
            let mut moved = steps(&best.fit).into_iter().map(model);
            let of = all.iter().filter(|r| r.sensor == sensor).copied();
            let of: Vec<Reading> = of.collect();
            let marked: Vec<bool> = of.iter().map(|r| r.marked).collect();
            let held = options.hold_out.held(&marked);
            let here = model(best.fit.values());
            if let Some(loops) = hysteresis::of_sensor(&here, &mut moved, &of, &held, prefix) {
                remarks.push(Remark::whole(loops.about.clone()));
                found.push(loops);
            }
        }
        found
    }

    fn held(&self, readings: &[Reading], options: &CalibrateOptions) -> Vec<bool> {
        let mut held = Vec::with_capacity(readings.len());
        for sensor in 0..self.models.len() {
            let of = readings.iter().filter(|r| r.sensor == sensor);
            let marked: Vec<bool> = of.map(|r| r.marked).collect();
            held.extend(options.hold_out.held(&marked));
        }
        held
    }

    fn with_profiles(
        &self,
        fitted: &mut Fitted,
        readings: &[Reading],
        options: &CalibrateOptions,
    ) -> Result<(), FitError> {
        if !options.profile {
            return Ok(());
        }
        let bench = Bench::new(
            &self.models,
            readings,
            fitted.model.law(),
            fitted.noise.clone(),
        );
        for j in 0..fitted.parameters.len() {
            if fitted.fit.estimates[j].status == taxel_numerics::least_squares::Status::Identified {
                fitted.fit.estimates[j].interval =
                    profile_interval(&bench, &fitted.parameters, &fitted.options, &fitted.fit, j)?;
            }
        }
        Ok(())
    }

    /// Fits of all models that have an answer, the wanted one first.
    fn all_fits(
        &self,
        wanted: Model,
        readings: &[Reading],
        options: &CalibrateOptions,
        data: &BenchData,
        remarks: &mut Vec<Remark>,
    ) -> Result<Vec<Fitted>, InputError> {
        let mut fits = Vec::new();
        for model in Model::ALL {
            match self.fit(model, readings, options, &self.starts(model, readings)) {
                Ok(fitted) if model == wanted => fits.insert(0, fitted),
                Ok(fitted) => fits.push(fitted),
                Err(error) if model == wanted => {
                    let help = "check the units and the sensor file, or choose another --model";
                    return Err(data.error("", format!("{}: {error}", model.name()), help));
                }
                Err(error) => {
                    let message = format!("{} was not fitted: {error}", model.name());
                    remarks.push(Remark::whole(message));
                }
            }
        }
        Ok(fits)
    }
}

impl Calibrator for InPlaneCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        "gap"
    }

    fn models(&self) -> &'static [&'static str] {
        &MODELS
    }

    fn calibrate(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        let wanted = Model::ALL[wanted(&MODELS, options)?];
        let mut remarks = data.remarks.clone();
        let all = checks::readings(self, data, &mut remarks)?;
        let readings = self.loading(&all, &mut remarks);
        checks::enough(self, data, &readings)?;
        let held = self.held(&readings, options);
        let pick = |wanted: bool| picked(&readings, &held, wanted);
        let (seen, unseen) = (pick(false), pick(true));
        checks::beyond(&seen, &unseen, self.models.len(), &mut remarks);
        let mut fits = self.all_fits(wanted, &readings, options, data, &mut remarks)?;
        let fitted = |model: Model, error: FitError| {
            let help = "hold out fewer readings, or take more";
            data.error(
                "",
                format!("{} without the readings held out: {error}", model.name()),
                help,
            )
        };
        let mut models = Vec::new();
        let mut hold_out = Vec::new();
        for (place, found) in fits.iter().enumerate() {
            let mut comparison = ModelComparison {
                name: found.model.name(),
                about: found.model.about(),
                unknowns: found.parameters.iter().filter(|p| p.is_free()).count(),
                residual: self.relative(found, &readings, &readings),
                hold_out: None,
            };
            if !unseen.is_empty() {
                let starts = [found.fit.values()];
                let trained = self
                    .fit(found.model, &seen, options, &starts)
                    .map_err(|error| fitted(found.model, error))?;
                comparison.hold_out = Some(self.relative(&trained, &unseen, &readings));
                if place == 0 {
                    hold_out = self.residuals(&trained, &unseen, &readings);
                }
            }
            models.push(comparison);
        }
        self.with_profiles(&mut fits[0], &readings, options)
            .map_err(|error| fitted(wanted, error))?;
        let best = &fits[0];
        let loops = self.loops(best, &all, options, &mut remarks);
        let figures = self.figures(&fits, &readings);
        let (_, given) = checks::noise(&readings, self.models.len());
        let found = &best.fit;
        let sensor =
            |(named, prefix): (&NamedSensor<'_>, &String)| CalibratedSensor::of(named, prefix);
        let mut outcome = Outcome {
            element: ELEMENT,
            model: wanted.name(),
            sensors: self
                .sensors
                .iter()
                .zip(&self.prefixes)
                .map(sensor)
                .collect(),
            parameters: paired(&best.parameters, found),
            covariance: CovarianceBlock::of([found]),
            open: open_in_words(&best.parameters, found),
            places: None,
            derived: self.derived(best),
            noise: checks::noise_in_words(given, found),
            search: search_in_words(found, given),
            residuals: self.residuals(best, &readings, &readings),
            hold_out,
            held_out: options.hold_out.words(),
            models,
            scope: self.scope(best, &readings),
            remarks,
            figures,
        };
        outcome.add_loops(loops);
        Ok(outcome)
    }

    fn bench(&self, options: &BenchOptions) -> String {
        synthetic::bench(&self.models, options)
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
    let find = |name: Cow<'_, str>| value(&name).ok_or_else(|| name.clone().into_owned());
    let shared = [find(MODULUS.into())?, find(END_SCALE.into())?];
    let mut own = [0.0; OWN];
    for (place, name) in own.iter_mut().zip(NAMES) {
        *place = find(format!("{prefix}{name}").into())?;
    }
    let law = Model::ALL
        .into_iter()
        .find(|known| known.name() == model)
        .ok_or("model")?
        .law();
    if let taxel::sensor::Element::InPlaneCapacitor(element) = &mut sensor.element {
        let found = problem::calibrated(&element.model(), law, shared, own);
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
