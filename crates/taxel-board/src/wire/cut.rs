//! Where a packet begins and ends.

use super::candidate::{Around, Candidate};
use super::packet::{self, Reading, Verdict};
use super::stuffing;
use super::{can, json, taxel_wire};
use crate::board::layout::PacketLayout;
use crate::board::{
    Board, BuiltIn, Carrier, Counted, Fixed, Format, Framing, LONGEST_PACKET, Length, Marked, Order,
};
use crate::papillarray;
use crate::pattern::BytePattern;

/// Cuts packets of bytes; lines have their own way.
#[derive(Debug, Clone)]
pub(super) struct Cutter {
    framing: Framing,
    format: Format,
    scratch: Vec<u8>,
    scan: json::Scan,
}

impl Cutter {
    pub(super) fn new(board: &Board) -> Self {
        Self {
            framing: board.framing.clone(),
            format: board.format.clone(),
            scratch: Vec::new(),
            scan: json::Scan::default(),
        }
    }

    /// Longest packet on the wire, bytes.
    pub(super) fn longest(&self) -> usize {
        match &self.framing {
            Framing::Fixed(fixed) => fixed.length,
            Framing::Marked(marked) => marked.longest.unwrap_or(LONGEST_PACKET),
            Framing::Length(length) => length.longest.unwrap_or(LONGEST_PACKET),
            Framing::Cobs(cobs) => cobs.longest(),
            Framing::Slip(stuffed) => stuffed.longest.unwrap_or(LONGEST_PACKET),
            Framing::Lines(_) | Framing::Messages(_) => match &self.format {
                Format::Lines(lines) => lines.longest,
                Format::Messages(messages) => messages.longest,
                _ => LONGEST_PACKET,
            },
        }
    }

    /// Bytes of a packet where all have as many.
    pub(super) fn fixed_length(&self) -> Option<usize> {
        match &self.framing {
            Framing::Fixed(fixed) => Some(fixed.length),
            _ => None,
        }
    }

    /// Bytes before a packet that say something of it.
    pub(super) fn looks_back(&self) -> usize {
        match &self.framing {
            Framing::Fixed(fixed) => fixed.tail.as_ref().map_or(0, BytePattern::len),
            _ => 0,
        }
    }

    pub(super) fn candidate(&mut self, around: Around<'_>) -> Candidate {
        if around.bytes.is_empty() {
            return Candidate::More;
        }
        match (&self.framing, &self.format) {
            (_, Format::BuiltIn(BuiltIn::Papillarray)) => papillarray_packet(around),
            (Framing::Messages(messages), Format::Messages(format)) => match messages.carrier {
                Carrier::Can => can::candidate(format, around),
                Carrier::Json => json::candidate(format, &mut self.scan, around),
            },
            (Framing::Fixed(fixed), format) => of_fixed(fixed, format, around),
            (Framing::Marked(marked), format) => of_marked(marked, format, around),
            (Framing::Length(length), format) => of_length(length, format, around),
            (Framing::Cobs(_), format) => {
                let longest = self.longest();
                let undo = stuffing::from_cobs;
                of_stuffed(0, undo, format, around, longest, &mut self.scratch)
            }
            (Framing::Slip(_), format) => {
                let longest = self.longest();
                let undo = stuffing::from_slip;
                let end = stuffing::SLIP_END;
                of_stuffed(end, undo, format, around, longest, &mut self.scratch)
            }
            _ => Candidate::None(1),
        }
    }

    /// What the bytes of the last candidate, which holds no reading, say to people.
    pub(super) fn text(&self, bytes: &[u8]) -> Option<String> {
        match &self.framing {
            Framing::Messages(_) => Some(String::from_utf8_lossy(bytes).into_owned()),
            Framing::Cobs(cobs) if cobs.hello => taxel_wire::text(&self.scratch),
            _ => None,
        }
    }

    /// What the last candidate, which holds no reading, says that frames hold.
    pub(super) fn hello(&self) -> Option<String> {
        match &self.framing {
            Framing::Cobs(cobs) if cobs.hello => taxel_wire::hello(&self.scratch),
            _ => None,
        }
    }

