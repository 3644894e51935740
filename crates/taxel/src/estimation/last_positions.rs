//! Positions that are estimated now and then; between, contacts keep their offset
//! from the centres of force.

use super::contact::{Cell, Contact, Gathering};
use super::localisation::Located;

/// Where contacts were found last, against the centres of their forces, with
/// which they move.
#[derive(Debug, Clone)]
pub(super) struct LastPositions {
    until_ns: u64,
    /// Contacts that the touched cells made then.
    regions: usize,
    parts: Vec<Located>,
    /// Shift, m, and covariance, m², of each contact; none where its position is
    /// not known.
    shifts: Vec<Option<([f64; 2], [f64; 3])>>,
}

impl LastPositions {
    /// For contacts that are good until a time, ns, and as long as the touched
    /// cells make as many regions.
    pub(super) fn new(parts: Vec<Located>, until_ns: u64, regions: usize) -> Self {
        Self {
            until_ns,
            regions,
            parts,
            shifts: Vec::new(),
        }
    }

    /// True if it is still good.
    pub(super) fn holds(&self, time_ns: u64, regions: usize) -> bool {
        time_ns < self.until_ns && regions == self.regions
    }

    /// Writes contacts and regions anew where more contacts were found than
    /// regions: each touched cell belongs to the contact that puts most on it.
    /// Keeps what each contact was found to be, in their order.
    pub(super) fn split(
        &mut self,
        cells: &[Cell],
        pitch: [f64; 2],
        contacts: &mut Vec<Contact>,
        regions: &mut [Option<u32>],
    ) {
        if self.parts.len() < 2 || self.parts.len() < contacts.len() {
            return;
        }
        let most = |index: usize| {
            let parts = 0..self.parts.len();
            let carried = |part: &usize| self.parts[*part].carried[index];
            parts.max_by(|a, b| carried(a).total_cmp(&carried(b)))
        };
        let touched = regions.iter().enumerate();
        let owners: Vec<Option<usize>> = touched
            .map(|(index, region)| region.and_then(|_| most(index)))
            .collect();
        let mut found: Vec<(usize, Contact)> = (0..self.parts.len())
            .filter_map(|part| Some((part, gathered(part, &owners, cells, pitch)?)))
            .collect();
        found.sort_by(|(_, a), (_, b)| b.peak.total_cmp(&a.peak));
        for (region, owner) in regions.iter_mut().zip(&owners) {
            let index = found.iter().position(|(part, _)| Some(*part) == *owner);
            *region = index.map(|index| index as u32);
        }
        contacts.clear();
        contacts.extend(found.iter().map(|(_, contact)| *contact));
        if self.shifts.is_empty() {
            self.parts = found
                .iter()
                .map(|(part, _)| self.parts[*part].clone())
                .collect();
        }
    }

    /// Moves contacts to their positions.
    pub(super) fn apply(&mut self, contacts: &mut [Contact]) {
        if contacts.len() != self.parts.len() {
            return;
        }
        if self.shifts.is_empty() {
            let pairs = self.parts.iter().zip(&*contacts);
            let shift = |(part, contact): (&Located, &Contact)| {
                let position = part.position?;
                let shift = [0, 1].map(|axis| position.centre[axis] - contact.centre[axis]);
                Some((shift, position.covariance))
            };
            self.shifts = pairs.map(shift).collect();
        }
        for (contact, shift) in contacts.iter_mut().zip(&self.shifts) {
            if let Some((shift, covariance)) = shift {
                contact.centre = [0, 1].map(|axis| contact.centre[axis] + shift[axis]);
                contact.covariance = *covariance;
            }
        }
    }
}

/// The contact of the cells that belong to a part; none without a cell.
fn gathered(
    part: usize,
    owners: &[Option<usize>],
    cells: &[Cell],
    pitch: [f64; 2],
) -> Option<Contact> {
    let own = || {
        let pairs = cells.iter().enumerate().zip(owners);
        pairs.filter_map(move |(cell, owner)| (*owner == Some(part)).then_some(cell))
    };
    own().next()?;
    let mut gathering = Gathering::default();
    for (index, cell) in own() {
        gathering.add(index, cell);
    }
    gathering.settle();
    for (_, cell) in own() {
        gathering.add_about_centre(cell);
    }
    Some(gathering.finish(pitch))
}
