//! Another design on the same mesh: moved nodes and a warm start against a new solution.

#![allow(clippy::unwrap_used)]

use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, Grading, Grid2, Mesh};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::{Cavity, Motion, Pressure, Problem, Rule};
use taxel_fem::solver::iterative::Iterations;
use taxel_fem::solver::newton::{Continue, Solver};

fn drawn() -> Mesh {
    let axis = |n| Axis::new(&[0.0, 1.0, 2.0, 3.0], &[Grading::Uniform(n); 3]).unwrap();
    let grid = Grid2::new([axis(3), axis(2)], "solid").void("hole", [[1.0, 2.0], [1.0, 2.0]]);
    grid.mesh().unwrap()
}

/// The hole wider by a factor, the outer sides where they were.
fn moved([x, y, z]: [f64; 3], factor: f64) -> [f64; 3] {
    let from_middle = (x - 1.5) * factor;
    let beyond = ((x - 1.5).abs() - 0.5).max(0.0) * (1.5 - 0.5 * factor - factor);
    [1.5 + from_middle + beyond.copysign(from_middle), y, z]
}

fn solver(mesh: Mesh) -> Solver {
    let law = Law::MooneyRivlin { c10: 1.0, c01: 0.1 };
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    let rubber = Material::new(law, Volumetric::Quadratic(1000.0)).unwrap();
    problem.materials.push(rubber);
    problem.clamp("bottom").unwrap();
    // Between planes of symmetry the tangent of a follower pressure is symmetric, and
    // the iteration quadratic.
    problem.support("left", 0, Motion::Fixed).unwrap();
    problem.support("right", 0, Motion::Fixed).unwrap();
    let pressure = problem.parameter("pressure", Rule::Given);
    let inside = problem.parameter("inside", Rule::Given);
    problem.pressures.push(Pressure {
        surface: problem.surface("top").unwrap(),
        parameter: pressure,
    });
    problem.cavities.push(Cavity {
        wall: problem.surface("hole").unwrap(),
        axis: 0,
        origin: 0.0,
        pressure: inside,
    });
    Solver::new(problem).unwrap()
}

#[test]
fn a_moved_body_settles_where_a_new_one_ends() {
    let aim = [0.3, 0.1];
    let mut kept = solver(drawn());
    kept.load_to(&aim, |_, _| Continue::Yes).unwrap();
    let points = drawn().points;
    for factor in [1.02, 1.05, 0.98] {
        kept.place_nodes(|node| moved(points[node], factor));
        let step = kept.settle().unwrap();

        let mut mesh = drawn();
        for point in &mut mesh.points {
            *point = moved(*point, factor);
        }
        let mut fresh = solver(mesh);
        let rest = fresh.evaluate().unwrap().volumes[0];
        assert!((rest - factor).abs() < 1e-12, "{rest}");
        fresh.load_to(&aim, |_, _| Continue::Yes).unwrap();
        assert!(step.iterations <= 5, "{step:?}");
        // Newton's last step is the square of a change of 1e-7 of the first.
        for (a, b) in kept
            .state()
            .displacement
            .iter()
            .zip(&fresh.state().displacement)
        {
            for d in 0..2 {
                assert!((a[d] - b[d]).abs() < 1e-10, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn the_next_designs_end_where_new_bodies_do() {
    let aim = [0.3, 0.1];
    let mut kept = solver(drawn());
    kept.load_to(&aim, |_, _| Continue::Yes).unwrap();
    let points = drawn().points;
    // Along a line in equal steps, back, with a longer one, and again by the usual way.
    for (number, factor) in [1.0, 1.01, 1.02, 1.03, 1.04, 1.03, 1.06]
        .into_iter()
        .enumerate()
    {
        let step = kept
            .next_design(|node| moved(points[node], factor))
            .unwrap();
        assert!(number != 4 || step.iterations <= 3, "{step:?}");
        let mut other = solver(drawn());
        other.load_to(&aim, |_, _| Continue::Yes).unwrap();
        other.place_nodes(|node| moved(points[node], factor));
        other.settle().unwrap();
        let other = &other.state().displacement;
        for (a, b) in kept.state().displacement.iter().zip(other) {
            for d in 0..2 {
                assert!((a[d] - b[d]).abs() < 1e-9, "{factor}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn iterations_solve_what_a_factor_solves() {
    let aim = [0.3, 0.1];
    let solutions = [false, true].map(|iterative| {
        let problem = solver(drawn()).problem().clone();
        let mut solver = if iterative {
            Solver::iterative(problem, Iterations::default()).unwrap()
        } else {
            Solver::new(problem).unwrap()
        };
        assert_eq!(solver.linear_iterations().is_some(), iterative);
        solver.load_to(&aim, |_, _| Continue::Yes).unwrap();
        solver
    });
    assert!(solutions[1].linear_iterations().unwrap() > 10);
    let [one, other] = solutions.map(|solver| solver.state().displacement.clone());
    for (a, b) in one.iter().zip(&other) {
        for d in 0..2 {
            // The tolerance of the iterations, over the smallest change of Newton's method.
            assert!((a[d] - b[d]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
}

/// A block between a held side and a rigid one that is turned, its sides apart by a factor.
fn turned_block(width: f64) -> Problem {
    let axes = [
        Axis::uniform(0.0, width, 4).unwrap(),
        Axis::uniform(0.0, 1.0, 2).unwrap(),
    ];
    let mesh = Grid2::new(axes, "rubber").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    let rubber = Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(100.0)).unwrap();
    problem.materials.push(rubber);
    problem.clamp("left").unwrap();
    let mut body = problem.rigid_body("right", Some([0.0; 3])).unwrap();
    let angle = problem.parameter("angle", Rule::Given);
    body.turn[2] = Motion::Driven(angle, 1.0);
    problem.rigid_bodies.push(body);
    problem
}

#[test]
fn designs_with_a_rigid_body_are_settled_and_have_no_iterative_solution() {
    let mut solver = Solver::new(turned_block(2.0)).unwrap();
    solver.load_to(&[0.3], |_, _| Continue::Yes).unwrap();
    let drawn = solver.problem().mesh.points.clone();
    let torque = |solver: &mut Solver| solver.evaluate().unwrap().along[0];
    for factor in [1.02, 1.04, 1.06] {
        let place = |node: usize| [factor * drawn[node][0], drawn[node][1], 0.0];
        solver.next_design(place).unwrap();
        let mut new = Solver::new(turned_block(2.0 * factor)).unwrap();
        new.load_to(&[0.3], |_, _| Continue::Yes).unwrap();
        let (found, expected) = (torque(&mut solver), torque(&mut new));
        assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    }
    let refused = Solver::iterative(turned_block(2.0), Iterations::default()).err();
    let message = refused.unwrap().to_string();
    assert!(
        message.contains("rigid bodies and constraints"),
        "{message}"
    );
}
