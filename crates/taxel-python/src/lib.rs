//! The Python package `taxel`.
#![cfg(feature = "extension")]
use pyo3::prelude::*;
use numpy as _;

#[pymodule]
mod _taxel {}
