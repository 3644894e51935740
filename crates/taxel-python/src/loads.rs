//! Loads that Python gives.

use numpy::{AllowTypeChange, PyArrayLikeDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use taxel::InputError;
use taxel::predict::{GivenValues, LoadColumn, Loads};

use crate::fault::Fault;
use crate::pool;

/// Name that stands for a file in messages of loads.
pub(crate) const LOAD: &str = "load";

/// Values that are read without leaving the thread.
const FEW: usize = 4096;

enum Owned<'py> {
    Text(String),
    Texts(Vec<String>),
    Number(f64),
    Numbers(Vec<f64>),
    /// Numbers side by side: read where they are.
    Array(PyArrayLikeDyn<'py, f64, AllowTypeChange>),
}

/// Loads by the names of their columns: numbers in SI, texts with units, or arrays of them.
pub(crate) fn loads(values: &Bound<'_, PyDict>, columns: &[LoadColumn]) -> Result<Loads, Fault> {
    let mut owned = Vec::with_capacity(values.len());
    for (key, value) in values.iter() {
        let key: String = key.extract()?;
        if let Some(value) = read(&key, &value)? {
            owned.push((key, value));
        }
    }
    let given: Vec<_> = owned
        .iter()
        .map(|(key, value)| {
            let values = match value {
                Owned::Text(text) => GivenValues::Text(text),
                Owned::Texts(texts) => GivenValues::Texts(texts),
                Owned::Number(number) => GivenValues::Number(*number),
                Owned::Numbers(numbers) => GivenValues::Numbers(numbers),
                Owned::Array(array) => GivenValues::Numbers(array.as_slice().unwrap_or_default()),
            };
            (key.as_str(), values)
        })
        .collect();
    let many = |(_, values): &(&str, GivenValues<'_>)| matches!(values, GivenValues::Numbers(numbers) if numbers.len() > FEW);
    if !given.iter().any(many) {
        return Ok(Loads::of_values(LOAD, &given, columns)?);
    }
    Ok(pool::run(values.py(), |_| {
        Ok(Loads::of_values(LOAD, &given, columns)?)
    })?)
}

fn read<'py>(key: &str, value: &Bound<'py, PyAny>) -> Result<Option<Owned<'py>>, Fault> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Some(Owned::Text(text.to_string())));
    }
    let several = value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    if several
        && let Ok(texts) = value.extract::<Vec<String>>()
        && !texts.is_empty()
    {
        return Ok(Some(Owned::Texts(texts)));
    }
    if !several && let Ok(number) = value.extract::<f64>() {
        return Ok(Some(Owned::Number(number)));
    }
    let wrong = |message: String| {
        let help = "give a number in SI, a text with its unit, or an array of one dimension";
        Fault::from(InputError::whole(LOAD, message).key(key).help(help))
    };
    let kind = value
        .get_type()
        .name()
        .map_or_else(|_| String::new(), |name| name.to_string());
    let given: PyArrayLikeDyn<'_, f64, AllowTypeChange> = value
        .extract()
        .map_err(|_| wrong(format!("a {kind} is no load")))?;
    let array = given.as_array();
    match array.shape() {
        [] => Ok(array.first().copied().map(Owned::Number)),
        [_] if array.is_standard_layout() => Ok(Some(Owned::Array(given))),
        [_] => Ok(Some(Owned::Numbers(array.iter().copied().collect()))),
        shape => Err(wrong(format!("has the shape {shape:?}"))),
    }
}
