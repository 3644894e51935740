//! Columns of the readings of crossing microchannels.

use crate::clock::sensor_clock;
use crate::readings::{hold_out, number, quantity, required, size};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{self as units, AREA, FORCE, STRESS, TIME};

/// Pressure, force and its area.
pub(super) const LOAD_AT: [usize; 3] = [2, 3, 4];
pub(super) const VOLTAGE: usize = 6;
pub(super) const RESISTANCE: usize = 7;

pub(super) static COLUMNS: [LoadColumn; 11] = [
    quantity("time", &TIME, 1e12, "clock of the readings"),
    required(number(CHANNEL, [0.0, 1e6], "which one, rows first, from 0")),
    quantity(
        "pressure",
        &STRESS,
        1e9,
        "on the surface above the loaded part",
    ),
    quantity("force_z", &FORCE, 1e6, "pressing force, with area"),
    crate::readings::column(
        "area",
        LoadKind::Quantity(&AREA, [1e-12, 1.0]),
        "under the force",
    ),
    number(
        "loaded_share",
        [1e-6, 1.0],
        "share of the channel's length under the load; 1 without it",
    ),
    quantity("voltage", &units::VOLTAGE, 1e6, "of the divider"),
    size(
        "resistance",
        &units::RESISTANCE,
        1e12,
        "of the channel with its leads, in place of the voltage",
    ),
    size(
        "voltage_deviation",
        &units::VOLTAGE,
        1e3,
        "standard deviation of the voltage",
    ),
    hold_out(),
    sensor_clock(),
];
/// The column that says of which channel a row is.
pub(super) const CHANNEL: &str = "channel";
