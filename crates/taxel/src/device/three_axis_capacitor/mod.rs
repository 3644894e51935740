//! The array of three-axis capacitive units (P2).

mod check;
mod drawing;
mod facts;
mod predict;
mod simulated;

use super::{Device, Sense, capacitor_channel};
use crate::acquisition::{Quantity, Simulated, Stream};
use crate::calibration::{Calibration, ChannelScale};
use crate::drawing::Drawing;
use crate::electronics::FrontEnd;
use crate::estimation::{FrameError, ObserverOptions};
use crate::layout::Layout;
use crate::predict::Predictor;
use crate::sensor::{Broken, Sensor, ThreeAxisCapacitor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::UnitModel;

pub use predict::{LoadState, Prediction, ThreeAxisPredictor};

/// An array of three-axis units with its board.
#[derive(Debug, Clone)]
pub struct ThreeAxisArray<'a> {
    sensor: &'a Sensor,
    /// What one unit is.
    pub element: &'a ThreeAxisCapacitor,
    /// The board.
    pub board: FrontEnd,
}

impl<'a> ThreeAxisArray<'a> {
    /// `None` when the board has no charge amplifier.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a ThreeAxisCapacitor) -> Option<Self> {
        let array = &sensor.array;
        Some(Self {
            sensor,
            element,
            board: FrontEnd::new(&sensor.electronics, array.rows, array.columns)?,
        })
    }

    /// The model of one unit as drawn.
    pub fn unit_model(&self) -> UnitModel {
        self.element.unit_model()
    }

    /// The first calibrated unit; without one as drawn.
    pub fn typical_unit(&self) -> UnitModel {
        let first = self.element.calibrated.first();
        first.map_or_else(|| self.unit_model(), |calibrated| calibrated.unit)
    }

    /// Where the units are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// The units of the piece of fabrication that the sensor file describes.
    pub fn made(&self) -> Vec<UnitModel> {
        self.element.fabricate(self.layout().taxels())
    }

    /// The calibration that the drawing implies: every taxel as
    /// drawn, noise from the board's own figures.
    pub fn calibration(&self) -> Calibration {
        let (element, board, layout) = (self.element, &self.board, self.layout());
        let taxels = layout.taxels();
        let at_zero = board.capacitance(0.0);
        Calibration {
            channel: ChannelScale {
                farad_at_zero: at_zero,
                farad_per_count: board.capacitance(1.0) - at_zero,
                highest_code: f64::from(board.highest_code()),
            },
            units: element.unit_models(taxels),
            deviation: vec![[board.deviation(); 4]; taxels],
            masked: self.masked(),
            relaxation: element.relaxation.clone(),
            hysteresis: element.hysteresis,
            full_scale: element.full_scale,
            usable_force: element.usable_force,
            layout,
        }
    }

    /// Which capacitors of each unit are masked.
    pub fn masked(&self) -> Vec<[bool; 4]> {
        let array = &self.sensor.array;
        masked_capacitors(&self.sensor.mask, array.rows, array.columns)
    }
}

impl Device for ThreeAxisArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(ThreeAxisPredictor::new(self)))
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn sense(&self, stream: &Stream) -> Result<Sense, FrameError> {
        let calibration = self.calibration();
        let expected = 4 * calibration.layout.taxels();
        if stream.channels() != expected || stream.columns != calibration.layout.columns {
            return Err(FrameError::Channels {
                found: stream.channels(),
                expected,
            });
        }
        if !matches!(
            stream.unit.quantity,
            Quantity::Counts | Quantity::Capacitance
        ) {
            return Err(FrameError::Quantity {
                found: stream.unit.quantity,
            });
        }
        Ok(Sense::ThreeAxis(Box::new(calibration)))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        let calibration = self.calibration();
        let (scale, quantity) = (&calibration.channel, stream.unit.quantity);
        let deviations = calibration.deviation.iter().flatten();
        let channels = deviations.zip(calibration.masked.iter().flatten());
        ObserverOptions {
            channels: channels
                .map(|(sigma, masked)| capacitor_channel(scale, *sigma, *masked, quantity))
                .collect(),
            ..ObserverOptions::new(stream)
        }
        .on(&calibration.layout)
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
