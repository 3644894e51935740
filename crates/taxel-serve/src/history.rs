//! History of a run: first, minimum, mean, maximum and last of each signal at three resolutions, in
//! bounded memory.

mod reply;

use std::borrow::Cow;
use std::collections::VecDeque;

use serde::Serialize;
use taxel::estimation::{Meaning, Scale, Touch};

use crate::reserved::reserved;

pub(crate) use reply::{Gathered, HistoryQuery, Reply};

/// Width of the bins, ns, and number of bins of each resolution: 0.1 s for 10 min, 1 s for
/// 2 h, 10 s for 12 h.
const LEVELS: [(u64, usize); 3] = [
    (100_000_000, 6000),
    (1_000_000_000, 7200),
    (10_000_000_000, 4320),
];
/// Memory of the bins at all resolutions, bytes.
const BUDGET: usize = 32 << 20;
/// More channels than this are not kept: the page lists no more.
const MOST_CHANNELS: usize = 32;
/// Changes of the rest values that are kept.
const MARKS: usize = 1000;

/// A signal of the history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Signal {
    /// Such as `force_z`, `channel row 0` or `taxel r0c3`.
    pub(crate) name: String,
    /// SI unit; `1` for a number without one.
    pub(crate) unit: Cow<'static, str>,
}

/// First, smallest, mean, largest and last of some values, and their number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stats {
    pub(crate) first: f32,
    pub(crate) minimum: f32,
    pub(crate) mean: f32,
    pub(crate) maximum: f32,
    pub(crate) last: f32,
    /// Twice the number of values, and one more if the smallest came before the largest.
    order: u32,
}

impl Stats {
    fn count(&self) -> u32 {
        self.order / 2
    }

    /// True if the smallest value came before the largest.
    pub(crate) fn rises(&self) -> bool {
        self.order % 2 == 1
    }
}

/// The same while values still come.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Running {
    first: f64,
    minimum: f64,
    sum: f64,
    maximum: f64,
    last: f64,
    count: u32,
    rises: bool,
}

impl Running {
    const NOTHING: Self = Self {
        first: f64::NAN,
        minimum: f64::INFINITY,
        sum: 0.0,
        maximum: f64::NEG_INFINITY,
        last: f64::NAN,
        count: 0,
        rises: false,
    };

    /// Takes a value; one that is missing is no zero.
    fn push(&mut self, value: f64) {
        if value.is_finite() {
            self.order([value; 4], true);
            self.sum += value;
            self.count += 1;
        }
    }

    fn join(&mut self, stats: &Stats) {
        if stats.count() > 0 {
            let values = [stats.first, stats.minimum, stats.maximum, stats.last];
            self.order(values.map(f64::from), stats.rises());
            self.sum += f64::from(stats.mean) * f64::from(stats.count());
            self.count += stats.count();
        }
    }

    /// Takes the first, smallest, largest and last of later values; whether their smallest came
    /// before their largest.
    fn order(&mut self, [first, minimum, maximum, last]: [f64; 4], rises: bool) {
        if self.count == 0 {
            self.first = first;
        }
        let (lower, higher) = (minimum < self.minimum, maximum > self.maximum);
        self.rises = match (lower, higher) {
            (true, true) => rises,
            (true, false) => false,
            (false, true) => true,
            (false, false) => self.rises,
        };
        self.minimum = self.minimum.min(minimum);
        self.maximum = self.maximum.max(maximum);
        self.last = last;
    }

    /// All are NaN without any value.
    fn stats(&self) -> Stats {
        let some = |value: f64| if self.count > 0 { value } else { f64::NAN };
        Stats {
            first: self.first as f32,
            minimum: some(self.minimum) as f32,
            mean: (self.sum / f64::from(self.count)) as f32,
            maximum: some(self.maximum) as f32,
            last: self.last as f32,
            order: 2 * self.count + u32::from(self.rises),
        }
    }
}

/// Where a bin lies.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    /// Device time over the width.
    number: u64,
    /// Wall clock at its first frame, s since 1970.
    unix_s: f64,
}

