//! Sources of frames: the simulated twin and recordings.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use taxel::acquisition::{Delivery, Frame, Stream, Twin};
use taxel::estimation::MapNoise;
use taxel::shown;
use taxel_recording::foreign::{BEGIN, ForeignFile, Seekable};
use taxel_recording::mcap::{Findings, RestMessage};
use taxel_recording::{
    Change, ForeignFormat, Format, Recording, RecordingError, RecordingOptions, Taken,
};

use crate::link::{LinkError, LinkHandle};
use crate::record::Recorder;

/// Next item of a source.
#[derive(Debug, Clone, PartialEq)]
pub enum Next {
    /// A frame.
    Frame(Frame),
    /// Nothing arrives at this device time, ns.
    Nothing(u64),
    /// The rest values changed here when this was recorded.
    Rest(Box<RestMessage>),
    /// The link was lost and is open again: the frames that follow begin a new segment.
    Reconnected,
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

    /// Gives the source the recorder of the run, or none, before its first frame and at each
    /// change: for what only the source knows, such as the bytes of the wire, states of the link
    /// and relations of clocks.
    fn record_to(&mut self, _recorder: Option<&Recorder>) {}

    /// Nothing is asked for any more: what has come so far goes to the recorder.
    fn stop(&mut self) {}

    /// When the last byte of `frame` arrived, for sources that read a link.
    fn arrival(&self, frame: &Frame) -> Option<Instant> {
        let _ = frame;
        None
    }

    /// When `frame` was read on the device, by the relation of its clock to that of this computer, for
    /// sources that know it.
    fn taken(&self, frame: &Frame) -> Option<Instant> {
        let _ = frame;
        None
    }

    /// The status of the link that it reads, or that its bytes were captured from.
    fn link(&self) -> Option<LinkHandle> {
        None
    }

    /// True if its frames come when they come; else they are due by their device times.
    fn is_live(&self) -> bool {
        false
    }
}

