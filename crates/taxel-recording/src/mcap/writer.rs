//! Writes a recording: small chunks without compression, each with its CRC, none before it
//! is whole.

use std::io::{Error, ErrorKind, Result};
use std::sync::Arc;

use super::chunk_list::{ChunkList, ChunkPlace, TOPICS};
use super::companion::{Companion, CompanionTopic, put_channel, put_schema};
use super::message::{Message, TouchMessage};
use super::record::{
    Attachment, HEAD, LARGEST, MAGIC, Metadata, code, put, put_map, put_text, put_u16, put_u32,
    put_u64,
};
use super::schemas::Topic;
use super::storage::Storage;
use crate::check::crc32;

/// A chunk is written when it has so many bytes.
const CHUNK: usize = 1 << 20;
/// Schemas and channels are repeated after so much time, ns, so that a file without its
/// beginning can still be read by any program.
const REPEATED_NS: u64 = 10_000_000_000;

/// What stands at the beginning of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordingHead {
    /// Program and version.
    pub library: String,
    /// When it was begun, ns of UTC.
    pub utc_ns: u64,
    /// Meaning of the raw frames, see [`described_stream`](crate::described_stream).
    pub description: String,
    /// Sensor, calibration and other files.
    pub attachments: Vec<Attachment>,
    /// Command line, version, hashes.
    pub metadata: Vec<Metadata>,
}

/// Time and number of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    pub(super) topic: Topic,
    /// Running number in its topic.
    pub(super) sequence: u32,
    /// ns of UTC.
    pub(super) log_time: u64,
    pub(super) publish_time: u64,
}

/// Name of the attachment with the meaning of the frames.
pub(super) const DESCRIPTION: &str = "channels.csv";
/// Key of the same in the channel of the frames.
pub(super) const DESCRIPTION_KEY: &str = "channels";

/// Writes messages into chunks.
///
/// Nothing of a chunk is written before [`McapWriter::flush`], which writes all of it at once, or
/// before it has 1 MiB. After an error the file is cut to its last whole chunk, and every
/// call fails.
///
/// # Example
/// ```
/// use taxel_recording::mcap::{RecordingHead, MarkMessage, McapWriter};
///
/// let mut writer = McapWriter::new(Vec::new(), &RecordingHead::default())?;
/// let mark = MarkMessage { text: "begin".into(), ..MarkMessage::default() };
/// writer.message(1_800_000_000_000_000_000, &mark)?;
/// let file = writer.finish()?;
/// assert!(file.starts_with(&taxel_recording::mcap::MAGIC));
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct McapWriter<S: Storage> {
    storage: S,
    /// Bytes that are written and whole.
    written: u64,
    failed: bool,
    /// Records of the chunk that is filled.
    records: Vec<u8>,
    open: ChunkPlace,
    /// Time and place in the chunk of the messages of each topic.
    indices: [Vec<(u64, u64)>; TOPICS],
    scratch: Vec<u8>,
    out: Vec<u8>,
    chunks: ChunkList,
    sequences: [u32; TOPICS],
    messages: [u64; TOPICS],
    times: Option<[u64; 2]>,
    description: String,
    described: Option<u64>,
    companion: Option<Arc<dyn Companion>>,
    /// Its topics: each has a message for each touch, so that their numbers are those of the touches.
    accompanying: Vec<CompanionTopic>,
    /// Time and place in the chunk of the messages of each of them.
    their_indices: Vec<Vec<(u64, u64)>>,
    /// Index records of attachments and metadata.
    attachments: Vec<u8>,
    metadata: Vec<u8>,
    counts: [u32; 2],
}

