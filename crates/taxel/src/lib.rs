//! From the drawing of a soft tactile sensor to live touch.
//!
//! The modules follow the signal: [`sensor`] -> [`mechanics`] ->
//! [`transduction`] -> [`electronics`] -> [`acquisition`] -> [`estimation`].
//! [`calibration`] holds the constants of one sensor, and [`device`] joins the stages for each
//! kind of sensor.
//!
//! # Example: a force to four capacitances, and back
//! ```
//! use taxel::device::ThreeAxisPredictor;
//! use taxel::estimation::{SearchOptions, estimate_unit};
//! use taxel::sensor::Sensor;
//!
//! let sensor = Sensor::shipped("three-axis-8x8").expect("a shipped sensor");
//! let array = sensor.three_axis()?;
//! let force = [3e-3, 0.0, 8e-3]; // N: x, y, pressing
//! let capacitance = ThreeAxisPredictor::new(&array).predict(force).response.capacitance(); // F
//! let device = array.calibration();
//! let options = SearchOptions::default();
//! let found = estimate_unit(&device.units[0], capacitance, device.deviation[0], [true; 4], &options);
//! assert!((found.force[2] - force[2]).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
    InputError, Place, drawing, figure, quantity, schema, shown, stress_map, svg, table,
    toml_input, words, work,
};

/// The example of the README is compiled and run with the other examples.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
