//! Drawing of taxels whose board gives forces: where they are.

use super::MeasuredForceArray;
use crate::drawing::{Dimension, Drawing, Label, Part, Shape, View};

/// Side of a drawn taxel over the pitch: its own size is not known.
const SIDE: f64 = 0.8;

pub(super) fn drawing(array: &MeasuredForceArray<'_>) -> Drawing {
    let layout = array.layout();
    let half = layout.pitch.map(|pitch| 0.5 * SIDE * pitch);
    let mut view = View {
        title: String::from("from above (developed where the array is bent)"),
        ..View::default()
    };
    for taxel in 0..layout.taxels() {
        let [x, y] = layout.flat_position(taxel);
        let corners = [[x - half[0], y - half[1]], [x + half[0], y + half[1]]];
        let [low, high] = corners;
        view.shapes.push(Shape::rectangle(Part::Taxel, low, high));
    }
    let [x, y] = layout.flat_position(0);
    if layout.columns > 1 {
        let to = [x + layout.pitch[0], y];
        let pitch = Dimension::new([x, y], to, 14.0, "pitch");
        view.dimensions.push(pitch);
    }
    if layout.rows > 1 {
        let to = [x, y - layout.pitch[1]];
        let pitch = Dimension::new(to, [x, y], -14.0, "pitch");
        view.dimensions.push(pitch);
    }
    view.labels.push(Label {
        at: [x, y],
        text: "0, 0".into(),
    });
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![view],
    }
}
