//! From cells to the system of equations.

pub mod contact;
pub mod dofs;
mod edges;
pub mod folds;
pub(crate) mod follow;
mod foot;
pub(crate) mod friction;
mod hardening;
pub mod kernel;
mod meeting;
pub(crate) mod mixed;
mod overlap;
mod points;
pub mod state;
pub mod surfaces;
pub mod system;
pub mod unsymmetric;
