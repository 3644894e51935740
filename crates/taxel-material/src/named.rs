//! Laws by name or file in the descriptions of sensors and problems.
//!
//! `youngs_modulus = { material = "rtv615" }` stands wherever a modulus does, and `material = "rtv615"`
//! wherever a law does; `{ file = "silicone.toml" }` in the place of the name is a law file. What opens
//! files puts the text of the law file behind the description ([`with_file`]), so that a description is
//! whole wherever it goes: into a study, a recording, another process.

use std::ops::Range;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use taxel_ground::toml_input::{Change, DeTable, DeValue, Spanned};
use taxel_ground::{InputError, schema, shown, toml_input};

use crate::law::Law;
use crate::library;
use crate::material::Material;

/// Key of the names of laws, and of the table of law files behind a description.
const MATERIAL: &str = "material";
const FILES: &str = "law_files";
/// Keys whose name ends so take `{ material = … }`.
const MODULUS: &str = "modulus";
/// Key of a law file.
const FILE: &str = "file";

/// A law that a description names.
#[derive(Debug, Clone, PartialEq)]
pub struct Used {
    /// Path of the key.
    pub key: String,
    /// What it names.
    pub material: Material,
}

/// A name in a description, and where it stands.
struct Found {
    path: Vec<String>,
    what: Named,
    span: Range<usize>,
}

enum Named {
    Product(String),
    File(String),
}

impl Found {
    /// True if the name stands for a modulus and not for a law.
    fn is_modulus(&self) -> bool {
        self.path
            .last()
            .is_some_and(|key| key.to_lowercase().ends_with(MODULUS))
    }

    fn change(&self, key: Option<&str>, value: String) -> Change {
        let mut path = self.path.clone();
        if let (Some(key), Some(last)) = (key, path.last_mut()) {
            key.clone_into(last);
        }
        Change {
            path,
            value: Some(value),
            span: self.span.clone(),
        }
    }

    fn material(
        &self,
        file: &str,
        text: &str,
        files: &[(String, String)],
    ) -> Result<Material, InputError> {
        let wrong = |message: String| {
            InputError::at(file, text, self.span.clone(), message).key(self.path.join("."))
        };
        match &self.what {
            Named::Product(name) => library::named(name).ok_or_else(|| {
                let near = library::near(name).join(", ");
                let name = shown::text(name);
                wrong(format!("no material is called \"{name}\"")).help(format!(
                    "near names: {near}; or name a law file: {{ file = \"silicone.toml\" }}"
                ))
            }),
            Named::File(name) => {
                let known = files.iter().find(|(known, _)| known == name);
                let (_, law) = known.ok_or_else(|| {
                    let message = format!(
                        "the law file \"{}\" does not come with this text",
                        shown::text(name)
                    );
                    wrong(message).help("name the description by its file, so that the law file is found from its folder")
                })?;
                Material::parse(name, law)
            }
        }
    }
}

fn named(value: &Spanned<DeValue<'_>>) -> Option<(Named, Range<usize>)> {
    match value.get_ref() {
        DeValue::String(name) => Some((Named::Product(name.to_string()), value.span())),
        DeValue::Table(table) if table.len() == 1 => match table.get(FILE) {
            Some(file) => match file.get_ref() {
                DeValue::String(name) => Some((Named::File(name.to_string()), file.span())),
                _ => None,
            },
            None => None,
        },
        _ => None,
    }
}

fn find(table: &DeTable<'_>, path: &mut Vec<String>, found: &mut Vec<Found>) {
    for (key, value) in table {
        path.push(key.get_ref().to_string());
        find_in(value, path, found);
        path.pop();
    }
}

fn find_in(value: &Spanned<DeValue<'_>>, path: &mut Vec<String>, found: &mut Vec<Found>) {
    let key = path
        .last()
        .map(|key| key.to_lowercase())
        .unwrap_or_default();
    let inner = match value.get_ref() {
        DeValue::Table(table) if key.ends_with(MODULUS) && table.len() == 1 => table.get(MATERIAL),
        _ if key == MATERIAL => Some(value),
        _ => None,
    };
    if let Some((what, span)) = inner.and_then(named) {
        let path = path.clone();
        found.push(Found { path, what, span });
        return;
    }
    match value.get_ref() {
        DeValue::Table(table) => find(table, path, found),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                path.push(index.to_string());
                find_in(item, path, found);
                path.pop();
            }
        }
        _ => {}
    }
}

fn all_in(table: &DeTable<'_>) -> Vec<Found> {
    let mut found = Vec::new();
    find(table, &mut Vec::new(), &mut found);
    found
}

/// Names and texts of the law files behind a description.
fn files(table: &DeTable<'_>) -> Vec<(String, String)> {
    let Some(DeValue::Table(files)) = table.get(FILES).map(Spanned::get_ref) else {
        return Vec::new();
    };
    let text = |value: &Spanned<DeValue<'_>>| match value.get_ref() {
        DeValue::String(text) => text.to_string(),
        _ => String::new(),
    };
    files
        .iter()
        .map(|(key, value)| (key.get_ref().to_string(), text(value)))
        .collect()
}

