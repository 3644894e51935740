//! What follows from the parts of a chain together.

use super::{CONTACT_SHARE, ChainDevice};
use crate::device::timing;
use crate::estimation::{Reader as _, Threshold};
use crate::information::InformationOptions;
use crate::predict::{Load, LoadValue};
use crate::stage::{CellLoad, CellQuantity};
use crate::summary::{Fact, Value, fact, number, text};

/// Facts of all parts, in the order of the signal.
pub(super) fn facts(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    let each = match chain.channel_of(0) {
        Some(_) => "one for each cell",
        None if chain.network.channel_name(0).is_some() => "those of each body",
        None => "three for each magnetometer",
    };
    let mut facts = vec![fact("device", "channels", text(&chain.channels()), each)];
    facts.extend(device.chain.stages().iter().flat_map(|stage| stage.facts()));
    facts.extend(of_the_cover(device));
    facts.extend(of_the_cells(device));
    facts.extend(of_the_board(device));
    facts.extend(of_the_estimate(device));
    facts
}

fn share(of: f64) -> Value {
    number(of, "share", "%", 1e-2)
}

fn in_unit(value: f64, quantity: CellQuantity) -> Value {
    let (unit, scale, key) = quantity.unit;
    number(value, key, unit, scale)
}

fn of_the_cover(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    let Some(cover) = &chain.cover else {
        return Vec::new();
    };
    let (pitch, area) = (chain.layout.pitch, chain.cell_area());
    let shares = cover.shares(area, pitch, [&[0.0, pitch[0]], &[0.0]]);
    let names = ["share_at_the_loaded_cell", "share_at_its_neighbour"];
    let source = "cover, area of a cell and pitch";
    let each = names.into_iter().zip(shares);
    let mut facts: Vec<Fact> = each
        .map(|(name, arrived)| fact("mechanics", name, share(arrived), source))
        .collect();
    let sampling = share(cover.sampling(area, pitch));
    let name = "total_force_deviation_of_a_point_load";
    facts.push(fact("mechanics", name, sampling, source));
    facts
}

fn of_the_cells(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    if chain.cell(0).load() == CellLoad::Force {
        // The value is the load, and its network says the rest.
        return Vec::new();
    }
    let (cell, mut names) = (chain.cell(0), Vec::new());
    let quantity = cell.quantity();
    let values = [0.0, chain.full_scale].map(|pressure| cell.value(pressure));
    let at = ["rest", "full_scale"].into_iter().zip(values);
    let mut facts: Vec<Fact> = at
        .map(|(at, value)| {
            let name = format!("{}_at_{at}", quantity.name);
            fact(
                "transduction",
                name,
                in_unit(value, quantity),
                "law of the cell",
            )
        })
        .collect();
    facts.extend(chain.network.facts_at(values[0], values[1]));
    chain
        .clone()
        .parameters(&mut |parameter, _| names.push(parameter.name));
    let (names, source) = (text(&names.join(", ")), "for fabrication and calibration");
    facts.push(fact("transduction", "numbers_of_the_parts", names, source));
    facts
}

fn of_the_board(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    let scan_time = chain.scan.duration(chain.layout.rows, chain.layout.columns);
    let mut facts = timing(chain.period, scan_time, "time for all channels of a frame");
    let signal = chain.network.quantity(chain.cell(0).quantity());
    let noise = in_unit(chain.deviation(), signal);
    facts.push(fact(
        "electronics",
        "noise_of_a_reading",
        noise,
        "readout, last stage",
    ));
    let [low, high] = chain.last.range();
    let inputs = device.inputs(0).into_iter();
    facts.extend(
        inputs
            .filter(|_| (high - low).is_finite())
            .map(|(name, input)| {
                let name = format!("range_used_{}", name.replace(' ', "_"));
                let used = share((input - low) / (high - low));
                fact(
                    "electronics",
                    name,
                    used,
                    device.sensor.electronics.range_key(),
                )
            }),
    );
    facts
}

fn of_the_estimate(device: &ChainDevice<'_>) -> Vec<Fact> {
    let (chain, full_scale) = (&device.chain, device.chain.full_scale);
    if chain.cell(0).load() == CellLoad::Force {
        return of_the_force(device);
    }
    let kpa = |value: f64| number(value, "pa", "kPa", 1e3);
    let noise = |(at, pressure)| {
        let noise = kpa(chain.deviation() / one_cell_slope(device, pressure).abs());
        let name = format!("noise_of_a_pressure_at_{at}");
        let source = "noise of a reading over the slope of the chain";
        fact("estimation", name, noise, source)
    };
    let mut facts: Vec<Fact> = [("rest", 0.0), ("half_scale", 0.5 * full_scale)]
        .map(noise)
        .into();
    let (end, source) = (kpa(full_scale), "element.cells.full_scale");
    facts.push(fact("estimation", "full_scale", end, source));
    let quantity = chain.last.unit().quantity;
    let rules = device.chain_reader(quantity).map(|reader| reader.rules());
    if let Ok(Threshold::Deviations(deviations, least)) = rules.map(|rules| rules.threshold) {
        let words = format!("{deviations} deviations, at least {} kPa", least / 1e3);
        let source = "standard deviations of the pressure by noise, or this pressure; default";
        facts.push(fact(
            "estimation",
            "contact_threshold",
            text(&words),
            source,
        ));
    }
    let caveat = chain.cell(0).caveat();
    let holds = format!("holds for {}", caveat.unwrap_or("loading and unloading"));
    let source = "law of the cell";
    facts.push(fact("estimation", "stated_deviation", text(&holds), source));
    facts
}

/// What one frame says of the forces on a taxel, with and without all else that moves its signals.
fn of_the_force(device: &ChainDevice<'_>) -> Vec<Fact> {
    let chain = &device.chain;
    let newtons = |value: f64| number(value, "n", "mN", 1e-3);
    let mut facts = Vec::new();
    let nothing = vec![None; super::predict::loads(chain).len()];
    for (at, share) in [("rest", 0.0), ("half_scale", 0.5)] {
        let mut values = nothing.clone();
        values[2] = Some(LoadValue::Number(share * chain.full_scale));
        let found = device.of_forces(&Load::of(&values), &InformationOptions::default());
        let Some(covariance) = found.covariance() else {
            let words = "one frame does not tell the forces";
            let name = format!("deviation_of_a_force_at_{at}");
            facts.push(fact(
                "estimation",
                name,
                text(&words),
                "slopes of the chain",
            ));
            continue;
        };
        let source = "Cramer-Rao bound, all else that moves the signals unknown";
        for (index, unknown) in found
            .unknowns
            .iter()
            .enumerate()
            .filter(|(_, one)| !one.beside)
        {
            let name = format!("deviation_of_{}_at_{at}", unknown.name);
            let value = newtons(covariance[index][index].sqrt());
            facts.push(fact("estimation", name, value, source));
        }
    }
    let source = "full_scale of the element";
    facts.push(fact(
        "estimation",
        "full_scale",
        newtons(chain.full_scale),
        source,
    ));
    let least = newtons(CONTACT_SHARE * chain.full_scale);
    let source =
        "or 6 standard deviations of the pressing force by noise, if that is more; default";
    facts.push(fact("estimation", "least_contact_force", least, source));
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
