//! The calibration file: what a calibration found, kept for prediction and
//! live touch.

use std::fmt::Write as _;

use std::collections::HashMap;

use serde::Deserialize;

use crate::devices;
use crate::meaning::differences;
use crate::options::NamedSensor;
use crate::outcome::{CovarianceBlock, Outcome, Provenance, ResidualSummary};
use crate::toml_tables::table as put_tables;
use taxel::InputError;
use taxel::sensor::{Element, Sensor};
use taxel::trained::{IndentationMap, TrainedMaps, TrainingError};
use taxel::{shown, toml_input};
use taxel_numerics::least_squares::singular_values;

/// Version of the file's form.
pub const CALIBRATION_SCHEMA: u32 = 2;

/// Advice for a file that cannot be used.
const AGAIN: &str = "make the file again with `taxel calibrate`";
/// Keys that a message about another sensor names.
const NAMED: usize = 4;

/// The version of the form alone.
#[derive(Deserialize)]
struct Form {
    schema: u32,
}

/// Key of the tables of learned places.
const PLACES: &str = "places";
/// Key of the element that is trained.
const TRAINED: &str = "trained";
/// Largest calibration file that is read, bytes: maps of 1024 channels from 20 000 frames have 78 MB (`skins` example,
/// `--kinds huge`).
const LARGEST: usize = 1 << 27;

/// A calibration file as it is read.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Version of its form.
    pub schema: u32,
    /// Version of taxel that wrote it.
    pub taxel: String,
    /// Date on which it was written.
    pub date: String,
    /// Key of the element.
    pub element: String,
    /// Name of the model.
    pub model: String,
    /// Size of the noise, in words: given or estimated.
    pub noise: String,
    /// End of the search.
    pub search: String,
    /// Remarks.
    pub remarks: Vec<String>,
    /// Combinations of parameters that the readings do not identify.
    pub not_identifiable: Vec<String>,
    /// Covariance of the parameters in their order; none without parameters.
    #[serde(default)]
    pub covariance: Vec<CovarianceBlock>,
    /// The readings.
    pub data: DataOf,
    /// Readings held out.
    pub hold_out: HeldOut,
    /// The sensors.
    pub sensor: Vec<SensorOf>,
    /// The parameters; none of a device that was trained.
    #[serde(default)]
    pub parameter: Vec<ParameterOf>,
    /// Residuals of the fit.
    #[serde(default)]
    pub residual: Vec<ResidualOf>,
    /// Ranges within which it holds.
    pub scope: Vec<ScopeOf>,
    /// Maps of a device without a physical model.
    pub trained: Option<TrainedMaps>,
    /// Map of indentations at known positions of a device with a model.
    pub places: Option<IndentationMap>,
}

/// The readings of a calibration.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataOf {
    /// Name of the file.
    pub file: String,
    /// SHA-256 of it.
    pub sha256: String,
}

/// Readings held out of a fit to the others.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Which ones.
    pub readings: String,
    /// Their residuals.
    pub residual: Vec<ResidualOf>,
}

/// A sensor of a calibration file.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorOf {
    /// Name of its file.
    pub file: String,
    /// Prefix of the names of its own parameters.
    pub prefix: String,
    /// The file itself: a calibration is for its values.
    pub text: String,
}

/// A parameter of a calibration file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterOf {
    /// Name.
    pub name: String,
    /// SI unit; empty for a plain number.
    pub unit: String,
    /// Best value.
    pub value: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// 95 % interval; of what is not identifiable that of its prior or bounds.
    pub interval: [f64; 2],
    /// Status of the parameter.
    pub status: String,
}

/// Largest size of a parameter: beyond any quantity of a sensor in SI units.
const LARGEST_PARAMETER: f64 = 1e30;

impl ParameterOf {
    /// The key of a number that cannot be meant, and why.
    fn unsound(&self) -> Option<(&'static str, String)> {
        let [low, high] = self.interval;
        let sized = |number: f64| number.abs() <= LARGEST_PARAMETER;
        if !sized(low) || !sized(high) {
            let message = format!("must be from -{LARGEST_PARAMETER:e} to {LARGEST_PARAMETER:e}");
            return Some(("interval", message));
        }
        if !(low..=high).contains(&self.value) {
            let message = format!(
                "is {:e}, but the interval of this parameter is from {low:e} to {high:e}",
                self.value
            );
            return Some(("value", message));
        }
        // Of a parameter that was not identified it is not known.
        (self.deviation < 0.0).then(|| ("deviation", "must be 0 or more".into()))
    }
}

