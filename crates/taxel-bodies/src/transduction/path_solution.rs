//! Solving a load path for its table.

use super::in_plane_field::NoField;
use crate::mechanics::{Fineness, NotSolved};
use taxel::transduction::path_table::{Contents, ERRORS, PathState, PathTable, TableErrors};

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
    /// There is no solution of crossing layers of microchannels.
    #[error(transparent)]
    Layers(#[from] NotSolved),
    /// The whole top pressed closes nothing.
    #[error(
        "the sealed liquid keeps its volume, so that a load on the whole top closes nothing and there is no path to solve\n\
         help: use the closing curves of the sensor file, or another element.microchannel.liquid.pressure"
    )]
    Sealed,
    /// Roof and floor do not touch.
    #[error(
        "roof and floor of the channels do not touch: at {:.4} kPa on the top {gap:.4} of their height is left between them\n\
         help: use the closing curves of the sensor file, or another element.microchannel.liquid.pressure", .pressure * 1e-3
    )]
    Open {
        /// Highest pressure that was solved, Pa.
        pressure: f64,
        /// Smallest gap there over that at rest.
        gap: f64,
    },
    /// The nodes do not suffice.
    #[error(
        "between nodes at a {variable} of {from:.4} and {to:.4} an interpolation error of {error:.1e} of full scale is left, \
         above the tolerance of {tolerance:.1e}\n\
         help: give a larger --tolerance"
    )]
    Tolerance {
        /// What the path is followed by, with its unit.
        variable: String,
        /// Its values at the ends of the first of the closest intervals that does not keep to it.
        from: f64,
        /// See `from`.
        to: f64,
        /// Error that is left.
        error: f64,
        /// Tolerance.
        tolerance: f64,
    },
}

/// A drawing whose load path is solved for a table.
pub(super) trait LoadPath {
    /// What the table holds.
    const CONTENTS: &'static Contents;

    /// All that the table follows from, as `key = value`.
    fn drawing(&self) -> Vec<String>;

    /// Follows the path to its end: the variable there, and why that is sooner than it might be.
    fn reach(&mut self, progress: &mut dyn FnMut(f64)) -> Result<(f64, Option<String>), NoTable>;

    /// States at rising values of the variable, the first at rest.
    fn states(&mut self, loads: &[f64], fineness: Fineness) -> Result<Vec<PathState>, NoTable>;

    /// Differences of what is read from a table from solved states of a path that is at rest in
    /// `rest`, over full scale.
    fn off(
        &self,
        table: &PathTable,
        rest: &PathState,
        states: &[PathState],
    ) -> Result<Vec<Off>, NoTable>;
}

/// Differences of the quantities whose errors are stated.
pub(super) type Off = [f64; ERRORS];

/// Solves a load path with nodes added where the interpolation error is above the tolerance: seven
/// loads are compared between each two nodes; `progress` hears the fraction.
///
/// # Errors
/// [`NoTable`].
pub(super) fn solve<P: LoadPath>(
    path: &mut P,
    options: &TableOptions,
    program: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<PathTable, NoTable> {
    let (reached, ended) = path.reach(&mut |part| progress(0.1 * part))?;
    // Where closer nodes do not help, the solution itself leaps.
    let least = 1.5 * reached / options.most_intervals as f64;
    let mut nodes: Vec<f64> = (0..=FEWEST)
        .map(|node| reached * node as f64 / FEWEST as f64)
        .collect();
    loop {
        // One path for all of them: what a far leap finds depends on the leap.
        let states = path.states(&with_between(&nodes, &QUARTERS), Fineness::Usual)?;
        let pieces: Vec<_> = states.chunks(QUARTERS.len() + 1).collect();
        let solved: Vec<_> = pieces.iter().map(|piece| piece[0].clone()).collect();
        let mut table = PathTable::through(P::CONTENTS, &solved);
        let rest = &states[0];
        let mut off = Vec::new();
        for piece in &pieces[..nodes.len() - 1] {
            off.push(path.off(&table, rest, &piece[1..])?);
        }
        let halved = |off: &[Vec<Off>]| -> Vec<bool> {
            let ends = nodes.windows(2).zip(off);
            ends.map(|(ends, off)| {
                ends[1] - ends[0] >= least && largest(&[stated(off)]) > options.tolerance
            })
            .collect()
        };
        let mut to_halve = halved(&off);
        if !to_halve.contains(&true) {
            let states = path.states(&with_between(&nodes, &EIGHTHS), Fineness::Usual)?;
            for (off, piece) in off.iter_mut().zip(states.chunks(EIGHTHS.len() + 1)) {
                // In the order of the loads.
                let between = path.off(&table, rest, &piece[1..])?;
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
                let variable = &P::CONTENTS.variable;
                return Err(NoTable::Tolerance {
                    variable: match variable.unit {
                        "" => variable.name.into(),
                        unit => format!("{} in {unit}", variable.name),
                    },
                    from: nodes[piece] / variable.scale,
                    to: nodes[piece + 1] / variable.scale,
                    error: largest(&errors),
                    tolerance: options.tolerance,
                });
            }
            let fine: Vec<f64> = (0..=COMPARED)
                .map(|load| reached * load as f64 / COMPARED as f64)
                .collect();
            let finer = path.states(&fine, Fineness::Finer)?;
            let of_mesh = path.off(&table, &finer[0], &finer[1..])?;
            let of_nodes = off.iter().map(Vec::len).sum();
            table.mesh = TableErrors::new(P::CONTENTS, greatest(&of_mesh), of_mesh.len());
            table.interpolation = TableErrors::new(P::CONTENTS, worst(&errors), of_nodes);
            table.drawing = path.drawing();
            program.clone_into(&mut table.program);
            table.ended = ended;
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
fn worst(errors: &[Off]) -> Off {
    std::array::from_fn(|which| errors.iter().map(|error| error[which]).fold(0.0, f64::max))
}

/// The greatest of differences.
fn greatest(off: &[Off]) -> Off {
    std::array::from_fn(|which| off.iter().map(|one| one[which].abs()).fold(0.0, f64::max))
}

/// Differences in order between two nodes as they are stated: a tenth above the greatest one, or
/// above the greatest step from one to the next, rounded up to two digits. A step that is larger
/// than both is a leap, and a load beside it may be off by all of it.
fn stated(off: &[Off]) -> Off {
    // At the nodes nothing is off.
    let none = [0.0; ERRORS];
    let all: Vec<Off> = std::iter::once(none)
        .chain(off.iter().copied())
        .chain([none])
        .collect();
    let steps = all.windows(2);
    let steps: Vec<Off> = steps
        .map(|pair| std::array::from_fn(|which| pair[1][which] - pair[0][which]))
        .collect();
    let (off, steps) = (greatest(off), greatest(&steps));
    std::array::from_fn(|which| {
        let error = off[which].max(steps[which]);
        let digit = 10f64.powf((ABOVE * error).log10().floor() - 1.0);
        if error > 0.0 {
            (ABOVE * error / digit).ceil() * digit
        } else {
            0.0
        }
    })
}

/// The largest of stated errors.
fn largest(errors: &[Off]) -> f64 {
    worst(errors).into_iter().fold(0.0, f64::max)
}
