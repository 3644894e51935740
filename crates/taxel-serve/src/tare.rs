//! Which rest values were in force when, by whom they came, and the way back.

use std::collections::VecDeque;

use serde::Serialize;

use crate::sense::{Rest, Sense};

/// Who changed rest values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// The start of the run.
    Start,
    /// A client, such as the page.
    Page,
}

/// What happened to the rest values.
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
    /// Why it was refused.
    message: String,
    /// Whether its rest values can be put back.
    restorable: bool,
    /// The rest values after it, and when they were captured.
    #[serde(skip)]
    rest: Option<Rest>,
    #[serde(skip)]
    captured_ns: Option<u64>,
}

/// The history of the rest values of one run.
#[derive(Debug)]
pub(crate) struct TareHistory {
    entries: VecDeque<Entry>,
    next: u64,
    /// Who asked for the capture that runs.
    by: By,
}

/// Entries that are kept beside the first one.
const KEPT: usize = 64;

impl TareHistory {
    /// Begins with the rest values of `sense`.
    pub(crate) fn new(sense: &Sense) -> Self {
        let mut history = Self {
            entries: VecDeque::new(),
            next: 0,
            by: By::Start,
        };
        history.push(TareKind::Begun, By::Start, None, sense);
        history
    }

    /// A capture begins.
    pub(crate) fn begin(&mut self, by: By) {
        self.by = by;
    }

    /// The capture has ended; `refused` says why it changed nothing.
    pub(crate) fn captured(&mut self, time_ns: u64, refused: Option<&str>, sense: &Sense) {
        let kind = match refused {
            None => TareKind::Captured,
            Some(_) => TareKind::Refused,
        };
        let entry = self.push(kind, self.by, Some(time_ns), sense);
        entry.message = refused.unwrap_or_default().into();
        if refused.is_none() {
            entry.captured_ns = Some(time_ns);
        }
    }

    /// The rest values of the start are back in force.
    pub(crate) fn cleared(&mut self, time_ns: Option<u64>, sense: &Sense) {
        self.push(TareKind::Cleared, By::Page, time_ns, sense)
            .captured_ns = None;
    }

    /// Goes back to the rest values after entry `to`; `false` when they are not
    /// kept.
    pub(crate) fn undo(&mut self, to: u64, time_ns: Option<u64>, sense: &mut Sense) -> bool {
        let found = self.entries.iter().find(|entry| entry.index == to);
        let Some((rest, captured_ns)) = found.and_then(|entry| {
            let rest = entry.rest.clone()?;
            Some((rest, entry.captured_ns))
        }) else {
            return false;
        };
        sense.restore(&rest);
        let entry = self.push(TareKind::Undone, By::Page, time_ns, sense);
        entry.to = Some(to);
        entry.captured_ns = captured_ns;
        true
    }

    /// When the rest values in force were captured; `None` for those of the start.
    pub(crate) fn captured_ns(&self) -> Option<u64> {
        self.entries.back().and_then(|entry| entry.captured_ns)
    }

    fn push(&mut self, kind: TareKind, by: By, time_ns: Option<u64>, sense: &Sense) -> &mut Entry {
        if self.entries.len() > KEPT {
            // The first one is the way back to the start.
            self.entries.remove(1);
        }
        let rest = sense.rest();
        let before = self.entries.back();
        let largest_change = before
            .and_then(|before| before.rest.as_ref())
            .and_then(|before| largest_change(&before.values(), &rest.values(), sense));
        let restorable = !matches!(rest, Rest::Signals(None));
        let entry = Entry {
            index: self.next,
            time_ns,
            kind,
            by,
            largest_change,
            to: None,
            message: String::new(),
            restorable,
            captured_ns: before.and_then(|before| before.captured_ns),
            rest: restorable.then_some(rest),
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

fn largest_change(before: &[f64], after: &[f64], sense: &Sense) -> Option<LargestChange> {
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
        name: sense.channel_name(channel),
        change,
    })
}
