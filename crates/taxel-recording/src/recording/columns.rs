//! What the user says that columns are: `time=2[ms],value=3-18[kPa],ignore=1`.

use std::fmt::{self, Write as _};
use std::str::FromStr;

use super::lines::quote;
use super::units;
use crate::frame::{Quantity, SignalUnit};

/// Powers of ten from a unit of time to ns.
const TIMES: [(&[&str], i32); 4] = [
    (&["s", "sec", "secs", "second", "seconds"], 9),
    (
        &[
            "ms",
            "msec",
            "millis",
            "millisecond",
            "milliseconds",
            "milli",
        ],
        6,
    ),
    (
        &[
            "us",
            "µs",
            "μs",
            "usec",
            "micros",
            "microsecond",
            "microseconds",
        ],
        3,
    ),
    (
        &["ns", "nsec", "nanos", "nanosecond", "nanoseconds", "nano"],
        0,
    ),
];

/// Power of ten from a unit of time, in any of its usual spellings, to ns.
pub(crate) fn time_power(unit: &str) -> Option<i32> {
    let unit = unit.trim().to_lowercase();
    let found = TIMES.iter().find(|(names, _)| names.contains(&&*unit));
    found.map(|(_, power)| *power)
}

/// The unit whose power of ten to ns this is.
pub(crate) fn time_unit(power: i32) -> &'static str {
    let found = TIMES.iter().find(|(_, known)| *known == power);
    found.map_or("s", |(names, _)| names[0])
}

/// What the columns of a table, or the channels of a recording of another program, are taken
/// for, as `--columns` says it.
///
/// Items stand between commas: a role, `=`, and a column by its number from 1 on, by its name, or
/// a range of either (`3-18`, `r0c0..r3c3`), with a unit in brackets where it has one. An item
/// without a role has that of the item before it. What is not named keeps the role that it is
/// recognised by; where values are named, other columns are none.
///
/// | role | meaning |
/// |---|---|
/// | `time` | when the frame was read; unit s, ms, us or ns |
/// | `sequence` | running number |
/// | `value` | a reading; any unit that recordings know |
/// | `ignore` | not read |
/// | `rate` | no column: frames come at this rate, such as `rate=100 Hz` |
///
/// # Example
/// ```
/// use taxel_recording::Columns;
///
/// assert!("time=2[ms],value=1,3-5[kPa]".parse::<Columns>().is_ok());
/// ```
///
/// # Example: a role that means nothing is refused
/// ```
/// use taxel_recording::Columns;
///
/// let error = "times=2".parse::<Columns>().unwrap_err();
/// assert!(error.starts_with("`times` is no role"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Columns {
    entries: Vec<Entry>,
    /// Frames per second.
    rate: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    role: Role,
    which: Which,
    unit: Option<Unit>,
    text: String,
}

/// What a column is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Time,
    Sequence,
    Value,
    Ignore,
}

#[derive(Debug, Clone, PartialEq)]
enum Which {
    Numbers(usize, usize),
    Names(String, String),
}

/// The unit of a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Unit {
    /// 10^n ns.
    Time(i32),
    Value(SignalUnit),
}

impl FromStr for Columns {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut columns = Self::default();
        let mut role = None;
        for item in split(text) {
            let item = item.trim();
            let (said, which) = match item.split_once('=') {
                Some((said, which)) => (Some(said.trim()), which.trim()),
                None => (None, item),
            };
            if which.is_empty() {
                return Err(format!("{} names no column", quote(item)));
            }
            match said {
                Some("rate") => {
                    if columns.rate.replace(said_rate(which)?).is_some() {
                        return Err("the rate is given a second time".into());
                    }
                    role = None;
                    continue;
                }
                Some(said) => {
                    role = Some(match said {
                        "time" => Role::Time,
                        "sequence" => Role::Sequence,
                        "value" | "values" => Role::Value,
                        "ignore" => Role::Ignore,
                        _ => {
                            return Err(format!(
                                "{} is no role; use time, sequence, value, ignore or rate",
                                quote(said)
                            ));
                        }
                    });
                }
                None => {}
            }
            let role = role.ok_or_else(|| {
                format!(
                    "{} has no role; write time=, sequence=, value= or ignore= before it",
                    quote(item)
                )
            })?;
            columns.entries.push(Entry::of(role, which)?);
        }
        let is_time = |entry: &Entry| entry.role == Role::Time;
        if columns.rate.is_some() && columns.entries.iter().any(is_time) {
            return Err("a rate and a time contradict each other; give one of them".into());
        }
        Ok(columns)
    }
}

