//! What the types of a file say of it: the schema that editors read, and the reference of its
//! keys.

mod editor;
mod forms;
mod reference;

/// The schema of `T` for editors and validators, JSON that ends with a line feed.
pub fn json_schema<T: schemars::JsonSchema>() -> String {
    editor::text::<T>(|_| ())
}

/// The same schema of types of which `changed` knows what else their keys take.
pub fn json_schema_changed<T: schemars::JsonSchema>(
    changed: impl FnOnce(&mut serde_json::Value),
) -> String {
    editor::text::<T>(changed)
}

/// The tables and names that the value of a key of the file that `T` reads may be, as an
/// instruction; `path` has the names and indices of the key. None for plain values.
pub(crate) fn forms<T: schemars::JsonSchema>(path: &[&str]) -> Option<String> {
    forms::at(schemars::schema_for!(T).as_value(), path)
}

/// The reference of the file that `T` reads, Markdown that begins with `head`: every key with
/// its meaning, unit and range.
pub fn reference<T: schemars::JsonSchema>(head: &str) -> String {
    reference::page(head, schemars::schema_for!(T).as_value())
}
