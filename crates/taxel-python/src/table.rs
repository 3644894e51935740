//! Tables of results: columns that become NumPy arrays when they are asked for.

use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadwriteArray1};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use taxel::quantity::dimensions;
use taxel::table::{Cell, Column};

/// Values of a column while it is gathered.
#[derive(Debug, Default)]
pub(crate) enum Values {
    /// Nothing yet, or only empty cells: their number.
    #[default]
    Nothing,
    Empty(usize),
    Numbers(Vec<f64>),
    Whole(Vec<i64>),
    /// Different words and the index of that of each row.
    Words(Vec<String>, Vec<u32>),
    Mixed(Vec<Cell>),
    /// What Python was given.
    Given(Py<PyAny>),
}

impl Values {
    fn cells(self) -> Vec<Cell> {
        match self {
            Self::Nothing | Self::Given(_) => Vec::new(),
            Self::Empty(count) => vec![Cell::Missing; count],
            Self::Numbers(numbers) => numbers.into_iter().map(Cell::Number).collect(),
            Self::Whole(numbers) => {
                let whole = numbers
                    .into_iter()
                    .map(|number| Cell::Whole(number.cast_unsigned()));
                whole.collect()
            }
            Self::Words(words, places) => {
                let places = places.into_iter();
                places
                    .map(|place| Cell::from(words[place as usize].clone()))
                    .collect()
            }
            Self::Mixed(cells) => cells,
        }
    }

    pub(crate) fn push(&mut self, cell: &Cell) {
        match (&mut *self, cell) {
            (Self::Numbers(numbers), Cell::Number(number)) => numbers.push(*number),
            (Self::Numbers(numbers), Cell::Whole(whole)) => numbers.push(*whole as f64),
            (Self::Numbers(numbers), Cell::Missing) => numbers.push(f64::NAN),
            (Self::Whole(numbers), Cell::Whole(whole)) => numbers.push(whole.cast_signed()),
            (Self::Words(words, places), Cell::Text(text)) => {
                let known = words.iter().rposition(|word| word == text);
                let place = known.unwrap_or_else(|| {
                    words.push(text.clone().into_owned());
                    words.len() - 1
                });
                places.push(place as u32);
            }
            // An array of states is one of words.
            (_, Cell::State(state)) => self.push(&Cell::from(*state)),
            (Self::Empty(count), Cell::Missing) => *count += 1,
            (Self::Words(..), Cell::Missing) => self.push(&Cell::from("")),
            (Self::Mixed(cells), cell) => cells.push(cell.clone()),
            (Self::Nothing, Cell::Missing) => *self = Self::Empty(1),
            (Self::Nothing, Cell::Number(number)) => *self = Self::Numbers(vec![*number]),
            (Self::Nothing, Cell::Whole(whole)) => *self = Self::Whole(vec![whole.cast_signed()]),
            (Self::Nothing, Cell::Text(text)) => {
                *self = Self::Words(vec![text.clone().into_owned()], vec![0]);
            }
            (Self::Empty(count), Cell::Number(_) | Cell::Whole(_)) => {
                *self = Self::Numbers(vec![f64::NAN; *count]);
                self.push(cell);
            }
            (Self::Empty(count), Cell::Text(_)) => {
                *self = Self::Words(vec![String::new()], vec![0; *count]);
                self.push(cell);
            }
            (Self::Whole(numbers), Cell::Number(_) | Cell::Missing) => {
                *self = Self::Numbers(numbers.iter().map(|number| *number as f64).collect());
                self.push(cell);
            }
            _ => {
                let mut cells = std::mem::take(self).cells();
                cells.push(cell.clone());
                *self = Self::Mixed(cells);
            }
        }
    }

    /// These values and `other` behind them.
    pub(crate) fn append(&mut self, other: Self) {
        match (&mut *self, other) {
            (Self::Nothing, other) => *self = other,
            (Self::Numbers(numbers), Self::Numbers(more)) => numbers.extend(more),
            (Self::Whole(numbers), Self::Whole(more)) => numbers.extend(more),
            (Self::Words(words, places), Self::Words(others, more)) => {
                let moved = merged(words, others);
                places.extend(more.into_iter().map(|place| moved[place as usize]));
            }
            (_, other) => other.cells().iter().for_each(|cell| self.push(cell)),
        }
    }

