//! Static electric fields: potentials, capacitances and resistances, in the shape
//! that a solid has taken.
//!
//! [`laplace`] solves `div(k grad phi) = 0` on a mesh, on a moved mesh, or on the
//! reference mesh with the motion pulled back; [`exterior`] adds the unbounded rest
//! of space; [`electrostatics`] and [`conduction`] name what the potential means.

mod error;
mod system;
mod terminals;

pub mod cases;
pub mod conduction;
pub mod electrostatics;
pub mod exterior;
pub mod geometry;
pub mod laplace;
pub mod sections;

pub use error::FieldError;

#[cfg(test)]
mod tests;
