//! What came off a wire, and what did not.

/// What came off a wire, each kind counted apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames delivered.
    pub delivered: u64,
    /// Frames that the board numbered and that did not come; `None` without a counter: then it
    /// is not known.
    pub lost: Option<u64>,
    /// Frames that are missing by rate and silence, where no counter says it: an estimate;
    /// `None` without a counter and without a rate: then there is none.
    pub missing_estimate: Option<u64>,
    /// Gaps of the counter whose length in time is not known to half of its numbers.
    pub ambiguous: u64,
    /// Stretches of the wire that hold a damaged packet: a mark, a length, a check or a range
    /// does not hold.
    pub damaged: u64,
    /// Frames whose number does not fit the numbers before and behind it.
    pub wrong_number: u64,
    /// Frames whose time fits neither the times around it nor the arrival; they are delivered
    /// with a time that follows from those.
    pub wrong_time: u64,
    /// Frames that were held back for a large step, which the next frame did not confirm.
    pub unconfirmed: u64,
    /// Bytes that belong to no packet.
    pub passed_over: u64,
    /// Whole packets or lines that hold no reading.
    pub other: u64,
    /// Whole packets whose status is not good.
    pub bad_status: u64,
    /// Frames that came after one with a higher number.
    pub late: u64,
    /// Frames with the number of the one before.
    pub duplicate: u64,
    /// Frames of several packets of which some did not come.
    pub incomplete: u64,
    /// Times that counter or clock of the board began again.
    pub restarts: u64,
    /// Connects after the first.
    pub reconnects: u64,
}

impl Counts {
    /// Frames that were there and were not delivered.
    pub fn refused(&self) -> u64 {
        self.wrong_number + self.unconfirmed + self.bad_status + self.incomplete
    }

    /// True if nothing was lost, damaged or refused.
    pub fn is_clean(&self) -> bool {
        self.lost.unwrap_or(0) == 0
            && self.missing_estimate.unwrap_or(0) == 0
            && self.damaged == 0
            && self.wrong_time == 0
            && self.refused() == 0
    }
}
