//! Behaviour of the solver beside elastic loading: memory, friction, limit points,
//! restart, and failures that say why.
#![allow(clippy::unwrap_used)]

use taxel_fem::material::viscoelastic::{PronyTerm, Relaxation};
use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, Grading, Grid2, Growth, Mesh};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::load::traction;
use taxel_fem::problem::{
    Cavity, Contact, DeadLoad, FreeMotion, FreePart, Motion, Obstacle, Parameter, Pressure,
    Problem, ProblemError, Quantity, Rule, Shape, SurfacePair,
};
use taxel_fem::solver::failure::Reason;
use taxel_fem::solver::newton::{Continue, Multipliers, Solver};

const RUBBER: Material = Material::incompressible(Law::MooneyRivlin { c10: 0.5, c01: 0.0 });

/// A rectangle of unit thickness from the origin, shear modulus 1.
fn rectangle(size: [f64; 2], cells: [usize; 2]) -> Problem {
    let axes = [
        Axis::uniform(0.0, size[0], cells[0]).unwrap(),
        Axis::uniform(0.0, size[1], cells[1]).unwrap(),
    ];
    let mesh = Grid2::new(axes, "rubber").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials.push(RUBBER);
    problem
}

#[test]
fn a_held_body_relaxes_by_its_series() {
    let relaxation = Relaxation::new(&[
        PronyTerm {
            fraction: 0.3,
            time: 1.0,
        },
        PronyTerm {
            fraction: 0.2,
            time: 10.0,
        },
    ])
    .unwrap();
    let mut problem = rectangle([1.0, 1.0], [2, 2]);
    problem.relaxations = vec![Some(relaxation.clone())];
    problem.support("left", 0, Motion::Fixed).unwrap();
    problem.support("bottom", 1, Motion::Fixed).unwrap();
    let pull = problem.parameter("pull", Rule::Given);
    problem
        .support("top", 1, Motion::Driven(pull, 1.0))
        .unwrap();
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[0.5], |_, _| Continue::Yes).unwrap();
    // Plane strain, stretch 1.5: P = l - l^-3.
    let sudden = solver.evaluate().unwrap().along[0];
    assert!((sudden - (1.5 - 1.5_f64.powi(-3))).abs() < 1e-8, "{sudden}");
    let mut time = 0.0;
    for wait in [0.1, 0.9, 4.0, 30.0] {
        solver
            .load_over(wait, &[0.5], |_, _| Continue::Yes)
            .unwrap();
        time += wait;
        let force = solver.evaluate().unwrap().along[0];
        let exact = sudden * relaxation.remaining(time);
        assert!((force / exact - 1.0).abs() < 1e-8, "{time} {force} {exact}");
    }
}

#[test]
fn a_block_sticks_and_then_slides_on_a_rough_plane() {
    let mut problem = rectangle([4.0, 1.0], [4, 1]);
    let press = problem.parameter("press", Rule::Given);
    let drag = problem.parameter("drag", Rule::Given);
    problem
        .support("top", 1, Motion::Driven(press, -1.0))
        .unwrap();
    problem
        .support("top", 0, Motion::Driven(drag, 1.0))
        .unwrap();
    let surface = problem.surface("bottom").unwrap();
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface,
        shape: Shape::HalfSpace {
            point: [0.0; 3],
            normal: [0.0, 1.0, 0.0],
        },
        travel: None,
        stiffness: 200.0,
        friction: 0.3,
        overlap_limit: 1e-3,
    }));
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[0.05, 0.0], |_, _| Continue::Yes).unwrap();
    let mut last = 0.0;
    let mut pulls = Vec::new();
    for step in 1..=4 {
        solver
            .load_to(&[0.05, 0.2 * f64::from(step)], |_, _| Continue::Yes)
            .unwrap();
        let along = solver.evaluate().unwrap().along;
        let ratio = along[1] / along[0];
        assert!(ratio <= 0.3 + 1e-6, "{ratio}");
        assert!(ratio >= last - 1e-3, "{ratio} after {last}");
        last = ratio;
        pulls.push(ratio);
    }
    // It sticks at first (elastic shear) and slides as a whole at the end.
    assert!(pulls[0] < 0.28, "{pulls:?}");
    assert!((last - 0.3).abs() < 1e-6, "{pulls:?}");
    let overlap = solver.contact(0).overlap;
    assert!(overlap <= 1e-3, "{overlap}");
}

