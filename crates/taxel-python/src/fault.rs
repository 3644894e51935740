//! What becomes of errors of the library: exceptions of the package, with the text of the command.

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyString, PyType};
use taxel::InputError;
use taxel::estimation::FrameError;
use taxel_fem::solver::failure::Failure;
use taxel_files::Stop;
use taxel_study::store::StoreError;

/// Why work did not end well.
#[derive(Debug)]
pub(crate) enum Fault {
    /// A mistake in something a person wrote, with its place.
    Input(Box<InputError>),
    /// A mistake without a place.
    Wrong(String),
    /// A solver or a search stopped.
    Solve(String),
    /// Frames that are not of the device.
    Frame(String),
    /// A file could not be written.
    File(String),
    /// An exception of Python.
    Python(PyErr),
}

impl From<InputError> for Fault {
    fn from(error: InputError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl From<Stop> for Fault {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::WrongInput(message) => Self::Wrong(message),
            Stop::Failed(message) => Self::File(message),
        }
    }
}

impl From<StoreError> for Fault {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Other(message) => Self::Wrong(message),
            error @ StoreError::Io(..) => Self::File(error.to_string()),
        }
    }
}

impl From<FrameError> for Fault {
    fn from(error: FrameError) -> Self {
        Self::Frame(error.to_string())
    }
}

impl From<Failure> for Fault {
    fn from(failure: Failure) -> Self {
        Self::Solve(failure.to_string())
    }
}

impl From<PyErr> for Fault {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

/// The classes of exceptions, which Python defines.
static INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static SOLVE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static FRAME: PyOnceLock<Py<PyType>> = PyOnceLock::new();

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        Python::attach(|py| exception(py, fault).unwrap_or_else(|error| error))
    }
}

fn exception(py: Python<'_>, fault: Fault) -> PyResult<PyErr> {
    let of = |class: &PyOnceLock<Py<PyType>>, name: &str, message: &str| {
        let class = class.import(py, "taxel._errors", name)?;
        Ok(PyErr::from_value(
            class.call1((PyString::new(py, message),))?,
        ))
    };
    match fault {
        Fault::Input(error) => {
            let class = INPUT.import(py, "taxel._errors", "InputError")?;
            let line = error.place.as_ref().map(|place| place.line);
            let made = class.call1((error.to_string(), &error.file, line, &error.key))?;
            Ok(PyErr::from_value(made))
        }
        Fault::Wrong(message) => of(&INPUT, "InputError", &message),
        Fault::Solve(message) => of(&SOLVE, "SolveError", &message),
        Fault::Frame(message) => of(&FRAME, "FrameError", &message),
        Fault::File(message) => Ok(PyOSError::new_err(message)),
        Fault::Python(error) => Ok(error),
    }
}

/// A wrong argument of a call.
pub(crate) fn value_error(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}
