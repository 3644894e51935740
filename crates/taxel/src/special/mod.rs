//! Special functions of the closed forms.

mod elliptic;
mod gamma;

pub use elliptic::complete_elliptic_k;
pub use gamma::{beta, gamma};
