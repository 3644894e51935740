//! Rest values of a run: captures, their refusal, and the way back.

use taxel::estimation::{RestRefused, State, TaxelTouch};
use taxel_recording::mcap::{RestKind, RestMessage};

use super::{Pump, StartTare};
use crate::last_zero::{LastZero, Verdict};
use crate::message::{self, Tare};
use crate::record::{rest_message, rest_of};
use crate::shared::{REST, TARES};
use crate::tare::By;

/// Why rest values are those of the recording that is played.
const RESTORED: &str = "as recorded";

impl Pump {
    /// The zero of the last run is compared with that of the start.
    pub(crate) fn compare_zeros(&mut self, last_zero: Option<LastZero>) {
        self.last_zero = last_zero;
    }

    pub(super) fn tare_at_start(&mut self) {
        let kind = match self.options.start_tare {
            StartTare::Automatic if self.session.estimator().rules().rest.at_start => {
                RestKind::StartedUnasked
            }
            StartTare::Asked => RestKind::Started,
            StartTare::Automatic | StartTare::Never => return,
        };
        self.begin_capture(kind, self.options.tare_frames, By::Start, None);
        self.tares.begin(By::Start, false);
        self.tell_rest();
    }

    /// Takes the rest capture that is owed since the start, once nothing stands out any more.
    pub(super) fn tare_owed(&mut self, time_ns: u64) {
        if self.owed.is_due(time_ns)
            && !self.session.capturing()
            && self.session.estimator().standing_out().is_none()
        {
            self.tares.begin(By::Start, false);
            self.begin_capture(
                RestKind::StartedUnasked,
                self.options.tare_frames,
                By::Start,
                Some(time_ns),
            );
            self.tell_rest();
        }
    }

    pub(super) fn find_below_zero(&mut self) {
        let touch = self.session.estimator().touch();
        let below = |taxel: &&TaxelTouch| taxel.state == State::BelowZero;
        let taxels = touch.taxels.iter().filter(below).count();
        if self.below_zero.as_ref().map_or(0, |below| below.taxels) != taxels {
            self.below_zero = (taxels > 0).then(|| self.tares.below_zero(taxels));
            self.shared.status().below_zero.clone_from(&self.below_zero);
        }
    }

    /// What was below the zero before says nothing of a new one: the next frame finds it, and its cause, anew.
    pub(super) fn forget_below_zero(&mut self) {
        self.below_zero = None;
        self.shared.status().below_zero = None;
    }

    pub(super) fn captured(&mut self, captured: Result<(), RestRefused>, time_ns: Option<u64>) {
        let by = self.tares.by();
        let Err(refused) = captured else {
            self.mark("tare", time_ns);
            self.tares.captured(time_ns, None, &self.session);
            self.record_rest(RestKind::Captured, by, time_ns, String::new());
            self.forget_below_zero();
            if let Some(why) = self.owed.why() {
                let mut status = self.shared.status();
                if status.notice == why {
                    status.notice.clear();
                }
                if let Some(time_ns) = time_ns.filter(|_| !self.source.is_live()) {
                    status.notice = taken_later(time_ns);
                }
            }
            self.owed.settle();
            self.compare_with_last_zero(by);
            return self.tell_rest();
        };
        let message = refused.to_string();
        // Of attempts that nobody asked for the first refusal says it all.
        if by != By::Start || !self.tares.is_refused_at_start() {
            self.mark("tare refused", time_ns);
            self.tares.captured(time_ns, Some(&message), &self.session);
            self.shared.status().notice.clone_from(&message);
        }
        self.record_rest(RestKind::Refused, by, time_ns, message);
        let unasked = by == By::Start && self.options.start_tare == StartTare::Automatic;
        // A recording that has its rest values says itself when they were taken.
        if unasked && !self.rest_recorded {
            self.owed.refused(&refused, time_ns.unwrap_or(0));
            if let Some(why) = self.owed.why() {
                why.clone_into(&mut self.shared.status().notice);
            }
        }
        self.tell_rest();
    }

    /// Compares the zero at the start with that of the last run, and says if something pressed by that one. Such a
    /// zero is not kept: another run would find it alike.
    fn compare_with_last_zero(&mut self, by: By) {
        let Some(last_zero) = &mut self.last_zero else {
            return;
        };
        let verdict = last_zero.verdict().filter(|_| by == By::Start);
        match &verdict {
            Some(Verdict::Doubted(words)) => {
                self.tares.remark(words);
                self.shared.status().notice.clone_from(words);
                return;
            }
            Some(Verdict::Alike(words)) => self.tares.remark(words),
            None => {}
        }
        if let Err(failure) = last_zero.keep(&self.session.rest()) {
            (self.options.told)(&failure);
            self.last_zero = None;
        }
    }

