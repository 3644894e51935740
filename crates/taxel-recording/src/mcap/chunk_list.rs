//! Where the chunks of a file are, in few bytes each: a recording of a day has a million.

use super::schemas::Topic;

/// Number of channels.
pub(super) const TOPICS: usize = Topic::ALL.len();

/// A chunk that was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ChunkPlace {
    /// Offset of its record.
    pub(super) offset: u64,
    /// Bytes of its record.
    pub(super) length: u64,
    /// First and last time, ns of UTC.
    pub(super) times: [u64; 2],
    /// Messages of each topic.
    pub(super) messages: [u64; TOPICS],
}

impl ChunkPlace {
    /// Offset behind its record.
    fn end(&self) -> u64 {
        self.offset + self.length
    }

    /// Time from its first to its last message, ns.
    fn span(&self) -> u64 {
        self.times[1].wrapping_sub(self.times[0])
    }

    fn total(&self) -> u64 {
        self.messages
            .iter()
            .fold(0, |sum, of| sum.wrapping_add(*of))
    }
}

/// Bytes that are reserved at once: a list that grows is never moved, which would leave holes.
const BLOCK: usize = 4096;

/// The chunks of a file, packed: one is much like the one before, and only what differs is kept.
#[derive(Debug, Clone, Default)]
pub(super) struct ChunkList {
    /// Blocks, all full but the last.
    blocks: Vec<Vec<u8>>,
    last: Neighbour,
    count: u32,
}

/// The chunk before, and the bytes between it and the one before that.
#[derive(Debug, Clone, Copy, Default)]
struct Neighbour {
    place: ChunkPlace,
    gap: u64,
}

/// What is expected of a chunk, of which the messages are known.
struct Expected {
    gap: u64,
    length: u64,
    /// Time from the last message of the chunk before to its first one, ns.
    pause: u64,
}

/// Bytes of the index of a message.
const INDEX_ENTRY: u64 = 16;

impl Neighbour {
    /// Modulo 2^64: an expectation that is far off costs bytes, and no more.
    fn expected(&self, messages: &[u64; TOPICS]) -> Expected {
        let last = &self.place;
        let before = last.total();
        let more = messages
            .iter()
            .fold(0_u64, |sum, of| sum.wrapping_add(*of))
            .wrapping_sub(before);
        let of_each = |all: u64| all.checked_div(before).unwrap_or(0);
        // Frames are the messages that most chunks are full of.
        let most = last.messages.iter().max().copied().unwrap_or(0);
        Expected {
            gap: self.gap.wrapping_add(INDEX_ENTRY.wrapping_mul(more)),
            length: last
                .length
                .wrapping_add(of_each(last.length).wrapping_mul(more)),
            pause: last.span().checked_div(most).unwrap_or(0),
        }
    }
}

impl ChunkList {
    /// Appends a chunk that lies behind the last one.
    pub(super) fn push(&mut self, place: ChunkPlace) {
        let last = self.last.place;
        let changed = (0..TOPICS).filter(|topic| place.messages[*topic] != last.messages[*topic]);
        self.number(changed.clone().map(|topic| 1 << topic).sum());
        for topic in changed {
            self.difference(place.messages[topic], last.messages[topic]);
        }
        let expected = self.last.expected(&place.messages);
        let gap = place.offset - last.end();
        self.difference(gap, expected.gap);
        self.difference(place.length, expected.length);
        // Times may go back.
        let pause = place.times[0].wrapping_sub(last.times[1]);
        self.difference(pause, expected.pause);
        self.difference(place.span(), last.span());
        self.last = Neighbour { place, gap };
        self.count += 1;
    }

    pub(super) fn len(&self) -> u32 {
        self.count
    }

