//! Traction on a surface that is held, from the forces on its nodes.

use std::collections::BTreeMap;

use crate::mesh::{Facet, Mesh};
use crate::problem::Kinematics;
use crate::problem::load::FacetTable;

/// Traction on a surface as the shape functions of its facets see it.
#[derive(Clone, Debug, PartialEq)]
pub struct Traction {
    /// Nodes of the surface, in order of their numbers.
    pub nodes: Vec<u32>,
    /// Traction at each, Pa of undeformed area.
    pub values: Vec<[f64; 3]>,
}

/// Entries of a facet's rows: nodes, and areas of the products of their shape functions.
struct Block {
    nodes: Vec<usize>,
    areas: Vec<f64>,
}

/// Residual over the right-hand side at which the iteration ends.
const TOLERANCE: f64 = 1e-14;
/// The areas of products of shape functions, scaled by their diagonal, have eigenvalues within
/// a factor of some tens: this many steps are more than rounding leaves to gain.
const STEPS: usize = 200;

impl Traction {
    /// The traction whose nodal forces are those given: integrated over the surface it is their
    /// sum, up to rounding. `force` is that of a node, N (N/m in plane strain).
    ///
    /// It converges faster than the stresses of the cells, and needs no extrapolation to the
    /// surface (Carey, Chow and Seager 1985, "Approximate boundary-flux calculations").
    pub fn from_forces(
        mesh: &Mesh,
        kinematics: Kinematics,
        surface: &[Facet],
        force: impl Fn(u32) -> [f64; 3],
    ) -> Self {
        let mut numbers = BTreeMap::new();
        for node in surface.iter().flat_map(|&facet| mesh.facet_nodes(facet)) {
            numbers.insert(node, 0);
        }
        for (number, place) in numbers.values_mut().enumerate() {
            *place = number;
        }
        let blocks: Vec<Block> = surface
            .iter()
            .map(|&facet| Block::of(mesh, kinematics, facet, &numbers))
            .collect();
        let mut traction = Self {
            nodes: numbers.into_keys().collect(),
            values: Vec::new(),
        };
        let forces: Vec<_> = traction.nodes.iter().map(|&node| force(node)).collect();
        traction.values = vec![[0.0; 3]; forces.len()];
        for component in 0..3 {
            let right: Vec<f64> = forces.iter().map(|force| force[component]).collect();
            for (value, found) in traction.values.iter_mut().zip(solve(&blocks, &right)) {
                value[component] = found;
            }
        }
        traction
    }
}

impl Block {
    fn of(
        mesh: &Mesh,
        kinematics: Kinematics,
        facet: Facet,
        numbers: &BTreeMap<u32, usize>,
    ) -> Self {
        let table = FacetTable::new(mesh.shape(facet.cell as usize).facet_shape());
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let places: Vec<_> = nodes.iter().map(|&n| mesh.points[n as usize]).collect();
        let mut areas = vec![0.0; nodes.len() * nodes.len()];
        for point in table.points(&places, kinematics) {
            let (area, shapes) = (point.area(), &point.shapes.values);
            for (row, entries) in areas.chunks_mut(nodes.len()).enumerate() {
                for (entry, shape) in entries.iter_mut().zip(shapes) {
                    *entry += shapes[row] * shape * area;
                }
            }
        }
        Self {
            nodes: nodes.iter().map(|node| numbers[node]).collect(),
            areas,
        }
    }

    /// Rows of the block: number of the node, entries.
    fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let rows = self.areas.chunks(self.nodes.len());
        self.nodes.iter().copied().zip(rows)
    }
}

/// Conjugate gradients, scaled by the diagonal.
fn solve(blocks: &[Block], right: &[f64]) -> Vec<f64> {
    let mut diagonal = vec![0.0; right.len()];
    for block in blocks {
        for (place, (node, entries)) in block.rows().enumerate() {
            diagonal[node] += entries[place];
        }
    }
    let times = |x: &[f64]| {
        let mut product = vec![0.0; x.len()];
        for block in blocks {
            for (node, entries) in block.rows() {
                let columns = block.nodes.iter().zip(entries);
                product[node] += columns.map(|(&at, entry)| entry * x[at]).sum::<f64>();
            }
        }
        product
    };
    let scaled = |x: &[f64]| -> Vec<f64> { x.iter().zip(&diagonal).map(|(x, d)| x / d).collect() };
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let mut solution = vec![0.0; right.len()];
    let mut residual = right.to_vec();
    let mut direction = scaled(&residual);
    let mut size = dot(&residual, &direction);
    let end = TOLERANCE * TOLERANCE * size;
    for _ in 0..STEPS {
        // Not greater, so that zero and NaN end it.
        if size.partial_cmp(&end) != Some(std::cmp::Ordering::Greater) {
            break;
        }
        let product = times(&direction);
        let step = size / dot(&direction, &product);
        for at in 0..solution.len() {
            solution[at] += step * direction[at];
            residual[at] -= step * product[at];
        }
        let next = scaled(&residual);
        let before = std::mem::replace(&mut size, dot(&residual, &next));
        for (along, next) in direction.iter_mut().zip(next) {
            *along = next + size / before * *along;
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Axis, Grading, Grid2, Grid3};
    use crate::problem::load::traction;

    /// What shape functions hold comes back from its nodal forces.
    fn comes_back(mesh: &Mesh, kinematics: Kinematics, name: &str) {
        let surface = &mesh.surfaces[name];
        let of = |[x, y, _]: [f64; 3]| [1.0 + x, 2.0 - x * x + y, x * y];
        let forces: BTreeMap<_, _> = traction(mesh, kinematics, surface, of)
            .into_iter()
            .collect();
        let found = Traction::from_forces(mesh, kinematics, surface, |node| forces[&node]);
        assert!(!found.nodes.is_empty());
        for (node, value) in found.nodes.iter().zip(&found.values) {
            let expected = of(mesh.points[*node as usize]);
            for (value, expected) in value.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-11, "{value} for {expected}");
            }
        }
    }

    fn axis(cells: usize) -> Axis {
        Axis::new(&[0.0, 1.5], &[Grading::Uniform(cells)]).unwrap()
    }

    #[test]
    fn a_quadratic_traction_comes_back() {
        let plane = Grid2::new([axis(5), axis(3)], "solid").mesh().unwrap();
        comes_back(&plane, Kinematics::PlaneStrain, "bottom");
        comes_back(&plane, Kinematics::Axisymmetric, "bottom");
        let block = Grid3::new([axis(3), axis(4), axis(2)], "solid")
            .mesh()
            .unwrap();
        comes_back(&block, Kinematics::Solid, "top");
    }
}
