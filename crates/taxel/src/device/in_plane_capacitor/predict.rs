//! Load on one in-plane sensor to signal, stage by stage.

use super::InPlaneArray;
use crate::device::{number_cell, number_column};
use crate::electronics::{CapacitanceBoard, Delivered};
use crate::mechanics::{LARGEST_COMPRESSION, LayerError, LayerRange, LayerState};
use crate::predict::{Curve, Load, LoadColumn, LoadKind, LoadRefused, Predictor};
use crate::quantity::{CAPACITANCE, FORCE, LENGTH};
use crate::table::{Cell, Column};
use crate::transduction::{InPlaneError, InPlaneInverse, InPlaneModel, InPlaneState};

/// Response of one sensor to one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InPlanePrediction {
    /// The layer; `None` where no compression belongs to the load.
    pub layer: Option<LayerState>,
    /// Electrodes and capacitance under the law of the device; `None` beyond
    /// its range.
    pub response: Option<InPlaneState>,
    /// C₀ − C by mechanics, F.
    pub mechanics: Option<f64>,
    /// C₀ − C by the published law (P1's Model 1), F.
    pub model_1: Option<f64>,
    /// C₀ − C by parallel plates (P1's Model 2), F.
    pub model_2: Option<f64>,
    /// Voltage of the amplifier, V; none where capacitances are measured.
    pub voltage: Option<f64>,
    /// Number of a frame.
    pub number: Option<Delivered>,
    /// State of the sensor under the load.
    pub state: InPlaneLoadState,
}

/// State of a sensor under a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InPlaneLoadState {
    /// Within the range in which the models were verified.
    Ok,
    /// The capacitance belongs to more than one compression.
    Ambiguous,
    /// The force was not compared with finite elements: too short or too much
    /// compressed a layer.
    ForceUnverified,
    /// The capacitance model ends below this compression.
    BeyondCapacitance,
    /// No compression within the range of the models belongs to the load.
    OutOfRange,
}

impl InPlaneLoadState {
    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Ambiguous => "ambiguous",
            Self::ForceUnverified => "force_unverified",
            Self::BeyondCapacitance => "beyond_capacitance",
            Self::OutOfRange => "out_of_range",
        }
    }
}

/// Predicts loads on one sensor as drawn.
#[derive(Debug, Clone)]
pub struct InPlanePredictor {
    model: InPlaneModel,
    /// `None` only for a device that its own check refuses.
    inverse: Option<InPlaneInverse>,
    /// Force at the largest compression that a force is read back to, N.
    largest_force: Option<f64>,
    board: CapacitanceBoard,
}

impl InPlanePredictor {
    /// A predictor for the sensors of `array`.
    pub fn new(array: &InPlaneArray<'_>) -> Self {
        Self::of(array.model(), array.board.clone())
    }

    /// A predictor for one sensor with its board.
    pub(super) fn of(model: InPlaneModel, board: CapacitanceBoard) -> Self {
        Self {
            inverse: model.inverse().ok(),
            largest_force: match model.compression_from_force(f64::MAX) {
                Err(InPlaneError::Layer(LayerError::Force { limit, .. })) => Some(limit),
                _ => None,
            },
            model,
            board,
        }
    }

    /// The chain for a relative compression.
    ///
    /// # Errors
    /// [`InPlaneError::Layer`] for a compression that no layer can have.
    ///
    /// ```
    /// let sensor = taxel::sensor::Sensor::shipped("in-plane-50um").unwrap();
    /// let predictor = taxel::device::InPlanePredictor::new(&sensor.in_plane().unwrap());
    /// let pressed = predictor.at_compression(0.1)?;
    /// let rest = predictor.at_compression(0.0)?;
    /// assert!(pressed.response.unwrap().capacitance < rest.response.unwrap().capacitance);
    /// assert!(predictor.at_compression(1.0).is_err());
    /// # Ok::<(), taxel::transduction::InPlaneError>(())
    /// ```
    pub fn at_compression(&self, compression: f64) -> Result<InPlanePrediction, InPlaneError> {
        let layer = self.model.compress(compression)?;
        let response = self.model.respond(compression).ok();
        let state = self.state(&layer, response.as_ref());
        let published = Some(&layer).filter(|_| compression <= LARGEST_COMPRESSION);
        Ok(InPlanePrediction {
            layer: Some(layer),
            response,
            mechanics: self.model.change_by_mechanics(&layer).ok(),
            model_1: published.and_then(|layer| self.model.change_as_published(layer)),
            model_2: published.and_then(|layer| self.model.change_of_parallel_plates(layer)),
            voltage: response.and_then(|r| self.board.voltage(r.capacitance)),
            number: response.map(|r| self.board.read(r.capacitance, 0.0)),
            state,
        })
    }

    /// The chain for a force, N; without answers beyond the range.
    ///
    /// # Errors
    /// [`LayerError::Force`] for a pull, in an [`InPlaneError::Layer`].
    pub fn at_force(&self, force: f64) -> Result<InPlanePrediction, InPlaneError> {
        match self.model.compression_from_force(force) {
            Ok(compression) => self.at_compression(compression),
            Err(InPlaneError::Layer(LayerError::Force { limit, .. })) if force > limit => {
                Ok(nothing())
            }
            Err(error) => Err(error),
        }
    }

