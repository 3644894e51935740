//! Which messages have come, by their running numbers: what is missing, and which chunks are
//! not of this recording.

use super::chunk_list::TOPICS;

/// First and last number of the messages of one topic in a chunk, and how many are missing
/// between them.
pub(super) type Span = Option<([u32; 2], u32)>;

/// Gaps that are kept; behind so many, what comes late is taken for foreign.
const MOST_GAPS: usize = 1000;
/// A jump ahead of more messages than this is not believed.
const FARTHEST: u32 = 1 << 28;

/// Numbers that were passed over, and the time before and after, ns.
#[derive(Debug, Clone, Copy)]
struct Gap {
    numbers: [u32; 2],
    times: [u64; 2],
}

/// Numbers of one topic.
#[derive(Debug, Clone, Default)]
struct Numbers {
    next: u32,
    gaps: Vec<Gap>,
    missing: u64,
}

/// What has come of all topics.
#[derive(Debug, Clone, Default)]
pub(super) struct Order {
    channels: [Numbers; TOPICS],
    newest: u64,
}

/// What a chunk is by its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// It continues the recording.
    Next,
    /// It belongs into a gap before.
    Late,
    /// It has come before, or is of another recording.
    Foreign,
}

impl Order {
    /// Takes a chunk with these numbers and times, ns, unless it is foreign.
    pub(super) fn take(&mut self, spans: &[Span; TOPICS], times: [u64; 2]) -> Place {
        let numbers = || {
            let pairs = self.channels.iter().zip(spans);
            pairs.filter_map(|(channel, span)| Some((channel, (*span)?)))
        };
        let ahead = numbers().all(|(channel, ([first, _], _))| {
            first >= channel.next && first - channel.next < FARTHEST
        });
        if ahead && times[0] >= self.newest {
            for (channel, span) in self.channels.iter_mut().zip(spans) {
                let Some(([first, last], inside)) = *span else {
                    continue;
                };
                channel.missing += u64::from(inside);
                if first > channel.next {
                    channel.missing += u64::from(first - channel.next);
                    if channel.gaps.len() < MOST_GAPS {
                        channel.gaps.push(Gap {
                            numbers: [channel.next, first - 1],
                            times: [self.newest, times[0]],
                        });
                    }
                }
                channel.next = last.saturating_add(1);
            }
            self.newest = times[1];
            return Place::Next;
        }
        let fits = |gap: &Gap, [first, last]: [u32; 2]| {
            gap.numbers[0] <= first
                && last <= gap.numbers[1]
                && gap.times[0] <= times[0]
                && times[1] <= gap.times[1]
        };
        let filled = numbers().all(|(channel, (span, _))| {
            let mut gaps = channel.gaps.iter();
            gaps.any(|gap| fits(gap, span))
        });
        if !filled || numbers().next().is_none() {
            return Place::Foreign;
        }
        for (channel, span) in self.channels.iter_mut().zip(spans) {
            let Some(([first, last], inside)) = *span else {
                continue;
            };
            if let Some(at) = channel.gaps.iter().position(|gap| fits(gap, [first, last])) {
                let gap = channel.gaps.swap_remove(at);
                channel.missing -= u64::from(last - first) + 1 - u64::from(inside);
                if gap.numbers[0] < first {
                    channel.gaps.push(Gap {
                        numbers: [gap.numbers[0], first - 1],
                        times: [gap.times[0], times[0]],
                    });
                }
                if last < gap.numbers[1] {
                    channel.gaps.push(Gap {
                        numbers: [last + 1, gap.numbers[1]],
                        times: [times[1], gap.times[1]],
                    });
                }
            }
        }
        Place::Late
    }

    /// Messages of each topic that are missing between others.
    pub(super) fn missing(&self) -> [u64; TOPICS] {
        std::array::from_fn(|at| self.channels[at].missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(first: u32, last: u32) -> ([Span; TOPICS], [u64; 2]) {
        let mut spans = [None; TOPICS];
        spans[1] = Some(([first, last], 0));
        (spans, [u64::from(first) * 10, u64::from(last) * 10])
    }

    fn take(order: &mut Order, first: u32, last: u32) -> Place {
        let (spans, times) = chunk(first, last);
        order.take(&spans, times)
    }

    #[test]
    fn gaps_late_and_foreign_chunks_are_distinguished() {
        let mut order = Order::default();
        assert_eq!(take(&mut order, 0, 9), Place::Next);
        assert_eq!(take(&mut order, 30, 39), Place::Next);
        assert_eq!(order.missing()[1], 20);
        assert_eq!(take(&mut order, 20, 29), Place::Late);
        assert_eq!(order.missing()[1], 10);
        // What has come is not taken again, nor what lies across it.
        assert_eq!(take(&mut order, 20, 29), Place::Foreign);
        assert_eq!(take(&mut order, 5, 15), Place::Foreign);
        assert_eq!(take(&mut order, 10, 19), Place::Late);
        assert_eq!(order.missing()[1], 0);
        // The beginning of another recording.
        assert_eq!(take(&mut order, 0, 9), Place::Foreign);
        assert_eq!(take(&mut order, 40, 49), Place::Next);
    }
}
