//! The pump: takes frames from a source in real time, estimates, and offers
//! the messages to whoever listens. No listener can slow it.

mod recording;
mod replaying;
mod rest;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taxel::acquisition::{Frame, Stream};
use taxel::estimation::{Continuity, FrameError, TouchSession};
use taxel::work::Parts;
use taxel_recording::mcap::{LinkMessage, RECONNECTED, RestKind};

use crate::condition::{ChannelConditions, ConditionSender};
use crate::events::{EventFile, EventSummary, EventWriter, Events};
use crate::history::Mark;
use crate::last_touch::LastTouch;
use crate::last_zero::LastZero;
use crate::latency::Latencies;
use crate::link::{LinkHandle, LinkStatus};
use crate::message::{self, Health, Tare};
use crate::moved_rest::MovedRest;
use crate::out::{LineOutput, LineSummary, Outlet, Rows, TableWriter, TouchTable};
use crate::outgoing::Outgoing;
use crate::record::{
    RecordFolder, RecordTo, Recorder, RecordingSummary, WhenRecordingFails, event_message,
    touch_message,
};
use crate::replay::{Playing, ReplayCommand};
use crate::save::{Pace, SaveError, Saver};
use crate::shared::{BASELINE, CONDITION, Shared};
use crate::source::{Next, Source, SourceError};
use crate::tare::{BaselineSender, BelowZero, By, Owed, TareHistory, unix_s};

/// Options of the pump.
#[derive(Debug, Clone)]
pub struct PumpOptions {
    /// Device seconds per second; infinite means as fast as possible; default 1.
    pub speed: f64,
    /// End after so many new frames; default never.
    pub frames: Option<u64>,
    /// Frames that the source has, where that is known: how far the run is.
    pub expected: Option<u64>,
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
    /// What becomes of the run when `save`, `events` or `outputs` fail: by default it goes on.
    pub when_failing: WhenRecordingFails,
    /// Hears of such a failure at once.
    pub told: fn(&str),
    /// Lines of provenance for the saved file.
    pub provenance: Vec<String>,
}

