//! What a key of a file may be, in words for a message.

use serde_json::Value;

use super::reference::{braces, is_choice, properties, resolved};

/// Tables of more keys than this are not written out.
const MOST_KEYS: usize = 6;

/// The tables and names that the value at a path of keys (segments; a number is an index) may be;
/// none for a plain value, and where the schema has no such key.
pub(super) fn at(schema: &Value, path: &[&str]) -> Option<String> {
    let definitions = &schema["$defs"];
    let mut shape = schema;
    for name in path {
        shape = resolved(definitions, inner(shape, name)?);
    }
    if is_choice(shape) {
        let variants = shape["oneOf"].as_array()?.iter();
        let forms: Vec<String> = variants.map(|of| variant(definitions, of)).collect();
        return Some(format!("write one of: {}", forms.join("; ")));
    }
    let table = properties(shape).next().is_some();
    table.then(|| format!("write {}", written(definitions, shape)))
}

/// The schema of a key of a table, of one table of a choice, or of the entries of a list.
fn inner<'a>(shape: &'a Value, name: &str) -> Option<&'a Value> {
    if name.parse::<usize>().is_ok() {
        return shape.get("items");
    }
    let variants = shape["oneOf"].as_array().into_iter().flatten();
    let mut tables = std::iter::once(shape).chain(variants);
    tables.find_map(|table| table["properties"].get(name))
}

/// One of the values of a choice.
fn variant(definitions: &Value, of: &Value) -> String {
    let Some((name, content)) = properties(of).next() else {
        return of["const"].to_string();
    };
    let content = written(definitions, resolved(definitions, content));
    format!("{{ {name} = {content} }}")
}

/// A table in braces, a list of tables in brackets, and what is neither as `…`.
fn written(definitions: &Value, shape: &Value) -> String {
    let entries = shape.get("items").map(|items| resolved(definitions, items));
    let (table, list) = match entries {
        Some(entries) => (entries, true),
        None => (shape, false),
    };
    let text = match properties(table).count() {
        0 => "…".to_owned(),
        1..=MOST_KEYS => braces(table),
        _ => "{ … }".to_owned(),
    };
    if list { format!("[{text}]") } else { text }
}
