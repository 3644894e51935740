//! Values of a frame that come in several packets, messages or lines.

use super::packet::Reading;
use crate::board::Board;
use crate::board::layout::FrameRule;

/// What has come of a frame.
#[derive(Debug, Clone)]
pub(super) struct Assembly {
    rule: FrameRule,
    values: Vec<f64>,
    come: Vec<bool>,
    sequence: Option<u64>,
    time: Option<f64>,
    bad_status: bool,
    /// Arrival of its first packet, ns.
    began_ns: Option<u64>,
    /// True before the first whole frame of a wire that begins anywhere.
    cut: bool,
    /// Frames of which some packets did not come.
    pub(super) incomplete: u64,
}

/// A whole frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Whole {
    pub(super) values: Vec<f64>,
    pub(super) sequence: Option<u64>,
    pub(super) time: Option<f64>,
    pub(super) bad_status: bool,
}

impl Assembly {
    /// `cut` for a wire that may begin within a frame.
    pub(super) fn new(board: &Board, cut: bool) -> Self {
        let rule = board.frame_rule();
        Self {
            values: vec![f64::NAN; board.values.len()],
            come: vec![false; rule.required.len()],
            rule,
            sequence: None,
            time: None,
            bad_status: false,
            began_ns: None,
            cut,
            incomplete: 0,
        }
    }

    /// Takes a packet that arrived at `host_ns`; the frame that it makes whole.
    pub(super) fn packet(&mut self, reading: &Reading, host_ns: Option<u64>) -> Option<Whole> {
        let required = self.rule.required[reading.slot];
        if required && self.is_another(reading, host_ns) {
            self.give_up();
        }
        if !self.begun() {
            self.began_ns = host_ns;
        }
        let places = reading.first..reading.first + reading.values.len();
        self.values[places].copy_from_slice(&reading.values);
        self.sequence = reading.sequence.or(self.sequence);
        self.time = reading.time.or(self.time);
        self.bad_status |= reading.bad_status;
        self.come[reading.slot] = required;
        let ends = match self.rule.ends_with {
            Some(slot) => reading.slot == slot,
            None => required,
        };
        if !ends {
            return None;
        }
        if self.come == self.rule.required {
            self.cut = false;
            let values = self.take();
            let whole = Whole {
                values,
                sequence: self.sequence.take(),
                time: self.time.take(),
                bad_status: std::mem::take(&mut self.bad_status),
            };
            return Some(whole);
        }
        if self.rule.ends_with.is_some() {
            self.give_up();
        }
        None
    }

    /// True if a packet belongs to another frame than what has come.
    fn is_another(&self, reading: &Reading, host_ns: Option<u64>) -> bool {
        let late = match (self.rule.within_ns, self.began_ns, host_ns) {
            (Some(within), Some(began), Some(now)) => now.saturating_sub(began) > within,
            _ => false,
        };
        let numbered = match (self.sequence, reading.sequence) {
            (Some(own), Some(other)) => own != other,
            _ => false,
        };
        self.begun() && (self.come[reading.slot] || late || numbered)
    }

    fn begun(&self) -> bool {
        self.come.contains(&true)
    }

    fn give_up(&mut self) {
        // What was sent before the first connection was not lost.
        self.incomplete += u64::from(!std::mem::take(&mut self.cut));
        self.clear();
    }

    /// A value of a line.
    pub(super) fn put(&mut self, place: usize, value: f64) {
        self.values[place] = value;
    }

    /// The values; the next frame begins.
    pub(super) fn take(&mut self) -> Vec<f64> {
        let values = self.values.clone();
        self.next_frame();
        values
    }

    /// A new connection.
    pub(super) fn reconnect(&mut self, cut: bool) {
        self.cut = cut;
        self.clear();
        self.values.fill(f64::NAN);
    }

    /// Forgets what has come.
    pub(super) fn clear(&mut self) {
        self.next_frame();
        self.sequence = None;
        self.time = None;
        self.bad_status = false;
    }

    fn next_frame(&mut self) {
        for (value, kept) in self.values.iter_mut().zip(&self.rule.kept) {
            if !kept {
                *value = f64::NAN;
            }
        }
        self.come.fill(false);
        self.began_ns = None;
    }
}
