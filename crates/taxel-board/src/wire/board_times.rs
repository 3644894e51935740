//! Times of the board's own clock, each judged by those before it and by its arrival.
//!
//! As with counters, a jump counts only when the next time goes on from it. See
//! theory/acquisition.

use std::collections::VecDeque;

use crate::board::DeviceClock;

/// Latest readings of the clock, by which a new one is judged.
const KEPT: usize = 33;
/// With fewer of them the delays of the link are not known: a time may be so far off, ns.
const FEW: usize = KEPT / 4;
const UNKNOWN_DELAY_NS: f64 = 250e6;
/// A step is a usual one up to so many times the median of the last.
const USUAL: f64 = 1.5;
/// Largest difference of two clocks over a silence, as a share.
const CLOCK_ERROR: f64 = 0.01;
/// Frames whose arrival took less than this share of their own time came out of a store.
const STORED: f64 = 0.5;
/// Share of its numbers above which a step forward is one back; of a step, above which a clock
/// is a coarse one.
const HALF: f64 = 0.5;
/// Latest time that is believed, ns: 146 years.
pub(super) const LATEST_NS: f64 = (1_u64 << 62) as f64;

/// A reading of the clock and what else is known of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stamp {
    /// Steps of the clock.
    pub(super) raw: f64,
    pub(super) number: u64,
    pub(super) host_ns: Option<u64>,
}

/// What a reading of the clock is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Judged {
    /// The device time of its frame, ns.
    Right(f64),
    /// The clock began anew with the frame before: the device time, ns.
    Anew(f64),
    /// It fits neither the times before nor the arrival, or not yet: its frame needs another.
    Wrong,
}

/// Judges the readings of a clock and makes one device time of them.
#[derive(Debug, Clone)]
pub(super) struct BoardTimes {
    clock: DeviceClock,
    /// Readings that were right, with their device times, ns.
    recent: VecDeque<(Stamp, f64)>,
    /// One that was not, with the device time that its frame got instead, ns.
    suspect: Option<(Stamp, f64)>,
    /// The last that was right before the clock began anew: it may come back.
    before: Option<(Stamp, f64)>,
    /// True while the clock has shown whole steps only.
    whole: bool,
    /// True as soon as one was right.
    begun: bool,
    /// Readings that were wrong.
    wrong: u64,
}

impl BoardTimes {
    pub(super) fn new(clock: DeviceClock) -> Self {
        Self {
            clock,
            recent: VecDeque::with_capacity(KEPT + 1),
            suspect: None,
            before: None,
            whole: true,
            begun: false,
            wrong: 0,
        }
    }

    /// Readings that were wrong; one that waits for the next to tell is none yet.
    pub(super) fn wrong(&self) -> u64 {
        self.wrong
    }

    /// True if it has run before and none of its readings is known since.
    pub(super) fn begins_anew(&self) -> bool {
        self.begun && self.recent.is_empty()
    }

    /// Nothing tells any more what the last reading was worth.
    pub(super) fn finish(&mut self) {
        self.wrong += u64::from(self.suspect.take().is_some());
    }

    /// Device time of the first reading, and of the first behind a restart, where it is
    /// `begins_ns`.
    pub(super) fn begin(&mut self, stamp: Stamp, begins_ns: Option<f64>) -> Judged {
        self.finish();
        self.recent.clear();
        self.before = None;
        let stamp = self.within(stamp);
        let own_ns = stamp.raw * self.clock.step_ns;
        if !is_possible(own_ns.abs()) {
            self.wrong += 1;
            return Judged::Wrong;
        }
        // The clock may have a sign; device time has none.
        let time_ns = begins_ns.unwrap_or(own_ns.max(0.0));
        self.keep(stamp, time_ns);
        Judged::Right(time_ns)
    }

