//! Answers to a whole table of loads, in pieces and on all cores.

use rayon::prelude::*;
use serde_json::{Map, Value};

use super::{LoadRefused, Loads, Predictor};
use crate::table::{self, Cell, Column, Format};

/// Loads that one core answers at a time: their text stays within its cache.
const PIECE: usize = 512;
/// Pieces that are held in memory at a time.
const PIECES: usize = 64;

/// A table of loads with a predictor for it.
#[derive(Clone, Copy)]
pub struct Answers<'a> {
    predictor: &'a dyn Predictor,
    loads: &'a Loads,
}

/// Why a table of answers was not finished.
#[derive(Debug)]
pub enum Refusal<E> {
    /// The load at this index has no meaning.
    Load(usize, LoadRefused),
    /// The answers could not be taken.
    Sink(E),
}

impl<'a> Answers<'a> {
    /// Answers of `predictor` to `loads`.
    pub fn new(predictor: &'a dyn Predictor, loads: &'a Loads) -> Self {
        Self { predictor, loads }
    }

    /// Columns: those that are passed on, then the answers.
    pub fn columns(&self) -> Vec<Column> {
        let others = self.loads.given.others.iter().map(Column::plain);
        others.chain(self.predictor.columns()).collect()
    }

    /// The row of the load at `index`.
    fn row(&self, index: usize, row: &mut Vec<Cell>) -> Result<(), (usize, LoadRefused)> {
        row.clear();
        let others = self.loads.others(index);
        row.extend(others.iter().cloned().map(Cell::from));
        self.predictor
            .answer(&self.loads.load(index), row)
            .map_err(|refused| (index, refused))
    }

    /// All rows in memory.
    fn rows(&self) -> Result<Vec<Vec<Cell>>, (usize, LoadRefused)> {
        (0..self.loads.len())
            .map(|index| {
                let mut row = Vec::new();
                self.row(index, &mut row).map(|()| row)
            })
            .collect()
    }

    /// Gives the table piece by piece to `sink`, in the order of the loads and
    /// the same on any number of cores. `about` heads a JSON document.
    ///
    /// # Errors
    /// The first load that is refused; what `sink` was given then is to be
    /// thrown away. Or the error of `sink`.
    pub fn write<E: Send>(
        &self,
        format: Format,
        about: &Map<String, Value>,
        mut sink: impl FnMut(&str) -> Result<(), E>,
    ) -> Result<(), Refusal<E>> {
        let columns = self.columns();
        if format == Format::Table {
            let rows = self
                .rows()
                .map_err(|(index, why)| Refusal::Load(index, why))?;
            let text = table::render(format, about, &columns, &rows);
            return sink(&text).map_err(Refusal::Sink);
        }
        let frame = table::Frame::new(format, about, &columns);
        sink(&frame.head).map_err(Refusal::Sink)?;
        let starts: Vec<usize> = (0..self.loads.len()).step_by(PIECE).collect();
        // Used again and again: fresh memory costs more than the digits in it.
        let mut texts = vec![String::new(); PIECES.min(starts.len())];
        for starts in starts.chunks(PIECES) {
            let answered: Vec<Result<(), (usize, LoadRefused)>> = starts
                .par_iter()
                .zip(&mut texts)
                .map(|(start, text)| self.piece(&frame, *start, text))
                .collect();
            for (answered, text) in answered.into_iter().zip(&texts) {
                answered.map_err(|(index, why)| Refusal::Load(index, why))?;
                sink(text).map_err(Refusal::Sink)?;
            }
        }
        sink(frame.tail).map_err(Refusal::Sink)
    }

    /// Replaces `text` by the rows of a piece.
    fn piece(
        &self,
        frame: &table::Frame,
        start: usize,
        text: &mut String,
    ) -> Result<(), (usize, LoadRefused)> {
        text.clear();
        let mut row = Vec::new();
        for index in start..(start + PIECE).min(self.loads.len()) {
            self.row(index, &mut row)?;
            frame.row(index == 0, &row, text);
        }
        Ok(())
    }
}
