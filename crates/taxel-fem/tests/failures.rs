//! A solution that can't go on says by its reason why, where, and what helps.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use taxel_fem::assembly::state::State;
use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, Grid2, Mesh, gmsh};
use taxel_fem::problem::load::traction;
use taxel_fem::problem::{
    Cavity, Constraint, Contact, DeadLoad, FreeMotion, Kinematics, Motion, Obstacle, Parameter,
    Pressure, Problem, ProblemError, Quantity, RigidBody, Rule, Shape, SurfacePair,
};
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::solver::newton::{Continue, Jump, Solver, Step};

/// A rectangle from the origin, of a solid.
fn rectangle(size: [f64; 2], cells: [usize; 2], material: Material) -> Problem {
    let axes = [
        Axis::uniform(0.0, size[0], cells[0]).unwrap(),
        Axis::uniform(0.0, size[1], cells[1]).unwrap(),
    ];
    let mesh = Grid2::new(axes, "rubber").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials.push(material);
    problem
}

fn rubber() -> Material {
    Material::new(Law::neo_hookean(1.0), Volumetric::Incompressible).unwrap()
}

/// The failure on the way to these targets; `part` must be in what it says.
#[track_caller]
fn fails(problem: Problem, targets: &[f64], part: &str) -> Failure {
    let failure = match Solver::new(problem) {
        Err(failure) => failure,
        Ok(mut solver) => solver.load_to(targets, |_, _| Continue::Yes).unwrap_err(),
    };
    let text = failure.to_string();
    assert!(text.contains(part), "{part}: {text}");
    failure
}

#[test]
fn a_cell_inside_out_in_the_mesh_is_named_with_its_place() {
    let mut problem = rectangle([2.0, 1.0], [2, 1], rubber());
    problem.clamp("bottom").unwrap();
    let push = problem.parameter("push", Rule::Given);
    problem
        .support("top", 1, Motion::Driven(push, -1.0))
        .unwrap();
    // The upper right corner goes to the other side of the cell.
    let corner = problem
        .mesh
        .points
        .iter()
        .position(|x| x[..2] == [2.0, 1.0]);
    problem.mesh.points[corner.unwrap()] = [0.2, 0.5, 0.0];
    let failure = fails(problem, &[0.1], "orientation of that cell");
    let Reason::Inverted(cell) = failure.reason else {
        panic!("{failure}");
    };
    assert!(cell.undeformed && cell.cell == 1, "{cell}");
    // Of the right cell.
    assert!(cell.place[0] > 1.0 && cell.place[0] < 2.0, "{cell}");
}

#[test]
fn a_law_that_softens_is_named_with_place_and_stretch() {
    // Stable to a stretch of 1.91 in pure shear, less under the pressure of a bonded face.
    let law = Law::Yeoh {
        c10: 1e5,
        c20: -1e4,
        c30: 0.0,
    };
    let material = Material::new(law, Volumetric::Incompressible).unwrap();
    let mut problem = rectangle([1.0, 1.0], [4, 4], material);
    problem.clamp("bottom").unwrap();
    problem.support("top", 0, Motion::Fixed).unwrap();
    let pull = problem.parameter("pull", Rule::Given);
    problem
        .support("top", 1, Motion::Driven(pull, 1.0))
        .unwrap();
    let failure = fails(problem, &[4.0], "a law that stiffens");
    let Reason::LostEllipticity {
        stretch,
        ref region,
        ..
    } = failure.reason
    else {
        panic!("{failure}");
    };
    assert_eq!(region, "rubber");
    assert!(stretch > 1.5 && stretch < 2.5, "{failure}");
}

#[test]
fn a_closed_body_that_keeps_its_volume_has_no_room() {
    let mut problem = rectangle([1.0, 1.0], [3, 3], rubber());
    for side in ["left", "right"] {
        problem.support(side, 0, Motion::Fixed).unwrap();
    }
    problem.support("bottom", 1, Motion::Fixed).unwrap();
    let push = problem.parameter("push", Rule::Given);
    problem
        .support("top", 1, Motion::Driven(push, -1.0))
        .unwrap();
    let failure = fails(problem, &[0.05], "bulk modulus");
    assert!(matches!(failure.reason, Reason::Volume { .. }), "{failure}");
    assert!(failure.fraction < 1e-3, "{failure}");
}

