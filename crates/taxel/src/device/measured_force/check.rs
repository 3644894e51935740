//! Rules between the keys of taxels whose board gives forces.

use super::MeasuredForceArray;
use crate::device::check_mask;
use crate::mechanics::ForceAxes;
use crate::sensor::{Broken, check_scan_time, require};

pub(super) fn check(array: &MeasuredForceArray<'_>) -> Result<(), Broken> {
    check_scan_time(array.sensor, array.scan_time())?;
    let [low, high] = array.board.ends();
    let unit = &array.board.unit;
    require(
        low <= 0.0 && 0.0 < high && (low < 0.0 || array.element.axes == ForceAxes::Z),
        "electronics.readout.measured.range",
        || {
            let [low, high] = [low, high].map(|end| end / unit.si_per_unit);
            format!(
                "no force at all lies outside of {low} to {high} {}, or at its end",
                unit.symbol
            )
        },
        "give a range around zero; of axes = \"z\" it may begin at zero",
    )?;
    check_mask(array.sensor)
}
