//! Rules between the keys of a three-axis array.

use super::ThreeAxisArray;
use crate::mechanics::UnitDrawing;
use crate::sensor::{
    Broken, SAME_LENGTH, ThreeAxisCapacitor, check_scan_time, micrometres, require, rounded_down,
};

pub(super) fn check(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    check_element(array.element, array.sensor.array.pitch)?;
    check_suspension(array)?;
    check_edges(array)?;
    check_bending(array)?;
    check_reach(array)?;
    check_electronics(array)?;
    check_fabrication(array.element)
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
    )
}

const SUSPENSION: &str = "element.three_axis_capacitor.suspension";

/// A stiffness is typed in or follows from the drawing, and not both.
fn check_suspension(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    let suspension = &array.element.suspension;
    let typed_in = [
        ("stiffness", suspension.stiffness.is_some()),
        ("tile_tilt", suspension.tile_tilt.is_some()),
        ("bump_sinking", suspension.bump_sinking.is_some()),
    ];
    for (key, given) in typed_in {
        if suspension.from_drawing.is_some() {
            require(
                !given,
                &format!("{SUSPENSION}.{key}"),
                || format!("{key} follows from the drawing where from_drawing is given"),
                "remove this key, or the table from_drawing",
            )?;
        } else {
            require(
                given,
                SUSPENSION,
                || format!("missing field `{key}`: the stiffness is typed in"),
                &format!(
                    "add {key}, or the table from_drawing with modulus, side_contact and cavity \
                     in the place of stiffness, tile_tilt and bump_sinking"
                ),
            )?;
        }
    }
    let drawing = array.unit_drawing();
    if suspension.from_drawing.is_some() {
        let [x, y] = array.element.plates.electrode;
        require(
            (x - y).abs() <= SAME_LENGTH,
            "element.three_axis_capacitor.plates.electrode",
            || {
                format!(
                    "the stiffness follows from the drawing of square electrodes, not of {} by {}",
                    micrometres(x),
                    micrometres(y)
                )
            },
            "give equal sides, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the place of from_drawing",
        )?;
        check_unit(&drawing)?;
    }
    if let Err(outside) = suspension.model(&drawing) {
        let path = match outside.key.strip_prefix("array.") {
            Some(_) => outside.key.to_owned(),
            None => format!("element.three_axis_capacitor.{}", outside.key),
        };
        let help = "the command taxel and Sensor::parse_with solve such a drawing; or change this \
                    length, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the \
                    place of from_drawing";
        return Err(Broken::new(&path, outside.to_string(), help));
    }
    Ok(())
}

/// A unit whose stiffness follows from its drawing has electrodes within its cavities, and
/// elastomer between it and the next one.
fn check_unit(drawing: &UnitDrawing) -> Result<(), Broken> {
    let key = |name: &str| format!("element.three_axis_capacitor.{name}");
    let [inner, outer] = [-1.0, 1.0].map(|side| drawing.centre_distance + side * drawing.electrode);
    require(
        drawing.wall_width < inner,
        &key("outline.wall_width"),
        || {
            format!(
                "a wall of {} reaches the electrodes, which are {} apart",
                micrometres(drawing.wall_width),
                micrometres(inner)
            )
        },
        "give a narrower wall, or a larger centre distance",
    )?;
    require(
        outer < drawing.unit_side,
        &key("outline.unit_side"),
        || {
            format!(
                "the electrodes end {} from each other and need cavities wider than that, not of {}",
                micrometres(outer),
                micrometres(drawing.unit_side)
            )
        },
        "give a larger unit side",
    )?;
    require(
        drawing.insulation > 0.0,
        &key("plates.insulation"),
        || "the stiffness follows from the drawing of units with an insulation".into(),
        "give an insulation of more than 0 um, or type the stiffness in",
    )?;
    let layer = drawing.lower_layer.min(drawing.upper_layer);
    require(
        drawing.electrode_thickness < layer,
        &key("outline.electrode_thickness"),
        || {
            format!(
                "electrodes of {} are as thick as a layer of {} in which they lie",
                micrometres(drawing.electrode_thickness),
                micrometres(layer)
            )
        },
        "give thinner electrodes, or thicker layers",
    )?;
    require(
        inner < drawing.bump_base && drawing.bump_base < outer,
        &key("outline.bump_base"),
        || {
            format!(
                "a bump's base of {} does not end over the electrodes: the stiffness follows from the drawing for more \
                 than {} and less than {}",
                micrometres(drawing.bump_base),
                micrometres(inner),
                micrometres(outer)
            )
        },
        "change the base, or type the stiffness in (stiffness, tile_tilt, bump_sinking) in the place of from_drawing",
    )?;
    require(
        drawing.unit_side < drawing.pitch,
        "array.pitch",
        || {
            format!(
                "units of {} at a pitch of {} have no elastomer between them",
                micrometres(drawing.unit_side),
                micrometres(drawing.pitch)
            )
        },
        "give a larger pitch or a smaller unit side",
    )
}

