//! Text export of Tekscan I-Scan and F-Scan.
//!
//! Lines `KEY value` up to `ASCII_DATA @@`, then for each frame a line
//! `Frame N` or `Frame N, seconds,, date,,,Raw Sum=,,sum` and one line of
//! readings for each row, at last the mark `@@`. Commas part the readings, or
//! where a spreadsheet has saved the file again semicolons or tabs, and then
//! `0,5` may be a number.

use std::io::BufRead;

use super::lines::{Dialect, Lines, number, quote};
use super::{Opened, RecordingError, shape_fault, side, spacing, units};
use crate::frame::{Frame, Quantity, SignalUnit, Stream};

/// First words by which a header is known, also behind comments.
const KEYS: [&str; 24] = [
    "DATA_TYPE",
    "VERSION",
    "HARDWARE",
    "MAP_VERSION",
    "HW_TYPE",
    "FILENAME",
    "SENSOR_TYPE",
    "ROWS",
    "COLS",
    "ROW_SPACING",
    "COL_SPACING",
    "SENSEL_AREA",
    "NOISE_THRESHOLD",
    "SECONDS_PER_FRAME",
    "MICRO_SECOND",
    "TIME",
    "SENSITIVITY",
    "COMMENTS",
    "START_FRAME",
    "END_FRAME",
    "UNITS",
    "MIRROR_ROW",
    "MIRROR_COL",
    "ASCII_DATA",
];

/// Characters around a value when a spreadsheet has padded the line.
const PADDING: [char; 6] = [',', ';', ' ', '\t', ':', '"'];

/// Longest period, s.
const LONGEST_PERIOD: f64 = 86400.0;

pub(super) fn recognises(line: &str) -> bool {
    KEYS.contains(&split(line).0)
}

#[derive(Debug)]
pub(super) struct Decoder {
    columns: usize,
    rows: usize,
    si_per_unit: f64,
    period: Option<f64>,
    start_frame: Option<u64>,
    end_mark: String,
    /// Number format of the readings, once a row was seen.
    dialect: Option<Dialect>,
    /// Which sensels exist; empty before the first frame.
    present: Vec<bool>,
    /// The first frame, read when the file was opened.
    first: Option<Frame>,
}

#[derive(Debug, Default)]
struct Header {
    sensor: Option<String>,
    rows: Option<usize>,
    columns: Option<usize>,
    row_spacing: Option<f64>,
    column_spacing: Option<f64>,
    noise_threshold: Option<f64>,
    period: Option<f64>,
    start_frame: Option<u64>,
    unit: Option<SignalUnit>,
}

pub(super) fn open<R: BufRead>(lines: &mut Lines<R>) -> Result<Opened, RecordingError> {
    let (header, end_mark) = read_header(lines)?;
    let missing = |key: &str| {
        lines
            .line_error(format!("the header has no line {key}"))
            .key(key)
    };
    let rows = header.rows.ok_or_else(|| missing("ROWS"))?;
    let columns = header.columns.ok_or_else(|| missing("COLS"))?;
    let unit = header.unit.ok_or_else(|| missing("UNITS"))?;
    if let Some(fault) = shape_fault(rows, columns) {
        return Err(lines.line_error(fault).key("ROWS, COLS").into());
    }
    let mut decoder = Decoder {
        columns,
        rows,
        si_per_unit: unit.si_per_unit,
        period: header.period,
        start_frame: header.start_frame,
        end_mark,
        dialect: None,
        present: Vec::new(),
        first: None,
    };
    let first = decoder.read(lines)?;
    let present = match &first {
        Some(frame) => frame.values.iter().map(|value| !value.is_nan()).collect(),
        None => vec![true; rows * columns],
    };
    decoder.present.clone_from(&present);
    decoder.first = first;
    let name = header.sensor.unwrap_or_else(|| "Tekscan".to_owned());
    let stream = Stream {
        name: name.clone(),
        rows,
        columns,
        channels_per_taxel: 1,
        pitch: header
            .row_spacing
            .zip(header.column_spacing)
            .map(|(row, column)| [row, column]),
        period: header.period,
        // Counts mean nothing where the readings were converted to pressure.
        threshold: header
            .noise_threshold
            .filter(|_| unit.quantity == Quantity::Raw),
        unit,
        present,
    };
    Ok(Opened {
        stream,
        sensors: vec![name],
        decoder: super::Decoder::Tekscan(decoder),
    })
}

