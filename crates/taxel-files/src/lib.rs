//! What opens files: sensors, calibrations and studies by the names that a user gives, the
//! folder in which solutions are kept, and results that appear whole or not at all. The command
//! and the Python package stand on it.
//!
//! # Example
//! ```
//! use std::path::Path;
//!
//! let named = taxel_files::sensor(Path::new("in-plane-50um"))?;
//! assert!(named.sensor.device().is_ok());
//! let error = taxel_files::sensor(Path::new("no-such-sensor")).unwrap_err();
//! assert!(error.to_string().contains("or a shipped sensor: "));
//! # Ok::<(), taxel_files::Stop>(())
//! ```

mod calibrations;
mod files;
mod hash;
pub mod notes;
pub mod outputs;
mod points;
mod problem;
mod progress;
mod reading;
mod solutions;
mod stop;
pub mod study;

pub use calibrations::{applied, applied_text, propagated, propagated_text, read_sensors, today};
pub use files::{
    NamedSensor, by_mechanics, device, is_page, predictor, recordings, sensor, sensor_of_text,
    sensor_text,
};
pub use hash::sha256;
pub use points::PointFile;
pub use problem::NamedProblem;
pub use progress::Progress;
pub use reading::{bytes, law_file, text, with_laws, with_shipped_names};
pub use solutions::{Folder, state_folder};
pub use stop::Stop;

/// Version, as written into every file.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Commit of this build.
pub const COMMIT: &str = env!("TAXEL_COMMIT");