    /// Bytes of the last candidate, where it is a packet with the marks and the check of a
    /// frame and another length; and those that the fields have.
    pub(super) fn other_length(&self, bytes: &[u8]) -> Option<[usize; 2]> {
        let Format::Packet(layout) = &self.format else {
            return None;
        };
        let packet = match &self.framing {
            Framing::Cobs(_) | Framing::Slip(_) => &self.scratch,
            _ => bytes,
        };
        let frame = layout.has_marks() && packet::has_marks(layout, packet);
        frame.then_some([packet.len(), layout.length])
    }

    /// A new connection: what was begun does not go on.
    pub(super) fn reset(&mut self) {
        self.scan = json::Scan::default();
    }
}

/// Bytes to the next one that a pattern may begin with.
fn to_next(head: &BytePattern, bytes: &[u8]) -> usize {
    (1..bytes.len())
        .find(|at| head.may_begin(bytes[*at]))
        .unwrap_or(bytes.len())
}

fn of_fixed(fixed: &Fixed, format: &Format, around: Around<'_>) -> Candidate {
    let Around { bytes, .. } = around;
    if let Some(head) = &fixed.head
        && !head.may_begin(bytes[0])
    {
        return Candidate::None(to_next(head, bytes));
    }
    let Some(packet) = bytes.get(..fixed.length) else {
        return Candidate::More;
    };
    let marked = fixed.head.as_ref().is_none_or(|head| head.begins(packet))
        && fixed.tail.as_ref().is_none_or(|tail| tail.ends(packet));
    if !marked {
        return Candidate::None(1);
    }
    let Verdict::Reading(reading) = packet::read_any(format, packet) else {
        return Candidate::None(1);
    };
    let has_check = |layout: &&PacketLayout| layout.check.is_some();
    let checked = packet::layouts(format).iter().all(has_check)
        || (fixed.head.is_some() && fixed.tail.is_some());
    match (checked, &fixed.head, &fixed.tail) {
        (false, Some(head), None) => {
            // Only the head of the next shows that no byte is missing or too many.
            let behind = &bytes[fixed.length..];
            if behind.len() < head.len() && !around.last {
                return Candidate::More;
            }
            if behind.len() >= head.len() && !head.begins(behind) {
                return Candidate::None(1);
            }
        }
        (false, _, Some(tail)) => {
            let follows = around.since_packet == Some(0) || tail.ends(around.before);
            if !follows {
                // After damage: a whole number of packets behind the last one, and the next
                // one agrees.
                let whole = around
                    .since_packet
                    .is_none_or(|bytes| bytes % fixed.length as u64 == 0);
                let next = bytes.get(fixed.length..2 * fixed.length);
                match next {
                    _ if !whole => return Candidate::None(1),
                    None if !around.last => return Candidate::More,
                    Some(next) if tail.ends(next) => {}
                    _ => return Candidate::None(1),
                }
            }
        }
        _ => {}
    }
    Candidate::Reading(fixed.length, reading)
}

fn of_marked(marked: &Marked, format: &Format, around: Around<'_>) -> Candidate {
    let bytes = around.bytes;
    if !marked.head.may_begin(bytes[0]) {
        return Candidate::None(to_next(&marked.head, bytes));
    }
    if bytes.len() < marked.head.len() {
        return Candidate::More;
    }
    if !marked.head.begins(bytes) {
        return Candidate::None(1);
    }
    let longest = marked.longest.unwrap_or(LONGEST_PACKET);
    let tail = marked.tail.len();
    // The lengths that the fields have come first.
    let layouts = packet::layouts(format);
    for layout in &layouts {
        if let Some(packet) = bytes.get(..layout.length)
            && marked.tail.ends(packet)
            && let Verdict::Reading(reading) = packet::read_any(format, packet)
        {
            return Candidate::Reading(layout.length, reading);
        }
    }
    let length = layouts
        .iter()
        .map(|layout| layout.length)
        .max()
        .unwrap_or(0);
    let checked = layouts.iter().all(|layout| layout.check.is_some());
    let first = marked.head.len() + tail;
    for end in first..=longest.min(bytes.len()) {
        let packet = &bytes[..end];
        if marked.tail.ends(packet) && checked && packet::read_any(format, packet) == Verdict::Other
        {
            return Candidate::Other(end);
        }
    }
    // A packet of another length may still come to its end, if there is a check to show it.
    let open = if checked { longest } else { length };
    // Once the known length is there and is wrong, a whole packet behind another head shows
    // that this one does not come to its end.
    let next_head = (marked.head.len()..bytes.len())
        .find(|at| marked.head.begins(&bytes[*at..]))
        .is_some_and(|at| bytes.len() >= at + length);
    if bytes.len() < open && !around.last && !(bytes.len() >= length && next_head) {
        return Candidate::More;
    }
    Candidate::None(1)
}

