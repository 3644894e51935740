//! Live sources, HTTP and WebSocket service, and the page.
//!
//! A [`Session`] joins a [`Source`] of frames (the twin, a recording, a link to a board) and the
//! estimator of its device; it runs headless or serves the page.
//!
//! # Example: frames of the simulated twin
//! ```
//! use taxel::acquisition::{Stimulus, Twin};
//! use taxel::sensor::Sensor;
//! use taxel_serve::{Next, Source, TwinSource};
//!
//! let sensor = Sensor::shipped("three-axis-8x8").expect("a shipped sensor");
//! let script = Stimulus::shipped_text("finger").expect("a shipped script");
//! let twin = Twin::new(&sensor, &Stimulus::parse("finger", script)?, 1)?;
//! let mut source = TwinSource::new(twin);
//! assert_eq!(source.stream().channels(), 256);
//! while let Next::Frame(frame) = source.next()? {
//!     assert_eq!(frame.values.len(), 256);
//!     if frame.sequence == 5 { break; }
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod board;
mod capture;
mod condition;
mod connection;
pub mod device;
mod events;
mod history;
mod interrupt;
mod last_touch;
mod latency;
pub mod link;
mod link_source;
mod marks;
mod message;
mod moved_rest;
mod out;
mod outgoing;
mod pump;
mod record;
mod replay;
mod reserved;
mod save;
mod server;
mod source;
mod tare;
#[cfg(test)]
mod tests;

use std::net::SocketAddr;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};

pub use board::{BoardDecoder, BoardEncoder, begin, greeting, serial_settings};
pub use capture::CaptureSource;
pub use condition::{ChannelConditions, SwappedChannels, WrongChannel};
pub use events::{EventFile, EventFileError, EventRecord, EventSummary};
pub use interrupt::Interrupt;
pub use last_touch::LastTouch;
pub use latency::Latencies;
pub use link_source::LinkSource;
pub use message::{Provenance, Tare};
pub use out::{LineFormat, LineOutput, LineOutputError, LineSummary, TouchTable};
pub use pump::{Command, Failure, PumpOptions, StartTare, Summary};
pub use record::{
    RecordFile, RecordFolder, RecordTo, Recorded, Recorder, RecordingSummary, WhenRecordingFails,
};
pub use replay::{Reopen, Replay, ReplayCommand};
pub use save::SaveError;
pub use source::{Next, ReplayOptions, ReplaySource, Source, SourceError, Survey, TwinSource};
pub use tare::{BelowZero, By};

use history::History;
use pump::{Pump, Shared};
use server::Site;
use taxel::acquisition::Stream;
use taxel::estimation::TouchSession;

/// Why the service could not run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The address cannot be listened on.
    #[error(
        "cannot listen on {address}: {cause}; choose another with --port, or --port 0 for any free one"
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The system gives no runtime, random numbers or threads.
    #[error("the system refused: {0}")]
    System(String),
    /// The address of the page could not be told.
    #[error("cannot print the address of the page: {0}")]
    NotTold(std::io::Error),
    /// The frames cannot be saved.
    #[error("{0}")]
    Save(#[from] SaveError),
}

/// A live session: a source, an estimator, and options.
pub struct Session {
    /// Where frames come from.
    pub source: Box<dyn Source>,
    /// Estimator and observer of the device.
    pub touch: TouchSession,
    /// Options of the run.
    pub options: PumpOptions,
    /// Whether lines of the standard input are marks.
    pub marks: Marks,
    /// Program and device as reported to clients.
    pub provenance: Provenance,
    /// The device to scale, SVG; empty for a recording that describes itself.
    pub drawing: String,
    /// A recording whose replay clients may control; `None` for other sources.
    pub replay: Option<Replay>,
}

/// Where marks come from beside the clients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Marks {
    /// From clients alone.
    #[default]
    Clients,
    /// From lines of the standard input, too.
    StandardInput,
}

impl Marks {
    fn listen(self, commands: &mpsc::SyncSender<Command>) {
        if self == Self::StandardInput {
            let input = std::io::BufReader::new(std::io::stdin());
            marks::listen(input, commands.clone());
        }
    }
}

/// Silence after which a source counts as stale, s, unless its own frames are
/// further apart.
const STALE_AFTER: f64 = 0.35;

/// Silence after which a source of these frames counts as stale, s.
pub(crate) fn stale_after(stream: &Stream) -> f64 {
    STALE_AFTER.max(2.5 * stream.period.unwrap_or(0.0))
}

