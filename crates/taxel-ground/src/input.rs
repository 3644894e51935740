//! Errors in input files, with the exact place.

use std::fmt;
use std::ops::Range;
use std::string::FromUtf8Error;

/// A mistake in something a person wrote: a sensor file, a table of loads, a
/// recording.
///
/// It carries all that one clear message needs; [`fmt::Display`] renders it
/// with the offending line and a caret under the word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputError {
    /// Name of the file as the user gave it.
    pub file: String,
    /// Where in the file; `None` when the mistake is the file as a whole.
    pub place: Option<Box<Place>>,
    /// Key path (`electronics.scan.rate`) or column name; may be empty.
    pub key: String,
    /// Description of the mistake, with the value found and the range allowed.
    pub message: String,
    /// Advice how to correct it; may be empty.
    pub help: String,
    /// The next mistake that was found in the same run.
    pub next: Option<Box<Self>>,
}

/// A stretch of one line of an input file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Line, counted from 1.
    pub line: usize,
    /// First column in characters, counted from 1.
    pub column: usize,
    /// Number of characters marked, at least 1.
    pub width: usize,
    /// The text of the line.
    pub text: String,
}

/// Longest stretch of an offending line that is quoted.
const QUOTED_CHARACTERS: usize = 110;

/// Order of the bytes of a text in UTF-16, as spreadsheets save it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Utf16 {
    /// Low byte first.
    Little,
    /// High byte first.
    Big,
}

/// The text of a file, without its mark: UTF-8, or UTF-16 that begins with one.
///
/// # Errors
/// Bytes that are neither.
pub fn text_of(bytes: Vec<u8>) -> Result<String, FromUtf8Error> {
    match Utf16::of_mark(&bytes) {
        Some(order) => Ok(order.decode(&bytes[Utf16::MARK..])),
        None => String::from_utf8(bytes).map(|text| match text.strip_prefix('\u{feff}') {
            Some(text) => text.to_owned(),
            None => text,
        }),
    }
}

/// Separator of the fields of a table: semicolons or tabs where its first line that is no
/// comment has them, and then `1,5` may be a number; else commas.
pub fn separator_of(text: &str) -> u8 {
    let line = text
        .lines()
        .find(|line| !line.starts_with('#') && !line.trim().is_empty());
    let found = [b';', b'\t']
        .into_iter()
        .find(|separator| line.unwrap_or("").as_bytes().contains(separator));
    found.unwrap_or(b',')
}

impl Utf16 {
    /// Number of the bytes of the mark.
    pub const MARK: usize = 2;

    /// Byte order by the mark at the start of a file.
    pub fn of_mark(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0xff, 0xfe, ..] => Some(Self::Little),
            [0xfe, 0xff, ..] => Some(Self::Big),
            _ => None,
        }
    }

    /// Number of the bytes that are whole characters.
    pub fn whole(self, bytes: &[u8]) -> usize {
        let last = bytes.chunks_exact(2).next_back();
        let begun = last.is_some_and(|pair| (0xd800..0xdc00).contains(&self.unit(pair)));
        (bytes.len() & !1) - if begun { 2 } else { 0 }
    }

    /// Text of the bytes; a sign for what cannot be decoded.
    pub fn decode(self, bytes: &[u8]) -> String {
        let units = bytes.chunks_exact(2).map(|pair| self.unit(pair));
        char::decode_utf16(units)
            .map(|found| found.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect()
    }

    fn unit(self, pair: &[u8]) -> u16 {
        let pair = [pair[0], pair[1]];
        match self {
            Self::Little => u16::from_le_bytes(pair),
            Self::Big => u16::from_be_bytes(pair),
        }
    }
}

impl InputError {
    /// An error about the file as a whole.
    pub fn whole(file: &str, message: impl Into<String>) -> Self {
        Self {
            file: file.to_owned(),
            place: None,
            key: String::new(),
            message: message.into(),
            help: String::new(),
            next: None,
        }
    }

    /// An error at the byte `span` of `source`.
    pub fn at(file: &str, source: &str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self {
            place: Some(Box::new(Place::of_span(source, span))),
            ..Self::whole(file, message)
        }
    }

