//! Frames to touch: the inverse of the model that a calibration carries.

mod array;
mod assignment;
mod baseline;
mod capacitors;
mod certainty;
mod charge;
mod charge_balance;
mod contact;
mod continuity;
mod drift_rate;
mod event;
mod force_history;
mod health;
mod holding;
mod indentation_map;
mod judged;
mod kernel_regression;
mod last_positions;
mod localisation;
mod map;
mod map_noise;
mod microchannel;
mod motion;
mod numbers;
mod observer;
mod position_fit;
mod reader;
mod rest;
mod segmentation;
mod session;
mod several_contacts;
mod slip;
mod steps;
mod swap;
mod three_axis;
mod touch;
mod touch_event;
mod tracking;
mod trained;
mod unit;
mod zero_doubt;

pub use array::{ArrayEstimator, Captured, FrameError};
pub use baseline::{Baseline, BaselineOptions, Change, Why};
pub use certainty::Certainty;
pub use charge::{ChargeModel, ChargeOptions, ChargeReader};
pub use contact::{Cell, Contact};
pub use continuity::Continuity;
pub use event::Event;
pub use force_history::HistoryOptions;
pub use health::{
    ChannelFacts, ChannelHealth, ChannelReading, Condition, HealthMonitor, HealthOptions,
};
pub use indentation_map::{localiser, regression};
pub use kernel_regression::{IndentationForces, KernelRegression, Trust};
pub use localisation::{
    Centroid, ContactPosition, ELLIPSE_95, Localiser, Located, Method, ProfileModel,
};
pub use map::{MapOptions, MapReader};
pub use map_noise::MapNoise;
pub use microchannel::{
    MicrochannelOptions, MicrochannelReader, MicrochannelState, MicrochannelTouch, TaxelPressure,
};
pub(crate) use numbers::convert_within;
pub use observer::{Observer, ObserverOptions, Wiring};
pub use position_fit::ProfileFit;
pub(crate) use reader::counting;
pub use reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
};
pub use rest::{Rest, RestRefused, rest_at_start};
pub use segmentation::MOST_CONTACTS;
pub use session::{Observed, TouchSession};
pub use slip::{Slip, SlipEstimator, SlipOptions};
pub use swap::{SwapWatch, swapped};
pub use three_axis::{CAPACITORS, ThreeAxisOptions, ThreeAxisReader};
pub use touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
pub use touch_event::{TouchEvent, TouchEventKind, TouchEventOptions, TouchEvents};
pub use tracking::{EndedTrack, Ending, Track, Tracker, TrackerOptions};
pub use trained::{TrainedArea, TrainedReader};
pub use unit::{Outcome, SearchOptions, UnitEstimate, estimate_unit};
