//! The channels of a press at a position, from the surface that was learned.

use super::ReadingUnit;
use crate::predict::{Curve, Load, LoadColumn, LoadKind, LoadRefused, Predictor};
use crate::quantity::{FORCE, LENGTH};
use crate::table::{Cell, Column};
use crate::trained::{PositionMap, TrainedMaps};

const POSITION: [LoadColumn; 2] = [along("x"), along("y")];

/// Loads of presses of one depth or of several.
static LOADS: [LoadColumn; 3] = [
    POSITION[0],
    POSITION[1],
    LoadColumn {
        name: "z",
        short: "z",
        kind: LoadKind::Quantity(&LENGTH, [-10.0, 10.0]),
        required: false,
        about: "depth of the press, as the z of training; without it the middle of the depths",
    },
];

/// Loads of presses of several forces.
static FORCES: [LoadColumn; 3] = [
    POSITION[0],
    POSITION[1],
    LoadColumn {
        name: "force_z",
        short: "force_z",
        kind: LoadKind::Quantity(&FORCE, [-1e4, 1e4]),
        required: false,
        about: "force of the press; without it the middle of the forces",
    },
];

const fn along(name: &'static str) -> LoadColumn {
    LoadColumn {
        name,
        short: name,
        kind: LoadKind::Quantity(&LENGTH, [-1.0, 1.0]),
        required: true,
        about: "position of the press from the middle of the area",
    }
}

/// Answers the channels of a press of a depth of training, with their
/// deviation from press to press.
#[derive(Debug, Clone)]
pub struct TrainedPredictor {
    map: PositionMap,
    /// Standard deviation of each channel in use.
    deviation: Vec<f64>,
    columns: Vec<Column>,
    /// SI value of the unit of a channel.
    si_per_unit: f64,
}

impl TrainedPredictor {
    /// `None` where no positions were learned.
    pub(crate) fn new(names: &[String], maps: &TrainedMaps, unit: ReadingUnit) -> Option<Self> {
        let map = maps.position.clone()?;
        let used: Vec<String> = map
            .standard
            .used
            .iter()
            .map(|channel| names.get(*channel).map(|name| name.replace(' ', "_")))
            .collect::<Option<_>>()?;
        let column = |name: String| Column::new(name, unit.symbol, unit.si_per_unit, unit.key, 1);
        let deviations = used.iter().map(|name| column(format!("{name}_deviation")));
        Some(Self {
            columns: used.iter().cloned().map(column).chain(deviations).collect(),
            deviation: map.deviation(),
            si_per_unit: unit.si_per_unit,
            map,
        })
    }
}

impl Predictor for TrainedPredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        if self.map.by_force { &FORCES } else { &LOADS }
    }

    fn columns(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let surface = &self.map.surface;
        let [shallow, deep] = surface.range(2);
        let middle = [0.0, 0.0, 0.5 * (shallow + deep)];
        let mut position = [0, 1, 2].map(|axis| load.number(axis).unwrap_or(middle[axis]));
        if !surface.is_deep() {
            // Nothing is known of other depths.
            position[2] = 0.0;
        }
        let nearest = surface.clamp(position);
        if let Some(column) = (0..3).find(|axis| (nearest[*axis] - position[*axis]).abs() > 1e-9) {
            let (scale, unit) = match column {
                2 if self.map.by_force => (1.0, "N"),
                _ => (1e3, "mm"),
            };
            let [low, high] = self.map.surface.range(column).map(|end| end * scale);
            return Err(LoadRefused {
                column,
                message: format!(
                    "{:.3} {unit} is outside of the presses of training, {low:.3} to {high:.3} {unit}",
                    position[column] * scale
                ),
                help: "give a press among them, or train on more".into(),
            });
        }
        // The map knows the numbers as people read them.
        let si = |number: f64| Cell::Number(number * self.si_per_unit);
        row.extend(self.map.answer(position).into_iter().map(si));
        row.extend(self.deviation.iter().copied().map(si));
        Ok(())
    }

    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        Vec::new()
    }
}
