//! Tables of loads: CSV with units in the header; and one load of the command
//! line.

use rayon::prelude::*;

use super::{Load, LoadColumn, LoadKind, LoadValue, Source};
use crate::InputError;
use crate::quantity::HELP;
use crate::words::advice;

/// Loads that are read without leaving the thread: fewer than it takes longer to ask others.
const FEW: usize = 4096;

/// A table of loads with all its columns, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Columns that the table names.
    pub given: Given,
    /// Number of loads.
    count: usize,
    /// Line of each load in the file, from 1; none of loads that are in no file.
    lines: Vec<usize>,
    /// Values of each load column of the device.
    columns: Vec<Values>,
    /// Fields of the other columns, load after load.
    others: Vec<String>,
}

/// Values of one load column. A million loads of a program stay as small as it gave them.
#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// The same for all loads; none of a column that is not given.
    All(Option<LoadValue>),
    /// A number for each load, SI.
    Numbers(Vec<f64>),
    /// A value or none for each load.
    Each(Vec<Option<LoadValue>>),
}

impl Values {
    #[inline]
    fn at(&self, load: usize) -> Option<LoadValue> {
        match self {
            Self::All(value) => *value,
            Self::Numbers(numbers) => Some(LoadValue::Number(numbers[load])),
            Self::Each(values) => values[load],
        }
    }
}

/// Columns that a table of loads names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Given {
    /// For each load column of the device whether it is there.
    pub columns: Vec<bool>,
    /// Titles of the other columns.
    pub others: Vec<String>,
}

