//! Grids of quadrilaterals and hexahedra with regions and cavities.

use super::axis::Axis;
use super::error::MeshError;
use super::{CellShape, Facet, Mesh};

/// Most cells of a grid.
const MOST_CELLS: usize = 20_000_000;

/// Contents of a cell of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part<'a> {
    /// Solid of the region of this name.
    Region(&'a str),
    /// Nothing: a cell of the cavity of this name.
    Void(&'a str),
}

/// A grid in the plane: axes x (left to right) and y (bottom to top).
pub type Grid2 = Grid<2>;

/// A grid in space: axes x (left to right), y (front to back) and z (bottom to top).
pub type Grid3 = Grid<3>;

/// A box of cells, in order of its mention.
#[derive(Clone, Debug)]
struct Block {
    void: bool,
    name: String,
    limits: Vec<[f64; 2]>,
}

/// Product of axes, each cell of it solid or void.
///
/// The mesh has a surface for each outer side (`left`, `right`, `bottom`, `top`, and in
/// space `front`, `back`) and for each void: all its walls under its own name, and each
/// side as `NAME.left`, `NAME.right`, `NAME.floor`, `NAME.roof`, `NAME.front`,
/// `NAME.back`, as seen from inside the void. Facets stand in rising order of x, then y,
/// then z.
///
/// # Example
/// ```
/// use taxel_fem::mesh::{Axis, Grading, Grid2};
/// let thirds = |n| Axis::new(&[0.0, 1.0, 2.0, 3.0], &[Grading::Uniform(n); 3]);
/// let mesh = Grid2::new([thirds(2)?, thirds(1)?], "solid")
///     .void("hole", [[1.0, 2.0], [1.0, 2.0]])
///     .mesh()?;
/// assert_eq!(mesh.cell_count(), 18 - 2);
/// assert_eq!(mesh.surfaces["hole"].len(), 6);
/// assert_eq!(mesh.surfaces["hole.roof"].len(), 2);
/// # Ok::<(), taxel_fem::mesh::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Grid<const D: usize> {
    axes: [Axis; D],
    background: String,
    blocks: Vec<Block>,
}

impl Grid2 {
    /// A grid whose cells belong to the region `background` where no box says otherwise.
    pub fn new(axes: [Axis; 2], background: &str) -> Self {
        Self::of(axes, background)
    }
}

impl Grid3 {
    /// A grid whose cells belong to the region `background` where no box says otherwise.
    pub fn new(axes: [Axis; 3], background: &str) -> Self {
        Self::of(axes, background)
    }
}

impl<const D: usize> Grid<D> {
    fn of(axes: [Axis; D], background: &str) -> Self {
        Self {
            axes,
            background: background.to_owned(),
            blocks: Vec::new(),
        }
    }

    /// Gives the cells of a box to a region. Start and end on each axis are breakpoints.
    #[must_use]
    pub fn region(self, name: &str, limits: [[f64; 2]; D]) -> Self {
        self.block(false, name, limits)
    }

    /// Takes the cells of a box out, whatever their region.
    #[must_use]
    pub fn void(self, name: &str, limits: [[f64; 2]; D]) -> Self {
        self.block(true, name, limits)
    }

    fn block(mut self, void: bool, name: &str, limits: [[f64; 2]; D]) -> Self {
        self.blocks.push(Block {
            void,
            name: name.to_owned(),
            limits: limits.to_vec(),
        });
        self
    }

    /// The mesh.
    ///
    /// # Errors
    /// A box off the breakpoints, empty or in contradiction to another; voids that leave
    /// no solid or several pieces; too many cells.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let mut cells = Cells::new(&self.axes)?;
        cells.paint(&self.background, &self.blocks)?;
        cells.mesh()
    }

    /// The mesh whose cells are what `part` says of their middles; boxes are not asked.
    ///
    /// # Errors
    /// Voids that leave no solid or several pieces; too many cells.
    pub fn mesh_by<'a>(&self, part: &dyn Fn([f64; 3]) -> Part<'a>) -> Result<Mesh, MeshError> {
        let mut cells = Cells::new(&self.axes)?;
        for cell in 0..cells.owners.len() {
            cells.owners[cell] = match part(cells.middle(cell)) {
                Part::Region(name) => cells.owner(false, name),
                Part::Void(name) => cells.owner(true, name),
            };
        }
        cells.mesh()
    }
}

/// Sides of a grid in the order of [`Cells::neighbour`]: outer name, name in a void,
/// side of the cell.
const PLANE_SIDES: [(&str, &str, u8); 4] = [
    ("left", "right", 3),
    ("right", "left", 1),
    ("bottom", "roof", 0),
    ("top", "floor", 2),
];
const SPACE_SIDES: [(&str, &str, u8); 6] = [
    ("left", "right", 0),
    ("right", "left", 1),
    ("front", "back", 2),
    ("back", "front", 3),
    ("bottom", "roof", 4),
    ("top", "floor", 5),
];

