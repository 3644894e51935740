//! Drawing of an array of cells: where they are, and the views of its parts.

use super::ChainDevice;
use crate::drawing::{Dimension, Drawing, Label, Part, Shape, View};

pub(super) fn drawing(device: &ChainDevice<'_>) -> Drawing {
    let (chain, layout) = (&device.chain, &device.chain.layout);
    let half = chain.cell(0).area().map(|side| 0.5 * side);
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        ..View::default()
    };
    let cell = |index: usize, part: Part, half: [f64; 2]| {
        let [x, y] = layout.flat_position(index);
        Shape::rectangle(part, [x - half[0], y - half[1]], [x + half[0], y + half[1]])
    };
    let pitch = layout.pitch.map(|pitch| 0.5 * pitch);
    for index in 0..layout.taxels() {
        view.shapes.push(cell(index, Part::Taxel, pitch));
        view.shapes.push(cell(index, Part::Electrode, half));
    }
    let [x, y] = layout.flat_position(0);
    if layout.columns > 1 {
        view.dimensions.push(Dimension::new(
            [x, y],
            [x + layout.pitch[0], y],
            14.0,
            "pitch",
        ));
    }
    if layout.rows > 1 {
        view.dimensions.push(Dimension::new(
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
