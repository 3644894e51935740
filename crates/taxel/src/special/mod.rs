//! Special functions and quadrature that several models share.

mod bessel;
mod quadrature;
mod sine_integral;

pub use bessel::{i0, i0_scaled, i1_scaled, j0, j1};
pub(crate) use quadrature::gauss_panel;
pub use sine_integral::sine_integral;
