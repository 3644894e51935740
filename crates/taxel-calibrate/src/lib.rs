//! From readings of a sensor under known loads to the constants of its model.

mod clock;
mod device_model;
mod devices;
mod driver;
mod file;
mod hysteresis;
mod in_plane_capacitor;
mod loads;
mod meaning;
mod microchannel;
mod options;
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
mod toml_tables;
mod trained;
pub mod training;

pub use device_model::{Calibratable, Model};
pub use devices::{NoCalibrator, calibrator};
pub use driver::Calibrator;
pub use file::{
    CALIBRATION_SCHEMA, CalibrationFile, DataOf, HeldOut, ParameterOf, ResidualOf, STEP, ScopeOf,
    SensorOf, civil_date,
};
pub use options::{CalibrateOptions, IndentationOptions, NamedSensor, SyntheticOptions};
pub use outcome::{
    CalibratedSensor, CovarianceBlock, Derived, ModelComparison, Outcome, Provenance,
    ResidualSummary, Scope,
};
pub use propagated::Propagated;
pub use readings::{ReadingTable, TIME};
pub use remark::Remark;
pub use split::{Branch, HoldOut, branches, turns};
pub use trained::{TrainedOutcome, TrainingFile, train};
