//! JSON objects, one behind the other.

use serde_json::{Map, Number, Value};
use taxel_recording::Frame;

use super::candidate::{Around, Candidate};
use super::packet::{Reading, Verdict};
use crate::board::messages::{Body, JsonField, JsonRole, MessageFormat, MessageLayout};
use crate::board::text_number::is_no_number;
use crate::board::{Digits, Id, Type};

/// Deepest object or list.
const DEEPEST: usize = 32;

/// How far the object at a place of the buffer was followed.
#[derive(Debug, Clone, Default)]
pub(super) struct Scan {
    at: usize,
    depth: usize,
    in_string: bool,
    escaped: bool,
    /// Last byte that is no blank, outside strings.
    last: u8,
}

impl Scan {
    /// Goes on with an object that begins with `bytes[0]`: where it ends; `None` before it
    /// does, and an error for bytes that are no JSON.
    fn end(&mut self, bytes: &[u8]) -> Result<Option<usize>, ()> {
        while let Some(byte) = bytes.get(self.at).copied() {
            self.at += 1;
            if self.in_string {
                match byte {
                    _ if self.escaped => self.escaped = false,
                    b'\\' => self.escaped = true,
                    b'"' => self.in_string = false,
                    // A line feed in a string: its end is missing.
                    0..=0x1f => return Err(()),
                    _ => {}
                }
                continue;
            }
            match byte {
                b' ' | b'\t' | b'\r' | b'\n' => continue,
                b'"' => self.in_string = true,
                b'{' | b'[' => {
                    // Anything else before it: the end of another object is missing.
                    let follows = matches!(self.last, 0 | b':' | b',' | b'[');
                    if !follows || self.depth == DEEPEST {
                        return Err(());
                    }
                    self.depth += 1;
                }
                b'}' | b']' => {
                    self.depth -= 1;
                    if self.depth == 0 {
                        return Ok(Some(self.at));
                    }
                }
                b':' | b',' | b'+' | b'-' | b'.' | b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z' => {}
                _ => return Err(()),
            }
            self.last = byte;
        }
        Ok(None)
    }
}

/// The object, or the text that is none, at a place of the buffer.
pub(super) fn candidate(format: &MessageFormat, scan: &mut Scan, around: Around<'_>) -> Candidate {
    let found = look(format, scan, around);
    if found != Candidate::More {
        *scan = Scan::default();
    }
    found
}

fn look(format: &MessageFormat, scan: &mut Scan, around: Around<'_>) -> Candidate {
    let bytes = around.bytes;
    let blanks = bytes.iter().take_while(|byte| byte.is_ascii_whitespace());
    match blanks.count() {
        0 => {}
        blanks => return Candidate::Blank(blanks),
    }
    let within = &bytes[..bytes.len().min(format.longest)];
    if bytes[0] != b'{' {
        // Text to the end of its line, or to an object.
        let end = within.iter().position(|byte| matches!(byte, b'\n' | b'{'));
        return match end {
            Some(end) => Candidate::Other(end),
            None if bytes.len() >= format.longest => Candidate::Damaged(format.longest),
            None if around.last => Candidate::Other(bytes.len()),
            None => Candidate::More,
        };
    }
    match scan.end(within) {
        Ok(None) if bytes.len() < format.longest => Candidate::More,
        Err(()) | Ok(None) => Candidate::None(to_next(bytes)),
        Ok(Some(end)) => match parsed(&bytes[..end]) {
            Err(_) => Candidate::None(to_next(bytes)),
            Ok(object) => match read(format, &object) {
                Verdict::Reading(reading) => Candidate::Reading(end, reading),
                Verdict::Other => Candidate::Other(end),
                Verdict::Damaged => Candidate::Damaged(end),
            },
        },
    }
}

/// An object; `NaN`, `Infinity` and their like, which are no JSON and which programs write, are
/// `null`.
fn parsed(bytes: &[u8]) -> serde_json::Result<Value> {
    serde_json::from_slice(bytes).or_else(|error| {
        let mut plain = Vec::with_capacity(bytes.len());
        let (mut in_string, mut at) = (false, 0);
        while at < bytes.len() {
            let byte = bytes[at];
            let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-.".contains(byte);
            let word = bytes[at..].iter().take_while(|byte| is_word(byte)).count();
            if in_string || word == 0 {
                let escaped = in_string && byte == b'\\';
                in_string ^= byte == b'"';
                let count = if escaped { 2 } else { 1 }.min(bytes.len() - at);
                plain.extend_from_slice(&bytes[at..at + count]);
                at += count;
                continue;
            }
            let word = &bytes[at..at + word];
            let text = std::str::from_utf8(word).unwrap_or_default();
            plain.extend_from_slice(if is_no_number(text) { b"null" } else { word });
            at += word.len();
        }
        serde_json::from_slice(&plain).map_err(|_| error)
    })
}

