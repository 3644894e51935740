//! The counter of a board as it is on the wire: numbers of frames, and what it shows of how it
//! counts.

use crate::board::Counter;

/// Numbers that all say the same before it is said: as many as `taxel listen` asks of a check.
const ENOUGH: u64 = 50;
/// Turns that all begin anew at the same number.
const TURNS: u64 = 3;

/// Makes numbers of frames of a counter.
#[derive(Debug, Clone)]
pub(super) struct FrameCounter {
    counter: Counter,
    last: Option<u64>,
    /// Frames of the last number before this one.
    same: u64,
    seen: Seen,
}

/// What the numbers on the wire have in common.
#[derive(Debug, Clone, Default)]
struct Seen {
    /// Steps from one number to another, and the step, while all are alike.
    steps: u64,
    step: Option<u64>,
    unlike: bool,
    /// Runs of one number, and their length, while all are alike.
    runs: u64,
    run: Option<u64>,
    uneven: bool,
    /// Turns to zero, and the number before, while all are alike.
    turns: u64,
    top: Option<u64>,
    scattered: bool,
}

impl FrameCounter {
    pub(super) fn new(counter: Counter) -> Self {
        Self {
            counter,
            last: None,
            same: 0,
            seen: Seen::default(),
        }
    }

    /// The number of the next frame, whose counter reads `raw`.
    pub(super) fn frame(&mut self, raw: u64) -> u64 {
        match self.last {
            Some(last) if last == raw => self.same += 1,
            Some(last) => {
                self.seen.run(self.same + 1);
                self.seen.step(last, raw);
                self.same = 0;
            }
            None => {}
        }
        self.last = Some(raw);
        self.counter.frame(raw, self.same)
    }

    /// A new connection: the next number goes on from none.
    pub(super) fn reconnect(&mut self) {
        (self.last, self.same) = (None, 0);
    }

    /// What the board file should say of it.
    pub(super) fn remark(&self) -> Option<String> {
        let seen = &self.seen;
        let [step, repeats] = self.counter.counts();
        if let Some(top) = seen.top
            && !seen.scattered
            && seen.turns >= TURNS
            && self.counter.numbers() != Some(top + seen.step.unwrap_or(1))
        {
            let modulus = top + seen.step.unwrap_or(1);
            return Some(format!(
                "the counter began anew {} times, each time behind {top}: write modulus = {modulus} for the sequence",
                seen.turns
            ));
        }
        if let Some(found) = seen.step
            && !seen.unlike
            && seen.steps >= ENOUGH
            && found != step
        {
            return Some(format!(
                "all {} differences of the counter are {found}: write step = {found} for the sequence",
                seen.steps
            ));
        }
        if let Some(found) = seen.run
            && !seen.uneven
            && seen.runs >= ENOUGH
            && found != repeats
        {
            return Some(format!(
                "each of {} numbers of the counter came {found} times: write repeats = {found} for the sequence",
                seen.runs
            ));
        }
        None
    }
}

impl Seen {
    fn step(&mut self, last: u64, raw: u64) {
        if raw < last {
            // Anew: from zero, or it is no turn of a counter.
            self.turns += 1;
            self.scattered |= raw != 0 || self.top.is_some_and(|top| top != last);
            self.top = Some(last);
            return;
        }
        self.steps += 1;
        self.unlike |= self.step.is_some_and(|step| step != raw - last);
        self.step = Some(raw - last);
    }

    /// The first run may have begun before.
    fn run(&mut self, length: u64) {
        self.runs += 1;
        if self.runs > 1 {
            self.uneven |= self.run.is_some_and(|run| run != length);
            self.run = Some(length);
        }
    }
}
