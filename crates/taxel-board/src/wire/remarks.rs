//! What does not agree with the board file, by what comes.

use super::pace::{Disagrees, Pace, Passed};
use crate::board::Board;

/// Collects what the operator should change in the board file.
#[derive(Debug, Clone)]
pub(super) struct Remarks {
    stated_rate: Option<f64>,
    says_hello: bool,
    has_clock: bool,
    pace: Pace,
    /// Bytes of the last packet of another length, and those of the fields.
    other_length: Option<[usize; 2]>,
    /// True if nothing tells how far apart frames are.
    untimed: bool,
}

impl Remarks {
    pub(super) fn new(board: &Board) -> Self {
        Self {
            stated_rate: board.rate,
            says_hello: board.says_hello(),
            has_clock: board.clock().is_some(),
            pace: Pace::new(board.rate),
            other_length: None,
            untimed: false,
        }
    }

    /// Takes a frame.
    pub(super) fn push(&mut self, passed: Passed) {
        self.untimed |= passed.host_ns.is_none() && !self.has_clock && self.stated_rate.is_none();
        self.pace.push(passed);
    }

    /// Takes the bytes of a packet that seems to be a frame of another length, and those that
    /// the fields have.
    pub(super) fn other_length(&mut self, lengths: Option<[usize; 2]>) {
        self.other_length = lengths.or(self.other_length);
    }

    /// A new connection.
    pub(super) fn reconnect(&mut self) {
        self.pace.reconnect();
    }

    /// The most urgent one after so many frames: one line.
    pub(super) fn of(&self, delivered: u64) -> Option<String> {
        if let (0, Some([found, expected])) = (delivered, self.other_length) {
            return Some(self.of_length(found, expected));
        }
        if self.untimed {
            return Some(
                "nobody wrote down when these bytes arrived, and the board file has neither a time nor a rate: the frames are placed 1 ms apart; write rate = \"100 Hz\" or what it is"
                    .into(),
            );
        }
        match (self.pace.found()?, self.stated_rate) {
            (Disagrees::Clock(ratio), _) => Some(format!(
                "the clock of the board runs {} times as fast as that of this computer; compare the unit of its time in the board file with the firmware",
                significant(ratio)
            )),
            (Disagrees::Rate(_), None) => None,
            (Disagrees::Rate(measured), Some(stated)) => {
                let (measured, stated) = (significant(measured), significant(stated));
                let hello = if self.says_hello {
                    " (in a hello \"rate\")"
                } else {
                    ""
                };
                Some(format!(
                    "{measured} frames a second come, the board file says {stated}; what follows from the rate is wrong by as much; write rate = \"{measured} Hz\"{hello}"
                ))
            }
        }
    }

    fn of_length(&self, found: usize, expected: usize) -> String {
        let by = found.abs_diff(expected);
        let longer = if found > expected {
            "longer"
        } else {
            "shorter"
        };
        let said = if self.says_hello {
            "the hello of the board, or its board file, says"
        } else {
            "the fields of the board file say"
        };
        format!(
            "frames are {by} bytes {longer} than {said}: {found} bytes, not {expected}, with the right check; name all values in the fields"
        )
    }
}

/// Three digits, as a person would write them.
fn significant(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    let magnitude = number.abs().log10().floor() as i32;
    let unit = 10_f64.powi(magnitude - 2);
    let rounded = (number / unit).round() * unit;
    format!("{rounded:.*}", (2 - magnitude).clamp(0, 9) as usize)
        .trim_end_matches(|c| c == '0' && magnitude < 2)
        .trim_end_matches('.')
        .to_owned()
}
