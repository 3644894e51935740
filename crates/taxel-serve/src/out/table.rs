//! The estimates of every frame as a table: what a run estimates live, for later.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use taxel::estimation::{Meaning, State, Touch, TouchSession};

use super::frame::{Number, unit};
use crate::save::{SaveError, created};

/// A table (CSV) with one row for each frame: time, total force with its deviations, position
/// and depth of the contact, number of contacts, state. No frame is ever left out: the run
/// waits for the disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TouchTable {
    /// The file; none for the standard output.
    pub file: Option<PathBuf>,
}

/// Writes the table as the run goes.
pub(crate) struct TableWriter {
    path: PathBuf,
    out: BufWriter<Box<dyn Write + Send>>,
    rows: Rows,
}

/// Rows of the table.
pub(crate) struct Rows {
    /// True for a device whose values do not add up to newtons: their sum is a column.
    summed: bool,
    row: String,
    number: Number,
}

impl Rows {
    pub(crate) fn new(meaning: &Meaning) -> Self {
        Self {
            summed: meaning.adds_up(),
            row: String::new(),
            number: Number::new(),
        }
    }

    /// The first line.
    pub(crate) fn header(meaning: &Meaning) -> String {
        let summed = meaning.adds_up();
        let length = meaning.length_unit();
        let mut header = String::from("sequence,time [s]");
        for quantity in ["force", "moment"] {
            for axis in ["x", "y", "z"] {
                let name = format!("{quantity}_{axis}");
                let _ = match quantity {
                    "force" => write!(header, ",{name} [N],{name}_deviation [N]"),
                    _ => write!(header, ",{name} [N m],{name}_deviation [N m]"),
                };
            }
        }
        if summed {
            let _ = write!(header, ",sum [{}]", unit(&meaning.value.quantity).1);
        }
        for axis in ["x", "y"] {
            let _ = write!(header, ",{axis} [{length}],{axis}_deviation [{length}]");
        }
        header.push_str(",depth [m],depth_deviation [m],contacts,state,total_certainty,total_reason,zero_known,wrong_channels\n");
        header
    }

    /// The row of the frame that `session` has taken last.
    pub(crate) fn row(&mut self, session: &TouchSession) -> &str {
        let touch = session.estimator().touch();
        self.row.clear();
        let (row, number) = (&mut self.row, &mut self.number);
        let [seconds, rest] = [touch.time_ns / 1_000_000_000, touch.time_ns % 1_000_000_000];
        let _ = write!(row, "{},{seconds}.{rest:09}", touch.sequence);
        let deviation = touch.total_deviation();
        for (force, deviation) in touch.total.force.iter().zip(deviation) {
            number.field(row, *force);
            number.field(row, if force.is_nan() { f64::NAN } else { deviation });
        }
        for (moment, deviation) in touch.total.moment.iter().zip(touch.moment_deviation) {
            number.field(row, *moment);
            number.field(row, deviation);
        }
        if self.summed {
            number.field(row, touch.sum);
        }
        let unknown = ([f64::NAN; 2], [f64::NAN; 3]);
        let (centre, [xx, _, yy]) = touch.centre_of_pressure.unwrap_or(unknown);
        for (position, variance) in centre.into_iter().zip([xx, yy]) {
            number.field(row, position);
            number.field(row, variance.sqrt());
        }
        for value in touch.depth.unwrap_or([f64::NAN; 2]) {
            number.field(row, value);
        }
        let _ = write!(
            row,
            ",{},{},{},{},{},",
            touch.contacts.len(),
            state_of(touch).name(),
            touch.total_certainty.name(),
            touch.total_reason.map_or("", State::name),
            touch.zero_known
        );
        let channels = session.observer().health().channels().iter();
        let wrong = channels.zip(&session.meaning().channels);
        let mut parting = "";
        for (_, name) in wrong.filter(|(channel, _)| channel.condition.wrong()) {
            let name = name.replace([',', ';', '"', '\n', '\r'], " ");
            let _ = write!(row, "{parting}{name}");
            parting = ";";
        }
        row.push('\n');
        row
    }
}

/// Rows are written out when this much has gathered, bytes.
const BUFFER: usize = 1 << 16;

impl TableWriter {
    /// Opens the table and writes its first line; `replace` as for [`created`].
    pub(crate) fn create(
        table: &TouchTable,
        replace: bool,
        meaning: &Meaning,
    ) -> Result<Self, SaveError> {
        let path = table
            .file
            .clone()
            .unwrap_or_else(|| "standard output".into());
        let out: Box<dyn Write + Send> = match &table.file {
            Some(file) => Box::new(open(file, replace)?),
            None => Box::new(io::stdout()),
        };
        let mut writer = Self {
            path,
            out: BufWriter::with_capacity(BUFFER, out),
            rows: Rows::new(meaning),
        };
        writer.write(&Rows::header(meaning))?;
        Ok(writer)
    }

    /// Adds the frame that `session` has taken last.
    pub(crate) fn push(&mut self, session: &TouchSession) -> Result<(), SaveError> {
        let row = self.rows.row(session);
        let written = self.out.write_all(row.as_bytes());
        written.map_err(|cause| self.failed(&cause))
    }

    fn write(&mut self, text: &str) -> Result<(), SaveError> {
        let written = self.out.write_all(text.as_bytes());
        written.map_err(|cause| self.failed(&cause))
    }

    /// Writes out what is still held.
    pub(crate) fn finish(mut self) -> Result<(), SaveError> {
        let written = self.out.flush();
        written.map_err(|cause| self.failed(&cause))
    }

    fn failed(&self, cause: &io::Error) -> SaveError {
        SaveError::Write {
            path: self.path.clone(),
            message: cause.to_string(),
        }
    }
}

fn open(file: &Path, replace: bool) -> Result<File, SaveError> {
    created(file, replace).map_err(|cause| SaveError::Create {
        path: file.to_owned(),
        cause,
    })
}

/// The state of the taxels that is most against them; `ok` if nothing is against any that
/// is in use.
fn state_of(touch: &Touch) -> State {
    const GRAVEST: [State; 11] = [
        State::Faulty,
        State::NotConverged,
        State::Inconsistent,
        State::Ambiguous,
        State::OutOfRange,
        State::Saturated,
        State::Closed,
        State::BelowZero,
        State::Unchecked,
        State::Ok,
        State::Masked,
    ];
    let counts = touch.state_counts();
    let mut states = GRAVEST.into_iter();
    let found = states.find(|state| counts[*state as usize] > 0);
    found.unwrap_or(State::Masked)
}
