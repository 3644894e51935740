//! TOML files with mistakes shown under the very word.

mod wording;

use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
pub use toml::Spanned;
pub use toml::de::{DeTable, DeValue};

use crate::quantity::HELP;
use crate::words::advice;
use crate::{InputError, schema};

/// Largest description that is read, bytes: a guard against a wrong file.
pub const LARGEST: usize = 1 << 20;

/// Parses a description.
///
/// # Errors
/// The first mistake, at its place, with the key and what to do: where a table or one of several
/// names is needed, with those that the schema of the file knows.
pub fn parse<T: DeserializeOwned + JsonSchema>(file: &str, text: &str) -> Result<T, InputError> {
    read((LARGEST, file, text), schema::forms::<T>, &[])
}

/// Another value for a key of a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Names and indices of the key; its table exists.
    pub path: Vec<String>,
    /// The value, in the words of TOML; none takes the key out.
    pub value: Option<String>,
    /// Part of the text that stands for the value: its mistakes are shown there.
    pub span: Range<usize>,
}

/// As [`parse`], after `changes`.
///
/// # Errors
/// As [`parse`].
pub fn parse_changed<T: DeserializeOwned + JsonSchema>(
    file: &str,
    text: &str,
    changes: &[Change],
) -> Result<T, InputError> {
    read((LARGEST, file, text), schema::forms::<T>, changes)
}

/// Parses a file of at most `largest` bytes.
///
/// # Errors
/// The first mistake, at its place, with the key and what to do; a longer file.
pub fn parse_up_to<T: DeserializeOwned>(
    largest: usize,
    file: &str,
    text: &str,
) -> Result<T, InputError> {
    read((largest, file, text), |_| None, &[])
}

/// Parses a file; `forms` knows what the value of a key may be, `changes` come first.
fn read<T: DeserializeOwned>(
    (largest, file, text): (usize, &str, &str),
    forms: impl Fn(&[&str]) -> Option<String>,
    changes: &[Change],
) -> Result<T, InputError> {
    if text.len() > largest {
        let message = format!(
            "the file has {} bytes; at most {largest} are read",
            text.len()
        );
        return Err(InputError::whole(file, message).help("give a TOML description"));
    }
    let mistake = |error: &toml::de::Error| {
        let (said, mut help) = split_help(error.message());
        let message = said;
        if help.is_empty() && wording::of_missing(message).is_some() {
            help = "add it with its value and unit; `taxel schema` and the shipped files show how";
        }
        let span = error.span().unwrap_or(0..0);
        let key = key_at(text, &span);
        if message.starts_with("invalid type:") && message.ends_with("expected a sequence") {
            let given = text.get(span.clone()).unwrap_or_default();
            return InputError::at(file, text, span, format!("{given} is no list"))
                .key(key)
                .help(format!("write it in brackets: [{given}]"));
        }
        let path: Vec<&str> = key.split('.').collect();
        let (message, forms) = match wording::in_words(message) {
            Some(words) => (words, forms(&path)),
            None => match wording::of_choice(message) {
                // The key of a table that is not known is beside those which are.
                Some([found, known]) => {
                    let beside = path.split_last().and_then(|(_, parent)| forms(parent));
                    let known = format!("write one of: {known}");
                    (found, forms(&path).or(beside).or(Some(known)))
                }
                None => (message.to_owned(), None),
            },
        };
        let help = forms.unwrap_or_else(|| help.to_owned());
        let help = match wording::of_name(said) {
            Some((word, known)) => advice(word, known, &help),
            None => help,
        };
        InputError::at(file, text, span, message)
            .key(key)
            .help(help)
    };
    // What is wrong is left out, and the rest read again: each mistake is found in one run.
    let mut removed: Vec<Change> = Vec::new();
    let mut found: Vec<InputError> = Vec::new();
    loop {
        let mut table = DeTable::parse(text).map_err(|error| mistake(&error))?;
        for change in changes.iter().chain(&removed) {
            make(table.get_mut(), change);
        }
        let error = match T::deserialize(toml::de::Deserializer::from(table)) {
            Ok(read) if found.is_empty() => return Ok(read),
            Ok(_) => break,
            Err(error) => error,
        };
        let span = error.span().unwrap_or(0..0);
        let path = path_at(text, &span);
        let missing = wording::of_missing(error.message());
        // What lacks a key that was left out is no mistake of the file.
        let concerns = |one: &Change| one.path.starts_with(&path) || path.starts_with(&one.path);
        let left_out = |one: &Change| one.path.last().map(String::as_str) == missing;
        if removed.iter().any(|one| concerns(one) || left_out(one)) {
            break;
        }
        found.push(mistake(&error));
        let named = path.iter().rposition(|name| name.parse::<usize>().is_err());
        let Some(last) = named.filter(|_| found.len() < MOST_MISTAKES) else {
            break;
        };
        if missing.is_some() {
            break;
        }
        removed.push(Change {
            path: path[..=last].to_vec(),
            value: None,
            span,
        });
    }
    Err(InputError::joined(found).expect("the loop ends with a mistake"))
}

