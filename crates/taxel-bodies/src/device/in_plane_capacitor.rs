//! Load on one in-plane sensor to signal, by finite elements of its cross-section.

use std::sync::{Arc, OnceLock};

use crate::transduction::{FieldState, SolvedInPlane};
use taxel::device::{InPlaneArray, InPlaneLoadState, InPlanePredictor};
use taxel::electronics::{CapacitanceBoard, Delivered};
use taxel::mechanics::{LARGEST_COMPRESSION, LayerState};
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel::transduction::{InPlaneModel, VACUUM_PERMITTIVITY};
use taxel_ground::table::{Cell, Column};
use taxel_numerics::roots;

/// Response of one sensor to one load, by finite elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InPlaneFieldPrediction {
    /// The cross-section; `None` where no solved compression belongs to the load.
    pub field: Option<FieldState>,
    /// Force, N.
    pub force: Option<f64>,
    /// C₀ − C, F.
    pub change: Option<f64>,
    /// Share of the capacitance that does not lie between the facing sides as in
    /// parallel plates: 1 − ε₀ ε_r w_e (t/d)/C.
    pub fringe_share: Option<f64>,
    /// Voltage of the amplifier, V; none where capacitances are measured.
    pub voltage: Option<f64>,
    /// Number of a frame.
    pub number: Option<Delivered>,
    /// State of the sensor under the load.
    pub state: InPlaneLoadState,
}

/// Predicts loads on one sensor as drawn, by finite elements.
///
/// The way from rest is solved once: by [`Predictor::prepare`] as far as the loads ask, or
/// else at the first answer as far as the models hold.
#[derive(Debug, Clone)]
pub struct InPlaneFieldPredictor {
    /// The closed form, whose loads and columns are these.
    closed: InPlanePredictor,
    model: InPlaneModel,
    board: CapacitanceBoard,
    solved: OnceLock<Result<Solved, String>>,
    /// Compression under the greatest load of [`Predictor::prepare`]: that of the body to show.
    greatest: Option<f64>,
}

/// The solved load path with the part of it that can be read back.
#[derive(Debug, Clone)]
struct Solved {
    way: SolvedInPlane,
    /// Compression up to which a change belongs to one compression only; `None` if that lies beyond
    /// what was solved.
    invertible: Option<f64>,
    /// True if it ends there because the curve turns.
    turns: bool,
    /// True if the path was solved as far as it goes, and not only as far as loads asked.
    whole: bool,
}

impl Solved {
    fn new(way: SolvedInPlane, model: &InPlaneModel) -> Self {
        let rest = way.rest().capacitance;
        let change = |e: f64| way.at(e).map_or(f64::NAN, |state| rest - state.capacitance);
        let last = way.last().compression;
        let whole = way.ended.is_some() || last >= LARGEST_COMPRESSION * (1.0 - 1e-9);
        let range = roots::one_to_one(last, change);
        // Where the path ends before its curve turns, the fast form knows.
        let fast = model.inverse().ok();
        let turning = fast.filter(|inverse| inverse.turning().is_some());
        let turning = turning.map(|inverse| inverse.last().layer.kinematics.compression());
        let own = (whole || range.first_maximum.is_some()).then_some(range.end);
        let ends = [own, turning.filter(|_| !whole)];
        Self {
            invertible: ends
                .into_iter()
                .flatten()
                .filter(|end| *end <= last)
                .reduce(f64::min),
            turns: range.first_maximum.is_some() || turning.is_some(),
            whole,
            way,
        }
    }

    /// Compression up to which a state is read back.
    fn end(&self) -> f64 {
        self.invertible.unwrap_or(self.way.last().compression)
    }
}

impl InPlaneFieldPredictor {
    /// A predictor for the sensors of `array`; nothing is solved yet.
    pub fn new(array: &InPlaneArray<'_>) -> Self {
        Self {
            closed: InPlanePredictor::new(array),
            model: array.model(),
            board: array.board.clone(),
            solved: OnceLock::new(),
            greatest: None,
        }
    }

    /// Force on the loaded area, N.
    fn force(&self, state: &FieldState) -> f64 {
        self.model.layer.contact_area() * state.mean_stress
    }

