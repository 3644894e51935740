//! Which column is the time, which the running number, which are readings: by what the user
//! says, by the names of the columns, and by their numbers.

use super::columns::{
    Columns, Role, Said, Taken, Unit, column_name, column_names, split_unit, time_power, time_unit,
    values_taken,
};
use super::lines::{Dialect, date_time, is_missing, quote};
use super::{channels, units};
use crate::frame::{Quantity, SignalUnit};

/// Words by one of which a column is called that has times.
const TIME_WORDS: [&str; 24] = [
    "time",
    "times",
    "timestamp",
    "timestamps",
    "t",
    "ts",
    "stamp",
    "unix",
    "unixtime",
    "epoch",
    "date",
    "datetime",
    "elapsed",
    "clock",
    "millis",
    "micros",
    "nanos",
    "second",
    "seconds",
    "milliseconds",
    "microseconds",
    "nanoseconds",
    "ms",
    "us",
];
/// Names of columns that have a running number.
const SEQUENCE_WORDS: [&str; 14] = [
    "sequence", "seq", "frame", "frames", "index", "counter", "count", "sample", "samples",
    "packet", "number", "nr", "no", "n",
];

/// Unix times between September 2001, where those in s have ten digits, and the year 2100, in s.
const UNIX_SECONDS: std::ops::Range<f64> = 1e9..4_102_444_800.0;

/// What the first rows of a column show.
#[derive(Debug, Clone, Default)]
pub(crate) struct Facts {
    /// Cells with a number.
    numbers: usize,
    /// Cells with a date.
    dates: usize,
    /// Cells with anything else but a sign of a missing value.
    others: usize,
    /// True until a number has a fraction.
    fraction: bool,
    /// Steps upwards, downwards, and of exactly 1.
    rises: usize,
    falls: usize,
    ones: usize,
    steps: usize,
    first: Option<f64>,
    last: Option<f64>,
    /// Range of the numbers.
    least: f64,
    most: f64,
}

impl Facts {
    /// Takes one more cell of a table.
    pub(super) fn cell(&mut self, text: &str, dialect: &mut Dialect) {
        if let Some(value) = dialect.number(text) {
            self.number(value);
        } else if let Some(time_ns) = date_time(text) {
            self.dates += 1;
            self.step(time_ns as f64 * 1e-9);
        } else if !is_missing(text) {
            self.others += 1;
        }
    }

    /// Takes one more number.
    pub(crate) fn number(&mut self, value: f64) {
        self.numbers += 1;
        self.fraction |= value.fract() != 0.0;
        self.step(value);
    }

    fn step(&mut self, value: f64) {
        if let Some(last) = self.last {
            self.steps += 1;
            self.rises += usize::from(value > last);
            self.falls += usize::from(value < last);
            self.ones += usize::from(value - last == 1.0);
        } else {
            (self.least, self.most) = (value, value);
        }
        self.first = self.first.or(Some(value));
        self.last = Some(value);
        (self.least, self.most) = (self.least.min(value), self.most.max(value));
    }

    fn is_numeric(&self) -> bool {
        self.numbers > self.others + self.dates
    }

    fn is_dates(&self) -> bool {
        self.dates > self.others + self.numbers
    }

    /// Power of ten to ns of the unit in which all numbers are Unix times that never fall.
    fn unix(&self) -> Option<i32> {
        let fits = |power: &i32| {
            let scale = 10_f64.powi(9 - power);
            let range = UNIX_SECONDS.start * scale..UNIX_SECONDS.end * scale;
            range.contains(&self.least) && range.contains(&self.most)
        };
        let candidate = self.is_numeric() && self.falls == 0 && (self.steps == 0 || self.rises > 0);
        candidate.then(|| [9, 6, 3, 0].into_iter().find(fits))?
    }

    /// True if every number is larger than the one before.
    fn always_rises(&self) -> bool {
        self.is_numeric() && self.steps > 0 && self.rises == self.steps
    }

    /// True if it counts eight rows or more and begins again, more than once: no reading does so by chance
    /// that flickers by one.
    fn counts_round(&self) -> bool {
        let steps = self.ones + self.falls == self.steps && 8 * self.falls <= self.steps;
        self.is_numeric() && !self.fraction && self.falls > 1 && steps
    }

    /// True if it rises by one with every row.
    fn counts(&self) -> bool {
        self.is_numeric() && self.steps > 1 && self.ones == self.steps && !self.fraction
    }
}

/// How a column gives the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TimeForm {
    /// A number of units of 10^n ns.
    Number(i32),
    /// A date with a time of day.
    Date,
}

