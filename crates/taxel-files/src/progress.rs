//! Progress of long work, on the standard error.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

use crate::note;

/// A line that says how far the work is and how long it will take.
pub struct Progress {
    what: String,
    start: Instant,
    shown: Option<Instant>,
    live: bool,
}

/// Time between two lines: on a terminal, and in a log.
const LIVE: Duration = Duration::from_millis(200);
const LOG: Duration = Duration::from_secs(10);

impl Progress {
    /// Progress of `what`, which begins now.
    pub fn new(what: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            start: Instant::now(),
            shown: None,
            live: std::io::stderr().is_terminal(),
        }
    }

    /// Hears that a fraction of the work is done.
    pub fn at(&mut self, fraction: f64) {
        let pause = if self.live { LIVE } else { LOG };
        let since = self.shown.unwrap_or(self.start).elapsed();
        if since < pause {
            return;
        }
        self.shown = Some(Instant::now());
        let gone = self.start.elapsed().as_secs_f64();
        let left = if fraction > 0.0 {
            format!(", about {:.0} s left", gone * (1.0 - fraction) / fraction)
        } else {
            String::new()
        };
        let line = format!("{}: {:.0} %{left}", self.what, 100.0 * fraction);
        if self.live {
            let _ = write!(std::io::stderr(), "\r{line:<60}");
            let _ = std::io::stderr().flush();
        } else {
            note!("{line}");
        }
    }

    /// Clears the line of a terminal.
    pub fn end(&mut self) {
        if self.live && self.shown.is_some() {
            let _ = write!(std::io::stderr(), "\r{:<60}\r", "");
        }
    }
}
