//! What is held out of a training in turn: whole runs, or blocks of the only one.

use std::ops::Range;

use super::Session;

/// Blocks of the only run.
pub(super) const BLOCKS: usize = 5;

/// What is left out of a training: a time of a run, or all of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fold {
    pub(crate) run: usize,
    /// From a time until before another, s.
    pub(crate) times: Range<f64>,
}

impl Fold {
    /// True if it has the reading or frame of a run at a time, s.
    pub(crate) fn has(&self, run: usize, time: f64) -> bool {
        self.run == run && self.times.contains(&time)
    }

    /// All folds: whole runs, or blocks of equal numbers of readings of the only one.
    pub(crate) fn all(runs: &[Session]) -> Vec<Self> {
        let times = match runs {
            [one] => one
                .force
                .iter()
                .flat_map(super::Series::times)
                .copied()
                .collect(),
            _ => Vec::new(),
        };
        if times.is_empty() {
            let whole = |run| Self {
                run,
                times: f64::NEG_INFINITY..f64::INFINITY,
            };
            return (0..runs.len()).map(whole).collect();
        }
        let begin = |block: usize| match block {
            0 => f64::NEG_INFINITY,
            BLOCKS => f64::INFINITY,
            block => times[block * times.len() / BLOCKS],
        };
        let block = |block| Self {
            run: 0,
            times: begin(block)..begin(block + 1),
        };
        (0..BLOCKS).map(block).collect()
    }
}
