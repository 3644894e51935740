//! Keys of a sensor file: paths into its text, which is edited and read as usual.

use taxel::quantity::Dimension;
use taxel::words::distance;
use toml_edit::{DocumentMut, Item, Value};

use crate::exponents::quantity_of;

/// A path such as `element.three_axis_capacitor.suspension.stiffness[0]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyPath {
    /// The path as written.
    pub text: String,
    segments: Vec<Segment>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Segment {
    Name(String),
    Index(usize),
}

/// How a value is written into a sensor file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A text with this unit.
    Quantity(&'static Dimension, &'static str),
    /// A number without a unit.
    Number,
    /// A whole number.
    Whole,
}

impl KeyPath {
    /// Reads a path; none for what is no path.
    pub fn parse(text: &str) -> Option<Self> {
        let mut segments = Vec::new();
        for part in text.split('.') {
            let (name, mut rest) = part.split_at(part.find('[').unwrap_or(part.len()));
            if name.is_empty() {
                return None;
            }
            segments.push(Segment::Name(name.to_owned()));
            while !rest.is_empty() {
                let (index, behind) = rest.strip_prefix('[')?.split_once(']')?;
                segments.push(Segment::Index(index.parse().ok()?));
                rest = behind;
            }
        }
        Some(Self {
            text: text.to_owned(),
            segments,
        })
    }

    /// The path of an item of the list at this one.
    #[must_use]
    pub fn at(&self, index: usize) -> Self {
        let mut segments = self.segments.clone();
        segments.push(Segment::Index(index));
        Self {
            text: format!("{}[{index}]", self.text),
            segments,
        }
    }

    /// The value at this path.
    pub fn find<'a>(&self, document: &'a DocumentMut) -> Option<&'a Item> {
        self.segments
            .iter()
            .try_fold(document.as_item(), |item, segment| match segment {
                Segment::Name(name) => item.get(name.as_str()),
                Segment::Index(index) => item.get(*index),
            })
    }

    /// The list of which this path names a value that it does not have, and how many it has.
    pub(crate) fn beyond(&self, document: &DocumentMut) -> Option<(String, usize)> {
        let (mut item, mut list) = (document.as_item(), String::new());
        for segment in &self.segments {
            match segment {
                Segment::Name(name) => {
                    item = item.get(name.as_str())?;
                    list += if list.is_empty() { "" } else { "." };
                    list += name;
                }
                Segment::Index(index) => {
                    let count = item.as_array()?.len();
                    if *index >= count {
                        return (count > 0).then_some((list, count));
                    }
                    item = item.get(*index)?;
                    list = format!("{list}[{index}]");
                }
            }
        }
        None
    }

    /// Puts `value` there, with the comments beside what was there; false where its table or
    /// list does not exist.
    pub fn set(&self, document: &mut DocumentMut, value: &Value) -> bool {
        let Some((last, parents)) = self.segments.split_last() else {
            return false;
        };
        let mut item = document.as_item_mut();
        for segment in parents {
            let inner = match segment {
                Segment::Name(name) => item.get_mut(name.as_str()),
                Segment::Index(index) => item.get_mut(*index),
            };
            match inner {
                Some(inner) => item = inner,
                None => return false,
            }
        }
        let mut value = value.clone();
        match last {
            Segment::Name(name) => {
                let Some(table) = item.as_table_like_mut() else {
                    return false;
                };
                match table.get_mut(name) {
                    Some(Item::Value(old)) => {
                        *value.decor_mut() = old.decor().clone();
                        *old = value;
                    }
                    Some(other) => *other = Item::Value(value),
                    None => drop(table.insert(name, Item::Value(value))),
                }
                true
            }
            Segment::Index(index) => {
                let Some(old) = item.as_array_mut().and_then(|list| list.get_mut(*index)) else {
                    return false;
                };
                *value.decor_mut() = old.decor().clone();
                *old = value;
                true
            }
        }
    }

    /// The form of the value that is there.
    pub fn form(&self, document: &DocumentMut) -> Option<Form> {
        match self.find(document)?.as_value()? {
            Value::String(text) => {
                let (dimension, unit, _) = quantity_of(text.value())?;
                Some(Form::Quantity(dimension, unit))
            }
            Value::Integer(_) => Some(Form::Whole),
            Value::Float(_) => Some(Form::Number),
            _ => None,
        }
    }

    /// The number that is there, SI.
    pub fn number(&self, document: &DocumentMut) -> Option<f64> {
        match self.find(document)?.as_value()? {
            Value::String(text) => quantity_of(text.value()).map(|(_, _, si)| si),
            Value::Integer(whole) => Some(*whole.value() as f64),
            Value::Float(number) => Some(*number.value()),
            _ => None,
        }
    }

    /// Names of this path for an error of the sensor file: an index is a segment of its own.
    pub(crate) fn dotted(&self) -> String {
        let parts: Vec<String> = self
            .segments
            .iter()
            .map(|segment| match segment {
                Segment::Name(name) => name.clone(),
                Segment::Index(index) => index.to_string(),
            })
            .collect();
        parts.join(".")
    }
}

