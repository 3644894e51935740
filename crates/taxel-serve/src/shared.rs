//! What a run shows to its clients, and what they tell it.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use bytes::Bytes;
use tokio::sync::broadcast;

use crate::events::EventLog;
use crate::history::History;
use crate::latency::Latencies;
use crate::link::LinkHandle;
use crate::message::Tare;
use crate::outgoing::Outgoing;
use crate::record::Recorder;
use crate::replay::ReplayNow;
use crate::tare::BelowZero;

/// Messages that a slow subscriber may be behind before it loses the oldest.
const QUEUE: usize = 1024;

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
pub(crate) const REST: usize = 0;
pub(crate) const TARES: usize = 1;
pub(crate) const CONDITION: usize = 2;
pub(crate) const BASELINE: usize = 3;

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

    pub(crate) fn post(&self, place: usize, text: String) {
        let post = &mut self.status().posts[place];
        post.text = text.into();
        post.version += 1;
    }

    pub(crate) fn sent(&self) -> MutexGuard<'_, Latencies> {
        self.sent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
