//! The pump: takes frames from a source in real time, estimates, and offers
//! the messages to whoever listens. No listener can slow it.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bytes::Bytes;
use taxel::acquisition::{Frame, FrameFlags, Stream};
use taxel::estimation::{Continuity, FrameError, RestRefused, State, TaxelTouch, TouchSession};
use taxel::shown;
use taxel_recording::mcap::{
    FrameMessage, HealthMessage, LinkMessage, MarkMessage, RECONNECTED, RestKind, RestMessage,
};
use tokio::sync::broadcast;

use crate::condition::{ChannelConditions, ConditionSender};
use crate::events::{EventFile, EventLog, EventSummary, EventWriter, Events};
use crate::history::{History, Mark};
use crate::last_touch::LastTouch;
use crate::latency::Latencies;
use crate::link::{LinkHandle, LinkStatus};
use crate::message::{self, Health, Tare};
use crate::moved_rest::MovedRest;
use crate::out::{LineOutput, LineSummary, Lines, Rows, TableWriter, TouchTable};
use crate::outgoing::Outgoing;
use crate::record::{
    RecordFolder, RecordTo, Recorder, RecordingSummary, event_message, rest_message, rest_of,
    touch_message,
};
use crate::replay::{Playing, Replay, ReplayCommand, ReplayNow};
use crate::save::{Pace, SaveError, Saver};
use crate::source::{Next, Source, SourceError};
use crate::tare::{BaselineSender, BelowZero, By, Owed, TareHistory, unix_s};

/// Options of the pump.
#[derive(Debug, Clone)]
pub struct PumpOptions {
    /// Device seconds per second; infinite means as fast as possible; default 1.
    pub speed: f64,
    /// End after so many new frames; default never.
    pub frames: Option<u64>,
    /// Frames of a rest capture; default 50, as in the paper.
    pub tare_frames: usize,
    /// Whether a rest capture is taken at the start; default automatic.
    pub start_tare: StartTare,
    /// Name of the recording that the rest values of the session are from, if they are from one.
    pub rest_from: Option<String>,
    /// Write the frames of the source to this file.
    pub save: Option<PathBuf>,
    /// Write the events to this file.
    pub events: Option<EventFile>,
    /// Record the run here.
    pub record: Option<RecordTo>,
    /// Where clients may record the run to.
    pub record_folder: Option<RecordFolder>,
    /// Lines for other programs.
    pub outputs: Vec<LineOutput>,
    /// Write the estimates of every frame to this table.
    pub table: Option<TouchTable>,
    /// True if `save`, `events`, `table`, `outputs` and `record` may replace ordinary files that exist;
    /// default false.
    pub replace_files: bool,
    /// Lines of provenance for the saved file.
    pub provenance: Vec<String>,
}

impl Default for PumpOptions {
    fn default() -> Self {
        Self {
            speed: 1.0,
            frames: None,
            tare_frames: 50,
            start_tare: StartTare::Automatic,
            rest_from: None,
            save: None,
            events: None,
            record: None,
            record_folder: None,
            outputs: Vec::new(),
            table: None,
            replace_files: false,
            provenance: Vec::new(),
        }
    }
}

impl PumpOptions {
    /// True if the run ends by itself.
    pub(crate) fn is_bounded(&self) -> bool {
        self.frames.is_some()
    }

    /// True if anything is written of the run.
    pub(crate) fn writes(&self) -> bool {
        self.save.is_some()
            || self.events.is_some()
            || self.record.is_some()
            || self.table.is_some()
            || !self.outputs.is_empty()
    }
}

/// Whether a run begins with a rest capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartTare {
    /// Where the device takes one at the start, and no taxel stands out from the others.
    Automatic,
    /// On any device, whatever presses.
    Asked,
    /// No.
    Never,
}

/// Commands while it runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Take a rest capture from the next frames.
    Tare {
        /// Who asks for it.
        by: By,
        /// True to take it even while something presses.
        force: bool,
    },
    /// Return to the calibration's own rest values.
    ClearTare,
    /// Return to the rest values after this entry of the tare history.
    UndoTare {
        /// Number of the entry.
        to: u64,
    },
    /// Note something at the newest frame.
    Mark {
        /// What, in the words of whoever notes it.
        text: String,
    },
    /// Record the run from now on.
    StartRecording {
        /// Name of the file in the folder of recordings.
        name: String,
    },
    /// End the recording that is written.
    StopRecording,
    /// Control a replay.
    Replay(ReplayCommand),
}

/// State of the pump that others see.
#[derive(Debug)]
pub(crate) struct Shared {
    /// Messages; a receiver that lags loses the oldest.
    pub(crate) messages: broadcast::Sender<Outgoing>,
    pub(crate) stop: AtomicBool,
    pub(crate) clients: AtomicUsize,
    /// Of a source that reads a link.
    pub(crate) link: OnceLock<LinkHandle>,
    status: Mutex<StatusNow>,
    events: Mutex<EventLog>,
    /// Empty without a page: nobody could ask for it.
    history: Mutex<History>,
    /// From a frame's arrival to the end of its sending, over all clients.
    sent: Mutex<Latencies>,
}

