//! Counters of a few bits to numbers that go on for ever.
//!
//! A number is placed by time: nearest to rate x time + offset, the offset being the median of
//! the last 33. A jump counts only when the next frame continues it; until then its frame is
//! held. See theory/acquisition.

use std::collections::VecDeque;

/// Frames whose offsets are looked at.
const OFFSETS: usize = 33;
/// Largest jump over which a next frame continues.
const CONTINUES: i64 = 16;
/// Gaps that a late frame may belong to.
const GAPS: usize = 16;
/// Frames between two that the rate is measured from, and the most of them.
const RATE_STRIDE: i64 = 64;
const RATE_POINTS: usize = 32;
/// Relative error of a rate that is stated, and of one that was measured.
pub(super) const STATED_RATE: f64 = 0.05;
const MEASURED_RATE: f64 = 2e-3;

/// A frame with its number, to be placed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbered<T> {
    /// Number on the wire.
    pub(super) number: u64,
    /// Time, s, of the device or of its arrival.
    pub(super) time: Option<f64>,
    /// Tells frames with other values apart.
    pub(super) fingerprint: u64,
    pub(super) frame: T,
}

/// What came of the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct NumberCounts {
    pub(super) lost: u64,
    pub(super) ambiguous: u64,
    pub(super) wrong: u64,
    pub(super) late: u64,
    pub(super) duplicate: u64,
    pub(super) restarts: u64,
}

/// A frame that is placed: its number, and whether a restart of the board lies before it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed<T> {
    pub(super) number: u64,
    pub(super) restarted: bool,
    pub(super) frame: T,
}

/// Places numbers.
#[derive(Debug, Clone)]
pub(super) struct Numbering<T> {
    /// Numbers before the counter begins again; `None` for one that is endless.
    modulus: Option<i64>,
    stated_rate: Option<f64>,
    last: Option<Last>,
    /// Number and time of the last frames.
    recent: VecDeque<(i64, f64)>,
    rate_points: VecDeque<(i64, f64)>,
    held: Option<Numbered<T>>,
    /// First and last number of the latest gaps.
    missing: VecDeque<[i64; 2]>,
    /// The last frame before the counter began anew.
    before_restart: Option<Last>,
    /// True if the next number begins anew.
    fresh: bool,
    /// Frames placed before the held one, which came before them.
    early: u64,
    /// Frames that came in no place of their own: each is one that the gaps count.
    refused: u64,
    counts: NumberCounts,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    /// Number on the wire.
    raw: i64,
    /// Number given out.
    number: i64,
    fingerprint: u64,
}

/// Where a number belongs.
#[derive(Debug, Clone, Copy)]
struct Place {
    number: i64,
    /// False if the counter may have begun again once more or less.
    certain: bool,
    /// False if time says that the jump did not happen.
    plausible: bool,
}

impl<T> Numbering<T> {
    pub(super) fn new(modulus: Option<u64>, stated_rate: Option<f64>) -> Self {
        Self {
            modulus: modulus.map(u64::cast_signed),
            stated_rate,
            last: None,
            recent: VecDeque::new(),
            missing: VecDeque::new(),
            before_restart: None,
            fresh: false,
            rate_points: VecDeque::new(),
            held: None,
            early: 0,
            refused: 0,
            counts: NumberCounts::default(),
        }
    }

    pub(super) fn counts(&self) -> NumberCounts {
        NumberCounts {
            lost: self.counts.lost.saturating_sub(self.refused),
            ..self.counts
        }
    }

    /// The frames that are placed with this one, in order.
    pub(super) fn push(&mut self, frame: Numbered<T>, out: &mut Vec<Placed<T>>) {
        let Some(last) = self.last else {
            self.accept(frame, None, out);
            return;
        };
        if std::mem::take(&mut self.fresh) {
            self.begin_anew(frame, last, out);
            return;
        }
        let place = self.place(&frame, last);
        let jump = place.number.saturating_sub(last.number);
        let Some(held) = self.held.take() else {
            self.alone(frame, place, jump, out);
            return;
        };
        let ahead = self.distance(held.number.cast_signed(), frame.number.cast_signed());
        let held_place = self.place(&held, last);
        let held_jump = held_place.number.saturating_sub(last.number);
        let goes_on = (1..=CONTINUES).contains(&jump);
        if (1..=CONTINUES).contains(&ahead) && self.returned(held_place.number, last) {
            // The numbers behind the gap were wrong, and these are what it lacks.
            self.counts.late += 1;
            self.refused += 1;
            self.alone(frame, place, jump, out);
        } else if (1..=CONTINUES).contains(&ahead) && !(held_jump <= 0 && goes_on) {
            // The jump goes on: it happened.
            self.counts.late += std::mem::take(&mut self.early);
            self.accept(held, Some(held_place), out);
            self.push(frame, out);
        } else if (1..held_jump).contains(&jump) && held_jump - jump <= CONTINUES {
            // The held one came too early, or its number is wrong: the next ones tell.
            self.early += 1;
            self.accept(frame, Some(place), out);
            self.held = Some(held);
        } else {
            self.refuse(&held, held_jump, last, goes_on);
            self.alone(frame, place, jump, out);
        }
    }