impl<S: Storage> McapWriter<S> {
    /// Writes the head of a recording.
    ///
    /// # Errors
    /// Those of `storage`; [`ErrorKind::InvalidInput`] for a file that is too large to be
    /// part of a recording.
    pub fn new(storage: S, head: &RecordingHead) -> Result<Self> {
        let mut writer = Self {
            storage,
            written: 0,
            failed: false,
            records: Vec::with_capacity(CHUNK + CHUNK / 4),
            open: ChunkPlace::default(),
            indices: Default::default(),
            scratch: Vec::new(),
            out: Vec::new(),
            chunks: ChunkList::default(),
            sequences: [0; TOPICS],
            messages: [0; TOPICS],
            times: None,
            description: head.description.clone(),
            described: None,
            companion: None,
            accompanying: Vec::new(),
            their_indices: Vec::new(),
            attachments: Vec::new(),
            metadata: Vec::new(),
            counts: [0; 2],
        };
        let out = &mut writer.out;
        out.extend_from_slice(&MAGIC);
        put(out, code::HEADER, |out| {
            put_text(out, "ros2");
            put_text(out, &head.library);
        });
        let description = Attachment {
            name: DESCRIPTION.into(),
            media_type: "text/csv".into(),
            bytes: head.description.clone().into_bytes(),
        };
        for attachment in [&description].into_iter().chain(&head.attachments) {
            writer.attach(attachment, head.utc_ns)?;
        }
        for metadata in &head.metadata {
            writer.note(metadata);
        }
        writer.put_out()?;
        Ok(writer)
    }

    /// The same writer, which adds the messages of `companion` to each touch; they are no part of what is read
    /// again, repaired or cut.
    #[must_use]
    pub fn accompanied(mut self, companion: Option<Arc<dyn Companion>>) -> Self {
        self.accompanying = companion
            .as_ref()
            .map_or_else(Vec::new, |companion| companion.topics());
        self.their_indices = vec![Vec::new(); self.accompanying.len()];
        self.companion = companion;
        self
    }

    fn attach(&mut self, attachment: &Attachment, utc_ns: u64) -> Result<()> {
        let Attachment {
            name,
            media_type,
            bytes,
        } = attachment;
        if bytes.len() > LARGEST / 2 {
            return Err(Error::new(
                ErrorKind::InvalidInput,
                format!(
                    "{name} has {} bytes; a file of at most {} can be part of a recording",
                    bytes.len(),
                    LARGEST / 2
                ),
            ));
        }
        let offset = self.out.len() as u64;
        let length = put(&mut self.out, code::ATTACHMENT, |out| {
            let begin = out.len();
            put_u64(out, utc_ns);
            put_u64(out, utc_ns);
            put_text(out, name);
            put_text(out, media_type);
            put_u64(out, bytes.len() as u64);
            out.extend_from_slice(bytes);
            let check = crc32(&out[begin..]);
            put_u32(out, check);
        });
        put(&mut self.attachments, code::ATTACHMENT_INDEX, |out| {
            for number in [offset, length as u64, utc_ns, utc_ns, bytes.len() as u64] {
                put_u64(out, number);
            }
            put_text(out, name);
            put_text(out, media_type);
        });
        self.counts[0] += 1;
        Ok(())
    }

    fn note(&mut self, metadata: &Metadata) {
        let offset = self.out.len() as u64;
        let length = put(&mut self.out, code::METADATA, |out| {
            put_text(out, &metadata.name);
            put_map(out, &metadata.pairs);
        });
        put(&mut self.metadata, code::METADATA_INDEX, |out| {
            put_u64(out, offset);
            put_u64(out, length as u64);
            put_text(out, &metadata.name);
        });
        self.counts[1] += 1;
    }

    /// Appends a message with its time of this computer, ns of UTC.
    ///
    /// # Errors
    /// Those of the storage, when a chunk is full.
    pub fn message<M: Message>(&mut self, utc_ns: u64, message: &M) -> Result<()> {
        let mut bytes = std::mem::take(&mut self.scratch);
        bytes.clear();
        message.encode(&mut bytes);
        // Readers may rely on the order of the times; clocks are set back sometimes.
        let last = self.times.map_or(0, |[_, last]| last);
        let log_time = utc_ns.max(last).max(self.open.times[1]);
        let stamp = Stamp {
            topic: M::TOPIC,
            sequence: self.sequences[M::TOPIC.place()],
            log_time,
            publish_time: message.device_time_ns().unwrap_or(log_time),
        };
        let result = self.encoded(stamp, &bytes);
        self.scratch = bytes;
        result
    }

