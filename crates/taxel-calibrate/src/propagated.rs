//! Predictions with the standard deviation that a calibration leaves.

use std::sync::Arc;

use crate::file::STEP;
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel::table::{Cell, Column};

/// A predictor that adds to some numbers of its answers their standard
/// deviation: σ² = Σ ((y₊ − y₋)/2h)² over the directions in which the
/// parameters are uncertain, with h deviations along each.
pub struct Propagated {
    centre: Box<dyn Predictor>,
    sides: Vec<[Box<dyn Predictor>; 2]>,
    /// Places of the columns among the answers.
    uncertain: Vec<usize>,
}

impl Propagated {
    /// `sides` are predictors of sensors from
    /// [`crate::CalibrationFile::spread`].
    pub fn new(
        centre: Box<dyn Predictor>,
        sides: Vec<[Box<dyn Predictor>; 2]>,
        names: &[&str],
    ) -> Self {
        let uncertain = centre
            .columns()
            .iter()
            .enumerate()
            .filter(|(_, column)| names.contains(&column.name.as_str()))
            .map(|(place, _)| place)
            .collect();
        Self {
            centre,
            sides,
            uncertain,
        }
    }

    /// Squares along one direction, added to `variances`.
    fn add(&self, sides: &[Box<dyn Predictor>; 2], load: &Load<'_>, variances: &mut [f64]) {
        let [below, above] = [0, 1].map(|side| {
            let mut row = Vec::new();
            // A side may end just before the centre does: then no deviation.
            sides[side]
                .answer(load, &mut row)
                .map_or(Vec::new(), |()| row)
        });
        for (variance, place) in variances.iter_mut().zip(&self.uncertain) {
            *variance += match (below.get(*place), above.get(*place)) {
                (Some(Cell::Number(below)), Some(Cell::Number(above))) => {
                    ((above - below) / (2.0 * STEP)).powi(2)
                }
                _ => f64::NAN,
            };
        }
    }
}

impl Predictor for Propagated {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        for side in self.sides.iter_mut().flatten() {
            side.prepare(loads, &mut |_| ())?;
        }
        self.centre.prepare(loads, progress)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        self.centre.load_columns()
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        self.centre.combination(given)
    }

    fn pictures(&self, load: &Load<'_>) -> Vec<(String, String)> {
        self.centre.pictures(load)
    }

    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        self.centre.bodies()
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = self.centre.columns();
        let deviations: Vec<Column> = self
            .uncertain
            .iter()
            .map(|place| {
                let column = &columns[*place];
                let name = format!("{}_deviation", column.name);
                Column::new(&name, column.unit, column.scale, column.si, column.decimals)
            })
            .collect();
        columns.extend(deviations);
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let first = row.len();
        self.centre.answer(load, row)?;
        let mut variances = vec![0.0; self.uncertain.len()];
        for sides in &self.sides {
            self.add(sides, load, &mut variances);
        }
        for (variance, place) in variances.iter().zip(&self.uncertain) {
            let known = variance.is_finite() && matches!(row[first + place], Cell::Number(_));
            row.push(if known {
                Cell::Number(variance.sqrt())
            } else {
                Cell::Missing
            });
        }
        Ok(())
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        self.centre.curves(given)
    }

    fn scales_with_load(&self, column: usize) -> bool {
        self.centre.scales_with_load(column)
    }
}