#[test]
fn a_cavity_ends_before_its_walls_pass_through_each_other() {
    // Half of a slit of height 0.2, and its plane of symmetry below.
    let mut problem = rectangle([1.0, 0.4], [8, 3], rubber());
    for point in &mut problem.mesh.points {
        point[1] += 0.1;
    }
    problem.clamp("left").unwrap();
    problem.clamp("right").unwrap();
    let inside = Quantity::Volume(0);
    let pressure = problem.parameter("pressure", Rule::Prescribes(inside));
    problem.cavities.push(Cavity {
        wall: problem.surface("bottom").unwrap(),
        axis: 1,
        origin: 0.0,
        pressure,
    });
    let failure = fails(problem, &[-0.02], "pass through each other");
    let Reason::CavityCrossed { cavity, share } = failure.reason else {
        panic!("{failure}");
    };
    assert!(cavity == 0 && share <= 0.0, "{failure}");
    // From 0.1 to -0.02 the volume is zero at five sixths.
    let zero = 5.0 / 6.0;
    let near = failure.fraction < zero && failure.fraction > zero - 2e-3;
    assert!(near, "{failure}");
}

#[test]
fn a_column_that_buckles_is_told_from_a_wrong_tangent() {
    // Clamped below, pressed from above by a force that keeps its direction, beyond Euler's.
    let mut problem = rectangle([1.0, 12.0], [2, 12], rubber());
    problem.clamp("bottom").unwrap();
    let load = problem.parameter("load", Rule::Given);
    let surface = problem.surface("top").unwrap();
    let forces = traction(&problem.mesh, problem.kinematics, &surface, |_| {
        [0.0, -1.0, 0.0]
    });
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: load,
    });
    // pi^2 E I / (4 L^2) with the plane-strain modulus 4 G: 0.0057 of G.
    let failure = fails(problem, &[0.02], "control by displacement");
    let Reason::Unstable { mode: Some(mode) } = failure.reason else {
        panic!("{failure}");
    };
    // The free end goes aside.
    assert!(
        mode.place[1] == 12.0 && mode.direction[0].abs() > 0.95,
        "{failure}"
    );
    assert!((0.2..0.5).contains(&failure.fraction), "{failure}");
}

#[test]
fn a_part_that_only_a_contact_could_hold_is_named() {
    // A block over a plane that it does not reach, pressed by a force.
    let mut problem = rectangle([1.0, 1.0], [2, 2], rubber());
    problem.support("left", 0, Motion::Fixed).unwrap();
    let load = problem.parameter("load", Rule::Given);
    let surface = problem.surface("top").unwrap();
    let forces = traction(&problem.mesh, problem.kinematics, &surface, |_| {
        [0.0, -1.0, 0.0]
    });
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: load,
    });
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("bottom").unwrap(),
        shape: Shape::HalfSpace {
            point: [0.0, -0.1, 0.0],
            normal: [0.0, 1.0, 0.0],
        },
        travel: None,
        stiffness: 100.0,
        friction: 0.0,
        overlap_limit: 1e-4,
    }));
    let failure = fails(problem, &[0.1], "only a contact could hold the body");
    let Reason::HeldByContact(ref part) = failure.reason else {
        panic!("{failure}");
    };
    assert_eq!(part.motions, [FreeMotion::Translation([0.0, 1.0, 0.0])]);
    // One that rests on the plane is held from the start.
    assert!(failure.to_string().contains("begin with the part in touch"));
}