    fn given(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::Nothing => PyArray1::from_vec(py, Vec::<f64>::new())
                .into_any()
                .unbind(),
            Self::Given(array) => array,
            Self::Numbers(numbers) => numbers.into_pyarray(py).into_any().unbind(),
            Self::Whole(numbers) => numbers.into_pyarray(py).into_any().unbind(),
            Self::Empty(count) => vec![f64::NAN; count].into_pyarray(py).into_any().unbind(),
            Self::Words(words, places) => texts(py, &words, places)?,
            Self::Mixed(cells) => {
                let values = cells.into_iter().map(|cell| match cell {
                    Cell::Number(number) => number.into_pyobject(py).map(Bound::into_any),
                    Cell::Whole(whole) => (whole as f64).into_pyobject(py).map(Bound::into_any),
                    Cell::Text(text) => Ok(text.into_pyobject(py)?.into_any()),
                    Cell::State(state) => Ok(state.into_pyobject(py)?.into_any()),
                    Cell::Missing => f64::NAN.into_pyobject(py).map(Bound::into_any),
                });
                let values = values.collect::<Result<Vec<_>, _>>()?;
                let list = PyList::new(py, values)?;
                let numpy = py.import("numpy")?;
                numpy.call_method1("array", (list, "O"))?.unbind()
            }
        })
    }
}

/// Columns of a known number of rows in memory of NumPy, filled in pieces side by side. Each column
/// is what its cell of the first row is; where another row has something else there, its piece is
/// gathered loosely.
pub(crate) struct Filled<'py> {
    columns: Vec<Room<'py>>,
    size: usize,
}

/// Room for a column.
enum Room<'py> {
    Numbers(PyReadwriteArray1<'py, f64>),
    Whole(PyReadwriteArray1<'py, i64>),
    /// The index of the word of each row.
    Words(Vec<u32>),
}

/// An array that is not filled yet. NumPy asks the system for large pages, which the allocator of
/// Rust does not: most of the time that fresh memory takes is that of its pages.
fn room<T: Element>(py: Python<'_>, rows: usize) -> PyResult<PyReadwriteArray1<'_, T>> {
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("empty", (rows, numpy::dtype::<T>(py)))?;
    Ok(array.cast_into::<PyArray1<T>>()?.readwrite())
}

impl Room<'_> {
    fn array(self) -> Values {
        match self {
            Self::Numbers(all) => Values::Given((**all).clone().into_any().unbind()),
            Self::Whole(all) => Values::Given((**all).clone().into_any().unbind()),
            Self::Words(places) => Values::Words(Vec::new(), places),
        }
    }

    /// The values of a piece; `words` are those that it has.
    fn piece(&self, number: usize, size: usize, words: &[String]) -> Values {
        fn some<T: Clone>(all: &[T], number: usize, size: usize) -> Vec<T> {
            all.chunks(size).nth(number).unwrap_or_default().to_vec()
        }
        match self {
            Self::Numbers(all) => {
                Values::Numbers(some(all.as_slice().unwrap_or_default(), number, size))
            }
            Self::Whole(all) => {
                Values::Whole(some(all.as_slice().unwrap_or_default(), number, size))
            }
            Self::Words(all) => words_or_empty(words, &some(all, number, size)),
        }
    }
}

/// What a piece of a column became.
pub(crate) enum Part {
    /// It stands in its place; of words those that it has.
    Tight(Vec<String>),
    /// It holds something else than the first row.
    Loose(Values),
}

/// A piece of a column while it is filled.
pub(crate) struct Piece<'a> {
    place: Place<'a>,
    filled: usize,
    loose: Option<Values>,
}

