//! Lines of bounded length, their fields and numbers, each with its place.
//!
//! The lines are split here and not by the `csv` crate, because errors name
//! the character at which a value stands, a file that ends inside a line must
//! be distinguished from one that is wrong, and no line may grow without bound.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::{BufRead, ErrorKind};

use super::RecordingError;
use super::encoding::Decoded;
use taxel_ground::InputError;

/// Longest line read, bytes: 16 for each channel of the largest recording.
const LONGEST_LINE: usize = 16 << 20;

/// Part of a line behind a mistake that its message keeps, bytes.
const KEPT_BEHIND: usize = 400;

/// The lines of a file, one at a time.
#[derive(Debug)]
pub(super) struct Lines<R> {
    reader: Decoded<R>,
    file: String,
    bytes: Vec<u8>,
    text: String,
    number: usize,
    terminated: bool,
    again: bool,
    /// Lines that were looked at and are still to come.
    ahead: VecDeque<Result<Ahead, RecordingError>>,
}

/// A line that was looked at.
#[derive(Debug)]
struct Ahead {
    text: String,
    number: usize,
    terminated: bool,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(file: &str, reader: R) -> Self {
        Self {
            reader: Decoded::new(reader),
            file: file.to_owned(),
            bytes: Vec::new(),
            text: String::new(),
            number: 0,
            terminated: true,
            again: false,
            ahead: VecDeque::new(),
        }
    }

    /// The lines from this one on, up to `count`: all of them are still to come.
    pub(super) fn look(&mut self, count: usize) -> Vec<String> {
        let mut held = VecDeque::new();
        let mut room = LONGEST_LINE;
        while held.len() < count {
            match self.advance() {
                Ok(true) => {
                    room = room.saturating_sub(self.text.len());
                    held.push_back(Ok(Ahead {
                        text: self.text.clone(),
                        number: self.number,
                        terminated: self.terminated,
                    }));
                    if room == 0 {
                        break;
                    }
                }
                Ok(false) => break,
                Err(error) => {
                    held.push_back(Err(error));
                    break;
                }
            }
        }
        held.append(&mut self.ahead);
        self.ahead = held;
        let lines = self.ahead.iter().filter_map(|line| line.as_ref().ok());
        lines.map(|line| line.text.clone()).collect()
    }

