//! Rules between the keys of an in-plane sensor.

use super::InPlaneArray;
use crate::device::check_mask;
use crate::sensor::{
    Broken, InPlaneCapacitor, MOST_SCATTER, SAME_LENGTH, check_scan_time, micrometres, require,
    rounded_down,
};
use crate::transduction::{InPlaneError, InPlaneInverse};

/// A device that cannot be read back up to here is of no use.
const LEAST_RANGE: f64 = 1e-3;

pub(super) fn check(array: &InPlaneArray<'_>) -> Result<(), Broken> {
    check_element(array.element, array.sensor.array.pitch)?;
    let inverse = check_model(array)?;
    check_electronics(array, &inverse)?;
    check_mask(array.sensor)
}

fn key(name: &str) -> String {
    format!("element.in_plane_capacitor.{name}")
}

fn check_element(element: &InPlaneCapacitor, pitch: [f64; 2]) -> Result<(), Broken> {
    let (layer, electrodes) = (&element.layer, &element.electrodes);
    let top = electrodes.height + electrodes.thickness;
    require(
        top < layer.thickness,
        &key("electrodes.height"),
        || {
            format!(
                "electrodes up to {} do not lie in a layer of {}",
                micrometres(top),
                micrometres(layer.thickness)
            )
        },
        "give lower or thinner electrodes, or a thicker layer",
    )?;
    let across = electrodes.gap + 2.0 * electrodes.width;
    let loaded = 2.0 * layer.contact_half_length;
    for (name, length, what) in [
        ("electrodes.width", across, "two electrodes and their gap"),
        ("layer.contact_half_length", loaded, "the loaded length"),
    ] {
        require(
            length <= element.layer_width + SAME_LENGTH,
            &key(name),
            || {
                let width = micrometres(element.layer_width);
                format!(
                    "{what} need {}; the layer is {width} wide",
                    micrometres(length)
                )
            },
            "give a smaller length or a wider layer",
        )?;
    }
    for (pitch, need, what) in [
        (pitch[0], element.layer_width, "the layer is"),
        (pitch[1], electrodes.depth, "the electrodes are"),
        (pitch[1], layer.contact_depth, "the loaded part is"),
    ] {
        require(
            need <= pitch + SAME_LENGTH,
            "array.pitch",
            || {
                format!(
                    "{what} {}, more than a pitch of {}",
                    micrometres(need),
                    micrometres(pitch)
                )
            },
            "give a larger pitch",
        )?;
    }
    let scatter = element.fabrication.gap_deviation;
    let most = 0.1 * electrodes.gap / MOST_SCATTER;
    require(
        scatter <= most,
        &key("fabrication.gap_deviation"),
        || {
            let gap = micrometres(electrodes.gap);
            format!("{MOST_SCATTER} of these deviations are more than a tenth of the gap of {gap}")
        },
        &format!("give at most {} um", rounded_down(most * 1e6)),
    )
}

/// The model must have an answer, and a way back.
fn check_model(array: &InPlaneArray<'_>) -> Result<InPlaneInverse, Broken> {
    let inverse = array.model().inverse().map_err(|error| {
        let place = match error {
            InPlaneError::NoPublishedFit => "law",
            InPlaneError::Layer(_) => "layer.end_condition",
            _ => "electrodes",
        };
        let help = "change the drawing, or choose a model that reaches it";
        Broken::new(&key(place), error.to_string(), help)
    })?;
    let range = inverse.last().layer.kinematics.compression();
    require(
        range >= LEAST_RANGE,
        &key("dielectric.surroundings"),
        || format!("the capacitance can be read back only up to a compression of {range:.4}"),
        "choose other surroundings or a smaller gap",
    )?;
    Ok(inverse)
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
