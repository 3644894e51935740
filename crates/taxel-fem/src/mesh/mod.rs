//! Meshes of quadratic cells with named regions, named surfaces and named points.
//!
//! Every cell carries the nodes that a linear, discontinuous pressure needs beside
//! it to be stable: 9 on a quadrilateral, 7 on a triangle, 27 on a hexahedron, 15
//! on a tetrahedron. Local numbers follow VTK.

mod axis;
mod boxes;
mod cell;
mod crossing_voids;
mod ellipse;
pub(crate) mod error;
pub mod gmsh;
mod join;
pub mod neighbours;
mod parts;
mod patchwork;
pub mod polygon;
mod promote;
pub mod quality;
pub mod sight;
mod structured;
mod void_block;
mod void_cell;

pub use axis::{Axis, Grading, Growth};
pub use cell::{CellShape, FacetShape, QuadraturePoint, Shapes};
pub use crossing_voids::CrossingVoids;
pub use ellipse::VoidShape;
pub use error::MeshError;
pub use parts::Parts;
pub use promote::LowerCell;
pub use structured::{Grid, Grid2, Grid3, Part};
pub use void_block::{Footprint, FootprintShape, VOID_ROWS, VoidBlock};
pub use void_cell::{CornerDivision, VoidCell};

use std::collections::BTreeMap;

/// One side of one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Facet {
    /// Number of the cell.
    pub cell: u32,
    /// Side of the cell, in the order of [`CellShape::sides`].
    pub side: u8,
}

/// A mesh. Coordinates in m (or any one unit of length, used throughout).
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions of the nodes; the third number is zero in two dimensions.
    pub points: Vec<[f64; 3]>,
    shapes: Vec<CellShape>,
    regions_of_cells: Vec<u16>,
    first_nodes: Vec<u32>,
    nodes: Vec<u32>,
    /// Names of the regions that cells refer to by number.
    pub regions: Vec<String>,
    /// Named parts of the boundary, or of interfaces inside.
    pub surfaces: BTreeMap<String, Vec<Facet>>,
    /// Named sets of nodes.
    pub node_sets: BTreeMap<String, Vec<u32>>,
}

impl Mesh {
    /// Number of space dimensions, 2 or 3; zero without cells.
    pub fn dimension(&self) -> usize {
        self.shapes.first().map_or(0, |shape| shape.dimension())
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.shapes.len()
    }

