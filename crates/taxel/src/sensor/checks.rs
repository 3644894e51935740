//! Rules between the fields of a sensor file.

use super::{Element, Sensor};
use crate::InputError;
use crate::electronics::Readout;
use crate::layout::{MOST_LINES, Mount};
use crate::quantity::{at_most, decimal};
use crate::solutions::{OfDrawing, Unsolved};
use crate::toml_input;
use crate::transduction::WrongTable;

/// A broken rule, shown at one key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broken {
    path: Vec<String>,
    message: String,
    help: String,
}

impl std::fmt::Display for Broken {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {}", self.path.join("."), self.message)
    }
}

impl Broken {
    /// A rule broken at the key `path`.
    pub(crate) fn new(path: &str, message: String, help: &str) -> Self {
        Self {
            path: path.split('.').map(str::to_owned).collect(),
            message,
            help: help.to_owned(),
        }
    }

    pub(crate) fn at(&self, file: &str, text: &str) -> InputError {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        toml_input::at_key(file, text, &path, &self.message, &self.help)
    }
}

/// A table that is not of the drawing of its sensor file; `name` is its file.
pub(super) fn wrong_table(name: &str, wrong: &WrongTable) -> Broken {
    Broken::new(
        "mechanics.table",
        format!("{name}: {wrong}"),
        "make the table of this drawing: taxel tabulate SENSOR -o TABLE",
    )
}

/// Demands that a rule between keys holds; `path` is the key to show.
pub(crate) fn require(
    holds: bool,
    path: &str,
    message: impl Fn() -> String,
    help: &str,
) -> Result<(), Broken> {
    if holds {
        return Ok(());
    }
    Err(Broken::new(path, message(), help))
}

pub(crate) fn check(sensor: &Sensor) -> Result<(), Broken> {
    require(
        sensor.schema == super::SCHEMA_VERSION,
        "schema",
        || {
            format!(
                "schema {} is not known; this program reads schema {}",
                sensor.schema,
                super::SCHEMA_VERSION
            )
        },
        "write schema = 2",
    )?;
    require(
        !sensor.name.trim().is_empty(),
        "name",
        || "the name is empty".into(),
        "name the device",
    )?;
    check_array(sensor)?;
    check_electronics(sensor)?;
    check_mask(sensor)
}

fn check_array(sensor: &Sensor) -> Result<(), Broken> {
    for (key, lines) in [
        ("array.rows", sensor.array.rows),
        ("array.columns", sensor.array.columns),
    ] {
        let allowed = (1..=MOST_LINES).contains(&lines);
        let message = || format!("{lines} is out of range: must be from 1 to {MOST_LINES}");
        require(allowed, key, message, "give the number of taxels")?;
    }
    if let Mount::Cylinder(cylinder) = sensor.array.mount {
        let arc = sensor.array.columns as f64 * sensor.array.pitch[0];
        let round = std::f64::consts::TAU * cylinder.radius;
        require(
            at_most(arc, round),
            "array.mount.cylinder.radius",
            || {
                format!(
                    "the array is {} long and goes more than once round a cylinder of {}",
                    millimetres(arc),
                    millimetres(round)
                )
            },
            &format!(
                "give a radius of at least {} mm",
                rounded_up(arc / std::f64::consts::TAU * 1e3)
            ),
        )?;
    }
    Ok(())
}

fn check_electronics(sensor: &Sensor) -> Result<(), Broken> {
    if sensor.electronics.measured().is_some() {
        // Which unit its element has comes first.
        return Ok(());
    }
    let Some(converter) = &sensor.electronics.converter else {
        let readout = &sensor.electronics.readout;
        let digital = matches!(
            readout,
            Readout::Digital(_)
                | Readout::CapacitanceToDigital(_)
                | Readout::PressureChip(_)
                | Readout::Magnetometer(_)
        );
        return require(
            digital,
            "electronics.readout",
            || {
                format!(
                    "the counts of a {} need electronics.converter",
                    sensor.electronics.readout.key()
                )
            },
            "add a table [electronics.converter] with bits and range, as in the shipped files",
        );
    };
    require(
        !matches!(
            sensor.electronics.readout,
            Readout::Digital(_)
                | Readout::CapacitanceToDigital(_)
                | Readout::PressureChip(_)
                | Readout::Magnetometer(_)
        ),
        "electronics.converter",
        || "these chips deliver numbers: they have a converter of their own".into(),
        "leave the table out",
    )?;
    let [low, high] = converter.range;
    require(
        (1..=32).contains(&converter.bits),
        "electronics.converter.bits",
        || format!("{} is out of range: must be from 1 to 32", converter.bits),
        "give the resolution of the converter in bits",
    )?;
    require(
        low < high,
        "electronics.converter.range",
        || format!("the range from {low} V to {high} V is empty"),
        "write [lowest, highest]",
    )
}

