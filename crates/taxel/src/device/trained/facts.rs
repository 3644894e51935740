//! Quantities of a body whose channels are learned.

use super::TrainedArray;
use crate::summary::{Fact, fact, number, text};

pub(super) fn facts(array: &TrainedArray<'_>) -> Vec<Fact> {
    let names = array.body.channels();
    let [x, y] = array.area().half_sides();
    let mut facts = vec![fact(
        "device",
        "channels",
        text(&names.len()),
        "element.trained.groups",
    )];
    for group in &array.body.groups {
        facts.push(fact(
            "device",
            group.name.clone(),
            text(&group.channels.join(", ")),
            "element.trained.groups",
        ));
    }
    facts.extend([
        fact(
            "mechanics",
            "model",
            text("none: learned by `taxel calibrate`"),
            "element",
        ),
        fact(
            "mechanics",
            "width_of_the_area",
            number(2.0 * x, "m", "mm", 1e-3),
            "columns x pitch",
        ),
        fact(
            "mechanics",
            "height_of_the_area",
            number(2.0 * y, "m", "mm", 1e-3),
            "rows x pitch",
        ),
        fact(
            "electronics",
            "frame_period",
            number(array.sensor.electronics.period(), "s", "ms", 1e-3),
            "1/frame rate",
        ),
        fact(
            "electronics",
            "unit",
            text(array.unit.symbol),
            "electronics.readout",
        ),
        fact(
            "estimation",
            "full_scale",
            number(array.body.full_scale, "n", "N", 1.0),
            "element.trained.full_scale",
        ),
    ]);
    facts
}
