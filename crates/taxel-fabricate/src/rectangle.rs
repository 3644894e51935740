//! Rectangles with sides along x and y, and what they leave of a field.

/// A rectangle with its sides along x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Lower left corner, m.
    pub low: [f64; 2],
    /// Upper right corner, m.
    pub high: [f64; 2],
}

/// Coordinates nearer than this are the same, m: rounding of sums of lengths.
const SAME: f64 = 1e-13;

impl Rectangle {
    /// A rectangle about its centre; `centre` and `size` in m.
    pub fn centred(centre: [f64; 2], size: [f64; 2]) -> Self {
        Self {
            low: std::array::from_fn(|axis| centre[axis] - 0.5 * size[axis]),
            high: std::array::from_fn(|axis| centre[axis] + 0.5 * size[axis]),
        }
    }

    /// Lengths along x and y, m.
    pub fn size(&self) -> [f64; 2] {
        std::array::from_fn(|axis| self.high[axis] - self.low[axis])
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        let [x, y] = self.size();
        x * y
    }

    /// Corners counterclockwise from the lower left one, m.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let ([left, low], [right, high]) = (self.low, self.high);
        [[left, low], [right, low], [right, high], [left, high]]
    }
}

/// Lines across x and across y at the edges of `field` and of figures in it.
pub(crate) fn grid<'r>(
    field: &'r Rectangle,
    figures: impl Iterator<Item = &'r Rectangle>,
) -> [Vec<f64>; 2] {
    let mut edges = [Vec::new(), Vec::new()];
    for figure in figures.chain([field]) {
        for (axis, edges) in edges.iter_mut().enumerate() {
            edges.extend([figure.low[axis], figure.high[axis]]);
        }
    }
    edges.map(lines)
}

/// Gives `value` to the cells of a grid, row by row from the lowest y, that a figure covers.
pub(crate) fn paint<T: Clone>(
    cells: &mut [T],
    [xs, ys]: &[Vec<f64>; 2],
    figure: &Rectangle,
    value: &T,
) {
    let columns = xs.len() - 1;
    let across = line_at(xs, figure.low[0])..line_at(xs, figure.high[0]);
    for row in line_at(ys, figure.low[1])..line_at(ys, figure.high[1]) {
        cells[row * columns + across.start..row * columns + across.end].fill(value.clone());
    }
}

/// Sorted `values` without those that are the same but for rounding.
pub(crate) fn lines(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values.dedup_by(|next, kept| *next - *kept < SAME);
    values
}

/// Number of the line at `value`, which is one of them but for rounding.
pub(crate) fn line_at(lines: &[f64], value: f64) -> usize {
    lines.partition_point(|line| *line < value - SAME)
}

/// What `holes` leave of `field`, as rectangles that do not overlap.
///
/// Holes lie in the field; they may touch one another.
pub(crate) fn complement(field: &Rectangle, holes: &[Rectangle]) -> Vec<Rectangle> {
    let grid = grid(field, holes.iter());
    let mut filled = vec![false; (grid[0].len() - 1) * (grid[1].len() - 1)];
    for hole in holes {
        paint(&mut filled, &grid, hole, &true);
    }
    let [xs, ys] = grid;
    let columns = xs.len() - 1;
    let mut left: Vec<Rectangle> = Vec::new();
    // Bands of equal runs are one rectangle each: as few figures as the pattern has.
    let mut open: Vec<(usize, usize, usize)> = Vec::new();
    for row in 0..ys.len() {
        let runs = if row + 1 < ys.len() {
            runs(&filled[row * columns..(row + 1) * columns])
        } else {
            Vec::new()
        };
        let same =
            open.len() == runs.len() && open.iter().zip(&runs).all(|(a, b)| (a.0, a.1) == *b);
        if same && !open.is_empty() {
            continue;
        }
        left.extend(open.drain(..).map(|(from, to, start)| Rectangle {
            low: [xs[from], ys[start]],
            high: [xs[to], ys[row]],
        }));
        open = runs.into_iter().map(|(from, to)| (from, to, row)).collect();
    }
    left
}

/// From where to where cells are free.
fn runs(filled: &[bool]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (column, filled) in filled.iter().chain([&true]).enumerate() {
        match (filled, start) {
            (false, None) => start = Some(column),
            (true, Some(from)) => {
                found.push((from, column));
                start = None;
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_and_what_they_leave_make_the_field() {
        let field = Rectangle::centred([0.0; 2], [10e-3, 6e-3]);
        // A window, two that touch, one at the edge.
        let holes = [
            Rectangle::centred([-3e-3, 1e-3], [1e-3, 1e-3]),
            Rectangle::centred([0.0, 0.0], [1e-3, 2e-3]),
            Rectangle::centred([1e-3, 0.0], [1e-3, 2e-3]),
            Rectangle::centred([4e-3, 2e-3], [2e-3, 2e-3]),
        ];
        let left = complement(&field, &holes);
        let sum = |all: &[Rectangle]| all.iter().map(Rectangle::area).sum::<f64>();
        // Sums of products of lengths, round-off.
        assert!((sum(&left) + sum(&holes) - field.area()).abs() < 1e-18);
        for (number, a) in left.iter().enumerate() {
            for b in left.iter().skip(number + 1).chain(&holes) {
                let apart = (0..2).any(|axis| {
                    a.high[axis] <= b.low[axis] + SAME || b.high[axis] <= a.low[axis] + SAME
                });
                assert!(apart, "{a:?} {b:?}");
            }
        }
        assert!(complement(&field, &[field]).is_empty());
        assert_eq!(complement(&field, &[]), [field]);
    }
}