impl Loads {
    /// Reads a table; `file` is its name for messages. Columns that are none
    /// of `columns` are kept and passed on.
    ///
    /// # Errors
    /// The first mistake, with its line and column.
    ///
    /// # Example
    /// ```
    /// # let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let predictor = sensor.device().unwrap().predictor().unwrap();
    /// let text = "name,force_x [mN],force_y [mN],force_z [mN]\npress,0,0,5\n";
    /// let loads = taxel::predict::Loads::parse("loads.csv", text, predictor.load_columns())?;
    /// assert_eq!(loads.given.others, ["name"]);
    /// assert_eq!(loads.others(0), ["press"]);
    /// # Ok::<(), taxel::InputError>(())
    /// ```
    pub fn parse(file: &str, text: &str, columns: &[LoadColumn]) -> Result<Self, InputError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            // Fields are trimmed where they are read, which copies nothing.
            .trim(csv::Trim::Headers)
            .from_reader(text.as_bytes());
        let header: Vec<String> = match reader.headers() {
            Ok(header) => header.iter().map(str::to_owned).collect(),
            Err(error) => return Err(InputError::whole(file, error.to_string())),
        };
        let places = find_columns(file, text, &header, columns)?;
        let given = Given::new(&header, &places, columns.len());
        let lines = text.bytes().filter(|byte| *byte == b'\n').count();
        let mut loads = Self {
            count: 0,
            lines: Vec::with_capacity(lines),
            columns: vec![Values::All(None); columns.len()],
            others: Vec::with_capacity(lines * given.others.len()),
            given,
        };
        for place in places.iter().flatten() {
            loads.columns[place.load] = Values::Each(Vec::with_capacity(lines));
        }
        let mut record = csv::StringRecord::new();
        while reader
            .read_record(&mut record)
            .map_err(|error| InputError::whole(file, error.to_string()))?
        {
            let line = record.position().map_or(0, csv::Position::line) as usize;
            let row = Row {
                file,
                text,
                line,
                header: &header,
            };
            if record.len() != header.len() {
                let message = format!(
                    "this row has {} fields; the header has {}",
                    record.len(),
                    header.len()
                );
                return Err(row.error(0, &message));
            }
            row.read(&record, columns, &places, &mut loads)?;
        }
        if loads.is_empty() {
            return Err(InputError::whole(file, "the table has no loads")
                .help("add one row per load below the header"));
        }
        Ok(loads)
    }

    /// One load of the command line, such as `"fx=1 mN, fz=5 mN"`.
    ///
    /// # Errors
    /// The mistake, as an error of the "file" `--load`.
    pub fn one(spec: &str, columns: &[LoadColumn]) -> Result<Self, InputError> {
        let values = one_load(spec, columns)?;
        Ok(Self {
            given: Given {
                columns: values.iter().map(Option::is_some).collect(),
                others: Vec::new(),
            },
            count: 1,
            lines: Vec::new(),
            columns: values.into_iter().map(Values::All).collect(),
            others: Vec::new(),
        })
    }

    /// Loads that a program gives, by the names of their columns; `name` stands for a file in
    /// messages. Values that are given once hold for all loads.
    ///
    /// # Errors
    /// The first mistake: a name or value that the device does not take, or columns of different
    /// lengths.
    ///
    /// # Example
    /// ```
    /// use taxel::predict::{GivenValues, Loads};
    /// # let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
    /// let predictor = sensor.device().unwrap().predictor().unwrap();
    /// let given = [("fx", GivenValues::Text("1 mN")), ("fz", GivenValues::Numbers(&[0.0, 5e-3]))];
    /// let loads = Loads::of_values("load", &given, predictor.load_columns())?;
    /// assert_eq!(loads.len(), 2);
    /// assert_eq!(loads.load(1).number(0), Some(1e-3));
    /// # Ok::<(), taxel::InputError>(())
    /// ```
    pub fn of_values(
        name: &str,
        given: &[(&str, GivenValues<'_>)],
        columns: &[LoadColumn],
    ) -> Result<Self, InputError> {
        let wrong = |key: &str, message: String, help: &str| {
            Err(InputError::whole(name, message).key(key).help(help))
        };
        let mut count = None;
        for (key, values) in given {
            match (values.len(), count) {
                (None, _) => {}
                (Some(0), _) => return wrong(key, "has no loads".into(), "give at least one"),
                (Some(length), Some((first, of))) if length != of => {
                    let message = format!("has {length} values; {first} has {of}");
                    return wrong(key, message, "give the same number of each, or one for all");
                }
                (Some(length), _) => count = Some((*key, length)),
            }
        }
        let count = count.map_or(1, |(_, count)| count);
        let width = columns.len();
        let mut loads = Self {
            given: Given {
                columns: vec![false; width],
                others: Vec::new(),
            },
            count,
            lines: Vec::new(),
            columns: vec![Values::All(None); width],
            others: Vec::new(),
        };
        for (key, values) in given {
            let found = columns
                .iter()
                .position(|column| column.name == *key || column.short == *key);
            let Some(index) = found else {
                let message = format!("\"{key}\" is no load of this device");
                let all = format!("names: {}", names(columns));
                return wrong(key, message, &advice(key, known(columns), &all));
            };
            if std::mem::replace(&mut loads.given.columns[index], true) {
                let message = format!("{} is given twice", columns[index].name);
                return wrong(key, message, "leave one of them out");
            }
            loads.columns[index] = values.read(columns[index].kind).map_err(|mistake| {
                let (message, help) = mistake
                    .message
                    .split_once(HELP)
                    .unwrap_or((&mistake.message, ""));
                let place = match values.len() {
                    Some(_) => format!("value {}: ", mistake.row),
                    None => String::new(),
                };
                let message = format!("{place}{}", message.trim_end());
                InputError::whole(name, message).key(*key).help(help.trim())
            })?;
        }
        Ok(loads)
    }

    /// Number of loads.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there is no load.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A load.
    ///
    /// # Panics
    /// If `index` is not below [`Self::len`].
    pub fn load(&self, index: usize) -> Load<'_> {
        assert!(index < self.count, "load {index} of {}", self.count);
        Load(Source::Row(self, index))
    }

    /// The value of the load at `index` in this load column.
    #[inline]
    pub(super) fn value(&self, index: usize, column: usize) -> Option<LoadValue> {
        self.columns.get(column)?.at(index)
    }

    /// Number of load columns of the device.
    pub(super) fn width(&self) -> usize {
        self.columns.len()
    }

    /// Fields of the columns that are passed on.
    pub fn others(&self, index: usize) -> &[String] {
        let width = self.given.others.len();
        &self.others[index * width..(index + 1) * width]
    }

    /// Line of a load in its file, from 1; of loads that are in no file their number.
    pub fn line(&self, index: usize) -> usize {
        self.lines.get(index).copied().unwrap_or(index + 1)
    }
}