/// A thin ring under inner pressure (plane strain cylinder has no maximum; a balloon
/// does): quarter of a sphere, axisymmetric, as a bent grid.
fn balloon(thickness: f64) -> Problem {
    let axes = [
        Axis::uniform(0.0, 1.0, 1).unwrap(),
        Axis::uniform(0.0, 1.0, 12).unwrap(),
    ];
    let mut mesh = Grid2::new(axes, "rubber").mesh().unwrap();
    for point in &mut mesh.points {
        let angle = std::f64::consts::FRAC_PI_2 * point[1];
        let radius = 1.0 + thickness * (point[0] - 0.5);
        *point = [radius * angle.cos(), radius * angle.sin(), 0.0];
    }
    let mut problem = Problem::new(mesh, Kinematics::Axisymmetric).unwrap();
    problem.materials.push(RUBBER);
    problem.support("bottom", 1, Motion::Fixed).unwrap();
    problem.support("top", 0, Motion::Fixed).unwrap();
    problem
}

#[test]
fn arc_length_and_volume_go_over_the_limit_point_of_a_balloon() {
    // p r0 / (G t0) = 2 (l^-1 - l^-7): greatest 1.2394629 at l = 7^(1/6).
    let thickness = 0.01;
    for by_arc in [false, true] {
        let mut problem = balloon(thickness);
        let inside = problem.parameter("pressure", Rule::Given);
        let wall = problem.surface("left").unwrap();
        problem.cavities.push(Cavity {
            wall,
            axis: 0,
            origin: 0.0,
            pressure: inside,
        });
        let quantity = if by_arc {
            Quantity::Arc(1.0)
        } else {
            Quantity::Volume(0)
        };
        problem.set_rule(inside, Rule::Prescribes(quantity));
        let mut solver = Solver::new(problem).unwrap();
        solver.settings.first_step = 0.02;
        solver.settings.largest_step = 0.05;
        let rest = solver.targets()[0];
        let goal = if by_arc { 6.0 } else { 6.0 * rest };
        let mut path = Vec::new();
        solver
            .load_to(&[goal], |state, _| {
                path.push(state.parameters[0] / thickness);
                Continue::Yes
            })
            .unwrap();
        let highest = path.iter().copied().fold(0.0, f64::max);
        assert!(
            (highest / 1.2394629 - 1.0).abs() < 3e-3,
            "{by_arc} {highest}"
        );
        assert!(
            *path.last().unwrap() < 0.97 * highest,
            "{by_arc}: beyond the maximum"
        );
    }
}

#[test]
fn a_load_beyond_the_limit_fails_with_its_reason_and_keeps_what_was_reached() {
    let mut problem = balloon(0.01);
    let inside = problem.parameter("pressure", Rule::Given);
    let wall = problem.surface("left").unwrap();
    problem.cavities.push(Cavity {
        wall,
        axis: 0,
        origin: 0.0,
        pressure: inside,
    });
    let mut solver = Solver::new(problem).unwrap();
    let failure = solver.load_to(&[0.013], |_, _| Continue::Yes).unwrap_err();
    assert!(
        failure.fraction > 0.9 && failure.fraction < 0.96,
        "{failure}"
    );
    assert_eq!(failure.parameters[0].0, "pressure");
    let text = failure.to_string();
    assert!(
        text.contains("last good state") && text.contains("control"),
        "{text}"
    );
    // What was reached stays, and the solution goes on from there.
    let reached = solver.state().parameters[0];
    assert!((reached / 0.013 - failure.fraction).abs() < 1e-9);
    let back = [0.5 * reached];
    solver.load_to(&back, |_, _| Continue::Yes).unwrap();
}

#[test]
fn a_restart_from_an_accepted_step_ends_at_the_same_state() {
    let pose = || {
        let mut problem = rectangle([2.0, 1.0], [4, 2]);
        problem.clamp("bottom").unwrap();
        let push = problem.parameter("push", Rule::Given);
        problem.support("top", 0, Motion::Fixed).unwrap();
        problem
            .support("top", 1, Motion::Driven(push, -1.0))
            .unwrap();
        Solver::new(problem).unwrap()
    };
    let mut whole = pose();
    let mut kept = None;
    whole
        .load_to(&[0.3], |state, step| {
            if step.fraction < 0.6 {
                kept = Some((state.clone(), 0.3 * step.fraction));
            }
            Continue::Yes
        })
        .unwrap();
    let (state, reached) = kept.unwrap();
    let mut second = pose();
    second.restart(state, vec![reached]);
    second.load_to(&[0.3], |_, _| Continue::Yes).unwrap();
    for (a, b) in whole
        .state()
        .displacement
        .iter()
        .zip(&second.state().displacement)
    {
        assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9);
    }
    // Stopping keeps the steps so far.
    let mut third = pose();
    third
        .load_to(&[0.3], |_, step| {
            if step.fraction > 0.3 {
                Continue::Stop
            } else {
                Continue::Yes
            }
        })
        .unwrap();
    assert!(third.state().parameters[0] > 0.09 && third.state().parameters[0] < 0.3);
}

