//! Which rest values were in force when, by whom they came, and the way back.

use std::collections::VecDeque;
use std::time::SystemTime;

use serde::Serialize;
use taxel::estimation::{Picture, Rest, RestRefused, TouchSession, Why};

/// Who changed rest values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// The start of the run.
    Start,
    /// A client, such as the page.
    Page,
}

impl By {
    const ALL: [Self; 2] = [Self::Start, Self::Page];

    /// Name in recordings.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Page => "page",
        }
    }

    /// Who is called so in a recording; anyone else is a client.
    pub(crate) fn of_name(name: &str) -> Self {
        let found = Self::ALL.into_iter().find(|by| by.name() == name);
        found.unwrap_or(Self::Page)
    }
}

/// Kind of a change of the rest values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum TareKind {
    /// Those that the run began with.
    Begun,
    /// A rest capture.
    Captured,
    /// A return to those of the start.
    Cleared,
    /// A rest capture was refused; nothing changed.
    Refused,
    /// A return to those of an earlier entry.
    Undone,
}

/// The largest change of a rest value.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct LargestChange {
    channel: usize,
    name: String,
    /// SI.
    change: f64,
}

/// One entry of the history.
#[derive(Debug, Clone, Serialize)]
struct Entry {
    index: u64,
    /// Device time, ns; none before the first frame.
    time_ns: Option<u64>,
    kind: TareKind,
    by: By,
    largest_change: Option<LargestChange>,
    /// The entry that was gone back to.
    to: Option<u64>,
    /// Why it was refused, or where the first rest values are from.
    message: String,
    /// True if the link was lost and opened again since.
    before_reconnect: bool,
    /// True if something pressed while they were captured.
    #[serde(skip)]
    under_load: bool,
    /// When, s since 1970.
    #[serde(skip)]
    unix_s: f64,
    /// The rest values after it, and when they were captured.
    #[serde(skip)]
    rest: Rest,
    #[serde(skip)]
    captured_ns: Option<u64>,
}

/// Taxels that read below zero, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BelowZero {
    /// How many.
    pub taxels: usize,
    /// The cause in words; the moment of the zero stands beside it.
    pub cause: &'static str,
    /// When the zero was taken, s since 1970; none for one that was not taken in this run.
    pub zero_unix_s: Option<f64>,
    /// The same in device time, ns.
    pub zero_time_ns: Option<u64>,
}

/// A rest capture that is owed since the start of a run: something touched the sensor. It is taken as
/// soon as nothing does.
#[derive(Debug, Default)]
pub(crate) struct Owed {
    /// Why the zero is not taken yet, in words; `None` for nothing owed.
    why: Option<String>,
    /// Device time of the last refusal, ns.
    refused_ns: u64,
}

/// Time from a refusal to the next attempt at least, ns.
const NEXT_ATTEMPT_NS: u64 = 1_000_000_000;

impl Owed {
    /// The capture was refused at this device time, ns.
    pub(crate) fn refused(&mut self, refused: &RestRefused, time_ns: u64) {
        let why = match refused {
            RestRefused::StandsOut {
                row,
                column,
                value,
                others,
            } => format!(
                "row {row}, column {column} reads {value} where the others read {others}: something may press"
            ),
            RestRefused::Moving {
                moving,
                units,
                unit,
                ..
            } => format!("{moving} of {units} {unit}s moved"),
            // It would be refused again.
            RestRefused::NotTaken { .. } => return,
            other => other.to_string(),
        };
        self.why = Some(format!(
            "the zero is not taken yet: {why}; it is taken as soon as nothing touches"
        ));
        self.refused_ns = time_ns;
    }

    /// Nothing is owed any more.
    pub(crate) fn settle(&mut self) {
        self.why = None;
    }

    /// Why the zero is not taken yet; `None` where nothing is owed.
    pub(crate) fn why(&self) -> Option<&str> {
        self.why.as_deref()
    }

    /// True if it is time for another attempt, ns of device time.
    pub(crate) fn is_due(&self, time_ns: u64) -> bool {
        self.why.is_some() && time_ns.abs_diff(self.refused_ns) >= NEXT_ATTEMPT_NS
    }
}

/// The history of the rest values of one run.
#[derive(Debug)]
pub(crate) struct TareHistory {
    entries: VecDeque<Entry>,
    next: u64,
    /// Who asked for the capture that runs.
    by: By,
    /// True if something pressed as it began.
    under_load: bool,
    from_recording: bool,
    /// True if a map brings its own zero.
    map: bool,
}

