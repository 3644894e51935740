//! The reference of a file, written from its schema.

use std::fmt::Write as _;

use serde_json::Value;

use crate::quantity;

/// Tables of more keys than this get a section of their own where they are one
/// of several values.
const MOST_INLINE: usize = 3;

/// Deepest level that the contents name.
const CONTENTS_LEVEL: usize = 2;

const QUANTITIES: &str = "
A quantity is text, a number and a unit: `\"400 um\"`. The unit after the comma of a description is the SI unit of
its value inside the program and in its JSON. A value that is not zero has a size between the two of its quantity, in
the SI unit.

| quantity | units | sizes |
|---|---|---|
";

/// The page, from a schema as `schemars` writes it.
pub(super) fn page(head: &str, schema: &Value) -> String {
    let mut page = Page {
        definitions: &schema["$defs"],
        text: String::new(),
        contents: Vec::new(),
    };
    for dimension in quantity::dimensions() {
        let name = without_article(dimension.name);
        let [smallest, largest] = dimension.sizes;
        page.line(&format!(
            "| {name} | {} | {smallest:e} to {largest:e} {} |",
            dimension.symbols(),
            dimension.si
        ));
    }
    page.section("", 1, schema);
    let contents = page.contents.join(" ·\n");
    format!("{head}\nTables: {contents}\n{QUANTITIES}{}", page.text)
}

struct Page<'a> {
    definitions: &'a Value,
    text: String,
    contents: Vec<String>,
}

