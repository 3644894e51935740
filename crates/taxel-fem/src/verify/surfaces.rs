//! C6: surfaces that touch each other.
//!
//! - C6.1 Two blocks of one solid with meshes that do not match are pressed together: the state
//!   is that of one block, and the pressure is even (contact patch test).
//! - C6.2 Two round bodies (Hertz 1881; Johnson, Contact Mechanics, chapter 4): with
//!   `1/E* = (1 - nu)/(2 G1) + (1 - nu)/(2 G2)` and `1/R = 1/R1 + 1/R2` two spheres press each
//!   other by `4/3 E* sqrt(R) d^1.5`; between two cylinders the greatest pressure is
//!   `sqrt(P E* / (pi R))`.
//! - C6.3 A body against its mirror image is the body against a rigid plane.
//! - C6.4 The walls of a slit that is pressed shut are half of it against a rigid plane.
//! - C6.6 Two blocks whose meshes do not match are tied: they deform as one.
//! - C6.5 A block that is dragged over another one slides at `mu` times the load, as long as both
//!   are hardly strained: on a slab without end whose elastic energy stays, the force along it is
//!   the friction over the length of its deformed surface, and its stretch is of the order of the
//!   pressure over the shear modulus.

use super::tools::{
    UNIT_RUBBER, body, drive, from_start, load_to, mapped, plane, towards_end, with_poisson,
};
use super::{Case, Effort};
use crate::assembly::surfaces::tie;
use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Grading, Grid3, Mesh};
use crate::problem::load::traction;
use crate::problem::{
    Contact, DeadLoad, Kinematics, Motion, Obstacle, Parameter, Problem, Rule, Shape, SurfacePair,
};
use crate::solver::failure::Failure;
use crate::solver::newton::Solver;

/// A block between two heights, of so many cells along each side and up.
fn block(kinematics: Kinematics, heights: [f64; 2], cells: [usize; 2]) -> Result<Mesh, Failure> {
    let side = || Axis::uniform(0.0, 1.0, cells[0]);
    let up = Axis::uniform(heights[0], heights[1], cells[1])?;
    Ok(if kinematics == Kinematics::Solid {
        Grid3::new([side()?, side()?, up], "solid").mesh()?
    } else {
        plane(side()?, up)?
    })
}

/// Two bodies in one mesh, held below and on their planes of symmetry, moved by the
/// parameter above.
fn pressed_together(
    bodies: [(&Mesh, Material); 2],
    kinematics: Kinematics,
) -> Result<(Problem, Parameter), Failure> {
    let mesh = Mesh::joined(&[("lower", bodies[0].0), ("upper", bodies[1].0)], |_| false);
    let mut problem = body(mesh, kinematics, bodies[0].1)?;
    problem.materials[1] = bodies[1].1;
    let height = kinematics.components() - 1;
    for part in ["lower", "upper"] {
        problem.support(&format!("{part}_left"), 0, Motion::Fixed)?;
        if height == 2 {
            problem.support(&format!("{part}_front"), 1, Motion::Fixed)?;
        }
    }
    problem.support("lower_bottom", height, Motion::Fixed)?;
    let depth = problem.parameter("depth", Rule::Given);
    problem.support("upper_top", height, Motion::Driven(depth, -1.0))?;
    Ok((problem, depth))
}

fn touch(problem: &mut Problem, first: &str, second: &str, modulus: f64) -> Result<(), Failure> {
    let surfaces = [problem.surface(first)?, problem.surface(second)?];
    let pair = SurfacePair::new(&problem.mesh, surfaces, modulus);
    problem.contacts.push(Contact::Surfaces(pair));
    Ok(())
}

/// Greatest difference of the pressure from its exact value, over that.
fn unevenness(solver: &Solver, exact: f64) -> f64 {
    let pressures = solver.contact(0).pressures;
    pressures
        .iter()
        .fold(0.0, |most: f64, p| most.max((p / exact - 1.0).abs()))
}

/// What the rounds of multipliers leave of an overlap of 1e-9, in pressures.
const LIMIT: f64 = 1e-8;

