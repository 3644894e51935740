//! Writes raw channels.

use std::fmt::Write as _;
use std::io::{Error, ErrorKind, Result, Write};

use super::channels::{AXES, CAPACITORS};
use super::units;
use crate::frame::{Frame, SignalUnit, Stream};

/// Writes frames as raw channels, the CSV that [`super::Recording`] reads.
///
/// ```text
/// # any comment
/// sequence,time [ns],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],r0c0.22 [fF],r0c1.11 [fF],...
/// 0,0,120.5,119.25,121,nan,118,...
/// ```
///
/// A channel is named by row, column and, in a taxel of four, capacitor:
/// `r<row>c<column>.<capacitor>` with 11, 12, 21, 22, in a taxel of three forces
/// `r<row>c<column>.<axis>` with x, y, z, or `r<row>c<column>` in
/// taxels of one channel. Units stand in brackets: a capacitance, voltage, resistance,
/// charge, force or pressure, `counts` or `raw`. What may differ in a file that is read: the order of the
/// columns; `time` in s, ms, us or ns; no `sequence`, then lines are counted
/// from 0; an empty field for `nan`; semicolons or tabs between fields, then
/// with decimal points or commas; quotes around fields; blank lines. A last
/// line without line end is taken if it has all its fields and the last one is
/// not empty; if the file was cut inside that last number, this cannot be seen.
///
/// Times are written in whole ns, and a value in the fewest digits from which
/// reading gives the very same number. Where the unit is not SI itself there
/// are doubles that no text in that unit gives; these come back off by one
/// unit in the last place. Whatever was read in the same unit comes back bit
/// for bit.
///
/// Comments of the form `# key = value` before the header line say more of the channels:
///
/// | comment | meaning |
/// |---|---|
/// | `# pitch = 1.27 mm`, `# pitch = 5 mm x 7 mm` | spacing of the taxels, or of rows and of columns |
/// | `# unit = 0.35 kPa` | what 1 is in a file of `raw` or `counts`: a pressure or a force |
/// | `# quantity = force` | the quantity, as a check of the units |
/// | `# threshold = 2 kPa` | readings up to this are noise |
///
/// The pitch and the threshold of a stream are written so; its name, period and `present`
/// have no place in the file: a channel that does not exist is written as `nan`.
///
/// # Example
/// ```
/// use taxel_recording::{ChannelWriter, Recording};
///
/// let text = "time [s],r0c0 [kPa]\n0.5,1.5\n";
/// let mut recording = Recording::open("a.csv", text.as_bytes())?;
/// let mut writer = ChannelWriter::new(Vec::new(), recording.stream(), &["from a.csv".to_owned()])?;
/// for frame in &mut recording {
///     writer.write(&frame?)?;
/// }
/// assert_eq!(writer.into_inner(), b"# from a.csv\nsequence,time [ns],r0c0 [kPa]\n0,500000000,1.5\n");
/// # Ok::<(), taxel_recording::RecordingError>(())
/// ```
#[derive(Debug)]
pub struct ChannelWriter<W> {
    writer: W,
    si_per_unit: f64,
    channels: usize,
    line: String,
}

