//! Device times of frames.

use crate::board::DeviceClock;

/// Longest step back of a clock that does not begin again that is taken for its end, as a
/// share of its numbers.
const HALF: f64 = 0.5;
/// Share of the difference between arrival and expectation that a time follows.
const FOLLOWS: f64 = 0.05;

/// Gives each frame a device time that never goes back.
#[derive(Debug, Clone)]
pub(super) struct Times {
    clock: Option<DeviceClock>,
    /// Nominal time between frames, ns.
    period_ns: Option<f64>,
    last: Option<Last>,
}

#[derive(Debug, Clone, Copy)]
struct Last {
    /// Steps of the board's clock.
    raw: f64,
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
    /// True if the clock of the board went back.
    pub(super) restarted: bool,
}

impl Times {
    pub(super) fn new(clock: Option<DeviceClock>, rate: Option<f64>) -> Self {
        Self {
            clock,
            period_ns: rate.map(|rate| 1e9 / rate),
            last: None,
        }
    }

    pub(super) fn time(&mut self, known: Known) -> Timed {
        let mut restarted = known.restarted;
        let (time_ns, inferred) = match (self.clock, known.raw) {
            (Some(clock), Some(raw)) => {
                let (time_ns, back) = self.of_clock(clock, raw, known);
                restarted |= back;
                (time_ns, false)
            }
            _ => (self.without_clock(known), true),
        };
        self.last = Some(Last {
            raw: known.raw.unwrap_or(0.0),
            number: known.number,
            time_ns,
            host_ns: known.host_ns,
        });
        Timed {
            time_ns: time_ns as u64,
            inferred,
            restarted,
        }
    }

    /// By the clock of the board; true if it went back.
    fn of_clock(&self, clock: DeviceClock, raw: f64, known: Known) -> (f64, bool) {
        let Some(last) = self.last else {
            return (raw * clock.step_ns, false);
        };
        let ahead = raw - last.raw;
        let ahead = match clock.modulus {
            Some(modulus) if !known.restarted => {
                let modulus = modulus as f64;
                let once = ahead.rem_euclid(modulus);
                // More than once around: the arrival says how often.
                let elapsed = known
                    .host_ns
                    .zip(last.host_ns)
                    .map(|(now, then)| now.saturating_sub(then) as f64 / clock.step_ns);
                let turns =
                    elapsed.map_or(0.0, |elapsed| ((elapsed - once) / modulus).round().max(0.0));
                if once > HALF * modulus && elapsed.is_none_or(|elapsed| elapsed < HALF * once) {
                    once - modulus
                } else {
                    once + turns * modulus
                }
            }
            _ => ahead,
        };
        if ahead >= 0.0 && !known.restarted {
            (last.time_ns + ahead * clock.step_ns, false)
        } else {
            (self.without_clock(known), true)
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
                if elapsed > 8.0 * period + 50e6 {
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
            (None, None, _) => last.time_ns + 1e6,
        }
    }
}