#[test]
fn bodies_that_nothing_holds_and_solids_that_are_not_stable_are_refused() {
    let loose = rectangle([1.0, 1.0], [1, 1]);
    let failure = Solver::new(loose).err().unwrap();
    assert_eq!(
        failure.reason,
        Reason::Problem(ProblemError::NotFixed(FreePart {
            motions: vec![
                FreeMotion::Translation([1.0, 0.0, 0.0]),
                FreeMotion::Translation([0.0, 1.0, 0.0]),
                FreeMotion::Rotation {
                    axis: [0.0, 0.0, 1.0],
                    through: [0.5, 0.5, 0.0],
                },
            ],
            region: None,
        })),
        "{failure}"
    );
    // The message says all of them, and in which unit where.
    let mut reason = failure.reason;
    assert!(reason.scale(1e3));
    assert!(
        reason.to_string().contains(
            "translation in component 0 (x), and against translation in component 1 (y), and \
             against rotation about (0, 0, 1) through (500, 500, 0)"
        ),
        "{reason}"
    );

    let mut unstable = rectangle([1.0, 1.0], [1, 1]);
    unstable.clamp("bottom").unwrap();
    unstable.materials[0] = Material::incompressible(Law::MooneyRivlin {
        c10: 0.4326,
        c01: -0.841,
    });
    let failure = Solver::new(unstable).err().unwrap();
    assert!(failure.to_string().contains("rubber"), "{failure}");

    let mut unnamed = rectangle([1.0, 1.0], [1, 1]);
    let error = unnamed.clamp("ground").unwrap_err();
    assert!(error.to_string().contains("bottom"), "{error}");

    // Held against one motion only: the matrix is singular, and it is said.
    let mut sliding = rectangle([1.0, 1.0], [1, 1]);
    sliding.support("bottom", 1, Motion::Fixed).unwrap();
    sliding.mesh.node_sets.insert("corner".into(), Vec::new());
    sliding.support("corner", 0, Motion::Fixed).unwrap();
    let failure = match Solver::new(sliding) {
        Err(failure) => failure,
        Ok(mut solver) => solver.load_to(&[], |_, _| Continue::Yes).unwrap_err(),
    };
    assert!(failure.to_string().contains("support"), "{failure}");
}

#[test]
fn a_dead_load_and_its_control_by_force_agree() {
    // Uniform tension on the top of a free-sided block, found by displacement.
    let pose = |rule: Rule| {
        let mut problem = rectangle([1.0, 1.0], [2, 2]);
        problem.support("left", 0, Motion::Fixed).unwrap();
        problem.support("bottom", 1, Motion::Fixed).unwrap();
        let load = problem.parameter("load", rule);
        let surface = problem.surface("top").unwrap();
        let forces = traction(&problem.mesh, problem.kinematics, &surface, |_| {
            [0.0, 1.0, 0.0]
        });
        problem.dead_loads.push(DeadLoad {
            forces,
            parameter: load,
        });
        Solver::new(problem).unwrap()
    };
    let stretch = 1.4_f64;
    let nominal = stretch - stretch.powi(-3);
    let mut by_load = pose(Rule::Given);
    by_load.load_to(&[nominal], |_, _| Continue::Yes).unwrap();
    let top = by_load.problem().mesh.nodes_of("top").unwrap()[0];
    let rise = by_load.state().displacement[top as usize][1];
    assert!((rise - 0.4).abs() < 1e-8, "{rise}");
    let mut by_motion = pose(Rule::Prescribes(Quantity::Displacement(top, 1)));
    by_motion.load_to(&[0.4], |_, _| Continue::Yes).unwrap();
    assert!((by_motion.state().parameters[0] - nominal).abs() < 1e-8);
}

