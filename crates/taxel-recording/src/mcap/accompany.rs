//! A recording with messages for another program beside its own.

use std::io::{Read, Result, Write};

use super::companion::{Companion, CompanionTopic, put_channel, put_schema};
use super::message::{Message as _, TouchMessage};
use super::reader::McapReader;
use super::record::{MAGIC, code, put, put_text, put_u16, put_u32, put_u64};
use super::schemas::Topic;

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
