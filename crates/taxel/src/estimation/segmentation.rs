//! Touched cells of the array divided into contacts.

use super::contact::{Cell, Contact, Gathering};
use super::reader::Division;

/// Most contacts of a frame: what every frame costs is bounded. More are merged.
pub const MOST_CONTACTS: usize = 64;

/// A touched cell stays touched down to this share of its threshold.
const HOLD: f64 = 0.5;
/// Neighbouring peaks are two contacts when the lower one stands above the
/// saddle between them by this many standard deviations of the difference ...
const PROMINENCE_DEVIATIONS: f64 = 6.0;
/// ... and by this share of itself: gains that differ make dips too.
const PROMINENCE_SHARE: f64 = 0.25;

/// No contact, in [`Segmentation::labels`].
const NONE: u32 = u32::MAX;

/// Finds contacts, neighbours by side or corner, without allocating once warm.
///
/// Touched cells are taken from the highest down. A cell next to none yet taken
/// is a peak; one next to two peaks is their saddle, and joins them unless both
/// are prominent (a watershed). So two fingers side by side are two contacts as
/// long as a dip is between them. On a map ([`Division::Regions`]) all that hangs
/// together is one contact.
#[derive(Debug, Clone)]
pub(super) struct Segmentation {
    division: Division,
    rows: usize,
    columns: usize,
    pitch: [f64; 2],
    cells: Vec<Cell>,
    /// Cells touched in this frame; the next one's hysteresis begins here.
    touched: Vec<bool>,
    order: Vec<u32>,
    /// Peak of each cell, later its contact.
    labels: Vec<u32>,
    /// Contact of each cell in the last frame.
    before: Vec<u32>,
    /// Contacts of the last frame that go on.
    goes_on: Vec<bool>,
    peaks: Vec<Peak>,
    found: Vec<Gathering>,
    /// Regions beyond [`MOST_CONTACTS`], merged with others.
    merged: usize,
}

#[derive(Debug, Clone, Copy)]
struct Peak {
    cell: u32,
    /// The higher peak that it belongs to, or itself; later its contact.
    into: u32,
    /// Cells of a region, those above their thresholds, and whether one of them was touched
    /// in the last frame.
    cells: u32,
    above: u32,
    held: bool,
    /// No contact after all.
    left_out: bool,
}

impl Segmentation {
    /// For cells of `pitch` x, y, m.
    pub(super) fn new(rows: usize, columns: usize, pitch: [f64; 2], division: Division) -> Self {
        let count = rows * columns;
        Self {
            division,
            rows,
            columns,
            pitch,
            cells: Vec::new(),
            touched: vec![false; count],
            order: Vec::with_capacity(count),
            labels: vec![NONE; count],
            before: vec![NONE; count],
            goes_on: Vec::new(),
            peaks: Vec::new(),
            found: Vec::new(),
            merged: 0,
        }
    }

    /// No cell was touched before.
    pub(super) fn forget(&mut self) {
        self.touched.fill(false);
        self.labels.fill(NONE);
    }

    /// Regions of the last run that are part of other contacts because there are too many.
    pub(super) fn merged(&self) -> usize {
        self.merged
    }

    /// Writes the contact of each cell, an index into the contacts of the last
    /// run.
    pub(super) fn label(&self, regions: &mut Vec<Option<u32>>) {
        regions.clear();
        let label = |label: &u32| (*label != NONE).then_some(*label);
        regions.extend(self.labels.iter().map(label));
    }

    /// Writes the contacts, strongest first, and returns the centre and
    /// covariance over all of them.
    pub(super) fn run(
        &mut self,
        cells: &mut Vec<Cell>,
        contacts: &mut Vec<Contact>,
    ) -> Option<([f64; 2], [f64; 3])> {
        // Lent for the run.
        std::mem::swap(&mut self.cells, cells);
        match self.division {
            Division::Peaks => {
                self.find_touched();
                self.sort();
                self.flood();
                self.find_remnants();
                self.leave_out();
            }
            Division::Regions { least } => {
                self.find_held();
                self.sort();
                self.flood();
                self.find_slight(least);
                self.leave_out();
                self.join_near();
            }
        }
        self.number();
        self.gather();
        contacts.clear();
        contacts.extend(self.found.iter().map(|found| found.finish(self.pitch)));
        let whole = self.whole(contacts);
        std::mem::swap(&mut self.cells, cells);
        whole
    }

    fn find_touched(&mut self) {
        self.order.clear();
        for (index, cell) in self.cells.iter().enumerate() {
            let share = if self.touched[index] { HOLD } else { 1.0 };
            self.touched[index] = cell.weight > share * cell.threshold;
            if self.touched[index] {
                self.order.push(index as u32);
            }
        }
    }

