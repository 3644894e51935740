//! CAN messages as text: SLCAN, and what `candump` prints.

use std::io::Write as _;

use super::candidate::{Around, Candidate};
use super::packet::{self, Verdict};
use crate::board::Id;
use crate::board::messages::{
    Body, LARGEST_STANDARD_ID, MOST_CAN_BYTES, MOST_CLASSICAL, MessageFormat,
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
    let of_slcan = |id_digits, flexible| {
        slcan(&line[1..], id_digits, flexible).map_or(Line::Damaged, Line::Message)
    };
    match line.first() {
        Some(b't') => of_slcan(3, false),
        Some(b'T') => of_slcan(8, false),
        Some(b'd' | b'b') => of_slcan(3, true),
        Some(b'D' | b'B') => of_slcan(8, true),
        _ => candump(line).map_or(Line::Other, Line::Message),
    }
}

/// Bytes of a message by the code of its length.
const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// `71380081f679d0753c00`: the id, the code of the length, the bytes, and perhaps a time;
/// `flexible` for CAN FD.
fn slcan(text: &[u8], id_digits: usize, flexible: bool) -> Option<CanMessage> {
    let (id, rest) = text.split_at_checked(id_digits)?;
    let (code, data) = rest.split_at_checked(1)?;
    let length = *LENGTHS.get(number(code)? as usize)?;
    if length > MOST_CLASSICAL && !flexible {
        return None;
    }
    let timed = data.len() == 2 * length + TIME_DIGITS;
    if timed {
        number(&data[2 * length..])?;
    } else if data.len() != 2 * length {
        return None;
    }
    message(number(id)?, id_digits > 3, &[&data[..2 * length]])
}

/// A line of `candump`: `can0  713   [8]  00 81 F6 79`, behind it with `-a` the characters in
/// quotes, before the id with `-x` a direction and flags, before all with `-t` a time in brackets,
/// of `-tA` with a blank in it. Of `candump -L` `(1436509052.249713) can0 713#0081F679D0753C00`,
/// of CAN FD `713##1` and the bytes.
fn candump(line: &[u8]) -> Option<CanMessage> {
    let line = line.trim_ascii_start();
    let time = line
        .strip_prefix(b"(")
        .map(|rest| rest.iter().position(|byte| *byte == b')'));
    let (stamped, line) = match time {
        Some(end) => (true, &line[end? + 2..]),
        None => (false, line),
    };
    let mut words = line
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .peekable();
    // The name of the interface.
    words.next()?;
    if words
        .next_if(|word| matches!(*word, b"RX" | b"TX"))
        .is_some()
    {
        let flags = [words.next()?, words.next()?];
        flags
            .iter()
            .all(|flag| matches!(*flag, b"-" | b"B" | b"E"))
            .then_some(())?;
    }
    let word = words.next()?;
    if let Some(hash) = word.iter().position(|byte| *byte == b'#') {
        let (id, data) = word.split_at(hash);
        let flexible = data.get(1) == Some(&b'#');
        if flexible {
            // A digit of flags.
            number(data.get(2..3)?)?;
        }
        let data = &data[if flexible { 3 } else { 1 }..];
        let whole = flexible || data.len() <= 2 * MOST_CLASSICAL;
        return (stamped && whole && words.next().is_none_or(|direction| direction.len() == 1))
            .then(|| message(number(id)?, id.len() > 3, &[data]))?;
    }
    let length = words.next()?.strip_prefix(b"[")?.strip_suffix(b"]")?;
    let length: usize = std::str::from_utf8(length).ok()?.parse().ok()?;
    let data: Vec<&[u8]> = words.by_ref().take(length.min(MOST_CAN_BYTES)).collect();
    let whole = length == data.len()
        && data.iter().all(|byte| byte.len() == 2)
        && words.next().is_none_or(|rest| rest.starts_with(b"'"));
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
            Verdict::Reading(reading) => return Verdict::Reading(reading.placed(layout, number)),
            _ => Verdict::Damaged,
        };
    }
    verdict
}

