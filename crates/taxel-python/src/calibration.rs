//! Calibration: from measurements to the constants of a sensor.

use std::path::PathBuf;

use pyo3::prelude::*;
use taxel::sensor::Element;
use taxel::shown;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, HoldOut, Provenance, ReadingTable, ScaleUnit,
    SyntheticOptions, TrainingFile, calibrator, train,
};
use taxel_files::{self as files, COMMIT, NamedSensor, VERSION};

use crate::fault::Fault;
use crate::pool;
use crate::sensor::Sensor;

/// A calibration as its file describes it.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Calibration {
    name: String,
    text: String,
    file: CalibrationFile,
}

#[pymethods]
impl Calibration {
    #[new]
    fn new(py: Python<'_>, name: String, text: String) -> PyResult<Self> {
        pool::run(py, move |_| {
            let file = CalibrationFile::parse(&name, &text)?;
            Ok(Self { name, text, file })
        })
    }

    #[getter]
    fn file(&self) -> &str {
        &self.name
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn model(&self) -> &str {
        &self.file.model
    }

    #[getter]
    fn element(&self) -> &str {
        &self.file.element
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.file.remarks.clone()
    }

    /// What maps of a device that was trained estimate, by the names of its columns.
    fn outputs(&self) -> Vec<&'static str> {
        let mut outputs = Vec::new();
        if let Some(maps) = &self.file.trained {
            if maps.position.is_some() {
                outputs.extend(["x", "y"]);
            }
            if maps.force.is_some() {
                outputs.push("force_z");
            }
        }
        outputs
    }

    /// Name, value, deviation, interval, unit and verdict of each parameter.
    fn parameters(&self) -> Vec<(String, f64, f64, [f64; 2], String, String)> {
        let parameters = self.file.parameter.iter();
        parameters
            .map(|one| {
                let (unit, status) = (one.unit.clone(), one.status.clone());
                (
                    one.name.clone(),
                    one.value,
                    one.deviation,
                    one.interval,
                    unit,
                    status,
                )
            })
            .collect()
    }
}

/// The sensors of a calibration as the library takes them.
fn described(named: &[NamedSensor]) -> Vec<taxel_calibrate::NamedSensor<'_>> {
    named.iter().map(NamedSensor::described).collect()
}

/// Calibration file, report and JSON of a calibration; recordings may be given as names and texts.
#[pyfunction]
#[pyo3(signature = (sensor, beside, data, hold_out, model = None, profile = false, robust = false, rate = None, scale_unit = None, texts = None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn calibrate(
    py: Python<'_>,
    sensor: &Sensor,
    beside: Vec<PyRef<'_, Sensor>>,
    data: Vec<PathBuf>,
    hold_out: &str,
    model: Option<String>,
    profile: bool,
    robust: bool,
    rate: Option<f64>,
    scale_unit: Option<&str>,
    texts: Option<Vec<(String, String)>>,
) -> PyResult<(String, String, String, String)> {
    let named: Vec<NamedSensor> = std::iter::once(NamedSensor::clone(&sensor.named))
        .chain(
            beside
                .iter()
                .map(|sensor| NamedSensor::clone(&sensor.named)),
        )
        .collect();
    let options = CalibrateOptions {
        hold_out: HoldOut::parse(hold_out)
            .map_err(|message| Fault::Wrong(format!("hold_out: {message}")))?,
        model,
        profile,
        robust,
        rate: match rate {
            Some(rate) if !(rate > 0.0 && rate.is_finite()) => {
                let message = format!("rate: {rate} is no rate; give rows a second, such as 28.0");
                return Err(Fault::Wrong(message).into());
            }
            rate => rate,
        },
        scale_unit: match scale_unit {
            None => None,
            Some("g") => Some(ScaleUnit::Grams),
            Some("N") => Some(ScaleUnit::Newtons),
            Some(other) => {
                let message = format!("scale_unit: {other:?} is none of g, N");
                return Err(Fault::Wrong(message).into());
            }
        },
    };
    pool::run(py, move |_| {
        let sensors = described(&named);
        let (version, date) = (format!("{VERSION} {COMMIT}"), files::today());
        let given = texts.iter().flatten().map(|(name, _)| name.clone());
        let names = data.iter().map(|path| shown::path(path)).chain(given);
        let names = names.collect::<Vec<_>>().join(", ");
        let about = |hash: &str| -> (String, String) { (names.clone(), hash.to_owned()) };
        if let [one] = sensors.as_slice()
            && matches!(one.sensor.element, Element::Trained(_))
        {
            let groups = match texts {
                Some(texts) => {
                    let file = |(name, text)| TrainingFile { name, text };
                    vec![texts.into_iter().map(file).collect()]
                }
                None => files::recordings(&data)?,
            };
            let texts: Vec<&str> = groups
                .iter()
                .flatten()
                .map(|file| file.text.as_str())
                .collect();
            let hash = files::sha256(texts.concat().as_bytes());
            let maps = train(one, &groups, &options)?;
            let (data, data_hash) = about(&hash);
            let about = Provenance {
                version: &version,
                date: &date,
                data: &data,
                data_hash: &data_hash,
            };
            let outcome = &maps.outcome;
            return Ok((
                maps.to_toml(&about),
                outcome.html(&about),
                outcome.json(&about).to_string(),
                outcome.text(),
            ));
        }
        let calibrator = calibrator(&sensors).map_err(|error| Fault::Wrong(error.to_string()))?;
        let (mut tables, mut texts) = (Vec::new(), String::new());
        for path in &data {
            let text = files::text(path)?;
            let table = ReadingTable::parse(
                &shown::path(path),
                &text,
                calibrator.columns(),
                calibrator.group(),
            )?;
            tables.push(table);
            texts.push_str(&text);
        }
        let outcome = calibrator.calibrate_all(&tables, &options)?;
        let (data, data_hash) = about(&files::sha256(texts.as_bytes()));
        let about = Provenance {
            version: &version,
            date: &date,
            data: &data,
            data_hash: &data_hash,
        };
        Ok((
            outcome.to_toml(&about),
            outcome.html(&about),
            outcome.json(&about).to_string(),
            outcome.text(),
        ))
    })
}

/// Synthetic calibration data of sensors, CSV.
#[pyfunction]
pub(crate) fn synthetic(
    py: Python<'_>,
    sensor: &Sensor,
    beside: Vec<PyRef<'_, Sensor>>,
    seed: u64,
    readings: usize,
    noise: f64,
) -> PyResult<String> {
    let named: Vec<NamedSensor> = std::iter::once(NamedSensor::clone(&sensor.named))
        .chain(
            beside
                .iter()
                .map(|sensor| NamedSensor::clone(&sensor.named)),
        )
        .collect();
    if !(1..=1_000_000).contains(&readings) || !(0.0..=1.0).contains(&noise) {
        let message = "calibration data: readings must be from 1 to 1000000, noise from 0 to 1";
        return Err(Fault::Wrong(message.into()).into());
    }
    pool::run(py, move |_| {
        let sensors = described(&named);
        let calibrator = calibrator(&sensors).map_err(|error| Fault::Wrong(error.to_string()))?;
        Ok(calibrator.synthetic(&SyntheticOptions {
            seed,
            readings,
            noise,
            ..SyntheticOptions::default()
        }))
    })
}
