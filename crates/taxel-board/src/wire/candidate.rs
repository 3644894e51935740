//! What may stand at a place of the buffer.

use super::packet::Reading;

/// What stands at a place of the buffer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Candidate {
    /// It cannot be said before more bytes have come.
    More,
    /// No packet begins there; go on after so many bytes.
    None(usize),
    /// So many bytes: a packet with a reading.
    Reading(usize, Reading),
    /// A whole packet or line without one.
    Other(usize),
    /// What stands between two, and is nothing: ends, blanks.
    Blank(usize),
    /// A stretch between two ends that is no packet.
    Damaged(usize),
}

/// What lies around a candidate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around<'a> {
    /// Bytes from the candidate on.
    pub(super) bytes: &'a [u8],
    /// The bytes before it that are still there.
    pub(super) before: &'a [u8],
    /// Bytes since the end of the last packet; `None` before the first.
    pub(super) since_packet: Option<u64>,
    /// True if no more bytes will come.
    pub(super) last: bool,
}
