//! What is known of one device: the model that estimation inverts.

mod bench_data;
mod channel_bench;
mod channels;
mod clock;
mod devices;
mod file;
mod in_plane;
mod in_plane_bench;
mod loops;
mod outcome;
mod piezoelectric_bench;
mod propagated;
mod remark;
mod report;
mod rest;
mod split;
mod stiffness;
mod sweep;
#[cfg(test)]
mod testing;
mod three_axis_bench;
mod trained_bench;

use crate::layout::Layout;
use crate::mechanics::{ForceHysteresis, RelaxationTerm};
use crate::transduction::UnitModel;

pub use bench_data::{BenchData, TIME};
pub use channels::{ChannelCalibration, ChannelModel, ChannelSignal, DividerScale};
pub use devices::{NoCalibrator, calibrator};
pub use file::{
    CALIBRATION_SCHEMA, CalibrationFile, DataOf, HeldOut, ParameterOf, Provenance, ResidualOf,
    STEP, ScopeOf, SensorOf, civil_date,
};
pub use in_plane::{InPlaneCalibration, InPlaneRestCapture, InPlaneRestRefused};
pub use outcome::{
    BenchOptions, CalibrateOptions, CalibratedSensor, Calibrator, CovarianceBlock, Derived,
    ModelComparison, NamedSensor, Outcome, PressOptions, ResidualSummary, Scope,
};
pub use propagated::Propagated;
pub use remark::Remark;
pub use rest::{MOVING, RestCapture, RestReadings, RestRefused, Running};
pub use split::{Branch, HoldOut, branches, turns};
pub use stiffness::{EvenTerms, Observation, StiffnessFit, fit_stiffness};
pub use sweep::{SweepFit, SweepNoise, SweepPoint, SweepStart, fit_normal_sweep};
pub use trained_bench::{TrainedOutcome, TrainingFile, train};

/// All that estimation needs to know of an array of three-axis units.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Counts to capacitance.
    pub channel: ChannelScale,
    /// The model of each taxel.
    pub units: Vec<UnitModel>,
    /// Standard deviation of one reading of each capacitor, F.
    pub deviation: Vec<[f64; 4]>,
    /// Capacitors that are not used.
    pub masked: Vec<[bool; 4]>,
    /// Relaxing springs beside the long-time stiffness.
    pub relaxation: Vec<RelaxationTerm>,
    /// What unloading carries less than loading along x, y and z, where slow
    /// loops told it.
    pub hysteresis: [Option<ForceHysteresis>; 3],
    /// Force on each axis that the device is meant for, N.
    pub full_scale: f64,
    /// Force on each axis up to which the model was verified, N.
    pub usable_force: f64,
}

/// Counts of a channel to capacitance: C = `farad_at_zero` + `farad_per_count`·n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelScale {
    /// Capacitance at code zero, F.
    pub farad_at_zero: f64,
    /// Capacitance per count, F.
    pub farad_per_count: f64,
    /// The largest code; it and zero mean a clipped reading.
    pub highest_code: f64,
}

impl ChannelScale {
    /// Capacitance for a code, F; `None` for a code at either end of the
    /// range, which says nothing but "outside".
    pub fn capacitance(&self, counts: f64) -> Option<f64> {
        let inside = counts > 0.0 && counts < self.highest_code;
        inside.then_some(self.farad_at_zero + self.farad_per_count * counts)
    }
}

impl Calibration {
    /// Rest capacitances of all units in the order of a frame, F.
    pub fn rest(&self) -> Vec<f64> {
        self.units.iter().flat_map(UnitModel::rest).collect()
    }
}
