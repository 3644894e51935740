//! Calibration of any chain of stages from readings under known loads.
//!
//! The parameters are the numbers that the parts name themselves; readings go through the whole
//! chain, cover and network included.

mod result;

use std::collections::HashMap;
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
use taxel::mechanics::{ForceAxes, LoadHistory};
use taxel::predict::LoadColumn;
use taxel::quantity as unit;
use taxel::sensor::{Element, Sensor};
use taxel::stage::{CellLoad, Chain, PartParameter};
use taxel_numerics::Noise;
use taxel_numerics::least_squares::{FitError, Parameter, Prior, Problem, fit};

/// The column that says which cell a row is of.
const TAXEL: &str = "taxel";
/// ... and which of its channels, where it has several.
const CHANNEL_OF: &str = "channel";

columns! {
    TIME = quantity("time", &unit::TIME, 1e12, "clock of the readings");
    NUMBER = number(TAXEL, [0.0, 65535.0], "which cell, row by row from 0; without it the middle one");
    PRESSURE = quantity("pressure", &unit::STRESS, 1e9, "on the pitch of that cell alone");
    CHANNEL = number(CHANNEL_OF, [0.0, 65535.0], "which channel of that taxel, from 0, where it has several; without it the first");
    FORCE_X = quantity("force_x", &unit::FORCE, 1e6, "side force on that taxel along x, of one that has it");
    FORCE_Y = quantity("force_y", &unit::FORCE, 1e6, "side force along y");
    FORCE_Z = quantity("force_z", &unit::FORCE, 1e6, "pressing force on the pitch of that cell, in place of the pressure");
    COUNTS = number("counts", [-4294967295.0, 4294967295.0], "of the board, of that cell's channel");
    VOLTAGE = quantity("voltage", &unit::VOLTAGE, 1e6, "at the converter, in place of the counts");
    CAPACITANCE = size("capacitance", &unit::CAPACITANCE, 1.0, "of a board that gives capacitances");
    RESISTANCE = size("resistance", &unit::RESISTANCE, 1e18, "of a board that gives resistances");
    PORT_PRESSURE = quantity("port_pressure", &unit::STRESS, 1e9, "of a board that gives pressures");
    FLUX_DENSITY = quantity("flux_density", &unit::FLUX_DENSITY, 1e3, "of a board of magnetometers");
    COUNTS_DEVIATION = number("counts_deviation", [0.0, 4294967295.0], "standard deviation of the counts");
    CAPACITANCE_DEVIATION = size("capacitance_deviation", &unit::CAPACITANCE, 1.0, "standard deviation of the capacitance");
    VOLTAGE_DEVIATION = size("voltage_deviation", &unit::VOLTAGE, 1e6, "standard deviation of the voltage");
    RESISTANCE_DEVIATION = size("resistance_deviation", &unit::RESISTANCE, 1e18, "standard deviation of the resistance");
    PORT_DEVIATION = size("port_pressure_deviation", &unit::STRESS, 1e9, "standard deviation of the pressure");
    FLUX_DENSITY_DEVIATION = size("flux_density_deviation", &unit::FLUX_DENSITY, 1e3, "standard deviation of the flux density");
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
    chain: Chain,
    /// Deviations of what is made, by the name of the number.
    fabrication: Vec<(String, f64)>,
}

/// One reading of a channel of a taxel under a load on it alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    taxel: usize,
    /// Among all of the array.
    channel: usize,
    /// Along x and y, N, and pressing, Pa or N.
    load: [f64; 3],
    /// Signal of the channel, SI.
    signal: f64,
    deviation: Option<f64>,
    marked: bool,
}

impl Reading {
    /// Pressing, Pa or N.
    fn pressure(&self) -> f64 {
        self.load[2]
    }
}

