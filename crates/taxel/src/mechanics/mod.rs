//! Load to deformation.

mod relaxation;
mod suspension;

pub use relaxation::{Relaxation, RelaxationTerm};
pub use suspension::{Deformation, SIDE_X, SIDE_Y, Suspension, SuspensionDescription};
