//! A study, read and checked: variables, links, answers, constraints, objectives.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sha2::{Digest, Sha256};
use taxel::mechanics::Mechanics;
use taxel::quantity::STRESS;
use taxel::sensor::Sensor;
use taxel::solutions::Solutions;
use taxel::words::advice;
use taxel::{InputError, toml_input};
use toml_edit::{DocumentMut, Value};

use crate::answers::{Answer, Context, Named, Outcome, SolvedSection, WAY_COLUMN};
use crate::exponents::{Exponents, NONE, quantity_of};
use crate::expression::{Comparison, Expression, Mistake, comparison, expression, names_in};
use crate::file::{
    AfterFile, Bound, EachFile, PlaceFile, ScaleFile, StudyFile, SweepFile, ToleranceFile,
};
use crate::keys::{Form, KeyPath, nearest, paths};
use crate::spread::{Limit, Shape, Spread};

/// Makes a place of solutions for each design that needs one.
pub type SolutionsMaker = Box<dyn Fn() -> Box<dyn Solutions> + Send + Sync>;

/// Most variables of a study: the Sobol sequence has this many dimensions.
pub const MOST_VARIABLES: usize = 21;

/// A sensor file with the name that the user gave it.
#[derive(Debug, Clone, Copy)]
pub struct SensorText<'a> {
    /// Name for messages.
    pub name: &'a str,
    /// Its text.
    pub text: &'a str,
}

/// A study, ready to evaluate designs.
pub struct Study {
    /// Name.
    pub name: String,
    /// Name of the sensor file.
    pub sensor: String,
    /// SHA-256 of the text of the study.
    pub hash: String,
    /// SHA-256 of the text of the sensor file.
    pub sensor_hash: String,
    /// What is varied, in the order of the file.
    pub variables: Vec<Variable>,
    /// What is asked, in the order of the file.
    pub answers: Vec<Answer>,
    /// Comparisons with their names, in the order of the file.
    pub constraints: Vec<(String, Comparison)>,
    /// Objectives: those to be small, then those to be great.
    pub objectives: Vec<Objective>,
    /// Plan of a sweep.
    pub sweep: SweepFile,
    /// Options of an optimisation.
    pub optimize: crate::file::OptimizeFile,
    /// Options of a tolerance analysis.
    pub tolerance: ToleranceFile,
    /// Limits of answers: index of the answer and its limits.
    pub limits: Vec<(usize, Limit)>,
    /// Places to choose.
    pub place: Option<PlaceFile>,
    /// The sensor file with `[set]` applied.
    base: DocumentMut,
    links: Vec<Link>,
    /// SHA-256 of the table that the sensor file names.
    table_hash: Option<String>,
    solutions: SolutionsMaker,
}

/// One variable.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Its key; none of a condition that answers name.
    pub key: Option<KeyPath>,
    /// Its values.
    pub values: Values,
    /// Number of values on a grid.
    pub points: usize,
    /// Value in the sensor file, SI, where it is a number.
    pub drawn: Option<f64>,
    /// Spread of made devices.
    pub spread: Option<Spread>,
    /// Name of the spread: capacitors of which each is made differently share one.
    pub process: String,
}

/// Values of a variable.
#[derive(Debug, Clone)]
pub enum Values {
    /// Numbers between two ends, SI.
    Range {
        /// Least and greatest.
        ends: [f64; 2],
        /// True for equal ratios.
        logarithmic: bool,
        /// Form in the sensor file.
        form: Form,
    },
    /// These numbers, SI.
    Numbers(Vec<f64>, Form),
    /// These words or flags; a point holds an index.
    Words(Vec<Value>),
    /// Only the value of the sensor file, about which made devices spread.
    Drawn(Form),
}

#[derive(Debug, Clone, PartialEq)]
struct Link {
    key: KeyPath,
    expression: Expression,
    form: Form,
}

/// One objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// As it is written.
    pub name: String,
    /// 1 for what is to be small, -1 for what is to be great.
    pub sign: f64,
    /// Its value.
    pub expression: Expression,
}

/// State of an evaluated design.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All answers are there.
    Done,
    /// A rule of the sensor file forbids it.
    Refused,
    /// A solver stopped.
    Ended,
    /// An answer lies outside the accepted states.
    Outside,
}

/// One evaluated design.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Value of each variable, SI, as written and read back; the index of a word.
    pub point: Vec<f64>,
    /// State.
    pub status: Status,
    /// Why it is not done.
    pub reason: String,
    /// Answers.
    pub answers: Vec<Outcome>,
}

impl Status {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Refused => "refused",
            Self::Ended => "ended",
            Self::Outside => "outside",
        }
    }

    /// The state of this name.
    pub fn of(name: &str) -> Option<Self> {
        [Self::Done, Self::Refused, Self::Ended, Self::Outside]
            .into_iter()
            .find(|status| status.name() == name)
    }
}

impl Variable {
    /// What an answer needs to know to name it.
    fn named(&self) -> Named<'_> {
        Named {
            name: &self.name,
            keyless: self.key.is_none(),
            exponents: self.values.form().map(exponents_of),
            least: self
                .values
                .grid(2)
                .into_iter()
                .fold(f64::INFINITY, f64::min),
            listed: match &self.values {
                Values::Numbers(values, _) => values,
                _ => &[],
            },
        }
    }
}

