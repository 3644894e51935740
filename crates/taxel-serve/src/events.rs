//! Events of contacts for messages, the report and a file.

use std::collections::{BTreeMap, VecDeque};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread::JoinHandle;

use serde::Serialize;
use taxel::estimation::{Certainty, TouchEvent, TouchEventKind};
use taxel::shown;

use crate::reserved::reserved;
use crate::save::{SaveError, created};

/// One event as messages, the report and files have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventRecord {
    /// Its number in this run, from 0.
    pub index: u64,
    /// Device time, ns.
    pub time_ns: u64,
    /// Number of the contact; 0 for none.
    pub contact: u64,
    /// Name of what happened.
    pub kind: &'static str,
    /// Its value in `unit`; `NaN` where it is not known.
    pub value: f64,
    /// Standard deviation of the value; `NaN` where it is not known.
    pub deviation: f64,
    /// How much the value says; none without one.
    pub certainty: Option<&'static str>,
    /// Unit of the value.
    pub unit: &'static str,
    /// Words of a mark.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Contact that a split one came off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parent: Option<u64>,
    /// Contact that a merged one went into.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub into: Option<u64>,
    /// Rise time of an impact from 10 to 90 %, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rise_time_s: Option<f64>,
    /// Smaller over larger amplitude of a cyclic load.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symmetry: Option<f64>,
    /// Unit vector of a slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 2]>,
    /// Correlation of a slip along rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub score: Option<f64>,
}

/// First line of a CSV file of events.
const COLUMNS: &str = "time [ns],contact,event,value,deviation,certainty,unit,parent,into,rise_time [s],symmetry,\
                       direction_x,direction_y,score,text";

impl EventRecord {
    fn new(index: u64, event: &TouchEvent, [force, speed]: [&'static str; 2]) -> Self {
        let mut record = Self {
            index,
            time_ns: event.time_ns,
            contact: event.contact,
            kind: event.kind.name(),
            value: event.value,
            deviation: event.deviation,
            certainty: (!event.value.is_nan()).then(|| event.certainty.name()),
            unit: force,
            text: None,
            parent: None,
            into: None,
            rise_time_s: None,
            symmetry: None,
            direction: None,
            score: None,
        };
        match event.kind {
            TouchEventKind::Split { parent } => record.parent = Some(parent),
            TouchEventKind::Merged { into } => record.into = Some(into),
            TouchEventKind::Impact { rise_time } => record.rise_time_s = Some(rise_time),
            TouchEventKind::Cyclic { symmetry } => {
                record.unit = "Hz";
                record.symmetry = Some(symmetry);
            }
            TouchEventKind::Slip { direction, score } => {
                record.unit = speed;
                record.direction = Some(direction);
                record.score = score;
            }
            _ => {}
        }
        record
    }

    /// One with all of its fields, whose kinds are those of any.
    pub(crate) fn sample() -> Self {
        Self {
            parent: Some(0),
            into: Some(0),
            rise_time_s: Some(0.0),
            symmetry: Some(0.0),
            direction: Some([0.0; 2]),
            score: Some(0.0),
            certainty: Some("exact"),
            ..Self::mark(0, String::new(), 0)
        }
    }

    fn mark(index: u64, text: String, time_ns: u64) -> Self {
        Self {
            index,
            time_ns,
            contact: 0,
            kind: "mark",
            value: f64::NAN,
            deviation: f64::NAN,
            certainty: None,
            unit: "",
            text: Some(text),
            parent: None,
            into: None,
            rise_time_s: None,
            symmetry: None,
            direction: None,
            score: None,
        }
    }

    /// Kind and contact, such as `touch 3`.
    pub(crate) fn label(&self) -> String {
        match (self.contact, &self.text) {
            (0, Some(text)) => format!("mark: {text}"),
            (0, None) => self.kind.into(),
            (contact, _) => format!("{} {contact}", self.kind),
        }
    }

    pub(crate) fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    fn csv(&self) -> String {
        let number = |value: Option<f64>| {
            let known = value.filter(|value| value.is_finite());
            known.map_or(String::new(), |value| value.to_string())
        };
        let contact = |contact: Option<u64>| contact.map_or(String::new(), |id| id.to_string());
        [
            self.time_ns.to_string(),
            self.contact.to_string(),
            self.kind.into(),
            number(Some(self.value)),
            number(Some(self.deviation)),
            self.certainty.unwrap_or_default().into(),
            self.unit.into(),
            contact(self.parent),
            contact(self.into),
            number(self.rise_time_s),
            number(self.symmetry),
            number(self.direction.map(|[x, _]| x)),
            number(self.direction.map(|[_, y]| y)),
            number(self.score),
            self.text.as_deref().map_or(String::new(), quoted),
        ]
        .join(",")
    }
}

/// A field of a CSV file with any characters, on one line.
fn quoted(text: &str) -> String {
    let line = text.replace(['\r', '\n'], " ");
    format!("\"{}\"", line.replace('"', "\"\""))
}

/// A file for events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EventFile {
    path: PathBuf,
    format: EventFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EventFormat {
    Csv,
    JsonLines,
}

/// Why a file cannot take events.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EventFileError {
    /// Its name does not end in a known format.
    #[error("{}: events are written as .csv or .jsonl; end the name in one of these", shown::path(.0))]
    Format(PathBuf),
}

