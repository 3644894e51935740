//! One clock for all that a service reads and records.

use std::sync::OnceLock;
use std::time::{Instant, SystemTime};

/// A moment by the steady clock, with the UTC of then, ns since 1970.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Epoch {
    pub(crate) at: Instant,
    utc_ns: u64,
}

impl Epoch {
    /// The one of this process: times of several sensors and of their recordings compare, and go on
    /// when the clock of the computer is set.
    pub(crate) fn of_process() -> Self {
        static EPOCH: OnceLock<Epoch> = OnceLock::new();
        *EPOCH.get_or_init(|| Self {
            at: Instant::now(),
            utc_ns: system_utc_ns(),
        })
    }

    /// UTC now, ns since 1970.
    pub(crate) fn utc_ns(&self) -> u64 {
        self.utc_ns_at(Instant::now())
    }

    /// UTC at a moment, ns since 1970.
    pub(crate) fn utc_ns_at(&self, at: Instant) -> u64 {
        self.utc_ns + self.since_ns(at)
    }

    /// A moment by the steady clock, ns; 0 before it began.
    pub(crate) fn since_ns(&self, at: Instant) -> u64 {
        let since = at.saturating_duration_since(self.at).as_nanos();
        u64::try_from(since).unwrap_or(u64::MAX / 4)
    }
}

/// UTC by the clock of this computer, ns since 1970.
pub(crate) fn system_utc_ns() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(0))
}
