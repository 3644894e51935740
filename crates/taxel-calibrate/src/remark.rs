//! Remarks of a calibration on its readings.

use std::fmt;

/// A remark, at a line of the readings or about all of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// Finding and action.
    pub message: String,
}

impl Remark {
    /// A remark at a line.
    pub fn at(line: usize, message: &str) -> Self {
        Self {
            line,
            message: message.to_owned(),
        }
    }

    /// Remark that so many readings, from these lines on, are of some kind; none without any.
    pub(crate) fn from_here_on(lines: &[usize], what: &str) -> Option<Self> {
        let message = format!("{} {what}, from here on", lines.len());
        lines.first().map(|line| Self::at(*line, &message))
    }

    /// One remark of what holds for several subjects alike, with the list of them; none without any.
    pub(crate) fn of_each(what: &str, subjects: &[String]) -> Option<Self> {
        let listed = || Self::whole(format!("{what}: {}", subjects.join(", ")));
        (!subjects.is_empty()).then(listed)
    }

    /// A remark about all readings.
    pub fn whole(message: impl Into<String>) -> Self {
        Self {
            line: 0,
            message: message.into(),
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => f.write_str(&self.message),
            line => write!(f, "line {line}: {}", self.message),
        }
    }
}
