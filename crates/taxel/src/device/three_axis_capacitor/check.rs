//! Rules between the keys of a three-axis array.

use super::ThreeAxisArray;
use crate::device::{AXES, check_capacitor_board, check_readable};
use crate::quantity::{at_most, below};
use crate::sensor::{
    Broken, ThreeAxisCapacitor, check_scan_time, micrometres, require, rounded_down,
};
use crate::transduction::VACUUM_PERMITTIVITY;

pub(super) fn check(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    check_suspension(array)?;
    check_edges(array)?;
    check_bending(array)?;
    check_reach(array)?;
    for rest in array.unit_model().rest() {
        check_readable(&array.board, "a rest capacitance", rest)?;
    }
    Ok(())
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
        below(bent.closing, least),
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
    let least = |axis: usize, size: f64| {
        let mut force = [0.0; 3];
        force[axis] = size;
        let air = unit.plates.air_gaps(&unit.suspension.deform(force));
        air.into_iter().fold(f64::INFINITY, f64::min)
    };
    let closes = |axis: &usize| least(*axis, element.full_scale) <= 0.0;
    let Some(axis) = (0..3).find(closes) else {
        return Ok(());
    };
    // A gap shrinks with the force: the ends are halved until rounding is left.
    let largest = |axis: usize| {
        let halved = |[low, high]: [f64; 2], _| {
            let middle = 0.5 * (low + high);
            if least(axis, middle) > 0.0 {
                [middle, high]
            } else {
                [low, middle]
            }
        };
        (0..f64::MANTISSA_DIGITS).fold([0.0, element.full_scale], halved)[0]
    };
    let fits = (0..3).map(largest).fold(f64::INFINITY, f64::min);
    let message = format!(
        "the full scale along {} closes a gap: {:.3} um would be missing",
        AXES[axis],
        -least(axis, element.full_scale) * 1e6
    );
    let help = format!(
        "give less than {} mN, a stiffer suspension or a larger air gap",
        rounded_down(fits * 1e3)
    );
    let key = "element.three_axis_capacitor.full_scale";
    Err(Broken::new(key, message, &help))
}

/// Rules of the board and of the scatter that need no solution of the drawing: its plates are less
/// than its capacitance.
pub(super) fn check_board(array: &ThreeAxisArray<'_>) -> Result<(), Broken> {
    check_scan_time(array.sensor, array.board.scan_time())?;
    let plates = &array.element.plates;
    let widest = plates.air_gap.into_iter().fold(0.0, f64::max);
    let gap = widest + plates.insulation / plates.insulation_permittivity;
    let plate = VACUUM_PERMITTIVITY * plates.electrode[0] * plates.electrode[1] / gap;
    check_capacitor_board(
        &array.board,
        Some((
            "the capacitance of a pair of plates without its edges",
            plate,
        )),
    )?;
    check_fabrication(array.element)
}

fn check_fabrication(element: &ThreeAxisCapacitor) -> Result<(), Broken> {
    let least = element
        .plates
        .air_gap
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    require(
        at_most(element.fabrication.air_gap_deviation, 0.2 * least),
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
