//! Pressure on the surface to the signals of both layers, stage by stage.

use super::loads::{AREA_COLUMN, FORCE_Z, LOADED_SHARE, LOADS, PRESSURE, is_local, pressure_of};
use super::{LAYERS, MicrochannelArray};
use crate::device::{number_cell, number_column};
use crate::electronics::{Delivered, DividerBoard};
use crate::mechanics::{
    ClosingState, LinearElastic, MicrochannelClosed, MicrochannelError, MicrochannelSection,
    SectionClosure, SolvedBody, SolvedLayer, SolvedVoids, Stretch, VoidStack,
};
use crate::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor};
use crate::table::{Cell, Column};
use crate::transduction::MicrochannelLayer;

/// Response of a microchannel of each layer to one pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct MicrochannelPrediction {
    /// Pressure on the surface, Pa.
    pub pressure: f64,
    /// Area ratio by the closed form of P4 (Eq. 1), or the pressure at which
    /// it ends.
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
    /// The loaded part.
    pub loaded: SectionClosure,
    /// Area ratio of the thinnest section of the loaded part, where known.
    pub thinnest: Option<f64>,
    /// Smallest distance between roof and floor, m; only finite elements know it.
    pub gap: Option<f64>,
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
    pub state: LayerState,
}

/// State of a layer under a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerState {
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

impl LayerState {
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

/// Predicts loads on channels as drawn.
#[derive(Debug, Clone)]
pub struct MicrochannelPredictor {
    layers: [MicrochannelLayer; 2],
    board: DividerBoard,
    section: MicrochannelSection,
    closed_form: LinearElastic,
    field: Option<Field>,
}

/// The layers as finite elements see them.
#[derive(Debug, Clone)]
struct Field {
    /// The drawing; or why it can't be solved.
    stack: Result<VoidStack, String>,
    /// Which of the upper and the lower layer the rows are, which the columns.
    position: [usize; 2],
    solved: Option<SolvedVoids>,
}

impl MicrochannelPredictor {
    /// A predictor for the channels of `array`.
    pub fn new(array: &MicrochannelArray<'_>) -> Self {
        Self {
            layers: array.layers.clone(),
            board: array.board,
            section: array.element.section(),
            closed_form: array.element.closed_form,
            field: None,
        }
    }

    /// Makes the channels of both layers higher by these lengths, m, and with them nothing but
    /// their resistance, as [`crate::sensor::Microchannel::fabricate`] does.
    pub(super) fn heighten(&mut self, by: [f64; 2]) {
        for (layer, by) in self.layers.iter_mut().zip(by) {
            layer.conductor.section.height += by;
        }
    }

    /// The same with the closing of both layers solved by finite elements of the
    /// crossing cell, the whole top pressed.
    pub fn by_finite_elements(array: &MicrochannelArray<'_>) -> Self {
        Self {
            field: Some(Field {
                stack: array.void_stack(),
                position: array.position(),
                solved: None,
            }),
            ..Self::new(array)
        }
    }

    /// Solves up to a pressure in Pa on the whole top.
    ///
    /// # Errors
    /// A sentence when there is no solution.
    pub fn solve(
        &mut self,
        pressure: f64,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let Some(field) = &mut self.field else {
            return Ok(None);
        };
        let stack = field.stack.as_ref().map_err(Clone::clone)?;
        let solved = stack
            .solve(pressure, progress)
            .map_err(|error| error.to_string())?;
        for (layer, position) in self.layers.iter_mut().zip(field.position) {
            layer.along(solved.layers[position].closing.clone());
        }
        let ended = solved.ended.clone();
        field.solved = Some(solved);
        Ok(ended)
    }

    fn solved_layer(&self, number: usize) -> Option<&SolvedLayer> {
        let field = self.field.as_ref()?;
        Some(&field.solved.as_ref()?.layers[field.position[number]])
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
        let [rows, columns] = &self.layers;
        Ok(MicrochannelPrediction {
            pressure,
            closed_form: self
                .section
                .published_area_ratio(&self.closed_form, pressure),
            layers: [
                self.layer(rows, 0, pressure, share)?,
                self.layer(columns, 1, pressure, share)?,
            ],
        })
    }

    fn layer(
        &self,
        layer: &MicrochannelLayer,
        number: usize,
        pressure: f64,
        share: f64,
    ) -> Result<LayerAnswer, MicrochannelError> {
        let stretches = [
            Stretch { share, pressure },
            Stretch {
                share: 1.0 - share,
                pressure: 0.0,
            },
        ];
        let response = layer.respond(&stretches)?;
        let loaded = response.channel.sections[0];
        let solved = self.solved_layer(number);
        let resistance = response.resistance;
        let signal = self.board.signal.of(resistance);
        let state = match loaded.state {
            _ if self.board.saturated(signal) => LayerState::Saturated,
            ClosingState::Beyond { .. } => LayerState::Beyond,
            ClosingState::Closed => LayerState::Closed,
            ClosingState::Open | ClosingState::Bulging => LayerState::Open,
        };
        Ok(LayerAnswer {
            internal_pressure: layer.initial_pressure + response.channel.internal_pressure,
            volume_ratio: response.channel.volume_ratio,
            loaded,
            thinnest: layer.thinnest_of(&loaded),
            gap: solved.and_then(|s| s.gap(loaded.net_pressure, self.section.height)),
            resistance,
            change: response.change,
            signal,
            number: self.board.read(resistance, 0.0),
            state,
        })
    }
}

impl Predictor for MicrochannelPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        if self.field.is_none() {
            return Ok(None);
        }
        let pressures = (0..loads.len()).map(|row| pressure_of(&loads.load(row)).1);
        let greatest = pressures.fold(0.0, f64::max);
        if greatest == 0.0 {
            return Ok(None);
        }
        self.solve(greatest, progress)
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

