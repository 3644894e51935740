//! Solving the load path of an in-plane sensor for its table.

use std::fmt::Write as _;
use std::sync::Arc;

use super::in_plane_field::{FieldState, FieldStudy, NoField, SolvedInPlane};
use super::in_plane_model::InPlaneModel;
use super::path_table::{DrawnTable, PathTable, State, TableErrors, WrongTable};
use super::section_solution::{as_drawn, statement};
use crate::mechanics::LARGEST_COMPRESSION;
use crate::solutions::digits;
use taxel_numerics::roots;

/// Intervals of the first table.
const FEWEST: usize = 8;
/// Solved loads between two nodes that are not used: at the quarters.
const BETWEEN: usize = 3;
/// Loads that are solved on the finer mesh.
const COMPARED: usize = 5;

/// How a table is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableOptions {
    /// Largest interpolation error, as a share of full scale; default 1e-4.
    pub tolerance: f64,
    /// Most intervals between nodes; default 128.
    pub most_intervals: usize,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-4,
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
        let mut pieces = Pieces::first(&body, reached)?;
        loop {
            let nodes: Vec<_> = pieces.nodes.clone();
            let intervals = nodes.len() - 1;
            let mut table = Self::through(&nodes);
            let errors: Vec<_> = pieces
                .between
                .iter()
                .map(|solved| table.between(solved))
                .collect();
            table.interpolation = worst(&errors);
            progress(0.1 + 0.7 * intervals as f64 / options.most_intervals as f64);
            let error = table.interpolation.force.max(table.interpolation.change);
            if error <= options.tolerance {
                let finer = equal_steps(FieldStudy::fine(&body)?, reached, COMPARED)?;
                table.mesh = table.differ(&finer[1..], rest_of(&finer));
                table.drawing = drawing(model);
                program.clone_into(&mut table.program);
                table.ended.clone_from(&whole.ended);
                progress(1.0);
                return Ok(table);
            }
            let halved: Vec<_> = errors
                .iter()
                .map(|error| error.force.max(error.change) > options.tolerance)
                .collect();
            let more = halved.iter().filter(|halved| **halved).count();
            if intervals + more > options.most_intervals {
                return Err(NoTable::Tolerance {
                    intervals,
                    error,
                    tolerance: options.tolerance,
                });
            }
            pieces = pieces.halved(&body, &halved)?;
        }
    }
}

/// The solved states of a path: nodes, and between two of them those that are not used.
struct Pieces {
    nodes: Vec<State>,
    between: Vec<[State; BETWEEN]>,
}

impl Pieces {
    fn first(body: &InPlaneModel, reached: f64) -> Result<Self, NoField> {
        let states = equal_steps(FieldStudy::new(body)?, reached, FEWEST * (BETWEEN + 1))?;
        let inside = states.chunks(BETWEEN + 1).take(FEWEST);
        Ok(Self {
            between: inside.map(|piece| [piece[1], piece[2], piece[3]]).collect(),
            nodes: states.iter().step_by(BETWEEN + 1).copied().collect(),
        })
    }

    /// The pieces with some of them halved. One more path solves what their halves lack and passes
    /// by what is known.
    fn halved(&self, body: &InPlaneModel, halved: &[bool]) -> Result<Self, NoField> {
        let mut study = FieldStudy::new(body)?;
        let mut found = Self {
            nodes: vec![self.nodes[0]],
            between: Vec::new(),
        };
        for (piece, halved) in halved.iter().enumerate() {
            let [first, middle, third] = self.between[piece];
            let end = self.nodes[piece + 1];
            if *halved {
                let known = [self.nodes[piece], first, middle, third, end];
                let mut eighth = |place: usize| -> Result<State, NoField> {
                    let compression = 0.5 * (known[place].0 + known[place + 1].0);
                    Ok(numbers(&study.press(compression)?))
                };
                found.between.push([eighth(0)?, first, eighth(1)?]);
                found.between.push([eighth(2)?, third, eighth(3)?]);
                found.nodes.extend([middle, end]);
            } else {
                found.between.push(self.between[piece]);
                found.nodes.push(end);
            }
        }
        Ok(found)
    }
}

/// The largest of the errors of the pieces.
fn worst(errors: &[TableErrors]) -> TableErrors {
    let greatest = |of: fn(&TableErrors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    TableErrors {
        force: greatest(|error| error.force),
        change: greatest(|error| error.change),
        loads: errors.iter().map(|error| error.loads).sum(),
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
fn equal_steps(mut study: FieldStudy, reached: f64, steps: usize) -> Result<Vec<State>, NoField> {
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
