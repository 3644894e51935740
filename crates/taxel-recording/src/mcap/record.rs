//! Records of MCAP: a code, a length and a body.

/// Bytes at the beginning and at the end of every file.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Code and length.
pub(super) const HEAD: usize = 9;
/// Largest record that is read or written, bytes: a message of a million channels takes 8 MB.
pub(super) const LARGEST: usize = 1 << 26;

/// Codes of records.
pub(crate) mod code {
    pub(crate) const HEADER: u8 = 1;
    pub(crate) const FOOTER: u8 = 2;
    pub(crate) const SCHEMA: u8 = 3;
    pub(crate) const CHANNEL: u8 = 4;
    pub(crate) const MESSAGE: u8 = 5;
    pub(crate) const CHUNK: u8 = 6;
    pub(crate) const MESSAGE_INDEX: u8 = 7;
    pub(crate) const CHUNK_INDEX: u8 = 8;
    pub(crate) const ATTACHMENT: u8 = 9;
    pub(crate) const ATTACHMENT_INDEX: u8 = 10;
    pub(crate) const STATISTICS: u8 = 11;
    pub(crate) const METADATA: u8 = 12;
    pub(crate) const METADATA_INDEX: u8 = 13;
    pub(crate) const SUMMARY_OFFSET: u8 = 14;
    pub(crate) const DATA_END: u8 = 15;
}

/// Appends a record whose body `fill` appends; the number of its bytes.
pub(super) fn put(out: &mut Vec<u8>, code: u8, fill: impl FnOnce(&mut Vec<u8>)) -> usize {
    let begin = out.len();
    out.push(code);
    out.extend_from_slice(&[0; 8]);
    fill(out);
    let length = (out.len() - begin - HEAD) as u64;
    out[begin + 1..begin + HEAD].copy_from_slice(&length.to_le_bytes());
    out.len() - begin
}

pub(super) fn put_u16(out: &mut Vec<u8>, value: u16) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(super) fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(super) fn put_u64(out: &mut Vec<u8>, value: u64) {
    out.extend_from_slice(&value.to_le_bytes());
}

/// Text or bytes behind their length.
pub(super) fn put_text(out: &mut Vec<u8>, text: &str) {
    put_u32(out, text.len() as u32);
    out.extend_from_slice(text.as_bytes());
}

pub(super) fn put_map(out: &mut Vec<u8>, pairs: &[(String, String)]) {
    let bytes: usize = pairs.iter().map(|(a, b)| 8 + a.len() + b.len()).sum();
    put_u32(out, bytes as u32);
    for (key, value) in pairs {
        put_text(out, key);
        put_text(out, value);
    }
}

/// Reads the fields of a record; `None` where it has no more of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        Some(self.take(1)?[0])
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    /// Text behind its length.
    pub(crate) fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        str::from_utf8(self.take(length)?).ok()
    }

    pub(crate) fn map(&mut self) -> Option<Vec<(String, String)>> {
        let length = self.u32()? as usize;
        let mut inner = Fields(self.take(length)?);
        let mut pairs = Vec::new();
        while !inner.0.is_empty() {
            pairs.push((inner.text()?.to_owned(), inner.text()?.to_owned()));
        }
        Some(pairs)
    }

    /// The next record: its code and its body.
    pub(crate) fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let code = self.u8()?;
        let length = usize::try_from(self.u64()?).ok()?;
        Some((code, self.take(length)?))
    }
}

/// A file that is part of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Attachment {
    /// Its name, such as `sensor.toml`.
    pub name: String,
    /// Its media type, such as `application/toml`.
    pub media_type: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Facts about a recording under one name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Metadata {
    /// Name of the facts.
    pub name: String,
    /// Key and value of each.
    pub pairs: Vec<(String, String)>,
}
