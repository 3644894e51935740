//! Outputs to other programs: what they are called, and the thread that feeds one.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;

use taxel::acquisition::Stream;
use taxel::estimation::Meaning;
use taxel::shown;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};

use super::lines::LineSink;
use super::lsl::Lsl;
use super::osc::Osc;
use super::plot_juggler::PlotJuggler;
use super::sink::{LineFormat, Sink};
use super::tcp::TcpLines;
use crate::outgoing::Outgoing;
use crate::save::{SaveError, created};
use crate::shared::Shared;

/// Where it goes.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Place {
    StandardOutput,
    File(PathBuf),
    /// A port of this machine that programs connect to.
    Port(String),
    /// A port that datagrams are sent to.
    Datagrams(String),
    /// Whoever asks for it on the local network.
    Network,
}

/// An output to other programs, as the command line names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineOutput {
    format: LineFormat,
    place: Place,
}

/// The text names no output.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "--out \"{text}\" is no output; use jsonl, csv, jsonl:FILE, csv:FILE, jsonl:tcp:PORT, csv:tcp:PORT, osc:HOST:PORT, plotjuggler:HOST:PORT or lsl"
)]
pub struct LineOutputError {
    /// The text.
    pub text: String,
}

/// `HOST:PORT`; a port alone is of this machine.
fn address(text: &str) -> Option<String> {
    let (host, port) = text.rsplit_once(':').unwrap_or(("127.0.0.1", text));
    let sound = !host.is_empty() && port.parse::<u16>().is_ok();
    sound.then(|| format!("{host}:{port}"))
}

impl LineOutput {
    /// Reads the name of an output.
    ///
    /// # Errors
    /// [`LineOutputError`].
    pub fn parse(text: &str) -> Result<Self, LineOutputError> {
        let wrong = || LineOutputError { text: text.into() };
        let (name, place) = match text.split_once(':') {
            Some((name, place)) => (name, Some(place)),
            None => (text, None),
        };
        let format = LineFormat::ALL.into_iter().find(|one| one.name() == name);
        let format = format.ok_or_else(wrong)?;
        let place = match (format, place) {
            (LineFormat::Lsl, None) => Place::Network,
            (LineFormat::Osc | LineFormat::PlotJuggler, Some(place)) => {
                Place::Datagrams(address(place).ok_or_else(wrong)?)
            }
            (LineFormat::JsonLines | LineFormat::Csv, None | Some("-")) => Place::StandardOutput,
            (LineFormat::JsonLines | LineFormat::Csv, Some(place)) if !place.is_empty() => {
                match place.strip_prefix("tcp:") {
                    Some(place) => Place::Port(address(place).ok_or_else(wrong)?),
                    None => Place::File(place.into()),
                }
            }
            _ => return Err(wrong()),
        };
        Ok(Self { format, place })
    }

    /// The file, if it is one.
    pub fn file(&self) -> Option<&Path> {
        match &self.place {
            Place::File(path) => Some(path),
            _ => None,
        }
    }

    /// True if it takes the standard output.
    pub fn is_standard(&self) -> bool {
        self.place == Place::StandardOutput
    }

    /// What the operator is told before it begins; nothing of an output that nobody else can read.
    pub fn caution(&self) -> Option<&'static str> {
        (self.place == Place::Network).then_some(
            "--out lsl: the lab streaming layer has no password; whoever is on the local network can read these streams",
        )
    }

    /// True if its lines are rows of the table of estimates.
    pub(crate) fn are_rows(&self) -> bool {
        self.format == LineFormat::Csv
    }

    fn open(
        &self,
        replace: bool,
        (meaning, stream): (&Meaning, &Stream),
        shared: &Arc<Shared>,
    ) -> Result<Box<dyn Sink>, SaveError> {
        let fail = |cause| SaveError::Create {
            path: self.to_string().into(),
            cause,
        };
        let link = shared.link.get().cloned();
        let lines = |out| LineSink::new(out, self.format, meaning, link.clone());
        Ok(match (&self.place, self.format) {
            (Place::StandardOutput, _) => Box::new(lines(Box::new(io::stdout()))),
            (Place::File(path), _) => {
                let file = created(path, replace).map_err(|cause| SaveError::Create {
                    path: path.clone(),
                    cause,
                })?;
                Box::new(lines(Box::new(file)))
            }
            (Place::Port(port), _) => {
                let head = LineSink::head(self.format, meaning);
                let port = TcpLines::open(port, head).map_err(fail)?;
                Box::new(lines(Box::new(port)))
            }
            (Place::Datagrams(to), LineFormat::Osc) => Box::new(Osc::open(to).map_err(fail)?),
            (Place::Datagrams(to), _) => Box::new(PlotJuggler::open(to, meaning).map_err(fail)?),
            (Place::Network, _) => Box::new(Lsl::open(meaning, stream).map_err(fail)?),
        })
    }
}

impl fmt::Display for LineOutput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let format = self.format.name();
        match &self.place {
            Place::StandardOutput | Place::Network => f.write_str(format),
            Place::File(path) => write!(f, "{format}:{}", shown::path(path)),
            Place::Port(port) => write!(f, "{format}:tcp:{port}"),
            Place::Datagrams(to) => write!(f, "{format}:{to}"),
        }
    }
}

