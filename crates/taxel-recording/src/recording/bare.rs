//! Rows of numbers without a header: the time of the host in s, then the
//! channels of a device that is described elsewhere.

use std::io::BufRead;

use super::lines::{Dialect, Field, Lines, quote};
use super::{Opened, RecordingError, channels};
use crate::frame::{Frame, Quantity, SignalUnit, Stream};
use taxel_ground::InputError;

/// Time to ns: 10⁹.
const SECONDS: i32 = 9;

#[derive(Debug)]
pub(super) struct Decoder {
    dialect: Dialect,
    channels: usize,
    row: u64,
}

/// True if `line` is such a row: a time and at least one channel.
pub(super) fn recognises(line: &str) -> bool {
    let dialect = Dialect::of_line(line);
    let mut fields = dialect.fields(line);
    let time = fields.next().and_then(|field| reading(&dialect, field.raw));
    let mut rest = fields.map(|field| reading(&dialect, field.raw));
    time.is_some_and(f64::is_finite)
        && rest.clone().next().is_some()
        && rest.all(|value| value.is_some())
}

/// A number, or `NaN` for the cell `nan` or an empty one.
fn reading(dialect: &Dialect, text: &str) -> Option<f64> {
    if text.is_empty() || text.eq_ignore_ascii_case("nan") {
        return Some(f64::NAN);
    }
    dialect.clone().number(text)
}

/// The first row is read again as the first frame.
pub(super) fn open<R: BufRead>(lines: &mut Lines<R>) -> Result<Opened, RecordingError> {
    if !lines.advance()? {
        return Err(lines.truncated("there is no row"));
    }
    let dialect = Dialect::of_line(lines.text());
    // A spreadsheet may have padded the rows.
    let filled = |(at, field): (usize, Field<'_>)| (!field.raw.is_empty()).then_some(at);
    let channels = dialect
        .fields(lines.text())
        .enumerate()
        .filter_map(filled)
        .last()
        .unwrap_or(0);
    lines.again();
    let stream = Stream {
        name: channels::base_name(lines.file()).to_owned(),
        rows: 1,
        columns: channels,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Counts,
            symbol: "counts".into(),
            si_per_unit: 1.0,
        },
        pitch: None,
        period: None,
        threshold: None,
        present: vec![true; channels],
    };
    Ok(Opened {
        sensors: vec![stream.name.clone()],
        stream,
        decoder: super::Decoder::Bare(Decoder {
            dialect,
            channels,
            row: 0,
        }),
    })
}

impl Decoder {
    pub(super) fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<Frame>, RecordingError> {
        if !lines.advance_to_row(&self.dialect)? {
            return Ok(None);
        }
        let rest = self.dialect.fields(lines.text()).skip(1 + self.channels);
        let padding = rest.take_while(|field| field.raw.is_empty()).count();
        let found = self.dialect.fields(lines.text()).count() - padding;
        let expected = self.channels + 1;
        if found < expected {
            let error = lines.line_error(format!(
                "the row has {found} numbers, the first one has {expected}"
            ));
            return Err(lines.fault(error.help("a row is the time in s and all channels")));
        }
        if found > expected {
            let error = lines.line_error(format!(
                "the row has {found} numbers, the first one has {expected}"
            ));
            return Err(error.help("a row is the time in s and all channels").into());
        }
        let frame = self.frame(lines)?;
        self.row += 1;
        Ok(Some(frame))
    }

    fn frame<R: BufRead>(&mut self, lines: &Lines<R>) -> Result<Frame, RecordingError> {
        let dialect = self.dialect.clone();
        let mut frame = Frame {
            sequence: self.row,
            time_ns: 0,
            values: Vec::with_capacity(self.channels),
            ..Frame::default()
        };
        let fields = dialect.fields(lines.text()).take(1 + self.channels);
        for (at, field) in fields.enumerate() {
            let wrong = |what: &str| -> InputError {
                let message = format!("{} is not {what}", quote(field.raw));
                lines
                    .error_at(field.raw, message)
                    .help(self.dialect.number_hint())
            };
            if at == 0 {
                frame.time_ns = self
                    .dialect
                    .clone()
                    .scaled_integer(field.raw, SECONDS)
                    .ok_or_else(|| wrong("a time in s, which must not be negative"))?;
                continue;
            }
            let value = reading(&dialect, field.raw);
            let value = value.ok_or_else(|| {
                // Only the last field of a line can have been cut.
                let error = wrong("a number");
                if at == self.channels {
                    lines.fault(error)
                } else {
                    error.into()
                }
            })?;
            frame.values.push(value);
        }
        Ok(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Recording;

    #[test]
    fn empty_fields_behind_all_rows_are_no_channels() {
        let frames = |text: &str| -> Vec<_> {
            let recording = Recording::open_bare("s.csv", text.as_bytes()).unwrap();
            recording.map(Result::unwrap).collect()
        };
        let plain = frames("0.5,1,2\n0.6,1.5,3\n");
        assert_eq!(frames("0.5,1,2,,\n0.6,1.5,3,,\n"), plain);
        assert_eq!(frames("0,5;1;2;\n0,6;1,5;3;\n"), plain);
        let wider = Recording::open_bare("s.csv", "0,1,2,\n1,1,2,9\n".as_bytes()).unwrap();
        let error = wider.last().unwrap().unwrap_err().to_string();
        assert!(
            error.contains("has 4 numbers, the first one has 3"),
            "{error}"
        );
    }
}