#[test]
fn wrong_input_is_refused_with_what_is_wrong() {
    let refused = |change: &dyn Fn(&mut Problem)| -> String {
        let mut problem = rectangle([1.0, 1.0], [1, 1]);
        problem.clamp("bottom").unwrap();
        change(&mut problem);
        match Solver::new(problem) {
            Ok(_) => panic!("not refused"),
            Err(failure) => failure.to_string(),
        }
    };
    let surplus = refused(&|problem| problem.materials.push(RUBBER));
    assert!(
        surplus.contains("2 materials") && surplus.contains("rubber"),
        "{surplus}"
    );
    let negative = Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(-1.0));
    let negative = negative.unwrap_err().to_string();
    assert!(negative.contains("bulk modulus"), "{negative}");
    let nothing = refused(&|problem| {
        let parameter = problem.parameter("push", Rule::Given);
        let surface = Vec::new();
        problem.pressures.push(Pressure { surface, parameter });
    });
    assert!(nothing.contains("\"push\" has no facets"), "{nothing}");
    let both = refused(&|problem| {
        let parameter = problem.parameter("push", Rule::Given);
        let motion = Motion::Driven(parameter, 1.0);
        problem.support("left", 1, motion).unwrap();
    });
    assert!(
        both.contains("contradict") && both.contains("\"push\""),
        "{both}"
    );
    let unknown = refused(&|problem| {
        problem.supports[0].motion = Motion::Driven(Parameter(3), 1.0);
    });
    assert!(unknown.contains("no parameter number 3"), "{unknown}");

    let mut flat = rectangle([1.0, 1.0], [1, 1]);
    let error = flat.support("left", 2, Motion::Fixed).unwrap_err();
    assert!(error.to_string().contains("no component 2"), "{error}");

    let mut held = rectangle([1.0, 1.0], [1, 1]);
    held.clamp("bottom").unwrap();
    held.parameter("idle", Rule::Given);
    let mut solver = Solver::new(held).unwrap();
    for (targets, word) in [
        (vec![], "0 targets"),
        (vec![1.0, 2.0], "2 targets"),
        (vec![f64::NAN], "NaN"),
    ] {
        let failure = solver.load_to(&targets, |_, _| Continue::Yes).unwrap_err();
        assert!(failure.to_string().contains(word), "{failure}");
    }
}

#[test]
fn a_body_that_can_turn_is_refused_with_the_point_about_which_it_turns() {
    let mut hinged = rectangle([2.0, 1.0], [2, 1]);
    hinged.mesh.node_sets.insert("hinge".into(), vec![0]);
    let hinge = hinged.mesh.points[0];
    hinged.clamp("hinge").unwrap();
    let failure = Solver::new(hinged).err().unwrap();
    let Reason::Problem(ProblemError::NotFixed(FreePart {
        ref motions,
        region: None,
    })) = failure.reason
    else {
        panic!("{failure}");
    };
    let [FreeMotion::Rotation { axis, through }] = motions[..] else {
        panic!("{failure}");
    };
    assert!((axis[2].abs() - 1.0).abs() < 1e-12);
    assert!(
        (0..2).all(|d| (through[d] - hinge[d]).abs() < 1e-9),
        "{through:?}"
    );
}

#[test]
fn a_light_load_has_the_slope_of_rest() {
    // A cell as slender as those at corners, under a load far below any other rounding.
    let mut problem = rectangle([100.0, 1.0], [50, 4]);
    problem.clamp("bottom").unwrap();
    let push = problem.parameter("push", Rule::Given);
    let surface = problem.surface("top").unwrap();
    problem.pressures.push(Pressure {
        surface,
        parameter: push,
    });
    let mut solver = Solver::new(problem).unwrap();
    let corner = solver.problem().mesh.nodes_of("top").unwrap()[0] as usize;
    let slope = solver.linear_response(push).unwrap().displacement[corner];
    solver.load_to(&[1e-9], |_, _| Continue::Yes).unwrap();
    let moved = solver.state().displacement[corner];
    for d in 0..2 {
        assert!(
            (moved[d] * 1e9 / slope[d] - 1.0).abs() < 1e-5,
            "{moved:?} {slope:?}"
        );
    }
}

/// What presses a bonded round layer of thickness 1, without friction.
#[derive(Clone, Copy, Debug)]
enum Presses {
    /// A ball of radius 0.5.
    Ball,
    /// A flat face of radius 0.45 with a rim of 0.05.
    Punch,
}

/// A layer with cells of this size where it is pressed, solved to a depth or as far as it goes.
fn pressed_layer(
    presses: Presses,
    multipliers: Multipliers,
    size: f64,
    depth: f64,
) -> (Solver, Option<String>) {
    let growth = Growth {
        smallest: size,
        ratio: 1.5,
        largest: 0.2,
    };
    let even = |length: f64| Grading::Uniform((length / size).round() as usize);
    let (end, below, shape) = match presses {
        Presses::Ball => (
            0.6,
            even(0.6),
            Shape::Sphere {
                centre: [0.0, 1.5, 0.0],
                radius: 0.5,
            },
        ),
        Presses::Punch => (
            0.5,
            even(0.5),
            Shape::Punch {
                point: [0.0, 1.0, 0.0],
                axis: [0.0, 1.0, 0.0],
                flat: 0.45,
                rim: 0.05,
            },
        ),
    };
    let across = Axis::new(&[0.0, end, 5.0], &[below, Grading::FromStart(growth)]).unwrap();
    let up = Axis::new(&[0.0, 1.0], &[Grading::FromEnd(growth)]).unwrap();
    let mesh = Grid2::new([across, up], "rubber").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::Axisymmetric).unwrap();
    problem.materials.push(RUBBER);
    problem.clamp("bottom").unwrap();
    problem.support("left", 0, Motion::Fixed).unwrap();
    let travel = problem.parameter("depth", Rule::Given);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("top").unwrap(),
        shape,
        travel: Some(([0.0, -1.0, 0.0], travel)),
        stiffness: 200.0 / size,
        friction: 0.0,
        overlap_limit: 1e-3 * size,
    }));
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.first_step = 0.02;
    solver.settings.stable = false;
    solver.settings.multipliers = multipliers;
    let ended = solver.load_to(&[depth], |_, _| Continue::Yes);
    (
        solver,
        ended.err().map(|failure| failure.reason.to_string()),
    )
}