impl Place {
    const NONE: Self = Self {
        number: u64::MAX,
        unix_s: f64::NAN,
    };
}

/// Bins of one width. A time without frames takes no bin.
#[derive(Debug)]
struct Level {
    width_ns: u64,
    bins: usize,
    signals: usize,
    places: VecDeque<Place>,
    /// Of each bin, signal by signal.
    stats: VecDeque<Stats>,
    /// The newest bin, into which values still come.
    open: Option<Place>,
    running: Vec<Running>,
    /// True once an old bin has been given up.
    dropped: bool,
}

impl Level {
    fn new((width_ns, bins): (u64, usize), signals: usize) -> Self {
        Self {
            width_ns,
            bins,
            signals,
            // One more than is kept, so that they never grow.
            places: reserved(Place::NONE, bins + 1),
            stats: reserved(Running::NOTHING.stats(), (bins + 1) * signals),
            open: None,
            running: vec![Running::NOTHING; signals],
            dropped: false,
        }
    }

    fn push(&mut self, time_ns: u64, unix_s: f64, values: &[f64]) {
        let number = time_ns / self.width_ns;
        if self.open.is_none_or(|open| open.number != number) {
            self.close();
            self.open = Some(Place { number, unix_s });
            let kept = number.saturating_sub(self.bins as u64);
            let old = self.places.iter().take_while(|place| place.number < kept);
            let old = old.count();
            self.dropped |= old > 0;
            self.places.drain(..old);
            self.stats.drain(..old * self.signals);
        }
        for (running, value) in self.running.iter_mut().zip(values) {
            running.push(*value);
        }
    }

    fn close(&mut self) {
        if let Some(open) = self.open.take() {
            self.places.push_back(open);
            self.stats.extend(self.running.iter().map(Running::stats));
            self.running.fill(Running::NOTHING);
        }
    }

    fn clear(&mut self) {
        self.places.clear();
        self.stats.clear();
        self.open = None;
        self.running.fill(Running::NOTHING);
        self.dropped = false;
    }

    /// True if it has all that there ever was from this time on.
    fn reaches(&self, from_ns: u64) -> bool {
        !self.dropped || self.oldest_ns().is_some_and(|oldest| oldest <= from_ns)
    }

    /// Begin of the oldest bin, ns.
    fn oldest_ns(&self) -> Option<u64> {
        let oldest = self.places.front().or(self.open.as_ref());
        oldest.map(|place| place.number * self.width_ns)
    }

    /// Bins from one number to another with the statistics of chosen signals.
    fn between(
        &self,
        from: u64,
        to: u64,
        chosen: &[usize],
        mut take: impl FnMut(Place, usize, Stats),
    ) {
        let first = self.places.partition_point(|place| place.number < from);
        let bins = self.places.range(first..).enumerate();
        for (bin, place) in bins.take_while(|(_, place)| place.number <= to) {
            let base = (first + bin) * self.signals;
            for (slot, signal) in chosen.iter().enumerate() {
                take(*place, slot, self.stats[base + signal]);
            }
        }
        if let Some(open) = self.open.filter(|open| (from..=to).contains(&open.number)) {
            for (slot, signal) in chosen.iter().enumerate() {
                take(open, slot, self.running[*signal].stats());
            }
        }
    }

    /// Bytes that it may take.
    const fn memory(bins: usize, signals: usize) -> usize {
        (bins + 1) * (size_of::<Place>() + signals * size_of::<Stats>())
    }
}

/// A change of the rest values on the time axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Mark {
    pub(crate) time_ns: u64,
    /// Wall clock, s since 1970.
    pub(crate) unix_s: f64,
    /// `tare`, `tare refused`, `tare cleared` or `tare undone`.
    pub(crate) kind: &'static str,
}

/// Where the value of a signal is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    Force(usize),
    Moment(usize),
    Sum,
    Contacts,
    Channel(usize),
    Taxel(usize),
}