    /// Judges a reading.
    pub(super) fn judge(&mut self, stamp: Stamp) -> Judged {
        let Some(last) = self.recent.back().copied() else {
            return self.begin(stamp, None);
        };
        let usual = self.usual();
        self.find_wrap(last.0, stamp, usual);
        let stamp = self.within(stamp);
        let ahead = self.ahead(last.0, stamp);
        let time_ns = last.1 + ahead;
        if !is_possible((stamp.raw * self.clock.step_ns).abs()) {
            self.wrong += 1;
            return Judged::Wrong;
        }
        if is_possible(time_ns) && self.fits(last, stamp, ahead, usual) {
            // A time behind this one was too late, though not so much that it was noticed.
            self.wrong += u64::from(ahead < 0.0);
            self.finish();
            self.keep(stamp, time_ns);
            return Judged::Right(time_ns);
        }
        if let Some(time_ns) = self.back_again(last, stamp, usual) {
            return Judged::Right(time_ns);
        }
        let Some((suspect, given_ns)) = self.suspect else {
            self.suspect = Some((stamp, time_ns));
            return Judged::Wrong;
        };
        let behind = self.ahead(suspect, stamp);
        if !self.goes_on(suspect, stamp, behind, usual) {
            self.finish();
            self.suspect = Some((stamp, time_ns));
            return Judged::Wrong;
        }
        self.suspect = None;
        if ahead >= 0.0 && is_possible(time_ns) && !self.arrival_tells(stamp) {
            // Only the clock knows how much time has passed.
            self.keep(suspect, time_ns - behind);
            self.keep(stamp, time_ns);
            return Judged::Right(time_ns);
        }
        self.before = Some(last);
        self.recent.clear();
        self.keep(suspect, given_ns);
        self.keep(stamp, given_ns + behind);
        Judged::Anew(given_ns + behind)
    }

    /// The device time of a reading that goes on from where the clock was before it began anew,
    /// ns: it has not, and what came between was wrong.
    fn back_again(&mut self, last: (Stamp, f64), stamp: Stamp, usual: Option<f64>) -> Option<f64> {
        let before = self.before?;
        let frames = stamp.number.saturating_sub(before.0.number);
        if frames > KEPT as u64 {
            self.before = None;
            return None;
        }
        let ahead = self.ahead(before.0, stamp);
        if !is_usual(before.0, stamp, ahead, usual) || 2.0 * ahead < usual? * frames as f64 {
            return None;
        }
        self.before = None;
        self.finish();
        self.wrong += self.recent.len() as u64;
        self.recent.clear();
        let time_ns = (before.1 + ahead).max(last.1);
        self.keep(stamp, time_ns);
        Some(time_ns)
    }

    /// Finds out that a clock without a type, as text has it, is a number of 16 or 32 bits: one
    /// that begins anew just where such a number ends.
    fn find_wrap(&mut self, last: Stamp, stamp: Stamp, usual: Option<f64>) {
        if self.clock.modulus.is_some() || !self.whole || stamp.raw >= last.raw {
            return;
        }
        self.clock.modulus = [16, 32]
            .map(|bits| 1_u64 << bits)
            .into_iter()
            .find(|modulus| {
                let modulus = *modulus as f64;
                let ahead = (stamp.raw - last.raw + modulus) * self.clock.step_ns;
                last.raw < modulus && stamp.raw >= 0.0 && is_usual(last, stamp, ahead, usual)
            });
    }

    /// Says what device time, ns, the frame of a wrong reading got instead.
    pub(super) fn gave(&mut self, time_ns: f64) {
        if let Some((_, given_ns)) = &mut self.suspect {
            *given_ns = time_ns;
        }
    }

    /// Device time from a right reading to the next frame, ns: the median of the last steps.
    pub(super) fn usual(&self) -> Option<f64> {
        let mut steps = [0.0; KEPT];
        let pairs = self.recent.iter().zip(self.recent.iter().skip(1));
        let mut count = 0;
        for (step, ((before, from), (stamp, to))) in steps.iter_mut().zip(pairs) {
            *step = (to - from) / frames_between(*before, *stamp);
            count += 1;
        }
        let steps = &mut steps[..count];
        if steps.is_empty() {
            return None;
        }
        let (_, median, _) = steps.select_nth_unstable_by(count / 2, f64::total_cmp);
        if *median > 0.0 {
            return Some(*median);
        }
        // A clock whose steps are longer than the time between frames.
        let ((first, from), (last, to)) = (self.recent.front()?, self.recent.back()?);
        Some((to - from) / frames_between(*first, *last)).filter(|mean| *mean > 0.0)
    }

    fn keep(&mut self, stamp: Stamp, time_ns: f64) {
        if self.recent.len() == KEPT {
            self.recent.pop_front();
        }
        self.begun = true;
        self.whole &= stamp.raw.fract() == 0.0;
        self.recent.push_back((stamp, time_ns));
    }

    /// The reading as a number that the clock has.
    fn within(&self, stamp: Stamp) -> Stamp {
        let modulus = self.clock.modulus.map(|modulus| modulus as f64);
        Stamp {
            raw: modulus.map_or(stamp.raw, |modulus| stamp.raw.rem_euclid(modulus)),
            ..stamp
        }
    }