impl OfSeries for Reading {
    fn series(&self) -> usize {
        self.channel
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
        let mut loads = vec![0.0; chain.count()];
        let (count, first) = (chain.axes.count(), chain.axes.first());
        let per_taxel = chain.channels_per_taxel();
        // The channels of a taxel are read under the same loads.
        let mut known: HashMap<(usize, [u64; 3]), Vec<f64>> = HashMap::new();
        let signal = |reading: &Reading| {
            let taxel = reading.taxel;
            let under = (taxel, reading.load.map(f64::to_bits));
            let signals = known.entry(under).or_insert_with(|| {
                let own = count * taxel..count * (taxel + 1);
                loads[own.clone()].copy_from_slice(&reading.load[first..]);
                let signals = chain.respond(&loads).signals;
                loads[own].fill(0.0);
                signals[per_taxel * taxel..per_taxel * (taxel + 1)].to_vec()
            });
            signals[reading.channel - per_taxel * taxel]
        };
        self.readings.iter().map(signal).collect()
    }
}

impl Bench<'_> {
    /// The same with what each channel reads more than the model throughout, where a taxel has several:
    /// a field of the bench and offsets of the chips are no number of the skin.
    fn follow(&self, at: &[f64]) -> Vec<f64> {
        let mut predicted = self.predict(at);
        if self.chain.channel_of(0).is_some() {
            return predicted;
        }
        let mut sums = vec![[0.0; 2]; self.chain.channels()];
        for ((reading, signal), noise) in self.readings.iter().zip(&predicted).zip(&self.noise) {
            let weight = noise.powi(-2);
            let [sum, weights] = sums[reading.channel];
            sums[reading.channel] = [sum + weight * (reading.signal - signal), weights + weight];
        }
        for (reading, signal) in self.readings.iter().zip(&mut predicted) {
            let [sum, weights] = sums[reading.channel];
            *signal += sum / weights;
        }
        predicted
    }
}

