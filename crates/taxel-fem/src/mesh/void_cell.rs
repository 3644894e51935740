//! Half of one cell of a layer with a row of rectangular voids, refined to their corners.

use super::axis::{Axis, Grading, Growth};
use super::ellipse::Ellipse;
use super::error::{MeshError, in_range};
use super::patchwork::{Patchwork, between};
use super::{Facet, Mesh};

/// Most cells round the corners' squares.
const MOST_CELLS: usize = 2_000_000;

/// Largest innermost ring inside another, over the square round a corner: what is larger takes
/// the whole square.
const WIDEST_INNER: f64 = 0.8;

/// A layer with a row of voids of one shape: the half between the middle of a void
/// (x = 0) and the middle of the solid beside it. Lengths in one unit of choice.
///
/// ```text
///  cover  |                  |
///         |______            |
///  height  void  |           |
///         |______|           |
///  base   |                  |
///         0    width/2    pitch/2
/// ```
///
/// The region is `solid`, the outer sides are `left`, `right`, `bottom`, `top`, the walls
/// `void`, `void.roof`, `void.floor`, `void.side`. `void.roof` and `void.floor` start at
/// their corner; `void.side` starts at the upper corner, and so does its upper half
/// `void.side.upper`; its lower half `void.side.lower` starts at the lower corner. A
/// fillet is shared between its two walls in its middle: facets of the same number in
/// `void.roof` and `void.side.upper` (or `void.floor` and `void.side.lower`) lie at the
/// same distance from the corner, as far as both walls go.
///
/// Round each corner lie rings of trapezia that shrink to the smallest cell: the number of
/// cells grows with the logarithm of the refinement.
///
/// # Example
/// ```
/// use taxel_fem::mesh::{CornerDivision, VoidCell};
/// let cell = VoidCell {
///     width: 400e-6,
///     height: 40e-6,
///     cover: 120e-6,
///     base: 340e-6,
///     pitch: 600e-6,
///     fillet: 0.0,
///     division: CornerDivision::default(),
/// };
/// let mesh = cell.mesh()?;
/// assert!(mesh.cell_count() < 500);
/// # Ok::<(), taxel_fem::mesh::MeshError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoidCell {
    /// Width of the void, of which half is in the mesh.
    pub width: f64,
    /// Height of the void.
    pub height: f64,
    /// Thickness of the solid above the void.
    pub cover: f64,
    /// Thickness of the solid below the void.
    pub base: f64,
    /// Distance from one void to the next, of which half is in the mesh.
    pub pitch: f64,
    /// Radius of the corners of the void; zero for sharp corners.
    pub fillet: f64,
    /// Sizes of the cells.
    pub division: CornerDivision,
}

/// Sizes of the cells round corners and away from them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerDivision {
    /// Size of the smallest cell over the height of the void, 1e-6 to 0.5 (in very large cells
    /// 1e-8 of their extent), or up to a quarter more where no ring fits between the smallest
    /// cells and the square round their corner; at a fillet the thickness of the cells on the
    /// arc. Default 0.01.
    pub smallest: f64,
    /// Cells on half a side of the square round a corner, 1 to 64; a fillet has twice as
    /// many on its arc. Default 2.
    pub segments: usize,
    /// Largest ratio of neighbours away from the corners, 1 to 2. Default 1.5.
    pub growth: f64,
    /// Largest cell over the height of the void. Default: no limit.
    pub largest: f64,
}

impl Default for CornerDivision {
    fn default() -> Self {
        Self {
            smallest: 0.01,
            segments: 2,
            growth: 1.5,
            largest: f64::INFINITY,
        }
    }
}

