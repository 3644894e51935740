//! Quantities of taxels whose board gives forces.

use super::MeasuredForceArray;
use crate::device::timing;
use crate::estimation::MeasuredForceReader;
use crate::estimation::{Reader, Threshold};
use crate::summary::{Fact, fact, number, text};

pub(super) fn facts(array: &MeasuredForceArray<'_>) -> Vec<Fact> {
    let (board, axes) = (&array.board, array.element.axes);
    let unit = &board.unit;
    let force = |value: f64| number(value, "n", unit.symbol, unit.si_per_unit);
    let [low, high] = board.ends();
    let mut facts = vec![
        fact(
            "device",
            "channels",
            text(&(axes.count() * array.layout().taxels())),
            "one per force",
        ),
        fact(
            "device",
            "forces_of_a_taxel",
            text(&axes.names().join(", ")),
            "element.measured_force.axes",
        ),
        fact(
            "mechanics",
            "model",
            text("none: the readings are the forces"),
            "element",
        ),
    ];
    facts.extend(timing(
        array.sensor.electronics.period(),
        array.scan_time(),
        "time for all taxels of a frame",
    ));
    let range = "electronics.readout.measured.range";
    facts.push(fact("electronics", "lowest_force", force(low), range));
    facts.push(fact("electronics", "highest_force", force(high), range));
    for (axis, name) in (axes.first()..).zip(axes.names()) {
        let noise = force(board.deviations()[axis]);
        let source = "electronics.readout.measured.noise";
        facts.push(fact("electronics", format!("noise_{name}"), noise, source));
    }
    facts.push(fact(
        "estimation",
        "full_scale",
        force(array.element.full_scale),
        "element.measured_force.full_scale",
    ));
    let rules = MeasuredForceReader::new(array.model()).rules();
    if let Threshold::Deviations(deviations, least) = rules.threshold {
        let least = force(least.max(deviations * board.deviation()));
        let source = "6 standard deviations, at least 1 % of the full scale; default";
        facts.push(fact("estimation", "contact_threshold", least, source));
    }
    facts
}
