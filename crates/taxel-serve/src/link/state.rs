//! State of a link, as people, clients and recordings see it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;

use super::clock::ClockRelation;
use super::port::Others;
use super::wire::WireCounts;

/// State of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkState {
    /// There is no such port, or nobody answers.
    Absent,
    /// It is being opened.
    Opening,
    /// It is open; no frame was decoded yet.
    Connected,
    /// Frames arrive.
    InStep,
    /// It is open and nothing arrives.
    Silent,
    /// Bytes arrive that are no packets.
    Garbled,
    /// It has ended and will not come back.
    Ended,
}

impl LinkState {
    /// Name in messages and lines.
    pub fn key(self) -> &'static str {
        match self {
            Self::InStep => "in_step",
            other => other.name(),
        }
    }

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::Opening => "opening",
            Self::Connected => "connected",
            Self::InStep => "in step",
            Self::Silent => "silent",
            Self::Garbled => "garbled",
            Self::Ended => "ended",
        }
    }
}

/// A link now.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinkStatus {
    /// Name of the port, host or program.
    pub name: String,
    /// Name of the board.
    pub board: String,
    /// Class of its wire, A to D: how surely damage is seen.
    pub wire_class: char,
    /// Its state.
    pub state: LinkState,
    /// Since when by the wall clock, s since 1970.
    pub since_unix_s: f64,
    /// Since when by the steady clock, ns since the program began.
    pub since_ns: u64,
    /// Why it is in this state, with advice; empty where the state says all.
    pub reason: String,
    /// What should be changed in the description of the board, by what came; empty where all
    /// agrees.
    pub remark: String,
    /// The words of the remark that was told last, without its numbers.
    #[serde(skip)]
    told: String,
    /// How often it was connected.
    pub connects: u64,
    /// Bytes that arrived.
    pub bytes: u64,
    /// Frames dropped because the program was too slow.
    pub overrun: u64,
    /// Counts of the wire.
    pub wire: WireCounts,
    /// Who else sends to a UDP port, of the last connection that any did.
    pub others: Others,
    /// The clock of the board against that of this computer, of frames that have a time or a
    /// number of the board.
    pub clock: Option<ClockRelation>,
}

/// The status of a link, shared by its thread and those who show it.
#[derive(Debug, Clone)]
pub struct LinkHandle(Arc<Mutex<LinkStatus>>);

impl LinkHandle {
    pub(crate) fn new(name: String, board: String, wire_class: char) -> Self {
        Self(Arc::new(Mutex::new(LinkStatus {
            name,
            board,
            wire_class,
            state: LinkState::Opening,
            since_unix_s: unix_s(),
            since_ns: 0,
            reason: String::new(),
            remark: String::new(),
            told: String::new(),
            connects: 0,
            bytes: 0,
            overrun: 0,
            wire: WireCounts::default(),
            others: Others::default(),
            clock: None,
        })))
    }

    /// The status now.
    pub fn now(&self) -> LinkStatus {
        self.lock().clone()
    }

    /// The state now.
    pub fn state(&self) -> LinkState {
        self.lock().state
    }

    /// Frames lost so far; none where the wire cannot tell.
    pub fn lost(&self) -> Option<u64> {
        self.lock().wire.lost
    }

    /// Times that counter or clock of the board began again.
    pub(crate) fn restarts(&self) -> u64 {
        self.lock().wire.restarts
    }

    /// What should be changed in the description of the board, where that is not `known`.
    pub(crate) fn remark_beside(&self, known: &str) -> Option<String> {
        let status = self.lock();
        (status.remark != known).then(|| status.remark.clone())
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, LinkStatus> {
        // A poisoned lock still holds a whole value.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LinkStatus {
    pub(crate) fn change(&mut self, state: LinkState, reason: String, host_ns: u64) {
        self.state = state;
        self.reason = reason;
        self.since_ns = host_ns;
        self.since_unix_s = unix_s();
    }

    /// Takes what should be changed; true if that is news, which another number is not.
    pub(crate) fn remarked(&mut self, remark: Option<String>) -> bool {
        self.remark = remark.unwrap_or_default();
        let number = |c: char| c.is_ascii_digit() || c == '.';
        let words = self.remark.replace(number, "");
        let news = !words.is_empty() && words != self.told;
        if news {
            self.told = words;
        }
        news
    }
}

fn unix_s() -> f64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0.0, |now| now.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_number_is_no_news() {
        let link = LinkHandle::new(String::from("pty"), String::new(), 'A');
        let mut status = link.lock();
        let mut said = |text: &str| status.remarked(Some(text.to_owned()));
        assert!(said("the clock runs 0.87 times as fast"));
        assert!(!said("the clock runs 1.05 times as fast"));
        // It comes and goes on a busy computer.
        assert!(!said(""));
        assert!(!said("the clock runs 0.9 times as fast"));
        assert!(said("frames are 2 bytes longer"));
    }
}
