//! The array of in-plane capacitive sensors (P1).

mod check;
mod drawing;
mod facts;
mod predict;

use super::chain::Piece;
use super::{ChainDevice, Device};
use crate::acquisition::{Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::CapacitanceBoard;
use crate::estimation::{FrameError, ObserverOptions, Reader};
use crate::information::{Information, InformationOptions, NoInformation, Unknown};
use crate::layout::Layout;
use crate::predict::{Load, LoadColumn, Predictor};
use crate::quantity::FORCE;
use crate::sensor::{Broken, InPlaneCapacitor, Sensor};
use crate::stage::{Chain, Hysteresis, InPlaneCell, Memory, Parts};
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
    pub board: CapacitanceBoard,
}

impl<'a> InPlaneArray<'a> {
    /// `None` when the board takes no capacitance.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a InPlaneCapacitor) -> Option<Self> {
        let array = &sensor.array;
        Some(Self {
            sensor,
            element,
            board: CapacitanceBoard::of_single(&sensor.electronics, array.rows, array.columns)?,
        })
    }

    /// The model of one taxel as drawn.
    pub fn model(&self) -> InPlaneModel {
        self.element.model()
    }

    /// Rules of the board that need nothing that is solved of the drawing.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    pub(crate) fn check_board(&self) -> Result<(), Broken> {
        check::check_board(self)
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// The array as a chain of stages, as drawn.
    ///
    /// # Errors
    /// [`FrameError::NotInvertible`] for a drawing from whose capacitance no force follows.
    pub fn chain(&self) -> Result<ChainDevice<'a>, FrameError> {
        let not_invertible = |error: InPlaneError| FrameError::NotInvertible(error.to_string());
        let cell = InPlaneCell::invertible(self.model()).map_err(not_invertible)?;
        self.chain_of(cell).map_err(not_invertible)
    }

    /// The array of this cell.
    fn chain_of(&self, cell: InPlaneCell) -> Result<ChainDevice<'a>, InPlaneError> {
        let full_scale = self.model().inverse()?.last().layer.force;
        let memory = self.element.hysteresis.map(Hysteresis::new);
        let parts = Parts {
            memory: memory.map(|memory| Box::new(memory) as Box<dyn Memory>),
            ..Parts::of_cell(Box::new(cell), full_scale)
        };
        let chain = ChainDevice::new(self.sensor, parts, Vec::new());
        Ok(chain.expect("a board for single capacitors reads capacitances"))
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

    fn way(&self) -> String {
        let model = self.model();
        String::from(match (&model.table, &model.solved) {
            (Some(_), _) => "table",
            (None, Some(_)) => "solved cross-section",
            (None, None) if model.is_compared() => "closed form",
            (None, None) => "closed form, not compared",
        })
    }

    fn compression(&self) -> Option<f64> {
        let inverse = self.model().inverse().ok()?;
        Some(inverse.last().layer.kinematics.compression())
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        let mut model = self.model();
        model.electrodes.gap += self.element.fabrication.gap_deviation * normal();
        Some(Box::new(InPlanePredictor::of(model, self.board.clone())))
    }

    /// Read back by searching, which is less work than a curve for a few readings.
    fn stages(&self) -> Option<Chain> {
        let chain = self.chain_of(InPlaneCell::new(self.model())).ok()?;
        Some(chain.chain().clone())
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        let mut chain = self.stages()?;
        let made = self.element.fabricate(chain.count());
        for (taxel, model) in made.into_iter().enumerate() {
            chain.set_cell(taxel, Box::new(InPlaneCell::new(model)));
        }
        Some(Box::new(Piece::new(chain)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        self.chain()?.reader(stream)
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.layout())
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