/// Bytes to the next object.
fn to_next(bytes: &[u8]) -> usize {
    let next = bytes[1..].iter().position(|byte| *byte == b'{');
    next.map_or(bytes.len(), |next| next + 1)
}

/// What an object says: other, where none with its keys is described.
fn read(format: &MessageFormat, object: &Value) -> Verdict {
    for layout in &format.messages {
        let Body::Json(fields) = &layout.body else {
            continue;
        };
        let Some(number) = number_of(layout, object) else {
            continue;
        };
        let samples = match &layout.samples {
            None => vec![object],
            Some(list) => match object.pointer(list) {
                Some(Value::Array(list)) => list.iter().collect(),
                _ => continue,
            },
        };
        // What an entry of the list does not have stands in the message.
        let found = |sample: &&Value, field: &JsonField| {
            let there = sample.pointer(&field.pointer).is_some();
            there || object.pointer(&field.pointer).is_some()
        };
        let all = |sample: &&Value| fields.iter().all(|field| found(sample, field));
        if samples.is_empty() || !samples.iter().all(all) {
            continue;
        }
        let mut whole = Reading::default();
        for sample in samples {
            let Some(reading) = reading(layout, fields, sample, object) else {
                return Verdict::Damaged;
            };
            whole.values.extend(reading.values);
            whole.bad_status |= reading.bad_status;
            (whole.sequence, whole.time) = (reading.sequence, reading.time);
            if layout.samples.is_some() {
                whole.each.push((reading.sequence, reading.own_time));
            }
        }
        return Verdict::Reading(whole.placed(layout, number));
    }
    Verdict::Other
}

/// Which of the messages of one kind an object is; `None` for none.
fn number_of(layout: &MessageLayout, object: &Value) -> Option<usize> {
    let Some(key) = &layout.key else {
        return Some(0);
    };
    let found = object.pointer(key)?;
    if layout.ids.is_empty() {
        return Some(0);
    }
    layout.ids.iter().position(|id| match (id, found) {
        (Id::Number(id), Value::Number(found)) => found.as_u64() == Some(*id),
        (Id::Number(id), Value::String(found)) => found.parse() == Ok(*id),
        (Id::Text(id), Value::String(found)) => id == found,
        _ => false,
    })
}

/// What one entry of the list of a message says, or a message without one.
#[derive(Default)]
struct Sample {
    values: Vec<f64>,
    sequence: Option<u64>,
    time: Option<f64>,
    /// The time that the entry itself has.
    own_time: Option<f64>,
    bad_status: bool,
}

/// The values of a `sample` of an object; `None` where one is no number, or outside its range.
fn reading(
    layout: &MessageLayout,
    fields: &[JsonField],
    sample: &Value,
    object: &Value,
) -> Option<Sample> {
    let mut reading = Sample {
        values: vec![f64::NAN; layout.values],
        ..Sample::default()
    };
    let mut numbers = Vec::new();
    for field in fields {
        numbers.clear();
        let words: &[String] = match &field.role {
            JsonRole::Values { conversion, .. } => &conversion.missing_words,
            _ => &[],
        };
        let own = sample.pointer(&field.pointer);
        let value = own.or_else(|| object.pointer(&field.pointer))?;
        field.numbers(value, words, &mut numbers)?;
        match &field.role {
            JsonRole::Values {
                first,
                count,
                conversion,
            } => {
                // A list that ends before: the board has fewer.
                if numbers.is_empty() || numbers.len() > *count {
                    return None;
                }
                for (value, number) in reading.values[*first..].iter_mut().zip(&numbers) {
                    *value = if number.is_nan() {
                        f64::NAN
                    } else {
                        conversion.value(*number)?
                    };
                }
            }
            JsonRole::Sequence(_) => reading.sequence = Some(whole(&numbers)?),
            JsonRole::Time(_) => match numbers[..] {
                [time] if time.is_finite() => {
                    reading.time = Some(time);
                    reading.own_time = own.map(|_| time);
                }
                _ => return None,
            },
            JsonRole::Status(status) => {
                let good = &status.good;
                reading.bad_status |= !good.is_empty() && !good.contains(&whole(&numbers)?);
            }
        }
    }
    Some(reading)
}