#[test]
fn a_part_that_slides_is_named_with_its_motion() {
    let axis = |from: f64, to: f64, cells: usize| Axis::uniform(from, to, cells).unwrap();
    let lower = Grid2::new([axis(0.0, 20.0, 9), axis(-5.0, 0.0, 3)], "rubber");
    let upper = Grid2::new([axis(5.0, 13.0, 5), axis(0.0, 4.0, 3)], "rubber");
    let (lower, upper) = (lower.mesh().unwrap(), upper.mesh().unwrap());
    let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |_| false);
    // Pressed by a way on smooth surfaces or by a load on rough ones, and pulled by more than they hold.
    for (friction, targets) in [
        (0.0, [[0.1, 0.0], [0.1, 0.02]]),
        (0.3, [[0.05, 0.0], [0.05, 0.05]]),
    ] {
        let mut problem = Problem::new(mesh.clone(), Kinematics::PlaneStrain).unwrap();
        problem.materials = vec![rubber(); 2];
        problem.clamp("lower_bottom").unwrap();
        let press = problem.parameter("press", Rule::Given);
        let pull = problem.parameter("pull", Rule::Given);
        let mut load = |name: &str, direction: [f64; 3], parameter| {
            let surface = problem.surface(name).unwrap();
            let forces = traction(&problem.mesh, problem.kinematics, &surface, |_| direction);
            problem.dead_loads.push(DeadLoad { forces, parameter });
        };
        load("upper_left", [1.0, 0.0, 0.0], pull);
        if friction == 0.0 {
            problem
                .support("upper_top", 1, Motion::Driven(press, -1.0))
                .unwrap();
        } else {
            load("upper_top", [0.0, -1.0, 0.0], press);
        }
        let surfaces = ["upper_bottom", "lower_top"].map(|name| problem.surface(name).unwrap());
        let mut pair = SurfacePair::new(&problem.mesh, surfaces, 1.0);
        pair.friction = friction;
        problem.contacts.push(Contact::Surfaces(pair));
        let mut solver = Solver::new(problem).unwrap();
        let ended: Result<Vec<()>, Failure> = targets
            .iter()
            .map(|targets| solver.load_to(targets, |_, _| Continue::Yes))
            .collect();
        let Err(failure) = ended else {
            panic!("{friction}: it is held");
        };
        let Reason::HeldByContact(ref part) = failure.reason else {
            panic!("{friction}: {failure}");
        };
        assert_eq!(part.motions, [FreeMotion::Translation([1.0, 0.0, 0.0])]);
        let named = part.region.as_ref().map(|part| part.0.as_str());
        assert_eq!(named, Some("upper_rubber"), "{failure}");
        if friction > 0.0 {
            // Its load times the friction over its left side.
            let held = 0.3 * 0.05 * 8.0 / (0.05 * 4.0);
            assert!((failure.fraction / held - 1.0).abs() < 0.02, "{failure}");
        }
    }
}

#[test]
fn a_part_of_several_that_nothing_holds_is_named() {
    let axis = || Axis::uniform(0.0, 1.0, 1).unwrap();
    let lower = Grid2::new([axis(), axis()], "rubber").mesh().unwrap();
    let mut upper = lower.clone();
    for point in &mut upper.points {
        point[1] += 1.5;
    }
    let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |_| false);
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials = vec![rubber(); 2];
    problem.clamp("lower_bottom").unwrap();
    fails(problem, &[], "the part \"upper_rubber\" of the body");
}

/// A block pressed by a ball beside its middle in one step, with a contact of this stiffness.
fn pressed_in_one_step(stiffness: f64, iterations: usize) -> Result<(), Failure> {
    let mut problem = rectangle([2.0, 1.0], [8, 4], rubber());
    problem.clamp("bottom").unwrap();
    let depth = problem.parameter("depth", Rule::Given);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("top").unwrap(),
        shape: Shape::Sphere {
            centre: [1.03, 2.0, 0.0],
            radius: 1.0,
        },
        travel: Some(([0.0, -1.0, 0.0], depth)),
        stiffness,
        friction: 0.0,
        overlap_limit: 1e-4,
    }));
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 1.0;
    solver.settings.smallest_step = 0.5;
    solver.settings.iterations = iterations;
    solver.load_to(&[0.2], |_, _| Continue::Yes)
}

#[test]
fn a_contact_that_chatters_is_named_with_its_point() {
    // Far too stiff: each change flips the set of touching points.
    let failure = pressed_in_one_step(1e7, 14).unwrap_err();
    let Reason::Chatter { contact, place, .. } = failure.reason else {
        panic!("{failure}");
    };
    assert!(contact == 0 && place[1] == 1.0, "{failure}");
    assert!((place[0] - 1.03).abs() < 0.65, "{failure}");
    let text = failure.to_string();
    for part in ["touches in one iteration", "Lower the contact stiffness"] {
        assert!(text.contains(part), "{text}");
    }
    // What the sentence says helps.
    pressed_in_one_step(1e3, 30).unwrap();
}

