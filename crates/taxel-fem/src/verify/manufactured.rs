//! B9: a chosen deformation, the loads that it needs, and how fast the error falls.
//!
//! The deformation is a row of shears, `x = X + a sin(pi Y)`, `y = Y + a sin(pi Z + pi x)`,
//! and so on: it keeps the volume exactly, and its gradient is far from small.

use std::f64::consts::PI;

use super::patch::nominal;
use super::tools::{
    SHAPES, body, drive, eager, interpolated, kinematics, load_to, place_in, unit_body,
};
use super::{Case, Effort, Refinement};
use crate::material::{Law, Material, Volumetric};
use crate::mesh::CellShape;
use crate::problem::load::{body_force, traction};
use crate::problem::{DeadLoad, Rule};
use crate::scalar::Tensor;
use crate::solver::failure::Failure;
use crate::solver::newton::Solver;
use crate::solver::stress::stress_points;

const MATERIAL: Material = Material {
    law: Law::MooneyRivlin { c10: 0.4, c01: 0.1 },
    volumetric: Volumetric::Incompressible,
};
const HEIGHT: f64 = 0.11;

/// Place and gradient of the chosen deformation.
fn deformation(dimension: usize, x: [f64; 3]) -> ([f64; 3], Tensor<f64>) {
    let mut place = x;
    let mut gradient = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for moved in 0..dimension {
        let by = (moved + 1) % dimension;
        let phase = PI * (place[by] + 0.2 * moved as f64);
        place[moved] += HEIGHT * phase.sin();
        let slope = HEIGHT * PI * phase.cos();
        for k in 0..3 {
            gradient[moved][k] += slope * gradient[by][k];
        }
    }
    (place, gradient)
}

/// Mean stress, up to 0.78 shear moduli. Elements keep the volume in the mean, not at
/// every place: under a mean tension near one shear modulus distorted hexahedra lose a
/// stability that the body (and tetrahedra) still have.
fn pressure(x: [f64; 3]) -> f64 {
    0.6 * ((PI * x[0]).cos() * (PI * x[1] + 0.5).sin() + 0.3 * x[2])
}

fn stress(dimension: usize, x: [f64; 3]) -> Tensor<f64> {
    let (_, gradient) = deformation(dimension, x);
    nominal(&MATERIAL, &gradient, pressure(x))
}

/// `-Div P`, by differences of sixth order: exact to about 1e-11.
fn force(dimension: usize, x: [f64; 3]) -> [f64; 3] {
    const STEP: f64 = 4e-3;
    const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];
    let mut force = [0.0; 3];
    for k in 0..dimension {
        for (n, weight) in WEIGHTS.into_iter().enumerate() {
            let at = |sign: f64| {
                let mut moved = x;
                moved[k] += sign * STEP * (n + 1) as f64;
                stress(dimension, moved)
            };
            let (up, down) = (at(1.0), at(-1.0));
            for i in 0..dimension {
                force[i] -= weight * (up[i][k] - down[i][k]) / STEP;
            }
        }
    }
    force
}

/// Errors of displacement (of places and of gradients) and pressure, root of the mean
/// square over the body.
fn errors(solver: &Solver, dimension: usize) -> [f64; 3] {
    let (problem, state) = (solver.problem(), solver.state());
    let mesh = &problem.mesh;
    let mut squares = [0.0; 3];
    let mut points = stress_points(problem, state);
    for cell in 0..mesh.cell_count() {
        for quadrature in mesh.shape(cell).quadrature() {
            let Some(point) = points.next() else { break };
            let x = place_in(mesh, cell, quadrature.at);
            let u = interpolated(mesh, cell, quadrature.at, &state.displacement);
            let (place, gradient) = deformation(dimension, x);
            for i in 0..dimension {
                squares[0] += point.volume * (x[i] + u[i] - place[i]).powi(2);
                for k in 0..dimension {
                    let error = point.gradient[i][k] - gradient[i][k];
                    squares[1] += point.volume * error * error;
                }
            }
            squares[2] += point.volume * (point.pressure - pressure(x)).powi(2);
        }
    }
    squares.map(f64::sqrt)
}

/// Errors on a mesh of so many cells along each side.
fn solved(case: &mut Case, shape: CellShape, count: usize) -> Result<[f64; 3], Failure> {
    let dimension = shape.dimension();
    let wave = |x: [f64; 3]| {
        let bump = 0.03 * (2.0 * PI * x[0]).sin() * (2.0 * PI * x[1]).sin();
        [x[0] + bump, x[1] - bump, x[2]]
    };
    let mut mesh = unit_body(shape, count, wave)?;
    mesh.name_boundary("end", |x| x[0] > 1.0 - 1e-9);
    let mut problem = body(mesh, kinematics(shape), MATERIAL)?;
    let way = problem.parameter("way", Rule::Given);
    let end = problem.surface("end")?;
    let mut nodes: Vec<u32> = Vec::new();
    for facet in problem.mesh.boundary() {
        if !end.contains(&facet) {
            nodes.extend(problem.mesh.facet_nodes(facet));
        }
    }
    nodes.sort_unstable();
    nodes.dedup();
    drive(&mut problem, &nodes, way, |x| {
        let (place, _) = deformation(dimension, x);
        std::array::from_fn(|d| place[d] - x[d])
    });
    let kinematics = problem.kinematics;
    let pull = |x| stress(dimension, x).map(|row| row[0]);
    let mut forces = traction(&problem.mesh, kinematics, &end, pull);
    forces.extend(body_force(&problem.mesh, kinematics, |x| {
        force(dimension, x)
    }));
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: way,
    });
    let mut solver = eager(problem)?;
    solver.settings.first_step = 0.5;
    load_to(&mut solver, &[1.0])?;
    case.sized(&solver);
    Ok(errors(&solver, dimension))
}

pub(super) fn solve(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    case.note = String::from(
        "The solid keeps its volume; three sides follow the map, one is loaded. Only stable \
         equilibria are accepted.",
    );
    for shape in SHAPES {
        let counts: &[usize] = match (shape, effort) {
            (CellShape::Quad9, Effort::Full) => &[4, 8, 16, 32],
            (CellShape::Tri7, Effort::Full) => &[8, 16, 32, 64],
            (CellShape::Quad9, Effort::Short) => &[4, 8, 16],
            // Triangles reach their rates on finer meshes.
            (CellShape::Tri7, Effort::Short) => &[8, 16, 32],
            (CellShape::Hex27, Effort::Full) => &[2, 4, 8],
            (CellShape::Tet15, Effort::Full) => &[2, 4, 6],
            (_, Effort::Short) => &[2, 4],
        };
        let names = ["displacement", "gradient", "pressure"];
        let mut curves = names.map(|name| Refinement {
            what: format!("{shape:?}: {name}"),
            points: Vec::new(),
        });
        for &count in counts {
            for (curve, error) in curves.iter_mut().zip(solved(case, shape, count)?) {
                curve.points.push((1.0 / count as f64, error));
            }
        }
        for (curve, rate) in curves.into_iter().zip([3.0, 2.0, 2.0]) {
            let slope = curve.slope().unwrap_or(f64::NAN);
            // Meshes are not yet fine where the slope is read (the pressure on triangles
            // has 1.76, 1.87, 1.95 on its way to 2); above the rate is good.
            let limit = match (shape.dimension(), effort) {
                (2, Effort::Full) => 0.1,
                (2, Effort::Short) => 0.15,
                _ => 0.35,
            };
            case.absolute(
                format!("{}: rate", curve.what),
                rate,
                slope.min(rate),
                limit,
            );
            case.refinement.push(curve);
        }
    }
    Ok(())
}
