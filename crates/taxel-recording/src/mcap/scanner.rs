//! Goes through the bytes of a recording and believes only what its own CRC confirms.
//!
//! A chunk or an attachment counts where its lengths agree with each other and its CRC with its
//! bytes. After anything else the next such place is searched byte by byte.

use std::io::{ErrorKind, Read, Result};

use super::record::{Attachment, Fields, HEAD, LARGEST, MAGIC, Metadata, code};
use crate::check::crc32;

/// Bytes that are read at once.
const STEP: usize = 1 << 16;
/// Bytes of a chunk record before its records.
pub(super) const CHUNK_HEAD: usize = HEAD + 40;
/// Bytes of the end of a file: the footer and the mark behind it.
const END: usize = HEAD + 20 + MAGIC.len();

/// Next part of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Part<'a> {
    /// Records of a chunk.
    Chunk {
        /// Offset of the chunk in the file.
        offset: u64,
        records: &'a [u8],
    },
    /// A chunk of another program, which is compressed.
    Compressed(String),
    Attachment(Attachment),
    /// Not confirmed by a check: only for people.
    Metadata(Metadata),
    /// Another recording begins.
    Begin {
        offset: u64,
    },
    /// The end of a finished recording.
    End,
    /// Bytes from one offset to another that are none of these.
    Damage {
        from: u64,
        to: u64,
    },
}

/// The bytes of a file from a moving place on.
#[derive(Debug)]
pub(super) struct Scanner<R> {
    reader: R,
    window: Vec<u8>,
    /// Place in the window.
    at: usize,
    /// Offset of the window in the file.
    base: u64,
    ended: bool,
}

/// What stands at a place.
enum Found {
    Nothing,
    /// A record of so many bytes that says nothing here.
    Passed(usize),
    Chunk(usize),
    Compressed(usize, String),
    Attachment(usize, Attachment),
    Metadata(usize, Metadata),
    Begin,
    End,
}

impl<R: Read> Scanner<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            window: Vec::new(),
            at: 0,
            base: 0,
            ended: false,
        }
    }

    /// Offset of the next byte.
    pub(super) fn offset(&self) -> u64 {
        self.base + self.at as u64
    }

    /// The next part; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Part<'_>>> {
        loop {
            let offset = self.offset();
            if !self.has(1)? {
                return Ok(None);
            }
            match self.found()? {
                Found::Passed(length) => self.at += length,
                Found::Nothing => {
                    self.search()?;
                    return Ok(Some(Part::Damage {
                        from: offset,
                        to: self.offset(),
                    }));
                }
                Found::Chunk(length) => {
                    let begin = self.at + CHUNK_HEAD;
                    self.at += length;
                    return Ok(Some(Part::Chunk {
                        offset,
                        records: &self.window[begin..self.at],
                    }));
                }
                Found::Compressed(length, name) => {
                    self.at += length;
                    return Ok(Some(Part::Compressed(name)));
                }
                Found::Attachment(length, attachment) => {
                    self.at += length;
                    return Ok(Some(Part::Attachment(attachment)));
                }
                Found::Metadata(length, metadata) => {
                    self.at += length;
                    return Ok(Some(Part::Metadata(metadata)));
                }
                Found::Begin => {
                    self.at += MAGIC.len();
                    return Ok(Some(Part::Begin { offset }));
                }
                Found::End => {
                    self.at += END;
                    return Ok(Some(Part::End));
                }
            }
        }
    }

    /// Makes the next `length` bytes ready; `false` where the file has fewer.
    fn has(&mut self, length: usize) -> Result<bool> {
        while self.window.len() - self.at < length && !self.ended {
            if self.at >= STEP {
                self.window.drain(..self.at);
                self.base += self.at as u64;
                self.at = 0;
            }
            let before = self.window.len();
            let wanted = (length + self.at).saturating_sub(before).max(STEP);
            self.window.resize(before + wanted, 0);
            let read = loop {
                match self.reader.read(&mut self.window[before..]) {
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    read => break read,
                }
            };
            let read = read.inspect_err(|_| self.window.truncate(before))?;
            self.window.truncate(before + read);
            self.ended = read == 0;
        }
        Ok(self.window.len() - self.at >= length)
    }

    /// Moves to the next place where something is believed, or to the end.
    fn search(&mut self) -> Result<()> {
        self.at += 1;
        while self.has(1)? {
            let worth = [code::CHUNK, code::ATTACHMENT, code::FOOTER, MAGIC[0]];
            let rest = &self.window[self.at..];
            match rest.iter().position(|byte| worth.contains(byte)) {
                None => self.at = self.window.len(),
                Some(ahead) => {
                    self.at += ahead;
                    match self.found()? {
                        Found::Nothing | Found::Passed(_) => self.at += 1,
                        _ => return Ok(()),
                    }
                }
            }
        }
        Ok(())
    }

    fn found(&mut self) -> Result<Found> {
        let first = self.window[self.at];
        if first == MAGIC[0] {
            let whole = self.has(MAGIC.len())?;
            let is_magic = whole && self.window[self.at..].starts_with(&MAGIC);
            return Ok(if is_magic {
                Found::Begin
            } else {
                Found::Nothing
            });
        }
        if !(code::HEADER..=code::DATA_END).contains(&first) || !self.has(HEAD)? {
            return Ok(Found::Nothing);
        }
        let mut head = Fields(&self.window[self.at + 1..]);
        let Some(length) = head.u64().and_then(|length| usize::try_from(length).ok()) else {
            return Ok(Found::Nothing);
        };
        if length > LARGEST || !self.fits(first, length)? || !self.has(HEAD + length)? {
            return Ok(Found::Nothing);
        }
        let body = &self.window[self.at + HEAD..self.at + HEAD + length];
        let record = HEAD + length;
        let found = match first {
            code::CHUNK => chunk(body, record),
            code::ATTACHMENT => attachment(body).map(|found| Found::Attachment(record, found)),
            code::METADATA => metadata(body).map(|found| Found::Metadata(record, found)),
            code::FOOTER => {
                let whole = self.has(END)?;
                let end = &self.window[self.at + record..];
                (whole && end.starts_with(&MAGIC)).then_some(Found::End)
            }
            _ => is_regular(first, body).then_some(Found::Passed(record)),
        };
        Ok(found.unwrap_or(Found::Nothing))
    }

    /// True if a record of this kind can be so long: looks no further than its head, so that a
    /// wrong length brings no megabytes into memory.
    fn fits(&mut self, kind: u8, length: usize) -> Result<bool> {
        Ok(match kind {
            code::CHUNK => {
                self.has(CHUNK_HEAD)?
                    && chunk_fits(&self.window[self.at + HEAD..], length as u64) == Some(true)
            }
            code::FOOTER => length == 20,
            code::DATA_END => length == 4,
            _ => true,
        })
    }
}

