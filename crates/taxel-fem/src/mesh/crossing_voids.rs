//! A quarter of one cell of a layer with two crossing rows of voids.

use super::Mesh;
use super::axis::{Axis, Grading, Growth};
use super::ellipse::{Ellipse, VoidShape};
use super::error::{MeshError, in_range};
use super::structured::Grid3;

/// A layer with two rows of long voids above each other: the upper ones run along x, the
/// lower ones along y. The mesh is the quarter between the middles of a crossing and of
/// the solid beside it: 0 to pitch/2 in x and y. Lengths in one unit of choice.
///
/// The region is `solid`; surfaces are those of [`super::Grid`], the voids `upper` and
/// `lower`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingVoids {
    /// Width of all voids, of which half is in the mesh.
    pub width: f64,
    /// Distance from one void to the next in its row, of which half is in the mesh.
    pub pitch: f64,
    /// Thickness of the solid below the lower voids.
    pub base: f64,
    /// Height of the lower voids.
    pub lower: f64,
    /// Thickness of the solid between the voids.
    pub between: f64,
    /// Height of the upper voids.
    pub upper: f64,
    /// Thickness of the solid above the upper voids.
    pub cover: f64,
    /// Smallest cell, at the edges of the voids, in the unit of the lengths.
    pub smallest: f64,
    /// Largest ratio of neighbours, 1 to 2.
    pub growth: f64,
    /// Largest cell, in the unit of the lengths; infinity for no limit.
    pub largest: f64,
    /// Cross-section of all voids.
    pub shape: VoidShape,
}

