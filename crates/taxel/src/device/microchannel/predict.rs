//! Pressure on the surface to the signals of both layers, stage by stage.

use super::loads::{
    AREA_COLUMN, FORCE_Z, LOADED_SHARE, LOADS, PRESSURE, SECOND, is_double, is_local, pressure_of,
    shortest_part, stretches_of, whole_top_error,
};
use super::{LAYERS, MicrochannelArray};
use crate::device::{number_cell, number_column};
use crate::electronics::{Delivered, DividerBoard};
use crate::mechanics::{
    ClosingCurve, ClosingState, LinearElastic, MicrochannelClosed, MicrochannelError,
    MicrochannelSection, SectionClosure, Stretch,
};
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor};
use crate::quantity::below;
use crate::sensor::micrometres;
use crate::table::{Cell, Column};
use crate::transduction::MicrochannelLayer;

/// Response of a microchannel of each layer to one pressure, or to several on parts of it.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelPrediction {
    /// Pressure on the surface, Pa; that of the first part.
    pub pressure: f64,
    /// Area ratio of the first part by the closed form of P4 (Eq. 1), or the pressure at
    /// which it ends.
    pub closed_form: Result<f64, MicrochannelClosed>,
    /// The row and the column layer.
    pub layers: [LayerAnswer; 2],
}

/// A channel of one layer under load.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerAnswer {
    /// Pressure of the liquid, Pa.
    pub internal_pressure: f64,
    /// Volume over the volume at rest: the mean area ratio of the channel.
    pub volume_ratio: f64,
    /// The parts, in the order they were given.
    pub parts: Vec<PartAnswer>,
    /// Resistance without leads, Ω.
    pub resistance: f64,
    /// Relative change R/R₀ − 1 of the channel.
    pub change: f64,
    /// Signal of the channel: the voltage of the divider, V, or the resistance that is
    /// measured, with its leads, Ω.
    pub signal: f64,
    /// Number of a frame.
    pub number: Delivered,
    /// State of the layer under the load.
    pub state: MicrochannelLayerState,
}

/// A part of a channel under one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartAnswer {
    /// Its sections.
    pub loaded: SectionClosure,
    /// Area ratio of its thinnest section, where known.
    pub thinnest: Option<f64>,
}

/// State of a layer under a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MicrochannelLayerState {
    /// Open over the whole width.
    Open,
    /// The roof touches the floor; the corners are open.
    Closed,
    /// Closed further than the curve is known: areas are upper bounds,
    /// resistance and voltage lower ones.
    Beyond,
    /// The voltage counts as saturated.
    Saturated,
}

impl MicrochannelLayerState {
    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
            Self::Beyond => "beyond_curve",
            Self::Saturated => "saturated",
        }
    }
}

/// Change of resistance from which on a channel counts as closed by Eq. 1, which goes on to infinity.
const CLOSED: f64 = 1e3;

/// Predicts loads on channels as drawn.
#[derive(Debug, Clone)]
pub struct MicrochannelPredictor {
    layers: [MicrochannelLayer; 2],
    board: DividerBoard,
    section: MicrochannelSection,
    closed_form: LinearElastic,
    /// Thickness of the stack, m.
    thickness: f64,
    /// Loads that press at once on parts of a channel in the answers, 1 or 2.
    loads_at_once: usize,
}

impl MicrochannelPredictor {
    /// A predictor for the channels of `array`.
    pub fn new(array: &MicrochannelArray<'_>) -> Self {
        Self {
            layers: array.layers.clone(),
            board: array.board,
            section: array.element.section(),
            closed_form: array.element.closed_form,
            thickness: array.element.thickness(),
            loads_at_once: 1,
        }
    }

    /// Makes the channels of both layers higher by these lengths, m, and with them nothing but
    /// their resistance, as [`crate::sensor::Microchannel::fabricate`] does.
    pub(super) fn heighten(&mut self, by: [f64; 2]) {
        for (layer, by) in self.layers.iter_mut().zip(by) {
            layer.conductor.section.height += by;
        }
    }