impl VoidCell {
    /// The mesh.
    ///
    /// # Errors
    /// [`MeshError::OutOfRange`] and [`MeshError::NoWall`] for lengths that make no cell.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let corner = Corner::new(self)?;
        let mut patches = Patchwork::new("solid", 1e-4 * corner.finest());
        self.add_surroundings(&mut patches, &corner)?;
        for (y, up) in [(self.base, -1.0), (self.base + self.height, 1.0)] {
            corner.add(&mut patches, [self.width / 2.0, y], up);
        }
        let mut mesh = patches.mesh;
        self.name_sides(&mut mesh);
        Ok(mesh)
    }

    /// The mesh with the ellipse of this width and height in the place of the rectangle; `fillet`
    /// counts for nothing. Names as before: the corners of the rectangle lie on the ellipse at the
    /// angle, as its parameter, at which its quarter is shared like the half width and the half
    /// height.
    ///
    /// Each node beside the void moves with the nearest point of the rectangle's wall, the less the
    /// nearer to the outer side: cells stay whole, and where three of them meet at a corner they
    /// share a half turn.
    ///
    /// # Errors
    /// As [`VoidCell::mesh`].
    ///
    /// # Example
    /// ```
    /// use taxel_fem::mesh::{CornerDivision, VoidCell};
    /// let round = VoidCell {
    ///     width: 1.0,
    ///     height: 1.0,
    ///     cover: 2.0,
    ///     base: 2.0,
    ///     pitch: 4.0,
    ///     fillet: 0.0,
    ///     division: CornerDivision { smallest: 0.25, ..CornerDivision::default() },
    /// };
    /// let mesh = round.elliptic_mesh()?;
    /// let wall = mesh.nodes_of("void").unwrap_or_default();
    /// assert!(wall.iter().all(|node| {
    ///     let [x, y, _] = mesh.points[*node as usize];
    ///     (x.hypot(y - 2.5) - 0.5).abs() < 1e-12
    /// }));
    /// # Ok::<(), taxel_fem::mesh::MeshError>(())
    /// ```
    pub fn elliptic_mesh(&self) -> Result<Mesh, MeshError> {
        let sharp = Self {
            fillet: 0.0,
            ..*self
        };
        let mut mesh = sharp.mesh()?;
        let half = [0.5 * self.width, 0.5 * self.height];
        let middle = self.base + half[1];
        let ellipse = Ellipse {
            half,
            beside: 0.5 * self.pitch - half[0],
            room: [self.cover, self.base],
        };
        for point in &mut mesh.points {
            let [x, y] = ellipse.place([point[0], point[1] - middle]);
            (point[0], point[1]) = (x, middle + y);
        }
        Ok(mesh)
    }

    /// The blocks outside the squares round the two corners.
    fn add_surroundings(&self, patches: &mut Patchwork, corner: &Corner) -> Result<(), MeshError> {
        let reach = corner.reach;
        let growth = Growth {
            smallest: reach / corner.segments as f64,
            ratio: self.division.growth,
            // The cells at the squares are as large as they are there.
            largest: (self.division.largest * self.height).max(reach / corner.segments as f64),
        };
        let line = |start: f64, end: f64, grading: Grading| {
            if end - start <= 1e-9 * self.height {
                return Ok(Vec::new());
            }
            Axis::new(&[start, end], &[grading]).map(|axis| axis.positions().to_vec())
        };
        let square = |middle: f64| {
            line(
                middle - reach,
                middle + reach,
                Grading::Uniform(2 * corner.segments),
            )
        };
        let layers = |wall: f64, sign: f64| -> Vec<f64> {
            let layers = corner.layers.iter();
            layers.map(|layer| wall + sign * layer * reach).collect()
        };
        let (wall, roof) = (self.width / 2.0, self.base + self.height);
        let top = roof + self.cover;
        let left = line(0.0, wall - reach, Grading::FromEnd(growth))?;
        let over = square(wall)?;
        let right = line(wall + reach, self.pitch / 2.0, Grading::FromStart(growth))?;
        let below = line(0.0, self.base - reach, Grading::FromEnd(growth))?;
        let beside = line(self.base + reach, roof - reach, Grading::FromBoth(growth))?;
        let above = line(roof + reach, top, Grading::FromStart(growth))?;
        let across = left.len() + over.len() + right.len();
        let cells = across * (below.len() + beside.len() + above.len());
        if cells > MOST_CELLS {
            return Err(MeshError::TooManyCells {
                cells,
                limit: MOST_CELLS,
            });
        }
        for x in [&left, &over, &right] {
            patches.product(x, &below);
            patches.product(x, &above);
        }
        patches.product(&left, &layers(self.base, -1.0));
        patches.product(&left, &layers(roof, 1.0));
        patches.product(&right, &square(self.base)?);
        patches.product(&right, &square(roof)?);
        patches.product(&right, &beside);
        patches.product(&layers(wall, 1.0), &beside);
        Ok(())
    }

    fn name_sides(&self, mesh: &mut Mesh) {
        let (right, top) = (self.pitch / 2.0, self.base + self.height + self.cover);
        let (wall, floor, roof) = (self.width / 2.0, self.base, self.base + self.height);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * self.height;
        let mut named: Vec<(&str, Facet, [f64; 3])> = Vec::new();
        for facet in mesh.boundary() {
            let middle = mesh.facet_nodes(facet).last().unwrap_or_default();
            let at = mesh.points[middle as usize];
            // The wall of a fillet that is nearer.
            let gaps = [roof - at[1], at[1] - floor, wall - at[0]];
            let name = match at {
                [x, ..] if near(x, 0.0) => "left",
                [x, ..] if near(x, right) => "right",
                [_, y, _] if near(y, 0.0) => "bottom",
                [_, y, _] if near(y, top) => "top",
                _ if gaps[0] < gaps[1].min(gaps[2]) => "void.roof",
                _ if gaps[1] < gaps[2] => "void.floor",
                _ => "void.side",
            };
            named.push((name, facet, at));
        }
        let middle = 0.5 * (floor + roof);
        let mut pick = |surface: &str, part: &str, rank: &dyn Fn([f64; 3]) -> Option<f64>| {
            let mut facets: Vec<(f64, Facet)> = named
                .iter()
                .filter(|(name, ..)| name.starts_with(part))
                .filter_map(|(_, facet, at)| rank(*at).map(|rank| (rank, *facet)))
                .collect();
            facets.sort_by(|a, b| a.0.total_cmp(&b.0));
            let facets = facets.into_iter().map(|(_, facet)| facet).collect();
            mesh.surfaces.insert(surface.to_owned(), facets);
        };
        for side in ["bottom", "top"] {
            pick(side, side, &|at| Some(at[0]));
        }
        for side in ["left", "right"] {
            pick(side, side, &|at| Some(at[1]));
        }
        pick("void.roof", "void.roof", &|at| Some(-at[0]));
        pick("void.floor", "void.floor", &|at| Some(-at[0]));
        pick("void.side", "void.side", &|at| Some(-at[1]));
        pick("void.side.upper", "void.side", &|at| {
            (at[1] > middle).then_some(-at[1])
        });
        pick("void.side.lower", "void.side", &|at| {
            (at[1] < middle).then_some(at[1])
        });
        // Round the void: along the roof to the side, down, and back along the floor.
        let walls: Vec<Facet> = ["void.roof", "void.side", "void.floor"]
            .iter()
            .flat_map(|&name| {
                let mut facets = mesh.surfaces[name].clone();
                if name == "void.roof" {
                    facets.reverse();
                }
                facets
            })
            .collect();
        mesh.surfaces.insert("void".to_owned(), walls);
    }
}

