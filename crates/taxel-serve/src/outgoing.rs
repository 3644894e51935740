//! What the pump offers to all who listen.

use std::time::Instant;

use bytes::Bytes;

/// A message with the moment its frame arrived.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    pub(crate) arrival: Instant,
    pub(crate) bytes: Bytes,
}

impl Outgoing {
    /// The last message of a run.
    pub(crate) fn end() -> Self {
        Self {
            arrival: Instant::now(),
            bytes: Bytes::new(),
        }
    }

    /// True for the last message of a run.
    pub(crate) fn is_end(&self) -> bool {
        self.bytes.is_empty()
    }
}
