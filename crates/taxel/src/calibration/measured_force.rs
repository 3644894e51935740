//! Model of taxels whose board gives forces, for estimation.

use crate::layout::Layout;
use crate::mechanics::ForceAxes;
use crate::signal::NumberScale;
use taxel_recording::SignalUnit;

/// All that estimation needs to know of taxels whose board gives forces.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceModel {
    /// Where the taxels are.
    pub layout: Layout,
    /// Forces of a taxel in the order of a frame.
    pub axes: ForceAxes,
    /// Numbers of a frame to forces, with their range.
    pub channel: NumberScale,
    /// Quantity and unit of those numbers.
    pub unit: SignalUnit,
    /// Standard deviation of one reading along x, y and z, N.
    pub deviation: [f64; 3],
    /// Taxels that are not used.
    pub masked: Vec<bool>,
    /// Force at the end of the colour scale, N.
    pub full_scale: f64,
}