#[test]
fn constraints_and_rigid_bodies_that_say_two_things_are_named() {
    let block = || {
        let mut problem = rectangle([2.0, 1.0], [2, 1], rubber());
        problem.clamp("bottom").unwrap();
        problem
    };
    let follow = |dependent, leader| Constraint {
        dependent: (dependent, 0),
        terms: vec![((leader, 0), 1.0)],
        drive: Vec::new(),
    };
    let of = |problem: &Problem, name: &str| problem.mesh.nodes_of(name).unwrap();
    let [first, second, third] = of(&block(), "top")[..3] else {
        panic!("three nodes");
    };
    // One component that follows two.
    let mut problem = block();
    problem.constraints = vec![follow(first, second), follow(first, third)];
    let failure = fails(
        problem,
        &[],
        "constraint 1 contradicts constraint 0: component 0",
    );
    assert!(
        matches!(failure.reason, Reason::Problem(ProblemError::GivenTwice { node, .. }) if node == first),
        "{failure}"
    );
    // Twice the same is no mistake, nor is what follows from a support.
    let mut problem = block();
    let below = of(&problem, "bottom");
    problem.constraints = vec![
        follow(first, second),
        follow(first, second),
        follow(below[0], below[1]),
    ];
    problem.check().unwrap();
    // A support that holds what follows.
    let mut problem = block();
    problem.constraints = vec![follow(below[0], first)];
    fails(
        problem,
        &[],
        "constraint 0 contradicts a support: component 0",
    );
    // One that goes round.
    let mut problem = block();
    problem.constraints = vec![
        follow(first, second),
        follow(second, third),
        follow(third, first),
    ];
    fails(problem, &[], "goes round");
    let mut problem = block();
    problem.constraints = vec![follow(first, u32::MAX)];
    fails(problem, &[], "there is no node number 4294967295");
    let mut problem = block();
    problem.constraints = vec![follow(first, second)];
    problem.constraints[0].terms[0].1 = f64::NAN;
    fails(problem, &[], "a factor of constraint 0 is NaN");
    // Rigid bodies that share a node, with each other, a support, a constraint.
    let rigid = |problem: &mut Problem, name: &str| {
        let body = problem.rigid_body(name, None).unwrap();
        problem.rigid_bodies.push(body);
    };
    let mut problem = block();
    rigid(&mut problem, "top");
    rigid(&mut problem, "left");
    fails(problem, &[], "belongs to rigid body 1 and to rigid body 0");
    let mut problem = block();
    let push = problem.parameter("push", Rule::Given);
    rigid(&mut problem, "left");
    problem.rigid_bodies[0].travel[0] = Motion::Driven(push, 1.0);
    fails(
        problem,
        &[0.1],
        "belongs to rigid body 0 and to a support (fixed in component 0)",
    );
    let mut problem = block();
    rigid(&mut problem, "top");
    problem.constraints = vec![follow(below[0], first)];
    fails(problem, &[], "belongs to rigid body 0 and to constraint 0");
    let mut problem = block();
    problem
        .rigid_bodies
        .push(RigidBody::new(Vec::new(), [0.0; 3]));
    fails(problem, &[], "rigid body 0 has no nodes");
    // Faces that do not match.
    let mut problem = block();
    let error = problem.periodic(["left", "top"], &[]).unwrap_err();
    assert!(error.to_string().contains("opposite"), "{error}");
}

#[test]
fn a_rigid_body_that_may_turn_with_the_whole_is_named() {
    // A free block between a plate that may turn and nothing else.
    let mut problem = rectangle([1.0, 1.0], [2, 2], rubber());
    let mut plate = problem.rigid_body("top", None).unwrap();
    let turn = problem.free_parameter("turn");
    plate.turn[2] = Motion::Driven(turn, 1.0);
    problem.rigid_bodies.push(plate.clone());
    let failure = fails(problem, &[0.0], "rotation about");
    let Reason::Problem(ProblemError::NotFixed(part)) = failure.reason else {
        panic!("{failure}");
    };
    let [FreeMotion::Rotation { through, .. }] = part.motions[..] else {
        panic!("{part}");
    };
    // About the point of the plate, the middle of the upper side.
    assert!((through[0] - 0.5).abs() < 1e-12 && (through[1] - 1.0).abs() < 1e-12);
    // Held against turning it is held as a whole.
    let mut problem = rectangle([1.0, 1.0], [2, 2], rubber());
    plate.turn[2] = Motion::Fixed;
    problem.rigid_bodies.push(plate);
    problem.check().unwrap();
}