    fn scales_with_load(&self, column: usize) -> bool {
        matches!(column, PRESSURE | FORCE_Z)
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = vec![
            Column::new("pressure", "kPa", 1e3, "pa", 3),
            Column::new("loaded_share", "", 1.0, "", 4),
            Column::new("closed_form_change", "", 1.0, "", 4),
        ];
        for layer in LAYERS {
            let of = |what: &str| format!("{layer}_{what}");
            columns.extend([
                Column::new(of("net_pressure"), "kPa", 1e3, "pa", 4),
                Column::new(of("internal_pressure"), "kPa", 1e3, "pa", 4),
                Column::new(of("area_ratio"), "", 1.0, "", 4),
                Column::new(of("thinnest_ratio"), "", 1.0, "", 3),
                Column::new(of("volume_ratio"), "", 1.0, "", 4),
                Column::new(of("resistance"), "ohm", 1.0, "ohm", 4),
                Column::new(of("change"), "", 1.0, "", 5),
            ]);
            columns.extend(signal_columns(layer, &self.board, 3));
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
        if self.field.is_some() {
            for layer in LAYERS {
                columns.push(Column::new(format!("{layer}_gap"), "um", 1e-6, "m", 3));
            }
            columns.push(Column::new("greatest_stress", "kPa", 1e3, "pa", 3));
        }
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let share = load.number(LOADED_SHARE).unwrap_or(1.0);
        let (column, pressure) = pressure_of(load);
        let answer = self.predict(pressure, share).map_err(|error| LoadRefused {
            column,
            message: error.to_string(),
            help: String::from("give a pressure of zero or more"),
        })?;
        row.push(Cell::Number(pressure));
        row.push(Cell::Number(share));
        row.push(match answer.closed_form {
            Ok(ratio) => Cell::Number(share * (1.0 / ratio - 1.0)),
            Err(_) => Cell::from("closed"),
        });
        for (layer, drawn) in answer.layers.iter().zip(&self.layers) {
            row.extend(
                [
                    layer.loaded.net_pressure,
                    layer.internal_pressure,
                    layer.loaded.area_ratio,
                ]
                .map(Cell::Number),
            );
            row.push(layer.thinnest.map_or(Cell::from(""), Cell::Number));
            row.push(Cell::Number(layer.volume_ratio));
            row.push(Cell::Number(layer.resistance));
            // Of a bound only the resistance is reported; a signal that is only
            // known to be larger would look like a reading.
            if layer.state == LayerState::Beyond {
                let signal = signal_columns("", &self.board, 0).len();
                row.extend(std::iter::repeat_n(Cell::from(""), 1 + signal));
            } else {
                row.push(Cell::Number(layer.change));
                row.extend(signal_cells(layer.signal, &layer.number, &self.board));
            }
            row.push(Cell::from(layer.state.name()));
            row.push(Cell::Number(drawn.closing.end()[0]));
        }
        let closing = self.section.closing_pressure(&self.closed_form);
        row.push(Cell::Number(closing));
        let signal = &self.board.signal;
        row.push(Cell::Number(signal.resistance(self.board.saturation)));
        if let Some(field) = &self.field {
            let number = |value: Option<f64>| value.map_or(Cell::from(""), Cell::Number);
            row.extend(answer.layers.iter().map(|layer| number(layer.gap)));
            // The stress belongs to the load on the whole top.
            let solved = field.solved.as_ref().filter(|_| share == 1.0);
            row.push(number(solved.and_then(|solved| solved.stress(pressure))));
        }
        Ok(())
    }

    fn reading_columns(&self) -> Vec<String> {
        let voltage = self.board.signal.is_voltage();
        let what = if voltage { "voltage" } else { "resistance" };
        LAYERS.map(|layer| format!("{layer}_{what}")).to_vec()
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        let share = load.number(LOADED_SHARE).unwrap_or(1.0);
        let answer = self.predict(pressure_of(load).1, share);
        answer.is_ok_and(|answer| answer.layers.iter().any(|layer| layer.number.clipped))
    }

    fn bodies(&self) -> Vec<&SolvedBody> {
        let solved = self.field.as_ref().and_then(|field| field.solved.as_ref());
        solved.map(|solved| &solved.body).into_iter().collect()
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

/// Columns of the signal of a channel: the voltage, where there is a divider, and the number
/// of a frame.
pub(super) fn signal_columns(prefix: &str, board: &DividerBoard, decimals: usize) -> Vec<Column> {
    let voltage = || Column::new(format!("{prefix}_voltage"), "mV", 1e-3, "v", decimals);
    let voltage = board.signal.is_voltage().then(voltage);
    let number = number_column(&format!("{prefix}_"), "", &board.last);
    voltage.into_iter().chain([number]).collect()
}

/// Their cells.
pub(super) fn signal_cells(signal: f64, number: &Delivered, board: &DividerBoard) -> Vec<Cell> {
    let voltage = board.signal.is_voltage().then_some(Cell::Number(signal));
    let number = number_cell(number, &board.last);
    voltage.into_iter().chain([number]).collect()
}
