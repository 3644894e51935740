//! Calibration of any array of cells from readings under known pressures.
//!
//! The parameters are the numbers that the parts name themselves; readings go through the whole
//! chain, cover and network included.

mod result;

use std::fmt::Write as _;

use crate::device_model::{
    Calibratable, DeviceModel, DeviceReadings, Fitted, Model, ReadingsOf, Task,
};
use crate::hysteresis::{self, on_loading};
use crate::loads::{LEAST_SPAN, Loads};
use crate::options::{CalibrateOptions, NamedSensor, SyntheticOptions};
use crate::readings::{ReadingTable, columns, hold_out, number, quantity, size};
use crate::remark::Remark;
use crate::split::{Branch, OfSeries, branches};
use crate::synthetic::{triangle, truth};
use crate::table_checks::follows;
use taxel::InputError;
use taxel::acquisition::Quantity;
use taxel::electronics::LastStage;
use taxel::mechanics::LoadHistory;
use taxel::predict::LoadColumn;
use taxel::quantity as unit;
use taxel::sensor::{Element, Sensor};
use taxel::stage::{Cells, Chain, PartParameter};
use taxel_numerics::Noise;
use taxel_numerics::least_squares::{FitError, Parameter, Prior, Problem, fit};

/// The column that says which cell a row is of.
const TAXEL: &str = "taxel";

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the readings");
    NUMBER = number(TAXEL, [0.0, 65535.0], "which cell, row by row from 0; without it the middle one");
    PRESSURE = quantity("pressure", &unit::STRESS, 1e9, "on the pitch of that cell alone");
    FORCE_Z = quantity("force_z", &unit::FORCE, 1e6, "pressing force on the pitch of that cell, in place of the pressure");
    COUNTS = number("counts", [-4294967295.0, 4294967295.0], "of the board, of that cell's channel");
    VOLTAGE = quantity("voltage", &unit::VOLTAGE, 1e6, "at the converter, in place of the counts");
    CAPACITANCE = size("capacitance", &unit::CAPACITANCE, 1.0, "of a board that gives capacitances");
    RESISTANCE = size("resistance", &unit::RESISTANCE, 1e18, "of a board that gives resistances");
    PORT_PRESSURE = quantity("port_pressure", &unit::STRESS, 1e9, "of a board that gives pressures");
    COUNTS_DEVIATION = number("counts_deviation", [0.0, 4294967295.0], "standard deviation of the counts");
    CAPACITANCE_DEVIATION = size("capacitance_deviation", &unit::CAPACITANCE, 1.0, "standard deviation of the capacitance");
    VOLTAGE_DEVIATION = size("voltage_deviation", &unit::VOLTAGE, 1e6, "standard deviation of the voltage");
    RESISTANCE_DEVIATION = size("resistance_deviation", &unit::RESISTANCE, 1e18, "standard deviation of the resistance");
    PORT_DEVIATION = size("port_pressure_deviation", &unit::STRESS, 1e9, "standard deviation of the pressure");
    HOLD_OUT = hold_out();
}

static MODELS: [Model; 1] = [Model {
    name: "cells",
    about: "the law of the cells, through cover, network and readout",
}];

/// Share of a fitted number that matters: what is known no better is not identified.
const MATTERS: f64 = 0.1;

/// Calibrates an array of cells.
pub(super) struct CellsCalibrator<'a> {
    named: &'a NamedSensor<'a>,
    cells: &'a Cells,
    chain: Chain,
}

/// One reading of the channel of a cell under a pressure on it alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    taxel: usize,
    /// Pa.
    pressure: f64,
    /// Signal of the channel, SI.
    signal: f64,
    deviation: Option<f64>,
    marked: bool,
}

impl OfSeries for Reading {
    fn series(&self) -> usize {
        self.taxel
    }

    fn is_marked(&self) -> bool {
        self.marked
    }
}

