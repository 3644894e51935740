//! Soft solids at large strain, and the electric fields in their deformed shape.
//!
//! The way of a solution: [`mesh`] and [`material`] make a problem with supports,
//! loads and contact; Newton's method finds the deformed shape step by step; static
//! fields are then read off that shape.

pub mod material;
pub mod mesh;
pub mod scalar;