    /// The way back: the state at a fall C₀ − C of the capacitance, F; without
    /// answers beyond the range in which it belongs to one compression.
    ///
    /// # Errors
    /// [`InPlaneError::AboveRest`] for a rise.
    pub fn at_change(&self, change: f64) -> Result<InPlanePrediction, InPlaneError> {
        let Some(inverse) = &self.inverse else {
            return Ok(nothing());
        };
        match inverse.state_from_change(change) {
            Ok(state) => Ok(self.at_compression(state.layer.kinematics.compression())?),
            Err(InPlaneError::BeyondInvertible { .. }) => Ok(InPlanePrediction {
                state: match inverse.turning() {
                    Some(_) => InPlaneLoadState::Ambiguous,
                    None => InPlaneLoadState::OutOfRange,
                },
                ..nothing()
            }),
            Err(error) => Err(error),
        }
    }

    /// Column and value of a load, which is one value.
    ///
    /// # Errors
    /// [`LoadRefused`] of a row without one.
    pub fn given(load: &Load<'_>) -> Result<(usize, f64), LoadRefused> {
        the_load(load)
    }

    /// Columns of the answers that finite elements give too.
    pub fn common_columns(&self) -> Vec<Column> {
        columns(&self.board)
    }

    /// Cells of the signal at a capacitance in F, as [`Self::common_columns`] has them.
    pub fn signal_cells(
        &self,
        capacitance: Option<f64>,
        number: Option<Delivered>,
        row: &mut Vec<Cell>,
    ) {
        if self.board.voltage(0.0).is_some() {
            row.push(cell(capacitance.and_then(|c| self.board.voltage(c))));
        }
        row.push(match number {
            Some(number) => number_cell(&number, &self.board.last),
            None => Cell::Missing,
        });
    }

    /// The chain for the value of a column of [`LOADS`].
    fn under(&self, column: usize, value: f64) -> Result<InPlanePrediction, InPlaneError> {
        match column {
            0 => self.at_compression(value / self.model.layer.thickness),
            1 => self.at_compression(value),
            2 => self.at_force(value),
            _ => self.at_change(value),
        }
    }

    /// Largest known difference from finite elements.
    fn force_error(&self, answer: &InPlanePrediction) -> Option<f64> {
        let compression = answer.layer?.kinematics.compression();
        self.model.force_error(compression)
    }

    fn fill(&self, answer: &InPlanePrediction, row: &mut Vec<Cell>) {
        let (layer, response) = (answer.layer, answer.response);
        let kinematics = layer.map(|layer| layer.kinematics);
        row.extend([
            cell(kinematics.map(|k| k.compression())),
            cell(kinematics.map(|k| k.unknown())),
            cell(kinematics.map(|k| k.top_stretch())),
            cell(layer.map(|layer| layer.force)),
            cell(layer.map(|layer| layer.mean_stress)),
            cell(response.map(|r| r.electrodes.gap)),
            cell(response.map(|r| r.electrodes.thickness)),
            cell(response.map(|r| r.capacitance)),
            cell(answer.mechanics),
            cell(answer.model_1),
            cell(answer.model_2),
        ]);
        self.signal_cells(response.map(|r| r.capacitance), answer.number, row);
        row.push(Cell::State(answer.state.name()));
    }

    fn state(&self, layer: &LayerState, response: Option<&InPlaneState>) -> InPlaneLoadState {
        let compression = layer.kinematics.compression();
        let last = self.inverse.as_ref().map(InPlaneInverse::last);
        let invertible = last
            .is_some_and(|last| compression <= last.layer.kinematics.compression() * (1.0 + 1e-12));
        if layer.range != LayerRange::Within {
            InPlaneLoadState::ForceUnverified
        } else if response.is_none() {
            InPlaneLoadState::BeyondCapacitance
        } else if !invertible {
            InPlaneLoadState::Ambiguous
        } else {
            InPlaneLoadState::Ok
        }
    }
}

fn nothing() -> InPlanePrediction {
    InPlanePrediction {
        layer: None,
        response: None,
        mechanics: None,
        model_1: None,
        model_2: None,
        voltage: None,
        number: None,
        state: InPlaneLoadState::OutOfRange,
    }
}

const fn load(
    name: &'static str,
    short: &'static str,
    kind: LoadKind,
    about: &'static str,
) -> LoadColumn {
    LoadColumn {
        name,
        short,
        kind,
        required: false,
        about,
    }
}

pub(super) static LOADS: [LoadColumn; 4] = [
    load(
        "displacement",
        "u",
        LoadKind::Quantity(&LENGTH, [0.0, 10.0]),
        "how far the pressed face sinks",
    ),
    load(
        "compression",
        "e",
        LoadKind::Number([0.0, 1.0]),
        "displacement over layer thickness",
    ),
    load(
        "force_z",
        "fz",
        LoadKind::Quantity(&FORCE, [0.0, 1e6]),
        "pressing force",
    ),
    load(
        "capacitance_change",
        "dc",
        LoadKind::Quantity(&CAPACITANCE, [0.0, 1.0]),
        "fall of the capacitance: the way back",
    ),
];

