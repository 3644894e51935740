//! Load to signal, stage by stage: the forward way of the whole chain.

use crate::electronics::{Code, FrontEnd};
use crate::mechanics::Deformation;
use crate::sensor::{Element, Sensor};
use crate::transduction::Response;
use crate::transduction::UnitModel;

/// What one load does to one unit of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The load: force x, y, pressing, N.
    pub force: [f64; 3],
    /// Motion of the tiles.
    pub deformation: Deformation,
    /// Capacitances.
    pub response: Response,
    /// Voltages of the amplifiers, V.
    pub voltage: [f64; 4],
    /// Codes of the converter.
    pub code: [Code; 4],
    /// Force by the published inverse from these capacitances, N.
    pub published_inverse: [f64; 3],
    /// How the unit takes the load.
    pub state: LoadState,
}

/// How a unit takes a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadState {
    /// Within the range in which the model was verified.
    Ok,
    /// Above the usable force, within the full scale.
    AboveUsable,
    /// Above the full scale.
    OutOfRange,
    /// A tile touches: capacitances of touching capacitors are lower bounds.
    Contact,
}

impl LoadState {
    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::AboveUsable => "above_usable",
            Self::OutOfRange => "out_of_range",
            Self::Contact => "contact",
        }
    }
}

/// Predicts loads on one unit as drawn.
#[derive(Debug, Clone)]
pub struct Predictor {
    unit: UnitModel,
    board: FrontEnd,
    usable_force: f64,
    full_scale: f64,
}

impl Predictor {
    /// A predictor for the units of `sensor`.
    pub fn new(sensor: &Sensor) -> Self {
        let Element::ThreeAxisCapacitor(element) = &sensor.element;
        Self {
            unit: element.unit_model(),
            board: sensor.front_end(),
            usable_force: element.usable_force,
            full_scale: element.full_scale,
        }
    }

    /// The chain for a force x, y, pressing, N.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let row = taxel::predict::Predictor::new(&sensor).predict([0.0, 0.0, 10e-3]);
    /// // P2: 10 mN raise all four capacitances by 13 %.
    /// assert!((row.response.capacitance()[0] / 172.2977e-15 - 1.1324).abs() < 1e-4);
    /// ```
    pub fn predict(&self, force: [f64; 3]) -> Prediction {
        let (deformation, response) = self.unit.predict(force);
        let capacitance = response.capacitance();
        let published_inverse = self
            .unit
            .effective_force(self.unit.rest(), capacitance)
            .unwrap_or([f64::NAN; 3]);
        Prediction {
            force,
            deformation,
            voltage: capacitance.map(|c| self.board.voltage(c)),
            code: capacitance.map(|c| self.board.read(c, 0.0)),
            published_inverse,
            state: self.state(force, &response),
            response,
        }
    }

    fn state(&self, force: [f64; 3], response: &Response) -> LoadState {
        let largest = force
            .iter()
            .fold(0.0, |largest: f64, f| largest.max(f.abs()));
        if response.touching().contains(&true) {
            LoadState::Contact
        } else if largest > self.full_scale {
            LoadState::OutOfRange
        } else if largest > self.usable_force {
            LoadState::AboveUsable
        } else {
            LoadState::Ok
        }
    }
}