fn of_length(length: &Length, format: &Format, around: Around<'_>) -> Candidate {
    let bytes = around.bytes;
    // Packets of several kinds have their length and check alike.
    let layouts = packet::layouts(format);
    let Some(layout) = layouts.first() else {
        return Candidate::None(1);
    };
    if !length.head.may_begin(bytes[0]) {
        return Candidate::None(to_next(&length.head, bytes));
    }
    let size = length.kind.bits() / 8;
    let behind = length.at + size;
    if bytes.len() < behind {
        let begun = bytes.len().min(length.head.len());
        return if begun == length.head.len() && !length.head.begins(bytes) {
            Candidate::None(1)
        } else {
            Candidate::More
        };
    }
    if !length.head.begins(bytes) {
        return Candidate::None(1);
    }
    let order = length.order.unwrap_or(match layout.fields.first() {
        Some(field) => field.order,
        None => Order::Little,
    });
    let said = order.join(&bytes[length.at..behind]) as usize;
    let check = layout.check.as_ref().map_or(0, |check| check.from_end);
    let whole = match length.counts {
        Counted::All => said,
        Counted::Rest => behind.saturating_add(said),
        Counted::Payload => behind.saturating_add(said).saturating_add(check),
    };
    if whole < behind || whole > length.longest.unwrap_or(LONGEST_PACKET) {
        return Candidate::None(1);
    }
    let Some(packet) = bytes.get(..whole) else {
        return Candidate::More;
    };
    match packet::read_any(format, packet) {
        Verdict::Reading(reading) => Candidate::Reading(whole, reading),
        Verdict::Other => Candidate::Other(whole),
        Verdict::Damaged => Candidate::None(1),
    }
}

fn of_stuffed(
    end: u8,
    undo: fn(&[u8], &mut Vec<u8>) -> Option<()>,
    format: &Format,
    around: Around<'_>,
    longest: usize,
    scratch: &mut Vec<u8>,
) -> Candidate {
    let bytes = around.bytes;
    let within = &bytes[..bytes.len().min(longest)];
    let Some(at) = within.iter().position(|byte| *byte == end) else {
        return if bytes.len() >= longest {
            Candidate::Damaged(longest)
        } else {
            Candidate::More
        };
    };
    if at == 0 {
        // Between two ends, or before the first.
        return Candidate::Blank(1);
    }
    if undo(&bytes[..at], scratch).is_none() {
        return Candidate::Damaged(at + 1);
    }
    match packet::read_any(format, scratch) {
        Verdict::Reading(reading) => Candidate::Reading(at + 1, reading),
        Verdict::Other => Candidate::Other(at + 1),
        Verdict::Damaged => Candidate::Damaged(at + 1),
    }
}

fn papillarray_packet(around: Around<'_>) -> Candidate {
    let bytes = around.bytes;
    if bytes[0] != papillarray::HEAD[0] {
        let next = (1..bytes.len()).find(|at| bytes[*at] == papillarray::HEAD[0]);
        return Candidate::None(next.unwrap_or(bytes.len()));
    }
    let begun = bytes.len().min(papillarray::HEAD.len());
    if bytes[..begun] != papillarray::HEAD[..begun] {
        return Candidate::None(1);
    }
    let tail = papillarray::TAIL;
    for end in 8..=papillarray::LONGEST.min(bytes.len()) {
        if bytes[..end].ends_with(&tail)
            && let Some(found) = papillarray::read(&bytes[..end])
        {
            return Candidate::Reading(
                end,
                Reading {
                    values: found.values,
                    sequence: Some(found.sequence),
                    time: Some(found.time as f64),
                    ..Reading::default()
                },
            );
        }
    }
    // A packet behind this one shows that this one is broken.
    let next =
        (4..bytes.len().saturating_sub(3)).find(|at| bytes[*at..].starts_with(&papillarray::HEAD));
    let given_up = next.is_some_and(|next| bytes.len() >= next + papillarray::LONGEST / 4);
    if bytes.len() < papillarray::LONGEST && !around.last && !given_up {
        return Candidate::More;
    }
    Candidate::None(1)
}
