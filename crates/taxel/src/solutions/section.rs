//! The question for the cross-section of an in-plane sensor that no table has.

use std::sync::Arc;

use super::{Asked, Question, Solutions, Unsolved, answer};
use crate::mechanics::LayerError;
use crate::transduction::{InPlaneError, InPlaneModel, SolvedSection};

impl InPlaneModel {
    /// Solves the cross-section if a table that it needs does not have it.
    ///
    /// # Errors
    /// [`Unsolved`].
    pub(crate) fn solve(&mut self, solutions: &mut dyn Solutions) -> Result<(), Unsolved> {
        self.solved = None;
        let needed = matches!(
            self.check(),
            Err(InPlaneError::Table(_) | InPlaneError::Layer(LayerError::AspectOutsideTable { .. }))
        );
        if needed || !self.is_compared() {
            match of_model(self, solutions) {
                Ok(solved) => self.solved = Some(Arc::new(solved)),
                // The rules between keys say so, with what the tables have.
                Err(Unsolved::TablesOnly) => {}
                Err(failed) if needed => return Err(failed),
                // The closed form answers it, without an error that is known.
                Err(_) => {}
            }
        }
        Ok(())
    }
}

/// The solution for the drawing of `model`.
///
/// # Errors
/// [`Unsolved`] when there is no solution, with what it could not get over.
fn of_model(
    model: &InPlaneModel,
    solutions: &mut dyn Solutions,
) -> Result<SolvedSection, Unsolved> {
    let gap = model.electrodes.gap;
    let mut solved = answer(&question(model), solutions, SolvedSection::is_sound)?;
    // The lengths of a question are ratios.
    solved.drawn_gap = gap;
    Ok(solved)
}

/// All that the solution follows from.
fn question(model: &InPlaneModel) -> Question {
    Question {
        what: String::from("cross-section of the in-plane sensor"),
        statement: model.section_statement(),
        of: Asked::Section(Box::new(model.clone())),
    }
}
