//! The thread of a link: opens it, reads it, decodes, and opens it again for ever.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, Instant};

use taxel::acquisition::Frame;

use super::advice;
use super::error::LinkError;
use super::exec::Tell;
use super::options::{LinkObserver, Reconnect};
use super::port::{Link, Others, Port, Received};
use super::state::{LinkHandle, LinkState};
use super::tracker::Tracker;
use super::wire::{Decode, Greeting};

/// Longest wait for bytes before state, questions, observers and the end are looked at.
const PATIENCE: Duration = Duration::from_millis(10);
/// Waits between attempts to open: the first, and the longest.
const FIRST_WAIT: Duration = Duration::from_millis(100);
const LONGEST_WAIT: Duration = Duration::from_secs(2);
/// How often a port that has gone is looked for in between.
const LOOK: Duration = Duration::from_millis(20);
/// A board is asked for its hello as often as it says it unasked.
const ASK_AGAIN: Duration = Duration::from_secs(1);
/// Bytes of one read.
const BUFFER: usize = 1 << 16;

/// What the thread hands to the source.
#[derive(Debug)]
pub(crate) enum Item {
    /// A frame.
    Frame(Frame),
    /// The frames that follow come over a new connection.
    Reconnected,
    /// There is no more.
    End(Option<LinkError>),
}

/// Everything that the thread of a link owns.
pub(crate) struct Reader {
    pub(crate) link: Box<dyn Link>,
    pub(crate) decoder: Box<dyn Decode>,
    pub(crate) greeting: Greeting,
    pub(crate) reconnect: Reconnect,
    /// Silence after which frames are missed, ns.
    pub(crate) stale_after: u64,
    pub(crate) baud: Option<u32>,
    pub(crate) origin: Instant,
    pub(crate) status: LinkHandle,
    pub(crate) observers: Vec<Box<dyn LinkObserver>>,
    pub(crate) tell: Tell,
    pub(crate) items: SyncSender<Item>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// How a connection ended.
enum Ended {
    /// It was lost, and why.
    Lost(String),
    /// There is no more to come.
    Done,
    /// The board says now that its frames hold something else.
    Changed(String),
    /// The run ends.
    Stopped,
}

impl Reader {
    /// Runs until the run ends or the link has ended for good.
    pub(crate) fn run(mut self) {
        let end = self.connections();
        let reason = end.as_ref().map(ToString::to_string).unwrap_or_default();
        self.change(LinkState::Ended, reason);
        // Nobody may be there any more.
        let _ = self.items.send(Item::End(end));
    }