/// Values of one column of loads that a program gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GivenValues<'a> {
    /// A quantity with its unit, or a word, for all loads.
    Text(&'a str),
    /// The same, one for each load.
    Texts(&'a [String]),
    /// A number for all loads, SI.
    Number(f64),
    /// A number for each load, SI.
    Numbers(&'a [f64]),
}

impl GivenValues<'_> {
    /// Number of values; none of one that holds for all loads.
    fn len(&self) -> Option<usize> {
        match self {
            Self::Text(_) | Self::Number(_) => None,
            Self::Texts(texts) => Some(texts.len()),
            Self::Numbers(numbers) => Some(numbers.len()),
        }
    }

    fn read(&self, kind: LoadKind) -> Result<Values, Mistake> {
        let at = |row| move |message| Mistake { row, message };
        Ok(match self {
            Self::Text(text) => {
                let value = parse(kind, text.trim(), None);
                Values::All(Some(value.map_err(at(0))?))
            }
            Self::Number(number) => Values::All(Some(value_of(*number, kind).map_err(at(0))?)),
            Self::Texts(texts) => {
                let one = |(row, text): (usize, &String)| {
                    parse(kind, text.trim(), None).map(Some).map_err(at(row))
                };
                Values::Each(
                    texts
                        .iter()
                        .enumerate()
                        .map(one)
                        .collect::<Result<_, _>>()?,
                )
            }
            // A word is no number, unless one is written like it.
            Self::Numbers(numbers) if matches!(kind, LoadKind::Word(_)) => {
                let one = |(row, number): (usize, &f64)| {
                    value_of(*number, kind).map(Some).map_err(at(row))
                };
                Values::Each(
                    numbers
                        .iter()
                        .enumerate()
                        .map(one)
                        .collect::<Result<_, _>>()?,
                )
            }
            Self::Numbers(numbers) => {
                let wrong =
                    |(row, number): (usize, &f64)| Some((row, value_of(*number, kind).err()?));
                let first_wrong = |numbers: &[f64]| numbers.iter().enumerate().find_map(wrong);
                // Whole pieces are seldom wrong, and quickly compared.
                let pieces = numbers.par_chunks(FEW).enumerate();
                let found = pieces.find_map_first(|(piece, numbers)| {
                    if kind.all_within(numbers) {
                        return None;
                    }
                    first_wrong(numbers).map(|(row, message)| (piece * FEW + row, message))
                });
                if let Some((row, message)) = found {
                    return Err(Mistake { row, message });
                }
                // Fresh memory is filled by all cores, too.
                Values::Numbers(if numbers.len() > FEW {
                    numbers.par_iter().copied().collect()
                } else {
                    numbers.to_vec()
                })
            }
        })
    }
}

/// What is wrong in a column of values that a program gives.
struct Mistake {
    row: usize,
    message: String,
}

impl LoadKind {
    /// True if all of these are numbers that a load of this kind may have.
    fn all_within(self, numbers: &[f64]) -> bool {
        let [low, high] = match self {
            Self::Quantity(_, range) | Self::Number(range) => range,
            Self::Word(_) => return false,
        };
        // Counted, without an early end, the comparisons go side by side.
        let within = |number: &&f64| (low..=high).contains(*number);
        numbers.iter().filter(within).count() == numbers.len()
    }
}

/// A number of a program as a value of this kind.
#[inline]
fn value_of(number: f64, kind: LoadKind) -> Result<LoadValue, String> {
    let ([low, high], unit) = match kind {
        LoadKind::Quantity(dimension, range) => (range, dimension.si),
        LoadKind::Number(range) => (range, ""),
        // It says which words there are.
        LoadKind::Word(_) => return parse(kind, &number.to_string(), None),
    };
    if (low..=high).contains(&number) {
        return Ok(LoadValue::Number(number));
    }
    let unit = if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    };
    Err(format!(
        "{number} is out of range: must be from {low} to {high}{unit}{HELP}correct or remove it"
    ))
}

