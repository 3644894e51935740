//! Solving the load path of an in-plane sensor for its table.

use std::fmt::Write as _;
use std::sync::Arc;

use super::in_plane_field::{FieldState, FieldStudy, NoField, SolvedInPlane};
use super::in_plane_model::InPlaneModel;
use super::path_table::{DrawnTable, PathTable, State, WrongTable};
use super::section_solution::{as_drawn, statement};
use crate::mechanics::LARGEST_COMPRESSION;
use crate::solutions::digits;
use taxel_numerics::roots;

/// Intervals of the first table; half of its solved loads are not used.
const FEWEST: usize = 8;
/// Loads that are solved on the finer mesh.
const COMPARED: usize = 5;

/// How a table is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableOptions {
    /// Largest interpolation error, as a share of full scale; default 1e-3.
    pub tolerance: f64,
    /// Most intervals between nodes; default 128.
    pub most_intervals: usize,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            most_intervals: 128,
        }
    }
}

/// Why a table cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTable {
    /// There is no solution.
    #[error(transparent)]
    Field(#[from] NoField),
    /// The nodes do not suffice.
    #[error(
        "{intervals} intervals leave an interpolation error of {error:.1e} of full scale, above the tolerance of {tolerance:.1e}\n\
         help: give a larger --tolerance"
    )]
    Tolerance {
        /// Most intervals.
        intervals: usize,
        /// Error that is left.
        error: f64,
        /// Tolerance.
        tolerance: f64,
    },
}

impl PathTable {
    /// Solves the load path of `model` by finite elements as far as it can be read back, with nodes added until the
    /// interpolation error is within the tolerance; `progress` hears the fraction.
    ///
    /// # Errors
    /// [`NoTable`].
    pub fn solve(
        model: &InPlaneModel,
        options: &TableOptions,
        program: &str,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, NoTable> {
        let body = as_drawn(model);
        let whole = SolvedInPlane::solve(&body, LARGEST_COMPRESSION, &|_| false, &mut |part| {
            progress(0.1 * part);
        })?;
        let reached = invertible(&whole);
        let mut intervals = FEWEST;
        loop {
            let states = way(FieldStudy::new(&body)?, reached, 2 * intervals)?;
            let nodes: Vec<_> = states.iter().step_by(2).copied().collect();
            let between: Vec<_> = states.iter().skip(1).step_by(2).copied().collect();
            let mut table = Self::through(&nodes);
            table.interpolation = table.differ(&between, table.rest_capacitance());
            progress(0.1 + 0.5 * intervals as f64 / options.most_intervals as f64);
            let error = table.interpolation.force.max(table.interpolation.change);
            if error <= options.tolerance {
                let finer = way(FieldStudy::fine(&body)?, reached, COMPARED)?;
                table.mesh = table.differ(&finer[1..], rest_of(&finer));
                table.drawing = drawing(model);
                program.clone_into(&mut table.program);
                table.ended.clone_from(&whole.ended);
                progress(1.0);
                return Ok(table);
            }
            if 2 * intervals > options.most_intervals {
                return Err(NoTable::Tolerance {
                    intervals,
                    error,
                    tolerance: options.tolerance,
                });
            }
            intervals *= 2;
        }
    }
}

impl InPlaneModel {
    /// Takes the text of a table of this drawing in the place of the closed forms.
    ///
    /// # Errors
    /// [`WrongTable`].
    pub fn take_table(&mut self, text: &str) -> Result<(), WrongTable> {
        let table = DrawnTable::read(text, &drawing(self), self.closed_layer())?;
        self.table = Some(Arc::new(table));
        Ok(())
    }
}

/// Compression up to which a change of capacitance belongs to one compression: beyond, nothing reads
/// the sensor back.
fn invertible(way: &SolvedInPlane) -> f64 {
    let rest = way.rest().capacitance;
    let change = |e: f64| way.at(e).map_or(f64::NAN, |state| rest - state.capacitance);
    roots::one_to_one(way.last().compression, change).end
}

/// All that a table follows from.
fn drawing(model: &InPlaneModel) -> Vec<String> {
    let (layer, electrodes) = (&model.layer, &model.electrodes);
    let mut text = statement(model);
    for (key, value) in [
        ("layer_thickness", layer.thickness),
        ("layer_modulus", layer.youngs_modulus),
        ("loaded_depth", layer.contact_depth),
        ("electrode_depth", electrodes.depth),
    ] {
        let _ = writeln!(text, "{key} = {}", digits(value));
    }
    text.lines().map(str::to_owned).collect()
}

/// States at equal steps of compression, the first at rest.
fn way(mut study: FieldStudy, reached: f64, steps: usize) -> Result<Vec<State>, NoField> {
    (0..=steps)
        .map(|step| {
            let state = study.press(reached * step as f64 / steps as f64)?;
            Ok(numbers(&state))
        })
        .collect()
}

/// Capacitance of the first state, F.
fn rest_of(states: &[State]) -> f64 {
    let [.., capacitance] = states[0].1;
    capacitance
}

fn numbers(state: &FieldState) -> State {
    let numbers = [
        state.mean_stress,
        state.gap,
        state.thickness,
        state.width,
        state.capacitance,
    ];
    (state.compression, numbers)
}