/// One whole number without sign.
fn whole(numbers: &[f64]) -> Option<u64> {
    match numbers {
        [number] if *number >= 0.0 && number.fract() == 0.0 && *number < 2_f64.powi(63) => {
            Some(*number as u64)
        }
        _ => None,
    }
}

impl JsonField {
    /// The numbers of a value: of a number, of text with delimiters, of lists of these. NaN
    /// for `null` and for the `missing` words.
    fn numbers(&self, value: &Value, missing: &[String], out: &mut Vec<f64>) -> Option<()> {
        match value {
            Value::Null => out.push(f64::NAN),
            Value::Bool(is) => out.push(f64::from(u8::from(*is))),
            Value::Number(number) => {
                let number = number.as_f64()?;
                out.push(self.text.holds(number).then_some(number)?);
            }
            Value::String(text) => {
                let delimiter = |c: char| matches!(c, ',' | ';') || c.is_whitespace();
                for word in text.split(delimiter).filter(|word| !word.is_empty()) {
                    let stated = missing.iter().any(|missing| missing == word);
                    let number = self.text.read(word).filter(|_| !stated);
                    let none = (stated || is_no_number(word)).then_some(f64::NAN);
                    out.push(number.or(none)?);
                }
            }
            Value::Array(values) => {
                for value in values {
                    self.numbers(value, missing, out)?;
                }
            }
            Value::Object(_) => return None,
        }
        Some(())
    }

    /// The inverse of [`Self::numbers`].
    fn value(&self, numbers: impl ExactSizeIterator<Item = f64>) -> Value {
        match self.text.digits {
            Digits::Hexadecimal => {
                let words: Vec<String> = numbers.map(|number| self.text.write(number)).collect();
                Value::String(words.join(","))
            }
            Digits::Decimal => {
                let mut values: Vec<Value> = numbers.map(json_number).collect();
                if values.len() == 1 {
                    values.remove(0)
                } else {
                    Value::Array(values)
                }
            }
        }
    }
}

/// A number as JSON has it: whole without a point, `null` for none.
fn json_number(number: f64) -> Value {
    let whole = number as i64;
    if whole as f64 == number && whole.unsigned_abs() < 1 << 53 {
        Value::Number(whole.into())
    } else {
        Number::from_f64(number).map_or(Value::Null, Value::Number)
    }
}

/// Appends the objects of one kind of message, each with its line feed.
pub(super) fn write(
    layout: &MessageLayout,
    fields: &[JsonField],
    values: &[f64],
    of_slot: &impl Fn(usize) -> Frame,
    out: &mut Vec<u8>,
) {
    for number in 0..layout.slots() {
        let frame = of_slot(layout.first_slot + number);
        let mut whole = Value::Object(Map::new());
        let mut object = Value::Object(Map::new());
        let holder = if layout.samples.is_some() {
            &mut whole
        } else {
            &mut object
        };
        if let Some(key) = &layout.key {
            let id = match layout.ids.get(number) {
                Some(Id::Number(id)) => Value::Number((*id).into()),
                Some(Id::Text(id)) => Value::String(id.clone()),
                None => Value::Bool(true),
            };
            put(holder, key, id);
        }
        for field in fields {
            let value = match &field.role {
                JsonRole::Values {
                    first,
                    count,
                    conversion,
                } => {
                    let from = layout.first_value + number * layout.values + first;
                    let values = values[from..from + count].iter();
                    field.value(values.map(|value| conversion.number(*value)))
                }
                JsonRole::Sequence(_) => {
                    let bits = field.text.kind.map_or(64, Type::bits).min(64);
                    Value::Number((frame.sequence & (u64::MAX >> (64 - bits))).into())
                }
                JsonRole::Time(step_ns) => json_number(frame.time_ns as f64 / step_ns),
                JsonRole::Status(status) => {
                    Value::Number(status.good.first().copied().unwrap_or(0).into())
                }
            };
            put(&mut object, &field.pointer, value);
        }
        if let Some(list) = &layout.samples {
            put(&mut whole, list, Value::Array(vec![object]));
            object = whole;
        }
        out.extend_from_slice(object.to_string().as_bytes());
        out.push(b'\n');
    }
}

/// Puts a value where the pointer leads, in objects that it makes on the way.
fn put(object: &mut Value, pointer: &str, value: Value) {
    let mut place = object;
    for key in pointer.split('/').skip(1) {
        if !place.is_object() {
            *place = Value::Object(Map::new());
        }
        let Value::Object(keys) = place else { return };
        let key = key.replace("~1", "/").replace("~0", "~");
        place = keys.entry(key).or_insert(Value::Null);
    }
    *place = value;
}
