//! Loads on crossing microchannels (P4) by finite elements.

mod field;
mod local;
mod whole_top;

pub use field::MicrochannelFieldPredictor;
pub use whole_top::WholeTopPredictor;