    /// Models of the row and of the column layer.
    pub fn layers(&self) -> &[MicrochannelLayer; 2] {
        &self.layers
    }

    /// Takes closing curves of the row and of the column layer that know the sections along a
    /// channel, in the place of those of the drawing.
    pub fn along(&mut self, closing: [ClosingCurve; 2]) {
        for (layer, closing) in self.layers.iter_mut().zip(closing) {
            layer.along(closing);
        }
    }

    /// Loads that press at once on parts of a channel in the answers, 1 or 2.
    pub fn loads_at_once(&self) -> usize {
        self.loads_at_once
    }

    /// Takes as many loads at once as these rows name.
    pub fn expect(&mut self, loads: &Loads) {
        self.loads_at_once = 1 + usize::from(is_double(&loads.given.columns));
    }

    /// The chain for a pressure in Pa on `share` of the length of a channel;
    /// nothing presses on the rest of it.
    ///
    /// # Errors
    /// [`MicrochannelError`] for a pull, or a share outside 0 to 1.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("liquid-metal-2x4").unwrap();
    /// let predictor = taxel::device::MicrochannelPredictor::new(&sensor.microchannels().unwrap());
    /// let answer = predictor.predict(25e3, 1.0)?;
    /// // At the least load of the sweep of P4 the upper channels have twice
    /// // their resistance; Eq. 1 calls them closed.
    /// assert!((answer.layers[1].change - 1.002).abs() < 1e-3);
    /// assert!(answer.closed_form.is_err());
    /// # Ok::<(), taxel::mechanics::MicrochannelError>(())
    /// ```
    pub fn predict(
        &self,
        pressure: f64,
        share: f64,
    ) -> Result<MicrochannelPrediction, MicrochannelError> {
        let rest = Stretch {
            share: 1.0 - share,
            pressure: 0.0,
        };
        self.predict_parts(&[Stretch { share, pressure }, rest])
    }

    /// The chain for pressures on several parts of a channel at once; the shares of all parts
    /// sum to 1, so that the unloaded one is among them.
    ///
    /// Each part closes by its own net pressure p − P, all have the same liquid, and the
    /// resistance is the integral along the channel: nothing is superposed. Holds where parts
    /// are long beside the depth of the channels (`docs/theory/microchannel.md`, section 9).
    ///
    /// # Errors
    /// [`MicrochannelError`] for a pull, or shares that do not sum to 1.
    ///
    /// ```
    /// use taxel::mechanics::Stretch;
    /// let sensor = taxel::sensor::Sensor::shipped("liquid-metal-2x4").unwrap();
    /// let predictor = taxel::device::MicrochannelPredictor::new(&sensor.microchannels().unwrap());
    /// let part = |share, pressure| Stretch { share, pressure };
    /// let one = |pressure| predictor.predict(pressure, 0.1).unwrap().layers[1].change;
    /// let both = predictor.predict_parts(&[part(0.1, 3e3), part(0.1, 6e3), part(0.8, 0.0)])?;
    /// // The common liquid resists twice as much: less than the sum of both alone.
    /// assert!(both.layers[1].change < one(3e3) + one(6e3));
    /// # Ok::<(), taxel::mechanics::MicrochannelError>(())
    /// ```
    pub fn predict_parts(
        &self,
        parts: &[Stretch],
    ) -> Result<MicrochannelPrediction, MicrochannelError> {
        let [rows, columns] = &self.layers;
        let pressure = parts.first().map_or(0.0, |part| part.pressure);
        Ok(MicrochannelPrediction {
            pressure,
            closed_form: self
                .section
                .published_area_ratio(&self.closed_form, pressure),
            layers: [self.layer(rows, parts)?, self.layer(columns, parts)?],
        })
    }

