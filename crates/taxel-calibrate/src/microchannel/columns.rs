//! Columns of the readings of crossing microchannels.

use crate::clock::sensor_clock;
use crate::readings::{column, columns, hold_out, number, quantity, required, size};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity as unit;

/// The column that says of which channel a row is.
pub(super) const CHANNEL: &str = "channel";

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the readings");
    NUMBER = required(number(CHANNEL, [0.0, 1e6], "which one, rows first, from 0"));
    PRESSURE = quantity("pressure", &unit::STRESS, 1e9, "on the surface above the loaded part");
    FORCE_Z = quantity("force_z", &unit::FORCE, 1e6, "pressing force, with area");
    AREA = column("area", LoadKind::Quantity(&unit::AREA, [1e-12, 1.0]), "under the force");
    SHARE =
        number("loaded_share", [1e-6, 1.0], "share of the channel's length under the load; 1 without it");
    VOLTAGE = quantity("voltage", &unit::VOLTAGE, 1e6, "of the divider");
    RESISTANCE =
        size("resistance", &unit::RESISTANCE, 1e12, "of the channel with its leads, in place of the voltage");
    DEVIATION = size("voltage_deviation", &unit::VOLTAGE, 1e3, "standard deviation of the voltage");
    RESISTANCE_DEVIATION =
        size("resistance_deviation", &unit::RESISTANCE, 1e12, "standard deviation of the resistance, of a board that gives it");
    HOLD_OUT = hold_out();
    SENSOR_TIME = sensor_clock();
}
