//! Materials: the library, law files, hardness, fits of arrays.

use std::path::PathBuf;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use serde_json::Value;
use taxel_files as files;
use taxel_material as material;
use taxel_material::{Form, Held, Material, Options, Slack, Steps, Test};

use crate::fault::{Fault, value_error};

fn wrong(message: String) -> PyErr {
    Fault::Wrong(message).into()
}

/// The library as JSON.
#[pyfunction]
pub(crate) fn material_list() -> String {
    Value::Array(material::all().map(|one| one.json()).collect()).to_string()
}

/// A material of the library, or of a law file, as JSON.
#[pyfunction]
pub(crate) fn material_load(name: PathBuf) -> PyResult<String> {
    let text = name.to_string_lossy();
    let found = match material::named(&text) {
        Some(found) => found,
        None if name.exists() => {
            let law = files::text(&name).map_err(Fault::from)?;
            files::law_file(&name, &law).map_err(Fault::from)?
        }
        None => {
            let near = material::near(&text).join(", ");
            let message =
                format!("no material and no file is called \"{text}\"\nhelp: near names: {near}");
            return Err(wrong(message));
        }
    };
    Ok(found.json().to_string())
}

/// The modulus of a hardness as JSON.
#[pyfunction]
pub(crate) fn material_hardness(text: &str) -> PyResult<String> {
    let found = material::Hardness::parse(text).map_err(|error| wrong(error.to_string()))?;
    Ok(found.json().to_string())
}

/// Laws of a loading test as JSON, with the law file of the chosen one.
#[pyfunction]
#[pyo3(signature = (strain, stress, mode, law, slack, strain_range, weight))]
pub(crate) fn material_fit(
    strain: PyReadonlyArray1<'_, f64>,
    stress: PyReadonlyArray1<'_, f64>,
    mode: &str,
    law: Option<&str>,
    slack: Option<f64>,
    strain_range: Option<[f64; 2]>,
    weight: &str,
) -> PyResult<(String, Option<String>)> {
    let test = Test::of(
        &strain.as_array().to_vec(),
        &stress.as_array().to_vec(),
        mode,
    )
    .map_err(Fault::from)?;
    let forms = match law.map(Form::labelled) {
        None => None,
        Some(Some(forms)) => Some(forms),
        Some(None) => {
            let names: Vec<_> = Form::all().into_iter().map(Form::label).collect();
            return Err(value_error(format!(
                "law: use one of: {}, all",
                names.join(", ")
            )));
        }
    };
    let options = Options {
        forms,
        slack: slack.map_or(Slack::WhereItMatters, Slack::Given),
        weights: match weight {
            "relative" => material::Weights::Relative,
            "absolute" => material::Weights::Absolute,
            _ => return Err(value_error("weight: use relative or absolute")),
        },
        ..Options::default()
    };
    let steps = Steps {
        strain_range,
        ..Steps::default()
    };
    let (tests, notes) = material::prepare(&[test], &steps).map_err(Fault::from)?;
    let choice = material::choose(&tests, &options).map_err(|error| wrong(error.to_string()))?;
    let mut answer = choice.json();
    answer.insert("notes".into(), notes.into());
    let file = choice.index.map(|index| {
        let stretches = || {
            tests
                .iter()
                .flat_map(|one| one.points.iter().map(|[e, _]| 1.0 + e))
        };
        let material = Material {
            name: "fit".into(),
            law: choice.candidates[index].law.clone(),
            interval: choice.interval,
            basis: "one specimen".into(),
            stretch: Some([
                stretches().fold(1.0, f64::min),
                stretches().fold(1.0, f64::max),
            ]),
            modes: tests.iter().map(material::Specimen::tested).collect(),
            source: "arrays".into(),
            note: String::new(),
            relaxation: Vec::new(),
            tests: Vec::new(),
        };
        material.toml(None)
    });
    Ok((Value::Object(answer).to_string(), file))
}

/// The series of a test that was held as JSON.
#[pyfunction]
#[pyo3(signature = (time, value, ramp, creeps))]
pub(crate) fn material_relaxation(
    time: PyReadonlyArray1<'_, f64>,
    value: PyReadonlyArray1<'_, f64>,
    ramp: Option<f64>,
    creeps: bool,
) -> PyResult<String> {
    let (time, value) = (time.as_array(), value.as_array());
    if time.len() != value.len() {
        return Err(value_error("time and value: give equally many"));
    }
    let held = Held {
        points: time.iter().zip(value).map(|(t, v)| [*t, *v]).collect(),
        ramp,
        creeps,
    };
    let found = material::relaxed(&held).map_err(|error| wrong(error.to_string()))?;
    Ok(found.json().to_string())
}