/// Reads a sensor file in which laws may stand by their names; `factor` gives the modulus of a made
/// device over that of the law.
///
/// # Errors
/// As [`toml_input::parse`]; a name that nobody knows, or a law that the place cannot take.
pub fn parse_sensor<T: DeserializeOwned + JsonSchema>(
    file: &str,
    text: &str,
    factor: &dyn Fn(&Material) -> f64,
) -> Result<T, InputError> {
    let mut changes = Vec::new();
    for (found, material) in all_named(file, text, &mut changes)? {
        let law = material.law.scaled(factor(&material));
        let value = if found.is_modulus() {
            let shear = found.path.last().is_some_and(|key| key == "shear_modulus");
            let modulus = if shear {
                law.shear_modulus()
            } else {
                law.youngs_modulus()
            };
            format!("\"{modulus} Pa\"")
        } else {
            of_two_constants(&law).ok_or_else(|| {
                let message = format!(
                    "{} is a {} law; only neo_hookean and mooney_rivlin are taken here",
                    shown::text(&material.name),
                    law.name()
                );
                let help = format!(
                    "the neo-Hookean law of the same shear modulus: {MATERIAL} = {{ mooney_rivlin = \
                     {{ c10 = \"{} Pa\", c01 = \"0 Pa\" }} }}",
                    law.shear_modulus() / 2.0
                );
                InputError::at(file, text, found.span.clone(), message)
                    .key(found.path.join("."))
                    .help(help)
            })?
        };
        changes.push(found.change(None, value));
    }
    toml_input::parse_changed(file, text, &changes)
}

/// The laws that a text names, with their places; `changes` takes out the law files behind it. None
/// in a text that is no TOML, which reading it says.
fn all_named(
    file: &str,
    text: &str,
    changes: &mut Vec<Change>,
) -> Result<Vec<(Found, Material)>, InputError> {
    let Ok(table) = DeTable::parse(text) else {
        return Ok(Vec::new());
    };
    let files = files(table.get_ref());
    if !files.is_empty() {
        changes.push(Change {
            path: vec![FILES.to_owned()],
            value: None,
            span: 0..0,
        });
    }
    let found = all_in(table.get_ref()).into_iter();
    found
        .map(|found| {
            let material = found.material(file, text, &files)?;
            Ok((found, material))
        })
        .collect()
}

/// Mooney and Rivlin's law that is the same; none for the others.
fn of_two_constants(law: &Law) -> Option<String> {
    match law {
        Law::NeoHookean { shear } => Some(
            Law::MooneyRivlin {
                c10: shear / 2.0,
                c01: 0.0,
            }
            .toml(),
        ),
        Law::MooneyRivlin { .. } => Some(law.toml()),
        _ => None,
    }
}

/// Reads a problem file, in whose `[[material]]` a name may stand in the place of a law.
///
/// # Errors
/// As [`parse_sensor`]; a name and a law for the same regions.
pub fn parse_problem<T: DeserializeOwned + JsonSchema>(
    file: &str,
    text: &str,
) -> Result<T, InputError> {
    let mut changes = Vec::new();
    for (found, material) in all_named(file, text, &mut changes)? {
        let path: Vec<&str> = found.path.iter().map(String::as_str).collect();
        let path = &path[..path.len() - 1];
        let beside =
            |key: &'static str| -> Vec<&str> { path.iter().copied().chain([key]).collect() };
        let has = |key: &'static str| toml_input::has(text, &beside(key));
        if has("law") {
            let message = "these regions have a law and the name of one";
            let help = "take `law` or `material` out";
            return Err(toml_input::at_key(
                file,
                text,
                &beside("law"),
                message,
                help,
            ));
        }
        changes.push(found.change(None, shown::toml(&material.name)));
        changes.push(found.change(Some("law"), material.law.toml()));
        if !material.relaxation.is_empty() && !has("relaxation") {
            changes.push(found.change(Some("relaxation"), material.relaxation_toml()));
        }
        if !has("compressibility") {
            let incompressible = "\"incompressible\"".to_owned();
            changes.push(found.change(Some("compressibility"), incompressible));
        }
    }
    toml_input::parse_changed(file, text, &changes)
}

/// The laws that a description names, by the order of their keys; none in a text that is no TOML.
///
/// # Errors
/// What [`parse_sensor`] says of names.
pub fn used(file: &str, text: &str) -> Result<Vec<Used>, InputError> {
    let found = all_named(file, text, &mut Vec::new())?.into_iter();
    Ok(found
        .map(|(found, material)| Used {
            key: found.path.join("."),
            material,
        })
        .collect())
}

/// Law files that a description names and does not come with, each with the path of its key; none
/// in a text that is no TOML.
pub fn unread_files(text: &str) -> Vec<(String, Vec<String>)> {
    let Ok(table) = DeTable::parse(text) else {
        return Vec::new();
    };
    let known = files(table.get_ref());
    let mut unread: Vec<(String, Vec<String>)> = Vec::new();
    for found in all_in(table.get_ref()) {
        if let Named::File(name) = found.what
            && !known.iter().any(|(known, _)| *known == name)
            && !unread.iter().any(|(other, _)| *other == name)
        {
            unread.push((name, found.path));
        }
    }
    unread
}

