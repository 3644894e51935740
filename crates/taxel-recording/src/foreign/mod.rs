//! Recordings of other programs: bags of ROS, XDF of LabRecorder, arrays of NumPy, MATLAB and HDF5.
//!
//! Each is a file of named parts (topics, streams, data sets), each part a series of rows of
//! numbers with their times. One part is chosen and read as the frames of a [`Recording`]; which of
//! its numbers are readings is recognised, or said by [`Columns`].

mod array;
mod bag;
mod bytes;
mod bzip2;
mod definition;
mod hdf5;
mod matlab;
mod mcap;
mod messages;
mod sqlite;
mod unpack;
mod xdf;

use std::fmt;

use crate::foreign_format::ForeignFormat;
use crate::frame::{Frame, SignalUnit, Stream};
use crate::recording::{
    Columns, Frames, MOST_TAXELS, Otherwise, Recording, RecordingError, RecordingOptions, Role,
    Taken, TimeForm, Unit, base_name, column_name, column_names, decide, no_such_part, plain_unit,
    time_unit, values_taken,
};
use bytes::Bytes;
use taxel_ground::InputError;

pub use crate::foreign_format::BEGIN;
pub use bytes::Seekable;

/// A topic, a stream or a data set.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// Its name in the file.
    pub name: String,
    /// What it holds, such as `geometry_msgs/msg/WrenchStamped` or `float64 1200 x 16`.
    pub kind: String,
    /// Messages, samples or rows.
    pub count: u64,
    /// Rows per second, where the times are known without reading them all.
    pub rate: Option<f64>,
    /// Why it cannot be read as frames, where it cannot.
    pub unread: Option<String>,
}

impl Part {
    /// The mean rate of `count` rows between two times, ns.
    fn rate_of(count: u64, [first, last]: [u64; 2]) -> Option<f64> {
        let span = last.saturating_sub(first) as f64 * 1e-9;
        (count > 1 && span > 0.0).then(|| (count - 1) as f64 / span)
    }
}

/// A number of every row of a part.
#[derive(Debug, Clone, PartialEq, Default)]
struct Channel {
    name: String,
    unit: Option<SignalUnit>,
}

/// A part that was opened.
struct Series {
    channels: Vec<Channel>,
    /// Rows, columns and channels of a taxel, of all channels together.
    shape: Option<[usize; 3]>,
    rows: Box<dyn Rows>,
    times: Times,
}

/// Where the times of a part come from.
enum Times {
    /// With every row; in words.
    Own(String),
    /// From one of the channels: their first numbers, and how many of the channels are not of
    /// the part itself, which are no readings unless it is said.
    Channel { sample: Vec<Vec<f64>>, lent: usize },
}

/// The rows of a part, one after the other.
trait Rows: fmt::Debug + Send {
    /// Puts the next row into `values`; its time in ns, or 0 where a channel has it. `None` at the
    /// end.
    fn next(&mut self, values: &mut Vec<f64>) -> Result<Option<i128>, Fault>;
}

