//! The structure of the schemas that editors read; `tests/schema` runs Taplo and a validator on them.
#![allow(clippy::unwrap_used)]

use serde_json::{Map, Value, json};
use taxel::acquisition::Stimulus;
use taxel::sensor::Sensor;

/// Every object in `schema` with its path.
fn objects<'a>(path: &str, schema: &'a Value, found: &mut Vec<(String, &'a Map<String, Value>)>) {
    match schema {
        Value::Object(object) => {
            found.push((path.to_owned(), object));
            for (key, value) in object {
                objects(&format!("{path}/{key}"), value, found);
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                objects(&format!("{path}/{index}"), item, found);
            }
        }
        _ => {}
    }
}

#[test]
fn no_mistake_is_an_error_of_a_whole_choice() {
    for text in [Sensor::json_schema(), Stimulus::json_schema()] {
        let schema: Value = serde_json::from_str(&text).unwrap();
        let mut found = Vec::new();
        objects("", &schema, &mut found);
        for (path, object) in found {
            for keyword in ["oneOf", "anyOf", "allOf", "not"] {
                assert!(!object.contains_key(keyword), "{path} has {keyword}");
            }
            let table = object.get("type").is_some_and(|kind| kind == "object");
            if table && object.contains_key("properties") {
                // Every table says what is wrong at the wrong key itself.
                let unknown = object["additionalProperties"]["const"].as_str().unwrap();
                assert!(unknown.starts_with("unknown key"), "{path}");
                assert!(!object.contains_key("required"), "{path}");
            }
        }
    }
}

#[test]
fn an_element_is_one_table_of_its_kinds() {
    let schema: Value = serde_json::from_str(&Sensor::json_schema()).unwrap();
    for name in ["Element", "Readout"] {
        let choice = &schema["$defs"][name];
        assert_eq!(choice["minProperties"], 1, "{name}");
        assert_eq!(choice["maxProperties"], 1, "{name}");
        assert!(choice["properties"].as_object().unwrap().len() > 1);
    }
    let mount = &schema["$defs"]["Mount"];
    assert_eq!(mount["type"], json!(["string", "object"]));
    assert_eq!(mount["pattern"], "^(flat)$");
}
