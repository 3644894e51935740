//! What a calibration found, whatever the device.

use serde::{Deserialize, Serialize};

use crate::hysteresis::Loops;
use crate::remark::Remark;
use taxel::figure::Figure;
use taxel::predict::LoadColumn;
use taxel::sensor::Sensor;
use taxel::trained::PlaceMap;
use taxel_numerics::least_squares::{
    Direction, Estimate, Fit, FitOptions, Loss, NoiseSize, Parameter, Status,
};
use taxel_recording::InputError;

use crate::clock::same_moment;
use crate::readings::BenchData;
use crate::split::HoldOut;

/// A sensor with what files say of it.
#[derive(Debug, Clone, Copy)]
pub struct NamedSensor<'a> {
    /// Name of its file, or of a shipped one.
    pub name: &'a str,
    /// SHA-256 of its text, in hexadecimal digits.
    pub hash: &'a str,
    /// What the file says.
    pub sensor: &'a Sensor,
}

/// Options of a calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrateOptions {
    /// Which readings are held out; by default the last 20 % in time.
    pub hold_out: HoldOut,
    /// Name of the model whose parameters are wanted; by default the first of
    /// [`Calibrator::models`].
    pub model: Option<String>,
    /// Whether intervals are taken from profiles of the likelihood.
    pub profile: bool,
    /// Whether wrong readings are to be forgotten (Huber's loss).
    pub robust: bool,
}

impl CalibrateOptions {
    /// Options of the fits, by whether the noise is given with every reading.
    pub(crate) fn fitting(&self, given: bool) -> FitOptions {
        FitOptions {
            noise: if given {
                NoiseSize::Given
            } else {
                NoiseSize::Estimated
            },
            loss: if self.robust {
                Loss::Huber
            } else {
                Loss::Square
            },
            ..FitOptions::default()
        }
    }
}

/// Options of a synthetic bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BenchOptions {
    /// Seed of its noise.
    pub seed: u64,
    /// Readings of each sensor.
    pub readings: usize,
    /// Cycles of loading and unloading.
    pub cycles: usize,
    /// Largest relative compression.
    pub compression: f64,
    /// Standard deviation of a reading over the largest one, of forces and of
    /// changes of the signal.
    pub noise: f64,
    /// Force of loading over that of unloading, less one.
    pub hysteresis: f64,
    /// Change of the signal from the first reading to the last, over its range.
    pub drift: f64,
    /// Tilt of the probe along the gap, rad.
    pub tilt: f64,
    /// Share of the largest change of a channel from which it reads no more.
    pub saturation: f64,
}

impl Default for BenchOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            readings: 200,
            cycles: 2,
            compression: 0.28,
            noise: 0.01,
            hysteresis: 0.0,
            drift: 0.0,
            tilt: 0.0,
            saturation: 1.0,
        }
    }
}

/// Options of a synthetic bench that presses at places.
#[derive(Debug, Clone, PartialEq)]
pub struct PressOptions {
    /// Seed of its noise.
    pub seed: u64,
    /// Radii of the contacts of the probes, m.
    pub radii: Vec<f64>,
    /// Distance of the presses, m.
    pub grid: f64,
    /// Standard deviation of a signal over the highest one of its press.
    pub noise: f64,
}

/// Calibrates one kind of device.
pub trait Calibrator {
    /// What the readings may name; the order is that of [`BenchData::number`].
    fn columns(&self) -> &'static [LoadColumn];

    /// Name of the column whose value says which sensor a row is of.
    fn group(&self) -> &'static str;