/// The cells of a grid with their owners: one code for any number of axes.
struct Cells<'a> {
    axes: &'a [Axis],
    counts: [usize; 3],
    /// Regions and voids: whether void, and the name.
    names: Vec<(bool, String)>,
    /// For each cell the number of its name.
    owners: Vec<usize>,
}

impl<'a> Cells<'a> {
    fn new(axes: &'a [Axis]) -> Result<Self, MeshError> {
        let mut counts = [1; 3];
        for (count, axis) in counts.iter_mut().zip(axes) {
            *count = axis.cell_count();
        }
        let cells = counts
            .iter()
            .fold(1, |all: usize, &n| all.saturating_mul(n));
        if cells > MOST_CELLS {
            return Err(MeshError::TooManyCells {
                cells,
                limit: MOST_CELLS,
            });
        }
        Ok(Self {
            axes,
            counts,
            names: Vec::new(),
            owners: vec![0; cells],
        })
    }

    fn owner(&mut self, void: bool, name: &str) -> usize {
        let known = self.names.iter().position(|(v, n)| *v == void && n == name);
        known.unwrap_or_else(|| {
            self.names.push((void, name.to_owned()));
            self.names.len() - 1
        })
    }

    fn sides(&self) -> &'static [(&'static str, &'static str, u8)] {
        if self.axes.len() == 2 {
            &PLANE_SIDES
        } else {
            &SPACE_SIDES
        }
    }

    fn index(&self, at: [usize; 3]) -> usize {
        (at[2] * self.counts[1] + at[1]) * self.counts[0] + at[0]
    }

    fn at(&self, cell: usize) -> [usize; 3] {
        let [x, y, _] = self.counts;
        [cell % x, cell / x % y, cell / (x * y)]
    }

    fn middle(&self, cell: usize) -> [f64; 3] {
        let mut middle = [0.0; 3];
        for ((axis, place), index) in self.axes.iter().zip(&mut middle).zip(self.at(cell)) {
            *place = 0.5 * (axis.positions()[index] + axis.positions()[index + 1]);
        }
        middle
    }

    /// The cell beyond a side, sides counted -x, +x, -y, +y, -z, +z; none outside the grid.
    fn neighbour(&self, cell: usize, side: usize) -> Option<usize> {
        let mut at = self.at(cell);
        let axis = side / 2;
        at[axis] = if side.is_multiple_of(2) {
            at[axis].checked_sub(1)?
        } else {
            at[axis] + 1
        };
        (at[axis] < self.counts[axis]).then(|| self.index(at))
    }

    fn is_void(&self, cell: usize) -> bool {
        self.names[self.owners[cell]].0
    }

    /// Regions first, then voids: a void in a layer is the usual case and no contradiction.
    fn paint(&mut self, background: &str, blocks: &[Block]) -> Result<(), MeshError> {
        for void in [false, true] {
            let mut claimed = vec![false; self.owners.len()];
            if !void {
                let owner = self.owner(false, background);
                self.owners.fill(owner);
            }
            for block in blocks.iter().filter(|block| block.void == void) {
                let owner = self.owner(void, &block.name);
                for cell in self.cells_of(block)? {
                    if claimed[cell] && self.owners[cell] != owner {
                        return Err(MeshError::Contradiction {
                            first: self.names[self.owners[cell]].1.clone(),
                            second: block.name.clone(),
                            place: self.middle(cell),
                        });
                    }
                    claimed[cell] = true;
                    self.owners[cell] = owner;
                }
            }
        }
        Ok(())
    }

    fn cells_of(&self, block: &Block) -> Result<Vec<usize>, MeshError> {
        let mut ranges = [(0, 1); 3];
        for (axis, &[start, end]) in block.limits.iter().enumerate() {
            let find = |value: f64| {
                self.axes[axis]
                    .breakpoint(value)
                    .map_err(|nearest| MeshError::OffBreakpoint {
                        name: block.name.clone(),
                        axis,
                        value,
                        nearest,
                    })
            };
            if start.partial_cmp(&end) != Some(std::cmp::Ordering::Less) {
                return Err(MeshError::InsideOut {
                    name: block.name.clone(),
                    axis,
                    start,
                    end,
                });
            }
            ranges[axis] = (find(start)?, find(end)?);
        }
        let mut cells = Vec::new();
        for z in ranges[2].0..ranges[2].1 {
            for y in ranges[1].0..ranges[1].1 {
                for x in ranges[0].0..ranges[0].1 {
                    cells.push(self.index([x, y, z]));
                }
            }
        }
        Ok(cells)
    }

    fn mesh(&self) -> Result<Mesh, MeshError> {
        self.check_names()?;
        self.check_pieces()?;
        let mut mesh = Mesh::default();
        let numbers = self.add_cells(&mut mesh);
        self.add_surfaces(&mut mesh, &numbers);
        Ok(mesh)
    }

    fn check_names(&self) -> Result<(), MeshError> {
        let outer = |name: &str| self.sides().iter().any(|side| side.0 == name);
        match self.names.iter().find(|(void, name)| *void && outer(name)) {
            Some((_, name)) => Err(MeshError::ReservedName { name: name.clone() }),
            None => Ok(()),
        }
    }

    fn check_pieces(&self) -> Result<(), MeshError> {
        let mut seen: Vec<bool> = (0..self.owners.len())
            .map(|cell| self.is_void(cell))
            .collect();
        let mut starts = Vec::new();
        for start in 0..seen.len() {
            if seen[start] {
                continue;
            }
            starts.push(start);
            seen[start] = true;
            let mut open = vec![start];
            while let Some(cell) = open.pop() {
                for side in 0..self.sides().len() {
                    if let Some(next) = self.neighbour(cell, side).filter(|&next| !seen[next]) {
                        seen[next] = true;
                        open.push(next);
                    }
                }
            }
        }
        match starts[..] {
            [] => Err(MeshError::NothingLeft),
            [_] => Ok(()),
            [_, second, ..] => Err(MeshError::Pieces {
                pieces: starts.len(),
                place: self.middle(second),
            }),
        }
    }

    /// Adds nodes and cells; the number of the mesh's cell for each solid cell of the grid.
    fn add_cells(&self, mesh: &mut Mesh) -> Vec<Option<u32>> {
        let shape = if self.axes.len() == 2 {
            CellShape::Quad9
        } else {
            CellShape::Hex27
        };
        let lattice = Lattice::new(self.axes);
        let places: Vec<[f64; 3]> = (0..shape.node_count()).map(|n| shape.node_at(n)).collect();
        let nodes_of = |cell: usize| -> Vec<usize> {
            let at = self.at(cell);
            places
                .iter()
                .map(|place| lattice.index(at, place))
                .collect()
        };
        let solid: Vec<usize> = (0..self.owners.len())
            .filter(|&cell| !self.is_void(cell))
            .collect();
        let mut node_numbers: Vec<Option<u32>> = vec![None; lattice.len()];
        for node in solid.iter().flat_map(|&cell| nodes_of(cell)) {
            node_numbers[node] = Some(0);
        }
        for (index, number) in node_numbers.iter_mut().enumerate() {
            if let Some(number) = number {
                *number = mesh.points.len() as u32;
                mesh.points.push(lattice.point(index));
            }
        }
        let mut numbers = vec![None; self.owners.len()];
        for cell in solid {
            let nodes: Vec<u32> = nodes_of(cell)
                .into_iter()
                .filter_map(|node| node_numbers[node])
                .collect();
            let region = mesh.region(&self.names[self.owners[cell]].1);
            numbers[cell] = Some(mesh.add_cell(shape, region, &nodes));
        }
        numbers
    }

    fn add_surfaces(&self, mesh: &mut Mesh, numbers: &[Option<u32>]) {
        for (cell, number) in numbers.iter().enumerate() {
            let Some(number) = *number else { continue };
            for (direction, &(outer, inner, side)) in self.sides().iter().enumerate() {
                let facet = Facet { cell: number, side };
                let mut name = |name: String| mesh.surfaces.entry(name).or_default().push(facet);
                match self.neighbour(cell, direction) {
                    None => name(outer.to_owned()),
                    Some(other) if self.is_void(other) => {
                        let void = &self.names[self.owners[other]].1;
                        name(void.clone());
                        name(format!("{void}.{inner}"));
                    }
                    Some(_) => {}
                }
            }
        }
    }
}

