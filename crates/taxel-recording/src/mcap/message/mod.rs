//! The messages of a recording as plain structs.

mod operation;
mod readings;
mod touch;

pub use operation::{ClockMessage, HealthMessage, LinkMessage, MarkMessage, RECONNECTED};
pub use readings::{FrameMessage, RestKind, RestMessage, WireMessage};
pub use touch::{CertaintyMessage, ContactMessage, EventMessage, TouchMessage};

use super::cdr::{Decoder, Encoder};
use super::schemas::Topic;

/// Time that is not known.
pub const NO_TIME: u64 = u64::MAX;

/// A message of one topic.
pub trait Message: Sized {
    /// The topic that it is written to.
    const TOPIC: Topic;

    /// Device time, ns, where the message has one.
    fn device_time_ns(&self) -> Option<u64>;

    /// Appends the message in CDR.
    fn encode(&self, out: &mut Vec<u8>);

    /// The message of these bytes; `None` if they are not one.
    fn decode(bytes: &[u8]) -> Option<Self>;
}

/// `None` as the largest number.
fn time_or_none(time: Option<u64>) -> u64 {
    time.unwrap_or(NO_TIME)
}

fn known_time(time: u64) -> Option<u64> {
    (time != NO_TIME).then_some(time)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use std::fmt::Debug;

    use super::*;
    use crate::frame::{Frame, FrameFlags};

    fn comes_back<M: Message + Debug>(message: &M) {
        let mut bytes = Vec::new();
        message.encode(&mut bytes);
        let again = M::decode(&bytes).unwrap();
        // As text: NaN equals NaN.
        assert_eq!(format!("{again:?}"), format!("{message:?}"));
        // The one part that may come back is what a version without the last fields wrote.
        let parts = 0..bytes.len();
        let whole: Vec<_> = parts
            .filter(|length| M::decode(&bytes[..*length]).is_some())
            .collect();
        let extended = matches!(M::TOPIC, Topic::Touch | Topic::Events);
        assert_eq!(whole.len(), usize::from(extended), "{whole:?}");
    }

    #[test]
    fn every_message_comes_back_and_no_part_of_one_does() {
        comes_back(&WireMessage {
            utc_ns: 5,
            host_ns: 7,
            bytes: vec![1, 2, 3],
        });
        comes_back(&FrameMessage {
            utc_ns: 1_700_000_000_123_456_789,
            frame: Frame {
                host_ns: Some(8),
                sequence: 9,
                time_ns: 10,
                flags: FrameFlags::UNCHECKED_WIRE,
                values: vec![0.5, f64::NAN],
            },
        });
        let contact = ContactMessage {
            id: 3,
            force: [1.0, 2.0, f64::NAN],
            bound: Some(2),
            ..ContactMessage::default()
        };
        comes_back(&TouchMessage {
            sequence: 1,
            components: 3,
            values: vec![1.0; 6],
            states: vec![0, 2],
            contacts: vec![contact.clone(), contact],
            certainty: Some(CertaintyMessage {
                zero_known: true,
                total: 1,
                reason: Some(6),
                contacts: vec![2, 0],
            }),
            ..TouchMessage::default()
        });
        comes_back(&EventMessage {
            kind: "slip".into(),
            parent: Some(4),
            direction: Some([1.0, 0.0]),
            certainty: Some("exact".into()),
            ..EventMessage::default()
        });
        comes_back(&RestMessage {
            kind: RestKind::Captured,
            by: "page".into(),
            device_time_ns: None,
            values: vec![1.0],
            captured: vec![Some([1.0, 0.1])],
            at_end: vec![true],
            ..RestMessage::default()
        });
        comes_back(&LinkMessage::default());
        comes_back(&ClockMessage::default());
        comes_back(&HealthMessage {
            wrong: vec!["r0c0".into()],
            reasons: vec!["stuck".into()],
            ..HealthMessage::default()
        });
        comes_back(&MarkMessage {
            text: "begin — ä".into(),
            ..MarkMessage::default()
        });
    }
}
