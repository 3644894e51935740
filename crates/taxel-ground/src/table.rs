//! Results in columns: for people, as JSON, as CSV.

use std::borrow::Cow;
use std::fmt::Write as _;

use serde_json::{Map, Value};

use crate::quantity::whole_parts;
use crate::shown;

/// Format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For people.
    Table,
    /// SI values with the unit in the key.
    Json,
    /// With the unit in brackets in the header.
    Csv,
}

/// One column: its name, and its unit for people and in SI.
#[derive(Debug, Clone)]
pub struct Column {
    /// Name, such as `capacitance_11`.
    pub name: String,
    /// Unit for people, such as `fF`; empty for text and counts.
    pub unit: &'static str,
    /// SI value of that unit.
    pub scale: f64,
    /// SI unit as it ends a JSON key, such as `f`.
    pub si: &'static str,
    /// Decimals for people.
    pub decimals: usize,
}

/// One value.
#[derive(Debug, Clone)]
pub enum Cell {
    /// SI.
    Number(f64),
    /// Counts and other whole numbers.
    Whole(u64),
    /// Text.
    Text(Cow<'static, str>),
    /// State of the sensor, or of a part of it, under the load of the row.
    State(&'static str),
    /// No value: `null` in JSON, nothing in CSV.
    Missing,
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<&'static str> for Cell {
    fn from(text: &'static str) -> Self {
        Self::Text(Cow::Borrowed(text))
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(Cow::Owned(text))
    }
}

impl Column {
    /// A column of numbers: `unit` is for people, `scale` its SI value, `si`
    /// the SI unit as it ends a key.
    pub fn new(
        name: impl Into<String>,
        unit: &'static str,
        scale: f64,
        si: &'static str,
        decimals: usize,
    ) -> Self {
        Self {
            name: name.into(),
            unit,
            scale,
            si,
            decimals,
        }
    }

    /// A column of text or counts.
    pub fn plain(name: impl Into<String>) -> Self {
        Self::new(name, "", 1.0, "", 0)
    }

    fn title(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} [{}]", self.name, self.unit)
        }
    }

    fn key(&self) -> String {
        if self.si.is_empty() {
            self.name.clone()
        } else {
            format!("{}_{}", self.name, self.si)
        }
    }

    /// SI to the unit for people.
    pub fn shown(&self, value: f64) -> f64 {
        Shown::new(self.scale).of(value)
    }
}

/// Renders rows as `format` asks; JSON becomes `{ ...about, "rows": [...] }`.
pub fn render(
    format: Format,
    about: &Map<String, Value>,
    columns: &[Column],
    rows: &[Vec<Cell>],
) -> String {
    match format {
        Format::Table => match (rows, with_digits(columns, rows)) {
            ([row], columns) => one_for_people(&columns, row),
            (_, columns) => for_people(&columns, rows),
        },
        Format::Json | Format::Csv => {
            let frame = Frame::new(format, about, columns);
            let mut text = frame.head.clone();
            for (index, row) in rows.iter().enumerate() {
                frame.row(index == 0, row, &mut text);
            }
            text + frame.tail
        }
    }
}

/// Text before, between and after the rows of a file.
#[derive(Debug, Clone)]
pub struct Frame {
    format: Format,
    /// Before the first row.
    pub head: String,
    /// After the last row.
    pub tail: &'static str,
    /// JSON keys of the columns with their quotes and colons.
    keys: Vec<String>,
    /// Units in which the columns of CSV show their numbers.
    units: Vec<Shown>,
}

/// SI to the unit for people; the reciprocal of a decimal is exact.
#[derive(Debug, Clone, Copy)]
enum Shown {
    /// Multiplied by this.
    Times(f64),
    /// Divided by this.
    Over(f64),
}

impl Shown {
    /// For a unit of the SI value `scale`.
    fn new(scale: f64) -> Self {
        whole_parts(scale).map_or(Self::Over(scale), Self::Times)
    }

    fn of(self, value: f64) -> f64 {
        match self {
            Self::Times(factor) => value * factor,
            Self::Over(scale) => value / scale,
        }
    }
}