    fn solve(
        &self,
        most: f64,
        enough: &dyn Fn(&FieldState) -> bool,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Solved, String> {
        SolvedInPlane::solve(&self.model, most, enough, progress)
            .map(|way| Solved::new(way, &self.model))
            .map_err(|error| error.to_string())
    }

    fn solved(&self) -> Result<&Solved, String> {
        self.solved
            .get_or_init(|| self.solve(LARGEST_COMPRESSION, &|_| false, &mut |_| {}))
            .as_ref()
            .map_err(Clone::clone)
    }

    /// The chain for a relative compression; without answers where the solution does not
    /// reach.
    ///
    /// # Errors
    /// A sentence when there is no solution at all.
    pub fn at_compression(&self, compression: f64) -> Result<InPlaneFieldPrediction, String> {
        let solved = self.solved()?;
        let Some(state) = solved.way.at(compression) else {
            return Ok(nothing(InPlaneLoadState::OutOfRange));
        };
        let electrodes = &self.model.electrodes;
        let facing = VACUUM_PERMITTIVITY
            * self.model.dielectric.permittivity
            * electrodes.depth
            * state.thickness
            / state.gap;
        let ambiguous = compression > solved.end() * (1.0 + 1e-12);
        Ok(InPlaneFieldPrediction {
            field: Some(state),
            force: Some(self.force(&state)),
            change: Some(solved.way.rest().capacitance - state.capacitance),
            fringe_share: Some(1.0 - facing / state.capacitance),
            voltage: self.board.voltage(state.capacitance),
            number: Some(self.board.read(state.capacitance, 0.0)),
            state: if ambiguous {
                InPlaneLoadState::Ambiguous
            } else {
                InPlaneLoadState::Ok
            },
        })
    }

    /// The chain for a pressing force, N; without answers beyond the solution.
    ///
    /// # Errors
    /// As [`InPlaneFieldPredictor::at_compression`].
    pub fn at_force(&self, force: f64) -> Result<InPlaneFieldPrediction, String> {
        let way = &self.solved()?.way;
        let last = way.last().compression;
        let misfit = |e: f64| way.at(e).map_or(f64::NAN, |state| self.force(&state)) - force;
        if force < 0.0 || misfit(last) < 0.0 {
            return Ok(nothing(InPlaneLoadState::OutOfRange));
        }
        self.at_compression(roots::ridders([0.0, last], misfit))
    }

    /// The way back: the state at a fall C₀ − C of the capacitance, F; without answers
    /// beyond the range in which it belongs to one compression.
    ///
    /// # Errors
    /// As [`InPlaneFieldPredictor::at_compression`].
    pub fn at_change(&self, change: f64) -> Result<InPlaneFieldPrediction, String> {
        let solved = self.solved()?;
        let way = &solved.way;
        let rest = way.rest().capacitance;
        let misfit = |e: f64| way.at(e).map_or(f64::NAN, |state| rest - state.capacitance) - change;
        if change < 0.0 || misfit(solved.end()) < 0.0 {
            return Ok(nothing(if solved.turns {
                InPlaneLoadState::Ambiguous
            } else {
                InPlaneLoadState::OutOfRange
            }));
        }
        self.at_compression(roots::ridders([0.0, solved.end()], misfit))
    }

    /// The layer of the closed form at a compression, for the columns that compare.
    fn closed_form(&self, compression: f64) -> Option<LayerState> {
        self.model.layer.compress(compression).ok()
    }

    fn fill(&self, answer: &InPlaneFieldPrediction, row: &mut Vec<Cell>) {
        let field = answer.field;
        let layer = field.and_then(|state| self.closed_form(state.compression));
        let kinematics = layer.map(|layer| layer.kinematics);
        row.extend([
            cell(field.map(|state| state.compression)),
            cell(kinematics.map(|k| k.unknown())),
            cell(kinematics.map(|k| k.top_stretch())),
            cell(answer.force),
            cell(field.map(|state| state.mean_stress)),
            cell(field.map(|state| state.gap)),
            cell(field.map(|state| state.thickness)),
            cell(field.map(|state| state.capacitance)),
            cell(answer.change),
            cell(layer.and_then(|layer| self.model.change_as_published(&layer))),
            cell(layer.and_then(|layer| self.model.change_of_parallel_plates(&layer))),
        ]);
        let capacitance = field.map(|state| state.capacitance);
        self.closed.signal_cells(capacitance, answer.number, row);
        row.push(Cell::State(answer.state.name()));
    }
}

fn nothing(state: InPlaneLoadState) -> InPlaneFieldPrediction {
    InPlaneFieldPrediction {
        field: None,
        force: None,
        change: None,
        fringe_share: None,
        voltage: None,
        number: None,
        state,
    }
}

fn cell(value: Option<f64>) -> Cell {
    value.map_or_else(|| Cell::Missing, Cell::Number)
}

impl Predictor for InPlaneFieldPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let mut greatest = [0.0_f64; 4];
        for row in 0..loads.len() {
            if let Ok((column, value)) = InPlanePredictor::given(&loads.load(row)) {
                greatest[column] = greatest[column].max(value);
            }
        }
        let [displacement, compression, force, change] = greatest;
        let compression = compression.max(displacement / self.model.layer.thickness);
        let backwards = force > 0.0 || change > 0.0;
        // Nothing asked is answered on the way to the first states.
        let least = 0.01;
        let most = if backwards {
            LARGEST_COMPRESSION
        } else {
            compression.clamp(least, LARGEST_COMPRESSION)
        };
        let enough = |state: &FieldState| {
            // A change can turn: the whole way says where.
            change == 0.0 && state.compression >= compression && self.force(state) >= force
        };
        let solved = self.solve(most, &enough, progress)?;
        let remark = solved.way.ended.as_ref().map(|reason| {
            format!(
                "the solution ended at a compression of {:.4}: {reason}",
                solved.way.last().compression
            )
        });
        self.solved = OnceLock::from(Ok(solved));
        let by_force = self.at_force(force)?.field;
        let by_change = self.at_change(change)?.field;
        let reached = [by_force, by_change].into_iter().flatten();
        self.greatest = Some(reached.fold(compression, |most, state| state.compression.max(most)));
        Ok(remark)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        self.closed.load_columns()
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        self.closed.combination(given)
    }

    fn columns(&self) -> Vec<Column> {
        let length = |name: &str| Column::new(name, "um", 1e-6, "m", 4);
        let mut columns = self.closed.common_columns();
        columns.extend([
            length("gap_bottom"),
            length("gap_top"),
            length("mean_thickness"),
            length("width"),
            Column::new("fringe_share", "", 1.0, "", 5),
            length("side_face_on_base"),
            Column::new("greatest_stress", "kPa", 1e3, "pa", 2),
        ]);
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        let (column, value) = InPlanePredictor::given(load)?;
        let answer = match column {
            0 => self.at_compression(value / self.model.layer.thickness),
            1 => self.at_compression(value),
            2 => self.at_force(value),
            _ => self.at_change(value),
        };
        let refused = |message: String| LoadRefused {
            column,
            message,
            help: "change the drawing, or use the closed form".into(),
        };
        let answer = answer.map_err(refused)?;
        self.fill(&answer, row);
        let solved = self.solved().map_err(refused)?;
        let way = &solved.way;
        let last = solved.invertible.and_then(|end| way.at(end));
        row.extend([
            cell(last.map(|last| way.rest().capacitance - last.capacitance)),
            cell(last.map(|last| self.force(&last))),
            cell(solved.whole.then(|| self.force(way.last()))),
        ]);
        let field = answer.field;
        row.extend([
            cell(field.map(|state| state.gap_bottom)),
            cell(field.map(|state| state.gap_top)),
            cell(field.map(|state| state.mean_thickness)),
            cell(field.map(|state| state.width)),
            cell(answer.fringe_share),
            cell(field.map(|state| state.on_base)),
            cell(field.map(|state| state.greatest_stress)),
        ]);
        Ok(())
    }

    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        let solved = self.solved.get().and_then(|solved| solved.as_ref().ok());
        let Some(solved) = solved else {
            return Ok(Vec::new());
        };
        let last = solved.way.last().compression;
        // The path was solved a little beyond the load, or far beyond it for the way back.
        let load = self.greatest.filter(|load| (1e-6..last).contains(load));
        let body = match load {
            Some(load) => self.solve(load, &|_| false, &mut |_| {})?.way.body,
            None => solved.way.body.clone(),
        };
        let shown = |body| Arc::new(body) as Arc<dyn SolvedBody>;
        Ok(body.map(shown).into_iter().collect())
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        self.closed.curves(given)
    }
}
