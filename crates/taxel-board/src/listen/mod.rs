//! The draft of a board file from the bytes that a board sends, with what speaks for it.
//!
//! Each way to cut the bytes that is possible is tried, its packets are looked at column by
//! column, and the file that follows is read by the decoder itself: what counts is how many of
//! the bytes it takes. Nothing is claimed that fewer than [`LEAST`] packets hold.

mod columns;
mod cuts;
mod text;

use std::fmt::Write as _;

use taxel_ground::work::Parts;

use crate::board::Board;
use crate::{Begin, Decoder, HelloFinder, board_file_of_hello};

/// Packets that a claim needs.
pub const LEAST: usize = 50;
/// Share of the bytes that a file must take before it is proposed.
const TAKEN: f64 = 0.9;

/// A board file for bytes that nobody described.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// The shipped board whose packets these are, if they are.
    pub shipped: Option<&'static str>,
    /// The board file, with comments.
    pub file: String,
    /// What speaks for it, one line each.
    pub evidence: Vec<String>,
    /// Frames that it finds in the bytes.
    pub frames: u64,
    /// Share of the bytes that are in them.
    pub taken: f64,
}

/// A way to read the bytes.
struct Proposal {
    /// The file behind schema and name.
    body: String,
    evidence: Vec<String>,
    found: Found,
    /// True if a number goes through the same values again and again, a packet each.
    cyclic: bool,
}

/// What speaks for a proposal, the strongest first: they are compared in this order.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
struct Found {
    check: bool,
    counter: bool,
    /// Bits of what is left to its numbers to say, below zero: the fewer, the more is explained.
    explained: f64,
    clock: bool,
    /// Bytes of head and tail.
    marks: usize,
}

/// Longest time between frames that a step of a clock may be, s.
const LONGEST_PERIOD: f64 = 1.0;

/// The unit in which a clock that grows by `step` from frame to frame is believed to count: the
/// largest in which frames are no more than a second apart.
fn unit_of_clock(step: f64) -> Option<&'static str> {
    let units = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    let fits = |(_, seconds): &(&str, f64)| step * seconds <= LONGEST_PERIOD;
    units.into_iter().find(fits).map(|(unit, _)| unit)
}

/// Drafts a board file from bytes; `rate` is that of the bytes a second, where it is known.
///
/// # Example
/// ```
/// let wire: Vec<u8> = (0..100_u32)
///     .flat_map(|n| format!("F: {},{}\n", n * n % 97, 500 + n % 7).into_bytes())
///     .collect();
/// let draft = taxel_board::listen(&wire, None).expect("lines of two numbers");
/// assert!(draft.file.contains("F: {value F},{value c1}"));
/// ```
///
/// # Errors
/// What was looked for and not found, one line each.
pub fn listen(bytes: &[u8], rate: Option<f64>) -> Result<Draft, Vec<String>> {
    if let Some(found) = shipped(bytes) {
        return Ok(found);
    }
    said(bytes).map_or_else(|| draft(bytes, rate), Ok)
}

/// The same for a board that is none of the shipped ones and says nothing itself.
///
/// # Errors
/// As [`listen`].
pub fn draft(bytes: &[u8], rate: Option<f64>) -> Result<Draft, Vec<String>> {
    let mut tried = Vec::new();
    // What is text is no packet.
    for proposals in [text::proposals, cuts::proposals] {
        let mut best: Option<(Found, Draft)> = None;
        let proposals = proposals(bytes);
        let parts = Parts::new("ways to read the bytes", proposals.len() as u64);
        for proposal in proposals {
            let is_better = best.as_ref().is_none_or(|(best, _)| proposal.found > *best);
            match judged(&proposal, bytes, rate) {
                Ok(draft) if is_better => best = Some((proposal.found, draft)),
                Ok(_) => {}
                Err(why) => tried.push(why),
            }
            parts.done(1);
        }
        if let Some((_, draft)) = best {
            return Ok(draft);
        }
    }
    if tried.is_empty() {
        tried.push(format!(
            "{} bytes: no lines of numbers, no packets between zeros or 0xc0, and no length at which {LEAST} packets have the same marks",
            bytes.len()
        ));
        tried.push(
            "packets whose length depends on what they hold, such as runs of zeros with their number, need a program that unpacks them: --source exec:\"PROGRAM\" with clients/python/taxel_source.py"
                .into(),
        );
    }
    Err(tried)
}

