//! What was done to each frame, one line of JSON each.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::DeviceError;
use crate::save::created;

/// What was done to one frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "what was done is independent of each other"
)]
pub(super) struct Done {
    /// Its number.
    pub(super) sequence: u64,
    /// Its number on the wire, where that is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) counter: Option<u64>,
    /// True time of the reading, s from the start.
    pub(super) time_s: f64,
    /// The same by the steady clock of this computer, s, which on Unix is that of other programs.
    pub(super) steady_s: f64,
    /// Time by the clock of the device, ns.
    pub(super) device_time_ns: u64,
    /// When it was put on the wire, s from the start; none if it was not.
    pub(super) sent_s: Option<f64>,
    /// It was left out.
    pub(super) lost: bool,
    /// It was sent twice.
    pub(super) repeated: bool,
    /// It was sent after the next one.
    pub(super) swapped: bool,
    /// Bits that were changed.
    pub(super) flipped: u32,
    /// Bytes that were left out.
    pub(super) dropped: u32,
    /// Bytes that were added.
    pub(super) inserted: u32,
    /// Bytes that a burst replaced.
    pub(super) burst: u32,
    /// Only its end was sent.
    pub(super) cut: bool,
    /// Nobody was connected, or the device was unplugged or hung.
    pub(super) unsent: bool,
}

impl Done {
    /// True if its bytes are not those that they should be.
    pub(super) fn damaged(&self) -> bool {
        self.cut || self.flipped + self.dropped + self.inserted + self.burst > 0
    }
}

/// Writes the truth.
#[derive(Debug)]
pub(super) struct Truth {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Truth {
    /// Makes the file; one that exists is replaced only with `replace`.
    pub(super) fn create(path: &Path, replace: bool) -> Result<Self, DeviceError> {
        let file = created(path, replace).map_err(|cause| DeviceError::Truth {
            path: path.into(),
            cause,
        })?;
        Ok(Self {
            path: path.into(),
            file: BufWriter::new(file),
        })
    }

    pub(super) fn write(&mut self, done: &Done) -> Result<(), DeviceError> {
        let written = serde_json::to_writer(&mut self.file, done)
            .map_err(std::io::Error::from)
            .and_then(|()| self.file.write_all(b"\n"));
        written.map_err(|cause| self.failed(cause))
    }

    pub(super) fn flush(&mut self) -> Result<(), DeviceError> {
        self.file.flush().map_err(|cause| DeviceError::Truth {
            path: self.path.clone(),
            cause,
        })
    }

    fn failed(&self, cause: std::io::Error) -> DeviceError {
        DeviceError::Truth {
            path: self.path.clone(),
            cause,
        }
    }
}