impl EventFile {
    /// The file `path`, whose ending says the format; it is made when the run
    /// begins.
    ///
    /// # Errors
    /// [`EventFileError`].
    pub fn new(path: &Path) -> Result<Self, EventFileError> {
        let format = match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv") => EventFormat::Csv,
            Some("jsonl") => EventFormat::JsonLines,
            _ => return Err(EventFileError::Format(path.to_owned())),
        };
        Ok(Self {
            path: path.to_owned(),
            format,
        })
    }
}

/// Writes events on a thread of its own, each at once to the disk.
#[derive(Debug)]
pub(crate) struct EventWriter {
    file: EventFile,
    lines: mpsc::Sender<String>,
    writer: JoinHandle<std::io::Result<()>>,
}

impl EventWriter {
    /// Makes the file; one that exists is written anew only with `replace`.
    pub(crate) fn create(file: &EventFile, replace: bool) -> Result<Self, SaveError> {
        let path = file.path.clone();
        let mut open =
            created(&path, replace).map_err(|cause| SaveError::Create { path, cause })?;
        let (lines, waiting) = mpsc::channel::<String>();
        let writer = std::thread::spawn(move || {
            for line in waiting {
                // One write for each line: no half of one can be read.
                open.write_all(format!("{line}\n").as_bytes())?;
                open.flush()?;
            }
            Ok(())
        });
        let writer = Self {
            file: file.clone(),
            lines,
            writer,
        };
        if file.format == EventFormat::Csv {
            writer.line(COLUMNS.into())?;
        }
        Ok(writer)
    }

    fn line(&self, line: String) -> Result<(), SaveError> {
        self.lines.send(line).map_err(|_| SaveError::Write {
            path: self.file.path.clone(),
            message: "writing failed; is the disk full?".into(),
        })
    }

    fn push(&self, record: &EventRecord) -> Result<(), SaveError> {
        self.line(match self.file.format {
            EventFormat::Csv => record.csv(),
            EventFormat::JsonLines => record.json(),
        })
    }

    fn finish(self) -> Result<(), SaveError> {
        drop(self.lines);
        let ended = self.writer.join().unwrap_or_else(|_| {
            Err(std::io::Error::other(
                "the writing thread ended unexpectedly",
            ))
        });
        ended.map_err(|cause| SaveError::Write {
            path: self.file.path,
            message: cause.to_string(),
        })
    }
}

/// Events that are kept for the history, and those of them that a client which comes late gets.
const KEPT: usize = 10_000;
const SENT_LATE: usize = 500;
/// Events of the report.
const REPORTED: usize = 10;

/// The newest events, where the clients' tasks find them.
#[derive(Debug)]
pub(crate) struct EventLog {
    next: u64,
    kept: VecDeque<EventRecord>,
    /// Number of the first event since the clock of the device was last set back.
    restarted: u64,
}

