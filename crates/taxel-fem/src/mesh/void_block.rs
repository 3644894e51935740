//! A block with two crossing rows of voids, under loads on parts of its top.

use super::axis::{Axis, Grading, Growth};
use super::ellipse::VoidShape;
use super::error::{MeshError, in_range};
use super::structured::Grid3;
use super::{CrossingVoids, Facet, Mesh};

/// Outline of a footprint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FootprintShape {
    /// A rectangle.
    #[default]
    Rectangle,
    /// The ellipse that touches its sides, of equal sides a disc: the cells whose middles lie in
    /// it, so that its area is right to the size of the cells.
    Ellipse,
}

/// A part of the top of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Its middle along x and y, from the middle of the block.
    pub centre: [f64; 2],
    /// Its lengths along x and y.
    pub size: [f64; 2],
    /// Its outline.
    pub shape: FootprintShape,
}

impl Footprint {
    /// Its ends along an axis.
    pub fn ends(&self, axis: usize) -> [f64; 2] {
        let reach = self.size[axis] / 2.0;
        [-reach, reach].map(|side| self.centre[axis] + side)
    }
}

/// A block whose voids run through it from side to side. Its middle lies at x = y = 0,
/// its bottom at z = 0. Lengths in one unit of choice.
///
/// Where all footprints lie in the middle of an axis, only the half beyond zero is
/// meshed: what remains is the same on both sides. The region is `solid`; surfaces are
/// those of [`super::Grid`], the parts of the top under the footprints, `footprint0`,
/// `footprint1` … in their order, and the voids, `upper0`, `upper1` … in the order of y
/// and `lower0` … in the order of x.
#[derive(Clone, Debug, PartialEq)]
pub struct VoidBlock {
    /// Section and distance of the voids, the stack, and the division into cells; these
    /// also shrink towards the edges of the footprints.
    pub voids: CrossingVoids,
    /// Number of upper voids, which run along x, and of lower ones, along y. Each row
    /// stands in the middle of the block.
    pub counts: [usize; 2],
    /// Lengths along x and y.
    pub size: [f64; 2],
    /// Where the loads act.
    pub footprints: Vec<Footprint>,
}

/// Names of the rows: upper, lower.
pub const VOID_ROWS: [&str; 2] = ["upper", "lower"];

