//! Loads on channels answered by finite elements: the whole top, a patch, a punch.

use std::sync::Arc;

use crate::mechanics::microchannel_block::{BlockState, BlockVoid};

use super::local::{self, ArrayBlock};
use super::whole_top::WholeTopPredictor;
use crate::mechanics::{LocalLoad, LocalLoads, SolvedBlock};
use taxel::device::microchannel_loads::{LOADS, is_local};
use taxel::device::{LAYERS, MicrochannelArray};
use taxel::electronics::DividerBoard;
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel::transduction::{MicrochannelLayer, mean_inverse_area_ratio};
use taxel_ground::table::{Cell, Column};

/// Predicts loads on channels as drawn, by finite elements.
///
/// A load on the whole top is solved in the crossing cell ([`WholeTopPredictor`]), one or two on parts of it in the block of
/// all taxels. [`Predictor::prepare`] solves.
#[derive(Debug, Clone)]
pub struct MicrochannelFieldPredictor {
    whole_top: WholeTopPredictor,
    layers: [MicrochannelLayer; 2],
    board: DividerBoard,
    array_block: Result<ArrayBlock, String>,
    /// Answers of loads on a part of the top; none while the whole top is pressed.
    solved: Option<Vec<(LocalLoads, SolvedBlock)>>,
}

impl MicrochannelFieldPredictor {
    /// A predictor for the channels of `array`; nothing is solved yet.
    pub fn new(array: &MicrochannelArray<'_>) -> Self {
        Self {
            whole_top: WholeTopPredictor::new(array),
            layers: array.layers.clone(),
            board: array.board,
            array_block: ArrayBlock::new(array),
            solved: None,
        }
    }

    /// Solves every position that is pressed up to its greatest load.
    fn solve(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let array_block = self.array_block.as_ref().map_err(Clone::clone)?;
        let solved = self.solved.insert(Vec::new());
        let mut asked: Vec<(LocalLoads, Vec<f64>)> = Vec::new();
        for index in 0..loads.len() {
            let Ok((load, value)) = array_block.read(&loads.load(index)) else {
                // It is refused with its line when it is answered.
                return Ok(None);
            };
            let known = |(known, _): &&mut (LocalLoads, Vec<f64>)| known.include(&load, value);
            match asked.iter_mut().find(known) {
                Some((_, values)) => values.push(value),
                None => asked.push((load, vec![value])),
            }
        }
        let count = asked.len() as f64;
        let mut ended = None;
        for (number, (load, values)) in asked.into_iter().enumerate() {
            let hears = &mut |part| progress((number as f64 + part) / count);
            let block = array_block
                .block
                .solve(&load, &values, hears)
                .map_err(|error| error.to_string())?;
            ended = ended.or_else(|| block.ended.clone());
            solved.push((load, block));
        }
        Ok(ended)
    }

    /// Relative change R/R₀ − 1 of a channel whose part in the block is `void`.
    fn change(&self, array_block: &ArrayBlock, layer: usize, void: &BlockVoid) -> f64 {
        let share = array_block.share(layer);
        // Nothing presses on the rest, which has the same liquid.
        let rest = self.layers[layer].closing.at(-void.inside).area_ratio;
        let parts = [(share, 1.0 / void.resistance_ratio), (1.0 - share, rest)];
        mean_inverse_area_ratio(parts) - 1.0
    }

    /// Cells of one channel.
    fn channel(
        &self,
        array_block: &ArrayBlock,
        layer: usize,
        void: &BlockVoid,
        row: &mut Vec<Cell>,
    ) {
        let drawn = &self.layers[layer];
        let change = self.change(array_block, layer, void);
        let resistance = drawn.conductor.rest_resistance() * (1.0 + change);
        let signal = self.board.signal.of(resistance);
        row.extend(
            [
                void.inside,
                void.volume_ratio,
                void.thinnest,
                void.thickest,
                void.rim,
                void.gap,
                resistance,
                change,
            ]
            .map(Cell::Number),
        );
        let number = self.board.read(resistance, 0.0);
        row.extend(self.whole_top.closed.signal_cells(signal, &number));
        row.push(Cell::State(if self.board.saturated(signal) {
            "saturated"
        } else if void.gap <= 0.0 {
            "closed"
        } else {
            "open"
        }));
    }

    fn answer_locally(
        &self,
        solved: &[(LocalLoads, SolvedBlock)],
        load: &Load<'_>,
        row: &mut Vec<Cell>,
    ) -> Result<(), LoadRefused> {
        let array_block = self
            .array_block
            .as_ref()
            .map_err(|message| local::refused(message))?;
        let (pressed, value) = array_block.read(load)?;
        let block = solved
            .iter()
            .find(|(known, _)| known.include(&pressed, value));
        let state = block.and_then(|(_, block)| block.at(value));
        let Some(state) = state else {
            // Beyond the end of the solution nothing is known.
            let open = self.columns().len() - 1;
            row.extend(std::iter::repeat_n(Cell::Missing, open));
            row.push(Cell::from("beyond_solution"));
            return Ok(());
        };
        self.block(array_block, &pressed, &state, row);
        Ok(())
    }