#[test]
fn a_surface_that_leaps_over_the_reach_of_its_contact_is_named() {
    // A block that is carried 0.3 aside in one step, over another one that looks 0.1 far.
    let axis = |from: f64, to: f64, cells| Axis::uniform(from, to, cells).unwrap();
    let lower = Grid2::new([axis(0.0, 3.0, 6), axis(0.0, 1.0, 2)], "rubber")
        .mesh()
        .unwrap();
    let upper = Grid2::new([axis(0.0, 1.0, 2), axis(1.0, 2.0, 2)], "rubber")
        .mesh()
        .unwrap();
    let mesh = Mesh::joined(&[("lower", &lower), ("upper", &upper)], |_| false);
    let carried = |smallest_step: f64| {
        let mut problem = Problem::new(mesh.clone(), Kinematics::PlaneStrain).unwrap();
        problem.materials = vec![rubber(); 2];
        problem.clamp("lower_bottom").unwrap();
        let aside = problem.parameter("aside", Rule::Given);
        problem
            .support("upper_top", 0, Motion::Driven(aside, 1.0))
            .unwrap();
        problem.support("upper_top", 1, Motion::Fixed).unwrap();
        let surfaces = ["upper_bottom", "lower_top"].map(|name| problem.surface(name).unwrap());
        let mut pair = SurfacePair::new(&problem.mesh, surfaces, 1.0);
        pair.reach = 0.1;
        problem.contacts.push(Contact::Surfaces(pair));
        let mut solver = Solver::new(problem).unwrap();
        solver.settings.first_step = 1.0;
        solver.settings.smallest_step = smallest_step;
        solver.load_to(&[0.3], |_, _| Continue::Yes)
    };
    let failure = carried(0.5).unwrap_err();
    let Reason::Leapt {
        contact,
        way,
        reach,
    } = failure.reason
    else {
        panic!("{failure}");
    };
    assert!(
        contact == 0 && reach == 0.1 && (way - 0.3).abs() < 1e-9,
        "{failure}"
    );
    assert!(failure.to_string().contains("a larger reach"), "{failure}");
    // What the sentence says helps.
    carried(0.1).unwrap();
}

/// A block on a wider, stiff base, half of it, with pressure on its top that ends at the free side
/// face; the side face may touch the base.
fn block_on_base(cells: usize, touches: bool) -> Solver {
    let axis = |from, to, cells| Axis::uniform(from, to, cells).unwrap();
    let block = Grid2::new([axis(0.0, 1.0, cells), axis(0.0, 1.0, cells)], "rubber");
    let base = Grid2::new(
        [axis(0.0, 2.0, 2 * cells), axis(-0.5, 0.0, cells / 2)],
        "rubber",
    );
    let (block, base) = (block.mesh().unwrap(), base.mesh().unwrap());
    let bodies = [("block", &block), ("base", &base)];
    let mesh = Mesh::joined(&bodies, |x| x[1] == 0.0 && x[0] <= 1.0);
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    let stiff = Material::new(Law::neo_hookean(100.0), Volumetric::Incompressible).unwrap();
    problem.materials = vec![rubber(), stiff];
    problem.clamp("base_bottom").unwrap();
    for side in ["block_left", "base_left"] {
        problem.support(side, 0, Motion::Fixed).unwrap();
    }
    let parameter = problem.parameter("pressure", Rule::Given);
    let surface = problem.surface("block_top").unwrap();
    problem.pressures.push(Pressure { surface, parameter });
    if touches {
        let surfaces = ["block_right", "base_top"].map(|name| problem.surface(name).unwrap());
        let pair = SurfacePair::new(&problem.mesh, surfaces, 1.0);
        problem.contacts.push(Contact::Surfaces(pair));
    }
    Solver::new(problem).unwrap()
}

#[test]
fn a_foot_that_folds_onto_its_base_is_no_limit_of_the_load() {
    // The side face goes through the base at the corner of the foot, and the cell there turns
    // inside out. Then the load may turn, too; but where depends on the mesh: it is no limit.
    let ends = [4, 8].map(|cells| {
        let mut solver = block_on_base(cells, false);
        let failure = solver.load_to(&[6.0], |_, _| Continue::Yes).unwrap_err();
        let (Reason::CellGivesWay(least)
        | Reason::NotConverged {
            inside_out: Some(least),
            ..
        }) = failure.reason
        else {
            panic!("{failure}");
        };
        let [x, y, _] = least.place;
        assert!((x - 1.0).abs() < 0.1 && y.abs() < 0.1, "{failure}");
        let text = failure.to_string();
        let cell = format!("cell {} is inside out between its points", least.cell);
        for part in [&cell, "that fold onto each other there a contact"] {
            assert!(text.contains(part), "{text}");
        }
        // The lowest node of the side face has gone through the top of the base.
        let mesh = &solver.problem().mesh;
        let side = mesh.nodes_of("block_right").unwrap().into_iter();
        let side = side.filter(|&node| mesh.points[node as usize][1] > 0.0);
        let height = |node: u32| {
            mesh.points[node as usize][1] + solver.state().displacement[node as usize][1]
        };
        assert!(side.map(height).fold(f64::INFINITY, f64::min) < -0.01);
        solver.state().parameters[0]
    });
    assert!(ends[0] > 1.1 * ends[1], "{ends:?}");
    // What the sentence says helps.
    let mut solver = block_on_base(8, true);
    let farther = 1.3 * ends[1];
    let ended = solver.load_to(&[6.0], |state, _| {
        if state.parameters[0] > farther {
            Continue::Stop
        } else {
            Continue::Yes
        }
    });
    ended.unwrap();
}