/// Residuals of one kind of reading, SI.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResidualOf {
    /// Which.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Number of residuals.
    pub count: usize,
    /// Root of the mean square.
    pub root_mean_square: f64,
    /// Largest size.
    pub largest: f64,
}

/// A range of the readings, SI.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScopeOf {
    /// Quantity.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// From and to.
    pub range: [f64; 2],
}

impl Outcome {
    /// The calibration file as text.
    pub fn to_toml(&self, about: &Provenance<'_>) -> String {
        let mut text = String::from(
            "# Calibration of a sensor. Numbers are SI. Made by `taxel calibrate`, read by `taxel predict` and\n\
             # `taxel live` (--calibration).\n",
        );
        let _ = writeln!(text, "schema = {CALIBRATION_SCHEMA}");
        for (key, value) in [
            ("taxel", about.version),
            ("date", about.date),
            ("element", self.element),
            ("model", self.model),
            ("noise", &self.noise),
            ("search", &self.search),
        ] {
            let _ = writeln!(text, "{key} = {}", shown::toml(value));
        }
        let remarks: Vec<String> = self.remarks.iter().map(ToString::to_string).collect();
        list(&mut text, "remarks", &remarks);
        list(&mut text, "not_identifiable", &self.open);
        let _ = write!(
            text,
            "\n[data]\nfile = {}\nsha256 = {}\n\n[hold_out]\nreadings = {}\n",
            shown::toml(about.data),
            shown::toml(about.data_hash),
            shown::toml(&self.held_out)
        );
        if self.hold_out.is_empty() {
            text.push_str("residual = []\n");
        }
        for residual in &self.hold_out {
            put_residual(&mut text, "hold_out.residual", residual);
        }
        for sensor in &self.sensors {
            let _ = write!(
                text,
                "\n[[sensor]]\nfile = {}\nprefix = {}\ntext = \"\"\"\n{}\"\"\"\n",
                shown::toml(&sensor.name),
                shown::toml(&sensor.prefix),
                sensor
                    .text
                    .replace('\\', "\\\\")
                    .replace('"', "\\\"")
                    .replace('\r', "")
            );
        }
        for (parameter, estimate) in &self.parameters {
            let [low, high] = estimate.interval;
            let _ = write!(
                text,
                "\n[[parameter]]\nname = {}\nunit = {}\nvalue = {:e}\ndeviation = {:e}\ninterval = [{low:e}, {high:e}]\n\
                 status = {}\n",
                shown::toml(&parameter.name),
                shown::toml(parameter.unit),
                estimate.value,
                estimate.deviation,
                shown::toml(estimate.status.name())
            );
        }
        for block in &self.covariance {
            let _ = write!(
                text,
                "\n[[covariance]]\nfirst = {}\nrows = [\n",
                block.first
            );
            for row in &block.rows {
                let row: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
                let _ = writeln!(text, "  [{}],", row.join(", "));
            }
            text.push_str("]\n");
        }
        for residual in &self.residuals {
            put_residual(&mut text, "residual", residual);
        }
        for scope in &self.scope {
            let [low, high] = scope.range;
            let _ = write!(
                text,
                "\n[[scope]]\nname = {}\nunit = {}\nrange = [{low:e}, {high:e}]\n",
                shown::toml(&scope.name),
                shown::toml(scope.unit)
            );
        }
        if let Some(places) = &self.places {
            // A structure of numbers and lists always has a value.
            let tables = serde_json::to_value(places).unwrap_or_default();
            put_tables(&mut text, PLACES, &tables);
        }
        text
    }
}

fn put_residual(text: &mut String, table: &str, residual: &ResidualSummary) {
    let _ = write!(
        text,
        "\n[[{table}]]\nname = {}\nunit = {}\ncount = {}\nroot_mean_square = {:e}\nlargest = {:e}\n",
        shown::toml(&residual.name),
        shown::toml(residual.unit),
        residual.count,
        residual.root_mean_square,
        residual.largest
    );
}

fn list(text: &mut String, key: &str, items: &[String]) {
    let _ = writeln!(text, "{key} = [");
    for item in items {
        let _ = writeln!(text, "  {},", shown::toml(item));
    }
    text.push_str("]\n");
}

