//! Bodies between a flat bottom and a relief over a rectangular grid, as closed surfaces.
//!
//! Where two cells meet at different heights stands a wall. Its upright edges are divided at every
//! height that any neighbour has there, so that no corner of one triangle lies inside the edge of
//! another (such T-joints are what fails in slicers), and all triangles share their corners. Bodies
//! that touch along an upright edge alone have no such surface; no mould of a sensor is one.

use std::collections::BTreeMap;

use crate::rectangle::{Rectangle, grid, paint};

/// Heights over the cells of a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    /// Lines across x, ascending, m.
    xs: Vec<f64>,
    /// Lines across y, ascending, m.
    ys: Vec<f64>,
    /// Heights of the corners of each cell, row by row from the lowest y, m: (x-, y-), (x+, y-),
    /// (x-, y+), (x+, y+). A cell of height 0 is a hole.
    cells: Vec<[f64; 4]>,
}

/// A surface of triangles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Corners, m.
    pub points: Vec<[f64; 3]>,
    /// Numbers of the corners of each triangle, counterclockwise from outside.
    pub triangles: Vec<[usize; 3]>,
}

impl Relief {
    /// A plate over `field` as high as `ground`, m, with level figures in it: groups of them with their
    /// height, m, of which a later one covers an earlier one; 0 is a hole.
    pub fn level(field: &Rectangle, ground: f64, groups: &[(&[Rectangle], f64)]) -> Self {
        let grid = grid(field, groups.iter().flat_map(|(figures, _)| *figures));
        let mut cells = vec![[ground; 4]; (grid[0].len() - 1) * (grid[1].len() - 1)];
        for (figures, height) in groups {
            for figure in *figures {
                paint(&mut cells, &grid, figure, &[*height; 4]);
            }
        }
        let [xs, ys] = grid;
        Self { xs, ys, cells }
    }

    /// A relief without steps: `height` of a corner by the numbers of its lines, m, above 0.
    pub fn of_corners(xs: Vec<f64>, ys: Vec<f64>, height: impl Fn(usize, usize) -> f64) -> Self {
        let mut cells = Vec::with_capacity((xs.len() - 1) * (ys.len() - 1));
        for j in 0..ys.len() - 1 {
            for i in 0..xs.len() - 1 {
                cells.push(
                    [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| height(i, j)),
                );
            }
        }
        Self { xs, ys, cells }
    }

    /// Heights of a cell; of one outside 0.
    fn cell(&self, i: Option<usize>, j: Option<usize>) -> [f64; 4] {
        let columns = self.xs.len() - 1;
        match (i, j) {
            (Some(i), Some(j)) if i < columns && j < self.ys.len() - 1 => {
                self.cells[j * columns + i]
            }
            _ => [0.0; 4],
        }
    }

    /// The closed surface of the body below the relief, its bottom at z = 0.
    pub fn mesh(&self) -> Mesh {
        let mut surface = Surface {
            relief: self,
            numbers: BTreeMap::new(),
            mesh: Mesh::default(),
        };
        let (columns, rows) = (self.xs.len() - 1, self.ys.len() - 1);
        for j in 0..rows {
            for i in 0..columns {
                surface.cell(i, j);
            }
        }
        // Walls on the lines across x, then on those across y; the first cell lies to the left of
        // the way from p to q.
        for i in 0..=columns {
            for j in 0..rows {
                let (left, right) = (
                    self.cell(i.checked_sub(1), Some(j)),
                    self.cell(Some(i), Some(j)),
                );
                surface.wall(
                    [[i, j], [i, j + 1]],
                    [left[1], left[3]],
                    [right[0], right[2]],
                );
            }
        }
        for j in 0..=rows {
            for i in 0..columns {
                let (above, below) = (
                    self.cell(Some(i), Some(j)),
                    self.cell(Some(i), j.checked_sub(1)),
                );
                surface.wall(
                    [[i, j], [i + 1, j]],
                    [above[0], above[1]],
                    [below[2], below[3]],
                );
            }
        }
        surface.mesh
    }
}

/// A surface in the making.
struct Surface<'r> {
    relief: &'r Relief,
    /// Number of the corner on a line across x, a line across y, at a height.
    numbers: BTreeMap<(usize, usize, u64), usize>,
    mesh: Mesh,
}