    fn now(&self) -> u64 {
        self.origin.elapsed().as_nanos() as u64
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn change(&mut self, state: LinkState, reason: String) {
        let now = self.now();
        let mut status = self.status.lock();
        let same = status.state == state && status.reason == reason;
        if !same {
            status.change(state, reason, now);
        }
        status.wire = self.decoder.counts();
        status.name = self.link.name();
        let copy = status.clone();
        drop(status);
        if same {
            return;
        }
        let said = match copy.reason.as_str() {
            "" => String::new(),
            reason => format!(": {reason}"),
        };
        (self.tell)(&format!("{}: {}{said}", copy.name, state.name()));
        for observer in &mut self.observers {
            observer.link(&copy);
        }
    }

    fn connections(&mut self) -> Option<LinkError> {
        let mut wait = FIRST_WAIT;
        let mut connected_before = false;
        while !self.stopped() {
            match self.link.open() {
                Err(error @ LinkError::Never { .. }) => return Some(error),
                Err(error) => {
                    let LinkError::Open { reason, .. } = &error else {
                        return Some(error);
                    };
                    if self.reconnect == Reconnect::Once && !connected_before {
                        return Some(error);
                    }
                    self.change(LinkState::Absent, reason.clone());
                    if self.wait(wait) {
                        wait = FIRST_WAIT;
                    } else {
                        wait = (2 * wait).min(LONGEST_WAIT);
                    }
                }
                Ok(mut port) => {
                    if connected_before {
                        self.decoder.reconnected();
                        if self.items.send(Item::Reconnected).is_err() {
                            return None;
                        }
                    }
                    connected_before = true;
                    self.status.lock().connects += 1;
                    self.change(LinkState::Connected, String::new());
                    for remark in self.link.remarks() {
                        (self.tell)(&format!("note: {remark}"));
                    }
                    let before = self.decoder.counts().delivered;
                    let ended = self.connection(port.as_mut());
                    // Closed before it is opened again.
                    drop(port);
                    match ended {
                        Ended::Done | Ended::Stopped => return None,
                        Ended::Changed(difference) => {
                            let name = self.link.name();
                            return Some(LinkError::Changed { name, difference });
                        }
                        Ended::Lost(reason) => {
                            if self.reconnect == Reconnect::Once {
                                let name = self.link.name();
                                return Some(LinkError::Lost { name, reason });
                            }
                            self.change(LinkState::Absent, reason);
                            if self.decoder.counts().delivered > before {
                                wait = FIRST_WAIT;
                            }
                            self.wait(wait);
                            wait = (2 * wait).min(LONGEST_WAIT);
                        }
                    }
                }
            }
        }
        None
    }

    /// Waits; true if the link has appeared meanwhile.
    fn wait(&mut self, time: Duration) -> bool {
        let deadline = Instant::now() + time;
        while !self.stopped() {
            if self.link.appeared() {
                return true;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            std::thread::sleep(left.min(LOOK));
        }
        false
    }

    fn connection(&mut self, port: &mut dyn Port) -> Ended {
        let mut tracker = Tracker::new(self.now(), self.stale_after);
        let mut buffer = vec![0; BUFFER];
        let mut next_question = Instant::now();
        let mut asked: Option<Instant> = None;
        if let Err(error) = port.write(&self.greeting.start) {
            return Ended::Lost(format!("the start command cannot be written: {error}"));
        }
        loop {
            if self.stopped() {
                // The board may be gone already.
                let _ = port.write(&self.greeting.stop);
                return Ended::Stopped;
            }
            let mut patience = PATIENCE;
            if let Some(poll) = &self.greeting.poll {
                let now = Instant::now();
                if now >= next_question {
                    if let Err(error) = port.write(&poll.send) {
                        return Ended::Lost(error.to_string());
                    }
                    let every = Duration::try_from_secs_f64(poll.every).unwrap_or(PATIENCE);
                    next_question = (next_question + every).max(now);
                }
                patience = patience.min(next_question.saturating_duration_since(now));
                patience = patience.max(Duration::from_millis(1));
            }
            let question = self.decoder.question();
            if !question.is_empty() && asked.is_none_or(|asked| asked.elapsed() >= ASK_AGAIN) {
                if let Err(error) = port.write(question) {
                    return Ended::Lost(error.to_string());
                }
                asked = Some(Instant::now());
            }
            let read = port.read(&mut buffer, patience);
            // Before anything else: this is the time of arrival.
            let host_ns = self.now();
            self.hear_others(port.others());
            match read {
                Ok(Received::Bytes(bytes)) => {
                    let Some(frames) = self.take(&mut tracker, &buffer[..bytes], host_ns) else {
                        return Ended::Stopped;
                    };
                    if frames > 0 {
                        port.gave_frame(Duration::from_nanos(self.stale_after));
                    }
                    if let Some(difference) = self.decoder.changed() {
                        return Ended::Changed(difference.to_owned());
                    }
                }
                Ok(Received::Nothing) => {
                    for observer in &mut self.observers {
                        observer.quiet(host_ns);
                    }
                    let changed = tracker.passed(host_ns);
                    self.changed(changed, &tracker);
                }
                Ok(Received::End) => {
                    return Ended::Lost("the other side closed the connection".into());
                }
                Ok(Received::Done) => {
                    self.decoder.finish();
                    self.hand_out();
                    return Ended::Done;
                }
                Err(error) => return Ended::Lost(lost(&error)),
            }
        }
    }

    /// Names a new sender that is not the board.
    fn hear_others(&mut self, others: Others) {
        if others.datagrams == 0 {
            return;
        }
        let mut status = self.status.lock();
        let news = others.senders.get(status.others.senders.len()).copied();
        status.others = others;
        let name = status.name.clone();
        drop(status);
        if let Some(sender) = news {
            (self.tell)(&format!(
                "note: {name}: {sender} sends too; one board is read, the first that sent, and nothing of others"
            ));
        }
    }

    /// Decodes what arrived, and gives the number of frames; `None` if nobody takes frames any
    /// more.
    fn take(&mut self, tracker: &mut Tracker, bytes: &[u8], host_ns: u64) -> Option<usize> {
        for observer in &mut self.observers {
            observer.wire(host_ns, bytes);
        }
        self.status.lock().bytes += bytes.len() as u64;
        self.decoder.push(bytes, host_ns);
        let frames = self.hand_out()?;
        let changed = tracker.received(host_ns, bytes, frames);
        self.changed(changed, tracker);
        Some(frames)
    }

    /// Hands the decoded frames to the source: how many; `None` if nobody takes them any more.
    fn hand_out(&mut self) -> Option<usize> {
        let (mut frames, mut overrun) = (0, 0);
        while let Some(frame) = self.decoder.next() {
            frames += 1;
            match self.send(Item::Frame(frame)) {
                Ok(()) => {}
                Err(TrySendError::Full(_)) => overrun += 1,
                Err(TrySendError::Disconnected(_)) => return None,
            }
        }
        let mut status = self.status.lock();
        status.overrun += overrun;
        status.wire = self.decoder.counts();
        let news = status.remarked(self.decoder.remark());
        let copy = news.then(|| status.clone());
        drop(status);
        if let Some(status) = copy {
            (self.tell)(&format!("note: {}: {}", status.name, status.remark));
            for observer in &mut self.observers {
                observer.link(&status);
            }
        }
        Some(frames)
    }

    /// Hands an item on; where the other side waits, so does this one.
    fn send(&self, mut item: Item) -> Result<(), TrySendError<Item>> {
        loop {
            match self.items.try_send(item) {
                Err(TrySendError::Full(back)) if self.link.waits() && !self.stopped() => {
                    item = back;
                    std::thread::sleep(Duration::from_millis(1));
                }
                other => return other,
            }
        }
    }

    fn changed(&mut self, state: Option<LinkState>, tracker: &Tracker) {
        let Some(state) = state else { return };
        let reason = match state {
            LinkState::Garbled => advice::garbled(tracker.sample(), self.decoder.as_ref(), self.baud),
            LinkState::Silent if self.decoder.counts().delivered == 0 => {
                "open, but no byte has come; does the board send without being asked, and is it this port?".into()
            }
            LinkState::Silent => "no frame".into(),
            _ => String::new(),
        };
        self.change(state, reason);
    }
}

/// A port that was pulled out has many names.
fn lost(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::BrokenPipe | std::io::ErrorKind::NotConnected => {
            "the port has gone".into()
        }
        _ => error.to_string(),
    }
}
