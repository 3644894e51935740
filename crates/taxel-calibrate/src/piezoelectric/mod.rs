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
mod cross_validation;
mod indentations;
mod peaks;
mod positions;
mod problem;
mod result;
mod synthetic;

use crate::device_model::{
    Calibratable, DeviceModel, Fitted as FittedTo, Model as NamedModel, Task,
};
use crate::options::{IndentationOptions, NamedSensor, SyntheticOptions};
use crate::outcome::{CovarianceBlock, Outcome};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use taxel::InputError;
use taxel::electronics::OutputUnit;
use taxel::estimation::ProfileModel;
use taxel::layout::Layout;
use taxel::predict::LoadColumn;
use taxel::sensor::Sensor;
use taxel_numerics::least_squares::{Estimate, FitError, Parameter, Problem, Status, fit};

use columns::with_elements;
use problem::{Bench, Drive, GAIN, LEAK, NAMES, OWN, Reading, Table, UNITS, VISCOSITY};

/// Calibrates one piezoelectric sensor.
pub(super) struct PiezoelectricCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    /// Least and greatest output that is not clipped, V, or C of a charge that is measured.
    span: [f64; 2],
    /// Standard deviation of a reading by the board's own figures.
    deviation: f64,
    /// Output per force in the middle of the band, V/N or C/N.
    output_per_newton: f64,
    /// Unit of the output.
    unit: OutputUnit,
    /// C/N.
    charge_per_force: f64,
    layout: Layout,
    /// Profiles of contacts, as drawn.
    profile: ProfileModel,
}

static MODELS: [NamedModel; 2] = [
    NamedModel {
        name: "dynamic",
        about: "charge per force, leak and viscosity",
    },
    NamedModel {
        name: "gain",
        about: "charge per force; leak and viscosity of the drawing",
    },
];

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

    /// The viscosity delays the signal by μ/E of the silicone: a peak, where the
    /// signal stands still, does not identify it, a recording does.
    fn frees(self, place: usize, table: &Table) -> bool {
        match place {
            GAIN => true,
            LEAK => self == Self::Dynamic,
            // A force reaches the element whole, however it came.
            _ => {
                let displaced = table.device.drive == Drive::Displacement;
                self == Self::Dynamic && table.is_recorded() && displaced
            }
        }
    }
}

/// Share of each constant that matters: of the slope two hundredths, of the
/// time constant a tenth, of the viscosity a quarter.
const SIZES: [f64; OWN] = [0.02, 0.1, 0.25];
/// Factors about the drawing between which each constant is searched.
const WITHIN: [[f64; 2]; OWN] = [[0.01, 100.0], [1e-3, 1e3], [0.0, 1e3]];

type Fitted = FittedTo<Reading, ()>;

impl<'a> PiezoelectricCalibrator<'a> {
    /// `None` when the sensor is of another kind.
    pub(super) fn new(named: &'a NamedSensor<'a>) -> Option<Self> {
        let array = named.sensor.piezoelectric().ok()?;
        Some(Self {
            named,
            span: array.board.span(),
            deviation: array.board.deviation(),
            output_per_newton: array.output_per_newton(),
            unit: array.board.unit(),
            charge_per_force: array.element.charge_per_force,
            layout: array.layout(),
            profile: array.profile_model(),
        })
    }

    fn bench<'b>(&self, table: &'b Table, readings: &'b [Reading]) -> Bench<'b> {
        Bench {
            table,
            readings,
            deviation: self.deviation,
        }
    }
}

impl Calibratable for PiezoelectricCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        with_elements(&self.unit)
    }

    fn group(&self) -> &'static str {
        ""
    }

    fn models(&self) -> &'static [NamedModel] {
        &MODELS
    }

    fn synthetic(&self, options: &SyntheticOptions) -> String {
        synthetic::table(self.named.sensor, options)
    }

    fn synthetic_indentations(&self, options: &IndentationOptions) -> Option<String> {
        synthetic::indentations(self, options)
    }
}

impl DeviceModel for PiezoelectricCalibrator<'_> {
    type Noise = ();

    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)> {
        vec![(self.named, "")]
    }

    fn fit(&self, task: &Task<'_, Self>) -> Result<Fitted, FitError> {
        let (table, readings) = (task.context, task.readings);
        let drawn = table.device.drawn();
        let parameter = |place: usize| {
            let at = drawn[place];
            let free = Model::ALL[task.model].frees(place, table);
            let start = match place {
                GAIN => at * table.ratio(readings, &drawn).clamp(0.02, 50.0),
                // A silicone without damping would have no size.
                VISCOSITY => at.max(1.0),
                _ => at,
            };
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
        };
        let parameters: Vec<Parameter> = (0..OWN).map(parameter).collect();
        let given = readings.iter().all(|r| r.deviation.is_some());
        let options = task.options.fitting(given);
        Ok(Fitted {
            model: task.model,
            fit: fit(&self.bench(table, readings), &parameters, &options)?,
            parameters,
            readings: readings.to_vec(),
            options,
            given,
            noise: (),
        })
    }

    fn problem<'b>(
        &'b self,
        context: &'b Table,
        fitted: &'b Fitted,
    ) -> Option<Box<dyn Problem + 'b>> {
        Some(Box::new(self.bench(context, &fitted.readings)))
    }

    fn has_indentations(&self, table: &ReadingTable) -> bool {
        indentations::has(table)
    }

    fn as_drawn(&self) -> Option<Outcome> {
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
        Some(Outcome {
            parameters: (0..OWN).map(fixed).collect(),
            covariance: vec![CovarianceBlock {
                first: 0,
                rows: vec![vec![0.0; OWN]; OWN],
            }],
            noise: "of the indentations".into(),
            search: "constants of the drawing; indentations identify positions alone".into(),
            ..Outcome::new("as-drawn", &self.sensors())
        })
    }

    fn learn(&self, outcome: &mut Outcome, table: &ReadingTable) -> Result<(), InputError> {
        outcome.remarks.extend_from_slice(&table.remarks);
        let pressed = self.indentations(table, &mut outcome.remarks)?;
        positions::learn(self, &pressed, outcome).map_err(|error| {
            let help = "press at positions all over the elements, 0.5 to 1 mm apart";
            table.error("x", error.to_string(), help)
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
