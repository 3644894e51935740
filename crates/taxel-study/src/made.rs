//! Answers of devices that are not made as drawn, beside those of the drawing.
//!
//! Lengths and gains are normal, moduli of materials log-normal with their interval as 95 %.
//! The same random numbers as in [`crate::tolerance`]: normal, cut at three standard deviations as
//! the twin cuts them, from a seed.

use std::sync::Arc;

use taxel::InputError;
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel::sensor::Sensor;
use taxel::solutions::TablesOnly;
use taxel::table::{Cell, Column};
use taxel_material::Material;

use crate::plans::{draw, seeded};
use crate::spread::{normal_below, normal_quantile};
use crate::tolerance::quantile;

/// Made devices, unless the caller says otherwise: the 5 % quantile of a normal answer has a
/// standard error of 0.07 of its deviation then.
pub const DEVICES: usize = 1000;
/// Standard deviations at which what is made is sorted out.
const CUT: f64 = 3.0;
/// Quantiles that are stated, with the names that [`crate::tolerance`] gives them.
const QUANTILES: [(&str, f64); 2] = [("quantile_5", 0.05), ("quantile_95", 0.95)];

/// A predictor that adds to each number of its answers the interval that the deviations in the
/// table `fabrication` of the sensor file leave: 5 and 95 % of the made devices lie below its ends.
pub struct MadeDevices {
    drawn: Box<dyn Predictor>,
    devices: Vec<Box<dyn Predictor>>,
    /// Places of the numbers among the answers.
    numbers: Vec<usize>,
}

impl MadeDevices {
    /// `count` devices of the drawing of `sensor`, whose answers `drawn` gives; none for a device whose
    /// sensor file states no deviation and names no material with an interval. `text` is the sensor file
    /// with its name, where its materials are not known better from a calibration.
    ///
    /// # Errors
    /// A made device that is no sensor, or needs a solution of its own.
    pub fn new(
        sensor: &Sensor,
        text: Option<(&str, &str)>,
        drawn: Box<dyn Predictor>,
        count: usize,
        seed: u64,
    ) -> Result<Option<Self>, String> {
        let mut random = seeded(seed);
        let [low, high] = [-CUT, CUT].map(normal_below);
        let mut normal = || normal_quantile(low + draw(&mut random) * (high - low));
        let said = |error: &dyn std::fmt::Display| format!("a made device: {error}");
        let scattered = match text {
            Some((name, text)) => scattered(name, text).map_err(|error| said(&error))?,
            None => Vec::new(),
        };
        let mut devices = Vec::with_capacity(count);
        for _ in 0..count {
            let piece = match text.filter(|_| !scattered.is_empty()) {
                None => None,
                Some((name, text)) => {
                    let factors: Vec<f64> = scattered
                        .iter()
                        .map(|(_, [median, width])| (median + width * normal()).exp())
                        .collect();
                    let factor = |material: &Material| {
                        let mut all = scattered.iter().zip(&factors);
                        all.find(|((known, _), _)| known == material)
                            .map_or(1.0, |(_, factor)| *factor)
                    };
                    let made = Sensor::made_of(name, text, &factor, &mut TablesOnly);
                    Some(made.map_err(|error| said(&error.message))?)
                }
            };
            let device = piece.as_ref().unwrap_or(sensor).device();
            let device = device.map_err(|error| said(&error))?;
            let of_law = || piece.is_some().then(|| device.predictor()).flatten();
            match device.made(&mut normal).or_else(of_law) {
                Some(predictor) => devices.push(predictor),
                None => return Ok(None),
            }
        }
        // Words, counts and states have no unit and no decimals.
        let is_number = |column: &Column| column.decimals > 0;
        let columns = drawn.columns();
        let numbers = (0..columns.len()).filter(|place| is_number(&columns[*place]));
        Ok(Some(Self {
            numbers: numbers.collect(),
            drawn,
            devices,
        }))
    }
}

/// The materials with an interval that a sensor file names, each once, with their
/// [`Material::scatter`].
fn scattered(name: &str, text: &str) -> Result<Vec<(Material, [f64; 2])>, InputError> {
    let mut found: Vec<(Material, [f64; 2])> = Vec::new();
    for used in taxel_material::used(name, text)? {
        if let Some(scatter) = used.material.scatter()
            && !found.iter().any(|(known, _)| *known == used.material)
        {
            found.push((used.material, scatter));
        }
    }
    Ok(found)
}

impl Predictor for MadeDevices {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        self.drawn.prepare(loads, progress)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        self.drawn.load_columns()
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        self.drawn.combination(given)
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = self.drawn.columns();
        let beside: Vec<Column> = self
            .numbers
            .iter()
            .flat_map(|place| {
                let column = &columns[*place];
                QUANTILES.map(|(quantile, _)| {
                    let name = format!("{}_{quantile}", column.name);
                    Column::new(name, column.unit, column.scale, column.si, column.decimals)
                })
            })
            .collect();
        columns.extend(beside);
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        self.drawn.answer(load, row)?;
        let mut values = vec![Vec::with_capacity(self.devices.len()); self.numbers.len()];
        let mut made = Vec::new();
        for device in &self.devices {
            made.clear();
            // A made device may end where the drawn one does not: it has no number there.
            if device.answer(load, &mut made).is_err() {
                continue;
            }
            for (values, place) in values.iter_mut().zip(&self.numbers) {
                if let Some(Cell::Number(value)) = made.get(*place)
                    && value.is_finite()
                {
                    values.push(*value);
                }
            }
        }
        for mut values in values {
            values.sort_by(f64::total_cmp);
            for (_, share) in QUANTILES {
                row.push(if values.is_empty() {
                    Cell::Missing
                } else {
                    Cell::Number(quantile(&values, share))
                });
            }
        }
        Ok(())
    }

    fn pictures(&self, load: &Load<'_>) -> Vec<(String, String)> {
        self.drawn.pictures(load)
    }

    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        self.drawn.bodies()
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        self.drawn.curves(given)
    }

    fn scales_with_load(&self, column: usize) -> bool {
        self.drawn.scales_with_load(column)
    }
}
