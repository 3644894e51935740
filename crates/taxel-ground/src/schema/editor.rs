//! The schema that editors and validators read: one mistake gives one error, at its key.
//!
//! `schemars` writes a choice as `oneOf`: a mistake inside one variant is then an error of the
//! whole choice, once for every variant. Most keywords bind values of one type only, so a
//! choice is written without it: names as an enumeration or a pattern of text, tables as the
//! properties of one object that holds exactly one of them. [The
//! reference](super::reference) is written from the types' own schema.

use std::mem::take;

use serde_json::{Map, Value, json};

/// The schema of `T`, `changed`, as text that ends with a line feed.
pub(super) fn text<T: schemars::JsonSchema>(changed: impl FnOnce(&mut Value)) -> String {
    let mut schema = schemars::schema_for!(T).to_value();
    flatten(&mut schema);
    changed(&mut schema);
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    text.push('\n');
    text
}

fn flatten(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(flatten),
        Value::Object(object) => {
            object.values_mut().for_each(flatten);
            drop_null(object);
            merge_choice(object);
            name_wrong_keys(object);
        }
        _ => {}
    }
}

/// TOML has no null: what may be missing is what it is when it is there.
fn drop_null(object: &mut Map<String, Value>) {
    if object.get("default").is_some_and(Value::is_null) {
        object.remove("default");
    }
    if let Some(Value::Array(types)) = object.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [kind] = &mut types[..] {
            let kind = kind.take();
            object.insert("type".into(), kind);
        }
    }
    let Some(Value::Array(options)) = object.remove("anyOf") else {
        return;
    };
    for option in options {
        if let Value::Object(option) = option
            && option.get("type").is_none_or(|kind| kind != "null")
        {
            add(object, option);
        }
    }
}

/// Adds the keys of `other` that `object` does not have.
fn add(object: &mut Map<String, Value>, other: Map<String, Value>) {
    for (key, value) in other {
        object.entry(key).or_insert(value);
    }
}

/// Variants beside each other: names, one object with a property for each table, plain values.
fn merge_choice(object: &mut Map<String, Value>) {
    let Some(Value::Array(variants)) = object.remove("oneOf") else {
        return;
    };
    let (mut names, mut meanings) = (Vec::new(), Vec::new());
    let (mut tables, mut types) = (Map::new(), Vec::new());
    for variant in variants {
        let Value::Object(mut variant) = variant else {
            continue;
        };
        let meaning = variant.remove("description");
        if let Some(name) = variant.remove("const") {
            names.push(name);
            meanings.push(meaning.unwrap_or_default());
        } else if let Some(Value::Object(properties)) = variant.remove("properties") {
            for (name, mut table) in properties {
                if let (Value::Object(table), Some(meaning)) = (&mut table, &meaning) {
                    table.insert("description".into(), meaning.clone());
                }
                tables.insert(name, table);
            }
        } else {
            types.extend(variant.remove("type"));
            add(object, variant);
        }
    }
    if !tables.is_empty() {
        types.insert(0, "object".into());
        object.insert("properties".into(), tables.into());
        object.insert("additionalProperties".into(), false.into());
        object.insert("minProperties".into(), 1.into());
        object.insert("maxProperties".into(), 1.into());
    }
    if !names.is_empty() {
        if types.is_empty() {
            object.insert("x-taplo".into(), json!({"docs": {"enumValues": meanings}}));
            object.insert("enum".into(), names.into());
        } else {
            // An enumeration would bind tables too.
            let text: Vec<_> = names.iter().filter_map(Value::as_str).collect();
            object.insert("pattern".into(), format!("^({})$", text.join("|")).into());
            object.insert("examples".into(), names.into());
        }
        types.insert(0, "string".into());
    }
    let one = types.len() == 1;
    let kind = if one {
        take(&mut types[0])
    } else {
        types.into()
    };
    object.insert("type".into(), kind);
}

/// An unknown key is an error at that key, which names the known ones. A required key is
/// missed only where no key is unknown: a misspelt key is one mistake.
fn name_wrong_keys(object: &mut Map<String, Value>) {
    if object.get("additionalProperties") != Some(&Value::Bool(false)) {
        return;
    }
    let Some(Value::Object(properties)) = object.get("properties") else {
        return;
    };
    let names: Vec<_> = properties.keys().cloned().collect();
    let message = format!("unknown key; the keys of this table: {}", names.join(", "));
    object.insert("additionalProperties".into(), json!({"const": message}));
    if let Some(required) = object.remove("required") {
        object.insert("if".into(), json!({"propertyNames": {"enum": names}}));
        object.insert("then".into(), json!({"required": required}));
    }
}
