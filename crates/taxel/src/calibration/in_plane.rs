//! Model of an array of in-plane capacitive sensors for estimation.

use crate::layout::Layout;
use crate::mechanics::ForceHysteresis;
use crate::signal::NumberScale;
use crate::transduction::InPlaneModel;
use taxel_recording::SignalUnit;

/// All that estimation needs to know of an array of in-plane sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct InPlaneCalibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Numbers of a frame to capacitance.
    pub channel: NumberScale,
    /// Quantity and unit of those numbers.
    pub unit: SignalUnit,
    /// The model of each taxel.
    pub models: Vec<InPlaneModel>,
    /// Standard deviation of one reading of each taxel, F.
    pub deviation: Vec<f64>,
    /// Taxels that are not used.
    pub masked: Vec<bool>,
    /// Hysteresis of the force, where slow loops identified it.
    pub hysteresis: Option<ForceHysteresis>,
}