impl Values {
    /// The value at a share of the way from the first to the last, 0 to 1.
    pub fn at(&self, share: f64) -> f64 {
        let pick = |count: usize| {
            let index = (share * count as f64).floor().max(0.0) as usize;
            index.min(count.saturating_sub(1))
        };
        match self {
            Self::Range {
                ends: [low, high],
                logarithmic,
                ..
            } => {
                let share = share.clamp(0.0, 1.0);
                if share == 0.0 {
                    *low
                } else if share == 1.0 {
                    *high
                } else if *logarithmic {
                    low * (high / low).powf(share)
                } else {
                    low + (high - low) * share
                }
            }
            Self::Numbers(values, _) => values[pick(values.len())],
            Self::Words(words) => pick(words.len()) as f64,
            Self::Drawn(_) => f64::NAN,
        }
    }

    /// Share of the way at which a value of a range stands.
    pub fn share(&self, value: f64) -> f64 {
        match self {
            Self::Range {
                ends: [low, high],
                logarithmic: true,
                ..
            } => (value / low).ln() / (high / low).ln(),
            Self::Range {
                ends: [low, high], ..
            } => (value - low) / (high - low),
            Self::Numbers(values, _) => {
                let index = values.iter().position(|one| *one == value).unwrap_or(0);
                (index as f64 + 0.5) / values.len() as f64
            }
            Self::Words(words) => (value + 0.5) / words.len() as f64,
            Self::Drawn(_) => 0.5,
        }
    }

    /// The values on a grid of `points` of a range; all of a list.
    pub fn grid(&self, points: usize) -> Vec<f64> {
        match self {
            Self::Range { .. } => {
                let last = points.saturating_sub(1).max(1) as f64;
                (0..points).map(|i| self.at(i as f64 / last)).collect()
            }
            Self::Numbers(values, _) => values.clone(),
            Self::Words(words) => (0..words.len()).map(|i| i as f64).collect(),
            Self::Drawn(_) => Vec::new(),
        }
    }

    /// Form of the numbers; none of words.
    pub fn form(&self) -> Option<Form> {
        match self {
            Self::Range { form, .. } | Self::Numbers(_, form) | Self::Drawn(form) => Some(*form),
            Self::Words(_) => None,
        }
    }

    /// True if it varies between the designs of a sweep or an optimisation.
    pub fn varies(&self) -> bool {
        !matches!(self, Self::Drawn(_))
    }

    fn write(&self, value: f64) -> (Value, f64) {
        match self {
            Self::Words(words) => {
                let index = (value.max(0.0) as usize).min(words.len() - 1);
                (words[index].clone(), index as f64)
            }
            // What is listed is written as it is listed.
            Self::Numbers(_, form) => form.write_exactly(value),
            Self::Range { form, .. } | Self::Drawn(form) => form.write(value),
        }
    }
}

/// SHA-256 of a text in hexadecimal digits.
pub fn sha256(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .fold(String::new(), |mut hex, byte| {
            let _ = write!(hex, "{byte:02x}");
            hex
        })
}

/// What a study file says of itself before its sensor is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Version of the format.
    pub schema: i64,
    /// Sensor file, or name of a shipped one.
    pub sensor: String,
}

/// Version and sensor of a study file.
///
/// # Errors
/// A text that is no TOML, or without these keys.
pub fn header(file: &str, text: &str) -> Result<Header, InputError> {
    #[derive(serde::Deserialize, schemars::JsonSchema)]
    struct Head {
        schema: i64,
        sensor: String,
    }
    let head: Head = toml_input::parse(file, text)?;
    Ok(Header {
        schema: head.schema,
        sensor: head.sensor,
    })
}

/// Reads a study with the places of its mistakes.
struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    written: StudyFile,
    /// Keys of each table in the order of the file.
    order: DocumentMut,
}

impl Reader<'_> {
    fn at(&self, path: &[&str], message: &str, help: &str) -> InputError {
        toml_input::at_key(self.file, self.text, path, message, help)
    }

    /// A mistake inside the text of an expression, under its words.
    fn inside(&self, path: &[&str], text: &str, mistake: &Mistake) -> InputError {
        let mut error = self.at(path, &mistake.message, &mistake.help);
        if let Some(place) = error.place.as_deref_mut() {
            let chars = |part: &str| part.chars().count();
            let literal: String = place.text.chars().skip(place.column).collect();
            // Only where the file has the very text: an escape moves the words.
            if literal.starts_with(text) {
                place.column += 1 + chars(&text[..mistake.span.start]);
                place.width = chars(&text[mistake.span.clone()]).max(1);
            }
        }
        error
    }

    /// Keys of a table in the order of the file.
    fn keys(&self, table: &[&str]) -> Vec<String> {
        let found = table
            .iter()
            .try_fold(self.order.as_item(), |item, name| item.get(name))
            .and_then(|item| item.as_table_like());
        found.map_or_else(Vec::new, |table| {
            table.iter().map(|(key, _)| key.to_owned()).collect()
        })
    }
}

/// SI value and form of a bound; none of a word.
fn number_of(bound: &Bound) -> Option<(f64, Form)> {
    match bound {
        Bound::Whole(whole) => Some((*whole as f64, Form::Whole)),
        Bound::Number(number) => Some((*number, Form::Number)),
        Bound::Text(text) => {
            quantity_of(text).map(|(dimension, unit, si)| (si, Form::Quantity(dimension, unit)))
        }
        Bound::Flag(_) => None,
    }
}

pub(crate) fn exponents_of(form: Form) -> Exponents {
    match form {
        Form::Quantity(dimension, _) => Exponents::of(dimension),
        Form::Number | Form::Whole => NONE,
    }
}

