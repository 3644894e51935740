//! Requests for the history, and the answers as JSON and CSV; `docs/live-protocol.md` is
//! their table.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::{History, Mark, Row, Section, Signal, Stats};
use crate::events::{EventLog, EventRecord};
use crate::message::Provenance;

/// Rows of an answer: without a request, and at most.
const POINTS: usize = 1000;
const MOST_POINTS: usize = 10_000;
/// Rows times signals of an answer at most: while they are gathered, frames wait.
const MOST_CELLS: usize = 400_000;
/// Events of an answer, the newest.
const MOST_EVENTS: usize = 1000;

/// What a client asks for, as text.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HistoryQuery {
    #[serde(default, rename = "token")]
    _token: String,
    /// Device time, s; a negative one counts back from the newest frame.
    from: Option<String>,
    to: Option<String>,
    points: Option<String>,
    signals: Option<String>,
    format: Option<String>,
}

/// An answer as text.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Reply {
    Json(String),
    Csv(String),
}

/// What an answer is made of: gathered quickly, since frames wait meanwhile, and written later.
#[derive(Debug)]
pub(crate) struct Gathered {
    csv: bool,
    range_ns: [u64; 2],
    extent_ns: Option<[u64; 2]>,
    signals: Vec<Signal>,
    section: Section,
    tares: Vec<Mark>,
    events: Vec<EventRecord>,
}

impl Gathered {
    /// What a request asks for, or in words what is wrong with it.
    pub(crate) fn new(
        query: &HistoryQuery,
        history: &History,
        events: &EventLog,
    ) -> Result<Self, String> {
        let csv = match query.format.as_deref() {
            None | Some("json") => false,
            Some("csv") => true,
            Some(other) => return Err(format!("format is \"{other}\"; use json or csv")),
        };
        let range_ns = range_ns(query, history)?;
        let names = query.signals.as_deref().unwrap_or("totals");
        let chosen = chosen(names, history.signals())?;
        let points = points(query.points.as_deref())?;
        if points * chosen.len() > MOST_CELLS {
            return Err(format!(
                "{points} points of {} signals are more than {MOST_CELLS} values; ask for fewer points or signals",
                chosen.len()
            ));
        }
        let [from_ns, to_ns] = range_ns;
        let signal = |signal: &usize| history.signals()[*signal].clone();
        Ok(Self {
            csv,
            range_ns,
            extent_ns: history.extent_ns(),
            signals: chosen.iter().map(signal).collect(),
            section: history.section(range_ns, points, &chosen),
            tares: history.marks(from_ns, to_ns),
            events: events.between(from_ns, to_ns, MOST_EVENTS),
        })
    }

    /// The text of the answer.
    pub(crate) fn write(&self, provenance: &Provenance) -> Reply {
        if self.csv {
            Reply::Csv(self.csv(provenance))
        } else {
            Reply::Json(self.json())
        }
    }

    fn json(&self) -> String {
        let [from_ns, to_ns] = self.range_ns;
        let rows = &self.section.rows;
        let column = |slot: usize, of: fn(&Stats) -> f32| -> Vec<f32> {
            rows.iter().map(|row| of(&row.stats[slot])).collect()
        };
        let signals = self.signals.iter().enumerate();
        let signals = signals.map(|(slot, signal)| SignalMessage {
            signal,
            min: column(slot, |stats| stats.minimum),
            mean: column(slot, |stats| stats.mean),
            max: column(slot, |stats| stats.maximum),
            first: column(slot, |stats| stats.first),
            last: column(slot, |stats| stats.last),
            rises: rows.iter().map(|row| row.stats[slot].rises()).collect(),
        });
        let message = HistoryMessage {
            from_ns,
            to_ns,
            oldest_ns: self.extent_ns.map(|[oldest, _]| oldest),
            newest_ns: self.extent_ns.map(|[_, newest]| newest),
            width_ns: self.section.width_ns,
            time_ns: rows.iter().map(|row| row.time_ns).collect(),
            unix_s: rows.iter().map(|row| row.unix_s).collect(),
            signals: signals.collect(),
            tares: &self.tares,
            events: &self.events,
        };
        serde_json::to_string(&message).unwrap_or_default()
    }

