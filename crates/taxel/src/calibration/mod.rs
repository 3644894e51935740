//! Model of one device that estimation inverts.

mod microchannel;

use crate::layout::Layout;
use crate::mechanics::{ForceHysteresis, RelaxationTerm};
use crate::signal::NumberScale;
use crate::transduction::ThreeAxisModel;
use taxel_recording::SignalUnit;

pub use microchannel::{
    ChannelScale, MicrochannelCalibration, MicrochannelModel, MicrochannelSignal,
};

/// All that estimation needs to know of an array of three-axis units.
#[derive(Debug, Clone, PartialEq)]
pub struct ThreeAxisCalibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Numbers of a frame to capacitance.
    pub channel: NumberScale,
    /// Quantity and unit of those numbers.
    pub unit: SignalUnit,
    /// The model of each taxel.
    pub units: Vec<ThreeAxisModel>,
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

impl ThreeAxisCalibration {
    /// Rest capacitances of all units in the order of a frame, F.
    pub fn rest(&self) -> Vec<f64> {
        self.units.iter().flat_map(ThreeAxisModel::rest).collect()
    }
}
