//! The in-plane capacitor (P1): two electrodes in a soft layer, cast into a tray with ridges.

use taxel::sensor::InPlaneCapacitor;

use super::array::{Array, FLOOR, own_choice, walled};
use super::parts::Parts;
use crate::bill::Layer;
use crate::mask::{Mask, Mould};
use crate::rectangle::Rectangle;
use crate::relief::Relief;

pub(crate) fn parts(array: &Array, element: &InPlaneCapacitor) -> Parts {
    let (layer, electrodes) = (&element.layer, &element.electrodes);
    let taxels = array.taxels();
    let bar = [electrodes.width, electrodes.depth];
    let offset = 0.5 * (electrodes.gap + electrodes.width);
    let bars: Vec<Rectangle> = array
        .each([-offset, 0.0], bar)
        .zip(array.each([offset, 0.0], bar))
        .flat_map(|(left, right)| [left, right])
        .collect();
    let long = electrodes.depth.max(layer.contact_depth);
    let bodies: Vec<Rectangle> = array.each([0.0; 2], [element.layer_width, long]).collect();
    let tray = tray(element, &bars, &bodies);

    let body = taxels as f64 * element.layer_width * long;
    let metal = 2.0 * taxels as f64 * bar[0] * bar[1];
    let soft = format!("elastomer, E {} kPa", layer.youngs_modulus * 1e-3);
    let top = electrodes.height + electrodes.thickness;
    let layers = vec![
        Layer::flat(
            "layer below the electrodes",
            soft.clone(),
            electrodes.height,
            (taxels, body),
            "layer_width, electrodes.depth, layer.contact_depth, electrodes.height",
        ),
        Layer::flat(
            "electrodes",
            "conductive elastomer",
            electrodes.thickness,
            (2 * taxels, metal),
            "electrodes.width, electrodes.depth, electrodes.thickness",
        ),
        Layer::flat(
            "layer beside the electrodes",
            soft.clone(),
            electrodes.thickness,
            (taxels, body - metal),
            "layer_width, electrodes.width, electrodes.thickness",
        ),
        Layer::flat(
            "layer above the electrodes",
            soft,
            layer.thickness - top,
            (taxels, body),
            "layer.thickness, electrodes.height, electrodes.thickness",
        ),
    ];
    Parts {
        masks: vec![
            Mask {
                name: "electrodes",
                figures: bars,
            },
            Mask {
                name: "layer",
                figures: bodies,
            },
        ],
        moulds: vec![tray],
        layers,
        missing: vec![
            "leads from the electrodes to the board".into(),
            "the recipe of the electrodes: what is filled into the elastomer, and how it is cured".into(),
            "length of the layer along the electrodes: drawn as long as the longer of electrodes and loaded part".into(),
            "deviation of thicknesses: the file states that of the gap alone".into(),
            own_choice(),
        ],
    }
}

/// A tray for all below the upper faces of the electrodes, cast upside down: two ridges leave the
/// grooves of the electrodes and, between them, the wall that is the gap.
fn tray(element: &InPlaneCapacitor, bars: &[Rectangle], bodies: &[Rectangle]) -> Mould {
    let electrodes = &element.electrodes;
    let deep = electrodes.height + electrodes.thickness;
    let bounds = |pick: fn(&Rectangle) -> [f64; 2], choose: fn(f64, f64) -> f64| {
        bodies
            .iter()
            .map(pick)
            .reduce(|a, b| [choose(a[0], b[0]), choose(a[1], b[1])])
            .unwrap_or_default()
    };
    let (low, high) = (
        bounds(|body| body.low, f64::min),
        bounds(|body| body.high, f64::max),
    );
    let relief = Relief::level(
        &walled(&Rectangle { low, high }),
        FLOOR + deep,
        &[(bodies, FLOOR), (bars, FLOOR + electrodes.thickness)],
    );
    Mould {
        name: "mould-tray",
        about: "tray for the layer up to the electrodes, cast upside down, with the ridges of the electrodes".into(),
        relief,
    }
}
