//! The thread that writes a recording.

use std::io::Result;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taxel_recording::mcap::{Companion, McapWriter, RecordingHead, Storage, Topic};

use super::disk::{SyncThread, Syncs};
use super::{Item, Recorded, State};

/// A chunk is written after this time: with what the machine takes to wake the thread and to
/// write, no more than 100 ms are lost with the process.
const FLUSH: Duration = Duration::from_millis(80);
/// A chunk waits so long for the estimate of its last frame.
const ESTIMATE: Duration = Duration::from_millis(10);
/// The disk is asked to keep what it has after this time.
const SYNC: Duration = Duration::from_secs(1);
/// Longest wait for a message.
const IDLE: Duration = Duration::from_hours(1);

/// Writes the head, then begins the thread.
pub(super) fn begin<S: Storage + Syncs + Send + 'static>(
    disk: S,
    (head, companion): (&RecordingHead, Option<Arc<dyn Companion>>),
    messages: Receiver<(u64, Item)>,
    state: Arc<State>,
) -> Result<JoinHandle<()>> {
    let syncer = disk.syncer()?;
    let mut writer = McapWriter::new(disk, head)?.accompanied(companion);
    writer.sync()?;
    let failed = Arc::clone(&state);
    let sync = SyncThread::begin(syncer, move |error| failed.fail(error));
    std::thread::Builder::new()
        .name("recorder".into())
        .spawn(move || {
            let ended = write(writer, &messages, &state, &sync);
            sync.end();
            if let Err(error) = ended {
                state.fail(&error);
            }
        })
}

fn write<S: Storage>(
    mut writer: McapWriter<S>,
    messages: &Receiver<(u64, Item)>,
    state: &State,
    sync: &SyncThread,
) -> Result<()> {
    let mut skipped = [0; Topic::ALL.len()];
    // When the chunk was opened, and when the oldest was written that the disk may not have.
    let mut opened: Option<Instant> = None;
    let mut unsynced: Option<Instant> = None;
    // A frame and its estimate are in one chunk, so that what is lost after it is whole frames.
    let mut flush = FLUSH;
    loop {
        let left = |since: Option<Instant>, time: Duration| {
            since.map_or(IDLE, |since| time.saturating_sub(since.elapsed()))
        };
        let wait = left(opened, flush).min(left(unsynced, SYNC));
        let item = match messages.recv_timeout(wait) {
            Ok(item) => Some(item),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        if state.failure.get().is_some() {
            // The disk failed where nobody could tell the writer.
            return Ok(());
        }
        match item {
            Some((_, Item::End)) => break,
            Some((utc_ns, Item::Message(message))) => {
                let place = usize::from(message.channel().number()) - 1;
                let lost = state.lost[place].load(Ordering::Relaxed);
                writer.skip(message.channel(), (lost - skipped[place]) as u32);
                skipped[place] = lost;
                put(&mut writer, utc_ns, &message)?;
                flush = match message {
                    Recorded::Raw(_) => FLUSH + ESTIMATE,
                    _ => FLUSH,
                };
                state.messages.fetch_add(1, Ordering::Relaxed);
                opened.get_or_insert_with(Instant::now);
            }
            None => {}
        }
        if opened.is_some_and(|opened| opened.elapsed() >= flush) {
            writer.flush()?;
            opened = None;
            unsynced.get_or_insert_with(Instant::now);
        }
        if unsynced.is_some_and(|unsynced| unsynced.elapsed() >= SYNC) {
            sync.ask();
            unsynced = None;
        }
    }
    writer.finish().map(drop)
}

fn put<S: Storage>(writer: &mut McapWriter<S>, utc_ns: u64, message: &Recorded) -> Result<()> {
    match message {
        Recorded::Wire(message) => writer.message(utc_ns, message),
        Recorded::Raw(message) => writer.message(utc_ns, message),
        Recorded::Touch(message) => writer.message(utc_ns, &**message),
        Recorded::Event(message) => writer.message(utc_ns, &**message),
        Recorded::Link(message) => writer.message(utc_ns, message),
        Recorded::Rest(message) => writer.message(utc_ns, &**message),
        Recorded::Clock(message) => writer.message(utc_ns, message),
        Recorded::Health(message) => writer.message(utc_ns, &**message),
        Recorded::Mark(message) => writer.message(utc_ns, message),
    }
}