    /// Begins a rest capture.
    pub(super) fn begin_capture(
        &mut self,
        kind: RestKind,
        frames: usize,
        by: By,
        time_ns: Option<u64>,
    ) {
        if let Some(recorder) = &self.recorder {
            let mut message = rest_message(kind, by.name(), time_ns, &self.session);
            message.frames = u32::try_from(frames).unwrap_or(u32::MAX);
            recorder.rest(message);
        }
        match kind {
            RestKind::StartedUnasked => self.session.begin_unasked_rest_capture(frames),
            _ => self.session.begin_rest_capture(frames),
        }
    }

    /// Repeats a change of the rest values that a recording has, so that each frame is
    /// estimated as it was.
    pub(super) fn recorded_rest(&mut self, change: &RestMessage) {
        self.rest_recorded = true;
        if self.options.start_tare == StartTare::Asked || self.options.rest_from.is_some() {
            // The rest values of this run are others.
            return;
        }
        let now = self.last.as_ref().map(|last| last.time_ns);
        let by = By::of_name(&change.by);
        match change.kind {
            RestKind::Started | RestKind::StartedUnasked => {
                self.tares.begin(by, false);
                self.begin_capture(change.kind, change.frames as usize, by, now);
            }
            // The frames before have done the same; what they gave counts unless the recording
            // has other values.
            RestKind::Captured | RestKind::Refused | RestKind::Begun => {
                if self.restored(change) {
                    self.record_rest(RestKind::Undone, by, now, RESTORED.into());
                }
            }
            RestKind::Cleared => {
                self.session.clear_rest();
                self.restored(change);
                self.tares.cleared(now, &self.session);
                self.record_rest(RestKind::Cleared, by, now, String::new());
                self.mark("tare cleared", now);
            }
            RestKind::Undone => {
                if let Some(rest) = rest_of(change) {
                    self.session.restore_rest(&rest);
                }
                self.record_rest(RestKind::Undone, by, now, change.message.clone());
                self.mark("tare undone", now);
            }
        }
        self.forget_below_zero();
        self.tell_rest();
    }

    /// Puts the rest values of a recording in force where others are; true if so.
    fn restored(&mut self, change: &RestMessage) -> bool {
        let own = rest_message(change.kind, "", None, &self.session);
        let bits = |message: &RestMessage| -> Vec<u64> {
            let captured = message.captured.iter().flatten().flatten();
            let values = message.values.iter().chain(captured);
            values.map(|value| value.to_bits()).collect()
        };
        let known = |message: &RestMessage| -> Vec<bool> {
            message.captured.iter().map(Option::is_some).collect()
        };
        let same = bits(&own) == bits(change)
            && known(&own) == known(change)
            && own.at_end == change.at_end;
        match rest_of(change).filter(|_| !same) {
            Some(rest) if rest.values().len() == own.values.len() => {
                self.session.restore_rest(&rest);
                true
            }
            _ => false,
        }
    }

    pub(super) fn record_rest(
        &self,
        kind: RestKind,
        by: By,
        time_ns: Option<u64>,
        message: String,
    ) {
        if let Some(recorder) = &self.recorder {
            let mut change = rest_message(kind, by.name(), time_ns, &self.session);
            change.message = message;
            recorder.rest(change);
        }
    }

    /// Puts the rest values and how they came where the clients' tasks find them.
    pub(super) fn tell_rest(&self) {
        let captured_ns = self.tares.captured_ns();
        let mut status = self.shared.status();
        status.tare_time_ns = captured_ns;
        status.tare = match captured_ns {
            _ if self.session.capturing() => Tare::Running,
            Some(_) => Tare::Done,
            None if self.session.estimator().is_tared() => Tare::Loaded,
            None if self.owed.why().is_some() => Tare::Waiting,
            None => Tare::None,
        };
        drop(status);
        let rest = &self.session.estimator().touch().channels.rest;
        self.shared.post(REST, message::rest(rest));
        self.shared.post(TARES, self.tares.message());
    }
}

/// What is said of a recording whose zero was taken after its beginning.
fn taken_later(time_ns: u64) -> String {
    let seconds = time_ns as f64 * 1e-9;
    format!(
        "the zero was taken at {seconds:.1} s, as soon as nothing touched: what comes before has no forces"
    )
}