pub(super) fn patch(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    // The same stretch in both blocks, the sides free.
    let shorter = 0.8_f64;
    let even = |power: i32| shorter - shorter.powi(power);
    let shapes = [
        ("plane strain", Kinematics::PlaneStrain, even(-3)),
        ("axisymmetric", Kinematics::Axisymmetric, even(-2)),
        ("in space", Kinematics::Solid, even(-2)),
    ];
    let cells = if effort == Effort::Full {
        [[3, 2], [4, 3]]
    } else {
        [[2, 1], [3, 1]]
    };
    for (name, kinematics, stress) in shapes {
        let lower = block(kinematics, [-1.0, 0.0], cells[0])?;
        let upper = block(kinematics, [0.0, 1.0], cells[1])?;
        let bodies = [(&lower, UNIT_RUBBER), (&upper, UNIT_RUBBER)];
        let (mut problem, _) = pressed_together(bodies, kinematics)?;
        touch(&mut problem, "upper_bottom", "lower_top", 1.0)?;
        if let Contact::Surfaces(pair) = &mut problem.contacts[0] {
            pair.overlap_limit = 1e-9;
        }
        let mut solver = Solver::new(problem)?;
        case.sized(&solver);
        load_to(&mut solver, &[2.0 * (1.0 - shorter)])?;
        let off = unevenness(&solver, -stress);
        case.absolute(
            format!("greatest difference of the pressure, {name}"),
            0.0,
            off,
            LIMIT,
        );
    }
    Ok(())
}

/// Height of the surface of a round body of radius one over its top.
fn sagged(x: f64) -> f64 {
    -0.5 * x * x
}

/// Two round bodies with even cells where they touch, from their common point to far away.
struct Round {
    kinematics: Kinematics,
    /// Cells on the half width that may touch.
    cells: [usize; 2],
    materials: [Material; 2],
    /// Radius over that of contact.
    radius: f64,
}

/// Half width (radius) of the part with even cells, in radii of contact.
const NEAR: f64 = 1.5;
/// Where the grading begins anew, and the sides, in radii of contact.
const FAR: [f64; 2] = [50.0, 1000.0];

impl Round {
    /// The lower body, its top at the origin.
    fn half(&self, cells: usize, upwards: bool) -> Result<Mesh, Failure> {
        let size = NEAR / cells as f64;
        let (near, away) = (
            from_start(size, 1.5, f64::INFINITY),
            from_start(10.0, 1.5, f64::INFINITY),
        );
        let (below, deep) = (
            towards_end(size, 1.5, f64::INFINITY),
            towards_end(10.0, 1.5, f64::INFINITY),
        );
        let across = Axis::new(
            &[0.0, NEAR, FAR[0], FAR[1]],
            &[Grading::Uniform(cells), near, away],
        )?;
        let sign = if upwards { 1.0 } else { -1.0 };
        let up = if upwards {
            Axis::new(&[0.0, FAR[0], FAR[1]], &[near, away])?
        } else {
            Axis::new(&[-FAR[1], -FAR[0], 0.0], &[deep, below])?
        };
        let mut mesh = plane(across, up)?;
        mesh.name_boundary("round", |x| x[1] == 0.0 && x[0] <= NEAR);
        let radius = self.radius;
        // The surface alone: its sag is far below the size of a cell.
        Ok(mapped(mesh, |[x, y, z]| {
            let sag = if y == 0.0 {
                radius * sagged(x.min(NEAR) / radius)
            } else {
                0.0
            };
            [x, y - sign * sag, z]
        }))
    }

    fn pressed(&self, case: &mut Case, depth: f64) -> Result<(Solver, f64), Failure> {
        let lower = self.half(self.cells[0], false)?;
        let upper = self.half(self.cells[1], true)?;
        let bodies = [(&lower, self.materials[0]), (&upper, self.materials[1])];
        let (mut problem, _) = pressed_together(bodies, self.kinematics)?;
        touch(&mut problem, "lower_round", "upper_round", 1.0)?;
        if let Contact::Surfaces(pair) = &mut problem.contacts[0] {
            pair.overlap_limit = 1e-4 * depth;
        }
        let mut solver = Solver::new(problem)?;
        // Far places are rounded; the force is in error by the square.
        solver.settings.tolerance = 3e-4;
        solver.settings.first_step = 1.0;
        solver.settings.iterations = 30;
        case.sized(&solver);
        load_to(&mut solver, &[depth])?;
        let force = solver.evaluate()?.along[0];
        Ok((solver, force))
    }
}