/// The pump's state for the status messages.
#[derive(Debug, Clone)]
pub(crate) struct StatusNow {
    pub(crate) last_arrival: Instant,
    pub(crate) ended: bool,
    pub(crate) tare: Tare,
    pub(crate) tare_time_ns: Option<u64>,
    pub(crate) notice: String,
    pub(crate) below_zero: Option<BelowZero>,
    /// What is written now.
    pub(crate) recording: Option<Recorder>,
    /// Of a replay that clients control.
    pub(crate) replay: Option<ReplayNow>,
    /// The last frame of a run that has ended, or of a replay that is paused.
    pub(crate) last_frame: Option<Bytes>,
    /// Text messages that every client gets once, and again when they change.
    pub(crate) posts: [Post; POSTS],
}

/// A text message, and how often it has changed; none before the first time.
#[derive(Debug, Clone)]
pub(crate) struct Post {
    pub(crate) text: Arc<str>,
    pub(crate) version: u64,
}

/// Rest values, history of tares, condition of channels, changes of baselines.
pub(crate) const POSTS: usize = 4;
const REST: usize = 0;
const TARES: usize = 1;
const CONDITION: usize = 2;
const BASELINE: usize = 3;

/// Messages that a slow subscriber may be behind before it loses the oldest.
const QUEUE: usize = 1024;
/// Notice when rest values are to be replaced while others are captured.
const RUNNING: &str = "a rest capture is running; wait for its end";
/// Why rest values are those of the recording that is played.
const RESTORED: &str = "as recorded";
/// Time from one record of losses and conditions to the next.
const HEALTH_EVERY: Duration = Duration::from_secs(1);
/// Longest sleep before commands and the stop flag are looked at again.
const NAP: Duration = Duration::from_millis(20);

impl Shared {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self {
            messages: broadcast::channel(QUEUE).0,
            stop: AtomicBool::new(false),
            clients: AtomicUsize::new(0),
            link: OnceLock::new(),
            status: Mutex::new(StatusNow {
                last_arrival: Instant::now(),
                ended: false,
                tare: Tare::None,
                tare_time_ns: None,
                notice: String::new(),
                below_zero: None,
                recording: None,
                replay: None,
                last_frame: None,
                posts: std::array::from_fn(|_| Post {
                    text: Arc::from(""),
                    version: 0,
                }),
            }),
            events: Mutex::new(EventLog::default()),
            history: Mutex::new(History::default()),
            sent: Mutex::new(Latencies::default()),
        })
    }

    pub(crate) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(crate) fn status(&self) -> MutexGuard<'_, StatusNow> {
        // A poisoned lock still holds a whole value.
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn events(&self) -> MutexGuard<'_, EventLog> {
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn history(&self) -> MutexGuard<'_, History> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn post(&self, place: usize, text: String) {
        let post = &mut self.status().posts[place];
        post.text = text.into();
        post.version += 1;
    }

    pub(crate) fn sent(&self) -> MutexGuard<'_, Latencies> {
        self.sent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Summary of a run of the pump.
#[derive(Debug)]
pub struct Summary {
    /// Times that the board began anew, as the frames or its wire tell.
    pub restarts: u64,
    /// Count of the frames.
    pub continuity: Continuity,
    /// Frames lost; none where the wire of a link cannot tell.
    pub lost: Option<u64>,
    /// Frames with a clipped channel.
    pub clipped_frames: u64,
    /// Frames with more contacts than a frame can have, some of them merged.
    pub merged_frames: u64,
    /// From the first to the last new frame by the host's clock, s.
    pub duration: f64,
    /// From a frame's arrival to the pump, s; of sources that read a link.
    pub waited: Latencies,
    /// From a frame's arrival to its message, s.
    pub latency: Latencies,
    /// From a frame's arrival to the end of its sending to each client, s.
    pub sent: Latencies,
    /// State of the rest capture at the end.
    pub tare: Tare,
    /// Last notice to the operator, such as a refused rest capture.
    pub notice: String,
    /// Taxels below zero at the end, and why.
    pub below_zero: Option<BelowZero>,
    /// Events of contacts.
    pub events: EventSummary,
    /// Condition of the channels at the end.
    pub conditions: ChannelConditions,
    /// Touch of the last frame; `None` without any.
    pub last: Option<LastTouch>,
    /// The recording of the run, if one was made.
    pub recording: Option<RecordingSummary>,
    /// What the outputs have written.
    pub outputs: Vec<LineSummary>,
    /// The link at the end, of a source that reads one.
    pub link: Option<LinkStatus>,
    /// Why the source failed, if it did.
    pub failure: Option<Failure>,
}

