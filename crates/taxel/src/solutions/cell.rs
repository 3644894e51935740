//! The question for the closing curve of a cell that no table has.

use super::{Asked, Question, Solutions, Unsolved, answer};
use crate::mechanics::{CellGeometry, SectionShape, SolvedCell};
use crate::of_drawing::{SOLVER_VERSION, digits};

/// Raised whenever mesh, steps or points of the solution change.
const METHOD: u32 = 4;

impl SolvedCell {
    /// The solution of a cell; `what` names it in words.
    ///
    /// # Errors
    /// [`Unsolved`] when there is no solution, with what it could not get over.
    pub fn of_cell(
        cell: &CellGeometry,
        what: &str,
        solutions: &mut dyn Solutions,
    ) -> Result<Self, Unsolved> {
        answer(&question(cell, what), solutions, Self::is_sound)
    }
}

/// All that the curve follows from.
fn question(cell: &CellGeometry, what: &str) -> Question {
    let width = cell.section.width;
    let over_width = |length: f64| digits(length / width);
    let section = match cell.section.shape {
        SectionShape::Rectangle => "rectangle with sharp corners",
        SectionShape::Ellipse => "ellipse",
    };
    Question {
        what: what.to_owned(),
        statement: format!(
            "solution = closing curve of a plane-strain cell\n\
             solver = taxel-fem {} method {METHOD}\n\
             material = incompressible, pressures over its shear modulus\n\
             section = {section}\n\
             height_over_width = {}\n\
             roof_over_width = {}\n\
             thickness_over_width = {}\n\
             pitch_over_width = {}\n",
            SOLVER_VERSION,
            over_width(cell.section.height),
            over_width(cell.roof),
            over_width(cell.thickness),
            over_width(cell.pitch),
        ),
        of: Asked::Cell(*cell),
    }
}
