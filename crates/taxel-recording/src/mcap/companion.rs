//! Messages for other programs that follow each touch: of types that those programs know.

use std::fmt;
use std::io::{Read, Result, Write};

use super::message::{Message as _, TouchMessage};
use super::reader::McapReader;
use super::record::{MAGIC, code, put, put_map, put_text, put_u16, put_u32, put_u64};
use super::schemas::Topic;

/// A topic of messages for another program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompanionTopic {
    /// Number of its channel, from 100 on: fixed for ever, as those of [`Topic`].
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

/// Writes the messages of a recording for another program, with those of `companion` behind each touch.
/// Stamps are UTC of this computer. Returns how many frames have such messages.
///
/// # Errors
/// Those of the recording and of `out`.
pub fn write_accompanied<R: Read>(
    mut reader: McapReader<R>,
    companion: &dyn Companion,
    library: &str,
    mut out: impl Write,
) -> Result<u64> {
    let mut records = MAGIC.to_vec();
    put(&mut records, code::HEADER, |out| {
        put_text(out, "ros2");
        put_text(out, library);
    });
    let topics = companion.topics();
    let of = |topic: Topic| CompanionTopic {
        number: topic.number(),
        name: topic.name(),
        type_name: topic.type_name(),
        encodings: ["cdr", "ros2msg"],
        definition: topic.definition(),
    };
    let own: Vec<_> = Topic::ALL.into_iter().map(of).collect();
    for topic in own.iter().chain(&topics) {
        put_schema(&mut records, topic);
        put_channel(&mut records, topic);
    }
    let mut frames = 0;
    let mut body = Vec::new();
    while let Some(entry) = reader.next()? {
        let mut message = |channel: u16, sequence: u32, bytes: &[u8]| {
            put(&mut records, code::MESSAGE, |out| {
                put_u16(out, channel);
                put_u32(out, sequence);
                put_u64(out, entry.log_time);
                put_u64(out, entry.publish_time);
                out.extend_from_slice(bytes);
            });
        };
        message(entry.topic.number(), entry.sequence, entry.bytes);
        let touch = (entry.topic == Topic::Touch).then(|| TouchMessage::decode(entry.bytes));
        if let Some(touch) = touch.flatten() {
            for (place, topic) in topics.iter().enumerate() {
                body.clear();
                companion.encode(place, &touch, entry.log_time, &mut body);
                message(topic.number, entry.sequence, &body);
            }
            frames += 1;
        }
        out.write_all(&records)?;
        records.clear();
    }
    put(&mut records, code::DATA_END, |out| put_u32(out, 0));
    put(&mut records, code::FOOTER, |out| {
        // Without a summary: readers go through the file.
        put_u64(out, 0);
        put_u64(out, 0);
        put_u32(out, 0);
    });
    records.extend_from_slice(&MAGIC);
    out.write_all(&records)?;
    Ok(frames)
}
