//! A recording being read, and the formats that are recognised.

// An error ends the reading, so its size costs nothing; boxing it would only
// get in the way of matching on it.
#![allow(clippy::result_large_err)]

mod bare;
mod channels;
mod chunks;
mod description;
mod encoding;
mod lines;
mod remarks;
mod tekscan;
mod units;
mod vendors;
mod writer;
mod xsensor;

use std::collections::VecDeque;
use std::fmt;
use std::io::{BufRead, ErrorKind};

use crate::frame::{Frame, Stream};
use crate::mcap::Findings;
use chunks::Chunks;
use lines::{Dialect, Lines, quote};
use remarks::Remarks;
use taxel_ground::InputError;

pub use chunks::Change;
pub use description::{described_stream, description_of};
pub use writer::ChannelWriter;

/// Most taxels of a recording, rows x columns; more is taken for a damaged
/// header.
const MOST_TAXELS: u64 = 1_000_000;

/// A recording being read: an iterator of its frames.
///
/// Frames come in the order of the file, with the numbers and times of the
/// file; what is late or double is delivered as it stands. After an error the
/// iterator ends.
#[derive(Debug)]
pub struct Recording<R> {
    body: Body<R>,
    delivered: u64,
    finished: bool,
}

/// The kind of file that a recording is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Raw channels with their units in the header line, see
    /// [`ChannelWriter`].
    Channels,
    /// Rows of numbers without a header, the time in s first: only read where
    /// the device is known ([`Recording::open_bare`]). The channels come as
    /// counts in one row.
    Bare,
    /// Text export of Tekscan I-Scan (`.csv`) or F-Scan (`.asf`).
    ///
    /// A sensel marked `B` does not exist: `present` is false and its value
    /// `NaN`. The first frame gives the layout. A `B` in a later frame where
    /// there was a number is a missing reading, `NaN`. A number where there
    /// was a `B` is refused: it would either be hidden or contradict `present`.
    ///
    /// Frame numbers of the file are the sequence. The time is that of the
    /// frame line, else (number - `START_FRAME`) x `SECONDS_PER_FRAME`.
    /// `NOISE_THRESHOLD` is in raw counts and left out for other units.
    Tekscan,
    /// CSV export of XSENSOR.
    ///
    /// One file may hold several sensors, such as a left and a right insole:
    /// each frame then has one `SENSOR` block of readings after the other. A
    /// recording delivers one of them, the first unless another is asked for
    /// with [`Recording::open_sensor`]. `GROUP` blocks repeat the readings of
    /// regions without saying where they lie, in lines of up to 20 values, and
    /// are passed over. The file does not distinguish a sensel that does not
    /// exist from one without load, so that all count as present.
    ///
    /// Times are those of day relative to the first frame; midnight may pass,
    /// frames must be less than 12 h apart.
    Xsensor,
    /// Recording of [`crate::mcap`]: frames, touch, events and all else of a run.
    Chunks,
}

/// Why a recording cannot be read, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The content is not what the format demands.
    #[error("{0}")]
    Input(InputError),
    /// The file ends inside its header or inside a frame.
    #[error("{error}")]
    Truncated {
        /// Where the file ends, what is missing and what to do.
        error: InputError,
        /// Frames delivered before, all of them complete.
        complete_frames: u64,
    },
    /// The bytes cannot be read.
    #[error("the recording cannot be read: {0}")]
    Io(#[from] std::io::Error),
}

impl From<InputError> for RecordingError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl RecordingError {
    /// The same error, saying that `complete_frames` were delivered before.
    fn after(self, complete_frames: u64) -> Self {
        let Self::Truncated { mut error, .. } = self else {
            return self;
        };
        let frames = if complete_frames == 1 {
            "frame"
        } else {
            "frames"
        };
        error.message = format!(
            "the recording is cut off after {complete_frames} complete {frames}: {}",
            error.message
        );
        if error.help == chunks::SALVAGE {
            return Self::Truncated {
                error,
                complete_frames,
            };
        }
        error.help = if complete_frames == 0 {
            "export or copy the recording again".to_owned()
        } else {
            "the complete frames were read; export or copy the recording again to have the rest"
                .to_owned()
        };
        Self::Truncated {
            error,
            complete_frames,
        }
    }
}

/// Text or chunks.
#[derive(Debug)]
enum Body<R> {
    Text(Box<Text<R>>),
    Chunks(Box<Chunks<R>>),
}

/// A recording in lines.
#[derive(Debug)]
struct Text<R> {
    lines: Lines<R>,
    stream: Stream,
    sensors: Vec<String>,
    decoder: Decoder,
}

#[derive(Debug)]
enum Decoder {
    Bare(bare::Decoder),
    Channels(channels::Decoder),
    Tekscan(tekscan::Decoder),
    Xsensor(Box<xsensor::Decoder>),
}

/// Head of a file as the decoder has read it.
struct Opened {
    stream: Stream,
    sensors: Vec<String>,
    decoder: Decoder,
}

