//! The solver of questions by finite elements.

use serde::Serialize;

use crate::device::tabulate_body;
use crate::mechanics::{solve_cell, solve_stiffness};
use crate::transduction::{NoPoints, ResponseOptions, solve_edges, solve_section};
use taxel::solutions::{Asked, Question, Solutions, Solver};

/// Solves questions by finite elements.
///
/// Whoever changes the mesh, the steps or the numbers of a solution raises `METHOD` of its
/// question, in `solutions` of `taxel` or with the statement of the drawing: kept solutions are
/// those of another method then.
#[derive(Debug, Clone, Copy, Default)]
pub struct FiniteElements;

impl Solver for FiniteElements {
    fn answer(&self, question: &Question, progress: &mut dyn FnMut(f64)) -> Result<String, String> {
        match &question.of {
            Asked::Cell(cell) => text(solve_cell(cell, progress)),
            Asked::Stiffness(drawing) => text(solve_stiffness(drawing, progress)),
            Asked::Edges(drawing) => text(solve_edges(drawing, progress)),
            Asked::Section(model) => text(solve_section(model, progress)),
            Asked::Body(drawing) => {
                let options = ResponseOptions::default();
                let program = format!("taxel-fem {}", taxel_fem::VERSION);
                let table = tabulate_body(drawing, options, &NoPoints, &program, progress);
                text(table.map(|table| table.file().clone()))
            }
            _ => Err(format!(
                "finite elements do not solve the {}",
                question.what
            )),
        }
    }
}

/// A solution as JSON.
fn text(solved: Result<impl Serialize, impl ToString>) -> Result<String, String> {
    let solved = solved.map_err(|error| error.to_string())?;
    serde_json::to_string(&solved).map_err(|error| error.to_string())
}

/// Solves every time by finite elements, and keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Afresh;

impl Solutions for Afresh {
    fn kept(&mut self, _question: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _question: &Question, _solution: &str) {}

    fn solver(&self) -> Option<Box<dyn Solver>> {
        Some(Box::new(FiniteElements))
    }
}

#[cfg(test)]
mod tests {
    /// Statements of kept solutions name it.
    #[test]
    fn the_version_is_that_of_the_solver() {
        assert_eq!(taxel::solutions::SOLVER_VERSION, taxel_fem::VERSION);
    }
}