    /// Seven bits a byte.
    fn number(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.byte(value as u8 | 0x80);
            value >>= 7;
        }
        self.byte(value as u8);
    }

    /// A value that is a little above or below the one expected, modulo 2^64.
    fn difference(&mut self, value: u64, expected: u64) {
        let value = value.wrapping_sub(expected);
        self.number((value << 1) ^ (value.cast_signed() >> 63).cast_unsigned());
    }

    fn byte(&mut self, byte: u8) {
        match self.blocks.last_mut() {
            Some(block) if block.len() < BLOCK => block.push(byte),
            _ => {
                let mut block = Vec::with_capacity(BLOCK);
                block.push(byte);
                self.blocks.push(block);
            }
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = ChunkPlace> {
        let mut rest = self.blocks.iter().flatten().copied();
        let mut before = Neighbour::default();
        (0..self.count).map(move |_| {
            let last = before.place;
            let changed = number(&mut rest);
            let mut messages = last.messages;
            for (topic, count) in messages.iter_mut().enumerate() {
                if changed >> topic & 1 == 1 {
                    *count = difference(&mut rest, *count);
                }
            }
            let expected = before.expected(&messages);
            let gap = difference(&mut rest, expected.gap);
            let length = difference(&mut rest, expected.length);
            let pause = difference(&mut rest, expected.pause);
            let span = difference(&mut rest, last.span());
            let begin = last.times[1].wrapping_add(pause);
            let place = ChunkPlace {
                offset: last.end() + gap,
                length,
                times: [begin, begin.wrapping_add(span)],
                messages,
            };
            before = Neighbour { place, gap };
            place
        })
    }
}

/// Reads what [`ChunkList::number`] wrote.
fn number(bytes: &mut impl Iterator<Item = u8>) -> u64 {
    let (mut value, mut shift) = (0, 0);
    for byte in bytes {
        value |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            break;
        }
    }
    value
}

/// Reads what [`ChunkList::difference`] wrote.
fn difference(bytes: &mut impl Iterator<Item = u8>, expected: u64) -> u64 {
    let zigzag = number(bytes);
    expected.wrapping_add((zigzag >> 1) ^ (zigzag & 1).wrapping_neg())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_back_and_take_few_bytes() {
        let mut list = ChunkList::default();
        let mut offset = 5000;
        let mut time = 1_800_000_000_000_000_000;
        let places: Vec<_> = (0..1000)
            .map(|at| {
                // A board of 1 kHz whose frames come with a jitter of 0.2 ms, in chunks of 100 ms
                // or some frames more; some 5 messages of its bytes, and now and then a state of
                // the clock.
                let jitter = |of: u64| (of * 7_919_371) % 200_000;
                let frames = 100 + jitter(at) % 5;
                let mut messages = [0; TOPICS];
                messages[0] = 5 + jitter(at + 3) % 2;
                messages[1..3].fill(frames);
                messages[6] = u64::from(at % 10 == 0);
                let length = 5000 * frames + 600 * messages[0] + jitter(at + 1) / 500;
                // Behind each are the indexes of its messages.
                let place = ChunkPlace {
                    offset,
                    length,
                    times: [time, time + 1_000_000 * (frames - 1) + jitter(at + 2)],
                    messages,
                };
                offset += length + 60 + 16 * messages.iter().sum::<u64>();
                time += 1_000_000 * frames + jitter(at + 2);
                place
            })
            .collect();
        for place in &places {
            list.push(*place);
        }
        assert!(list.iter().eq(places));
        // 36 000 chunks an hour stay below 0.5 MiB.
        let bytes: usize = list.blocks.iter().map(Vec::len).sum();
        assert!(bytes < 14_500, "{bytes}");
    }

    #[test]
    fn times_may_go_back() {
        let mut list = ChunkList::default();
        let places = [[5, 9], [3, 3], [u64::MAX, 1], [0, u64::MAX]].map(|times| ChunkPlace {
            offset: 0,
            length: 0,
            times,
            messages: [0; TOPICS],
        });
        for place in places {
            list.push(place);
        }
        assert!(list.iter().eq(places));
    }
}