impl<R: BufRead> Recording<R> {
    /// Recognises the format by content and reads the header, of vendors'
    /// formats also the first frame, which has the layout.
    ///
    /// `file` is the name by which errors call the recording.
    ///
    /// # Errors
    /// [`RecordingError::Input`] if the file is none of the known formats or
    /// its header or layout is wrong, [`RecordingError::Truncated`] if it ends
    /// before the first frame is complete, [`RecordingError::Io`] if `reader`
    /// fails.
    pub fn open(file: &str, reader: R) -> Result<Self, RecordingError> {
        Self::open_any(file, reader, None, false)
    }

    /// Like [`Recording::open`], for the sensor called `sensor` of a file that
    /// holds several (see [`Format::Xsensor`]).
    ///
    /// # Errors
    /// Those of [`Recording::open`]; [`RecordingError::Input`] naming the
    /// sensors of the file if none is called so.
    pub fn open_sensor(file: &str, reader: R, sensor: &str) -> Result<Self, RecordingError> {
        Self::open_any(file, reader, Some(sensor), false)
    }

    /// Like [`Recording::open`], and rows of numbers without a header are
    /// taken as [`Format::Bare`].
    ///
    /// # Errors
    /// Those of [`Recording::open`].
    pub fn open_bare(file: &str, reader: R) -> Result<Self, RecordingError> {
        Self::open_any(file, reader, None, true)
    }

    fn open_any(
        file: &str,
        mut reader: R,
        wanted: Option<&str>,
        bare: bool,
    ) -> Result<Self, RecordingError> {
        let in_chunks = loop {
            match reader.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                begin => break chunks::recognises(begin?),
            }
        };
        if !in_chunks {
            return Self::open_text(file, reader, wanted, bare);
        }
        let chunks = Chunks::open(file, reader).map_err(|error| error.after(0))?;
        let own = [chunks.stream().name.clone()];
        if let Some(wanted) = wanted
            && own[0] != wanted
        {
            return Err(no_such_sensor(file, wanted, &own).into());
        }
        Ok(Self {
            body: Body::Chunks(Box::new(chunks)),
            delivered: 0,
            finished: false,
        })
    }

    /// Opens raw channels alone.
    fn open_channels(file: &str, reader: R) -> Result<Self, RecordingError> {
        Self::open_text(file, reader, None, false)
    }

    fn open_text(
        file: &str,
        reader: R,
        wanted: Option<&str>,
        bare: bool,
    ) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(file, reader);
        let (format, remarks) = recognise(&mut lines, bare)?;
        let opened = match format {
            Format::Bare => bare::open(&mut lines),
            Format::Channels => channels::open(&mut lines, &remarks),
            Format::Tekscan => tekscan::open(&mut lines),
            Format::Xsensor => xsensor::open(&mut lines, wanted),
            // Never found among lines.
            Format::Chunks => return Err(unrecognised(&lines).into()),
        }
        .map_err(|error| error.after(0))?;
        if let Some(wanted) = wanted
            && !opened.sensors.iter().any(|name| name == wanted)
        {
            return Err(no_such_sensor(file, wanted, &opened.sensors).into());
        }
        Ok(Self {
            body: Body::Text(Box::new(Text {
                lines,
                stream: opened.stream,
                sensors: opened.sensors,
                decoder: opened.decoder,
            })),
            delivered: 0,
            finished: false,
        })
    }

    /// Meaning of the frames: shape, unit, pitch (m), period (s), threshold.
    pub fn stream(&self) -> &Stream {
        match &self.body {
            Body::Text(text) => &text.stream,
            Body::Chunks(chunks) => chunks.stream(),
        }
    }

    /// The kind of file.
    pub fn format(&self) -> Format {
        match &self.body {
            Body::Chunks(_) => Format::Chunks,
            Body::Text(text) => match text.decoder {
                Decoder::Bare(_) => Format::Bare,
                Decoder::Channels(_) => Format::Channels,
                Decoder::Tekscan(_) => Format::Tekscan,
                Decoder::Xsensor(_) => Format::Xsensor,
            },
        }
    }

    /// Names of the sensors in the file, in its order; the one delivered is
    /// [`Stream::name`]. More than one only in [`Format::Xsensor`].
    pub fn sensors(&self) -> &[String] {
        match &self.body {
            Body::Text(text) => &text.sensors,
            Body::Chunks(chunks) => std::slice::from_ref(&chunks.stream().name),
        }
    }

    /// What stands before the frame that was delivered last, or before the end, the oldest
    /// first, each once; only a recording in chunks ([`Format::Chunks`]) has it.
    pub fn take_changes(&mut self) -> VecDeque<Change> {
        match &mut self.body {
            Body::Text(_) => VecDeque::new(),
            Body::Chunks(chunks) => chunks.take_changes(),
        }
    }

    /// What was found in a recording in chunks so far, with its attachments.
    pub fn findings(&self) -> Option<&Findings> {
        match &self.body {
            Body::Text(_) => None,
            Body::Chunks(chunks) => Some(chunks.findings()),
        }
    }

    fn read(&mut self) -> Result<Option<Frame>, RecordingError> {
        let text = match &mut self.body {
            Body::Chunks(chunks) => return chunks.read(),
            Body::Text(text) => text,
        };
        match &mut text.decoder {
            Decoder::Bare(decoder) => decoder.read(&mut text.lines),
            Decoder::Channels(decoder) => decoder.read(&mut text.lines),
            Decoder::Tekscan(decoder) => decoder.read(&mut text.lines),
            Decoder::Xsensor(decoder) => decoder.read(&mut text.lines),
        }
    }
}

