//! Taxels whose board gives forces: skins of magnetic, optical or pneumatic cells with a
//! computer of their own, arrays of load cells.

mod check;
mod drawing;
mod facts;
mod predict;
mod simulated;

use super::{Device, carries, fits};
use crate::acquisition::{Simulated, Stream};
use crate::calibration::ForceModel;
use crate::drawing::Drawing;
use crate::electronics::{LARGEST_STEP, LastStage, Measured};
use crate::estimation::{FrameError, MeasuredForceReader, ObserverOptions, Reader};
use crate::layout::Layout;
use crate::predict::Predictor;
use crate::quantity::FORCE;
use crate::sensor::{Broken, MeasuredForce, Sensor, masked_capacitors};
use crate::summary::Fact;

pub use predict::{MeasuredForcePrediction, MeasuredForcePredictor};

/// An array of taxels with a board that gives their forces.
#[derive(Debug, Clone)]
pub struct MeasuredForceArray<'a> {
    sensor: &'a Sensor,
    /// Element of one taxel.
    pub element: &'a MeasuredForce,
    /// The board.
    pub board: Measured,
}

impl<'a> MeasuredForceArray<'a> {
    /// `None` when the board gives no forces.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a MeasuredForce) -> Option<Self> {
        let board = *sensor.electronics.measured()?;
        let forces = *board.unit.dimension == FORCE && board.stage.is_none();
        forces.then_some(Self {
            sensor,
            element,
            board,
        })
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    fn last(&self) -> LastStage {
        LastStage::Instrument(self.board)
    }

    /// Sampling time of a taxel after the start of the frame, s.
    pub fn delay(&self, taxel: usize) -> f64 {
        let columns = self.sensor.array.columns;
        let scan = &self.sensor.electronics.scan;
        scan.delay(taxel / columns, taxel % columns, columns)
    }

    /// Time for one scan, s.
    pub fn scan_time(&self) -> f64 {
        let array = &self.sensor.array;
        self.sensor
            .electronics
            .scan
            .duration(array.rows, array.columns)
    }

    /// All that estimation needs to know.
    pub fn model(&self) -> ForceModel {
        let (array, layout) = (&self.sensor.array, self.layout());
        let last = self.last();
        let least = self
            .board
            .deviations()
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let mut channel = last.scale();
        channel.step = LARGEST_STEP * least;
        ForceModel {
            axes: self.element.axes,
            channel,
            unit: last.unit(),
            deviation: self.board.deviations(),
            masked: masked_capacitors(&self.sensor.mask, array.rows, array.columns)
                .iter()
                .map(|channels| channels.contains(&true))
                .collect(),
            full_scale: self.element.full_scale,
            layout,
        }
    }
}

impl Device for MeasuredForceArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(MeasuredForcePredictor::new(self)))
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let model = self.model();
        let channels = model.axes.count() * model.layout.taxels();
        fits(stream, channels, model.layout.columns)?;
        carries(stream, &self.last())?;
        Ok(Box::new(MeasuredForceReader::new(model)))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.layout())
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