    /// An error on line `line` (from 1), whose text is `text`, marking the
    /// characters from `column` (from 1) on.
    pub fn on_line(
        file: &str,
        line: usize,
        text: &str,
        column: usize,
        width: usize,
        message: impl Into<String>,
    ) -> Self {
        let place = Place {
            line,
            column,
            width: width.max(1),
            text: text.to_owned(),
        };
        Self {
            place: Some(Box::new(place)),
            ..Self::whole(file, message)
        }
    }

    /// The first of `mistakes`, each of which stands alone, with all others behind it; none of none.
    pub fn joined(mistakes: Vec<Self>) -> Option<Self> {
        mistakes.into_iter().rev().reduce(|next, one| Self {
            next: Some(Box::new(next)),
            ..one
        })
    }

    /// The other mistakes that were found in the same run.
    pub fn others(&self) -> impl Iterator<Item = &Self> {
        std::iter::successors(self.next.as_deref(), |one| one.next.as_deref())
    }

    /// The same error, naming the key or column it is about.
    #[must_use]
    pub fn key(self, key: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            ..self
        }
    }

    /// The same error, saying what to do.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Self {
            help: help.into(),
            ..self
        }
    }
}

impl Place {
    /// The line that holds the start of the byte range `span` in `source`.
    fn of_span(source: &str, span: Range<usize>) -> Self {
        let start = floor_boundary(source, span.start);
        let end = floor_boundary(source, span.end).max(start);
        let line_start = source[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = source[start..]
            .find('\n')
            .map_or(source.len(), |at| start + at);
        let text = source[line_start..line_end].trim_end_matches('\r');
        let marked_end = end.min(line_end);
        Self {
            line: source[..start].matches('\n').count() + 1,
            column: source[line_start..start].chars().count() + 1,
            width: source[start..marked_end].chars().count().max(1),
            text: text.to_owned(),
        }
    }

    /// The line shortened around the mark, and the column of the mark in it.
    fn window(&self) -> (String, usize) {
        // Recordings have lines of thousands of characters; tabs would move
        // the caret.
        let skipped = self.column.saturating_sub(QUOTED_CHARACTERS * 2 / 3);
        let shown: String = self
            .text
            .chars()
            .skip(skipped)
            .take(QUOTED_CHARACTERS)
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        (shown, self.column - skipped)
    }
}

fn floor_boundary(source: &str, at: usize) -> usize {
    let mut at = at.min(source.len());
    while !source.is_char_boundary(at) {
        at -= 1;
    }
    at
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(place) = &self.place {
            write!(f, ":{}:{}", place.line, place.column)?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        if let Some(place) = &self.place {
            let (text, column) = place.window();
            let number = place.line.to_string();
            let room = text.chars().count().saturating_sub(column - 1).max(1);
            let carets = "^".repeat(place.width.min(room));
            write!(f, "\n {number} | {text}\n {:1$} | ", "", number.len())?;
            write!(f, "{:1$}{carets}", "", column - 1)?;
        }
        write!(f, "\n{}", self.message)?;
        if !self.help.is_empty() {
            write!(f, "\nhelp: {}", self.help)?;
        }
        match &self.next {
            Some(next) => write!(f, "\nalso: {next}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caret_stands_under_the_word() {
        let source = "[layer]\nc10 = \"75.5 um\"\n";
        let error = InputError::at("a.toml", source, 14..23, "\"um\" is not a unit of stress")
            .key("layer.c10")
            .help("use one of: Pa, kPa, MPa");
        let expected = "a.toml:2:7: layer.c10\n 2 | c10 = \"75.5 um\"\n   |       ^^^^^^^^^\n\
                        \"um\" is not a unit of stress\nhelp: use one of: Pa, kPa, MPa";
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn any_span_is_rendered_without_panic() {
        let source = "é = \"µ\"\r\nlast";
        for start in 0..20 {
            for end in 0..20 {
                let _ = InputError::at("f", source, start..end, "m").to_string();
            }
        }
    }
}
