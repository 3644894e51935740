//! Rules between the keys of an in-plane sensor.

use super::InPlaneArray;
use crate::device::{check_capacitor_board, check_mask, check_readable};
use crate::sensor::{Broken, check_scan_time};
use crate::transduction::{InPlaneError, InPlaneInverse};

pub(super) fn check(array: &InPlaneArray<'_>) -> Result<(), Broken> {
    let inverse = check_model(array)?;
    let (rest, least) = (array.model().rest_capacitance(), inverse.last().capacitance);
    check_readable(&array.board, "a rest capacitance", rest)?;
    check_readable(&array.board, "the least capacitance", least)?;
    check_mask(array.sensor)
}

fn key(name: &str) -> String {
    format!("element.in_plane_capacitor.{name}")
}

/// The model must have an answer; where its way back ends at once, loads are predicted and only what
/// reads forces is refused ([`InPlaneInverse::check`]).
fn check_model(array: &InPlaneArray<'_>) -> Result<InPlaneInverse, Broken> {
    array.model().inverse().map_err(|error| {
        let place = match error {
            InPlaneError::NoPublishedFit => "law",
            InPlaneError::Layer(_) => "layer.end_condition",
            _ => "electrodes",
        };
        let help = "change the drawing, or choose a model that reaches it";
        Broken::new(&key(place), error.to_string(), help)
    })
}

/// Rules of the board that need no solution of the drawing: its facing sides are less than its
/// capacitance, unless a grounded base takes field lines away.
pub(super) fn check_board(array: &InPlaneArray<'_>) -> Result<(), Broken> {
    check_scan_time(array.sensor, array.board.scan_time())?;
    let model = array.model();
    let grounded = model.dielectric.surroundings.has_ground();
    let sides = model.rest_capacitance_without_fringe();
    check_capacitor_board(
        &array.board,
        (!grounded).then_some(("the capacitance of the facing sides alone", sides)),
    )
}
