//! From the drawing of a soft tactile sensor to live touch.

pub mod acquisition;
pub mod input;

pub use input::{InputError, Place};
