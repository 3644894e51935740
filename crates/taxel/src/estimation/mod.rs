//! Frames to touch: the inverse of the model that a calibration carries.

mod unit;

pub use unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
