//! One whole packet: marks, check, status, ranges, values.

use crate::board::layout::{PacketLayout, Role};

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
                let range = layout.address.map(|range| (range.first, range.count));
                let (first, count) = range.unwrap_or((0, 1));
                match usize::try_from(address - first) {
                    Ok(address) if address < count => {
                        reading.slot = address;
                        reading.first = address * layout.values;
                    }
                    _ => return Verdict::Damaged,
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
