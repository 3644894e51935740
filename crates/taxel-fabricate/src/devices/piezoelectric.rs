//! Piezoelectric plates in silicone (P3): plates, and frames into which the cover is poured.

use taxel::sensor::Piezoelectric;

use super::array::{Array, frame, own_choice};
use super::parts::Parts;
use crate::bill::Layer;
use crate::mask::{Mask, Mould};

pub(crate) fn parts(array: &Array, element: &Piezoelectric) -> Parts {
    let (ceramic, cover) = (&element.ceramic, &element.cover);
    let (taxels, field) = (array.taxels(), array.field());
    let above = element.depth();
    let below = cover.thickness - above;
    let plates: Vec<_> = array.each([0.0; 2], [ceramic.side; 2]).collect();
    let plate = taxels as f64 * ceramic.side * ceramic.side;
    let soft = format!("silicone, E {} kPa", cover.modulus * 1e-3);
    let mut parts = Parts {
        masks: vec![
            Mask {
                name: "plates",
                figures: plates,
            },
            Mask {
                name: "film-cut",
                figures: vec![field],
            },
        ],
        missing: vec![
            "wiring: electrodes on the film, leads, connector".into(),
            "the film that carries the plates: its thickness and material; its cut is drawn along the edge of the array".into(),
            "deviation of thicknesses: the file states that of the signal alone".into(),
            own_choice(),
        ],
        ..Parts::default()
    };
    if below > 0.0 {
        parts.moulds.push(Mould {
            name: "frame-below",
            about: "frame for the silicone below the plates".into(),
            relief: frame(&field, below),
        });
        parts.layers.push(Layer::flat(
            "silicone below the plates",
            soft.clone(),
            below,
            (1, field.area()),
            "array, cover.thickness, cover.share_above",
        ));
    }
    parts.layers.push(Layer::flat(
        "plates",
        "piezoelectric ceramic",
        ceramic.thickness,
        (taxels, plate),
        "ceramic.side, ceramic.thickness",
    ));
    parts.layers.push(Layer::flat(
        "silicone beside the plates",
        soft.clone(),
        ceramic.thickness,
        (1, field.area() - plate),
        "array, ceramic.side, ceramic.thickness",
    ));
    if above > 0.0 {
        parts.moulds.push(Mould {
            name: "frame-above",
            about: "frame for the plates and the silicone above them".into(),
            relief: frame(&field, ceramic.thickness + above),
        });
        parts.layers.push(Layer::flat(
            "silicone above the plates",
            soft,
            above,
            (1, field.area()),
            "array, cover.thickness, cover.share_above",
        ));
    }
    parts
}