impl Study {
    /// Reads a study; `sensor` is the text of the file that it names.
    ///
    /// # Errors
    /// The first mistake, under its word.
    pub fn parse(
        file: &str,
        text: &str,
        sensor: &SensorText<'_>,
        solutions: SolutionsMaker,
    ) -> Result<Self, InputError> {
        let written: StudyFile = toml_input::parse(file, text)?;
        if written.schema != 2 {
            let message = format!(
                "schema = {} is not read; this is a study of schema 2",
                written.schema
            );
            return Err(toml_input::at_key(
                file,
                text,
                &["schema"],
                &message,
                "write schema = 2",
            ));
        }
        let parsed = |file: &str, text: &str| -> Result<DocumentMut, InputError> {
            text.parse().map_err(|error: toml_edit::TomlError| {
                let span = error.span().unwrap_or(0..0);
                InputError::at(file, text, span, error.message())
            })
        };
        let order = parsed(file, text)?;
        let reader = Reader {
            file,
            text,
            written,
            order,
        };
        // The sensor file as it is: its own mistakes are told first.
        let drawn = Sensor::parse_with(sensor.name, sensor.text, solutions().as_mut())?;
        let table_hash = match &drawn.mechanics {
            Mechanics::Table(name) => solutions().table(name).ok().map(|table| sha256(&table)),
            Mechanics::ClosedForm | Mechanics::Fem => None,
        };
        let mut base = parsed(sensor.name, sensor.text)?;
        reader.apply_set(&mut base)?;
        let lists = drawn.device().map_or(&[][..], |device| device.lists());
        let variables = reader.variables(&mut base, lists)?;
        let links = reader.links(&base, &variables)?;
        let mut study = Self {
            name: reader.written.name.clone(),
            sensor: sensor.name.to_owned(),
            hash: sha256(text),
            sensor_hash: sha256(sensor.text),
            variables,
            answers: Vec::new(),
            constraints: Vec::new(),
            objectives: Vec::new(),
            sweep: reader.written.sweep.clone(),
            optimize: reader.written.optimize,
            tolerance: reader.written.tolerance.clone(),
            limits: Vec::new(),
            place: reader.written.place.clone(),
            base,
            links,
            table_hash,
            solutions,
        };
        reader.check_keys(&study)?;
        let nominal = study.nominal_sensor().unwrap_or(drawn);
        study.answers = reader.answers(&nominal, &study.variables)?;
        let names = study.names();
        study.constraints = reader.constraints(&names)?;
        study.objectives = reader.objectives(&names, &study)?;
        study.limits = reader.limits(&study)?;
        reader.check_options(&study)?;
        let ways = nominal
            .device()
            .is_ok_and(|device| !device.way().is_empty());
        let named = |name: &String| name == WAY_COLUMN;
        if ways && !study.names().iter().any(|(name, _)| named(name)) {
            study.answers.push(Answer::way());
        }
        Ok(study)
    }

    /// Names of expressions with their dimensions: variables, then answers.
    pub(crate) fn names(&self) -> Vec<(String, Exponents)> {
        let variables = self.variables.iter().map(|variable| {
            let exponents = variable.values.form().map_or(NONE, exponents_of);
            (variable.name.clone(), exponents)
        });
        let answers = self.answers.iter().map(|answer| {
            let unit = Exponents::of_key(answer.column.si).unwrap_or(NONE);
            (answer.name.clone(), unit)
        });
        variables.chain(answers).collect()
    }

    /// The drawn value of each variable, SI; the first of those whose key has no number.
    pub fn nominal(&self) -> Vec<f64> {
        let drawn = |variable: &Variable| variable.drawn.unwrap_or_else(|| variable.values.at(0.0));
        self.variables.iter().map(drawn).collect()
    }

    fn nominal_sensor(&self) -> Option<Sensor> {
        let (text, _) = self.text_of(&self.nominal());
        self.read(&text).ok()
    }

    /// The sensor of a design text.
    ///
    /// # Errors
    /// As [`Sensor::parse`].
    pub fn read(&self, text: &str) -> Result<Sensor, InputError> {
        Sensor::parse_with(&self.sensor, text, (self.solutions)().as_mut())
    }

    /// The sensor file of a design, and its point as written and read back.
    pub fn text_of(&self, point: &[f64]) -> (String, Vec<f64>) {
        let mut document = self.base.clone();
        let mut values = Vec::new();
        for (variable, value) in self.variables.iter().zip(point) {
            let (item, back) = variable.values.write(*value);
            if let Some(key) = &variable.key {
                key.set(&mut document, &item);
            }
            values.push(back);
        }
        let written = values.clone();
        for link in &self.links {
            let value = link.expression.value(&values);
            let (item, back) = link.form.write(value);
            link.key.set(&mut document, &item);
            values.push(back);
        }
        (document.to_string(), written)
    }

    /// Evaluates one design.
    pub fn evaluate(&self, point: &[f64]) -> Row {
        self.evaluate_made(point, None)
    }

    /// True if some variables are conditions: then neighbours on a grid are the same sensor.
    pub(crate) fn has_conditions(&self) -> bool {
        self.variables.iter().any(|one| one.key.is_none())
    }

    /// Evaluates one design, or a made device of which `drawn` is the drawing.
    pub(crate) fn evaluate_made(&self, point: &[f64], drawn: Option<(&Sensor, AfterFile)>) -> Row {
        let rows = self.evaluate_alike(&[point], drawn, &|| false);
        let row = rows.into_iter().flatten().next();
        row.expect("nobody stops it")
    }

    /// Evaluates designs that are the same sensor under different conditions.
    pub(crate) fn evaluate_alike(
        &self,
        points: &[&[f64]],
        drawn: Option<(&Sensor, AfterFile)>,
        stop: &dyn Fn() -> bool,
    ) -> Vec<Option<Row>> {
        let mut known = None;
        points
            .iter()
            .map(|point| self.evaluate_one(point, drawn, &mut known, stop))
            .collect()
    }

