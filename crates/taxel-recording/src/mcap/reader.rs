//! The messages of a recording in the order of the file, and what is wrong with it.

use std::io::{Read, Result};

use super::chunk_list::TOPICS;
use super::order::{Order, Place, Span};
use super::record::{Attachment, Fields, Metadata, code};
use super::scanner::{CHUNK_HEAD, Part, Scanner};
use super::schemas::{BESIDE, FIRST_BESIDE, Topic};
use super::writer::{DESCRIPTION, DESCRIPTION_KEY};

/// Damages that are listed one by one.
const LISTED: usize = 1000;
/// Attachments and metadata that are kept.
const KEPT: usize = 64;
/// Longest of them together, bytes.
const KEPT_BYTES: usize = 1 << 26;

/// What was found in a recording so far.
#[derive(Debug, Clone, Default)]
pub struct Findings {
    /// Bytes so far.
    pub bytes: u64,
    /// Chunks whose messages count.
    pub chunks: u64,
    /// Chunks that come late: their place is in a gap before.
    pub late_chunks: u64,
    /// Chunks that have come before, or are of another recording; they do not count.
    pub foreign_chunks: u64,
    /// Messages of each topic, in the order of [`Topic::ALL`].
    pub messages: [u64; TOPICS],
    /// Messages of each topic that are missing between others.
    pub missing: [u64; TOPICS],
    /// Stretches of bytes that are damaged, the first ones.
    pub damages: Vec<Damage>,
    /// Number of all of them.
    pub damage_count: u64,
    /// Times of the first and of the last message, ns of UTC.
    pub times: Option<[u64; 2]>,
    /// True if the recording ended as it should.
    pub finished: bool,
    /// Where another recording begins in the same file.
    pub second: Option<u64>,
    /// True if the file has topics of other programs, or compressed chunks.
    pub foreign: Option<String>,
    /// Meaning of the raw frames, where it is preserved.
    pub description: Option<String>,
    /// Attached files, each with a right CRC.
    pub attachments: Vec<Attachment>,
    /// Command line and version as written; no check confirms them.
    pub metadata: Vec<Metadata>,
}

/// A stretch of bytes that is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damage {
    /// Offset of its first byte.
    pub from: u64,
    /// Offset behind its last byte.
    pub to: u64,
    /// Time of the last message before it, ns of UTC, where there is one.
    pub after_utc_ns: Option<u64>,
}

impl Findings {
    /// Messages of one topic.
    pub fn messages(&self, topic: Topic) -> u64 {
        self.messages[topic.place()]
    }

    /// Messages of one topic that are missing between others.
    pub fn missing(&self, topic: Topic) -> u64 {
        self.missing[topic.place()]
    }

    /// True if bytes are damaged, but for a torn end of an unfinished recording.
    pub fn is_damaged(&self) -> bool {
        let torn = self.torn_tail().is_some();
        self.damage_count > u64::from(torn) || self.late_chunks + self.foreign_chunks > 0
    }

    /// Notes a stretch of bytes that is damaged.
    fn damaged(&mut self, from: u64, to: u64) {
        self.damage_count += 1;
        if self.damages.len() < LISTED {
            self.damages.push(Damage {
                from,
                to,
                after_utc_ns: self.times.map(|[_, last]| last),
            });
        }
    }

    /// The torn end of a recording that was not finished.
    pub fn torn_tail(&self) -> Option<Damage> {
        let last = self.damages.last().copied()?;
        (!self.finished && last.to == self.bytes).then_some(last)
    }
}

/// One message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoredMessage<'a> {
    /// Its topic.
    pub topic: Topic,
    /// Running number in its topic.
    pub sequence: u32,
    /// Time of this computer, ns of UTC.
    pub log_time: u64,
    /// Device time where the message has one, else as above, ns.
    pub publish_time: u64,
    /// The message in CDR, see [`super::Message::decode`].
    pub bytes: &'a [u8],
}

/// Where a chunk is that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ChunkAt {
    pub(super) offset: u64,
    pub(super) records: u64,
    pub(super) begin: u64,
}