impl CalibrationFile {
    /// Reads a calibration file; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake, at its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let wrong = |key: &str, message: String| {
            let path: Vec<&str> = key.split('.').collect();
            Err(toml_input::at_key(file, text, &path, &message, AGAIN))
        };
        // Before the keys of a form that this program does not know.
        let Form { schema } = toml_input::parse_up_to(LARGEST, file, text)?;
        if schema < CALIBRATION_SCHEMA {
            let message = format!(
                "this calibration has the form {schema} of an older taxel, which does not say for which values of the \
                 sensor file it was made; this program reads {CALIBRATION_SCHEMA}"
            );
            return wrong("schema", message);
        }
        if schema > CALIBRATION_SCHEMA {
            let message =
                format!("schema {schema} is not known; this program reads {CALIBRATION_SCHEMA}");
            return wrong("schema", message);
        }
        let found: Self = toml_input::parse_up_to(LARGEST, file, text)?;
        let unsound = |key: &str, error: TrainingError| {
            let table = match &error {
                TrainingError::Unsound { table } => table,
                _ => "",
            };
            wrong(&format!("{key}.{table}"), error.to_string())
        };
        if let Some(Err(error)) = found.places.as_ref().map(IndentationMap::check) {
            return unsound(PLACES, error);
        }
        match &found.trained {
            Some(maps) => {
                if let Err(error) = maps.check() {
                    return unsound(TRAINED, error);
                }
            }
            None if found.element == TRAINED => {
                return wrong(
                    "element",
                    "the tables of the trained maps are missing".into(),
                );
            }
            None => {}
        }
        let count = found.parameter.len();
        let mut next = 0;
        for (place, block) in found.covariance.iter().enumerate() {
            let size = block.rows.len();
            if block.first != next || block.rows.iter().any(|row| row.len() != size) {
                let message =
                    format!("must begin with parameter {next} and have as many rows as columns");
                return wrong(&format!("covariance.{place}"), message);
            }
            if !block.is_covariance() {
                let message = "is not a covariance: must be symmetric, with squares of deviations";
                return wrong(&format!("covariance.{place}"), message.into());
            }
            next += size;
        }
        if next != count {
            let message = format!("has {next} rows in all, and there are {count} parameters");
            return wrong("covariance", message);
        }
        for (place, parameter) in found.parameter.iter().enumerate() {
            if let Some((key, message)) = parameter.unsound() {
                return wrong(&format!("parameter.{place}.{key}"), message);
            }
        }
        Ok(found)
    }

    /// The sensor with its calibrated values in the place of its constants.
    ///
    /// # Errors
    /// One message when the file is of other sensors, or lacks a parameter.
    pub fn apply(&self, file: &str, named: &NamedSensor<'_>) -> Result<Sensor, InputError> {
        let values: Vec<f64> = self.parameter.iter().map(|p| p.value).collect();
        self.with_values(file, named, &values)
    }

    /// As [`Self::apply`], one for each of the directions in which the
    /// parameters are uncertain, to both sides by [`STEP`] deviations.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn spread(
        &self,
        file: &str,
        named: &NamedSensor<'_>,
    ) -> Result<Vec<[Sensor; 2]>, InputError> {
        let best: Vec<f64> = self.parameter.iter().map(|p| p.value).collect();
        let side = |first: usize, direction: &[f64], sign: f64| {
            let mut values = best.clone();
            for (value, part) in values[first..].iter_mut().zip(direction) {
                *value += sign * STEP * part;
            }
            self.with_values(file, named, &values)
        };
        let mut sides = Vec::new();
        for block in &self.covariance {
            for direction in block.directions() {
                let side = |sign| side(block.first, &direction, sign);
                sides.push([side(-1.0)?, side(1.0)?]);
            }
        }
        Ok(sides)
    }

    /// The sensor of the file that means the same as `named`.
    fn made_for(&self, file: &str, named: &NamedSensor<'_>) -> Result<&SensorOf, InputError> {
        let of = |known: &SensorOf| differences(&known.text, named.text, named.sensor);
        let mut all: Vec<_> = self.sensor.iter().map(|known| (of(known), known)).collect();
        all.sort_by_key(|(differences, _)| differences.len());
        let Some((differences, known)) = all.into_iter().next() else {
            return Err(InputError::whole(file, "no sensor is named").help(AGAIN));
        };
        if differences.is_empty() {
            return Ok(known);
        }
        let more = match differences.len().saturating_sub(NAMED) {
            0 => String::new(),
            more => format!("; and {more} more"),
        };
        let message = format!(
            "this calibration was made for other values than those of {}: in {} {}{more}",
            named.name,
            known.file,
            differences[..differences.len().min(NAMED)].join("; ")
        );
        Err(InputError::whole(file, message)
            .key("sensor.text")
            .help("calibrate this sensor file, or give the values back that it was made with"))
    }

    fn with_values(
        &self,
        file: &str,
        named: &NamedSensor<'_>,
        values: &[f64],
    ) -> Result<Sensor, InputError> {
        let sensor = named.sensor;
        let of = self.made_for(file, named)?;
        let names = self.parameter.iter().map(|p| p.name.as_str());
        let known: HashMap<&str, f64> = names.zip(values.iter().copied()).collect();
        let value = |name: &str| known.get(name).copied();
        let mut calibrated = sensor.clone();
        let unfit =
            |key: &str, message: String| Err(InputError::whole(file, message).key(key).help(AGAIN));
        if let Err(name) = devices::apply(&mut calibrated, &self.model, &of.prefix, &value) {
            let message = format!("{name} is missing or of another kind of device");
            return unfit("parameter", message);
        }
        if let (Element::Trained(body), Some(maps)) = (&mut calibrated.element, &self.trained) {
            let (found, expected) = (maps.channels, body.channels().len());
            if found != expected {
                let message = format!("the maps have {found} channels, the sensor has {expected}");
                return unfit("trained.channels", message);
            }
            body.maps = Some(maps.clone());
        }
        if let (Element::Piezoelectric(element), Some(map)) =
            (&mut calibrated.element, &self.places)
        {
            let (found, expected) = (map.gains.len(), sensor.array.rows * sensor.array.columns);
            if found != expected {
                let message =
                    format!("the map has {found} gains, the sensor has {expected} elements");
                return unfit("places.gains", message);
            }
            element.indentations = Some(map.clone());
        }
        Ok(calibrated)
    }

    /// Columns of the answers for this sensor that the uncertainty reaches.
    pub fn uncertain_columns(sensor: &Sensor) -> &'static [&'static str] {
        devices::uncertain(sensor)
    }
}