impl Given {
    fn new(header: &[String], places: &[Option<Found>], columns: usize) -> Self {
        let there = |load| places.iter().flatten().any(|place| place.load == load);
        let titles = header.iter().zip(places);
        Self {
            columns: (0..columns).map(there).collect(),
            others: titles
                .filter(|(_, place)| place.is_none())
                .map(|(title, _)| title.clone())
                .collect(),
        }
    }
}

/// Values of the load that `spec` names.
fn one_load(spec: &str, columns: &[LoadColumn]) -> Result<Vec<Option<LoadValue>>, InputError> {
    let mut values = vec![None; columns.len()];
    let form = format!(
        "write names with values and units, such as \"{}\"; names: {}",
        example(columns),
        names(columns)
    );
    let mut at = 0;
    for part in spec.split(',') {
        let span = at + part.len() - part.trim_start().len()..at + part.trim_end().len();
        at += part.len() + 1;
        let error = |message: String, help: &str| {
            InputError::at("--load", spec, span.clone(), message).help(help)
        };
        let Some((name, value)) = part.split_once('=') else {
            let message = format!("\"{}\" has no value", part.trim());
            return Err(error(message, &form));
        };
        let name = name.trim();
        let found = columns
            .iter()
            .position(|column| column.name == name || column.short == name);
        let Some(index) = found else {
            let message = format!("\"{name}\" is no load of this device");
            return Err(error(message, &advice(name, known(columns), &form)));
        };
        let parsed = parse(columns[index].kind, value.trim(), None).map_err(|message| {
            let (message, help) = message.split_once(HELP).unwrap_or((&message, &form));
            error(message.trim_end().into(), help.trim())
        })?;
        if values[index].replace(parsed).is_some() {
            return Err(error(format!("{name} is given twice"), &form));
        }
    }
    Ok(values)
}

/// Names that a load may have.
fn known(columns: &[LoadColumn]) -> impl Iterator<Item = &'static str> {
    columns
        .iter()
        .flat_map(|column| [column.name, column.short])
}

fn names(columns: &[LoadColumn]) -> String {
    let all: Vec<_> = columns
        .iter()
        .map(|column| format!("{} ({})", column.short, column.about))
        .collect();
    all.join(", ")
}

fn example(columns: &[LoadColumn]) -> String {
    columns.first().map_or(String::new(), |column| {
        let value = match column.kind {
            LoadKind::Quantity(dimension, _) => format!("1 {}", dimension.si),
            LoadKind::Number(_) => String::from("1"),
            LoadKind::Word(words) => words.first().copied().unwrap_or("").to_owned(),
        };
        format!("{}={value}", column.short)
    })
}

/// Reads a value; `unit` is the unit in a column's title, or none where the
/// text carries its own unit.
fn parse(kind: LoadKind, text: &str, unit: Option<Unit>) -> Result<LoadValue, String> {
    let number = || {
        let value: Option<f64> = text.parse().ok();
        value.ok_or_else(|| {
            format!(
                "\"{text}\" is not a number{HELP}write numbers with a decimal point, such as 1.5"
            )
        })
    };
    let within = |value: f64, [low, high]: [f64; 2], unit: &str| {
        if (low..=high).contains(&value) {
            return Ok(LoadValue::Number(value));
        }
        Err(format!(
            "{text} is out of range: must be from {low} to {high}{}{unit}{HELP}correct or remove it",
            if unit.is_empty() { "" } else { " " }
        ))
    };
    match kind {
        LoadKind::Word(words) => words
            .iter()
            .position(|word| *word == text)
            .map(LoadValue::Word)
            .ok_or_else(|| {
                format!(
                    "\"{text}\" is not one of the words{HELP}use one of: {}",
                    words.join(", ")
                )
            }),
        LoadKind::Number(range) => within(number()?, range, ""),
        LoadKind::Quantity(dimension, range) => {
            let value = match unit {
                Some(Unit::Part(parts)) => number()? / parts,
                Some(Unit::Multiple(unit)) => number()? * unit,
                None => dimension.read(text)?,
            };
            within(value, range, dimension.si)
        }
    }
}