enum Place<'a> {
    Numbers(&'a mut [f64]),
    Whole(&'a mut [i64]),
    Words(Words, &'a mut [u32]),
}

/// The different words of a piece.
#[derive(Default)]
struct Words {
    all: Vec<String>,
    /// Where the text of the last constant word lies, its length and its place: the next one is
    /// mostly the same and need not be read.
    last: Option<(usize, usize, u32)>,
}

impl Words {
    /// Place of a constant word.
    fn constant(&mut self, word: &'static str) -> u32 {
        let (address, length) = (word.as_ptr().addr(), word.len());
        if let Some((known_address, known_length, place)) = self.last
            && (address, length) == (known_address, known_length)
        {
            return place;
        }
        let place = self.place(word);
        self.last = Some((address, length, place));
        place
    }

    fn place(&mut self, word: &str) -> u32 {
        let known = self.all.iter().rposition(|known| known == word);
        known.unwrap_or_else(|| {
            self.all.push(word.to_owned());
            self.all.len() - 1
        }) as u32
    }
}

impl<'py> Filled<'py> {
    /// Room for `rows` like `first`, in pieces of `size`.
    pub(crate) fn new(py: Python<'py>, first: &[Cell], rows: usize, size: usize) -> PyResult<Self> {
        let column = |cell: &Cell| {
            Ok(match cell {
                Cell::Number(_) | Cell::Missing => Room::Numbers(room(py, rows)?),
                Cell::Whole(_) => Room::Whole(room(py, rows)?),
                Cell::Text(_) | Cell::State(_) => Room::Words(vec![0; rows]),
            })
        };
        let columns: PyResult<_> = first.iter().map(column).collect();
        Ok(Self {
            columns: columns?,
            size,
        })
    }

    /// The pieces: of each all columns.
    pub(crate) fn pieces(&mut self) -> Vec<Vec<Piece<'_>>> {
        fn chunks<'a, T>(
            all: &'a mut [T],
            size: usize,
            place: impl Fn(&'a mut [T]) -> Place<'a>,
        ) -> Vec<Place<'a>> {
            all.chunks_mut(size).map(place).collect()
        }
        let mut pieces: Vec<Vec<Piece<'_>>> = Vec::new();
        for column in &mut self.columns {
            let places = match column {
                Room::Numbers(all) => chunks(
                    all.as_slice_mut().unwrap_or_default(),
                    self.size,
                    Place::Numbers,
                ),
                Room::Whole(all) => chunks(
                    all.as_slice_mut().unwrap_or_default(),
                    self.size,
                    Place::Whole,
                ),
                Room::Words(all) => chunks(all, self.size, |chunk| {
                    Place::Words(Words::default(), chunk)
                }),
            };
            pieces.resize_with(places.len(), Vec::new);
            for (piece, place) in pieces.iter_mut().zip(places) {
                piece.push(Piece {
                    place,
                    filled: 0,
                    loose: None,
                });
            }
        }
        pieces
    }

    /// The columns, once all pieces are filled.
    pub(crate) fn values(self, parts: Vec<Vec<Part>>) -> Vec<Values> {
        let mut parts: Vec<_> = parts.into_iter().map(Vec::into_iter).collect();
        let columns = self.columns.into_iter();
        columns
            .map(|column| {
                let parts = parts.iter_mut().filter_map(Iterator::next).collect();
                joined(column, parts, self.size)
            })
            .collect()
    }
}

/// A column of its pieces.
fn joined(column: Room<'_>, parts: Vec<Part>, size: usize) -> Values {
    let tight = parts.iter().all(|part| matches!(part, Part::Tight(_)));
    match column {
        Room::Words(mut places) if tight => {
            let mut words: Vec<String> = Vec::new();
            for (part, places) in parts.into_iter().zip(places.chunks_mut(size)) {
                let Part::Tight(own) = part else { continue };
                let moved = merged(&mut words, own);
                if (0u32..).zip(&moved).any(|(own, moved)| own != *moved) {
                    for at in places {
                        *at = moved[*at as usize];
                    }
                }
            }
            Values::Words(words, places)
        }
        column if tight => column.array(),
        column => {
            let mut all = Values::Nothing;
            for (number, part) in parts.into_iter().enumerate() {
                all.append(match part {
                    Part::Loose(values) => values,
                    Part::Tight(words) => column.piece(number, size, &words),
                });
            }
            all
        }
    }
}

/// Joins `others` to `words`: where each of them is now.
fn merged(words: &mut Vec<String>, others: Vec<String>) -> Vec<u32> {
    let place = |word: String| {
        let known = words.iter().position(|one| *one == word);
        known.unwrap_or_else(|| {
            words.push(word);
            words.len() - 1
        }) as u32
    };
    others.into_iter().map(place).collect()
}