    /// Cells that a region may have: those that would hold a contact.
    fn find_held(&mut self) {
        self.order.clear();
        for (index, cell) in self.cells.iter().enumerate() {
            if cell.weight > 0.0 && cell.weight >= HOLD * cell.threshold {
                self.order.push(index as u32);
            }
        }
    }

    /// The highest first.
    fn sort(&mut self) {
        let cells = &self.cells;
        self.order.sort_unstable_by(|a, b| {
            let weight = |index: &u32| cells[*index as usize].weight;
            weight(b).total_cmp(&weight(a)).then(a.cmp(b))
        });
    }

    fn flood(&mut self) {
        std::mem::swap(&mut self.before, &mut self.labels);
        self.labels.fill(NONE);
        self.peaks.clear();
        for rank in 0..self.order.len() {
            let index = self.order[rank];
            // The highest neighbour decides to which peak the cell belongs.
            let mut up: Option<(f64, u32)> = None;
            for next in neighbours(self.rows, self.columns, index as usize) {
                if self.labels[next] == NONE {
                    continue;
                }
                let (weight, peak) = (self.cells[next].weight, self.root(self.labels[next]));
                if let Some((best, mine)) = up {
                    let joined = self.meet(mine, peak, index);
                    let peak = if weight > best { peak } else { mine };
                    up = Some((best.max(weight), joined.unwrap_or(peak)));
                } else {
                    up = Some((weight, peak));
                }
            }
            self.labels[index as usize] = up.map_or(self.peaks.len() as u32, |(_, peak)| peak);
            if up.is_none() {
                self.peaks.push(Peak {
                    cell: index,
                    into: self.peaks.len() as u32,
                    cells: 0,
                    above: 0,
                    held: false,
                    left_out: false,
                });
            }
        }
    }

    fn root(&mut self, mut peak: u32) -> u32 {
        while self.peaks[peak as usize].into != peak {
            // Half the way for whoever comes next.
            let into = self.peaks[peak as usize].into;
            self.peaks[peak as usize].into = self.peaks[into as usize].into;
            peak = into;
        }
        peak
    }

    /// Joins two peaks at their saddle if the lower one is not prominent.
    fn meet(&mut self, one: u32, other: u32, saddle: u32) -> Option<u32> {
        // Peaks are numbered from the highest down.
        let (high, low) = (one.min(other), one.max(other));
        if matches!(self.division, Division::Regions { .. }) {
            self.peaks[low as usize].into = high;
            return Some(high);
        }
        let top = &self.cells[self.peaks[low as usize].cell as usize];
        let saddle = &self.cells[saddle as usize];
        let noise = PROMINENCE_DEVIATIONS * top.deviation.hypot(saddle.deviation);
        // Of an unknown noise (not a number) the share decides.
        let needed = (PROMINENCE_SHARE * top.weight).max(noise);
        (top.weight - saddle.weight < needed).then(|| {
            self.peaks[low as usize].into = high;
            high
        })
    }

    /// Finds what is left of a contact beside its higher part: cells that only hold, and
    /// would not begin a contact of their own.
    fn find_remnants(&mut self) {
        self.goes_on.clear();
        self.goes_on.resize(self.found.len(), false);
        for (at, peak) in self.peaks.iter_mut().enumerate() {
            if peak.into as usize != at {
                continue;
            }
            let top = &self.cells[peak.cell as usize];
            let before = self.before[peak.cell as usize] as usize;
            let goes_on = self.goes_on.get_mut(before);
            let begins = top.weight > top.threshold;
            peak.left_out = !begins && goes_on.as_deref().is_none_or(|goes_on| *goes_on);
            if let Some(goes_on) = goes_on {
                *goes_on = true;
            }
        }
    }

    /// Finds regions of less than `least` cells, and those that neither begin in this frame
    /// nor were there in the last one. For a begin half of the least must be above their
    /// thresholds: one cell that always reads too much, and noise beside it, are no touch.
    fn find_slight(&mut self, least: usize) {
        for rank in 0..self.order.len() {
            let index = self.order[rank] as usize;
            let peak = self.root(self.labels[index]) as usize;
            let cell = &self.cells[index];
            self.peaks[peak].cells += 1;
            self.peaks[peak].above += u32::from(cell.weight > cell.threshold);
            self.peaks[peak].held |= self.touched[index];
        }
        self.touched.fill(false);
        for index in &self.order {
            self.touched[*index as usize] = true;
        }
        for peak in &mut self.peaks {
            let begins = peak.above as usize >= least.div_ceil(2);
            peak.left_out = (peak.cells as usize) < least || !begins && !peak.held;
        }
    }

    /// Takes the cells of peaks that are left out for untouched.
    fn leave_out(&mut self) {
        let mut order = std::mem::take(&mut self.order);
        order.retain(|index| {
            let index = *index as usize;
            let root = self.root(self.labels[index]);
            let left_out = self.peaks[root as usize].left_out;
            if left_out {
                (self.labels[index], self.touched[index]) = (NONE, false);
            }
            !left_out
        });
        self.order = order;
    }