/// What nobody knows of the zero of a device that no drawing describes.
const RESTED: &str = "a load that rested throughout would be part of it: no drawing says what this device reads empty";

/// Entries that are kept beside the first one.
const KEPT: usize = 64;

impl TareHistory {
    /// Begins with the rest values of `session`, which may be from a recording.
    pub(crate) fn new(session: &TouchSession, recording: Option<&str>) -> Self {
        let mut history = Self {
            entries: VecDeque::new(),
            next: 0,
            by: By::Start,
            under_load: false,
            from_recording: recording.is_some(),
            map: session.meaning().picture == Picture::Map,
        };
        let entry = history.push(TareKind::Begun, By::Start, None, session);
        if let Some(recording) = recording {
            entry.message = format!("from {recording}");
        }
        history
    }

    /// A capture begins, under load or not.
    pub(crate) fn begin(&mut self, by: By, under_load: bool) {
        (self.by, self.under_load) = (by, under_load);
    }

    /// True if the last that happened is a refusal of the capture at the start.
    pub(crate) fn is_refused_at_start(&self) -> bool {
        let refused = |entry: &Entry| (entry.kind, entry.by) == (TareKind::Refused, By::Start);
        self.entries.back().is_some_and(refused)
    }

    /// Who asked for the capture that runs, or ran last.
    pub(crate) fn by(&self) -> By {
        self.by
    }

    /// The link is open again: what was captured is from before.
    pub(crate) fn reconnected(&mut self) {
        for entry in &mut self.entries {
            entry.before_reconnect = true;
        }
    }

    /// Why `taxels` taxels read below zero.
    pub(crate) fn below_zero(&self, taxels: usize) -> BelowZero {
        let last = self.entries.back();
        let captured = last.filter(|entry| entry.captured_ns.is_some());
        let cause = match captured {
            Some(entry) if entry.under_load => "the zero was taken under load",
            Some(_) => "the zero was taken under load, or the sensor has changed since",
            None if self.from_recording
                && last.is_some_and(|last| last.kind != TareKind::Cleared) =>
            {
                "the recorded rest is not that of the sensor now"
            }
            None if self.map => "the zero is that of the frames themselves: none was taken here",
            None => "the rest values are those of the drawing: no zero was taken",
        };
        BelowZero {
            taxels,
            cause,
            zero_unix_s: captured.map(|entry| entry.unix_s),
            zero_time_ns: captured.and_then(|entry| entry.captured_ns),
        }
    }

    /// The capture has ended; `refused` says why it changed nothing.
    pub(crate) fn captured(
        &mut self,
        time_ns: Option<u64>,
        refused: Option<&str>,
        session: &TouchSession,
    ) {
        let kind = match refused {
            None => TareKind::Captured,
            Some(_) => TareKind::Refused,
        };
        let (under_load, map) = (self.under_load, self.map);
        let entry = self.push(kind, self.by, time_ns, session);
        entry.message = match refused {
            Some(refused) => refused.into(),
            None if map => RESTED.into(),
            None => String::new(),
        };
        if refused.is_none() {
            entry.captured_ns = time_ns;
            entry.under_load = under_load;
            entry.unix_s = unix_s();
        }
    }

    /// What is known besides of the last entry.
    pub(crate) fn remark(&mut self, words: &str) {
        if let Some(entry) = self.entries.back_mut() {
            words.clone_into(&mut entry.message);
        }
    }

    /// The rest values of the start are back in force.
    pub(crate) fn cleared(&mut self, time_ns: Option<u64>, session: &TouchSession) {
        self.push(TareKind::Cleared, By::Page, time_ns, session)
            .captured_ns = None;
    }

    /// Goes back to the rest values after entry `to`; `false` when they are not
    /// kept.
    pub(crate) fn undo(
        &mut self,
        to: u64,
        time_ns: Option<u64>,
        session: &mut TouchSession,
    ) -> bool {
        let found = self.entries.iter().find(|entry| entry.index == to);
        let Some(entry) = found else {
            return false;
        };
        let before = entry.clone();
        session.restore_rest(&before.rest);
        let entry = self.push(TareKind::Undone, By::Page, time_ns, session);
        entry.to = Some(to);
        entry.captured_ns = before.captured_ns;
        (entry.under_load, entry.unix_s) = (before.under_load, before.unix_s);
        true
    }

