//! Records a run: all that came and all that followed from it, in a file that survives the
//! end of the process.

mod disk;
mod link;
mod run;
#[cfg(test)]
mod tests;
mod thread;
mod touch;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;
use taxel::shown;

use taxel_recording::mcap::{
    Attachment, ClockMessage, Companion, EventMessage, FrameMessage, HealthMessage, LinkMessage,
    MarkMessage, Metadata, RecordingHead, RestMessage, Storage, Topic, TouchMessage, WireMessage,
};
use taxel_recording::{Stream, description_of};

use crate::clock::{Epoch, system_utc_ns};
use crate::save::{Pace, SaveError};

pub(crate) use disk::DiskFile;
pub(crate) use link::{LinkRecorder, RecorderSlot};
pub use run::RecordFolder;
pub(crate) use run::RecordingNow;
pub(crate) use touch::{event_message, rest_message, rest_of, touch_message};

/// What becomes of the run when its recording fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhenRecordingFails {
    /// The measurement goes on.
    #[default]
    GoOn,
    /// The run ends.
    Stop,
}

/// A recording that is to be made.
#[derive(Debug, Clone)]
pub struct RecordFile {
    /// The file.
    pub path: PathBuf,
    /// Program and version.
    pub library: String,
    /// Files of the run: sensor, calibration, stimulus.
    pub attachments: Vec<Attachment>,
    /// Command line, version, hashes.
    pub metadata: Vec<Metadata>,
    /// Messages of types that another program knows, beside our own; default none.
    pub companion: Option<Arc<dyn Companion>>,
    /// What becomes of the run when the recording fails.
    pub when_failing: WhenRecordingFails,
    /// Hears of the failure at once.
    pub told: fn(&str),
}

/// Where a run is recorded to.
#[derive(Debug, Clone)]
pub enum RecordTo {
    /// A file.
    File(Box<RecordFile>),
    /// The messages themselves.
    Messages(SyncSender<Recorded>),
}

/// One message on its way into a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Recorded {
    /// Bytes of the wire.
    Wire(WireMessage),
    /// A raw frame.
    Raw(FrameMessage),
    /// Touch of a frame.
    Touch(Box<TouchMessage>),
    /// An event.
    Event(Box<EventMessage>),
    /// A state of the link.
    Link(LinkMessage),
    /// A change of the rest values.
    Rest(Box<RestMessage>),
    /// Relations of clocks.
    Clock(ClockMessage),
    /// Losses and conditions.
    Health(Box<HealthMessage>),
    /// A mark.
    Mark(MarkMessage),
}

impl Recorded {
    fn channel(&self) -> Topic {
        match self {
            Self::Wire(_) => Topic::Wire,
            Self::Raw(_) => Topic::Raw,
            Self::Touch(_) => Topic::Touch,
            Self::Event(_) => Topic::Events,
            Self::Link(_) => Topic::Link,
            Self::Rest(_) => Topic::Rest,
            Self::Clock(_) => Topic::Clock,
            Self::Health(_) => Topic::Health,
            Self::Mark(_) => Topic::Marks,
        }
    }
}

/// What a recorder has done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingSummary {
    /// The file.
    pub path: PathBuf,
    /// Bytes of it.
    pub bytes: u64,
    /// Messages in it.
    pub messages: u64,
    /// Messages that the disk did not take in time.
    pub lost: u64,
    /// Why it ended before the run, if it did.
    pub failure: Option<String>,
}

/// Takes the messages of a run, from any thread; none of its calls waits for the disk. Clones
/// write to the same recording.
///
/// A source that knows more than frames gets it by [`crate::Source::record_to`].
#[derive(Debug, Clone)]
pub struct Recorder {
    sender: SyncSender<(u64, Item)>,
    shared: Arc<State>,
    pace: Pace,
}

#[derive(Debug)]
enum Item {
    Message(Recorded),
    End,
}

/// State that the threads share.
#[derive(Debug)]
struct State {
    path: PathBuf,
    /// UTC at `since`, ns.
    utc_ns: u64,
    since: Instant,
    failure: OnceLock<String>,
    told: fn(&str),
    when_failing: WhenRecordingFails,
    lost: [AtomicU64; Topic::ALL.len()],
    messages: AtomicU64,
    writer: Mutex<Option<JoinHandle<()>>>,
}

