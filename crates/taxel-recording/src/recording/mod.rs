//! A recording being read, and the formats that are recognised.

// An error ends the reading, so its size costs nothing; boxing it would only
// get in the way of matching on it.
#![allow(clippy::result_large_err)]

mod channels;
mod chunks;
mod columns;
mod description;
mod encoding;
mod lines;
mod remarks;
mod roles;
mod table;
mod tekscan;
mod units;
mod vendors;
mod writer;
mod xsensor;

use std::collections::VecDeque;
use std::fmt;
use std::io::{BufRead, ErrorKind};

use crate::foreign_format::{BEGIN, ForeignFormat, refused};
use crate::frame::{Frame, Stream};
use crate::mcap::Findings;
use chunks::Chunks;
use lines::{Dialect, Lines, quote};
use remarks::Remarks;
use taxel_ground::InputError;

pub(crate) use channels::base_name;
pub use chunks::Change;
pub use columns::{Columns, Taken};
pub(crate) use columns::{Role, Unit, column_name, column_names, time_unit, values_taken};
pub use description::{described_stream, description_of};
pub(crate) use roles::{Facts, Otherwise, TimeForm, decide, plain_unit};
pub use writer::ChannelWriter;

/// Most taxels of a recording, rows x columns; more is taken for a damaged
/// header.
pub(crate) const MOST_TAXELS: u64 = 1_000_000;

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
    /// Rows of numbers of another program, whose columns are recognised by their names and
    /// numbers or are said ([`RecordingOptions::columns`]). Without names it is only read where
    /// the device is known ([`RecordingOptions::bare`]) or the columns are said.
    Table,
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
    /// A file of another program.
    Foreign(ForeignFormat),
}

/// How a recording is opened.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordingOptions {
    /// True if rows of numbers without names are the channels of a device that is known.
    pub bare: bool,
    /// The sensor, topic, stream or data set to read of a file that holds several; the first
    /// sensor without.
    pub part: Option<String>,
    /// What columns or channels are, as far as it is said.
    pub columns: Columns,
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

/// The frames of a file of another program.
pub(crate) trait Frames: fmt::Debug + Send {
    fn stream(&self) -> &Stream;
    /// Names of the parts of the file.
    fn parts(&self) -> &[String];
    fn taken(&self) -> &Taken;
    fn format(&self) -> ForeignFormat;
    fn read(&mut self) -> Result<Option<Frame>, RecordingError>;
}

