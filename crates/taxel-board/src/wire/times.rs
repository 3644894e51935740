//! Device times of frames.

use super::board_times::{BoardTimes, Judged, LATEST_NS, Stamp};
use crate::board::DeviceClock;

/// Share of the difference between arrival and expectation that a time follows.
const FOLLOWS: f64 = 0.05;
/// Longer without a frame than so many periods, and this, is a silence, ns.
const SILENT_PERIODS: f64 = 8.0;
const SILENT_NS: f64 = 50e6;
/// Time between frames of which nothing tells it, ns.
const UNKNOWN_PERIOD_NS: f64 = 1e6;

/// Gives each frame a device time that never goes back.
#[derive(Debug, Clone)]
pub(super) struct Times {
    clock: Option<BoardTimes>,
    /// Nominal time between frames, ns.
    period_ns: Option<f64>,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    number: u64,
    time_ns: f64,
    host_ns: Option<u64>,
}

/// What is known of a frame's time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    /// Steps of the board's clock.
    pub(super) raw: Option<f64>,
    /// Number of the frame; with `counted` it is the board's.
    pub(super) number: u64,
    pub(super) counted: bool,
    pub(super) host_ns: Option<u64>,
    /// True if the board began anew before it.
    pub(super) restarted: bool,
}

/// A device time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timed {
    pub(super) time_ns: u64,
    /// True if it is not the board's own.
    pub(super) inferred: bool,
    /// True if the clock of the board began anew.
    pub(super) restarted: bool,
}

impl Times {
    pub(super) fn new(clock: Option<DeviceClock>, rate: Option<f64>) -> Self {
        Self {
            clock: clock.map(BoardTimes::new),
            period_ns: rate.map(|rate| 1e9 / rate),
            last: None,
        }
    }

    /// Times of the board's clock that were wrong.
    pub(super) fn wrong(&self) -> u64 {
        self.clock.as_ref().map_or(0, BoardTimes::wrong)
    }

    /// The end, or a new connection: what waits for the next frame is decided.
    pub(super) fn finish(&mut self) {
        if let Some(clock) = &mut self.clock {
            clock.finish();
        }
    }

    pub(super) fn time(&mut self, known: Known) -> Timed {
        let judged = self.of_clock(known);
        let (time_ns, inferred) = match judged {
            Some(Judged::Right(time_ns) | Judged::Anew(time_ns)) => (time_ns, false),
            Some(Judged::Wrong) => (self.instead(known), true),
            None => (self.without_clock(known), true),
        };
        let least = self.last.map_or(0.0, |last| last.time_ns);
        let time_ns = time_ns.max(least).min(LATEST_NS);
        if let (Some(clock), Some(Judged::Wrong)) = (&mut self.clock, judged) {
            clock.gave(time_ns);
        }
        self.last = Some(Last {
            number: known.number,
            time_ns,
            host_ns: known.host_ns,
        });
        Timed {
            time_ns: time_ns as u64,
            inferred,
            restarted: known.restarted || matches!(judged, Some(Judged::Anew(_))),
        }
    }

    /// By the clock of the board; `None` without one.
    fn of_clock(&mut self, known: Known) -> Option<Judged> {
        let anew = known.restarted || self.clock.as_ref()?.begins_anew();
        let begins_ns = (anew && self.last.is_some()).then(|| self.instead(known));
        let clock = self.clock.as_mut()?;
        let Some(raw) = known.raw else {
            return Some(Judged::Wrong);
        };
        let stamp = Stamp {
            raw,
            number: known.number,
            host_ns: known.host_ns,
        };
        Some(if anew {
            clock.begin(stamp, begins_ns)
        } else {
            clock.judge(stamp)
        })
    }

    /// Time of a frame whose own is wrong: as far behind the last as frames usually are, or as
    /// their arrival is after a silence.
    fn instead(&self, known: Known) -> f64 {
        let Some(last) = self.last else {
            return 0.0;
        };
        let usual = self.clock.as_ref().and_then(BoardTimes::usual);
        let frames = known.number.saturating_sub(last.number).max(1) as f64;
        let expected = usual.or(self.period_ns).map(|period| frames * period);
        let elapsed = known.host_ns.zip(last.host_ns);
        let elapsed = elapsed.map(|(now, then)| now.saturating_sub(then) as f64);
        last.time_ns
            + match (expected, elapsed) {
                (_, Some(elapsed)) if known.restarted => elapsed.max(1.0),
                (Some(expected), Some(elapsed)) if is_silence(elapsed, expected) => elapsed,
                (Some(expected), _) => expected,
                (None, Some(elapsed)) => elapsed,
                (None, None) => UNKNOWN_PERIOD_NS,
            }
    }

    /// By the counter and the nominal rate, or by the arrival.
    fn without_clock(&self, known: Known) -> f64 {
        let Some(last) = self.last else {
            return match (self.period_ns, known.host_ns) {
                (Some(period), _) if known.counted => known.number as f64 * period,
                (_, host_ns) => host_ns.unwrap_or(0) as f64,
            };
        };
        let elapsed = known
            .host_ns
            .zip(last.host_ns)
            .map(|(now, then)| now.saturating_sub(then) as f64);
        let frames = known.number.saturating_sub(last.number).max(1) as f64;
        match (self.period_ns, known.host_ns, elapsed) {
            // A restart or a reconnect: the time in between is that of the arrival.
            (_, Some(_), Some(elapsed)) if known.restarted => last.time_ns + elapsed.max(1.0),
            (Some(period), _, _) if known.counted => last.time_ns + frames * period,
            (Some(period), Some(host), Some(elapsed)) => {
                // Frames that come in bursts are as far apart as their rate says; the arrival
                // draws the time slowly, and a silence is one.
                let expected = last.time_ns + frames * period;
                if is_silence(elapsed, period) {
                    return last.time_ns + elapsed;
                }
                let drawn = expected + FOLLOWS * (host as f64 - expected);
                if (host as f64 - expected).abs() > 1e9 {
                    (host as f64).max(last.time_ns + 1.0)
                } else {
                    drawn.max(last.time_ns + 0.1 * period)
                }
            }
            (Some(period), _, _) => last.time_ns + frames * period,
            (None, Some(host), _) => (host as f64).max(last.time_ns + 1.0),
            (None, None, _) => last.time_ns + UNKNOWN_PERIOD_NS,
        }
    }
}

fn is_silence(elapsed: f64, period: f64) -> bool {
    elapsed > SILENT_PERIODS * period + SILENT_NS
}
