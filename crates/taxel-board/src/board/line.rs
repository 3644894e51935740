//! A line of text: which number is what.

use super::description::{Decimal, Empty, FrameEnd, Lines, Packet};
use super::field::{Digits, Field, Is, Type, Within};
use super::layout::{AddressRange, Conversion, Counting};
use super::rules::{self, Broken, broken};
use super::template::{Part, Template};
use super::text_number::{TextNumber, is_no_number};
use super::{Format, LONGEST_LINE, ValueOfBoard, unit};
use crate::names::{self, MOST_VALUES};

/// How lines are read and written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LineFormat {
    /// End of a line; none for a line feed or a carriage return, whichever comes.
    end: Option<Vec<u8>>,
    pub(crate) longest: usize,
    pub(crate) frame: FrameEnd,
    templates: Vec<Vec<Piece>>,
    /// The template whose line completes a frame.
    last: usize,
    delimiters: Vec<char>,
    empty: Option<Empty>,
    decimal: Decimal,
    values: Vec<TextValue>,
    /// The lines of a frame, where each says which it is or a blank line stands before the first.
    pub(crate) address: Option<AddressRange>,
    /// True if a blank line stands between two frames.
    pub(crate) by_blank_lines: bool,
}

/// How a value is written, and what its number means.
#[derive(Debug, Clone, PartialEq)]
struct TextValue {
    text: TextNumber,
    conversion: Conversion,
}