#[test]
fn a_load_that_turns_is_told_as_a_limit() {
    // A hollow sphere whose wall is a fifth of its middle radius.
    let mut problem = rectangle([1.0, 1.0], [2, 8], rubber());
    problem.kinematics = Kinematics::Axisymmetric;
    for point in &mut problem.mesh.points {
        let (angle, radius) = (std::f64::consts::FRAC_PI_2 * point[1], 0.9 + 0.2 * point[0]);
        *point = [radius * angle.cos(), radius * angle.sin(), 0.0];
    }
    problem.support("bottom", 1, Motion::Fixed).unwrap();
    problem.support("top", 0, Motion::Fixed).unwrap();
    let parameter = problem.parameter("pressure", Rule::Given);
    let surface = problem.surface("left").unwrap();
    problem.pressures.push(Pressure { surface, parameter });
    let mut solver = Solver::new(problem).unwrap();
    let failure = solver.load_to(&[0.5], |_, _| Continue::Yes).unwrap_err();
    assert!(matches!(failure.reason, Reason::Limit { .. }), "{failure}");
    // Greatest of 2 (1/b - 1/a) + (1/b^4 - 1/a^4) / 2 with b^3 - 1 = (a^3 - 1) (0.9/1.1)^3.
    let ratio = (0.9_f64 / 1.1).powi(3);
    let pressure = |a: f64| {
        let b = (1.0 + (a.powi(3) - 1.0) * ratio).cbrt();
        2.0 * (1.0 / b - 1.0 / a) + 0.5 * (b.powi(-4) - a.powi(-4))
    };
    let greatest = (1000..2000).map(|k| pressure(f64::from(k) / 1000.0));
    let greatest = greatest.fold(0.0, f64::max);
    let reached = solver.state().parameters[0];
    assert!(
        (reached / greatest - 1.0).abs() < 2e-3,
        "{reached} {greatest}"
    );
    // Where it was, it still is: the search beyond leaves nothing.
    assert!(solver.targets() == [reached]);
    solver
        .load_to(&[0.5 * reached], |_, _| Continue::Yes)
        .unwrap();
}

/// A tube on a rough plate, pressed by 2 mm and about to be rolled (mm and kPa).
fn pressed_tube() -> Solver {
    pressed_tubes(&[0.5])
}

/// Tubes beside each other, each on a plate of its own friction.
fn pressed_tubes(frictions: &[f64]) -> Solver {
    let mesh = include_str!("../../taxel-bodies/tests/bodies/tube.msh");
    let mesh = gmsh::read(mesh).unwrap();
    let names: Vec<String> = (0..frictions.len()).map(|k| format!("tube{k}")).collect();
    let parts: Vec<(&str, &Mesh)> = names.iter().map(|name| (name.as_str(), &mesh)).collect();
    let mesh = Mesh::joined(&parts, |_| false);
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    let solid = Material::incompressible(Law::neo_hookean(60.0));
    problem.materials = vec![solid; problem.mesh.regions.len()];
    for (name, component, sign) in [("press", 1, -1.0), ("slide", 0, 1.0)] {
        let parameter = problem.parameter(name, Rule::Given);
        let motion = Motion::Driven(parameter, sign);
        for tube in &names {
            problem
                .support(&format!("{tube}_crown"), component, motion)
                .unwrap();
        }
    }
    for (tube, &friction) in names.iter().zip(frictions) {
        let surface = problem.surface(&format!("{tube}_skin")).unwrap();
        let side = problem.mesh.mean_side(&surface);
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface,
            shape: Shape::HalfSpace {
                point: [0.0; 3],
                normal: [0.0, 1.0, 0.0],
            },
            travel: None,
            stiffness: 3000.0 / side,
            friction,
            overlap_limit: 1e-4 * side,
        }));
    }
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[2.0, 0.0], |_, _| Continue::Yes).unwrap();
    solver
}