    /// Joins regions with no more than one cell between them.
    fn join_near(&mut self) {
        for rank in 0..self.order.len() {
            let index = self.order[rank] as usize;
            for next in around(self.rows, self.columns, index, 2) {
                if self.labels[next] == NONE {
                    continue;
                }
                let (one, other) = (self.root(self.labels[index]), self.root(self.labels[next]));
                self.peaks[one.max(other) as usize].into = one.min(other);
            }
        }
    }

    /// Numbers the peaks that remain and labels the cells with them. Those beyond
    /// [`MOST_CONTACTS`] go to the nearest of the highest.
    fn number(&mut self) {
        let mut contacts = 0;
        let mut kept = [0_usize; MOST_CONTACTS];
        self.merged = 0;
        for peak in 0..self.peaks.len() {
            let into = self.peaks[peak].into as usize;
            // A higher peak has its number already.
            self.peaks[peak].into = if into != peak {
                self.peaks[into].into
            } else if self.peaks[peak].left_out {
                NONE
            } else if contacts < MOST_CONTACTS {
                kept[contacts] = peak;
                contacts += 1;
                contacts as u32 - 1
            } else {
                self.merged += 1;
                self.nearest(&kept, peak)
            };
        }
        for label in self.labels.iter_mut().filter(|label| **label != NONE) {
            *label = self.peaks[*label as usize].into;
        }
        self.found.clear();
        self.found.resize(contacts, Gathering::default());
    }

    /// The index in `kept` of the peak that is nearest to another.
    fn nearest(&self, kept: &[usize], peak: usize) -> u32 {
        let at = |peak: usize| self.cells[self.peaks[peak].cell as usize].position;
        let [x, y] = at(peak);
        let square = |other: usize| {
            let [u, v] = at(other);
            (u - x) * (u - x) + (v - y) * (v - y)
        };
        let nearest = (0..kept.len()).min_by(|a, b| square(kept[*a]).total_cmp(&square(kept[*b])));
        nearest.unwrap_or(0) as u32
    }

    fn gather(&mut self) {
        for index in &self.order {
            let index = *index as usize;
            self.found[self.labels[index] as usize].add(index, &self.cells[index]);
        }
        self.found.iter_mut().for_each(Gathering::settle);
        for index in &self.order {
            let index = *index as usize;
            self.found[self.labels[index] as usize].add_about_centre(&self.cells[index]);
        }
        for (index, cell) in self.cells.iter().enumerate() {
            if self.labels[index] != NONE || cell.weight.is_nan() {
                continue;
            }
            let mut last = NONE;
            for next in neighbours(self.rows, self.columns, index) {
                let label = self.labels[next];
                if label != NONE && label != last {
                    self.found[label as usize].add_neighbour(cell);
                    last = label;
                }
            }
        }
    }

    /// Centre and covariance over all contacts.
    fn whole(&self, contacts: &[Contact]) -> Option<([f64; 2], [f64; 3])> {
        let weight: f64 = self.found.iter().map(Gathering::weight).sum();
        if weight <= 0.0 {
            return None;
        }
        let share = |found: &Gathering| found.weight() / weight;
        let parts = || self.found.iter().map(share).zip(contacts);
        let centre = std::array::from_fn(|axis| {
            parts()
                .map(|(share, contact)| share * contact.centre[axis])
                .sum()
        });
        let mut covariance: [f64; 3] = std::array::from_fn(|entry| {
            parts()
                .map(|(share, contact)| share * share * contact.covariance[entry])
                .sum()
        });
        // That the shares are not exact either moves the centre between them.
        for (share, contact) in parts() {
            let [x, y]: [f64; 2] = std::array::from_fn(|axis| contact.centre[axis] - centre[axis]);
            let variance: f64 = contact.force_covariance[2][2] * share * share
                / (contact.force[2] * contact.force[2]);
            for (sum, factor) in covariance.iter_mut().zip([x * x, x * y, y * y]) {
                *sum += variance * factor;
            }
        }
        Some((centre, covariance))
    }
}

/// The up to eight cells round a cell.
fn neighbours(rows: usize, columns: usize, at: usize) -> impl Iterator<Item = usize> {
    around(rows, columns, at, 1)
}

/// The cells that are at most `reach` rows and columns from a cell.
fn around(rows: usize, columns: usize, at: usize, reach: usize) -> impl Iterator<Item = usize> {
    let (row, column) = (at / columns, at % columns);
    (row.saturating_sub(reach)..=(row + reach).min(rows - 1))
        .flat_map(move |r| {
            let from = column.saturating_sub(reach);
            (from..=(column + reach).min(columns - 1)).map(move |c| r * columns + c)
        })
        .filter(move |next| *next != at)
}

#[cfg(test)]
mod tests;
