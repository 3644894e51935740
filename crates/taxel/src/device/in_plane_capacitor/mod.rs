//! The array of in-plane capacitive sensors (P1).

mod check;
mod drawing;
mod facts;
mod field;
mod predict;
mod simulated;

use super::{Device, NotSolvable, fits};
use crate::acquisition::{Simulated, Stream};
use crate::calibration::InPlaneCalibration;
use crate::drawing::Drawing;
use crate::electronics::FrontEnd;
use crate::estimation::{FrameError, InPlaneReader, InPlaneReaderError, ObserverOptions, Reader};
use crate::layout::Layout;
use crate::predict::Predictor;
use crate::sensor::{Broken, InPlaneCapacitor, Sensor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::InPlaneModel;

pub use field::{InPlaneFieldPrediction, InPlaneFieldPredictor};
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

    fn field_predictor(&self) -> Result<Box<dyn Predictor>, NotSolvable> {
        Ok(Box::new(InPlaneFieldPredictor::new(self)))
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
                // `check` has refused such a device before it had frames.
                InPlaneReaderError::Model(_) => {
                    FrameError::quantity(quantity, &self.board.last.unit())
                }
            })
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.layout())
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
