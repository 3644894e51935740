//! Columns of the readings of piezoelectric elements.

use std::sync::LazyLock;

use crate::clock::sensor_clock;
use crate::readings::{column, hold_out, number, quantity, size};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{CHARGE, FORCE, LENGTH, TIME, VOLTAGE};

const ANY_VOLTAGE: LoadKind = LoadKind::Quantity(&VOLTAGE, [-1e6, 1e6]);
const ANY_CHARGE: LoadKind = LoadKind::Quantity(&CHARGE, [-1.0, 1.0]);

pub(super) const TIME_AT: usize = 0;
pub(super) const DISPLACEMENT: usize = 1;
pub(super) const FORCE_Z: usize = 2;
pub(super) const RAMP: usize = 3;
pub(super) const DWELL: usize = 4;
pub(super) const PERIOD: usize = 5;
pub(super) const CYCLES: usize = 6;
pub(super) const FIRST_PEAK: usize = 7;
pub(super) const SECOND_PEAK: usize = 8;
pub(super) const VOLTAGE_AT: usize = 9;
pub(super) const DEVIATION: usize = 10;
pub(super) const HOLD_OUT: usize = 11;
pub(super) const PLACE: [usize; 2] = [12, 13];
pub(super) const RADIUS: usize = 14;
/// Column of the first element's voltage; the others follow.
pub(super) const VOLTAGES: usize = 16;
/// Column of the first element's charge.
pub(super) const CHARGES: usize = VOLTAGES + MOST_ELEMENTS;
/// Most elements whose signals a table of presses may have.
pub(super) const MOST_ELEMENTS: usize = 256;

static VOLTAGE_NAMES: LazyLock<Vec<String>> = LazyLock::new(|| numbered("voltage"));
static CHARGE_NAMES: LazyLock<Vec<String>> = LazyLock::new(|| numbered("charge"));

fn numbered(name: &str) -> Vec<String> {
    let numbers = 1..=MOST_ELEMENTS;
    numbers.map(|number| format!("{name}_{number}")).collect()
}

pub(super) static COLUMNS: LazyLock<Vec<LoadColumn>> = LazyLock::new(|| {
    let of = |names: &'static [String], kind| {
        let about = "peak of this element's output, or its charge, in an indentation";
        names.iter().map(move |name| column(name, kind, about))
    };
    let mut columns = OWN_COLUMNS.to_vec();
    columns.extend(of(&VOLTAGE_NAMES, ANY_VOLTAGE));
    columns.extend(of(&CHARGE_NAMES, ANY_CHARGE));
    columns
});

static OWN_COLUMNS: [LoadColumn; VOLTAGES] = [
    quantity("time", &TIME, 1e12, "clock of the gauge"),
    quantity(
        "displacement",
        &LENGTH,
        1e-2,
        "of the surface over the element; of a peak that at the top",
    ),
    quantity(
        "force_z",
        &FORCE,
        1e3,
        "force on the element, in place of the displacement",
    ),
    size("ramp", &TIME, 1e3, "duration of a ramp of a test load"),
    size("dwell", &TIME, 1e3, "time at the top: an impact"),
    size("period", &TIME, 1e3, "period of a cyclic load"),
    number(
        "cycles",
        [1.0, 1000.0],
        "cycles; the peaks are those of the last one",
    ),
    quantity(
        "a1",
        &VOLTAGE,
        1e6,
        "peak of the output in the direction of loading",
    ),
    quantity("a2", &VOLTAGE, 1e6, "peak in the other direction"),
    quantity(
        "voltage",
        &VOLTAGE,
        1e6,
        "output at the moment, in place of peaks",
    ),
    quantity(
        "voltage_deviation",
        &VOLTAGE,
        1e6,
        "standard deviation of a voltage",
    ),
    hold_out(),
    quantity("x", &LENGTH, 10.0, "centre of the probe along the rows"),
    quantity(
        "y",
        &LENGTH,
        10.0,
        "centre of the probe, up from the last row",
    ),
    size("radius", &LENGTH, 1.0, "of the contact of the probe"),
    sensor_clock(),
];