/// True if the lengths in the head of a chunk agree with that of its record.
fn chunk_fits(head: &[u8], length: u64) -> Option<bool> {
    let mut fields = Fields(head);
    fields.take(16)?;
    let size = fields.u64()?;
    fields.u32()?;
    Some(match fields.u32()? {
        0 => size == fields.u64()? && size.checked_add(40) == Some(length),
        // The name of a compression is short.
        name => name <= 8,
    })
}

fn chunk(body: &[u8], length: usize) -> Option<Found> {
    let mut fields = Fields(body);
    fields.take(16 + 8)?;
    let check = fields.u32()?;
    let name = fields.text()?;
    if fields.u64()? != fields.0.len() as u64 {
        return None;
    }
    if !name.is_empty() {
        let known = ["lz4", "zstd"].contains(&name);
        return known.then(|| Found::Compressed(length, name.to_owned()));
    }
    (crc32(fields.0) == check).then_some(Found::Chunk(length))
}

fn attachment(body: &[u8]) -> Option<Attachment> {
    let (checked, check) = body.split_at_checked(body.len().checked_sub(4)?)?;
    let mut fields = Fields(checked);
    fields.take(16)?;
    let (name, media_type) = (fields.text()?, fields.text()?);
    let length = fields.u64()?;
    if length != fields.0.len() as u64 || Fields(check).u32()? != crc32(checked) {
        return None;
    }
    Some(Attachment {
        name: name.to_owned(),
        media_type: media_type.to_owned(),
        bytes: fields.0.to_vec(),
    })
}

fn metadata(body: &[u8]) -> Option<Metadata> {
    let mut fields = Fields(body);
    let name = fields.text()?.to_owned();
    let pairs = fields.map()?;
    fields.0.is_empty().then_some(Metadata { name, pairs })
}

/// True if the lengths inside a record without a check agree with its own, so that it may be
/// passed over.
fn is_regular(kind: u8, body: &[u8]) -> bool {
    let mut fields = Fields(body);
    pass(kind, &mut fields).is_some() && fields.0.is_empty()
}

/// Goes over the fields of a record.
fn pass(kind: u8, fields: &mut Fields<'_>) -> Option<()> {
    let list = |fields: &mut Fields<'_>| {
        let length = fields.u32()?;
        fields.take(length as usize).map(drop)
    };
    match kind {
        code::HEADER => {
            fields.text()?;
            fields.text()?;
        }
        code::MESSAGE_INDEX => {
            fields.u16()?;
            list(fields)?;
        }
        code::SCHEMA => {
            fields.u16()?;
            fields.text()?;
            fields.text()?;
            list(fields)?;
        }
        code::CHANNEL => {
            fields.u32()?;
            fields.text()?;
            fields.text()?;
            fields.map()?;
        }
        code::CHUNK_INDEX => {
            fields.take(32)?;
            list(fields)?;
            fields.u64()?;
            fields.text()?;
            fields.take(16)?;
        }
        code::ATTACHMENT_INDEX => {
            fields.take(40)?;
            fields.text()?;
            fields.text()?;
        }
        code::STATISTICS => {
            fields.take(8 + 2 + 4 * 4 + 16)?;
            list(fields)?;
        }
        code::METADATA_INDEX => {
            fields.take(16)?;
            fields.text()?;
        }
        code::SUMMARY_OFFSET => fields.take(17).map(drop)?,
        code::DATA_END => fields.take(4).map(drop)?,
        // A message outside a chunk has no check.
        _ => return None,
    }
    Some(())
}