/// The readings as a least-squares problem.
struct Bench<'a> {
    chain: &'a Chain,
    readings: &'a [Reading],
    names: Vec<&'static str>,
    noise: Vec<f64>,
}

impl Bench<'_> {
    /// Signals of all readings, each with its cell pressed alone.
    fn predict(&self, at: &[f64]) -> Vec<f64> {
        let mut chain = self.chain.clone();
        chain.parameters(&mut |parameter, value| {
            if let Some(place) = self.names.iter().position(|name| *name == parameter.name) {
                *value = at[place];
            }
        });
        let mut pressures = vec![0.0; chain.count()];
        let signal = |reading: &Reading| {
            pressures[reading.taxel] = reading.pressure;
            let signal = chain.respond(&pressures).signals[reading.taxel];
            pressures[reading.taxel] = 0.0;
            signal
        };
        self.readings.iter().map(signal).collect()
    }
}

impl Problem for Bench<'_> {
    fn readings(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let predicted = self.predict(at);
        let pairs = self.readings.iter().zip(predicted).zip(&self.noise);
        for (residual, ((reading, signal), noise)) in residuals.iter_mut().zip(pairs) {
            *residual = (reading.signal - signal) / noise;
        }
        residuals.iter().all(|residual| residual.is_finite())
    }

    fn remedy(&self, _together: &[usize]) -> String {
        String::from("read each cell at rest, at small pressures and up to the full scale")
    }
}

impl<'a> CellsCalibrator<'a> {
    /// `None` for a sensor of another kind.
    pub(super) fn new(named: &'a NamedSensor<'a>) -> Option<Self> {
        let Element::Cells(cells) = &named.sensor.element else {
            return None;
        };
        let chain = named.sensor.cells().ok()?.chain().clone();
        Some(Self {
            named,
            cells,
            chain,
        })
    }

    /// The numbers of the parts that readings can tell, with their values as drawn.
    fn fitted(&self) -> Vec<(PartParameter, f64)> {
        let mut found = Vec::new();
        let mut take = |parameter: PartParameter, value: &mut f64| {
            if parameter.fitted {
                found.push((parameter, *value));
            }
        };
        self.cells.clone().parameters(&mut take);
        found
    }

    fn bench<'b>(&'b self, readings: &'b [Reading]) -> Bench<'b> {
        Bench {
            chain: &self.chain,
            readings,
            names: self
                .fitted()
                .iter()
                .map(|(parameter, _)| parameter.name)
                .collect(),
            noise: readings
                .iter()
                .map(|reading| reading.deviation.unwrap_or(self.chain.deviation()))
                .collect(),
        }
    }

    /// Column of the readings and of their deviation, and its unit in a table.
    fn column(&self) -> (usize, usize, &'static str) {
        match self.chain.last.unit().quantity {
            Quantity::Counts if matches!(self.chain.last, LastStage::Instrument(_)) => {
                (COUNTS, COUNTS_DEVIATION, "counts")
            }
            Quantity::Capacitance => (CAPACITANCE, CAPACITANCE_DEVIATION, "capacitance [F]"),
            Quantity::Resistance => (RESISTANCE, RESISTANCE_DEVIATION, "resistance [ohm]"),
            Quantity::Pressure => (PORT_PRESSURE, PORT_DEVIATION, "port_pressure [Pa]"),
            _ => (VOLTAGE, VOLTAGE_DEVIATION, "voltage [V]"),
        }
    }

    /// Signal of what is at the input of the last stage.
    fn signal(&self, input: f64) -> f64 {
        self.chain.readout.signal(input)
    }

    fn middle(&self) -> usize {
        let layout = &self.chain.layout;
        layout.rows / 2 * layout.columns + layout.columns / 2
    }
}

