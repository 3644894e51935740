//! Pressures that follow the surface, and loads of fixed direction.

use taxel_numerics::dense::cross;

use super::Parameter;
use crate::mesh::{Facet, FacetShape, Mesh, QuadraturePoint, Shapes};
use crate::problem::Kinematics;

/// A pressure that stays normal to the deformed surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Pressure {
    /// Where it acts.
    pub surface: Vec<Facet>,
    /// Its value in Pa.
    pub parameter: Parameter,
}

/// Nodal forces of fixed direction, times a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadLoad {
    /// Node and force, N (N/m in plane strain).
    pub forces: Vec<(u32, [f64; 3])>,
    /// Factor.
    pub parameter: Parameter,
}

/// Shape functions of a side at its quadrature points.
#[derive(Clone, Debug)]
pub struct FacetTable {
    points: Vec<(QuadraturePoint, Shapes)>,
}

/// Geometry at a quadrature point of a deformed side.
#[derive(Clone, Copy, Debug)]
pub struct FacetPoint<'t> {
    /// Place.
    pub place: [f64; 3],
    /// Outward normal times area and weight (the whole turn when axisymmetric).
    pub normal: [f64; 3],
    /// Tangents along the two reference directions.
    pub tangents: [[f64; 3]; 2],
    /// Weight of the point, with the turn when axisymmetric but without the radius.
    pub weight: f64,
    /// Shape functions.
    pub shapes: &'t Shapes,
}

impl FacetTable {
    /// Tables of a shape at its usual points.
    pub fn new(shape: FacetShape) -> Self {
        Self::at(shape, shape.quadrature())
    }

    /// Tables of a shape at these points.
    pub fn at(shape: FacetShape, points: Vec<QuadraturePoint>) -> Self {
        let points = points.into_iter();
        Self {
            points: points.map(|p| (p, shape.shapes(p.at))).collect(),
        }
    }

    /// Geometry at each quadrature point, for these places of the nodes.
    pub fn points<'t>(
        &'t self,
        nodes: &'t [[f64; 3]],
        kinematics: Kinematics,
    ) -> impl Iterator<Item = FacetPoint<'t>> + 't {
        self.points.iter().map(move |(point, shapes)| {
            let mut place = [0.0; 3];
            let mut tangents = [[0.0; 3]; 2];
            for (n, x) in nodes.iter().enumerate() {
                for d in 0..3 {
                    place[d] += shapes.values[n] * x[d];
                    for (k, tangent) in tangents.iter_mut().enumerate() {
                        tangent[d] += shapes.gradients[n][k] * x[d];
                    }
                }
            }
            let mut weight = point.weight;
            let mut normal = match kinematics {
                Kinematics::Solid => cross(tangents[0], tangents[1]),
                _ => [tangents[0][1], -tangents[0][0], 0.0],
            };
            if kinematics == Kinematics::Axisymmetric {
                weight *= std::f64::consts::TAU;
                normal = normal.map(|x| x * place[0]);
            }
            FacetPoint {
                place,
                normal: normal.map(|x| x * weight),
                tangents,
                weight,
                shapes,
            }
        })
    }
}

impl FacetPoint<'_> {
    /// Area (length times depth in two dimensions) that the point stands for.
    pub fn area(&self) -> f64 {
        self.normal.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Derivative of component `i` of the normal by component `j` of node `b`.
    pub fn normal_slope(&self, kinematics: Kinematics, i: usize, b: usize, j: usize) -> f64 {
        let slopes = &self.shapes.gradients[b];
        if kinematics == Kinematics::Solid {
            // d(t0 x t1) = e_j x (N,0 t1) - e_j x (N,1 t0), component i.
            if i == j {
                return 0.0;
            }
            let k = 3 - i - j;
            let sign = if (j + 1) % 3 == k { 1.0 } else { -1.0 };
            let across = slopes[0] * self.tangents[1][k] - slopes[1] * self.tangents[0][k];
            return self.weight * sign * across;
        }
        let turn = match (i, j) {
            (0, 1) => slopes[0],
            (1, 0) => -slopes[0],
            _ => 0.0,
        };
        if kinematics == Kinematics::PlaneStrain {
            return self.weight * turn;
        }
        let line = if i == 0 {
            self.tangents[0][1]
        } else {
            -self.tangents[0][0]
        };
        let widening = if j == 0 {
            line * self.shapes.values[b]
        } else {
            0.0
        };
        self.weight * (turn * self.place[0] + widening)
    }
}

/// Nodal forces of a traction in Pa of undeformed area, given by place.
pub fn traction(
    mesh: &Mesh,
    kinematics: Kinematics,
    surface: &[Facet],
    of: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<(u32, [f64; 3])> {
    let mut forces = std::collections::BTreeMap::<u32, [f64; 3]>::new();
    for &facet in surface {
        let table = FacetTable::new(mesh.shape(facet.cell as usize).facet_shape());
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let places: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.points[n as usize]).collect();
        for point in table.points(&places, kinematics) {
            let (traction, area) = (of(point.place), point.area());
            for (n, &node) in nodes.iter().enumerate() {
                let force = forces.entry(node).or_default();
                for d in 0..3 {
                    force[d] += point.shapes.values[n] * traction[d] * area;
                }
            }
        }
    }
    forces.into_iter().collect()
}

/// Nodal forces of a body force in N/m^3 of undeformed volume, given by place.
pub fn body_force(
    mesh: &Mesh,
    kinematics: Kinematics,
    of: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<(u32, [f64; 3])> {
    let mut forces = std::collections::BTreeMap::<u32, [f64; 3]>::new();
    for cell in 0..mesh.cell_count() {
        let nodes = mesh.cell(cell);
        for point in mesh.shape(cell).quadrature() {
            let shapes = mesh.shape(cell).shapes(point.at);
            let mut place = [0.0; 3];
            let mut gradient = [[0.0; 3]; 3];
            if mesh.dimension() == 2 {
                gradient[2][2] = 1.0;
            }
            for (n, &node) in nodes.iter().enumerate() {
                for i in 0..mesh.dimension() {
                    let x = mesh.points[node as usize][i];
                    place[i] += shapes.values[n] * x;
                    for k in 0..mesh.dimension() {
                        gradient[i][k] += shapes.gradients[n][k] * x;
                    }
                }
            }
            let mut volume = crate::scalar::determinant(&gradient) * point.weight;
            if kinematics == Kinematics::Axisymmetric {
                volume *= std::f64::consts::TAU * place[0];
            }
            let body = of(place);
            for (n, &node) in nodes.iter().enumerate() {
                let force = forces.entry(node).or_default();
                for d in 0..3 {
                    force[d] += shapes.values[n] * body[d] * volume;
                }
            }
        }
    }
    forces.into_iter().collect()
}