    /// Leaves out the numbers of `messages` messages of a channel that could not be written, so
    /// that readers know of them.
    pub fn skip(&mut self, topic: Topic, messages: u32) {
        let sequence = &mut self.sequences[topic.place()];
        *sequence = sequence.wrapping_add(messages);
    }

    /// True if a chunk is open: messages wait for [`McapWriter::flush`].
    pub fn is_open(&self) -> bool {
        !self.records.is_empty()
    }

    /// Appends a message whose bytes and number are known.
    pub(super) fn encoded(&mut self, stamp: Stamp, bytes: &[u8]) -> Result<()> {
        if self.failed {
            return Err(failed());
        }
        if bytes.len() > LARGEST / 2 {
            return Err(Error::new(
                ErrorKind::InvalidInput,
                format!(
                    "a message of {} bytes is too long; allowed are {}",
                    bytes.len(),
                    LARGEST / 2
                ),
            ));
        }
        let due = |since: u64| stamp.log_time.abs_diff(since) >= REPEATED_NS;
        if self.records.is_empty() && self.described.is_none_or(due) {
            put_schemas(&mut self.records, &self.accompanying);
            put_channels(&mut self.records, &self.description, &self.accompanying);
            self.described = Some(stamp.log_time);
        }
        let place = stamp.topic.place();
        self.sequences[place] = stamp.sequence.wrapping_add(1);
        let at = self.records.len() as u64;
        put(&mut self.records, code::MESSAGE, |out| {
            put_u16(out, stamp.topic.number());
            put_u32(out, stamp.sequence);
            put_u64(out, stamp.log_time);
            put_u64(out, stamp.publish_time);
            out.extend_from_slice(bytes);
        });
        let times = within(
            (self.open.messages != [0; TOPICS]).then_some(self.open.times),
            stamp.log_time,
        );
        self.open.times = times;
        self.open.messages[place] += 1;
        self.indices[place].push((stamp.log_time, at));
        if stamp.topic == Topic::Touch {
            self.accompany(stamp, bytes);
        }
        if self.records.len() >= CHUNK {
            self.put_chunk()?;
        }
        Ok(())
    }

    /// Appends the messages of the companion for a touch, in the chunk of the touch.
    fn accompany(&mut self, stamp: Stamp, bytes: &[u8]) {
        let Some(companion) = &self.companion else {
            return;
        };
        // A touch of ours always reads; of another version its companions hold nothing.
        let touch = TouchMessage::decode(bytes).unwrap_or_default();
        let topics = self.accompanying.iter().zip(&mut self.their_indices);
        for (place, (topic, index)) in topics.enumerate() {
            index.push((stamp.log_time, self.records.len() as u64));
            put(&mut self.records, code::MESSAGE, |out| {
                put_u16(out, topic.number);
                put_u32(out, stamp.sequence);
                put_u64(out, stamp.log_time);
                put_u64(out, stamp.publish_time);
                companion.encode(place, &touch, stamp.log_time, out);
            });
        }
    }