impl Predictor for InPlanePredictor {
    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        one_load(given)
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = columns(&self.board);
        columns.push(Column::new("force_error", "%", 1e-2, "", 1));
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let (column, value) = the_load(load)?;
        let answer = self.under(column, value).map_err(|error| LoadRefused {
            column,
            message: error.to_string(),
            help: format!("the models hold up to a compression of {LARGEST_COMPRESSION}"),
        })?;
        self.fill(&answer, row);
        // What the states refer to: where the way back ends, and the layer.
        let last = self.inverse.as_ref().map(InPlaneInverse::last);
        row.extend([
            cell(last.map(|last| last.change)),
            cell(last.map(|last| last.layer.force)),
            cell(self.largest_force),
            cell(self.force_error(&answer)),
        ]);
        Ok(())
    }

    fn reading_columns(&self) -> Vec<String> {
        let voltage = self.board.voltage(0.0).is_some();
        vec![String::from(if voltage {
            "voltage"
        } else {
            "capacitance"
        })]
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        let answer = the_load(load)
            .ok()
            .and_then(|(column, value)| self.under(column, value).ok());
        let number = answer.and_then(|answer| answer.number);
        number.is_some_and(|number| number.clipped)
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        curves(given)
    }

    fn in_words(&self, column: &str) -> String {
        String::from(match column {
            "change_mechanics" => "by mechanics",
            "change_model_1" => "fit of the paper P1",
            "change_model_2" => "facing sides alone",
            column => return column.replace('_', " "),
        })
    }
}

/// Compression under a load; zero without one.
pub(super) fn compression_of(model: &InPlaneModel, load: &Load<'_>) -> Result<f64, InPlaneError> {
    match the_load(load) {
        Err(_) => Ok(0.0),
        Ok((0, displacement)) => Ok(displacement / model.layer.thickness),
        Ok((1, compression)) => Ok(compression),
        Ok((2, force)) => model.compression_from_force(force),
        Ok((_, change)) => {
            let state = model.inverse()?.state_from_change(change)?;
            Ok(state.layer.kinematics.compression())
        }
    }
}

/// A load is one value.
fn one_load(given: &[bool]) -> Result<(), String> {
    match given.iter().filter(|given| **given).count() {
        1 => Ok(()),
        count => {
            let names = LOADS.map(|column| column.name).join(", ");
            Err(format!(
                "{count} of these loads are given: {names}; give exactly one"
            ))
        }
    }
}

/// Column and value of a load.
fn the_load(load: &Load<'_>) -> Result<(usize, f64), LoadRefused> {
    (0..LOADS.len())
        .find_map(|column| Some((column, load.number(column)?)))
        .ok_or_else(|| LoadRefused {
            column: 0,
            message: "the row has no load".into(),
            help: "give one value".into(),
        })
}

/// Columns of the answers.
fn columns(board: &CapacitanceBoard) -> Vec<Column> {
    let number = |name: &str, decimals| Column::new(name, "", 1.0, "", decimals);
    let change = |name: &str| Column::new(name, "fF", 1e-15, "f", 4);
    let mut columns = vec![
        number("compression", 6),
        number("kinematic_unknown", 6),
        number("top_stretch", 6),
        Column::new("force_z", "N", 1.0, "n", 5),
        Column::new("mean_stress", "kPa", 1e3, "pa", 4),
        Column::new("gap", "um", 1e-6, "m", 4),
        Column::new("thickness", "um", 1e-6, "m", 4),
        Column::new("capacitance", "fF", 1e-15, "f", 4),
        change("change_mechanics"),
        change("change_model_1"),
        change("change_model_2"),
    ];
    if board.voltage(0.0).is_some() {
        columns.push(Column::new("voltage", "mV", 1e-3, "v", 4));
    }
    columns.extend([
        number_column("", "", &board.last),
        Column::plain("state"),
        change("invertible_change"),
        Column::new("invertible_force", "N", 1.0, "n", 5),
        Column::new("largest_force", "N", 1.0, "n", 5),
    ]);
    columns
}

/// Curves that show the answers.
fn curves(given: &[bool]) -> Vec<Curve> {
    let forward = given.get(3) != Some(&true);
    let curve = |title: &str, x, y: Vec<&'static str>, y_label| Curve {
        title: title.into(),
        x,
        y,
        y_label,
    };
    let mut curves = vec![curve(
        "Fall of the capacitance against force",
        "force_z",
        vec!["change_mechanics", "change_model_1", "change_model_2"],
        "C0 - C",
    )];
    if forward {
        curves.push(curve("Force", "compression", vec!["force_z"], "force"));
        curves.push(curve(
            "Electrodes",
            "compression",
            vec!["gap", "thickness"],
            "length",
        ));
    }
    curves
}

fn cell(value: Option<f64>) -> Cell {
    value.map_or_else(|| Cell::Missing, Cell::Number)
}
