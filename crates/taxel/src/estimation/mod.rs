//! Frames to touch: the inverse of the model that a calibration carries.

mod array;
mod assignment;
mod baseline;
mod charge;
mod contact;
mod continuity;
mod crossed_channels;
mod event;
mod force_history;
mod health;
mod in_plane;
mod kernel_regression;
mod localisation;
mod map;
mod motion;
mod observer;
mod place_map;
mod placing_fit;
mod placing_live;
mod placing_several;
mod segmentation;
mod signal;
mod slip;
mod swap;
mod touch_event;
mod tracking;
mod trained;
mod unit;

pub use array::{Captured, Estimator, EstimatorOptions, FrameError, State, TaxelTouch, Touch};
pub use baseline::{Baseline, BaselineOptions, Change, Why};
pub use charge::{ChargeEstimator, ChargeEstimatorOptions, ChargeModel};
pub use contact::Contact;
pub use continuity::Continuity;
pub use crossed_channels::{
    ChannelRestRefused, ChannelState, ChannelTouch, CrossedChannels, CrossedOptions, TaxelPressure,
};
pub use event::Event;
pub use force_history::HistoryOptions;
pub use health::{
    ChannelFacts, ChannelHealth, ChannelReading, Condition, HealthMonitor, HealthOptions,
};
pub use in_plane::{CONTACT_DEVIATIONS, CONTACT_SHARE, InPlaneEstimator, InPlaneEstimatorError};
pub use kernel_regression::{KernelRegression, Press, Trust};
pub use localisation::{Centroid, ELLIPSE_95, Located, Method, Place, Placing, ProfileModel};
pub use map::{MapEstimator, MapTouch};
pub use observer::{Observer, ObserverOptions, Seen, Wiring};
pub use place_map::{placing, regression};
pub use placing_fit::ProfileFit;
pub use signal::{
    Picture, RestEnd, RestState, Scale, SignalEstimator, SignalMeaning, SignalTouch, TaxelValue,
};
pub use slip::{Slip, SlipEstimator, SlipOptions};
pub use swap::{SwapWatch, swapped};
pub use touch_event::{TouchEvent, TouchEventKind, TouchEventOptions, TouchEvents};
pub use tracking::{EndedTrack, Ending, Track, Tracker, TrackerOptions};
pub use trained::{TrainedArea, TrainedEstimator};
pub use unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
