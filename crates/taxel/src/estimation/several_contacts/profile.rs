//! Shares of a contact on the elements, between the positions and sizes of the tables.

use super::{Scene, Shape};
use crate::estimation::localisation::ProfileModel;
use crate::estimation::position_fit::{OFFSETS, STEPS};

/// The offset of a contact from an element along one axis, between two of a table.
struct Cut {
    cell: usize,
    part: f64,
    sign: f64,
}

impl Cut {
    /// From the element of this number; none where it is too far.
    #[inline]
    fn new(at: f64, element: usize) -> Option<Self> {
        let offset = at - (element * STEPS) as f64;
        let far = offset.abs();
        let cell = far as usize;
        (cell + 1 < OFFSETS).then_some(Self {
            cell,
            part: far - cell as f64,
            sign: offset.signum(),
        })
    }
}

/// A table between its offsets, with its slopes along both axes.
#[inline]
fn plane(table: &[f64], x: &Cut, y: &Cut) -> [f64; 3] {
    let corner = x.cell * OFFSETS + y.cell;
    let (first, second) = (&table[corner..][..2], &table[corner + OFFSETS..][..2]);
    let [low, high] = [0, 1].map(|k| first[k] + x.part * (second[k] - first[k]));
    let [below, above] = [0, 1].map(|k| second[k] - first[k]);
    [
        low + y.part * (high - low),
        below + y.part * (above - below),
        high - low,
    ]
}

impl Scene<'_> {
    /// What tables of all sizes say of a contact on each element that it reaches, with the
    /// slopes along x, y and size.
    #[inline]
    pub(super) fn each(
        tables: &[Vec<f64>],
        model: &ProfileModel,
        at: [f64; 2],
        size: f64,
        mut take: impl FnMut(usize, [f64; 4]),
    ) {
        let last = tables.len() - 1;
        let cell = (size as usize).min(last.saturating_sub(1));
        let (near, far) = (&tables[cell], &tables[(cell + 1).min(last)]);
        let part = size - cell as f64;
        let columns: Vec<Option<Cut>> = (0..model.columns).map(|c| Cut::new(at[0], c)).collect();
        for row in 0..model.rows {
            let Some(y) = Cut::new(at[1], model.rows - 1 - row) else {
                continue;
            };
            for (column, x) in columns.iter().enumerate() {
                let Some(x) = x else { continue };
                let [near, far] = [near, far].map(|table| plane(table, x, &y));
                let [value, along_x, along_y] =
                    [0, 1, 2].map(|k| near[k] + part * (far[k] - near[k]));
                let slopes = [along_x * x.sign, along_y * y.sign, far[0] - near[0]];
                let element = row * model.columns + column;
                take(element, [value, slopes[0], slopes[1], slopes[2]]);
            }
        }
    }

    /// Shares on each element that a contact reaches, with their slopes along x, y and size.
    #[inline]
    pub(super) fn shares(&self, one: &Shape, take: impl FnMut(usize, [f64; 4])) {
        Self::each(self.tables, &self.fit.model, one.at, one.size, take);
    }

    /// Shares on all elements over the deviations of the forces.
    pub(super) fn weighed(&self, one: &Shape) -> Vec<f64> {
        let mut row = vec![0.0; self.roots.len()];
        self.shares(one, |element, [share, ..]| {
            row[element] = share * self.roots[element];
        });
        row
    }

    /// Forces of a contact on all elements, N.
    pub(super) fn carried(&self, one: &Shape) -> Vec<f64> {
        let mut forces = vec![0.0; self.forces.len()];
        self.shares(one, |element, [share, ..]| {
            forces[element] = one.force * share;
        });
        forces
    }

    /// Residuals of the forces over their deviations.
    pub(super) fn residuals(&self, shapes: &[Shape]) -> Vec<f64> {
        let mut left = self.weighted.clone();
        for one in shapes {
            self.shares(one, |element, [share, ..]| {
                left[element] -= one.force * share * self.roots[element];
            });
        }
        left
    }
}
