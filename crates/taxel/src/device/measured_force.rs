//! Taxels whose board gives forces: skins of magnetic, optical or pneumatic cells with a
//! computer of their own, arrays of load cells. A chain whose cells are the loads themselves;
//! peculiar to it are what `check` says of a board with axes, and loads on one taxel.

use super::chain::{CONTACT_DEVIATIONS, CONTACT_SHARE};
use super::{
    AXES, ChainDevice, Device, check_mask, force_loads, number_cell, number_column, timing,
};
use crate::acquisition::{Simulated, Stream};
use crate::drawing::Drawing;
use crate::electronics::{LastStage, Measured};
use crate::estimation::{FrameError, ObserverOptions, Reader};
use crate::mechanics::ForceAxes;
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Predictor};
use crate::sensor::{Broken, MeasuredForce, Sensor, check_scan_time, require};
use crate::stage::{CellLaw as _, Chain, ForceCell, Parts};
use crate::summary::{Fact, fact, number, text};
use crate::table::{Cell, Column};

/// An array of taxels with a board that gives their forces.
#[derive(Debug)]
pub struct MeasuredForceArray<'a> {
    sensor: &'a Sensor,
    /// The board.
    board: Measured,
    chain: ChainDevice<'a>,
}

impl<'a> MeasuredForceArray<'a> {
    /// `None` when the board gives no forces.
    pub(crate) fn new(sensor: &'a Sensor, element: &MeasuredForce) -> Option<Self> {
        let parts = Parts {
            axes: element.axes,
            ..Parts::of_cell(ForceCell::Measured.boxed(), element.full_scale)
        };
        Some(Self {
            sensor,
            board: *sensor.electronics.measured()?,
            chain: ChainDevice::new(sensor, parts, Vec::new()).ok()?,
        })
    }
}

impl Device for MeasuredForceArray<'_> {
    fn check(&self) -> Result<(), Broken> {
        let chain = self.chain.chain();
        let [rows, columns] = [chain.layout.rows, chain.layout.columns];
        check_scan_time(self.sensor, chain.scan.duration(rows, columns))?;
        let [low, high] = self.board.ends();
        let unit = &self.board.unit;
        require(
            low <= 0.0 && 0.0 < high && (low < 0.0 || chain.axes == ForceAxes::Z),
            "electronics.readout.measured.range",
            || {
                let [low, high] = [low, high].map(|end| end / unit.si_per_unit);
                format!(
                    "no force at all lies outside of {low} to {high} {}, or at its end",
                    unit.symbol
                )
            },
            "give a range around zero; of axes = \"z\" it may begin at zero",
        )?;
        check_mask(self.sensor)
    }

    fn facts(&self) -> Vec<Fact> {
        let (board, chain) = (&self.board, self.chain.chain());
        let unit = &board.unit;
        let force = |value: f64| number(value, "n", unit.symbol, unit.si_per_unit);
        let [low, high] = board.ends();
        let scan_time = chain.scan.duration(chain.layout.rows, chain.layout.columns);
        let names = text(&chain.axes.names().join(", "));
        let none = text("none: the readings are the forces");
        let mut facts = vec![
            fact("device", "channels", text(&chain.count()), "one per force"),
            fact(
                "device",
                "forces_of_a_taxel",
                names,
                "element.measured_force.axes",
            ),
            fact("mechanics", "model", none, "element"),
        ];
        facts.extend(timing(
            chain.period,
            scan_time,
            "time for all taxels of a frame",
        ));
        let range = "electronics.readout.measured.range";
        facts.push(fact("electronics", "lowest_force", force(low), range));
        facts.push(fact("electronics", "highest_force", force(high), range));
        for (axis, name) in (chain.axes.first()..).zip(chain.axes.names()) {
            let noise = force(board.deviations()[axis]);
            let source = "electronics.readout.measured.noise";
            facts.push(fact("electronics", format!("noise_{name}"), noise, source));
        }
        let (end, source) = (chain.full_scale, "element.measured_force.full_scale");
        facts.push(fact("estimation", "full_scale", force(end), source));
        let least = (CONTACT_SHARE * end).max(CONTACT_DEVIATIONS * board.deviation());
        let source = "6 standard deviations, at least 1 % of the full scale; default";
        facts.push(fact(
            "estimation",
            "contact_threshold",
            force(least),
            source,
        ));
        facts
    }

    fn predictor(&self) -> Option<Box<dyn Predictor>> {
        let chain = self.chain.chain();
        Some(Box::new(ForcePredictor {
            axes: chain.axes,
            last: chain.last,
        }))
    }

    fn stages(&self) -> Option<Chain> {
        self.chain.stages()
    }

    fn simulated(&self) -> Option<Box<dyn Simulated>> {
        self.chain.simulated()
    }

    fn reader(&self, stream: &Stream) -> Result<Box<dyn Reader>, FrameError> {
        self.chain.reader(stream)
    }

    fn observed(&self, stream: &Stream) -> ObserverOptions {
        self.chain.observed(stream)
    }

    fn drawing(&self) -> Drawing {
        self.chain.drawing()
    }
}

/// Predicts the readings of one taxel: the load is the reading.
#[derive(Debug, Clone)]
struct ForcePredictor {
    axes: ForceAxes,
    last: LastStage,
}

/// The force on a taxel, at most this much along each axis, N.
static LOADS: [LoadColumn; 3] = force_loads(1e5);

impl Predictor for ForcePredictor {
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
        let forces = (0..self.axes.count()).map(|axis| load.number(axis).unwrap_or(0.0));
        let forces: Vec<f64> = forces.collect();
        row.extend(forces.iter().copied().map(Cell::Number));
        let numbers = || forces.iter().map(|force| self.last.deliver(*force));
        row.extend(numbers().map(|number| number_cell(&number, &self.last)));
        let clipped = numbers().any(|number| number.clipped);
        row.push(Cell::State(if clipped { "saturated" } else { "ok" }));
        Ok(())
    }

    /// None: a straight line of slope one shows nothing.
    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        Vec::new()
    }
}