#[test]
fn a_body_that_loses_its_equilibrium_on_a_rough_plate_jumps_or_stops() {
    let mut solver = pressed_tube();
    solver.settings.jump_steps = 0;
    // A longer step may fall on a state beyond by itself.
    solver.settings.largest_step = 0.1;
    let failure = solver.load_to(&[2.0, 0.5], |_, _| Continue::Yes);
    let failure = failure.unwrap_err();
    assert!(
        matches!(failure.reason, Reason::NotConverged { .. }),
        "{failure}"
    );
    // Without a state beyond, it stays at the last one before.
    let slid = solver.state().parameters[1];

    assert!((0.2..0.4).contains(&slid), "{slid}");
    let press = solver.contact(0).force()[1];
    solver.settings.jump_steps = 200;
    let mut jumps = Vec::new();
    let mut hear = |_: &_, step: &Step| {
        jumps.extend(step.jump);
        Continue::Yes
    };
    solver.load_to(&[2.0, slid + 1e-3], &mut hear).unwrap();
    let [jump] = jumps[..] else {
        panic!("{jumps:?}");
    };
    // Far, over the thousandth of a millimetre that the crown went, and to a softer state.
    assert!((0.2..1.0).contains(&jump.way), "{jump:?}");
    let after = solver.contact(0).force()[1];
    assert!(after < 0.95 * press, "{after} {press}");
    // It is an equilibrium, and no other one is nearer.
    let found = solver.state().displacement.clone();
    solver.settle().unwrap();
    let ways = found.iter().zip(&solver.state().displacement);
    let off = ways.flat_map(|(a, b)| [0, 1].map(|d| (a[d] - b[d]).abs()));
    let off = off.fold(0.0, f64::max);
    assert!(off < 1e-4, "{off}");
}

#[test]
fn a_body_that_jumps_again_and_again_ends_with_that() {
    // Each of two tubes folds once on its way.
    let jumps = |most: usize| {
        let mut solver = pressed_tubes(&[0.5, 0.45]);
        solver.settings.largest_step = 0.1;
        solver.settings.jumps = most;
        let mut jumps = 0;
        let mut hear = |_: &_, step: &Step| {
            jumps += usize::from(step.jump.is_some());
            Continue::Yes
        };
        let ended = solver.load_to(&[2.0, 0.6], &mut hear);
        (jumps, ended)
    };
    let (all, ended) = jumps(100);
    assert!(ended.is_ok() && all >= 2, "{all} {ended:?}");
    let (first, ended) = jumps(1);
    let failure = ended.unwrap_err();
    assert!(
        matches!(failure.reason, Reason::KeepsJumping { jumps: 1, .. }),
        "{failure}"
    );
    assert_eq!(first, 1);
    assert!(failure.fraction > 0.0 && failure.fraction < 1.0);
}

#[test]
fn a_request_to_stop_is_heard_in_every_iteration_of_a_jump() {
    let mut solver = pressed_tube();
    solver.settings.jump_steps = 0;
    solver.settings.largest_step = 0.1;
    solver
        .load_to(&[2.0, 0.5], |_, _| Continue::Yes)
        .unwrap_err();
    solver.settings.jump_steps = 200;
    let (state, targets) = (solver.state().clone(), solver.targets().to_vec());
    let beyond = [2.0, targets[1] + 1e-3];
    // The whole way: cut steps, then creep.
    let asked = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&asked);
    solver.stop_when(move || {
        count.fetch_add(1, Ordering::Relaxed);
        false
    });
    let mut jumped = false;
    let mut hear = |_: &_, step: &Step| {
        jumped |= step.jump.is_some();
        Continue::Yes
    };
    solver.load_to(&beyond, &mut hear).unwrap();
    assert!(jumped);
    let all = asked.load(Ordering::Relaxed);
    for after in [all / 2, all - 1] {
        solver.restart(state.clone(), targets.clone());
        let (before, left) = (solver.iterations, AtomicUsize::new(after));
        // It does not change its mind.
        let less = |left: usize| left.checked_sub(1);
        solver.stop_when(move || {
            let order = Ordering::Relaxed;
            left.fetch_update(order, order, less).is_err()
        });
        let mut last = state.clone();
        let mut hear = |state: &State, _: &Step| {
            last.clone_from(state);
            Continue::Yes
        };
        let failure = solver.load_to(&beyond, &mut hear).unwrap_err();
        assert_eq!(failure.reason, Reason::Stopped, "{failure}");
        assert_eq!(solver.iterations - before, after);
        assert_eq!(solver.state(), &last);
    }
}

