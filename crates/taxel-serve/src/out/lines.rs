//! One line for each frame, on the standard output or in a file.

use std::fmt;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;

use taxel::estimation::Meaning;
use taxel::shown;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};

use super::frame::{Columns, FrameMessage};
use super::table::Rows;
use crate::link::LinkHandle;
use crate::outgoing::Outgoing;
use crate::save::{SaveError, created};

/// Format of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFormat {
    /// An object of JSON.
    JsonLines,
    /// A row of CSV, after one with the names of the columns.
    Csv,
}

/// Where lines go.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    StandardOutput,
    File(PathBuf),
}

/// Lines for other programs, as the command line names them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineOutput {
    format: LineFormat,
    place: Place,
}

/// The text names no output.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--out \"{text}\" is no output; use jsonl, csv, jsonl:FILE or csv:FILE")]
pub struct LineOutputError {
    /// The text.
    pub text: String,
}

impl LineOutput {
    /// Reads the name of an output.
    ///
    /// # Errors
    /// [`LineOutputError`].
    pub fn parse(text: &str) -> Result<Self, LineOutputError> {
        let (format, file) = match text.split_once(':') {
            Some((format, file)) => (format, Some(file)),
            None => (text, None),
        };
        let format = match format {
            "jsonl" => LineFormat::JsonLines,
            "csv" => LineFormat::Csv,
            _ => return Err(LineOutputError { text: text.into() }),
        };
        let place = match file {
            None | Some("-") => Place::StandardOutput,
            Some("") => return Err(LineOutputError { text: text.into() }),
            Some(file) => Place::File(file.into()),
        };
        Ok(Self { format, place })
    }

    /// The file, if it is one.
    pub fn file(&self) -> Option<&Path> {
        match &self.place {
            Place::File(path) => Some(path),
            Place::StandardOutput => None,
        }
    }

    fn open(&self, replace: bool) -> Result<Box<dyn Write + Send>, SaveError> {
        Ok(match &self.place {
            Place::StandardOutput => Box::new(io::stdout()),
            Place::File(path) => {
                Box::new(created(path, replace).map_err(|cause| SaveError::Create {
                    path: path.clone(),
                    cause,
                })?)
            }
        })
    }
}

impl fmt::Display for LineOutput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let format = match self.format {
            LineFormat::JsonLines => "jsonl",
            LineFormat::Csv => "csv",
        };
        match &self.place {
            Place::StandardOutput => write!(f, "{format}"),
            Place::File(path) => write!(f, "{format}:{}", shown::path(path)),
        }
    }
}

/// What an output has written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSummary {
    /// The output as the command line names it.
    pub output: String,
    /// Lines written.
    pub lines: u64,
    /// Frames that it missed because it was slow.
    pub dropped: u64,
}

/// Writes lines on a thread of its own: it takes what the pump offers, and loses the oldest
/// when it is slow.
#[derive(Debug)]
pub(crate) struct Lines {
    output: LineOutput,
    thread: JoinHandle<(LineSummary, io::Result<()>)>,
}

impl Lines {
    /// Opens the output; `closed` is called when its reader goes.
    pub(crate) fn start(
        output: &LineOutput,
        replace: bool,
        meaning: &Meaning,
        link: Option<LinkHandle>,
        messages: Receiver<Outgoing>,
        closed: Arc<dyn Fn() + Send + Sync>,
    ) -> Result<Self, SaveError> {
        let mut writer = Writer {
            out: BufWriter::with_capacity(1 << 16, output.open(replace)?),
            format: output.format,
            columns: Columns::new(meaning),
            header: Rows::header(meaning),
            link,
            line: String::new(),
            summary: LineSummary {
                output: output.to_string(),
                lines: 0,
                dropped: 0,
            },
        };
        let thread = std::thread::spawn(move || {
            let written = writer.run(messages);
            let written = match written {
                // Whoever reads may stop early (`taxel live --out jsonl | head`).
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    closed();
                    Ok(())
                }
                other => other,
            };
            // What is still held would be written once more to a pipe that is closed.
            let (_, _unwritten) = writer.out.into_parts();
            (writer.summary, written)
        });
        Ok(Self {
            output: output.clone(),
            thread,
        })
    }

    /// True if its lines are rows of the table of estimates.
    pub(crate) fn are_rows(&self) -> bool {
        self.output.format == LineFormat::Csv
    }

    /// Waits for the last line: it is written once the pump has said that it ends.
    pub(crate) fn finish(self) -> (LineSummary, Result<(), SaveError>) {
        let path = match &self.output.place {
            Place::StandardOutput => PathBuf::from("standard output"),
            Place::File(path) => path.clone(),
        };
        let (summary, written) = self.thread.join().unwrap_or_else(|_| {
            let error = io::Error::other("the writing thread ended unexpectedly");
            let summary = LineSummary {
                output: self.output.to_string(),
                lines: 0,
                dropped: 0,
            };
            (summary, Err(error))
        });
        let written = written.map_err(|error| SaveError::Write {
            path,
            message: error.to_string(),
        });
        (summary, written)
    }
}

struct Writer {
    out: BufWriter<Box<dyn Write + Send>>,
    format: LineFormat,
    columns: Columns,
    header: String,
    link: Option<LinkHandle>,
    line: String,
    summary: LineSummary,
}

impl Writer {
    fn run(&mut self, mut messages: Receiver<Outgoing>) -> io::Result<()> {
        if self.format == LineFormat::Csv {
            self.out.write_all(self.header.as_bytes())?;
        }
        loop {
            let next = match messages.try_recv() {
                Err(TryRecvError::Empty) => {
                    // Whoever reads gets at once what there is.
                    self.out.flush()?;
                    messages.blocking_recv()
                }
                Ok(outgoing) => Ok(outgoing),
                Err(TryRecvError::Lagged(frames)) => Err(RecvError::Lagged(frames)),
                Err(TryRecvError::Closed) => Err(RecvError::Closed),
            };
            match next {
                Ok(outgoing) if outgoing.is_end() => break,
                Ok(outgoing) => self.write(&outgoing)?,
                Err(RecvError::Lagged(frames)) => self.summary.dropped += frames,
                Err(RecvError::Closed) => break,
            }
        }
        self.out.flush()
    }

    fn write(&mut self, outgoing: &Outgoing) -> io::Result<()> {
        self.summary.lines += 1;
        match &outgoing.row {
            Some(row) if self.format == LineFormat::Csv => self.out.write_all(row.as_bytes()),
            _ => {
                let link = self.link.as_ref().map_or("", |link| link.state().key());
                self.line.clear();
                FrameMessage(&outgoing.bytes).json(&self.columns, link, &mut self.line);
                self.out.write_all(self.line.as_bytes())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_read() {
        let jsonl = LineOutput::parse("jsonl").unwrap();
        assert_eq!((jsonl.format, jsonl.file()), (LineFormat::JsonLines, None));
        let csv = LineOutput::parse("csv:run.csv").unwrap();
        assert_eq!(csv.file(), Some(Path::new("run.csv")));
        assert_eq!(csv.to_string(), "csv:run.csv");
        for text in ["json", "csv:", ""] {
            let message = LineOutput::parse(text).unwrap_err().to_string();
            assert!(message.contains("jsonl:FILE"), "{message}");
        }
    }
}
