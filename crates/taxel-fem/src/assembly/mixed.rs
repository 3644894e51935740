//! The tangent with the pressures of the cells not eliminated, and its part on the corners.
//!
//! ```text
//! [ A   C ] [du]   [-R]
//! [ C' -D ] [ q] = [ 0]      q = D^-1 C' du
//! ```
//!
//! has the same `du` as the condensed `(A + C D^-1 C') du = -R`, but `A` knows nothing of the bulk
//! modulus. The functions that are linear in each cell, on its corners, are the coarse part:
//! `Ac = P' A P`, added up cell by cell.

use super::dofs::Unknowns;
use super::kernel::{Kernel, MAX_NODES, MAX_PRESSURES};
use crate::mesh::{CellShape, Mesh};
use crate::scalar::Lanes;

/// Most corners of a cell.
const MAX_CORNERS: usize = 8;

/// What does not change with the state.
pub(crate) struct Mixed {
    /// Numbers of the unknowns on the corners.
    pub(crate) corners: Unknowns,
    /// Places of the corners of each cell in their matrix.
    places: Vec<Vec<u32>>,
    /// For each unknown those on corners that it follows, with weights.
    pub(crate) follows: Vec<Vec<(u32, f64)>>,
}

/// The parts of one tangent.
#[derive(Clone, Debug, Default)]
pub(crate) struct MixedParts {
    /// Values of `Ac` on the pattern of the corners.
    pub(crate) corners: Vec<f64>,
    /// `C`: by cell, component, column of nodes and pressure.
    pub(crate) coupling: Vec<Lanes>,
    /// `D` of each cell.
    pub(crate) compliance: Vec<[[f64; MAX_PRESSURES]; MAX_PRESSURES]>,
    /// `D^-1`.
    pub(crate) stiffness: Vec<[[f64; MAX_PRESSURES]; MAX_PRESSURES]>,
    /// `dJ/dp` times the shear modulus of each cell: how much it gives way beside its shape.
    pub(crate) softness: Vec<f64>,
}

impl Mixed {
    pub(crate) fn new(mesh: &Mesh, unknowns: &Unknowns, held: impl Fn(u32, usize) -> bool) -> Self {
        let cells = 0..mesh.cell_count();
        let own = |cell: usize| &mesh.cell(cell)[..mesh.shape(cell).corner_count()];
        let components = unknowns.components();
        let corners = Unknowns::new(&mesh.points, components, held, cells.clone().map(own));
        let places = cells
            .clone()
            .map(|cell| corners.places(own(cell)))
            .collect();
        let mut follows = vec![Vec::new(); unknowns.count()];
        for cell in cells {
            let weights = weights(mesh.shape(cell));
            for (&node, weights) in mesh.cell(cell).iter().zip(&weights) {
                for i in 0..components {
                    let Some(number) = unknowns.of(node, i) else {
                        continue;
                    };
                    if !follows[number].is_empty() {
                        continue;
                    }
                    let parents = own(cell).iter().zip(weights).filter(|(_, w)| **w != 0.0);
                    follows[number] = parents
                        .filter_map(|(&corner, &w)| Some((corners.of(corner, i)? as u32, w)))
                        .collect();
                }
            }
        }
        Self {
            corners,
            places,
            follows,
        }
    }

