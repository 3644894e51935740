//! From the drawing of a soft tactile sensor to live touch.
//!
//! The modules follow the signal: [`sensor`] -> [`mechanics`] ->
//! [`transduction`] -> [`electronics`] -> [`acquisition`] -> [`estimation`];
//! [`calibration`] stands beside them.

pub mod acquisition;
pub mod calibration;
pub mod electronics;
pub mod estimation;
pub mod input;
pub mod layout;
pub mod linear;
pub mod loads;
pub mod mechanics;
pub mod predict;
pub mod quantity;
pub mod sensor;
pub mod special;
pub mod summary;
mod toml_input;
pub mod transduction;

pub use input::{InputError, Place};

/// The example of the README is compiled and run with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