    /// How far a reading is ahead of another by the clock, ns.
    fn ahead(&self, from: Stamp, to: Stamp) -> f64 {
        let step_ns = self.clock.step_ns;
        let Some(modulus) = self.clock.modulus else {
            return (to.raw - from.raw) * step_ns;
        };
        let modulus = modulus as f64;
        let once = (to.raw - from.raw).rem_euclid(modulus);
        // More than once around: the arrival says how often.
        let elapsed = arrival(from, to).map(|elapsed| elapsed / step_ns);
        let turns = elapsed.map_or(0.0, |elapsed| ((elapsed - once) / modulus).round().max(0.0));
        if once > HALF * modulus && elapsed.is_none_or(|elapsed| elapsed < HALF * once) {
            (once - modulus) * step_ns
        } else {
            (once + turns * modulus) * step_ns
        }
    }

    /// True if a reading goes on from `last`: by a usual step, or as far from its arrival as
    /// the last readings were.
    fn fits(&self, last: (Stamp, f64), stamp: Stamp, ahead: f64, usual: Option<f64>) -> bool {
        if is_usual(last.0, stamp, ahead, usual) {
            return true;
        }
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut least_own, mut most_own) = (0.0_f64, 0.0_f64);
        for (kept, time_ns) in &self.recent {
            let (Some(elapsed), Some(own)) = (
                self.elapsed(*kept, stamp, usual),
                self.elapsed(*kept, last.0, usual),
            ) else {
                // Nothing says how much time has passed.
                return ahead >= 0.0;
            };
            let early = last.1 + ahead - time_ns - elapsed;
            least = least.min(early);
            most = most.max(early);
            let early = last.1 - time_ns - own;
            least_own = least_own.min(early);
            most_own = most_own.max(early);
        }
        let silence = self.elapsed(last.0, stamp, usual).unwrap_or(0.0);
        let slack = self.slack(silence, usual) + most_own - least_own;
        least <= slack && most >= -slack
    }

    /// True if a reading goes on from one that did not fit.
    fn goes_on(&self, suspect: Stamp, stamp: Stamp, ahead: f64, usual: Option<f64>) -> bool {
        // Two equal times go on only by a clock whose steps are longer than those of the frames.
        let coarse = self.whole && usual.is_none_or(|usual| self.clock.step_ns >= HALF * usual);
        if ahead < 0.0 || (ahead == 0.0 && !coarse) {
            return false;
        }
        if is_usual(suspect, stamp, ahead, usual) {
            return true;
        }
        let elapsed = self.elapsed(suspect, stamp, usual);
        let agrees = |elapsed: f64| (ahead - elapsed).abs() <= self.slack(elapsed, usual);
        elapsed.is_none_or(agrees)
    }

    /// How far a time may be off for the delays of the link and the steps of the clock, ns.
    fn slack(&self, silence: f64, usual: Option<f64>) -> f64 {
        let unknown = if self.recent.len() < FEW {
            UNKNOWN_DELAY_NS
        } else {
            0.0
        };
        let step = if self.whole { self.clock.step_ns } else { 0.0 };
        unknown + step + 2.0 * usual.unwrap_or(0.0) + CLOCK_ERROR * silence
    }

    /// Time from one frame to another by their arrival, or by their numbers, ns.
    fn elapsed(&self, from: Stamp, to: Stamp, usual: Option<f64>) -> Option<f64> {
        if self.arrival_tells(to) {
            return arrival(from, to);
        }
        Some(usual? * to.number.saturating_sub(from.number) as f64)
    }

    /// False where frames come out of a store: from a file, or behind a pause of the link.
    fn arrival_tells(&self, stamp: Stamp) -> bool {
        let Some(((first, from), (last, to))) = self.recent.front().zip(self.recent.back()) else {
            return stamp.host_ns.is_some();
        };
        arrival(*first, *last).is_some_and(|elapsed| elapsed >= STORED * (to - from))
            && stamp.host_ns.is_some()
    }
}

/// True for a step forward that is not longer than the last ones.
fn is_usual(from: Stamp, to: Stamp, ahead: f64, usual: Option<f64>) -> bool {
    let most = usual.map(|usual| USUAL * usual * frames_between(from, to));
    ahead >= 0.0 && most.is_some_and(|most| ahead <= most)
}

fn is_possible(time_ns: f64) -> bool {
    (0.0..=LATEST_NS).contains(&time_ns)
}

fn frames_between(from: Stamp, to: Stamp) -> f64 {
    to.number.saturating_sub(from.number).max(1) as f64
}

fn arrival(from: Stamp, to: Stamp) -> Option<f64> {
    let (then, now) = from.host_ns.zip(to.host_ns)?;
    Some(now as f64 - then as f64)
}