/// Most mistakes of one file that are named in one run: a screen of them.
const MOST_MISTAKES: usize = 8;

/// True if a description has the key `path` (segments; a number is an index) itself, not only a
/// parent of it.
pub fn has(text: &str, path: &[&str]) -> bool {
    let Ok(table) = DeTable::parse(text) else {
        return false;
    };
    let root = DeValue::Table(table.into_inner());
    path.iter()
        .try_fold(&root, |value, name| match value {
            DeValue::Table(table) => table.get(*name).map(Spanned::get_ref),
            DeValue::Array(items) => {
                let index: usize = name.parse().ok()?;
                items.get(index).map(Spanned::get_ref)
            }
            _ => None,
        })
        .is_some()
}

/// An error of a rule between fields, shown at the value of the key `path`
/// (segments; a number is an index), or at the nearest parent that exists.
pub fn at_key(file: &str, text: &str, path: &[&str], message: &str, help: &str) -> InputError {
    let span = DeTable::parse(text).map_or(0..0, |table| find(table.get_ref(), path));
    InputError::at(file, text, span, message)
        .key(path.join("."))
        .help(help)
}

fn split_help(text: &str) -> (&str, &str) {
    match text.split_once(HELP) {
        Some((message, help)) => (message.trim_end(), help.trim()),
        None => (text.trim_end(), ""),
    }
}

fn make<'t>(table: &mut DeTable<'t>, change: &'t Change) {
    let Some((last, path)) = change.path.split_last() else {
        return;
    };
    let Some(table) = inner_table(table, path) else {
        return;
    };
    let Some(value) = &change.value else {
        table.remove(last.as_str());
        return;
    };
    if let Ok(value) = DeValue::parse(value) {
        let value = shown_at(value.into_inner(), &change.span);
        // The key that is there keeps its place in the text.
        if let Some(old) = table.get_mut(last.as_str()) {
            *old = value;
        } else {
            let key = Spanned::new(change.span.clone(), last.as_str().into());
            table.insert(key, value);
        }
    }
}

/// The table with this path.
fn inner_table<'t, 'i>(table: &'t mut DeTable<'i>, path: &[String]) -> Option<&'t mut DeTable<'i>> {
    let Some((first, rest)) = path.split_first() else {
        return Some(table);
    };
    let mut value = table.get_mut(first.as_str())?.get_mut();
    for (at, name) in rest.iter().enumerate() {
        value = match value {
            DeValue::Array(items) => items.get_mut(name.parse::<usize>().ok()?)?.get_mut(),
            DeValue::Table(table) => return inner_table(table, &rest[at..]),
            _ => return None,
        };
    }
    match value {
        DeValue::Table(table) => Some(table),
        _ => None,
    }
}

/// A value of which all is shown at one part of the text.
fn shown_at<'i>(value: DeValue<'i>, span: &Range<usize>) -> Spanned<DeValue<'i>> {
    let value = match value {
        DeValue::Table(table) => {
            let mut placed = DeTable::new();
            for (key, value) in table {
                let key = Spanned::new(span.clone(), key.into_inner());
                placed.insert(key, shown_at(value.into_inner(), span));
            }
            DeValue::Table(placed)
        }
        value => value,
    };
    Spanned::new(span.clone(), value)
}

/// Byte range of the value at `path`.
fn find(table: &DeTable<'_>, path: &[&str]) -> Range<usize> {
    let Some((first, rest)) = path.split_first() else {
        return 0..0;
    };
    let Some((key, value)) = table.iter().find(|(key, _)| key.get_ref() == first) else {
        return 0..0;
    };
    let inner = find_in(value.get_ref(), rest);
    if inner.is_empty() {
        // A table's own span is its body; its name says more.
        if value.get_ref().is_table() {
            key.span()
        } else {
            value.span()
        }
    } else {
        inner
    }
}