    fn csv(&self, provenance: &Provenance) -> String {
        let [from_ns, to_ns] = self.range_ns;
        let mut out = format!(
            "# taxel {} {}\n# sensor_hash {}\n# source {}\n# history from {} s to {} s in rows of {} s\n",
            provenance.version,
            provenance.commit,
            provenance.sensor_hash,
            plain(&provenance.source),
            seconds(from_ns),
            seconds(to_ns),
            seconds(self.section.width_ns),
        );
        out.push_str("time [s],clock [s since 1970]");
        for signal in &self.signals {
            for which in ["min", "mean", "max"] {
                let name = format!("{} {which} [{}]", signal.name, signal.unit);
                let _ = write!(out, ",{}", field(&name));
            }
        }
        out.push_str(",events\n");
        let mut labels = self.labels();
        for row in &self.section.rows {
            csv_row(&mut out, row, &labels.take_until(row.time_ns));
        }
        out
    }

    /// Events and tares with the begin of the row in which they lie.
    fn labels(&self) -> Labels {
        let width_ns = self.section.width_ns;
        let tares = self.tares.iter();
        let tares = tares.map(|mark| (mark.time_ns, mark.kind.to_owned()));
        let events = self.events.iter();
        let events = events.map(|event| (event.time_ns, event.label()));
        let mut labels: Vec<_> = tares
            .chain(events)
            .map(|(time, label)| (time / width_ns * width_ns, label))
            .collect();
        labels.sort();
        labels.reverse();
        Labels(labels)
    }
}

/// Device times from one to another, ns.
fn range_ns(query: &HistoryQuery, history: &History) -> Result<[u64; 2], String> {
    let [oldest, newest] = history.extent_ns().unwrap_or([0; 2]);
    let from = device_time("from", query.from.as_deref(), newest)?.unwrap_or(oldest);
    let to = device_time("to", query.to.as_deref(), newest)?.unwrap_or(newest);
    if from > to {
        return Err(format!(
            "from is {} s, after to at {} s; exchange them",
            seconds(from),
            seconds(to)
        ));
    }
    Ok([from, to])
}

/// Labels on the time axis, the newest first.
struct Labels(Vec<(u64, String)>);

impl Labels {
    /// Takes those up to a time: what lies in a pause is told with the next row.
    fn take_until(&mut self, time_ns: u64) -> String {
        let later = self.0.partition_point(|(time, _)| *time > time_ns);
        let labels = self.0.split_off(later).into_iter().rev();
        labels
            .map(|(_, label)| label)
            .collect::<Vec<_>>()
            .join("; ")
    }
}

fn csv_row(out: &mut String, row: &Row, labels: &str) {
    let _ = write!(out, "{},{:.3}", seconds(row.time_ns), row.unix_s);
    for stats in &row.stats {
        for value in [stats.minimum, stats.mean, stats.maximum] {
            out.push(',');
            // A missing value is an empty field.
            if value.is_finite() {
                out.push_str(&number(value));
            }
        }
    }
    let _ = writeln!(out, ",{}", field(labels));
}

/// As short as it can be read back.
fn number(value: f32) -> String {
    if value == 0.0 || (1e-3..1e7).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

#[derive(Debug, Serialize)]
struct SignalMessage<'a> {
    #[serde(flatten)]
    signal: &'a Signal,
    min: Vec<f32>,
    mean: Vec<f32>,
    max: Vec<f32>,
    first: Vec<f32>,
    last: Vec<f32>,
    rises: Vec<bool>,
}

#[derive(Debug, Serialize)]
struct HistoryMessage<'a> {
    from_ns: u64,
    to_ns: u64,
    oldest_ns: Option<u64>,
    newest_ns: Option<u64>,
    width_ns: u64,
    time_ns: Vec<u64>,
    unix_s: Vec<f64>,
    signals: Vec<SignalMessage<'a>>,
    tares: &'a [Mark],
    events: &'a [EventRecord],
}

