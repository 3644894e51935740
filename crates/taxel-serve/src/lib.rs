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
mod clock;
mod condition;
mod connection;
pub mod device;
mod events;
mod foxglove;
mod history;
mod interrupt;
mod last_touch;
mod last_zero;
mod latency;
pub mod link;
mod link_source;
mod lsl;
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
mod shared;
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
pub use foxglove::foxglove_messages;
pub use interrupt::Interrupt;
pub use last_touch::LastTouch;
pub use last_zero::LastZero;
pub use latency::Latencies;
pub use link_source::LinkSource;
pub use marks::{Marks, MarksError};
pub use message::{Provenance, Tare};
pub use out::{LineFormat, LineOutput, LineOutputError, LineSummary, TouchTable};
pub use pump::{Command, Failure, NewMark, PumpOptions, StartTare, Summary};
pub use record::{
    RecordFile, RecordFolder, RecordTo, Recorded, Recorder, RecordingSummary, WhenRecordingFails,
};
pub use replay::{Reopen, Replay, ReplayCommand};
pub use save::SaveError;
pub use source::{
    Next, ReplaySource, Source, SourceError, Survey, TwinSource, open_foreign, open_recording,
};
pub use tare::{BelowZero, By};

use history::History;
use pump::Pump;
use server::Site;
use shared::Shared;
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
    /// The zero of the last run of this sensor; `None` where none is kept.
    pub last_zero: Option<LastZero>,
    /// Where marks come from beside the clients; default nowhere.
    pub marks: Vec<Marks>,
    /// Program and device as reported to clients.
    pub provenance: Provenance,
    /// The device to scale, SVG; empty for a recording that describes itself.
    pub drawing: String,
    /// A recording whose replay clients may control; `None` for other sources.
    pub replay: Option<Replay>,
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
    let shared = Shared::new();
    for marks in &session.marks {
        marks.listen(&sender, &shared, session.options.told);
    }
    let mut pump = Pump::new(
        session.source,
        session.touch,
        session.options,
        Arc::clone(&shared),
        commands,
    )?;
    pump.compare_zeros(session.last_zero);
    runtime()?.block_on(async {
        let interrupted = interruption()?;
        let run = tokio::task::spawn_blocking(|| pump.run());
        let summaries = finish(vec![run], interrupted, &[shared], true).await?;
        let nothing = || ServeError::System("the session gave no summary".into());
        summaries.into_iter().next().ok_or_else(nothing)
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
    let mut summaries = run_with_pages(vec![session], address, ready)?;
    let nothing = || ServeError::System("the session gave no summary".into());
    summaries.pop().ok_or_else(nothing)
}

/// Runs several sessions side by side, each with its page, as [`run_with_page`]: a source that is absent or
/// ends does not stop the others. The page of the first has the address that `ready` receives; each page leads
/// to the others.
///
/// # Errors
/// As [`run_with_page`].
pub fn run_with_pages(
    sessions: Vec<Session>,
    address: SocketAddr,
    ready: impl FnOnce(&str) -> std::io::Result<()>,
) -> Result<Vec<Summary>, ServeError> {
    let ends = sessions.iter().any(|session| session.options.is_bounded());
    runtime()?.block_on(async {
        let listen = |cause| ServeError::Listen { address, cause };
        let listener = tokio::net::TcpListener::bind(address)
            .await
            .map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        let token = random_token()?;
        let (mut sites, mut pumps) = (Vec::new(), Vec::new());
        for session in sessions {
            let (site, pump) = begun(session, address, &token)?;
            sites.push(site);
            pumps.push(pump);
        }
        let sites = Arc::new(sites);
        let shared: Vec<_> = sites.iter().map(|site| Arc::clone(&site.shared)).collect();
        let interrupted = interruption()?;
        ready(&server::page_address(address, &token)).map_err(ServeError::NotTold)?;
        let serving = tokio::spawn(server::serve(listener, sites));
        let runs = pumps.into_iter();
        let runs: Vec<_> = runs
            .map(|pump| tokio::task::spawn_blocking(|| pump.run()))
            .collect();
        let summaries = finish(runs, interrupted, &shared, ends).await;
        // A client that does not read must not keep the process alive.
        serving.abort();
        summaries
    })
}

/// The site and the pump of a session.
fn begun(
    mut session: Session,
    address: SocketAddr,
    token: &str,
) -> Result<(Site, Pump), ServeError> {
    let (sender, commands) = mpsc::sync_channel(16);
    let shared = Shared::new();
    for marks in &session.marks {
        marks.listen(&sender, &shared, session.options.told);
    }
    let options = &mut session.options;
    // What is written is one pass of the source, from its beginning to its end.
    let controlled = !options.is_bounded() && !options.writes();
    let replay = session.replay.filter(|_| controlled);
    if replay.is_some() {
        options.record_folder = None;
    }
    let folder = options.record_folder.as_ref();
    let records_to = folder.map(|folder| folder.folder.to_string_lossy().into_owned());
    let provenance = session.provenance;
    let mut pump = Pump::new(
        session.source,
        session.touch,
        session.options,
        Arc::clone(&shared),
        commands,
    )?;
    pump.compare_zeros(session.last_zero);
    if let Some(replay) = replay {
        pump.control(replay);
    }
    *shared.history() = History::new(pump.session().meaning());
    let stale_after = stale_after(pump.stream());
    let site = Site {
        hello: message::hello(
            pump.stream(),
            pump.session().estimator(),
            &provenance,
            stale_after,
        ),
        drawing: session.drawing,
        foxglove: foxglove::View::new(pump.session().meaning()),
        provenance,
        token: token.to_owned(),
        address: address.ip(),
        stale_after,
        records_to,
        shared,
        commands: sender,
    };
    Ok((site, pump))
}

/// Waits for the pumps; with `ends` unset, the page stays up after all recordings
/// have ended, until the interruption.
async fn finish(
    runs: Vec<tokio::task::JoinHandle<Summary>>,
    interrupted: impl Future<Output = ()>,
    shared: &[Arc<Shared>],
    ends: bool,
) -> Result<Vec<Summary>, ServeError> {
    let stop = || {
        let stops = shared.iter().map(|shared| &shared.stop);
        stops.for_each(|stop| stop.store(true, Ordering::Relaxed));
    };
    let all = async {
        let mut summaries = Vec::new();
        for run in runs {
            let lost = |error: tokio::task::JoinError| ServeError::System(error.to_string());
            summaries.push(run.await.map_err(lost)?);
        }
        Ok(summaries)
    };
    tokio::pin!(all, interrupted);
    tokio::select! {
        summaries = &mut all => {
            if !ends {
                interrupted.await;
            }
            stop();
            summaries
        }
        () = &mut interrupted => {
            stop();
            all.await
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