/// A solid of a shear modulus and a Poisson's ratio.
fn solid(modulus: f64, poisson: f64) -> Material {
    let unit = with_poisson(poisson);
    let volumetric = match unit.volumetric {
        Volumetric::Quadratic(bulk) => Volumetric::Quadratic(modulus * bulk),
        other => other,
    };
    Material {
        law: Law::neo_hookean(modulus),
        volumetric,
    }
}

pub(super) fn hertz(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let cells = if effort == Effort::Full {
        [40, 30]
    } else {
        [30, 22]
    };
    case.note = String::from(
        "The sides are 1000 radii of contact away; the cells of the bodies do not match.",
    );
    let pairs = [("equal", 1.0, 0.3, 0.3), ("1 to 3", 3.0, 0.3, 0.5)];
    for (name, stiffer, first, second) in pairs {
        let inverse = (1.0 - first) / 2.0 + (1.0 - second) / (2.0 * stiffer);
        let modulus = 1.0 / inverse;
        let round = |kinematics| Round {
            kinematics,
            cells,
            materials: [solid(1.0, first), solid(stiffer, second)],
            radius: 1e4,
        };
        let radius = 0.5 * 1e4;
        // Of spheres: the radius of contact is one.
        let depth = 1.0 / radius;
        let (_, force) = round(Kinematics::Axisymmetric).pressed(case, depth)?;
        let exact = 4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5);
        case.relative(
            format!("force between spheres, moduli {name}"),
            exact,
            force,
            1e-2,
        );
        // Of cylinders: the way depends on the far sides, the pressure on the force alone. One
        // half is solved.
        let (solver, half) = round(Kinematics::PlaneStrain).pressed(case, 4.0 * depth)?;
        let greatest = solver.contact(0).pressures.into_iter().fold(0.0, f64::max);
        let exact = (2.0 * half * modulus / (std::f64::consts::PI * radius)).sqrt();
        let what = format!("greatest pressure between cylinders, moduli {name}");
        case.relative(what, exact, greatest, 1e-2);
    }
    Ok(())
}

/// Height of a hump of height 0.2 over the unit square.
fn humped(x: [f64; 3], kinematics: Kinematics) -> f64 {
    let across = if kinematics == Kinematics::Solid {
        x[1]
    } else {
        0.0
    };
    0.2 * (1.0 - x[0] * x[0]) * (1.0 - across * across)
}

pub(super) fn mirror(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let travel = 0.15;
    for (name, kinematics, cells) in [
        ("plane strain", Kinematics::PlaneStrain, [6, 4]),
        ("axisymmetric", Kinematics::Axisymmetric, [6, 4]),
        ("in space", Kinematics::Solid, [4, 3]),
    ] {
        if effort == Effort::Short && kinematics == Kinematics::Solid {
            continue;
        }
        let height = kinematics.components() - 1;
        let body_of = |upwards: bool| -> Result<Mesh, Failure> {
            let heights = if upwards { [0.2, 1.0] } else { [-1.0, -0.2] };
            let mesh = block(kinematics, heights, cells)?;
            let sign = if upwards { 1.0 } else { -1.0 };
            Ok(mapped(mesh, |mut x| {
                // The hump is the whole of the surface, and nothing of the far side.
                let share = (1.0 - x[height].abs()) / 0.8;
                x[height] -= sign * share * humped(x, kinematics);
                x
            }))
        };
        let (lower, upper) = (body_of(false)?, body_of(true)?);
        let bodies = [(&lower, UNIT_RUBBER), (&upper, UNIT_RUBBER)];
        let (mut problem, _) = pressed_together(bodies, kinematics)?;
        let last = ["", "bottom", "bottom"][height];
        let top = ["", "top", "top"][height];
        touch(
            &mut problem,
            &format!("upper_{last}"),
            &format!("lower_{top}"),
            1.0,
        )?;
        let mut both = Solver::new(problem)?;
        case.sized(&both);
        load_to(&mut both, &[2.0 * travel])?;
        // One of them on a plane in the middle.
        let mut problem = body(upper, kinematics, UNIT_RUBBER)?;
        problem.support("left", 0, Motion::Fixed)?;
        if height == 2 {
            problem.support("front", 1, Motion::Fixed)?;
        }
        let depth = problem.parameter("depth", Rule::Given);
        problem.support(top, height, Motion::Driven(depth, -1.0))?;
        let surface = problem.surface(last)?;
        let side = problem.mesh.mean_side(&surface);
        let normal = std::array::from_fn(|d| f64::from(u8::from(d == height)));
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface,
            shape: Shape::HalfSpace {
                point: [0.0; 3],
                normal,
            },
            travel: None,
            stiffness: 50.0 / side,
            friction: 0.0,
            overlap_limit: 1e-4 * side,
        }));
        let mut one = Solver::new(problem)?;
        load_to(&mut one, &[travel])?;
        let (pair, plane) = (both.evaluate()?.along[0], one.evaluate()?.along[0]);
        case.relative(format!("force, {name}"), plane, pair, 2e-3);
    }
    Ok(())
}

