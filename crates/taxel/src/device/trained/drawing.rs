//! Drawing of a body without a model: the area that can be touched.

use super::TrainedArray;
use crate::drawing::{DimensionLine, Drawing, Label, Part, Shape, View};

pub(super) fn drawing(array: &TrainedArray<'_>) -> Drawing {
    let area = array.area();
    let [x, y] = area.half_sides();
    let mut view = View {
        title: String::from("the area that can be touched, from above"),
        shapes: vec![Shape::rectangle(Part::Elastomer, [-x, -y], [x, y])],
        ..View::default()
    };
    view.labels.push(Label {
        at: [0.0, 0.0],
        text: format!("{} channels", array.body.channels().len()),
    });
    view.dimensions
        .push(DimensionLine::new([-x, -y], [x, -y], -14.0, "width"));
    view.dimensions
        .push(DimensionLine::new([x, -y], [x, y], 14.0, "height"));
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![view],
    }
}
