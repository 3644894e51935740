//! Special functions and quadrature that several models share.

mod bessel;
mod elliptic;
mod gamma;
mod quadrature;
mod sine_integral;

pub use bessel::{i0, i0_scaled, i1_scaled, j0, j1};
pub use elliptic::{cel, complete_elliptic_e, complete_elliptic_k, complete_elliptic_remainder};
pub use gamma::{beta, gamma};
pub use quadrature::{gauss_panel, gauss_points};
pub use sine_integral::sine_integral;
