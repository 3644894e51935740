//! State of an open link from what arrives and when. No I/O.

use super::state::LinkState;

/// Time with bytes but without a packet after which they are garbled, ns.
pub(super) const GARBLED_AFTER: u64 = 2_000_000_000;
/// Newest bytes that are kept to see what they are.
const SAMPLE: usize = 4096;

/// Follows an open link.
#[derive(Debug)]
pub(crate) struct Tracker {
    stale_after: u64,
    state: LinkState,
    last_byte: Option<u64>,
    last_frame: u64,
    /// Since when bytes have come without a frame.
    without_frame: Option<u64>,
    sample: Vec<u8>,
}

impl Tracker {
    /// A link that was opened at `host_ns`; a frame is missed after `stale_after`, both ns.
    pub(crate) fn new(host_ns: u64, stale_after: u64) -> Self {
        Self {
            stale_after,
            state: LinkState::Connected,
            last_byte: None,
            last_frame: host_ns,
            without_frame: None,
            sample: Vec::new(),
        }
    }

    /// The newest bytes since the last frame.
    pub(crate) fn sample(&self) -> &[u8] {
        &self.sample
    }

    /// Bytes arrived and gave so many frames; the new state if it changed.
    pub(crate) fn received(
        &mut self,
        host_ns: u64,
        bytes: &[u8],
        frames: usize,
    ) -> Option<LinkState> {
        self.last_byte = Some(host_ns);
        if frames > 0 {
            self.last_frame = host_ns;
            self.without_frame = None;
            self.sample.clear();
            return self.becomes(LinkState::InStep);
        }
        self.without_frame.get_or_insert(host_ns);
        self.sample
            .extend(&bytes[bytes.len().saturating_sub(SAMPLE)..]);
        if self.sample.len() > 2 * SAMPLE {
            self.sample.drain(..self.sample.len() - SAMPLE);
        }
        self.passed(host_ns)
    }

    /// Time has passed; the new state if it changed.
    pub(crate) fn passed(&mut self, host_ns: u64) -> Option<LinkState> {
        let since = |then: u64| host_ns.saturating_sub(then);
        let bytes_come = self
            .last_byte
            .is_some_and(|last| since(last) < GARBLED_AFTER);
        let garbled = self
            .without_frame
            .is_some_and(|begin| since(begin) >= GARBLED_AFTER);
        if bytes_come && garbled {
            return self.becomes(LinkState::Garbled);
        }
        let patience = match self.state {
            // The first frame of a board that restarts takes its time.
            LinkState::Connected => self.stale_after.max(1_000_000_000),
            _ => self.stale_after,
        };
        if since(self.last_frame) > patience && (!bytes_come || self.state == LinkState::InStep) {
            return self.becomes(LinkState::Silent);
        }
        None
    }

    fn becomes(&mut self, state: LinkState) -> Option<LinkState> {
        if self.state == LinkState::Garbled && state == LinkState::Silent {
            self.without_frame = None;
        }
        let changed = self.state != state;
        self.state = state;
        changed.then_some(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_link_is_in_step_silent_garbled_and_in_step_again() {
        let mut tracker = Tracker::new(0, 350 * MS);
        assert_eq!(tracker.received(10 * MS, b"half", 0), None);
        assert_eq!(
            tracker.received(20 * MS, b"whole", 1),
            Some(LinkState::InStep)
        );
        assert_eq!(tracker.passed(300 * MS), None);
        assert_eq!(tracker.passed(400 * MS), Some(LinkState::Silent));
        assert_eq!(tracker.passed(9000 * MS), None);
        let mut changes = Vec::new();
        for at in 0..30 {
            changes.extend(tracker.received((10_000 + 100 * at) * MS, b"noise", 0));
        }
        assert_eq!(changes, [LinkState::Garbled]);
        assert!(tracker.sample().ends_with(b"noise"));
        assert_eq!(
            tracker.received(14_000 * MS, b"frame", 2),
            Some(LinkState::InStep)
        );
        assert!(tracker.sample().is_empty());
    }

    #[test]
    fn an_open_port_without_bytes_is_silent() {
        let mut tracker = Tracker::new(0, 350 * MS);
        assert_eq!(tracker.passed(900 * MS), None);
        assert_eq!(tracker.passed(1100 * MS), Some(LinkState::Silent));
    }

    #[test]
    fn the_sample_stays_small() {
        let mut tracker = Tracker::new(0, 350 * MS);
        for at in 0..100 {
            tracker.received(at, &[7; 3000], 0);
            assert!(tracker.sample().len() <= 2 * SAMPLE + 3000);
        }
    }
}
