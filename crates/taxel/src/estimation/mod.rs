//! Frames to touch: the inverse of the model that a calibration carries.

mod array;
mod contact;
mod continuity;
mod crossed_channels;
mod map;
mod signal;
mod unit;

pub use array::{Captured, Estimator, EstimatorOptions, FrameError, State, TaxelTouch, Touch};
pub use contact::Contact;
pub use continuity::Continuity;
pub use crossed_channels::{
    ChannelRestRefused, ChannelState, ChannelTouch, CrossedChannels, CrossedOptions, TaxelPressure,
};
pub use map::{MapEstimator, MapTouch};
pub use signal::{
    Picture, RestEnd, Scale, SignalEstimator, SignalMeaning, SignalTouch, TaxelValue,
};
pub use unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
