//! What follows from the parts of a chain together.

use super::ChainDevice;
use crate::device::timing;
use crate::estimation::{Reader as _, Threshold};
use crate::summary::{Fact, fact, number, text};

pub(super) fn facts(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    let (count, full_scale) = (chain.count(), chain.full_scale);
    let kpa = |value: f64| number(value, "pa", "kPa", 1e3);
    let cell = chain.cell(0);
    let quantity = cell.quantity();
    let of_cell = |value: f64| number(value, quantity.unit.2, quantity.unit.0, quantity.unit.1);
    let mut facts = vec![fact(
        "device",
        "channels",
        text(&count),
        "one for each cell",
    )];
    for stage in chain.stages() {
        facts.extend(stage.facts());
    }
    if let Some(cover) = &chain.cover {
        let pitch = chain.layout.pitch;
        let shares = cover.shares(cell.area(), pitch, [&[0.0, pitch[0]], &[0.0]]);
        for (name, share) in ["share_at_the_loaded_cell", "share_at_its_neighbour"]
            .into_iter()
            .zip(shares)
        {
            facts.push(fact(
                "mechanics",
                name,
                number(share, "share", "%", 1e-2),
                "element.cells.cover",
            ));
        }
        let sampling = number(cover.sampling(cell.area(), pitch), "share", "%", 1e-2);
        facts.push(fact(
            "mechanics",
            "total_force_deviation_of_a_point_load",
            sampling,
            "cover, area of a cell and pitch",
        ));
    }
    let [rest, full] = [0.0, full_scale].map(|pressure| cell.value(pressure));
    let law = "law of the cell";
    facts.push(fact(
        "transduction",
        format!("{}_at_rest", quantity.name),
        of_cell(rest),
        law,
    ));
    facts.push(fact(
        "transduction",
        format!("{}_at_full_scale", quantity.name),
        of_cell(full),
        law,
    ));
    facts.extend(chain.network.facts_at(rest, full));
    let mut clone = chain.clone();
    let mut names = Vec::new();
    clone.parameters(&mut |parameter, _| names.push(parameter.name));
    facts.push(fact(
        "transduction",
        "numbers_of_the_parts",
        text(&names.join(", ")),
        "for fabrication and calibration",
    ));
    facts.extend(timing(
        chain.period,
        chain.scan.duration(chain.layout.rows, chain.layout.columns),
        "time for all channels of a frame",
    ));
    let signal = chain.network.quantity(quantity);
    let of_signal = |value: f64| number(value, signal.unit.2, signal.unit.0, signal.unit.1);
    facts.push(fact(
        "electronics",
        "noise_of_a_reading",
        of_signal(chain.deviation()),
        "readout, last stage",
    ));
    let [low, high] = chain.last.range();
    for (name, input) in device.inputs() {
        let share = number((input - low) / (high - low), "share", "%", 1e-2);
        facts.push(fact(
            "electronics",
            format!("range_used_{}", name.replace(' ', "_")),
            share,
            chain.last.range_key(),
        ));
    }
    for (name, pressure) in [("rest", 0.0), ("half_scale", 0.5 * full_scale)] {
        let slope = one_cell_slope(device, pressure);
        let noise = kpa(chain.deviation() / slope.abs());
        facts.push(fact(
            "estimation",
            format!("noise_of_a_pressure_at_{name}"),
            noise,
            "noise of a reading over the slope of the chain",
        ));
    }
    facts.push(fact(
        "estimation",
        "full_scale",
        kpa(full_scale),
        "element.cells.full_scale",
    ));
    if let Threshold::Deviations(deviations, least) = device.chain_reader().rules().threshold {
        let source = "standard deviations of the pressure, or this pressure; default";
        facts.push(fact(
            "estimation",
            "contact_threshold",
            text(&format!(
                "{deviations} deviations, at least {} kPa",
                least / 1e3
            )),
            source,
        ));
    }
    let states = cell
        .caveat()
        .map_or("holds for loading and unloading".into(), |caveat| {
            format!("holds for {caveat}")
        });
    facts.push(fact("estimation", "stated_deviation", text(&states), law));
    facts
}

/// Slope of the signal of the middle cell by the pressure on it alone, per Pa.
fn one_cell_slope(device: &ChainDevice<'_>, pressure: f64) -> f64 {
    let chain = &device.chain;
    let at = chain.layout.rows / 2 * chain.layout.columns + chain.layout.columns / 2;
    let mut pressures = vec![0.0; chain.count()];
    pressures[at] = pressure;
    chain.slopes(&pressures, &device.direction(Some(at)))[at]
}
