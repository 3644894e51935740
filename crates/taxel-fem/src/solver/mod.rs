//! Linear and nonlinear solution.

mod chords;
mod control;
mod designs;
mod drag;
pub mod failure;
mod foreseen;
mod hop;
pub mod iterative;
mod jump;
pub mod linear;
mod memory;
mod neighbours;
pub mod newton;
mod previous;
mod reasons;
mod settings;
mod small;
mod steps;
mod stop;
pub mod stress;
pub mod traction;
mod unsymmetric;
pub mod volume;