/// The places of nodes: a lattice twice as fine as the cells, x running first.
struct Lattice<'a> {
    axes: &'a [Axis],
    extent: [usize; 3],
}

impl<'a> Lattice<'a> {
    fn new(axes: &'a [Axis]) -> Self {
        let extent = |axis: Option<&Axis>| axis.map_or(1, |axis| 2 * axis.cell_count() + 1);
        Self {
            axes,
            extent: std::array::from_fn(|axis| extent(axes.get(axis))),
        }
    }

    fn len(&self) -> usize {
        self.extent.iter().product()
    }

    /// Number of the node at a place (-1, 0, 1 on each axis) of a cell.
    fn index(&self, cell: [usize; 3], place: &[f64; 3]) -> usize {
        (0..self.axes.len()).rev().fold(0, |index, axis| {
            index * self.extent[axis] + 2 * cell[axis] + (place[axis] + 1.0) as usize
        })
    }

    fn point(&self, index: usize) -> [f64; 3] {
        let [x, y, _] = self.extent;
        let on = [index % x, index / x % y, index / (x * y)];
        let mut point = [0.0; 3];
        for ((axis, value), half) in self.axes.iter().zip(&mut point).zip(on) {
            let line = axis.positions();
            *value = 0.5 * (line[half / 2] + line[half.div_ceil(2)]);
        }
        point
    }
}

#[cfg(test)]
mod tests;
