//! What readings of in-plane sensors may name.

use crate::clock::sensor_clock;
use crate::readings::{hold_out, quantity, required, size};
use taxel::predict::LoadColumn;
use taxel::quantity::{CAPACITANCE, FORCE, LENGTH, TIME};

pub(super) static COLUMNS: [LoadColumn; 9] = [
    quantity("time", &TIME, 1e12, "clock of the gauge"),
    sensor_clock(),
    required(quantity("force_z", &FORCE, 1e6, "pressing force")),
    quantity(
        "displacement",
        &LENGTH,
        1.0,
        "how far the pressed face sinks",
    ),
    required(size("capacitance", &CAPACITANCE, 1.0, "of the electrodes")),
    size("gap", &LENGTH, 1.0, "which sensor, by its drawn gap"),
    quantity(
        "force_z_deviation",
        &FORCE,
        1e6,
        "standard deviation of the force",
    ),
    size(
        "capacitance_deviation",
        &CAPACITANCE,
        1.0,
        "standard deviation of the capacitance",
    ),
    hold_out(),
];
/// Place of the force's deviation.
pub(super) const FORCE_DEVIATION: usize = 6;
/// Place of the capacitance's deviation.
pub(super) const CAPACITANCE_DEVIATION: usize = 7;
