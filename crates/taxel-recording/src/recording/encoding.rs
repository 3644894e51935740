//! Text in UTF-16, as spreadsheets save "Unicode text", recognised by its byte order mark or
//! by the zeros of its first letters.

use std::io::{self, BufRead};

use taxel_ground::Utf16;

/// The bytes of a file in UTF-8: its own, unless it begins with the mark of
/// UTF-16.
#[derive(Debug)]
pub(super) struct Decoded<R> {
    reader: R,
    state: State,
}

#[derive(Debug)]
enum State {
    Unknown,
    AsItIs,
    Utf16(Pieces),
}

/// Text that was decoded and is not yet read.
#[derive(Debug)]
struct Pieces {
    order: Utf16,
    text: Vec<u8>,
    read: usize,
    /// Bytes of a character whose rest is still to come.
    begun: Vec<u8>,
}

impl<R: BufRead> Decoded<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            state: State::Unknown,
        }
    }

    /// Bytes in UTF-8; none at the end.
    pub(super) fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if matches!(self.state, State::Unknown) {
            let begin = self.reader.fill_buf()?;
            self.state = if let Some(order) = Utf16::of_mark(begin) {
                self.reader.consume(Utf16::MARK);
                State::Utf16(Pieces::new(order))
            } else {
                without_mark(begin).map_or(State::AsItIs, |order| State::Utf16(Pieces::new(order)))
            };
        }
        match &mut self.state {
            State::Utf16(pieces) => pieces.fill_from(&mut self.reader),
            _ => self.reader.fill_buf(),
        }
    }

    pub(super) fn consume(&mut self, count: usize) {
        match &mut self.state {
            State::Utf16(pieces) => pieces.read += count,
            _ => self.reader.consume(count),
        }
    }
}

/// The order of the bytes of plain letters in UTF-16, of which every other one is zero.
fn without_mark(begin: &[u8]) -> Option<Utf16> {
    let (pairs, _) = begin.get(..6)?.as_chunks::<2>();
    if pairs.iter().all(|[low, high]| *low != 0 && *high == 0) {
        return Some(Utf16::Little);
    }
    let big = pairs.iter().all(|[high, low]| *low != 0 && *high == 0);
    big.then_some(Utf16::Big)
}

impl Pieces {
    fn new(order: Utf16) -> Self {
        Self {
            order,
            text: Vec::new(),
            read: 0,
            begun: Vec::new(),
        }
    }

    fn fill_from(&mut self, reader: &mut impl BufRead) -> io::Result<&[u8]> {
        while self.read == self.text.len() {
            let bytes = reader.fill_buf()?;
            let count = bytes.len();
            if count == 0 {
                break;
            }
            self.begun.extend_from_slice(bytes);
            reader.consume(count);
            let whole = self.order.whole(&self.begun);
            self.text = self.order.decode(&self.begun[..whole]).into_bytes();
            self.read = 0;
            self.begun.drain(..whole);
        }
        Ok(&self.text[self.read..])
    }
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::super::Recording;

    /// In both orders, with a sign of four bytes, read in odd pieces.
    #[test]
    fn utf_16_gives_the_same_frames() {
        let text = "# 𝛼 µ\r\ntime [s];r0c0 [kPa];r0c1 [kPa]\r\n0,00;1,5;2\r\n0,01;1,6;3\r\n";
        let units = || text.encode_utf16();
        let little: Vec<u8> = units().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = units().flat_map(u16::to_be_bytes).collect();
        let frames = |bytes: &[u8]| -> Vec<_> {
            let reader = BufReader::with_capacity(7, bytes);
            let recording = Recording::open("t.csv", reader).unwrap();
            recording.map(Result::unwrap).collect()
        };
        let expected = frames(text.as_bytes());
        assert_eq!(expected.len(), 2);
        let plain: Vec<u8> = text["# 𝛼 µ\r\n".len()..]
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        assert_eq!(frames(&plain), expected);
        assert_eq!(frames(&[&[0xff, 0xfe], &little[..]].concat()), expected);
        assert_eq!(frames(&[&[0xfe, 0xff], &big[..]].concat()), expected);
    }
}