    /// Numbers of the channels with how many messages each has, where those of our topics are known.
    fn counted(&self, messages: [u64; TOPICS]) -> impl Iterator<Item = (u16, u64)> + Clone + '_ {
        let own = Topic::ALL.into_iter().map(Topic::number).zip(messages);
        let touches = messages[Topic::Touch.place()];
        let theirs = self.accompanying.iter();
        let theirs = theirs.map(move |topic| (topic.number, touches));
        own.chain(theirs).filter(|(_, count)| *count > 0)
    }

    /// Writes the messages so far as a whole chunk.
    ///
    /// # Errors
    /// Those of the storage.
    pub fn flush(&mut self) -> Result<()> {
        self.put_chunk()?;
        let flushed = self.storage.flush();
        self.checked(flushed)
    }

    /// [`McapWriter::flush`], then waits until the disk has it.
    ///
    /// # Errors
    /// Those of the storage.
    pub fn sync(&mut self) -> Result<()> {
        self.flush()?;
        let synced = self.storage.sync();
        self.checked(synced)
    }

    /// Bytes that are written, all of them whole.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Writes the rest, the index and the summary.
    ///
    /// # Errors
    /// Those of the storage.
    pub fn finish(mut self) -> Result<S> {
        self.put_chunk()?;
        put(&mut self.out, code::DATA_END, |out| put_u32(out, 0));
        let begin = self.written + self.out.len() as u64;
        let mut summary = Vec::new();
        let mut groups = Vec::new();
        let mut group = |summary: &mut Vec<u8>, code: u8, fill: &dyn Fn(&mut Vec<u8>)| {
            let from = summary.len();
            fill(summary);
            if summary.len() > from {
                groups.push((code, from, summary.len() - from));
            }
        };
        group(&mut summary, code::SCHEMA, &|out| {
            put_schemas(out, &self.accompanying);
        });
        group(&mut summary, code::CHANNEL, &|out| {
            put_channels(out, &self.description, &self.accompanying);
        });
        group(&mut summary, code::STATISTICS, &|out| self.statistics(out));
        group(&mut summary, code::CHUNK_INDEX, &|out| {
            self.chunks.iter().for_each(|chunk| self.index(out, &chunk));
        });
        group(&mut summary, code::ATTACHMENT_INDEX, &|out| {
            out.extend_from_slice(&self.attachments);
        });
        group(&mut summary, code::METADATA_INDEX, &|out| {
            out.extend_from_slice(&self.metadata);
        });
        let offsets = begin + summary.len() as u64;
        for (code, from, length) in groups {
            put(&mut summary, code::SUMMARY_OFFSET, |out| {
                out.push(code);
                put_u64(out, begin + from as u64);
                put_u64(out, length as u64);
            });
        }
        put(&mut summary, code::FOOTER, |out| {
            put_u64(out, begin);
            put_u64(out, offsets);
            let check = crc32(out);
            put_u32(out, check);
        });
        // The length of the footer was not known to the check.
        let footer = summary.len() - 20;
        let check = crc32(&summary[..footer + 16]);
        summary[footer + 16..].copy_from_slice(&check.to_le_bytes());
        self.out.extend_from_slice(&summary);
        self.out.extend_from_slice(&MAGIC);
        self.put_out()?;
        let flushed = self.storage.flush().and_then(|()| self.storage.sync());
        self.checked(flushed)?;
        Ok(self.storage)
    }

    fn statistics(&self, out: &mut Vec<u8>) {
        let counted = self.counted(self.messages);
        let channels = TOPICS + self.accompanying.len();
        put(out, code::STATISTICS, |out| {
            put_u64(out, counted.clone().map(|(_, count)| count).sum());
            put_u16(out, channels as u16);
            put_u32(out, channels as u32);
            put_u32(out, self.counts[0]);
            put_u32(out, self.counts[1]);
            put_u32(out, self.chunks.len());
            let [first, last] = self.times.unwrap_or_default();
            put_u64(out, first);
            put_u64(out, last);
            put_u32(out, 10 * counted.clone().count() as u32);
            for (channel, count) in counted {
                put_u16(out, channel);
                put_u64(out, count);
            }
        });
    }

    /// The index record of a chunk; the records of its messages' places follow it in the file.
    fn index(&self, out: &mut Vec<u8>, chunk: &ChunkPlace) {
        let indexed = self.counted(chunk.messages);
        let size = |messages: u64| HEAD as u64 + 6 + 16 * messages;
        put(out, code::CHUNK_INDEX, |out| {
            put_u64(out, chunk.times[0]);
            put_u64(out, chunk.times[1]);
            put_u64(out, chunk.offset);
            put_u64(out, chunk.length);
            put_u32(out, 10 * indexed.clone().count() as u32);
            let mut at = chunk.offset + chunk.length;
            for (channel, messages) in indexed {
                put_u16(out, channel);
                put_u64(out, at);
                at += size(messages);
            }
            put_u64(out, at - chunk.offset - chunk.length);
            put_text(out, "");
            // RecordingHead, times, sizes, check and the name of no compression.
            let records = chunk.length - HEAD as u64 - 40;
            put_u64(out, records);
            put_u64(out, records);
        });
    }

    fn put_chunk(&mut self) -> Result<()> {
        if self.failed {
            return Err(failed());
        }
        if self.records.is_empty() {
            return Ok(());
        }
        let records = &self.records;
        let mut place = ChunkPlace {
            offset: self.written,
            ..std::mem::take(&mut self.open)
        };
        let length = put(&mut self.out, code::CHUNK, |out| {
            put_u64(out, place.times[0]);
            put_u64(out, place.times[1]);
            put_u64(out, records.len() as u64);
            put_u32(out, crc32(records));
            put_text(out, "");
            put_u64(out, records.len() as u64);
            out.extend_from_slice(records);
        });
        place.length = length as u64;
        let own = self.indices.iter_mut().zip(Topic::ALL.map(Topic::number));
        let theirs = self.their_indices.iter_mut();
        let theirs = theirs.zip(self.accompanying.iter().map(|topic| topic.number));
        for (entries, channel) in own.chain(theirs) {
            if entries.is_empty() {
                continue;
            }
            put(&mut self.out, code::MESSAGE_INDEX, |out| {
                put_u16(out, channel);
                put_u32(out, 16 * entries.len() as u32);
                for (time, at) in entries.drain(..) {
                    put_u64(out, time);
                    put_u64(out, at);
                }
            });
        }
        self.records.clear();
        self.put_out()?;
        self.chunks.push(place);
        for (sum, count) in self.messages.iter_mut().zip(place.messages) {
            *sum += count;
        }
        let times = within(self.times, place.times[0]);
        self.times = Some(within(Some(times), place.times[1]));
        Ok(())
    }

    /// Writes what is whole, at once.
    fn put_out(&mut self) -> Result<()> {
        let written = self.storage.write_all(&self.out);
        self.checked(written)?;
        self.written += self.out.len() as u64;
        self.out.clear();
        Ok(())
    }

    fn checked(&mut self, result: Result<()>) -> Result<()> {
        if result.is_err() {
            self.failed = true;
            // What is half written is of no use; if it stays, readers pass over it.
            let _ = self.storage.cut(self.written);
        }
        result
    }
}