impl Piece<'_> {
    /// The cells of the column at `column` of next rows, each `width` wide.
    pub(crate) fn extend(&mut self, rows: &[Cell], column: usize, width: usize) {
        let mut at = column;
        // Nearly all cells are what the first row has: they ask for nothing else. Loops by index,
        // for iterators are calls here where the compiler does not inline them.
        if self.loose.is_none() {
            let mut filled = self.filled;
            match &mut self.place {
                Place::Numbers(numbers) => {
                    let numbers = &mut **numbers;
                    while let Some(Cell::Number(number)) = rows.get(at) {
                        numbers[filled] = *number;
                        filled += 1;
                        at += width;
                    }
                }
                Place::Whole(numbers) => {
                    let numbers = &mut **numbers;
                    while let Some(Cell::Whole(whole)) = rows.get(at) {
                        numbers[filled] = whole.cast_signed();
                        filled += 1;
                        at += width;
                    }
                }
                Place::Words(words, places) => {
                    let places = &mut **places;
                    while let Some(Cell::Text(Cow::Borrowed(word)) | Cell::State(word)) =
                        rows.get(at)
                    {
                        places[filled] = words.constant(word);
                        filled += 1;
                        at += width;
                    }
                }
            }
            self.filled = filled;
        }
        while let Some(cell) = rows.get(at) {
            self.push(cell);
            at += width;
        }
    }

    /// The next cell.
    fn push(&mut self, cell: &Cell) {
        if let Some(loose) = &mut self.loose {
            loose.push(cell);
            return;
        }
        match (&mut self.place, cell) {
            (Place::Numbers(numbers), Cell::Number(number)) => numbers[self.filled] = *number,
            (Place::Numbers(numbers), Cell::Whole(whole)) => numbers[self.filled] = *whole as f64,
            (Place::Numbers(numbers), Cell::Missing) => {
                numbers[self.filled] = f64::NAN;
            }
            (Place::Whole(numbers), Cell::Whole(whole)) => {
                numbers[self.filled] = whole.cast_signed();
            }
            (Place::Words(words, places), Cell::State(state)) => {
                places[self.filled] = words.constant(state);
            }
            (Place::Words(words, places), Cell::Text(text)) => {
                places[self.filled] = match text {
                    Cow::Borrowed(word) => words.constant(word),
                    Cow::Owned(word) => words.place(word),
                };
            }
            (place, cell) => {
                let mut loose = match place {
                    Place::Numbers(all) => Values::Numbers(all[..self.filled].to_vec()),
                    Place::Whole(all) => Values::Whole(all[..self.filled].to_vec()),
                    Place::Words(words, all) => words_or_empty(&words.all, &all[..self.filled]),
                };
                if self.filled == 0 {
                    loose = Values::Nothing;
                }
                loose.push(cell);
                self.loose = Some(loose);
            }
        }
        self.filled += 1;
    }

    pub(crate) fn part(self) -> Part {
        match (self.loose, self.place) {
            (Some(loose), _) => Part::Loose(loose),
            (None, Place::Words(words, _)) => Part::Tight(words.all),
            (None, _) => Part::Tight(Vec::new()),
        }
    }
}

/// Words, or empty cells if there is no other one: they may become anything.
fn words_or_empty(words: &[String], places: &[u32]) -> Values {
    match words {
        [word] if word.is_empty() => Values::Empty(places.len()),
        _ => Values::Words(words.to_vec(), places.to_vec()),
    }
}

/// An array of texts.
fn texts(py: Python<'_>, words: &[String], places: Vec<u32>) -> PyResult<Py<PyAny>> {
    let words = py
        .import("numpy")?
        .call_method1("array", (words.to_vec(),))?;
    let places = places.into_pyarray(py);
    Ok(words.call_method1("__getitem__", (places,))?.unbind())
}

/// Columns of results.
#[pyclass(frozen, module = "taxel._taxel")]
pub(crate) struct Table {
    columns: Vec<Column>,
    values: Vec<Mutex<Values>>,
    rows: usize,
}

impl Table {
    pub(crate) fn new(columns: Vec<Column>, values: Vec<Values>, rows: usize) -> Self {
        Self {
            columns,
            values: values.into_iter().map(Mutex::new).collect(),
            rows,
        }
    }

    /// The table of `rows` of cells.
    pub(crate) fn of_rows(columns: Vec<Column>, rows: &[Vec<Cell>]) -> Self {
        let mut values: Vec<Values> = columns.iter().map(|_| Values::Nothing).collect();
        for row in rows {
            for (values, cell) in values.iter_mut().zip(row) {
                values.push(cell);
            }
        }
        Self::new(columns, values, rows.len())
    }
}

/// Symbol of the SI unit of a column.
pub(crate) fn si_symbol(column: &Column) -> &'static str {
    let unit = column.unit;
    let known = dimensions().find(|one| !unit.is_empty() && one.unit(unit) == Some(column.scale));
    known.map_or(column.si, |dimension| dimension.si)
}

#[pymethods]
impl Table {
    fn __len__(&self) -> usize {
        self.rows
    }

    /// Name, SI unit, unit for people and its SI value of each column.
    fn columns(&self) -> Vec<(String, &'static str, &'static str, f64)> {
        let columns = self.columns.iter();
        columns
            .map(|one| (one.name.clone(), si_symbol(one), one.unit, one.scale))
            .collect()
    }

    /// The array of a column.
    fn column(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let place = self.columns.iter().position(|column| column.name == name);
        let place = place.ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        let mut values = self.values[place]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let array = std::mem::take(&mut *values).given(py)?;
        *values = Values::Given(array.clone_ref(py));
        Ok(array)
    }
}
