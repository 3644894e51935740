//! Saves the raw frames of a run as a recording of channels.

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread::JoinHandle;

use taxel::acquisition::{Frame, Stream};
use taxel_recording::ChannelWriter;

/// Frames that may wait for the disk before the run is ended with an error.
const WAITING: usize = 1 << 14;

/// Why frames could not be saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file cannot be made; an existing one is overwritten only on request.
    #[error("{}: cannot be made: {cause}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The disk failed or cannot keep up.
    #[error("{}: {message}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        message: String,
    },
}

/// Opens a new file, or with `replace` an ordinary one that exists: it is written anew in
/// its place, so that its mode and the links to it stay.
pub(crate) fn created(path: &Path, replace: bool) -> std::io::Result<File> {
    if !replace || std::fs::symlink_metadata(path).is_err() {
        return File::create_new(path);
    }
    // Opening a pipe would wait for its reader.
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is no ordinary file"));
    }
    OpenOptions::new().write(true).truncate(true).open(path)
}

/// Writes frames on a thread of its own, so that the disk cannot delay them.
#[derive(Debug)]
pub(crate) struct Saver {
    path: PathBuf,
    frames: mpsc::SyncSender<Frame>,
    writer: JoinHandle<std::io::Result<()>>,
}

impl Saver {
    pub(crate) fn create(
        path: &Path,
        stream: &Stream,
        provenance: &[String],
        replace: bool,
    ) -> Result<Self, SaveError> {
        let fail = |cause| SaveError::Create {
            path: path.to_owned(),
            cause,
        };
        let file = created(path, replace).map_err(fail)?;
        let mut writer =
            ChannelWriter::new(BufWriter::new(file), stream, provenance).map_err(fail)?;
        let (frames, waiting) = mpsc::sync_channel::<Frame>(WAITING);
        let writer = std::thread::spawn(move || {
            for frame in waiting {
                writer.write(&frame)?;
            }
            writer.into_inner().into_inner()?.flush()
        });
        Ok(Self {
            path: path.to_owned(),
            frames,
            writer,
        })
    }

    pub(crate) fn push(&self, frame: Frame) -> Result<(), SaveError> {
        self.frames.try_send(frame).map_err(|error| {
            let message = match error {
                mpsc::TrySendError::Full(_) => "the disk cannot keep up; frames would be lost",
                mpsc::TrySendError::Disconnected(_) => "writing failed; is the disk full?",
            };
            SaveError::Write {
                path: self.path.clone(),
                message: message.into(),
            }
        })
    }

    pub(crate) fn finish(self) -> Result<(), SaveError> {
        drop(self.frames);
        let written = self.writer.join().unwrap_or_else(|_| {
            Err(std::io::Error::other(
                "the writing thread ended unexpectedly",
            ))
        });
        written.map_err(|cause| SaveError::Write {
            path: self.path,
            message: cause.to_string(),
        })
    }
}
