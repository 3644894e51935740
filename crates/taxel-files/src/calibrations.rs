//! Sensors with the values of a calibration.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use taxel::InputError;
use taxel::predict::Predictor;
use taxel::sensor::Sensor;
use taxel::shown;
use taxel_calibrate::{CalibrationFile, Propagated, civil_date};

use crate::Stop;
use crate::files::{self, NamedSensor};
use crate::reading::text;

/// Reads the first sensor and those beside it.
///
/// # Errors
/// A file that cannot be read, or its first mistake.
pub fn read_sensors(first: &Path, others: &[PathBuf]) -> Result<Vec<NamedSensor>, Stop> {
    let paths = std::iter::once(first).chain(others.iter().map(PathBuf::as_path));
    paths.map(files::sensor).collect()
}

/// The date of this day, such as `2026-02-03`.
pub fn today() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    civil_date(now.map_or(0, |now| now.as_secs()))
}

/// The sensor with its calibrated values, if a calibration is given.
///
/// # Errors
/// A file that cannot be read, a mistake of the calibration, or one of another sensor.
pub fn applied(named: NamedSensor, calibration: Option<&Path>) -> Result<NamedSensor, Stop> {
    let Some(path) = calibration else {
        return Ok(named);
    };
    let name = shown::path(path);
    Ok(applied_text(named, &name, &text(path)?)?)
}

/// The sensor with the values of a calibration.
///
/// # Errors
/// A mistake of the calibration, or one of another sensor.
pub fn applied_text(named: NamedSensor, name: &str, text: &str) -> Result<NamedSensor, InputError> {
    let file = CalibrationFile::parse(name, text)?;
    let sensor = file.apply(name, &named.described())?;
    Ok(NamedSensor { sensor, ..named })
}

/// `predictor` of a calibrated sensor, whose answers carry the deviation that
/// the calibration leaves; `drawn` is the sensor as its file says.
///
/// # Errors
/// A file that cannot be read, a mistake of the calibration, or what `make` refuses.
pub fn propagated(
    predictor: Box<dyn Predictor>,
    drawn: &NamedSensor,
    calibration: &Path,
    make: impl Fn(&Sensor) -> Result<Box<dyn Predictor>, Stop>,
) -> Result<Box<dyn Predictor>, Stop> {
    let text = text(calibration)?;
    propagated_text(predictor, drawn, &shown::path(calibration), &text, make)
}

/// The same of the text of a calibration.
///
/// # Errors
/// A mistake of the calibration, or what `make` refuses.
pub fn propagated_text<E: From<InputError>>(
    predictor: Box<dyn Predictor>,
    drawn: &NamedSensor,
    name: &str,
    text: &str,
    make: impl Fn(&Sensor) -> Result<Box<dyn Predictor>, E>,
) -> Result<Box<dyn Predictor>, E> {
    let sides = CalibrationFile::parse(name, text)?
        .spread(name, &drawn.described())?
        .iter()
        .map(|[below, above]| Ok([make(below)?, make(above)?]))
        .collect::<Result<_, E>>()?;
    let names = CalibrationFile::uncertain_columns(&drawn.sensor);
    Ok(Box::new(Propagated::new(predictor, sides, names)))
}