impl<R: BufRead> Iterator for Recording<R> {
    type Item = Result<Frame, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.finished {
            return None;
        }
        let item = self.read().transpose();
        if let Some(Ok(_)) = item {
            self.delivered += 1;
        } else {
            self.finished = true;
        }
        item.map(|item| item.map_err(|error| error.after(self.delivered)))
    }
}

impl<R: BufRead> std::iter::FusedIterator for Recording<R> {}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bare => "rows of numbers without a header (CSV)",
            Self::Channels => "raw channels (CSV)",
            Self::Tekscan => "Tekscan (I-Scan CSV or F-Scan ASF)",
            Self::Xsensor => "XSENSOR (CSV)",
            Self::Chunks => "recording of taxel (MCAP)",
        })
    }
}

/// Reads to the first line that is no comment and leaves it to be read again; with what the
/// comments said.
fn recognise<R: BufRead>(
    lines: &mut Lines<R>,
    bare: bool,
) -> Result<(Format, Remarks), RecordingError> {
    let mut remarks = Remarks::default();
    let format = loop {
        if !lines.advance()? {
            return Err(
                InputError::whole(lines.file(), "the file has no header line")
                    .help(KNOWN_FORMATS)
                    .into(),
            );
        }
        let text = lines.text();
        if let Some(vendor) = vendors::of_line(text) {
            return Err(vendors::refused(lines.file(), vendor).into());
        }
        if text.contains('\0') {
            return Err(InputError::whole(
                lines.file(),
                "the file is binary, or UTF-16 text without its mark",
            )
            .help("save it as plain CSV text in UTF-8; bytes as a board sent them are played with its board file (--board)")
            .into());
        }
        if channels::is_comment(text) {
            remarks.read(lines)?;
            continue;
        }
        if Dialect::of_line(text).is_blank(text) {
            continue;
        }
        if tekscan::recognises(text) {
            break Format::Tekscan;
        }
        if xsensor::recognises(text) {
            break Format::Xsensor;
        }
        if channels::recognises(text) {
            break Format::Channels;
        }
        if bare && bare::recognises(text) {
            break Format::Bare;
        }
        return Err(unrecognised(lines).into());
    };
    lines.again();
    Ok((format, remarks))
}

const KNOWN_FORMATS: &str = "a recording is one of\n  \
     raw channels: a header line such as `time [s],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],r0c0.22 [fF]` or `time [s],r0c0 [kPa]`, then one line of numbers per frame\n  \
     Tekscan I-Scan CSV or F-Scan ASF: begins with `DATA_TYPE MOVIE`\n  \
     XSENSOR CSV: begins with `File:,` and the name of the XSN file\n  \
     MCAP that taxel live --record has written";

fn unrecognised<R: BufRead>(lines: &Lines<R>) -> InputError {
    let text = lines.text();
    let dialect = Dialect::of_line(text);
    let numbers = dialect
        .fields(text)
        .all(|field| dialect.clone().number(&field.text()).is_some());
    let error = lines.line_error(format!(
        "this is no recording of a known format: the first line is {}",
        quote(text)
    ));
    if numbers {
        error.help(format!(
            "the numbers have no header that says what they are: add a first line such as \
             `time [s],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],r0c0.22 [fF]`, with one name and unit for each \
             column\n{KNOWN_FORMATS}"
        ))
    } else {
        error.help(KNOWN_FORMATS)
    }
}

fn no_such_sensor(file: &str, wanted: &str, sensors: &[String]) -> InputError {
    InputError::whole(
        file,
        format!("the recording has no sensor {}", quote(wanted)),
    )
    .help(format!("it has {}", sensors.join(", ")))
}

/// A number of rows or columns, 1 to [`MOST_TAXELS`].
fn side(text: &str) -> Option<usize> {
    let count = text.parse::<u64>().ok()?;
    (1..=MOST_TAXELS)
        .contains(&count)
        .then(|| usize::try_from(count).ok())?
}

/// Message for a shape that is too large, if it is.
fn shape_fault(rows: usize, columns: usize) -> Option<String> {
    let taxels = rows as u128 * columns as u128;
    (taxels > u128::from(MOST_TAXELS)).then(|| {
        format!(
            "{rows} rows x {columns} columns are {taxels} taxels; allowed are 1 to {MOST_TAXELS}"
        )
    })
}

/// A distance between taxels, above 0 to 1 m.
fn spacing(value: f64, unit_m: f64) -> Option<f64> {
    Some(value * unit_m).filter(|&metres| metres > 0.0 && metres <= 1.0)
}
