//! What follows from a drawing: how it is carried, and how it is said what it follows from.

/// Version of the finite elements that solve drawings, as statements name it: that of the
/// workspace, which `taxel-fem` has too (`the_version_is_that_of_the_solver` of `taxel-bodies`).
pub const SOLVER_VERSION: &str = env!("CARGO_PKG_VERSION");

/// What was solved of a drawing. It follows from the drawing and is no part of it: two
/// drawings are the same whether or not they are solved.
#[derive(Debug, Clone)]
pub struct OfDrawing<T>(pub Option<T>);

impl<T> Default for OfDrawing<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> PartialEq for OfDrawing<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A number of a statement: twelve digits, so that units do not matter.
pub(crate) fn digits(value: f64) -> String {
    format!("{value:.11e}")
}