    /// When the rest values in force were captured; `None` for those of the start.
    pub(crate) fn captured_ns(&self) -> Option<u64> {
        self.entries.back().and_then(|entry| entry.captured_ns)
    }

    fn push(
        &mut self,
        kind: TareKind,
        by: By,
        time_ns: Option<u64>,
        session: &TouchSession,
    ) -> &mut Entry {
        if self.entries.len() > KEPT {
            // The first one is the way back to the start.
            self.entries.remove(1);
        }
        let rest = session.rest();
        let before = self.entries.back();
        let largest_change =
            before.and_then(|before| largest_change(before.rest.values(), rest.values(), session));
        let entry = Entry {
            index: self.next,
            time_ns,
            kind,
            by,
            largest_change,
            to: None,
            message: String::new(),
            before_reconnect: false,
            captured_ns: before.and_then(|before| before.captured_ns),
            under_load: before.is_some_and(|before| before.under_load),
            unix_s: before.map_or(f64::NAN, |before| before.unix_s),
            rest,
        };
        self.next += 1;
        self.entries.push_back(entry);
        let last = self.entries.len() - 1;
        &mut self.entries[last]
    }

    /// The message with all entries, the oldest first.
    pub(crate) fn message(&self) -> String {
        serde_json::json!({ "type": "tares", "entries": self.entries }).to_string()
    }
}

/// Tells of the changes that a baseline makes itself.
#[derive(Debug, Default)]
pub(crate) struct BaselineSender {
    sent_ns: Option<u64>,
    /// Changes of the history that were looked at.
    seen: u64,
    count: u64,
    last: VecDeque<BaselineChange>,
}

#[derive(Debug, Serialize)]
struct BaselineChange {
    time_ns: u64,
    name: String,
    /// SI.
    change: f64,
    reason: &'static str,
}

/// Changes in a message, and the time from one message to the next, ns.
const SENT: usize = 8;
const SEND_EVERY_NS: u64 = 1_000_000_000;

impl BaselineSender {
    /// The message, if there are changes since the last one.
    pub(crate) fn message(&mut self, time_ns: u64, session: &TouchSession) -> Option<String> {
        let soon = self
            .sent_ns
            .is_some_and(|sent| time_ns.abs_diff(sent) < SEND_EVERY_NS);
        let baseline = session.estimator().baseline()?;
        let new = baseline.changes() - self.seen;
        if soon || new == 0 {
            return None;
        }
        self.sent_ns = Some(time_ns);
        let before = self.count;
        let history = baseline.history();
        let kept = history.len();
        // Those that are no longer kept came in one second: they count.
        self.count += new.saturating_sub(kept as u64);
        let new = kept.min(usize::try_from(new).unwrap_or(kept));
        for change in history.skip(kept - new) {
            // Tares have a history of their own.
            if change.why != Why::Tare {
                self.count += 1;
                self.last.push_back(BaselineChange {
                    time_ns: change.time_ns,
                    name: name(session, change.channel),
                    change: change.to - change.from,
                    reason: change.why.words(),
                });
            }
        }
        self.seen = baseline.changes();
        self.last.drain(..self.last.len().saturating_sub(SENT));
        let message = || {
            let message = serde_json::json!({
                "type": "baseline",
                "changes": self.count,
                "last": self.last,
            });
            message.to_string()
        };
        (self.count > before).then(message)
    }
}

/// Wall clock, s since 1970.
pub(crate) fn unix_s() -> f64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map_or(f64::NAN, |since| since.as_secs_f64())
}

fn largest_change(before: &[f64], after: &[f64], session: &TouchSession) -> Option<LargestChange> {
    let changes = before
        .iter()
        .zip(after)
        .map(|(before, after)| after - before);
    let (channel, change) = changes
        .enumerate()
        .filter(|(_, change)| change.is_finite())
        .max_by(|(_, one), (_, other)| one.abs().total_cmp(&other.abs()))?;
    Some(LargestChange {
        channel,
        name: name(session, channel),
        change,
    })
}

/// Name of a channel, as recordings have it.
fn name(session: &TouchSession, channel: usize) -> String {
    let names = &session.meaning().channels;
    names.get(channel).cloned().unwrap_or_default()
}