/// The square round a corner of the void, in a frame with the corner at the origin and
/// the void at negative x and y.
struct Corner {
    /// Half the side of the square.
    reach: f64,
    /// Size of the smallest cell.
    smallest: f64,
    /// Half the sides of the rings, falling; the first is the reach.
    rings: Vec<f64>,
    /// Distances from a wall of the faces of the cells along it, over the ring, 0 to 1.
    layers: Vec<f64>,
    segments: usize,
    fillet: f64,
}

impl Corner {
    fn new(cell: &VoidCell) -> Result<Self, MeshError> {
        let wall = 0.5 * (cell.pitch - cell.width);
        for (quantity, length) in [
            ("width of the void", cell.width),
            ("height of the void", cell.height),
            ("cover above the void", cell.cover),
            ("base below the void", cell.base),
            ("pitch of the voids", cell.pitch),
        ] {
            in_range(quantity, length, f64::MIN_POSITIVE, f64::MAX)?;
        }
        if wall <= 0.0 {
            return Err(MeshError::NoWall {
                width: cell.width,
                pitch: cell.pitch,
            });
        }
        let extent = cell.pitch + cell.base + cell.height + cell.cover;
        let CornerDivision {
            smallest,
            segments,
            growth,
            largest,
        } = cell.division;
        in_range(
            "smallest cell over the height of the void",
            smallest,
            // Positions of nodes must distinguish cells anywhere in the mesh.
            f64::max(1e-6, 1e-8 * extent / cell.height),
            0.5,
        )?;
        in_range(
            "cells on half a side round a corner",
            segments as f64,
            1.0,
            64.0,
        )?;
        in_range("growth of cells", growth, 1.0, 2.0)?;
        in_range(
            "largest cell over the height of the void",
            largest,
            smallest,
            f64::INFINITY,
        )?;
        // As much room is left beyond the square as it takes, or none.
        let mut reach = cell.height / 2.0;
        for length in [cell.cover, cell.base, cell.width / 2.0, wall] {
            reach = reach.min(length / 2.0);
        }
        let left = cell.height - 2.0 * reach;
        if left > 0.0 && left < reach / 2.0 {
            reach = cell.height / 3.0;
        }
        in_range("radius of the fillet", cell.fillet, 0.0, 0.8 * reach)?;
        let smallest = smallest * cell.height;
        let (innermost, layers) = if cell.fillet > 0.0 {
            let innermost = reach.min(2.0 * cell.fillet);
            let layers = Growth {
                smallest: (smallest / innermost).min(1.0 / segments as f64),
                ratio: 2.0,
                largest: 1.0 / segments as f64,
            };
            let axis = Axis::new(&[0.0, 1.0], &[Grading::FromStart(layers)])?;
            (innermost, axis.positions().to_vec())
        } else {
            let uniform = (0..=segments).map(|k| k as f64 / segments as f64).collect();
            (reach.min(smallest * segments as f64), uniform)
        };
        // A ring that is thin beside its cells would be of flat cells, or of none.
        let innermost = if innermost > WIDEST_INNER * reach {
            reach
        } else {
            innermost
        };
        // Each ring has half the size of the one outside it, or a little more.
        let count = ((reach / innermost).log2() - 1e-9).ceil().max(0.0);
        let ring = |k: usize| reach * (innermost / reach).powf(k as f64 / count.max(1.0));
        Ok(Self {
            reach,
            smallest,
            rings: (0..=count as usize).map(ring).collect(),
            layers,
            segments,
            fillet: cell.fillet,
        })
    }