/// Why the pump ended early.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The source failed.
    #[error("{0}")]
    Source(#[from] SourceError),
    /// A frame does not belong to the device.
    #[error("{0}")]
    Frame(#[from] FrameError),
    /// The frames could not be saved.
    #[error("{0}")]
    Save(#[from] SaveError),
    /// The recording failed, and the run was to end with it.
    #[error("{message}")]
    Record {
        /// Why.
        message: String,
    },
}

/// Runs a source through an estimator until it ends, `options.frames` are
/// done or the stop flag is set.
pub(crate) struct Pump {
    source: Box<dyn Source>,
    session: TouchSession,
    components: usize,
    options: PumpOptions,
    shared: Arc<Shared>,
    commands: mpsc::Receiver<Command>,
    continuity: Continuity,
    clipped_frames: u64,
    merged_frames: u64,
    waited: Latencies,
    latency: Latencies,
    moved_rest: MovedRest,
    /// What was said last of the description of the board.
    remark: String,
    outputs: Vec<Lines>,
    recent: VecDeque<Instant>,
    first: Option<Instant>,
    last: Option<LastTouch>,
    clock: Clock,
    saver: Option<Saver>,
    table: Option<TableWriter>,
    /// Rows for the outputs that are tables.
    rows: Option<Rows>,
    recorder: Option<Recorder>,
    pace: Pace,
    /// Recordings that were stopped and are being finished.
    finishing: Vec<JoinHandle<RecordingSummary>>,
    playing: Option<Playing>,
    /// From one connection to the next.
    segment: u32,
    /// When losses and conditions were recorded last.
    recorded_health: Option<Instant>,
    events: Events,
    tares: TareHistory,
    owed: Owed,
    below_zero: Option<BelowZero>,
    conditions: ConditionSender,
    baselines: BaselineSender,
}

/// Opens the outputs; a run whose reader of the standard output goes ends.
fn outputs(
    options: &PumpOptions,
    session: &TouchSession,
    shared: &Arc<Shared>,
) -> Result<Vec<Lines>, SaveError> {
    let start = |output: &LineOutput| {
        let ending = Arc::clone(shared);
        Lines::start(
            output,
            options.replace_files,
            session.meaning(),
            shared.link.get().cloned(),
            shared.messages.subscribe(),
            Arc::new(move || ending.stop.store(true, Ordering::Relaxed)),
        )
    };
    options.outputs.iter().map(start).collect()
}

/// Device time against host time.
struct Clock {
    speed: f64,
    origin: Option<(u64, Instant)>,
}

impl Clock {
    /// When the frame of device time `time_ns` is due; at once after a jump
    /// back, which begins a new origin.
    fn due(&mut self, time_ns: u64) -> Instant {
        let now = Instant::now();
        let (start_ns, start) = *self.origin.get_or_insert((time_ns, now));
        if self.speed.is_infinite() {
            return now;
        }
        if time_ns < start_ns {
            self.origin = Some((time_ns, now));
            return now;
        }
        let wait = Duration::from_nanos(time_ns - start_ns).as_secs_f64() / self.speed;
        Duration::try_from_secs_f64(wait)
            .ok()
            .and_then(|wait| start.checked_add(wait))
            .unwrap_or(now)
    }
}

/// The recorder that the options ask for.
fn recorder(
    options: &PumpOptions,
    stream: &Stream,
    pace: Pace,
) -> Result<Option<Recorder>, SaveError> {
    Ok(match &options.record {
        None => None,
        Some(RecordTo::Messages(receiver)) => Some(Recorder::piped(receiver.clone())),
        Some(RecordTo::File(file)) => {
            let replace = options.replace_files;
            Some(Recorder::create(file, stream, replace, pace)?)
        }
    })
}

impl Pump {
    pub(crate) fn new(
        source: Box<dyn Source>,
        session: TouchSession,
        options: PumpOptions,
        shared: Arc<Shared>,
        commands: mpsc::Receiver<Command>,
    ) -> Result<Self, SaveError> {
        let pace = if options.speed.is_infinite() && !source.is_live() {
            Pace::Waits
        } else {
            Pace::Device
        };
        let recorder = recorder(&options, source.stream(), pace)?;
        let saver = match &options.save {
            Some(path) => Some(Saver::create(
                path,
                source.stream(),
                &options.provenance,
                options.replace_files,
                pace,
            )?),
            None => None,
        };
        let writer = options
            .events
            .as_ref()
            .map(|file| EventWriter::create(file, options.replace_files))
            .transpose();
        let writer = writer.inspect_err(|_| {
            // Nothing was written yet: no file is left for a run that never began.
            if let Some(path) = options.save.as_ref().filter(|_| !options.replace_files) {
                let _ = std::fs::remove_file(path);
            }
        })?;
        let table = options
            .table
            .as_ref()
            .map(|table| TableWriter::create(table, options.replace_files, session.meaning()));
        let table = table.transpose()?;
        if let Some(link) = source.link() {
            // There is one source to a run.
            let _ = shared.link.set(link);
        }
        let outputs = outputs(&options, &session, &shared)?;
        let are_rows = outputs.iter().any(Lines::are_rows);
        let rows = are_rows.then(|| Rows::new(session.meaning()));
        let clock = Clock {
            speed: if source.is_live() {
                f64::INFINITY
            } else {
                options.speed
            },
            origin: None,
        };
        Ok(Self {
            events: Events::new(
                [
                    session.meaning().force_unit(),
                    session.meaning().speed_unit(),
                ],
                writer,
            ),
            tares: TareHistory::new(&session, options.rest_from.as_deref()),
            owed: Owed::default(),
            below_zero: None,
            conditions: ConditionSender::default(),
            baselines: BaselineSender::default(),
            source,
            components: session.meaning().components,
            session,
            options,
            shared,
            commands,
            continuity: Continuity::default(),
            clipped_frames: 0,
            merged_frames: 0,
            waited: Latencies::default(),
            latency: Latencies::default(),
            moved_rest: MovedRest::default(),
            remark: String::new(),
            outputs,
            recent: VecDeque::new(),
            first: None,
            last: None,
            clock,
            rows,
            saver,
            table,
            recorder,
            pace,
            finishing: Vec::new(),
            playing: None,
            segment: 0,
            recorded_health: None,
        })
    }

    pub(crate) fn stream(&self) -> &Stream {
        self.source.stream()
    }

    pub(crate) fn session(&self) -> &TouchSession {
        &self.session
    }

    /// Lets clients control the replay.
    pub(crate) fn control(&mut self, replay: Replay) {
        self.playing = Some(Playing::new(replay, self.options.speed));
        self.tell_replay();
    }

    pub(crate) fn run(mut self) -> Summary {
        self.tell_rest();
        self.source.record_to(self.recorder.as_ref());
        self.shared.status().recording.clone_from(&self.recorder);
        self.record_rest(RestKind::Begun, By::Start, None, String::new());
        self.tare_at_start();
        let mut failure = self.frames().err();
        self.keep_last_frame();
        if self.recorder.is_some() {
            self.record_health();
        }
        let link = self.shared.link.get().map(LinkHandle::now);
        let lost = self.lost();
        let restarts = self.restarts();
        self.source.stop();
        let mut recording = self.recorder.take().map(|recorder| recorder.finish());
        self.shared.status().recording = None;
        for finishing in self.finishing.drain(..) {
            // A thread that panicked has said so itself.
            recording = recording.or(finishing.join().ok());
        }
        if let Some(saver) = self.saver.take()
            && let Err(error) = saver.finish()
        {
            failure.get_or_insert(error.into());
        }
        if let Some(table) = self.table.take()
            && let Err(error) = table.finish()
        {
            failure.get_or_insert(error.into());
        }
        let (events, written) = self.events.finish();
        if let Err(error) = written {
            failure.get_or_insert(error.into());
        }
        // An error means that nobody listens any more.
        let _ = self.shared.messages.send(Outgoing::end());
        let mut outputs = Vec::new();
        for output in self.outputs {
            let (summary, written) = output.finish();
            outputs.push(summary);
            if let Err(error) = written {
                failure.get_or_insert(error.into());
            }
        }
        if let Some(failure) = &failure {
            self.shared.status().notice = failure.to_string();
        }
        self.shared.status().replay = None;
        self.shared.status().ended = true;
        let duration = match (self.first, self.recent.back()) {
            (Some(first), Some(last)) => last.duration_since(first).as_secs_f64(),
            _ => 0.0,
        };
        let status = self.shared.status().clone();
        Summary {
            restarts,
            continuity: self.continuity,
            lost,
            clipped_frames: self.clipped_frames,
            merged_frames: self.merged_frames,
            duration,
            waited: self.waited,
            latency: self.latency,
            sent: self.shared.sent().clone(),
            tare: status.tare,
            notice: status.notice,
            below_zero: self.below_zero,
            events,
            conditions: ChannelConditions::of(&self.session),
            last: self.last,
            recording: recording.filter(|recording| !recording.path.as_os_str().is_empty()),
            outputs,
            link,
            failure,
        }
    }

    fn tare_at_start(&mut self) {
        let kind = match self.options.start_tare {
            StartTare::Automatic if self.session.estimator().rules().rest.at_start => {
                RestKind::StartedUnasked
            }
            StartTare::Asked => RestKind::Started,
            StartTare::Automatic | StartTare::Never => return,
        };
        self.begin_capture(kind, self.options.tare_frames, By::Start, None);
        self.tares.begin(By::Start, false);
        self.tell_rest();
    }

    /// Takes the rest capture that is owed since the start, once nothing stands out any more.
    fn tare_owed(&mut self, time_ns: u64) {
        if self.owed.is_due(time_ns)
            && !self.session.capturing()
            && self.session.estimator().standing_out().is_none()
        {
            self.tares.begin(By::Start, false);
            self.begin_capture(
                RestKind::StartedUnasked,
                self.options.tare_frames,
                By::Start,
                Some(time_ns),
            );
            self.tell_rest();
        }
    }

    fn frames(&mut self) -> Result<(), Failure> {
        while !self.done() {
            if self.playing.as_ref().is_some_and(Playing::begins_again) && !self.play_again() {
                continue;
            }
            let next = self.source.next()?;
            match next {
                Next::End if self.goes_on_after_the_end() => {}
                Next::End => break,
                Next::Reconnected => self.reconnected(),
                Next::Nothing(time_ns) => self.wait(time_ns),
                Next::Rest(change) => self.recorded_rest(&change),
                Next::Frame(frame) => {
                    self.wait(frame.time_ns);
                    if self.shared.stopped() {
                        break;
                    }
                    if self.playing.as_ref().is_some_and(Playing::begins_again) {
                        continue;
                    }
                    self.take(frame)?;
                }
            }
        }
        Ok(())
    }

    fn done(&self) -> bool {
        self.shared.stopped()
            || self
                .options
                .frames
                .is_some_and(|frames| self.continuity.accepted >= frames)
    }

    /// Sleeps until the frame is due, with an eye on commands and the end.
    fn wait(&mut self, time_ns: u64) {
        loop {
            while let Ok(command) = self.commands.try_recv() {
                self.command(command);
            }
            if let Some(playing) = &mut self.playing {
                if playing.is_due(time_ns) {
                    self.clock.origin = None;
                    return;
                }
                if playing.now.paused && !self.shared.stopped() {
                    self.clock.origin = None;
                    std::thread::sleep(NAP);
                    continue;
                }
            }
            let due = self.clock.due(time_ns);
            let left = due.saturating_duration_since(Instant::now());
            if left.is_zero() || self.shared.stopped() {
                return;
            }
            std::thread::sleep(left.min(NAP));
        }
    }

    fn command(&mut self, command: Command) {
        let now = self.last.as_ref().map(|last| last.time_ns);
        let running = self.session.capturing();
        // A mark changes nothing that a notice may be about, nor does the control of a replay.
        if !matches!(command, Command::Mark { .. } | Command::Replay(_)) {
            self.shared.status().notice.clear();
        }
        match command {
            Command::Tare { by, force } => {
                self.owed.settle();
                let pressed = self.session.pressed();
                self.tares.begin(by, pressed.is_some());
                match pressed.filter(|_| !force) {
                    Some(refused) => return self.captured(Err(refused), now),
                    None => {
                        self.begin_capture(RestKind::Started, self.options.tare_frames, by, now);
                    }
                }
            }
            Command::Mark { text } => return self.note(text, now),
            Command::StartRecording { name } => {
                if let Err(message) = self.start_recording(&name, now) {
                    self.shared.status().notice = message;
                }
                return;
            }
            Command::StopRecording => return self.stop_recording(),
            Command::Replay(command) => {
                if let Some(playing) = &mut self.playing {
                    playing.obey(command);
                    self.clock.speed = playing.now.speed.unwrap_or(f64::INFINITY);
                    self.clock.origin = None;
                    self.tell_replay();
                }
                return;
            }
            Command::ClearTare | Command::UndoTare { .. } if running => {
                self.shared.status().notice = RUNNING.into();
            }
            Command::ClearTare => {
                self.owed.settle();
                self.session.clear_rest();
                self.tares.cleared(now, &self.session);
                self.record_rest(RestKind::Cleared, By::Page, now, String::new());
                self.forget_below_zero();
                self.mark("tare cleared", now);
            }
            Command::UndoTare { to } => {
                if self.tares.undo(to, now, &mut self.session) {
                    self.owed.settle();
                    self.record_rest(RestKind::Undone, By::Page, now, String::new());
                    self.forget_below_zero();
                    self.mark("tare undone", now);
                } else {
                    self.shared.status().notice =
                        format!("the rest values after tare {to} are not kept");
                }
            }
        }
        self.tell_rest();
    }

    /// Notes what a person or a program says, at the newest frame.
    fn note(&mut self, text: String, time_ns: Option<u64>) {
        if let Some(recorder) = &self.recorder {
            recorder.mark(MarkMessage {
                device_time_ns: time_ns,
                text: text.clone(),
                ..MarkMessage::default()
            });
        }
        let shared = Arc::clone(&self.shared);
        let noted = self.events.mark(text, time_ns.unwrap_or(0), &|event| {
            shared.events().push(event);
        });
        if let Err(error) = noted {
            // The next event meets the same failure and ends the run.
            self.shared.status().notice = error.to_string();
        }
    }

    /// Records the run from here on, as a run that is recorded from its beginning.
    fn start_recording(&mut self, name: &str, time_ns: Option<u64>) -> Result<(), String> {
        let Some(folder) = self.options.record_folder.as_ref() else {
            return Err("this run takes no recordings from its clients".into());
        };
        if let Some(recorder) = &self.recorder {
            let path = shown::path(recorder.path());
            return Err(format!("{path} is being written: stop it first"));
        }
        if self.session.capturing() {
            // Half a capture could not be repeated from the recording.
            return Err(RUNNING.into());
        }
        let file = folder.named(name)?;
        let recorder = Recorder::create(&file, self.source.stream(), false, self.pace)
            .map_err(|error| error.to_string())?;
        self.source.record_to(Some(&recorder));
        self.shared.status().recording = Some(recorder.clone());
        if let Some(link) = self.shared.link.get().map(LinkHandle::now) {
            recorder.link(LinkMessage {
                host_ns: link.since_ns,
                segment: self.segment,
                state: link.state.name().into(),
                reason: link.reason,
                ..LinkMessage::default()
            });
        }
        self.recorder = Some(recorder);
        self.recorded_health = None;
        self.record_rest(RestKind::Begun, By::Start, time_ns, String::new());
        Ok(())
    }

    /// Ends the recording; its thread finishes the file while the run goes on.
    fn stop_recording(&mut self) {
        if self.recorder.is_some() {
            self.record_health();
        }
        self.source.record_to(None);
        self.shared.status().recording = None;
        if let Some(recorder) = self.recorder.take() {
            self.finishing
                .push(std::thread::spawn(move || recorder.finish()));
        }
    }

    /// Puts where the replay is, and its frame while nothing comes, where the clients' tasks find them.
    fn tell_replay(&mut self) {
        if self
            .playing
            .as_ref()
            .is_some_and(|playing| playing.now.paused)
        {
            self.keep_last_frame();
        } else {
            self.shared.status().last_frame = None;
        }
        if let Some(playing) = &self.playing {
            let mut status = self.shared.status();
            status.ended = playing.now.ended;
            status.replay = Some(playing.now.clone());
        }
    }

    /// Opens the recording anew, with an estimator that has seen nothing; false if that fails.
    fn play_again(&mut self) -> bool {
        let Some(playing) = &mut self.playing else {
            return false;
        };
        let opened = (playing.replay.reopen)();
        playing.begun();
        match opened {
            Ok((source, session)) => (self.source, self.session) = (source, session),
            Err(message) => {
                self.shared.status().notice = message;
                self.shared.stop.store(true, Ordering::Relaxed);
                return false;
            }
        }
        self.continuity = Continuity::default();
        self.moved_rest = MovedRest::default();
        self.tares = TareHistory::new(&self.session, self.options.rest_from.as_deref());
        self.owed = Owed::default();
        self.conditions = ConditionSender::default();
        self.baselines = BaselineSender::default();
        self.last = None;
        self.clock.origin = None;
        *self.shared.history() = History::new(self.session.meaning());
        self.shared.events().restart();
        self.forget_below_zero();
        self.tell_rest();
        self.tare_at_start();
        self.tell_replay();
        true
    }

    /// At the end of a replay that clients control: waits for one of them to go on.
    fn goes_on_after_the_end(&mut self) -> bool {
        let Some(playing) = &mut self.playing else {
            return false;
        };
        playing.end();
        self.tell_replay();
        self.keep_last_frame();
        while !self.shared.stopped() {
            while let Ok(command) = self.commands.try_recv() {
                self.command(command);
            }
            if self.playing.as_ref().is_some_and(Playing::begins_again) {
                return true;
            }
            std::thread::sleep(NAP);
        }
        false
    }

    /// The link is open again: numbers and times begin anew, the rest values stay.
    fn reconnected(&mut self) {
        self.segment += 1;
        if let Some(recorder) = &self.recorder {
            // In its place between the frames.
            recorder.link(LinkMessage {
                segment: self.segment,
                state: RECONNECTED.into(),
                ..LinkMessage::default()
            });
        }
        self.continuity.begin_segment();
        self.tares.reconnected();
        self.moved_rest.reconnected();
        self.tell_rest();
    }

    fn take(&mut self, frame: Frame) -> Result<(), Failure> {
        self.record_frame(&frame)?;
        let arrived = self.source.arrival(&frame);
        if let Some(arrived) = arrived {
            self.waited.push(arrived.elapsed().as_secs_f64());
        }
        let arrival = arrived.unwrap_or_else(Instant::now);
        if !self.continuity.accept(&frame) {
            self.shared.status().last_arrival = arrival;
            return self.save(frame);
        }
        if self.session.repeats(&frame) {
            // Nothing new has arrived: the source counts as silent.
            self.continuity.repeat();
            self.tell_condition(frame.time_ns);
            return self.save(frame);
        }
        self.shared.status().last_arrival = arrival;
        if let Some(advice) = self.moved_rest.push(&frame.values) {
            self.shared.status().notice = advice;
        }
        self.pass_on_remark();
        let rate = self.rate(arrival);
        let tared = self.session.estimator().is_tared();
        let capturing = self.session.capturing();
        let captured = self.session.push(&frame)?.captured;
        let touch = self.session.estimator().touch();
        self.clipped_frames += u64::from(touch.clipped > 0);
        self.merged_frames += u64::from(touch.merged > 0);
        let health = Health {
            continuity: &self.continuity,
            rate,
            latency: arrival.elapsed().as_secs_f64(),
            tared,
            capturing,
            host_ns: frame.host_ns,
            flags: frame.flags,
            lost: self.lost(),
        };
        let (shared, rows) = (&self.shared, &mut self.rows);
        let passed_over = self.playing.as_ref().is_some_and(Playing::passes_over);
        if shared.messages.receiver_count() > 0 && !passed_over {
            // An error means that the last receiver has just gone.
            let _ = shared.messages.send(Outgoing {
                arrival,
                bytes: message::frame(touch, self.components, &health),
                row: rows.as_mut().map(|rows| rows.row(&self.session).into()),
            });
        }
        if shared.history().push(touch, unix_s()) {
            shared.events().restart();
        }
        let recorder = self.recorder.as_ref();
        if let Some(recorder) = recorder {
            recorder.touch(touch_message(touch, self.components));
        }
        let events = self.session.observer().events();
        self.events.push(events, &|event| {
            shared.events().push(event);
            if let Some(recorder) = recorder {
                recorder.event(event_message(event));
            }
        })?;
        if let Some(table) = &mut self.table {
            table.push(&self.session)?;
        }
        let (touch, meaning) = (self.session.estimator().touch(), self.session.meaning());
        self.last = Some(LastTouch::new(touch, meaning, self.last.take()));
        self.latency.push(arrival.elapsed().as_secs_f64());
        if let Some(playing) = &mut self.playing {
            playing.now.at_ns = Some(frame.time_ns);
            self.tell_replay();
        }
        self.find_below_zero();
        if let Some(captured) = captured {
            self.captured(captured, Some(frame.time_ns));
        }
        self.tare_owed(frame.time_ns);
        self.tell_condition(frame.time_ns);
        self.save(frame)
    }

    /// Shows the operator what should be changed in the description of the board.
    fn pass_on_remark(&mut self) {
        let link = self.shared.link.get();
        if let Some(remark) = link.and_then(|link| link.remark_beside(&self.remark)) {
            if !remark.is_empty() {
                self.shared.status().notice.clone_from(&remark);
            }
            self.remark = remark;
        }
    }

    /// Frames lost so far: by the wire of a link, which alone knows what it lost; else by the numbers
    /// of the frames. None where neither can tell.
    fn lost(&self) -> Option<u64> {
        let link = self.shared.link.get();
        link.map_or(Some(self.continuity.lost), LinkHandle::lost)
    }

    /// Keeps the last frame for whoever comes after the end, or while a replay is paused.
    fn keep_last_frame(&mut self) {
        if self.last.is_none() {
            return;
        }
        let health = Health {
            continuity: &self.continuity,
            rate: 0.0,
            latency: f64::NAN,
            tared: self.session.estimator().is_tared(),
            capturing: self.session.capturing(),
            host_ns: None,
            flags: FrameFlags::default(),
            lost: self.lost(),
        };
        let touch = self.session.estimator().touch();
        let bytes = message::frame(touch, self.components, &health);
        self.shared.status().last_frame = Some(bytes);
    }

    /// Times that the board began anew, as the frames or its wire tell.
    fn restarts(&self) -> u64 {
        let link = self.shared.link.get();
        self.continuity.restarts + link.map_or(0, LinkHandle::restarts)
    }

    fn find_below_zero(&mut self) {
        let touch = self.session.estimator().touch();
        let below = |taxel: &&TaxelTouch| taxel.state == State::BelowZero;
        let taxels = touch.taxels.iter().filter(below).count();
        if self.below_zero.as_ref().map_or(0, |below| below.taxels) != taxels {
            self.below_zero = (taxels > 0).then(|| self.tares.below_zero(taxels));
            self.shared.status().below_zero.clone_from(&self.below_zero);
        }
    }

    /// What was below the zero before says nothing of a new one: the next frame finds it, and its cause, anew.
    fn forget_below_zero(&mut self) {
        self.below_zero = None;
        self.shared.status().below_zero = None;
    }

    fn save(&mut self, frame: Frame) -> Result<(), Failure> {
        match &self.saver {
            Some(saver) => Ok(saver.push(frame)?),
            None => Ok(()),
        }
    }

    fn captured(&mut self, captured: Result<(), RestRefused>, time_ns: Option<u64>) {
        let by = self.tares.by();
        let Err(refused) = captured else {
            self.mark("tare", time_ns);
            self.tares.captured(time_ns, None, &self.session);
            self.record_rest(RestKind::Captured, by, time_ns, String::new());
            self.forget_below_zero();
            if let Some(why) = self.owed.why() {
                let mut status = self.shared.status();
                if status.notice == why {
                    status.notice.clear();
                }
            }
            self.owed.settle();
            return self.tell_rest();
        };
        let message = refused.to_string();
        // Of attempts that nobody asked for the first refusal says it all.
        if by != By::Start || !self.tares.is_refused_at_start() {
            self.mark("tare refused", time_ns);
            self.tares.captured(time_ns, Some(&message), &self.session);
            self.shared.status().notice.clone_from(&message);
        }
        self.record_rest(RestKind::Refused, by, time_ns, message);
        let unasked = by == By::Start && self.options.start_tare == StartTare::Automatic;
        if unasked && self.source.is_live() {
            self.owed.refused(&refused, time_ns.unwrap_or(0));
            if let Some(why) = self.owed.why() {
                why.clone_into(&mut self.shared.status().notice);
            }
        }
        self.tell_rest();
    }

    /// Begins a rest capture.
    fn begin_capture(&mut self, kind: RestKind, frames: usize, by: By, time_ns: Option<u64>) {
        if let Some(recorder) = &self.recorder {
            let mut message = rest_message(kind, by.name(), time_ns, &self.session);
            message.frames = u32::try_from(frames).unwrap_or(u32::MAX);
            recorder.rest(message);
        }
        match kind {
            RestKind::StartedUnasked => self.session.begin_unasked_rest_capture(frames),
            _ => self.session.begin_rest_capture(frames),
        }
    }

    /// Repeats a change of the rest values that a recording has, so that each frame is
    /// estimated as it was.
    fn recorded_rest(&mut self, change: &RestMessage) {
        if self.options.start_tare == StartTare::Asked || self.options.rest_from.is_some() {
            // The rest values of this run are others.
            return;
        }
        let now = self.last.as_ref().map(|last| last.time_ns);
        let by = By::of_name(&change.by);
        match change.kind {
            RestKind::Started | RestKind::StartedUnasked => {
                self.tares.begin(by, false);
                self.begin_capture(change.kind, change.frames as usize, by, now);
            }
            // The frames before have done the same; what they gave counts unless the recording
            // has other values.
            RestKind::Captured | RestKind::Refused | RestKind::Begun => {
                if self.restored(change) {
                    self.record_rest(RestKind::Undone, by, now, RESTORED.into());
                }
            }
            RestKind::Cleared => {
                self.session.clear_rest();
                self.restored(change);
                self.tares.cleared(now, &self.session);
                self.record_rest(RestKind::Cleared, by, now, String::new());
                self.mark("tare cleared", now);
            }
            RestKind::Undone => {
                if let Some(rest) = rest_of(change) {
                    self.session.restore_rest(&rest);
                }
                self.record_rest(RestKind::Undone, by, now, change.message.clone());
                self.mark("tare undone", now);
            }
        }
        self.forget_below_zero();
        self.tell_rest();
    }

    /// Puts the rest values of a recording in force where others are; true if so.
    fn restored(&mut self, change: &RestMessage) -> bool {
        let own = rest_message(change.kind, "", None, &self.session);
        let bits = |message: &RestMessage| -> Vec<u64> {
            let captured = message.captured.iter().flatten().flatten();
            let values = message.values.iter().chain(captured);
            values.map(|value| value.to_bits()).collect()
        };
        let known = |message: &RestMessage| -> Vec<bool> {
            message.captured.iter().map(Option::is_some).collect()
        };
        let same = bits(&own) == bits(change)
            && known(&own) == known(change)
            && own.at_end == change.at_end;
        match rest_of(change).filter(|_| !same) {
            Some(rest) if rest.values().len() == own.values.len() => {
                self.session.restore_rest(&rest);
                true
            }
            _ => false,
        }
    }

    fn record_rest(&self, kind: RestKind, by: By, time_ns: Option<u64>, message: String) {
        if let Some(recorder) = &self.recorder {
            let mut change = rest_message(kind, by.name(), time_ns, &self.session);
            change.message = message;
            recorder.rest(change);
        }
    }

    /// Records a frame as it came, and notices a recording that has failed.
    fn record_frame(&mut self, frame: &Frame) -> Result<(), Failure> {
        let Some(recorder) = &self.recorder else {
            return Ok(());
        };
        if let Some(failure) = recorder.failure() {
            let message = failure.to_owned();
            if recorder.stops_run() {
                return Err(Failure::Record { message });
            }
            let mut status = self.shared.status();
            if status.notice.is_empty() {
                status.notice = message;
            }
            return Ok(());
        }
        recorder.raw(FrameMessage {
            utc_ns: 0,
            frame: frame.clone(),
        });
        let due = |since: Instant| since.elapsed() >= HEALTH_EVERY;
        if self.recorded_health.is_none_or(due) {
            self.record_health();
        }
        Ok(())
    }

    fn record_health(&mut self) {
        self.recorded_health = Some(Instant::now());
        let conditions = ChannelConditions::of(&self.session);
        let counts = &self.continuity;
        let span = self.recent.front().zip(self.recent.back());
        let span = span.map_or(0.0, |(a, b)| b.duration_since(*a).as_secs_f64());
        let wrong = conditions.wrong.into_iter();
        let (wrong, reasons) = wrong.map(|wrong| (wrong.name, wrong.reason)).unzip();
        let message = HealthMessage {
            utc_ns: 0,
            device_time_ns: self.last.as_ref().map_or(0, |last| last.time_ns),
            accepted: counts.accepted,
            lost: self.lost().unwrap_or(counts.lost),
            late: counts.late,
            duplicate: counts.duplicate,
            repeated: counts.repeated,
            restarts: self.restarts(),
            clipped: self.clipped_frames,
            rate: self.recent.len().saturating_sub(1) as f64 / span,
            wrong,
            reasons,
        };
        if let Some(recorder) = &self.recorder {
            recorder.health(message);
        }
    }

    /// Notes a change of the rest values in the history; none lies before the first frame.
    fn mark(&self, kind: &'static str, time_ns: Option<u64>) {
        if let Some(time_ns) = time_ns {
            let unix_s = unix_s();
            self.shared.history().mark(Mark {
                time_ns,
                unix_s,
                kind,
            });
        }
    }

    /// Puts the rest values and how they came where the clients' tasks find them.
    fn tell_rest(&self) {
        let captured_ns = self.tares.captured_ns();
        let mut status = self.shared.status();
        status.tare_time_ns = captured_ns;
        status.tare = match captured_ns {
            _ if self.session.capturing() => Tare::Running,
            Some(_) => Tare::Done,
            None if self.session.estimator().is_tared() => Tare::Loaded,
            None if self.owed.why().is_some() => Tare::Waiting,
            None => Tare::None,
        };
        drop(status);
        let rest = &self.session.estimator().touch().channels.rest;
        self.shared.post(REST, message::rest(rest));
        self.shared.post(TARES, self.tares.message());
    }

    fn tell_condition(&mut self, time_ns: u64) {
        let repeated = self.continuity.repeated;
        let message = self.conditions.message(time_ns, repeated, &self.session);
        if let Some(message) = message {
            self.shared.post(CONDITION, message);
        }
        let message = self.baselines.message(time_ns, &self.session);
        if let Some(message) = message {
            self.shared.post(BASELINE, message);
        }
    }

    /// Frames per second over the last second.
    fn rate(&mut self, now: Instant) -> f64 {
        self.first.get_or_insert(now);
        self.recent.push_back(now);
        while self.recent.len() > 2 && now.duration_since(self.recent[0]) > Duration::from_secs(1) {
            self.recent.pop_front();
        }
        let span = now.duration_since(self.recent[0]).as_secs_f64();
        if span > 0.0 {
            (self.recent.len() - 1) as f64 / span
        } else {
            0.0
        }
    }
}
