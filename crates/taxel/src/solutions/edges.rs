//! The question for the edges of the electrodes of a unit that no table has.

use std::fmt::Write as _;

use super::{Asked, Question, Solutions, Unsolved, answer};
use crate::of_drawing::{SOLVER_VERSION, digits};
use crate::transduction::{EdgeDrawing, SolvedEdges};

/// Number of this way of solving: another one has other kept solutions.
const METHOD: u32 = 1;

impl SolvedEdges {
    /// The solution of a drawing.
    ///
    /// # Errors
    /// [`Unsolved`] when there is none, with what the solver could not get over.
    pub fn of_unit(drawing: &EdgeDrawing, solutions: &mut dyn Solutions) -> Result<Self, Unsolved> {
        answer(&question(drawing), solutions, Self::is_sound)
    }
}

/// All that the edges follow from.
fn question(drawing: &EdgeDrawing) -> Question {
    let lengths = [
        ("electrode_x", drawing.electrode[0]),
        ("electrode_y", drawing.electrode[1]),
        ("least_air_gap", drawing.air_gap[0]),
        ("greatest_air_gap", drawing.air_gap[1]),
        ("insulation", drawing.insulation),
        ("electrode_thickness", drawing.electrode_thickness),
        ("inner_cavity_x", drawing.cavity[0][0]),
        ("outer_cavity_x", drawing.cavity[0][1]),
        ("inner_cavity_y", drawing.cavity[1][0]),
        ("outer_cavity_y", drawing.cavity[1][1]),
        ("above", drawing.above),
        ("below", drawing.below),
        ("inner_x", drawing.inner[0]),
        ("inner_y", drawing.inner[1]),
        ("outer_x", drawing.outer[0].unwrap_or(f64::INFINITY)),
        ("outer_y", drawing.outer[1].unwrap_or(f64::INFINITY)),
    ];
    let mut statement = format!(
        "solution = laws of the edges of a tile\n\
         solver = taxel-fem {} method {METHOD}\n\
         permittivity = {}\n",
        SOLVER_VERSION,
        digits(drawing.permittivity),
    );
    for (name, length) in lengths {
        writeln!(statement, "{name} = {} m", digits(length)).expect("a String takes any text");
    }
    Question {
        what: String::from("field at the edges of the electrodes"),
        statement,
        of: Asked::Edges(*drawing),
    }
}