/// What an output has written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineSummary {
    /// The output as the command line names it.
    pub output: String,
    /// Frames written.
    pub lines: u64,
    /// Frames that it missed because it was slow.
    pub dropped: u64,
}

/// Feeds an output on a thread of its own: it takes what the pump offers, and loses the oldest
/// when it is slow.
#[derive(Debug)]
pub(crate) struct Outlet {
    output: LineOutput,
    thread: JoinHandle<(LineSummary, Result<(), SaveError>)>,
}

/// Hears at once that an output has ended early: that its reader has gone, or why it failed.
type Ended = Arc<dyn Fn(Option<&SaveError>) + Send + Sync>;

impl Outlet {
    /// Opens the output; `ended` hears when its reader goes, and when it fails.
    pub(crate) fn start(
        output: &LineOutput,
        replace: bool,
        of: (&Meaning, &Stream),
        shared: &Arc<Shared>,
        ended: Ended,
    ) -> Result<Self, SaveError> {
        let mut feed = Feed {
            sink: output.open(replace, of, shared)?,
            shared: Arc::clone(shared),
            next_event: 0,
            summary: summary_of(output),
        };
        let messages = shared.messages.subscribe();
        let place = output.clone();
        let thread = std::thread::spawn(move || {
            let written = match feed.run(messages) {
                // Whoever reads may stop early (`taxel live --out jsonl | head`).
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                    ended(None);
                    Ok(())
                }
                written => written.map_err(|error| {
                    let error = failed(&place, &error);
                    ended(Some(&error));
                    error
                }),
            };
            feed.summary.dropped += feed.sink.dropped();
            feed.sink.end();
            (feed.summary, written)
        });
        Ok(Self {
            output: output.clone(),
            thread,
        })
    }

    /// Waits for the last frame: it is written once the pump has said that it ends.
    pub(crate) fn finish(self) -> (LineSummary, Result<(), SaveError>) {
        self.thread.join().unwrap_or_else(|_| {
            let error = io::Error::other("the writing thread ended unexpectedly");
            (summary_of(&self.output), Err(failed(&self.output, &error)))
        })
    }
}

fn summary_of(output: &LineOutput) -> LineSummary {
    LineSummary {
        output: output.to_string(),
        lines: 0,
        dropped: 0,
    }
}

fn failed(output: &LineOutput, error: &io::Error) -> SaveError {
    SaveError::Write {
        path: match &output.place {
            Place::StandardOutput => PathBuf::from("standard output"),
            Place::File(path) => path.clone(),
            _ => output.to_string().into(),
        },
        message: error.to_string(),
    }
}

struct Feed {
    sink: Box<dyn Sink>,
    shared: Arc<Shared>,
    next_event: u64,
    summary: LineSummary,
}

impl Feed {
    fn run(&mut self, mut messages: Receiver<Outgoing>) -> io::Result<()> {
        loop {
            let next = match messages.try_recv() {
                Err(TryRecvError::Empty) => {
                    self.sink.flush()?;
                    messages.blocking_recv()
                }
                Ok(outgoing) => Ok(outgoing),
                Err(TryRecvError::Lagged(frames)) => Err(RecvError::Lagged(frames)),
                Err(TryRecvError::Closed) => Err(RecvError::Closed),
            };
            match next {
                Ok(outgoing) if outgoing.is_end() => break,
                Ok(outgoing) => {
                    self.events(Some(&outgoing))?;
                    self.summary.lines += 1;
                    self.sink.frame(&outgoing)?;
                }
                Err(RecvError::Lagged(frames)) => self.summary.dropped += frames,
                Err(RecvError::Closed) => break,
            }
        }
        self.events(None)?;
        self.sink.flush()
    }

    /// Passes on the events since the last frame.
    fn events(&mut self, outgoing: Option<&Outgoing>) -> io::Result<()> {
        let (events, next) = self.shared.events().newer(self.next_event);
        self.next_event = next;
        events
            .iter()
            .try_for_each(|event| self.sink.event(event, outgoing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_read() {
        let jsonl = LineOutput::parse("jsonl").unwrap();
        assert_eq!((jsonl.format, jsonl.file()), (LineFormat::JsonLines, None));
        assert!(jsonl.is_standard());
        let csv = LineOutput::parse("csv:run.csv").unwrap();
        assert_eq!(csv.file(), Some(Path::new("run.csv")));
        for (text, shown) in [
            ("csv:run.csv", "csv:run.csv"),
            ("jsonl:tcp:7000", "jsonl:tcp:127.0.0.1:7000"),
            ("csv:tcp:0.0.0.0:7000", "csv:tcp:0.0.0.0:7000"),
            ("osc:localhost:9000", "osc:localhost:9000"),
            ("osc:9000", "osc:127.0.0.1:9000"),
            ("plotjuggler:9870", "plotjuggler:127.0.0.1:9870"),
            ("lsl", "lsl"),
        ] {
            let output = LineOutput::parse(text).unwrap();
            assert_eq!(output.to_string(), shown);
            assert_eq!(output.caution().is_some(), text == "lsl");
        }
        for text in [
            "json",
            "csv:",
            "",
            "osc",
            "osc:host",
            "lsl:here",
            "plotjuggler:x:70000",
            "csv:tcp:x",
        ] {
            let message = LineOutput::parse(text).unwrap_err().to_string();
            assert!(message.contains("osc:HOST:PORT"), "{message}");
        }
    }
}
