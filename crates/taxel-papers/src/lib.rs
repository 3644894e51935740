//! Every printed number of the four papers beside ours.
//!
//! One table per paper, `papers/p1.toml` to `p4.toml`, holds what is printed: place, digits,
//! unit, kind and verdict. The number stands there once. [`Paper::ledger`] computes ours beside
//! each row; the report (`taxel reproduce`), the tests and the pages of `docs/papers` read the
//! same ledger.
//!
//! ```
//! use taxel_papers::{Paper, Verdict};
//!
//! let ledger = Paper::P4.ledger();
//! let entry = ledger.entry("rest_resistance").expect("a row of papers/p4.toml");
//! assert_eq!(entry.row.printed, "3.67 ohm");
//! // Equation 3 with the printed supply and reference resistor says 3.378 ohm.
//! assert!((entry.ours.expect("a number") - 3.378).abs() < 5e-4);
//! assert_eq!(entry.verdict, Verdict::Contradicts);
//! ```
//!
//! The verdict is derived: ours agrees when it rounds to the printed digits. Where it does not,
//! the row names the reason. Values of runs that take minutes stand in the table as well, with
//! the command that gave them and a test that repeats part of them ([`Run`]).

mod ledger;
mod p1;
mod p2;
mod p3;
mod p4;
mod page;
mod report;
mod table;

use std::sync::LazyLock;

use serde::Deserialize;

pub use ledger::{Entry, Ledger, PaperFigure};
pub use page::page;
pub use report::{html, json, text};
pub use table::{Kind, Row, Run, Table};

/// One of the four papers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paper {
    /// In-plane capacitive sensor.
    P1,
    /// Three-axis capacitive array.
    P2,
    /// Piezoelectric array.
    P3,
    /// Liquid-metal array.
    P4,
}

static TABLES: [LazyLock<Table>; 4] = [
    LazyLock::new(|| table(include_str!("../papers/p1.toml"))),
    LazyLock::new(|| table(include_str!("../papers/p2.toml"))),
    LazyLock::new(|| table(include_str!("../papers/p3.toml"))),
    LazyLock::new(|| table(include_str!("../papers/p4.toml"))),
];

fn table(text: &str) -> Table {
    Table::parse(text).expect("the tables are part of the program; the tests read all of them")
}

impl Paper {
    /// All papers.
    pub const ALL: [Self; 4] = [Self::P1, Self::P2, Self::P3, Self::P4];

    /// Name, such as `P2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::P1 => "P1",
            Self::P2 => "P2",
            Self::P3 => "P3",
            Self::P4 => "P4",
        }
    }

    /// Title of the paper.
    pub fn title(self) -> &'static str {
        &self.table().title
    }

    /// What the paper prints.
    pub fn table(self) -> &'static Table {
        &TABLES[self as usize]
    }

    /// What the paper prints beside ours, computed now.
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

/// What became of a printed statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Ours rounds to what is printed.
    Reproduced,
    /// It follows from other printed numbers, without any model.
    Follows,
    /// It contradicts another printed number.
    Contradicts,
    /// What is printed does not determine it.
    NotDetermined,
    /// It needs a field solution.
    AwaitsFieldSolver,
    /// Ours differs and no reason is known: a mistake, theirs or ours.
    Unexplained,
}

impl Verdict {
    /// All verdicts, as the report counts them.
    pub const ALL: [Self; 6] = [
        Self::Reproduced,
        Self::Follows,
        Self::Contradicts,
        Self::NotDetermined,
        Self::AwaitsFieldSolver,
        Self::Unexplained,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced within the printed digits",
            Self::Follows => "follows from other printed numbers",
            Self::Contradicts => "contradicts another printed number",
            Self::NotDetermined => "not determined by what is printed",
            Self::AwaitsFieldSolver => "awaits the field solver",
            Self::Unexplained => "unexplained",
        }
    }

    /// As a key, the same in the tables and in the report.
    pub fn key(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::Follows => "follows",
            Self::Contradicts => "contradicts",
            Self::NotDetermined => "not_determined",
            Self::AwaitsFieldSolver => "awaits_field_solver",
            Self::Unexplained => "unexplained",
        }
    }
}
