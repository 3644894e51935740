//! Calibration of piezoelectric elements (P3) from a bench: peaks of test
//! loads over the load, or a voltage over time, driven by a displacement or a
//! force.
//!
//! Charge per force, leak resistance and the silicone's viscosity are fitted.
//! The modulus of the silicone stays that of the drawing: under a displacement
//! it acts as the charge per force does.

mod answers;
mod checks;
mod columns;
mod peaks;
mod places;
mod presses;
mod problem;
mod result;
mod school;
mod synthetic;

use crate::outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, ModelComparison,
    NamedSensor, Outcome, PressOptions, open_in_words, paired, search_in_words, wanted,
};
use crate::readings::BenchData;
use crate::remark::Remark;
use crate::split::picked;
use taxel::estimation::ProfileModel;
use taxel::layout::Layout;
use taxel::predict::LoadColumn;
use taxel::sensor::Sensor;
use taxel_numerics::least_squares::{
    Estimate, Fit, FitError, Parameter, Status, fit, profile_interval,
};
use taxel_recording::InputError;

use checks::Table;
use columns::COLUMNS;
use problem::{Bench, Drive, GAIN, LEAK, NAMES, OWN, Reading, UNITS, VISCOSITY};

/// Calibrates one piezoelectric sensor.
pub(super) struct PiezoelectricCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    /// Least and greatest voltage that is not clipped, V.
    span: [f64; 2],
    /// Of a reading by the board's own figures, V.
    deviation: f64,
    /// Output per force in the middle of the band, V/N.
    volt_per_newton: f64,
    /// C/N.
    charge_per_force: f64,
    layout: Layout,
    /// Profiles of contacts, as drawn.
    profile: ProfileModel,
}

static MODELS: [&str; 2] = ["dynamic", "gain"];

/// Which parameters are free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// All three; the viscosity from a displacement that was recorded only.
    Dynamic,
    /// The charge per force alone.
    Gain,
}

impl Model {
    const ALL: [Self; 2] = [Self::Dynamic, Self::Gain];

    fn name(self) -> &'static str {
        MODELS[self as usize]
    }

    fn about(self) -> &'static str {
        match self {
            Self::Dynamic => "charge per force, leak and viscosity",
            Self::Gain => "charge per force; leak and viscosity of the drawing",
        }
    }

    /// The viscosity delays the signal by μ/E of the silicone: a peak, where the
    /// signal stands still, does not tell it, a recording does.
    fn frees(self, place: usize, table: &Table) -> bool {
        match place {
            GAIN => true,
            LEAK => self == Self::Dynamic,
            // A force reaches the element whole, however it came.
            _ => {
                let recorded = !table.path.is_empty();
                self == Self::Dynamic && recorded && table.device.drive == Drive::Displacement
            }
        }
    }
}

/// Share of each constant that matters: of the slope two hundredths, of the
/// time constant a tenth, of the viscosity a quarter.
const SIZES: [f64; OWN] = [0.02, 0.1, 0.25];
/// Factors about the drawing between which each constant is searched.
const WITHIN: [[f64; 2]; OWN] = [[0.01, 100.0], [1e-3, 1e3], [0.0, 1e3]];

struct Fitted {
    parameters: Vec<Parameter>,
    fit: Fit,
}

impl<'a> PiezoelectricCalibrator<'a> {
    /// `None` when the sensor is of another kind.
    pub(super) fn new(named: &'a NamedSensor<'a>) -> Option<Self> {
        let array = named.sensor.piezoelectric().ok()?;
        Some(Self {
            named,
            span: array.board.span(),
            deviation: array.board.deviation(),
            volt_per_newton: array.volt_per_newton(),
            charge_per_force: array.element.charge_per_force,
            layout: array.layout(),
            profile: array.profile_model(),
        })
    }

    fn problem<'b>(&self, table: &'b Table, readings: &'b [Reading]) -> Bench<'b> {
        Bench {
            device: &table.device,
            profiles: &table.profiles,
            readings,
            path: &table.path,
            deviation: self.deviation,
        }
    }

