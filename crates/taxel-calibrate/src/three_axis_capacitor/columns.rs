//! Columns of the readings of three-axis units.

use crate::clock::sensor_clock;
use crate::readings::{hold_out, number, quantity, required};
use taxel::predict::LoadColumn;
use taxel::quantity::{CAPACITANCE, FORCE, TIME};

pub(super) const TAXEL: usize = 1;
pub(super) const FORCE_AT: [usize; 3] = [2, 3, 4];
pub(super) const CAPACITANCE_AT: [usize; 4] = [5, 6, 7, 8];
pub(super) const COUNTS_AT: [usize; 4] = [9, 10, 11, 12];
pub(super) const REST: usize = 13;
pub(super) const TIME_AT: usize = 0;
/// Deviation of a force, of a capacitance.
pub(super) const DEVIATION_AT: [usize; 2] = [14, 15];
pub(super) const PARALLEL_AT: [usize; 4] = [16, 17, 18, 19];
pub(super) const PARALLEL_DEVIATION: usize = 20;
pub(super) const HOLD_OUT: usize = 21;

const fn force(name: &'static str, about: &'static str) -> LoadColumn {
    quantity(name, &FORCE, 1e6, about)
}

const fn capacitance(name: &'static str, about: &'static str) -> LoadColumn {
    quantity(name, &CAPACITANCE, 1.0, about)
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

pub(super) static COLUMNS: [LoadColumn; 23] = [
    quantity("time", &TIME, 1e12, "clock of the gauge"),
    number(
        "taxel",
        [0.0, 1e6],
        "number of the taxel, row by row from 0",
    ),
    force("force_x", "side force along x"),
    force("force_y", "side force along y"),
    required(force("force_z", "pressing force")),
    capacitance("capacitance_11", "at -x, +y"),
    capacitance("capacitance_12", "at +x, +y"),
    capacitance("capacitance_21", "at -x, -y"),
    capacitance("capacitance_22", "at +x, -y"),
    counts("counts_11"),
    counts("counts_12"),
    counts("counts_21"),
    counts("counts_22"),
    number(
        "rest",
        [0.0, 1.0],
        "1 where nothing touches: the force is then zero",
    ),
    force("force_deviation", "standard deviation of the gauge"),
    capacitance(
        "capacitance_deviation",
        "standard deviation of a capacitance",
    ),
    parallel("parallel_capacitance_11"),
    parallel("parallel_capacitance_12"),
    parallel("parallel_capacitance_21"),
    parallel("parallel_capacitance_22"),
    capacitance("parallel_capacitance_deviation", "their standard deviation"),
    hold_out(),
    sensor_clock(),
];