/// The history of a run.
#[derive(Debug, Default)]
pub(crate) struct History {
    signals: Vec<Signal>,
    origins: Vec<Origin>,
    levels: Vec<Level>,
    /// Device time of the first and of the newest frame, ns.
    extent_ns: Option<[u64; 2]>,
    marks: VecDeque<Mark>,
    /// Values of the newest frame.
    values: Vec<f64>,
}

/// A part of the history.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Section {
    /// Width of the rows, ns.
    pub(crate) width_ns: u64,
    /// The oldest first.
    pub(crate) rows: Vec<Row>,
}

/// The values of a time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Its beginning, device time, ns.
    pub(crate) time_ns: u64,
    /// Wall clock at its first frame, s since 1970.
    pub(crate) unix_s: f64,
    /// Of each chosen signal.
    pub(crate) stats: Vec<Stats>,
}

impl History {
    /// An empty history of a device: totals and contacts, the readings of a device of few
    /// channels, and the pressing of each taxel if there is memory for all of them.
    pub(crate) fn new(meaning: &Meaning) -> Self {
        let mut history = Self::default();
        history.totals(meaning);
        let channels = &meaning.channels;
        if channels.len() <= MOST_CHANNELS {
            let unit = si_unit(&meaning.reading);
            for (channel, name) in channels.iter().enumerate() {
                history.add(Origin::Channel(channel), &format!("channel {name}"), &unit);
            }
        }
        let (columns, taxels) = (
            meaning.layout.columns,
            meaning.layout.rows * meaning.layout.columns,
        );
        if history.signals.len() + taxels <= most_signals() {
            let unit = si_unit(&meaning.value);
            for taxel in 0..taxels {
                let name = format!("taxel r{}c{}", taxel / columns, taxel % columns);
                history.add(Origin::Taxel(taxel), &name, &unit);
            }
        }
        let signals = history.signals.len();
        history.levels = LEVELS.map(|level| Level::new(level, signals)).into();
        history
    }

    fn totals(&mut self, meaning: &Meaning) {
        let newtons = meaning.force_unit() == "N";
        let axes = ["x", "y", "z"]
            .iter()
            .enumerate()
            .skip(3 - meaning.components);
        if newtons {
            for (axis, name) in axes.clone() {
                self.add(Origin::Force(axis), &format!("force_{name}"), "N");
            }
        } else {
            self.add(Origin::Sum, "sum", &si_unit(&meaning.value));
        }
        if meaning.components == 3 {
            for (axis, name) in axes {
                self.add(Origin::Moment(axis), &format!("moment_{name}"), "N m");
            }
        }
        self.add(Origin::Contacts, "contacts", "1");
    }

    fn add(&mut self, origin: Origin, name: &str, unit: &str) {
        self.origins.push(origin);
        self.signals.push(Signal {
            name: name.into(),
            unit: unit.to_owned().into(),
        });
    }

    /// Takes the touch of a frame; true if the clock of the device was set back, which
    /// begins the history anew.
    pub(crate) fn push(&mut self, touch: &Touch, unix_s: f64) -> bool {
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.extend(self.origins.iter().map(|origin| match *origin {
            Origin::Force(axis) => touch.total.force[axis],
            Origin::Moment(axis) => touch.total.moment[axis],
            Origin::Sum => touch.sum,
            Origin::Contacts => touch.contacts.len() as f64,
            Origin::Channel(channel) => touch.channels.readings[channel],
            Origin::Taxel(taxel) => touch.taxels[taxel].value[2],
        }));
        let restarted = self.push_values(touch.time_ns, unix_s, &values);
        self.values = values;
        restarted
    }

    fn push_values(&mut self, time_ns: u64, unix_s: f64, values: &[f64]) -> bool {
        let restarted = self.extent_ns.is_some_and(|[_, newest]| time_ns < newest);
        if restarted {
            self.levels.iter_mut().for_each(Level::clear);
            self.marks.clear();
            self.extent_ns = None;
        }
        let [first, _] = self.extent_ns.unwrap_or([time_ns; 2]);
        self.extent_ns = Some([first, time_ns]);
        for level in &mut self.levels {
            level.push(time_ns, unix_s, values);
        }
        restarted
    }