#[test]
fn a_ball_goes_deep_into_a_bonded_layer_with_a_force_that_does_not_hang_on_the_mesh() {
    let force = |size: f64| {
        let (mut solver, ended) = pressed_layer(Presses::Ball, Multipliers::Corners, size, 0.5);
        assert_eq!(ended, None, "{size}");
        solver.evaluate().unwrap().along[0]
    };
    let (coarse, fine) = (force(0.1), force(0.05));
    assert!((coarse / fine - 1.0).abs() < 1e-3, "{coarse} {fine}");
}

#[test]
fn where_multipliers_at_points_end_a_ball_goes_on_with_those_at_corners() {
    let goes = |multipliers| {
        let (solver, ended) = pressed_layer(Presses::Ball, multipliers, 0.05, 0.9);
        let at = (solver.state().parameters[0], solver.multipliers());
        (at, ended)
    };
    let ((points, stand), ended) = goes(Multipliers::Points);
    assert_eq!(stand, Multipliers::Points);
    assert!(ended.is_some());
    let ((farther, stand), ended) = goes(Multipliers::Automatic);
    assert_eq!(stand, Multipliers::Corners);
    assert_eq!(ended, None);
    assert!(farther > points + 0.03, "{farther} {points}");
}

/// `cargo test -p taxel-fem --test behaviour how_far -- --ignored --nocapture`
#[test]
#[ignore = "a minute; prints how far a bonded layer is pressed"]
#[allow(clippy::print_stdout)]
fn how_far_a_bonded_layer_is_pressed() {
    let cases = [
        (Presses::Ball, [0.1, 0.05, 0.025].as_slice(), 0.5),
        (Presses::Punch, &[0.05, 0.025, 0.0125], 0.2),
    ];
    for (presses, sizes, least) in cases {
        for &size in sizes {
            let (mut solver, ended) = pressed_layer(presses, Multipliers::Automatic, size, 0.8);
            let depth = solver.state().parameters[0];
            let force = solver.evaluate().unwrap().along[0];
            let ended = ended.unwrap_or_default();
            let volume = solver.least_volume_ratio().unwrap();
            println!(
                "{presses:?}, cells of {size}: depth {depth:.4}, force {force:.4}, least volume ratio {:.3} at {:.3?}; {ended}",
                volume.ratio, volume.place
            );
            assert!(depth > least, "{presses:?} {size} {depth}");
        }
    }
}

#[test]
fn a_rigid_body_turns_by_any_angle_without_strain() {
    // A block with a rigid half, carried round by more than a turn, and shifted.
    let axes = [
        Axis::uniform(0.0, 2.0, 4).unwrap(),
        Axis::uniform(0.0, 1.0, 2).unwrap(),
    ];
    let mesh = Grid2::new(axes, "rubber").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials.push(RUBBER);
    let mut body = problem.rigid_body("left", Some([0.0, 0.0, 0.0])).unwrap();
    let way = problem.parameter("way", Rule::Given);
    let angle = problem.parameter("angle", Rule::Given);
    body.travel[1] = Motion::Driven(way, 2.0);
    body.turn[2] = Motion::Driven(angle, 1.0);
    problem.rigid_bodies.push(body);
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[1.5, 7.0], |_, _| Continue::Yes).unwrap();
    let (sin, cos) = 7.0_f64.sin_cos();
    let places = solver.state().places(&solver.problem().mesh);
    for (rest, place) in solver.problem().mesh.points.iter().zip(&places) {
        let x = cos * rest[0] - sin * rest[1];
        let y = 3.0 + sin * rest[0] + cos * rest[1];
        assert!((place[0] - x).abs() < 1e-9 && (place[1] - y).abs() < 1e-9);
    }
    let stress = solver.greatest_stress().unwrap().von_mises;
    assert!(stress < 1e-8, "{stress}");
}

