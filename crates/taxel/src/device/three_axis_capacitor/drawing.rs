//! Drawing of a three-axis array.

use super::ThreeAxisArray;
use crate::drawing::{DimensionLine, Drawing, Label, Outline, Part, Shape, View};

/// Thickness at which the rigid base is drawn, as a share of the stack above
/// it: the base has no thickness in the model.
const BASE_SHARE: f64 = 0.08;

pub(super) fn drawing(array: &ThreeAxisArray<'_>) -> Drawing {
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![from_above(array), section(array), gap(array)],
    }
}

fn square(part: Part, [x, y]: [f64; 2], size: [f64; 2]) -> Shape {
    let half = size.map(|side| 0.5 * side);
    Shape::rectangle(part, [x - half[0], y - half[1]], [x + half[0], y + half[1]])
}

/// All units with their electrodes and bumps; lengths at the first one.
fn from_above(array: &ThreeAxisArray<'_>) -> View {
    let (element, layout) = (array.element, array.layout());
    let (outline, plates) = (&element.outline, &element.plates);
    let arm = 0.5 * element.suspension.centre_distance;
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        ..View::default()
    };
    for taxel in 0..layout.taxels() {
        let [x, y] = layout.flat_position(taxel);
        let unit = [outline.unit_side; 2];
        view.shapes.push(square(Part::Elastomer, [x, y], unit));
        for (sx, sy) in [(-1.0, 1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
            let centre = [x + sx * arm, y + sy * arm];
            view.shapes
                .push(square(Part::Electrode, centre, plates.electrode));
        }
        view.shapes
            .push(square(Part::Bump, [x, y], [outline.bump_top; 2]));
        view.shapes
            .push(square(Part::Taxel, [x, y], [outline.bump_base; 2]));
    }
    let corner = |taxel: usize| layout.flat_position(taxel);
    let [x, y] = corner(0);
    let half = 0.5 * outline.unit_side;
    view.dimensions.push(DimensionLine::new(
        [x - half, y + half],
        [x + half, y + half],
        14.0,
        "unit",
    ));
    let last = corner(layout.taxels() - 1);
    if layout.columns > 1 {
        let low = last[1] - half;
        view.dimensions.push(DimensionLine::new(
            [x, low],
            [x + layout.pitch[0], low],
            -14.0,
            "pitch",
        ));
        view.dimensions.push(DimensionLine::new(
            [x, low],
            [last[0], low],
            -38.0,
            "centres",
        ));
    }
    if layout.rows > 1 {
        let right = last[0] + half;
        view.dimensions.push(DimensionLine::new(
            [right, y],
            [right, y - layout.pitch[1]],
            14.0,
            "pitch",
        ));
    }
    view
}

/// One unit cut through two of its capacitors.
fn section(array: &ThreeAxisArray<'_>) -> View {
    let element = array.element;
    let (outline, plates) = (&element.outline, &element.plates);
    let half = 0.5 * outline.unit_side;
    let air = plates.air_gap[0];
    let insulation_top = plates.insulation;
    let layer = insulation_top + air;
    let bump_layer = layer + outline.electrode_layer;
    let bump = bump_layer + outline.bump_layer;
    let top = bump + outline.bump_height;
    let band = |part, low: f64, high: f64| Shape::rectangle(part, [-half, low], [half, high]);
    let mut shapes = vec![
        band(Part::Base, -BASE_SHARE * top, 0.0),
        band(Part::Insulation, 0.0, insulation_top),
        band(Part::Air, insulation_top, layer),
        band(Part::Elastomer, layer, bump),
    ];
    let wall = 0.5 * outline.wall_width;
    shapes.push(Shape::rectangle(
        Part::Elastomer,
        [-wall, insulation_top],
        [wall, layer],
    ));
    for side in [-1.0, 1.0] {
        let centre = 0.5 * side * element.suspension.centre_distance;
        let reach = 0.5 * plates.electrode[0];
        let thick = outline.electrode_thickness;
        for [low, high] in [[layer, layer + thick], [-thick, 0.0]] {
            shapes.push(Shape::rectangle(
                Part::Electrode,
                [centre - reach, low],
                [centre + reach, high],
            ));
        }
    }
    let (base, tip) = (0.5 * outline.bump_base, 0.5 * outline.bump_top);
    shapes.push(Shape {
        part: Part::Bump,
        outline: Outline::Polygon(vec![[-base, bump], [base, bump], [tip, top], [-tip, top]]),
    });
    let arm = 0.5 * element.suspension.centre_distance;
    View {
        title: String::from("one unit, cut through the centres of two capacitors"),
        shapes,
        dimensions: vec![
            DimensionLine::new([-tip, top], [tip, top], 12.0, "bump top"),
            DimensionLine::new([half, bump], [half, top], 14.0, "bump"),
            DimensionLine::new([half, bump_layer], [half, bump], 14.0, "bump layer"),
            DimensionLine::new([half, layer], [half, bump_layer], 14.0, "electrode layer"),
            DimensionLine::new([-half, layer], [-half, top], -14.0, "lever"),
            DimensionLine::new(
                [-arm, -BASE_SHARE * top],
                [arm, -BASE_SHARE * top],
                -12.0,
                "centres",
            ),
            DimensionLine::new(
                [-half, -BASE_SHARE * top],
                [half, -BASE_SHARE * top],
                -34.0,
                "unit",
            ),
        ],
        labels: vec![Label {
            at: [0.0, 0.5 * (bump + top)],
            text: String::from("bump"),
        }],
    }
}

/// The edge of one capacitor, enlarged until its gap is seen.
fn gap(array: &ThreeAxisArray<'_>) -> View {
    let (outline, plates) = (&array.element.outline, &array.element.plates);
    let (insulation, air) = (plates.insulation, plates.air_gap[0]);
    let thick = outline.electrode_thickness;
    let wide = 3.0 * (2.0 * thick + insulation + air);
    let band =
        |part, low: f64, high: f64, reach: f64| Shape::rectangle(part, [0.0, low], [reach, high]);
    let layer = insulation + air;
    let top = layer + 1.5 * thick;
    let edge = 0.7 * wide;
    View {
        title: String::from("the gap at the edge of a capacitor, enlarged"),
        shapes: vec![
            band(Part::Base, -1.5 * thick, 0.0, wide),
            band(Part::Electrode, -thick, 0.0, edge),
            band(Part::Insulation, 0.0, insulation, wide),
            band(Part::Air, insulation, layer, wide),
            band(Part::Elastomer, layer, top, wide),
            band(Part::Electrode, layer, layer + thick, edge),
        ],
        dimensions: vec![
            DimensionLine::new([wide, insulation], [wide, layer], 14.0, "air gap")
                .made_within(array.element.fabrication.air_gap_deviation),
            DimensionLine::new([0.0, 0.0], [0.0, insulation], -14.0, "insulation"),
            DimensionLine::new([wide, layer], [wide, layer + thick], 14.0, "electrode"),
        ],
        labels: Vec::new(),
    }
}
