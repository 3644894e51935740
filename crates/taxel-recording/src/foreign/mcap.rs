//! MCAP of other programs: messages in any order of records, in chunks that may be compressed.

use std::collections::HashMap;

use super::bytes::Bytes;
use super::messages::{Message, Messages, Topic};
use super::{Fault, unpack};
use crate::check::crc32;
use crate::mcap::{Fields, MAGIC, code};

/// A file, read record by record.
#[derive(Debug)]
pub(super) struct McapFile {
    bytes: Bytes,
    /// Offset of the next record.
    at: u64,
    /// Records of the chunk that is read, and the place in it.
    chunk: Vec<u8>,
    place: usize,
    topics: Vec<Topic>,
    /// Place among the topics of each channel.
    channels: HashMap<u16, usize>,
    schemas: HashMap<u16, (String, String, String)>,
    damaged: u64,
    finished: bool,
}

impl McapFile {
    pub(super) fn new(bytes: Bytes) -> Self {
        Self {
            bytes,
            at: MAGIC.len() as u64,
            chunk: Vec::new(),
            place: 0,
            topics: Vec::new(),
            channels: HashMap::new(),
            schemas: HashMap::new(),
            damaged: 0,
            finished: false,
        }
    }

    /// Takes a record; a message is given back.
    fn record(&mut self, code: u8, body: &[u8]) -> Option<Message> {
        let mut fields = Fields(body);
        match code {
            code::SCHEMA => {
                let (number, name, encoding) = (fields.u16()?, fields.text()?, fields.text()?);
                let length = fields.u32()? as usize;
                let text = String::from_utf8_lossy(fields.take(length)?).into_owned();
                self.schemas
                    .insert(number, (name.to_owned(), encoding.to_owned(), text));
                None
            }
            code::CHANNEL => {
                let (number, schema) = (fields.u16()?, fields.u16()?);
                let (name, encoding) = (fields.text()?, fields.text()?);
                let (type_name, definition) = match self.schemas.get(&schema) {
                    Some((name, kind, text))
                        if kind.starts_with("ros") && kind.ends_with("msg") =>
                    {
                        (name.clone(), text.clone())
                    }
                    Some((name, ..)) => (name.clone(), String::new()),
                    None => (String::new(), String::new()),
                };
                let at = self.topics.iter().position(|topic| topic.name == name);
                let at = at.unwrap_or_else(|| {
                    self.topics.push(Topic {
                        name: name.to_owned(),
                        type_name,
                        encoding: encoding.to_owned(),
                        definition,
                    });
                    self.topics.len() - 1
                });
                self.channels.insert(number, at);
                None
            }
            code::MESSAGE => {
                let topic = *self.channels.get(&fields.u16()?)?;
                fields.u32()?;
                let time = fields.u64()?;
                fields.u64()?;
                Some(Message {
                    topic,
                    time,
                    bytes: fields.0.to_vec(),
                })
            }
            _ => None,
        }
    }
}

/// The records of a chunk; `None` if they are not as they were written.
fn unpacked(body: &[u8]) -> Option<Vec<u8>> {
    let mut fields = Fields(body);
    fields.take(16)?;
    let length = fields.u64()?;
    let check = fields.u32()?;
    let compression = fields.text()?;
    let size = usize::try_from(fields.u64()?).ok()?;
    let packed = fields.take(size)?;
    let records = match compression {
        "" => packed.to_vec(),
        "lz4" => unpack::lz4(packed, length)?,
        "zstd" => unpack::zstd(packed, length)?,
        _ => return None,
    };
    (records.len() as u64 == length && (check == 0 || check == crc32(&records))).then_some(records)
}

impl Messages for McapFile {
    fn next(&mut self) -> Result<Option<Message>, Fault> {
        loop {
            let mut rest = Fields(&self.chunk[self.place..]);
            if let Some((code, body)) = rest.record() {
                let begin = self.chunk.len() - rest.0.len() - body.len();
                self.place = self.chunk.len() - rest.0.len();
                let body = self.chunk[begin..self.place].to_vec();
                if let Some(message) = self.record(code, &body) {
                    return Ok(Some(message));
                }
                continue;
            }
            if self.finished || self.at >= self.bytes.length() {
                return if self.finished {
                    Ok(None)
                } else {
                    Err(Fault::Cut(
                        "the file has no end: it was cut or not finished".into(),
                    ))
                };
            }
            let cut = || Fault::Cut("the file ends inside a record".to_owned());
            let head = self.bytes.array::<9>(self.at)?.ok_or_else(cut)?;
            let mut fields = Fields(&head);
            let (code, length) = (fields.u8().unwrap_or(0), fields.u64().unwrap_or(0));
            self.at += 9;
            let body = self.bytes.get(self.at, length)?.ok_or_else(cut)?;
            match code {
                code::CHUNK => {
                    let records = unpacked(body);
                    self.damaged += u64::from(records.is_none());
                    self.chunk = records.unwrap_or_default();
                    self.place = 0;
                }
                code::DATA_END | code::FOOTER => self.finished = true,
                _ => {
                    let body = body.to_vec();
                    self.at += length;
                    if let Some(message) = self.record(code, &body) {
                        return Ok(Some(message));
                    }
                    continue;
                }
            }
            self.at += length;
        }
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn rewind(&mut self) {
        self.at = MAGIC.len() as u64;
        self.chunk.clear();
        (self.place, self.damaged, self.finished) = (0, 0, false);
    }

    fn cut(&self) -> Option<String> {
        (self.damaged > 0).then(|| {
            format!(
                "{} chunks are damaged or compressed in an unknown way and left out",
                self.damaged
            )
        })
    }
}