pub(super) fn slit(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    // With half as many the tip creases.
    let cells = 12;
    let (reach, open, travel) = (2.0, 0.1, 0.5);
    // The slit is a lens of half width one in the lower or upper half of a block.
    let half = |upwards: bool| -> Result<Mesh, Failure> {
        let along = Axis::uniform(0.0, reach, 2 * cells)?;
        let (low, high) = if upwards { (0.0, reach) } else { (-reach, 0.0) };
        let mut mesh = plane(along, Axis::uniform(low, high, 2 * cells)?)?;
        mesh.name_boundary("wall", |x| x[1] == 0.0 && x[0] <= 1.0);
        mesh.name_boundary("ahead", |x| x[1] == 0.0 && x[0] >= 1.0);
        let sign = if upwards { 1.0 } else { -1.0 };
        Ok(mapped(mesh, |[x, y, z]| {
            let lens = open * (1.0 - x * x).max(0.0);
            [x, y + sign * lens * (1.0 - y.abs() / reach), z]
        }))
    };
    let (lower, upper) = (half(false)?, half(true)?);
    let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |x| {
        x[1] == 0.0 && x[0] >= 1.0
    });
    let mut problem = body(mesh, Kinematics::PlaneStrain, UNIT_RUBBER)?;
    for part in ["lower", "upper"] {
        problem.support(&format!("{part}_left"), 0, Motion::Fixed)?;
    }
    let press = problem.parameter("press", Rule::Given);
    problem.support("upper_top", 1, Motion::Driven(press, -1.0))?;
    problem.support("lower_bottom", 1, Motion::Driven(press, 1.0))?;
    let mut walls = problem.surface("lower_wall")?;
    walls.extend(problem.surface("upper_wall")?);
    problem.mesh.surfaces.insert("wall".into(), walls);
    touch(&mut problem, "wall", "wall", 1.0)?;
    let mut whole = Solver::new(problem)?;
    case.sized(&whole);
    let mut problem = body(upper, Kinematics::PlaneStrain, UNIT_RUBBER)?;
    problem.support("left", 0, Motion::Fixed)?;
    problem.support("ahead", 1, Motion::Fixed)?;
    let press = problem.parameter("press", Rule::Given);
    problem.support("top", 1, Motion::Driven(press, -1.0))?;
    let surface = problem.surface("wall")?;
    let side = problem.mesh.mean_side(&surface);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface,
        shape: Shape::HalfSpace {
            point: [0.0; 3],
            normal: [0.0, 1.0, 0.0],
        },
        travel: None,
        stiffness: 50.0 / side,
        friction: 0.0,
        overlap_limit: 1e-4 * side,
    }));
    let mut one = Solver::new(problem)?;
    let shares: &[f64] = if effort == Effort::Full {
        &[0.5, 1.0]
    } else {
        &[0.5]
    };
    for share in shares {
        load_to(&mut whole, &[share * travel])?;
        load_to(&mut one, &[share * travel])?;
        // Both ends of the whole are driven.
        let (pair, plane) = (0.5 * whole.evaluate()?.along[0], one.evaluate()?.along[0]);
        case.relative(format!("force at {:.2}", share * travel), plane, pair, 2e-3);
        let (pair, plane) = (whole.contact(0).force_size(), one.contact(0).force_size());
        case.relative(
            format!("force of the walls at {:.2}", share * travel),
            plane,
            pair,
            5e-3,
        );
    }
    Ok(())
}