/// A device time in ns; a negative one counts back from the newest frame.
fn device_time(name: &str, text: Option<&str>, newest_ns: u64) -> Result<Option<u64>, String> {
    let Some(text) = text else {
        return Ok(None);
    };
    let seconds: f64 = text
        .parse()
        .ok()
        .filter(|seconds: &f64| seconds.is_finite() && seconds.abs() < 1e10)
        .ok_or_else(|| {
            format!(
                "{name} is \"{text}\"; use seconds of device time, or negative ones back from now"
            )
        })?;
    // Whole nanoseconds of the magnitude, then the sign: the newest frame itself is exact.
    let size_ns = (seconds.abs() * 1e9).round() as u64;
    Ok(Some(if seconds.is_sign_negative() {
        newest_ns.saturating_sub(size_ns)
    } else {
        size_ns
    }))
}

fn points(text: Option<&str>) -> Result<usize, String> {
    let Some(text) = text else {
        return Ok(POINTS);
    };
    let points = text.parse().ok();
    points
        .filter(|points| (1..=MOST_POINTS).contains(points))
        .ok_or_else(|| format!("points is \"{text}\"; use a whole number from 1 to {MOST_POINTS}"))
}

/// Numbers of signals by their names or the names of groups.
fn chosen(text: &str, signals: &[Signal]) -> Result<Vec<usize>, String> {
    let mut chosen = Vec::new();
    for name in text.split(',') {
        let fits = |signal: &Signal| match name {
            "totals" => !["channel ", "taxel "]
                .iter()
                .any(|group| signal.name.starts_with(group)),
            "channels" => signal.name.starts_with("channel "),
            "taxels" => signal.name.starts_with("taxel "),
            _ => signal.name == name,
        };
        let before = chosen.len();
        chosen.extend((0..signals.len()).filter(|signal| fits(&signals[*signal])));
        if chosen.len() == before {
            return Err(format!(
                "signals has \"{name}\", which is not kept for this device; use totals, channels, taxels or one of: {}",
                names(signals)
            ));
        }
    }
    // A signal that is asked for twice is sent once.
    let mut seen = vec![false; signals.len()];
    chosen.retain(|signal| !std::mem::replace(&mut seen[*signal], true));
    Ok(chosen)
}

/// The first names, and how many more there are.
fn names(signals: &[Signal]) -> String {
    const SHOWN: usize = 12;
    let names = signals.iter().map(|signal| signal.name.as_str());
    let mut text = names.take(SHOWN).collect::<Vec<_>>().join(", ");
    if signals.len() > SHOWN {
        let _ = write!(text, " and {} more", signals.len() - SHOWN);
    }
    text
}