    /// Evaluates one design; `known` is what was computed of the same sensor before.
    fn evaluate_one(
        &self,
        point: &[f64],
        drawn: Option<(&Sensor, AfterFile)>,
        known: &mut Option<SolvedSection>,
        stop: &dyn Fn() -> bool,
    ) -> Option<Row> {
        let (text, point) = self.text_of(point);
        let failed = |status, reason: String| {
            Some(Row {
                point: point.clone(),
                status,
                reason,
                answers: vec![Outcome::None; self.answers.len()],
            })
        };
        if let Some(link) = self.broken_link(&point) {
            return failed(
                Status::Refused,
                format!("{link}: the expression of this link has no finite value"),
            );
        }
        let sensor = match self.read(&text) {
            Ok(sensor) => sensor,
            Err(error) => {
                let key = if error.key.is_empty() {
                    String::new()
                } else {
                    format!("{}: ", error.key)
                };
                let line = error.message.lines().next().unwrap_or("").to_owned();
                return failed(Status::Refused, format!("{key}{line}"));
            }
        };
        let mut context = Context::new(&sensor, drawn, &point, stop);
        context.section = known.take();
        let answers: Vec<Outcome> = self
            .answers
            .iter()
            .map(|answer| answer.evaluate(&mut context))
            .collect();
        *known = context.section.take();
        if context.stopped {
            return None;
        }
        drop(context);
        let mut status = Status::Done;
        let mut reason = String::new();
        for (answer, outcome) in self.answers.iter().zip(&answers) {
            let (found, why) = match outcome {
                Outcome::Outside(why) => (Status::Outside, why),
                Outcome::Ended(why) => (Status::Ended, why),
                _ => continue,
            };
            if reason.is_empty() {
                status = found;
                reason = format!("{}: {why}", answer.name);
            }
        }
        Some(Row {
            point,
            status,
            reason,
            answers,
        })
    }

    /// Key of the first link without a finite value.
    fn broken_link(&self, point: &[f64]) -> Option<&str> {
        let mut values = point.to_vec();
        for link in &self.links {
            let value = link.expression.value(&values);
            if !value.is_finite() {
                return Some(&link.key.text);
            }
            values.push(link.form.write(value).1);
        }
        None
    }

    /// Values of the names of expressions for a row; not a number where there is none.
    pub fn values(&self, row: &Row) -> Vec<f64> {
        let answers = row.answers.iter().map(Outcome::number);
        let answers = answers.map(|number| number.unwrap_or(f64::NAN));
        row.point.iter().copied().chain(answers).collect()
    }

    /// How far a row violates each constraint: zero or less where it holds, infinite where it
    /// has no value.
    pub fn violations(&self, row: &Row) -> Vec<f64> {
        let values = self.values(row);
        let excess = |comparison: &Comparison| {
            let excess = comparison.excess(&values);
            if excess.is_nan() {
                f64::INFINITY
            } else {
                excess
            }
        };
        self.constraints
            .iter()
            .map(|(_, comparison)| excess(comparison))
            .collect()
    }

    /// Values of the objectives for a row, SI.
    pub fn objective_values(&self, row: &Row) -> Vec<f64> {
        let values = self.values(row);
        let value = |objective: &Objective| objective.expression.value(&values);
        self.objectives.iter().map(value).collect()
    }

    /// What the result of a design follows from, beside the library: the sensor in SI, the
    /// contents of the table that it names, and the answers asked.
    pub fn content(&self, point: &[f64]) -> String {
        let (text, written) = self.text_of(point);
        let resolved = text
            .parse::<DocumentMut>()
            .map_or(serde_json::Value::Null, |document| {
                resolved(document.as_item())
            });
        let answers: Vec<&str> = self
            .answers
            .iter()
            .map(|one| one.statement.as_str())
            .collect();
        let mut content = serde_json::json!({"answers": answers, "sensor": resolved});
        for (variable, value) in self.variables.iter().zip(&written) {
            if variable.key.is_none() {
                content["conditions"][&variable.name] = serde_json::Value::from(*value);
            }
        }
        if let Some(hash) = &self.table_hash {
            content["table"] = serde_json::Value::from(hash.as_str());
        }
        content.to_string()
    }
}

/// A sensor file in SI: quantities as dimension and number, keys sorted.
fn resolved(item: &toml_edit::Item) -> serde_json::Value {
    use serde_json::Value as Json;
    if let Some(table) = item.as_table_like() {
        let sorted: BTreeMap<&str, Json> = table
            .iter()
            .map(|(key, inner)| (key, resolved(inner)))
            .collect();
        let pairs = sorted.into_iter().map(|(key, json)| (key.to_owned(), json));
        return Json::Object(pairs.collect());
    }
    if let Some(tables) = item.as_array_of_tables() {
        let list = tables
            .iter()
            .map(|table| resolved(&toml_edit::Item::Table(table.clone())));
        return Json::Array(list.collect());
    }
    match item.as_value() {
        Some(Value::String(text)) => match quantity_of(text.value()) {
            Some((dimension, _, si)) => Json::from(format!("{} {}", si, dimension.si)),
            None => Json::from(text.value().as_str()),
        },
        Some(Value::Integer(whole)) => Json::from(*whole.value()),
        Some(Value::Float(number)) => Json::from(*number.value()),
        Some(Value::Boolean(flag)) => Json::from(*flag.value()),
        Some(Value::Array(list)) => {
            let items = list.iter();
            let items = items.map(|one| resolved(&toml_edit::Item::Value(one.clone())));
            Json::Array(items.collect())
        }
        _ => Json::Null,
    }
}

/// The keys that a misspelt one may have meant.
fn near(key: &str, base: &DocumentMut) -> String {
    format!("the nearest are: {}", nearest(key, &paths(base)).join(", "))
}

