//! Templates of lines: words, and in braces what stands between them.

use std::ops::Range;

use super::unit;
use crate::names;

/// One line.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Template {
    /// Its parts, and where each stands in its text, bytes.
    pub(crate) parts: Vec<(Part, Range<usize>)>,
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
    /// Which line of a frame it is.
    Address,
    /// Anything up to a delimiter.
    Skip,
}

impl Template {
    /// Reads `Capacitance (pF):{value c1..c4}`; `{{` and `}}` are braces of the line itself.
    ///
    /// # Errors
    /// A message for people, and the bytes of the text that it is about.
    pub(crate) fn parse(text: &str) -> Result<Self, (String, Range<usize>)> {
        let mut parts = Vec::new();
        let mut rest = text;
        let mut words = String::new();
        let place = |rest: &str| text.len() - rest.len();
        while let Some(open) = rest.find('{') {
            let (before, inner) = rest.split_at(open);
            words.push_str(&before.replace("}}", "}"));
            if let Some(behind) = inner.strip_prefix("{{") {
                words.push('{');
                rest = behind;
                continue;
            }
            let begin = place(inner);
            if !words.is_empty() {
                parts.push((Part::Words(std::mem::take(&mut words)), begin..begin));
            }
            let Some(close) = closing(inner) else {
                return Err(("a brace is not closed".into(), begin..text.len()));
            };
            let at = begin..begin + close + 1;
            let part = part(&inner[1..close]).map_err(|message| (message, at.clone()))?;
            parts.push((part, at));
            rest = &inner[close + 1..];
        }
        words.push_str(&rest.replace("}}", "}"));
        if !words.is_empty() {
            parts.push((Part::Words(words), text.len()..text.len()));
        }
        let all = || 0..text.len();
        if parts.is_empty() {
            return Err(("a template cannot be empty".into(), all()));
        }
        for (kind, is) in [
            (
                "sequence",
                (|part| *part == Part::Sequence) as fn(&Part) -> bool,
            ),
            ("time", |part| matches!(part, Part::Time(_))),
            ("address", |part| *part == Part::Address),
        ] {
            if let Some((_, at)) = parts.iter().filter(|(part, _)| is(part)).nth(1) {
                return Err((format!("a second {kind}; a line has one"), at.clone()));
            }
        }
        Ok(Self { parts })
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
        "address" if rest.is_empty() => Ok(Part::Address),
        "time" => unit::of_time(rest)
            .map(Part::Time)
            .ok_or_else(|| format!("{{{inside}}} needs a unit of time: s, ms, us or ns")),
        _ => Err(format!(
            "{{{inside}}} is none of {{value NAME}}, {{value NAME UNIT}}, {{sequence}}, {{time UNIT}}, {{address}}, {{skip}}"
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
        let parts: Vec<Part> = template.parts.into_iter().map(|(part, _)| part).collect();
        assert_eq!(
            parts,
            [
                words("{\"n\":"),
                Part::Sequence,
                words(",\"v\":["),
                Part::Values(names, None),
                words("]}"),
            ]
        );
    }

    #[test]
    fn mistakes_have_their_place() {
        for (text, wrong) in [
            ("T {time s} {volts x},{value y}", "{volts x}"),
            ("{time s}{time ms}", "{time ms}"),
            ("{value a},{value b", "{value b"),
            ("{value a furlong}", "{value a furlong}"),
        ] {
            let (message, at) = Template::parse(text).unwrap_err();
            assert_eq!(&text[at], wrong, "{message}");
        }
    }
}