    /// Goes to the next line that is not blank; `false` at the end of the file.
    pub(super) fn advance_to_row(&mut self, dialect: &Dialect) -> Result<bool, RecordingError> {
        while self.advance()? {
            if !dialect.is_blank(self.text()) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Goes to the next line; `false` at the end of the file, where the last
    /// line stays in place for messages.
    pub(super) fn advance(&mut self) -> Result<bool, RecordingError> {
        if std::mem::take(&mut self.again) {
            return Ok(true);
        }
        if let Some(line) = self.ahead.pop_front() {
            let line = line?;
            (self.text, self.number, self.terminated) = (line.text, line.number, line.terminated);
            return Ok(true);
        }
        self.bytes.clear();
        loop {
            let chunk = match self.reader.fill_buf() {
                Ok(chunk) => chunk,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(error.into()),
            };
            if chunk.is_empty() {
                break;
            }
            let end = chunk.iter().position(|&byte| byte == b'\n');
            let taken = end.map_or(chunk.len(), |at| at + 1);
            let room = LONGEST_LINE - self.bytes.len();
            self.bytes.extend_from_slice(&chunk[..taken.min(room)]);
            if taken > room {
                return Err(self.too_long().into());
            }
            self.reader.consume(taken);
            if end.is_some() {
                break;
            }
        }
        if self.bytes.is_empty() {
            return Ok(false);
        }
        self.terminated = self.bytes.ends_with(b"\n");
        self.number += 1;
        self.text.clear();
        // Comments and file names of vendors' exports may be in any code page.
        self.text.push_str(&String::from_utf8_lossy(&self.bytes));
        self.text
            .truncate(self.text.trim_end_matches(['\r', '\n']).len());
        if self.number == 1 && self.text.starts_with('\u{feff}') {
            self.text.remove(0);
        }
        Ok(true)
    }

    /// Makes the next [`Lines::advance`] stay on this line.
    pub(super) fn again(&mut self) {
        self.again = true;
    }

    /// The line, without its end.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// True if the line has an end, so that it is surely complete.
    pub(super) fn terminated(&self) -> bool {
        self.terminated
    }

    pub(super) fn file(&self) -> &str {
        &self.file
    }

    /// An error about `part`, which is a slice of the line.
    pub(super) fn error_at(&self, part: &str, message: impl Into<String>) -> InputError {
        let start = (part.as_ptr() as usize)
            .saturating_sub(self.text.as_ptr() as usize)
            .min(self.text.len());
        let mut kept = self
            .text
            .len()
            .min(start + part.len().min(KEPT_BEHIND) + KEPT_BEHIND);
        while !self.text.is_char_boundary(kept) {
            kept -= 1;
        }
        let text = &self.text[..kept];
        let column = text.get(..start).unwrap_or(text).chars().count() + 1;
        let width = part.chars().count();
        InputError::on_line(&self.file, self.number, text, column, width, message)
    }

    /// An error about the line as a whole.
    pub(super) fn line_error(&self, message: impl Into<String>) -> InputError {
        self.error_at(self.text.trim(), message)
    }

    /// The error of a file that ends too early.
    pub(super) fn truncated(&self, missing: impl Into<String>) -> RecordingError {
        let end = &self.text[self.text.len()..];
        cut(self.error_at(end, missing))
    }

    /// `error` as it stands, or as the sign of a cut file if the line has no
    /// end.
    pub(super) fn fault(&self, error: InputError) -> RecordingError {
        if self.terminated {
            error.into()
        } else {
            cut(error)
        }
    }

    fn too_long(&self) -> InputError {
        let start = String::from_utf8_lossy(&self.bytes[..KEPT_BEHIND]);
        let message = format!("the line is longer than the allowed {LONGEST_LINE} bytes");
        InputError::on_line(&self.file, self.number + 1, &start, 1, 1, message)
            .help("a recording has one line per frame or per row of taxels; is this a text file?")
    }
}

/// Separators and number format of a file.
#[derive(Debug, Clone)]
pub(super) struct Dialect {
    separator: u8,
    /// `,` or `.`, once one was seen: a file that mixes them writes thousands
    /// with one of them.
    decimal: Option<u8>,
}

/// One field of a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Field<'a> {
    /// As it stands in the line, without blanks around it.
    pub(super) raw: &'a str,
}

impl Dialect {
    /// Commas between fields and points in numbers.
    pub(super) const COMMA: Self = Self {
        separator: b',',
        decimal: Some(b'.'),
    };

    /// That of a file whose first line with a separator is `line`: semicolons, else
    /// tabs, else commas. Only with the first two can a number have a comma.
    pub(super) fn of_line(line: &str) -> Self {
        let separator = [b';', b'\t']
            .into_iter()
            .find(|&separator| Fields::new(line, separator).nth(1).is_some());
        separator.map_or(Self::COMMA, |separator| Self {
            separator,
            decimal: None,
        })
    }

    /// That of a table which begins with `rows`, and the index of its first row: the first
    /// separator by which a row has nothing but numbers, else the first by which three rows have
    /// as many fields, the last two of them with numbers. `wanted` is the least number of fields.
    /// A number between quotes may have a decimal comma whatever the separator.
    pub(super) fn of_table(rows: &[String], wanted: usize) -> Option<(Self, usize)> {
        let separators = || {
            let all = [b';', b'\t', b'|', b',', b' '].into_iter();
            all.map(|separator| Self {
                separator,
                decimal: None,
            })
        };
        let fields = |dialect: &Self, row: &str| dialect.fields(row).count();
        let numbers = |dialect: &Self, row: &str| {
            let mut own = dialect.clone();
            dialect
                .fields(row)
                .filter(|field| own.is_measured(&field.text()))
                .count()
        };
        let is_full = |dialect: &Self, row: &str| {
            let missing = dialect
                .fields(row)
                .filter(|field| is_missing(&field.text()))
                .count();
            let (all, found) = (fields(dialect, row), numbers(dialect, row));
            all >= wanted && found > 0 && found + missing == all
        };
        let full = || {
            rows.iter().enumerate().find_map(|(at, row)| {
                let found = separators().find(|dialect| is_full(dialect, row));
                found.map(|dialect| (dialect, at))
            })
        };
        let even = || {
            separators().find_map(|dialect| {
                let is_row = |row: &str| numbers(&dialect, row) > 0;
                let all = rows.windows(3).position(|three| {
                    let count = fields(&dialect, &three[0]);
                    let even = three.iter().all(|row| fields(&dialect, row) == count);
                    count >= wanted.max(2) && even && is_row(&three[1]) && is_row(&three[2])
                })?;
                let first = if is_row(&rows[all]) { all } else { all + 1 };
                Some((dialect, first))
            })
        };
        let (mut dialect, at) = full().or_else(even)?;
        if dialect.separator == b',' && !rows[at].contains('"') {
            dialect.decimal = Some(b'.');
        }
        Some((dialect, at))
    }