/// Text, chunks, or what another program wrote.
#[derive(Debug)]
enum Body<R> {
    Foreign(Box<dyn Frames>),
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
    Table(Box<table::Decoder>),
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
        Self::open_any(file, reader, &RecordingOptions::default())
    }

    /// Like [`Recording::open`], for the sensor called `sensor` of a file that
    /// holds several (see [`Format::Xsensor`]).
    ///
    /// # Errors
    /// Those of [`Recording::open`]; [`RecordingError::Input`] naming the
    /// sensors of the file if none is called so.
    pub fn open_sensor(file: &str, reader: R, sensor: &str) -> Result<Self, RecordingError> {
        let part = Some(sensor.to_owned());
        let options = RecordingOptions {
            part,
            ..RecordingOptions::default()
        };
        Self::open_any(file, reader, &options)
    }

    /// Like [`Recording::open`], as `options` say.
    ///
    /// # Errors
    /// Those of [`Recording::open`]; [`RecordingError::Input`] if the file has not what the
    /// options ask for.
    pub fn open_with(
        file: &str,
        reader: R,
        options: &RecordingOptions,
    ) -> Result<Self, RecordingError> {
        Self::open_any(file, reader, options)
    }

    fn open_any(
        file: &str,
        mut reader: R,
        options: &RecordingOptions,
    ) -> Result<Self, RecordingError> {
        let wanted = options.part.as_deref();
        let (in_chunks, foreign) = loop {
            match reader.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                begin => {
                    let begin = begin?;
                    let begun = &begin[..begin.len().min(BEGIN)];
                    break (chunks::recognises(begin), ForeignFormat::of(begun));
                }
            }
        };
        if let Some(foreign) = foreign {
            return Err(refused(file, foreign).into());
        }
        if !in_chunks {
            return Self::open_text(file, reader, options);
        }
        if !options.columns.is_empty() {
            return Err(no_columns(file, Format::Chunks).into());
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
        Self::open_text(file, reader, &RecordingOptions::default())
    }

    fn open_text(
        file: &str,
        reader: R,
        options: &RecordingOptions,
    ) -> Result<Self, RecordingError> {
        let wanted = options.part.as_deref();
        let mut lines = Lines::new(file, reader);
        let (found, remarks) = recognise(&mut lines, options)?;
        let opened = match found {
            Found::Table(layout, otherwise) => {
                layout.open(&mut lines, &options.columns, otherwise, &remarks)
            }
            Found::Channels => channels::open(&mut lines, &remarks),
            Found::Tekscan => tekscan::open(&mut lines),
            Found::Xsensor => xsensor::open(&mut lines, wanted),
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

    /// The frames of a file of another program.
    pub(crate) fn foreign(frames: Box<dyn Frames>) -> Self {
        Self {
            body: Body::Foreign(frames),
            delivered: 0,
            finished: false,
        }
    }

    /// Meaning of the frames: shape, unit, pitch (m), period (s), threshold.
    pub fn stream(&self) -> &Stream {
        match &self.body {
            Body::Text(text) => &text.stream,
            Body::Chunks(chunks) => chunks.stream(),
            Body::Foreign(foreign) => foreign.stream(),
        }
    }

    /// The kind of file.
    pub fn format(&self) -> Format {
        match &self.body {
            Body::Chunks(_) => Format::Chunks,
            Body::Foreign(foreign) => Format::Foreign(foreign.format()),
            Body::Text(text) => match text.decoder {
                Decoder::Table(_) => Format::Table,
                Decoder::Channels(_) => Format::Channels,
                Decoder::Tekscan(_) => Format::Tekscan,
                Decoder::Xsensor(_) => Format::Xsensor,
            },
        }
    }

    /// Names of the sensors in the file, in its order; the one delivered is
    /// [`Stream::name`]. More than one only in [`Format::Xsensor`] and files of other programs.
    pub fn sensors(&self) -> &[String] {
        match &self.body {
            Body::Text(text) => &text.sensors,
            Body::Chunks(chunks) => std::slice::from_ref(&chunks.stream().name),
            Body::Foreign(foreign) => foreign.parts(),
        }
    }

    /// What stands before the frame that was delivered last, or before the end, the oldest
    /// first, each once; only a recording in chunks ([`Format::Chunks`]) and a table with a
    /// second header have it.
    pub fn take_changes(&mut self) -> VecDeque<Change> {
        match &mut self.body {
            Body::Text(text) => match &mut text.decoder {
                Decoder::Table(table) => table.take_changes(),
                _ => VecDeque::new(),
            },
            Body::Chunks(chunks) => chunks.take_changes(),
            Body::Foreign(_) => VecDeque::new(),
        }
    }

    /// What was found in a recording in chunks so far, with its attachments.
    pub fn findings(&self) -> Option<&Findings> {
        match &self.body {
            Body::Text(_) | Body::Foreign(_) => None,
            Body::Chunks(chunks) => Some(chunks.findings()),
        }
    }

    /// What was taken for what, in a file whose columns or channels do not say it themselves.
    pub fn taken(&self) -> Option<Taken> {
        match &self.body {
            Body::Text(text) => match &text.decoder {
                Decoder::Table(table) => Some(table.taken()),
                Decoder::Channels(decoder) => Some(decoder.taken(&text.stream)),
                _ => None,
            },
            Body::Chunks(_) => None,
            Body::Foreign(foreign) => Some(foreign.taken().clone()),
        }
    }

    fn read(&mut self) -> Result<Option<Frame>, RecordingError> {
        let text = match &mut self.body {
            Body::Chunks(chunks) => return chunks.read(),
            Body::Foreign(foreign) => return foreign.read(),
            Body::Text(text) => text,
        };
        match &mut text.decoder {
            Decoder::Table(decoder) => decoder.read(&mut text.lines),
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
            Self::Foreign(foreign) => return foreign.fmt(f),
            Self::Table => "table of another program",
            Self::Channels => "raw channels (CSV)",
            Self::Tekscan => "Tekscan (I-Scan CSV or F-Scan ASF)",
            Self::Xsensor => "XSENSOR (CSV)",
            Self::Chunks => "recording of taxel (MCAP)",
        })
    }
}