/// Appends a message in SLCAN; one of more than 8 bytes is filled up with zeros to a length that
/// CAN FD has.
pub(super) fn write(id: u64, extended: bool, data: &[u8], out: &mut Vec<u8>) {
    let (code, length) = LENGTHS
        .into_iter()
        .enumerate()
        .find(|(_, length)| *length >= data.len())
        .unwrap_or((LENGTHS.len() - 1, MOST_CAN_BYTES));
    let kind = match (extended, length > MOST_CLASSICAL) {
        (false, false) => 't',
        (true, false) => 'T',
        (false, true) => 'd',
        (true, true) => 'D',
    };
    let digits = if extended { 8 } else { 3 };
    let written = write!(out, "{kind}{id:0digits$x}{code:x}");
    debug_assert!(written.is_ok(), "memory takes all");
    for place in 0..length {
        let byte = data.get(place).copied().unwrap_or(0);
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
        let mut data = [0; MOST_CAN_BYTES];
        data[..8].copy_from_slice(&[0x00, 0x81, 0xf6, 0x79, 0xd0, 0x75, 0x3c, 0x00]);
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
            "  can0  713   [8]  00 81 F6 79 D0 75 3C 00   '...y.u<.'",
            "  can0  713   [8]  00 81 F6 79 D0 75 3C 00   '. ]y '<.'",
            "  can0  RX - -  713   [8]  00 81 F6 79 D0 75 3C 00",
            "  can0  TX B E  713   [8]  00 81 F6 79 D0 75 3C 00   '...y.u<.'",
            " (2026-11-28 17:30:00.123456)  can0  713   [8]  00 81 F6 79 D0 75 3C 00",
            " (1436509052.249713)  can0  RX - -  713   [8]  00 81 F6 79 D0 75 3C 00",
            " (000.010023)  can0  713   [8]  00 81 F6 79 D0 75 3C 00",
            "(1436509052.249713) can0 713##10081F679D0753C00",
            "  can0  713  [08]  00 81 F6 79 D0 75 3C 00",
            "d71380081f679d0753c00",
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
            "t7139000102030405060708090a0b",
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
            "(1) can0 713##",
            "(1) can0 713#000102030405060708",
            "(2026-11-28 17:30:00 can0 713#00",
            "can0 RX 713 [1] 00",
            "can0 713 [1] 00 01",
            "can0 713 [0] remote request",
            "can0 20000004 [1] 00 ERRORFRAME",
            "(1) can0 713#R",
            "can0 713 [8] 00 81",
        ] {
            assert_eq!(of(line), Line::Other, "{line}");
        }
    }

    #[test]
    fn messages_of_can_fd_have_up_to_64_bytes() {
        let twelve = "000102030405060708090a0b";
        let spaced = "00 01 02 03 04 05 06 07 08 09 0A 0B";
        let mut written = Vec::new();
        write(
            0x123,
            false,
            &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
            &mut written,
        );
        assert_eq!(written, format!("d1239{twelve}\r").as_bytes());
        for line in [
            format!("d1239{twelve}"),
            format!("b1239{twelve}1234"),
            format!("(1.5) can0 123##1{twelve}"),
            format!("  can0  123  [12]  {spaced}"),
            format!(" (2026-11-28 17:30:00.1)  can0  RX B -  123  [12]  {spaced}   '............'"),
        ] {
            let Line::Message(message) = parse(line.as_bytes()) else {
                panic!("{line}");
            };
            assert_eq!((message.id, message.length), (0x123, 12), "{line}");
            assert!((0..12).all(|n| usize::from(message.data[n]) == n), "{line}");
        }
        // Ten bytes go as twelve.
        written.clear();
        write(0x1234_5678, true, &[1; 10], &mut written);
        assert!(written.starts_with(b"D123456789"), "{written:?}");
        assert_eq!(written.len(), 1 + 8 + 1 + 24 + 1);
    }
}
