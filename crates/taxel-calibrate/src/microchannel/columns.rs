//! What readings of crossing channels may name.

use crate::clock::sensor_clock;
use crate::readings::{column, required};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{self, AREA, FORCE, STRESS, TIME};

/// Pressure, force and its area.
pub(super) const LOAD_AT: [usize; 3] = [2, 3, 4];
pub(super) const VOLTAGE: usize = 6;
pub(super) const RESISTANCE: usize = 7;

pub(super) static COLUMNS: [LoadColumn; 11] = [
    column(
        "time",
        LoadKind::Quantity(&TIME, [-1e12, 1e12]),
        "clock of the readings",
    ),
    required(
        CHANNEL,
        LoadKind::Number([0.0, 1e6]),
        "which one, rows first, from 0",
    ),
    column(
        "pressure",
        LoadKind::Quantity(&STRESS, [-1e9, 1e9]),
        "on the surface above the loaded part",
    ),
    column(
        "force_z",
        LoadKind::Quantity(&FORCE, [-1e6, 1e6]),
        "pressing force, with area",
    ),
    column(
        "area",
        LoadKind::Quantity(&AREA, [1e-12, 1.0]),
        "under the force",
    ),
    column(
        "loaded_share",
        LoadKind::Number([1e-6, 1.0]),
        "share of the channel's length under the load; 1 without it",
    ),
    column(
        "voltage",
        LoadKind::Quantity(&quantity::VOLTAGE, [-1e6, 1e6]),
        "of the divider",
    ),
    column(
        "resistance",
        LoadKind::Quantity(&quantity::RESISTANCE, [0.0, 1e12]),
        "of the channel with its leads, in place of the voltage",
    ),
    column(
        "voltage_deviation",
        LoadKind::Quantity(&quantity::VOLTAGE, [0.0, 1e3]),
        "standard deviation of the voltage",
    ),
    column(
        "hold_out",
        LoadKind::Number([0.0, 1.0]),
        "1 where a reading is held out",
    ),
    sensor_clock(),
];
/// The column that says of which channel a row is.
pub(super) const CHANNEL: &str = "channel";