    /// Notes a change of the rest values.
    pub(crate) fn mark(&mut self, mark: Mark) {
        if self.marks.len() == MARKS {
            self.marks.pop_front();
        }
        self.marks.push_back(mark);
    }

    pub(crate) fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Changes of the rest values from one device time to another, ns.
    pub(crate) fn marks(&self, from_ns: u64, to_ns: u64) -> Vec<Mark> {
        let within = |mark: &&Mark| (from_ns..=to_ns).contains(&mark.time_ns);
        self.marks.iter().filter(within).copied().collect()
    }

    /// First and last device time, ns; `None` before the first frame.
    pub(crate) fn extent_ns(&self) -> Option<[u64; 2]> {
        let oldest = self.levels.last()?.oldest_ns()?;
        let [first, newest] = self.extent_ns?;
        Some([oldest.max(first), newest])
    }

    /// Chosen signals from one device time to another, ns, in at most `points` rows of
    /// one width: the smallest that reaches back so far and has no more rows.
    pub(crate) fn section(
        &self,
        [from_ns, to_ns]: [u64; 2],
        points: usize,
        chosen: &[usize],
    ) -> Section {
        let nothing = Section {
            width_ns: LEVELS[0].0,
            rows: Vec::new(),
        };
        let Some(level) = self.level(from_ns, to_ns, points) else {
            return nothing;
        };
        let [first, last] = [from_ns, to_ns].map(|time| time / level.width_ns);
        let group = group(first, last, points.max(1) as u64);
        let width_ns = group * level.width_ns;
        let mut rows: Vec<(Place, Vec<Running>)> = Vec::new();
        level.between(first, last, chosen, |place, slot, stats| {
            let number = place.number / group;
            if rows.last().is_none_or(|(row, _)| row.number != number) {
                let unix_s = place.unix_s;
                rows.push((
                    Place { number, unix_s },
                    vec![Running::NOTHING; chosen.len()],
                ));
            }
            if let Some((_, running)) = rows.last_mut() {
                running[slot].join(&stats);
            }
        });
        let row = |(place, running): (Place, Vec<Running>)| Row {
            time_ns: place.number * width_ns,
            unix_s: place.unix_s,
            stats: running.iter().map(Running::stats).collect(),
        };
        Section {
            width_ns,
            rows: rows.into_iter().map(row).collect(),
        }
    }

    /// Of the resolutions that reach back to `from_ns`, or as far as any, the coarsest
    /// that has a bin for each point, else the finest.
    fn level(&self, from_ns: u64, to_ns: u64, points: usize) -> Option<&Level> {
        let span = to_ns.saturating_sub(from_ns);
        let enough = |level: &&Level| level.width_ns.saturating_mul(points as u64) <= span;
        let mut usable = self.levels.iter().filter(|level| level.reaches(from_ns));
        let Some(finest) = usable.next() else {
            return self.levels.last();
        };
        Some(usable.rfind(enough).unwrap_or(finest))
    }
}

/// How many bins make a row, so that those from `first` to `last` are at most `points` rows.
fn group(first: u64, last: u64, points: u64) -> u64 {
    let mut group = (last.saturating_sub(first) + 1).div_ceil(points).max(1);
    // Rows begin at multiples of their width, which may cut one more off.
    while last / group - first / group >= points {
        group += 1;
    }
    group
}

/// Signals for which there is memory.
fn most_signals() -> usize {
    let of_bins = |signals| {
        let levels = LEVELS.iter();
        levels
            .map(|(_, bins)| Level::memory(*bins, signals))
            .sum::<usize>()
    };
    (BUDGET - of_bins(0)) / (of_bins(1) - of_bins(0))
}

/// SI unit of a quantity, as values are stored.
fn si_unit(scale: &Scale) -> Cow<'static, str> {
    let unit = match &*scale.quantity {
        "force" | "change of force" => "N",
        "pressure" => "Pa",
        "capacitance" => "F",
        "voltage" => "V",
        "resistance" => "ohm",
        _ if scale.si_per_unit == 1.0 && !scale.symbol.is_empty() => return scale.symbol.clone(),
        _ => "1",
    };
    unit.into()
}

