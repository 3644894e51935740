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
/// Frames between two that the rate is measured from, and the most of them.
const RATE_STRIDE: i64 = 64;
const RATE_POINTS: usize = 32;
/// Relative error of a rate that is stated, and of one that was measured.
const STATED_RATE: f64 = 0.05;
const MEASURED_RATE: f64 = 2e-3;

/// A frame with its number, to be placed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbered<T> {
    /// Number on the wire.
    pub(super) number: u64,
    /// Time, s, of the device or of its arrival.
    pub(super) time: Option<f64>,
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
    /// True if the next number begins anew.
    fresh: bool,
    /// Frames refused since the last that was placed.
    refused: i64,
    counts: NumberCounts,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    /// Number on the wire.
    raw: i64,
    /// Number given out.
    number: i64,
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
            modulus: modulus.map(|modulus| modulus as i64),
            stated_rate,
            last: None,
            recent: VecDeque::new(),
            fresh: false,
            rate_points: VecDeque::new(),
            held: None,
            refused: 0,
            counts: NumberCounts::default(),
        }
    }

    pub(super) fn counts(&self) -> NumberCounts {
        self.counts
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
        let jump = place.number - last.number;
        let Some(held) = self.held.take() else {
            self.alone(frame, place, jump, out);
            return;
        };
        let ahead = self.distance(held.number as i64, frame.number as i64);
        if (1..=CONTINUES).contains(&ahead) {
            // The jump goes on: it happened.
            let place = self.place(&held, last);
            self.accept(held, Some(place), out);
            self.push(frame, out);
            return;
        }
        let held_jump = self.place(&held, last).number - last.number;
        let between = (1..held_jump).contains(&jump) && held_jump - jump <= CONTINUES;
        if between {
            // The held one came too early.
            self.counts.late += 1;
            self.accept(frame, Some(place), out);
            if held_jump - jump == 1 {
                self.push(held, out);
            } else {
                self.held = Some(held);
            }
            return;
        }
        if (-CONTINUES..0).contains(&held_jump) && (1..=CONTINUES).contains(&jump) {
            // The held one came too late; the frames behind it have gone out.
            self.counts.late += 1;
            self.counts.lost = self.counts.lost.saturating_sub(1);
        } else if held_jump == 0 {
            self.counts.duplicate += 1;
        } else {
            self.counts.wrong += 1;
            self.refused += 1;
        }
        self.alone(frame, place, jump, out);
    }

    /// Gives out a frame that is held, at the end of a stream.
    pub(super) fn finish(&mut self, out: &mut Vec<Placed<T>>) {
        if let (Some(held), Some(last)) = (self.held.take(), self.last) {
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
        } else if jump == 0 && place.plausible {
            self.counts.duplicate += 1;
        } else {
            self.held = Some(frame);
        }
    }

    /// How far `number` is behind `from` on the wire: forward, or back where that is shorter.
    fn distance(&self, from: i64, number: i64) -> i64 {
        let ahead = number - from;
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
        let ahead = self.distance(last.raw, frame.number as i64);
        let near = last.number + ahead;
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
        let (rate, error) = self.rate()?;
        let mut offsets = [0.0; OFFSETS];
        let offsets = &mut offsets[..self.recent.len()];
        for (offset, (number, at)) in offsets.iter_mut().zip(&self.recent) {
            *offset = (number - last.number) as f64 - rate * (at - time);
        }
        offsets.sort_unstable_by(f64::total_cmp);
        let ahead = offsets[offsets.len() / 2];
        let spread = offsets[offsets.len() - 1] - offsets[0];
        let expected = last.number as f64 + ahead;
        Some((expected, spread + error * ahead.abs() + 1.0))
    }

    /// Frames in a second and the relative error of it.
    fn rate(&self) -> Option<(f64, f64)> {
        let measured = || {
            let (first, last) = (self.rate_points.front()?, self.rate_points.back()?);
            let time = last.1 - first.1;
            (last.0 > first.0 && time > 0.0).then(|| (last.0 - first.0) as f64 / time)
        };
        match (measured(), self.stated_rate) {
            (Some(rate), _) => Some((rate, MEASURED_RATE)),
            (None, Some(rate)) => Some((rate, STATED_RATE)),
            (None, None) => None,
        }
    }

    /// The first frame after a reconnect: what was lost in between is not known.
    fn begin_anew(&mut self, frame: Numbered<T>, last: Last, out: &mut Vec<Placed<T>>) {
        let (raw, number) = (frame.number as i64, last.number + 1);
        self.last = Some(Last { raw, number });
        if let Some(time) = frame.time {
            self.learn(number, time);
        }
        out.push(Placed {
            number: number.cast_unsigned(),
            restarted: true,
            frame: frame.frame,
        });
    }

    fn accept(&mut self, frame: Numbered<T>, place: Option<Place>, out: &mut Vec<Placed<T>>) {
        let raw = frame.number as i64;
        let mut restarted = false;
        let number = match (self.last, place) {
            (Some(last), Some(place)) => {
                if place.plausible && place.number > last.number {
                    let gap = place.number - last.number - 1 - self.refused;
                    self.counts.lost += gap.max(0).cast_unsigned();
                    if !place.certain {
                        self.counts.ambiguous += 1;
                    }
                    place.number
                } else {
                    // The counter begins anew: what was lost in between is not known.
                    restarted = true;
                    self.counts.restarts += 1;
                    self.counts.ambiguous += 1;
                    self.forget();
                    last.number + 1
                }
            }
            _ => raw,
        };
        self.refused = 0;
        self.last = Some(Last { raw, number });
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
        self.refused = 0;
        self.fresh = self.last.is_some();
    }

    fn forget(&mut self) {
        self.recent.clear();
        self.rate_points.clear();
    }
}
