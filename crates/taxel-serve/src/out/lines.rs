//! One line for each frame: on the standard output, in a file, or at a port.

use std::io::{self, BufWriter, Write};

use taxel::estimation::Meaning;

use super::frame::{Columns, FrameMessage};
use super::sink::{LineFormat, Sink};
use super::table::Rows;
use crate::link::LinkHandle;
use crate::outgoing::Outgoing;

/// Lines are written out when this much has gathered, bytes.
const BUFFER: usize = 1 << 16;

/// What lines are written to.
pub(super) trait Lines: Write + Send {
    /// Lines that a reader missed because it was slow.
    fn dropped(&self) -> u64 {
        0
    }

    /// True if readers come later, and get the first line when they do.
    fn has_own_head(&self) -> bool {
        false
    }
}

impl Lines for io::Stdout {}
impl Lines for std::fs::File {}

/// Writes lines.
pub(super) struct LineSink {
    /// None after the end.
    out: Option<BufWriter<Box<dyn Lines>>>,
    format: LineFormat,
    columns: Columns,
    /// The first line, while it is to be written.
    head: String,
    link: Option<LinkHandle>,
    line: String,
}

impl LineSink {
    pub(super) fn new(
        out: Box<dyn Lines>,
        format: LineFormat,
        meaning: &Meaning,
        link: Option<LinkHandle>,
    ) -> Self {
        Self {
            head: if out.has_own_head() {
                String::new()
            } else {
                Self::head(format, meaning)
            },
            out: Some(BufWriter::with_capacity(BUFFER, out)),
            format,
            columns: Columns::new(meaning),
            link,
            line: String::new(),
        }
    }

    /// The line before those of the frames; empty without one.
    pub(super) fn head(format: LineFormat, meaning: &Meaning) -> String {
        match format {
            LineFormat::Csv => Rows::header(meaning),
            _ => String::new(),
        }
    }
}

impl Sink for LineSink {
    fn frame(&mut self, outgoing: &Outgoing) -> io::Result<()> {
        let Some(out) = &mut self.out else {
            return Ok(());
        };
        out.write_all(std::mem::take(&mut self.head).as_bytes())?;
        match &outgoing.row {
            Some(row) if self.format == LineFormat::Csv => out.write_all(row.as_bytes()),
            _ => {
                let link = self.link.as_ref().map_or("", |link| link.state().key());
                self.line.clear();
                FrameMessage(&outgoing.bytes).json(&self.columns, link, &mut self.line);
                out.write_all(self.line.as_bytes())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        let Some(out) = &mut self.out else {
            return Ok(());
        };
        out.write_all(std::mem::take(&mut self.head).as_bytes())?;
        out.flush()
    }

    fn dropped(&self) -> u64 {
        self.out.as_ref().map_or(0, |out| out.get_ref().dropped())
    }

    /// What is still held would be written once more to a pipe that is closed.
    fn end(&mut self) {
        if let Some(out) = self.out.take() {
            let (_, _unwritten) = out.into_parts();
        }
    }
}
