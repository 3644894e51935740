//! Result of a calibration of any device.

use serde::{Deserialize, Serialize};

use crate::hysteresis::Loops;
use crate::loads::range;
use crate::options::NamedSensor;
use crate::remark::Remark;
use taxel::figure::Figure;
use taxel::trained::IndentationMap;
use taxel_numerics::least_squares::{Direction, Estimate, Fit, Parameter, Status};

/// Constants with what was found of each.
pub(crate) type Constants = Vec<(Parameter, Estimate)>;

/// Result of a calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// Key of the element in the sensor file.
    pub element: &'static str,
    /// Name of the model.
    pub model: &'static str,
    /// Each sensor with its file, and what its parameters begin with.
    pub sensors: Vec<CalibratedSensor>,
    /// Parameters with what the fit says of them.
    pub parameters: Vec<(Parameter, Estimate)>,
    /// Covariance of the parameters, in their order.
    pub covariance: Vec<CovarianceBlock>,
    /// Combinations of parameters that are not identifiable, in words.
    pub open: Vec<String>,
    /// What was learned from indentations at known positions.
    pub places: Option<IndentationMap>,
    /// Further quantities that follow from them.
    pub derived: Vec<Derived>,
    /// The noise, and how it is known.
    pub noise: String,
    /// End of the search, and with given noise χ² over the degrees of freedom.
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
    /// Remarks.
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CalibratedSensor {
    /// Name of its file.
    #[serde(rename = "file")]
    pub name: String,
    /// Prefix of the names of its own parameters, such as `gap_50um.`.
    pub prefix: String,
    /// Text of its file.
    #[serde(skip)]
    pub text: String,
}

/// A quantity that follows from the parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Derived {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// 95 % interval; `None` where the readings do not identify it.
    pub interval: Option<[f64; 2]>,
    /// Meaning, with its unit first.
    pub about: String,
}

impl Derived {
    /// A quantity that rises or falls with one parameter alone.
    pub(crate) fn of_parameter(
        name: impl Into<String>,
        estimate: &Estimate,
        follows: impl Fn(f64) -> f64,
        about: String,
    ) -> Self {
        let mut interval = estimate.interval.map(&follows);
        interval.sort_by(f64::total_cmp);
        let identified = estimate.status != Status::NotIdentifiable;
        Self {
            name: name.into(),
            value: follows(estimate.value),
            interval: identified.then_some(interval),
            about,
        }
    }

    /// Value and interval in words.
    pub(crate) fn in_words(&self, digits: impl Fn(f64) -> String) -> String {
        let value = digits(self.value);
        match self.interval.map(|ends| ends.map(&digits)) {
            Some([low, high]) => format!("{value} ({low} to {high})"),
            None => format!("({value}), not identifiable"),
        }
    }
}

/// Residuals of one kind of reading of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualSummary {
    /// Which: `gap_50um.capacitance`.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Count.
    pub count: usize,
    /// Root of the mean square, SI.
    pub root_mean_square: f64,
    /// Largest size, SI.
    pub largest: f64,
    /// Range of the readings, SI.
    pub range: f64,
}

/// One model beside others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelComparison {
    /// Name.
    pub name: &'static str,
    /// Name.
    pub about: &'static str,
    /// Fitted parameters.
    pub unknowns: usize,
    /// Residual of the signal over its range, root of the mean square over all
    /// sensors.
    #[serde(rename = "relative_residual")]
    pub residual: f64,
    /// The same of the readings held out; `None` without such.
    #[serde(rename = "relative_hold_out")]
    pub hold_out: Option<f64>,
}

/// A range of readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scope {
    /// Quantity.
    pub name: String,
    /// SI unit; empty for a plain number.
    pub unit: &'static str,
    /// From and to, SI.
    pub range: [f64; 2],
}

impl Scope {
    /// The range of these values.
    pub(crate) fn of(
        name: impl Into<String>,
        unit: &'static str,
        values: impl Iterator<Item = f64>,
    ) -> Self {
        Self {
            name: name.into(),
            unit,
            range: range(values),
        }
    }
}

impl ResidualSummary {
    /// Summary of `residuals` of readings that span `range`.
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

    /// Root of the mean square over the range.
    pub(crate) fn share(&self) -> f64 {
        self.root_mean_square / self.range.max(f64::MIN_POSITIVE)
    }
}

/// Residual of the signal over its range, root of the mean square; the signal is the
/// first kind of reading, with all others of its unit.
pub(crate) fn relative(residuals: &[ResidualSummary]) -> f64 {
    let signal = || residuals.iter().filter(|r| r.unit == residuals[0].unit);
    let squares = signal().map(|r| r.count as f64 * r.share().powi(2));
    let count: usize = signal().map(|r| r.count).sum();
    (squares.sum::<f64>() / count.max(1) as f64).sqrt()
}

/// Parameters with what a fit says of them.
pub(crate) fn paired(parameters: &[Parameter], fit: &Fit) -> Constants {
    let estimates = fit.estimates.iter().copied();
    parameters.iter().cloned().zip(estimates).collect()
}

/// End of a search; χ² means something where the noise was given.
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
            format!("{last} is not identifiable from the readings")
        } else {
            format!(
                "{} and {last} cannot be identified separately",
                members.join(", ")
            )
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
            "{names}: moving them together ({}) by {:.1} of their typical sizes changes the readings by no more than \
             their noise{remedy}",
            signs.join(" "),
            direction.deviation
        )
    };
    found.directions.iter().map(words).collect()
}

impl Outcome {
    /// An outcome in which nothing was found yet; `sensors` are of one kind, each with
    /// what its own parameters begin with.
    pub(crate) fn new(model: &'static str, sensors: &[(&NamedSensor<'_>, &str)]) -> Self {
        let element = sensors
            .first()
            .map_or("", |(named, _)| named.sensor.element.key());
        let sensor = |(named, prefix): &(&NamedSensor<'_>, &str)| CalibratedSensor {
            name: named.name.to_owned(),
            prefix: (*prefix).to_owned(),
            text: named.text.to_owned(),
        };
        Self {
            element,
            model,
            sensors: sensors.iter().map(sensor).collect(),
            ..Self::default()
        }
    }

    /// Adds the hysteresis of bodies that was found beside the other constants.
    pub(crate) fn add_loops(&mut self, loops: impl IntoIterator<Item = Loops>) {
        for one in loops {
            self.add_constants(one.parameters, one.covariance);
            self.figures.push(one.figure);
        }
    }

    /// Adds constants that are independent of the others.
    pub(crate) fn add_constants(&mut self, parameters: Constants, covariance: Vec<Vec<f64>>) {
        self.covariance.push(CovarianceBlock {
            first: self.parameters.len(),
            rows: covariance,
        });
        self.parameters.extend(parameters);
    }

    /// True if every parameter is identified by the readings or its prior.
    pub fn is_identified(&self) -> bool {
        let known =
            |(_, estimate): &(Parameter, Estimate)| estimate.status != Status::NotIdentifiable;
        self.parameters.iter().all(known)
    }
}

/// Program and time of a calibration; the library knows neither.
#[derive(Debug, Clone, Copy)]
pub struct Provenance<'a> {
    /// Version and commit of taxel.
    pub version: &'a str,
    /// Date, such as `2026-02-03`.
    pub date: &'a str,
    /// Name of the file of readings.
    pub data: &'a str,
    /// SHA-256 of it.
    pub data_hash: &'a str,
}