fn failed() -> Error {
    Error::other("the recording has ended because writing failed before")
}

/// The times with one more.
fn within(times: Option<[u64; 2]>, time: u64) -> [u64; 2] {
    times.map_or([time; 2], |[first, last]| [first.min(time), last.max(time)])
}

fn put_schemas(out: &mut Vec<u8>, theirs: &[CompanionTopic]) {
    for channel in Topic::ALL {
        put(out, code::SCHEMA, |out| {
            put_u16(out, channel.number());
            put_text(out, channel.type_name());
            put_text(out, "ros2msg");
            put_text(out, &channel.definition());
        });
    }
    for topic in theirs {
        put_schema(out, topic);
    }
}

fn put_channels(out: &mut Vec<u8>, description: &str, theirs: &[CompanionTopic]) {
    for channel in Topic::ALL {
        let pairs = match channel {
            Topic::Raw => vec![(DESCRIPTION_KEY.to_owned(), description.to_owned())],
            _ => Vec::new(),
        };
        put(out, code::CHANNEL, |out| {
            put_u16(out, channel.number());
            put_u16(out, channel.number());
            put_text(out, channel.name());
            put_text(out, "cdr");
            put_map(out, &pairs);
        });
    }
    for topic in theirs {
        put_channel(out, topic);
    }
}
