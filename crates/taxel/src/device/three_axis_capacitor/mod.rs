//! The array of three-axis capacitive units (P2).

mod check;
mod drawing;
mod facts;
mod predict;
mod simulated;

use super::{Device, fits};
use crate::acquisition::{Simulated, Stream};
use crate::calibration::ThreeAxisCalibration;
use crate::drawing::Drawing;
use crate::electronics::CapacitanceBoard;
use crate::estimation::{FrameError, ObserverOptions, Reader, ThreeAxisOptions, ThreeAxisReader};
use crate::information::{Information, InformationOptions, NoInformation, Unknown};
use crate::layout::Layout;
use crate::mechanics::UnitDrawing;
use crate::predict::{Load, LoadColumn, Predictor};
use crate::quantity::FORCE;
use crate::sensor::{Broken, Sensor, ThreeAxisCapacitor, masked_capacitors};
use crate::summary::Fact;
use crate::transduction::{DrawnEdges, OutsideEdges, ThreeAxisModel};

pub use predict::{CapacitanceParts, ThreeAxisLoadState, ThreeAxisPrediction, ThreeAxisPredictor};

/// An array of three-axis units with its board.
#[derive(Debug, Clone)]
pub struct ThreeAxisArray<'a> {
    sensor: &'a Sensor,
    /// Element of one taxel.
    pub element: &'a ThreeAxisCapacitor,
    /// The board.
    pub board: CapacitanceBoard,
}

impl<'a> ThreeAxisArray<'a> {
    /// `None` when the board takes no capacitance.
    pub(crate) fn new(sensor: &'a Sensor, element: &'a ThreeAxisCapacitor) -> Option<Self> {
        let array = &sensor.array;
        Some(Self {
            sensor,
            element,
            board: CapacitanceBoard::new(&sensor.electronics, array.rows, array.columns)?,
        })
    }

    /// The same array with another element.
    #[must_use]
    pub fn with_element<'b>(&self, element: &'b ThreeAxisCapacitor) -> ThreeAxisArray<'b>
    where
        'a: 'b,
    {
        ThreeAxisArray {
            sensor: self.sensor,
            element,
            board: self.board.clone(),
        }
    }

    /// The model of one unit as drawn.
    pub fn unit_model(&self) -> ThreeAxisModel {
        self.element.unit_model(&self.sensor.array)
    }

    /// The lengths that the stiffness of a unit follows from.
    pub fn unit_drawing(&self) -> UnitDrawing {
        self.element.unit_drawing(self.sensor.array.pitch)
    }

    /// The edges of the electrodes by the drawing.
    ///
    /// # Errors
    /// [`OutsideEdges`] for a drawing that the table has not and that was not solved.
    pub fn edges(&self) -> Result<DrawnEdges, OutsideEdges> {
        self.element.edges(&self.sensor.array)
    }

    /// The first calibrated unit; without one as drawn.
    pub fn typical_unit(&self) -> ThreeAxisModel {
        let first = self.element.calibrated.first();
        first.map_or_else(|| self.unit_model(), |calibrated| calibrated.unit)
    }

    /// Rules of the board that need nothing that is solved of the drawing.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    pub(crate) fn check_board(&self) -> Result<(), Broken> {
        check::check_board(self)
    }

    /// Where the units are.
    pub fn layout(&self) -> Layout {
        self.sensor.layout()
    }

    /// The units of the piece of fabrication that the sensor file describes.
    pub fn made(&self) -> Vec<ThreeAxisModel> {
        self.element.fabricate(&self.sensor.array)
    }

    /// The calibration that the drawing implies: every taxel as
    /// drawn, noise from the board's own figures.
    pub fn calibration(&self) -> ThreeAxisCalibration {
        let (element, board, layout) = (self.element, &self.board, self.layout());
        let taxels = layout.taxels();
        ThreeAxisCalibration {
            channel: board.scale(),
            unit: board.last.unit(),
            units: element.unit_models(&self.sensor.array),
            deviation: vec![[board.deviation(); 4]; taxels],
            masked: self.masked(),
            relaxation: element.relaxation.clone(),
            hysteresis: element.hysteresis,
            full_scale: element.full_scale,
            usable_force: element.usable_force,
            layout,
        }
    }

    /// What one frame says of the force on a unit, N; `noise` in F.
    ///
    /// # Errors
    /// [`NoInformation::Beyond`] where a pair of electrodes touches.
    pub fn information_at(
        &self,
        force: [f64; 3],
        noise: Option<f64>,
    ) -> Result<Information, NoInformation> {
        let at = self
            .unit_model()
            .linearise(force)
            .ok_or_else(|| NoInformation::Beyond(String::from("a pair of electrodes touches")))?;
        let unknown = |name| Unknown {
            name,
            dimension: &FORCE,
            full_scale: self.element.full_scale,
            beside: false,
        };
        Ok(Information {
            unknowns: ["force_x", "force_y", "force_z"].map(unknown).to_vec(),
            jacobian: at.jacobian.map(|row| row.to_vec()).to_vec(),
            noise: vec![noise.unwrap_or_else(|| self.board.deviation()); 4],
            prior: vec![0.0; 3],
        })
    }

    /// Which capacitors of each unit are masked.
    pub fn masked(&self) -> Vec<[bool; 4]> {
        let array = &self.sensor.array;
        masked_capacitors(&self.sensor.mask, array.rows, array.columns)
    }
}