/// Reads to `ASCII_DATA` and returns the mark of the end that is named there.
fn read_header<R: BufRead>(lines: &mut Lines<R>) -> Result<(Header, String), RecordingError> {
    let mut header = Header::default();
    let mut seen: Vec<&'static str> = Vec::new();
    let mut in_comments = false;
    loop {
        if !lines.advance()? {
            return Err(lines.truncated("the file ends inside its header, before ASCII_DATA"));
        }
        let (key, value) = split(lines.text());
        let Some(&key) = KEYS.iter().find(|&&known| known == key) else {
            continue;
        };
        if seen.contains(&key) {
            if in_comments {
                continue;
            }
            let message = format!("{key} is given a second time");
            return Err(lines.fault(lines.line_error(message).key(key)));
        }
        if key == "ASCII_DATA" {
            if !lines.terminated() {
                return Err(lines.truncated("the file ends with its header"));
            }
            let mark = if value.is_empty() { "@@" } else { value };
            return Ok((header, mark.to_owned()));
        }
        match header.set(key, value) {
            Ok(()) => {
                seen.push(key);
                in_comments = key == "COMMENTS";
            }
            // A sentence that begins like a key.
            Err(_) if in_comments => {}
            Err((message, help)) => {
                let error = lines.error_at(value, message).key(key).help(help);
                return Err(lines.fault(error));
            }
        }
    }
}

impl Header {
    /// Takes over one line; a fault is what is wrong and what to do.
    fn set(&mut self, key: &str, value: &str) -> Result<(), (String, String)> {
        let wrong = |allowed: &str| {
            let message = format!("{} is not allowed here; allowed is {allowed}", quote(value));
            (message, String::new())
        };
        let given = either_mark(value);
        match key {
            "SENSOR_TYPE" => self.sensor = Some(value.to_owned()).filter(|name| !name.is_empty()),
            "ROWS" | "COLS" => {
                let side = side(value).ok_or_else(|| wrong("a whole number from 1 to 1000000"))?;
                *(if key == "ROWS" {
                    &mut self.rows
                } else {
                    &mut self.columns
                }) = Some(side);
            }
            "ROW_SPACING" | "COL_SPACING" => {
                let spacing = length(value).ok_or_else(|| {
                    wrong(&format!(
                        "a length above 0 and up to 1 m with one of the units {}",
                        units::LENGTHS
                    ))
                })?;
                *(if key == "ROW_SPACING" {
                    &mut self.row_spacing
                } else {
                    &mut self.column_spacing
                }) = Some(spacing);
            }
            "NOISE_THRESHOLD" => {
                let threshold = given.filter(|&counts| counts >= 0.0);
                self.noise_threshold =
                    Some(threshold.ok_or_else(|| wrong("a number of 0 or more"))?);
            }
            "SECONDS_PER_FRAME" => {
                let period = given.filter(|seconds| (0.0..=LONGEST_PERIOD).contains(seconds));
                let period = period.ok_or_else(|| wrong("0 to 86400 seconds"))?;
                // A snapshot has no period.
                self.period = Some(period).filter(|&seconds| seconds > 0.0);
            }
            "START_FRAME" => {
                let start = value.parse().ok();
                self.start_frame = Some(start.ok_or_else(|| wrong("a whole number of 0 or more"))?);
            }
            "UNITS" => {
                let known = |quantity| matches!(quantity, Quantity::Raw | Quantity::Pressure);
                let unit = units::find(value).filter(|unit| known(unit.quantity));
                self.unit = Some(unit.ok_or_else(|| {
                    let message = format!("{} is not a unit of readings", quote(value));
                    (message, format!("use one of: {}", units::list(known)))
                })?);
            }
            _ => {}
        }
        Ok(())
    }
}

impl Decoder {
    pub(super) fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<Frame>, RecordingError> {
        if let Some(frame) = self.first.take() {
            return Ok(Some(frame));
        }
        loop {
            if !lines.advance()? {
                return Err(
                    lines.truncated(format!("the end mark {} is missing", quote(&self.end_mark)))
                );
            }
            let line = lines.text().trim().trim_matches(PADDING);
            if line.is_empty() {
                continue;
            }
            if line == self.end_mark {
                return after_end(lines).map(|()| None);
            }
            let (sequence, time_ns) = self.frame_line(lines, line)?;
            let values = self.rows(lines, sequence)?;
            return Ok(Some(Frame {
                sequence,
                time_ns,
                values,
                ..Frame::default()
            }));
        }
    }