/// A description with the text of a law file behind it.
#[must_use]
pub fn with_file(text: &str, name: &str, law: &str) -> String {
    let table = format!("\n[{FILES}]\n");
    let head = if text.contains(&table) { "" } else { &table };
    let end = if text.ends_with('\n') { "" } else { "\n" };
    format!(
        "{text}{end}{head}{} = {}\n",
        shown::toml(name),
        shown::toml(law)
    )
}

/// The schema of files in whose places of moduli and laws names may stand.
pub fn schema<T: JsonSchema>() -> String {
    schema::json_schema_changed::<T>(|schema| {
        let mut laws = Vec::new();
        names_in(schema, &mut laws);
        for law in laws {
            if let Some(Value::Object(law)) = schema.pointer_mut(&law) {
                law.insert("type".into(), json!(["string", "object"]));
                if let Some(Value::Object(tables)) = law.get_mut("properties") {
                    tables.insert(FILE.into(), json!({ "type": "string" }));
                }
            }
        }
    })
}

/// Adds names to moduli and laws; the pointers to definitions of laws go to `laws`.
fn names_in(schema: &mut Value, laws: &mut Vec<String>) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| names_in(item, laws)),
        Value::Object(object) => {
            object.values_mut().for_each(|value| names_in(value, laws));
            let Some(Value::Object(properties)) = object.get_mut("properties") else {
                return;
            };
            for (key, value) in properties.iter_mut() {
                let name_of = match key.as_str() {
                    MATERIAL => FILE,
                    key if key.ends_with(MODULUS) => MATERIAL,
                    _ => continue,
                };
                let Value::Object(value) = value else {
                    continue;
                };
                if value.get("type").is_some_and(|kind| kind == "string") {
                    value.insert("type".into(), json!(["string", "object"]));
                    let kinds = if name_of == FILE {
                        json!("string")
                    } else {
                        json!(["string", "object"])
                    };
                    value.insert("properties".into(), json!({ name_of: { "type": kinds } }));
                } else if let Some(law) = value.get("$ref").and_then(Value::as_str)
                    && name_of == FILE
                {
                    laws.push(law.trim_start_matches('#').to_owned());
                }
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Layer {
        youngs_modulus: String,
        shear_modulus: Option<String>,
        material: Option<Constants>,
    }

    #[derive(Debug, PartialEq, serde::Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum Constants {
        MooneyRivlin { c10: String, c01: String },
    }

    fn read(text: &str) -> Result<Layer, InputError> {
        parse_sensor("layer.toml", text, &|_| 1.0)
    }

    #[test]
    fn a_name_stands_for_a_modulus_and_for_a_law() {
        let text = "youngs_modulus = { material = \"rtv615\" }\nshear_modulus = { material = \"RTV615\" }\n\
                    material = \"ecoflex-00-30\"\n";
        let layer = read(text).unwrap();
        let shear: f64 = 345.03 * 1e3;
        assert_eq!(layer.youngs_modulus, format!("{} Pa", 3.0 * shear));
        assert_eq!(layer.shear_modulus, Some(format!("{shear} Pa")));
        let Some(Constants::MooneyRivlin { c10, c01 }) = layer.material else {
            panic!("{layer:?}");
        };
        assert_eq!((c10.as_str(), c01.as_str()), ("8558.5 Pa", "0 Pa"));
        let keys: Vec<_> = used("", text)
            .unwrap()
            .into_iter()
            .map(|one| one.key)
            .collect();
        assert_eq!(keys, ["material", "shear_modulus", "youngs_modulus"]);
    }

    #[test]
    fn a_law_file_comes_with_the_text() {
        let text = "youngs_modulus = { material = { file = \"it's mine.toml\" } }";
        assert_eq!(unread_files(text)[0].0, "it's mine.toml");
        let error = read(text).unwrap_err();
        assert_eq!(error.key, "youngs_modulus");
        let law = Material {
            name: "a \"pour\"\n".into(),
            ..library::named("ecoflex-00-30").unwrap()
        };
        let whole = with_file(text, "it's mine.toml", &law.toml(None));
        assert!(unread_files(&whole).is_empty());
        assert_eq!(read(&whole).unwrap().youngs_modulus, "51351 Pa");
        assert_eq!(used("", &whole).unwrap()[0].material.name, law.name);
    }

    #[test]
    fn a_mistake_is_shown_at_the_name() {
        let error = read("youngs_modulus = { material = \"rtv 61\" }").unwrap_err();
        let place = error.place.unwrap();
        assert_eq!((place.column, place.width), (31, 8));
        assert!(error.help.contains("rtv615"), "{}", error.help);
        let error = read("youngs_modulus = \"1 MPa\"\nmaterial = \"dragon-skin-30\"").unwrap_err();
        assert!(error.help.contains("c10 = \"95665 Pa\""), "{}", error.help);
        assert_eq!(error.place.unwrap().line, 2);
    }
}