/// A column of the file.
#[derive(Debug, Clone, Copy)]
struct Found {
    /// Index among the device's load columns.
    load: usize,
    /// Its unit.
    unit: Option<Unit>,
}

/// The unit of a column.
#[derive(Debug, Clone, Copy)]
enum Unit {
    /// So many of it are an SI unit: dividing by a whole number is exact where
    /// multiplying by its reciprocal is not.
    Part(f64),
    /// It is so many SI units.
    Multiple(f64),
}

impl Unit {
    /// The unit of the SI value `scale`.
    fn new(scale: f64) -> Self {
        if scale < 1.0 {
            Self::Part((1.0 / scale).round())
        } else {
            Self::Multiple(scale)
        }
    }
}

/// For each column of the file the load column that it is, if it is one.
fn find_columns(
    file: &str,
    text: &str,
    header: &[String],
    columns: &[LoadColumn],
) -> Result<Vec<Option<Found>>, InputError> {
    let row = Row {
        file,
        text,
        line: 1,
        header,
    };
    let mut places: Vec<Option<Found>> = Vec::new();
    for (at, title) in header.iter().enumerate() {
        let (name, unit) = split_title(title);
        let Some(load) = columns.iter().position(|column| column.name == name) else {
            places.push(None);
            continue;
        };
        if places.iter().flatten().any(|place| place.load == load) {
            return Err(row.error(at, "this column appears twice"));
        }
        let unit = match (columns[load].kind, unit) {
            (LoadKind::Quantity(dimension, _), None) => {
                return Err(row.error(at, "this column has no unit").help(format!(
                    "write {name} [{}]; units: {}",
                    dimension.si,
                    dimension.symbols()
                )));
            }
            (LoadKind::Quantity(dimension, _), Some(unit)) => {
                let Some(scale) = dimension.unit(unit) else {
                    let message = format!(
                        "\"{unit}\" is not a unit of {}",
                        dimension.name.trim_start_matches("a ")
                    );
                    return Err(row
                        .error(at, &message)
                        .help(format!("use one of: {}", dimension.symbols())));
                };
                Some(Unit::new(scale))
            }
            (_, Some(_)) => {
                return Err(row
                    .error(at, "this column has no unit")
                    .help(format!("write {name}")));
            }
            (_, None) => None,
        };
        places.push(Some(Found { load, unit }));
    }
    let there = |load: usize| places.iter().flatten().any(|place| place.load == load);
    let missing = columns
        .iter()
        .enumerate()
        .find(|(load, column)| column.required && !there(*load));
    let line = line_text(text, 1);
    let lacking = |name: &str, message: String| {
        let all: Vec<_> = columns.iter().map(LoadColumn::title).collect();
        InputError::on_line(file, 1, line, 1, 1, message)
            .key(name)
            .help(format!("columns of loads are: {}", all.join(", ")))
    };
    if let Some((_, column)) = missing {
        return Err(lacking(
            column.name,
            format!("column {} is missing", column.name),
        ));
    }
    if places.iter().all(Option::is_none) {
        return Err(lacking("", "no column of this table is a load".into()));
    }
    Ok(places)
}

impl LoadColumn {
    /// Title in a table, such as `force_z [N]`.
    pub fn title(&self) -> String {
        match self.kind {
            LoadKind::Quantity(dimension, _) => format!("{} [{}]", self.name, dimension.si),
            _ => self.name.to_owned(),
        }
    }
}

/// `force_x [mN]` to its name and unit.
fn split_title(title: &str) -> (&str, Option<&str>) {
    match title.split_once('[') {
        Some((name, rest)) => (
            name.trim(),
            rest.split_once(']').map(|(unit, _)| unit.trim()),
        ),
        None => (title.trim(), None),
    }
}

struct Row<'a> {
    file: &'a str,
    text: &'a str,
    line: usize,
    header: &'a [String],
}

