//! Maps learned from recordings, for devices without a physical model.
//!
//! The models of [`crate::transduction`] know from the drawing what a device
//! answers; calibration only corrects their parameters. Some devices have no
//! such drawing: magnetometers under a printed lattice, arrays bought without
//! papers. Their map from channels to touch is learned from indentations of
//! known position and force, together with its uncertainty: every estimate has
//! a standard deviation from blocks of time that the training did not use, and a
//! frame unlike all training frames is marked. The maps hold for the device, the
//! range and the speeds they were trained with.
//!
//! [`PositionMap`] estimates where a probe of fixed depth presses, [`ForceMap`]
//! its force, with the memory of a creeping body. `taxel-calibrate` trains them.
//! `docs/theory/trained-maps.md` has the equations and what the maps reach on real
//! recordings.

mod features;
mod force;
mod gaussian_process;
mod indentation_map;
mod maps;
mod memory;
mod place;
mod position;
mod relation;
mod standard;
mod surface;

pub use features::{Block, FeatureLaw, FeatureStream, SLOW, SUMS};
pub use force::{
    BetweenRuns, BeyondTraining, ChannelSlope, Component, ComponentMap, ErrorLaw, ForceEstimator,
    ForceMap, MemberMap, MixedMap,
};
pub use gaussian_process::{GaussianProcess, Kernel};
pub(crate) use indentation_map::FEWEST_PRESSES;
pub use indentation_map::{IndentationMap, PositionMethod};
pub use maps::{RestStatistics, TrainedMaps};
pub use place::{AxisMap, NearestPatterns, PatternMap, PatternStream, PlaceEstimator, PlaceMap};
pub use position::{PositionEstimate, PositionEstimator, PositionMap, whiten};
pub use relation::{CONTRADICTS, Judged, Relation, RelationWatch};
pub use standard::Standard;
pub use surface::Surface;

use serde::Serialize;

/// By chance estimates go beyond what was trained by up to this many of their deviations, and no
/// farther than these.
const USUAL: f64 = 2.0;
const SURELY: f64 = 3.0;

/// Support of an estimate by the training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    /// The frame is like those of training.
    Trained,
    /// The frame is unlike all frames of training: the deviation is large, and
    /// still a guess.
    Outside,
}

/// One estimated quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Value, in the unit of the training target.
    pub value: f64,
    /// Its standard deviation, in the same unit.
    pub deviation: f64,
    /// Support of the frame by the training.
    pub support: Support,
}

/// Why there is no map or no estimate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrainingError {
    /// Not enough rows are left.
    #[error("{found} usable rows, at least {needed} are needed")]
    TooFew {
        /// Rows found.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// Features that depend on each other.
    #[error("the {features} features depend on each other: use a stronger prior")]
    Dependent {
        /// Number of features.
        features: usize,
    },
    /// Frames of another number of channels.
    #[error("a frame has {found} channels, the map was trained with {expected}")]
    Channels {
        /// Channels of the frame.
        found: usize,
        /// Channels of the map.
        expected: usize,
    },
    /// A channel without a reading.
    #[error("channel {channel} (from 1) has no reading, and the map needs it")]
    Dead {
        /// The channel, counted from 1.
        channel: usize,
    },
    /// A map from a file whose parts do not belong together.
    #[error("the table `{table}` of the trained map does not fit the others: train it again")]
    Unsound {
        /// Its key.
        table: &'static str,
    },
    /// All channels are constant.
    #[error("no channel changes: there is nothing to learn from")]
    NoSignal,
    /// Presses in one position or along one line.
    #[error("the presses span {0:.3e} m by {1:.3e} m: positions need an area")]
    NoArea(f64, f64),
}
