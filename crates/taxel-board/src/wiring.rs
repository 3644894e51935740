//! Which value of a board is which channel of a sensor.

use taxel_recording::{Frame, Quantity, Stream};

use crate::board::{Board, ValueOfBoard, shortened};

/// Which value of a board is which channel of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    stream: Stream,
}

/// A sensor and a board that do not fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// Another number of channels.
    #[error(
        "the sensor has {sensor} channels, the board gives {board}: {names}\nhelp: name the values that are the sensor's channels, in their order, in the board file, such as\n  wiring = [\"{line}\"]"
    )]
    Channels {
        /// Channels of the sensor.
        sensor: usize,
        /// Values of the board.
        board: usize,
        /// Names of the board's values, shortened.
        names: String,
        /// A wiring that has as many, where the board has enough values.
        line: String,
    },
    /// Another quantity.
    #[error(
        "the value \"{name}\" of the board is in {board}, a {found}; the sensor file reads {needed}\nhelp: {help}"
    )]
    Quantity {
        /// Name of the value.
        name: String,
        /// Unit of the board.
        board: String,
        /// Quantity of the board's value.
        found: &'static str,
        /// Quantity of the sensor's electronics.
        needed: &'static str,
        /// What to do.
        help: String,
    },
}

impl Wiring {
    /// The channels of `board` as those of a sensor, whose frames have the meaning `sensor`.
    ///
    /// # Errors
    /// [`Mismatch`] when there are more or fewer, or another quantity.
    pub fn fit(board: &Board, sensor: &Stream) -> Result<Self, Mismatch> {
        let needed = sensor.channels();
        let names: Vec<&str> = board.names().collect();
        if names.len() != needed {
            let all: Vec<&str> = board.values().iter().map(|v| v.name.as_str()).collect();
            let line = match all.get(..needed) {
                Some([first, .., last]) if needed > 3 => format!("{first}\", …, \"{last}"),
                Some(enough) if !enough.is_empty() => enough.join("\", \""),
                _ => "c{1..4}".into(),
            };
            return Err(Mismatch::Channels {
                sensor: needed,
                board: names.len(),
                names: shortened(&names),
                line,
            });
        }
        match board.channels().find(|value| !same_quantity(value, sensor)) {
            Some(value) => Err(mismatch(value, sensor)),
            None => Ok(Self {
                stream: Stream {
                    name: board.name.clone(),
                    period: sensor.period.or(board.rate.map(f64::recip)),
                    ..sensor.clone()
                },
            }),
        }
    }

    /// Meaning of the frames of the board: those of the sensor.
    pub fn stream(&self) -> &Stream {
        &self.stream
    }

    /// True if `frame` has the channels of the sensor.
    pub fn holds(&self, frame: &Frame) -> bool {
        frame.values.len() == self.stream.channels()
    }
}

/// Counts and numbers without a meaning may stand for each other.
fn same_quantity(value: &ValueOfBoard, sensor: &Stream) -> bool {
    let plain = |quantity| matches!(quantity, Quantity::Counts | Quantity::Raw);
    let (found, needed) = (value.unit.quantity, sensor.unit.quantity);
    found == needed || (plain(found) && plain(needed))
}

fn mismatch(value: &ValueOfBoard, sensor: &Stream) -> Mismatch {
    let (found, needed) = (value.unit.quantity, sensor.unit.quantity);
    let help = match (found, needed) {
        (Quantity::Force, _) => {
            "describe the array by [element.measured_force] in the sensor file".to_owned()
        }
        (Quantity::Counts | Quantity::Raw, _) => format!(
            "give unit and scale of the value in the board file, such as scale = 0.01, unit = \"{}\"",
            sensor.unit.symbol
        ),
        (_, Quantity::Counts | Quantity::Raw) => format!(
            "say in the sensor file that the board measures it: [electronics.readout.measured] with unit = \"{}\"",
            value.unit.symbol
        ),
        _ => "name the values of the right quantity with `wiring` in the board file".to_owned(),
    };
    Mismatch::Quantity {
        name: value.name.clone(),
        board: value.unit.symbol.clone(),
        found: found.name(),
        needed: needed.name(),
        help,
    }
}
