//! What can be made from a sensor file.

use taxel::drawing::Drawing;
use taxel::layout::Mount;
use taxel::sensor::{Element, Sensor};

use crate::bill::Layer;
use crate::devices::{self, Array};
use crate::error::Refused;
use crate::mask::{Mask, Mould};
use crate::rectangle::Rectangle;

/// What a workshop gets of one sensor.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name of the sensor.
    pub name: String,
    /// The array from edge to edge, half a pitch round the outer taxels, m; centred at 0, 0.
    pub field: Rectangle,
    /// Masks, in the order of the steps.
    pub masks: Vec<Mask>,
    /// Moulds.
    pub moulds: Vec<Mould>,
    /// The bill of layers, from the base up.
    pub layers: Vec<Layer>,
    /// What the sensor file does not say, and what is therefore not drawn.
    pub missing: Vec<String>,
    /// The dimensioned drawing.
    pub drawing: Drawing,
}

impl Plan {
    /// What can be made from `sensor`, and what its file does not say.
    ///
    /// # Errors
    /// [`Refused::NoDrawing`] for taxels of which the file only says where they are.
    ///
    /// # Example: a body without a drawing
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("force-4x4").unwrap();
    /// assert!(taxel_fabricate::Plan::of(&sensor).is_err());
    /// ```
    pub fn of(sensor: &Sensor) -> Result<Self, Refused> {
        let array = Array {
            layout: sensor.layout(),
        };
        let no_drawing = Refused::NoDrawing {
            element: sensor.element.key(),
        };
        let parts = match &sensor.element {
            Element::InPlaneCapacitor(element) => devices::in_plane::parts(&array, element),
            Element::ThreeAxisCapacitor(element) => devices::three_axis::parts(&array, element),
            Element::Piezoelectric(element) => devices::piezoelectric::parts(&array, element),
            Element::Microchannel(element) => devices::microchannel::parts(&array, element),
            Element::Trained(_)
            | Element::MeasuredForce(_)
            | Element::Cells(_)
            | Element::MagneticSkin(_)
            | Element::Body(_)
            | Element::Own(_) => return Err(no_drawing),
        };
        // A sensor that was read has a device.
        let device = sensor.device().map_err(|_| no_drawing)?;
        let mut missing = parts.missing;
        if matches!(sensor.array.mount, Mount::Cylinder(_)) {
            missing.push("the cylinder: masks and moulds are flat, the drawn lengths lie on the unrolled surface".into());
        }
        missing.push("edges of the sheet beyond the array, and what it is fixed to".into());
        Ok(Self {
            name: sensor.name.clone(),
            field: array.field(),
            masks: parts.masks,
            moulds: parts.moulds,
            layers: parts.layers,
            missing,
            drawing: device.drawing(),
        })
    }
}
