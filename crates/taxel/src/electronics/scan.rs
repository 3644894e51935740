//! The order in which the channels are read: when each one is sampled.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, PositiveTime};

/// Scheme by which the electrode rows and columns are read.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Scan {
    /// One charge amplifier per electrode column: a row at once.
    RowParallel(RowParallel),
    /// Every channel at the same moment.
    Simultaneous,
    /// One converter behind a multiplexer: one channel after the other.
    Multiplexed(Multiplexed),
}

/// One electrode row after the other, all its columns at once.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RowParallel {
    /// Time for one row of electrodes, s.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "Checked<PositiveTime>")]
    pub row_time: f64,
}

/// One channel after the other; in arrays of capacitors electrode row by
/// electrode row.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Multiplexed {
    /// Time for one channel, s.
    #[serde(deserialize_with = "quantity::one::<PositiveTime, _>")]
    #[schemars(with = "Checked<PositiveTime>")]
    pub channel_time: f64,
}

impl Scan {
    /// Time from the start of a frame to the sampling of the capacitor in
    /// electrode row `row` and electrode column `column` of `columns`, s.
    pub fn delay(&self, row: usize, column: usize, columns: usize) -> f64 {
        match self {
            Self::Simultaneous => 0.0,
            Self::RowParallel(scan) => row as f64 * scan.row_time,
            Self::Multiplexed(scan) => (row * columns + column) as f64 * scan.channel_time,
        }
    }

    /// Time for all `rows` x `columns` capacitors, s.
    pub fn duration(&self, rows: usize, columns: usize) -> f64 {
        match self {
            Self::Simultaneous => 0.0,
            Self::RowParallel(scan) => rows as f64 * scan.row_time,
            Self::Multiplexed(scan) => (rows * columns) as f64 * scan.channel_time,
        }
    }
}
