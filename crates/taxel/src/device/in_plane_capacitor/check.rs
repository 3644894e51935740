//! Rules between the keys of an in-plane sensor.

use super::InPlaneArray;
use crate::device::check_mask;
use crate::sensor::{Broken, check_scan_time, require};
use crate::transduction::{InPlaneError, InPlaneInverse};

pub(super) fn check(array: &InPlaneArray<'_>) -> Result<(), Broken> {
    check_electronics(array, &check_model(array)?)?;
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

fn check_electronics(array: &InPlaneArray<'_>, inverse: &InPlaneInverse) -> Result<(), Broken> {
    let board = &array.board;
    check_scan_time(array.sensor, board.scan_time())?;
    let [least, most] = board.span();
    for (what, value) in [
        ("a rest capacitance", array.model().rest_capacitance()),
        ("the least capacitance", inverse.last().capacitance),
    ] {
        require(
            least < value && value < most,
            board.last.range_key(),
            || {
                format!(
                    "{what} of {:.2} fF is outside what the board can read, {:.2} to {:.2} fF",
                    value * 1e15,
                    least * 1e15,
                    most * 1e15
                )
            },
            "change the range, or the drive or the feedback capacitor of an amplifier",
        )?;
    }
    require(
        board.deviation() > 0.0,
        board.noise_key(),
        || "a board without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )
}
