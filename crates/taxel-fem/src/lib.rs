//! Soft solids at large strain, and the electric fields in their deformed shape.
//!
//! The way of a solution: [`mesh`] and [`material`] make a problem with supports,
//! loads and contact; Newton's method finds the deformed shape step by step; static
//! fields are then read off that shape.

// Laws and kernels run inside loops that are compiled for the widest registers of
// the machine at hand: what is not inlined there runs at the narrowest.
#![allow(clippy::inline_always)]
// Tensors read best with the indices of their equations.
#![allow(clippy::needless_range_loop)]
// Tabulated points keep the digits of their source.
#![allow(clippy::excessive_precision)]
// Numbers of nodes, cells and dimensions are far below 2^31.
#![allow(clippy::cast_possible_wrap)]

pub mod assembly;
pub mod field;
pub mod material;
pub mod mesh;
pub mod output;
pub mod problem;
pub mod scalar;
pub mod solver;
pub mod sparse;
pub mod study;
pub mod verify;

/// Version of the solver: a solution that is kept says which one found it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
