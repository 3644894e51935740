//! What has no symmetric tangent, put into the equations: free edges under a pressure, and the
//! products that sliding points add.

use super::system::{Assembled, System};
use super::unsymmetric::{FreeEdge, Slot};
use crate::mesh::FacetShape;
use crate::problem::Kinematics;

impl Assembled {
    /// Adds a change of forces by a motion.
    pub(super) fn add_unsymmetric(&mut self, forces: &[(Slot, f64)], motion: &[(Slot, f64)]) {
        let unknown = |parts: &[(Slot, f64)]| -> Vec<(usize, f64)> {
            let parts = parts.iter().filter_map(|&(slot, factor)| match slot {
                Slot::Unknown(number) => Some((number, factor)),
                Slot::Parameter(_) => None,
            });
            parts.collect()
        };
        let (on_unknowns, by_unknowns) = (unknown(forces), unknown(motion));
        for &(slot, factor) in motion {
            let Slot::Parameter(parameter) = slot else {
                continue;
            };
            for &(number, force) in &on_unknowns {
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
                slopes.extend(by_unknowns.iter().map(|&(k, motion)| (k, factor * motion)));
            }
        }
        self.unsymmetric.push(on_unknowns, by_unknowns);
    }
}

impl System {
    /// What moves a component of a node, each with its factor; nothing where it is fixed.
    pub(crate) fn slots(
        &self,
        node: u32,
        component: usize,
    ) -> impl Iterator<Item = (Slot, f64)> + '_ {
        let own = self.unknowns.of(node, component);
        let row = self.followed.row(node, component).unwrap_or_default();
        let own = own.map(|number| (Slot::Unknown(number), 1.0));
        own.into_iter().chain(row.iter().copied())
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
            let of = |component: usize, factor: f64| -> Vec<(Slot, f64)> {
                let slots = self.slots(node, component);
                slots.map(|(slot, share)| (slot, share * factor)).collect()
            };
            out.add_unsymmetric(&of(0, 1.0), &of(1, half));
            out.add_unsymmetric(&of(1, 1.0), &of(0, -half));
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
                let slots = slots.flat_map(|(&node, value)| {
                    let slots = self.slots(node, component);
                    slots.map(move |(slot, share)| (slot, share * value * factor))
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
