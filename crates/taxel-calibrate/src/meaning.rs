//! Meaning of a sensor file: its values in SI, whatever its comments, the order of its
//! keys and the spelling of its units.

use std::collections::BTreeMap;

use taxel::quantity;
use taxel::sensor::Sensor;

/// Two spellings of one value differ by rounding alone.
const ROUNDING: f64 = 1e-12;
/// The name of the device is no value of it, and a channel that has failed since changes
/// no value of the others.
const NO_VALUES: [&str; 2] = ["name", "mask"];

/// A value with its spelling.
#[derive(Debug, Clone, PartialEq)]
struct Spelled {
    /// SI, of a number or a quantity.
    number: Option<f64>,
    text: String,
}

impl Spelled {
    fn same(&self, other: &Self) -> bool {
        match (self.number, other.number) {
            (Some(a), Some(b)) => (a - b).abs() <= ROUNDING * a.abs().max(b.abs()),
            _ => self.text == other.text,
        }
    }
}

/// Values of a file by their key paths; none for a text that is no TOML.
fn values(text: &str) -> BTreeMap<String, Spelled> {
    let mut found = BTreeMap::new();
    if let Ok(mut table) = text.parse::<toml::Table>() {
        table.retain(|key, _| !NO_VALUES.contains(&key));
        put(&mut found, "", &toml::Value::Table(table));
    }
    found
}

fn put(found: &mut BTreeMap<String, Spelled>, path: &str, value: &toml::Value) {
    let below = |key: &str| {
        if path.is_empty() {
            key.to_owned()
        } else {
            format!("{path}.{key}")
        }
    };
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                put(found, &below(key), value);
            }
        }
        toml::Value::Array(items) => {
            for (index, value) in items.iter().enumerate() {
                put(found, &below(&index.to_string()), value);
            }
        }
        value => {
            let quantity = |text: &str| quantity::dimensions().find_map(|d| d.parse(text).ok());
            let (number, text) = match value {
                toml::Value::Integer(number) => (Some(*number as f64), number.to_string()),
                toml::Value::Float(number) => (Some(*number), number.to_string()),
                toml::Value::Boolean(flag) => (None, flag.to_string()),
                toml::Value::String(text) => (quantity(text), text.clone()),
                other => (None, format!("{other:?}")),
            };
            found.insert(path.to_owned(), Spelled { number, text });
        }
    }
}

/// Differences of the file `now` of `sensor` from the one `before`: a sentence for each
/// key; none where both mean the same device.
pub(crate) fn differences(before: &str, now: &str, sensor: &Sensor) -> Vec<String> {
    let (old, new) = (values(before), values(now));
    let mut found = Vec::new();
    let keys = old
        .keys()
        .chain(new.keys().filter(|key| !old.contains_key(*key)));
    for key in keys {
        match (old.get(key), new.get(key)) {
            (Some(old), Some(new)) if old.same(new) => {}
            (Some(old), Some(new)) => {
                found.push(format!("{key} was {}, is {}", old.text, new.text));
            }
            (Some(old), None) => found.push(format!("{key} was {}, is not there", old.text)),
            (None, Some(new)) => found.push(format!("{key} was not there, is {}", new.text)),
            (None, None) => {}
        }
    }
    // A default that is written out is no other value.
    if let Ok(mut known) = Sensor::drawn("", before) {
        known.name.clone_from(&sensor.name);
        known.mask.clone_from(&sensor.mask);
        if known == *sensor {
            found.clear();
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAME: &str = "in-plane-50um";

    fn differences_of(change: impl Fn(&str) -> String) -> Vec<String> {
        let text = Sensor::shipped_text(NAME).unwrap();
        let changed = change(text);
        assert_ne!(text, changed);
        let sensor = Sensor::parse("changed", &changed).unwrap();
        differences(text, &changed, &sensor)
    }

    #[test]
    fn spelling_is_no_other_sensor() {
        let same = |change: &dyn Fn(&str) -> String| {
            assert_eq!(differences_of(change), [""; 0]);
        };
        same(&|text| format!("# A comment.\n{text}"));
        same(&|text| text.replace("\"50 um\"", "\"0.05 mm\""));
        same(&|text| text.replacen("name = \"", "name = \"another ", 1));
        same(&|text| format!("{text}\n[[mask]]\ntaxel = [0, 0]\n"));
        // Keys of the first table in the other order.
        same(&|text| {
            let mut lines: Vec<&str> = text.lines().collect();
            let head = lines.iter().position(|line| *line == "[array]").unwrap();
            let key = |line: &&str| line.contains('=');
            assert!(key(&lines[head + 1]) && key(&lines[head + 2]));
            lines.swap(head + 1, head + 2);
            lines.join("\n")
        });
    }

    #[test]
    fn a_changed_value_is_named_with_both() {
        let found = differences_of(|text| text.replace("\"50 um\"", "\"60 um\""));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].ends_with("gap was 50 um, is 60 um"), "{found:?}");
    }
}
