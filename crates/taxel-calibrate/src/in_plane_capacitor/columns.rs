//! Columns of the readings of in-plane sensors.

use crate::clock::sensor_clock;
use crate::readings::{columns, hold_out, quantity, required, size};
use taxel::predict::LoadColumn;
use taxel::quantity as unit;

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the gauge");
    SENSOR_TIME = sensor_clock();
    FORCE_Z = quantity("force_z", &unit::FORCE, 1e6, "pressing force");
    DISPLACEMENT = quantity("displacement", &unit::LENGTH, 1.0, "how far the pressed face sinks; needed without a force");
    CAPACITANCE = required(size("capacitance", &unit::CAPACITANCE, 1.0, "of the electrodes"));
    GAP = size("gap", &unit::LENGTH, 1.0, "which sensor, by its drawn gap");
    FORCE_DEVIATION = quantity("force_z_deviation", &unit::FORCE, 1e6, "standard deviation of the force");
    CAPACITANCE_DEVIATION =
        size("capacitance_deviation", &unit::CAPACITANCE, 1.0, "standard deviation of the capacitance");
    HOLD_OUT = hold_out();
}