impl Form {
    /// A number, SI, with all its digits if it has more than [`Form::write`] keeps.
    pub(crate) fn write_exactly(self, si: f64) -> (Value, f64) {
        let short = self.write(si);
        let Self::Quantity(dimension, unit) = self else {
            return short;
        };
        let text = format!("{} {unit}", dimension.in_unit(si, unit));
        match dimension.parse(&text) {
            Ok(back) if back == si && short.1 != si => (Value::from(text), si),
            _ => short,
        }
    }

    /// A number, SI, as this form writes it, and the number that is read back from it.
    pub fn write(self, si: f64) -> (Value, f64) {
        match self {
            Self::Quantity(dimension, unit) => {
                let shown = dimension.in_unit(si, unit);
                // The sixteenth digit is rounding: 611.1 and not 611.0999999999999.
                let rounded = format!("{shown:.14e}").parse().unwrap_or(shown);
                let text = format!("{rounded} {unit}");
                let back = dimension.parse(&text).unwrap_or(si);
                (Value::from(text), back)
            }
            Self::Number => (Value::from(si), si),
            Self::Whole => {
                let whole = si.round();
                (Value::from(whole as i64), whole)
            }
        }
    }
}

/// Paths of all values of a sensor file.
pub(crate) fn paths(document: &DocumentMut) -> Vec<String> {
    fn walk(item: &Item, at: &str, found: &mut Vec<String>) {
        if let Some(table) = item.as_table_like() {
            for (key, inner) in table.iter() {
                let path = if at.is_empty() {
                    key.to_owned()
                } else {
                    format!("{at}.{key}")
                };
                walk(inner, &path, found);
            }
        } else {
            found.push(at.to_owned());
        }
    }
    let mut found = Vec::new();
    walk(document.as_item(), "", &mut found);
    found
}

/// The three of `known` that differ least from `text`, the nearest first.
pub(crate) fn nearest(text: &str, known: &[String]) -> Vec<String> {
    let last = |path: &str| path.rsplit('.').next().unwrap_or(path).to_owned();
    let mut ranked: Vec<(usize, &String)> = known
        .iter()
        .map(|path| {
            let whole = distance(text, path);
            (whole + distance(&last(text), &last(path)), path)
        })
        .collect();
    ranked.sort();
    ranked
        .into_iter()
        .take(3)
        .map(|(_, path)| path.clone())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1 # one\n[b]\nc = [\"2 um\", \"3 mm\"]\nd = { e = 0.5 }\n";

    fn document() -> DocumentMut {
        TEXT.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    fn path(text: &str) -> KeyPath {
        KeyPath::parse(text).unwrap_or_else(|| panic!("{text}"))
    }

    #[test]
    fn values_are_changed_in_place_and_comments_stay() {
        let mut document = document();
        for (key, value) in [("a", "5"), ("b.c[1]", "\"4 mm\""), ("b.d.e", "0.25")] {
            let value: Value = value.parse().unwrap_or_else(|error| panic!("{error}"));
            assert!(path(key).set(&mut document, &value), "{key}");
        }
        let expected = "a = 5 # one\n[b]\nc = [\"2 um\", \"4 mm\"]\nd = { e = 0.25 }\n";
        assert_eq!(document.to_string(), expected);
        let beyond = |key| path(key).beyond(&document);
        assert_eq!(beyond("b.c[2]"), Some(("b.c".into(), 2)));
        assert_eq!(beyond("b.c[1]").or(beyond("a[0]")).or(beyond("x[0]")), None);
        for missing in ["x.y", "b.c[2]", "a.b", "b.c.d"] {
            assert!(
                !path(missing).set(&mut document, &Value::from(1)),
                "{missing}"
            );
        }
        assert_eq!(document.to_string(), expected);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        for wrong in ["", "a.", "a[x]", "a[1", "[0]", "a..b"] {
            assert_eq!(KeyPath::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_written_number_is_read_back_as_the_number_that_is_reported() {
        let form = path("b.c[0]").form(&document()).unwrap_or(Form::Number);
        for si in [20e-6, 1.23456789e-5, 7e-9] {
            let (value, back) = form.write(si);
            let text = value.as_str().unwrap_or("");
            assert_eq!(quantity_of(text).map(|(_, _, si)| si), Some(back), "{text}");
            assert!((back / si - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn the_nearest_path_comes_first() {
        let known = paths(&document());
        assert_eq!(nearest("b.d.f", &known)[0], "b.d.e");
    }
}