impl Frame {
    /// The frame of a table of `columns`; JSON becomes
    /// `{ ...about, "rows": [...] }`.
    pub fn new(format: Format, about: &Map<String, Value>, columns: &[Column]) -> Self {
        if format != Format::Json {
            return Self {
                format,
                head: csv_header(columns),
                tail: "",
                keys: Vec::new(),
                units: columns.iter().map(|c| Shown::new(c.scale)).collect(),
            };
        }
        let mut head = String::from("{\n");
        for (key, value) in about {
            let _ = writeln!(head, "  {}: {value},", Value::from(key.as_str()));
        }
        head.push_str("  \"rows\": [");
        let keys = columns
            .iter()
            .map(|column| format!("{}: ", Value::from(column.key())));
        Self {
            format,
            head,
            tail: "\n  ]\n}\n",
            keys: keys.collect(),
            units: Vec::new(),
        }
    }

    /// Appends a row; `first` is the very first of the table.
    pub fn row(&self, first: bool, row: &[Cell], text: &mut String) {
        if self.format == Format::Json {
            text.push_str(if first { "\n    {" } else { ",\n    {" });
            json_fields(&self.keys, row, text);
            text.push('}');
        } else {
            csv_row(&self.units, row, text);
        }
    }
}

fn json_fields(keys: &[String], row: &[Cell], text: &mut String) {
    let mut digits = zmij::Buffer::new();
    for (index, (key, cell)) in keys.iter().zip(row).enumerate() {
        if index > 0 {
            text.push_str(", ");
        }
        text.push_str(key);
        match cell {
            Cell::Number(value) if value.is_finite() => {
                text.push_str(digits.format_finite(*value));
            }
            // JSON has no NaN: what is unknown is `null`.
            Cell::Number(_) | Cell::Missing => text.push_str("null"),
            Cell::Whole(value) => whole(*value, text),
            Cell::Text(value) => {
                let _ = write!(text, "{}", Value::from(value.as_ref()));
            }
            Cell::State(state) => {
                let _ = write!(text, "{}", Value::from(*state));
            }
        }
    }
}

/// A JSON document with its last line ended.
pub fn json(value: &Value) -> String {
    // `Value` displays as JSON; the alternate form is the one with lines.
    format!("{value:#}\n")
}

/// JSON has no NaN: what is unknown is `null`.
pub fn number_or_null(number: f64) -> Value {
    serde_json::Number::from_f64(number).map_or(Value::Null, Value::Number)
}

/// Digits that the greatest number of a unit has at least, for people.
const DIGITS: i32 = 4;
/// Decimals that are added for them at most: what is smaller is rounding.
const MORE_DECIMALS: i32 = 6;

/// Columns with more decimals where all numbers of their unit are so small that they would have
/// few digits left.
fn with_digits(columns: &[Column], rows: &[Vec<Cell>]) -> Vec<Column> {
    let greatest = |unit: &str| {
        let cells = rows.iter().flat_map(|row| columns.iter().zip(row));
        let shown = cells.filter_map(|(column, cell)| match cell {
            Cell::Number(value) if column.unit == unit => Some(column.shown(*value).abs()),
            _ => None,
        });
        shown.filter(|size| size.is_finite()).fold(0.0, f64::max)
    };
    let with_digits = |column: &Column| {
        let needed = f64::from(DIGITS - 1) - greatest(column.unit).log10().floor();
        let more = needed - column.decimals as f64;
        let mut column = column.clone();
        if !column.unit.is_empty() && more > 0.0 && more <= f64::from(MORE_DECIMALS) {
            column.decimals += more as usize;
        }
        column
    };
    columns.iter().map(with_digits).collect()
}

