//! Linear and nonlinear solution.

pub mod failure;
pub mod newton;
pub mod sparse;
pub mod state;
pub mod stress;
