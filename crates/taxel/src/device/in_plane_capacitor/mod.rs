//! The array of in-plane capacitive sensors (P1).

mod check;
mod drawing;
mod facts;
mod predict;
mod simulated;

use super::{Device, fits};
use crate::acquisition::{Simulated, Stream};
use crate::calibration::InPlaneCalibration;
use crate::drawing::Drawing;
use crate::electronics::FrontEnd;
use crate::estimation::{FrameError, InPlaneReader, InPlaneReaderError, ObserverOptions, Reader};
use crate::information::{Information, InformationOptions, NoInformation, Unknown};
use crate::layout::Layout;
use crate::predict::{Load, LoadColumn, Predictor};
use crate::quantity::FORCE;
use crate::sensor::{Broken, InPlaneCapacitor, Sensor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::{InPlaneError, InPlaneModel};

pub use predict::{InPlaneLoadState, InPlanePrediction, InPlanePredictor};

/// An array of in-plane sensors with its board.
#[derive(Debug, Clone)]
pub struct InPlaneArray<'a> {
    sensor: &'a Sensor,
    /// Element of one taxel.
    pub element: &'a InPlaneCapacitor,
    /// The board.
    pub board: FrontEnd,
}

impl<'a> InPlaneArray<'a> {
    /// `None` when the board takes no capacitance.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a InPlaneCapacitor) -> Option<Self> {
        let array = &sensor.array;
        Some(Self {
            sensor,
            element,
            board: FrontEnd::of_single(&sensor.electronics, array.rows, array.columns)?,
        })
    }

    /// The model of one taxel as drawn.
    pub fn model(&self) -> InPlaneModel {
        self.element.model()
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// The calibration that the drawing implies: every taxel as drawn, noise
    /// from the board's own figures.
    pub fn calibration(&self) -> InPlaneCalibration {
        let (board, layout) = (&self.board, self.layout());
        let taxels = layout.taxels();
        InPlaneCalibration {
            channel: board.scale(),
            unit: board.last.unit(),
            models: vec![self.model(); taxels],
            deviation: vec![board.deviation(); taxels],
            masked: self.masked(),
            hysteresis: self.element.hysteresis,
            layout,
        }
    }

    /// What one frame says of the pressing force on a taxel at a compression of its layer;
    /// `noise` in F.
    ///
    /// # Errors
    /// [`NoInformation::Beyond`] beyond the range of the models.
    pub fn information_at(
        &self,
        compression: f64,
        noise: Option<f64>,
    ) -> Result<Information, NoInformation> {
        let model = self.model();
        let beyond = |error: InPlaneError| NoInformation::Beyond(error.to_string());
        let noise = noise.unwrap_or_else(|| self.board.deviation());
        let full_scale = model
            .compress(model.largest_compression())
            .map_err(beyond)?;
        let slope = match model.sensitivity(compression) {
            // The published law has no slope at rest: the secant over one deviation.
            Err(InPlaneError::NoSensitivityAtRest { .. }) => {
                let inverse = model.inverse().map_err(beyond)?;
                noise / inverse.force_from_change(noise)
            }
            slope => slope.map_err(beyond)?,
        };
        let force = Unknown {
            name: "force_z",
            dimension: &FORCE,
            full_scale: full_scale.force,
            beside: false,
        };
        Ok(Information::of_one(force, -slope, noise))
    }

    /// Which taxels are masked.
    fn masked(&self) -> Vec<bool> {
        let array = &self.sensor.array;
        masked_capacitors(&self.sensor.mask, array.rows, array.columns)
            .iter()
            .map(|capacitors| capacitors.contains(&true))
            .collect()
    }
}

impl Device for InPlaneArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(InPlanePredictor::new(self)))
    }

    fn information_loads(&self) -> &'static [LoadColumn] {
        &predict::LOADS
    }

    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        let compression = predict::compression_of(&self.model(), load)
            .map_err(|error| NoInformation::Beyond(error.to_string()))?;
        self.information_at(compression, options.noise)
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        let mut model = self.model();
        model.electrodes.gap += self.element.fabrication.gap_deviation * normal();
        Some(Box::new(InPlanePredictor::of(model, self.board.clone())))
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let layout = self.layout();
        fits(stream, layout.taxels(), layout.columns)?;
        let quantity = stream.unit.quantity;
        let reader = InPlaneReader::new(self.calibration(), quantity);
        reader
            .map(|reader| Box::new(reader) as Box<dyn Reader>)
            .map_err(|error| match error {
                InPlaneReaderError::Frame(error) => error,
                InPlaneReaderError::Model(error) => FrameError::NotInvertible(error.to_string()),
            })
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.layout())
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
