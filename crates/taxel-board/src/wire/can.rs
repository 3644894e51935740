//! CAN messages as text: SLCAN, and what `candump` prints.

use std::io::Write as _;

use super::candidate::{Around, Candidate};
use super::packet::{self, Reading, Verdict};
use crate::board::Id;
use crate::board::messages::{
    Body, LARGEST_STANDARD_ID, MOST_CAN_BYTES, MessageFormat, MessageLayout,
};

/// The bell is the answer of an adapter that refuses.
const BELL: u8 = 0x07;
/// Hexadecimal digits of the time that an adapter may put behind a message.
const TIME_DIGITS: usize = 4;

/// A CAN message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct CanMessage {
    id: u64,
    extended: bool,
    data: [u8; MOST_CAN_BYTES],
    length: usize,
}

/// What a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Message(CanMessage),
    /// Begins as a message, and is none.
    Damaged,
    /// Anything else: an answer of the adapter, a request for a message.
    Other,
}

/// The line that stands at a place of the buffer.
pub(super) fn candidate(format: &MessageFormat, around: Around<'_>) -> Candidate {
    let bytes = around.bytes;
    let is_end = |byte: &u8| matches!(*byte, b'\r' | b'\n' | BELL);
    let ends = bytes.iter().take_while(|byte| is_end(byte)).count();
    if ends > 0 {
        return Candidate::Blank(ends);
    }
    let within = &bytes[..bytes.len().min(format.longest)];
    let (length, whole) = match within.iter().position(is_end) {
        Some(end) => (end, end + 1),
        None if bytes.len() >= format.longest => return Candidate::Damaged(format.longest),
        None if around.last => (bytes.len(), bytes.len()),
        None => return Candidate::More,
    };
    match parse(&bytes[..length]) {
        Line::Other => Candidate::Other(whole),
        Line::Damaged => Candidate::Damaged(whole),
        Line::Message(message) => match read(format, &message) {
            Verdict::Reading(reading) => Candidate::Reading(whole, reading),
            Verdict::Other => Candidate::Other(whole),
            Verdict::Damaged => Candidate::Damaged(whole),
        },
    }
}

fn parse(line: &[u8]) -> Line {
    match line.first() {
        Some(b't') => slcan(&line[1..], 3).map_or(Line::Damaged, Line::Message),
        Some(b'T') => slcan(&line[1..], 8).map_or(Line::Damaged, Line::Message),
        _ => candump(line).map_or(Line::Other, Line::Message),
    }
}

/// `71380081f679d0753c00`: the id, the number of bytes, the bytes, and perhaps a time.
fn slcan(text: &[u8], id_digits: usize) -> Option<CanMessage> {
    let (id, rest) = text.split_at_checked(id_digits)?;
    let (length, data) = rest.split_at_checked(1)?;
    let length = number(length)? as usize;
    let timed = data.len() == 2 * length + TIME_DIGITS;
    if timed {
        number(&data[2 * length..])?;
    } else if data.len() != 2 * length {
        return None;
    }
    message(number(id)?, id_digits > 3, &[&data[..2 * length]])
}

/// `(1436509052.249713) can0 713#0081F679D0753C00` or `can0  713   [8]  00 81 F6 79`.
fn candump(line: &[u8]) -> Option<CanMessage> {
    let mut words = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .peekable();
    let stamped = words.next_if(|word| word.starts_with(b"(")).is_some();
    // The name of the interface.
    words.next()?;
    let word = words.next()?;
    if let Some(hash) = word.iter().position(|byte| *byte == b'#') {
        let (id, data) = word.split_at(hash);
        return (stamped && words.next().is_none_or(|direction| direction.len() == 1))
            .then(|| message(number(id)?, id.len() > 3, &[&data[1..]]))?;
    }
    let length = words.next()?.strip_prefix(b"[")?.strip_suffix(b"]")?;
    let data: Vec<&[u8]> = words.take(MOST_CAN_BYTES + 1).collect();
    let whole = number(length)? as usize == data.len() && data.iter().all(|byte| byte.len() == 2);
    whole.then(|| message(number(word)?, word.len() > 3, &data))?
}