    /// Number and time of `Frame N, seconds,, ...`.
    fn frame_line<R: BufRead>(
        &mut self,
        lines: &Lines<R>,
        line: &str,
    ) -> Result<(u64, u64), RecordingError> {
        let mut dialect = Dialect::of_line(line);
        let fields = dialect.clone();
        let mut fields = fields.fields(line);
        let title = fields.next().map_or("", |field| field.raw);
        let number = title
            .get(..5)
            .filter(|word| word.eq_ignore_ascii_case("frame"))
            .and_then(|_| title.get(5..))
            .ok_or_else(|| {
                lines.fault(lines.line_error(format!(
                    "expected the next `Frame` or the end mark {}; a frame has {} rows",
                    quote(&self.end_mark),
                    self.rows
                )))
            })?
            .trim();
        let sequence: u64 = number.parse().map_err(|_| {
            let message = format!(
                "{} is not a frame number; allowed is a whole number of 0 or more",
                quote(number)
            );
            lines.fault(lines.error_at(number, message).key("Frame"))
        })?;
        let seconds = fields.next().map_or("", |field| field.raw);
        // A clock time is not the time since the start.
        if seconds.is_empty() || seconds.contains([':', '/']) {
            let time = self.time_from_number(sequence).ok_or_else(|| {
                lines.fault(
                    lines
                        .line_error(format!(
                            "the time of frame {sequence} is unknown: the line states none, and \
                             SECONDS_PER_FRAME does not give one that can be counted in ns"
                        ))
                        .key("SECONDS_PER_FRAME"),
                )
            })?;
            return Ok((sequence, time));
        }
        let time = dialect.scaled_integer(seconds, 9).ok_or_else(|| {
            let message = format!(
                "{} is not a time; allowed are 0 to 18446744073 seconds",
                quote(seconds)
            );
            lines.fault(lines.error_at(seconds, message).key("Frame"))
        })?;
        Ok((sequence, time))
    }

    /// Time since the first frame of the recording, ns.
    fn time_from_number(&mut self, sequence: u64) -> Option<u64> {
        let start = *self.start_frame.get_or_insert(sequence);
        let frames = sequence.saturating_sub(start);
        if frames == 0 {
            return Some(0);
        }
        let time = (frames as f64 * self.period? * 1e9).round();
        // Beyond 2^64 ns the conversion would saturate.
        (time < 1.8e19).then_some(time as u64)
    }

    fn rows<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        sequence: u64,
    ) -> Result<Vec<f64>, RecordingError> {
        let mut values = Vec::with_capacity(self.rows * self.columns);
        for row in 0..self.rows {
            let rows = self.rows;
            let counted = |row: usize| format!("frame {sequence} has {row} of {rows} rows");
            if !lines.advance()? {
                return Err(lines.truncated(counted(row)));
            }
            // Without a line end, the last number may have lost digits.
            if !lines.terminated() {
                return Err(lines.truncated(format!("{} and a part of the next", counted(row))));
            }
            let line = lines.text().trim();
            if is_blank(line) || line.starts_with(&self.end_mark) || recognised_frame(line) {
                return Err(lines.line_error(counted(row)).key("ROWS").into());
            }
            self.row(lines, &mut values)?;
        }
        Ok(values)
    }

    fn row<R: BufRead>(
        &mut self,
        lines: &Lines<R>,
        values: &mut Vec<f64>,
    ) -> Result<(), RecordingError> {
        let start = values.len();
        let mut count = 0;
        let known = self.dialect.take();
        let mut dialect = known.unwrap_or_else(|| Dialect::of_line(lines.text()));
        for field in dialect.clone().fields(lines.text()) {
            let column = count;
            // A spreadsheet may have padded the line.
            if column >= self.columns && field.raw.is_empty() {
                continue;
            }
            count += 1;
            if column >= self.columns {
                continue;
            }
            let expected = self.present.get(start + column).copied();
            values.push(
                self.value(&mut dialect, &field.text(), expected)
                    .map_err(|message| {
                        lines.error_at(field.raw, message).key(column_name(column))
                    })?,
            );
        }
        self.dialect = Some(dialect);
        if count == self.columns {
            return Ok(());
        }
        let message = format!("the row has {count} readings, COLS says {}", self.columns);
        Err(lines.line_error(message).key("COLS").into())
    }

    /// One reading in SI units; `expected` is whether the sensel exists, if
    /// that is known.
    fn value(
        &self,
        dialect: &mut Dialect,
        text: &str,
        expected: Option<bool>,
    ) -> Result<f64, String> {
        if text.eq_ignore_ascii_case("B") {
            return Ok(f64::NAN);
        }
        let value = dialect
            .number(text)
            .map(|value| value * self.si_per_unit)
            .filter(|value| value.is_finite())
            .ok_or_else(|| {
                format!(
                    "{} is not a reading; allowed are finite numbers, and B where there is no sensel; {}",
                    quote(text),
                    dialect.number_hint()
                )
            })?;
        if expected == Some(false) {
            return Err(format!(
                "the reading {} is at a sensel that does not exist (B) in the first frame",
                quote(text)
            ));
        }
        Ok(value)
    }
}

