//! The bytes of a file at any offset, read in pieces and never beyond its end.

use std::fmt;
use std::io::{Read, Result, Seek, SeekFrom};

/// A file whose bytes can be read at any offset.
pub trait Seekable: Read + Seek + Send {}

impl<T: Read + Seek + Send> Seekable for T {}

/// Bytes that are read at once.
const WINDOW: usize = 1 << 18;

/// The bytes of a file.
pub(super) struct Bytes {
    reader: Box<dyn Seekable>,
    length: u64,
    window: Vec<u8>,
    /// Offset of the window.
    base: u64,
}

impl fmt::Debug for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bytes")
            .field("length", &self.length)
            .finish_non_exhaustive()
    }
}

impl Bytes {
    pub(super) fn new(mut reader: Box<dyn Seekable>) -> Result<Self> {
        Ok(Self {
            length: reader.seek(SeekFrom::End(0))?,
            reader,
            window: Vec::new(),
            base: 0,
        })
    }

    pub(super) fn length(&self) -> u64 {
        self.length
    }

    /// So many bytes from an offset on; `None` where the file has fewer.
    pub(super) fn get(&mut self, offset: u64, length: u64) -> Result<Option<&[u8]>> {
        let Some(end) = offset.checked_add(length).filter(|end| *end <= self.length) else {
            return Ok(None);
        };
        if offset < self.base || end > self.base + self.window.len() as u64 {
            let wanted = (length as usize)
                .max(WINDOW)
                .min((self.length - offset) as usize);
            self.window.resize(wanted, 0);
            self.base = offset;
            self.reader.seek(SeekFrom::Start(offset))?;
            if let Err(error) = self.reader.read_exact(&mut self.window) {
                self.window.clear();
                return Err(error);
            }
        }
        let at = (offset - self.base) as usize;
        Ok(Some(&self.window[at..at + length as usize]))
    }

    /// The same as an array.
    pub(super) fn array<const N: usize>(&mut self, offset: u64) -> Result<Option<[u8; N]>> {
        let found = self.get(offset, N as u64)?;
        Ok(found.and_then(|bytes| bytes.try_into().ok()))
    }
}