/// Seconds without rounding.
fn seconds(time_ns: u64) -> String {
    let text = format!("{}.{:09}", time_ns / 1_000_000_000, time_ns % 1_000_000_000);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A field of a CSV file.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// On one line.
fn plain(text: &str) -> String {
    text.replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// Frames at 2 Hz from 5 s to 25 s, with a pause from 10 s to 20 s; one value is missing.
    fn history() -> History {
        let mut history = History::kept_for_tests(&["force_z", "contacts", "channel row 0"]);
        for half in (10..20).chain(40..=50) {
            let time_ns = half * SECOND / 2;
            let force = if half == 42 {
                f64::NAN
            } else {
                0.25 * half as f64
            };
            let unix_s = 1000.0 + 0.5 * half as f64;
            history.push_values(time_ns, unix_s, &[force, 1.0, 1e-15]);
        }
        let (time_ns, unix_s) = (6 * SECOND, 1006.0);
        let kind = "tare";
        history.mark(Mark {
            time_ns,
            unix_s,
            kind,
        });
        history
    }

    fn asked(pairs: &[(&str, &str)]) -> Result<Reply, String> {
        let text = |name: &str| {
            let found = pairs.iter().find(|(key, _)| *key == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        let query = HistoryQuery {
            _token: String::new(),
            from: text("from"),
            to: text("to"),
            points: text("points"),
            signals: text("signals"),
            format: text("format"),
        };
        let gathered = Gathered::new(&query, &history(), &EventLog::default())?;
        Ok(gathered.write(&Provenance::default()))
    }

    fn json(pairs: &[(&str, &str)]) -> Value {
        match asked(pairs) {
            Ok(Reply::Json(text)) => serde_json::from_str(&text).unwrap(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn json_has_everything_or_what_was_asked_for() {
        let all = json(&[]);
        assert_eq!(all["oldest_ns"], 5 * SECOND);
        assert_eq!(all["newest_ns"], 25 * SECOND);
        assert_eq!(all["time_ns"].as_array().unwrap().len(), 21);
        assert_eq!(
            all["signals"].as_array().unwrap().len(),
            2,
            "channels only when asked for"
        );
        assert_eq!(all["signals"][0]["unit"], "N");
        assert_eq!(all["tares"][0]["kind"], "tare");
        assert_eq!(all["events"].as_array().unwrap().len(), 0);
        // Back from now; a missing value is null.
        let end = json(&[("from", "-4.5"), ("points", "5"), ("signals", "force_z")]);
        assert!(
            (1..=5).contains(&end["time_ns"].as_array().unwrap().len()),
            "{end}"
        );
        let one = json(&[
            ("from", "21"),
            ("to", "21"),
            ("signals", "force_z,channels"),
        ]);
        assert_eq!(one["signals"][0]["mean"][0], Value::Null);
        assert_eq!(one["signals"][1]["name"], "channel row 0");
        assert_eq!(one["unix_s"][0], 1021.0);
    }

    #[test]
    fn csv_says_the_range_the_units_and_leaves_missing_values_empty() {
        let pairs = [
            ("format", "csv"),
            ("from", "5"),
            ("to", "21"),
            ("signals", "force_z"),
        ];
        let Ok(Reply::Csv(text)) = asked(&pairs) else {
            panic!("no CSV");
        };
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[3].ends_with("history from 5 s to 21 s in rows of 0.1 s"),
            "{}",
            lines[3]
        );
        assert_eq!(
            lines[4],
            "time [s],clock [s since 1970],force_z min [N],force_z mean [N],force_z max [N],events"
        );
        assert_eq!(lines[5], "5,1005.000,2.5,2.5,2.5,");
        assert_eq!(lines[7], "6,1006.000,3,3,3,tare");
        assert_eq!(lines[17], "21,1021.000,,,,");
        assert_eq!(lines.len(), 18, "no row stands for a time without frames");
    }

    #[test]
    fn what_is_wrong_with_a_request_is_said() {
        for (name, value, expected) in [
            ("from", "soon", "from is \"soon\"; use seconds"),
            ("to", "nan", "to is \"nan\"; use seconds"),
            ("from", "30", "from is 30 s, after to at 25 s"),
            (
                "points",
                "0",
                "points is \"0\"; use a whole number from 1 to 10000",
            ),
            ("points", "1e3", "points is \"1e3\""),
            ("format", "xml", "format is \"xml\"; use json or csv"),
            (
                "signals",
                "force_q",
                "signals has \"force_q\", which is not kept",
            ),
            (
                "signals",
                "taxels",
                "use totals, channels, taxels or one of: force_z, contacts",
            ),
        ] {
            let wrong = asked(&[(name, value)]).unwrap_err();
            assert!(wrong.contains(expected), "{name}={value}: {wrong}");
        }
    }

    #[test]
    fn an_empty_history_has_an_answer() {
        let query = HistoryQuery::default();
        let history = History::kept_for_tests(&["force_z"]);
        let gathered = Gathered::new(&query, &history, &EventLog::default()).unwrap();
        let Reply::Json(text) = gathered.write(&Provenance::default()) else {
            panic!("no JSON");
        };
        let answer: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(answer["newest_ns"], Value::Null);
        assert_eq!(answer["time_ns"].as_array().unwrap().len(), 0);
    }
}