impl<W: Write> ChannelWriter<W> {
    /// Writes `comments`, one or more lines each, and the header line.
    ///
    /// # Errors
    /// Those of `writer`; [`ErrorKind::InvalidInput`] if `stream` has taxels
    /// of other than 1, 3 or 4 channels, or a unit that a recording cannot have.
    pub fn new(writer: W, stream: &Stream, comments: &[String]) -> Result<Self> {
        let per_taxel = stream.channels_per_taxel;
        let names: &[&str] = match per_taxel {
            1 => &[""],
            3 => &AXES,
            4 => &CAPACITORS,
            _ => {
                return Err(invalid(format!(
                    "a taxel of {per_taxel} channels cannot be written; it can have 1, 3 or 4"
                )));
            }
        };
        if stream.channels() == 0 {
            return Err(invalid(
                "a stream without channels cannot be written".to_owned(),
            ));
        }
        let unit = written_unit(&stream.unit)?;
        let mut line = String::new();
        for comment in comments.iter().flat_map(|comment| comment.lines()) {
            line.push_str("# ");
            line.push_str(comment);
            line.push('\n');
        }
        if let Some([rows, columns]) = stream.pitch {
            let side = |metres| Number(shown(metres, 1e-3));
            let _ = if rows == columns {
                writeln!(line, "# pitch = {} mm", side(rows))
            } else {
                writeln!(line, "# pitch = {} mm x {} mm", side(rows), side(columns))
            };
        }
        if let Some(threshold) = stream.threshold {
            let threshold = Number(shown(threshold, unit.si_per_unit));
            let _ = writeln!(line, "# threshold = {threshold} {}", unit.symbol);
        }
        line.push_str("sequence,time [ns]");
        for row in 0..stream.rows {
            for column in 0..stream.columns {
                for name in names {
                    let _ = write!(line, ",r{row}c{column}");
                    if per_taxel > 1 {
                        let _ = write!(line, ".{name}");
                    }
                    let _ = write!(line, " [{}]", unit.symbol);
                }
            }
        }
        line.push('\n');
        let mut this = Self {
            writer,
            si_per_unit: unit.si_per_unit,
            channels: stream.channels(),
            line,
        };
        this.writer.write_all(this.line.as_bytes())?;
        Ok(this)
    }

    /// Writes one frame as one line.
    ///
    /// # Errors
    /// Those of the writer; [`ErrorKind::InvalidInput`], and nothing written,
    /// if the frame has another number of channels than the stream or an
    /// infinite value.
    pub fn write(&mut self, frame: &Frame) -> Result<()> {
        if frame.values.len() != self.channels {
            return Err(invalid(format!(
                "the frame has {} channels, the stream has {}",
                frame.values.len(),
                self.channels
            )));
        }
        self.line.clear();
        let _ = write!(self.line, "{},{}", frame.sequence, frame.time_ns);
        for (channel, &value) in frame.values.iter().enumerate() {
            if value.is_nan() {
                self.line.push_str(",nan");
                continue;
            }
            let shown = shown(value, self.si_per_unit);
            if !shown.is_finite() {
                return Err(invalid(format!(
                    "channel {channel} of frame {} is {value:e}, too large to be written",
                    frame.sequence
                )));
            }
            let _ = write!(self.line, ",{}", Number(shown));
        }
        self.line.push('\n');
        self.writer.write_all(self.line.as_bytes())
    }

    /// Writes out what the writer below still holds back.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn flush(&mut self) -> Result<()> {
        self.writer.flush()
    }

    /// The writer, as it is: not flushed.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// The unit as the decoder knows it, which must mean the same.
fn written_unit(unit: &SignalUnit) -> Result<SignalUnit> {
    units::find(&unit.symbol)
        .filter(|known| known.quantity == unit.quantity && known.si_per_unit == unit.si_per_unit)
        .ok_or_else(|| {
            let known = units::list(|quantity| quantity == unit.quantity);
            invalid(format!(
                "the unit {} of {} SI units cannot be written; use one of: {known}",
                unit.symbol, unit.si_per_unit
            ))
        })
}

/// The number with the fewest digits that, times `si_per_unit`, is `value`; the
/// nearest one if there is none.
fn shown(value: f64, si_per_unit: f64) -> f64 {
    let quotient = value / si_per_unit;
    let nearest = [quotient, quotient.next_up(), quotient.next_down()]
        .into_iter()
        .find(|shown| shown * si_per_unit == value);
    let fewer = [15, 16].into_iter().find_map(|digits| {
        let rounded = format!("{quotient:.*e}", digits - 1).parse::<f64>().ok()?;
        (rounded * si_per_unit == value).then_some(rounded)
    });
    fewer.or(nearest).unwrap_or(quotient)
}

/// Shows the shortest text that is read as the number.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(value) = *self;
        let size = value.abs();
        if size != 0.0 && !(1e-5..1e16).contains(&size) {
            write!(f, "{value:e}")
        } else {
            write!(f, "{value}")
        }
    }
}

fn invalid(message: String) -> Error {
    Error::new(ErrorKind::InvalidInput, message)
}
