//! The three-axis capacitor (P2): electrode layers, a spacer with four cavities, bumps.

use taxel::sensor::ThreeAxisCapacitor;

use super::array::{Array, FLOOR, own_choice};
use super::parts::Parts;
use crate::bill::Layer;
use crate::mask::{Mask, Mould};
use crate::rectangle::{Rectangle, complement, line_at, lines};
use crate::relief::Relief;

/// Angle of the walls that potassium hydroxide etches into (100) silicon, atan √2, degrees.
const ETCHED: f64 = 54.735_610_317_245_35;
/// Farthest that a drawn wall may be from it, degrees: the rounding of printed lengths.
const ANGLE_SLACK: f64 = 0.1;
/// Signs of the four capacitors 11, 12, 21, 22 along x and y.
const CORNERS: [[f64; 2]; 4] = [[-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];

pub(crate) fn parts(array: &Array, element: &ThreeAxisCapacitor) -> Parts {
    let (plates, outline) = (&element.plates, &element.outline);
    let (taxels, field) = (array.taxels(), array.field());
    let arm = 0.5 * element.suspension.centre_distance;
    let four = |arm: f64, size: [f64; 2]| -> Vec<Rectangle> {
        let each = CORNERS.map(|sign| array.each(sign.map(|side| side * arm), size));
        each.into_iter().flatten().collect()
    };
    let electrodes = four(arm, plates.electrode);
    let cavity = 0.5 * (outline.unit_side - outline.wall_width);
    let cavities = four(0.5 * (cavity + outline.wall_width), [cavity; 2]);
    let squares = |side: f64| array.each([0.0; 2], [side; 2]).collect::<Vec<_>>();

    let mut missing = vec![
        "leads of the rows and columns, and their crossings".into(),
        "pads and connector".into(),
        "deviation of thicknesses: the file states that of the air gap alone".into(),
    ];
    let mut moulds = Vec::new();
    let rise = 0.5 * (outline.bump_base - outline.bump_top);
    let angle = (outline.bump_height / rise).atan().to_degrees();
    if (angle - ETCHED).abs() <= ANGLE_SLACK {
        moulds.push(bumps(array, element));
        missing.push(own_choice());
    } else {
        missing.push(format!(
            "the mould of the bumps: their walls stand at {angle:.1} degrees, and silicon is etched at {ETCHED:.1}; a height \
             of {:.4} um would fit base and top",
            rise * std::f64::consts::SQRT_2 * 1e6
        ));
    }
    let masks = [
        ("lower-electrodes", electrodes.clone()),
        ("walls", complement(&field, &cavities)),
        ("upper-electrodes", electrodes),
        ("bump-base", squares(outline.bump_base)),
        ("bump-top", squares(outline.bump_top)),
    ];
    Parts {
        masks: masks
            .into_iter()
            .map(|(name, figures)| Mask { name, figures })
            .collect(),
        moulds,
        layers: layers(element, taxels, &field, cavity),
        missing,
    }
}

fn layers(
    element: &ThreeAxisCapacitor,
    taxels: usize,
    field: &Rectangle,
    cavity: f64,
) -> Vec<Layer> {
    let (plates, outline) = (&element.plates, &element.outline);
    let (sheet, units) = (field.area(), taxels as f64);
    let metal = 4.0 * units * plates.electrode[0] * plates.electrode[1];
    let open = 4.0 * units * cavity * cavity;
    let air = plates.air_gap.iter().sum::<f64>() / 4.0;
    let spread = element.fabrication.air_gap_deviation;
    let soft = "elastomer";
    let electrodes = || {
        Layer::flat(
            "electrodes",
            "conductor",
            outline.electrode_thickness,
            (4 * taxels, metal),
            "plates.electrode, outline.electrode_thickness",
        )
    };
    let carrier = |part| {
        let layer = Layer::flat(
            part,
            soft,
            outline.electrode_layer,
            (1, sheet),
            "array, outline.electrode_layer",
        );
        Layer {
            volume: layer.volume - metal * outline.electrode_thickness,
            ..layer
        }
    };
    let (base, top) = (outline.bump_base, outline.bump_top);
    let frustum = outline.bump_height / 3.0 * (base * base + base * top + top * top);
    let bumps = Layer {
        volume: units * frustum,
        ..Layer::flat(
            "bumps",
            soft,
            outline.bump_height,
            (taxels, units * base * base),
            "outline.bump_base, outline.bump_top, outline.bump_height",
        )
    };
    vec![
        carrier("lower electrode layer"),
        electrodes(),
        Layer::flat(
            "insulation",
            format!(
                "insulation, relative permittivity {}",
                plates.insulation_permittivity
            ),
            plates.insulation,
            (1, sheet),
            "array, plates.insulation",
        ),
        Layer::flat(
            "spacer walls",
            soft,
            air,
            (1, sheet - open),
            "outline.unit_side, outline.wall_width, plates.air_gap",
        )
        .made_within(spread),
        Layer::flat(
            "cavities",
            "air",
            air,
            (4 * taxels, open),
            "outline.unit_side, outline.wall_width, plates.air_gap",
        )
        .made_within(spread),
        electrodes(),
        carrier("upper electrode layer"),
        Layer::flat(
            "bump layer",
            soft,
            outline.bump_layer,
            (1, sheet),
            "array, outline.bump_layer",
        ),
        bumps,
    ]
}

/// A wafer with the pits of the bumps.
fn bumps(array: &Array, element: &ThreeAxisCapacitor) -> Mould {
    let outline = &element.outline;
    let field = array.field();
    let high = FLOOR + outline.bump_height;
    let [rows, columns] = array.places();
    // Lines at the edges of the field and at those of each base and top.
    let along = |places: &[f64], axis: usize| {
        let halves = [
            -outline.bump_base,
            -outline.bump_top,
            outline.bump_top,
            outline.bump_base,
        ];
        let edges = places
            .iter()
            .flat_map(|place| halves.map(|side| place + 0.5 * side));
        lines(edges.chain([field.low[axis], field.high[axis]]).collect())
    };
    let (xs, ys) = (along(&columns, 0), along(&rows, 1));
    let tops = |lines: &[f64], places: &[f64]| {
        let mut top = vec![false; lines.len()];
        for place in places {
            for side in [-outline.bump_top, outline.bump_top] {
                top[line_at(lines, place + 0.5 * side)] = true;
            }
        }
        top
    };
    let (top_x, top_y) = (tops(&xs, &columns), tops(&ys, &rows));
    let relief = Relief::of_corners(
        xs,
        ys,
        |i, j| if top_x[i] && top_y[j] { FLOOR } else { high },
    );
    Mould {
        name: "mould-bumps",
        about: "pits of the bumps, as etched into silicon".into(),
        relief,
    }
}