    /// Number of a region by its name; a new one when there is none.
    pub fn region(&mut self, name: &str) -> u16 {
        let known = self.regions.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.regions.push(name.to_owned());
            self.regions.len() - 1
        }) as u16
    }

    /// Adds a cell of a region and returns its number.
    ///
    /// # Panics
    /// When the number of nodes is not that of the shape.
    pub fn add_cell(&mut self, shape: CellShape, region: u16, nodes: &[u32]) -> u32 {
        assert_eq!(nodes.len(), shape.node_count(), "nodes of a {shape:?}");
        self.first_nodes.push(self.nodes.len() as u32);
        self.shapes.push(shape);
        self.regions_of_cells.push(region);
        self.nodes.extend_from_slice(nodes);
        self.shapes.len() as u32 - 1
    }

    /// Shape of a cell.
    pub fn shape(&self, cell: usize) -> CellShape {
        self.shapes[cell]
    }

    /// Number of the region of a cell.
    pub fn region_of(&self, cell: usize) -> usize {
        usize::from(self.regions_of_cells[cell])
    }

    /// Nodes of a cell, in VTK's order.
    pub fn cell(&self, cell: usize) -> &[u32] {
        let first = self.first_nodes[cell] as usize;
        &self.nodes[first..first + self.shapes[cell].node_count()]
    }

    /// Nodes of a facet in the order of its [`FacetShape`], the outward normal by the
    /// right hand (in two dimensions: outside lies to the right).
    pub fn facet_nodes(&self, facet: Facet) -> impl Iterator<Item = u32> + '_ {
        let cell = facet.cell as usize;
        let local = self.shapes[cell].sides()[usize::from(facet.side)];
        let nodes = self.cell(cell);
        local.iter().map(move |&n| nodes[usize::from(n)])
    }

    /// Nodes of a named surface or node set, of both where a name is that of both, sorted, each
    /// once; none without such a name.
    pub fn nodes_of(&self, name: &str) -> Option<Vec<u32>> {
        let (set, surface) = (self.node_sets.get(name), self.surfaces.get(name));
        let mut nodes = match (set, surface) {
            (None, None) => return None,
            (set, _) => set.cloned().unwrap_or_default(),
        };
        let facets = surface.into_iter().flatten();
        nodes.extend(facets.flat_map(|&facet| self.facet_nodes(facet)));
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    }

    /// Nodes of the cells of a region, sorted, each once; none without such a name.
    pub fn nodes_of_region(&self, name: &str) -> Option<Vec<u32>> {
        let region = self.regions.iter().position(|known| known == name)?;
        let cells = (0..self.cell_count()).filter(|&cell| self.region_of(cell) == region);
        let mut nodes: Vec<u32> = cells.flat_map(|cell| self.cell(cell).to_vec()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    }

    /// Mean distance of neighbouring corners of the facets of a surface, m; zero without facets.
    pub fn mean_side(&self, surface: &[Facet]) -> f64 {
        let sides = self.sides_of(surface);
        sides.iter().sum::<f64>() / f64::max(sides.len() as f64, 1.0)
    }

    /// Their median, m: on a graded surface that of its finer part; zero without facets.
    pub fn median_side(&self, surface: &[Facet]) -> f64 {
        let mut sides = self.sides_of(surface);
        let middle = sides.len() / 2;
        if sides.is_empty() {
            return 0.0;
        }
        *sides.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Distances of neighbouring corners of the facets of a surface, m.
    fn sides_of(&self, surface: &[Facet]) -> Vec<f64> {
        let mut sides = Vec::new();
        for &facet in surface {
            let nodes: Vec<u32> = self.facet_nodes(facet).collect();
            let corners = self.shape(facet.cell as usize).facet_shape().corner_count();
            for k in 0..corners {
                let [a, b] = [k, (k + 1) % corners].map(|k| self.points[nodes[k] as usize]);
                sides.push((0..3).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt());
            }
        }
        sides
    }

    /// Sides of cells that belong to one cell only.
    pub fn boundary(&self) -> Vec<Facet> {
        self.single_sides(|_| true)
    }

    /// Sides that belong to one of some cells only, sorted.
    fn single_sides(&self, among: impl Fn(usize) -> bool) -> Vec<Facet> {
        let mut seen: BTreeMap<Vec<u32>, Option<Facet>> = BTreeMap::new();
        for cell in (0..self.cell_count()).filter(|&cell| among(cell)) {
            for (key, facet) in self.keyed_sides(cell) {
                seen.entry(key)
                    .and_modify(|once| *once = None)
                    .or_insert(Some(facet));
            }
        }
        let mut facets: Vec<Facet> = seen.into_values().flatten().collect();
        facets.sort_unstable();
        facets
    }

    /// The sides of a cell with their nodes, sorted.
    fn keyed_sides(&self, cell: usize) -> impl Iterator<Item = (Vec<u32>, Facet)> + '_ {
        (0..self.shapes[cell].sides().len() as u8).map(move |side| {
            let facet = Facet {
                cell: cell as u32,
                side,
            };
            let mut key: Vec<u32> = self.facet_nodes(facet).collect();
            key.sort_unstable();
            (key, facet)
        })
    }

    /// Sides of the cells of the first of two regions that are sides of cells of the second as well.
    pub fn interface(&self, [first, second]: [usize; 2]) -> Vec<Facet> {
        let mut sides: BTreeMap<Vec<u32>, [Option<Facet>; 2]> = BTreeMap::new();
        for cell in 0..self.cell_count() {
            let Some(at) = [first, second]
                .iter()
                .position(|&region| region == self.region_of(cell))
            else {
                continue;
            };
            for (key, facet) in self.keyed_sides(cell) {
                sides.entry(key).or_default()[at] = Some(facet);
            }
        }
        let mut facets: Vec<Facet> = sides
            .into_values()
            .filter_map(|[first, second]| second.and(first))
            .collect();
        facets.sort_unstable();
        facets
    }

    /// Sides of the cells of a region that are not between two of them.
    pub fn sides_of_region(&self, name: &str) -> Option<Vec<Facet>> {
        let region = self.regions.iter().position(|known| known == name)?;
        Some(self.single_sides(|cell| self.region_of(cell) == region))
    }

    /// Outward unit normal in the middle of the corners of a facet; zero of one without area.
    pub fn outward(&self, facet: Facet) -> [f64; 3] {
        neighbours::outward(self, facet)
    }

    /// The longest side of the box around the mesh, in its unit.
    pub fn size(&self) -> f64 {
        let [low, high] = boxes::bounds(self.points.iter().copied());
        (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max)
    }

    /// Names the part of the boundary whose nodes all satisfy a condition.
    pub fn name_boundary(&mut self, name: &str, condition: impl Fn([f64; 3]) -> bool) {
        let facets = self
            .boundary()
            .into_iter()
            .filter(|&facet| {
                self.facet_nodes(facet)
                    .all(|node| condition(self.points[node as usize]))
            })
            .collect();
        self.surfaces.insert(name.to_owned(), facets);
    }
}
