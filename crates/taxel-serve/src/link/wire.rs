//! What a link needs to know of the wire: how bytes become frames.

use serde::Serialize;
use taxel::acquisition::Frame;

/// Makes frames of bytes; one for the life of a source, over all its connections.
pub trait Decode: Send {
    /// Takes the bytes that arrived at `host_ns`.
    fn push(&mut self, bytes: &[u8], host_ns: u64);

    /// The next whole frame of what was taken.
    fn next(&mut self) -> Option<Frame>;

    /// There is no more: what was held back comes now.
    fn finish(&mut self) {}

    /// A new connection begins: nothing continues what came before.
    fn reconnected(&mut self);

    /// What the board should be asked now, again and again until this is empty.
    fn question(&self) -> &[u8] {
        &[]
    }

    /// Why nothing more is decoded: the board says now that its frames hold something else.
    fn changed(&self) -> Option<&str> {
        None
    }

    /// What was counted so far.
    fn counts(&self) -> WireCounts;

    /// Name of the board.
    fn board(&self) -> String;

    /// Letter of the class of its wire: how surely damage is seen.
    fn wire_class(&self) -> char;

    /// True if the wire carries lines of text.
    fn expects_text(&self) -> bool;

    /// What the operator should change in the description of the board, by what came so far:
    /// one line.
    fn remark(&self) -> Option<String> {
        None
    }

    /// Names of other known boards whose packets `sample` has.
    fn others(&self, sample: &[u8]) -> Vec<String>;
}

/// Counts of a wire since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct WireCounts {
    /// Frames delivered.
    pub delivered: u64,
    /// Frames that the board numbered and that did not come; `None` where the wire cannot tell.
    pub lost: Option<u64>,
    /// Frames that are missing by rate and silence, where no counter says it: an estimate;
    /// `None` where the board has neither counter nor rate.
    pub missing_estimate: Option<u64>,
    /// Stretches of the wire with a damaged packet.
    pub damaged: u64,
    /// Bytes that belong to no packet.
    pub passed_over_bytes: u64,
    /// Whole packets or lines that hold no reading.
    pub other: u64,
    /// Packets whose status is not good.
    pub bad_status: u64,
    /// Frames whose number does not fit those around it.
    pub wrong_number: u64,
    /// Frames whose time fits neither those around it nor the arrival; they got another.
    pub wrong_time: u64,
    /// Frames with a large step that the next one did not confirm.
    pub unconfirmed: u64,
    /// Frames of several packets of which some did not come.
    pub incomplete: u64,
    /// Frames older than the newest.
    pub late: u64,
    /// Frames that came twice.
    pub duplicate: u64,
    /// Gaps whose length the counter cannot tell.
    pub ambiguous: u64,
    /// Times that counter or clock of the board began again.
    pub restarts: u64,
}

impl WireCounts {
    /// True if nothing was lost, damaged or refused.
    pub fn is_clean(&self) -> bool {
        let missing = self.lost.unwrap_or(0) + self.missing_estimate.unwrap_or(0);
        let damaged = self.damaged + self.bad_status + self.incomplete;
        let refused = self.wrong_number + self.wrong_time + self.unconfirmed;
        missing + damaged + refused == 0
    }
}

/// What is said to a board.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Greeting {
    /// After each connect.
    pub start: Vec<u8>,
    /// At the end.
    pub stop: Vec<u8>,
    /// Again and again, for boards that must be asked.
    pub poll: Option<Poll>,
}

/// A question to a board that answers with a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Poll {
    /// The question.
    pub send: Vec<u8>,
    /// Time between questions, s.
    pub every: f64,
}