impl Calibratable for CellsCalibrator<'_> {
    fn columns(&self) -> &'static [LoadColumn] {
        &COLUMNS
    }

    fn group(&self) -> &'static str {
        TAXEL
    }

    fn models(&self) -> &'static [Model] {
        &MODELS
    }

    /// Readings of the middle cell and of a corner, one after the other. The pressure goes up and
    /// down as a triangle to the full scale; on unloading less of it gives the same reading.
    fn synthetic(&self, options: &SyntheticOptions) -> String {
        let mut noise = Noise::seeded(options.seed);
        let mut text = options.head(&["hysteresis", "drift"]);
        for (parameter, value) in self.fitted() {
            text.push_str(&truth(parameter.name, value, parameter.unit));
        }
        let (.., title) = self.column();
        let _ = writeln!(text, "time [s],{TAXEL},pressure [kPa],{title}");
        let law = hysteresis::synthetic(options.hysteresis);
        let mut taxels = vec![0, self.middle()];
        taxels.dedup();
        for taxel in taxels {
            let loads = (0..options.readings)
                .map(|index| triangle(options.phase(index)) * self.chain.full_scale);
            let readings: Vec<Reading> = loads
                .map(|pressure| Reading {
                    taxel,
                    pressure,
                    signal: 0.0,
                    deviation: None,
                    marked: false,
                })
                .collect();
            let at: Vec<f64> = self.fitted().iter().map(|(_, value)| *value).collect();
            let signals = self.bench(&readings).predict(&at);
            let range = crate::loads::span(signals.iter().copied());
            let mut history = LoadHistory::default();
            for (index, (reading, signal)) in readings.iter().zip(signals).enumerate() {
                let carried = reading.pressure * law.share(&history.push(reading.pressure));
                let off = options.drifted(range, index) + options.noise * range * noise.normal();
                let _ = writeln!(
                    text,
                    "{:.1},{taxel},{:.6},{:.9e}",
                    0.1 * index as f64,
                    carried * 1e-3,
                    self.chain.input(signal + off)
                );
            }
        }
        text
    }
}

impl DeviceReadings for CellsCalibrator<'_> {
    type Reading = Reading;
    type Context = ();

    fn readings(
        &self,
        table: &ReadingTable,
        remarks: &mut Vec<Remark>,
    ) -> Result<ReadingsOf<Self>, InputError> {
        let (column, deviation, _) = self.column();
        let counted = column == VOLTAGE && table.given[COUNTS];
        if !table.given[column] && !counted {
            let name = COLUMNS[column].name;
            let help = format!(
                "give a column {} of the channel of each row",
                COLUMNS[column].title()
            );
            return Err(table.error(name, format!("there is no column {name}"), &help));
        }
        let scale = self.chain.last.scale();
        let mut left_out = Vec::new();
        let mut readings = Vec::with_capacity(table.len());
        for row in 0..table.len() {
            let taxel = table
                .number(row, NUMBER)
                .map_or(self.middle(), |taxel| taxel as usize);
            if taxel >= self.chain.count() {
                let message = format!(
                    "there is no taxel {taxel}; the array has {}",
                    self.chain.count()
                );
                return Err(table.error(TAXEL, message, "count row by row from 0"));
            }
            let of_force = || Some(table.number(row, FORCE_Z)? / self.chain.area());
            let input = || match table.number(row, column) {
                None => table.number(row, COUNTS).map(|counts| scale.input(counts)),
                input => input,
            };
            let Some((pressure, input)) =
                table.number(row, PRESSURE).or_else(of_force).zip(input())
            else {
                left_out.push(table.line(row));
                continue;
            };
            if pressure > self.chain.full_scale {
                left_out.push(table.line(row));
                continue;
            }
            readings.push(Reading {
                taxel,
                pressure,
                signal: self.signal(input),
                deviation: table
                    .positive(row, deviation)
                    .map(|sigma| self.chain.readout.deviation(sigma)),
                marked: table.flag(row, HOLD_OUT),
            });
        }
        let what =
            "rows without pressure or reading, or beyond element.cells.full_scale, are left out";
        remarks.extend(Remark::from_here_on(&left_out, what));
        for of in crate::split::by_series(&readings) {
            let rows: Vec<([f64; 1], f64)> = of.iter().map(|r| ([r.pressure], r.signal)).collect();
            let name = of
                .first()
                .map_or(String::new(), |r| format!("taxel {}", r.taxel));
            follows(table, COLUMNS[column].name, &name, &rows)?;
        }
        Ok(((), readings))
    }

    fn loading(&self, (): &(), of: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
        let loads: Vec<f64> = of.iter().map(|reading| reading.pressure).collect();
        let unloading: Vec<bool> = branches(&loads)
            .iter()
            .map(|branch| *branch == Branch::Unloading)
            .collect();
        let name = of
            .first()
            .map_or(String::new(), |r| format!("taxel {}", r.taxel));
        on_loading(&name, of, &unloading, "", remarks)
    }

    fn loads(&self, (): &(), of: &[Reading]) -> Vec<Loads> {
        vec![Loads {
            name: of
                .first()
                .map_or(String::new(), |r| format!("taxel {}", r.taxel)),
            column: "pressure",
            unit: ("kPa", 1e3),
            values: of.iter().map(|reading| reading.pressure).collect(),
            least: self.fitted().len() + 3,
            span: LEAST_SPAN,
            from_rest: true,
        }]
    }
}