/// What each column is.
#[derive(Debug, Clone)]
pub(crate) struct Roles {
    /// Column of the time; `None` where frames come at a rate.
    pub(crate) time: Option<(usize, TimeForm)>,
    /// Frames per second without a time.
    pub(crate) rate: f64,
    pub(crate) sequence: Option<usize>,
    /// Columns of the channels of a frame, in their order, with the SI value of a number.
    pub(crate) values: Vec<(usize, f64)>,
    pub(crate) unit: SignalUnit,
    /// Rows, columns and channels of a taxel.
    pub(crate) shape: [usize; 3],
    pub(crate) taken: Taken,
}

/// What a table leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Otherwise {
    /// The first column is the time in s, and the rest are counts: rows of a device that is known.
    Bare,
    /// Columns without names, which the user describes, are counts.
    Counts,
    /// Columns with names but without units are raw numbers.
    Raw,
}

/// A refusal: what is wrong, and what to do.
pub(crate) type Refusal = (String, String);

/// The unit of readings of which none is stated.
pub(crate) fn plain_unit(otherwise: Otherwise) -> SignalUnit {
    let (quantity, symbol) = match otherwise {
        Otherwise::Raw => (Quantity::Raw, "raw"),
        _ => (Quantity::Counts, "counts"),
    };
    SignalUnit {
        quantity,
        symbol: symbol.to_owned(),
        si_per_unit: 1.0,
    }
}

/// Decides for columns with these names (empty ones where there are none) and facts; the first
/// `lent` of them are no readings unless it is said.
pub(crate) fn decide(
    names: &[&str],
    facts: &[Facts],
    columns: &Columns,
    otherwise: Otherwise,
    lent: usize,
) -> Result<Roles, Refusal> {
    let said = columns
        .of(names)
        .map_err(|message| (format!("--columns: {message}"), String::new()))?;
    let table = Table {
        names,
        facts,
        said: &said,
    };
    let time = match columns.rate() {
        Some(_) => None,
        None => Some(table.time(otherwise)?),
    };
    let time_column = time.as_ref().map(|(at, _, _)| *at);
    let by_unix = time
        .as_ref()
        .is_some_and(|(_, _, how)| how.contains("Unix"));
    let sequence = table.sequence(time_column, by_unix);
    let (mut values, mut ignored) = (Vec::new(), Vec::new());
    for (at, one) in said.iter().enumerate() {
        if Some(at) == time_column || Some(at) == sequence.map(|(at, _)| at) {
            continue;
        }
        let is_other_time = || table.is_time_by_name(at) || facts[at].unix().is_some();
        match one.role {
            Some(Role::Value) => values.push(at),
            Some(_) => ignored.push((at, "as said")),
            None if columns.names_values() => ignored.push((at, "not named")),
            None if at < lent => ignored.push((at, "another array")),
            None if !facts[at].is_numeric() => ignored.push((at, "no numbers")),
            None if facts[at].counts_round() => ignored.push((at, "a counter that begins again")),
            None if table.is_index(at) => ignored.push((at, "an index of the rows")),
            None if time.is_some() && is_other_time() => ignored.push((at, "another time")),
            None => values.push(at),
        }
    }
    if values.is_empty() {
        let message = "there is no column of readings".to_owned();
        return Err((message, "say which with --columns value=2-5".to_owned()));
    }
    let (unit, scales) = table.unit(&values, otherwise)?;
    let value_names: Vec<_> = values.iter().map(|at| split_unit(names[*at]).0).collect();
    let (shape, places) = channels::layout(&value_names)
        .unwrap_or_else(|| ([1, values.len(), 1], (0..values.len()).collect()));
    let mut placed = vec![(0, 0.0); values.len()];
    for ((column, scale), place) in values.iter().zip(scales).zip(places) {
        placed[place] = (*column, scale);
    }
    let taken = Taken {
        time: time.as_ref().map_or_else(
            || {
                format!(
                    "none; frames come at {} Hz as said",
                    columns.rate().unwrap_or(1.0)
                )
            },
            |(at, form, how)| {
                let form = match form {
                    TimeForm::Number(power) => format!("in {}", time_unit(*power)),
                    TimeForm::Date => "dates".to_owned(),
                };
                format!("{} {form}, {how}", column_name(*at, names[*at]))
            },
        ),
        sequence: sequence.map_or_else(
            || "none, rows are counted".to_owned(),
            |(at, how)| format!("{}, {how}", column_name(at, names[at])),
        ),
        values: values_taken(&column_names(&values, names), shape, &unit),
        ignored: reasons(&ignored, names),
    };
    Ok(Roles {
        time: time.map(|(at, form, _)| (at, form)),
        rate: columns.rate().unwrap_or(1.0),
        sequence: sequence.map(|(at, _)| at),
        values: placed,
        unit,
        shape,
        taken,
    })
}

