//! Calibration: from readings of one soft tactile sensor under known loads to the
//! constants of its model, with their covariance.
//!
//! [`calibrator`] gives the model of a device, [`ReadingTable`] reads its table, and
//! one driver ([`Calibrator`]) does the rest for every device: it checks clocks and
//! units, finds the loading branches, fits the model that is asked for and the others
//! for comparison, judges them by readings that are held out, and finds the hysteresis.
//! The [`Outcome`] is written as a calibration file ([`CalibrationFile`]), a report,
//! JSON or a table. Devices without a physical model are trained from recordings
//! ([`train`], [`training`]).
//!
//! # Example: calibration from synthetic data
//! ```
//! use taxel::sensor::Sensor;
//! use taxel_calibrate::{
//!     CalibrateOptions, NamedSensor, ReadingTable, SyntheticOptions, calibrator,
//! };
//!
//! let (name, text) = ("in-plane-50um", Sensor::shipped_text("in-plane-50um").unwrap());
//! let sensor = Sensor::parse(name, text)?;
//! let named = [NamedSensor { name, text, sensor: &sensor }];
//! let device = calibrator(&named)?;
//! let csv = device.synthetic(&SyntheticOptions { seed: 7, ..SyntheticOptions::default() });
//! let table = ReadingTable::parse("readings.csv", &csv, device.columns(), device.group())?;
//! let outcome = device.calibrate(&table, &CalibrateOptions::default())?;
//!
//! let (parameter, estimate) = &outcome.parameters[0];
//! assert_eq!(parameter.name, "youngs_modulus");
//! assert!(estimate.deviation < 0.1 * estimate.value);
//! // Error of the fifth of the readings that the fit did not use, over their range.
//! assert!(outcome.models[0].hold_out.unwrap() < 0.03);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Example: a wrong unit is refused
//! ```
//! # use taxel::sensor::Sensor;
//! # use taxel_calibrate::*;
//! # let (name, text) = ("in-plane-50um", Sensor::shipped_text("in-plane-50um").unwrap());
//! # let sensor = Sensor::parse(name, text)?;
//! # let named = [NamedSensor { name, text, sensor: &sensor }];
//! # let device = calibrator(&named)?;
//! # let csv = device.synthetic(&SyntheticOptions::default());
//! let csv = csv.replace("force_z [N]", "force_z [mN]");
//! let table = ReadingTable::parse("readings.csv", &csv, device.columns(), device.group())?;
//! let error = device.calibrate(&table, &CalibrateOptions::default()).unwrap_err();
//! assert!(error.message.contains("a thousandth of what the drawing gives"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cells;
mod clock;
mod device_model;
mod devices;
mod driver;
mod figures;
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
mod synthetic;
mod table_checks;
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
pub use options::{CalibrateOptions, IndentationOptions, NamedSensor, ScaleUnit, SyntheticOptions};
pub use outcome::{
    CalibratedSensor, CovarianceBlock, Derived, ModelComparison, Outcome, Provenance,
    ResidualSummary, Scope,
};
pub use propagated::Propagated;
pub use readings::{ReadingTable, TIME};
pub use remark::Remark;
pub use split::{Branch, HoldOut, branches, turns};
pub use trained::{TrainedOutcome, TrainingFile, train, train_saying};
