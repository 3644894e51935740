//! Linear and nonlinear solution.

mod control;
pub mod failure;
mod memory;
pub mod newton;
mod small;
pub mod stress;
pub mod traction;