    /// True if a number lies a little back, behind the beginning of a gap: no board begins anew
    /// there, but damaged numbers that seemed to go on leave such a gap.
    fn returned(&self, number: i64, last: Last) -> bool {
        let behind = |[first, _]: &[i64; 2]| (*first..=last.number).contains(&number);
        last.number.saturating_sub(number) <= CONTINUES && self.missing.iter().any(behind)
    }

    /// Counts a held frame that the next one does not continue.
    fn refuse(&mut self, held: &Numbered<T>, jump: i64, last: Last, goes_on: bool) {
        let number = last.number.saturating_add(jump);
        let was_missing = |[first, end]: &[i64; 2]| (*first..=*end).contains(&number);
        if jump < 0 && goes_on && self.missing.iter().any(was_missing) {
            // It came too late: the frames behind it have gone out.
            self.counts.late += 1;
            self.refused += 1;
        } else if jump == 0 && held.fingerprint == last.fingerprint {
            self.counts.duplicate += 1;
        } else {
            self.counts.wrong += 1;
            self.refused += 1;
        }
        self.early = 0;
    }

    /// Gives out a frame that is held, at the end of a stream.
    pub(super) fn finish(&mut self, out: &mut Vec<Placed<T>>) {
        if let (Some(held), Some(last)) = (self.held.take(), self.last) {
            self.counts.late += std::mem::take(&mut self.early);
            let place = self.place(&held, last);
            if place.plausible && place.number > last.number {
                self.accept(held, Some(place), out);
            } else {
                self.counts.wrong += 1;
            }
        }
    }

    /// A frame when none is held.
    fn alone(&mut self, frame: Numbered<T>, place: Place, jump: i64, out: &mut Vec<Placed<T>>) {
        if jump == 1 {
            self.accept(frame, Some(place), out);
        } else if jump == 0
            && self
                .last
                .is_some_and(|last| last.fingerprint == frame.fingerprint)
        {
            self.counts.duplicate += 1;
        } else {
            self.held = Some(frame);
        }
    }

    /// How far `number` is behind `from` on the wire: forward, or back where that is shorter.
    fn distance(&self, from: i64, number: i64) -> i64 {
        let ahead = number.wrapping_sub(from);
        match self.modulus {
            None => ahead,
            Some(modulus) => {
                let ahead = ahead.rem_euclid(modulus);
                if ahead > modulus / 2 {
                    ahead - modulus
                } else {
                    ahead
                }
            }
        }
    }

    fn place(&self, frame: &Numbered<T>, last: Last) -> Place {
        let ahead = self.distance(last.raw, frame.number.cast_signed());
        let near = last.number.saturating_add(ahead);
        let expected = frame.time.and_then(|time| self.expected(time, last));
        let Some((expected, uncertainty)) = expected else {
            return Place {
                number: near,
                certain: true,
                plausible: true,
            };
        };
        let Some(modulus) = self.modulus else {
            let plausible = (near as f64 - expected).abs() <= uncertainty + CONTINUES as f64;
            return Place {
                number: near,
                certain: true,
                plausible,
            };
        };
        let half = modulus as f64 / 2.0;
        if uncertainty >= half {
            // Time does not tell; the shortest way forward, and no word on its length.
            let long = expected - last.number as f64 > half;
            return Place {
                number: near,
                certain: !long,
                plausible: true,
            };
        }
        let turns = ((expected - near as f64) / modulus as f64).round();
        let number = near + turns as i64 * modulus;
        let plausible = (number as f64 - expected).abs() <= uncertainty + CONTINUES as f64;
        Place {
            number,
            certain: true,
            plausible,
        }
    }

    /// The number that time says, and how far it may be off.
    fn expected(&self, time: f64, last: Last) -> Option<(f64, f64)> {
        if self.recent.len() < OFFSETS / 4 {
            return None;
        }
        let (rate, error, span) = self.rate()?;
        let mut offsets = [0.0; OFFSETS];
        let offsets = &mut offsets[..self.recent.len()];
        for (offset, (number, at)) in offsets.iter_mut().zip(&self.recent) {
            *offset = (number - last.number) as f64 - rate * (at - time);
        }
        offsets.sort_unstable_by(f64::total_cmp);
        let ahead = offsets[offsets.len() / 2];
        let spread = offsets[offsets.len() - 1] - offsets[0];
        let expected = last.number as f64 + ahead;
        // The stamps that the rate was measured from are as uncertain as these.
        let error = error + 2.0 * spread / span;
        Some((expected, spread + error * ahead.abs() + 1.0))
    }