fn find_in(value: &DeValue<'_>, path: &[&str]) -> Range<usize> {
    match (value, path.split_first()) {
        (DeValue::Table(table), Some(_)) => find(table, path),
        (DeValue::Array(items), Some((index, rest))) => {
            let item = index.parse().ok().and_then(|index: usize| items.get(index));
            item.map_or(0..0, |item| {
                let inner = find_in(item.get_ref(), rest);
                if inner.is_empty() { item.span() } else { inner }
            })
        }
        _ => 0..0,
    }
}

/// Path of the innermost key whose name or value holds the start of `span`.
fn path_at(text: &str, span: &Range<usize>) -> Vec<String> {
    let mut path = Vec::new();
    if let Ok(table) = DeTable::parse(text) {
        collect(table.get_ref(), span, &mut path);
    }
    path
}

/// The same in one word.
fn key_at(text: &str, span: &Range<usize>) -> String {
    path_at(text, span).join(".")
}

/// True if the key that holds `span` was found and left in `path`.
///
/// The span of a table is only its header, so children are always searched.
fn collect(table: &DeTable<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
    table.iter().any(|(key, value)| {
        path.push(key.get_ref().to_string());
        let found = holds(&key.span(), span)
            || collect_value(value.get_ref(), span, path)
            || holds(&value.span(), span);
        if !found {
            path.pop();
        }
        found
    })
}

fn collect_value(value: &DeValue<'_>, span: &Range<usize>, path: &mut Vec<String>) -> bool {
    match value {
        DeValue::Table(table) => collect(table, span, path),
        DeValue::Array(items) => items.iter().enumerate().any(|(index, item)| {
            path.push(index.to_string());
            let found = collect_value(item.get_ref(), span, path) || holds(&item.span(), span);
            if !found {
                path.pop();
            }
            found
        }),
        _ => false,
    }
}

fn holds(outer: &Range<usize>, inner: &Range<usize>) -> bool {
    outer.start <= inner.start && inner.end <= outer.end
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1\n[b.c]\nd = [1, \"x\"]\n[[e]]\nf = 2\n[[e]]\nf = 3\n";

    #[test]
    fn rules_point_at_the_value() {
        let at = |path: &[&str]| {
            let place = at_key("f", TEXT, path, "m", "").place.unwrap();
            (place.line, place.column, place.width)
        };
        assert_eq!(at(&["b", "c", "d", "1"]), (3, 9, 3));
        assert_eq!(at(&["e", "1", "f"]), (7, 5, 1));
        assert_eq!(at(&["b", "c"]), (2, 4, 1));
    }

    #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only what is wrong with it is asked")]
    struct Described {
        name: String,
        count: usize,
        part: Part,
    }

    #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code, reason = "only what is wrong with it is asked")]
    struct Part {
        sides: [f64; 2],
        #[serde(default)]
        colour: String,
    }

    #[test]
    fn mistakes_of_several_keys_are_found_in_one_run() {
        let error = |text: &str| parse::<Described>("f", text).unwrap_err();
        let text = "name = 1\nconut = 3\n[part]\nsides = [1, \"x\"]\ncolor = \"red\"\n";
        let error_of_all = error(text);
        let mut keys: Vec<String> = error_of_all.others().map(|one| one.key.clone()).collect();
        keys.push(error_of_all.key.clone());
        keys.sort();
        assert_eq!(
            keys,
            ["conut", "name", "part.color", "part.sides.1"],
            "{error_of_all}"
        );
        let said = error_of_all.to_string();
        assert!(said.contains("did you mean \"count\"?"), "{said}");
        assert!(said.contains("did you mean \"colour\"?"), "{said}");
        // What only lacks what was left out is no further mistake; what is missing is one.
        assert!(!said.contains("missing"), "{said}");
        let missing = error("name = \"a\"\ncount = 3\n[part]\n");
        assert!(missing.next.is_none() && missing.message.contains("missing field `sides`"));
        // One mistake is one error, however deep.
        let one = error("name = \"a\"\ncount = -3\n[part]\nsides = [1, 2]\n");
        assert!(one.next.is_none(), "{one}");
    }

    #[test]
    fn spans_are_named_by_their_key() {
        let start = TEXT.find("\"x\"").unwrap();
        assert_eq!(key_at(TEXT, &(start..start + 3)), "b.c.d.1");
        let start = TEXT.rfind('3').unwrap();
        assert_eq!(key_at(TEXT, &(start..start + 1)), "e.1.f");
    }
}
