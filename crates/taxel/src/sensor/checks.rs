//! Rules between the fields of a sensor file.

use super::{Element, Sensor, ThreeAxisCapacitor};
use crate::input::InputError;
use crate::layout::{MOST_LINES, Mount};
use crate::toml_input;

/// A broken rule, shown at one key.
pub(super) struct Broken {
    path: Vec<String>,
    message: String,
    help: String,
}

impl Broken {
    pub(super) fn at(&self, file: &str, text: &str) -> InputError {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        toml_input::at_key(file, text, &path, &self.message, &self.help)
    }
}

fn require(
    holds: bool,
    path: &str,
    message: impl Fn() -> String,
    help: &str,
) -> Result<(), Broken> {
    if holds {
        return Ok(());
    }
    let path = path.split('.').map(str::to_owned).collect();
    Err(Broken {
        path,
        message: message(),
        help: help.to_owned(),
    })
}

/// Lengths agree when they differ by less than this: rounding of unit strings.
const SAME_LENGTH: f64 = 1e-12;

pub(super) fn check(sensor: &Sensor) -> Result<(), Broken> {
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
        "write schema = 1, or use the program that the file was written for",
    )?;
    require(
        !sensor.name.trim().is_empty(),
        "name",
        || "the name is empty".into(),
        "name the device",
    )?;
    check_array(sensor)?;
    let Element::ThreeAxisCapacitor(element) = &sensor.element;
    check_element(element, sensor.array.pitch)?;
    check_electronics(sensor)?;
    check_fabrication(sensor, element)?;
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
            arc <= round,
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

fn check_element(element: &ThreeAxisCapacitor, pitch: [f64; 2]) -> Result<(), Broken> {
    let key = |name: &str| format!("element.three_axis_capacitor.{name}");
    let outline = &element.outline;
    let distance = element.suspension.centre_distance;
    for side in element.plates.electrode {
        require(
            side <= distance + SAME_LENGTH,
            &key("suspension.centre_distance"),
            || {
                format!(
                    "electrodes of {} at centres {} apart overlap",
                    micrometres(side),
                    micrometres(distance)
                )
            },
            "give a larger centre distance or smaller electrodes",
        )?;
        let unit = distance + side;
        require(
            unit <= outline.unit_side + SAME_LENGTH,
            &key("outline.unit_side"),
            || {
                format!(
                    "two electrodes and their distance need {}",
                    micrometres(unit)
                )
            },
            "give a larger unit side",
        )?;
    }
    for pitch in pitch {
        require(
            outline.unit_side <= pitch + SAME_LENGTH,
            "array.pitch",
            || {
                format!(
                    "units of {} overlap at a pitch of {}",
                    micrometres(outline.unit_side),
                    micrometres(pitch)
                )
            },
            "give a larger pitch or a smaller unit side",
        )?;
    }
    require(
        outline.bump_top <= outline.bump_base,
        &key("outline.bump_top"),
        || "the bump is wider at its top than at its base".into(),
        "give a top that is at most as wide as the base",
    )?;
    require(
        outline.bump_base <= outline.unit_side,
        &key("outline.bump_base"),
        || "the bump is wider than its unit".into(),
        "give a smaller base",
    )?;
    require(
        element.usable_force <= element.full_scale,
        &key("usable_force"),
        || "the usable force is above the full scale".into(),
        "give at most the full scale",
    )?;
    check_reach(element)
}

/// The full scale of each axis alone must not close a gap.
fn check_reach(element: &ThreeAxisCapacitor) -> Result<(), Broken> {
    let unit = element.unit_model();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut force = [0.0; 3];
        force[axis] = element.full_scale;
        let least = unit.predict(force).1.least_air_gap();
        require(
            least > 0.0,
            "element.three_axis_capacitor.full_scale",
            || {
                format!(
                    "the full scale along {name} closes a gap: {:.3} um would be missing",
                    -least * 1e6
                )
            },
            "give a smaller full scale, a stiffer suspension or a larger air gap",
        )?;
    }
    Ok(())
}

fn check_electronics(sensor: &Sensor) -> Result<(), Broken> {
    let front_end = sensor.front_end();
    let [low, high] = sensor.electronics.converter.range;
    require(
        (1..=32).contains(&sensor.electronics.converter.bits),
        "electronics.converter.bits",
        || {
            format!(
                "{} is out of range: must be from 1 to 32",
                sensor.electronics.converter.bits
            )
        },
        "give the resolution of the converter in bits",
    )?;
    require(
        low < high,
        "electronics.converter.range",
        || format!("the range from {low} V to {high} V is empty"),
        "write [lowest, highest]",
    )?;
    let (scan, period) = (front_end.scan_time(), front_end.period());
    require(
        scan <= period * (1.0 + 1e-9),
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
    )?;
    let rest = sensor.unit_model().rest();
    let [least, most] = front_end.span();
    for value in rest {
        require(
            least < value && value < most,
            "electronics.converter.range",
            || {
                format!(
                    "a rest capacitance of {:.2} fF is outside what the board can read, {:.2} to {:.2} fF",
                    value * 1e15,
                    least * 1e15,
                    most * 1e15
                )
            },
            "change the range, the drive or the feedback capacitor",
        )?;
    }
    require(
        front_end.deviation() > 0.0,
        "electronics.charge_amplifier.noise",
        || "a board without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )
}

fn check_fabrication(sensor: &Sensor, element: &ThreeAxisCapacitor) -> Result<(), Broken> {
    let least = element
        .plates
        .air_gap
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    require(
        sensor.fabrication.air_gap_deviation <= 0.2 * least,
        "fabrication.air_gap_deviation",
        || {
            format!(
                "more than a fifth of the air gap of {}: some units would be closed",
                micrometres(least)
            )
        },
        &format!("give at most {} um", rounded_down(0.2 * least * 1e6)),
    )
}

fn check_mask(sensor: &Sensor) -> Result<(), Broken> {
    let (rows, columns) = (sensor.array.rows, sensor.array.columns);
    for (index, mask) in sensor.mask.iter().enumerate() {
        let [row, column] = mask.taxel;
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

fn micrometres(length: f64) -> String {
    format!("{} um", rounded(length * 1e6))
}

fn millimetres(length: f64) -> String {
    format!("{} mm", rounded(length * 1e3))
}

/// At most four decimals, without trailing zeros.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// Four decimals, never below `value`: a limit that is itself accepted.
fn rounded_up(value: f64) -> f64 {
    (value * 1e4).ceil() / 1e4
}

/// Four decimals, never above `value`.
fn rounded_down(value: f64) -> f64 {
    (value * 1e4).floor() / 1e4
}