impl Row<'_> {
    fn read(
        &self,
        record: &csv::StringRecord,
        columns: &[LoadColumn],
        places: &[Option<Found>],
        loads: &mut Loads,
    ) -> Result<(), InputError> {
        for (at, (field, place)) in record.iter().zip(places).enumerate() {
            let field = field.trim();
            match place {
                None => loads.others.push(field.to_owned()),
                Some(place) => {
                    // What a table leaves open is not given in this row.
                    let open = field.is_empty() && !columns[place.load].required;
                    let read = || parse(columns[place.load].kind, field, place.unit);
                    let value = (!open).then(read).transpose().map_err(|message| {
                        let (message, help) = message.split_once(HELP).unwrap_or((&message, ""));
                        self.error(at, message.trim_end()).help(help.trim())
                    })?;
                    if let Values::Each(values) = &mut loads.columns[place.load] {
                        values.push(value);
                    }
                }
            }
        }
        loads.lines.push(self.line);
        loads.count += 1;
        Ok(())
    }

    fn error(&self, column: usize, message: &str) -> InputError {
        let text = line_text(self.text, self.line);
        // Fields in quotes with commas would move the caret; then the whole
        // line is marked.
        let plain = !text.contains('"');
        let parts: Vec<&str> = text.split(',').collect();
        let (start, width) = match parts.get(column) {
            Some(part) if plain => {
                let before: usize = parts[..column].iter().map(|p| p.chars().count() + 1).sum();
                (before + 1, part.chars().count())
            }
            _ => (1, text.chars().count()),
        };
        let key = self.header.get(column).map_or("", String::as_str);
        InputError::on_line(self.file, self.line, text, start, width, message).key(key)
    }
}

fn line_text(text: &str, line: usize) -> &str {
    text.lines().nth(line.saturating_sub(1)).unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::FORCE;

    const COLUMNS: [LoadColumn; 3] = [
        column("force_x", "fx"),
        column("force_y", "fy"),
        column("force_z", "fz"),
    ];

    const fn column(name: &'static str, short: &'static str) -> LoadColumn {
        LoadColumn {
            name,
            short,
            kind: LoadKind::Quantity(&FORCE, [-1e3, 1e3]),
            required: true,
            about: "a force",
        }
    }

    fn error(text: &str) -> InputError {
        Loads::parse("loads.csv", text, &COLUMNS).unwrap_err()
    }

    #[test]
    fn mistakes_name_line_and_column() {
        let head = "force_x [mN],force_y [mN],force_z [mN]\n";
        let wrong = error(&format!("{head}0,0,1\n0,nan,1\n"));
        assert_eq!(
            (wrong.place.as_ref().unwrap().line, wrong.key.as_str()),
            (3, "force_y [mN]")
        );
        assert_eq!(wrong.place.unwrap().column, 3);
        assert!(
            error(&format!("{head}0,1\n"))
                .message
                .contains("2 fields; the header has 3")
        );
        assert!(
            error(&format!("{head}0,x,1\n"))
                .message
                .contains("\"x\" is not a number")
        );
        assert!(
            error(&format!("{head}0,0,1e9\n"))
                .message
                .contains("out of range")
        );
        assert!(error(head).message.contains("no loads"));
        assert!(
            error("force_x [mN],force_y [mN]\n")
                .message
                .contains("force_z is missing")
        );
        assert!(
            error("force_x [mm],force_y [mN],force_z [mN]\n")
                .help
                .contains("mN")
        );
        assert!(
            error("force_x,force_y [mN],force_z [mN]\n")
                .message
                .contains("no unit")
        );
        assert!(error("").message.contains("missing"));
    }

    #[test]
    fn one_load_of_the_command_line() {
        let loads = Loads::one("fz=5 mN, force_x = -1 uN", &COLUMNS).unwrap();
        assert_eq!(loads.given.columns, [true, false, true]);
        let load = loads.load(0);
        let forces = [0, 1, 2].map(|axis| load.number(axis));
        assert_eq!(forces, [Some(-1e-6), None, Some(5e-3)]);
        for wrong in [
            "",
            "fz",
            "fq=1 mN",
            "fz=1",
            "fz=1 mm",
            "fz=1 mN,fz=2 mN",
            "fz=1e9 N",
        ] {
            assert!(Loads::one(wrong, &COLUMNS).is_err(), "{wrong}");
        }
    }
}