    /// Adds a cell whose tangent is that of fixed pressures.
    pub(crate) fn add(
        &self,
        (mesh, cell): (&Mesh, usize),
        kernel: &Kernel,
        unknowns: &Unknowns,
        parts: &mut MixedParts,
    ) {
        parts.coupling.extend_from_slice(kernel.coupling());
        parts.compliance.push(kernel.compliance);
        parts.stiffness.push(kernel.stiffness);
        parts.softness.push(kernel.softness);
        let nodes = mesh.cell(cell);
        let corners = mesh.shape(cell).corner_count();
        let components = unknowns.components();
        let weights = weights(mesh.shape(cell));
        // Held components follow no corner.
        let free: Vec<[f64; 3]> = nodes
            .iter()
            .map(|&node| {
                std::array::from_fn(|i| {
                    let free = i < components && unknowns.of(node, i).is_some();
                    f64::from(u8::from(free))
                })
            })
            .collect();
        let blocks = kernel.node_blocks();
        let mut coarse = [[[[0.0; 3]; 3]; MAX_CORNERS]; MAX_CORNERS];
        for (a, weights_a) in weights.iter().enumerate() {
            let mut half = [[[0.0; 3]; 3]; MAX_CORNERS];
            for (b, weights_b) in weights.iter().enumerate() {
                let entries = blocks.between(a, b);
                for (half, w) in half[..corners].iter_mut().zip(weights_b) {
                    if *w == 0.0 {
                        continue;
                    }
                    for i in 0..components {
                        for j in 0..components {
                            half[i][j] += w * entries[i][j] * free[b][j];
                        }
                    }
                }
            }
            for (coarse, w) in coarse[..corners].iter_mut().zip(weights_a) {
                if *w == 0.0 {
                    continue;
                }
                for (coarse, half) in coarse[..corners].iter_mut().zip(&half) {
                    for i in 0..components {
                        for j in 0..components {
                            coarse[i][j] += w * free[a][i] * half[i][j];
                        }
                    }
                }
            }
        }
        let of = |i: usize, a: usize, j: usize, b: usize| coarse[a][b][i][j];
        let own = &nodes[..corners];
        self.corners
            .scatter(own, &self.places[cell], &mut parts.corners, of);
    }
}

/// Values of the linear functions of the corners at the nodes of a cell.
fn weights(shape: CellShape) -> Vec<[f64; MAX_CORNERS]> {
    let corners = shape.corner_count();
    let dimension = shape.dimension();
    let simplex = matches!(shape, CellShape::Tri7 | CellShape::Tet15);
    let nodes = 0..shape.node_count();
    nodes
        .map(|node| {
            let at = shape.node_at(node);
            let mut weights = [0.0; MAX_CORNERS];
            for (corner, weight) in weights[..corners].iter_mut().enumerate() {
                *weight = if simplex {
                    match corner {
                        0 => 1.0 - at[..dimension].iter().sum::<f64>(),
                        _ => at[corner - 1],
                    }
                } else {
                    let own = shape.node_at(corner);
                    (0..dimension)
                        .map(|d| 0.5 * (1.0 + own[d] * at[d]))
                        .product()
                };
                // Thirds of places do not add up to one exactly.
                if weight.abs() < 1e-12 {
                    *weight = 0.0;
                }
            }
            weights
        })
        .collect()
}

/// Products with the coupling of a cell.
pub(crate) struct Coupling<'a> {
    pub(crate) nodes: &'a [u32],
    pub(crate) unknowns: &'a Unknowns,
    pub(crate) values: &'a [Lanes],
}

impl Coupling<'_> {
    /// Columns of nodes of a cell.
    pub(crate) fn size(&self) -> usize {
        self.unknowns.components() * self.nodes.len().div_ceil(Lanes::COUNT) * MAX_PRESSURES
    }

    /// Hears the number of each unknown with its row of `C`.
    #[inline]
    pub(crate) fn each(&self, mut hears: impl FnMut(usize, [f64; MAX_PRESSURES])) {
        debug_assert!(self.nodes.len() <= MAX_NODES);
        let columns = self.nodes.len().div_ceil(Lanes::COUNT);
        for i in 0..self.unknowns.components() {
            for (n, &node) in self.nodes.iter().enumerate() {
                if let Some(number) = self.unknowns.of(node, i) {
                    let at = (i * columns + n / Lanes::COUNT) * MAX_PRESSURES;
                    let lane = n % Lanes::COUNT;
                    let row = std::array::from_fn(|m| self.values[at + m].0[lane]);
                    hears(number, row);
                }
            }
        }
    }
}