/// The axis that a force is on.
fn loaded_axis(force: [f64; 3]) -> Result<usize, NoInformation> {
    let mut loaded = (0..3).filter(|axis| force[*axis] != 0.0);
    match (loaded.next(), loaded.next()) {
        (Some(axis), None) => Ok(axis),
        _ => Err(NoInformation::Beyond(String::from(
            "crosstalk is asked for of a load on one axis",
        ))),
    }
}

impl Device for ThreeAxisArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        check::check(self)
    }

    fn way(&self) -> String {
        let (plates, suspension) = (&self.element.plates, &self.element.suspension);
        let of = |typed_in: bool, solved: bool| match (typed_in, solved) {
            (true, _) => "typed in",
            (_, true) => "solved",
            _ => "table",
        };
        let edges = of(
            plates.parallel_capacitance.is_some(),
            plates.solved_edges.0.is_some(),
        );
        let stiffness = of(
            suspension.from_drawing.is_none(),
            suspension.is_solved(&self.unit_drawing()),
        );
        format!("edges {edges}, stiffness {stiffness}")
    }

    fn facts(&self) -> Vec<Fact> {
        facts::facts(self)
    }

    fn made(&self, normal: &mut dyn FnMut() -> f64) -> Option<Box<dyn Predictor>> {
        let deviation = self.element.fabrication.air_gap_deviation;
        let mut predictor = ThreeAxisPredictor::new(self);
        predictor.open([(); 4].map(|()| deviation * normal()));
        Some(Box::new(predictor))
    }

    fn lists(&self) -> &'static [(&'static str, usize)] {
        &[
            ("element.three_axis_capacitor.plates.air_gap", 4),
            (
                "element.three_axis_capacitor.plates.parallel_capacitance",
                4,
            ),
        ]
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        Some(Box::new(ThreeAxisPredictor::new(self)))
    }

    fn information_loads(&self) -> &'static [LoadColumn] {
        &predict::LOADS
    }

    fn information(
        &self,
        load: &Load<'_>,
        options: &InformationOptions,
    ) -> Result<Information, NoInformation> {
        let force = std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0));
        self.information_at(force, options.noise)
    }

    /// Of a read-out that is linear with the slopes at rest.
    fn crosstalk(&self, load: &Load<'_>) -> Result<f64, NoInformation> {
        let force: [f64; 3] = std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0));
        let loaded = loaded_axis(force)?;
        let unit = self.unit_model();
        let at = |force| unit.predict(force).1;
        let (rest, pressed) = (at([0.0; 3]), at(force));
        if pressed.closed().contains(&true) {
            let touching = String::from("a pair of electrodes touches");
            return Err(NoInformation::Beyond(touching));
        }
        let (rest, pressed) = (rest.capacitance(), pressed.capacitance());
        let changes: [f64; 4] = std::array::from_fn(|i| pressed[i] - rest[i]);
        let read = self.information_at([0.0; 3], None)?.linear(&changes);
        let read = read.ok_or_else(|| {
            NoInformation::Beyond(String::from("the slopes at rest determine no force"))
        })?;
        let others = (0..3).filter(|axis| *axis != loaded);
        let largest = others.map(|axis| read[axis].abs()).fold(0.0, f64::max);
        Ok(largest / read[loaded].abs())
    }

    fn time_constants(&self) -> Vec<f64> {
        self.element
            .relaxation
            .iter()
            .map(|term| term.time)
            .collect()
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        Some(Box::new(simulated::Piece::new(self)))
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        let calibration = self.calibration();
        let layout = &calibration.layout;
        fits(stream, 4 * layout.taxels(), layout.columns)?;
        let options = ThreeAxisOptions::default();
        let reader = ThreeAxisReader::new(calibration, stream.unit.quantity, options)?;
        Ok(Box::new(reader))
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        ObserverOptions::new(stream).on(&self.layout())
    }

    fn drawing(&self) -> Drawing {
        drawing::drawing(self)
    }
}
