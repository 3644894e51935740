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
/// Places between two nodes whose loads are solved and not used: those by which nodes are added ...
const QUARTERS: [f64; 3] = [0.25, 0.5, 0.75];
/// ... and those that are looked at when they suffice.
const EIGHTHS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];
/// Share of the path that a table has at least: before, no leap of the solution ends it.
const SHORTEST: f64 = 0.5;
/// What a stated error is above the largest difference observed: a load in between may differ a
/// little more.
const ABOVE: f64 = 1.1;
/// Loads that are solved on the finer mesh.
const COMPARED: usize = 5;

/// How a table is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableOptions {
    /// Largest interpolation error, as a share of full scale; default 1e-4.
    pub tolerance: f64,
    /// Most intervals that the path is cut into where it needs the closest nodes; default 128.
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
        "between nodes at compressions of {from:.4} and {to:.4} an interpolation error of {error:.1e} of full scale is left, \
         above the tolerance of {tolerance:.1e}\n\
         help: give a larger --tolerance"
    )]
    Tolerance {
        /// Compressions at the ends of the first of the closest intervals that does not keep to it.
        from: f64,
        /// See `from`.
        to: f64,
        /// Error that is left.
        error: f64,
        /// Tolerance.
        tolerance: f64,
    },
}

impl PathTable {
    /// Solves the load path of `model` by finite elements as far as it can be read back, with nodes added where the
    /// interpolation error is above the tolerance: seven loads are compared between each two nodes; `progress` hears the fraction.
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
        let mut reached = invertible(&whole);
        let mut ended = whole.ended.clone();
        let shortest = SHORTEST * reached;
        let mut nodes: Vec<f64> = (0..=FEWEST)
            .map(|node| reached * node as f64 / FEWEST as f64)
            .collect();
        loop {
            // One path for all of them: what a far leap finds depends on the leap.
            let states = path(FieldStudy::new(&body)?, &with_between(&nodes, &QUARTERS))?;
            let pieces: Vec<_> = states.chunks(QUARTERS.len() + 1).collect();
            let solved: Vec<_> = pieces.iter().map(|piece| piece[0]).collect();
            let mut table = Self::through(&solved);
            let error = |piece: &&[State]| table.between(&piece[1..]);
            let mut errors: Vec<_> = pieces[..nodes.len() - 1].iter().map(error).collect();
            if largest(&errors) <= options.tolerance {
                let loads = with_between(&nodes, &EIGHTHS);
                let states = path(FieldStudy::new(&body)?, &loads)?;
                let pieces = states.chunks(EIGHTHS.len() + 1);
                for (known, piece) in errors.iter_mut().zip(pieces) {
                    *known = worst(&[*known, table.between(&piece[1..])]);
                }
            }
            let closest = nodes.windows(2).map(|ends| ends[1] - ends[0]);
            let closest = reached / closest.fold(f64::INFINITY, f64::min);
            progress(0.1 + 0.7 * (closest / options.most_intervals as f64).min(1.0));
            let error = largest(&errors);
            if error <= options.tolerance {
                let fine: Vec<f64> = (0..=COMPARED)
                    .map(|load| reached * load as f64 / COMPARED as f64)
                    .collect();
                let finer = path(FieldStudy::fine(&body)?, &fine)?;
                table.mesh = table.differ(&finer[1..], rest_of(&finer));
                table.interpolation = stated(worst(&errors));
                table.drawing = drawing(model);
                program.clone_into(&mut table.program);
                table.ended = ended;
                progress(1.0);
                return Ok(table);
            }
            // Where halves do not help, the solution itself leaps.
            let least = 1.5 * reached / options.most_intervals as f64;
            let mut finer = vec![nodes[0]];
            for (ends, one) in nodes.windows(2).zip(&errors) {
                let error = largest(&[*one]);
                if error > options.tolerance {
                    let [from, to] = [ends[0], ends[1]];
                    if to - from < least && from < shortest {
                        return Err(NoTable::Tolerance {
                            error,
                            from,
                            to,
                            tolerance: options.tolerance,
                        });
                    }
                    if to - from < least {
                        ended = Some(format!(
                            "up to {to:.4} the solution leaps by {error:.1e} of full scale, more than the tolerance of {:.1e}",
                            options.tolerance
                        ));
                        reached = from;
                        break;
                    }
                    finer.push(0.5 * (from + to));
                }
                finer.push(ends[1]);
            }
            nodes = finer;
        }
    }
}

/// Nodes with places between each two of them, in order.
fn with_between(nodes: &[f64], places: &[f64]) -> Vec<f64> {
    let piece = |ends: &[f64]| {
        let between = places
            .iter()
            .map(|place| ends[0] + place * (ends[1] - ends[0]));
        std::iter::once(ends[0]).chain(between).collect::<Vec<_>>()
    };
    let all = nodes.windows(2).flat_map(piece);
    all.chain(nodes.last().copied()).collect()
}

/// The largest of errors.
fn worst(errors: &[TableErrors]) -> TableErrors {
    let greatest = |of: fn(&TableErrors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
    TableErrors {
        force: greatest(|error| error.force),
        change: greatest(|error| error.change),
        loads: errors.iter().map(|error| error.loads).sum(),
    }
}

/// Observed errors as they are stated: a tenth above, rounded up to two digits.
fn stated(observed: TableErrors) -> TableErrors {
    let above = |error: f64| {
        let digit = 10f64.powf((ABOVE * error).log10().floor() - 1.0);
        if error > 0.0 {
            (ABOVE * error / digit).ceil() * digit
        } else {
            0.0
        }
    };
    TableErrors {
        force: above(observed.force),
        change: above(observed.change),
        ..observed
    }
}

/// The largest stated error.
fn largest(errors: &[TableErrors]) -> f64 {
    let found = stated(worst(errors));
    found.force.max(found.change)
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

/// States at rising compressions, the first at rest.
fn path(mut study: FieldStudy, compressions: &[f64]) -> Result<Vec<State>, NoField> {
    compressions
        .iter()
        .map(|compression| Ok(numbers(&study.press(*compression)?)))
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
