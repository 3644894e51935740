//! Drawing of crossing microchannels.

use super::MicrochannelArray;
use crate::drawing::{DimensionLine, Drawing, Label, Outline, Part, Shape, View};
use crate::mechanics::SectionShape;

/// Thickness at which what the sheet is fixed to is drawn, as a share of the
/// sheet.
const SUPPORT_SHARE: f64 = 0.1;
/// Corners of the outline of a round channel.
const AROUND: u32 = 48;

pub(super) fn drawing(array: &MicrochannelArray<'_>) -> Drawing {
    Drawing {
        title: array.sensor.name.clone(),
        views: vec![from_above(array), section(array)],
    }
}

/// Both layers with the taxels where they cross.
fn from_above(array: &MicrochannelArray<'_>) -> View {
    let (layout, width) = (array.layout(), array.element.section.width);
    let [pitch_x, pitch_y] = layout.pitch;
    let (first, last) = (
        layout.flat_position(0),
        layout.flat_position(layout.taxels() - 1),
    );
    // Half a pitch round the outer channels.
    let low = [first[0] - 0.5 * pitch_x, last[1] - 0.5 * pitch_y];
    let high = [last[0] + 0.5 * pitch_x, first[1] + 0.5 * pitch_y];
    let mut view = View {
        title: String::from("from above: rows along x, columns along y"),
        shapes: vec![Shape::rectangle(Part::Elastomer, low, high)],
        ..View::default()
    };
    let rows = (0..layout.rows).map(|r| layout.flat_position(r * layout.columns)[1]);
    let rows = rows.map(|y| ([low[0], y - 0.5 * width], [high[0], y + 0.5 * width]));
    let columns = (0..layout.columns).map(|c| layout.flat_position(c)[0]);
    let columns = columns.map(|x| ([x - 0.5 * width, low[1]], [x + 0.5 * width, high[1]]));
    for (channel, (from, to)) in rows.chain(columns).enumerate() {
        view.shapes
            .push(Shape::rectangle(Part::LiquidMetal, from, to));
        let at = if channel < layout.rows {
            [low[0] + 0.08 * pitch_x, 0.5 * (from[1] + to[1])]
        } else {
            [0.5 * (from[0] + to[0]), high[1] - 0.08 * pitch_y]
        };
        view.labels.push(Label {
            at,
            text: channel.to_string(),
        });
    }
    for taxel in 0..layout.taxels() {
        let [x, y] = layout.flat_position(taxel);
        let half = 0.5 * width;
        view.shapes.push(Shape::rectangle(
            Part::Taxel,
            [x - half, y - half],
            [x + half, y + half],
        ));
    }
    if layout.columns > 1 {
        let from = [first[0], low[1]];
        let to = [first[0] + pitch_x, low[1]];
        view.dimensions
            .push(DimensionLine::new(from, to, -14.0, "pitch"));
    }
    if layout.rows > 1 {
        let from = [high[0], first[1]];
        let to = [high[0], first[1] - pitch_y];
        view.dimensions
            .push(DimensionLine::new(from, to, 14.0, "pitch"));
    }
    view
}

/// The stack cut across the columns, along the middle of a row.
fn section(array: &MicrochannelArray<'_>) -> View {
    let element = array.element;
    let pitch = array.sensor.array.pitch[0];
    let count = array.sensor.array.columns.min(2);
    let reach = pitch * count as f64;
    let thickness = element.thickness();
    let (height, width) = (element.section.height, element.section.width);
    let top_of = |roof: f64| thickness - roof;
    let band = |part, low: f64, high: f64| Shape::rectangle(part, [0.0, low], [reach, high]);
    let mut shapes = vec![
        band(Part::Base, -SUPPORT_SHARE * thickness, 0.0),
        band(Part::Elastomer, 0.0, thickness),
    ];
    let row = top_of(element.rows.roof);
    shapes.push(band(Part::LiquidMetal, row - height, row));
    let column = top_of(element.columns.roof);
    for index in 0..count {
        let centre = (index as f64 + 0.5) * pitch;
        shapes.push(channel(
            element.section.shape,
            [width, height],
            [centre, column],
        ));
    }
    let left = 0.5 * (pitch - width);
    View {
        title: String::from("cut along the middle of a row"),
        shapes,
        dimensions: vec![
            DimensionLine::new([reach, 0.0], [reach, thickness], 130.0, "stack"),
            DimensionLine::new([0.0, column], [0.0, thickness], -14.0, "column roof"),
            DimensionLine::new([reach, row], [reach, thickness], 14.0, "row roof"),
            DimensionLine::new([left, thickness], [left + width, thickness], 14.0, "width"),
        ],
        labels: vec![Label {
            at: [0.5 * reach, 0.5 * element.base],
            text: DimensionLine::new([0.0, 0.0], [0.0, height], 0.0, "channels, high")
                .made_within(element.fabrication.height_deviation)
                .text,
        }],
    }
}

/// A channel of this width and height, m, cut across, with the middle of its roof at `top`.
fn channel(shape: SectionShape, [width, height]: [f64; 2], [x, y]: [f64; 2]) -> Shape {
    match shape {
        SectionShape::Rectangle => Shape::rectangle(
            Part::LiquidMetal,
            [x - 0.5 * width, y - height],
            [x + 0.5 * width, y],
        ),
        SectionShape::Ellipse => {
            let corner = |number: u32| {
                let angle = std::f64::consts::TAU * f64::from(number) / f64::from(AROUND);
                [
                    x + 0.5 * width * angle.cos(),
                    y + 0.5 * height * (angle.sin() - 1.0),
                ]
            };
            Shape {
                part: Part::LiquidMetal,
                outline: Outline::Polygon((0..AROUND).map(corner).collect()),
            }
        }
    }
}
