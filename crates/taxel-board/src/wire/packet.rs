//! One whole packet: marks, check, status, ranges, values.

use crate::board::Format;
use crate::board::layout::{PacketLayout, Role};
use crate::board::messages::{Body, MessageLayout};

/// What a packet says.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Reading {
    /// Values of the packet, SI.
    pub(super) values: Vec<f64>,
    pub(super) sequence: Option<u64>,
    /// Steps of the board's clock; whole for a clock of a whole type.
    pub(super) time: Option<f64>,
    /// Which packet or message of a frame, from 0.
    pub(super) slot: usize,
    /// Place of its first value in the frame.
    pub(super) first: usize,
    /// True if its status is not good: it is numbered, and not delivered.
    pub(super) bad_status: bool,
    /// Number and time of each frame of a message of several, where they have their own.
    pub(super) each: Vec<(Option<u64>, Option<f64>)>,
}

impl Reading {
    /// As that of the message of this number of its kind.
    pub(super) fn placed(mut self, message: &MessageLayout, number: usize) -> Self {
        let slot = number * message.addresses + self.slot;
        self.slot = message.first_slot + slot;
        self.first = message.first_value + slot * message.values;
        self
    }
}

/// A packet that was looked at.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Verdict {
    Reading(Reading),
    /// Whole, with another length.
    Other,
    Damaged,
}

/// True if the bytes that tell a packet from others stand in `packet`.
pub(super) fn has_marks(layout: &PacketLayout, packet: &[u8]) -> bool {
    layout.fields.iter().all(|field| match &field.role {
        Role::Mark(bytes) => packet
            .get(field.bit / 8..)
            .is_some_and(|rest| bytes.begins(rest)),
        _ => true,
    })
}

/// The layouts of a packet: one, or those of several kinds.
pub(super) fn layouts(format: &Format) -> Vec<&PacketLayout> {
    match format {
        Format::Packet(layout) => vec![layout],
        Format::Messages(messages) => messages.layouts().collect(),
        Format::Lines(_) | Format::BuiltIn(_) => Vec::new(),
    }
}

/// What a packet says, of whichever kind it is.
pub(super) fn read_any(format: &Format, packet: &[u8]) -> Verdict {
    let messages = match format {
        Format::Packet(layout) => return read(layout, packet),
        Format::Messages(format) => format.messages.iter(),
        Format::Lines(_) | Format::BuiltIn(_) => return Verdict::Damaged,
    };
    let mut verdict = Verdict::Damaged;
    for message in messages {
        let Body::Bytes(layout) = &message.body else {
            continue;
        };
        match read(layout, packet) {
            Verdict::Reading(reading) => return Verdict::Reading(reading.placed(message, 0)),
            Verdict::Other => verdict = Verdict::Other,
            Verdict::Damaged => {}
        }
    }
    verdict
}

pub(super) fn read(layout: &PacketLayout, packet: &[u8]) -> Verdict {
    match &layout.check {
        Some(check) if !check.holds(packet, layout.length) => return Verdict::Damaged,
        Some(_) if packet.len() != layout.length => return Verdict::Other,
        None if packet.len() != layout.length => return Verdict::Damaged,
        _ => {}
    }
    let mut reading = Reading {
        values: vec![f64::NAN; layout.values],
        ..Reading::default()
    };
    for field in &layout.fields {
        match &field.role {
            Role::Value(place, conversion) => {
                let number = field.number(packet);
                let value = if number.is_nan() {
                    Some(f64::NAN)
                } else {
                    conversion.value(number)
                };
                let Some(value) = value else {
                    return Verdict::Damaged;
                };
                reading.values[*place] = value;
            }
            Role::Sequence(_) => reading.sequence = Some(field.whole(packet)),
            Role::Time(_) => {
                let time = field.number(packet);
                if !time.is_finite() {
                    return Verdict::Damaged;
                }
                reading.time = Some(time);
            }
            Role::Status(status) => {
                reading.bad_status |=
                    !status.good.is_empty() && !status.good.contains(&field.whole(packet));
            }
            Role::Address => {
                let address = field.number(packet) as i64;
                match layout.address.and_then(|range| range.slot(address)) {
                    Some(slot) => {
                        reading.slot = slot;
                        reading.first = slot * layout.values;
                    }
                    None => return Verdict::Damaged,
                }
            }
            Role::Mark(bytes) => {
                if !bytes.begins(&packet[field.bit / 8..]) {
                    return Verdict::Damaged;
                }
            }
        }
    }
    Verdict::Reading(reading)
}