/// Why a source failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// The recording is malformed, cut or unreadable.
    #[error("{0}")]
    Recording(Box<RecordingError>),
    /// The link ended.
    #[error("{0}")]
    Link(#[from] LinkError),
    /// The file cannot be opened.
    #[error("{}: cannot be opened: {cause}", shown::path(path))]
    Open {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// The file cannot be read to its end.
    #[error("{}: cannot be read: {cause}", shown::path(path))]
    Read {
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
    /// What comes before the frame that is held.
    changes: VecDeque<Change>,
    /// The frame behind them, or the end.
    held: Option<Next>,
}

/// What a first reading of a whole recording finds.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    /// Complete frames.
    pub frames: u64,
    /// Device time of the first, ns.
    pub first_ns: u64,
    /// Device time from the first to the last, ns.
    pub duration_ns: u64,
    /// The noise of its readings.
    pub noise: MapNoise,
    /// Steps between the times of the first frames, ns.
    steps: Vec<u64>,
}

/// Steps between frames that tell the usual one.
const STEPS: usize = 1000;

impl Survey {
    /// Reads all that a file still holds once, so that a mistake in its middle is found before
    /// anything is shown: what was found, and how it ended.
    pub fn of(mut source: impl Source) -> (Self, Result<(), SourceError>) {
        let mut survey = Self::default();
        let (mut first, mut last) = (None, None);
        loop {
            let frame = match source.next() {
                Ok(Next::Frame(frame)) => frame,
                Ok(Next::Rest(_) | Next::Reconnected) => continue,
                Ok(_) => return (survey, Ok(())),
                Err(error) => return (survey, Err(error)),
            };
            survey.frames += 1;
            if let Some(last) = last
                .replace(frame.time_ns)
                .filter(|_| survey.steps.len() < STEPS)
            {
                survey.steps.push(frame.time_ns.saturating_sub(last));
            }
            let first = *first.get_or_insert(frame.time_ns);
            survey.first_ns = first;
            let elapsed = frame.time_ns.saturating_sub(first);
            survey.duration_ns = survey.duration_ns.max(elapsed);
            survey.noise.push(&frame);
        }
    }

    /// Time between frames that half of the first do not exceed, s; none of one frame.
    pub fn usual_step(&self) -> Option<f64> {
        let mut steps = self.steps.clone();
        steps.sort_unstable();
        steps.get(steps.len() / 2).map(|step| *step as f64 * 1e-9)
    }

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
    /// [`SourceError`] when it cannot be opened, its header is malformed, or it has no such
    /// part.
    pub fn open(path: &Path, options: &RecordingOptions) -> Result<Self, SourceError> {
        let recording = open_recording(path, options)?;
        Ok(Self {
            stream: recording.stream().clone(),
            recording,
            changes: VecDeque::new(),
            held: None,
        })
    }

    /// What was taken for what, in a file that leaves it open.
    pub fn taken(&self) -> Option<Taken> {
        self.recording.taken()
    }

    /// The kind of the file.
    pub fn format(&self) -> Format {
        self.recording.format()
    }

    /// What was found so far in a recording of a whole run (`--record`), with the files that
    /// are part of it.
    pub fn findings(&self) -> Option<&Findings> {
        self.recording.findings()
    }

    /// Names of the sensors in the recording; the one played is the name of the stream.
    pub fn parts(&self) -> &[String] {
        self.recording.sensors()
    }

    /// The same source, whose stream states the mean time between frames that `survey`
    /// found where the recording itself states none.
    #[must_use]
    pub fn paced(mut self, survey: &Survey) -> Self {
        self.stream.period = self.stream.period.or_else(|| survey.period());
        self
    }
}

/// Opens a recording of any kind, a folder only if it is a bag of ROS 2.
///
/// # Errors
/// Those of [`ReplaySource::open`].
pub fn open_recording(
    path: &Path,
    options: &RecordingOptions,
) -> Result<Recording<BufReader<File>>, SourceError> {
    if let Some(foreign) = open_foreign(path)? {
        return Ok(Recording::of_foreign(foreign, options)?);
    }
    let file = shown::path(path);
    let open = |options: &RecordingOptions| {
        Recording::open_with(&file, reader(path)?, options).map_err(SourceError::from)
    };
    let Some(part) = &options.part else {
        return open(options);
    };
    let any = RecordingOptions {
        part: None,
        ..options.clone()
    };
    let recording = open(&any)?;
    let sensors = recording.sensors();
    let place = part
        .parse::<usize>()
        .ok()
        .and_then(|place| place.checked_sub(1));
    let numbered = place
        .and_then(|place| sensors.get(place))
        .filter(|_| !sensors.contains(part));
    open(&RecordingOptions {
        part: Some(numbered.unwrap_or(part).clone()),
        ..any
    })
}

/// Opens a file of another program, or a folder that is a bag of ROS 2; `None` if it is neither.
///
/// # Errors
/// [`SourceError`] when it cannot be opened or is damaged.
pub fn open_foreign(path: &Path) -> Result<Option<ForeignFile>, SourceError> {
    let folder = path.is_dir();
    let paths = if folder {
        files_of_bag(path)?
    } else {
        vec![path.to_owned()]
    };
    let mut files: Vec<(String, Box<dyn Seekable>)> = Vec::new();
    let mut format = None;
    for path in &paths {
        let mut begin = Vec::new();
        let read = reader(path)?.take(BEGIN as u64).read_to_end(&mut begin);
        read.map_err(|cause| SourceError::Read {
            path: path.clone(),
            cause,
        })?;
        let found = ForeignFormat::of(&begin);
        match (found, format) {
            (None, _) => return Ok(None),
            (Some(found), Some(first)) if found != first => {}
            (Some(found), _) => {
                format = Some(found);
                files.push((shown::path(path), Box::new(reader(path)?.into_inner())));
            }
        }
    }
    let Some(format) = format else {
        return Ok(None);
    };
    Ok(Some(ForeignFile::open(&shown::path(path), format, files)?))
}

/// The files of a bag of ROS 2 in a folder, in the order in which they were written.
fn files_of_bag(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let open = |cause| SourceError::Open {
        path: path.to_owned(),
        cause,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(open)? {
        let file = entry.map_err(open)?.path();
        let ending = file.extension().and_then(|ending| ending.to_str());
        if matches!(ending, Some("mcap" | "db3")) {
            files.push(file);
        }
    }
    // A bag that was split counts its files: NAME_9 comes before NAME_10.
    files.sort_by_cached_key(|file| {
        let name = shown::path(&file.with_extension(""));
        let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (begin, number) = name.split_at(name.len() - digits);
        (
            begin.to_owned(),
            number.parse::<u64>().unwrap_or(0),
            name.clone(),
        )
    });
    if files.is_empty() {
        return Err(open(std::io::Error::other(
            "it is a folder without the files of a bag of ROS 2 (.mcap, .db3); those that end in .zstd are unpacked with zstd -d",
        )));
    }
    Ok(files)
}

/// The bytes of an ordinary file.
pub(crate) fn reader(path: &Path) -> Result<BufReader<File>, SourceError> {
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
    Ok(BufReader::new(File::open(path).map_err(open)?))
}

impl Source for ReplaySource {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn next(&mut self) -> Result<Next, SourceError> {
        if self.held.is_none() {
            let frame = self.recording.next().transpose()?;
            self.changes = self.recording.take_changes();
            self.held = Some(frame.map_or(Next::End, Next::Frame));
        }
        match self.changes.pop_front() {
            Some(Change::Rest(change)) => return Ok(Next::Rest(change)),
            Some(Change::Reconnected) => return Ok(Next::Reconnected),
            _ => {}
        }
        Ok(self.held.take().unwrap_or(Next::End))
    }
}