/// Half of a shallow arch, three times as high as thick, clamped at its foot and loaded on its crown;
/// the load, and the node of the crown.
fn shallow_arch() -> (Problem, Parameter, u32) {
    let mut problem = rectangle([10.0, 0.5], [20, 2], rubber());
    for point in &mut problem.mesh.points {
        point[1] += 0.75 * (1.0 + (0.1 * std::f64::consts::PI * point[0]).cos());
    }
    problem.clamp("right").unwrap();
    problem.support("left", 0, Motion::Fixed).unwrap();
    let parameter = problem.parameter("load", Rule::Given);
    let surface = problem.surface("left").unwrap();
    let forces = traction(&problem.mesh, problem.kinematics, &surface, |_| {
        [0.0, -1.0, 0.0]
    });
    problem.dead_loads.push(DeadLoad { forces, parameter });
    let mut points = problem.mesh.points.iter();
    let crown = points.position(|point| *point == [0.0, 2.0, 0.0]).unwrap();
    (problem, parameter, crown as u32)
}

/// Loads the arch; the greatest load before the first jump, and the jumps.
fn jumps(solver: &mut Solver, load: f64) -> Result<(f64, Vec<Jump>), Failure> {
    let (mut before, mut jumps) = (0.0_f64, Vec::new());
    solver.load_to(&[load], |state, step| {
        jumps.extend(step.jump);
        if jumps.is_empty() {
            before = before.max(state.parameters[0]);
        }
        Continue::Yes
    })?;
    Ok((before, jumps))
}

#[test]
fn an_arch_that_snaps_through_in_a_long_step_is_told_to_jump() {
    // Driven by the way of its crown it goes over its greatest load, and on under less.
    let (problem, parameter, crown) = shallow_arch();
    let mut driven = Solver::new(problem.clone()).unwrap();
    let way = Rule::Prescribes(Quantity::Displacement(crown, 1));
    driven.set_rule(parameter, way).unwrap();
    driven.settings.largest_step = 0.02;
    let (mut limit, mut low) = (0.0_f64, f64::INFINITY);
    let seen = driven.load_to(&[-3.5], |state, step| {
        assert_eq!(step.jump, None);
        let load = state.parameters[0];
        if load > limit && low == f64::INFINITY {
            limit = load;
        } else {
            low = low.min(load);
        }
        Continue::Yes
    });
    seen.unwrap();
    assert!(low < 0.8 * limit);
    // By its load it stops at that limit, or jumps there and says so, as its steps fall.
    let mut jumped = 0;
    for times in [1.2, 4.0] {
        for first in [0.1, 0.5, 1.0] {
            let mut solver = Solver::new(problem.clone()).unwrap();
            solver.settings.first_step = first;
            let (_, none) = jumps(&mut solver, 0.95 * limit).unwrap();
            assert_eq!(none, [], "{first} {times}");
            solver.restart(State::rest(&problem), vec![0.0]);
            let (before, jumps) = match jumps(&mut solver, times * limit) {
                Ok(way) => way,
                Err(failure) => {
                    assert!(matches!(failure.reason, Reason::Limit { .. }), "{failure}");
                    (failure.parameters[0].1, Vec::new())
                }
            };
            assert!((before / limit - 1.0).abs() < 2e-3, "{before} {limit}");
            let [jump] = jumps[..] else {
                assert_eq!(jumps, []);
                assert!(solver.state().parameters[0] <= 1.002 * limit);
                continue;
            };
            jumped += 1;
            assert!(jump.way > 1.5 && jump.place[0] < 3.0, "{jump:?}");
            let moved = solver.state().displacement[crown as usize][1];
            driven.load_to(&[moved], |_, _| Continue::Yes).unwrap();
            let load = driven.state().parameters[0];
            assert!((load / (times * limit) - 1.0).abs() < 1e-6, "{load}");
        }
    }
    assert!(jumped > 0);
    // Who allows no jump hears of the limit.
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.first_step = 1.0;
    solver.settings.jump_steps = 0;
    let failure = jumps(&mut solver, 1.2 * limit).unwrap_err();
    assert!(matches!(failure.reason, Reason::Limit { .. }), "{failure}");
}