    fn layer(
        &self,
        layer: &MicrochannelLayer,
        stretches: &[Stretch],
    ) -> Result<LayerAnswer, MicrochannelError> {
        let response = layer.respond(stretches)?;
        let sections = &response.channel.sections;
        let resistance = response.resistance;
        let signal = self.board.signal.of(resistance);
        let any = |state: fn(&ClosingState) -> bool| sections.iter().any(|at| state(&at.state));
        let state = if self.board.saturated(signal) {
            MicrochannelLayerState::Saturated
        } else if any(|state| matches!(state, ClosingState::Beyond { .. })) {
            MicrochannelLayerState::Beyond
        } else if any(|state| matches!(state, ClosingState::Closed)) {
            MicrochannelLayerState::Closed
        } else {
            MicrochannelLayerState::Open
        };
        let part = |loaded: &SectionClosure| PartAnswer {
            loaded: *loaded,
            thinnest: layer.thinnest_of(loaded),
        };
        Ok(LayerAnswer {
            internal_pressure: layer.initial_pressure + response.channel.internal_pressure,
            volume_ratio: response.channel.volume_ratio,
            parts: sections.iter().map(part).collect(),
            resistance,
            change: response.change,
            signal,
            number: self.board.read(resistance, 0.0),
            state,
        })
    }

    /// Relative change of resistance by the closed form of P4 (Eq. 1), each part by its own
    /// pressure, or a word where it ends.
    fn closed_form_change(&self, stretches: &[Stretch]) -> Cell {
        let change = |part: &Stretch| {
            let ratio = self
                .section
                .published_area_ratio(&self.closed_form, part.pressure)?;
            Ok(part.share * (1.0 / ratio - 1.0))
        };
        let changes: Result<Vec<f64>, MicrochannelClosed> = stretches.iter().map(change).collect();
        let sum = changes.map(|changes| changes.iter().sum::<f64>());
        match sum {
            Ok(sum) if sum < CLOSED => Cell::Number(sum),
            _ => Cell::from("closed"),
        }
    }

    /// A remark where a load presses on a part of a channel so short that its ends matter.
    fn short_part(&self, loads: &Loads) -> Option<String> {
        let shortest = shortest_part(self.thickness);
        let smallest = shares(loads).reduce(f64::min)?;
        let lengths = self.layers.iter().map(|layer| layer.conductor.length);
        let length = smallest * lengths.fold(f64::INFINITY, f64::min);
        below(length, shortest).then(|| {
            format!(
                "loaded_share = {smallest} is a part of {}; its ends carry load that the closed form leaves out, and the error that \
                 taxel check states is for parts of {} or more; --mechanics fem answers for a patch (patch_x, patch_y)",
                micrometres(length),
                micrometres(shortest)
            )
        })
    }

    /// A remark where a load presses on the whole top, which the closing curves of one layer alone
    /// answer too low.
    fn whole_top(&self, loads: &Loads) -> Option<String> {
        let whole = (0..loads.len()).any(|row| {
            let share = loads.load(row).number(LOADED_SHARE);
            share.is_none_or(|share| share >= 1.0)
        });
        let errors = self.layers.iter();
        let errors = errors.filter_map(|layer| whole_top_error(&layer.closing, &layer.liquid));
        let error = errors.reduce(f64::max).filter(|_| whole)?;
        Some(format!(
            "the closing curves leave the other layer out: with the whole top pressed the changes of resistance are too small \
             by up to {:.0} % until half the area is closed; --mechanics fem and taxel tabulate solve both layers",
            100.0 * error
        ))
    }

    /// Columns of the signal of a channel: the voltage, where there is a divider, and the number
    /// of a frame.
    pub fn signal_columns(&self, prefix: &str, decimals: usize) -> Vec<Column> {
        let board = &self.board;
        let voltage = || Column::new(format!("{prefix}_voltage"), "mV", 1e-3, "v", decimals);
        let voltage = board.signal.is_voltage().then(voltage);
        let number = number_column(&format!("{prefix}_"), "", &board.last);
        voltage.into_iter().chain([number]).collect()
    }

    /// Their cells.
    pub fn signal_cells(&self, signal: f64, number: &Delivered) -> Vec<Cell> {
        let board = &self.board;
        let voltage = board.signal.is_voltage().then_some(Cell::Number(signal));
        let number = number_cell(number, &board.last);
        voltage.into_iter().chain([number]).collect()
    }

