//! What a wire can show of its damage.

use super::description::{BuiltIn, Carrier, Framing};
use super::layout::{PacketLayout, PlacedCheck, Role};
use super::messages::{Body, MessageFormat};
use super::{Board, Counter, Format};
use crate::check::CheckKind;

/// Class of a wire: how surely damage is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// A check of 16 bits or more.
    A,
    /// A check of 8 bits, or marks and a counter.
    B,
    /// Its form only: numbers as text, stuffed bytes.
    C,
    /// Nothing: a wrong value looks like a right one.
    D,
}

impl Class {
    /// Its letter.
    pub fn letter(self) -> char {
        match self {
            Self::A => 'A',
            Self::B => 'B',
            Self::C => 'C',
            Self::D => 'D',
        }
    }

    /// What it means, for people.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::A => "damage is seen by a check of 16 bits or more",
            Self::B => "most damage is seen, by a check of 8 bits or by marks and a counter",
            Self::C => "damage is seen only where it breaks the form; a changed value is not",
            Self::D => "damage of a value is not seen",
        }
    }

    /// True if the frames of such a wire carry the flag of an unchecked one.
    pub fn is_unchecked(self) -> bool {
        self >= Self::C
    }
}

/// What a wire can and cannot detect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Its class.
    pub class: Class,
    /// Probability that a packet with one byte changed at random passes.
    pub byte_passes: f64,
    /// Whether lost frames are counted by a counter of the board, of so many numbers.
    pub counter: Option<u64>,
    /// Whether the board gives its time.
    pub clock: bool,
}

impl Board {
    /// What the wire of the board can and cannot detect.
    pub fn detection(&self) -> Detection {
        let frames = |counter: Counter| counter.frames().unwrap_or(u64::MAX);
        let counter = self.counter().map(frames);
        let (class, byte_passes) = self.class(counter.is_some());
        Detection {
            class,
            byte_passes,
            counter,
            clock: self.clock().is_some(),
        }
    }

    fn class(&self, counted: bool) -> (Class, f64) {
        let layout = match &self.format {
            Format::BuiltIn(BuiltIn::Papillarray) => return (Class::A, of_bits(16)),
            // A changed character is a wrong number more often than no number.
            Format::Lines(_) => return (if counted { Class::B } else { Class::C }, 10.0 / 256.0),
            Format::Messages(messages) => {
                if let Framing::Messages(framing) = &self.framing {
                    return of_messages(framing.carrier, messages, counted);
                }
                let layouts = messages.layouts();
                let classes = layouts.map(|layout| self.class_of(layout, counted));
                return worst(classes).unwrap_or((Class::D, 1.0));
            }
            Format::Packet(layout) => layout,
        };
        self.class_of(layout, counted)
    }

    fn class_of(&self, layout: &PacketLayout, counted: bool) -> (Class, f64) {
        if let Some(check) = &layout.check {
            return of_check(check);
        }
        let marks: usize = match &self.framing {
            Framing::Fixed(fixed) => [&fixed.head, &fixed.tail]
                .into_iter()
                .flatten()
                .map(crate::pattern::BytePattern::len)
                .sum(),
            Framing::Marked(marked) => marked.head.len() + marked.tail.len(),
            Framing::Length(length) => length.head.len() + length.kind.bits() / 8,
            _ => 0,
        };
        let status: usize = layout
            .fields
            .iter()
            .filter(|field| matches!(&field.role, Role::Status(status) if !status.good.is_empty()))
            .map(|field| field.kind.bits() / 8)
            .sum();
        let open = layout.length.saturating_sub(marks + status) as f64 / layout.length as f64;
        let stuffed = matches!(self.framing, Framing::Cobs(_) | Framing::Slip(_));
        match (marks > 0 && counted, stuffed) {
            (true, _) => (Class::B, open),
            (_, true) => (Class::C, open),
            _ => (Class::D, open),
        }
    }
}

fn of_check(check: &PlacedCheck) -> (Class, f64) {
    match (check.kind, check.kind.bytes()) {
        // One changed byte: half of the changes keep the number of ones even.
        (CheckKind::Parity, _) => (Class::B, 0.5),
        // Sums and checks of 8 bits see every change of one byte; a random packet passes one
        // time in 256.
        (_, 1) => (Class::B, of_bits(8)),
        (_, bytes) => (Class::A, of_bits(8 * bytes)),
    }
}

/// The class of the worst of its messages.
fn of_messages(carrier: Carrier, messages: &MessageFormat, counted: bool) -> (Class, f64) {
    // A changed digit is another digit more often than none.
    let digits = match carrier {
        Carrier::Can => 22.0,
        Carrier::Json => 10.0,
    };
    let unchecked = (if counted { Class::B } else { Class::C }, digits / 256.0);
    let of_body = |body: &Body| match body {
        Body::Bytes(layout) => layout.check.as_ref().map_or(unchecked, of_check),
        Body::Json(_) => unchecked,
    };
    let classes = messages
        .messages
        .iter()
        .map(|message| of_body(&message.body));
    worst(classes).unwrap_or(unchecked)
}

fn worst(mut classes: impl Iterator<Item = (Class, f64)>) -> Option<(Class, f64)> {
    let first = classes.next()?;
    Some(classes.fold(first, |worst, class| {
        (worst.0.max(class.0), worst.1.max(class.1))
    }))
}

/// Probability that a random check of so many bits is right.
fn of_bits(bits: usize) -> f64 {
    (-(bits as f64)).exp2()
}
