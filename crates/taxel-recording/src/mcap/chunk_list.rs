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

impl ChunkList {
    /// Appends a chunk that lies behind the last one.
    pub(super) fn push(&mut self, place: ChunkPlace) {
        let Neighbour { place: last, gap } = self.last;
        let gap_now = place.offset - last.end();
        self.difference(gap_now, gap);
        self.difference(place.length, last.length);
        // Times may go back.
        self.difference(place.times[0], last.times[1]);
        self.difference(place.span(), last.span());
        if place.messages == last.messages {
            self.number(0);
        } else {
            self.number(1);
            for count in place.messages {
                self.number(count);
            }
        }
        self.last = Neighbour {
            place,
            gap: gap_now,
        };
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
            let Neighbour { place: last, gap } = before;
            let gap = difference(&mut rest, gap);
            let length = difference(&mut rest, last.length);
            let begin = difference(&mut rest, last.times[1]);
            let span = difference(&mut rest, last.span());
            let messages = match number(&mut rest) {
                0 => last.messages,
                _ => std::array::from_fn(|_| number(&mut rest)),
            };
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
        let places: Vec<_> = (0..1000)
            .map(|at| {
                // A board of 1 kHz whose frames come with a jitter of 0.2 ms.
                let jitter = |of: u64| (of * 7_919_371) % 200_000;
                let begin = 1_800_000_000_000_000_000 + at * 100_000_000 + jitter(at);
                let mut messages = [0; TOPICS];
                messages[1..3].fill(100);
                let length = 58_000 + jitter(at + 1) / 500;
                // Behind each are the indexes of its messages, as long as those of the last one.
                offset += length + 3218;
                ChunkPlace {
                    offset: offset - length,
                    length,
                    times: [begin, begin + 99_000_000 + jitter(at + 2)],
                    messages,
                }
            })
            .collect();
        for place in &places {
            list.push(*place);
        }
        assert!(list.iter().eq(places));
        // 36 000 chunks an hour stay below 0.4 MiB.
        let bytes: usize = list.blocks.iter().map(Vec::len).sum();
        assert!(bytes < 11_000, "{bytes}");
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
