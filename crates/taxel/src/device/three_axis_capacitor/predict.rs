//! Force on one unit to signal, stage by stage.

use super::ThreeAxisArray;
use crate::device::{AXES, force_loads, number_cell, number_column};
use crate::electronics::{Delivered, FrontEnd};
use crate::mechanics::Deformation;
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Predictor};
use crate::table::{Cell, Column};
use crate::transduction::{Response, UnitModel};

/// Response of one unit of a device to one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The load: force x, y, pressing, N.
    pub force: [f64; 3],
    /// Motion of the tiles.
    pub deformation: Deformation,
    /// Capacitances.
    pub response: Response,
    /// Voltages of the amplifiers, V; none where capacitances are measured.
    pub voltage: [Option<f64>; 4],
    /// Numbers of a frame.
    pub numbers: [Delivered; 4],
    /// Force by the published inverse from these capacitances, N.
    pub published_inverse: [f64; 3],
    /// State of the unit under the load.
    pub state: LoadState,
}

/// State of a unit under a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadState {
    /// Within the range in which the model was verified.
    Ok,
    /// Above the usable force, within the full scale.
    AboveUsable,
    /// Above the full scale.
    OutOfRange,
    /// A pair of electrodes is closed: its capacitance is a lower bound.
    Closed,
}

impl LoadState {
    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::AboveUsable => "above_usable",
            Self::OutOfRange => "out_of_range",
            Self::Closed => "closed",
        }
    }
}

/// Predicts loads on one unit: the first calibrated taxel, or else as drawn.
#[derive(Debug, Clone)]
pub struct ThreeAxisPredictor {
    unit: UnitModel,
    board: FrontEnd,
    usable_force: f64,
    full_scale: f64,
}

impl ThreeAxisPredictor {
    /// A predictor for the units of `array`.
    pub fn new(array: &ThreeAxisArray<'_>) -> Self {
        Self {
            unit: array.typical_unit(),
            board: array.board.clone(),
            usable_force: array.element.usable_force,
            full_scale: array.element.full_scale,
        }
    }

    /// The chain for a force x, y, pressing, N.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let row = taxel::device::ThreeAxisPredictor::new(&sensor.three_axis().unwrap())
    ///     .predict([0.0, 0.0, 10e-3]);
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
            numbers: capacitance.map(|c| self.board.read(c, 0.0)),
            published_inverse,
            state: self.state(force, &response),
            response,
        }
    }

    fn state(&self, force: [f64; 3], response: &Response) -> LoadState {
        let largest = force
            .iter()
            .fold(0.0, |largest: f64, f| largest.max(f.abs()));
        if response.closed().contains(&true) {
            LoadState::Closed
        } else if largest > self.full_scale {
            LoadState::OutOfRange
        } else if largest > self.usable_force {
            LoadState::AboveUsable
        } else {
            LoadState::Ok
        }
    }
}

const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];
/// The force on a taxel, at most this much along each axis, N.
static LOADS: [LoadColumn; 3] = force_loads(1e3);

impl Predictor for ThreeAxisPredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn columns(&self) -> Vec<Column> {
        let force =
            |name: &str| AXES.map(|axis| Column::new(format!("{name}_{axis}"), "mN", 1e-3, "n", 3));
        let mut columns = Vec::from(force("force"));
        columns.extend(
            AXES.map(|axis| Column::new(format!("displacement_{axis}"), "nm", 1e-9, "m", 2)),
        );
        columns.extend(
            CAPACITORS.map(|c| Column::new(format!("capacitance_{c}"), "fF", 1e-15, "f", 3)),
        );
        columns.push(Column::new("least_air_gap", "um", 1e-6, "m", 4));
        if self.board.voltage(0.0).is_some() {
            let voltage = |c| Column::new(format!("voltage_{c}"), "mV", 1e-3, "v", 3);
            columns.extend(CAPACITORS.map(voltage));
        }
        let last = &self.board.last;
        columns.extend(CAPACITORS.map(|c| number_column("", &format!("_{c}"), last)));
        columns.extend(force("published_inverse"));
        columns.push(Column::plain("state"));
        columns.push(Column::plain("closed"));
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let answer = self.predict(std::array::from_fn(|axis| load.number(axis).unwrap_or(0.0)));
        row.extend(answer.force.map(Cell::Number));
        row.extend(answer.deformation.displacement.map(Cell::Number));
        row.extend(answer.response.capacitance().map(Cell::Number));
        row.push(Cell::Number(answer.response.least_air_gap()));
        row.extend(answer.voltage.into_iter().flatten().map(Cell::Number));
        row.extend(
            answer
                .numbers
                .map(|number| number_cell(&number, &self.board.last)),
        );
        row.extend(answer.published_inverse.map(Cell::Number));
        row.push(Cell::from(answer.state.name()));
        let closed = answer.response.closed();
        row.push(if closed.contains(&true) {
            let names = (0..4).filter(|i| closed[*i]).map(|i| CAPACITORS[i]);
            Cell::from(names.collect::<Vec<_>>().join(" "))
        } else {
            Cell::from("")
        });
        Ok(())
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        let named = (0..3).filter(|axis| given.get(*axis) == Some(&true));
        named
            .map(|axis| Curve {
                title: format!("Capacitances against the force along {}", AXES[axis]),
                x: LOADS[axis].name,
                y: vec![
                    "capacitance_11",
                    "capacitance_12",
                    "capacitance_21",
                    "capacitance_22",
                ],
                y_label: "capacitance",
            })
            .collect()
    }
}
