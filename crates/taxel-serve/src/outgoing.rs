//! What the pump offers to all who listen.

use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;

/// A message with the moment its frame arrived.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    pub(crate) arrival: Instant,
    /// When it was read on the device, as far as the relation of the clocks is known; else its arrival.
    pub(crate) taken: Instant,
    pub(crate) bytes: Bytes,
    /// The same as a row of the table of estimates, where an output is one.
    pub(crate) row: Option<Arc<str>>,
}

impl Outgoing {
    /// The last message of a run.
    pub(crate) fn end() -> Self {
        let now = Instant::now();
        Self {
            arrival: now,
            taken: now,
            bytes: Bytes::new(),
            row: None,
        }
    }

    /// True for the last message of a run.
    pub(crate) fn is_end(&self) -> bool {
        self.bytes.is_empty()
    }
}