    /// Names of a quantity of each load: the second has the suffix of its columns.
    pub fn of_each(&self, what: &str) -> impl Iterator<Item = String> {
        let suffixes = ["", "_2"].into_iter().take(self.loads_at_once);
        suffixes.map(move |suffix| format!("{what}{suffix}"))
    }
}

/// What `of` answers of each load of all rows; of a column from 0 or from [`SECOND`] on.
fn each<'l, T: 'l>(
    loads: &'l Loads,
    of: impl Fn(&Load<'_>, usize) -> T + Copy + 'l,
) -> impl Iterator<Item = T> + 'l {
    (0..loads.len()).flat_map(move |row| {
        let load = loads.load(row);
        [0, SECOND].map(|first| of(&load, first))
    })
}

/// Shares of the length of a channel that all loads press on, where they are given.
fn shares(loads: &Loads) -> impl Iterator<Item = f64> {
    each(loads, |load, first| load.number(first + LOADED_SHARE)).flatten()
}

impl Predictor for MicrochannelPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        _progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        self.expect(loads);
        Ok(self.short_part(loads).or_else(|| self.whole_top(loads)))
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        if is_local(given) {
            return Err(String::from(
                "only finite elements know what a patch or a punch on a part of the sheet does: add --mechanics fem, \
                 or give a pressure with the loaded_share of the channels",
            ));
        }
        let has = |column: usize| given.get(column) == Some(&true);
        if is_double(given) {
            let second = &given[SECOND..];
            one_load(second).map_err(|problem| {
                format!("of the second load (columns that end in _2, words in 2): {problem}")
            })?;
            if !(has(LOADED_SHARE) && has(SECOND + LOADED_SHARE)) {
                return Err(String::from(
                    "two loads press on parts of the microchannels that lie beside each other: give loaded_share of the \
                     first and loaded_share_2 of the second, such as \"p=10 kPa, share=0.1, p2=20 kPa, share2=0.2\"",
                ));
            }
        }
        one_load(given)
    }

    fn scales_with_load(&self, column: usize) -> bool {
        matches!(column % SECOND, PRESSURE | FORCE_Z)
    }
    fn columns(&self) -> Vec<Column> {
        let pressures = |name: String| Column::new(name, "kPa", 1e3, "pa", 4);
        let ratios = |name: String| Column::new(name, "", 1.0, "", 4);
        let pressure = |name: String| Column::new(name, "kPa", 1e3, "pa", 3);
        let mut columns: Vec<Column> = self.of_each("pressure").map(pressure).collect();
        columns.extend(self.of_each("loaded_share").map(ratios));
        columns.push(ratios(String::from("closed_form_change")));
        for layer in LAYERS {
            let of = |what: &str| format!("{layer}_{what}");
            columns.extend(self.of_each(&of("net_pressure")).map(pressures));
            columns.push(pressures(of("internal_pressure")));
            columns.extend(self.of_each(&of("area_ratio")).map(ratios));
            let thinnest = |name: String| Column::new(name, "", 1.0, "", 3);
            columns.extend(self.of_each(&of("thinnest_ratio")).map(thinnest));
            columns.extend([
                Column::new(of("volume_ratio"), "", 1.0, "", 4),
                Column::new(of("resistance"), "ohm", 1.0, "ohm", 4),
                Column::new(of("change"), "", 1.0, "", 5),
            ]);
            columns.extend(self.signal_columns(layer, 3));
            columns.extend([
                Column::plain(of("state")),
                Column::new(of("curve_ends_at_net_pressure"), "kPa", 1e3, "pa", 4),
            ]);
        }
        columns.push(Column::new(
            "closed_form_ends_at_pressure",
            "kPa",
            1e3,
            "pa",
            4,
        ));
        let ohm = "ohm";
        columns.push(Column::new("saturates_at_resistance", ohm, 1.0, ohm, 4));
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let stretches = stretches_of(load)?;
        let (column, _) = pressure_of(load, 0);
        let answer = self
            .predict_parts(&stretches)
            .map_err(|error| LoadRefused {
                column,
                message: error.to_string(),
                help: String::from("give a pressure of zero or more"),
            })?;
        let number = |value: Option<f64>| value.map_or(Cell::Missing, Cell::Number);
        // All but the last part, on which nothing presses.
        let loads = || (0..self.loads_at_once).map(|load| (load, load + 1 < stretches.len()));
        let of_loads = |of: &dyn Fn(usize) -> Option<f64>| -> Vec<Cell> {
            let cells = loads().map(|(load, there)| number(of(load).filter(|_| there)));
            cells.collect()
        };
        row.extend(of_loads(&|load| Some(stretches.get(load)?.pressure)));
        row.extend(of_loads(&|load| Some(stretches.get(load)?.share)));
        row.push(self.closed_form_change(&stretches));
        for (layer, drawn) in answer.layers.iter().zip(&self.layers) {
            let part = |load: usize| layer.parts.get(load);
            row.extend(of_loads(&|load| Some(part(load)?.loaded.net_pressure)));
            row.push(Cell::Number(layer.internal_pressure));
            row.extend(of_loads(&|load| Some(part(load)?.loaded.area_ratio)));
            row.extend(of_loads(&|load| part(load)?.thinnest));
            row.push(Cell::Number(layer.volume_ratio));
            row.push(Cell::Number(layer.resistance));
            // Of a bound only the resistance is reported; a signal that is only
            // known to be larger would look like a reading.
            if layer.state == MicrochannelLayerState::Beyond {
                let signal = self.signal_columns("", 0).len();
                row.extend(std::iter::repeat_n(Cell::Missing, 1 + signal));
            } else {
                row.push(Cell::Number(layer.change));
                row.extend(self.signal_cells(layer.signal, &layer.number));
            }
            row.push(Cell::State(layer.state.name()));
            row.push(Cell::Number(drawn.closing.end()[0]));
        }
        let closing = self.section.closing_pressure(&self.closed_form);
        row.push(Cell::Number(closing));
        let signal = &self.board.signal;
        row.push(Cell::Number(signal.resistance(self.board.saturation)));
        Ok(())
    }

    fn reading_columns(&self) -> Vec<String> {
        let voltage = self.board.signal.is_voltage();
        let what = if voltage { "voltage" } else { "resistance" };
        LAYERS.map(|layer| format!("{layer}_{what}")).to_vec()
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        let Ok(stretches) = stretches_of(load) else {
            return false;
        };
        let answer = self.predict_parts(&stretches);
        answer.is_ok_and(|answer| answer.layers.iter().any(|layer| layer.number.clipped))
    }

    fn curves(&self, _given: &[bool]) -> Vec<Curve> {
        let mut curves = vec![
            Curve {
                title: String::from("Relative change of resistance against pressure"),
                x: "pressure",
                y: vec!["row_change", "column_change"],
                y_label: "R/R0 - 1",
            },
            Curve {
                title: String::from("The same by P4 Eq. 1, up to its closing pressure"),
                x: "pressure",
                y: vec!["closed_form_change"],
                y_label: "R/R0 - 1",
            },
        ];
        if self.board.signal.is_voltage() {
            curves.push(Curve {
                title: String::from("Voltage against pressure"),
                x: "pressure",
                y: vec!["row_voltage", "column_voltage"],
                y_label: "voltage",
            });
        }
        curves
    }
}

/// Checks that the columns of one load say how hard it presses.
fn one_load(given: &[bool]) -> Result<(), String> {
    let has = |column: usize| given.get(column) == Some(&true);
    match (has(PRESSURE), has(FORCE_Z), has(AREA_COLUMN)) {
        (true, false, false) | (false, true, true) => Ok(()),
        (false, true, false) => Err(String::from(
            "a force says nothing without the area that it presses on: the microchannels respond to pressure; \
             give the area too, such as \"fz=25 mN, area=1 mm2\", or the pressure",
        )),
        (false, false, _) => Err(String::from(
            "no load is given; name a pressure, or a force_z and its area",
        )),
        (true, _, _) => Err(String::from(
            "a pressure and a force or an area are given; name a pressure alone, or a force_z and its area",
        )),
    }
}
