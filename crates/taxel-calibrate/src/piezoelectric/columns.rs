//! What readings of piezoelectric elements may name.

use std::sync::LazyLock;

use crate::clock::sensor_clock;
use crate::readings::column;
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{CHARGE, FORCE, LENGTH, TIME, VOLTAGE};

const ANY_TIME: LoadKind = LoadKind::Quantity(&TIME, [-1e12, 1e12]);
const DURATION: LoadKind = LoadKind::Quantity(&TIME, [0.0, 1e3]);
const ANY_VOLTAGE: LoadKind = LoadKind::Quantity(&VOLTAGE, [-1e6, 1e6]);
const ANY_CHARGE: LoadKind = LoadKind::Quantity(&CHARGE, [-1.0, 1.0]);
const ANY_PLACE: LoadKind = LoadKind::Quantity(&LENGTH, [-10.0, 10.0]);

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
        let about = "peak of this element's output, or its charge, in a press";
        names.iter().map(move |name| column(name, kind, about))
    };
    let mut columns = OWN_COLUMNS.to_vec();
    columns.extend(of(&VOLTAGE_NAMES, ANY_VOLTAGE));
    columns.extend(of(&CHARGE_NAMES, ANY_CHARGE));
    columns
});

static OWN_COLUMNS: [LoadColumn; VOLTAGES] = [
    column("time", ANY_TIME, "clock of the bench"),
    column(
        "displacement",
        LoadKind::Quantity(&LENGTH, [-1e-2, 1e-2]),
        "of the surface over the element; of a peak that at the top",
    ),
    column(
        "force_z",
        LoadKind::Quantity(&FORCE, [-1e3, 1e3]),
        "force on the element, in place of the displacement",
    ),
    column("ramp", DURATION, "duration of a ramp of a test load"),
    column("dwell", DURATION, "time at the top: an impact"),
    column("period", DURATION, "period of a cyclic load"),
    column(
        "cycles",
        LoadKind::Number([1.0, 1000.0]),
        "cycles; the peaks are those of the last one",
    ),
    column(
        "a1",
        ANY_VOLTAGE,
        "peak of the output in the direction of loading",
    ),
    column("a2", ANY_VOLTAGE, "peak in the other direction"),
    column(
        "voltage",
        ANY_VOLTAGE,
        "output at the moment, in place of peaks",
    ),
    column(
        "voltage_deviation",
        ANY_VOLTAGE,
        "standard deviation of a voltage",
    ),
    column(
        "hold_out",
        LoadKind::Number([0.0, 1.0]),
        "1 where a reading is held out",
    ),
    column("x", ANY_PLACE, "centre of the probe along the rows"),
    column("y", ANY_PLACE, "centre of the probe, up from the last row"),
    column(
        "radius",
        LoadKind::Quantity(&LENGTH, [0.0, 1.0]),
        "of the contact of the probe",
    ),
    sensor_clock(),
];