    /// A number, or a date with a time of day.
    fn is_measured(&mut self, text: &str) -> bool {
        self.clone().number(text).is_some() || date_time(text).is_some()
    }

    /// The name of the separator.
    pub(super) fn separator_name(&self) -> &'static str {
        match self.separator {
            b';' => "semicolons",
            b'\t' => "tabs",
            b'|' => "vertical bars",
            b' ' => "blanks",
            _ => "commas",
        }
    }

    pub(super) fn fields<'a>(&self, line: &'a str) -> Fields<'a> {
        Fields::new(line, self.separator)
    }

    /// True if a line has nothing but blanks and separators, or is the rule below the head of a
    /// table between vertical bars.
    pub(super) fn is_blank(&self, line: &str) -> bool {
        let rule: &[u8] = if self.separator == b'|' { b"-:+=" } else { b"" };
        line.bytes().all(|byte| {
            byte == self.separator || byte.is_ascii_whitespace() || rule.contains(&byte)
        })
    }

    /// `text` with a decimal point, if it can be a number of this file.
    pub(super) fn decimal<'a>(&mut self, text: &'a str) -> Option<Cow<'a, str>> {
        let allowed = |byte: u8| byte.is_ascii_digit() || b"+-.,eE".contains(&byte);
        if text.is_empty() || !text.bytes().all(allowed) {
            return None;
        }
        let Some(mark) = text.bytes().find(|byte| b".,".contains(byte)) else {
            return Some(Cow::Borrowed(text));
        };
        if *self.decimal.get_or_insert(mark) != mark {
            return None;
        }
        Some(if mark == b',' {
            // A second comma turns into a second point and is refused there.
            if text.contains('.') {
                return None;
            }
            Cow::Owned(text.replace(',', "."))
        } else {
            Cow::Borrowed(text)
        })
    }

    /// A finite number.
    pub(super) fn number(&mut self, text: &str) -> Option<f64> {
        number(&self.decimal(text)?)
    }

    /// See [`scaled_integer`].
    pub(super) fn scaled_integer(&mut self, text: &str, power: i32) -> Option<u64> {
        scaled_integer(&self.decimal(text)?, power)
    }

    /// Form of a number of this file, for messages.
    pub(super) fn number_hint(&self) -> &'static str {
        match self.decimal {
            Some(b',') => {
                "numbers of this file look like 12,5 or 1,25e1, without a mark for thousands"
            }
            Some(_) => {
                "numbers of this file look like 12.5 or 1.25e1, without a mark for thousands"
            }
            None => "numbers look like 12.5 or 12,5, without a mark for thousands",
        }
    }
}

impl<'a> Field<'a> {
    /// The content without quotes.
    pub(super) fn text(&self) -> Cow<'a, str> {
        let inner = self
            .raw
            .strip_prefix('"')
            .and_then(|rest| rest.strip_suffix('"'));
        match inner {
            Some(inner) if inner.contains('"') => Cow::Owned(inner.trim().replace("\"\"", "\"")),
            Some(inner) => Cow::Borrowed(inner.trim()),
            None => Cow::Borrowed(self.raw),
        }
    }
}

/// The fields of a line; a separator between quotes is part of its field.
#[derive(Debug, Clone)]
pub(super) struct Fields<'a> {
    rest: Option<&'a str>,
    separator: u8,
}

