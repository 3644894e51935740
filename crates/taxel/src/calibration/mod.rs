//! Model of one device that estimation inverts.

mod in_plane;
mod microchannel;

use crate::layout::Layout;
use crate::mechanics::{ForceHysteresis, RelaxationTerm};
use crate::transduction::UnitModel;

pub use in_plane::InPlaneCalibration;
pub use microchannel::{
    DividerScale, MicrochannelCalibration, MicrochannelModel, MicrochannelSignal,
};

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
    /// Hysteresis of the force along x, y and z, where slow loops identified it.
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