impl Reader<'_> {
    fn path(&self, at: &[&str], key: &str, base: &DocumentMut) -> Result<KeyPath, InputError> {
        let sensor = &self.written.sensor;
        let wrong = || {
            let message = format!("\"{key}\" is no key of the sensor file {sensor}");
            self.at(at, &message, &near(key, base))
        };
        let path = KeyPath::parse(key).ok_or_else(wrong)?;
        if let Some((list, count)) = path.beyond(base) {
            let message = format!("{list} has {count} values in the sensor file {sensor}");
            let help = format!("give [0] to [{}]", count - 1);
            return Err(self.at(at, &message, &help));
        }
        // A key that is not there may be an optional one: its table must be.
        let mut trial = base.clone();
        if path.find(base).is_none() && !path.set(&mut trial, &Value::from(0)) {
            return Err(wrong());
        }
        Ok(path)
    }

    /// A spread of a key of which the sensor file has no number, which is most often misspelt.
    fn nothing_drawn(&self, name: &str, base: &DocumentMut) -> InputError {
        let key = self.written.variables[name].key.as_deref();
        let key = key.unwrap_or_default();
        let message = format!(
            "the sensor file {} has no number at \"{key}\" that could spread",
            self.written.sensor
        );
        let help = format!("{}; or give range = [least, greatest]", near(key, base));
        self.at(&["variables", name, "key"], &message, &help)
    }

    fn apply_set(&self, base: &mut DocumentMut) -> Result<(), InputError> {
        for key in self.keys(&["set"]) {
            let path = self.path(&["set", &key], &key, base)?;
            let item = self.order.get("set").and_then(|set| set.get(&key));
            if let Some(value) = item.and_then(|item| item.as_value()) {
                let mut value = value.clone();
                value.decor_mut().clear();
                path.set(base, &value);
            }
        }
        Ok(())
    }

    fn variables(
        &self,
        base: &mut DocumentMut,
        lists: &[(&str, usize)],
    ) -> Result<Vec<Variable>, InputError> {
        let names = self.keys(&["variables"]);
        if names.len() > MOST_VARIABLES {
            let message = format!(
                "{} variables; at most {MOST_VARIABLES} are varied",
                names.len()
            );
            return Err(self.at(&["variables"], &message, "set the others with [set]"));
        }
        let mut variables = Vec::with_capacity(names.len());
        for name in &names {
            let one = self.variable(name, base)?;
            match self.written.variables[name].each {
                EachFile::Device => variables.push(one),
                EachFile::Taxel => variables.extend(self.capacitors(&one, base, lists)?),
            }
        }
        Ok(variables)
    }

    /// A variable for each capacitor of a taxel; where the sensor file has one value for all of
    /// them, `base` gets a list.
    fn capacitors(
        &self,
        all: &Variable,
        base: &mut DocumentMut,
        lists: &[(&str, usize)],
    ) -> Result<Vec<Variable>, InputError> {
        let path = ["variables", all.name.as_str(), "each"];
        if all.spread.is_none() || all.values.varies() {
            let message = "what differs from taxel to taxel has a spread, and no range or values";
            let help = "leave range and values out and give spread, or leave each out";
            return Err(self.at(&path, message, help));
        }
        let key = all.key.as_ref();
        let known = lists
            .iter()
            .find(|(list, _)| key.is_some_and(|key| *list == key.text));
        let value = key.and_then(|key| key.find(base)?.as_value().cloned());
        let (Some(key), Some((_, count)), Some(value)) = (key, known, value) else {
            let names: Vec<&str> = lists.iter().map(|(key, _)| *key).collect();
            let text = key.map_or(all.name.as_str(), |key| &key.text);
            let message = format!("\"{text}\" has one value for all taxels");
            let help = if names.is_empty() {
                String::from("leave each out: the sensor file has no values of single taxels")
            } else {
                format!(
                    "leave each out; values of their own have: {}",
                    names.join(", ")
                )
            };
            return Err(self.at(&path, &message, &help));
        };
        key.set(base, &Value::from_iter(vec![value; *count]));
        let one = |index: usize| Variable {
            name: format!("{}[{index}]", all.name),
            key: Some(key.at(index)),
            ..all.clone()
        };
        Ok((0..*count).map(one).collect())
    }

    fn variable(&self, name: &str, base: &DocumentMut) -> Result<Variable, InputError> {
        let written = &self.written.variables[name];
        let at = |key: &str, message: &str, help: &str| {
            Err(self.at(&["variables", name, key], message, help))
        };
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !name.chars().all(plain) || name.starts_with(|c: char| c.is_ascii_digit()) {
            let help = "use letters, digits and _, a letter first";
            return Err(self.at(
                &["variables", name],
                "this name cannot stand in an expression",
                help,
            ));
        }
        let path = |key: &String| self.path(&["variables", name, "key"], key, base);
        let key = written.key.as_ref().map(path).transpose()?;
        let drawn = key.as_ref().and_then(|key| key.number(base));
        let form = |key: &Option<KeyPath>| key.as_ref().and_then(|key| key.form(base));
        if let (None, None, None) = (&written.range, &written.values, &written.spread)
            && let Some(variable) = key
                .as_ref()
                .and_then(|key| self.of_material(name, key, base))
        {
            return Ok(variable);
        }
        let values = match (&written.range, &written.values) {
            (Some(_), Some(_)) => {
                return at(
                    "values",
                    "range and values are both given",
                    "give one of them",
                );
            }
            (Some(ends), None) => self.range(name, ends, written.scale)?,
            (None, Some(values)) => self.list(name, values)?,
            (None, None) if key.is_none() => {
                let message = "a condition without a key has a range or values";
                return Err(self.at(&["variables", name], message, "give key, range or values"));
            }
            (None, None) => match (form(&key), &written.spread) {
                (Some(form), Some(_)) => Values::Drawn(form),
                (None, Some(_)) => return Err(self.nothing_drawn(name, base)),
                (_, None) => {
                    return at(
                        "key",
                        "neither range nor values are given",
                        "give range = [least, greatest]",
                    );
                }
            },
        };
        if let (Some(given), Some(form)) = (values.form(), form(&key))
            && exponents_of(given) != exponents_of(form)
        {
            let list = if written.range.is_some() {
                "range"
            } else {
                "values"
            };
            let needed = exponents_of(form).name();
            let message = format!(
                "this is {}; {needed} is needed here",
                exponents_of(given).name()
            );
            return at(list, &message, &format!("give {needed}"));
        }
        let points = written.points.unwrap_or(5);
        if !(2..=1000).contains(&points) {
            let message = format!("points = {points} is not between 2 and 1000");
            return at("points", &message, "give 2 to 1000");
        }
        let spread = match &written.spread {
            None => None,
            Some(_) if key.is_none() => {
                let message = "a condition without a key is not made, and does not spread";
                return at("spread", message, "leave spread out, or give key");
            }
            Some(spread) => {
                let Some(form) = values.form() else {
                    return at("spread", "words do not spread", "leave spread out");
                };
                let found = Spread::read(spread, exponents_of(form));
                Some(found.map_err(|message| {
                    let help = "such as spread = { uniform = \"3.5 %\" }";
                    let path = ["variables", name, "spread", spread.key()];
                    self.at(&path, &message, help)
                })?)
            }
        };
        Ok(Variable {
            name: name.to_owned(),
            key,
            values,
            points,
            drawn,
            spread,
            process: name.to_owned(),
        })
    }

    /// The modulus of the material that a key names, with the spread that its interval leaves.
    fn of_material(&self, name: &str, key: &KeyPath, base: &DocumentMut) -> Option<Variable> {
        let used = taxel_material::used(&self.written.sensor, &base.to_string()).ok()?;
        let used = used.into_iter().find(|used| used.key == key.dotted())?;
        let [median, width] = used.material.scatter()?;
        let law = &used.material.law;
        let modulus = if used.key.ends_with("shear_modulus") {
            law.shear_modulus()
        } else {
            law.youngs_modulus()
        };
        Some(Variable {
            name: name.to_owned(),
            key: Some(key.clone()),
            values: Values::Drawn(Form::Quantity(&STRESS, STRESS.si)),
            points: 0,
            drawn: Some(modulus),
            spread: Some(Spread {
                shape: Shape::Lognormal { median },
                size: width,
                relative: true,
            }),
            process: name.to_owned(),
        })
    }

    fn range(&self, name: &str, ends: &[Bound; 2], scale: ScaleFile) -> Result<Values, InputError> {
        let path = ["variables", name, "range"];
        let (Some((low, form)), Some((high, other))) = (number_of(&ends[0]), number_of(&ends[1]))
        else {
            let help = "write range = [\"20 um\", \"100 um\"]; words go into values";
            return Err(self.at(&path, "a range has numbers", help));
        };
        if exponents_of(form) != exponents_of(other) {
            let message = format!(
                "the ends are {} and {}",
                exponents_of(form).name(),
                exponents_of(other).name()
            );
            return Err(self.at(&path, &message, "give both ends the same dimension"));
        }
        if !(low < high && low.is_finite() && high.is_finite()) {
            let help = "give the least value first, then a greater one";
            return Err(self.at(&path, "the range is empty", help));
        }
        let logarithmic = scale == ScaleFile::Log;
        if logarithmic && low <= 0.0 {
            let help = "begin above zero, or leave scale out";
            return Err(self.at(&path, "a logarithmic range begins above zero", help));
        }
        let form = match (form, other) {
            (Form::Whole, Form::Number) => Form::Number,
            _ => form,
        };
        Ok(Values::Range {
            ends: [low, high],
            logarithmic,
            form,
        })
    }

    fn list(&self, name: &str, values: &[Bound]) -> Result<Values, InputError> {
        let path = ["variables", name, "values"];
        let Some(first) = values.first() else {
            return Err(self.at(&path, "the list is empty", "give at least one value"));
        };
        let Some((_, form)) = number_of(first) else {
            let word = |bound: &Bound| match bound {
                Bound::Text(text) if number_of(bound).is_none() => Some(Value::from(text.as_str())),
                Bound::Flag(flag) => Some(Value::from(*flag)),
                _ => None,
            };
            let words: Option<Vec<Value>> = values.iter().map(word).collect();
            return words.map(Values::Words).ok_or_else(|| {
                self.at(
                    &path,
                    "words and numbers are mixed",
                    "give words only, or numbers only",
                )
            });
        };
        let mut numbers = Vec::new();
        let mut all = form;
        for bound in values {
            match number_of(bound) {
                Some((si, other)) if exponents_of(other) == exponents_of(form) => {
                    if other == Form::Number {
                        all = Form::Number;
                    }
                    numbers.push(si);
                }
                _ => {
                    let help = "give all values the same dimension";
                    return Err(self.at(&path, "the values differ in dimension", help));
                }
            }
        }
        Ok(Values::Numbers(numbers, all))
    }

    /// Links in an order in which each follows from those before.
    fn links(&self, base: &DocumentMut, variables: &[Variable]) -> Result<Vec<Link>, InputError> {
        let mut waiting = self.keys(&["links"]);
        for key in &waiting {
            let is_key = |one: &&Variable| one.key.as_ref().is_some_and(|own| own.text == *key);
            if let Some(variable) = variables.iter().find(is_key) {
                let message = format!("this key is the variable {}", variable.name);
                return Err(self.at(&["links", key], &message, "link another key"));
            }
        }
        let all = waiting.clone();
        let mut names: Vec<(String, Exponents)> = variables
            .iter()
            .map(|one| {
                (
                    one.name.clone(),
                    one.values.form().map_or(NONE, exponents_of),
                )
            })
            .collect();
        let mut links = Vec::new();
        while !waiting.is_empty() {
            let ready = waiting.iter().position(|key| {
                let used = names_in(&self.written.links[key]).unwrap_or_default();
                let waits = |name: &String| waiting.contains(name);
                !used
                    .iter()
                    .any(|(name, _)| all.contains(name) && waits(name))
            });
            let Some(ready) = ready else {
                let key = &waiting[0];
                let message = "these links follow from each other in a circle";
                let help = format!("break it at one of: {}", waiting.join(", "));
                return Err(self.at(&["links", key], message, &help));
            };
            let key = waiting.remove(ready);
            let link = self.link(&key, base, &names)?;
            names.push((key, link.expression.exponents));
            links.push(link);
        }
        Ok(links)
    }

    fn link(
        &self,
        key: &str,
        base: &DocumentMut,
        names: &[(String, Exponents)],
    ) -> Result<Link, InputError> {
        let at = ["links", key];
        let path = self.path(&at, key, base)?;
        let text = &self.written.links[key];
        let read = expression(text, names).map_err(|mistake| self.inside(&at, text, &mistake))?;
        let form = match path.form(base) {
            Some(form) => form,
            None => match read.exponents.dimension() {
                Some(dimension) => Form::Quantity(dimension, dimension.si),
                None => Form::Number,
            },
        };
        let needed = exponents_of(form);
        if read.exponents != needed {
            let message = format!(
                "the expression is {}; the key takes {}",
                read.exponents.name(),
                needed.name()
            );
            let whole = Mistake {
                span: 0..text.len(),
                message,
                help: format!("make it {}", needed.name()),
            };
            return Err(self.inside(&at, text, &whole));
        }
        Ok(Link {
            key: path,
            expression: read,
            form,
        })
    }

    /// Keys and units of what is set, varied and linked, by reading the sensor file with each
    /// value in turn: its own message, under the word of the study.
    fn check_keys(&self, study: &Study) -> Result<(), InputError> {
        let told = |at: &[&str], error: &InputError| {
            let message = format!("{}: {}", error.key, error.message);
            self.at(at, &message, &error.help)
        };
        let set = self.keys(&["set"]);
        let mut base = study.base.clone();
        // Paths that are set are checked together: a table may need several of them.
        if let Err(error) = Sensor::drawn(&study.sensor, &base.to_string()) {
            let of = |key: &String| {
                KeyPath::parse(key).is_some_and(|path| error.key.starts_with(&path.dotted()))
            };
            let key = set.iter().find(|key| of(key)).or(set.first());
            return Err(match key {
                Some(key) => told(&["set", key], &error),
                None => error,
            });
        }
        for variable in &study.variables {
            let ends = match &variable.values {
                Values::Range { ends, .. } => ends.to_vec(),
                Values::Numbers(values, _) => values.clone(),
                Values::Words(words) => (0..words.len()).map(|i| i as f64).collect(),
                Values::Drawn(_) => Vec::new(),
            };
            for value in ends {
                base.clone_from(&study.base);
                let Some(key) = &variable.key else {
                    continue;
                };
                key.set(&mut base, &variable.values.write(value).0);
                if let Err(error) = Sensor::drawn(&study.sensor, &base.to_string()) {
                    let list = if matches!(variable.values, Values::Range { .. }) {
                        "range"
                    } else {
                        "values"
                    };
                    let of_key = error.message.starts_with("unknown field");
                    let word = if of_key { "key" } else { list };
                    return Err(told(&["variables", &variable.name, word], &error));
                }
            }
        }
        let (text, _) = study.text_of(&study.nominal());
        if let Err(error) = Sensor::drawn(&study.sensor, &text)
            && let Some(link) = study
                .links
                .iter()
                .find(|link| error.key.starts_with(&link.key.dotted()))
            && !error.message.contains("out of range")
        {
            return Err(told(&["links", &link.key.text], &error));
        }
        Ok(())
    }

    fn answers(&self, nominal: &Sensor, variables: &[Variable]) -> Result<Vec<Answer>, InputError> {
        let names = self.keys(&["answers"]);
        let named: Vec<Named<'_>> = variables.iter().map(Variable::named).collect();
        let (mut answers, mut mistakes) = (Vec::new(), Vec::new());
        for name in names {
            if self.written.variables.contains_key(&name) {
                let message = "a variable has this name";
                let help = "give the answer another name";
                mistakes.push(self.at(&["answers", &name], message, help));
                continue;
            }
            match Answer::read(&name, &self.written.answers[&name], nominal, &named) {
                Ok(answer) => answers.push(answer),
                Err(wrong) => {
                    let key = ["answers", &name, wrong.key];
                    mistakes.push(self.at(&key, &wrong.message, &wrong.help));
                }
            }
        }
        if let Some(mistakes) = InputError::joined(mistakes) {
            return Err(mistakes);
        }
        for (index, variable) in variables.iter().enumerate() {
            let used = || answers.iter().any(|answer| answer.uses(index));
            if variable.key.is_none() && !used() {
                let message = "this variable has no key, and no answer names it";
                let help = format!(
                    "give key, or write such as pressure = \"{}\" in an answer",
                    variable.name
                );
                return Err(self.at(&["variables", &variable.name], message, &help));
            }
        }
        Ok(answers)
    }

    fn constraints(
        &self,
        names: &[(String, Exponents)],
    ) -> Result<Vec<(String, Comparison)>, InputError> {
        let read = |name: String| {
            let text = &self.written.constraints[&name];
            let at = ["constraints", name.as_str()];
            let read =
                comparison(text, names).map_err(|mistake| self.inside(&at, text, &mistake))?;
            Ok((name, read))
        };
        self.keys(&["constraints"]).into_iter().map(read).collect()
    }

    fn objectives(
        &self,
        names: &[(String, Exponents)],
        study: &Study,
    ) -> Result<Vec<Objective>, InputError> {
        let mut objectives = Vec::new();
        let lists = [
            ("minimise", 1.0, &self.written.objectives.minimise),
            ("maximise", -1.0, &self.written.objectives.maximise),
        ];
        for (list, sign, texts) in lists {
            for (index, text) in texts.iter().enumerate() {
                let number = index.to_string();
                let at = ["objectives", list, number.as_str()];
                let read =
                    expression(text, names).map_err(|mistake| self.inside(&at, text, &mistake))?;
                let used = names_in(text).unwrap_or_default();
                let is_word = |name: &str| {
                    let of_answer = study.answers.iter().any(|one| one.name == name && one.word);
                    let words = |one: &&Variable| one.name == name;
                    let variable = study.variables.iter().find(words);
                    of_answer || variable.is_some_and(|one| one.values.form().is_none())
                };
                if let Some((name, span)) = used.iter().find(|(name, _)| is_word(name)) {
                    let mistake = Mistake {
                        span: span.clone(),
                        message: format!("{name} is a word; an objective is a number"),
                        help: String::from("name an answer that is a number"),
                    };
                    return Err(self.inside(&at, text, &mistake));
                }
                objectives.push(Objective {
                    name: text.clone(),
                    sign,
                    expression: read,
                });
            }
        }
        Ok(objectives)
    }

    fn limits(&self, study: &Study) -> Result<Vec<(usize, Limit)>, InputError> {
        let mut limits = Vec::new();
        for name in self.keys(&["tolerance", "limits"]) {
            let at = ["tolerance", "limits", name.as_str()];
            let index = study.answers.iter().position(|one| one.name == name);
            let Some(index) = index else {
                let known: Vec<&str> = study.answers.iter().map(|one| one.name.as_str()).collect();
                let all = format!("answers: {}", known.join(", "));
                let help = advice(&name, known, &all);
                return Err(self.at(&at, "this is no answer", &help));
            };
            let answer = &study.answers[index];
            if answer.word {
                return Err(self.at(&at, "this answer is a word", "limit a number"));
            }
            let exponents = Exponents::of_key(answer.column.si).unwrap_or(NONE);
            let limit = Limit::read(&self.written.tolerance.limits[&name], exponents).map_err(
                |(key, message)| {
                    let path: Vec<&str> = at.into_iter().chain(key).collect();
                    self.at(&path, &message, "such as { within = \"5 %\" }")
                },
            )?;
            limits.push((index, limit));
        }
        for (first, second, coefficient) in &self.written.tolerance.correlation {
            let at = ["tolerance", "correlation"];
            for name in [first, second] {
                let spreads = |one: &&Variable| one.process == *name && one.spread.is_some();
                if !study.variables.iter().any(|one| spreads(&one)) {
                    let message = format!("\"{name}\" is no variable with a spread");
                    return Err(self.at(&at, &message, "name two variables with spreads"));
                }
            }
            if !(-1.0..1.0).contains(coefficient) || *coefficient == -1.0 || first == second {
                let help = "give two names and a coefficient between -1 and 1";
                return Err(self.at(&at, "this correlation has no meaning", help));
            }
        }
        Ok(limits)
    }

    fn check_options(&self, study: &Study) -> Result<(), InputError> {
        let between = |path: &[&str], value: usize, [low, high]: [usize; 2]| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let message = format!("{value} is not between {low} and {high}");
            Err(self.at(path, &message, &format!("give {low} to {high}")))
        };
        between(&["sweep", "points"], study.sweep.points, [1, 1_000_000])?;
        let evaluations = study.optimize.evaluations;
        between(&["optimize", "evaluations"], evaluations, [10, 10_000_000])?;
        between(
            &["optimize", "population"],
            study.optimize.population,
            [8, 10_000],
        )?;
        between(
            &["tolerance", "samples"],
            study.tolerance.samples,
            [16, 1_000_000],
        )?;
        let plan = study.sweep.plan.as_str();
        let known = ["grid", "latin_hypercube", "sobol"];
        if !known.contains(&plan) && !study.sweep.is_list() {
            let message = format!("there is no plan \"{plan}\"");
            let all = format!(
                "use one of: {}, or name a table of designs (.csv)",
                known.join(", ")
            );
            let help = advice(plan, known, &all);
            return Err(self.at(&["sweep", "plan"], &message, &help));
        }
        for name in study.sweep.columns.iter().flatten() {
            let variables = study.variables.iter().map(|one| one.name.as_str());
            let answers = study.answers.iter().map(|one| one.name.as_str());
            let names = variables.chain(answers).chain(["status", "reason"]);
            let names: Vec<&str> = names.collect();
            if !names.contains(&name.as_str()) {
                let message = format!("the table of a sweep has no column \"{name}\"");
                let all = format!("use some of: {}", names.join(", "));
                let help = advice(name, names, &all);
                return Err(self.at(&["sweep", "columns"], &message, &help));
            }
        }
        if study.answers.is_empty() && study.place.is_none() {
            let help = "add [answers.NAME] with of and quantity";
            return Err(self.at(&["answers"], "nothing is asked of the designs", help));
        }
        Ok(())
    }
}