impl<'a> Fields<'a> {
    fn new(line: &'a str, separator: u8) -> Self {
        let line = match separator {
            b' ' => line.trim(),
            b'|' => {
                let line = line.trim();
                let line = line.strip_prefix('|').unwrap_or(line);
                line.strip_suffix('|').unwrap_or(line)
            }
            _ => line,
        };
        Self {
            rest: Some(line),
            separator,
        }
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Field<'a>;

    fn next(&mut self) -> Option<Field<'a>> {
        let rest = self.rest?;
        let mut quoted = false;
        let blanks = self.separator == b' ';
        let mut bytes = rest.bytes().enumerate();
        let end = bytes.find_map(|(at, byte)| {
            quoted ^= byte == b'"';
            let ends = !quoted && (byte == self.separator || blanks && byte == b'\t');
            // A unit in brackets belongs to the name before it.
            let unit = || rest[at..].trim_start().starts_with(['[', '(']);
            (ends && !(blanks && unit())).then_some(at)
        });
        let (field, rest) = match end {
            Some(at) if blanks => (&rest[..at], Some(rest[at..].trim_start())),
            Some(at) => (&rest[..at], Some(&rest[at + 1..])),
            None => (rest, None),
        };
        self.rest = rest;
        Some(Field { raw: field.trim() })
    }
}

/// True for a cell of a table without a number: empty, or one of the words by which programs
/// say that a value is missing or beyond the range.
pub(super) fn is_missing(text: &str) -> bool {
    const WORDS: [&str; 13] = [
        "",
        "nan",
        "na",
        "n/a",
        "null",
        "none",
        "inf",
        "+inf",
        "-inf",
        "infinity",
        "-infinity",
        "ovf",
        "-",
    ];
    WORDS.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// A date with a time of day by ISO 8601, or with a blank for its `T`, in ns of Unix time: UTC
/// unless it states its distance from it.
pub(super) fn date_time(text: &str) -> Option<u64> {
    let (date, time) = text.split_at_checked(10)?;
    let number = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        digits.then(|| text.parse::<i64>().ok())?
    };
    let mut parts = date.split(['-', '/']).map(number);
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    let time = time.strip_prefix(['T', 't', ' '])?;
    let zone = time.find(['Z', 'z', '+', '-']).unwrap_or(time.len());
    let (time, zone) = time.split_at(zone);
    let mut parts = time.trim().splitn(3, ':');
    let (hour, minute) = (number(parts.next()?)?, number(parts.next()?)?);
    let second = scaled_integer(&parts.next().unwrap_or("0").replace(',', "."), 9)?;
    let valid = (1970..2500).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && hour < 24
        && minute < 60
        && second < 61_000_000_000;
    if !valid {
        return None;
    }
    let zone_minutes = match zone.trim().split_at_checked(1) {
        None | Some(("Z" | "z", "")) => 0,
        Some((sign, rest)) => {
            let rest = rest.replace(':', "");
            let (hours, minutes) = rest.split_at_checked(2)?;
            let minutes = if minutes.is_empty() {
                0
            } else {
                number(minutes)?
            };
            (number(hours)? * 60 + minutes) * if sign == "-" { -1 } else { 1 }
        }
    };
    // Days of the Gregorian calendar, with the year beginning in March.
    let (year, month) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let days =
        365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 719_469;
    let seconds = (days * 24 + hour) * 3600 + (minute - zone_minutes) * 60;
    u64::try_from(seconds)
        .ok()?
        .checked_mul(1_000_000_000)?
        .checked_add(second)
}

/// The number of frames is filled in where they are delivered.
fn cut(error: InputError) -> RecordingError {
    RecordingError::Truncated {
        error,
        complete_frames: 0,
    }
}

/// `text` in quotes, shortened if it is long.
pub(super) fn quote(text: &str) -> String {
    const SHOWN: usize = 60;
    let mut shown: String = text.chars().take(SHOWN).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    format!("`{shown}`")
}