    /// Names of the models that can be fitted, the usual one first.
    fn models(&self) -> &'static [&'static str];

    /// Fits the readings.
    ///
    /// # Errors
    /// What the readings cannot be: of other sensors, of other units, too few.
    fn calibrate(
        &self,
        data: &BenchData,
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError>;

    /// Fits the readings of several tables together; most devices have one.
    ///
    /// # Errors
    /// As [`Self::calibrate`].
    fn calibrate_all(
        &self,
        tables: &[BenchData],
        options: &CalibrateOptions,
    ) -> Result<Outcome, InputError> {
        if let [one] = tables {
            same_moment(one, self.columns(), self.group())?;
            return self.calibrate(one, options);
        }
        let file = tables
            .get(1)
            .map_or("readings", |table| table.file.as_str());
        let message = "a second table: this device is calibrated from one";
        Err(InputError::whole(file, message).help("put the readings into one table"))
    }

    /// Readings of a synthetic bench as CSV, with its truth in comments.
    fn bench(&self, options: &BenchOptions) -> String;

    /// Presses of a synthetic bench at known places; none for a device that
    /// learns nothing from them.
    fn press_bench(&self, options: &PressOptions) -> Option<String> {
        let _ = options;
        None
    }
}

/// What a calibration found.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Key of the element in the sensor file.
    pub element: &'static str,
    /// Name of the model.
    pub model: &'static str,
    /// File name and hash of each sensor, and what its parameters begin with.
    pub sensors: Vec<CalibratedSensor>,
    /// Parameters with what the fit says of them.
    pub parameters: Vec<(Parameter, Estimate)>,
    /// Covariance of the parameters, in their order.
    pub covariance: Vec<CovarianceBlock>,
    /// Combinations that the readings do not tell apart, in words.
    pub open: Vec<String>,
    /// What presses at known places taught.
    pub places: Option<PlaceMap>,
    /// Further quantities that follow: name, value, 95 % interval, meaning.
    pub derived: Vec<Derived>,
    /// The noise, and how it is known.
    pub noise: String,
    /// How the search ended, and with given noise χ² over the degrees of freedom.
    pub search: String,
    /// Residuals of each kind of reading.
    pub residuals: Vec<ResidualSummary>,
    /// Error of the readings held out of a fit to the others.
    pub hold_out: Vec<ResidualSummary>,
    /// Which readings those were.
    pub held_out: String,
    /// The models beside one another.
    pub models: Vec<ModelComparison>,
    /// Ranges of the readings: within them the calibration holds.
    pub scope: Vec<Scope>,
    /// What was noticed.
    pub remarks: Vec<Remark>,
    /// Readings, model and residuals.
    pub figures: Vec<Figure>,
}

/// Covariance of some parameters that follow each other; those of other blocks
/// are independent of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CovarianceBlock {
    /// Place of the first of them.
    pub first: usize,
    /// Covariance, SI.
    pub rows: Vec<Vec<f64>>,
}

impl CovarianceBlock {
    /// Blocks of several fits whose parameters follow each other.
    pub(crate) fn of<'a>(fits: impl IntoIterator<Item = &'a Fit>) -> Vec<Self> {
        let mut first = 0;
        let block = |fit: &Fit| {
            let block = Self {
                first,
                rows: fit.covariance.clone(),
            };
            first += block.rows.len();
            block
        };
        fits.into_iter().map(block).collect()
    }
}

/// A sensor of a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CalibratedSensor {
    /// Name of its file.
    pub name: String,
    /// SHA-256 of its file.
    pub hash: String,
    /// What the names of its own parameters begin with, such as `gap_50um.`.
    pub prefix: String,
}

impl CalibratedSensor {
    /// A sensor whose own parameters begin with `prefix`.
    pub(crate) fn of(named: &NamedSensor<'_>, prefix: &str) -> Self {
        Self {
            name: named.name.to_owned(),
            hash: named.hash.to_owned(),
            prefix: prefix.to_owned(),
        }
    }
}

/// A quantity that follows from the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// What it is.
    pub about: String,
}

/// Residuals of one kind of reading of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualSummary {
    /// Which: `gap_50um.capacitance`.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// How many.
    pub count: usize,
    /// Root of the mean square, SI.
    pub root_mean_square: f64,
    /// Largest size, SI.
    pub largest: f64,
    /// Range of the readings, SI.
    pub range: f64,
}

/// One model beside others.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelComparison {
    /// Name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Fitted parameters.
    pub unknowns: usize,
    /// Residual of the signal over its range, root of the mean square over all
    /// sensors.
    pub residual: f64,
    /// The same of the readings held out; `None` without such.
    pub hold_out: Option<f64>,
}

