//! Loads in, electrical response out, row by row: `taxel predict`.

mod batch;
mod loads;

use std::sync::Arc;

use crate::figure::{Axis, Chart, Figure, Series, Style};
use crate::quantity::Dimension;
use crate::table::{Cell, Column};

pub use batch::{Answers, Refusal};
pub use loads::{Given, GivenValues, Loads};

/// Predicts the response of one kind of device to one kind of load.
pub trait Predictor: Send + Sync {
    /// Does what takes long, once for all of these loads; `progress` hears how
    /// far it is, from 0 to 1. The answer is a remark for the user, such as
    /// where a solution ends.
    ///
    /// # Errors
    /// A sentence when there is no answer at all.
    fn prepare(
        &mut self,
        loads: &Loads,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<String>, String> {
        let _ = (loads, progress);
        Ok(None)
    }

    /// Columns that a load may name; the order is that of [`Load`].
    fn load_columns(&self) -> &'static [LoadColumn];

    /// Checks that the columns `given` (as long as [`Self::load_columns`]) say what is
    /// needed together; the error is a sentence with what to do.
    ///
    /// # Errors
    /// That sentence.
    fn combination(&self, given: &[bool]) -> Result<(), String> {
        let _ = given;
        Ok(())
    }

    /// Columns of the answers.
    fn columns(&self) -> Vec<Column>;

    /// Appends the answer to one load, as long as [`Self::columns`].
    ///
    /// Answers a load. What a device cannot take is a state among the answers, with
    /// bounds or empty cells in the place of numbers that do not exist; only a load that
    /// has no meaning is refused.
    ///
    /// # Errors
    /// [`LoadRefused`] names the column, its value and what is allowed.
    fn answer(&self, load: &Load<'_>, row: &mut Vec<Cell>) -> Result<(), LoadRefused>;

    /// Names of the columns with what the channels read, before it becomes a number of a frame;
    /// empty for a device without such columns.
    fn reading_columns(&self) -> Vec<String> {
        Vec::new()
    }

    /// True if a channel is at an end of its range under a load, or beyond.
    fn clips(&self, load: &Load<'_>) -> bool {
        let _ = load;
        false
    }

    /// Curves that show the answers to loads of the columns `given`.
    fn curves(&self, given: &[bool]) -> Vec<Curve>;

    /// What a column is called in the legend of a figure.
    fn in_words(&self, column: &str) -> String {
        column.replace('_', " ")
    }

    /// True if a number in this load column is the size of the load, which a
    /// curve from no load lets grow, and not a condition such as an area.
    fn scales_with_load(&self, column: usize) -> bool {
        let _ = column;
        true
    }

    /// Bodies that were solved for the loads of [`Self::prepare`], each at its greatest load;
    /// none for a device that solves nothing. May solve what the answers did without.
    ///
    /// # Errors
    /// A sentence when one of them has no solution.
    fn bodies(&self) -> Result<Vec<Arc<dyn SolvedBody>>, String> {
        Ok(Vec::new())
    }

    /// Pictures of a field under one load, each an SVG document with its title; none for a
    /// device that has no field to show.
    fn pictures(&self, load: &Load<'_>) -> Vec<(String, String)> {
        let _ = load;
        Vec::new()
    }

    /// A figure of the response over time to one load; `None` for a device
    /// whose answer does not depend on time.
    fn history(&self, load: &Load<'_>) -> Option<Figure> {
        let _ = load;
        None
    }
}

/// A deformed body with its stresses, at one load.
pub trait SolvedBody: Send + Sync {
    /// Name of its file, without an ending.
    fn name(&self) -> &str;

    /// Its load, in words.
    fn load(&self) -> &str;

    /// The body as an unstructured grid of VTK, which ParaView reads: the undeformed mesh with
    /// the displacement in m, and the von Mises and the mean stress of each cell in Pa.
    ///
    /// # Errors
    /// A sentence; never of a body that was solved.
    fn vtu(&self) -> Result<String, String>;

    /// The deformed section, or a face of a body in space, with its von Mises stress (SVG).
    ///
    /// # Errors
    /// A sentence; never of a body that was solved.
    fn picture(&self) -> Result<String, String>;
}

/// One thing that a load may name: a column of a table of loads, or a word of
/// `--load`.
#[derive(Debug, Clone, Copy)]
pub struct LoadColumn {
    /// Name in a table, such as `force_z`; also a word of `--load`.
    pub name: &'static str,
    /// Short name in `--load`, such as `fz`; may be the name itself.
    pub short: &'static str,
    /// Kind of its values.
    pub kind: LoadKind,
    /// True if every table of loads must have it.
    pub required: bool,
    /// Meaning of the column, for help.
    pub about: &'static str,
}

/// Kind of the values of a column of loads.
#[derive(Debug, Clone, Copy)]
pub enum LoadKind {
    /// A quantity with a unit, from `range[0]` to `range[1]`, SI.
    Quantity(&'static Dimension, [f64; 2]),
    /// A number without a unit, from `range[0]` to `range[1]`.
    Number([f64; 2]),
    /// One of these words.
    Word(&'static [&'static str]),
}

/// A value of a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadValue {
    /// SI.
    Number(f64),
    /// Index into the words of its column.
    Word(usize),
}

/// One load: a value or none for each of [`Predictor::load_columns`].
#[derive(Debug, Clone, Copy)]
pub struct Load<'a>(Source<'a>);