/// What ends the reading of a file before its end.
#[derive(Debug)]
enum Fault {
    Io(std::io::Error),
    /// The file ends too early.
    Cut(String),
    Wrong(String),
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// A file of parts.
trait Container: fmt::Debug + Send {
    fn parts(&self) -> &[Part];
    /// What of the file is not whole, in words.
    fn cut(&self) -> Option<String>;
    /// Opens a part that can be read.
    fn open(self: Box<Self>, at: usize) -> Result<Series, Fault>;
}

/// A recording of another program, of which a part is to be chosen.
///
/// # Example
/// ```
/// use std::io::Cursor;
/// use taxel_recording::foreign::ForeignFile;
/// use taxel_recording::{ForeignFormat, Recording, RecordingOptions};
///
/// // numpy.save of [[0.5, 7.0], [0.6, 8.0]]
/// let head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }\n";
/// let mut file = b"\x93NUMPY\x01\x00".to_vec();
/// file.extend_from_slice(&(head.len() as u16).to_le_bytes());
/// file.extend_from_slice(head);
/// for number in [0.5_f64, 7.0, 0.6, 8.0] {
///     file.extend_from_slice(&number.to_le_bytes());
/// }
/// let files = vec![("a.npy".to_owned(), Box::new(Cursor::new(file)) as _)];
/// let found = ForeignFile::open("a.npy", ForeignFormat::Npy, files)?;
/// assert_eq!(found.parts()[0].kind, "float64 2 x 2");
/// let options = RecordingOptions { columns: "time=1[s]".parse().unwrap(), ..Default::default() };
/// let mut recording: Recording<&[u8]> = Recording::of_foreign(found, &options)?;
/// assert_eq!(recording.next().unwrap()?.values, [7.0]);
/// # Ok::<(), taxel_recording::RecordingError>(())
/// ```
#[derive(Debug)]
pub struct ForeignFile {
    file: String,
    format: ForeignFormat,
    container: Box<dyn Container>,
}

impl ForeignFile {
    /// Reads what the file holds; `file` is the name by which errors call it, `files` are the
    /// files that it consists of, with their names: more than one only of a bag that was split.
    ///
    /// # Errors
    /// [`RecordingError::Input`] if the file is not of this kind, [`RecordingError::Io`] if it
    /// cannot be read.
    pub fn open(
        file: &str,
        format: ForeignFormat,
        files: Vec<(String, Box<dyn Seekable>)>,
    ) -> Result<Self, RecordingError> {
        let wrong = |fault: Fault| refusal(file, format, fault, 0);
        let mut all = Vec::new();
        for (_, reader) in files {
            all.push(Bytes::new(reader)?);
        }
        let first = |all: Vec<Bytes>| {
            let missing = || Fault::Wrong("there is no file in it".into());
            all.into_iter().next().ok_or_else(missing)
        };
        let container: Result<Box<dyn Container>, Fault> = match format {
            ForeignFormat::Mcap | ForeignFormat::Sqlite | ForeignFormat::Bag => all
                .into_iter()
                .map(|bytes| messages_of(format, bytes))
                .collect::<Result<_, _>>()
                .and_then(messages::Bags::of),
            ForeignFormat::Xdf => first(all).and_then(xdf::open),
            ForeignFormat::Npy => first(all).and_then(array::open_npy),
            ForeignFormat::Npz => first(all).and_then(array::open_npz),
            ForeignFormat::Hdf5 => first(all).and_then(hdf5::open),
            ForeignFormat::Mat => first(all).and_then(matlab::open),
            ForeignFormat::Mat4 => first(all).and_then(matlab::open_4),
        };
        Ok(Self {
            file: file.to_owned(),
            format,
            container: container.map_err(wrong)?,
        })
    }

    /// The kind of the file.
    pub fn format(&self) -> ForeignFormat {
        self.format
    }

    /// What it holds.
    pub fn parts(&self) -> &[Part] {
        self.container.parts()
    }

    /// What of the file is not whole, in words.
    pub fn cut(&self) -> Option<String> {
        self.container.cut()
    }