impl CrossingVoids {
    /// The mesh.
    ///
    /// # Errors
    /// [`MeshError::OutOfRange`] and [`MeshError::NoWall`] for lengths that make no cell,
    /// [`MeshError::TooManyCells`].
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let (up, voids) = self.upward()?;
        let growth = self.growth();
        let (wall, middle) = (self.width / 2.0, self.pitch / 2.0);
        let towards_wall = [Grading::FromEnd(growth), Grading::FromStart(growth)];
        let across = Axis::new(&[0.0, wall, middle], &towards_wall)?;
        let all = [0.0, middle];
        let mut mesh = Grid3::new([across.clone(), across, up], "solid")
            .void("upper", [all, [0.0, wall], voids[0]])
            .void("lower", [[0.0, wall], all, voids[1]])
            .mesh()?;
        if self.shape == VoidShape::Ellipse {
            for (row, levels) in voids.into_iter().enumerate() {
                self.round(&mut mesh, row, levels, &|_| (0.0, middle - wall));
            }
        }
        Ok(mesh)
    }

    /// Makes the voids of a row (upper, lower) between two levels elliptic; `void` gives the middle
    /// of the void that a place across the row belongs to, and the solid beside that void there.
    pub(super) fn round(
        &self,
        mesh: &mut Mesh,
        row: usize,
        levels: [f64; 2],
        void: &dyn Fn(f64) -> (f64, f64),
    ) {
        let half = [0.5 * self.width, 0.5 * (levels[1] - levels[0])];
        let height = levels[0] + half[1];
        // The solid between the rows is shared in its middle.
        let room = match row {
            0 => [self.cover, 0.5 * self.between],
            _ => [0.5 * self.between, self.base],
        };
        let across = 1 - row;
        for point in &mut mesh.points {
            let (middle, beside) = void(point[across]);
            let ellipse = Ellipse { half, beside, room };
            let [x, y] = ellipse.place([point[across] - middle, point[2] - height]);
            point[across] = middle + x;
            point[2] = height + y;
        }
    }

    /// Growth of cells away from the edges of the voids.
    pub(super) fn growth(&self) -> Growth {
        Growth {
            smallest: self.smallest,
            ratio: self.growth,
            largest: self.largest,
        }
    }

    /// The axis through the layer, and where on it the upper and the lower voids lie.
    pub(super) fn upward(&self) -> Result<(Axis, [[f64; 2]; 2]), MeshError> {
        let stack = [
            ("base below the voids", self.base),
            ("height of the lower voids", self.lower),
            ("solid between the voids", self.between),
            ("height of the upper voids", self.upper),
            ("cover above the voids", self.cover),
        ];
        for (quantity, length) in stack {
            in_range(quantity, length, f64::MIN_POSITIVE, f64::MAX)?;
        }
        in_range(
            "width of the voids",
            self.width,
            f64::MIN_POSITIVE,
            f64::MAX,
        )?;
        if self.pitch.partial_cmp(&self.width) != Some(std::cmp::Ordering::Greater) {
            return Err(MeshError::NoWall {
                width: self.width,
                pitch: self.pitch,
            });
        }
        let mut levels = vec![0.0];
        for (_, thickness) in stack {
            levels.push(levels[levels.len() - 1] + thickness);
        }
        let growth = self.growth();
        let (from_end, from_start) = (Grading::FromEnd(growth), Grading::FromStart(growth));
        let both = Grading::FromBoth(growth);
        let up = Axis::new(&levels, &[from_end, both, both, both, from_start])?;
        Ok((up, [[levels[3], levels[4]], [levels[1], levels[2]]]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::measure;

    #[test]
    fn the_solid_is_the_layer_less_its_voids() {
        let layer = CrossingVoids {
            width: 400.0,
            pitch: 600.0,
            base: 100.0,
            lower: 20.0,
            between: 140.0,
            upper: 20.0,
            cover: 140.0,
            smallest: 10.0,
            growth: 2.0,
            largest: 80.0,
            shape: VoidShape::Rectangle,
        };
        let mesh = layer.mesh().unwrap();
        let volume: f64 = (0..mesh.cell_count())
            .map(|cell| measure(&mesh, cell))
            .sum();
        let exact = 300.0 * (300.0 * 420.0 - 2.0 * 200.0 * 20.0);
        assert!((volume / exact - 1.0).abs() < 1e-12);
        // Each void is open at both ends of the quarter, and cut by the plane of symmetry.
        assert!(mesh.surfaces.contains_key("upper.back"));
        assert!(!mesh.surfaces.contains_key("upper.left"));
        assert!(mesh.surfaces.contains_key("lower.right"));
        assert!(!mesh.surfaces.contains_key("lower.front"));
        let sides = [
            "left", "right", "front", "back", "bottom", "top", "upper", "lower",
        ];
        let named: usize = sides.iter().map(|name| mesh.surfaces[*name].len()).sum();
        assert_eq!(named, mesh.boundary().len());
    }

    #[test]
    fn elliptic_voids_have_the_area_of_ellipses_and_leave_the_outer_sides() {
        let layer = CrossingVoids {
            width: 100.0,
            pitch: 300.0,
            base: 100.0,
            lower: 60.0,
            between: 80.0,
            upper: 100.0,
            cover: 50.0,
            smallest: 25.0,
            growth: 2.0,
            largest: 80.0,
            shape: VoidShape::Ellipse,
        };
        let mesh = layer.mesh().unwrap();
        let volumes = (0..mesh.cell_count()).map(|cell| measure(&mesh, cell));
        let volume: f64 = volumes
            .inspect(|volume| assert!(*volume > 0.0, "a cell inside out"))
            .sum();
        let ellipses = 0.5 * std::f64::consts::FRAC_PI_4 * 100.0 * (60.0 + 100.0) * 150.0;
        let exact = 150.0 * 150.0 * 390.0 - ellipses;
        // Quadratic edges for arcs.
        assert!((volume / exact - 1.0).abs() < 1e-4, "{volume} {exact}");
        for node in mesh.nodes_of("upper").unwrap() {
            let [_, y, z] = mesh.points[node as usize];
            let off = (y / 50.0).hypot((z - 290.0) / 50.0) - 1.0;
            assert!(off.abs() < 1e-12, "{y} {z}");
        }
        for node in mesh.nodes_of("top").unwrap() {
            assert_eq!(mesh.points[node as usize][2], 390.0);
        }
    }

    #[test]
    fn a_pitch_not_wider_than_the_void_is_refused() {
        let layer = CrossingVoids {
            width: 2.0,
            pitch: 2.0,
            base: 1.0,
            lower: 1.0,
            between: 1.0,
            upper: 1.0,
            cover: 1.0,
            smallest: 0.5,
            growth: 2.0,
            largest: f64::INFINITY,
            shape: VoidShape::Rectangle,
        };
        assert!(matches!(layer.mesh(), Err(MeshError::NoWall { .. })));
        let nan = CrossingVoids {
            pitch: f64::NAN,
            ..layer
        };
        assert!(matches!(nan.mesh(), Err(MeshError::NoWall { .. })));
        let flat = CrossingVoids {
            pitch: 3.0,
            upper: 0.0,
            ..layer
        };
        assert!(matches!(flat.mesh(), Err(MeshError::OutOfRange { .. })));
    }
}
