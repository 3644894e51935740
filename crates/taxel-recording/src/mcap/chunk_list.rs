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

/// The chunks of a file, packed.
#[derive(Debug, Clone, Default)]
pub(super) struct ChunkList {
    bytes: Vec<u8>,
    last: ChunkPlace,
    count: u32,
}

impl ChunkList {
    /// Appends a chunk that lies behind the last one.
    pub(super) fn push(&mut self, place: ChunkPlace) {
        self.number(place.offset - self.last.offset);
        self.number(place.length);
        // Times may go back.
        self.number(place.times[0].wrapping_sub(self.last.times[0]));
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
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = ChunkPlace> {
        let mut rest = self.bytes.iter();
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
            let offset = last.offset + number();
            let length = number();
            let begin = last.times[0].wrapping_add(number());
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
        assert!(list.bytes.len() < 20_000, "{}", list.bytes.len());
    }
}