/// A message of pairs of digits.
fn message(id: u64, extended: bool, digits: &[&[u8]]) -> Option<CanMessage> {
    let mut message = CanMessage {
        id,
        extended,
        data: [0; MOST_CAN_BYTES],
        length: 0,
    };
    for pair in digits.iter().flat_map(|digits| digits.chunks(2)) {
        if pair.len() != 2 {
            return None;
        }
        *message.data.get_mut(message.length)? = number(pair)? as u8;
        message.length += 1;
    }
    (extended || id <= LARGEST_STANDARD_ID).then_some(message)
}

/// A hexadecimal number of 1 to 8 digits.
fn number(digits: &[u8]) -> Option<u64> {
    if digits.is_empty() || digits.len() > 8 {
        return None;
    }
    digits.iter().try_fold(0, |number, digit| {
        let digit = char::from(*digit).to_digit(16)?;
        Some(number << 4 | u64::from(digit))
    })
}

/// What a message says: other, where none with its id, length and marks is described.
fn read(format: &MessageFormat, message: &CanMessage) -> Verdict {
    let mut verdict = Verdict::Other;
    for layout in &format.messages {
        let is = |id: &Id| *id == Id::Number(message.id);
        let number = layout.ids.iter().position(is);
        let (Some(number), Body::Bytes(packet)) = (number, &layout.body) else {
            continue;
        };
        let fits = layout.length.is_none_or(|length| length == message.length)
            && layout.extended == message.extended;
        let data = message.data[..message.length].get(..packet.length);
        let Some(data) = data.filter(|data| fits && packet::has_marks(packet, data)) else {
            continue;
        };
        verdict = match packet::read(packet, data) {
            Verdict::Reading(reading) => return Verdict::Reading(placed(reading, layout, number)),
            _ => Verdict::Damaged,
        };
    }
    verdict
}

/// The reading of the message of this number of its kind.
fn placed(mut reading: Reading, layout: &MessageLayout, number: usize) -> Reading {
    let slot = number * layout.addresses + reading.slot;
    reading.slot = layout.first_slot + slot;
    reading.first = layout.first_value + slot * layout.values;
    reading
}

/// Appends a message in SLCAN.
pub(super) fn write(id: u64, extended: bool, data: &[u8], out: &mut Vec<u8>) {
    let written = if extended {
        write!(out, "T{id:08x}{}", data.len())
    } else {
        write!(out, "t{id:03x}{}", data.len())
    };
    debug_assert!(written.is_ok(), "memory takes all");
    for byte in data {
        let written = write!(out, "{byte:02x}");
        debug_assert!(written.is_ok(), "memory takes all");
    }
    out.push(b'\r');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_messages_damaged_or_other() {
        let of = |line: &str| parse(line.as_bytes());
        let data = [0x00, 0x81, 0xf6, 0x79, 0xd0, 0x75, 0x3c, 0x00];
        let xela = Line::Message(CanMessage {
            id: 0x713,
            extended: false,
            data,
            length: 8,
        });
        for line in [
            "t71380081f679d0753c00",
            "t71380081F679D0753C001234",
            "(1436509052.249713) can0 713#0081F679D0753C00",
            "(1436509052.249713) can0 713#0081F679D0753C00 R",
            "  can0  713   [8]  00 81 F6 79 D0 75 3C 00",
        ] {
            assert_eq!(of(line), xela, "{line}");
        }
        let extended = of("T000007132abcd");
        assert!(
            matches!(
                extended,
                Line::Message(CanMessage {
                    id: 0x713,
                    extended: true,
                    length: 2,
                    ..
                })
            ),
            "{extended:?}"
        );
        for line in [
            "t",
            "t713",
            "t7139",
            "t71380081f679d0753c0",
            "tzzz0",
            "t8000",
            "T0000071",
        ] {
            assert_eq!(of(line), Line::Damaged, "{line}");
        }
        for line in [
            "",
            "z",
            "V1013",
            "r7138",
            "713#00",
            "(1) can0 713##100",
            "(1) can0 713#R",
            "can0 713 [8] 00 81",
        ] {
            assert_eq!(of(line), Line::Other, "{line}");
        }
    }
}
