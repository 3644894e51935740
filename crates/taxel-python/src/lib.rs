//! The part of the Python package `taxel` that is written in Rust: handles of the library's
//! nouns, with arrays in and out. What users see is in `python/taxel`.
//!
//! Without the feature `extension` this library is empty, so that Cargo builds and tests the
//! workspace where no Python is.

#![cfg(feature = "extension")]
// The signatures are those of Python: arguments come by value, and what a method cannot do it
// says by an exception.
#![allow(clippy::needless_pass_by_value, clippy::missing_errors_doc)]

mod body;
mod calibration;
mod fault;
mod fem;
mod frames;
mod loads;
mod material;
mod pool;
mod sensor;
mod study;
mod table;

use std::ffi::CString;

use pyo3::prelude::*;
use pyo3::types::PyModule;

/// The part of the package `taxel` that is written in Rust.
#[pymodule]
mod _taxel {
    #[pymodule_export]
    use super::body::{Mesh, Problem, capacitance, resistance};
    #[pymodule_export]
    use super::calibration::{Calibration, calibrate, synthetic};
    #[pymodule_export]
    use super::fem::VoidStudy;
    #[pymodule_export]
    use super::frames::{Estimator, Twin, read_recording};
    #[pymodule_export]
    use super::material::{
        material_fit, material_hardness, material_list, material_load, material_relaxation,
    };
    #[pymodule_export]
    use super::pool::threads;
    #[pymodule_export]
    use super::reproduce;
    #[pymodule_export]
    use super::sensor::{Sensor, read_text, sensor_text, shipped, write_text};
    #[pymodule_export]
    use super::study::{Study, study_text};
    #[pymodule_export]
    use super::table::Table;

    use super::{Bound, PyModule, PyModuleMethods, PyResult, warn};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERSION", taxel_files::VERSION)?;
        module.add("COMMIT", taxel_files::COMMIT)?;
        let names: Vec<_> = taxel::estimation::State::ALL
            .map(taxel::estimation::State::name)
            .into();
        module.add("STATES", names)?;
        taxel_files::notes::listen(warn);
        Ok(())
    }
}

/// Makes a Python warning of a note; false where it cannot be one.
fn warn(note: &str) -> bool {
    let text = note.strip_prefix("note: ").unwrap_or(note);
    let Ok(text) = CString::new(text) else {
        return false;
    };
    Python::attach(|py| {
        let category = py.get_type::<pyo3::exceptions::PyUserWarning>();
        // A warning that is made an error is no error of the work: it is told, not raised.
        if let Err(error) = PyErr::warn(py, &category, &text, 2) {
            error.write_unraisable(py, None);
        }
    });
    true
}

/// The ledgers of the papers of these names as JSON.
#[pyfunction]
fn reproduce(py: Python<'_>, papers: Vec<String>) -> PyResult<String> {
    use taxel_papers::Paper;
    for name in &papers {
        if !Paper::ALL.iter().any(|paper| paper.name() == name) {
            let names = Paper::ALL.map(Paper::name).join(", ");
            let message = format!("\"{name}\" is no paper\nhelp: use one of: {names}");
            return Err(fault::Fault::Wrong(message).into());
        }
    }
    pool::run(py, |_| {
        let wanted =
            |paper: &Paper| papers.is_empty() || papers.iter().any(|name| name == paper.name());
        let ledgers: Vec<_> = Paper::ALL
            .into_iter()
            .filter(wanted)
            .map(Paper::ledger)
            .collect();
        let about = [
            ("version", taxel_files::VERSION),
            ("commit", taxel_files::COMMIT),
        ];
        Ok(taxel_papers::json(&ledgers, &about).to_string())
    })
}
