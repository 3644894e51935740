//! Bags of ROS 1.

use std::collections::HashMap;

use super::bytes::Bytes;
use super::messages::{Message, Messages, Topic};
use super::{Fault, unpack};

/// The first line of every bag.
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// A bag, read record by record.
#[derive(Debug)]
pub(super) struct BagFile {
    bytes: Bytes,
    at: u64,
    chunk: Vec<u8>,
    place: usize,
    topics: Vec<Topic>,
    connections: HashMap<u32, usize>,
    damaged: u64,
}

/// The fields in the head of a record.
type Head<'a> = HashMap<&'a [u8], &'a [u8]>;

fn u32_of(head: &Head<'_>, name: &str) -> Option<u32> {
    let bytes = head.get(name.as_bytes())?;
    Some(u32::from_le_bytes((*bytes).try_into().ok()?))
}

fn head(mut bytes: &[u8]) -> Option<Head<'_>> {
    let mut head = HashMap::new();
    while !bytes.is_empty() {
        let (field, rest) = piece(bytes)?;
        let at = field.iter().position(|byte| *byte == b'=')?;
        head.insert(&field[..at], &field[at + 1..]);
        bytes = rest;
    }
    Some(head)
}

/// Bytes behind their length, and what follows.
fn piece(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_at_checked(4)?;
    rest.split_at_checked(u32::from_le_bytes(length.try_into().ok()?) as usize)
}

impl BagFile {
    pub(super) fn open(mut bytes: Bytes) -> Result<Self, Fault> {
        if bytes.get(0, MAGIC.len() as u64)? != Some(MAGIC) {
            return Err(Fault::Wrong("its version is not 2.0".into()));
        }
        Ok(Self {
            bytes,
            at: MAGIC.len() as u64,
            chunk: Vec::new(),
            place: 0,
            topics: Vec::new(),
            connections: HashMap::new(),
            damaged: 0,
        })
    }

    /// Takes a record; a message is given back, a chunk is opened.
    fn record(&mut self, fields: &[u8], data: &[u8]) -> Option<Message> {
        let head = head(fields)?;
        match **head.get(&b"op"[..])? {
            [7] => {
                let name = String::from_utf8_lossy(head.get(&b"topic"[..])?).into_owned();
                let inner = self::head(data)?;
                let text = |key: &str| {
                    let bytes = inner.get(key.as_bytes()).copied().unwrap_or_default();
                    String::from_utf8_lossy(bytes).into_owned()
                };
                let at = self.topics.iter().position(|topic| topic.name == name);
                let at = at.unwrap_or_else(|| {
                    self.topics.push(Topic {
                        name,
                        type_name: text("type"),
                        encoding: "ros1".into(),
                        definition: text("message_definition"),
                    });
                    self.topics.len() - 1
                });
                self.connections.insert(u32_of(&head, "conn")?, at);
                None
            }
            [2] => {
                let time = head.get(&b"time"[..]).filter(|bytes| bytes.len() == 8)?;
                let [seconds, rest] = [&time[..4], &time[4..]]
                    .map(|four| u64::from(u32::from_le_bytes(four.try_into().unwrap_or([0; 4]))));
                Some(Message {
                    topic: *self.connections.get(&u32_of(&head, "conn")?)?,
                    time: seconds * 1_000_000_000 + rest,
                    bytes: data.to_vec(),
                })
            }
            [5] => {
                let length = u64::from(u32_of(&head, "size")?);
                let records = match *head.get(&b"compression"[..])? {
                    b"none" => Some(data.to_vec()),
                    b"lz4" => unpack::lz4(data, length),
                    b"bz2" => unpack::bzip2(data, length),
                    _ => None,
                };
                self.damaged += u64::from(records.is_none());
                (self.chunk, self.place) = (records.unwrap_or_default(), 0);
                None
            }
            _ => None,
        }
    }
}

impl Messages for BagFile {
    fn next(&mut self) -> Result<Option<Message>, Fault> {
        loop {
            let inner = piece(&self.chunk[self.place..]).and_then(|(fields, rest)| {
                let (data, rest) = piece(rest)?;
                Some((
                    fields.to_vec(),
                    data.to_vec(),
                    self.chunk.len() - rest.len(),
                ))
            });
            if let Some((fields, data, place)) = inner {
                self.place = place;
                if let Some(message) = self.record(&fields, &data) {
                    return Ok(Some(message));
                }
                continue;
            }
            if self.at == self.bytes.length() {
                return Ok(None);
            }
            let cut = || {
                Fault::Cut(
                    "the file ends inside a record: reindex it with rosbag reindex".to_owned(),
                )
            };
            let mut parts = [Vec::new(), Vec::new()];
            for part in &mut parts {
                let length = self.bytes.array::<4>(self.at)?.ok_or_else(cut)?;
                let length = u64::from(u32::from_le_bytes(length));
                *part = self
                    .bytes
                    .get(self.at + 4, length)?
                    .ok_or_else(cut)?
                    .to_vec();
                self.at += 4 + length;
            }
            let [fields, data] = parts;
            if let Some(message) = self.record(&fields, &data) {
                return Ok(Some(message));
            }
        }
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn rewind(&mut self) {
        self.at = MAGIC.len() as u64;
        self.chunk.clear();
        (self.place, self.damaged) = (0, 0);
    }

    fn cut(&self) -> Option<String> {
        (self.damaged > 0).then(|| format!("{} chunks are damaged", self.damaged))
    }
}
