//! Pressure on the whole top to the signals of both layers, their closing by finite elements.

use std::sync::Arc;

use crate::mechanics::{NotSolved, SolvedVoids, solve_voids};
use taxel::device::microchannel_loads::{
    LOADED_SHARE, SECOND, is_local, pressure_of, stretches_of,
};
use taxel::device::{LAYERS, MicrochannelArray, MicrochannelPrediction, MicrochannelPredictor};
use taxel::mechanics::{MicrochannelError, PressureLaw, Stretch, VoidStack};
use taxel::predict::{Curve, Load, LoadColumn, LoadRefused, Loads, Predictor, SolvedBody};
use taxel_ground::table::{Cell, Column};

/// A load on a part of a channel is solved up to so many times its pressure on the whole top.
const FARTHEST: f64 = 64.0;

/// Predicts loads on channels as drawn, with the closing of both layers solved by finite elements
/// of the crossing cell, the whole top pressed.
#[derive(Debug, Clone)]
pub struct WholeTopPredictor {
    /// The chain, with the closing curves of the drawing until something is solved.
    pub(super) closed: MicrochannelPredictor,
    /// The drawing; or why it can't be solved.
    stack: Result<VoidStack, String>,
    /// Which of the upper and the lower layer the rows are, which the columns.
    position: [usize; 2],
    solved: Option<SolvedVoids>,
}

impl WholeTopPredictor {
    /// A predictor for the channels of `array`; nothing is solved yet.
    pub fn new(array: &MicrochannelArray<'_>) -> Self {
        Self {
            closed: MicrochannelPredictor::new(array),
            stack: array.void_stack(),
            position: array.position(),
            solved: None,
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
        let stack = self.stack.as_ref().map_err(Clone::clone)?;
        let solved = solve_voids(stack, pressure, progress).map_err(|error| error.to_string())?;
        let closing = self
            .position
            .map(|layer| solved.layers[layer].closing.clone());
        self.closed.along(closing);
        let ended = solved.ended.clone();
        self.solved = Some(solved);
        Ok(ended)
    }

    /// As [`MicrochannelPredictor::predict`], by what was solved.
    ///
    /// # Errors
    /// As there.
    pub fn predict(
        &self,
        pressure: f64,
        share: f64,
    ) -> Result<MicrochannelPrediction, MicrochannelError> {
        self.closed.predict(pressure, share)
    }

    /// As [`MicrochannelPredictor::predict_parts`], by what was solved.
    ///
    /// # Errors
    /// As there.
    pub fn predict_parts(
        &self,
        parts: &[Stretch],
    ) -> Result<MicrochannelPrediction, MicrochannelError> {
        self.closed.predict_parts(parts)
    }

    /// Smallest distance between roof and floor of the rows (0) or the columns (1) under a net
    /// pressure in Pa, m; `None` beyond what was solved.
    pub fn gap(&self, layer: usize, net_pressure: f64) -> Option<f64> {
        let solved = self.solved.as_ref()?;
        solved.layers[self.position[layer]].gap(net_pressure)
    }

    /// Net pressure up to which both layers were solved, Pa.
    fn solved_net(&self) -> f64 {
        self.solved.as_ref().map_or(0.0, |solved| {
            let ends = solved.layers.iter().map(|layer| layer.closing.end()[0]);
            ends.fold(f64::INFINITY, f64::min)
        })
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

impl Predictor for WholeTopPredictor {
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        self.closed.expect(loads);
        let pressures = each(loads, |load, first| pressure_of(load, first).1);
        let greatest = pressures.fold(0.0, f64::max);
        if greatest == 0.0 {
            return Ok(None);
        }
        let remark = self.solve(greatest, progress)?;
        let shares = each(loads, |load, first| load.number(first + LOADED_SHARE));
        if remark.is_some() || shares.flatten().all(|share| share >= 1.0) {
            return Ok(remark);
        }
        // A part of a channel presses its liquid into the rest, and closes nearly by its whole load.
        let mut top = greatest;
        let mut remark = None;
        while remark.is_none() && self.solved_net() < greatest && top < FARTHEST * greatest {
            top *= 2.0;
            remark = self.solve(top, progress)?;
        }
        Ok(remark)
    }

    fn load_columns(&self) -> &'static [LoadColumn] {
        self.closed.load_columns()
    }

    fn combination(&self, given: &[bool]) -> Result<(), String> {
        let sealed = |stack: &VoidStack| stack.liquid == PressureLaw::Sealed;
        if !is_local(given) && self.stack.as_ref().is_ok_and(sealed) {
            return Err(NotSolved::Sealed.to_string());
        }
        self.closed.combination(given)
    }

    fn scales_with_load(&self, column: usize) -> bool {
        self.closed.scales_with_load(column)
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = self.closed.columns();
        for layer in LAYERS {
            let gap = |name: String| Column::new(name, "um", 1e-6, "m", 3);
            columns.extend(self.closed.of_each(&format!("{layer}_gap")).map(gap));
        }
        columns.push(Column::new("greatest_stress", "kPa", 1e3, "pa", 3));
        columns
    }

    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused> {
        self.closed.answer(load, row)?;
        let stretches = stretches_of(load)?;
        let number = |value: Option<f64>| value.map_or(Cell::Missing, Cell::Number);
        let answer = self.predict_parts(&stretches).ok();
        for layer in 0..LAYERS.len() {
            for part in 0..self.closed.loads_at_once() {
                // The last part is that on which nothing presses.
                let there = answer.as_ref().filter(|_| part + 1 < stretches.len());
                let part = there.and_then(|answer| answer.layers[layer].parts.get(part));
                row.push(number(
                    part.and_then(|part| self.gap(layer, part.loaded.net_pressure)),
                ));
            }
        }
        // The stress belongs to the load on the whole top.
        let solved = self.solved.as_ref().filter(|_| stretches[0].share == 1.0);
        let pressure = stretches[0].pressure;
        row.push(number(solved.and_then(|solved| solved.stress(pressure))));
        Ok(())
    }

    fn reading_columns(&self) -> Vec<String> {
        self.closed.reading_columns()
    }

    fn clips(&self, load: &Load<'_>) -> bool {
        self.closed.clips(load)
    }

    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        let body = |solved: &SolvedVoids| Arc::new(solved.body.clone()) as Arc<_>;
        Ok(self.solved.iter().map(body).collect())
    }

    fn curves(&self, given: &[bool]) -> Vec<Curve> {
        self.closed.curves(given)
    }
}