/// Reads the messages of a recording, whatever has happened to its file.
///
/// Only what its own CRC confirms is given out. After damage the next whole chunk is searched.
/// A second recording in the same file is not read.
///
/// # Example
/// ```
/// use taxel_recording::mcap::{Topic, RecordingHead, MarkMessage, Message, McapReader, McapWriter};
///
/// let mut writer = McapWriter::new(Vec::new(), &RecordingHead::default())?;
/// let mark = MarkMessage { text: "begin".into(), ..MarkMessage::default() };
/// writer.message(1_800_000_000_000_000_000, &mark)?;
/// let file = writer.finish()?;
///
/// let mut reader = McapReader::new(file.as_slice());
/// let entry = reader.next()?.expect("one message");
/// assert_eq!(entry.topic, Topic::Marks);
/// assert_eq!(MarkMessage::decode(entry.bytes), Some(mark));
/// assert!(reader.next()?.is_none());
/// assert!(reader.findings().finished);
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct McapReader<R> {
    scanner: Scanner<R>,
    findings: Findings,
    order: Order,
    records: Vec<u8>,
    at: usize,
    begun: bool,
    kept_bytes: usize,
}

impl<R: Read> McapReader<R> {
    /// Reads from the beginning of a file.
    pub fn new(reader: R) -> Self {
        Self {
            scanner: Scanner::new(reader),
            findings: Findings::default(),
            order: Order::default(),
            records: Vec::new(),
            at: 0,
            begun: false,
            kept_bytes: 0,
        }
    }

    /// What was found so far.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }

    /// What was found, at the end.
    pub fn into_findings(self) -> Findings {
        self.findings
    }

    /// The next message of a known topic; `None` at the end.
    ///
    /// # Errors
    /// Those of the reader.
    // Messages borrow from the reader, which no iterator can do.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Result<Option<StoredMessage<'_>>> {
        loop {
            while self.at < self.records.len() {
                let mut rest = Fields(&self.records[self.at..]);
                let Some((code, body)) = rest.record() else {
                    break;
                };
                let body = self.records.len() - rest.0.len() - body.len();
                self.at = self.records.len() - rest.0.len();
                if code == code::MESSAGE
                    && let Some(stamp) = message_head(&self.records[body..self.at])
                {
                    let (topic, sequence, log_time, publish_time) = stamp;
                    return Ok(Some(StoredMessage {
                        topic,
                        sequence,
                        log_time,
                        publish_time,
                        bytes: &self.records[body + MESSAGE_HEAD..self.at],
                    }));
                }
            }
            if self.next_chunk()?.is_none() {
                return Ok(None);
            }
        }
    }

    /// Goes to the next chunk that counts; `None` at the end.
    pub(super) fn next_chunk(&mut self) -> Result<Option<ChunkAt>> {
        (self.at, self.records) = (0, Vec::new());
        if self.findings.second.is_some() {
            return Ok(None);
        }
        loop {
            let part = self.scanner.next()?;
            let findings = &mut self.findings;
            match part {
                None => {
                    findings.bytes = self.scanner.offset();
                    return Ok(None);
                }
                Some(Part::Chunk { offset, records }) => {
                    findings.foreign = findings.foreign.take().or_else(|| of_others(records));
                    let description = description(records);
                    if findings.description.is_none() {
                        findings.description = description;
                    }
                    if !is_whole(records) {
                        let end = offset + (CHUNK_HEAD + records.len()) as u64;
                        findings.damaged(offset, end);
                    }
                    let Some((spans, counts, times)) = survey(records) else {
                        continue;
                    };
                    match self.order.take(&spans, times) {
                        Place::Next => {}
                        Place::Late => findings.late_chunks += 1,
                        Place::Foreign => {
                            findings.foreign_chunks += 1;
                            continue;
                        }
                    }
                    findings.chunks += 1;
                    findings.missing = self.order.missing();
                    for (sum, count) in findings.messages.iter_mut().zip(counts) {
                        *sum += count;
                    }
                    let known = findings.times.unwrap_or(times);
                    findings.times = Some([known[0].min(times[0]), known[1].max(times[1])]);
                    self.records.extend_from_slice(records);
                    let length = records.len() as u64;
                    findings.bytes = self.scanner.offset();
                    return Ok(Some(ChunkAt {
                        offset,
                        records: length,
                        begin: times[0],
                    }));
                }
                Some(Part::Compressed(name)) => {
                    findings.foreign.get_or_insert_with(|| {
                        format!("its chunks are compressed with {name}, which taxel does not write")
                    });
                }
                Some(Part::Attachment(attachment)) => {
                    let bytes = attachment.bytes.len();
                    if attachment.name == DESCRIPTION {
                        let text = String::from_utf8(attachment.bytes).ok();
                        findings.description = findings.description.take().or(text);
                    } else if findings.attachments.len() < KEPT
                        && self.kept_bytes + bytes <= KEPT_BYTES
                    {
                        self.kept_bytes += bytes;
                        findings.attachments.push(attachment);
                    }
                }
                Some(Part::Metadata(metadata)) => {
                    if findings.metadata.len() < KEPT {
                        findings.metadata.push(metadata);
                    }
                }
                Some(Part::Begin { offset }) => {
                    if self.begun || findings.chunks > 0 {
                        findings.second = Some(offset);
                        findings.bytes = offset;
                        return Ok(None);
                    }
                    self.begun = true;
                }
                Some(Part::End) => findings.finished = true,
                Some(Part::Damage { from, to }) => findings.damaged(from, to),
            }
        }
    }
}

