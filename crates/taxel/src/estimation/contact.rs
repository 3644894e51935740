//! Contact regions: connected taxels above their threshold.

/// One contact region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Number of taxels.
    pub taxels: usize,
    /// Centre of the normal force on the developed surface, m.
    pub centre: [f64; 2],
    /// Covariance of the centre xx, xy, yy, m².
    pub covariance: [f64; 3],
    /// Sum of the taxels' forces x, y, z, each in its taxel's frame, N.
    pub force: [f64; 3],
    /// Largest weight in the region (normal force, N).
    pub peak: f64,
    /// Index of the taxel with the largest weight.
    pub peak_taxel: usize,
}

/// Weight of a cell for segmentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    /// Place on the developed surface, m.
    pub(super) position: [f64; 2],
    /// Normal force or value; `NaN` for none.
    pub(super) weight: f64,
    /// Standard deviation of the weight.
    pub(super) deviation: f64,
    /// Weight above which the cell is touched.
    pub(super) threshold: f64,
    /// Force for the sum of the region.
    pub(super) force: [f64; 3],
}

/// Finds regions of touched cells, neighbours by side or corner, without
/// allocating once warm.
#[derive(Debug, Clone)]
pub(super) struct Segmentation {
    rows: usize,
    columns: usize,
    visited: Vec<bool>,
    stack: Vec<usize>,
}

/// A weighted centre with covariance, gathered cell by cell.
#[derive(Debug, Clone, Copy, Default)]
struct Centroid {
    weight: f64,
    moment: [f64; 2],
    /// Σσ², Σσ²x, Σσ²y, Σσ²xx, Σσ²xy, Σσ²yy.
    variance: [f64; 6],
}

impl Centroid {
    fn add(&mut self, cell: &Cell) {
        let [x, y] = cell.position;
        self.weight += cell.weight;
        self.moment[0] += cell.weight * x;
        self.moment[1] += cell.weight * y;
        let variance = cell.deviation * cell.deviation;
        for (sum, factor) in self
            .variance
            .iter_mut()
            .zip([1.0, x, y, x * x, x * y, y * y])
        {
            *sum += variance * factor;
        }
    }

    /// Centre Σwx/Σw and its covariance Σσ²(x−x̄)(y−ȳ)/(Σw)².
    fn finish(&self) -> ([f64; 2], [f64; 3]) {
        let [cx, cy] = self.moment.map(|moment| moment / self.weight);
        let [one, x, y, xx, xy, yy] = self.variance;
        let square = self.weight * self.weight;
        let covariance = [
            (xx - 2.0 * cx * x + cx * cx * one) / square,
            (xy - cx * y - cy * x + cx * cy * one) / square,
            (yy - 2.0 * cy * y + cy * cy * one) / square,
        ];
        // Rounding can leave a variance of a single cell just below zero.
        (
            [cx, cy],
            [
                covariance[0].max(0.0),
                covariance[1],
                covariance[2].max(0.0),
            ],
        )
    }
}

impl Segmentation {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            visited: vec![false; rows * columns],
            stack: Vec::new(),
        }
    }

    /// Writes the regions into `contacts`, strongest first, and returns the
    /// centre and covariance over all of them.
    pub(super) fn run(
        &mut self,
        cell: impl Fn(usize) -> Cell,
        contacts: &mut Vec<Contact>,
    ) -> Option<([f64; 2], [f64; 3])> {
        contacts.clear();
        self.visited.fill(false);
        let mut all = Centroid::default();
        for seed in 0..self.visited.len() {
            if !self.visited[seed] && touched(&cell(seed)) {
                contacts.push(self.grow(seed, &cell, &mut all));
            }
        }
        contacts.sort_by(|a, b| b.peak.total_cmp(&a.peak));
        (all.weight > 0.0).then(|| all.finish())
    }

    fn grow(&mut self, seed: usize, cell: &impl Fn(usize) -> Cell, all: &mut Centroid) -> Contact {
        let mut centroid = Centroid::default();
        let mut force = [0.0; 3];
        let (mut taxels, mut peak, mut peak_taxel) = (0, f64::NEG_INFINITY, seed);
        self.visited[seed] = true;
        self.stack.push(seed);
        while let Some(at) = self.stack.pop() {
            let here = cell(at);
            centroid.add(&here);
            all.add(&here);
            for (sum, value) in force.iter_mut().zip(here.force) {
                *sum += value;
            }
            taxels += 1;
            if here.weight > peak {
                (peak, peak_taxel) = (here.weight, at);
            }
            let (row, column) = (at / self.columns, at % self.columns);
            for r in row.saturating_sub(1)..=(row + 1).min(self.rows - 1) {
                for c in column.saturating_sub(1)..=(column + 1).min(self.columns - 1) {
                    let next = r * self.columns + c;
                    if !self.visited[next] && touched(&cell(next)) {
                        self.visited[next] = true;
                        self.stack.push(next);
                    }
                }
            }
        }
        let (centre, covariance) = centroid.finish();
        Contact {
            taxels,
            centre,
            covariance,
            force,
            peak,
            peak_taxel,
        }
    }
}

fn touched(cell: &Cell) -> bool {
    cell.weight > cell.threshold
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(weights: &'static [f64], columns: usize) -> impl Fn(usize) -> Cell {
        move |index| Cell {
            position: [(index % columns) as f64, -((index / columns) as f64)],
            weight: weights[index],
            deviation: 0.1,
            threshold: 0.5,
            force: [0.0, 0.0, weights[index]],
        }
    }

    #[test]
    fn corners_connect_and_gaps_divide() {
        let weights = &[
            2.0,
            0.0,
            0.0,
            1.0,
            0.0,
            1.0,
            0.0,
            0.0,
            f64::NAN,
            0.0,
            0.0,
            4.0,
        ];
        let mut contacts = Vec::new();
        let all = Segmentation::new(3, 4).run(cells(weights, 4), &mut contacts);
        assert_eq!(
            contacts.iter().map(|c| c.taxels).collect::<Vec<_>>(),
            [1, 2, 1]
        );
        assert_eq!(contacts[0].peak_taxel, 11);
        assert_eq!(contacts[1].centre, [1.0 / 3.0, -1.0 / 3.0]);
        assert_eq!(all.unwrap().0, [(1.0 + 3.0 + 12.0) / 8.0, -9.0 / 8.0]);
    }

    #[test]
    fn covariance_of_a_centre_of_two_is_the_textbook_one() {
        let mut contacts = Vec::new();
        Segmentation::new(1, 2).run(cells(&[1.0, 3.0], 2), &mut contacts);
        // x̄ = 3/4; var = σ²(x̄² + (1−x̄)²)/16.
        let expected = 0.01 * (0.5625 + 0.0625) / 16.0;
        assert!((contacts[0].covariance[0] - expected).abs() < 1e-16);
    }
}
