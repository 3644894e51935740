//! Loading and unloading, and readings held out of a fit.

use taxel_numerics::Noise;

/// Which way the load went when a reading was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// Up, or held.
    Loading,
    /// Down.
    Unloading,
}

/// A turn counts when the load goes back by more than this share of its range.
const TURN: f64 = 0.05;

/// The branch of each reading of a load in the order of time.
///
/// The load has turned when it has come back from its last extreme by 5 % of
/// its range; what lies behind that extreme is of the new branch.
pub fn branches(load: &[f64]) -> Vec<Branch> {
    let least = load.iter().copied().fold(f64::INFINITY, f64::min);
    let most = load.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let turn = TURN * (most - least);
    let mut branches = vec![Branch::Loading; load.len()];
    let (mut branch, mut extreme) = (Branch::Loading, 0);
    for i in 0..load.len() {
        let back = match branch {
            Branch::Loading => load[extreme] - load[i],
            Branch::Unloading => load[i] - load[extreme],
        };
        if back <= 0.0 {
            extreme = i;
        } else if back > turn {
            branch = match branch {
                Branch::Loading => Branch::Unloading,
                Branch::Unloading => Branch::Loading,
            };
            branches[extreme + 1..i].fill(branch);
            extreme = i;
        }
        branches[i] = branch;
    }
    branches
}

/// Turns of the load that [`branches`] found.
pub fn turns(branches: &[Branch]) -> usize {
    branches
        .windows(2)
        .filter(|pair| pair[0] != pair[1])
        .count()
}

/// The readings whose flag is `wanted`.
pub(crate) fn picked<T: Clone>(readings: &[T], flags: &[bool], wanted: bool) -> Vec<T> {
    let pairs = readings.iter().zip(flags);
    pairs
        .filter(|(_, flag)| **flag == wanted)
        .map(|(reading, _)| reading.clone())
        .collect()
}

/// A reading that belongs to a series: to one sensor, taxel or channel in time.
pub(crate) trait OfSeries {
    /// Number of the series.
    fn series(&self) -> usize;

    /// True if its column `hold_out` is not zero.
    fn is_marked(&self) -> bool;
}

/// Numbers of the series that have readings, in their order.
pub(crate) fn series_of<R: OfSeries>(readings: &[R]) -> Vec<usize> {
    let mut series: Vec<usize> = readings.iter().map(OfSeries::series).collect();
    series.sort_unstable();
    series.dedup();
    series
}

/// The readings of each series that has any, in the order of their numbers.
pub(crate) fn by_series<R: OfSeries + Clone>(readings: &[R]) -> Vec<Vec<R>> {
    let of = |number: usize| {
        let of = readings.iter().filter(|reading| reading.series() == number);
        of.cloned().collect()
    };
    series_of(readings).into_iter().map(of).collect()
}

/// Which readings a fit does not see, so that its error can be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HoldOut {
    /// None.
    None,
    /// The last share of each sensor's readings in time.
    Last(f64),
    /// A share at random, the same for the same seed.
    Random(f64, u64),
    /// Those whose column `hold_out` is not zero.
    Column,
}

impl Default for HoldOut {
    fn default() -> Self {
        Self::Last(0.2)
    }
}

impl HoldOut {
    /// Reads `20%`, `random:20%` (seed 1), `random:20%:7` (seed 7), `column` or
    /// `none`.
    ///
    /// # Errors
    /// A sentence for people.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" says nothing of what to hold out: write 20% (the last of each sensor in time), random:20% or \
                 random:20%:SEED, column (the column hold_out) or none; at most 50%"
            )
        };
        let share = |text: &str| -> Option<f64> {
            let percent: f64 = text.strip_suffix('%')?.trim().parse().ok()?;
            (percent > 0.0 && percent <= 50.0).then_some(percent / 100.0)
        };
        match text {
            "none" => Ok(Self::None),
            "column" => Ok(Self::Column),
            _ => match text.strip_prefix("random:") {
                Some(rest) => {
                    let (part, seed) = rest.split_once(':').unwrap_or((rest, "1"));
                    let seed = seed.trim().parse().ok();
                    seed.and_then(|seed| Some(Self::Random(share(part)?, seed)))
                }
                None => share(text).map(Self::Last),
            }
            .ok_or_else(wrong),
        }
    }

    /// True if each of these readings is held out, each series for itself.
    pub(crate) fn of<R: OfSeries>(self, readings: &[R]) -> Vec<bool> {
        let mut held = vec![false; readings.len()];
        for number in series_of(readings) {
            let places = (0..readings.len()).filter(|i| readings[*i].series() == number);
            let places: Vec<usize> = places.collect();
            let marked: Vec<bool> = places.iter().map(|i| readings[*i].is_marked()).collect();
            for (place, flag) in places.into_iter().zip(self.held(&marked)) {
                held[place] = flag;
            }
        }
        held
    }

    /// True if each of the readings of one series in time is held out; `marked` is
    /// their column `hold_out`.
    pub fn held(self, marked: &[bool]) -> Vec<bool> {
        let count = marked.len();
        match self {
            Self::None => vec![false; count],
            Self::Last(share) => {
                let kept = count - (share * count as f64).round() as usize;
                (0..count).map(|i| i >= kept).collect()
            }
            Self::Random(share, seed) => {
                let mut noise = Noise::seeded(seed);
                let mut order: Vec<(f64, usize)> =
                    (0..count).map(|i| (noise.normal(), i)).collect();
                order.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut held = vec![false; count];
                for (_, i) in order.iter().take((share * count as f64).round() as usize) {
                    held[*i] = true;
                }
                held
            }
            Self::Column => marked.to_vec(),
        }
    }

    /// In words.
    pub fn words(self) -> String {
        match self {
            Self::None => "none".into(),
            Self::Last(share) => format!("the last {:.0} % of each sensor in time", 100.0 * share),
            Self::Random(share, seed) => {
                format!("{:.0} % at random (seed {seed})", 100.0 * share)
            }
            Self::Column => "those of the column hold_out".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Branch::{Loading as L, Unloading as U};

    #[test]
    fn a_load_turns_once_it_has_come_back() {
        let load = [0.0, 5.0, 10.0, 9.9, 10.0, 6.0, 1.0, 0.0, 0.1, 4.0];
        assert_eq!(branches(&load), [L, L, L, L, L, U, U, U, L, L]);
        assert_eq!(turns(&branches(&load)), 2);
        assert_eq!(branches(&[1.0; 3]), [L; 3]);
        assert_eq!(branches(&[3.0, 2.0, 1.0]), [L, U, U]);
    }

    #[test]
    fn held_out_readings_are_those_asked_for() {
        let held = |text: &str| HoldOut::parse(text).unwrap().held(&[true; 10]);
        assert_eq!(held("20%").iter().filter(|held| **held).count(), 2);
        assert!(held("20%")[9] && !held("20%")[7]);
        assert_eq!(held("random:30%").iter().filter(|held| **held).count(), 3);
        assert!(held("column")[0] && !held("none")[9]);
        assert_eq!(HoldOut::parse("random:30%:7"), Ok(HoldOut::Random(0.3, 7)));
        for wrong in ["", "20", "0%", "80%", "random", "random:x", "random:20%:x"] {
            assert!(HoldOut::parse(wrong).is_err(), "{wrong}");
        }
    }
}