impl Entry {
    fn of(role: Role, text: &str) -> Result<Self, String> {
        let (which, unit) =
            bracketed(text, '[', ']').map_or((text, None), |(which, unit)| (which, Some(unit)));
        let unit = unit.map(|unit| match role {
            Role::Time => time_power(unit).map(Unit::Time).ok_or_else(|| {
                format!("{} is not a unit of time; use s, ms, us or ns", quote(unit))
            }),
            Role::Value => units::find(unit).map(Unit::Value).ok_or_else(|| {
                let all = units::list(|_| true);
                format!(
                    "{} is not a unit of a channel; use one of: {all}",
                    quote(unit)
                )
            }),
            Role::Sequence | Role::Ignore => Err(format!(
                "{}: only times and values have a unit",
                quote(text)
            )),
        });
        let number = |text: &str| text.trim().parse::<usize>().ok();
        let range = |(from, to): (&str, &str)| Some((number(from)?, number(to)?));
        let numbers = number(which)
            .map(|one| (one, one))
            .or_else(|| which.split_once('-').and_then(range))
            .or_else(|| which.split_once("..").and_then(range));
        let which = match (numbers, which.split_once("..")) {
            (Some((from, to)), _) if from == 0 || from > to => {
                let message = "columns are counted from 1, a range goes up";
                return Err(format!("{}: {message}", quote(text)));
            }
            (Some((from, to)), _) => Which::Numbers(from, to),
            (None, Some((from, to))) => Which::Names(from.trim().into(), to.trim().into()),
            (None, None) => Which::Names(which.into(), which.into()),
        };
        Ok(Self {
            role,
            which,
            unit: unit.transpose()?,
            text: text.to_owned(),
        })
    }
}

/// What was taken for what, in words.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Taken {
    /// The time: which column, its unit, and how that was decided.
    pub time: String,
    /// The running number.
    pub sequence: String,
    /// The readings, with their shape and unit.
    pub values: String,
    /// What is not read, and why.
    pub ignored: String,
}

impl fmt::Display for Taken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            time,
            sequence,
            values,
            ignored,
        } = self;
        write!(
            f,
            "time: {time}; sequence: {sequence}; values: {values}; ignored: {ignored}"
        )
    }
}

/// Readings in words: which, their shape where they have one, and their unit.
pub(crate) fn values_taken(
    which: &str,
    [rows, columns, each]: [usize; 3],
    unit: &SignalUnit,
) -> String {
    let shape = match (rows, columns, each) {
        (1, _, 1) => String::new(),
        (_, _, 1) => format!(", {rows} x {columns}"),
        _ => format!(", {rows} x {columns} x {each}"),
    };
    let symbol = match unit.quantity {
        Quantity::Raw => "raw numbers",
        _ => &unit.symbol,
    };
    format!("{which}{shape} in {symbol}")
}

/// A column with what was said of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Said {
    pub(crate) role: Option<Role>,
    pub(crate) unit: Option<Unit>,
}

impl Columns {
    /// True if nothing is said.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Frames per second, where they are said.
    pub(crate) fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// The same where the file itself has a rate and no times.
    pub(crate) fn at_rate(&self, rate: Option<f64>) -> Self {
        let is_time = |entry: &Entry| entry.role == Role::Time;
        let own = self.rate.is_some() || self.entries.iter().any(is_time);
        Self {
            entries: self.entries.clone(),
            rate: if own { self.rate } else { rate },
        }
    }

    /// What is said of columns that are called `names`.
    pub(crate) fn of(&self, names: &[&str]) -> Result<Vec<Said>, String> {
        let mut said = vec![Said::default(); names.len()];
        for entry in &self.entries {
            let (from, to) = entry.which.found(names).ok_or_else(|| {
                format!("there is no column {}; {}", quote(&entry.text), list(names))
            })?;
            for (at, one) in said.iter_mut().enumerate().take(to + 1).skip(from) {
                if one.role.replace(entry.role).is_some() {
                    let name = column_name(at, names[at]);
                    return Err(format!("{name} is named a second time"));
                }
                one.unit.clone_from(&entry.unit);
            }
        }
        for (role, name) in [(Role::Time, "time"), (Role::Sequence, "sequence")] {
            let named = said.iter().filter(|one| one.role == Some(role)).count();
            if named > 1 {
                return Err(format!("{named} columns are said to be the {name}"));
            }
        }
        Ok(said)
    }

