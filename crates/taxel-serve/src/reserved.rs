//! Memory of a history, taken at the start.

use std::collections::VecDeque;

/// An empty queue for so many values whose memory is in use from now on: a run takes as much
/// in its first minute as in its last hour.
pub(crate) fn reserved<T: Clone>(value: T, count: usize) -> VecDeque<T> {
    let mut queue = VecDeque::from(vec![value; count]);
    queue.clear();
    queue
}