impl Surface<'_> {
    fn corner(&mut self, [i, j]: [usize; 2], height: f64) -> usize {
        let points = &mut self.mesh.points;
        let place = [self.relief.xs[i], self.relief.ys[j], height];
        *self
            .numbers
            .entry((i, j, height.to_bits()))
            .or_insert_with(|| {
                points.push(place);
                points.len() - 1
            })
    }

    /// Top and bottom of a cell that is no hole.
    fn cell(&mut self, i: usize, j: usize) {
        let heights = self.relief.cell(Some(i), Some(j));
        if heights == [0.0; 4] {
            return;
        }
        let lines = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
        let [a, b, c, d]: [usize; 4] = std::array::from_fn(|k| self.corner(lines[k], heights[k]));
        // The crease of a cell with one corner off the plane of the others ends at that corner.
        let [ha, hb, hc, hd] = heights;
        let along_ad = (hb == hc) && (ha != hb || hd != hb);
        if along_ad {
            self.mesh.triangles.extend([[a, b, d], [a, d, c]]);
        } else {
            self.mesh.triangles.extend([[a, b, c], [b, d, c]]);
        }
        let [a, b, c, d]: [usize; 4] = std::array::from_fn(|k| self.corner(lines[k], 0.0));
        self.mesh.triangles.extend([[a, d, b], [a, c, d]]);
    }

    /// Heights at a corner of the grid, ascending.
    fn levels(&self, [i, j]: [usize; 2]) -> Vec<f64> {
        let (left, below) = (i.checked_sub(1), j.checked_sub(1));
        let mut levels = vec![
            self.relief.cell(Some(i), Some(j))[0],
            self.relief.cell(left, Some(j))[1],
            self.relief.cell(Some(i), below)[2],
            self.relief.cell(left, below)[3],
        ];
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        levels
    }

    /// The wall over the line from p to q between the heights of the cell on its left and of that
    /// on its right.
    fn wall(&mut self, [p, q]: [[usize; 2]; 2], left: [f64; 2], right: [f64; 2]) {
        if left == right {
            return;
        }
        let left_is_higher = left[0] + left[1] > right[0] + right[1];
        let mut chain = |at: [usize; 2], end: usize| -> Vec<(f64, usize)> {
            let (low, high) = (left[end].min(right[end]), left[end].max(right[end]));
            let levels = self.levels(at).into_iter();
            let between = levels.filter(|level| (low..=high).contains(level));
            between
                .map(|level| (level, self.corner(at, level)))
                .collect()
        };
        let (first, second) = (chain(p, 0), chain(q, 1));
        let (mut i, mut j) = (0, 0);
        while i + 1 < first.len() || j + 1 < second.len() {
            let (here, there) = (first[i].1, second[j].1);
            let up_first = match (first.get(i + 1), second.get(j + 1)) {
                (Some(a), Some(b)) => a.0 <= b.0,
                (next, _) => next.is_some(),
            };
            let next = if up_first {
                i += 1;
                first[i].1
            } else {
                j += 1;
                second[j].1
            };
            // From the higher cell the wall looks towards the lower one.
            self.mesh.triangles.push(if left_is_higher {
                [here, there, next]
            } else {
                [there, here, next]
            });
        }
    }
}

impl Mesh {
    /// Volume inside, m³: ∑ a · (b × c)/6 over the triangles (divergence theorem).
    pub fn volume(&self) -> f64 {
        let six = |triangle: &[usize; 3]| {
            let [a, b, c] = triangle.map(|corner| self.points[corner]);
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// True if every edge belongs to exactly two triangles that run through it in opposite ways.
    pub fn is_watertight(&self) -> bool {
        let mut ways: BTreeMap<(usize, usize), [u32; 2]> = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let seen = ways.entry((from.min(to), from.max(to))).or_default();
                seen[usize::from(from > to)] += 1;
            }
        }
        !ways.is_empty() && ways.values().all(|seen| *seen == [1, 1])
    }

    /// The surface, all its lengths times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for point in &mut self.points {
            *point = point.map(|coordinate| coordinate * factor);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_holes_and_slopes_are_closed_bodies_of_their_volume() {
        // Three heights and a hole round one corner; the middle column is painted twice.
        let figure = |low, high| [Rectangle { low, high }];
        let mesh = Relief::level(
            &figure([0.0, 0.0], [4.0, 3.0])[0],
            1.0,
            &[
                (&figure([1.0, 0.0], [3.0, 3.0]), 2.0),
                (&figure([3.0, 0.0], [4.0, 2.0]), 3.0),
                (&figure([0.0, 2.0], [1.0, 3.0]), 0.5),
                (&figure([1.0, 2.0], [3.0, 3.0]), 0.0),
                (&figure([3.0, 2.0], [4.0, 3.0]), 1.5),
            ],
        )
        .mesh();
        assert!(mesh.is_watertight());
        let volume = 2.0 * (1.0 + 2.0 * 2.0 + 3.0) + (0.5 + 1.5);
        assert!((mesh.volume() - volume).abs() < 1e-12);

        // A truncated pyramid as a pit: base 4, bottom 2, 1 deep.
        let lines = vec![-3.0, -2.0, -1.0, 1.0, 2.0, 3.0];
        let inner = |line: usize| line == 2 || line == 3;
        let depth = |i: usize, j: usize| if inner(i) && inner(j) { 1.0 } else { 2.0 };
        let mesh = Relief::of_corners(lines.clone(), lines, depth).mesh();
        assert!(mesh.is_watertight());
        let pit = (16.0 + 8.0 + 4.0) / 3.0;
        assert!((mesh.volume() - (72.0 - pit)).abs() < 1e-12);
    }

    #[test]
    fn a_surface_with_a_hole_in_it_is_seen() {
        let mut mesh = Relief::level(&Rectangle::centred([0.0; 2], [1.0; 2]), 1.0, &[]).mesh();
        assert!(mesh.is_watertight());
        mesh.triangles.pop();
        assert!(!mesh.is_watertight());
        assert!(!Mesh::default().is_watertight());
    }
}
