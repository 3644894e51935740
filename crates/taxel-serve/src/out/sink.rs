//! What an output is, and in which forms there are some.

use std::io;

use crate::events::EventRecord;
use crate::outgoing::Outgoing;

/// Takes the frames of a run and the events between them: a further output is a file that implements this,
/// a form of [`LineFormat`] and an arm of `LineOutput::open`.
pub(crate) trait Sink: Send {
    /// Takes a frame.
    fn frame(&mut self, outgoing: &Outgoing) -> io::Result<()>;

    /// Takes an event.
    fn event(&mut self, event: &EventRecord, outgoing: Option<&Outgoing>) -> io::Result<()> {
        let _ = (event, outgoing);
        Ok(())
    }

    /// Nothing more waits: whoever reads gets what there is.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Frames that a reader of it missed because it was slow.
    fn dropped(&self) -> u64 {
        0
    }

    /// Ends after the last frame.
    fn end(&mut self) {}
}

/// What is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFormat {
    /// An object of JSON.
    JsonLines,
    /// A row of CSV, after one with the names of the columns.
    Csv,
    /// Messages of Open Sound Control.
    Osc,
    /// Objects of JSON as `PlotJuggler` takes them.
    PlotJuggler,
    /// Streams of the lab streaming layer.
    Lsl,
}

impl LineFormat {
    pub(super) const ALL: [Self; 5] = [
        Self::JsonLines,
        Self::Csv,
        Self::Osc,
        Self::PlotJuggler,
        Self::Lsl,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::JsonLines => "jsonl",
            Self::Csv => "csv",
            Self::Osc => "osc",
            Self::PlotJuggler => "plotjuggler",
            Self::Lsl => "lsl",
        }
    }
}