/// The file of a proposal, if its decoder takes the bytes.
fn judged(proposal: &Proposal, bytes: &[u8], rate: Option<f64>) -> Result<Draft, String> {
    let file = |rate: &str| {
        let mut text = String::from("# Drafted by taxel listen; what speaks for it:\n");
        for line in &proposal.evidence {
            let _ = writeln!(text, "# - {line}");
        }
        let _ = write!(
            text,
            "schema = 1\nname = \"board\"\n{rate}{}",
            proposal.body
        );
        text
    };
    let board = Board::parse("draft", &file("")).map_err(|error| {
        format!(
            "{}: not possible: {}",
            proposal.evidence.join("; "),
            error.message
        )
    })?;
    let (frames, taken) = taken(&board, bytes);
    let packets = board.frame_rule().required.len().max(1) as u64;
    if taken < TAKEN || frames * packets < LEAST as u64 {
        return Err(format!(
            "{}: only {:.0} % of the bytes are such packets",
            proposal.evidence.join("; "),
            100.0 * taken
        ));
    }
    let rate = rate.map(|bytes_a_second| bytes_a_second * frames as f64 / bytes.len() as f64);
    let rate = rate.map_or(String::new(), |rate| format!("rate = \"{rate:.1} Hz\"\n"));
    Ok(Draft {
        shipped: None,
        file: file(&rate),
        evidence: proposal.evidence.clone(),
        frames,
        taken,
    })
}

/// Frames of a board in bytes that begin anywhere, and the share of the bytes in them.
fn taken(board: &Board, bytes: &[u8]) -> (u64, f64) {
    let mut decoder = Decoder::new(board, Begin::Cut);
    decoder.push(bytes, None);
    decoder.finish();
    while decoder.next().is_some() {}
    let counts = decoder.counts();
    let lost = counts.passed_over + other_bytes(board, &counts, bytes.len());
    (
        counts.delivered,
        1.0 - lost as f64 / bytes.len().max(1) as f64,
    )
}

/// Bytes of whole lines and packets that hold no reading: about as long as the others.
fn other_bytes(board: &Board, counts: &crate::Counts, length: usize) -> u64 {
    let all = counts.delivered + counts.other + counts.bad_status + counts.damaged;
    let no_readings = counts.other + counts.bad_status + counts.damaged;
    let mean = length as u64 / all.max(1);
    let packets = board.frame_rule().required.len() as u64;
    no_readings * mean / packets.max(1)
}

/// The shipped board that most of the bytes are packets of.
fn shipped(bytes: &[u8]) -> Option<Draft> {
    let found = Board::shipped_names().filter_map(|name| {
        let board = Board::shipped(name).filter(|board| !board.says_hello())?;
        let (frames, taken) = taken(&board, bytes);
        (taken >= TAKEN && frames >= LEAST as u64).then_some((taken, frames, name))
    });
    let (taken, frames, name) = found.max_by(|one, other| one.0.total_cmp(&other.0))?;
    Some(Draft {
        shipped: Some(name),
        file: Board::shipped_text(name)?.to_owned(),
        evidence: vec![format!(
            "the packets are those of the shipped board {name}: {frames} frames, {:.1} % of the bytes",
            100.0 * taken
        )],
        frames,
        taken,
    })
}

/// What a board of taxel-wire-1 says itself.
fn said(bytes: &[u8]) -> Option<Draft> {
    let hello = HelloFinder::default().push(bytes)?;
    let file = board_file_of_hello(&hello).ok()?;
    let board = Board::parse("hello", &file).ok()?;
    let (frames, taken) = taken(&board, bytes);
    Some(Draft {
        shipped: None,
        evidence: vec![format!(
            "the board says itself what its frames hold (taxel-wire-1): {}, {} values",
            board.name,
            board.values().len()
        )],
        file,
        frames,
        taken,
    })
}
