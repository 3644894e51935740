//! A line of text: which number is what.

use super::description::{Decimal, Empty, FrameEnd, Lines, Packet};
use super::field::Is;
use super::layout::Conversion;
use super::rules::{self, Broken, broken};
use super::template::{Part, Template};
use super::{Format, LONGEST_LINE, ValueOfBoard, unit};
use crate::names;

/// Longest number in a line, characters.
const LONGEST_NUMBER: usize = 64;

/// How lines are read and written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LineFormat {
    pub(crate) end: Vec<u8>,
    pub(crate) longest: usize,
    pub(crate) frame: FrameEnd,
    templates: Vec<Vec<Piece>>,
    /// The template whose line completes a frame.
    last: usize,
    delimiters: Vec<char>,
    empty: Option<Empty>,
    decimal: Decimal,
    conversions: Vec<Conversion>,
}

/// A stretch of a line.
#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Words(String),
    Value(usize),
    Sequence,
    Time(f64),
    Skip,
}

/// What a line said.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct LineReading {
    /// Place and value, SI.
    pub(crate) values: Vec<(usize, f64)>,
    pub(crate) sequence: Option<u64>,
    pub(crate) time: Option<f64>,
    /// True if the frame is complete with it.
    pub(crate) completes: bool,
    /// True if a value lies outside its range.
    pub(crate) out_of_range: bool,
}

pub(super) fn resolve(
    lines: &Lines,
    packet: &Packet,
) -> Result<(Format, Vec<ValueOfBoard>), Broken> {
    if packet.check.is_some() {
        let help = "leave it out; a template may name the words of a line";
        let message = "lines have no check of their own here";
        return Err(broken(&[&"packet", &"check"], message, help));
    }
    if let Some(place) = packet.fields.iter().position(|field| field.is == Is::Mark) {
        let message = "a line has no head: its end is what marks it";
        let help = "name words that must be there in framing.lines.template";
        return Err(broken(
            &[&"packet", &"fields", &place, &"is"],
            message,
            help,
        ));
    }
    let longest = rules::longest(lines.longest, LONGEST_LINE, "lines")?;
    let mut values = Vec::new();
    let mut conversions = Vec::new();
    let templates = if lines.template.is_empty() {
        vec![of_fields(packet, &mut values, &mut conversions)?]
    } else {
        of_templates(lines, packet, &mut values, &mut conversions)?
    };
    if values.is_empty() {
        let (key, help): (&[&dyn std::fmt::Display], _) = if lines.template.is_empty() {
            let help = "add framing.lines.template, such as \"{value c1..c4}\", or fields";
            (&[&"framing", &"lines"], help)
        } else {
            let help = "name one in a template, such as {value c1..c4}";
            (&[&"framing", &"lines", &"template"], help)
        };
        return Err(broken(key, "no line has a value", help));
    }
    let holds_value =
        |pieces: &Vec<Piece>| pieces.iter().any(|piece| matches!(piece, Piece::Value(_)));
    let last = templates.iter().rposition(holds_value).unwrap_or(0);
    let several = templates
        .iter()
        .filter(|pieces| holds_value(pieces))
        .count()
        > 1;
    if several && lines.frame == FrameEnd::Each {
        let message = "the values of a frame come in several lines";
        let help = "say framing.lines.frame = \"last\": the line of the last template with a value completes the frame";
        return Err(broken(&[&"framing", &"lines", &"template"], message, help));
    }
    let delimiters: Vec<char> = match &lines.delimiters {
        None if lines.decimal == Decimal::Comma => " \t;".chars().collect(),
        None => " \t,;".chars().collect(),
        Some(given) => given.chars().collect(),
    };
    if delimiters.is_empty()
        || delimiters
            .iter()
            .any(|c| c.is_alphanumeric() || ".+-".contains(*c))
    {
        let message = "delimiters are characters that no number has";
        let help = "such as \", \\t\"";
        return Err(broken(
            &[&"framing", &"lines", &"delimiters"],
            message,
            help,
        ));
    }
    if lines.decimal == Decimal::Comma && delimiters.contains(&',') {
        let message = "a comma cannot be the decimal sign and a delimiter";
        let help = "give delimiters without it, such as \";\"";
        return Err(broken(&[&"framing", &"lines", &"decimal"], message, help));
    }
    let end: Vec<u8> = match &lines.end {
        None => vec![b'\n'],
        Some(end) => end.example().collect(),
    };
    let format = LineFormat {
        end,
        longest,
        frame: lines.frame,
        templates,
        last,
        delimiters,
        empty: lines.empty,
        decimal: lines.decimal,
        conversions,
    };
    Ok((Format::Lines(format), values))
}

