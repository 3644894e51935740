//! How fast frames come, beside the rate that the board file states.

use std::collections::VecDeque;

use super::numbering::STATED_RATE;

/// A rate is measured over so much time, ns, again and again.
const WINDOW_NS: f64 = 1e9;
/// The median of the last windows is the measured rate: pauses of the link fall into few of
/// them. With fewer than these it is not known.
const WINDOWS: usize = 9;
const FEW: usize = 5;
/// Frames that come so many times as fast as stated, or faster, come out of a store.
const STORED: f64 = 20.0;
/// But a clock that runs so many times as fast has another unit.
const UNITS: [f64; 3] = [1e3, 1e6, 1e9];

/// What is known of the time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Passed {
    /// Frames of the board so far.
    pub(super) frames: u64,
    /// Time of the board's clock, ns.
    pub(super) board_ns: Option<f64>,
    /// Arrival, ns.
    pub(super) host_ns: Option<u64>,
}

/// Something that does not agree with the arrival of the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Disagrees {
    /// The rate: frames a second of the board, as they come.
    Rate(f64),
    /// The clock: its seconds in one of this computer.
    Clock(f64),
}

/// Measures rate and clock of a board.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    stated: Option<f64>,
    begin: Option<Passed>,
    /// Frames a second in the last windows.
    rates: VecDeque<f64>,
    /// Seconds of the clock in one of this computer, in the last windows.
    clocks: VecDeque<f64>,
    /// What has been found first; it stays as long as it holds.
    found: Option<Disagrees>,
}

impl Pace {
    pub(super) fn new(stated: Option<f64>) -> Self {
        Self {
            stated,
            begin: None,
            rates: VecDeque::with_capacity(WINDOWS + 1),
            clocks: VecDeque::with_capacity(WINDOWS + 1),
            found: None,
        }
    }

    /// What disagrees.
    pub(super) fn found(&self) -> Option<Disagrees> {
        self.found
    }

    /// Takes a frame.
    pub(super) fn push(&mut self, passed: Passed) {
        let Some(begin) = self.begin else {
            self.begin = Some(passed);
            return;
        };
        let board_ns = begin.board_ns.zip(passed.board_ns);
        let board_ns = board_ns.map(|(from, to)| to - from);
        let host_ns = begin.host_ns.zip(passed.host_ns);
        let host_ns = host_ns.map(|(from, to)| to.saturating_sub(from) as f64);
        let Some(window) = host_ns.or(board_ns) else {
            return;
        };
        if window < 0.0 {
            // The board began anew.
            self.begin = Some(passed);
        }
        if window < WINDOW_NS {
            return;
        }
        self.begin = Some(passed);
        let frames = passed.frames.saturating_sub(begin.frames) as f64;
        put(&mut self.rates, frames * 1e9 / window);
        if let Some((board_ns, host_ns)) = board_ns.zip(host_ns)
            && board_ns >= 0.0
        {
            put(&mut self.clocks, board_ns / host_ns);
        }
        self.found = self.find();
    }

    /// A new connection.
    pub(super) fn reconnect(&mut self) {
        self.begin = None;
    }

    fn find(&self) -> Option<Disagrees> {
        let differs = |ratio: f64| (ratio - 1.0).abs() > STATED_RATE;
        let unit = |ratio: f64| UNITS.iter().any(|unit| !differs(ratio / unit));
        let clock = median(&self.clocks)
            .filter(|ratio| differs(*ratio) && (*ratio < STORED || unit(*ratio)))
            .map(Disagrees::Clock);
        let rate = median(&self.rates)
            .zip(self.stated)
            .filter(|(rate, stated)| differs(rate / stated) && rate / stated < STORED)
            .map(|(rate, _)| Disagrees::Rate(rate));
        match (clock.or(rate), self.found) {
            // The figure that was told does not flicker.
            (Some(Disagrees::Rate(now)), Some(Disagrees::Rate(told)))
                if (now / told - 1.0).abs() < STATED_RATE =>
            {
                self.found
            }
            (found, _) => found,
        }
    }
}

fn put(last: &mut VecDeque<f64>, value: f64) {
    if last.len() == WINDOWS {
        last.pop_front();
    }
    last.push_back(value);
}

fn median(last: &VecDeque<f64>) -> Option<f64> {
    if last.len() < FEW {
        return None;
    }
    let mut sorted: Vec<f64> = last.iter().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    Some(sorted[sorted.len() / 2])
}