    /// Frames in a second, the relative error of it, and the frames that it was measured from.
    fn rate(&self) -> Option<(f64, f64, f64)> {
        let measured = || {
            let (first, last) = (self.rate_points.front()?, self.rate_points.back()?);
            let (frames, time) = ((last.0 - first.0) as f64, last.1 - first.1);
            (frames > 0.0 && time > 0.0).then(|| (frames / time, MEASURED_RATE, frames))
        };
        let stated = || Some((self.stated_rate?, STATED_RATE, f64::INFINITY));
        match measured() {
            Some(measured) if self.rate_points.len() > 3 => Some(measured),
            measured => stated().or(measured),
        }
    }

    /// The first frame after a reconnect: what was lost in between is not known.
    fn begin_anew(&mut self, frame: Numbered<T>, last: Last, out: &mut Vec<Placed<T>>) {
        let (raw, number) = (frame.number.cast_signed(), last.number.saturating_add(1));
        self.last = Some(Last {
            raw,
            number,
            fingerprint: frame.fingerprint,
        });
        if let Some(time) = frame.time {
            self.learn(number, time);
        }
        out.push(Placed {
            number: number.cast_unsigned(),
            restarted: true,
            frame: frame.frame,
        });
    }

    /// The number of a frame that comes in order; `None` if the counter begins anew.
    fn next_in_order(&self, place: Place, raw: i64, last: Last) -> Option<i64> {
        if place.plausible && place.number > last.number {
            return Some(place.number);
        }
        // Where the counter goes on as before a restart, that was none.
        let before = self
            .before_restart
            .and_then(|before| self.follows(before, raw, last));
        // Nor where it goes on at once: board or link have waited.
        before.or_else(|| self.follows(last, raw, last))
    }

    /// The number of a frame as `from` has it, if that comes soon behind the last.
    fn follows(&self, from: Last, raw: i64, last: Last) -> Option<i64> {
        let number = from.number.saturating_add(self.distance(from.raw, raw));
        (1..=CONTINUES)
            .contains(&number.saturating_sub(last.number))
            .then_some(number)
    }

    fn accept(&mut self, frame: Numbered<T>, place: Option<Place>, out: &mut Vec<Placed<T>>) {
        let raw = frame.number.cast_signed();
        let fingerprint = frame.fingerprint;
        let mut restarted = false;
        let number = match (self.last, place) {
            (Some(last), Some(place)) => {
                if let Some(number) = self.next_in_order(place, raw, last) {
                    let gap = number - last.number - 1;
                    self.counts.lost += gap.cast_unsigned();
                    if gap > 0 {
                        if self.missing.len() == GAPS {
                            self.missing.pop_front();
                        }
                        self.missing.push_back([last.number + 1, number - 1]);
                    }
                    if !place.certain || number != place.number {
                        self.counts.ambiguous += 1;
                    }
                    number
                } else {
                    // The counter begins anew: what was lost in between is not known.
                    restarted = true;
                    self.counts.restarts += 1;
                    self.counts.ambiguous += 1;
                    self.carry_over(frame.time);
                    self.before_restart = Some(last);
                    last.number.saturating_add(1)
                }
            }
            _ => raw,
        };
        self.last = Some(Last {
            raw,
            number,
            fingerprint,
        });
        if let Some(time) = frame.time {
            self.learn(number, time);
        }
        out.push(Placed {
            number: number.cast_unsigned(),
            restarted,
            frame: frame.frame,
        });
    }

    fn learn(&mut self, number: i64, time: f64) {
        let due = self
            .rate_points
            .back()
            .is_none_or(|(last, _)| number - last >= RATE_STRIDE);
        if due {
            if self.rate_points.len() == RATE_POINTS {
                self.rate_points.pop_front();
            }
            self.rate_points.push_back((number, time));
        }
        if self.recent.len() == OFFSETS {
            self.recent.pop_front();
        }
        self.recent.push_back((number, time));
    }

    /// A new connection: the next number begins anew behind the last.
    pub(super) fn reconnect(&mut self) {
        self.held = None;
        self.forget();
        self.fresh = self.last.is_some();
    }

    /// The counter begins anew at this time. What is known of the rate and of the delays holds
    /// on: without it the way back from a wrong restart would count as a loss.
    fn carry_over(&mut self, time: Option<f64>) {
        let Some((now, (_, last))) = time.zip(self.recent.back().copied()) else {
            return;
        };
        let Some((rate, ..)) = self.rate() else {
            return self.forget();
        };
        let moved = now - rate.recip() - last;
        let points = self.recent.iter_mut().chain(&mut self.rate_points);
        points.for_each(|(_, at)| *at += moved);
    }

    fn forget(&mut self) {
        self.recent.clear();
        self.rate_points.clear();
    }
}