/// Runs a session without a page until it ends or the process is interrupted.
///
/// # Errors
/// [`ServeError`] when it cannot begin; failures of the source are part of the
/// summary.
pub fn run_headless(session: Session) -> Result<Summary, ServeError> {
    let (sender, commands) = mpsc::sync_channel(16);
    session.marks.listen(&sender);
    let shared = Shared::new();
    let pump = Pump::new(
        session.source,
        session.touch,
        session.options,
        Arc::clone(&shared),
        commands,
    )?;
    runtime()?.block_on(async {
        let interrupted = interruption()?;
        let run = tokio::task::spawn_blocking(|| pump.run());
        finish(run, interrupted, &shared, true).await
    })
}

/// Runs a session with its page at `address` until the process is interrupted
/// or `options.frames` are done; `ready` receives the address of the page.
///
/// # Errors
/// As [`run_headless`], when the address is taken, and when `ready` fails.
pub fn run_with_page(
    session: Session,
    address: SocketAddr,
    ready: impl FnOnce(&str) -> std::io::Result<()>,
) -> Result<Summary, ServeError> {
    let (sender, commands) = mpsc::sync_channel(16);
    session.marks.listen(&sender);
    let shared = Shared::new();
    let ends = session.options.frames.is_some();
    // What is written is one pass of the source, from its beginning to its end.
    let replay = session
        .replay
        .filter(|_| !session.options.is_bounded() && !session.options.writes());
    let records_to = session
        .options
        .record_folder
        .as_ref()
        .filter(|_| replay.is_none());
    let records_to = records_to.map(|folder| folder.folder.to_string_lossy().into_owned());
    let provenance = session.provenance;
    runtime()?.block_on(async {
        let listen = |cause| ServeError::Listen { address, cause };
        let listener = tokio::net::TcpListener::bind(address)
            .await
            .map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let mut pump = Pump::new(
            session.source,
            session.touch,
            session.options,
            Arc::clone(&shared),
            commands,
        )?;
        if let Some(replay) = replay {
            pump.control(replay);
        }
        *shared.history() = History::new(pump.session().meaning());
        let stale_after = stale_after(pump.stream());
        let token = random_token()?;
        let site = Arc::new(Site {
            hello: message::hello(
                pump.stream(),
                pump.session().meaning(),
                &provenance,
                stale_after,
            ),
            drawing: session.drawing,
            provenance,
            token: token.clone(),
            address: address.ip(),
            stale_after,
            records_to,
            shared: Arc::clone(&shared),
            commands: sender,
        });
        let interrupted = interruption()?;
        ready(&server::page_address(address, &token)).map_err(ServeError::NotTold)?;
        let serving = tokio::spawn(server::serve(listener, site));
        let run = tokio::task::spawn_blocking(|| pump.run());
        let summary = finish(run, interrupted, &shared, ends).await;
        // A client that does not read must not keep the process alive.
        serving.abort();
        summary
    })
}

/// Waits for the pump; with `ends` unset, the page stays up after a recording
/// has ended, until the interruption.
async fn finish(
    run: tokio::task::JoinHandle<Summary>,
    interrupted: impl Future<Output = ()>,
    shared: &Shared,
    ends: bool,
) -> Result<Summary, ServeError> {
    let stop = || shared.stop.store(true, Ordering::Relaxed);
    let lost = |error: tokio::task::JoinError| ServeError::System(error.to_string());
    tokio::pin!(run, interrupted);
    tokio::select! {
        summary = &mut run => {
            if !ends {
                interrupted.await;
            }
            stop();
            summary.map_err(lost)
        }
        () = &mut interrupted => {
            stop();
            run.await.map_err(lost)
        }
    }
}

fn runtime() -> Result<tokio::runtime::Runtime, ServeError> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| ServeError::System(error.to_string()))
}

/// Ends with SIGINT (Ctrl-C) or, on Unix, SIGTERM and SIGHUP.
fn interruption() -> Result<impl Future<Output = ()>, ServeError> {
    let mut signals =
        interrupt::Signals::listen().map_err(|error| ServeError::System(error.to_string()))?;
    Ok(async move {
        signals.next().await;
    })
}

fn random_token() -> Result<String, ServeError> {
    use std::fmt::Write;
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| ServeError::System(error.to_string()))?;
    Ok(bytes.iter().fold(String::new(), |mut token, byte| {
        let _ = write!(token, "{byte:02x}");
        token
    }))
}
