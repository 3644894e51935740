//! Drawing of a piezoelectric array.

use super::PiezoelectricArray;
use crate::drawing::{DimensionLine, Drawing, Label, Part, Shape, View};

/// Thickness at which the stiff base is drawn, as a share of the cover: it has
/// no thickness in the model.
const BASE_SHARE: f64 = 0.12;

pub(super) fn drawing(array: &PiezoelectricArray<'_>) -> Drawing {
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![from_above(array), section(array)],
    }
}

/// All elements with the numbers that the paper gives them.
fn from_above(array: &PiezoelectricArray<'_>) -> View {
    let layout = array.layout();
    let half = 0.5 * array.description.ceramic.side;
    let [px, py] = layout.pitch;
    let reach = [
        0.5 * px * layout.columns as f64,
        0.5 * py * layout.rows as f64,
    ];
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        shapes: vec![Shape::rectangle(
            Part::Elastomer,
            [-reach[0], -reach[1]],
            reach,
        )],
        ..View::default()
    };
    for taxel in 0..layout.taxels() {
        let [x, y] = layout.flat_position(taxel);
        view.shapes.push(Shape::rectangle(
            Part::Ceramic,
            [x - half, y - half],
            [x + half, y + half],
        ));
        view.labels.push(Label {
            at: [x, y],
            text: (taxel + 1).to_string(),
        });
    }
    let [x, y] = layout.flat_position(0);
    view.dimensions.push(DimensionLine::new(
        [x - half, reach[1]],
        [x + half, reach[1]],
        14.0,
        "element",
    ));
    if layout.columns > 1 {
        let low = -reach[1];
        view.dimensions
            .push(DimensionLine::new([x, low], [x + px, low], -14.0, "pitch"));
    }
    if layout.rows > 1 {
        let right = reach[0];
        view.dimensions.push(DimensionLine::new(
            [right, y],
            [right, y - py],
            14.0,
            "pitch",
        ));
    }
    view
}

/// Two neighbours of the first row without load, cut through their centres.
fn section(array: &PiezoelectricArray<'_>) -> View {
    let (ceramic, cover) = (&array.description.ceramic, &array.description.cover);
    let layout = array.layout();
    let shown = layout.columns.min(2);
    let pitch = layout.pitch[0];
    let reach = 0.5 * pitch * shown as f64;
    let above = array.description.depth();
    let below = cover.thickness - above;
    let top = below + ceramic.thickness + above;
    let half = 0.5 * ceramic.side;
    let mut shapes = vec![
        Shape::rectangle(Part::Base, [-reach, -BASE_SHARE * top], [reach, 0.0]),
        Shape::rectangle(Part::Elastomer, [-reach, 0.0], [reach, top]),
    ];
    let centre = |i: usize| (i as f64 - 0.5 * (shown as f64 - 1.0)) * pitch;
    for i in 0..shown {
        shapes.push(Shape::rectangle(
            Part::Ceramic,
            [centre(i) - half, below],
            [centre(i) + half, below + ceramic.thickness],
        ));
    }
    let last = centre(shown - 1);
    let mut dimensions = vec![
        DimensionLine::new(
            [reach, below + ceramic.thickness],
            [reach, top],
            14.0,
            "above",
        ),
        DimensionLine::new(
            [-reach, below],
            [-reach, below + ceramic.thickness],
            -14.0,
            "ceramic",
        ),
        DimensionLine::new([last - half, top], [last + half, top], 12.0, "element"),
    ];
    if below > 0.0 {
        dimensions.push(DimensionLine::new(
            [reach, 0.0],
            [reach, below],
            14.0,
            "below",
        ));
    }
    if shown > 1 {
        let level = -BASE_SHARE * top;
        dimensions.push(DimensionLine::new(
            [centre(0), level],
            [last, level],
            -12.0,
            "pitch",
        ));
    }
    View {
        title: String::from("without load, cut through the centres of two elements of a row"),
        shapes,
        dimensions,
        labels: Vec::new(),
    }
}
