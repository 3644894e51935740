//! Columns of the readings of three-axis units.

use crate::clock::sensor_clock;
use crate::readings::{columns, hold_out, number, quantity, required};
use taxel::predict::LoadColumn;
use taxel::quantity as unit;

const fn force(name: &'static str, about: &'static str) -> LoadColumn {
    quantity(name, &unit::FORCE, 1e6, about)
}

const fn capacitance(name: &'static str, about: &'static str) -> LoadColumn {
    quantity(name, &unit::CAPACITANCE, 1.0, about)
}

const fn counts(name: &'static str) -> LoadColumn {
    number(
        name,
        [0.0, 4_294_967_295.0],
        "code in place of the capacitance",
    )
}

const fn parallel(name: &'static str) -> LoadColumn {
    capacitance(name, "measured otherwise")
}

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the gauge");
    TAXEL = number("taxel", [0.0, 1e6], "number of the taxel, row by row from 0");
    FORCE_X = force("force_x", "side force along x");
    FORCE_Y = force("force_y", "side force along y");
    FORCE_Z = required(force("force_z", "pressing force"));
    CAPACITANCE_11 = capacitance("capacitance_11", "at -x, +y");
    CAPACITANCE_12 = capacitance("capacitance_12", "at +x, +y");
    CAPACITANCE_21 = capacitance("capacitance_21", "at -x, -y");
    CAPACITANCE_22 = capacitance("capacitance_22", "at +x, -y");
    COUNTS_11 = counts("counts_11");
    COUNTS_12 = counts("counts_12");
    COUNTS_21 = counts("counts_21");
    COUNTS_22 = counts("counts_22");
    REST = number("rest", [0.0, 1.0], "1 where nothing touches: the force is then zero");
    FORCE_DEVIATION = force("force_deviation", "standard deviation of the gauge along all axes");
    FORCE_X_DEVIATION = force("force_x_deviation", "along x alone; 0 for exact loads");
    FORCE_Y_DEVIATION = force("force_y_deviation", "along y alone; 0 for exact loads");
    FORCE_Z_DEVIATION = force("force_z_deviation", "along z alone; 0 for exact loads");
    CAPACITANCE_DEVIATION =
        capacitance("capacitance_deviation", "standard deviation of a capacitance");
    PARALLEL_11 = parallel("parallel_capacitance_11");
    PARALLEL_12 = parallel("parallel_capacitance_12");
    PARALLEL_21 = parallel("parallel_capacitance_21");
    PARALLEL_22 = parallel("parallel_capacitance_22");
    PARALLEL_DEVIATION = capacitance("parallel_capacitance_deviation", "their standard deviation");
    HOLD_OUT = hold_out();
    SENSOR_TIME = sensor_clock();
}

pub(super) const FORCES: [usize; 3] = [FORCE_X, FORCE_Y, FORCE_Z];
pub(super) const CAPACITANCES: [usize; 4] = [
    CAPACITANCE_11,
    CAPACITANCE_12,
    CAPACITANCE_21,
    CAPACITANCE_22,
];
pub(super) const COUNTS: [usize; 4] = [COUNTS_11, COUNTS_12, COUNTS_21, COUNTS_22];
/// Deviation of the force along each axis.
pub(super) const FORCE_DEVIATIONS: [usize; 3] =
    [FORCE_X_DEVIATION, FORCE_Y_DEVIATION, FORCE_Z_DEVIATION];
pub(super) const PARALLEL: [usize; 4] = [PARALLEL_11, PARALLEL_12, PARALLEL_21, PARALLEL_22];
