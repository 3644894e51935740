//! Model of an array of in-plane capacitive sensors for estimation.

use super::ChannelScale;
use crate::layout::Layout;
use crate::mechanics::ForceHysteresis;
use crate::transduction::InPlaneModel;

/// All that estimation needs to know of an array of in-plane sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct InPlaneCalibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Counts to capacitance.
    pub channel: ChannelScale,
    /// The model of each taxel.
    pub models: Vec<InPlaneModel>,
    /// Standard deviation of one reading of each taxel, F.
    pub deviation: Vec<f64>,
    /// Taxels that are not used.
    pub masked: Vec<bool>,
    /// Hysteresis of the force, where slow loops identified it.
    pub hysteresis: Option<ForceHysteresis>,
}
