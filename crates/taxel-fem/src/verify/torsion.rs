//! B4: a solid cylinder twisted at constant length (Rivlin 1949).
//!
//! `T = pi (c10 + c01) psi a^4`, `N = -pi/2 psi^2 a^4 (c10 + 2 c01)`: the cylinder wants
//! to lengthen, and is held.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::tools::{body, drive, load_to};
use super::{Case, Effort, Refinement};
use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, CellShape, Grid3, Mesh};
use crate::problem::Kinematics;
use crate::problem::Rule;
use crate::solver::failure::Failure;
use crate::solver::newton::Solver;

pub(super) const C10: f64 = 0.4;
pub(super) const C01: f64 = 0.1;
/// Length of the piece that is solved; the radius is one. A shorter one is held by its
/// ends like a thin film, whose pressure is sensitive.
pub(super) const LENGTH: f64 = 0.5;
/// Cells along it: a helix is not quadratic.
const LAYERS: usize = 3;

/// A cylinder of five blocks: a square in the middle and one on each of its sides.
pub(super) fn cylinder(count: usize) -> Result<Mesh, Failure> {
    const HALF: f64 = 0.45;
    let mut mesh = Mesh::default();
    let region = mesh.region("solid");
    let mut known = HashMap::new();
    for block in 0..5 {
        let across = if block == 0 {
            Axis::uniform(-1.0, 1.0, count)?
        } else {
            Axis::uniform(0.0, 1.0, count)?
        };
        let axes = [
            across,
            Axis::uniform(-1.0, 1.0, count)?,
            Axis::uniform(0.0, LENGTH, LAYERS)?,
        ];
        let place = |[v, u, z]: [f64; 3]| {
            if block == 0 {
                return [HALF * v, HALF * u, z];
            }
            let angle = FRAC_PI_4 * u;
            let x = (1.0 - v) * HALF + v * angle.cos();
            let y = (1.0 - v) * HALF * u + v * angle.sin();
            let (sin, cos) = (FRAC_PI_2 * f64::from(block)).sin_cos();
            [cos * x - sin * y, sin * x + cos * y, z]
        };
        let part = Grid3::new(axes, "solid").mesh()?;
        for cell in 0..part.cell_count() {
            let nodes: Vec<u32> = part
                .cell(cell)
                .iter()
                .map(|&node| {
                    let x = place(part.points[node as usize]);
                    let key = x.map(|x| (x * 1e9).round() as i64);
                    *known.entry(key).or_insert_with(|| {
                        mesh.points.push(x);
                        mesh.points.len() as u32 - 1
                    })
                })
                .collect();
            mesh.add_cell(CellShape::Hex27, region, &nodes);
        }
    }
    mesh.name_boundary("bottom", |x| x[2] == 0.0);
    mesh.name_boundary("top", |x| x[2] == LENGTH);
    Ok(mesh)
}

/// Torque and axial force (tension positive) at a twist per length.
fn twisted(case: &mut Case, count: usize, twist: f64) -> Result<[f64; 2], Failure> {
    let law = Law::MooneyRivlin { c10: C10, c01: C01 };
    let material = Material {
        law,
        volumetric: Volumetric::Incompressible,
    };
    let mut problem = body(cylinder(count)?, Kinematics::Solid, material)?;
    problem.clamp("bottom")?;
    let way = problem.parameter("twist", Rule::Given);
    let top = problem.mesh.nodes_of("top").unwrap_or_default();
    let (sin, cos) = (twist * LENGTH).sin_cos();
    drive(&mut problem, &top, way, |[x, y, _]| {
        [cos * x - sin * y - x, sin * x + cos * y - y, 0.0]
    });
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 0.5;
    load_to(&mut solver, &[1.0])?;
    case.sized(&solver);
    let forces = solver.evaluate()?.forces;
    let places = solver.state().places(&solver.problem().mesh);
    let mut found = [0.0; 2];
    for &node in &top {
        let (x, f) = (places[node as usize], &forces[node as usize * 3..]);
        found[0] += x[0] * f[1] - x[1] * f[0];
        found[1] += f[2];
    }
    Ok(found)
}

pub(super) fn solve(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let (count, twists): (usize, &[f64]) = match effort {
        Effort::Full => (5, &[0.5, 1.0]),
        Effort::Short => (3, &[1.0]),
    };
    // The error falls with the fourth power of the cells around: 2 % with one.
    let limit = if effort == Effort::Full { 1e-4 } else { 1e-3 };
    let torque = |twist: f64| PI * (C10 + C01) * twist;
    for &twist in twists {
        let found = twisted(case, count, twist)?;
        let normal = -FRAC_PI_2 * twist * twist * (C10 + 2.0 * C01);
        case.relative(
            format!("torque at a twist of {twist}"),
            torque(twist),
            found[0],
            limit,
        );
        case.relative(
            format!("axial force at a twist of {twist}"),
            normal,
            found[1],
            limit,
        );
    }
    let mut points = Vec::new();
    let counts: &[usize] = match effort {
        Effort::Full => &[1, 2, 3],
        Effort::Short => &[1, 2],
    };
    for &count in counts {
        let [found, _] = twisted(case, count, 1.0)?;
        points.push((1.0 / count as f64, (found / torque(1.0) - 1.0).abs()));
    }
    case.refinement.push(Refinement {
        what: "torque at a twist of 1".to_owned(),
        points,
    });
    Ok(())
}