/// A format in lines.
enum Found {
    Table(table::Layout, Otherwise),
    Channels,
    Tekscan,
    Xsensor,
}

/// Reads to the first line that is no comment and leaves it to be read again; with what the
/// comments said.
fn recognise<R: BufRead>(
    lines: &mut Lines<R>,
    options: &RecordingOptions,
) -> Result<(Found, Remarks), RecordingError> {
    let mut remarks = Remarks::default();
    let mut comment = String::new();
    loop {
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
                "the file is binary",
            )
            .help("save it as plain CSV text in UTF-8; bytes as a board sent them are played with its board file (--board)")
            .into());
        }
        if channels::is_comment(text) {
            text.clone_into(&mut comment);
            remarks.read(lines)?;
        } else if !Dialect::of_line(text).is_blank(text) {
            break;
        }
    }
    let text = lines.text();
    if let Some(refusal) = vendors::refused_log(lines.file(), text) {
        return Err(refusal.into());
    }
    let vendor = if tekscan::recognises(text) {
        Some((Found::Tekscan, Format::Tekscan))
    } else if xsensor::recognises(text) {
        Some((Found::Xsensor, Format::Xsensor))
    } else {
        None
    };
    let said = !options.columns.is_empty();
    let is_own = vendor.is_none() && channels::recognises(text);
    lines.again();
    let found = match vendor {
        Some((_, format)) if said => return Err(no_columns(lines.file(), format).into()),
        Some((found, _)) => found,
        None if is_own && !said => Found::Channels,
        None => match table::Layout::of(lines, &comment) {
            Some(layout) if !layout.is_bare() => Found::Table(layout, Otherwise::Raw),
            Some(layout) if options.bare => Found::Table(layout, Otherwise::Bare),
            Some(layout) if said => Found::Table(layout, Otherwise::Counts),
            _ => {
                // The line that messages show is the first one.
                lines.advance()?;
                return Err(unrecognised(lines).into());
            }
        },
    };
    Ok((found, remarks))
}

/// The refusal of columns for a file that says itself what its numbers are.
fn no_columns(file: &str, format: Format) -> InputError {
    InputError::whole(
        file,
        format!("--columns: a file of {format} says itself what its numbers are"),
    )
    .help("leave it out")
}

const KNOWN_FORMATS: &str = "a recording is one of\n  \
     raw channels: a header line such as `time [s],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],r0c0.22 [fF]` or `time [s],r0c0 [kPa]`, then one line of numbers per frame\n  \
     Tekscan I-Scan CSV or F-Scan ASF: begins with `DATA_TYPE MOVIE`\n  \
     XSENSOR CSV: begins with `File:,` and the name of the XSN file\n  \
     MCAP that taxel live --record has written\n  \
     a table with names above its columns, of which one is a time";

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
             column, or say it with --columns \"time=1[s],value=2-5\"\n{KNOWN_FORMATS}"
        ))
    } else {
        error.help(KNOWN_FORMATS)
    }
}

fn no_such_sensor(file: &str, wanted: &str, sensors: &[String]) -> InputError {
    no_such_part(file, wanted, &sensors.join(", "))
}

/// The refusal of a part that a file has not.
pub(crate) fn no_such_part(file: &str, wanted: &str, has: &str) -> InputError {
    InputError::whole(
        file,
        format!("the recording has no sensor {}", quote(wanted)),
    )
    .help(format!("it has {has}"))
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
