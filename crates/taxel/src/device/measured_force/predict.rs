//! Force on one taxel to its readings: the load is the reading.

use super::MeasuredForceArray;
use crate::device::{AXES, force_loads, number_cell, number_column};
use crate::electronics::{Delivered, LastStage};
use crate::mechanics::ForceAxes;
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Predictor};
use crate::table::{Cell, Column};

/// Predicts the readings of one taxel.
#[derive(Debug, Clone)]
pub struct MeasuredForcePredictor {
    axes: ForceAxes,
    last: LastStage,
}

/// Readings of one taxel under a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredForcePrediction {
    /// The load: force x, y, pressing, N.
    pub force: [f64; 3],
    /// Readings along x, y and z; a taxel of one axis has the last alone.
    pub numbers: [Delivered; 3],
}

impl MeasuredForcePredictor {
    /// A predictor for the taxels of `array`.
    pub fn new(array: &MeasuredForceArray<'_>) -> Self {
        Self {
            axes: array.element.axes,
            last: array.last(),
        }
    }

    /// Readings under a force x, y, pressing, N.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("force-4x4").unwrap();
    /// let array = sensor.measured_force().unwrap();
    /// let answer = taxel::device::MeasuredForcePredictor::new(&array).predict([0.0, 1.0, 1e3]);
    /// assert_eq!(answer.numbers[1].number, 1.0);
    /// assert!(answer.numbers[2].clipped);
    /// ```
    pub fn predict(&self, force: [f64; 3]) -> MeasuredForcePrediction {
        MeasuredForcePrediction {
            force,
            numbers: force.map(|force| self.last.deliver(force)),
        }
    }
}

/// The force on a taxel, at most this much along each axis, N.
static LOADS: [LoadColumn; 3] = force_loads(1e5);

impl Predictor for MeasuredForcePredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS[self.axes.first()..]
    }

    fn columns(&self) -> Vec<Column> {
        let axes = || AXES.iter().skip(self.axes.first());
        let force = |axis| Column::new(format!("force_{axis}"), "N", 1.0, "n", 4);
        let reading = |axis| number_column("", &format!("_{axis}"), &self.last);
        let mut columns: Vec<Column> = axes().map(force).collect();
        columns.extend(axes().map(reading));
        columns.push(Column::plain("state"));
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let first = self.axes.first();
        let force = |axis: usize| {
            let column = axis.checked_sub(first);
            column.and_then(|column| load.number(column)).unwrap_or(0.0)
        };
        let answer = self.predict(std::array::from_fn(force));
        row.extend(answer.force[first..].iter().copied().map(Cell::Number));
        let numbers = &answer.numbers[first..];
        row.extend(numbers.iter().map(|number| number_cell(number, &self.last)));
        let clipped = numbers.iter().any(|number| number.clipped);
        row.push(Cell::State(if clipped { "saturated" } else { "ok" }));
        Ok(())
    }

    /// None: a straight line of slope one shows nothing.
    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        Vec::new()
    }
}