impl Default for EventLog {
    fn default() -> Self {
        let event = TouchEvent {
            time_ns: 0,
            contact: 0,
            kind: TouchEventKind::Touch,
            value: 0.0,
            deviation: 0.0,
            certainty: Certainty::Exact,
        };
        Self {
            next: 0,
            kept: reserved(EventRecord::new(0, &event, [""; 2]), KEPT),
            restarted: 0,
        }
    }
}

impl EventLog {
    pub(crate) fn push(&mut self, record: &EventRecord) {
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(record.clone());
        self.next += 1;
    }

    /// The clock of the device was set back: earlier events lie on another time axis.
    pub(crate) fn restart(&mut self) {
        self.restarted = self.next;
    }

    /// The newest events, at most `most`, from one device time to another, ns, the oldest first.
    pub(crate) fn between(&self, from_ns: u64, to_ns: u64, most: usize) -> Vec<EventRecord> {
        let since = self
            .kept
            .len()
            .saturating_sub((self.next - self.restarted) as usize);
        let within = |event: &&EventRecord| (from_ns..=to_ns).contains(&event.time_ns);
        let newest = self.kept.range(since..).rev().filter(within).take(most);
        let mut events: Vec<_> = newest.cloned().collect();
        events.reverse();
        events
    }

    /// The events from number `from` on that are kept, and the number of the next one.
    pub(crate) fn newer(&self, from: u64) -> (Vec<EventRecord>, u64) {
        let new = self.next.saturating_sub(from) as usize;
        let first = self.kept.len().saturating_sub(new);
        (self.kept.range(first..).cloned().collect(), self.next)
    }

    /// The message with all events from number `from` on, and the number of the
    /// next one; `None` without any. `missed` of them are not kept any more.
    pub(crate) fn since(&self, from: u64) -> Option<(String, u64)> {
        let new = self.next.saturating_sub(from) as usize;
        if new == 0 {
            return None;
        }
        let first = self.kept.len().saturating_sub(new.min(SENT_LATE));
        let missed = new - (self.kept.len() - first);
        let mut text = format!("{{\"type\":\"events\",\"missed\":{missed},\"events\":[");
        for (place, event) in self.kept.range(first..).enumerate() {
            if place > 0 {
                text.push(',');
            }
            text.push_str(&event.json());
        }
        text.push_str("]}");
        Some((text, self.next))
    }
}

/// Events of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EventSummary {
    /// Number of events of each kind, by name.
    pub counts: BTreeMap<&'static str, u64>,
    /// The last ten, the oldest first.
    pub last: VecDeque<EventRecord>,
}