/// A stretch of a line.
#[derive(Debug, Clone, PartialEq)]
enum Piece {
    Words(String),
    Value(usize),
    Sequence(TextNumber, Counting),
    /// Time; nanoseconds of one step.
    Time(f64, TextNumber),
    /// A status, and which are good; any where there is none.
    Status(TextNumber, Vec<u64>),
    Address(TextNumber),
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
    /// True if its status is not good.
    pub(crate) bad_status: bool,
    /// Which line of a frame it is, where it says so.
    pub(crate) slot: Option<usize>,
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
    if packet.order.is_some() {
        let message = "lines have no order of bytes";
        return Err(broken(&[&"packet", &"order"], message, "leave it out"));
    }
    let longest = rules::longest(lines.longest, LONGEST_LINE, "lines")?;
    let mut values = Vec::new();
    let mut texts = Vec::new();
    let templates = if lines.template.is_empty() {
        vec![of_fields(packet, &mut values, &mut texts)?]
    } else {
        of_templates(lines, packet, &mut values, &mut texts)?
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
    let address = match lines.rows {
        None => address(packet, &templates, several)?,
        Some(rows) => Some(counted_rows(rows, packet, &templates)?),
    };
    if let Some(address) = address {
        values = address.values(&values);
        if values.len() > MOST_VALUES {
            let message = format!("a frame has more than {MOST_VALUES} values");
            return Err(broken(&[&"packet", &"fields"], message, ""));
        }
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
    let end = lines.end.as_ref().map(|end| end.example().collect());
    let format = LineFormat {
        end,
        longest,
        frame: lines.frame,
        templates,
        last,
        delimiters,
        empty: lines.empty,
        decimal: lines.decimal,
        values: texts,
        address,
        by_blank_lines: lines.rows.is_some(),
    };
    Ok((Format::Lines(format), values))
}

/// The lines of a frame that follow each other.
fn counted_rows(
    rows: usize,
    packet: &Packet,
    templates: &[Vec<Piece>],
) -> Result<AddressRange, Broken> {
    let at = |message: String, help: &str| broken(&[&"framing", &"lines", &"rows"], message, help);
    if !(2..=MOST_VALUES).contains(&rows) {
        let message =
            format!("{rows} is out of range: must be at least 2 and at most {MOST_VALUES}");
        return Err(at(message, ""));
    }
    let addressed = packet.fields.iter().any(|field| field.is == Is::Address);
    if addressed || templates.len() > 1 {
        let message = "rows that follow each other are lines of one kind without an address";
        return Err(at(message.into(), "leave it out, or write one template"));
    }
    Ok(AddressRange {
        first: 0,
        step: 1,
        count: rows,
    })
}

/// The addresses of the lines of a frame, where lines have one.
fn address(
    packet: &Packet,
    templates: &[Vec<Piece>],
    several: bool,
) -> Result<Option<AddressRange>, Broken> {
    let field = packet
        .fields
        .iter()
        .position(|field| field.is == Is::Address);
    let is_address = |piece: &Piece| matches!(piece, Piece::Address(_));
    let named = templates.iter().flatten().any(is_address);
    let at = |place: usize, message: &str, help: &str| {
        broken(&[&"packet", &"fields", &place, &"is"], message, help)
    };
    match (field, named) {
        (None, false) => Ok(None),
        (None, true) => {
            let message = "how many lines make a frame?";
            let help = "add packet.fields = [{ is = \"address\", count = 8 }]; and first and step where they are not 0 and 1";
            Err(broken(&[&"framing", &"lines", &"template"], message, help))
        }
        (Some(place), false) => Err(at(place, "no template has it", "write {address} in it")),
        (Some(place), true) if several => {
            let message = "lines of several templates have no address";
            Err(at(place, message, "write one template with {address}"))
        }
        (Some(place), true) => Ok(Some(AddressRange::of(&packet.fields[place]))),
    }
}

/// The pieces of a line whose numbers are the fields in order.
fn of_fields(
    packet: &Packet,
    values: &mut Vec<ValueOfBoard>,
    texts: &mut Vec<TextValue>,
) -> Result<Vec<Piece>, Broken> {
    let mut pieces = Vec::new();
    for (place, field) in packet.fields.iter().enumerate() {
        rules::check_keys(field, Within::Line, place)?;
        check_hexadecimal(field, place)?;
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
                    texts.push(TextValue {
                        text: TextNumber::of(field),
                        conversion: rules::conversion(field, value.unit.si_per_unit, place)?,
                    });
                    values.push(value);
                }
            }
            Is::Sequence | Is::Time | Is::Address
                if packet.fields[..place]
                    .iter()
                    .any(|other| other.is == field.is) =>
            {
                let second = match field.is {
                    Is::Time => "time",
                    Is::Address => "address",
                    _ => "sequence",
                };
                return Err(at("is", format!("a second {second}; a line has one")));
            }
            Is::Sequence => {
                let counting = rules::counting(field);
                pieces.push(Piece::Sequence(TextNumber::of(field), counting));
            }
            Is::Time => {
                let step = field.unit.as_deref().and_then(unit::of_time);
                let step = step
                    .ok_or_else(|| at("unit", "a time needs its unit: s, ms, us or ns".into()))?;
                let scale = positive_scale(field, place)?;
                pieces.push(Piece::Time(step * scale, TextNumber::of(field)));
            }
            Is::Status => {
                pieces.push(Piece::Status(TextNumber::of(field), field.good.clone()));
            }
            Is::Skip => pieces.push(Piece::Skip),
            Is::Address => pieces.push(Piece::Address(TextNumber::of(field))),
            Is::Mark | Is::Check => {
                return Err(at(
                    "is",
                    "a line holds values, a sequence, a time, an address and what is skipped"
                        .into(),
                ));
            }
        }
    }
    Ok(pieces)
}

/// Hexadecimal digits are those of whole numbers.
fn check_hexadecimal(field: &Field, place: usize) -> Result<(), Broken> {
    if field.digits == Some(Digits::Hexadecimal) && field.kind.is_some_and(Type::is_float) {
        let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"type"];
        let message = "hexadecimal digits are those of whole numbers";
        return Err(broken(&path, message, "use u16, i16 or the like"));
    }
    Ok(())
}

/// Scale of the unit of a time.
fn positive_scale(field: &Field, place: usize) -> Result<f64, Broken> {
    let scale = field.scale.unwrap_or(1.0);
    if scale > 0.0 && scale.is_finite() {
        return Ok(scale);
    }
    let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"scale"];
    let message = format!("{scale} is out of range: must be greater than 0");
    Err(broken(&path, message, ""))
}

