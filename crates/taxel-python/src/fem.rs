//! Finite elements of a layer with a row of voids.

use std::sync::{Mutex, PoisonError};

use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use taxel_bodies::mechanics::microchannel_cell::{
    Closure, Filling, VoidStudy as Posed, WallContact,
};
use taxel_fem::mesh::{CornerDivision, VoidCell};

use crate::body::{Solid, material, meshed};
use crate::fault::{Fault, value_error};
use crate::pool;

/// A layer with a row of voids, bonded below and pressed all over the top.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct VoidStudy {
    posed: Mutex<Posed>,
}

#[pymethods]
impl VoidStudy {
    #[new]
    #[pyo3(signature = (lengths, solid, gas = None, sealed = false))]
    fn new(
        py: Python<'_>,
        lengths: [f64; 6],
        solid: Solid,
        gas: Option<f64>,
        sealed: bool,
    ) -> PyResult<Self> {
        let [width, height, cover, base, pitch, fillet] = lengths;
        let cell = VoidCell {
            width,
            height,
            cover,
            base,
            pitch,
            fillet,
            division: CornerDivision::default(),
        };
        let material = material(&solid)?;
        let filling = match (gas, sealed) {
            (None, false) => Filling::Vented,
            (None, true) => Filling::Sealed,
            (Some(scale), false) if scale.is_finite() && scale > 0.0 => Filling::Gas(scale),
            (Some(_), false) => return Err(value_error("gas: must be a pressure above 0")),
            (Some(_), true) => return Err(value_error("give gas or sealed, not both")),
        };
        pool::run(py, |_| {
            let posed = Posed::new(&cell, material, &filling, WallContact::default());
            Ok(Self {
                posed: Mutex::new(posed?),
            })
        })
    }

    /// The void at a pressure on the top.
    fn press<'py>(&self, py: Python<'py>, pressure: f64) -> PyResult<Bound<'py, PyDict>> {
        if !pressure.is_finite() {
            return Err(value_error("pressure: must be a finite number"));
        }
        self.moved(py, |posed, go_on| posed.press_while(pressure, go_on))
    }

    /// The void at an area ratio.
    fn close<'py>(&self, py: Python<'py>, area_ratio: f64) -> PyResult<Bound<'py, PyDict>> {
        if !(0.0..=1.0).contains(&area_ratio) {
            return Err(value_error("area_ratio: must be from 0 to 1"));
        }
        self.moved(py, |posed, go_on| posed.close_while(area_ratio, go_on))
    }

    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let posed = self.posed.lock().unwrap_or_else(PoisonError::into_inner);
        meshed(py, &posed.solver.problem().mesh)
    }

    /// Displacement of each point: points x 3.
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let posed = self.posed.lock().unwrap_or_else(PoisonError::into_inner);
        let found: Vec<f64> = posed
            .solver
            .state()
            .displacement
            .iter()
            .flatten()
            .copied()
            .collect();
        let found = Array2::from_shape_vec((found.len() / 3, 3), found);
        Ok(found
            .map_err(|error| Fault::Solve(error.to_string()))?
            .into_pyarray(py))
    }
}

impl VoidStudy {
    fn moved<'py>(
        &self,
        py: Python<'py>,
        work: impl FnOnce(
            &mut Posed,
            &mut dyn FnMut() -> bool,
        ) -> Result<Closure, taxel_fem::solver::failure::Failure>
        + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = pool::run(py, |request| {
            let mut posed = self.posed.lock().unwrap_or_else(PoisonError::into_inner);
            Ok(work(&mut posed, &mut || !request.asked())?)
        })?;
        let closure = PyDict::new(py);
        for (name, value) in [
            ("pressure", found.pressure),
            ("inside", found.inside),
            ("area_ratio", found.area_ratio),
            ("gap", found.gap),
            ("fold", found.fold),
            ("stress", found.stress),
        ] {
            closure.set_item(name, value)?;
        }
        Ok(closure)
    }
}