    /// The part that is asked for, by name or from 1 on; the only one that can be read without.
    fn chosen(&self, wanted: Option<&str>) -> Result<usize, InputError> {
        let parts = self.parts();
        let whole = |message: String| InputError::whole(&self.file, message);
        let readable = |part: &Part| part.unread.is_none() && part.count > 0;
        let listed = || {
            let names = parts
                .iter()
                .filter(|part| readable(part))
                .map(|part| &*part.name);
            names.collect::<Vec<_>>().join(", ")
        };
        if let Some(wanted) = wanted {
            let numbered = || {
                wanted
                    .parse::<usize>()
                    .ok()?
                    .checked_sub(1)
                    .filter(|at| *at < parts.len())
            };
            let found = parts
                .iter()
                .position(|part| part.name == wanted)
                .or_else(numbered);
            let at = found.ok_or_else(|| no_such_part(&self.file, wanted, &listed()))?;
            return match &parts[at].unread {
                Some(why) => Err(whole(format!(
                    "{} cannot be read as frames: {why}",
                    parts[at].name
                ))),
                None => Ok(at),
            };
        }
        let mut found = (0..parts.len()).filter(|at| readable(&parts[*at]));
        match (found.next(), found.next()) {
            (Some(only), None) => Ok(only),
            (Some(_), Some(_)) => Err(whole(format!("it holds several series: {}", listed()))
                .help("choose one with --part NAME; taxel recording inspect FILE lists them all")),
            (None, _) => {
                let why = parts.iter().find_map(|part| part.unread.clone());
                let why = why.or_else(|| self.cut());
                let why = why.unwrap_or_else(|| "it holds no message, sample or row".into());
                Err(whole(format!(
                    "this is {}, but nothing in it can be read as frames: {why}",
                    self.format
                ))
                .help("taxel recording inspect FILE lists what it holds"))
            }
        }
    }
}

/// The messages of one file of a bag.
fn messages_of(format: ForeignFormat, bytes: Bytes) -> Result<Box<dyn messages::Messages>, Fault> {
    Ok(match format {
        ForeignFormat::Sqlite => Box::new(sqlite::BagDatabase::open(bytes)?),
        ForeignFormat::Bag => Box::new(bag::BagFile::open(bytes)?),
        _ => Box::new(mcap::McapFile::new(bytes)),
    })
}

/// A fault as the error of a recording after so many frames.
fn refusal(
    file: &str,
    format: ForeignFormat,
    fault: Fault,
    complete_frames: u64,
) -> RecordingError {
    match fault {
        Fault::Io(error) => error.into(),
        Fault::Wrong(message) => InputError::whole(file, format!("{format}: {message}")).into(),
        Fault::Cut(message) => RecordingError::Truncated {
            error: InputError::whole(file, format!("{format}: {message}")),
            complete_frames,
        },
    }
}

/// The frames of a part.
#[derive(Debug)]
struct Foreign {
    file: String,
    format: ForeignFormat,
    stream: Stream,
    names: Vec<String>,
    taken: Taken,
    rows: Box<dyn Rows>,
    /// Channel and SI value of a number of each value of a frame.
    values: Vec<(usize, f64)>,
    channels: usize,
    /// Channel of the time and its unit, 10^n ns.
    time: Option<(usize, i32)>,
    /// Frames per second, where neither rows nor channels have times.
    rate: Option<f64>,
    sequence: Option<usize>,
    row: Vec<f64>,
    read: u64,
    origin_ns: Option<i128>,
    cut: Option<String>,
}

impl Foreign {
    fn open(found: ForeignFile, options: &RecordingOptions) -> Result<Self, RecordingError> {
        let at = found.chosen(options.part.as_deref())?;
        let ForeignFile {
            file,
            format,
            container,
        } = found;
        let part = container.parts()[at].clone();
        let names = container
            .parts()
            .iter()
            .map(|part| part.name.clone())
            .collect();
        let cut = container.cut();
        let series = container
            .open(at)
            .map_err(|fault| refusal(&file, format, fault, 0))?;
        let channels = series.channels.len();
        if channels == 0 || channels > 4 * MOST_TAXELS as usize {
            let message = format!("{} has {channels} numbers a row", part.name);
            return Err(InputError::whole(&file, message).into());
        }
        let wrong = |(message, help): (String, String)| {
            InputError::whole(&file, format!("{}: {message}", part.name)).help(help)
        };
        let chosen = series.choose(&options.columns).map_err(wrong)?;
        let count = chosen.values.len();
        let [rows, columns, channels_per_taxel] = chosen.shape;
        let stream = Stream {
            name: format!("{} {}", base_name(&file), part.name),
            rows,
            columns,
            channels_per_taxel,
            unit: chosen.unit,
            pitch: None,
            period: chosen.rate.map(f64::recip),
            threshold: None,
            present: vec![true; count],
        };
        let mut taken = chosen.taken;
        taken.values = format!(
            "{} of {} ({}), {}",
            part.name,
            base_name(&file),
            part.kind,
            taken.values
        );
        Ok(Self {
            file,
            format,
            stream,
            names,
            taken,
            rows: series.rows,
            values: chosen.values,
            channels,
            time: chosen.time,
            rate: chosen.rate,
            sequence: chosen.sequence,
            row: Vec::new(),
            read: 0,
            origin_ns: None,
            cut,
        })
    }
}

impl Frames for Foreign {
    fn stream(&self) -> &Stream {
        &self.stream
    }

    fn parts(&self) -> &[String] {
        &self.names
    }

    fn taken(&self) -> &Taken {
        &self.taken
    }

