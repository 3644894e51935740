//! What the pump offers to all who listen.

use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;

/// A message with the moment its frame arrived.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    pub(crate) arrival: Instant,
    pub(crate) bytes: Bytes,
    /// The same as a row of the table of estimates, where an output is one.
    pub(crate) row: Option<Arc<str>>,
}

impl Outgoing {
    /// The last message of a run.
    pub(crate) fn end() -> Self {
        Self {
            arrival: Instant::now(),
            bytes: Bytes::new(),
            row: None,
        }
    }

    /// True for the last message of a run.
    pub(crate) fn is_end(&self) -> bool {
        self.bytes.is_empty()
    }
}