/// A range of readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Scope {
    /// Quantity.
    pub name: String,
    /// SI unit; empty for a plain number.
    pub unit: &'static str,
    /// From and to, SI.
    pub range: [f64; 2],
}

impl ResidualSummary {
    /// Of `residuals` of readings that span `range`.
    pub(crate) fn of(name: String, unit: &'static str, residuals: &[f64], range: f64) -> Self {
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        let count = residuals.len();
        Self {
            name,
            unit,
            count,
            root_mean_square: (square / count.max(1) as f64).sqrt(),
            largest: residuals.iter().fold(0.0, |most, r| most.max(r.abs())),
            range,
        }
    }
}

/// Parameters with what a fit says of them.
pub(crate) fn paired(parameters: &[Parameter], fit: &Fit) -> Vec<(Parameter, Estimate)> {
    let estimates = fit.estimates.iter().copied();
    parameters.iter().cloned().zip(estimates).collect()
}

/// Place among `models` of the one that is asked for, by default the first.
pub(crate) fn wanted(models: &[&str], options: &CalibrateOptions) -> Result<usize, InputError> {
    let Some(name) = &options.model else {
        return Ok(0);
    };
    let found = models.iter().position(|known| known == name);
    found.ok_or_else(|| {
        InputError::whole("--model", format!("\"{name}\" is no model of this device"))
            .help(format!("use one of: {}", models.join(", ")))
    })
}

/// How a search ended; χ² tells something where the noise was given.
pub(crate) fn search_in_words(found: &Fit, given: bool) -> String {
    let ended = format!("{} after {} steps", found.stop.name(), found.iterations);
    if !given {
        return format!("{ended}; {} degrees of freedom", found.freedom);
    }
    format!(
        "{ended}; chi-square over degrees of freedom {:.3} ({} of them)",
        found.reduced_chi_square(),
        found.freedom
    )
}

/// The combinations that a fit leaves open, in words.
pub(crate) fn open_in_words(parameters: &[Parameter], found: &Fit) -> Vec<String> {
    let words = |direction: &Direction| {
        let one = |j: usize| {
            let (parameter, estimate) = (&parameters[j], &found.estimates[j]);
            format!(
                "{} (sigma {:.2e}{}{})",
                parameter.name,
                estimate.deviation,
                if parameter.unit.is_empty() { "" } else { " " },
                parameter.unit
            )
        };
        let mut members: Vec<String> = direction
            .members
            .iter()
            .map(|member| one(member.parameter))
            .collect();
        let last = members.pop().unwrap_or_default();
        let names = if members.is_empty() {
            format!("{last} is not told by the readings")
        } else {
            format!("{} and {last} cannot be told apart", members.join(", "))
        };
        let signs: Vec<&str> = direction
            .members
            .iter()
            .map(|member| if member.share < 0.0 { "-" } else { "+" })
            .collect();
        let remedy = if direction.remedy.is_empty() {
            String::new()
        } else {
            format!("; {}", direction.remedy)
        };
        format!(
            "{names}: moving them together ({}) by {:.1} of their sensible sizes changes the readings by no more than \
             their noise{remedy}",
            signs.join(" "),
            direction.deviation
        )
    };
    found.directions.iter().map(words).collect()
}

impl Outcome {
    /// Adds the hysteresis of bodies that was found beside the other constants.
    pub(crate) fn add_loops(&mut self, loops: impl IntoIterator<Item = Loops>) {
        for one in loops {
            self.add_constants(one.parameters, one.covariance);
            self.figures.push(one.figure);
        }
    }

    /// Adds constants that are independent of the others.
    pub(crate) fn add_constants(
        &mut self,
        parameters: Vec<(Parameter, Estimate)>,
        covariance: Vec<Vec<f64>>,
    ) {
        self.covariance.push(CovarianceBlock {
            first: self.parameters.len(),
            rows: covariance,
        });
        self.parameters.extend(parameters);
    }

    /// Whether every parameter is told by the readings or by its prior.
    pub fn is_identified(&self) -> bool {
        let told = |(_, estimate): &(Parameter, Estimate)| estimate.status != Status::NotIdentified;
        self.parameters.iter().all(told)
    }
}
