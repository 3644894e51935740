//! The part of the tangent that is not symmetric.
//!
//! Two things have no energy: a pressure that ends at a free edge of its surface, and
//! friction whose bound follows the pressure. What they add to the symmetric tangent acts on
//! few nodes, and is kept beside it as a sum of products `f m'`: a motion `m` of some nodes
//! changes forces `f` on some nodes.

use crate::mesh::{Facet, FacetShape, Mesh};

/// A sum of products over the unknowns, beside the symmetric tangent.
#[derive(Clone, Debug, Default)]
pub struct Unsymmetric {
    terms: Vec<Term>,
}

/// `forces motion'`: factors by the number of the unknown.
#[derive(Clone, Debug)]
struct Term {
    forces: Vec<(usize, f64)>,
    motion: Vec<(usize, f64)>,
}

impl Unsymmetric {
    /// True if the tangent is symmetric.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Adds a product, by the numbers of the unknowns.
    pub(crate) fn push(&mut self, forces: Vec<(usize, f64)>, motion: Vec<(usize, f64)>) {
        if !forces.is_empty() && !motion.is_empty() {
            self.terms.push(Term { forces, motion });
        }
    }

    /// Number of products.
    pub fn count(&self) -> usize {
        self.terms.len()
    }

    /// Forces of a product over all unknowns.
    pub fn forces(&self, term: usize, unknowns: usize) -> Vec<f64> {
        let mut forces = vec![0.0; unknowns];
        for &(k, factor) in &self.terms[term].forces {
            forces[k] += factor;
        }
        forces
    }

    /// What the motion of a product is in a change of the unknowns.
    pub fn motion(&self, term: usize, change: &[f64]) -> f64 {
        let motion = self.terms[term].motion.iter();
        motion.map(|&(k, factor)| factor * change[k]).sum()
    }

    /// Adds the product with `x` to `y`.
    pub fn add_product(&self, x: &[f64], y: &mut [f64]) {
        for term in &self.terms {
            let moved: f64 = term.motion.iter().map(|&(k, factor)| factor * x[k]).sum();
            for &(k, factor) in &term.forces {
                y[k] += factor * moved;
            }
        }
    }
}

/// What a component of a node, or the travel of an obstacle, stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Slot {
    /// An unknown, by its number.
    Unknown(usize),
    /// A parameter that drives it, by its number.
    Parameter(usize),
}

/// A free end (in the plane) or edge (in space) of a surface that carries a pressure.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeEdge {
    /// Ends and middle of the edge, along the outline; in the plane three times the node.
    pub(super) nodes: [u32; 3],
    /// In the plane: +1 at the end of the surface, -1 at its start.
    pub(super) sign: f64,
}

/// Corners and middles of the sides of a facet, along its outline.
const fn outline(shape: FacetShape) -> &'static [[usize; 3]] {
    match shape {
        FacetShape::Line3 => &[[0, 0, 0], [1, 1, 1]],
        FacetShape::Quad9 => &[[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]],
        FacetShape::Tri7 => &[[0, 1, 3], [1, 2, 4], [2, 0, 5]],
    }
}

/// Edges that belong to one facet of a surface only.
pub(super) fn free_edges(mesh: &Mesh, surface: &[Facet]) -> Vec<FreeEdge> {
    let mut edges = std::collections::BTreeMap::<u32, (FreeEdge, usize)>::new();
    for &facet in surface {
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let shape = mesh.shape(facet.cell as usize).facet_shape();
        for (number, side) in outline(shape).iter().enumerate() {
            let edge = FreeEdge {
                nodes: side.map(|local| nodes[local]),
                sign: if number == 0 { -1.0 } else { 1.0 },
            };
            edges.entry(edge.nodes[2]).or_insert((edge, 0)).1 += 1;
        }
    }
    let single = edges.into_values().filter(|(_, times)| *times == 1);
    single.map(|(edge, _)| edge).collect()
}
