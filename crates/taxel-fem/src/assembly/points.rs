//! Points of a surface that may touch something.

use taxel_numerics::dense::{cross, dot3};

use super::foot::normal_of;
use crate::mesh::{Facet, FacetShape};
use crate::problem::load::FacetTable;
use crate::problem::{Kinematics, Problem};

/// A contact point of a surface.
pub(super) struct ContactPoint<'p> {
    /// Number of the facet in its surface.
    pub(super) facet: usize,
    /// Number of the point in its surface.
    pub(super) number: usize,
    /// Nodes of the facet, their shape functions and the slopes of these.
    pub(super) nodes: &'p [u32],
    pub(super) values: &'p [f64],
    pub(super) slopes: &'p [[f64; 3]],
    /// Undeformed area that it stands for.
    pub(super) area: f64,
    /// Undeformed and present place.
    pub(super) rest: [f64; 3],
    pub(super) place: [f64; 3],
}

impl ContactPoint<'_> {
    /// Corners of its facet with its shares in the functions that are linear between them.
    pub(super) fn corners(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        // A line has its middle last, other facets have the middles of their sides, then their own.
        let corners = match self.nodes.len() {
            3 => 2,
            7 => 3,
            _ => 4,
        };
        let middle = if corners == 2 {
            0.0
        } else {
            self.values[2 * corners]
        };
        (0..corners).map(move |corner| {
            let side = |k: usize| 0.5 * self.values[corners + k];
            let sides = if corners == 2 {
                side(0)
            } else {
                side(corner) + side((corner + corners - 1) % corners)
            };
            let share = self.values[corner] + sides + middle / corners as f64;
            (self.nodes[corner], share)
        })
    }

    /// Tangents of the deformed surface at the point along its reference coordinates, m, and its
    /// unit normal out of the body.
    pub(super) fn frame(&self, places: &[[f64; 3]]) -> ([[f64; 3]; 2], [f64; 3]) {
        let mut tangents = [[0.0; 3]; 2];
        for (&node, slope) in self.nodes.iter().zip(self.slopes) {
            for d in 0..3 {
                for (k, tangent) in tangents.iter_mut().enumerate() {
                    tangent[d] += slope[k] * places[node as usize][d];
                }
            }
        }
        (tangents, normal_of(self.directions(), tangents))
    }

    /// Present area over undeformed area of its facet there.
    pub(super) fn stretch(&self, problem: &Problem, places: &[[f64; 3]]) -> f64 {
        let size = |places: &[[f64; 3]]| {
            let [s, t] = self.frame(places).0;
            let across = match self.directions() {
                1 => s,
                _ => cross(s, t),
            };
            dot3(across, across).sqrt()
        };
        let around = match problem.kinematics {
            Kinematics::Axisymmetric => self.place[0] / self.rest[0],
            _ => 1.0,
        };
        around * size(places) / size(&problem.mesh.points)
    }

    /// Number of reference coordinates of its facet.
    pub(super) fn directions(&self) -> usize {
        if self.nodes.len() == FacetShape::Line3.node_count() {
            1
        } else {
            2
        }
    }
}

/// Every contact point of a surface, in order, at the points that a facet has by its number and
/// shape.
pub(super) fn each_point_of<'t>(
    problem: &Problem,
    surface: &[Facet],
    (table_of, places): (&dyn Fn(usize, FacetShape) -> &'t FacetTable, &[[f64; 3]]),
    hears: &mut dyn FnMut(&ContactPoint<'_>),
) {
    let mut number = 0;
    for (facet, &side) in surface.iter().enumerate() {
        let nodes: Vec<u32> = problem.mesh.facet_nodes(side).collect();
        let shape = problem.mesh.shape(side.cell as usize).facet_shape();
        let undeformed: Vec<[f64; 3]> = nodes
            .iter()
            .map(|&node| problem.mesh.points[node as usize])
            .collect();
        for point in table_of(facet, shape).points(&undeformed, problem.kinematics) {
            let values = &point.shapes.values;
            let mut place = [0.0; 3];
            for (n, &node) in nodes.iter().enumerate() {
                for d in 0..3 {
                    place[d] += values[n] * places[node as usize][d];
                }
            }
            hears(&ContactPoint {
                facet,
                number,
                nodes: &nodes,
                values,
                slopes: &point.shapes.gradients,
                area: point.area(),
                rest: point.place,
                place,
            });
            number += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_corners_are_linear() {
        let sets: [(FacetShape, &[[f64; 2]]); 3] = [
            (FacetShape::Line3, &[[-1.0, 0.0], [1.0, 0.0]]),
            (FacetShape::Tri7, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
            (
                FacetShape::Quad9,
                &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]],
            ),
        ];
        for (shape, corners) in sets {
            for point in shape.quadrature() {
                let shapes = shape.shapes(point.at);
                let nodes: Vec<u32> = (0..shape.node_count() as u32).collect();
                let point_there = ContactPoint {
                    facet: 0,
                    number: 0,
                    nodes: &nodes,
                    values: &shapes.values,
                    slopes: &shapes.gradients,
                    area: 1.0,
                    rest: [0.0; 3],
                    place: [0.0; 3],
                };
                let mut sum = [0.0; 3];
                for (corner, share) in point_there.corners() {
                    let [x, y] = corners[corner as usize];
                    for (sum, of) in sum.iter_mut().zip([1.0, x, y]) {
                        *sum += share * of;
                    }
                }
                let exact = [1.0, point.at[0], point.at[1]];
                for (sum, exact) in sum.iter().zip(exact) {
                    assert!((sum - exact).abs() < 1e-14, "{shape:?} {sum} {exact}");
                }
            }
        }
    }
}
