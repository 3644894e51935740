//! Crossing liquid-metal microchannels (P4): two layers of channels, each cast on a master.

use taxel::mechanics::SectionShape;
use taxel::sensor::{LayerDescription, Microchannel};

use super::array::{Array, FLOOR, frame, own_choice, walled};
use super::parts::Parts;
use crate::bill::Layer;
use crate::mask::{Mask, Mould};
use crate::rectangle::Rectangle;
use crate::relief::Relief;

pub(crate) fn parts(array: &Array, element: &Microchannel) -> Parts {
    let field = array.field();
    let (width, height) = (element.section.width, element.section.height);
    let [rows, columns] = array.places();
    let along_x = rows.iter().map(|y| Rectangle {
        low: [field.low[0], y - 0.5 * width],
        high: [field.high[0], y + 0.5 * width],
    });
    let along_y = columns.iter().map(|x| Rectangle {
        low: [x - 0.5 * width, field.low[1]],
        high: [x + 0.5 * width, field.high[1]],
    });
    let (along_x, along_y): (Vec<_>, Vec<_>) = (along_x.collect(), along_y.collect());
    let rest = |layer: &LayerDescription, drawn: f64, name: &str| {
        format!(
            "the rest of each channel of the {name}: {:.3} of its {:.3} mm lie over the array and are drawn",
            drawn * 1e3,
            layer.length * 1e3
        )
    };
    let [long_x, long_y] = field.size();
    let taxels = array.each([0.0; 2], [width; 2]).collect();
    let mut missing = vec![
        rest(&element.rows, long_x, "rows"),
        rest(&element.columns, long_y, "columns"),
        "ports, needles and leads".into(),
        "deviation of thicknesses: the file states that of the height of the channels alone".into(),
    ];
    if element.section.shape == SectionShape::Ellipse {
        missing.push(
            "how an elliptic channel is cast: the ridges are rectangles of its width and height"
                .into(),
        );
    }
    missing.push(own_choice());
    Parts {
        missing,
        moulds: vec![
            master(
                "master-rows",
                "ridges of the channels along x",
                &field,
                &along_x,
                height,
            ),
            master(
                "master-columns",
                "ridges of the channels along y",
                &field,
                &along_y,
                height,
            ),
            Mould {
                name: "frame-sheet",
                about: "walls of the whole sheet".into(),
                relief: frame(&field, element.thickness()),
            },
        ],
        layers: layers(element, &field, [along_x.len(), along_y.len()]),
        masks: vec![
            Mask {
                name: "row-channels",
                figures: along_x,
            },
            Mask {
                name: "column-channels",
                figures: along_y,
            },
            Mask {
                name: "taxels",
                figures: taxels,
            },
        ],
    }
}

/// A plate with ridges where channels are to be.
fn master(
    name: &'static str,
    about: &str,
    field: &Rectangle,
    channels: &[Rectangle],
    height: f64,
) -> Mould {
    let relief = Relief::level(&walled(field), FLOOR, &[(channels, FLOOR + height)]);
    Mould {
        name,
        about: format!("master: {about}"),
        relief,
    }
}

/// From the base up: solid and channels in turn; the layer with the thicker roof lies lower.
fn layers(element: &Microchannel, field: &Rectangle, channels: [usize; 2]) -> Vec<Layer> {
    let (width, height) = (element.section.width, element.section.height);
    let [long_x, long_y] = field.size();
    let stack = element.thickness();
    let soft = "elastomer (element.material)";
    let named = [
        ("channels of the rows", &element.rows, long_x, channels[0]),
        (
            "channels of the columns",
            &element.columns,
            long_y,
            channels[1],
        ),
    ];
    let mut named: Vec<_> = named.into_iter().collect();
    named.sort_by(|a, b| b.1.roof.total_cmp(&a.1.roof));
    let mut layers = Vec::new();
    let mut reached = 0.0;
    for (part, layer, long, count) in named {
        let floor = stack - layer.roof - height;
        if floor > reached {
            layers.push(Layer::flat(
                "solid below channels",
                soft,
                floor - reached,
                (1, field.area()),
                "array, base, section.height, rows.roof, columns.roof",
            ));
        }
        let whole = count as f64 * width * layer.length;
        layers.push(
            Layer::flat(
                part,
                "liquid metal, in their whole length",
                height,
                (count, whole),
                "section.width, section.height, rows.length, columns.length",
            )
            .made_within(element.fabrication.height_deviation),
        );
        let beside = field.area() - count as f64 * width * long;
        layers.push(Layer::flat(
            "solid beside channels",
            soft,
            height,
            (1, beside),
            "array, section.width, section.height",
        ));
        reached = floor + height;
    }
    layers.push(Layer::flat(
        "roof",
        soft,
        stack - reached,
        (1, field.area()),
        "rows.roof, columns.roof",
    ));
    layers
}
