//! Drawing of an array of cells: where they are, and the views of its parts.

use super::ChainDevice;
use crate::drawing::{DimensionLine, Drawing, Label, Part, Shape, View};

/// Side of a drawn taxel over the pitch, where its own size is not known.
const UNKNOWN_SIDE: f64 = 0.8;

pub(super) fn drawing(device: &ChainDevice<'_>) -> Drawing {
    let (chain, layout) = (&device.chain, &device.chain.layout);
    let half = |sides: [f64; 2]| sides.map(|side| 0.5 * side);
    let area = chain.cell(0).area();
    // What is known of a cell is drawn on its whole pitch, else the taxel alone.
    let [of_pitch, own] = match area {
        Some(area) => [half(layout.pitch), half(area)],
        None => [half(layout.pitch.map(|side| UNKNOWN_SIDE * side)); 2],
    };
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        ..View::default()
    };
    let cell = |index: usize, part: Part, half: [f64; 2]| {
        let [x, y] = layout.flat_position(index);
        Shape::rectangle(part, [x - half[0], y - half[1]], [x + half[0], y + half[1]])
    };
    for index in 0..layout.taxels() {
        view.shapes.push(cell(index, Part::Taxel, of_pitch));
        if area.is_some() {
            view.shapes.push(cell(index, Part::Electrode, own));
        }
    }
    let [x, y] = layout.flat_position(0);
    if layout.columns > 1 {
        view.dimensions.push(DimensionLine::new(
            [x, y],
            [x + layout.pitch[0], y],
            14.0,
            "pitch",
        ));
    }
    if layout.rows > 1 {
        view.dimensions.push(DimensionLine::new(
            [x, y - layout.pitch[1]],
            [x, y],
            -14.0,
            "pitch",
        ));
    }
    view.labels.push(Label {
        at: [x, y],
        text: "0, 0".into(),
    });
    let mut views = vec![view];
    views.extend(chain.stages().iter().flat_map(|stage| stage.views()));
    Drawing {
        title: device.sensor.name.clone(),
        views,
    }
}