impl VoidBlock {
    /// The mesh.
    ///
    /// # Errors
    /// [`MeshError::OutOfRange`] and [`MeshError::NoWall`] for lengths that make no
    /// block, voids that do not fit in it, a footprint that is not on it, no footprint at all;
    /// [`MeshError::TooManyCells`].
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        self.check()?;
        let (up, heights) = self.voids.upward()?;
        let mut grid = Grid3::new([self.along(0)?, self.along(1)?, up], "solid");
        for (row, name) in VOID_ROWS.into_iter().enumerate() {
            for number in self.meshed(row) {
                let mut limits = [self.span(0), self.span(1), heights[row]];
                limits[1 - row] = self.side_walls(row, number);
                grid = grid.void(&format!("{name}{number}"), limits);
            }
        }
        let mut mesh = grid.mesh()?;
        if self.voids.shape == VoidShape::Ellipse {
            for (row, levels) in heights.into_iter().enumerate() {
                let void = |across: f64| self.nearest(row, across);
                self.voids.round(&mut mesh, row, levels, &void);
            }
        }
        for (number, footprint) in self.footprints.iter().enumerate() {
            self.name_footprint(&mut mesh, number, footprint);
        }
        Ok(mesh)
    }

    /// True if only the half beyond zero is meshed along an axis.
    pub fn is_half(&self, axis: usize) -> bool {
        self.footprints
            .iter()
            .all(|footprint| footprint.centre[axis] == 0.0)
    }

    /// Numbers of the voids of a row that are in the mesh.
    pub fn meshed(&self, row: usize) -> std::ops::Range<usize> {
        let count = self.counts[row];
        let first = if self.is_half(1 - row) { count / 2 } else { 0 };
        first..count
    }

    /// Middle of a void across its length.
    pub fn middle(&self, row: usize, number: usize) -> f64 {
        (number as f64 - (self.counts[row] as f64 - 1.0) / 2.0) * self.voids.pitch
    }

    /// Middle of the void of a row that is nearest to a place across it, and the solid beside it on
    /// that side: half a wall, or all to the side of the block.
    fn nearest(&self, row: usize, across: f64) -> (f64, f64) {
        let last = self.counts[row] - 1;
        let number = (across - self.middle(row, 0)) / self.voids.pitch;
        let number = (number.round().max(0.0) as usize).min(last);
        let middle = self.middle(row, number);
        let outer = (number == 0 && across < middle) || (number == last && across > middle);
        let reach = if outer {
            self.size[1 - row] / 2.0 - middle.abs()
        } else {
            self.voids.pitch / 2.0
        };
        (middle, reach - self.voids.width / 2.0)
    }

    /// Where a void begins and ends across its length, as far as it is in the mesh.
    fn side_walls(&self, row: usize, number: usize) -> [f64; 2] {
        let (middle, half) = (self.middle(row, number), self.voids.width / 2.0);
        [(middle - half).max(self.span(1 - row)[0]), middle + half]
    }

    /// Where the mesh begins and ends along an axis.
    fn span(&self, axis: usize) -> [f64; 2] {
        let half = self.size[axis] / 2.0;
        [if self.is_half(axis) { 0.0 } else { -half }, half]
    }

    fn check(&self) -> Result<(), MeshError> {
        let names = [
            ("number of upper voids", "width of the block across them"),
            ("number of lower voids", "length of the block across them"),
        ];
        for (row, (number, across)) in names.into_iter().enumerate() {
            let count = self.counts[row] as f64;
            in_range(number, count, 1.0, 1e3)?;
            let needed = (count - 1.0) * self.voids.pitch + self.voids.width;
            // Some solid must be left beside the last void.
            in_range(across, self.size[1 - row], needed * (1.0 + 1e-6), f64::MAX)?;
        }
        let count = self.footprints.len() as f64;
        in_range("number of footprints", count, 1.0, 1e3)?;
        for footprint in &self.footprints {
            for axis in 0..2 {
                let (half, reach) = (self.size[axis] / 2.0, footprint.size[axis] / 2.0);
                in_range("size of the footprint", 2.0 * reach, 1e-6 * half, f64::MAX)?;
                let end = footprint.centre[axis].abs() + reach;
                // A billionth is forgiven: lengths are often sums of others.
                in_range("end of the footprint", end, 0.0, half * (1.0 + 1e-9))?;
            }
        }
        Ok(())
    }

    /// Axis along x or y, divided at the side walls of voids and at the footprints.
    fn along(&self, axis: usize) -> Result<Axis, MeshError> {
        let [start, end] = self.span(axis);
        let row = 1 - axis;
        let mut places: Vec<f64> = self
            .meshed(row)
            .flat_map(|number| self.side_walls(row, number))
            .chain(self.footprints.iter().flat_map(|one| one.ends(axis)))
            .filter(|place| start < *place && *place < end)
            .chain([start, end])
            .collect();
        places.sort_by(f64::total_cmp);
        let near = 1e-9 * (end - start);
        // Of places that rounding has parted the outer sides stay.
        places.dedup_by(|second, first| *second - *first < near);
        if let Some(last) = places.last_mut() {
            *last = end;
        }
        let growths = places
            .windows(2)
            .map(|ends| self.growth_between(axis, ends));
        let growths: Vec<Growth> = growths.collect();
        let mut gradings: Vec<Grading> = growths.iter().copied().map(Grading::FromBoth).collect();
        gradings[0] = Grading::FromEnd(growths[0]);
        if let (Some(grading), Some(growth)) = (gradings.last_mut(), growths.last()) {
            *grading = Grading::FromStart(*growth);
        }
        Axis::new(&places, &gradings)
    }

    /// Growth of cells between two positions along an axis. From a quarter of a pitch
    /// beside all footprints on two cells in the width of a void do: it bends little
    /// there.
    fn growth_between(&self, axis: usize, ends: &[f64]) -> Growth {
        let growth = self.voids.growth();
        let beside = self.footprints.iter().map(|one| {
            let [near, far] = one.ends(axis);
            (near - ends[1]).max(ends[0] - far)
        });
        let beside = beside.fold(f64::INFINITY, f64::min);
        if beside < self.voids.pitch / 4.0 {
            return growth;
        }
        let smallest = growth.smallest.max(self.voids.width / 2.0);
        Growth {
            smallest,
            largest: growth.largest.max(smallest),
            ..growth
        }
    }

    fn name_footprint(&self, mesh: &mut Mesh, number: usize, footprint: &Footprint) {
        let near = 1e-6 * self.size[0].max(self.size[1]);
        let pressed = [footprint.ends(0), footprint.ends(1)];
        let inside = |node: u32| {
            let place = mesh.points[node as usize];
            (0..2).all(|axis| {
                let [low, high] = pressed[axis];
                (low - near..=high + near).contains(&place[axis])
            })
        };
        // Four corners of a facet come first.
        let middle = |facet: Facet, axis: usize| {
            let corners = mesh.facet_nodes(facet).take(4);
            corners
                .map(|node| mesh.points[node as usize][axis])
                .sum::<f64>()
                / 4.0
        };
        let outlined = |facet: Facet| match footprint.shape {
            FootprintShape::Rectangle => true,
            FootprintShape::Ellipse => {
                let away = [0, 1].map(|axis| {
                    2.0 * (middle(facet, axis) - footprint.centre[axis]) / footprint.size[axis]
                });
                away[0].hypot(away[1]) < 1.0
            }
        };
        let top = mesh.surfaces.get("top").into_iter().flatten().copied();
        let facets = top
            .filter(|&facet| mesh.facet_nodes(facet).all(inside) && outlined(facet))
            .collect();
        mesh.surfaces.insert(format!("footprint{number}"), facets);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::measure;

    fn block(counts: [usize; 2], size: [f64; 2], footprint: Footprint) -> VoidBlock {
        VoidBlock {
            voids: CrossingVoids {
                width: 400.0,
                pitch: 600.0,
                base: 100.0,
                lower: 20.0,
                between: 140.0,
                upper: 20.0,
                cover: 140.0,
                smallest: 100.0,
                growth: 2.0,
                largest: f64::INFINITY,
                shape: VoidShape::Rectangle,
            },
            counts,
            size,
            footprints: vec![footprint],
        }
    }

    const MIDDLE: Footprint = Footprint {
        centre: [0.0; 2],
        size: [1000.0; 2],
        shape: FootprintShape::Rectangle,
    };

    #[test]
    fn what_is_meshed_is_the_block_less_its_voids() {
        for (counts, size, centre) in [
            ([1, 1], [1000.0, 1000.0], [0.0, 0.0]),
            ([2, 2], [1400.0, 1400.0], [0.0, 0.0]),
            ([3, 2], [1400.0, 2000.0], [0.0, 0.0]),
            ([2, 4], [2600.0, 1400.0], [300.0, 0.0]),
            ([2, 4], [2600.0, 1400.0], [-700.0, 110.0]),
        ] {
            let footprint = Footprint { centre, ..MIDDLE };
            let block = block(counts, size, footprint);
            let mesh = block.mesh().unwrap();
            let parts = [0, 1].map(|axis| if block.is_half(axis) { 0.5 } else { 1.0 });
            let [rows, columns] = counts.map(|count| count as f64);
            let voids = 400.0 * 20.0 * (rows * size[0] + columns * size[1]);
            let exact = (size[0] * size[1] * 420.0 - voids) * parts[0] * parts[1];
            let volume: f64 = (0..mesh.cell_count())
                .map(|cell| measure(&mesh, cell))
                .sum();
            // Rounding of sums.
            assert!((volume / exact - 1.0).abs() < 1e-12, "{counts:?}");
            let area: f64 = mesh.surfaces["footprint0"]
                .iter()
                .map(|&facet| {
                    let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
                    let x = |k: usize| mesh.points[nodes[k] as usize];
                    ((x(1)[0] - x(0)[0]) * (x(3)[1] - x(0)[1])
                        - (x(1)[1] - x(0)[1]) * (x(3)[0] - x(0)[0]))
                        .abs()
                })
                .sum();
            assert!((area / (1e6 * parts[0] * parts[1]) - 1.0).abs() < 1e-12);
            for row in 0..2 {
                for number in block.meshed(row) {
                    let name = format!("{}{number}.roof", VOID_ROWS[row]);
                    assert!(mesh.surfaces.contains_key(&name), "{name}");
                }
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let narrow = block([2, 2], [1000.0, 1400.0], MIDDLE);
        assert!(matches!(narrow.mesh(), Err(MeshError::OutOfRange { .. })));
        assert!(block([0, 2], [1400.0; 2], MIDDLE).mesh().is_err());
        for footprint in [
            Footprint {
                centre: [300.0, 0.0],
                ..MIDDLE
            },
            Footprint {
                size: [0.0, 100.0],
                ..MIDDLE
            },
            Footprint {
                centre: [f64::NAN, 0.0],
                ..MIDDLE
            },
        ] {
            let refused = block([2, 2], [1400.0; 2], footprint).mesh();
            assert!(
                matches!(refused, Err(MeshError::OutOfRange { .. })),
                "{footprint:?}"
            );
        }
    }
}
