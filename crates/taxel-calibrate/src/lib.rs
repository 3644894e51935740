//! From readings of a sensor under known loads to the constants of its model.

mod clock;
mod devices;
mod file;
mod hysteresis;
mod in_plane_capacitor;
mod microchannel;
mod outcome;
mod piezoelectric;
mod propagated;
mod readings;
mod remark;
mod report;
mod split;
#[cfg(test)]
mod testing;
mod three_axis_capacitor;
mod trained;
pub mod training;

pub use devices::{NoCalibrator, calibrator};
pub use file::{
    CALIBRATION_SCHEMA, CalibrationFile, DataOf, HeldOut, ParameterOf, Provenance, ResidualOf,
    STEP, ScopeOf, SensorOf, civil_date,
};
pub use outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, Derived,
    ModelComparison, NamedSensor, Outcome, PressOptions, ResidualSummary, Scope,
};
pub use propagated::Propagated;
pub use readings::{BenchData, TIME};
pub use remark::Remark;
pub use split::{Branch, HoldOut, branches, turns};
pub use trained::{TrainedOutcome, TrainingFile, train};