/// Parts of a table besides plain values; written below its keys.
#[derive(Default)]
struct Below<'a> {
    choices: Vec<(String, &'a Value)>,
    sections: Vec<(String, &'a Value)>,
}

impl<'a> Page<'a> {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// One table of the file and, below it, its own tables.
    fn section(&mut self, path: &str, level: usize, table: &'a Value) {
        let title = match path {
            "" => String::from("Top of the file"),
            path => format!("`{path}`"),
        };
        let marks = "#".repeat((level + 1).min(4));
        if level <= CONTENTS_LEVEL && !path.is_empty() {
            self.contents.push(link(path));
        }
        let _ = write!(
            self.text,
            "\n{marks} {title}\n\n{}\n\n",
            sentence(description(table))
        );
        let mut below = Below::default();
        if properties(table).next().is_some() {
            self.line("| key | is | value | required |");
            self.line("|---|---|---|---|");
            self.rows(path, "", table, &mut below);
        } else {
            self.choice(path, table, &mut below);
        }
        for (path, choice) in std::mem::take(&mut below.choices) {
            let about = sentence(description(choice));
            let _ = write!(self.text, "\n**`{path}`**: one of these. {about}\n\n");
            self.choice(&path, choice, &mut below);
        }
        let inner = if path.is_empty() { level } else { level + 1 };
        for (path, table) in below.sections {
            self.section(&path, inner, table);
        }
    }

    /// One row for each key of `table`; `prefix` is its path inside the section.
    fn rows(&mut self, section: &str, prefix: &str, table: &'a Value, below: &mut Below<'a>) {
        let required = &table["required"];
        for (name, node) in properties(table) {
            let needed = required
                .as_array()
                .is_some_and(|names| names.iter().any(|other| other == name));
            let key = format!("{prefix}{name}");
            let path = joined(section, &key);
            let shape = self.shape(node);
            let value = self.value(&path, shape, below);
            let about = match description(node) {
                "" => description(shape),
                about => about,
            };
            let needed = if needed { "yes" } else { "no" };
            self.line(&format!(
                "| `{key}` | {} | {value} | {needed} |",
                cell(about)
            ));
            self.inner_rows(section, &key, shape, below);
        }
    }

    /// Rows of what is written in braces or brackets behind `key`.
    fn inner_rows(&mut self, section: &str, key: &str, shape: &'a Value, below: &mut Below<'a>) {
        if let Some(entry) = self.entries(shape)
            && !section.is_empty()
        {
            self.rows(section, &format!("{key}[]."), entry, below);
        }
        for (name, content) in self.variants(shape).filter_map(|variant| variant.1) {
            if let Some(entry) = self.entries(content) {
                self.rows(section, &format!("{key}.{name}[]."), entry, below);
            } else if self.is_small(content) {
                self.rows(section, &format!("{key}.{name}."), content, below);
            }
        }
    }

    /// Values that a key may have.
    fn value(&self, path: &str, shape: &'a Value, below: &mut Below<'a>) -> String {
        if is_choice(shape) {
            if self.variants(shape).all(|(_, content)| {
                content.is_some_and(|(_, c)| !self.is_small(c) && self.entries(c).is_none())
            }) {
                below.sections.push((path.to_owned(), shape));
                return format!("[one of these tables](#{})", anchor(path));
            }
            below.choices.push((path.to_owned(), shape));
            return String::from("one of the values below");
        }
        if properties(shape).next().is_some() {
            below.sections.push((path.to_owned(), shape));
            return format!("[a table](#{})", anchor(path));
        }
        if let Some(entry) = self.entries(shape) {
            if path.contains('.') {
                return String::from("a list of tables");
            }
            below.sections.push((path.to_owned(), entry));
            return format!("[a list of tables](#{})", anchor(path));
        }
        cell(&plain(shape))
    }

    /// The values of a choice.
    fn choice(&mut self, path: &str, choice: &'a Value, below: &mut Below<'a>) {
        self.line("| value | means |");
        self.line("|---|---|");
        for (variant, content) in self.variants(choice) {
            let value = match content {
                None => format!("`{}`", variant["const"]),
                Some((name, content)) => {
                    let path = joined(path, name);
                    if let Some(entry) = self.entries(content) {
                        format!("`{{ {name} = [{}, …] }}`", braces(entry))
                    } else if self.is_small(content) {
                        format!("`{{ {name} = {} }}`", braces(content))
                    } else {
                        below.sections.push((path.clone(), content));
                        format!("the table {}", link(&path))
                    }
                }
            };
            self.line(&format!("| {value} | {} |", cell(description(variant))));
        }
    }

    /// Each variant of a choice with the name and content of its table, if it
    /// has one.
    fn variants(
        &self,
        choice: &'a Value,
    ) -> impl Iterator<Item = (&'a Value, Option<(&'a str, &'a Value)>)> + use<'a> {
        let definitions = self.definitions;
        let variants = choice["oneOf"].as_array().filter(|_| is_choice(choice));
        variants.into_iter().flatten().map(move |variant| {
            let content = properties(variant)
                .next()
                .map(|(name, node)| (name, resolved(definitions, node)));
            (variant, content)
        })
    }

    /// The table that each entry of a list is, if it is a list of tables.
    fn entries(&self, shape: &'a Value) -> Option<&'a Value> {
        let entry = self.shape(shape.get("items")?);
        properties(entry).next().map(|_| entry)
    }

    /// True if a table has a few plain keys only.
    fn is_small(&self, table: &'a Value) -> bool {
        properties(table).count() <= MOST_INLINE
            && properties(table).all(|(_, node)| {
                let shape = self.shape(node);
                !is_choice(shape)
                    && properties(shape).next().is_none()
                    && self.entries(shape).is_none()
            })
    }

    fn shape(&self, node: &'a Value) -> &'a Value {
        resolved(self.definitions, node)
    }
}

/// Follows a reference; what may be missing is what it is when it is there.
pub(super) fn resolved<'a>(definitions: &'a Value, node: &'a Value) -> &'a Value {
    let options = node["anyOf"].as_array();
    // What says itself what it is stays whole.
    let node = match options.filter(|_| node.get(quantity::VALUE).is_none()) {
        Some(options) => options
            .iter()
            .find(|option| option["type"] != "null")
            .unwrap_or(node),
        None => node,
    };
    match node["$ref"].as_str() {
        Some(reference) => &definitions[reference.trim_start_matches("#/$defs/")],
        None => node,
    }
}

pub(super) fn properties(table: &Value) -> impl Iterator<Item = (&str, &Value)> {
    let properties = table["properties"].as_object();
    properties
        .into_iter()
        .flatten()
        .map(|(name, node)| (name.as_str(), node))
}

/// True if exactly one of several named values is needed.
pub(super) fn is_choice(shape: &Value) -> bool {
    shape["oneOf"].as_array().is_some_and(|variants| {
        variants
            .iter()
            .all(|variant| variant.get("const").is_some() || variant.get("properties").is_some())
    })
}

/// A value that is no table and no choice.
fn plain(shape: &Value) -> String {
    if let Some(options) = shape["oneOf"].as_array() {
        let options: Vec<_> = options.iter().map(plain).collect();
        return options.join("; or ");
    }
    if let Some(value) = shape.get("const") {
        return format!("`{value}`");
    }
    if let Some(value) = shape[quantity::VALUE].as_str() {
        return value.to_owned();
    }
    match kind(shape) {
        Some("integer") => match (shape["minimum"].as_u64(), shape["maximum"].as_u64()) {
            (Some(low), Some(high)) => format!("a whole number, {low} to {high}"),
            (Some(low), None) => format!("a whole number of {low} or more"),
            _ => String::from("a whole number"),
        },
        Some("array") => {
            let each = plain(&shape["items"]);
            match shape["minItems"].as_u64() {
                Some(length) => format!("a list of {length}, each {each}"),
                None => format!("a list, each {each}"),
            }
        }
        Some("string") => String::from("text"),
        Some(other) => format!("a {other}"),
        None => String::new(),
    }
}

/// Type of a value; what may be missing is what it is when it is there.
fn kind(shape: &Value) -> Option<&str> {
    let kinds = match &shape["type"] {
        Value::Array(kinds) => &kinds[..],
        kind => std::slice::from_ref(kind),
    };
    kinds
        .iter()
        .filter_map(Value::as_str)
        .find(|kind| *kind != "null")
}

/// A small table, written in braces; a text in its quotes.
pub(super) fn braces(table: &Value) -> String {
    if kind(table) == Some("string") {
        return String::from("\"…\"");
    }
    let keys: Vec<_> = properties(table)
        .map(|(name, _)| format!("{name} = …"))
        .collect();
    format!("{{ {} }}", keys.join(", "))
}

fn description(node: &Value) -> &str {
    node["description"].as_str().unwrap_or_default()
}

/// A description as running text; links of the code's documentation are cut.
fn sentence(text: &str) -> String {
    let plain = text.replace("[`", "`").replace("`]", "`");
    let paragraphs: Vec<_> = plain
        .split("\n\n")
        .map(|paragraph| paragraph.replace('\n', " "))
        .collect();
    paragraphs.join("\n\n")
}

/// The same inside a table.
fn cell(text: &str) -> String {
    sentence(text).replace("\n\n", " ").replace('|', "\\|")
}

fn joined(section: &str, key: &str) -> String {
    match section {
        "" => key.to_owned(),
        section => format!("{section}.{key}"),
    }
}

/// A link to the section of `path`.
fn link(path: &str) -> String {
    format!("[`{path}`](#{})", anchor(path))
}

/// Anchor of the section of `path`.
fn anchor(path: &str) -> String {
    path.replace('.', "")
}

fn without_article(name: &str) -> &str {
    name.trim_start_matches("a ").trim_start_matches("an ")
}