#[cfg(test)]
impl History {
    /// A history of these signals without a device.
    fn kept_for_tests(names: &[&str]) -> Self {
        let mut history = Self::default();
        for name in names {
            history.add(Origin::Sum, name, "N");
        }
        history.levels = LEVELS.map(|level| Level::new(level, names.len())).into();
        history
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A history of signals without a device.
    fn history(signals: usize) -> History {
        History::kept_for_tests(&["force_x", "force_y", "force_z"][..signals])
    }

    /// Repeatable numbers from 0 to 1 (xorshift).
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn decimated_values_are_those_of_the_frames_themselves() {
        for seed in 1..=40 {
            let mut numbers = Numbers(0x9E37_79B9_7F4A_7C15u64.wrapping_mul(seed));
            let mut history = history(2);
            let mut frames: Vec<(u64, [f64; 2])> = Vec::new();
            let mut time_ns = (numbers.next() * 1e12) as u64;
            for _ in 0..600 {
                // Frames at irregular times, with pauses, of which some have no value.
                let pause = if numbers.next() < 0.02 { 20.0 } else { 0.2 };
                time_ns += 1 + (numbers.next() * pause * 1e9) as u64;
                let missing = numbers.next() < 0.1;
                let first = if missing {
                    f64::NAN
                } else {
                    numbers.next() - 0.5
                };
                let values = [first, 1e-15 * numbers.next()];
                history.push_values(time_ns, 0.0, &values);
                frames.push((time_ns, values));
            }
            let [begin, end] = history.extent_ns().unwrap();
            let from_ns = begin + (numbers.next() * 0.5 * (end - begin) as f64) as u64;
            let to_ns = from_ns + (numbers.next() * (end - from_ns) as f64) as u64;
            let points = 1 + (numbers.next() * 300.0) as usize;
            let section = history.section([from_ns, to_ns], points, &[1, 0]);
            assert!(
                section.rows.len() <= points,
                "{} of {points}",
                section.rows.len()
            );
            assert!(!section.rows.is_empty());
            for row in &section.rows {
                let within =
                    |time: u64| (row.time_ns..row.time_ns + section.width_ns).contains(&time);
                // A bin at an end of the section is whole.
                let bin = history.level(from_ns, to_ns, points).unwrap().width_ns;
                let bins = from_ns / bin * bin..(to_ns / bin + 1) * bin;
                for (slot, signal) in [1, 0].into_iter().enumerate() {
                    let values = frames
                        .iter()
                        .filter(|(time, _)| within(*time) && bins.contains(time));
                    let values: Vec<f64> = values
                        .map(|(_, values)| values[signal])
                        .filter(|value| value.is_finite())
                        .collect();
                    let stats = row.stats[slot];
                    assert_eq!(stats.count() as usize, values.len(), "seed {seed}");
                    if values.is_empty() {
                        assert!(
                            stats.minimum.is_nan() && stats.mean.is_nan() && stats.maximum.is_nan()
                        );
                        continue;
                    }
                    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
                    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    let mean = values.iter().sum::<f64>() / values.len() as f64;
                    assert_eq!(
                        [stats.first, stats.last].map(f64::from),
                        [values[0], values[values.len() - 1]].map(|value| f64::from(value as f32))
                    );
                    // In which order the extremes came: the first of each.
                    let at = |extreme: f64| values.iter().position(|value| *value == extreme);
                    if (least as f32, most as f32) != (most as f32, least as f32) {
                        assert_eq!(stats.rises(), at(least) < at(most), "seed {seed}");
                    }
                    assert_eq!(stats.minimum, least as f32);
                    assert_eq!(stats.maximum, most as f32);
                    // Means are kept in single precision: an error of 6e-8 of the largest value.
                    let size = least.abs().max(most.abs());
                    assert!(
                        (f64::from(stats.mean) - mean).abs() <= 1.3e-7 * size,
                        "{stats:?}, {mean}"
                    );
                }
            }
        }
    }

    #[test]
    fn memory_stays_as_it_was_over_more_than_twelve_hours() {
        let mut history = history(3);
        let capacity = |history: &History| -> Vec<(usize, usize)> {
            let levels = history.levels.iter();
            levels
                .map(|level| (level.places.capacity(), level.stats.capacity()))
                .collect()
        };
        let before = capacity(&history);
        let frames = 14 * 3600 * 20;
        for frame in 0..frames {
            let time_ns = frame * SECOND / 20;
            history.push_values(
                time_ns,
                time_ns as f64 * 1e-9,
                &[frame as f64, 1.0, f64::NAN],
            );
        }
        assert_eq!(capacity(&history), before);
        for (level, (_, bins)) in history.levels.iter().zip(LEVELS) {
            assert_eq!(level.places.len(), bins);
            assert_eq!(level.stats.len(), 3 * bins);
        }
        // Twelve hours back, in 10 s; two hours in 1 s; ten minutes in 0.1 s.
        let newest = (frames - 1) * SECOND / 20;
        let [oldest, end] = history.extent_ns().unwrap();
        assert_eq!(end, newest);
        assert!(
            newest - oldest >= 12 * 3600 * SECOND,
            "{oldest} to {newest}"
        );
        for (back, width) in [(590, 100_000_000), (7190, SECOND), (43_190, 10 * SECOND)] {
            let section = history.section([newest - back * SECOND, newest], 10_000, &[0]);
            assert_eq!(section.width_ns, width);
            let rows = section.rows.len() as u64;
            assert!(
                rows.abs_diff(back * SECOND / width) <= 1,
                "{rows} rows of {width} ns"
            );
        }
    }

    #[test]
    fn as_many_signals_as_the_budget_has_room_for_stay_within_it() {
        let most = most_signals();
        let bytes = |signals| {
            LEVELS
                .iter()
                .map(|(_, bins)| Level::memory(*bins, signals))
                .sum::<usize>()
        };
        assert!(bytes(most) <= BUDGET && bytes(most + 1) > BUDGET);
        // As `docs/live-protocol.md` says: an array of 8 x 8 is kept taxel by taxel.
        assert_eq!(most, 79);
    }

    #[test]
    fn a_pause_is_a_gap_and_a_missing_value_no_zero() {
        let mut history = history(1);
        for second in [0, 1, 2, 60, 61] {
            history.push_values(second * SECOND, 100.0 + second as f64, &[5.0]);
        }
        history.push_values(62 * SECOND, 162.0, &[f64::NAN]);
        let section = history.section([0, 62 * SECOND], 1000, &[0]);
        let times: Vec<u64> = section
            .rows
            .iter()
            .map(|row| row.time_ns / SECOND)
            .collect();
        assert_eq!(times, [0, 1, 2, 60, 61, 62]);
        assert_eq!(section.rows[3].unix_s, 160.0);
        assert!(section.rows[5].stats[0].mean.is_nan());
    }

    #[test]
    fn a_clock_that_is_set_back_begins_anew() {
        let mut history = history(1);
        history.push_values(50 * SECOND, 0.0, &[1.0]);
        history.mark(Mark {
            time_ns: 50 * SECOND,
            unix_s: 0.0,
            kind: "tare",
        });
        assert!(!history.push_values(51 * SECOND, 1.0, &[1.0]));
        assert!(history.push_values(3 * SECOND, 2.0, &[2.0]));
        assert_eq!(history.extent_ns(), Some([3 * SECOND; 2]));
        assert_eq!(history.marks(0, u64::MAX), []);
        let section = history.section([0, 100 * SECOND], 10, &[0]);
        assert_eq!(section.rows.len(), 1);
    }

    #[test]
    fn nothing_has_no_rows() {
        assert_eq!(history(1).extent_ns(), None);
        assert_eq!(history(1).section([0, SECOND], 10, &[0]).rows, []);
        assert_eq!(History::default().section([0, SECOND], 10, &[]).rows, []);
    }
}
