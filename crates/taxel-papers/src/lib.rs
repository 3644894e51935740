//! Every printed number of the four papers, compared with ours.
//!
//! One table per paper, `papers/p1.toml` to `p4.toml`, holds each printed number once, with its
//! place, digits, unit, kind and verdict. [`Paper::ledger`] computes ours for
//! each row; the report (`taxel reproduce`), the tests and the pages of `docs/papers` read the
//! same ledger.
//!
//! ```
//! use taxel_papers::{Paper, Verdict};
//!
//! let ledger = Paper::P4.ledger();
//! let entry = ledger.entry("device_thickness").expect("a row of papers/p4.toml");
//! assert_eq!(entry.row.printed, "350 um");
//! // The printed layers add up to 420 um.
//! assert!((entry.ours.expect("a number") - 420.0).abs() < 1e-9);
//! assert_eq!(entry.verdict, Verdict::Contradicts);
//! ```
//!
//! The verdict is derived: ours agrees when it rounds, or is cut off, to the printed digits; what
//! follows from printed numbers is known to their digits alone. Where it does not agree, the row
//! names the reason. Values of runs that take minutes stand in the table as well, with
//! the command that gave them and a test that repeats part of them ([`Run`]).

mod ledger;
mod notation;
mod p1;
mod p2;
mod p3;
mod p4;
mod page;
mod paper;
mod report;
mod table;

pub use ledger::{Entry, Ledger, PaperFigure};
pub use page::page;
pub use paper::Paper;
pub use report::{html, json, text};
pub use table::{Kind, Row, Run, Table, Verdict};

impl Paper {
    /// Printed statements beside our values, computed now.
    pub fn ledger(self) -> Ledger {
        let mut ours = ledger::Ours::new(self.table());
        match self {
            Self::P1 => p1::fill(&mut ours),
            Self::P2 => p2::fill(&mut ours),
            Self::P3 => p3::fill(&mut ours),
            Self::P4 => p4::fill(&mut ours),
        }
        Ledger::new(self, ours)
    }
}