impl State {
    fn new(path: &Path, told: fn(&str), when_failing: WhenRecordingFails) -> Arc<Self> {
        Arc::new(Self {
            path: path.to_owned(),
            utc_ns: Epoch::of_process().utc_ns(),
            since: Instant::now(),
            failure: OnceLock::new(),
            told,
            when_failing,
            lost: Default::default(),
            messages: AtomicU64::new(0),
            writer: Mutex::new(None),
        })
    }

    /// The recording has failed: this is said once.
    fn fail(&self, cause: &std::io::Error) {
        let path = shown::path(&self.path);
        let message = format!(
            "the recording {path} has ended: {cause}; what came before is in it{}",
            match self.when_failing {
                WhenRecordingFails::GoOn => ", the measurement goes on",
                WhenRecordingFails::Stop => ", and the run ends",
            }
        );
        if self.failure.set(message).is_ok()
            && let Some(message) = self.failure.get()
        {
            (self.told)(message);
        }
    }
}

/// Seconds of messages that may wait for the disk, and how many that are at least and at most.
const WAITING_S: f64 = 2.0;
const LEAST_WAITING: usize = 512;
const MOST_WAITING: usize = 1 << 16;
/// Messages of a frame: itself, its touch, and now and then another.
const PER_FRAME: f64 = 2.5;
/// Period of a source that states none, s.
const USUAL_PERIOD: f64 = 1e-3;

impl Recorder {
    /// Makes the file of a recording; one that exists is replaced only with `replace`, and
    /// never while another program writes it.
    pub(crate) fn create(
        file: &RecordFile,
        stream: &Stream,
        replace: bool,
        pace: Pace,
    ) -> Result<Self, SaveError> {
        let fail = |cause| SaveError::Create {
            path: file.path.clone(),
            cause,
        };
        // Before the file is made: a stream that cannot be described leaves none.
        let description = description_of(stream).map_err(fail)?;
        let disk = DiskFile::create(&file.path, replace).map_err(fail)?;
        let started = Self::start(file, description, stream.period, pace, disk);
        started.map_err(|cause| {
            if !replace {
                // Nothing of the run is in it.
                let _ = std::fs::remove_file(&file.path);
            }
            fail(cause)
        })
    }