/// The pieces of a line whose numbers are the fields in order.
fn of_fields(
    packet: &Packet,
    values: &mut Vec<ValueOfBoard>,
    conversions: &mut Vec<Conversion>,
) -> Result<Vec<Piece>, Broken> {
    let mut pieces = Vec::new();
    for (place, field) in packet.fields.iter().enumerate() {
        rules::check_numbers(field, place)?;
        let at = |key: &'static str, message: String| {
            broken(&[&"packet", &"fields", &place, &key], message, "")
        };
        match field.is {
            Is::Value => {
                let names = names::expanded(field.name.as_deref().unwrap_or(""))
                    .map_err(|message| at("name", message))?;
                for name in names {
                    pieces.push(Piece::Value(values.len()));
                    let value = rules::value_of_board(name, field.unit.as_deref())
                        .map_err(|message| at("unit", message))?;
                    conversions.push(rules::conversion(field, value.unit.si_per_unit, place)?);
                    values.push(value);
                }
            }
            Is::Sequence if pieces.contains(&Piece::Sequence) => {
                return Err(at("is", "a second sequence; a line has one".into()));
            }
            Is::Sequence => pieces.push(Piece::Sequence),
            Is::Time if pieces.iter().any(|piece| matches!(piece, Piece::Time(_))) => {
                return Err(at("is", "a second time; a line has one".into()));
            }
            Is::Time => {
                let step = field.unit.as_deref().and_then(unit::of_time);
                let step = step
                    .ok_or_else(|| at("unit", "a time needs its unit: s, ms, us or ns".into()))?;
                pieces.push(Piece::Time(step * field.scale.unwrap_or(1.0)));
            }
            Is::Skip | Is::Status => pieces.push(Piece::Skip),
            Is::Mark | Is::Address | Is::Check => {
                return Err(at(
                    "is",
                    "a line holds values, a sequence, a time and what is skipped".into(),
                ));
            }
        }
    }
    Ok(pieces)
}