    fn format(&self) -> ForeignFormat {
        self.format
    }

    fn read(&mut self) -> Result<Option<Frame>, RecordingError> {
        self.row.clear();
        let fault = |this: &Self, fault| refusal(&this.file, this.format, fault, this.read);
        let next = match self.rows.next(&mut self.row) {
            Ok(next) => next,
            Err(error) => return Err(fault(self, error)),
        };
        let Some(time) = next else {
            return match self.cut.take() {
                Some(cut) => Err(fault(self, Fault::Cut(cut))),
                None => Ok(None),
            };
        };
        let wrong = |message: String| Fault::Wrong(format!("row {}: {message}", self.read + 1));
        if self.row.len() != self.channels {
            let message = format!(
                "{} numbers, the first one has {}",
                self.row.len(),
                self.channels
            );
            return Err(fault(self, wrong(message)));
        }
        let time = match (self.rate, self.time) {
            (Some(rate), _) => Some((self.read as f64 * 1e9 / rate).round() as i128),
            (None, None) => Some(time),
            (None, Some((at, power))) => nanoseconds(self.row[at], power),
        };
        // Times that begin before a trigger count from the first row.
        let time = time.and_then(|time| {
            let origin = *self.origin_ns.get_or_insert(time.min(0));
            u64::try_from(time - origin).ok()
        });
        let Some(time_ns) = time else {
            return Err(fault(
                self,
                wrong("it has no time from that of the first row on".into()),
            ));
        };
        let sequence = match self.sequence {
            None => self.read,
            Some(at) => {
                let number = self.row[at];
                if !(number >= 0.0 && number.fract() == 0.0 && number < 2_f64.powi(64)) {
                    return Err(fault(self, wrong(format!("{number} is no running number"))));
                }
                number as u64
            }
        };
        let value = |(at, scale): &(usize, f64)| {
            let value = self.row[*at] * scale;
            if value.is_finite() { value } else { f64::NAN }
        };
        let values = self.values.iter().map(value).collect();
        self.read += 1;
        Ok(Some(Frame {
            sequence,
            time_ns,
            values,
            ..Frame::default()
        }))
    }
}

/// A number of units of 10^`power` ns, in ns.
fn nanoseconds(value: f64, power: i32) -> Option<i128> {
    // Whole numbers of ms or us keep every digit.
    if value.fract() == 0.0 && value.abs() < 2_f64.powi(53) {
        return Some(value as i128 * 10_i128.pow(power.unsigned_abs()));
    }
    let time = value * 10_f64.powi(power);
    (time.is_finite() && time.abs() < 2_f64.powi(64)).then(|| time.round() as i128)
}

/// What the channels of a part are taken for.
struct Chosen {
    values: Vec<(usize, f64)>,
    shape: [usize; 3],
    unit: SignalUnit,
    time: Option<(usize, i32)>,
    rate: Option<f64>,
    sequence: Option<usize>,
    taken: Taken,
}

impl Series {
    fn choose(&self, columns: &Columns) -> Result<Chosen, (String, String)> {
        let names: Vec<&str> = self.channels.iter().map(|channel| &*channel.name).collect();
        match &self.times {
            Times::Own(clock) => self.choose_timed(columns, &names, clock),
            Times::Channel { sample, lent } => {
                let mut facts = vec![crate::recording::Facts::default(); names.len()];
                for row in sample {
                    for (facts, value) in facts.iter_mut().zip(row) {
                        if value.is_finite() {
                            facts.number(*value);
                        }
                    }
                }
                let roles = decide(&names, &facts, columns, Otherwise::Raw, *lent)?;
                let whole = roles.values.len() + lent == names.len()
                    && roles.values.iter().all(|(at, _)| at >= lent);
                let shape = match self.shape {
                    Some(shape) if whole && roles.shape[0] == 1 => shape,
                    _ => roles.shape,
                };
                let power = |form| match form {
                    TimeForm::Number(power) => power,
                    TimeForm::Date => 9,
                };
                let mut taken = roles.taken;
                if shape != roles.shape {
                    let [rows, columns, each] = shape;
                    taken.values = format!("{} as {rows} x {columns} x {each}", taken.values);
                }
                Ok(Chosen {
                    values: roles.values,
                    shape,
                    unit: roles.unit,
                    time: roles.time.map(|(at, form)| (at, power(form))),
                    rate: columns.rate(),
                    sequence: roles.sequence,
                    taken,
                })
            }
        }
    }