    /// Writes into `disk`.
    fn start<S: Storage + disk::Syncs + Send + 'static>(
        file: &RecordFile,
        description: String,
        period: Option<f64>,
        pace: Pace,
        disk: S,
    ) -> std::io::Result<Self> {
        let frames = WAITING_S / period.unwrap_or(USUAL_PERIOD);
        let waiting = ((frames * PER_FRAME) as usize).clamp(LEAST_WAITING, MOST_WAITING);
        let (sender, messages) = mpsc::sync_channel(waiting);
        let shared = State::new(&file.path, file.told, file.when_failing);
        let head = RecordingHead {
            library: file.library.clone(),
            utc_ns: shared.utc_ns,
            description,
            attachments: file.attachments.clone(),
            metadata: file.metadata.clone(),
        };
        let companion = file.companion.clone();
        let writer = thread::begin(disk, (&head, companion), messages, Arc::clone(&shared))?;
        *shared.writer.lock().unwrap_or_else(PoisonError::into_inner) = Some(writer);
        Ok(Self {
            sender,
            shared,
            pace,
        })
    }

    /// A recorder whose messages go to `receiver` instead of a file.
    pub(crate) fn piped(receiver: SyncSender<Recorded>) -> Self {
        let (sender, messages) = mpsc::sync_channel::<(u64, Item)>(LEAST_WAITING);
        let shared = State::new(Path::new(""), |_| (), WhenRecordingFails::GoOn);
        let piping = std::thread::spawn(move || pipe(&messages, &receiver));
        *shared.writer.lock().unwrap_or_else(PoisonError::into_inner) = Some(piping);
        Self {
            sender,
            shared,
            pace: Pace::Waits,
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.shared.path
    }

    /// Time of this computer, ns of UTC, by a clock that is never set back and the same for all
    /// recordings of the process.
    pub fn utc_ns(&self) -> u64 {
        Epoch::of_process().utc_ns()
    }

    /// Why the recording has ended, if it has.
    pub fn failure(&self) -> Option<&str> {
        self.shared.failure.get().map(String::as_str)
    }

    /// True if the run is to end where the recording fails.
    pub(crate) fn stops_run(&self) -> bool {
        self.shared.when_failing == WhenRecordingFails::Stop
    }

    /// Messages that the disk did not take in time.
    pub fn lost(&self) -> u64 {
        let lost = self.shared.lost.iter();
        lost.map(|lost| lost.load(Ordering::Relaxed)).sum()
    }

    /// Records bytes as they came off the wire, about 20 ms of them.
    pub fn wire(&self, mut message: WireMessage) {
        message.utc_ns = self.utc_ns();
        self.put(Recorded::Wire(message));
    }

    /// Records a raw frame.
    pub fn raw(&self, mut message: FrameMessage) {
        message.utc_ns = self.utc_ns();
        self.put(Recorded::Raw(message));
    }

    /// Records the touch of a frame.
    pub fn touch(&self, message: TouchMessage) {
        self.put(Recorded::Touch(Box::new(message)));
    }

    /// Records an event.
    pub fn event(&self, message: EventMessage) {
        self.put(Recorded::Event(Box::new(message)));
    }

    /// Records a state of the link.
    pub fn link(&self, mut message: LinkMessage) {
        message.utc_ns = self.utc_ns();
        self.put(Recorded::Link(message));
    }

    /// Records a change of the rest values.
    pub fn rest(&self, mut message: RestMessage) {
        message.utc_ns = self.utc_ns();
        self.put(Recorded::Rest(Box::new(message)));
    }

    /// Records relations of clocks; UTC is that of the call, so that the steady clock should be
    /// read just before it.
    pub fn clock(&self, mut message: ClockMessage) {
        message.utc_ns = system_utc_ns();
        self.put(Recorded::Clock(message));
    }

    /// Records losses and conditions.
    pub fn health(&self, mut message: HealthMessage) {
        message.utc_ns = self.utc_ns();
        self.put(Recorded::Health(Box::new(message)));
    }

    /// Records a mark of the operator; one without a time is of now.
    pub fn mark(&self, mut message: MarkMessage) {
        if message.utc_ns == 0 {
            message.utc_ns = self.utc_ns();
        }
        self.put(Recorded::Mark(message));
    }

    fn put(&self, message: Recorded) {
        if self.failure().is_some() {
            return;
        }
        let channel = message.channel();
        let item = (self.utc_ns(), Item::Message(message));
        let kept = match self.pace {
            Pace::Waits => self.sender.send(item).is_ok(),
            Pace::Device => !matches!(self.sender.try_send(item), Err(TrySendError::Full(_))),
        };
        if !kept {
            let place = usize::from(channel.number()) - 1;
            self.shared.lost[place].fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Finishes the recording; later messages are left out.
    pub(crate) fn finish(&self) -> RecordingSummary {
        let writer = {
            let writer = self.shared.writer.lock();
            writer.unwrap_or_else(PoisonError::into_inner).take()
        };
        if let Some(writer) = writer {
            // It may be gone after a failure.
            let _ = self.sender.send((self.utc_ns(), Item::End));
            if writer.join().is_err() {
                let cause = std::io::Error::other("the writing thread ended unexpectedly");
                self.shared.fail(&cause);
            }
        }
        RecordingSummary {
            path: self.shared.path.clone(),
            bytes: std::fs::metadata(&self.shared.path).map_or(0, |about| about.len()),
            messages: self.shared.messages.load(Ordering::Relaxed),
            lost: self.lost(),
            failure: self.failure().map(str::to_owned),
        }
    }
}

fn pipe(messages: &Receiver<(u64, Item)>, receiver: &SyncSender<Recorded>) {
    for (_, item) in messages {
        let Item::Message(message) = item else { return };
        if receiver.send(message).is_err() {
            return;
        }
    }
}