#[test]
fn a_rigid_region_carries_its_force_and_torque() {
    // Three layers, the middle one rigid, sheared by a force on it: each outer layer carries half.
    let axes = [
        Axis::uniform(0.0, 4.0, 4).unwrap(),
        Axis::uniform(0.0, 1.0, 1).unwrap(),
    ];
    let layer = Grid2::new(axes, "layer").mesh().unwrap();
    let moved = |by: f64| {
        let mut mesh = layer.clone();
        for point in &mut mesh.points {
            point[1] += by;
        }
        mesh
    };
    let (middle, upper) = (moved(1.0), moved(2.0));
    let parts = [("lower", &layer), ("middle", &middle), ("upper", &upper)];
    let mesh = Mesh::joined(&parts, |_| true);
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials = vec![RUBBER; 3];
    problem.clamp("lower_bottom").unwrap();
    problem.clamp("upper_top").unwrap();
    let mut body = problem.rigid_body("middle_layer", None).unwrap();
    let pull = problem.free_parameter("pull");
    let aside = problem.free_parameter("aside");
    let turn = problem.free_parameter("turn");
    body.travel[0] = Motion::Driven(pull, 1.0);
    body.travel[1] = Motion::Driven(aside, 1.0);
    body.turn[2] = Motion::Driven(turn, 1.0);
    problem.rigid_bodies.push(body.clone());
    let mut solver = Solver::new(problem).unwrap();
    solver
        .load_to(&[0.8, 0.0, 0.0], |_, _| Continue::Yes)
        .unwrap();
    let assembled = solver.evaluate().unwrap();
    let of = |node: u32| {
        let f = &assembled.forces[2 * node as usize..][..2];
        [f[0], f[1], 0.0]
    };
    let force = body.force(of);
    assert!(
        (force[0] - 0.8).abs() < 1e-9 && force[1].abs() < 1e-9,
        "{force:?}"
    );
    // By its symmetry it neither rises nor turns, and no torque acts on it.
    let parameters = &solver.state().parameters;
    assert!(parameters[1].abs() < 1e-9 && parameters[2].abs() < 1e-9);
    let places = solver.state().places(&solver.problem().mesh);
    let motion = body.motion(parameters);
    let torque = body.torque(&motion, |node| places[node as usize], of);
    assert!(torque[2].abs() < 1e-8, "{torque:?}");
    // G A x / h of two layers, a little less at their free ends.
    let stiff = 2.0 * 4.0 * parameters[0];
    assert!(0.8 / stiff < 1.0 && 0.8 / stiff > 0.85, "{stiff}");
}

#[test]
fn the_tangent_of_rigid_bodies_and_constraints_is_the_slope_of_the_forces() {
    // Turned far, pulled, periodic from side to side, its mean held: the change of all forces by
    // a small step of each parameter is what one linear step says.
    let mut problem = rectangle([2.0, 1.0], [4, 2]);
    problem.materials[0] =
        Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(5.0)).unwrap();
    let base = problem.rigid_body("bottom", None).unwrap();
    problem.rigid_bodies.push(base);
    let mut top = problem.rigid_body("top", Some([0.3, 1.2, 0.0])).unwrap();
    let names = ["x", "y", "turn"];
    let [x, y, turn] = names.map(|name| problem.parameter(name, Rule::Given));
    top.travel = [
        Motion::Driven(x, 1.0),
        Motion::Driven(y, 1.0),
        Motion::Fixed,
    ];
    top.turn[2] = Motion::Driven(turn, 1.0);
    problem.rigid_bodies.push(top);
    // The sides follow each other between the plates.
    let ends: Vec<u32> = ["bottom", "top"]
        .iter()
        .flat_map(|name| problem.mesh.nodes_of(name).unwrap())
        .collect();
    problem.periodic(["left", "right"], &[(1, x, 0.1)]).unwrap();
    problem
        .constraints
        .retain(|c| !ends.contains(&c.dependent.0));
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.tolerance = 1e-12;
    solver.settings.elimination = 1e3;
    solver.settings.iterations = 30;
    let at = [0.2, 0.1, 0.4];
    solver.load_to(&at, |_, _| Continue::Yes).unwrap();
    let slopes = solver.linear_responses(&[x, y, turn]).unwrap();
    let state = solver.state().clone();
    for k in 0..3 {
        let mut forces = |step: f64| {
            solver.restart(state.clone(), at.to_vec());
            let mut near = at;
            near[k] += step;
            solver.load_to(&near, |_, _| Continue::Yes).unwrap();
            solver.evaluate().unwrap().along
        };
        let (up, down) = (forces(1e-4), forces(-1e-4));
        for l in 0..3 {
            let slope = (up[l] - down[l]) / 2e-4;
            let found = slopes[k].forces[l];
            assert!(
                (slope - found).abs() < 2e-5 * slopes[k].forces[k].abs(),
                "{k} {l}: {slope} {found}"
            );
        }
    }
}

