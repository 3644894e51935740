//! Linear and nonlinear solution.

mod control;
pub mod failure;
mod memory;
pub mod newton;
pub mod sparse;
pub mod state;
pub mod stress;