impl Problem for Bench<'_> {
    fn readings(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let predicted = self.follow(at);
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
        let device = named.sensor.cells().ok()?;
        Some(Self {
            named,
            chain: device.chain().clone(),
            fabrication: device.fabrication().to_vec(),
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
        parameters(&mut self.named.sensor.element.clone(), &mut take);
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
            Quantity::FluxDensity => (FLUX_DENSITY, FLUX_DENSITY_DEVIATION, "flux_density [T]"),
            _ => (VOLTAGE, VOLTAGE_DEVIATION, "voltage [V]"),
        }
    }

    /// Signal of what is at the input of the last stage.
    fn signal(&self, input: f64) -> f64 {
        self.chain.readout.signal(input)
    }

    /// The pressing load as people read it: its column, unit, SI value, and SI unit.
    fn pressing(&self) -> (&'static str, &'static str, f64, &'static str) {
        match self.chain.cell(0).load() {
            CellLoad::Pressure => ("pressure", "kPa", 1e3, "Pa"),
            CellLoad::Force => ("force_z", "N", 1.0, "N"),
        }
    }

    /// What messages call a series of readings.
    fn series_name(&self, of: &[Reading]) -> String {
        let Some(first) = of.first() else {
            return String::new();
        };
        let (taxel, per_taxel) = (first.taxel, self.chain.channels_per_taxel());
        if per_taxel == 1 {
            format!("taxel {taxel}")
        } else {
            format!(
                "taxel {taxel}, channel {}",
                first.channel - per_taxel * taxel
            )
        }
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

    /// The channels of a taxel are read at the same times.
    fn group(&self) -> &'static str {
        if self.chain.channels_per_taxel() > 1 {
            CHANNEL_OF
        } else {
            TAXEL
        }
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
        let (pressing, shown, size, _) = self.pressing();
        let has_sides = self.chain.axes == ForceAxes::Xyz;
        let sides = if has_sides {
            "channel,force_x [N],force_y [N],"
        } else {
            ""
        };
        let _ = writeln!(text, "time [s],{TAXEL},{sides}{pressing} [{shown}],{title}");
        let law = hysteresis::synthetic(options.hysteresis);
        let mut taxels = vec![0, self.middle()];
        taxels.dedup();
        let per_taxel = self.chain.channels_per_taxel();
        let channels =
            |taxel: usize| (per_taxel * taxel..per_taxel * (taxel + 1)).map(move |at| (taxel, at));
        for (taxel, channel) in taxels.into_iter().flat_map(channels) {
            let full_scale = self.chain.full_scale;
            let load = |index: usize| {
                let pressed = triangle(options.phase(index)) * full_scale;
                // A side force of a quarter of what presses, along x and y in turn.
                let side = |axis: usize| {
                    if has_sides && index % 3 == axis + 1 {
                        0.25 * pressed
                    } else {
                        0.0
                    }
                };
                [side(0), side(1), pressed]
            };
            let readings: Vec<Reading> = (0..options.readings)
                .map(|index| Reading {
                    taxel,
                    channel,
                    load: load(index),
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
                let carried = reading.pressure() * law.share(&history.push(reading.pressure()));
                let off = options.drifted(range, index) + options.noise * range * noise.normal();
                let [x, y, _] = reading.load;
                let sides = if has_sides {
                    format!("{},{x:.6},{y:.6},", channel - per_taxel * taxel)
                } else {
                    String::new()
                };
                let _ = writeln!(
                    text,
                    "{:.1},{taxel},{sides}{:.6},{:.9e}",
                    0.1 * index as f64,
                    carried / size,
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
            let taxels = self.chain.layout.taxels();
            if taxel >= taxels {
                let message = format!("there is no taxel {taxel}; the array has {taxels}");
                return Err(table.error(TAXEL, message, "count row by row from 0"));
            }
            let per_taxel = self.chain.channels_per_taxel();
            let channel = table
                .number(row, CHANNEL)
                .map_or(0, |channel| channel as usize);
            if channel >= per_taxel {
                let message = format!("there is no channel {channel}; a taxel has {per_taxel}");
                return Err(table.error("channel", message, "count from 0, as in a frame"));
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
            let side = |column| table.number(row, column).unwrap_or(0.0);
            let load = [side(FORCE_X), side(FORCE_Y), pressure];
            if load.iter().any(|load| load.abs() > self.chain.full_scale) {
                left_out.push(table.line(row));
                continue;
            }
            readings.push(Reading {
                taxel,
                channel: per_taxel * taxel + channel,
                load,
                signal: self.signal(input),
                deviation: table
                    .positive(row, deviation)
                    .map(|sigma| self.chain.readout.deviation(sigma)),
                marked: table.flag(row, HOLD_OUT),
            });
        }
        let what =
            "rows without load or reading, or beyond the full_scale of the element, are left out";
        remarks.extend(Remark::from_here_on(&left_out, what));
        for of in crate::split::by_series(&readings) {
            let rows: Vec<([f64; 3], f64)> = of.iter().map(|r| (r.load, r.signal)).collect();
            let name = self.series_name(&of);
            follows(table, COLUMNS[column].name, &name, &rows)?;
        }
        Ok(((), readings))
    }

    fn loading(&self, (): &(), of: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
        let loads: Vec<f64> = of.iter().map(Reading::pressure).collect();
        let unloading: Vec<bool> = branches(&loads)
            .iter()
            .map(|branch| *branch == Branch::Unloading)
            .collect();
        let name = self.series_name(of);
        on_loading(&name, of, &unloading, "", remarks)
    }

    fn loads(&self, (): &(), of: &[Reading]) -> Vec<Loads> {
        vec![Loads {
            name: self.series_name(of),
            column: self.pressing().0,
            unit: (self.pressing().1, self.pressing().2),
            values: of.iter().map(Reading::pressure).collect(),
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
                .fabrication
                .iter()
                .find(|(name, deviation)| name == part.name && *deviation > 0.0)
                .map(|(_, deviation)| Prior {
                    value: drawn,
                    deviation: part.off(drawn, *deviation).abs(),
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
    parameters(
        &mut sensor.element,
        &mut |parameter, number| match value(parameter.name) {
            Some(found) => *number = found,
            None if parameter.fitted => missing = Some(parameter.name.to_owned()),
            None => {}
        },
    );
    missing.map_or(Ok(()), Err)
}

/// Shows each number of an element that is a chain to `each`, which may change it.
fn parameters(element: &mut Element, each: &mut dyn FnMut(PartParameter, &mut f64)) {
    match element {
        Element::Cells(cells) => cells.parameters(each),
        Element::MagneticSkin(skin) => skin.parameters(each),
        Element::Body(body) => body.parameters(each),
        _ => {}
    }
}