#[test]
fn a_surface_keeps_a_mean_displacement() {
    // Pressed down by 0.1 on the mean, the upper side bulges as it likes; the force is spread.
    let mut problem = rectangle([2.0, 1.0], [4, 2]);
    problem.clamp("bottom").unwrap();
    let way = problem.parameter("way", Rule::Given);
    problem.keep_mean("top", 1, Some((way, -1.0))).unwrap();
    let free = problem.mesh.nodes_of("top").unwrap();
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[0.1], |_, _| Continue::Yes).unwrap();
    let problem = solver.problem();
    let facets = problem.surface("top").unwrap();
    let shares = traction(&problem.mesh, problem.kinematics, &facets, |_| {
        [1.0, 0.0, 0.0]
    });
    let moved = solver.state().displacement.clone();
    let mean: f64 = shares
        .iter()
        .map(|(node, share)| share[0] * moved[*node as usize][1])
        .sum();
    assert!((mean / 2.0 + 0.1).abs() < 1e-12, "{mean}");
    // The reaction is that of an even traction, and its work that of the parameter.
    let assembled = solver.evaluate().unwrap();
    for &(node, share) in &shares {
        let force = assembled.forces[2 * node as usize + 1];
        let even = -assembled.along[0] * share[0] / 2.0;
        assert!((force - even).abs() < 1e-8, "{force} {even}");
    }
    let lowest = free.iter().map(|&node| moved[node as usize][1]);
    assert!(lowest.fold(0.0, f64::min) < -0.11);
}

#[test]
fn a_point_that_comes_to_touch_rubs_from_where_it_was() {
    // A rough bar pressed obliquely into a block. In two steps its pull was half of that in many
    // (0.118 for 0.230), while friction began at the end of the step in which a point touches.
    let pull = |steps: f64| {
        let mut problem = rectangle([4.0, 1.0], [16, 4]);
        problem.materials[0] =
            Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(10.0)).unwrap();
        problem.clamp("bottom").unwrap();
        let by = problem.parameter("by", Rule::Given);
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface: problem.surface("top").unwrap(),
            shape: Shape::Sphere {
                centre: [2.0, 2.0, 0.0],
                radius: 1.0,
            },
            travel: Some(([0.5, -1.0, 0.0], by)),
            stiffness: 200.0,
            friction: 0.5,
            overlap_limit: 2.5e-5,
        }));
        let mut solver = Solver::new(problem).unwrap();
        solver.settings.first_step = 1.0 / steps;
        solver.settings.largest_step = 1.0 / steps;
        solver.load_to(&[0.2], |_, _| Continue::Yes).unwrap();
        solver.contact(0).force()[0]
    };
    let (few, many) = (pull(2.0), pull(24.0));
    assert!((few / many - 1.0).abs() < 0.03, "{few} {many}");
}

/// A rough round indenter over a slab of a third of its shear modulus: radius 0.6, width 1.
fn ironing() -> Solver {
    let block = |x: [f64; 2], y: [f64; 2], cells: [usize; 2]| {
        let axes = [
            Axis::uniform(x[0], x[1], cells[0]).unwrap(),
            Axis::uniform(y[0], y[1], cells[1]).unwrap(),
        ];
        Grid2::new(axes, "solid").mesh().unwrap()
    };
    let slab = block([-2.0, 6.0], [-2.0, 0.0], [24, 4]);
    let mut indenter = block([-0.5, 0.5], [0.0, 1.0], [4, 4]);
    for point in &mut indenter.points {
        let sag = 0.6 - (0.36 - point[0] * point[0]).sqrt();
        point[1] += sag * (1.0 - point[1]);
    }
    let mesh = Mesh::joined(&[("slab", &slab), ("indenter", &indenter)], |_| false);
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials = [1.0, 3.0]
        .map(|g| Material::new(Law::neo_hookean(g), Volumetric::Quadratic(20.0 * g)).unwrap())
        .to_vec();
    problem.clamp("slab_bottom").unwrap();
    let press = problem.parameter("press", Rule::Given);
    let drag = problem.parameter("drag", Rule::Given);
    for (component, motion) in [
        (0, Motion::Driven(drag, 1.0)),
        (1, Motion::Driven(press, -1.0)),
    ] {
        problem.support("indenter_top", component, motion).unwrap();
    }
    let surfaces = ["indenter_bottom", "slab_top"].map(|name| problem.surface(name).unwrap());
    let mut pair = SurfacePair::new(&problem.mesh, surfaces, 1.0);
    pair.friction = 0.3;
    problem.contacts.push(Contact::Surfaces(pair));
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.multipliers = Multipliers::Corners;
    solver
}

