//! From cells to the system of equations.

pub mod contact;
pub mod dofs;
mod edges;
mod friction;
pub mod kernel;
pub mod state;
pub mod system;
pub mod unsymmetric;