impl CovarianceBlock {
    /// True if no entry exceeds what its variances allow, on both sides alike.
    fn is_covariance(&self) -> bool {
        let c = &self.rows;
        (0..c.len()).all(|i| {
            (0..c.len()).all(|j| {
                let most = (c[i][i] * c[j][j]).sqrt();
                let same = (c[i][j] - c[j][i]).abs() <= 1e-6 * most;
                // Beyond by rounding: strongly correlated parameters.
                c[i][i] >= 0.0 && same && c[i][j].abs() <= most * (1.0 + 1e-6)
            })
        })
    }

    /// Columns v with Σ v·vᵀ = covariance, those without length left out.
    fn directions(&self) -> Vec<Vec<f64>> {
        let c = &self.rows;
        let count = c.len();
        let deviation: Vec<f64> = (0..count).map(|j| c[j][j].sqrt()).collect();
        // In units of the deviations, so that sizes do not drown one another.
        let scaled = |i: usize, j: usize| {
            let product = deviation[i] * deviation[j];
            if product > 0.0 {
                c[i][j] / product
            } else {
                0.0
            }
        };
        let correlation: Vec<Vec<f64>> = (0..count)
            .map(|i| (0..count).map(|j| scaled(i, j)).collect())
            .collect();
        let (values, vectors) = singular_values(&correlation);
        (0..count)
            .filter(|k| values[*k] > 1e-12)
            .map(|k| {
                (0..count)
                    .map(|j| values[k].sqrt() * vectors[j][k] * deviation[j])
                    .collect()
            })
            .collect()
    }
}

/// Step of [`CalibrationFile::spread`] in standard deviations: small, so that strongly
/// correlated parameters stay on the straight line along which their covariance was made.
pub const STEP: f64 = 0.05;

/// The civil date of a moment, seconds after the beginning of 1970 in UTC.
///
/// ```
/// assert_eq!(taxel_calibrate::civil_date(951_782_400), "2000-02-29");
/// ```
pub fn civil_date(seconds: u64) -> String {
    // Years begin in March, so that the day that may be missing is the last.
    let days = seconds / 86_400 + 719_468;
    let era = days / 146_097;
    let day_of_era = days % 146_097;
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}
