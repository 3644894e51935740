//! What only the link knows, on its way into the recording.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use taxel_recording::mcap::{ClockMessage, LinkMessage, WireMessage};

use super::Recorder;
use crate::link::{LinkObserver, LinkStatus};

/// Bytes of the wire are one message after so much time, ns, or so many of them.
const TOGETHER_NS: u64 = 20_000_000;
const MOST_TOGETHER: usize = 1 << 16;
/// Bytes that are kept until the recorder is there.
const MOST_EARLY: usize = 1 << 20;
/// Time from one pair of the steady clock and UTC to the next, ns.
const CLOCK_EVERY_NS: u64 = 60_000_000_000;

/// The recorder of a run, as soon as there is one.
#[derive(Debug, Clone, Default)]
pub(crate) struct RecorderSlot(Arc<Mutex<Slot>>);

#[derive(Debug, Default)]
enum Slot {
    /// The run has not begun: what comes waits.
    #[default]
    Waiting,
    /// The run is not recorded: what comes is gone.
    Off,
    On(Recorder),
}

impl RecorderSlot {
    pub(crate) fn set(&self, recorder: Option<&Recorder>) {
        *self.lock() = recorder.cloned().map_or(Slot::Off, Slot::On);
    }

    pub(crate) fn get(&self) -> Option<Recorder> {
        match &*self.lock() {
            Slot::On(recorder) => Some(recorder.clone()),
            Slot::Waiting | Slot::Off => None,
        }
    }

    fn waits(&self) -> bool {
        matches!(*self.lock(), Slot::Waiting)
    }

    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Hears a link for the recording of its run.
#[derive(Debug)]
pub(crate) struct LinkRecorder {
    recorder: RecorderSlot,
    bytes: Vec<u8>,
    first_ns: u64,
    last_ns: u64,
    clock_ns: Option<u64>,
    /// States, and bytes before them, that wait for the recorder.
    early: VecDeque<Early>,
}

/// What came before there was a recorder, in its order.
#[derive(Debug)]
enum Early {
    Link(LinkMessage),
    Wire(WireMessage),
}

impl LinkRecorder {
    pub(crate) fn new(recorder: RecorderSlot) -> Self {
        Self {
            recorder,
            bytes: Vec::new(),
            first_ns: 0,
            last_ns: 0,
            clock_ns: None,
            early: VecDeque::new(),
        }
    }

    /// Hands over what has come so far.
    fn hand_over(&mut self) {
        let Some(recorder) = self.recorder.get() else {
            if !self.recorder.waits() {
                self.early.clear();
                self.bytes.clear();
            } else if self.bytes.len() > MOST_EARLY {
                self.bytes.clear();
            }
            return;
        };
        for message in self.early.drain(..) {
            match message {
                Early::Link(message) => recorder.link(message),
                Early::Wire(message) => recorder.wire(message),
            }
        }
        if let Some(message) = together(&mut self.bytes, self.last_ns) {
            recorder.wire(message);
        }
    }
}

/// The bytes as one message that arrived at `host_ns`; `None` for none.
fn together(bytes: &mut Vec<u8>, host_ns: u64) -> Option<WireMessage> {
    (!bytes.is_empty()).then(|| WireMessage {
        host_ns,
        bytes: std::mem::take(bytes),
        ..WireMessage::default()
    })
}

impl LinkObserver for LinkRecorder {
    fn wire(&mut self, host_ns: u64, bytes: &[u8]) {
        if self.bytes.is_empty() {
            self.first_ns = host_ns;
        }
        self.bytes.extend_from_slice(bytes);
        self.last_ns = host_ns;
        let due = |since: u64| host_ns.saturating_sub(since) >= CLOCK_EVERY_NS;
        if self.clock_ns.is_none_or(due)
            && let Some(recorder) = self.recorder.get()
        {
            self.clock_ns = Some(host_ns);
            recorder.clock(ClockMessage {
                host_ns,
                offset_ns: f64::NAN,
                rate: f64::NAN,
                lower_ns: f64::NAN,
                upper_ns: f64::NAN,
                ..ClockMessage::default()
            });
        }
        if self.bytes.len() >= MOST_TOGETHER {
            self.hand_over();
        }
        self.quiet(host_ns);
    }

    fn quiet(&mut self, host_ns: u64) {
        let old = host_ns.saturating_sub(self.first_ns) >= TOGETHER_NS;
        if old && !self.bytes.is_empty() {
            self.hand_over();
        }
    }

    fn link(&mut self, status: &LinkStatus) {
        // The bytes before a state stand before it: a decoder begins anew between them.
        let bytes = together(&mut self.bytes, self.last_ns);
        self.early.extend(bytes.map(Early::Wire));
        let reason = match status.remark.as_str() {
            "" => status.reason.clone(),
            remark => remark.to_owned(),
        };
        self.early.push_back(Early::Link(LinkMessage {
            host_ns: status.since_ns,
            segment: u32::try_from(status.connects.saturating_sub(1)).unwrap_or(u32::MAX),
            state: status.state.name().into(),
            reason,
            ..LinkMessage::default()
        }));
        // A link that never opens has no recorder either.
        if self.early.len() > 1000 {
            self.early.pop_front();
        }
        self.hand_over();
    }
}

impl Drop for LinkRecorder {
    /// The link is closed: the last bytes do not wait for others.
    fn drop(&mut self) {
        self.hand_over();
    }
}

#[cfg(test)]
mod tests {
    use super::super::Recorded;
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn bytes_before_a_silence_do_not_wait_for_its_end() {
        let (sender, recorded) = std::sync::mpsc::sync_channel(8);
        let slot = RecorderSlot::default();
        let mut observer = LinkRecorder::new(RecorderSlot::clone(&slot));
        observer.wire(5 * MS, b"early ");
        observer.quiet(100 * MS);
        let recorder = Recorder::piped(sender);
        slot.set(Some(&recorder));
        observer.quiet(110 * MS);
        observer.wire(120 * MS, b"one ");
        observer.wire(130 * MS, b"two");
        observer.quiet(139 * MS);
        observer.quiet(141 * MS);
        observer.quiet(161 * MS);
        recorder.finish();
        let wire = recorded.iter().filter_map(|message| match message {
            Recorded::Wire(wire) => Some((wire.host_ns / MS, wire.bytes)),
            _ => None,
        });
        let expected = [(5, b"early ".to_vec()), (130, b"one two".to_vec())];
        assert_eq!(wire.collect::<Vec<_>>(), expected);
    }
}