/// `cargo test --locked -p taxel-fem --test behaviour to_and_fro -- --ignored --nocapture`
#[test]
#[ignore = "half a minute; a thousand steps of a stroke, its forces printed"]
#[allow(clippy::print_stdout)]
fn a_stroke_to_and_fro_returns_to_its_forces() {
    let mut solver = ironing();
    let press = 0.3;
    solver.load_to(&[press, 0.0], |_, _| Continue::Yes).unwrap();
    let cycle = |solver: &mut Solver, steps: &mut usize| -> Vec<[f64; 2]> {
        let parts = (1..=20).map(|part| {
            let angle = std::f64::consts::TAU * f64::from(part) / 20.0;
            let mut hear = |_: &_, _: &_| {
                *steps += 1;
                Continue::Yes
            };
            solver
                .load_to(&[press, 0.5 * angle.sin()], &mut hear)
                .unwrap();
            let along = solver.evaluate().unwrap().along;
            [along[0], along[1]]
        });
        parts.collect()
    };
    let off = |now: &[[f64; 2]], then: &[[f64; 2]]| {
        let both = now.as_flattened().iter().zip(then.as_flattened());
        both.map(|(now, then)| (now - then).abs())
            .fold(0.0, f64::max)
    };
    // Friction remembers where its steps end: first the same in every cycle.
    let default = solver.settings;
    solver.settings.first_step = 1.0 / 3.0;
    solver.settings.largest_step = 1.0 / 3.0;
    let mut steps = 0;
    cycle(&mut solver, &mut steps);
    let second = cycle(&mut solver, &mut steps);
    while steps < 1000 {
        let forces = cycle(&mut solver, &mut steps);
        let off = off(&forces, &second);
        println!("{steps} steps: {:.9?}, off by {off:.1e}", forces[4]);
        assert!(off < 1e-10, "{steps}: {off}");
    }
    // By how much they matter is printed.
    solver.settings = default;
    cycle(&mut solver, &mut steps);
    let second = cycle(&mut solver, &mut steps);
    for _ in 0..8 {
        let before = steps;
        let forces = cycle(&mut solver, &mut steps);
        let (own, off) = (steps - before, off(&forces, &second));
        println!(
            "{own} steps of free size: {:.9?}, off by {off:.1e}",
            forces[4]
        );
        assert!(off < 1e-4, "{off}");
    }
}

/// A block that fills its mould, which a smooth plate presses to a share of its height: uniaxial
/// strain, P = K (J - 1) + G (J^(1/3) - (2 + J^2) J^(-5/3) / 3), at 60 shear moduli.
#[test]
fn a_contact_bears_the_pressure_of_a_mould() {
    const BULK: f64 = 100.0;
    let pressed = |multipliers: Multipliers| -> Vec<[f64; 2]> {
        let mut problem = rectangle([2.0, 1.0], [6, 3]);
        problem.materials =
            vec![Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(BULK)).unwrap()];
        for side in ["left", "right"] {
            problem.support(side, 0, Motion::Fixed).unwrap();
        }
        problem.support("bottom", 1, Motion::Fixed).unwrap();
        let way = problem.parameter("way", Rule::Given);
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface: problem.surface("top").unwrap(),
            shape: Shape::HalfSpace {
                point: [0.0, 1.0, 0.0],
                normal: [0.0, -1.0, 0.0],
            },
            travel: Some(([0.0, -1.0, 0.0], way)),
            stiffness: 50.0 * 3.0,
            friction: 0.0,
            overlap_limit: 1e-5,
        }));
        let mut solver = Solver::new(problem).unwrap();
        solver.settings.multipliers = multipliers;
        let steps = [0.1, 0.3, 0.6].into_iter();
        steps
            .map(|way| {
                solver.load_to(&[way], |_, _| Continue::Yes).unwrap();
                [way, solver.evaluate().unwrap().along[0] / 2.0]
            })
            .collect()
    };
    for multipliers in [Multipliers::Points, Multipliers::Corners] {
        for [way, found] in pressed(multipliers) {
            let j: f64 = 1.0 - way;
            let shape = j.cbrt() - (2.0 + j * j) / (3.0 * j.powf(5.0 / 3.0));
            let exact = -(BULK * (j - 1.0) + shape);
            assert!((found / exact - 1.0).abs() < 1e-3, "{way}: {found} {exact}");
        }
    }
}