/// Bytes of a message before its content.
const MESSAGE_HEAD: usize = 22;

/// Topic, number, log time and publish time of a message.
fn message_head(body: &[u8]) -> Option<(Topic, u32, u64, u64)> {
    let mut fields = Fields(body);
    let channel = Topic::of_number(fields.u16()?)?;
    Some((channel, fields.u32()?, fields.u64()?, fields.u64()?))
}

/// Records of a chunk: code and body.
fn each_record(records: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    let mut rest = Fields(records);
    std::iter::from_fn(move || rest.record())
}

/// True if the records of a chunk fill it, and each message has its head: its CRC says only that
/// it is as it was written.
fn is_whole(records: &[u8]) -> bool {
    let mut rest = Fields(records);
    while !rest.0.is_empty() {
        match rest.record() {
            None => return false,
            Some((code::MESSAGE, body)) if body.len() < MESSAGE_HEAD => return false,
            Some(_) => {}
        }
    }
    true
}

type Survey = ([Span; TOPICS], [u64; TOPICS], [u64; 2]);

/// Numbers, counts and times of the messages of a chunk; `None` without any.
fn survey(records: &[u8]) -> Option<Survey> {
    let mut spans: [Option<[u32; 2]>; TOPICS] = [None; TOPICS];
    let mut counts = [0_u64; TOPICS];
    let mut times: Option<[u64; 2]> = None;
    for (_, body) in each_record(records).filter(|(code, _)| *code == code::MESSAGE) {
        let Some((channel, sequence, log_time, _)) = message_head(body) else {
            continue;
        };
        counts[channel.place()] += 1;
        let span = &mut spans[channel.place()];
        let [first, last] = span.unwrap_or([sequence; 2]);
        *span = Some([first.min(sequence), last.max(sequence)]);
        let [begin, end] = times.unwrap_or([log_time; 2]);
        times = Some([begin.min(log_time), end.max(log_time)]);
    }
    let spans = std::array::from_fn(|at| {
        let [first, last] = spans[at]?;
        let inside = (u64::from(last - first) + 1).saturating_sub(counts[at]);
        Some(([first, last], inside as u32))
    });
    Some((spans, counts, times?))
}

/// Why the messages of a chunk are not those of a recording of this program.
fn of_others(records: &[u8]) -> Option<String> {
    each_record(records).find_map(|(code, body)| {
        if code != code::CHANNEL {
            return None;
        }
        let mut fields = Fields(body);
        let number = fields.u16()?;
        fields.u16()?;
        let topic = fields.text()?;
        let own = Topic::of_number(number).map(Topic::name) == Some(topic);
        let beside = number >= FIRST_BESIDE && BESIDE.contains(&topic);
        (!own && !beside)
            .then(|| format!("its channel {number} is {topic:?}, which taxel does not write"))
    })
}

/// Meaning of the frames as the channel of the frames says it.
fn description(records: &[u8]) -> Option<String> {
    each_record(records).find_map(|(code, body)| {
        let mut fields = Fields(body);
        if code != code::CHANNEL || fields.u16()? != Topic::Raw.number() {
            return None;
        }
        fields.u16()?;
        fields.text()?;
        fields.text()?;
        let pairs = fields.map()?;
        let found = pairs.into_iter().find(|(key, _)| key == DESCRIPTION_KEY);
        found.map(|(_, description)| description)
    })
}
