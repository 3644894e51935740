//! From the drawing of a soft tactile sensor to live touch.
//!
//! The modules follow the signal: [`sensor`] -> [`mechanics`] ->
//! [`transduction`] -> [`electronics`] -> [`acquisition`] -> [`estimation`];
//! [`calibration`] stands beside them, and [`device`] joins them for each kind of
//! sensor.

pub mod acquisition;
pub mod calibration;
pub mod contacts;
pub mod device;
pub mod electronics;
pub mod estimation;
pub mod information;
pub mod layout;
pub mod mechanics;
mod of_drawing;
pub mod predict;
pub mod sensor;
pub mod signal;
pub mod simulator;
pub mod solutions;
mod solved_table;
pub mod stage;
pub mod summary;
pub mod trained;
pub mod transduction;

pub use taxel_ground::{
    InputError, Place, drawing, figure, quantity, schema, shown, stress_map, svg, table, toml_input,
};

/// The example of the README is compiled and run with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