/// Takes the events of a run.
#[derive(Debug, Default)]
pub(crate) struct Events {
    units: [&'static str; 2],
    next: u64,
    summary: EventSummary,
    writer: Option<EventWriter>,
}

impl Events {
    /// `units` are those of forces and speeds.
    pub(crate) fn new(units: [&'static str; 2], writer: Option<EventWriter>) -> Self {
        Self {
            units,
            next: 0,
            summary: EventSummary::default(),
            writer,
        }
    }

    /// Takes all of `events`; a file that fails is closed.
    pub(crate) fn push(
        &mut self,
        events: &[TouchEvent],
        log: &dyn Fn(&EventRecord),
    ) -> Result<(), SaveError> {
        let mut written = Ok(());
        for event in events {
            let taken = self.take(EventRecord::new(self.next, event, self.units), log);
            written = written.and(taken);
        }
        written
    }

    /// Notes `text` at a device time, ns.
    pub(crate) fn mark(
        &mut self,
        text: String,
        time_ns: u64,
        log: &dyn Fn(&EventRecord),
    ) -> Result<(), SaveError> {
        self.take(EventRecord::mark(self.next, text, time_ns), log)
    }

    fn take(&mut self, record: EventRecord, log: &dyn Fn(&EventRecord)) -> Result<(), SaveError> {
        self.next += 1;
        *self.summary.counts.entry(record.kind).or_default() += 1;
        log(&record);
        let written = self.writer.as_ref().map(|writer| writer.push(&record));
        if self.summary.last.len() == REPORTED {
            self.summary.last.pop_front();
        }
        self.summary.last.push_back(record);
        match (written, self.writer.take()) {
            // Its end says why.
            (Some(Err(error)), Some(writer)) => writer.finish().and(Err(error)),
            (_, writer) => {
                self.writer = writer;
                Ok(())
            }
        }
    }

    pub(crate) fn finish(self) -> (EventSummary, Result<(), SaveError>) {
        let written = self.writer.map_or(Ok(()), EventWriter::finish);
        (self.summary, written)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(index: u64) -> EventRecord {
        let event = TouchEvent {
            time_ns: 5 * index,
            contact: 3,
            kind: TouchEventKind::Slip {
                direction: [-1.0, 0.0],
                score: Some(0.75),
            },
            value: 0.02,
            deviation: f64::NAN,
            certainty: Certainty::Exact,
        };
        EventRecord::new(index, &event, ["N", "m/s"])
    }

    #[test]
    fn an_event_is_one_line_in_each_format() {
        assert_eq!(
            record(2).json(),
            r#"{"index":2,"time_ns":10,"contact":3,"kind":"slip","value":0.02,"deviation":null,"certainty":"exact","unit":"m/s","direction":[-1.0,0.0],"score":0.75}"#
        );
        let csv = record(2).csv();
        assert_eq!(csv, "10,3,slip,0.02,,exact,m/s,,,,,-1,0,0.75,");
        assert_eq!(csv.split(',').count(), COLUMNS.split(',').count());
    }

    #[test]
    fn a_late_client_gets_what_is_kept_and_how_much_is_not() {
        let mut log = EventLog::default();
        assert_eq!(log.since(0), None);
        (0..SENT_LATE as u64 + 3).for_each(|index| log.push(&record(index)));
        let read = |from| {
            let (text, next) = log.since(from).unwrap();
            let message: serde_json::Value = serde_json::from_str(&text).unwrap();
            let events = message["events"].as_array().unwrap();
            let first = events[0]["index"].as_u64().unwrap();
            let missed = message["missed"].as_u64().unwrap();
            (missed, first, events.len(), next)
        };
        let next = SENT_LATE as u64 + 3;
        assert_eq!(read(0), (3, 3, SENT_LATE, next));
        assert_eq!(read(next - 2), (0, next - 2, 2, next));
        assert_eq!(log.since(next), None);
    }

    #[test]
    fn events_of_a_time_are_found_and_those_before_a_restart_are_not() {
        let mut log = EventLog::default();
        (0..KEPT as u64 + 5).for_each(|index| log.push(&record(index)));
        let times = |log: &EventLog, from, to, most| {
            let events = log.between(from, to, most);
            events.iter().map(|event| event.time_ns).collect::<Vec<_>>()
        };
        // Event 4 at 20 ns is not kept any more.
        assert_eq!(times(&log, 0, 32, 10), [25, 30]);
        assert_eq!(times(&log, 0, 100, 2), [95, 100]);
        assert_eq!(log.between(25, 25, 1)[0].label(), "slip 3");
        log.restart();
        assert!(times(&log, 0, 100, 10).is_empty());
        log.push(&record(7));
        assert_eq!(times(&log, 0, 100, 10), [35]);
    }

    #[test]
    fn a_file_is_streamed_and_an_existing_or_unknown_one_refused() {
        let folder = std::env::temp_dir().join(format!("taxel-events-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("events.csv");
        let file = EventFile::new(&path).unwrap();
        let writer = EventWriter::create(&file, false).unwrap();
        let mut taken = Events::new(["N", "m/s"], Some(writer));
        let touch = TouchEvent {
            time_ns: 7,
            contact: 1,
            kind: TouchEventKind::Touch,
            value: 0.5,
            deviation: 0.25,
            certainty: Certainty::Exact,
        };
        taken.push(&[touch, touch], &|_| ()).unwrap();
        let (summary, written) = taken.finish();
        written.unwrap();
        assert_eq!(summary.counts["touch"], 2);
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [COLUMNS, "7,1,touch,0.5,0.25,exact,N,,,,,,,,", lines[1]]
        );
        assert!(matches!(
            EventWriter::create(&file, false),
            Err(SaveError::Create { .. })
        ));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        EventWriter::create(&file, true).unwrap().finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, format!("{COLUMNS}\n"));
        let unknown = folder.join("events.txt");
        assert_eq!(
            EventFile::new(&unknown),
            Err(EventFileError::Format(unknown))
        );
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