/// Where the values of a load stand.
#[derive(Debug, Clone, Copy)]
enum Source<'a> {
    Values(&'a [Option<LoadValue>]),
    Row(&'a Loads, usize),
}

impl<'a> Load<'a> {
    /// The load of these values.
    pub fn of(values: &'a [Option<LoadValue>]) -> Self {
        Self(Source::Values(values))
    }

    /// The value in column `index`.
    #[inline]
    pub fn value(&self, index: usize) -> Option<LoadValue> {
        match self.0 {
            Source::Values(values) => *values.get(index)?,
            Source::Row(loads, row) => loads.value(row, index),
        }
    }

    /// The number in column `index`, SI.
    #[inline]
    pub fn number(&self, index: usize) -> Option<f64> {
        match self.value(index)? {
            LoadValue::Number(value) => Some(value),
            LoadValue::Word(_) => None,
        }
    }

    /// The index of the word in column `index`.
    pub fn word(&self, index: usize) -> Option<usize> {
        match self.value(index)? {
            LoadValue::Word(word) => Some(word),
            LoadValue::Number(_) => None,
        }
    }

    /// All values.
    pub fn values(&self) -> impl Iterator<Item = Option<LoadValue>> {
        let width = match self.0 {
            Source::Values(values) => values.len(),
            Source::Row(loads, _) => loads.width(),
        };
        let load = *self;
        (0..width).map(move |index| load.value(index))
    }

    /// The values with those that are the size of the load for `predictor` at `share` of it.
    pub fn scaled(&self, predictor: &dyn Predictor, share: f64) -> Vec<Option<LoadValue>> {
        let scaled = |(column, value)| match value {
            Some(LoadValue::Number(number)) if predictor.scales_with_load(column) => {
                Some(LoadValue::Number(share * number))
            }
            other => other,
        };
        self.values().enumerate().map(scaled).collect()
    }
}

/// A load that has no meaning for the device.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadRefused {
    /// Index of the column at fault.
    pub column: usize,
    /// Description of the mistake, with the value and the limit.
    pub message: String,
    /// Advice.
    pub help: String,
}

/// One chart of answers: columns of the answers against one another.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Title.
    pub title: String,
    /// Name of the column across.
    pub x: &'static str,
    /// Names of the columns upwards, all of one unit.
    pub y: Vec<&'static str>,
    /// Title of the upward axis.
    pub y_label: &'static str,
}

/// Steps of the curve from no load to one load.
const CURVE_STEPS: usize = 120;
/// Up to here the rows of a table are marked one by one.
const MOST_MARKS: usize = 60;

/// The figure of `taxel predict --plot`: of a single load its history, or the
/// way from nothing to it; of several loads the rows.
///
/// # Errors
/// [`LoadRefused`] when a load on the way is refused.
pub fn figure(
    title: &str,
    predictor: &dyn Predictor,
    loads: &Loads,
) -> Result<Figure, LoadRefused> {
    let single = (loads.len() == 1).then(|| loads.load(0));
    if let Some(figure) = single.and_then(|load| predictor.history(&load)) {
        return Ok(figure);
    }
    let answer = |load: &Load<'_>| {
        let mut row = Vec::new();
        predictor.answer(load, &mut row).map(|()| row)
    };
    let columns = predictor.columns();
    let curves = predictor.curves(&loads.given.columns);
    let mut charts: Vec<Chart> = curves.iter().map(|curve| empty(curve, &columns)).collect();
    let rows: Vec<_> = (0..loads.len())
        .map(|index| answer(&loads.load(index)))
        .collect::<Result<_, _>>()?;
    let way: Vec<_> = match single {
        Some(load) => (0..=CURVE_STEPS)
            .map(|step| step as f64 / CURVE_STEPS as f64)
            .map(|share| answer(&Load::of(&load.scaled(predictor, share))))
            .collect::<Result<_, _>>()?,
        None => Vec::new(),
    };
    let style = if rows.len() <= MOST_MARKS {
        Style::Marks
    } else {
        Style::Line
    };
    for (chart, curve) in charts.iter_mut().zip(&curves) {
        let mut here = Vec::new();
        for y in &curve.y {
            let name = predictor.in_words(y);
            let answered = points(&columns, &rows, curve.x, y);
            if way.is_empty() {
                chart.series.push(Series::new(name, answered, style));
            } else {
                let line = points(&columns, &way, curve.x, y);
                chart.series.push(Series::new(name, line, Style::Line));
                here.extend(answered);
            }
        }
        if !here.is_empty() {
            chart
                .series
                .push(Series::new("this load", here, Style::Marks));
        }
    }
    Ok(Figure {
        title: title.to_owned(),
        charts,
        caption: String::new(),
    })
}

fn empty(curve: &Curve, columns: &[Column]) -> Chart {
    let unit = |name: &str| {
        columns
            .iter()
            .find(|column| column.name == name)
            .map_or("", |column| column.unit)
    };
    Chart {
        title: curve.title.clone(),
        x: Axis::new(curve.x.replace('_', " "), unit(curve.x)),
        y: Axis::new(curve.y_label, curve.y.first().map_or("", |name| unit(name))),
        series: Vec::new(),
    }
}

/// Pairs of two columns in units for people, where both are numbers.
fn points(columns: &[Column], rows: &[Vec<Cell>], x: &str, y: &str) -> Vec<[f64; 2]> {
    let find = |name: &str| columns.iter().position(|column| column.name == name);
    let (Some(x), Some(y)) = (find(x), find(y)) else {
        return Vec::new();
    };
    let shown = |row: &[Cell], index: usize| match row[index] {
        Cell::Number(value) => columns[index].shown(value),
        Cell::Whole(value) => value as f64,
        Cell::Text(_) | Cell::State(_) | Cell::Missing => f64::NAN,
    };
    rows.iter()
        .map(|row| [shown(row, x), shown(row, y)])
        .filter(|point| point.iter().all(|value| value.is_finite()))
        .collect()
}