/// Where no parallel capacitance is typed in, the edges must follow from the drawing.
fn check_edges(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    let plates = &array.element.plates;
    if plates.parallel_capacitance.is_some() {
        return Ok(());
    }
    let help = "change this length, or type parallel_capacitance in: what edges and leads add \
                to each plate pair, such as \"30 fF\"";
    require(
        plates.insulation > 0.0,
        "element.three_axis_capacitor.plates.insulation",
        || "the edges follow from the drawing of electrodes with an insulation".into(),
        "give an insulation of more than 0 um, or type parallel_capacitance in",
    )?;
    match array.edges() {
        Ok(_) => Ok(()),
        Err(outside) => {
            let path = format!("element.three_axis_capacitor.{}", outside.key);
            Err(Broken::new(&path, outside.to_string(), help))
        }
    }
}

/// Bending must leave air.
fn check_bending(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    let Some(bent) = array.element.bent(&array.sensor.array) else {
        return Ok(());
    };
    let gaps = array.element.plates.air_gap.into_iter();
    let least = gaps.fold(f64::INFINITY, f64::min);
    require(
        bent.closing < least,
        "array.mount.cylinder.unstretched_plane",
        || {
            format!(
                "bending closes {} of an air gap of {}",
                micrometres(bent.closing),
                micrometres(least)
            )
        },
        "give a plane nearer to the air gap, or a larger radius",
    )
}

/// The full scale of each axis alone must not close a gap.
fn check_reach(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    let (element, unit) = (array.element, array.unit_model());
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut force = [0.0; 3];
        force[axis] = element.full_scale;
        let air = unit.plates.air_gaps(&unit.suspension.deform(force));
        let least = air.into_iter().fold(f64::INFINITY, f64::min);
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

fn check_electronics(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    let front_end = &array.board;
    check_scan_time(array.sensor, front_end.scan_time())?;
    let rest = array.unit_model().rest();
    let [least, most] = front_end.span();
    for value in rest {
        require(
            least < value && value < most,
            front_end.last.range_key(),
            || {
                format!(
                    "a rest capacitance of {:.2} fF is outside what the board can read, {:.2} to {:.2} fF",
                    value * 1e15,
                    least * 1e15,
                    most * 1e15
                )
            },
            "change the range, or the drive or the feedback capacitor of an amplifier",
        )?;
    }
    require(
        front_end.deviation() > 0.0,
        front_end.noise_key(),
        || "a board without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )
}

fn check_fabrication(element: &ThreeAxisCapacitor) -> Result<(), Broken> {
    let least = element
        .plates
        .air_gap
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    require(
        element.fabrication.air_gap_deviation <= 0.2 * least,
        "element.three_axis_capacitor.fabrication.air_gap_deviation",
        || {
            format!(
                "more than a fifth of the air gap of {}: some units would be closed",
                micrometres(least)
            )
        },
        &format!("give at most {} um", rounded_down(0.2 * least * 1e6)),
    )
}
