//! Results in columns: for people, as JSON, as CSV.

use serde_json::{Map, Value};

use crate::Stop;
use crate::arguments::Format;

/// One column: its name, and its unit for people and in SI.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    /// Name, such as `capacitance_11`.
    pub(crate) name: String,
    /// Unit for people, such as `fF`; empty for text and counts.
    pub(crate) unit: &'static str,
    /// SI value of that unit.
    pub(crate) scale: f64,
    /// SI unit as it ends a JSON key, such as `f`.
    pub(crate) si: &'static str,
    /// Decimals for people.
    pub(crate) decimals: usize,
}

/// One value.
#[derive(Debug, Clone)]
pub(crate) enum Cell {
    /// SI.
    Number(f64),
    /// Counts and other whole numbers.
    Whole(u64),
    /// Text.
    Text(String),
}

impl Column {
    pub(crate) fn new(
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

    pub(crate) fn plain(name: impl Into<String>) -> Self {
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

    /// SI to the unit for people; the reciprocal of a decimal is exact.
    fn shown(&self, value: f64) -> f64 {
        if self.scale < 1.0 {
            value * (1.0 / self.scale).round()
        } else {
            value / self.scale
        }
    }
}

/// Renders rows as `format` asks; JSON becomes `{ ...about, "rows": [...] }`.
pub(crate) fn render(
    format: Format,
    about: &Map<String, Value>,
    columns: &[Column],
    rows: &[Vec<Cell>],
) -> Result<String, Stop> {
    match format {
        Format::Table => match rows {
            [row] => Ok(one_for_people(columns, row)),
            _ => Ok(for_people(columns, rows)),
        },
        Format::Json => {
            let mut whole = about.clone();
            whole.insert(
                "rows".into(),
                rows.iter().map(|row| object(columns, row)).collect(),
            );
            json(&Value::Object(whole))
        }
        Format::Csv => csv_text(columns, rows),
    }
}

/// A JSON document with its last line ended.
pub(crate) fn json(value: &Value) -> Result<String, Stop> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Stop::Failed(format!("cannot write JSON: {error}")))?;
    text.push('\n');
    Ok(text)
}

fn object(columns: &[Column], row: &[Cell]) -> Value {
    let pairs = columns.iter().zip(row).map(|(column, cell)| {
        let value = match cell {
            Cell::Number(number) => number_or_null(*number),
            Cell::Whole(number) => Value::from(*number),
            Cell::Text(text) => Value::from(text.clone()),
        };
        (column.key(), value)
    });
    Value::Object(pairs.collect())
}

/// JSON has no NaN: what is unknown is `null`.
pub(crate) fn number_or_null(number: f64) -> Value {
    serde_json::Number::from_f64(number).map_or(Value::Null, Value::Number)
}

fn for_people(columns: &[Column], rows: &[Vec<Cell>]) -> String {
    let mut lines: Vec<Vec<String>> = vec![columns.iter().map(Column::title).collect()];
    lines.extend(rows.iter().map(|row| {
        let cells = columns.iter().zip(row);
        cells
            .map(|(column, cell)| text_of(cell, |n| format!("{:.*}", column.decimals, n), column))
            .collect()
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
                .any(|row| matches!(row.get(index), Some(Cell::Text(_))))
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
            let value = text_of(cell, |n| format!("{:.*}", column.decimals, n), column);
            text.push_str(format!("{:<width$}  {value}", column.title()).trim_end());
            text.push('\n');
            text
        })
}

fn text_of(cell: &Cell, number: impl Fn(f64) -> String, column: &Column) -> String {
    match cell {
        Cell::Number(value) => number(column.shown(*value)),
        Cell::Whole(value) => value.to_string(),
        Cell::Text(text) => text.clone(),
    }
}

fn csv_text(columns: &[Column], rows: &[Vec<Cell>]) -> Result<String, Stop> {
    let failed = |error: String| Stop::Failed(format!("cannot write CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(columns.iter().map(Column::title))
        .map_err(|error| failed(error.to_string()))?;
    for row in rows {
        let cells = columns.iter().zip(row);
        let fields = cells.map(|(column, cell)| text_of(cell, |n| n.to_string(), column));
        writer
            .write_record(fields)
            .map_err(|error| failed(error.to_string()))?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| failed(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| failed(error.to_string()))
}