fn reasons(ignored: &[(usize, &str)], names: &[&str]) -> String {
    if ignored.is_empty() {
        return "none".to_owned();
    }
    let parts = ignored.chunk_by(|(_, one), (_, other)| one == other);
    let parts = parts.map(|part| {
        let columns: Vec<_> = part.iter().map(|(at, _)| *at).collect();
        format!("{} ({})", column_names(&columns, names), part[0].1)
    });
    parts.collect::<Vec<_>>().join(", ")
}

struct Table<'a> {
    names: &'a [&'a str],
    facts: &'a [Facts],
    said: &'a [Said],
}

type FoundTime = (usize, TimeForm, String);

impl Table<'_> {
    fn free(&self) -> impl Iterator<Item = usize> {
        (0..self.said.len()).filter(|at| self.said[*at].role.is_none())
    }

    fn time(&self, otherwise: Otherwise) -> Result<FoundTime, Refusal> {
        let named = (0..self.said.len()).find(|at| self.said[*at].role == Some(Role::Time));
        if let Some(at) = named {
            return self.form(at, "as said", otherwise);
        }
        let usable = |at: &usize| self.facts[*at].is_numeric() || self.facts[*at].is_dates();
        let rises = |at: &usize| self.facts[*at].rises >= self.facts[*at].falls;
        let mut by_name = self
            .free()
            .filter(|at| self.is_time_by_name(*at))
            .filter(usable);
        if let Some(at) = by_name.find(rises) {
            return self.form(at, "by its name", otherwise);
        }
        let is_unix = |at: &usize| self.facts[*at].unix().is_some() || self.facts[*at].is_dates();
        if let Some(at) = self.free().find(is_unix) {
            return self.form(at, "by its numbers", otherwise);
        }
        let mut rising = self.free().filter(|at| self.facts[*at].always_rises());
        let (first, second) = (rising.next(), rising.next());
        if otherwise == Otherwise::Bare
            && let Some(at) = self.free().next()
        {
            let facts = &self.facts[at];
            // The column of an ordinary recording rises, but for rows that came late.
            let found = match first {
                Some(first) if 2 * facts.rises <= facts.steps => first,
                _ => at,
            };
            if self.facts[found].counts_round() {
                let column = column_name(found, self.names[found]);
                let message = format!("no time is known: {column} counts and begins again");
                return Err((message, SAY_TIME.to_owned()));
            }
            let how = if found == at {
                "the first column, as its numbers allow"
            } else {
                "the only one that always rises"
            };
            return self.form(found, how, otherwise);
        }
        let found = match (first, second) {
            (Some(first), Some(second)) if self.facts[first].counts() => Some(second),
            (first, _) => first,
        };
        let missing = || {
            let message = "no column is recognised as the time".to_owned();
            (message, SAY_TIME.to_owned())
        };
        self.form(found.ok_or_else(missing)?, "it always rises", otherwise)
    }

    /// The unit of a column that is the time.
    fn form(&self, at: usize, how: &str, otherwise: Otherwise) -> Result<FoundTime, Refusal> {
        let (name, unit) = split_unit(self.names[at]);
        if let Some(Unit::Time(power)) = self.said[at].unit {
            return Ok((at, TimeForm::Number(power), how.to_owned()));
        }
        if self.facts[at].is_dates() {
            return Ok((at, TimeForm::Date, how.to_owned()));
        }
        if let Some(unit) = unit {
            return match time_power(unit) {
                Some(power) => Ok((
                    at,
                    TimeForm::Number(power),
                    format!("{how}, unit by its name"),
                )),
                None => Err((
                    format!("{} is not a unit of time", quote(unit)),
                    format!("say the unit with --columns time={}[ms]", at + 1),
                )),
            };
        }
        let last = words(name);
        let suffix = last.last().filter(|_| last.len() > 1 || last[0].len() > 3);
        if let Some(power) = suffix.and_then(|word| time_power(word)) {
            return Ok((
                at,
                TimeForm::Number(power),
                format!("{how}, unit by its name"),
            ));
        }
        if let Some(power) = self.facts[at].unix() {
            return Ok((
                at,
                TimeForm::Number(power),
                format!("{how}, Unix time by its size"),
            ));
        }
        if otherwise == Otherwise::Bare || self.facts[at].fraction {
            let how = if self.facts[at].fraction && otherwise != Otherwise::Bare {
                format!("{how}, in s because it has fractions")
            } else {
                how.to_owned()
            };
            return Ok((at, TimeForm::Number(9), how));
        }
        let column = column_name(at, self.names[at]);
        let message =
            format!("the unit of the time, {column}, is not stated: it has whole numbers");
        let help = format!("say it with --columns \"time={}[ms]\"", at + 1);
        Err((message, help))
    }

    fn is_time_by_name(&self, at: usize) -> bool {
        let (name, unit) = split_unit(self.names[at]);
        let is_time = |word: &String| TIME_WORDS.contains(&word.as_str());
        unit.is_some_and(|unit| time_power(unit).is_some()) || words(name).iter().any(is_time)
    }

    /// True of the column without a name by which a table numbers its rows.
    fn is_index(&self, at: usize) -> bool {
        let is_named = |name: &&str| !name.is_empty();
        self.names[at].is_empty() && self.names.iter().any(is_named) && self.facts[at].counts()
    }

    fn sequence(&self, time: Option<usize>, by_unix: bool) -> Option<(usize, &'static str)> {
        let named = (0..self.said.len()).find(|at| self.said[*at].role == Some(Role::Sequence));
        if let Some(at) = named {
            return Some((at, "as said"));
        }
        let free = || self.free().filter(|at| Some(*at) != time);
        let running = |at: &usize| {
            let facts = &self.facts[*at];
            facts.is_numeric()
                && !facts.fraction
                && facts.falls == 0
                && facts.rises == facts.steps
                && facts.least >= 0.0
        };
        let by_name = |at: &usize| {
            let (name, unit) = split_unit(self.names[*at]);
            let words = words(name);
            unit.is_none()
                && words
                    .iter()
                    .any(|word| SEQUENCE_WORDS.contains(&word.as_str()))
        };
        free()
            .filter(running)
            .find(by_name)
            .map(|at| (at, "by its name"))
            .or_else(|| {
                // Beside a Unix time what counts rows is no reading.
                let counting = free().find(|at| by_unix && self.facts[*at].counts() && running(at));
                counting.map(|at| (at, "it rises by 1"))
            })
    }

    /// The unit of the readings, and the SI value of a number of each.
    fn unit(
        &self,
        values: &[usize],
        otherwise: Otherwise,
    ) -> Result<(SignalUnit, Vec<f64>), Refusal> {
        let unit = |at: usize| match &self.said[at].unit {
            Some(Unit::Value(unit)) => Some(unit.clone()),
            _ => split_unit(self.names[at])
                .1
                // A column of others in C is rather one of degrees than of coulombs.
                .filter(|symbol| *symbol != "C")
                .and_then(units::find),
        };
        let plain = plain_unit(otherwise);
        let all: Vec<_> = values
            .iter()
            .map(|at| unit(*at).unwrap_or_else(|| plain.clone()))
            .collect();
        let first = all[0].clone();
        if let Some(other) = all.iter().position(|unit| unit.quantity != first.quantity) {
            let [one, two] = [0, other].map(|at| {
                let column = column_name(values[at], self.names[values[at]]);
                format!("{column} in {}", all[at].symbol)
            });
            let message = format!("the columns mix quantities: {one}, {two}");
            let alike = |at: &&usize| {
                unit(**at).map(|unit| unit.quantity) == unit(values[0]).map(|unit| unit.quantity)
            };
            let alike: Vec<_> = values
                .iter()
                .filter(alike)
                .map(|at| (at + 1).to_string())
                .collect();
            let help = format!("choose with --columns value={}", alike.join(","));
            return Err((message, help));
        }
        Ok((
            first,
            all.into_iter().map(|unit| unit.si_per_unit).collect(),
        ))
    }
}

const SAY_TIME: &str =
    "say which with --columns \"time=2[ms]\", or give the rate with --columns \"rate=100 Hz\"";

/// The words of a name, in small letters: of `hostTime_ms` host, time and ms.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let begins = before.is_lowercase() && c.is_uppercase();
        if !c.is_alphanumeric() || begins {
            words.push(String::new());
        }
        if c.is_alphanumeric() {
            words
                .last_mut()
                .map(|word| word.extend(c.to_lowercase()))
                .unwrap_or_default();
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    if words.is_empty() {
        words.push(String::new());
    }
    words
}