/// A finite number with a decimal point.
pub(super) fn number(text: &str) -> Option<f64> {
    // `inf`, `nan` and `infinity` parse as well.
    let starts = text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first));
    if !starts || text.contains(['n', 'N', 'i', 'I']) {
        return None;
    }
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// A number that is not negative, times 10^`power`, rounded to an integer
/// without passing through floating point.
pub(super) fn scaled_integer(text: &str, power: i32) -> Option<u64> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (negative, digits) = match mantissa.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, mantissa.strip_prefix('+').unwrap_or(mantissa)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let is_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.len() + fraction.len() == 0 || !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    // More digits than these lie below any half nanosecond.
    let fraction = &fraction[..fraction.len().min(18)];
    let whole = whole.trim_start_matches('0');
    if whole.len() > 20 {
        return None;
    }
    let all = format!("0{whole}{fraction}").parse::<u128>().ok()?;
    let places = i32::try_from(fraction.len()).ok()?;
    let shift = power.checked_add(exponent)?.checked_sub(places)?;
    let scaled = if all == 0 {
        0
    } else if shift >= 0 {
        10_u128
            .checked_pow(shift.unsigned_abs())
            .and_then(|factor| all.checked_mul(factor))?
    } else {
        // All digits are gone where the divisor is too large for the type.
        10_u128
            .checked_pow(shift.unsigned_abs())
            .map_or(0, |divisor| (all + divisor / 2) / divisor)
    };
    if negative && all != 0 {
        return None;
    }
    u64::try_from(scaled).ok()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::*;

    #[test]
    fn decimal_times_become_integers_without_rounding_error() {
        assert_eq!(
            scaled_integer("1700000000.123456789", 9),
            Some(1_700_000_000_123_456_789)
        );
        assert_eq!(scaled_integer("18446744073709551615", 0), Some(u64::MAX));
        assert_eq!(scaled_integer("18446744073709551616", 0), None);
        assert_eq!(scaled_integer("31.1", 9), Some(31_100_000_000));
        assert_eq!(scaled_integer("1.5e-3", 9), Some(1_500_000));
        assert_eq!(scaled_integer("0.4", 0), Some(0));
        assert_eq!(scaled_integer(".5", 0), Some(1));
        assert_eq!(scaled_integer("-0.0", 9), Some(0));
        assert_eq!(scaled_integer("1e-400", 9), Some(0));
        assert_eq!(scaled_integer("0e999999999", 9), Some(0));
        for wrong in [
            "",
            ".",
            "-1",
            "1e400",
            "1.2.3",
            "e3",
            "1e",
            "--1",
            "1e2147483647",
        ] {
            assert_eq!(scaled_integer(wrong, 9), None, "{wrong}");
        }
    }

    #[test]
    fn dates_become_unix_times() {
        // date -u -d '2026-11-28 17:05:09' +%s
        let expected = 1_795_885_509_250_000_000;
        for text in [
            "2026-11-28T17:05:09.25Z",
            "2026-11-28 17:05:09,25",
            "2026/11/28 18:35:09.250+01:30",
            "2026-11-28T12:05:09.25-0500",
        ] {
            assert_eq!(date_time(text), Some(expected), "{text}");
        }
        for text in [
            "2026-11-28",
            "2026-13-28T17:05:09Z",
            "1969-12-31T23:59:59Z",
            "28.11.2026 17:05:09",
        ] {
            assert_eq!(date_time(text), None, "{text}");
        }
    }

    #[test]
    fn separators_between_quotes_belong_to_the_field() {
        let dialect = Dialect::COMMA;
        let texts: Vec<_> = dialect
            .fields(r#"File:,"C:\a,b ""c"" .XSN", 3 ,"#)
            .map(|field| field.text().into_owned())
            .collect();
        assert_eq!(texts, ["File:", r#"C:\a,b "c" .XSN"#, "3", ""]);
    }

    #[test]
    fn the_first_decimal_mark_holds_for_the_file() {
        let mut dialect = Dialect::of_line("time [s];r0c0 [kPa]");
        assert_eq!(dialect.number("0,5"), Some(0.5));
        assert_eq!(dialect.number("1.234"), None);
        assert_eq!(dialect.number("1.234,5"), None);
        assert_eq!(dialect.number("7"), Some(7.0));
        assert_eq!(number("1,5"), None);
    }

    #[test]
    fn a_line_without_end_is_refused_before_it_fills_the_memory() {
        let endless = std::io::BufReader::new(std::io::Read::take(std::io::repeat(b'7'), 1 << 40));
        let mut lines = Lines::new("endless.csv", endless);
        let error = lines.advance().unwrap_err().to_string();
        assert!(error.contains("16777216 bytes"), "{error}");
    }
}