    /// Of a part whose rows have times; numbers whose unit is known come first.
    fn choose_timed(
        &self,
        columns: &Columns,
        names: &[&str],
        clock: &str,
    ) -> Result<Chosen, (String, String)> {
        let said = columns
            .of(names)
            .map_err(|message| (format!("--columns: {message}"), String::new()))?;
        let role = |role: Role| said.iter().position(|one| one.role == Some(role));
        let (time, sequence) = (role(Role::Time), role(Role::Sequence));
        let time = time.map(|at| {
            if let Some(Unit::Time(power)) = said[at].unit {
                return Ok((at, power));
            }
            let column = column_name(at, names[at]);
            let message = format!("the unit of the time, {column}, is not stated");
            Err((
                message,
                format!("say it with --columns \"time={}[ms]\"", at + 1),
            ))
        });
        let time = time.transpose()?;
        let unit = |at: usize| match &said[at].unit {
            Some(Unit::Value(unit)) => Some(unit.clone()),
            _ => self.channels[at].unit.clone(),
        };
        let quantity = |at: usize| unit(at).map(|unit| unit.quantity);
        let any = (0..names.len()).find_map(quantity);
        let is_value = |at: &usize| match said[*at].role {
            Some(Role::Value) => true,
            Some(_) => false,
            // Of a wrench the forces: torques are of another quantity.
            None => !columns.names_values() && (any.is_none() || quantity(*at) == any),
        };
        let values: Vec<usize> = (0..names.len()).filter(is_value).collect();
        let Some(first) = values.first() else {
            return Err(("no channel is left to be a reading".into(), String::new()));
        };
        if let Some(other) = values.iter().find(|at| quantity(**at) != quantity(*first)) {
            let message = format!(
                "{} and {} are of different quantities",
                names[*first], names[*other]
            );
            return Err((message, "choose with --columns value=...".into()));
        }
        let plain = plain_unit(Otherwise::Raw);
        let scale = |at: &usize| (*at, unit(*at).map_or(1.0, |unit| unit.si_per_unit));
        let axes = ["x", "y", "z"]
            .iter()
            .zip(&values)
            .all(|(axis, at)| names[*at].ends_with(&format!(".{axis}")));
        let shape = match self.shape {
            Some(shape) if values.len() == names.len() => shape,
            _ if values.len() == 3 && axes => [1, 1, 3],
            _ => [1, values.len(), 1],
        };
        let rest: Vec<usize> = (0..names.len())
            .filter(|at| {
                !values.contains(at)
                    && Some(*at) != sequence
                    && time.is_none_or(|(time, _)| time != *at)
            })
            .collect();
        let unit = unit(*first).unwrap_or(plain);
        Ok(Chosen {
            taken: Taken {
                time: match (columns.rate(), time) {
                    (Some(rate), _) => format!("none; frames come at {rate} Hz as said"),
                    (None, None) => clock.to_owned(),
                    (None, Some((at, power))) => format!(
                        "{} in {}, as said",
                        column_name(at, names[at]),
                        time_unit(power)
                    ),
                },
                sequence: sequence.map_or_else(
                    || "none, rows are counted".into(),
                    |at| format!("{}, as said", column_name(at, names[at])),
                ),
                values: values_taken(&column_names(&values, names), shape, &unit),
                ignored: column_names(&rest, names),
            },
            values: values.iter().map(scale).collect(),
            shape,
            unit,
            time,
            rate: columns.rate(),
            sequence,
        })
    }
}

impl<R: std::io::BufRead> Recording<R> {
    /// The frames of a part of a file of another program: the one that `options` name, else the
    /// only one that can be read.
    ///
    /// # Errors
    /// [`RecordingError::Input`] if there is no such part, several without a name, or its
    /// channels are not those that the options say.
    pub fn of_foreign(
        file: ForeignFile,
        options: &RecordingOptions,
    ) -> Result<Self, RecordingError> {
        Foreign::open(file, options).map(|frames| Self::foreign(Box::new(frames)))
    }
}