fn for_people(columns: &[Column], rows: &[Vec<Cell>]) -> String {
    let mut lines: Vec<Vec<String>> = vec![columns.iter().map(Column::title).collect()];
    lines.extend(rows.iter().map(|row| {
        let cells = columns.iter().zip(row);
        cells.map(|(column, cell)| text_of(cell, column)).collect()
    }));
    let width = |index: usize| {
        lines
            .iter()
            .map(|line| line[index].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    // Text stands left, numbers right.
    let left: Vec<bool> = (0..columns.len())
        .map(|index| {
            rows.iter()
                .any(|row| matches!(row.get(index), Some(Cell::Text(_) | Cell::State(_))))
        })
        .collect();
    lines.iter().fold(String::new(), |mut text, line| {
        let cells = line.iter().enumerate().map(|(index, cell)| {
            let width = widths[index];
            if left[index] {
                format!("{cell:<width$}")
            } else {
                format!("{cell:>width$}")
            }
        });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
        text
    })
}

/// One row reads better from top to bottom.
fn one_for_people(columns: &[Column], row: &[Cell]) -> String {
    let width = columns
        .iter()
        .map(|column| column.title().chars().count())
        .max()
        .unwrap_or(0);
    columns
        .iter()
        .zip(row)
        .fold(String::new(), |mut text, (column, cell)| {
            let value = text_of(cell, column);
            text.push_str(format!("{:<width$}  {value}", column.title()).trim_end());
            text.push('\n');
            text
        })
}

fn text_of(cell: &Cell, column: &Column) -> String {
    match cell {
        Cell::Number(value) => {
            let text = format!("{:.*}", column.decimals, column.shown(*value));
            // What rounds to zero has no sign.
            let unsigned = text.strip_prefix('-');
            let zero = unsigned.filter(|digits| digits.bytes().all(|b| b"0.".contains(&b)));
            zero.map(str::to_owned).unwrap_or(text)
        }
        Cell::Whole(value) => value.to_string(),
        Cell::Text(text) => shown::text(text),
        Cell::State(state) => (*state).to_owned(),
        Cell::Missing => String::new(),
    }
}

/// First line of a CSV file: names with units.
fn csv_header(columns: &[Column]) -> String {
    let mut line = String::new();
    for (index, column) in columns.iter().enumerate() {
        separate(index, &mut line);
        quoted(&column.title(), &mut line);
    }
    line.push('\n');
    line
}

/// Appends one line of a CSV file: numbers in the unit for people, in as many
/// digits as distinguish them; nothing for what is not known.
fn csv_row(units: &[Shown], row: &[Cell], text: &mut String) {
    let mut digits = zmij::Buffer::new();
    for (index, (unit, cell)) in units.iter().zip(row).enumerate() {
        separate(index, text);
        match cell {
            Cell::Number(value) if value.is_finite() => {
                let shown = digits.format_finite(unit.of(*value));
                text.push_str(shown.strip_suffix(".0").unwrap_or(shown));
            }
            Cell::Number(_) | Cell::Missing => (),
            Cell::Whole(value) => whole(*value, text),
            Cell::Text(value) => quoted(value, text),
            Cell::State(state) => quoted(state, text),
        }
    }
    text.push('\n');
}

/// Appends the digits of a whole number, without the machinery of `write!`,
/// which a table of counts would notice.
fn whole(mut value: u64, text: &mut String) {
    let mut digits = [b'0'; 20];
    let mut first = digits.len();
    loop {
        first -= 1;
        digits[first] += (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    text.push_str(std::str::from_utf8(&digits[first..]).expect("digits are ASCII"));
}

fn separate(index: usize, line: &mut String) {
    if index > 0 {
        line.push(',');
    }
}

/// A field as RFC 4180 asks: in quotes where it must be.
fn quoted(field: &str, text: &mut String) {
    if field.contains([',', '"', '\n', '\r']) {
        let _ = write!(text, "\"{}\"", field.replace('"', "\"\""));
    } else {
        text.push_str(field);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_printed_as_its_name() {
        let (columns, rows) = ([Column::plain("state")], [vec![Cell::State("closed")]]);
        let text = |format| render(format, &Map::new(), &columns, &rows);
        assert_eq!(text(Format::Table), "state  closed\n");
        assert_eq!(text(Format::Csv), "state\nclosed\n");
        assert!(text(Format::Json).contains("{\"state\": \"closed\"}"));
    }

    #[test]
    fn small_numbers_keep_digits_and_rounding_has_none() {
        let columns = [
            Column::new("volume", "mm3", 1e-9, "m3", 5),
            Column::new("force_x", "mN", 1e-3, "n", 3),
            Column::new("force_y", "mN", 1e-3, "n", 3),
            Column::new("moment", "mN mm", 1e-6, "nm", 3),
        ];
        let row =
            |volume: f64| -> Vec<Cell> { [volume, 2.5e-6, 1e-19, 1e-21].map(Cell::from).to_vec() };
        let rows = [row(1.2e-13), row(7.03e-14)];
        let text = render(Format::Table, &Map::new(), &columns, &rows);
        let last = text.lines().last().unwrap_or_default();
        let cells: Vec<&str> = last.split_whitespace().collect();
        assert_eq!(cells, ["0.0000703", "0.002500", "0.000000", "0.000"]);
    }
}