fn of_templates(
    lines: &Lines,
    packet: &Packet,
    values: &mut Vec<ValueOfBoard>,
    texts: &mut Vec<TextValue>,
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
                        texts.push(TextValue {
                            text: TextNumber::default(),
                            conversion: Conversion {
                                scale: value.unit.si_per_unit,
                                ..Conversion::plain()
                            },
                        });
                        pieces.push(Piece::Value(values.len()));
                        values.push(value);
                    }
                }
                Part::Sequence => {
                    pieces.push(Piece::Sequence(TextNumber::default(), Counting::PLAIN));
                }
                Part::Time(step) => pieces.push(Piece::Time(step, TextNumber::default())),
                Part::Address => pieces.push(Piece::Address(TextNumber::default())),
                Part::Skip => pieces.push(Piece::Skip),
            }
        }
        all.push(pieces);
    }
    // The fields of the packet say more about what the templates name.
    for (place, field) in packet.fields.iter().enumerate() {
        rules::check_keys(field, Within::Template, place)?;
        check_hexadecimal(field, place)?;
        let at = |key: &'static str, message: String| {
            broken(&[&"packet", &"fields", &place, &key], message, "")
        };
        if matches!(field.is, Is::Sequence | Is::Time | Is::Address) {
            if packet.fields[..place]
                .iter()
                .any(|other| other.is == field.is)
            {
                return Err(at("is", "it is described twice".into()));
            }
            if !say_more(&mut all, field, place)? {
                return Err(at("is", "no template has it".into()));
            }
            continue;
        }
        if field.is != Is::Value {
            let message =
                "beside a template, fields only say more of its values, sequence, time and address";
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
            texts[found] = TextValue {
                text: TextNumber::of(field),
                conversion: rules::conversion(field, value.unit.si_per_unit, place)?,
            };
            values[found] = value;
        }
    }
    Ok(all)
}

/// Takes what a field says of the sequence or the time of templates; false where none has it.
fn say_more(all: &mut [Vec<Piece>], field: &Field, place: usize) -> Result<bool, Broken> {
    let text_of_field = TextNumber::of(field);
    let scale = positive_scale(field, place)?;
    let unit = field.unit.as_deref().map(|unit| {
        unit::of_time(unit).ok_or_else(|| {
            let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"unit"];
            broken(
                &path,
                "a unit of time is needed here",
                "use one of: s, ms, us, ns",
            )
        })
    });
    let unit = unit.transpose()?;
    let mut found = false;
    for piece in all.iter_mut().flatten() {
        match piece {
            Piece::Sequence(text, counting) if field.is == Is::Sequence => {
                (*text, *counting) = (text_of_field, rules::counting(field));
                found = true;
            }
            Piece::Time(step, text) if field.is == Is::Time => {
                (*step, *text) = (unit.unwrap_or(*step) * scale, text_of_field);
                found = true;
            }
            Piece::Address(text) if field.is == Is::Address => {
                *text = text_of_field;
                found = true;
            }
            _ => {}
        }
    }
    Ok(found)
}

impl LineFormat {
    /// How the counter of the frames counts, and its type.
    pub(crate) fn sequence(&self) -> Option<(Counting, Option<Type>)> {
        let mut pieces = self.templates.iter().flatten();
        pieces.find_map(|piece| match piece {
            Piece::Sequence(text, counting) => Some((*counting, text.kind)),
            _ => None,
        })
    }

    /// Nanoseconds of one step of the clock, and its type.
    pub(crate) fn time(&self) -> Option<(f64, Option<Type>)> {
        let mut pieces = self.templates.iter().flatten();
        pieces.find_map(|piece| match piece {
            Piece::Time(step, text) => Some((*step, text.kind)),
            _ => None,
        })
    }

    /// Type, where it has one, and conversion of a value.
    pub(crate) fn value(&self, place: usize) -> Option<(Option<Type>, &Conversion)> {
        let value = self.values.get(place % self.values.len().max(1))?;
        Some((value.text.kind, &value.conversion))
    }

