//! Learned maps as tables of the calibration file.

use std::fmt::Write as _;
use std::io::Write;

use serde::Serialize as _;
use serde_json::Value;
use serde_json::ser::{Formatter, Serializer};

use taxel::trained::TrainedMaps;

/// Key of the tables.
const KEY: &str = "trained";
/// Numbers of a line.
const IN_LINE: usize = 10;

/// Appends the tables.
pub(crate) fn append(text: &mut String, maps: &TrainedMaps) {
    // A structure of numbers and lists always has a value.
    let value = serde_json::to_value(maps).unwrap_or_default();
    table(text, KEY, &value);
}

/// Writes numbers of nine digits.
struct NineDigits;

impl Formatter for NineDigits {
    fn write_f64<W: Write + ?Sized>(&mut self, to: &mut W, value: f64) -> std::io::Result<()> {
        write!(to, "{value:.8e}")
    }
}

/// The maps with numbers of nine digits, as the file keeps them: what was
/// trained is then what is read. `None` for numbers that no file can hold.
pub(crate) fn rounded(maps: TrainedMaps) -> Option<TrainedMaps> {
    let mut text = Vec::new();
    maps.serialize(&mut Serializer::with_formatter(&mut text, NineDigits))
        .ok()?;
    drop(maps);
    serde_json::from_slice(&text).ok()
}

/// One table with its own tables below it.
pub(crate) fn table(text: &mut String, path: &str, value: &Value) {
    let Value::Object(keys) = value else { return };
    let _ = writeln!(text, "\n[{path}]");
    let (tables, values): (Vec<_>, Vec<_>) = keys.iter().partition(|(_, value)| value.is_object());
    for (key, value) in values.iter().filter(|(_, value)| !value.is_null()) {
        let _ = write!(text, "{key} = ");
        put(text, value);
        text.push('\n');
    }
    for (key, value) in tables {
        table(text, &format!("{path}.{key}"), value);
    }
}

fn put(text: &mut String, value: &Value) {
    match value {
        Value::Array(items) if items.len() > IN_LINE => {
            text.push_str("[\n");
            for line in items.chunks(IN_LINE) {
                text.push_str("  ");
                for item in line {
                    put(text, item);
                    text.push_str(", ");
                }
                text.truncate(text.trim_end().len());
                text.push('\n');
            }
            text.push(']');
        }
        Value::Array(items) => {
            text.push('[');
            for (index, item) in items.iter().enumerate() {
                text.push_str(if index > 0 { ", " } else { "" });
                put(text, item);
            }
            text.push(']');
        }
        // A table in a list.
        Value::Object(keys) => {
            text.push_str("{ ");
            let values = keys.iter().filter(|(_, value)| !value.is_null());
            for (index, (key, value)) in values.enumerate() {
                let _ = write!(text, "{}{key} = ", if index > 0 { ", " } else { "" });
                put(text, value);
            }
            text.push_str(" }");
        }
        Value::Number(number) if number.is_f64() => {
            let _ = write!(text, "{:e}", nine_digits(number.as_f64().unwrap_or(0.0)));
        }
        other => {
            let _ = write!(text, "{other}");
        }
    }
}

/// Short numbers stay short: single precision has more digits as double.
fn nine_digits(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}