/// Nothing may follow the end mark: it would be lost in silence.
fn after_end<R: BufRead>(lines: &mut Lines<R>) -> Result<(), RecordingError> {
    while lines.advance()? {
        if !is_blank(lines.text()) {
            let error = lines
                .line_error("there is text behind the end mark of the recording")
                .help("one file holds one recording; split it");
            return Err(error.into());
        }
    }
    Ok(())
}

fn is_blank(line: &str) -> bool {
    line.trim_matches(PADDING).trim().is_empty()
}

fn recognised_frame(line: &str) -> bool {
    line.get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case("frame"))
}

fn column_name(column: usize) -> String {
    format!("column {}", column + 1)
}

/// Key and value of a header line.
fn split(line: &str) -> (&str, &str) {
    let line = line.trim_start_matches('"').trim();
    let (key, value) = line.split_at(line.find(PADDING).unwrap_or(line.len()));
    (key, value.trim_matches(PADDING))
}

/// A length such as `0.127 centimeters`, m.
fn length(text: &str) -> Option<f64> {
    let (value, unit) = text.split_once(char::is_whitespace)?;
    spacing(either_mark(value)?, units::length(unit)?)
}

/// A number with a decimal point or a decimal comma: in the header no comma
/// parts values.
fn either_mark(text: &str) -> Option<f64> {
    number(&text.replacen(',', ".", 1))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::Recording;
    use super::*;
    use taxel_ground::InputError;

    const SMALL: &str = "DATA_TYPE MOVIE\nROWS 2\nCOLS 3\nROW_SPACING 0.5 inches\nCOL_SPACING 5.08 mm\n\
        NOISE_THRESHOLD 3\nSECONDS_PER_FRAME 0.032\nCOMMENTS:\nROWS of toes\n12,5 left\nSTART_FRAME 4\nEND_FRAME 6\nUNITS PSI\n\
        ASCII_DATA @@\n\nFrame 4\nB,0,1\n2,3,4.5\n\nFrame 6\nB,7,8\n9,B,11\n@@\n";

    /// The mistake of a small recording.
    fn first_error(text: &str) -> InputError {
        let result = Recording::open("t.csv", text.as_bytes())
            .and_then(Iterator::collect::<Result<Vec<_>, _>>);
        match result {
            Err(RecordingError::Input(error) | RecordingError::Truncated { error, .. }) => error,
            other => panic!("expected a mistake, found {other:?}"),
        }
    }

    #[test]
    fn header_and_readings_are_in_si_units() {
        let recording = Recording::open("t.asf", SMALL.as_bytes()).unwrap();
        let stream = recording.stream().clone();
        assert_eq!(
            (stream.rows, stream.columns, stream.channels_per_taxel),
            (2, 3, 1)
        );
        let pitch = stream.pitch.unwrap();
        // One rounding each.
        assert!((pitch[0] - 0.0127).abs() < 1e-17 && (pitch[1] - 0.00508).abs() < 1e-17);
        assert_eq!(stream.threshold, None, "counts mean nothing in psi");
        assert_eq!(stream.present, [false, true, true, true, true, true]);
        let frames: Vec<_> = recording.map(Result::unwrap).collect();
        assert_eq!(frames[0].values[5], 4.5 * stream.unit.si_per_unit);
        assert_eq!((frames[1].sequence, frames[1].time_ns), (6, 64_000_000));
        assert!(frames[0].values[0].is_nan());
        assert!(
            frames[1].values[4].is_nan(),
            "a later B is a missing reading"
        );
    }

    #[test]
    fn mistakes_are_named_with_place_and_allowed_values() {
        let cases = [
            ("ROWS 2", "ROWS 1000000000", 2, "1 to 1000000"),
            ("ROWS 2", "ROWS 900000", 14, "2700000 taxels"),
            ("ROWS 2", "ROW 2", 14, "no line ROWS"),
            ("COLS 3", "COLS 3\nCOLS 3", 4, "second time"),
            ("5.08 mm", "NaN mm", 5, "above 0 and up to 1 m"),
            ("5.08 mm", "-5.08 mm", 5, "above 0 and up to 1 m"),
            ("5.08 mm", "5.08 ell", 5, "inches"),
            ("0.032", "-0.032", 7, "0 to 86400 seconds"),
            ("0.032", "nan", 7, "0 to 86400 seconds"),
            ("UNITS PSI", "UNITS furlong", 13, "not a unit"),
            ("2,3,4.5", "2,3,4.5.6", 18, "`4.5.6` is not a reading"),
            ("2,3,4.5", "2,nan,4.5", 18, "`nan` is not a reading"),
            ("2,3,4.5", "2,3,1e999", 18, "`1e999` is not a reading"),
            ("2,3,4.5", "2,3", 18, "has 2 readings, COLS says 3"),
            ("2,3,4.5", "2,3,4,5", 18, "has 4 readings, COLS says 3"),
            ("2,3,4.5\n", "", 18, "frame 4 has 1 of 2 rows"),
            ("2,3,4.5", "2,3,4\n1,1,1", 19, "expected the next `Frame`"),
            (
                "B,7,8",
                "6,7,8",
                21,
                "does not exist (B) in the first frame",
            ),
            ("Frame 6", "Frame six", 20, "not a frame number"),
            ("Frame 6", "Frame 6, -1", 20, "is not a time"),
            ("@@\n", "@@\nmore\n", 24, "behind the end mark"),
        ];
        for (from, to, line, message) in cases {
            assert!(SMALL.contains(from));
            let text = if from == "@@\n" {
                format!("{SMALL}more\n")
            } else {
                SMALL.replacen(from, to, 1)
            };
            let error = first_error(&text);
            assert_eq!(
                error.place.as_ref().map(|place| place.line),
                Some(line),
                "{error}"
            );
            assert!(error.to_string().contains(message), "{error}");
        }
    }

    #[test]
    fn a_missing_end_mark_is_a_cut_recording() {
        let text = SMALL.strip_suffix("@@\n").unwrap();
        let mut recording = Recording::open("t.asf", text.as_bytes()).unwrap();
        assert!(recording.next().unwrap().is_ok());
        assert!(recording.next().unwrap().is_ok());
        match recording.next() {
            Some(Err(RecordingError::Truncated {
                complete_frames,
                error,
            })) => {
                assert_eq!(complete_frames, 2);
                assert!(!error.help.is_empty());
            }
            other => panic!("{other:?}"),
        }
        assert!(recording.next().is_none());
    }

    #[test]
    fn a_spreadsheet_may_have_padded_the_lines() {
        let padded = SMALL.replace('\n', ",,,,\r\n");
        let plain: Vec<_> = Recording::open("t", SMALL.as_bytes())
            .unwrap()
            .map(|f| f.unwrap().time_ns)
            .collect();
        let read: Vec<_> = Recording::open("t", padded.as_bytes())
            .unwrap()
            .map(|f| f.unwrap().time_ns)
            .collect();
        assert_eq!(plain, read);
    }

    #[test]
    fn semicolons_or_tabs_and_decimal_commas_mean_the_same() {
        let read = |text: &str| {
            let recording = Recording::open("t", text.as_bytes()).unwrap();
            let pitch = recording.stream().pitch;
            let frames: Vec<_> = recording.map(Result::unwrap).collect();
            let values = frames.iter().flat_map(|frame| frame.values.clone());
            // NaN is equal to nothing, its bits are.
            let bits: Vec<_> = values.map(f64::to_bits).collect();
            (pitch, bits, frames[1].time_ns)
        };
        let timed = SMALL.replace("Frame 6", "Frame 6, 0.5,, 12/2/2019,,,Raw Sum=,,3");
        for separator in [";", "\t"] {
            let other = timed.replace("12,5 left", "left").replace(',', separator);
            assert_eq!(read(&other), read(&timed));
            let continental = other.replace('.', ",");
            assert_eq!(read(&continental), read(&timed));
        }
        assert_eq!(read(&timed.replace("ROWS 2", "\"ROWS 2\"")), read(&timed));
    }
}
