//! The part of the tangent that is not symmetric.
//!
//! Two things have no energy: a pressure that ends at a free edge of its surface, and
//! friction whose bound follows the pressure. What they add to the symmetric tangent acts on
//! few nodes, and is kept beside it as a sum of products `f m'`: a motion `m` of some nodes
//! changes forces `f` on some nodes.

use super::system::{Assembled, System};
use crate::mesh::{Facet, FacetShape, Mesh};
use crate::problem::Kinematics;

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
#[derive(Clone, Copy, Debug)]
pub(super) enum Slot {
    /// An unknown, by its number.
    Unknown(usize),
    /// A parameter that drives it, by its number.
    Parameter(usize),
}

/// A free end (in the plane) or edge (in space) of a surface that carries a pressure.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeEdge {
    /// Ends and middle of the edge, along the outline; in the plane three times the node.
    nodes: [u32; 3],
    /// In the plane: +1 at the end of the surface, -1 at its start.
    sign: f64,
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

impl Assembled {
    /// Adds a change of forces by a motion.
    pub(super) fn add_unsymmetric(&mut self, forces: &[(Slot, f64)], motion: &[(Slot, f64)]) {
        let mut term = Term {
            forces: Vec::new(),
            motion: Vec::new(),
        };
        for &(slot, factor) in forces {
            if let Slot::Unknown(number) = slot {
                term.forces.push((number, factor));
            }
        }
        for &(slot, factor) in motion {
            if let Slot::Unknown(number) = slot {
                term.motion.push((number, factor));
            }
        }
        for &(slot, factor) in motion {
            let Slot::Parameter(parameter) = slot else {
                continue;
            };
            for &(number, force) in &term.forces {
                self.couplings[parameter][number] += factor * force;
            }
            for &(other, force) in forces {
                if let Slot::Parameter(other) = other {
                    self.cross[other][parameter] += factor * force;
                }
            }
        }
        for &(slot, factor) in forces {
            if let Slot::Parameter(parameter) = slot {
                let slopes = &mut self.force_slopes[parameter];
                slopes.extend(term.motion.iter().map(|&(k, motion)| (k, factor * motion)));
            }
        }
        if !term.forces.is_empty() && !term.motion.is_empty() {
            self.unsymmetric.terms.push(term);
        }
    }
}

impl System {
    /// What moves a component of a node, with a factor; none where it is fixed.
    pub(super) fn slot(&self, node: u32, component: usize) -> Option<(Slot, f64)> {
        if let Some(number) = self.unknowns.of(node, component) {
            return Some((Slot::Unknown(number), 1.0));
        }
        let components = self.unknowns.components();
        let (parameter, factor) = self.driven[node as usize * components + component]?;
        Some((Slot::Parameter(parameter), factor))
    }

    /// Adds what a pressure at free edges does beside its symmetric tangent,
    /// `1/2 q e_ijk` times the line integral of `N_a N_b dx_k`.
    pub(super) fn add_free_edges(
        &self,
        kinematics: Kinematics,
        places: &[[f64; 3]],
        (edges, pressure): (&[FreeEdge], f64),
        out: &mut Assembled,
    ) {
        for edge in edges {
            if kinematics == Kinematics::Solid {
                self.add_edge_in_space(places, edge, pressure, out);
                continue;
            }
            let node = edge.nodes[0];
            let turn = match kinematics {
                Kinematics::Axisymmetric => std::f64::consts::TAU * places[node as usize][0],
                _ => 1.0,
            };
            let half = 0.5 * pressure * edge.sign * turn;
            if let (Some(x), Some(y)) = (self.slot(node, 0), self.slot(node, 1)) {
                out.add_unsymmetric(&[x], &[(y.0, y.1 * half)]);
                out.add_unsymmetric(&[y], &[(x.0, -x.1 * half)]);
            }
        }
    }

    fn add_edge_in_space(
        &self,
        places: &[[f64; 3]],
        edge: &FreeEdge,
        pressure: f64,
        out: &mut Assembled,
    ) {
        let x = edge.nodes.map(|node| places[node as usize]);
        for point in FacetShape::Line3.quadrature() {
            let shapes = FacetShape::Line3.shapes(point.at);
            let tangent: [f64; 3] =
                std::array::from_fn(|d| (0..3).map(|n| shapes.gradients[n][0] * x[n][d]).sum());
            let length = tangent.iter().map(|t| t * t).sum::<f64>().sqrt();
            let of = |component: usize, factor: f64| -> Vec<(Slot, f64)> {
                let slots = edge.nodes.iter().zip(&shapes.values);
                let slots = slots.filter_map(|(&node, value)| {
                    let (slot, driven) = self.slot(node, component)?;
                    Some((slot, driven * value * factor))
                });
                slots.collect()
            };
            for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                // On a plane of symmetry the edge has no such part.
                if tangent[k].abs() <= 1e-12 * length {
                    continue;
                }
                let half = 0.5 * pressure * tangent[k] * point.weight;
                out.add_unsymmetric(&of(i, 1.0), &of(j, half));
                out.add_unsymmetric(&of(j, 1.0), &of(i, -half));
            }
        }
    }
}