    fn fit(
        &self,
        model: Model,
        table: &Table,
        readings: &[Reading],
        options: &CalibrateOptions,
    ) -> Result<Fitted, FitError> {
        let drawn = table.device.drawn();
        let bench = self.problem(table, readings);
        let parameters: Vec<Parameter> = (0..OWN)
            .map(|place| {
                let at = drawn[place];
                let start = match place {
                    GAIN => at * checks::ratio(&bench, &drawn).clamp(0.02, 50.0),
                    // A silicone without damping would have no size.
                    VISCOSITY => at.max(1.0),
                    _ => at,
                };
                let free = model.frees(place, table);
                Parameter {
                    unit: UNITS[place],
                    bounds: if free {
                        WITHIN[place].map(|factor| factor * start)
                    } else {
                        [at; 2]
                    },
                    size: SIZES[place] * start,
                    ..Parameter::new(NAMES[place], if free { start } else { at })
                }
            })
            .collect();
        let found = fit(&bench, &parameters, &options.fitting(is_given(readings)))?;
        Ok(Fitted {
            parameters,
            fit: found,
        })
    }

    /// What presses taught, added to what is known of the constants.
    fn add_places(&self, outcome: &mut Outcome, data: &BenchData) -> Result<(), InputError> {
        outcome.remarks.extend_from_slice(&data.remarks);
        let pressed = presses::presses(self, data, &mut outcome.remarks)?;
        let learned = places::learn(self, &pressed).map_err(|error| {
            let help = "press at places all over the elements, 0.5 to 1 mm apart";
            data.error("x", error.to_string(), help)
        })?;
        outcome.places = Some(learned.map);
        outcome.hold_out.extend(learned.hold_out);
        outcome.scope.extend(learned.scope);
        outcome.remarks.extend(learned.remarks);
        outcome.figures.push(learned.figure);
        if outcome.held_out.is_empty() {
            outcome.held_out = learned.held_out;
        } else {
            outcome.held_out = format!("{}; {}", outcome.held_out, learned.held_out);
        }
        Ok(())
    }

    /// The constants as drawn, where no readings tell them.
    fn as_drawn(&self) -> Outcome {
        let drawn = problem::Device::new(self.named.sensor, Drive::Force).drawn();
        let fixed = |place: usize| {
            let at = drawn[place];
            let parameter = Parameter {
                unit: UNITS[place],
                bounds: [at; 2],
                ..Parameter::new(NAMES[place], at)
            };
            let estimate = Estimate {
                value: at,
                deviation: 0.0,
                interval: [at; 2],
                status: Status::Fixed,
            };
            (parameter, estimate)
        };
        Outcome {
            element: self.named.sensor.element.key(),
            model: "as-drawn",
            sensors: vec![CalibratedSensor::of(self.named, "")],
            parameters: (0..OWN).map(fixed).collect(),
            covariance: vec![CovarianceBlock {
                first: 0,
                rows: vec![vec![0.0; OWN]; OWN],
            }],
            open: Vec::new(),
            places: None,
            derived: Vec::new(),
            noise: "of the presses".into(),
            search: "constants of the drawing; presses tell the places alone".into(),
            residuals: Vec::new(),
            hold_out: Vec::new(),
            held_out: String::new(),
            models: Vec::new(),
            scope: Vec::new(),
            remarks: Vec::new(),
            figures: Vec::new(),
        }
    }

    fn with_profiles(
        &self,
        fitted: &mut Fitted,
        table: &Table,
        options: &CalibrateOptions,
    ) -> Result<(), FitError> {
        let bench = self.problem(table, &table.readings);
        let fitting = options.fitting(is_given(&table.readings));
        for j in 0..OWN {
            if fitted.fit.estimates[j].status == Status::Identified {
                fitted.fit.estimates[j].interval =
                    profile_interval(&bench, &fitted.parameters, &fitting, &fitted.fit, j)?;
            }
        }
        Ok(())
    }
}

fn is_given(readings: &[Reading]) -> bool {
    readings.iter().all(|r| r.deviation.is_some())
}

