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
}

/// Bytes that are reserved at once: a list that grows is never moved, which would leave holes.
const BLOCK: usize = 4096;

/// The chunks of a file, packed.
#[derive(Debug, Clone, Default)]
pub(super) struct ChunkList {
    /// Blocks, all full but the last.
    blocks: Vec<Vec<u8>>,
    last: ChunkPlace,
    count: u32,
}

impl ChunkList {
    /// Appends a chunk that lies behind the last one.
    pub(super) fn push(&mut self, place: ChunkPlace) {
        self.number(place.offset - self.last.end());
        self.number(place.length);
        // Times may go back.
        self.signed(place.times[0].wrapping_sub(self.last.times[1]));
        self.number(place.times[1].wrapping_sub(place.times[0]));
        let mask = place.messages.iter().enumerate();
        self.number(mask.map(|(at, count)| u64::from(*count > 0) << at).sum());
        for count in place.messages.into_iter().filter(|count| *count > 0) {
            self.number(count);
        }
        self.last = place;
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

    /// A number that may be a little below zero, modulo 2^64.
    fn signed(&mut self, value: u64) {
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
        let mut rest = self.blocks.iter().flatten();
        let mut last = ChunkPlace::default();
        (0..self.count).map(move |_| {
            let mut number = || {
                let (mut value, mut shift) = (0, 0);
                for byte in rest.by_ref() {
                    value |= u64::from(byte & 0x7f) << shift;
                    shift += 7;
                    if *byte < 0x80 {
                        break;
                    }
                }
                value
            };
            let offset = last.end() + number();
            let length = number();
            let zigzag = number();
            let since = (zigzag >> 1) ^ (zigzag & 1).wrapping_neg();
            let begin = last.times[1].wrapping_add(since);
            let times = [begin, begin.wrapping_add(number())];
            let mask = number();
            let messages = std::array::from_fn(|at| match mask >> at & 1 {
                0 => 0,
                _ => number(),
            });
            last = ChunkPlace {
                offset,
                length,
                times,
                messages,
            };
            last
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_back_and_take_few_bytes() {
        let mut list = ChunkList::default();
        let places: Vec<_> = (0..1000)
            .map(|at| {
                let begin = 1_800_000_000_000_000_000 + at * 100_000_000;
                let mut messages = [0; TOPICS];
                messages[1..3].fill(100);
                ChunkPlace {
                    offset: 5000 + at * 60_000,
                    length: 58_000 + at,
                    times: [begin, begin + 99_000_000],
                    messages,
                }
            })
            .collect();
        for place in &places {
            list.push(*place);
        }
        assert!(list.iter().eq(places));
        // 36 000 chunks an hour stay below a megabyte.
        let bytes: usize = list.blocks.iter().map(Vec::len).sum();
        assert!(bytes < 20_000, "{bytes}");
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
