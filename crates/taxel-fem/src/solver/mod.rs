//! Linear and nonlinear solution.

pub mod failure;
mod memory;
pub mod newton;
pub mod sparse;
pub mod state;
pub mod stress;
