//! Linear and nonlinear solution.

mod control;
mod designs;
pub mod failure;
pub mod iterative;
pub mod linear;
mod memory;
mod neighbours;
pub mod newton;
mod reasons;
mod settings;
mod small;
pub mod stress;
pub mod traction;
mod unsymmetric;
pub mod volume;
