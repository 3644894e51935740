//! B17, B18: a body between rigid ends.

use super::tools::{UNIT_RUBBER, body, load_to, plane};
use super::torsion::{C01, C10, LENGTH, cylinder};
use super::{Case, Effort};
use crate::material::{Law, Material, Volumetric};
use crate::mesh::Axis;
use crate::problem::{Kinematics, Motion, Parameter, Problem, Rule};
use crate::solver::failure::Failure;
use crate::solver::newton::{Continue, Solver, Step};
use std::f64::consts::{FRAC_PI_2, PI};

/// A strip of thickness one, clamped at its left end; its right end is a rigid body that is free
/// but for the torque of the parameter.
fn strip(
    length: f64,
    cells: usize,
    material: Material,
) -> Result<(Problem, [Parameter; 3]), Failure> {
    let along = (length * cells as f64).round() as usize / 2;
    let mesh = plane(
        Axis::uniform(0.0, length, along)?,
        Axis::uniform(-0.5, 0.5, cells)?,
    )?;
    let mut problem = body(mesh, Kinematics::PlaneStrain, material)?;
    problem.clamp("left")?;
    let mut end = problem.rigid_body("right", None)?;
    let free = ["end along x", "end along y", "end about z"];
    let free = free.map(|name| problem.free_parameter(name));
    end.travel[0] = Motion::Driven(free[0], 1.0);
    end.travel[1] = Motion::Driven(free[1], 1.0);
    end.turn[2] = Motion::Driven(free[2], 1.0);
    problem.rigid_bodies.push(end);
    Ok((problem, free))
}

/// Angle of the end under a torque, and the greatest last energy norm of a step of a quarter over
/// the square of the one before it: a bounded number where the iteration converges quadratically.
fn bent(
    case: &mut Case,
    strip: (Problem, [Parameter; 3]),
    torque: f64,
) -> Result<[f64; 2], Failure> {
    let (problem, free) = strip;
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 0.25;
    solver.settings.largest_step = 0.25;
    solver.settings.tolerance = 1e-10;
    let mut targets = vec![0.0; 3];
    targets[free[2].0] = torque;
    let mut most = 0.0;
    solver.load_to(&targets, |_, step: &Step| {
        let [_, before, last] = step.energies;
        most = f64::max(most, last / (before * before));
        Continue::Yes
    })?;
    case.sized(&solver);
    Ok([solver.state().parameters[free[2].0], most])
}

/// Torque of a block of thickness one that is bent to this curvature of `r dr`-lines: plane
/// sections stay plane, `r^2 = 2 X / w + c`, without traction on its faces (Rivlin 1949). `w` is
/// the angle per undeformed length, the shear modulus one.
fn flexure(w: f64) -> f64 {
    // Stretches of the faces: their product is one, the difference of their squares 2 w.
    let outer = (w + (w * w + 1.0).sqrt()).sqrt();
    let inner = 1.0 / outer;
    let energy = 0.5 * (outer * outer + inner * inner);
    let [r1, r2] = [inner / w, outer / w];
    energy * (r2 * r2 - r1 * r1) / 2.0
        - w * w * (r2.powi(4) - r1.powi(4)) / 8.0
        - (r2 / r1).ln() / (2.0 * w * w)
}

pub(super) fn bending(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    // Without a Poisson's ratio a section that is bent keeps its height, as a rigid end does.
    let law = Law::neo_hookean(1.0);
    let material = Material::new(law, Volumetric::Quadratic(2.0 / 3.0))
        .map_err(|_| Failure::at_start(crate::solver::failure::Reason::NotANumber))?;
    let (length, torque) = (8.0, 1e-6);
    let [angle, _] = bent(case, strip(length, 2, material)?, torque)?;
    // M L / (E I), E = 2 G.
    let exact = torque * length / (2.0 / 12.0);
    case.relative("angle under a small torque", exact, angle, 1e-5);
    // Where nothing but the tangent decides of it: without pressures that are eliminated.
    let [angle, last] = bent(case, strip(length, 2, material)?, 0.02)?;
    let what = format!("last energy norm over the square of the one before, to {angle:.2} rad");
    case.absolute(what, 0.0, last, 10.0);
    // Far from both ends an incompressible strip bends as Rivlin's block; what the ends do
    // falls out of the difference of two lengths.
    let (cells, limit) = match effort {
        Effort::Full => (8, 1e-5),
        Effort::Short => (4, 1e-4),
    };
    for w in [0.1, 0.3] {
        let torque = flexure(w);
        let [short, _] = bent(case, strip(4.0, cells, UNIT_RUBBER)?, torque)?;
        let [long, _] = bent(case, strip(7.0, cells, UNIT_RUBBER)?, torque)?;
        let what = format!("angle of three lengths of the strip, {w} per length");
        case.relative(what, 3.0 * w, long - short, limit);
    }
    Ok(())
}

pub(super) fn torsion(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let (count, limit) = match effort {
        Effort::Full => (5, 1e-4),
        Effort::Short => (3, 1e-3),
    };
    let law = Law::MooneyRivlin { c10: C10, c01: C01 };
    let material = Material {
        law,
        volumetric: Volumetric::Incompressible,
    };
    let mut problem = body(cylinder(count)?, Kinematics::Solid, material)?;
    problem
        .rigid_bodies
        .push(problem.rigid_body("bottom", None)?);
    // By its torque: the angle is found.
    let mut top = problem.rigid_body("top", Some([0.0, 0.0, LENGTH]))?;
    let twist = problem.free_parameter("twist");
    let lift = problem.parameter("lift", Rule::Given);
    top.turn[2] = Motion::Driven(twist, 1.0);
    top.travel[2] = Motion::Driven(lift, 1.0);
    problem.rigid_bodies.push(top);
    let torque = |twist: f64| PI * (C10 + C01) * twist;
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 0.5;
    case.sized(&solver);
    for by in [0.5, 1.0] {
        load_to(&mut solver, &[torque(by), 0.0])?;
        let angle = solver.state().parameters[twist.0];
        case.relative(
            format!("angle under the torque of a twist of {by}"),
            by * LENGTH,
            angle,
            limit,
        );
        let forces = solver.evaluate()?;
        let found = angle / LENGTH;
        let normal = -FRAC_PI_2 * found * found * (C10 + 2.0 * C01);
        case.relative(
            format!("axial force at that angle, of a twist of {by}"),
            normal,
            forces.along[lift.0],
            limit,
        );
        let state = solver.state();
        let places = state.places(&solver.problem().mesh);
        let top = &solver.problem().rigid_bodies[1];
        let found = top.torque(
            &top.motion(&state.parameters),
            |node| places[node as usize],
            |node| std::array::from_fn(|d| forces.forces[3 * node as usize + d]),
        );
        // The prescribed torque is met by the forces on the nodes.
        case.relative(
            format!("torque of the forces on the plate, of a twist of {by}"),
            torque(by),
            found[2],
            1e-8,
        );
    }
    Ok(())
}