fn of_templates(
    lines: &Lines,
    packet: &Packet,
    values: &mut Vec<ValueOfBoard>,
    conversions: &mut Vec<Conversion>,
) -> Result<Vec<Vec<Piece>>, Broken> {
    let mut all = Vec::new();
    for (place, text) in lines.template.iter().enumerate() {
        let at =
            |message: String| broken(&[&"framing", &"lines", &"template", &place], message, "");
        let template =
            Template::parse(text).map_err(|(message, within)| at(message).within(within))?;
        if all.len() >= 64 {
            return Err(at("more than 64 templates".into()));
        }
        let mut pieces = Vec::new();
        for (part, within) in template.parts {
            match part {
                Part::Words(words) => pieces.push(Piece::Words(words)),
                Part::Values(names, symbol) => {
                    for name in names {
                        if values.iter().any(|value| value.name == name) {
                            let message = format!("a second value is called \"{name}\"");
                            return Err(at(message).within(within));
                        }
                        let value = rules::value_of_board(name, symbol.as_deref())
                            .map_err(|message| at(message).within(within.clone()))?;
                        conversions.push(Conversion {
                            scale: value.unit.si_per_unit,
                            ..Conversion::plain()
                        });
                        pieces.push(Piece::Value(values.len()));
                        values.push(value);
                    }
                }
                Part::Sequence => pieces.push(Piece::Sequence),
                Part::Time(step) => pieces.push(Piece::Time(step)),
                Part::Skip => pieces.push(Piece::Skip),
            }
        }
        all.push(pieces);
    }
    // The fields of the packet say more about values that the templates name.
    for (place, field) in packet.fields.iter().enumerate() {
        let at = |key: &'static str, message: String| {
            broken(&[&"packet", &"fields", &place, &key], message, "")
        };
        rules::check_numbers(field, place)?;
        if field.is != Is::Value {
            let message = "beside a template, fields only say what its values are";
            return Err(at("is", message.into()));
        }
        let names = names::expanded(field.name.as_deref().unwrap_or(""))
            .map_err(|message| at("name", message))?;
        for name in names {
            let found = values.iter().position(|value| value.name == name);
            let found = found
                .ok_or_else(|| at("name", format!("no template has a value called \"{name}\"")))?;
            let symbol = field
                .unit
                .clone()
                .unwrap_or_else(|| values[found].unit.symbol.clone());
            let value =
                rules::value_of_board(name, Some(symbol.as_str()).filter(|s| *s != "counts"))
                    .map_err(|message| at("unit", message))?;
            conversions[found] = rules::conversion(field, value.unit.si_per_unit, place)?;
            values[found] = value;
        }
    }
    Ok(all)
}

impl LineFormat {
    pub(crate) fn has_sequence(&self) -> bool {
        self.templates
            .iter()
            .flatten()
            .any(|piece| *piece == Piece::Sequence)
    }

    pub(crate) fn time_step_ns(&self) -> Option<f64> {
        self.templates
            .iter()
            .flatten()
            .find_map(|piece| match piece {
                Piece::Time(step) => Some(*step),
                _ => None,
            })
    }

    /// True if a line that lost its beginning may look like a whole one.
    pub(crate) fn may_begin_cut(&self) -> bool {
        self.templates.iter().any(
            |pieces| !matches!(pieces.first(), Some(Piece::Words(words)) if words.trim().len() > 1),
        )
    }

    /// What a line says; `None` for one that fits no template.
    pub(crate) fn read(&self, line: &str) -> Option<LineReading> {
        let line = line.strip_suffix('\r').unwrap_or(line);
        self.templates
            .iter()
            .enumerate()
            .find_map(|(place, pieces)| {
                let mut reading = self.fit(pieces, line)?;
                reading.completes = match self.frame {
                    FrameEnd::Each => !reading.values.is_empty(),
                    FrameEnd::Last => place == self.last,
                };
                Some(reading)
            })
    }

    fn fit(&self, pieces: &[Piece], line: &str) -> Option<LineReading> {
        let mut reading = LineReading::default();
        let mut rest = line;
        let mut behind_number = false;
        for (place, piece) in pieces.iter().enumerate() {
            if let Piece::Words(words) = piece {
                rest = after_words(words, rest)?;
                behind_number = false;
                continue;
            }
            if behind_number {
                rest = self.after_delimiter(rest)?;
            } else {
                rest = rest.trim_start();
            }
            behind_number = true;
            let next_words = match pieces.get(place + 1) {
                Some(Piece::Words(words)) => words.trim_start().chars().next(),
                _ => None,
            };
            let token_end = rest
                .find(|c| self.delimiters.contains(&c) || Some(c) == next_words)
                .unwrap_or(rest.len());
            let (token, behind) = rest.split_at(token_end);
            match piece {
                Piece::Skip | Piece::Words(_) => {}
                Piece::Value(value) => {
                    let number = self.number(token)?;
                    let converted = if number.is_nan() {
                        Some(f64::NAN)
                    } else {
                        self.conversions.get(*value)?.value(number)
                    };
                    reading.out_of_range |= converted.is_none();
                    reading.values.push((*value, converted.unwrap_or(f64::NAN)));
                }
                Piece::Sequence => {
                    reading.sequence = Some(token.trim().parse().ok()?);
                }
                Piece::Time(_) => {
                    let time = self.number(token).filter(|time| time.is_finite())?;
                    reading.time = Some(time);
                }
            }
            rest = behind;
        }
        let left =
            |c: char| c.is_whitespace() || (self.delimiters.contains(&c) && self.empty.is_none());
        rest.trim_end_matches(left).is_empty().then_some(reading)
    }