impl DeviceModel for CellsCalibrator<'_> {
    type Noise = ();

    const CURVED: bool = true;

    fn sensors(&self) -> Vec<(&NamedSensor<'_>, &str)> {
        vec![(self.named, "")]
    }

    fn fit(&self, task: &Task<'_, Self>) -> Result<Fitted<Reading, ()>, FitError> {
        let given = task
            .readings
            .iter()
            .all(|reading| reading.deviation.is_some());
        let options = CalibrateOptions::fitting(task.options, given);
        let parameter = |(part, drawn): (PartParameter, f64)| Parameter {
            unit: part.unit,
            bounds: part.bounds,
            size: MATTERS
                * match part.bounds {
                    // Of an offset its range says what matters, and not where it lies.
                    [low, high] if low < 0.0 && high > 0.0 => 0.5 * (high - low),
                    _ if drawn == 0.0 => 1.0,
                    _ => drawn.abs(),
                },
            // What is known of the make is known before the readings.
            prior: self
                .cells
                .fabrication
                .get(part.name)
                .filter(|share| share.0 > 0.0)
                .map(|share| Prior {
                    value: drawn,
                    deviation: share.0 * drawn.abs(),
                }),
            ..Parameter::new(part.name, drawn)
        };
        let mut parameters: Vec<Parameter> = self.fitted().into_iter().map(parameter).collect();
        if let Some(from) = task.from {
            for (parameter, value) in parameters.iter_mut().zip(from.fit.values()) {
                parameter.start = value;
            }
        }
        let found = fit(&self.bench(task.readings), &parameters, &options)?;
        Ok(Fitted {
            model: task.model,
            parameters,
            fit: found,
            readings: task.readings.to_vec(),
            options,
            given,
            noise: (),
        })
    }

    fn problem<'b>(
        &'b self,
        (): &'b (),
        fitted: &'b Fitted<Reading, ()>,
    ) -> Option<Box<dyn Problem + 'b>> {
        Some(Box::new(self.bench(&fitted.readings)))
    }
}

/// Puts calibrated values in the place of those of the sensor file.
///
/// # Errors
/// The name of a parameter that is missing.
pub(super) fn apply(
    sensor: &mut Sensor,
    value: &dyn Fn(&str) -> Option<f64>,
) -> Result<(), String> {
    let mut missing = None;
    if let Element::Cells(cells) = &mut sensor.element {
        cells.parameters(&mut |parameter, number| match value(parameter.name) {
            Some(found) => *number = found,
            None if parameter.fitted => missing = Some(parameter.name.to_owned()),
            None => {}
        });
    }
    missing.map_or(Ok(()), Err)
}
