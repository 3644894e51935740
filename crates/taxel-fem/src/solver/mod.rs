//! Linear and nonlinear solution.

pub mod sparse;
