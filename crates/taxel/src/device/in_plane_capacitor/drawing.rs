//! Drawing of an in-plane sensor.

use super::InPlaneArray;
use crate::drawing::{DimensionLine, Drawing, Label, Part, Shape, View};

/// Thickness at which the rigid base is drawn, as a share of the layer: the
/// base has no thickness in the model.
const BASE_SHARE: f64 = 0.08;

pub(super) fn drawing(array: &InPlaneArray<'_>) -> Drawing {
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![from_above(array), section(array), gap(array)],
    }
}

fn centred(part: Part, [x, y]: [f64; 2], size: [f64; 2]) -> Shape {
    let half = size.map(|side| 0.5 * side);
    Shape::rectangle(part, [x - half[0], y - half[1]], [x + half[0], y + half[1]])
}

/// All sensors; lengths at the first one.
fn from_above(array: &InPlaneArray<'_>) -> View {
    let (element, layout) = (array.element, array.layout());
    let electrodes = &element.electrodes;
    let loaded = [
        2.0 * element.layer.contact_half_length,
        element.layer.contact_depth,
    ];
    let long = electrodes.depth.max(loaded[1]);
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        ..View::default()
    };
    for taxel in 0..layout.taxels() {
        let [x, y] = layout.flat_position(taxel);
        let body = [element.layer_width, long];
        view.shapes.push(centred(Part::Elastomer, [x, y], body));
        for side in [-1.0, 1.0] {
            let centre = x + side * 0.5 * (electrodes.gap + electrodes.width);
            let bar = [electrodes.width, electrodes.depth];
            view.shapes.push(centred(Part::Electrode, [centre, y], bar));
        }
        view.shapes.push(centred(Part::Taxel, [x, y], loaded));
    }
    let [x, y] = layout.flat_position(0);
    let (left, right) = (x - 0.5 * element.layer_width, x + 0.5 * element.layer_width);
    let (low, high) = (y - 0.5 * long, y + 0.5 * long);
    view.dimensions = vec![
        DimensionLine::new([left, high], [right, high], 14.0, "layer"),
        DimensionLine::new(
            [x - 0.5 * loaded[0], low],
            [x + 0.5 * loaded[0], low],
            -14.0,
            "loaded",
        ),
        DimensionLine::new(
            [right, y - 0.5 * electrodes.depth],
            [right, y + 0.5 * electrodes.depth],
            14.0,
            "electrodes",
        ),
    ];
    view
}

/// One sensor cut across its gap.
fn section(array: &InPlaneArray<'_>) -> View {
    let element = array.element;
    let electrodes = &element.electrodes;
    let (half, top) = (0.5 * element.layer_width, element.layer.thickness);
    let base = -BASE_SHARE * top;
    let (low, high) = (electrodes.height, electrodes.height + electrodes.thickness);
    let near = 0.5 * electrodes.gap;
    let far = near + electrodes.width;
    let loaded = element.layer.contact_half_length;
    View {
        title: String::from("one sensor, cut across its gap"),
        shapes: vec![
            Shape::rectangle(Part::Base, [-half, base], [half, 0.0]),
            Shape::rectangle(Part::Elastomer, [-half, 0.0], [half, top]),
            Shape::rectangle(Part::Electrode, [-far, low], [-near, high]),
            Shape::rectangle(Part::Electrode, [near, low], [far, high]),
        ],
        dimensions: vec![
            DimensionLine::new([-half, 0.0], [-half, top], -14.0, "H"),
            DimensionLine::new([half, 0.0], [half, low], 14.0, "S"),
            DimensionLine::new([half, low], [half, high], 14.0, "T"),
            DimensionLine::new([near, base], [far, base], -12.0, "b"),
            DimensionLine::new([-loaded, top], [loaded, top], 14.0, "loaded 2 L"),
        ],
        labels: vec![Label {
            at: [0.0, 0.5 * low],
            text: String::from("soft layer"),
        }],
    }
}

/// The facing sides of the electrodes, enlarged until the gap is seen.
fn gap(array: &InPlaneArray<'_>) -> View {
    let electrodes = &array.element.electrodes;
    let near = 0.5 * electrodes.gap;
    let wide = near + electrodes.thickness.min(electrodes.width);
    let thick = electrodes.thickness;
    View {
        title: String::from("the gap, enlarged"),
        shapes: vec![
            Shape::rectangle(Part::Elastomer, [-wide, -0.4 * thick], [wide, 1.4 * thick]),
            Shape::rectangle(Part::Electrode, [-wide, 0.0], [-near, thick]),
            Shape::rectangle(Part::Electrode, [near, 0.0], [wide, thick]),
        ],
        dimensions: vec![
            DimensionLine::new([-near, thick], [near, thick], 14.0, "D")
                .made_within(array.element.fabrication.gap_deviation),
            DimensionLine::new([wide, 0.0], [wide, thick], 14.0, "T"),
        ],
        labels: Vec::new(),
    }
}
