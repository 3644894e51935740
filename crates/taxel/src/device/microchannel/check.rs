//! Rules between the keys of an array of crossing channels.

use super::MicrochannelArray;
use crate::device::check_mask;
use crate::quantity::at_most;
use crate::sensor::{Broken, check_scan_time, micrometres, require};
use crate::signal::ResistanceSignal;

pub(super) fn check(array: &MicrochannelArray<'_>) -> Result<(), Broken> {
    check_lengths(array)?;
    check_board(array)?;
    check_scatter(array)?;
    check_mask(array.sensor)
}

/// A channel is at least as long as the taxels that it crosses.
fn check_lengths(array: &MicrochannelArray<'_>) -> Result<(), Broken> {
    let [rows, columns] = array.counts();
    let share = array.taxel_share();
    for (layer, crossed) in [("rows", columns), ("columns", rows)]
        .into_iter()
        .enumerate()
    {
        let (name, crossed) = crossed;
        require(
            at_most(share[layer] * crossed as f64, 1.0),
            &format!("element.microchannel.{name}.length"),
            || format!("a channel crosses {crossed} taxels, which are longer than itself"),
            "give the length from lead to lead",
        )?;
    }
    require(
        array.calibration().is_ok(),
        "element.microchannel.liquid.pressure",
        || "with this law pressing a taxel does not raise the resistance of its channel".into(),
        "give a law that lets the pressed part close more than the rest opens",
    )
}

fn check_board(array: &MicrochannelArray<'_>) -> Result<(), Broken> {
    let (board, signal) = (&array.board, &array.board.signal);
    check_scan_time(array.sensor, board.scan_time())?;
    if let ResistanceSignal::Divider { supply, .. } = *signal {
        let key = array
            .sensor
            .electronics
            .stage_key("voltage_divider.saturation");
        require(
            board.saturation < supply,
            &key,
            || {
                format!(
                    "saturation at {} V, the supply is {supply} V",
                    board.saturation
                )
            },
            "give less than the supply, which an open channel reads",
        )?;
    }
    let [low, high] = board.last.range();
    let (what, unit) = signal.unit();
    for layer in &array.layers {
        let rest = signal.of(layer.conductor.rest_resistance());
        require(
            low < rest && rest < high.min(board.saturation),
            board.last.range_key(),
            || format!("a rest {what} of {rest:.4} {unit} cannot be read or is saturated"),
            "change the range, or the reference or the saturation of a divider",
        )?;
    }
    require(
        board.deviation() > 0.0,
        board.noise_key(),
        || "a board without any noise gives no uncertainty".into(),
        "give the noise of one reading, such as \"0.1 mV\"",
    )
}

fn check_scatter(array: &MicrochannelArray<'_>) -> Result<(), Broken> {
    let element = array.element;
    require(
        at_most(
            element.fabrication.height_deviation,
            0.2 * element.section.height,
        ),
        "element.microchannel.fabrication.height_deviation",
        || {
            format!(
                "more than a fifth of the height of {}: some channels would be closed",
                micrometres(element.section.height)
            )
        },
        &format!("give at most {}", micrometres(0.2 * element.section.height)),
    )
}