    /// Bytes to the end of the line that begins with `bytes[0]`, of which the first `searched`
    /// were looked at, and to the next; `None` before it ends.
    pub(crate) fn line_end(&self, bytes: &[u8], searched: usize) -> Option<(usize, usize)> {
        let Some(end) = &self.end else {
            // Where a blank line counts, none stands between the two bytes of one end.
            let is_end = |byte: u8| byte == b'\n' || (byte == b'\r' && !self.by_blank_lines);
            let ends = bytes[searched..].iter();
            let at = searched + ends.clone().position(|byte| is_end(*byte))?;
            return Some((at, at + 1));
        };
        // An end may have begun before.
        let from = searched.saturating_sub(end.len() - 1);
        let at = bytes[from..]
            .windows(end.len())
            .position(|window| window == end)?;
        Some((from + at, from + at + end.len()))
    }

    /// True if a line that lost its beginning may look like a whole one.
    pub(crate) fn may_begin_cut(&self) -> bool {
        self.templates.iter().any(
            |pieces| !matches!(pieces.first(), Some(Piece::Words(words)) if words.trim().len() > 1),
        )
    }

    /// What a line says; `None` for one that fits no template.
    pub(crate) fn read(&self, line: &str) -> Option<LineReading> {
        let plain;
        let line = if line.contains('\u{1b}') {
            plain = without_colours(line);
            &plain
        } else {
            line
        };
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
                Some(Piece::Words(words)) => Some(words.as_str()),
                _ => None,
            };
            let (token, behind) = self.token(rest, next_words);
            match piece {
                Piece::Skip | Piece::Words(_) => {}
                Piece::Value(value) => {
                    let TextValue { text, conversion } = self.values.get(*value)?;
                    let converted = match self.number(token, *text, &conversion.missing_words)? {
                        missing if missing.is_nan() => Some(f64::NAN),
                        number => conversion.value(number),
                    };
                    reading.out_of_range |= converted.is_none();
                    reading.values.push((*value, converted.unwrap_or(f64::NAN)));
                }
                Piece::Sequence(text, _) => {
                    reading.sequence = Some(text.whole(token.trim())?);
                }
                Piece::Time(_, text) => {
                    let time = self.number(token, *text, &[])?;
                    reading.time = Some(time).filter(|time| time.is_finite());
                    reading.time?;
                }
                Piece::Address(text) => {
                    let address = text.read(token.trim())?;
                    reading.slot = self.address?.slot(address as i64);
                    (address.fract() == 0.0 && reading.slot.is_some()).then_some(())?;
                }
                Piece::Status(text, good) => {
                    let status = text.whole(token.trim())?;
                    reading.bad_status |= !good.is_empty() && !good.contains(&status);
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

    /// The text of a number, which words may follow, and what is behind it.
    fn token<'a>(&self, rest: &'a str, next_words: Option<&str>) -> (&'a str, &'a str) {
        // A number in quotes may hold a delimiter: `"51,72"`.
        if let Some(inside) = rest.strip_prefix('"')
            && let Some(end) = inside.find('"')
        {
            return (&rest[..end + 2], &inside[end + 1..]);
        }
        let blank = next_words.is_some_and(|words| words.starts_with(char::is_whitespace));
        // The next word ends a number where it cannot be a part of it.
        let word = next_words.and_then(|words| words.trim_start().chars().next());
        let word = word.filter(|c| !c.is_ascii_digit() && !"+-.".contains(*c));
        let ends = |c: char| {
            self.delimiters.contains(&c) || (blank && c.is_whitespace()) || Some(c) == word
        };
        rest.split_at(rest.find(ends).unwrap_or(rest.len()))
    }

    /// A number; NaN where there is none and that means a missing one.
    fn number(&self, token: &str, text: TextNumber, missing: &[String]) -> Option<f64> {
        let token = token.trim();
        let quoted = token
            .strip_prefix('"')
            .and_then(|rest| rest.strip_suffix('"'));
        let token = quoted.map_or(token, str::trim);
        if token.is_empty() {
            return self.empty.map(|Empty::Missing| f64::NAN);
        }
        if missing.iter().any(|word| word == token) {
            return Some(f64::NAN);
        }
        if let Some(number) = match (self.decimal, quoted) {
            (Decimal::Comma, _) if token.contains('.') => None,
            (Decimal::Comma, _) => text.read(&token.replace(',', ".")),
            (Decimal::Point, Some(_)) if !token.contains('.') => {
                text.read(&token.replace(',', "."))
            }
            (Decimal::Point, _) => text.read(token),
        } {
            return Some(number);
        }
        is_no_number(token).then_some(f64::NAN)
    }

    /// Values of one line, where the lines of a frame have addresses.
    pub(crate) fn values_of_line(&self) -> usize {
        self.values.len()
    }

    /// The lines of a frame, whose counter reads `sequence` in the line of a place.
    pub(crate) fn write(
        &self,
        values: &[f64],
        sequence: impl Fn(usize) -> u64,
        time_ns: u64,
        out: &mut Vec<u8>,
    ) {
        for slot in 0..self.address.map_or(1, |address| address.count) {
            let own = &values[slot * self.values.len()..];
            self.write_line(slot, own, sequence(slot), time_ns, out);
        }
        if self.by_blank_lines {
            out.extend_from_slice(self.end.as_deref().unwrap_or(b"\r\n"));
        }
    }

    fn write_line(
        &self,
        slot: usize,
        values: &[f64],
        sequence: u64,
        time_ns: u64,
        out: &mut Vec<u8>,
    ) {
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
                        let TextValue { text, conversion } = &self.values[*value];
                        let number = conversion.number(number);
                        match conversion.missing_words.first() {
                            Some(word) if number.is_nan() => line.push_str(word),
                            _ => line.push_str(&self.text_of(number, *text)),
                        }
                    }
                    Piece::Sequence(text, _) => line.push_str(&text.write(sequence as f64)),
                    Piece::Time(step, text) => {
                        let steps = time_ns as f64 / step;
                        let whole = text.kind.is_some_and(|kind| !kind.is_float());
                        let steps = if whole { steps.round() } else { steps };
                        line.push_str(&self.text_of(steps, *text));
                    }
                    Piece::Status(text, good) => {
                        let good = good.first().copied().unwrap_or(0);
                        line.push_str(&text.write(good as f64));
                    }
                    Piece::Address(text) => {
                        let address = self.address.map_or(0, |address| address.at(slot));
                        line.push_str(&text.write(address as f64));
                    }
                    Piece::Skip => line.push('0'),
                    Piece::Words(_) => {}
                }
            }
            out.extend_from_slice(line.as_bytes());
            out.extend_from_slice(self.end.as_deref().unwrap_or(b"\r\n"));
        }
    }

    fn text_of(&self, number: f64, text: TextNumber) -> String {
        if number.is_nan() {
            return match self.empty {
                Some(Empty::Missing) => String::new(),
                None => "nan".into(),
            };
        }
        let text = text.write(number);
        match self.decimal {
            Decimal::Point => text,
            Decimal::Comma => text.replace('.', ","),
        }
    }
}

