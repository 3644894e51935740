//! Columns of the readings of piezoelectric elements.

use std::sync::LazyLock;

use crate::clock::sensor_clock;
use crate::readings::{columns, hold_out, number, quantity, size};
use taxel::electronics::OutputUnit;
use taxel::predict::LoadColumn;
use taxel::quantity as unit;

/// Most elements whose signals a table of presses may have.
pub(super) const MOST_ELEMENTS: usize = 256;
/// Columns of the voltages of all elements, and of their charges, behind the others.
pub(super) const VOLTAGES: usize = COLUMNS.len();
pub(super) const CHARGES: usize = VOLTAGES + MOST_ELEMENTS;

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the gauge");
    DISPLACEMENT =
        quantity("displacement", &unit::LENGTH, 1e-2, "of the surface over the element; of a peak that at the top");
    FORCE_Z = quantity("force_z", &unit::FORCE, 1e3, "force on the element, in place of the displacement");
    RAMP = size("ramp", &unit::TIME, 1e3, "duration of a ramp of a test load");
    DWELL = size("dwell", &unit::TIME, 1e3, "time at the top: an impact");
    PERIOD = size("period", &unit::TIME, 1e3, "period of a cyclic load");
    CYCLES = number("cycles", [1.0, 1000.0], "cycles; the peaks are those of the last one");
    FIRST_PEAK = quantity("a1", &unit::VOLTAGE, 1e6, "peak of the output in the direction of loading");
    SECOND_PEAK = quantity("a2", &unit::VOLTAGE, 1e6, "peak in the other direction");
    VOLTAGE = quantity("voltage", &unit::VOLTAGE, 1e6, "output at the moment, in place of peaks");
    DEVIATION = quantity("voltage_deviation", &unit::VOLTAGE, 1e6, "standard deviation of a voltage");
    HOLD_OUT = hold_out();
    X = quantity("x", &unit::LENGTH, 10.0, "centre of the probe along the rows");
    Y = quantity("y", &unit::LENGTH, 10.0, "centre of the probe, up from the last row");
    RADIUS = size("radius", &unit::LENGTH, 1.0, "of the contact of the probe");
    SENSOR_TIME = sensor_clock();
}

/// The columns, with those of the elements.
pub(super) static WITH_ELEMENTS: LazyLock<Vec<LoadColumn>> = LazyLock::new(|| {
    let about = "peak of this element's output, or its charge, in an indentation";
    let voltages = VOLTAGE_NAMES.iter();
    let voltages = voltages.map(|name| quantity(name, &unit::VOLTAGE, 1e6, about));
    let charges = CHARGE_NAMES.iter();
    let charges = charges.map(|name| quantity(name, &unit::CHARGE, 1.0, about));
    COLUMNS
        .iter()
        .copied()
        .chain(voltages)
        .chain(charges)
        .collect()
});

/// The same of a board that gives the charge itself: the columns of its output are charges.
static OF_CHARGE: LazyLock<Vec<LoadColumn>> = LazyLock::new(|| {
    let mut columns = WITH_ELEMENTS.clone();
    for (place, name) in [
        (FIRST_PEAK, "a1"),
        (SECOND_PEAK, "a2"),
        (VOLTAGE, "charge"),
        (DEVIATION, "charge_deviation"),
    ] {
        columns[place] = quantity(name, &unit::CHARGE, 1.0, columns[place].about);
    }
    columns
});

/// The columns for an output of this unit, with those of the elements.
pub(super) fn with_elements(output: &OutputUnit) -> &'static [LoadColumn] {
    match output.quantity {
        "charge" => &OF_CHARGE,
        _ => &WITH_ELEMENTS,
    }
}

static VOLTAGE_NAMES: LazyLock<Vec<String>> = LazyLock::new(|| numbered("voltage"));
static CHARGE_NAMES: LazyLock<Vec<String>> = LazyLock::new(|| numbered("charge"));

fn numbered(name: &str) -> Vec<String> {
    let numbers = 1..=MOST_ELEMENTS;
    numbers.map(|number| format!("{name}_{number}")).collect()
}