    /// A length below every distance between two nodes: a fillet may be far smaller than
    /// the smallest cell asked for.
    fn finest(&self) -> f64 {
        if self.fillet > 0.0 {
            self.smallest.min(self.fillet / self.segments as f64)
        } else {
            self.smallest
        }
    }

    /// Adds the cells of the square round `vertex`; `up` is -1 where the void lies above.
    fn add(&self, patches: &mut Patchwork, vertex: [f64; 2], up: f64) {
        let put = |at: [f64; 2]| [vertex[0] + at[0], vertex[1] + up * at[1]];
        let way = self.way_round();
        let axis = |k: usize| -> Vec<f64> { way.iter().map(|at| at[k]).collect() };
        let (x, y) = (axis(0), axis(1));
        patches.block([way.len() - 1, self.rings.len() - 1], &|i, j| {
            let size = between(&self.rings, j);
            put([size * between(&x, i), size * between(&y, i)])
        });
        let innermost = self.rings[self.rings.len() - 1];
        if self.fillet > 0.0 {
            self.add_fillet(patches, innermost, &put);
            return;
        }
        let line = |start: f64| -> Vec<f64> {
            self.layers
                .iter()
                .map(|layer| (start + layer) * innermost)
                .collect()
        };
        for (i, j) in [(-1.0, 0.0), (0.0, 0.0), (0.0, -1.0)] {
            let (x, y) = (line(i), line(j));
            patches.block([self.segments; 2], &|i, j| {
                put([between(&x, i), between(&y, j)])
            });
        }
    }

    /// Faces of the cells along a ring of size one, from the roof round to the side.
    fn way_round(&self) -> Vec<[f64; 2]> {
        let layers = self.layers.iter().copied();
        let mut way: Vec<[f64; 2]> = layers.clone().map(|layer| [-1.0, layer]).collect();
        way.extend(self.outside().skip(1));
        way.extend(layers.rev().skip(1).map(|layer| [layer, -1.0]));
        way
    }

    /// The part of it that faces away from both walls.
    fn outside(&self) -> impl Iterator<Item = [f64; 2]> {
        let segments = self.segments;
        (0..=4 * segments).map(move |k| {
            let along = k as f64 / segments as f64;
            [(along - 1.0).min(1.0), (3.0 - along).min(1.0)]
        })
    }

    /// Layers from the wall with its arc out to the innermost ring.
    fn add_fillet(&self, patches: &mut Patchwork, ring: f64, put: &dyn Fn([f64; 2]) -> [f64; 2]) {
        let radius = self.fillet;
        let quarter = self.segments as f64;
        let wall = |half: usize| -> [f64; 2] {
            let along = half as f64 / 2.0;
            let straight = |part: f64| -ring + (ring - radius) * part;
            if along <= quarter {
                [straight(along / quarter), 0.0]
            } else if along < 3.0 * quarter {
                let angle = (along / quarter - 1.0) * std::f64::consts::FRAC_PI_4;
                [
                    radius * (libm::sin(angle) - 1.0),
                    radius * (libm::cos(angle) - 1.0),
                ]
            } else {
                [0.0, straight(4.0 - along / quarter)]
            }
        };
        let outside: Vec<[f64; 2]> = self.outside().collect();
        let axis = |k: usize| -> Vec<f64> { outside.iter().map(|at| at[k]).collect() };
        let (x, y) = (axis(0), axis(1));
        patches.block([4 * self.segments, self.layers.len() - 1], &|i, j| {
            let share = between(&self.layers, j);
            let (inner, outer) = (wall(i), [ring * between(&x, i), ring * between(&y, i)]);
            put([0, 1].map(|k| inner[k] + share * (outer[k] - inner[k])))
        });
    }
}

#[cfg(test)]
mod tests;