pub(super) fn tied(case: &mut Case, _: Effort) -> Result<(), Failure> {
    for (name, kinematics, cells) in [
        ("plane strain", Kinematics::PlaneStrain, [3, 4]),
        ("in space", Kinematics::Solid, [2, 3]),
    ] {
        let lower = block(kinematics, [-1.0, 0.0], [cells[0], 2])?;
        let upper = block(kinematics, [0.0, 1.0], [cells[1], 2])?;
        let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |_| false);
        let mut problem = body(mesh, kinematics, with_poisson(0.3))?;
        let height = kinematics.components() - 1;
        let [top, bottom] = ["upper_bottom", "lower_top"];
        let surfaces = [problem.surface(top)?, problem.surface(bottom)?];
        let walls = tie(&problem, surfaces, 1.0)?;
        problem.contacts.push(Contact::Walls(walls));
        // Sheared and stretched on all sides but the tied ones.
        let moves = |x: [f64; 3]| {
            let mut u = [0.0; 3];
            u[0] = 0.2 * x[0] + 0.4 * x[height];
            u[height] = -0.1 * x[height];
            u
        };
        let by = problem.parameter("by", Rule::Given);
        // Nodes within the blocks and within the tied surfaces are free.
        let within = |x: f64, low: f64| x > low && x < 1.0;
        let points = problem.mesh.points.clone();
        let driven: Vec<u32> = (0..points.len() as u32)
            .filter(|&node| {
                let x = points[node as usize];
                let free = within(x[height], -1.0) && (0..height).all(|d| within(x[d], 0.0));
                !free
            })
            .collect();
        drive(&mut problem, &driven, by, moves);
        let mut solver = Solver::new(problem)?;
        case.sized(&solver);
        load_to(&mut solver, &[1.0])?;
        let moved = solver.state().displacement.iter().zip(&points);
        let off = moved.fold(0.0, |most: f64, (u, x)| {
            let exact = moves(*x);
            (0..3).fold(most, |most, d| most.max((u[d] - exact[d]).abs()))
        });
        // Nodes move by up to 0.6; the iteration ends at 1e-7 of its energy norm.
        let what = format!("greatest difference of a displacement, {name}");
        case.absolute(what, 0.0, off, 1e-5);
    }
    Ok(())
}

pub(super) fn dragged(case: &mut Case, _: Effort) -> Result<(), Failure> {
    let (roughness, pressure, length) = (0.5, 0.005, 1.0);
    // A block on the middle of a longer one of the same solid.
    let long = Axis::uniform(-1.0, 3.0, 13)?;
    let lower = plane(long, Axis::uniform(-1.0, 0.0, 3)?)?;
    let upper = block(Kinematics::PlaneStrain, [0.0, 0.5], [4, 2])?;
    let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |_| false);
    let mut problem = body(mesh, Kinematics::PlaneStrain, UNIT_RUBBER)?;
    problem.clamp("lower_bottom")?;
    let load = problem.parameter("load", Rule::Given);
    let drag = problem.parameter("drag", Rule::Given);
    let top = problem.surface("upper_top")?;
    let forces = traction(&problem.mesh, problem.kinematics, &top, |_| {
        [0.0, -1.0, 0.0]
    });
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: load,
    });
    problem.support("upper_top", 0, Motion::Driven(drag, 1.0))?;
    touch(&mut problem, "upper_bottom", "lower_top", 1.0)?;
    if let Contact::Surfaces(pair) = &mut problem.contacts[0] {
        pair.friction = roughness;
    }
    let mut solver = Solver::new(problem)?;
    case.sized(&solver);
    load_to(&mut solver, &[pressure, 0.0])?;
    let greatest = roughness * pressure * length;
    // Over several facets of the lower block, and back.
    for (way, sign) in [(0.3, 1.0), (1.2, 1.0), (0.6, -1.0)] {
        load_to(&mut solver, &[pressure, way])?;
        let pull = solver.evaluate()?.along[drag.0];
        case.relative(
            format!("pull at a way of {way}"),
            sign * greatest,
            pull,
            // The friction is along the surfaces, which are bent at the edges.
            2e-3,
        );
        let probe = solver.contact(0);
        let sizes = probe.tractions.iter().zip(&probe.areas);
        let friction: f64 = sizes.map(|(t, area)| area * t[0].hypot(t[1])).sum();
        case.relative(
            format!("friction of all points over their pressure at a way of {way}"),
            roughness,
            friction / probe.force_size(),
            // Anchors lie on facets, which are bent.
            1e-4,
        );
    }
    Ok(())
}
