//! The question for the stiffness of a unit that no table has.

use std::fmt::Write as _;

use super::{Asked, Question, Solutions, Unsolved, answer};
use crate::mechanics::{SolvedStiffness, UnitDrawing};
use crate::of_drawing::{SOLVER_VERSION, digits};

/// Number of this way of solving: another one has other kept solutions.
const METHOD: u32 = 2;

impl SolvedStiffness {
    /// The solution of a drawing.
    ///
    /// # Errors
    /// [`Unsolved`] when there is none, with what the solver could not get over.
    pub fn of_unit(drawing: &UnitDrawing, solutions: &mut dyn Solutions) -> Result<Self, Unsolved> {
        answer(&question(drawing), solutions, Self::is_sound)
    }
}

/// All that the stiffness of a unit follows from.
fn question(drawing: &UnitDrawing) -> Question {
    let lengths = [
        ("electrode", drawing.electrode),
        ("electrode_thickness", drawing.electrode_thickness),
        ("centre_distance", drawing.centre_distance),
        ("unit_side", drawing.unit_side),
        ("wall_width", drawing.wall_width),
        ("lower_layer", drawing.lower_layer),
        ("upper_layer", drawing.upper_layer),
        ("bump_height", drawing.bump_height),
        ("bump_base", drawing.bump_base),
        ("bump_top", drawing.bump_top),
        ("air_gap", drawing.air_gap),
        ("insulation", drawing.insulation),
        ("pitch", drawing.pitch),
    ];
    let mut statement = format!(
        "solution = closings of an elastic unit\n\
         solver = taxel-fem {SOLVER_VERSION} method {METHOD}\n\
         material = Poisson's ratio 0.49, closings times Young's modulus\n"
    );
    for (name, length) in lengths {
        writeln!(statement, "{name} = {} m", digits(length)).expect("a String takes any text");
    }
    Question {
        what: String::from("stiffness of the unit"),
        statement,
        of: Asked::Stiffness(*drawing),
    }
}
