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
/// ... and those that are looked at, too, when no more nodes are to be added.
const EIGHTHS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];
/// What a stated error is above the largest difference observed: a load in between may differ a
/// little more.
const ABOVE: f64 = 1.1;
/// Loads that are solved on the finer mesh.
const COMPARED: usize = 5;

/// How a table is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableOptions {
    /// Interpolation error above which nodes are added, as a share of full scale; default 1e-4.
    pub tolerance: f64,
    /// Most intervals that the path is cut into where it needs the closest nodes; default 128.
    pub most_intervals: usize,
    /// What becomes of an error above the tolerance that the closest nodes leave, because the solution
    /// itself leaps; default [`Leaps::Stated`].
    pub leaps: Leaps,
}

/// Leaps of the solution between the closest nodes by more than the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leaps {
    /// The table states the larger error.
    Stated,
    /// There is no table.
    Refused,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-4,
            most_intervals: 128,
            leaps: Leaps::Stated,
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
        let reached = invertible(&whole);
        // Where closer nodes do not help, the solution itself leaps.
        let least = 1.5 * reached / options.most_intervals as f64;
        let mut nodes: Vec<f64> = (0..=FEWEST)
            .map(|node| reached * node as f64 / FEWEST as f64)
            .collect();
        loop {
            // One path for all of them: what a far leap finds depends on the leap.
            let states = path(FieldStudy::new(&body)?, &with_between(&nodes, &QUARTERS))?;
            let pieces: Vec<_> = states.chunks(QUARTERS.len() + 1).collect();
            let solved: Vec<_> = pieces.iter().map(|piece| piece[0]).collect();
            let mut table = Self::through(&solved);
            let rest = table.rest_capacitance();
            let mut off: Vec<_> = pieces[..nodes.len() - 1]
                .iter()
                .map(|piece| table.off(&piece[1..], rest))
                .collect();
            let halved = |off: &[Vec<[f64; 2]>]| -> Vec<bool> {
                let ends = nodes.windows(2).zip(off);
                ends.map(|(ends, off)| {
                    ends[1] - ends[0] >= least && largest(&[stated(off)]) > options.tolerance
                })
                .collect()
            };
            let mut to_halve = halved(&off);
            if !to_halve.contains(&true) {
                let loads = with_between(&nodes, &EIGHTHS);
                let states = path(FieldStudy::new(&body)?, &loads)?;
                for (off, piece) in off.iter_mut().zip(states.chunks(EIGHTHS.len() + 1)) {
                    // In the order of the loads.
                    let between = table.off(&piece[1..], rest);
                    for (place, one) in between.into_iter().enumerate() {
                        off.insert(2 * place, one);
                    }
                }
                to_halve = halved(&off);
            }
            let closest = nodes.windows(2).map(|ends| ends[1] - ends[0]);
            let closest = reached / closest.fold(f64::INFINITY, f64::min);
            progress(0.1 + 0.7 * (closest / options.most_intervals as f64).min(1.0));
            if !to_halve.contains(&true) {
                let errors: Vec<_> = off.iter().map(|off| stated(off)).collect();
                let above = errors
                    .iter()
                    .position(|error| largest(&[*error]) > options.tolerance);
                if let (Some(piece), Leaps::Refused) = (above, options.leaps) {
                    return Err(NoTable::Tolerance {
                        from: nodes[piece],
                        to: nodes[piece + 1],
                        error: largest(&errors),
                        tolerance: options.tolerance,
                    });
                }
                let fine: Vec<f64> = (0..=COMPARED)
                    .map(|load| reached * load as f64 / COMPARED as f64)
                    .collect();
                let finer = path(FieldStudy::fine(&body)?, &fine)?;
                table.mesh = greatest(&table.off(&finer[1..], rest_of(&finer)));
                table.interpolation = worst(&errors);
                table.drawing = drawing(model);
                program.clone_into(&mut table.program);
                table.ended = whole.ended;
                progress(1.0);
                return Ok(table);
            }
            let mut finer = vec![nodes[0]];
            for (ends, halved) in nodes.windows(2).zip(&to_halve) {
                if *halved {
                    finer.push(0.5 * (ends[0] + ends[1]));
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

/// The greatest of differences.
fn greatest(off: &[[f64; 2]]) -> TableErrors {
    let of = |which: usize| off.iter().map(|one| one[which].abs()).fold(0.0, f64::max);
    TableErrors {
        force: of(0),
        change: of(1),
        loads: off.len(),
    }
}

/// Differences in order between two nodes as they are stated: a tenth above the greatest one, or
/// above the greatest step from one to the next, rounded up to two digits. A step that is larger
/// than both is a leap, and a load beside it may be off by all of it.
fn stated(off: &[[f64; 2]]) -> TableErrors {
    // At the nodes nothing is off.
    let all: Vec<[f64; 2]> = std::iter::once([0.0; 2])
        .chain(off.iter().copied())
        .chain([[0.0; 2]])
        .collect();
    let steps = all.windows(2);
    let steps: Vec<[f64; 2]> = steps
        .map(|pair| std::array::from_fn(|which| pair[1][which] - pair[0][which]))
        .collect();
    let (off, steps) = (greatest(off), greatest(&steps));
    let above = |error: f64| {
        let digit = 10f64.powf((ABOVE * error).log10().floor() - 1.0);
        if error > 0.0 {
            (ABOVE * error / digit).ceil() * digit
        } else {
            0.0
        }
    };
    TableErrors {
        force: above(off.force.max(steps.force)),
        change: above(off.change.max(steps.change)),
        ..off
    }
}

/// The largest of stated errors.
fn largest(errors: &[TableErrors]) -> f64 {
    let found = worst(errors);
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
