//! What readings of in-plane sensors may name.

use crate::clock::sensor_clock;
use crate::readings::{column, required};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{CAPACITANCE, FORCE, LENGTH, TIME};

const ANY_TIME: LoadKind = LoadKind::Quantity(&TIME, [-1e12, 1e12]);
const ANY_FORCE: LoadKind = LoadKind::Quantity(&FORCE, [-1e6, 1e6]);
const ANY_CAPACITANCE: LoadKind = LoadKind::Quantity(&CAPACITANCE, [0.0, 1.0]);

pub(super) static COLUMNS: [LoadColumn; 9] = [
    column("time", ANY_TIME, "clock of the gauge"),
    sensor_clock(),
    required("force_z", ANY_FORCE, "pressing force"),
    column(
        "displacement",
        LoadKind::Quantity(&LENGTH, [-1.0, 1.0]),
        "how far the pressed face sinks",
    ),
    required("capacitance", ANY_CAPACITANCE, "of the electrodes"),
    column(
        "gap",
        LoadKind::Quantity(&LENGTH, [0.0, 1.0]),
        "which sensor, by its drawn gap",
    ),
    column(
        "force_z_deviation",
        ANY_FORCE,
        "standard deviation of the force",
    ),
    column(
        "capacitance_deviation",
        ANY_CAPACITANCE,
        "standard deviation of the capacitance",
    ),
    column(
        "hold_out",
        LoadKind::Number([0.0, 1.0]),
        "1 where a reading is held out",
    ),
];
/// Place of the force's deviation.
pub(super) const FORCE_DEVIATION: usize = 6;
/// Place of the capacitance's deviation.
pub(super) const CAPACITANCE_DEVIATION: usize = 7;
