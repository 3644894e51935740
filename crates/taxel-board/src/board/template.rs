//! Templates of lines: words, and in braces what stands between them.

use super::unit;
use crate::names;

/// One line.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Template {
    pub(crate) parts: Vec<Part>,
}

/// A stretch of a line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Part {
    /// Words that must be there; a blank matches any run of blanks.
    Words(String),
    /// Values of these names, with the unit that the template gives.
    Values(Vec<String>, Option<String>),
    /// Running number.
    Sequence,
    /// Time; nanoseconds of one unit.
    Time(f64),
    /// Anything up to a delimiter.
    Skip,
}

impl Template {
    /// Reads `Capacitance (pF):{value c1..c4}`; `{{` and `}}` are braces of the line itself.
    ///
    /// # Errors
    /// A message for people.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut parts = Vec::new();
        let mut rest = text;
        let mut words = String::new();
        while let Some(open) = rest.find('{') {
            let (before, inner) = rest.split_at(open);
            words.push_str(&before.replace("}}", "}"));
            if let Some(behind) = inner.strip_prefix("{{") {
                words.push('{');
                rest = behind;
                continue;
            }
            if !words.is_empty() {
                parts.push(Part::Words(std::mem::take(&mut words)));
            }
            let close = closing(inner)
                .ok_or_else(|| format!("\"{text}\" has a brace that is not closed"))?;
            parts.push(part(&inner[1..close])?);
            rest = &inner[close + 1..];
        }
        words.push_str(&rest.replace("}}", "}"));
        if !words.is_empty() {
            parts.push(Part::Words(words));
        }
        if parts.is_empty() {
            return Err("a template cannot be empty".into());
        }
        Ok(Self { parts })
    }

    /// Names of its values in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = (&str, Option<&str>)> {
        self.parts.iter().flat_map(|part| match part {
            Part::Values(names, unit) => names
                .iter()
                .map(|name| (name.as_str(), unit.as_deref()))
                .collect(),
            _ => Vec::new(),
        })
    }
}

/// Place of the brace that closes the first one.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (place, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(place);
        }
    }
    None
}

fn part(inside: &str) -> Result<Part, String> {
    let inside = inside.trim();
    let (kind, rest) = inside
        .split_once(char::is_whitespace)
        .unwrap_or((inside, ""));
    let rest = rest.trim();
    match kind {
        "value" => {
            let (name, unit) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let unit = Some(unit.trim())
                .filter(|unit| !unit.is_empty())
                .map(str::to_owned);
            if let Some(symbol) = &unit {
                unit::of_value(symbol)?;
            }
            Ok(Part::Values(names::expanded(name)?, unit))
        }
        "sequence" if rest.is_empty() => Ok(Part::Sequence),
        "skip" if rest.is_empty() => Ok(Part::Skip),
        "time" => unit::of_time(rest)
            .map(Part::Time)
            .ok_or_else(|| format!("{{{inside}}} needs a unit of time: s, ms, us or ns")),
        _ => Err(format!(
            "{{{inside}}} is none of {{value NAME}}, {{value NAME UNIT}}, {{sequence}}, {{time UNIT}}, {{skip}}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubled_braces_are_braces_of_the_line() {
        let template = Template::parse("{{\"n\":{sequence},\"v\":[{value c{1..2}}]}}").unwrap();
        let words = |text: &str| Part::Words(text.to_owned());
        let names = vec!["c1".to_owned(), "c2".to_owned()];
        assert_eq!(
            template.parts,
            [
                words("{\"n\":"),
                Part::Sequence,
                words(",\"v\":["),
                Part::Values(names, None),
                words("]}"),
            ]
        );
    }
}
