//! Sources of frames: the simulated twin and recordings.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use taxel::acquisition::{Delivery, Frame, Stream, Twin};
use taxel_recording::{Recording, RecordingError};

/// Next item of a source.
#[derive(Debug, Clone, PartialEq)]
pub enum Next {
    /// A frame.
    Frame(Frame),
    /// Nothing arrives at this device time, ns.
    Nothing(u64),
    /// The source has ended.
    End,
}

/// Anything that delivers frames; real time is kept by the pump, from the
/// device times.
pub trait Source: Send {
    /// Meaning of the frames.
    fn stream(&self) -> &Stream;

    /// The next frame, or none at this time, or the end.
    ///
    /// # Errors
    /// When the source fails; it has ended then.
    fn next(&mut self) -> Result<Next, SourceError>;
}

/// Why a source failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The recording is malformed, cut or unreadable.
    #[error("{0}")]
    Recording(Box<RecordingError>),
    /// The file cannot be opened.
    #[error("{}: cannot be opened: {cause}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
}

impl From<RecordingError> for SourceError {
    fn from(error: RecordingError) -> Self {
        Self::Recording(Box::new(error))
    }
}

/// The simulated twin as a source; it never ends.
pub struct TwinSource {
    twin: Twin,
    stream: Stream,
}

impl TwinSource {
    /// Wraps a twin.
    pub fn new(twin: Twin) -> Self {
        Self {
            stream: twin.stream(),
            twin,
        }
    }
}

impl Source for TwinSource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        Ok(match self.twin.next_delivery() {
            Delivery::Frame(frame) => Next::Frame(frame),
            Delivery::Nothing(time_ns) => Next::Nothing(time_ns),
        })
    }
}

/// A recording as a source.
#[derive(Debug)]
pub struct ReplaySource {
    recording: Recording<BufReader<File>>,
    stream: Stream,
}

/// Opener of a recording: name and bytes to frames.
type Open = fn(&str, BufReader<File>) -> Result<Recording<BufReader<File>>, RecordingError>;

/// Size of a whole recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RecordingSize {
    /// Complete frames.
    pub frames: u64,
    /// Device time from the first to the last, ns.
    pub duration_ns: u64,
}

impl RecordingSize {
    /// Mean time between frames, s.
    fn period(&self) -> Option<f64> {
        let steps = self.frames.saturating_sub(1);
        (steps > 0 && self.duration_ns > 0).then(|| self.duration_ns as f64 * 1e-9 / steps as f64)
    }
}

impl ReplaySource {
    /// Opens a recording, whose format is recognised by its content.
    ///
    /// # Errors
    /// [`SourceError`] when it cannot be opened or its header is malformed.
    pub fn open(path: &Path) -> Result<Self, SourceError> {
        Self::open_with(path, Recording::open)
    }

    /// Like [`Self::open`], and rows of numbers without a header are taken as
    /// the channels of a device that is known.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_bare(path: &Path) -> Result<Self, SourceError> {
        Self::open_with(path, Recording::open_bare)
    }

    fn open_with(path: &Path, read: Open) -> Result<Self, SourceError> {
        let open = |cause| SourceError::Open {
            path: path.to_owned(),
            cause,
        };
        // Before it is opened: a pipe would wait for its writer, a device may never end.
        let about = std::fs::metadata(path).map_err(open)?;
        if about.is_dir() {
            return Err(open(std::io::Error::other("it is a folder")));
        }
        if !about.is_file() {
            let message = "it is a device, pipe or socket; give an ordinary file";
            return Err(open(std::io::Error::other(message)));
        }
        let file = File::open(path).map_err(open)?;
        let recording = read(&path.to_string_lossy(), BufReader::new(file))?;
        Ok(Self {
            stream: recording.stream().clone(),
            recording,
        })
    }

    /// Reads the whole recording once, so that a mistake in its middle is
    /// found before anything is shown.
    ///
    /// # Errors
    /// The first mistake.
    pub fn verify(path: &Path) -> Result<RecordingSize, SourceError> {
        Self::open(path)?.size()
    }

    /// Reads all of the rest once: its size, or the first mistake.
    ///
    /// # Errors
    /// The first mistake.
    pub fn size(self) -> Result<RecordingSize, SourceError> {
        let mut source = self;
        let mut size = RecordingSize::default();
        let mut first = None;
        while let Next::Frame(frame) = source.next()? {
            size.frames += 1;
            let first = *first.get_or_insert(frame.time_ns);
            size.duration_ns = size.duration_ns.max(frame.time_ns.saturating_sub(first));
        }
        Ok(size)
    }

    /// The same source, whose stream states the mean time between frames of
    /// `size` where the recording itself states none.
    #[must_use]
    pub fn paced(mut self, size: RecordingSize) -> Self {
        self.stream.period = self.stream.period.or_else(|| size.period());
        self
    }
}

impl Source for ReplaySource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        match self.recording.next() {
            Some(frame) => Ok(Next::Frame(frame?)),
            None => Ok(Next::End),
        }
    }
}
