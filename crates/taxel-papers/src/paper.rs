//! The four papers and their tables.

use std::sync::LazyLock;

use crate::table::Table;

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

    /// Table of the printed statements.
    pub fn table(self) -> &'static Table {
        &TABLES[self as usize]
    }
}
