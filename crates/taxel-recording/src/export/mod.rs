//! Recordings for other programs: tables (CSV) and arrays (NPZ).

mod arrays;
mod join;
mod tables;
mod zip;

pub use arrays::write_npz;
pub use join::write_csv;
pub use tables::write_tables;

use crate::frame::{SignalUnit, Stream};

/// Meaning of the numbers of a recording, for the heads of tables.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportMeaning {
    /// Name of each channel of a frame.
    pub channels: Vec<String>,
    /// Unit of the readings.
    pub reading: SignalUnit,
    /// Quantity of the value of a taxel, such as `force`, its unit for people, and its SI value.
    pub value: (String, String, f64),
    /// Unit of the forces of contacts: `N`, `Pa` or `1`.
    pub force: String,
    /// Unit of places: `m`, or `cells` where the pitch is not known.
    pub length: String,
    /// Columns of taxels, to name them by row and column.
    pub columns: usize,
    /// Names of the states of taxels, in the order of their codes.
    pub states: Vec<String>,
}

impl ExportMeaning {
    /// The meaning of a recording of which only the frames are known.
    pub fn of(stream: Option<&Stream>, channels: usize) -> Self {
        let raw = SignalUnit {
            quantity: crate::frame::Quantity::Raw,
            symbol: "raw".into(),
            si_per_unit: 1.0,
        };
        let per_taxel = stream.map_or(1, |stream| stream.channels_per_taxel.max(1));
        let columns = stream.map_or(channels.max(1), |stream| stream.columns.max(1));
        let name = |channel: usize| {
            let (taxel, part) = (channel / per_taxel, channel % per_taxel);
            let place = format!("r{}c{}", taxel / columns, taxel % columns);
            let capacitors = ["11", "12", "21", "22"];
            match per_taxel {
                1 => place,
                4 => format!("{place}.{}", capacitors[part]),
                _ => format!("{place}.{part}"),
            }
        };
        let count = stream.map_or(channels, Stream::channels);
        Self {
            channels: (0..count).map(name).collect(),
            reading: stream.map_or(raw, |stream| stream.unit.clone()),
            value: ("value".into(), "SI".into(), 1.0),
            force: "N".into(),
            length: "m".into(),
            columns,
            states: Vec::new(),
        }
    }

    /// Number in the unit for people of a reading, SI.
    fn reading(&self, value: f64) -> f64 {
        value / self.reading.si_per_unit
    }

    /// Title of a force of a contact, its factor to SI, and of a deviation.
    fn force_unit(&self) -> (&str, f64) {
        if self.force == "N" {
            ("mN", 1e-3)
        } else {
            (&self.force, 1.0)
        }
    }

    fn length_unit(&self) -> (&str, f64) {
        if self.length == "m" {
            ("mm", 1e-3)
        } else {
            (&self.length, 1.0)
        }
    }

    fn state(&self, code: u8) -> String {
        let name = self.states.get(usize::from(code));
        name.cloned().unwrap_or_else(|| code.to_string())
    }

    fn taxel(&self, taxel: usize) -> String {
        format!(
            "r{}c{}",
            taxel / self.columns.max(1),
            taxel % self.columns.max(1)
        )
    }
}

/// Axes of a value of so many components.
fn axes(components: u8) -> &'static [&'static str] {
    match components {
        3 => &["x", "y", "z"],
        _ => &["z"],
    }
}

/// A number for a table; nothing for none.
fn number(value: f64) -> String {
    if value.is_finite() {
        let size = value.abs();
        if size != 0.0 && !(1e-5..1e16).contains(&size) {
            return format!("{value:e}");
        }
        return value.to_string();
    }
    String::new()
}

/// A text for a table.
fn text(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text.to_owned()
}
