//! Which track is which contact: the assignment of least total cost.

/// No partner, in the columns of the search.
const NONE: usize = usize::MAX;

/// Assigns rows to columns one to one so that the sum of the costs is least,
/// where a row without a column costs `alone`; pairs that cost more than that
/// are never made. Buffers are kept between calls.
///
/// The Hungarian method with potentials (Jonker and Volgenant's form): one
/// shortest path for each row, O(rows² (rows + columns)).
#[derive(Debug, Clone, Default)]
pub(super) struct Assignment {
    /// Potentials of rows and columns.
    row_potential: Vec<f64>,
    column_potential: Vec<f64>,
    /// Row of each column; the last column is where a path starts.
    row_of: Vec<usize>,
    /// Column before each one on the path.
    before: Vec<usize>,
    distance: Vec<f64>,
    reached: Vec<bool>,
    column_of: Vec<Option<usize>>,
}

impl Assignment {
    /// The column of each row.
    pub(super) fn solve(
        &mut self,
        rows: usize,
        columns: usize,
        alone: f64,
        cost: impl Fn(usize, usize) -> f64,
    ) -> &[Option<usize>] {
        // Behind the columns each row has one of its own: to stay alone.
        let all = columns + rows;
        let full = |row: usize, column: usize| match column {
            _ if column == columns + row => alone,
            _ if column >= columns => f64::INFINITY,
            _ => Some(cost(row, column))
                .filter(|cost| *cost <= alone)
                .unwrap_or(f64::INFINITY),
        };
        self.begin(rows, all);
        for row in 0..rows {
            self.place(row, all, &full);
        }
        self.column_of.clear();
        self.column_of.resize(rows, None);
        for (column, row) in self.row_of[..columns].iter().enumerate() {
            if *row != NONE {
                self.column_of[*row] = Some(column);
            }
        }
        &self.column_of
    }

    fn begin(&mut self, rows: usize, all: usize) {
        self.row_potential.clear();
        self.row_potential.resize(rows, 0.0);
        self.column_potential.clear();
        self.column_potential.resize(all + 1, 0.0);
        self.row_of.clear();
        self.row_of.resize(all + 1, NONE);
        self.before.resize(all + 1, NONE);
        self.distance.resize(all + 1, 0.0);
        self.reached.resize(all + 1, false);
    }

    /// Gives `row` a column along the shortest alternating path.
    fn place(&mut self, row: usize, all: usize, cost: &impl Fn(usize, usize) -> f64) {
        self.distance.fill(f64::INFINITY);
        self.reached.fill(false);
        self.row_of[all] = row;
        let mut at = all;
        while self.row_of[at] != NONE {
            at = self.extend(at, all, cost);
        }
        while at != all {
            let before = self.before[at];
            self.row_of[at] = self.row_of[before];
            at = before;
        }
    }

    /// Reaches one more column, the nearest one.
    fn extend(&mut self, at: usize, all: usize, cost: &impl Fn(usize, usize) -> f64) -> usize {
        self.reached[at] = true;
        let row = self.row_of[at];
        let (mut nearest, mut step) = (all, f64::INFINITY);
        for column in 0..all {
            if self.reached[column] {
                continue;
            }
            let reduced =
                cost(row, column) - self.row_potential[row] - self.column_potential[column];
            if reduced < self.distance[column] {
                self.distance[column] = reduced;
                self.before[column] = at;
            }
            if self.distance[column] < step {
                (nearest, step) = (column, self.distance[column]);
            }
        }
        for column in 0..=all {
            if self.reached[column] {
                self.row_potential[self.row_of[column]] += step;
                self.column_potential[column] -= step;
            } else {
                self.distance[column] -= step;
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Least cost over all ways, by trying them.
    fn least(row: usize, costs: &[Vec<f64>], alone: f64, used: &mut Vec<bool>) -> f64 {
        if row == costs.len() {
            return 0.0;
        }
        let mut best = alone + least(row + 1, costs, alone, used);
        for column in 0..used.len() {
            if !used[column] && costs[row][column] <= alone {
                used[column] = true;
                best = best.min(costs[row][column] + least(row + 1, costs, alone, used));
                used[column] = false;
            }
        }
        best
    }

    proptest! {
        #[test]
        fn no_other_assignment_costs_less(
            (rows, columns) in (0_usize..5, 0_usize..5),
            numbers in prop::collection::vec(0.0..20.0, 25),
        ) {
            let costs: Vec<Vec<f64>> = (0..rows)
                .map(|row| numbers[5 * row..5 * row + columns].to_vec())
                .collect();
            let mut assignment = Assignment::default();
            let found = assignment.solve(rows, columns, 10.0, |r, c| costs[r][c]);
            let mut used = vec![false; columns];
            let mut total = 0.0;
            for (row, column) in found.iter().enumerate() {
                total += column.map_or(10.0, |column| {
                    assert!(!std::mem::replace(&mut used[column], true));
                    assert!(costs[row][column] <= 10.0);
                    costs[row][column]
                });
            }
            let best = least(0, &costs, 10.0, &mut vec![false; columns]);
            // Rounding of a few sums of numbers up to 20.
            prop_assert!((total - best).abs() < 1e-12, "{total} {best}");
        }
    }
}