    /// Greatest number of loads that press at once.
    fn parts(&self) -> usize {
        let solved = self.solved.iter().flatten();
        let parts = solved.map(|(loads, _)| loads.parts.len());
        parts.max().unwrap_or(1)
    }

    /// Cells of a block in a state.
    fn block(
        &self,
        array_block: &ArrayBlock,
        pressed: &LocalLoads,
        state: &BlockState,
        row: &mut Vec<Cell>,
    ) {
        row.push(Cell::Number(state.force));
        let none = || Cell::Missing;
        for part in 0..self.parts() {
            let state = state.drives.get(part).zip(state.contact_radii.get(part));
            let load = pressed.parts.get(part).map(|(load, _)| load);
            row.extend(match (load, state) {
                (Some(LocalLoad::Patch { .. }), Some((drive, _))) => {
                    [Cell::Number(*drive), none(), none()]
                }
                (Some(LocalLoad::Punch { .. }), Some((drive, radius))) => {
                    [none(), Cell::Number(*drive), Cell::Number(*radius)]
                }
                _ => [none(), none(), none()],
            });
        }
        row.extend([0, 1].map(|layer| {
            let changes = array_block
                .channels(state, layer)
                .map(|void| self.change(array_block, layer, void));
            Cell::Number(changes.fold(f64::NEG_INFINITY, f64::max))
        }));
        for layer in 0..2 {
            for void in array_block.channels(state, layer) {
                self.channel(array_block, layer, void, row);
            }
        }
        row.push(Cell::Number(state.stress));
        row.push(Cell::from("solved"));
    }

    fn local_columns(&self) -> Vec<Column> {
        let mut columns = vec![Column::new("support_force", "mN", 1e-3, "n", 4)];
        for part in 0..self.parts() {
            let of = |what: &str| match part {
                0 => what.to_owned(),
                _ => format!("{what}_{}", part + 1),
            };
            columns.extend([
                Column::new(of("pressure"), "kPa", 1e3, "pa", 3),
                Column::new(of("punch_depth"), "um", 1e-6, "m", 3),
                Column::new(of("contact_radius"), "um", 1e-6, "m", 1),
            ]);
        }
        columns.extend([
            Column::new("row_greatest_change", "", 1.0, "", 6),
            Column::new("column_greatest_change", "", 1.0, "", 6),
        ]);
        let counts = self
            .array_block
            .as_ref()
            .map_or([0; 2], |array_block| array_block.counts);
        for (layer, count) in LAYERS.into_iter().zip(counts) {
            for number in 0..count {
                let of = |what: &str| format!("{layer}_{number}_{what}");
                columns.extend([
                    Column::new(of("internal_pressure"), "kPa", 1e3, "pa", 4),
                    Column::new(of("volume_ratio"), "", 1.0, "", 4),
                    Column::new(of("thinnest_ratio"), "", 1.0, "", 3),
                    Column::new(of("thickest_ratio"), "", 1.0, "", 3),
                    Column::new(of("rim_ratio"), "", 1.0, "", 3),
                    Column::new(of("gap"), "um", 1e-6, "m", 3),
                    Column::new(of("resistance"), "ohm", 1.0, "ohm", 5),
                    Column::new(of("change"), "", 1.0, "", 6),
                ]);
                let prefix = format!("{layer}_{number}");
                columns.extend(self.whole_top.closed.signal_columns(&prefix, 4));
                columns.push(Column::plain(of("state")));
            }
        }
        columns.push(Column::new("greatest_stress", "kPa", 1e3, "pa", 3));
        columns.push(Column::plain("solution"));
        columns
    }
}

impl Predictor for MicrochannelFieldPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        if is_local(&loads.given.columns) {
            self.solve(loads, progress)
        } else {
            self.whole_top.prepare(loads, progress)
        }
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        &LOADS
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        if is_local(given) {
            local::combination(given)
        } else {
            self.whole_top.combination(given)
        }
    }

    fn scales_with_load(&self, column: usize) -> bool {
        self.whole_top.scales_with_load(column)
    }

    fn columns(&self) -> Vec<Column> {
        match self.solved {
            Some(_) => self.local_columns(),
            None => self.whole_top.columns(),
        }
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        match &self.solved {
            Some(solved) => self.answer_locally(solved, load, row),
            None => self.whole_top.answer(load, row),
        }
    }

    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        match &self.solved {
            Some(solved) => {
                let body = |block: &SolvedBlock| Arc::new(block.body.clone()) as Arc<_>;
                Ok(solved.iter().map(|(_, block)| body(block)).collect())
            }
            None => self.whole_top.bodies(),
        }
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        if self.solved.is_none() {
            return self.whole_top.curves(given);
        }
        local::curves()
    }
}