impl Calibrator for PiezoelectricCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        ""
    }

    fn models(&self) -> &'static [&'static str] {
        &MODELS
    }

    fn calibrate(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        self.calibrate_all(std::slice::from_ref(data), options)
    }

    fn calibrate_all(
        &self,
        tables: &[BenchData],
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        let (presses, readings): (Vec<_>, Vec<_>) =
            tables.iter().partition(|table| presses::are_presses(table));
        let twice = [&presses, &readings].into_iter().find_map(|of| of.get(1));
        if let Some(table) = twice {
            let message = "a second table of the same kind";
            return Err(InputError::whole(&table.file, message)
                .help("put the readings into one table, and the presses at places into another"));
        }
        let mut outcome = match readings.first() {
            Some(table) => self.constants(table, options)?,
            None => self.as_drawn(),
        };
        if let Some(table) = presses.first() {
            self.add_places(&mut outcome, table)?;
        }
        Ok(outcome)
    }

    fn bench(&self, options: &BenchOptions) -> String {
        synthetic::bench(self.named.sensor, options)
    }

    fn press_bench(&self, options: &PressOptions) -> Option<String> {
        synthetic::presses(self, options)
    }
}

impl PiezoelectricCalibrator<'_> {
    /// Charge per force, leak and viscosity from one table.
    fn constants(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        let wanted = Model::ALL[wanted(&MODELS, options)?];
        let mut remarks = data.remarks.clone();
        let table = checks::table(self, data, &mut remarks)?;
        let marked: Vec<bool> = table.readings.iter().map(|r| r.marked).collect();
        let held = options.hold_out.held(&marked);
        let pick = |wanted: bool| picked(&table.readings, &held, wanted);
        let (seen, unseen) = (pick(false), pick(true));
        let wrong = |model: Model, error: FitError| {
            let help = "check the units and the sensor file, or take more readings";
            data.error("", format!("{}: {error}", model.name()), help)
        };
        let mut best = None;
        let (mut models, mut hold_out) = (Vec::new(), Vec::new());
        for model in Model::ALL {
            let fitted = self
                .fit(model, &table, &table.readings, options)
                .map_err(|error| wrong(model, error))?;
            let free = fitted.parameters.iter().filter(|p| p.is_free());
            let mut comparison = ModelComparison {
                name: model.name(),
                about: model.about(),
                unknowns: free.count(),
                residual: self.relative(&fitted, &table, &table.readings),
                hold_out: None,
            };
            if !unseen.is_empty() {
                let trained = self
                    .fit(model, &table, &seen, options)
                    .map_err(|error| wrong(model, error))?;
                comparison.hold_out = Some(self.relative(&trained, &table, &unseen));
                if model == wanted {
                    hold_out = self.residuals(&trained, &table, &unseen);
                }
            }
            if model == wanted {
                models.insert(0, comparison);
                best = Some(fitted);
            } else {
                models.push(comparison);
            }
        }
        let Some(mut best) = best else {
            return Err(data.error("", "no model was fitted", "choose another --model"));
        };
        peaks::explained(self, data, &table, &best)?;
        if options.profile {
            self.with_profiles(&mut best, &table, options)
                .map_err(|error| wrong(wanted, error))?;
        }
        remarks.push(Remark::whole(match table.device.drive {
            Drive::Displacement => {
                "charge_per_force stands for its product with the silicone's stiffness, which stays that of the drawing"
            }
            Drive::Force => "the viscosity does not act between a force and its signal and stays that of the drawing",
        }));
        let found = &best.fit;
        Ok(Outcome {
            element: self.named.sensor.element.key(),
            model: wanted.name(),
            sensors: vec![CalibratedSensor::of(self.named, "")],
            parameters: paired(&best.parameters, found),
            covariance: CovarianceBlock::of([found]),
            open: open_in_words(&best.parameters, found),
            places: None,
            derived: self.derived(&best, &table),
            noise: result::noise_in_words(&table.readings, found, self.deviation),
            search: search_in_words(found, is_given(&table.readings)),
            residuals: self.residuals(&best, &table, &table.readings),
            hold_out,
            held_out: options.hold_out.words(),
            models,
            scope: result::scope(&table),
            remarks,
            figures: self.figures(&best, &table),
        })
    }
}

/// Puts calibrated values in the place of a sensor file's constants.
///
/// # Errors
/// The name of a parameter that is missing.
pub(super) fn apply(
    sensor: &mut Sensor,
    prefix: &str,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    let found = NAMES.map(|name| {
        let name = format!("{prefix}{name}");
        value(&name).ok_or(name)
    });
    let at: Vec<f64> = found.into_iter().collect::<Result<_, _>>()?;
    problem::put(sensor, &at);
    Ok(())
}

#[cfg(test)]
mod tests;