    /// What follows a delimiter, or a run of them.
    fn after_delimiter<'a>(&self, text: &'a str) -> Option<&'a str> {
        let is_delimiter = |c: char| self.delimiters.contains(&c);
        if self.empty.is_some() {
            // Blanks beside a delimiter that is not one belong to it.
            let blank_delimits = is_delimiter(' ');
            let text = if blank_delimits {
                text
            } else {
                text.trim_start()
            };
            let behind = text.strip_prefix(is_delimiter)?;
            return Some(if blank_delimits {
                behind
            } else {
                behind.trim_start()
            });
        }
        let behind = text.trim_start_matches(|c: char| is_delimiter(c) || c.is_whitespace());
        (behind.len() < text.len()).then_some(behind)
    }

    /// A number; NaN where there is none and that means a missing one.
    fn number(&self, token: &str) -> Option<f64> {
        let token = token.trim();
        if token.is_empty() {
            return self.empty.map(|Empty::Missing| f64::NAN);
        }
        if token.eq_ignore_ascii_case("nan") || token == "null" {
            return Some(f64::NAN);
        }
        if token.len() > LONGEST_NUMBER
            || !token
                .bytes()
                .all(|c| c.is_ascii_digit() || b"+-.,eE".contains(&c))
        {
            return None;
        }
        let number = match self.decimal {
            Decimal::Point => token.parse(),
            Decimal::Comma if token.contains('.') => return None,
            Decimal::Comma => token.replace(',', ".").parse(),
        };
        number.ok().filter(|number: &f64| number.is_finite())
    }

    /// The lines of a frame.
    pub(crate) fn write(&self, values: &[f64], sequence: u64, time_ns: u64, out: &mut Vec<u8>) {
        for pieces in &self.templates {
            let mut line = String::new();
            let mut behind_number = false;
            for piece in pieces {
                if let Piece::Words(words) = piece {
                    line.push_str(words);
                    behind_number = false;
                    continue;
                }
                if behind_number {
                    line.push(self.delimiters[0]);
                }
                behind_number = true;
                match piece {
                    Piece::Value(value) => {
                        let number = values.get(*value).copied().unwrap_or(f64::NAN);
                        let number = self.conversions[*value].number(number);
                        line.push_str(&self.text_of(number));
                    }
                    Piece::Sequence => line.push_str(&sequence.to_string()),
                    Piece::Time(step) => {
                        line.push_str(&self.text_of(time_ns as f64 / step));
                    }
                    Piece::Skip => line.push('0'),
                    Piece::Words(_) => {}
                }
            }
            out.extend_from_slice(line.as_bytes());
            if self.end == [b'\n'] {
                out.push(b'\r');
            }
            out.extend_from_slice(&self.end);
        }
    }

    fn text_of(&self, number: f64) -> String {
        if number.is_nan() {
            return match self.empty {
                Some(Empty::Missing) => String::new(),
                None => "nan".into(),
            };
        }
        let text = number.to_string();
        match self.decimal {
            Decimal::Point => text,
            Decimal::Comma => text.replace('.', ","),
        }
    }
}

/// What follows the words; a blank in them matches any run of blanks.
fn after_words<'a>(words: &str, text: &'a str) -> Option<&'a str> {
    let mut rest = text;
    let begins_blank = words.starts_with(char::is_whitespace);
    for (place, word) in words.split_whitespace().enumerate() {
        if place > 0 || begins_blank {
            rest = rest.trim_start();
        }
        rest = rest.strip_prefix(word)?;
    }
    Some(if words.ends_with(char::is_whitespace) || begins_blank {
        rest.trim_start()
    } else {
        rest
    })
}
