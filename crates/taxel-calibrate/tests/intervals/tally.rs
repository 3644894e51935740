//! Counts of intervals that hold the truth, and the bounds that chance sets them.

use std::collections::BTreeMap;

use rayon::prelude::*;

/// A number that was printed with an interval: its name, and whether the interval holds
/// the truth.
pub(crate) type Printed = (String, bool);

/// A command on one kind of synthetic bench.
pub(crate) struct Case {
    /// Name for the table.
    pub(crate) name: &'static str,
    /// True if a few benches take less than a second without optimisation.
    pub(crate) short: bool,
    /// Least coverage that is reached where it is not 95 %; the reason is beside it.
    pub(crate) reached: f64,
    /// Every number that the command prints with an interval on the bench of a seed.
    pub(crate) run: Box<dyn Fn(u64) -> Vec<Printed> + Sync>,
}

/// How often the intervals of one number were printed, and held the truth.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Count {
    pub(crate) printed: usize,
    pub(crate) held: usize,
}

/// Nominal coverage.
const NOMINAL: f64 = 0.95;
/// Deviations of a count that chance may bring: of some 150 numbers none goes beyond them
/// but once in a hundred tables.
const CHANCE: f64 = 4.0;
/// A number that is identified in fewer of the benches than this share is judged over all of
/// them: that it is printed at all is then the work of noise.
const RARE: f64 = 0.25;

impl Case {
    /// Counts over benches of different seeds, by number.
    pub(crate) fn counted(&self, benches: u64) -> BTreeMap<String, Count> {
        let all: Vec<Vec<Printed>> = (1..=benches).into_par_iter().map(&self.run).collect();
        let mut counts: BTreeMap<String, Count> = BTreeMap::new();
        for (name, held) in all.into_iter().flatten() {
            let count = counts.entry(name).or_default();
            count.printed += 1;
            count.held += usize::from(held);
        }
        counts
    }
}

impl Count {
    /// Percent of the intervals that hold the truth.
    pub(crate) fn percent(self) -> f64 {
        100.0 * self.held as f64 / self.printed.max(1) as f64
    }

    /// True if fewer intervals hold the truth than chance explains, of `benches`.
    pub(crate) fn falls_short(self, benches: u64, reached: f64) -> bool {
        let missed = (self.printed - self.held) as f64;
        let of = if (self.printed as f64) < RARE * benches as f64 {
            benches as f64
        } else {
            self.printed as f64
        };
        let share = 1.0 - NOMINAL.min(reached);
        missed > share * of + CHANCE * (share * (1.0 - share) * of).sqrt() + 1.0
    }
}
