//! What readings of three-axis units may name.

use crate::clock::sensor_clock;
use crate::readings::{column, required};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{CAPACITANCE, FORCE, TIME};

const ANY_FORCE: LoadKind = LoadKind::Quantity(&FORCE, [-1e6, 1e6]);
const ANY_CAPACITANCE: LoadKind = LoadKind::Quantity(&CAPACITANCE, [-1.0, 1.0]);
const COUNTS: LoadKind = LoadKind::Number([0.0, 4_294_967_295.0]);
const YES: LoadKind = LoadKind::Number([0.0, 1.0]);

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

pub(super) static COLUMNS: [LoadColumn; 23] = [
    column(
        "time",
        LoadKind::Quantity(&TIME, [-1e12, 1e12]),
        "clock of the bench",
    ),
    column(
        "taxel",
        LoadKind::Number([0.0, 1e6]),
        "number of the taxel, row by row from 0",
    ),
    column("force_x", ANY_FORCE, "side force along x"),
    column("force_y", ANY_FORCE, "side force along y"),
    required("force_z", ANY_FORCE, "pressing force"),
    column("capacitance_11", ANY_CAPACITANCE, "at -x, +y"),
    column("capacitance_12", ANY_CAPACITANCE, "at +x, +y"),
    column("capacitance_21", ANY_CAPACITANCE, "at -x, -y"),
    column("capacitance_22", ANY_CAPACITANCE, "at +x, -y"),
    column("counts_11", COUNTS, "code in place of the capacitance"),
    column("counts_12", COUNTS, "code in place of the capacitance"),
    column("counts_21", COUNTS, "code in place of the capacitance"),
    column("counts_22", COUNTS, "code in place of the capacitance"),
    column(
        "rest",
        YES,
        "1 where nothing touches: the force is then zero",
    ),
    column(
        "force_deviation",
        ANY_FORCE,
        "standard deviation of the gauge",
    ),
    column(
        "capacitance_deviation",
        ANY_CAPACITANCE,
        "standard deviation of a capacitance",
    ),
    column(
        "parallel_capacitance_11",
        ANY_CAPACITANCE,
        "measured otherwise",
    ),
    column(
        "parallel_capacitance_12",
        ANY_CAPACITANCE,
        "measured otherwise",
    ),
    column(
        "parallel_capacitance_21",
        ANY_CAPACITANCE,
        "measured otherwise",
    ),
    column(
        "parallel_capacitance_22",
        ANY_CAPACITANCE,
        "measured otherwise",
    ),
    column(
        "parallel_capacitance_deviation",
        ANY_CAPACITANCE,
        "their standard deviation",
    ),
    column("hold_out", YES, "1 where a reading is held out"),
    sensor_clock(),
];
