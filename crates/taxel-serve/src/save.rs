//! Saves the raw frames of a run as a recording of channels.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use taxel::acquisition::{Frame, Stream};
use taxel::shown;
use taxel_recording::ChannelWriter;

/// Frames that may wait for the disk; then a source that waits does, and the file of a device
/// ends.
const WAITING: usize = 1 << 14;

/// Lines are written out after this time, so that no more than 100 ms are lost with the
/// process.
const FLUSH: Duration = Duration::from_millis(80);
/// Longest wait for a frame.
const IDLE: Duration = Duration::from_hours(1);

/// Why frames could not be saved.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The file cannot be made; an existing one is overwritten only on request.
    #[error("{}: cannot be made: {cause}", shown::path(path))]
    Create {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The disk failed or cannot keep up.
    #[error("{}: {message}", shown::path(path))]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        message: String,
    },
}

/// Opens a new file, or with `replace` an ordinary one that exists: it is written anew in
/// its place, so that its mode and the links to it stay. No other program of this kind
/// replaces it while it is open.
pub(crate) fn created(path: &Path, replace: bool) -> std::io::Result<File> {
    if !replace || std::fs::symlink_metadata(path).is_err() {
        let file = File::create_new(path)?;
        return locked(file);
    }
    // Opening a pipe would wait for its reader.
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is no ordinary file"));
    }
    let file = locked(OpenOptions::new().write(true).open(path)?)?;
    file.set_len(0)?;
    Ok(file)
}

/// The file, unless another program writes it.
fn locked(file: File) -> std::io::Result<File> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(std::io::Error::other(
            "another program is writing it; name another file",
        )),
        // Some file systems have no locks.
        _ => Ok(file),
    }
}

/// Whether a run waits for the files that it writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pace {
    /// A device does not wait: what the disk cannot take is lost, and counted.
    Device,
    /// A twin or a recording played as fast as possible waits.
    Waits,
}

/// Writes frames on a thread of its own, so that the disk cannot delay them.
#[derive(Debug)]
pub(crate) struct Saver {
    path: PathBuf,
    frames: mpsc::SyncSender<Frame>,
    pace: Pace,
    writer: JoinHandle<std::io::Result<()>>,
}

impl Saver {
    pub(crate) fn create(
        path: &Path,
        stream: &Stream,
        provenance: &[String],
        replace: bool,
        pace: Pace,
    ) -> Result<Self, SaveError> {
        let fail = |cause| SaveError::Create {
            path: path.to_owned(),
            cause,
        };
        let file = created(path, replace).map_err(fail)?;
        // Who reads a file without the mark at its end knows that it is cut.
        let comments = [provenance, &["end = marked".to_owned()]].concat();
        let mut writer =
            ChannelWriter::new(BufWriter::new(file), stream, &comments).map_err(fail)?;
        let (frames, waiting) = mpsc::sync_channel::<Frame>(WAITING);
        let writer = std::thread::spawn(move || {
            // When the oldest line came that is not written out.
            let mut oldest: Option<Instant> = None;
            loop {
                let wait = oldest.map_or(IDLE, |oldest| FLUSH.saturating_sub(oldest.elapsed()));
                match waiting.recv_timeout(wait) {
                    Ok(frame) => {
                        writer.write(&frame)?;
                        oldest.get_or_insert_with(Instant::now);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if oldest.is_some_and(|oldest| oldest.elapsed() >= FLUSH) {
                    writer.flush()?;
                    oldest = None;
                }
            }
            writer.end()?.into_inner()?.flush()
        });
        Ok(Self {
            path: path.to_owned(),
            frames,
            pace,
            writer,
        })
    }

    /// Takes a frame; the saver itself again while it can take another.
    pub(crate) fn push(self, frame: Frame) -> Result<Self, SaveError> {
        let sent = match self.pace {
            Pace::Device => self.frames.try_send(frame),
            Pace::Waits => self.frames.send(frame).map_err(Into::into),
        };
        let message = match sent {
            Ok(()) => return Ok(self),
            Err(mpsc::TrySendError::Full(_)) => "the disk cannot keep up; frames would be lost",
            // The end of its thread says why.
            Err(mpsc::TrySendError::Disconnected(_)) => {
                let path = self.path.clone();
                self.finish()?;
                return Err(SaveError::Write {
                    path,
                    message: "writing ended unexpectedly".into(),
                });
            }
        };
        Err(SaveError::Write {
            path: self.path,
            message: message.into(),
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