/// Noise and range of an instrument are of its own quantity, and it has no converter.
pub(crate) fn check_instrument(sensor: &Sensor) -> Result<(), Broken> {
    let electronics = &sensor.electronics;
    let Some(measured) = electronics.measured() else {
        return Ok(());
    };
    let key = |name: &str| format!("electronics.readout.measured.{name}");
    let unit = &measured.unit;
    let noises = measured.noise.0.iter().map(|noise| (key("noise"), noise));
    let ends = measured.range.iter().enumerate();
    let ends = ends.map(|(index, end)| (key(&format!("range.{index}")), end));
    for (key, stated) in noises.chain(ends) {
        require(
            stated.dimension == unit.dimension,
            &key,
            || {
                format!(
                    "this is {}; the readings in \"{}\" need {}",
                    stated.dimension.name, unit.symbol, unit.dimension.name
                )
            },
            &format!("use one of: {}", unit.dimension.symbols()),
        )?;
    }
    let shown = |value: f64| format!("{} {}", rounded(value / unit.si_per_unit), unit.symbol);
    for noise in measured.deviations() {
        require(
            noise > 0.0,
            &key("noise"),
            || format!("a noise of {} gives no uncertainty", shown(noise)),
            &format!(
                "give the standard deviation of one reading, such as \"0.1 {}\"; with the rounding of its last digit",
                unit.symbol
            ),
        )?;
    }
    let [low, high] = measured.ends();
    require(
        low < high,
        &key("range"),
        || format!("the range from {} to {} is empty", shown(low), shown(high)),
        "write [lowest, highest]",
    )?;
    require(
        electronics.converter.is_none(),
        "electronics.converter",
        || {
            format!(
                "an instrument that gives \"{}\" has no converter",
                unit.symbol
            )
        },
        "leave the table out; the stage before a converter is readout itself",
    )?;
    check_axes(sensor)
}

/// Noises of three axes need three axes.
fn check_axes(sensor: &Sensor) -> Result<(), Broken> {
    let Some(measured) = sensor.electronics.measured() else {
        return Ok(());
    };
    let axes = match &sensor.element {
        Element::MeasuredForce(element) => element.axes.count(),
        _ => 1,
    };
    let [x, y, z] = measured.deviations();
    require(
        axes == 3 || (x == z && y == z),
        "electronics.readout.measured.noise",
        || "a list of noises is of taxels with three axes".into(),
        "give one value; a list [x, y, z] belongs to element.measured_force with axes = \"xyz\"",
    )
}

/// A scan must end before the next frame begins; `scan` in s.
pub(crate) fn check_scan_time(sensor: &Sensor, scan: f64) -> Result<(), Broken> {
    let period = sensor.electronics.period();
    require(
        at_most(scan, period),
        "electronics.frame_rate",
        || {
            format!(
                "one scan takes {:.4} ms, but a frame has only {:.4} ms",
                scan * 1e3,
                period * 1e3
            )
        },
        &format!(
            "give at most {} Hz, or a faster scan",
            rounded_down(1.0 / scan)
        ),
    )
}

fn check_mask(sensor: &Sensor) -> Result<(), Broken> {
    let (rows, columns) = (sensor.array.rows, sensor.array.columns);
    for (index, mask) in sensor.mask.iter().enumerate() {
        if mask.channel.is_some() {
            require(
                mask.taxel.is_none() && mask.capacitor.is_none(),
                &format!("mask.{index}.channel"),
                || "a mask is of a taxel or of a channel, not of both".into(),
                "write two [[mask]] tables",
            )?;
            continue;
        }
        let Some([row, column]) = mask.taxel else {
            return Err(Broken::new(
                &format!("mask.{index}"),
                "a mask without the taxel".into(),
                "write taxel = [row, column]",
            ));
        };
        require(
            row < rows && column < columns,
            &format!("mask.{index}.taxel"),
            || format!("there is no taxel in row {row}, column {column}"),
            &format!(
                "rows go from 0 to {}, columns from 0 to {}",
                rows - 1,
                columns - 1
            ),
        )?;
    }
    Ok(())
}

/// A length in m for people, um.
pub fn micrometres(length: f64) -> String {
    format!("{} um", rounded(length * 1e6))
}

/// What was solved of a drawing; nothing where tables alone may answer, and the rules between keys
/// say what they have.
///
/// # Errors
/// At `key` why there is no solution, with the remedy that the solver gives or else `help`.
pub(super) fn solved<T>(
    answer: Result<T, Unsolved>,
    key: &str,
    help: &str,
) -> Result<OfDrawing<T>, Broken> {
    match answer {
        Ok(solved) => Ok(OfDrawing(Some(solved))),
        Err(Unsolved::TablesOnly) => Ok(OfDrawing(None)),
        Err(Unsolved::Failed(message)) => {
            let (message, help) = message.split_once("\nhelp: ").unwrap_or((&message, help));
            Err(Broken::new(key, message.to_owned(), help))
        }
    }
}

/// A length for people.
pub(crate) fn millimetres(length: f64) -> String {
    format!("{} mm", rounded(length * 1e3))
}

/// At most four decimals, or four digits of what is smaller; without trailing zeros.
fn rounded(value: f64) -> f64 {
    let digits = (3.0 - value.abs().log10().floor()).clamp(4.0, 300.0);
    let scale = 10_f64.powf(digits);
    (value * scale).round() / scale
}

/// Four decimals, never below `value`: a limit that is itself accepted.
pub(crate) fn rounded_up(value: f64) -> f64 {
    decimal(value * 1e4).ceil() / 1e4
}

/// Four decimals, never above `value`.
pub(crate) fn rounded_down(value: f64) -> f64 {
    decimal(value * 1e4).floor() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_for_people_are_short_and_never_nothing() {
        for (metres, shown) in [
            (0.0, "0 um"),
            (5e-6, "5 um"),
            (1.23456e-7, "0.1235 um"),
            (1.000_001, "1000001 um"),
            (5e-13, "0.0000005 um"),
        ] {
            assert_eq!(micrometres(metres), shown);
        }
    }
}