impl Default for PumpOptions {
    fn default() -> Self {
        Self {
            speed: 1.0,
            frames: None,
            expected: None,
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
            when_failing: WhenRecordingFails::GoOn,
            told: |_| (),
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
    /// Note something.
    Mark(NewMark),
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

/// Something to note.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewMark {
    /// What, in the words of whoever notes it.
    pub text: String,
    /// Who notes it, such as `page`.
    pub by: String,
    /// When it happened; `None` for the newest frame.
    pub at: Option<Instant>,
}

/// Notice when rest values are to be replaced while others are captured.
const RUNNING: &str = "a rest capture is running; wait for its end";
/// Longest sleep before commands and the stop flag are looked at again.
const NAP: Duration = Duration::from_millis(20);

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
    /// Files that failed before the end of the run, and why.
    pub failed_files: Vec<String>,
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
    outputs: Vec<Outlet>,
    failed_files: Vec<String>,
    /// Why the run is to end.
    ending: Option<Failure>,
    recent: VecDeque<Instant>,
    first: Option<Instant>,
    last: Option<LastTouch>,
    /// When the last frame was read on the device.
    newest_taken: Instant,
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
    /// True if the source says itself how its rest values changed.
    rest_recorded: bool,
    below_zero: Option<BelowZero>,
    last_zero: Option<LastZero>,
    conditions: ConditionSender,
    baselines: BaselineSender,
}

/// Opens the outputs; a run whose reader of the standard output goes ends.
fn outputs(
    options: &PumpOptions,
    (session, stream): (&TouchSession, &Stream),
    shared: &Arc<Shared>,
) -> Result<Vec<Outlet>, SaveError> {
    let start = |output: &LineOutput| {
        let ending = Arc::clone(shared);
        let (told, when_failing) = (options.told, options.when_failing);
        if let Some(caution) = output.caution() {
            told(caution);
        }
        Outlet::start(
            output,
            options.replace_files,
            (session.meaning(), stream),
            shared,
            Arc::new(move |failure| {
                match failure {
                    Some(failure) if when_failing == WhenRecordingFails::GoOn => {
                        told(&going_on(failure));
                    }
                    // Its reader has gone, or it was to end the run.
                    _ => ending.stop.store(true, Ordering::Relaxed),
                }
            }),
        )
    };
    options.outputs.iter().map(start).collect()
}

/// What is said of a file that fails while the run goes on.
fn going_on(error: &SaveError) -> String {
    format!("{error}; what came before is in it, the measurement goes on")
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
        let outputs = outputs(&options, (&session, source.stream()), &shared)?;
        let are_rows = options.outputs.iter().any(LineOutput::are_rows);
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
            rest_recorded: false,
            below_zero: None,
            last_zero: None,
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
            newest_taken: Instant::now(),
            clock,
            failed_files: Vec::new(),
            ending: None,
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
            self.file_failed(error);
        }
        if let Some(table) = self.table.take()
            && let Err(error) = table.finish()
        {
            failure.get_or_insert(error.into());
        }
        let (events, written) = std::mem::take(&mut self.events).finish();
        if let Err(error) = written {
            self.file_failed(error);
        }
        // An error means that nobody listens any more.
        let _ = self.shared.messages.send(Outgoing::end());
        let mut outputs = Vec::new();
        for output in std::mem::take(&mut self.outputs) {
            let (summary, written) = output.finish();
            outputs.push(summary);
            match written {
                // It was told when it failed.
                Err(error) if self.options.when_failing == WhenRecordingFails::GoOn => {
                    self.failed_files.push(going_on(&error));
                }
                Err(error) => self.file_failed(error),
                Ok(()) => {}
            }
        }
        failure = failure.or(self.ending.take());
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
            failed_files: self.failed_files,
            link,
            failure,
        }
    }

    fn frames(&mut self) -> Result<(), Failure> {
        let of = self.options.frames.or(self.options.expected);
        let parts = of.map(|frames| Parts::new("playing the frames", frames));
        while !self.done() {
            if let Some(failure) = self.ending.take() {
                return Err(failure);
            }
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
                    if let Some(parts) = &parts {
                        parts.done(1);
                    }
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
        if !matches!(command, Command::Mark(_) | Command::Replay(_)) {
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
            Command::Mark(mark) => return self.note(mark),
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
        let taken = self.source.taken(&frame).unwrap_or(arrival);
        if !self.continuity.accept(&frame) {
            self.shared.status().last_arrival = arrival;
            self.save(frame);
            return Ok(());
        }
        if self.session.repeats(&frame) {
            // Nothing new has arrived: the source counts as silent.
            self.continuity.repeat();
            self.tell_condition(frame.time_ns);
            self.save(frame);
            return Ok(());
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
        if let Some(last_zero) = self.last_zero.as_mut().filter(|_| capturing) {
            last_zero.push(&frame);
        }
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
                taken,
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
        let written = self.events.push(events, &|event| {
            shared.events().push(event);
            if let Some(recorder) = recorder {
                recorder.event(event_message(event));
            }
        });
        if let Err(error) = written {
            self.file_failed(error);
        }
        if let Some(table) = &mut self.table {
            table.push(&self.session)?;
        }
        let (touch, meaning) = (self.session.estimator().touch(), self.session.meaning());
        self.last = Some(LastTouch::new(touch, meaning, self.last.take()));
        self.newest_taken = taken;
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
        self.save(frame);
        Ok(())
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

    /// Times that the board began anew, as the frames or its wire tell.
    fn restarts(&self) -> u64 {
        let link = self.shared.link.get();
        self.continuity.restarts + link.map_or(0, LinkHandle::restarts)
    }

    fn save(&mut self, frame: Frame) {
        let Some(saver) = self.saver.take() else {
            return;
        };
        match saver.push(frame) {
            Ok(saver) => self.saver = Some(saver),
            Err(error) => self.file_failed(error),
        }
    }

    /// A file of the run has failed: the measurement goes on without it, unless it was to end.
    fn file_failed(&mut self, error: SaveError) {
        if self.options.when_failing == WhenRecordingFails::Stop {
            self.ending = Some(error.into());
            return;
        }
        let message = going_on(&error);
        (self.options.told)(&message);
        self.shared.status().notice.clone_from(&message);
        self.failed_files.push(message);
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
