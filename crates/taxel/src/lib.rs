//! From the drawing of a soft tactile sensor to live touch.
//!
//! The modules follow the signal: [`sensor`] -> [`mechanics`] ->
//! [`transduction`] -> [`electronics`] -> [`acquisition`] -> [`estimation`];
//! [`calibration`] stands beside them, and [`device`] joins them for each kind of
//! sensor.

pub mod acquisition;
pub mod calibration;
pub mod contacts;
pub mod design;
pub mod device;
pub mod drawing;
pub mod electronics;
pub mod estimation;
pub mod figure;
pub mod information;
pub mod layout;
pub mod mechanics;
pub mod predict;
pub mod problem;
pub mod quantity;
pub mod schema;
pub mod sensor;
pub mod shown;
pub mod signal;
pub mod simulator;
pub mod solutions;
mod solved_table;
pub mod stress_map;
pub mod summary;
pub mod svg;
pub mod table;
pub mod toml_input;
pub mod trained;
pub mod transduction;

pub use taxel_recording::{InputError, Place};

/// The example of the README is compiled and run with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
