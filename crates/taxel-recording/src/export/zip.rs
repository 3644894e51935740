//! Stored members of a zip archive, as NumPy writes them.

use std::io::{Result, Write};

use crate::check::crc32;

/// Largest archive: without the extension for larger ones.
pub(super) const LARGEST: u64 = u32::MAX as u64 - (1 << 20);

/// An archive being written.
pub(super) struct Zip<W> {
    out: W,
    at: u32,
    central: Vec<u8>,
    members: u16,
}

impl<W: Write> Zip<W> {
    pub(super) fn new(out: W) -> Self {
        Self {
            out,
            at: 0,
            central: Vec::new(),
            members: 0,
        }
    }

    /// Appends a member; the sizes stay below [`LARGEST`].
    pub(super) fn member(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let (size, check) = (bytes.len() as u32, crc32(bytes));
        // Version 2.0, no flags, stored, 1 January 1980.
        let mut shared = Vec::new();
        for number in [20_u16, 0, 0, 0, 0x21] {
            shared.extend_from_slice(&number.to_le_bytes());
        }
        for number in [check, size, size] {
            shared.extend_from_slice(&number.to_le_bytes());
        }
        shared.extend_from_slice(&(name.len() as u16).to_le_bytes());
        shared.extend_from_slice(&[0; 2]);
        let head = [b"PK\x03\x04", &shared[..], name.as_bytes()].concat();
        self.central.extend_from_slice(b"PK\x01\x02\x14\x00");
        self.central.extend_from_slice(&shared);
        // No comment, first disk, no attributes.
        self.central.extend_from_slice(&[0; 10]);
        self.central.extend_from_slice(&self.at.to_le_bytes());
        self.central.extend_from_slice(name.as_bytes());
        self.out.write_all(&head)?;
        self.out.write_all(bytes)?;
        self.at += head.len() as u32 + size;
        self.members += 1;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.out.write_all(&self.central)?;
        let mut end = b"PK\x05\x06\x00\x00\x00\x00".to_vec();
        for _ in 0..2 {
            end.extend_from_slice(&self.members.to_le_bytes());
        }
        for number in [self.central.len() as u32, self.at] {
            end.extend_from_slice(&number.to_le_bytes());
        }
        end.extend_from_slice(&[0; 2]);
        self.out.write_all(&end)?;
        self.out.flush()
    }
}
