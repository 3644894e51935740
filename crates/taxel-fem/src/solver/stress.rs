//! Stress in a solved body.

use taxel_numerics::dense::dot;

use super::small::solve_small;
use crate::assembly::state::State;
use crate::mesh::CellShape;
use crate::mesh::quality::extreme_eigenvalues;
use crate::problem::Kinematics;
use crate::problem::Problem;
use crate::scalar::{Symmetric, Tensor, determinant, inverse};

/// Stress and deformation at a quadrature point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StressPoint {
    /// Number of the cell.
    pub cell: usize,
    /// Undeformed place.
    pub place: [f64; 3],
    /// Deformation gradient.
    pub gradient: Tensor<f64>,
    /// Cauchy stress, Pa.
    pub cauchy: Symmetric<f64>,
    /// Mean stress of the pressure field (tension positive), Pa.
    pub pressure: f64,
    /// Von Mises stress, Pa.
    pub von_mises: f64,
    /// Undeformed volume that the point stands for.
    pub volume: f64,
}

impl StressPoint {
    /// The principal strain `l - 1` of the greatest amount.
    pub fn strain(&self) -> f64 {
        let [least, most] = extreme_stretches(&self.gradient).map(|stretch| stretch - 1.0);
        if -least > most { least } else { most }
    }
}

/// Least and greatest principal stretch.
pub(super) fn extreme_stretches(gradient: &Tensor<f64>) -> [f64; 2] {
    let square: Tensor<f64> = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|k| gradient[k][i] * gradient[k][j]).sum())
    });
    extreme_eigenvalues(&square).map(f64::sqrt)
}

/// Stress at every quadrature point (without what a solid with memory carries over).
pub fn stress_points<'p>(
    problem: &'p Problem,
    state: &'p State,
) -> impl Iterator<Item = StressPoint> + 'p {
    let places = state.places(&problem.mesh);
    (0..problem.mesh.cell_count()).flat_map(move |cell| stress_in(problem, state, &places, cell))
}

/// Cauchy stress at each node, Pa: 11, 22, 33, 12, 23, 13. In each cell the linear field that is
/// nearest to the stress at its quadrature points is continued to the nodes; where cells meet, the
/// mean is taken, by their volumes. Nodes of no cell get zero.
pub fn nodal_stress(problem: &Problem, state: &State) -> Vec<Symmetric<f64>> {
    let mesh = &problem.mesh;
    let places = state.places(mesh);
    let mut sums = vec![[0.0; 6]; mesh.points.len()];
    let mut volumes = vec![0.0; mesh.points.len()];
    let mut continued: Vec<(CellShape, Vec<Vec<f64>>)> = Vec::new();
    for cell in 0..mesh.cell_count() {
        let shape = mesh.shape(cell);
        if continued.iter().all(|(known, _)| *known != shape) {
            continued.push((shape, continuation(shape)));
        }
        let Some((_, weights)) = continued.iter().find(|(known, _)| *known == shape) else {
            continue;
        };
        let points = stress_in(problem, state, &places, cell);
        let volume: f64 = points.iter().map(|point| point.volume).sum();
        for (&node, weights) in mesh.cell(cell).iter().zip(weights) {
            volumes[node as usize] += volume;
            for (point, weight) in points.iter().zip(weights) {
                for (sum, stress) in sums[node as usize].iter_mut().zip(point.cauchy) {
                    *sum += volume * weight * stress;
                }
            }
        }
    }
    let mean = |(sum, volume): (Symmetric<f64>, &f64)| {
        sum.map(|stress| if *volume == 0.0 { 0.0 } else { stress / volume })
    };
    sums.into_iter().zip(&volumes).map(mean).collect()
}

/// Von Mises stress of a stress 11, 22, 33, 12, 23, 13, Pa.
pub fn von_mises(s: Symmetric<f64>) -> f64 {
    let shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    let squares = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    (squares / 2.0 + 3.0 * shear).sqrt()
}

/// For each node of a shape the weights of its quadrature points in the value there of the linear
/// field that is nearest to their values (least squares).
fn continuation(shape: CellShape) -> Vec<Vec<f64>> {
    let size = shape.dimension() + 1;
    let terms = |at: [f64; 3]| -> Vec<f64> { std::iter::once(1.0).chain(at).take(size).collect() };
    let points: Vec<Vec<f64>> = shape
        .quadrature()
        .into_iter()
        .map(|point| terms(point.at))
        .collect();
    let mut normal = vec![vec![0.0; size]; size];
    for point in &points {
        for i in 0..size {
            for j in 0..size {
                normal[i][j] += point[i] * point[j];
            }
        }
    }
    (0..shape.node_count())
        .map(|node| {
            // The points of a shape span it, so the normal matrix is regular.
            let by_terms = solve_small(normal.clone(), terms(shape.node_at(node)))
                .unwrap_or_else(|| vec![0.0; size]);
            let weight = |point: &Vec<f64>| dot(point, &by_terms);
            points.iter().map(weight).collect()
        })
        .collect()
}

fn stress_in(
    problem: &Problem,
    state: &State,
    places: &[[f64; 3]],
    cell: usize,
) -> Vec<StressPoint> {
    let mesh = &problem.mesh;
    let shape = mesh.shape(cell);
    let nodes = mesh.cell(cell);
    let dimension = mesh.dimension();
    let material = &problem.materials[mesh.region_of(cell)];
    let centre = mesh.points[nodes[nodes.len() - 1] as usize];
    let size = nodes[..shape.corner_count()]
        .iter()
        .flat_map(|&n| (0..3).map(move |d| (mesh.points[n as usize][d] - centre[d]).abs()))
        .fold(0.0, f64::max);
    let map = |at: &crate::mesh::Shapes, points: &[[f64; 3]]| {
        let mut gradient = [[0.0; 3]; 3];
        let mut place = [0.0; 3];
        for (n, &node) in nodes.iter().enumerate() {
            let x = points[node as usize];
            for i in 0..dimension {
                place[i] += at.values[n] * x[i];
                for k in 0..dimension {
                    gradient[i][k] += at.gradients[n][k] * x[i];
                }
            }
        }
        match problem.kinematics {
            Kinematics::PlaneStrain => gradient[2][2] = 1.0,
            Kinematics::Axisymmetric => gradient[2][2] = place[0],
            Kinematics::Solid => {}
        }
        (gradient, place)
    };
    let points = shape.quadrature().into_iter().map(|point| {
        let shapes = shape.shapes(point.at);
        let (undeformed, place) = map(&shapes, &mesh.points);
        let (deformed, _) = map(&shapes, places);
        let volume = determinant(&undeformed);
        let inward = inverse(&undeformed, volume);
        let gradient: Tensor<f64> = std::array::from_fn(|i| {
            std::array::from_fn(|k| (0..3).map(|m| deformed[i][m] * inward[m][k]).sum())
        });
        let ratio = determinant(&gradient);
        let response = material.law.response(&gradient);
        let p = &state.pressures[cell];
        let pressure = (0..dimension).fold(p[0], |sum, d| {
            sum + p[d + 1] * (place[d] - centre[d]) / size
        });
        let mut cauchy = response.stress.map(|tau| tau / ratio);
        for stress in &mut cauchy[..3] {
            *stress += pressure;
        }
        StressPoint {
            cell,
            place,
            gradient,
            cauchy,
            pressure,
            von_mises: von_mises(response.stress.map(|tau| tau / ratio)),
            volume: volume * point.weight,
        }
    });
    points.collect()
}
