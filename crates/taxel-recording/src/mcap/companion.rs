//! Messages for other programs that follow each touch: of types that those programs know.

use std::fmt;

use super::message::TouchMessage;
use super::record::{code, put, put_map, put_text, put_u16};

/// A topic of messages for another program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompanionTopic {
    /// Number of its channel, from 100 on: fixed for ever, as those of [`super::Topic`].
    pub number: u16,
    /// Its name, one of those that a recording may have.
    pub name: &'static str,
    /// Name of the type of its messages.
    pub type_name: &'static str,
    /// Encoding of its messages, and of the definition: `cdr` and `ros2msg`, or `json` and `jsonschema`.
    pub encodings: [&'static str; 2],
    /// Definition of the type with those that it uses.
    pub definition: String,
}

/// What makes the messages of another program of a touch: one of each topic.
pub trait Companion: fmt::Debug + Send + Sync {
    /// Its topics.
    fn topics(&self) -> Vec<CompanionTopic>;

    /// Appends the message of the topic at `place` for a touch at this time of this computer, ns of UTC.
    fn encode(&self, place: usize, touch: &TouchMessage, utc_ns: u64, out: &mut Vec<u8>);
}

/// Appends the schema of a topic.
pub(super) fn put_schema(out: &mut Vec<u8>, topic: &CompanionTopic) {
    put(out, code::SCHEMA, |out| {
        put_u16(out, topic.number);
        put_text(out, topic.type_name);
        put_text(out, topic.encodings[1]);
        put_text(out, &topic.definition);
    });
}

/// Appends the channel of a topic.
pub(super) fn put_channel(out: &mut Vec<u8>, topic: &CompanionTopic) {
    put(out, code::CHANNEL, |out| {
        put_u16(out, topic.number);
        put_u16(out, topic.number);
        put_text(out, topic.name);
        put_text(out, topic.encodings[0]);
        put_map(out, &[]);
    });
}