/// What follows the words. A blank in them matches a run of blanks, and none where nothing runs
/// together without it: a number stands alone.
fn after_words<'a>(words: &str, text: &'a str) -> Option<&'a str> {
    let mut rest = text;
    let mut blank = words.starts_with(char::is_whitespace);
    let ends_blank = words.ends_with(char::is_whitespace);
    let mut words = words.split_whitespace().peekable();
    while let Some(word) = words.next() {
        if blank {
            rest = rest.trim_start();
        }
        rest = rest.strip_prefix(word)?;
        blank = words.peek().is_some() || ends_blank;
        // `1 2` is not in `12`, nor `1 ` in `10`.
        let runs = |c: char| c.is_alphanumeric() || c == '.';
        if blank && word.ends_with(runs) && rest.starts_with(runs) {
            return None;
        }
    }
    Some(if blank { rest.trim_start() } else { rest })
}

/// A line without the codes that colour it on a terminal (`ESC [ … m`).
fn without_colours(line: &str) -> String {
    let mut pieces = line.split("\u{1b}[");
    let mut plain = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let is_code = |c: char| c.is_ascii_digit() || c == ';';
        let behind = piece.trim_start_matches(is_code);
        plain.push_str(behind.strip_prefix('m').unwrap_or(behind));
    }
    plain
}