    /// True if values are named, so that other columns are none.
    pub(crate) fn names_values(&self) -> bool {
        self.entries.iter().any(|entry| entry.role == Role::Value)
    }
}

impl Which {
    /// First and last index among `names`.
    fn found(&self, names: &[&str]) -> Option<(usize, usize)> {
        let (from, to) = match self {
            Self::Numbers(from, to) => (from - 1, to - 1),
            Self::Names(from, to) => {
                let place = |wanted: &String| {
                    let exact = names.iter().position(|name| name == wanted);
                    exact.or_else(|| names.iter().position(|name| split_unit(name).0 == wanted))
                };
                (place(from)?, place(to)?)
            }
        };
        (from <= to && to < names.len()).then_some((from, to))
    }
}

/// Name and unit of `time [s]` or `Time (ms)`.
pub(crate) fn split_unit(title: &str) -> (&str, Option<&str>) {
    let mut title = title.trim();
    // Names that come again have a number behind the unit: `X [s].1`.
    if let Some((name, number)) = title.rsplit_once("].")
        && number.bytes().all(|digit| digit.is_ascii_digit())
    {
        title = &title[..=name.len()];
    }
    bracketed(title, '[', ']')
        .or_else(|| bracketed(title, '(', ')'))
        .map_or((title, None), |(name, unit)| (name, Some(unit)))
}

/// Name and unit of `time [s]`; an index such as that of `cells[3]` is no unit.
fn bracketed(title: &str, open: char, close: char) -> Option<(&str, &str)> {
    let (name, unit) = title.strip_suffix(close)?.rsplit_once(open)?;
    let is_index = unit.trim().starts_with(|c: char| c.is_ascii_digit());
    (!is_index).then(|| (name.trim(), unit.trim()))
}

/// A column in words: `column 3 "fx [N]"`.
pub(crate) fn column_name(at: usize, name: &str) -> String {
    if name.is_empty() {
        format!("column {}", at + 1)
    } else {
        format!("column {} \"{name}\"", at + 1)
    }
}

/// Columns of one kind in words: `columns 3 to 18 "fx" to "fz"`.
pub(crate) fn column_names(all: &[usize], names: &[&str]) -> String {
    let [first, .., last] = all else {
        return all
            .first()
            .map_or_else(|| "none".into(), |at| column_name(*at, names[*at]));
    };
    if last - first + 1 != all.len() {
        let mut text = String::new();
        let mut rest = all;
        while let [first, ..] = rest {
            let run = rest
                .iter()
                .enumerate()
                .take_while(|(step, at)| **at == first + step)
                .count();
            let (one, more) = rest.split_at(run);
            let comma = if text.is_empty() { "" } else { ", " };
            let _ = write!(text, "{comma}{}", column_names(one, names));
            rest = more;
        }
        return text;
    }
    let (from, to) = (names[*first], names[*last]);
    let numbers = format!("columns {} to {}", first + 1, last + 1);
    if from.is_empty() {
        numbers
    } else {
        format!("{numbers} \"{from}\" to \"{to}\"")
    }
}

/// Most columns that a message lists.
const LISTED: usize = 40;

fn list(names: &[&str]) -> String {
    if names.iter().all(|name| name.is_empty()) {
        return format!("there are {}", names.len());
    }
    let mut listed: Vec<_> = (0..names.len().min(LISTED))
        .map(|at| format!("{} {}", at + 1, names[at]))
        .collect();
    if names.len() > LISTED {
        listed.push(format!("... {}", names.len()));
    }
    format!("there are: {}", listed.join(", "))
}

/// Items between commas that do not stand in brackets.
fn split(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0_i32;
    text.split(move |c| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == ',' && depth <= 0
    })
}

fn said_rate(text: &str) -> Result<f64, String> {
    rate(text).ok_or_else(|| {
        format!(
            "{} is no rate; write a number and Hz or kHz, such as rate=100 Hz",
            quote(text)
        )
    })
}

/// `100 Hz`, frames per second.
fn rate(text: &str) -> Option<f64> {
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e')?;
    let (number, unit) = text.split_at(split);
    let factor = match unit.trim() {
        "Hz" => 1.0,
        "kHz" => 1e3,
        _ => return None,
    };
    let rate = number.trim().parse::<f64>().ok()? * factor;
    // Between two frames there is at least 1 ns, and at most a day.
    (1.0 / 86_400.0..=1e9).contains(&rate).then_some(rate)
}
