//! From the drawing of a soft tactile sensor to live touch.

pub mod acquisition;
pub mod calibration;
pub mod estimation;
pub mod input;
pub mod mechanics;
pub mod quantity;
pub mod transduction;

pub use input::{InputError, Place};
