//! C5: a slit in a large body under pressure, plane strain.
//!
//! The faces move apart (or together, under a pressure from outside) by an ellipse of
//! the height `2 (1 - nu^2) w p / E`; the area changes by `pi/4` of height times width.

use super::tools::{body, eager, from_start, load_to, node_near, plane, towards_end, with_poisson};
use super::{Case, Effort};
use crate::mesh::Axis;
use crate::problem::Kinematics;
use crate::problem::{Cavity, Motion, Rule};
use crate::solver::failure::Failure;

/// Half the body, in half widths of the slit; it is missed by the square of its inverse.
const FAR: f64 = 300.0;
const PRESSURE: f64 = 1e-3;

/// Height and area of the opened slit over those of the formula.
fn opened(case: &mut Case, poisson: f64, smallest: f64) -> Result<[f64; 2], Failure> {
    let near = from_start(smallest, 1.5, 1.0);
    let away = from_start(1.0, 1.5, 30.0);
    let slit = towards_end(smallest, 1.5, 0.1);
    let along = Axis::new(&[0.0, 1.0, 5.0, FAR], &[slit, near, away])?;
    let up = Axis::new(&[0.0, 4.0, FAR], &[near, away])?;
    let mut mesh = plane(along, up)?;
    mesh.name_boundary("slit", |x| x[1] == 0.0 && x[0] <= 1.0);
    mesh.name_boundary("ahead", |x| x[1] == 0.0 && x[0] >= 1.0);
    let mut problem = body(mesh, Kinematics::PlaneStrain, with_poisson(poisson))?;
    problem.support("left", 0, Motion::Fixed)?;
    problem.support("ahead", 1, Motion::Fixed)?;
    let pressure = problem.parameter("pressure", Rule::Given);
    let wall = problem.surface("slit")?;
    problem.cavities.push(Cavity {
        wall,
        axis: 1,
        origin: 0.0,
        pressure,
    });
    let middle = node_near(&problem.mesh, [0.0; 3]) as usize;
    let mut solver = eager(problem)?;
    case.sized(&solver);
    // Far places are rounded; the answer is in error by the square of the tolerance.
    solver.settings.tolerance = 1e-4;
    // Small strain: the mean of opening and closing has no term of second order.
    let mut found = [0.0; 2];
    for sign in [0.5, -0.5] {
        load_to(&mut solver, &[2.0 * sign * PRESSURE])?;
        found[0] += sign * solver.state().displacement[middle][1];
        found[1] += sign * solver.evaluate()?.volumes[0];
    }
    // E = 2 G (1 + nu), G = 1; the width is 2, and a half of a half is solved.
    let half_height = (1.0 - poisson * poisson) * 2.0 * PRESSURE / (2.0 * (1.0 + poisson));
    let quarter = std::f64::consts::FRAC_PI_4 * half_height;
    Ok([found[0] / half_height, found[1] / quarter])
}

pub(super) fn solve(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let smallest = if effort == Effort::Full { 1e-4 } else { 1e-3 };
    for poisson in [0.3, 0.5] {
        let [height, area] = opened(case, poisson, smallest)?;
        case.relative(
            format!("height over its formula, Poisson's ratio {poisson}"),
            1.0,
            height,
            1e-3,
        );
        case.relative(
            format!("area over its formula, Poisson's ratio {poisson}"),
            1.0,
            area,
            1e-3,
        );
    }
    Ok(())
}
