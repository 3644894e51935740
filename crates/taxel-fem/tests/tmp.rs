#![allow(clippy::all, warnings)]
use std::time::Instant;
use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, Grading, Grid2, Growth, Mesh};
use taxel_fem::problem::*;
use taxel_fem::solver::newton::{Continue, Solver};

fn g(smallest: f64, largest: f64) -> Growth {
    Growth {
        smallest,
        ratio: 1.5,
        largest,
    }
}

fn press(shape: &str, size: f64, largest: f64, stretch: f64, settings: impl Fn(&mut Solver)) {
    let start = Instant::now();
    let near = if shape == "sphere" { 0.6 } else { 0.5 };
    let x = if shape == "sphere" {
        Axis::new(
            &[0.0, near, 5.0],
            &[
                Grading::Uniform((near / size).round() as usize),
                Grading::FromStart(g(size, largest)),
            ],
        )
        .unwrap()
    } else {
        Axis::new(
            &[0.0, near, 5.0],
            &[
                Grading::FromEnd(g(size, largest)),
                Grading::FromStart(g(size, largest)),
            ],
        )
        .unwrap()
    };
    // cells taller by `stretch` near the surface
    let y = Axis::new(
        &[0.0, 1.0],
        &[Grading::FromEnd(g((size * stretch).min(0.3), largest))],
    )
    .unwrap();
    let mesh = Grid2::new([x, y], "s").mesh().unwrap();
    let mut problem = Problem::new(mesh, Kinematics::Axisymmetric).unwrap();
    problem.materials =
        vec![Material::new(Law::neo_hookean(1.0), Volumetric::Incompressible).unwrap()];
    problem.clamp("bottom").unwrap();
    problem.support("left", 0, Motion::Fixed).unwrap();
    let d = problem.parameter("depth", Rule::Given);
    let s = match shape {
        "sphere" => Shape::Sphere {
            centre: [0.0, 1.5, 0.0],
            radius: 0.5,
        },
        _ => Shape::Punch {
            point: [0.0, 1.0, 0.0],
            axis: [0.0, 1.0, 0.0],
            flat: 0.45,
            rim: 0.05,
        },
    };
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("top").unwrap(),
        shape: s,
        travel: Some(([0.0, -1.0, 0.0], d)),
        stiffness: 50.0 / size,
        friction: 0.0,
        overlap_limit: 1e-3 * size,
    }));
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.first_step = 0.02;
    settings(&mut solver);
    let r = solver.load_to(&[0.8], |_, step| {
        if start.elapsed().as_secs() > 25 {
            Continue::Stop
        } else {
            Continue::Yes
        }
    });
    let depth = solver.state().parameters[0];
    let force = solver.evaluate().unwrap().along[0];
    let least = solver.least_volume_ratio();
    println!(
        "{shape} size {size} largest {largest} tall {stretch}: depth {depth:.4} force {force:.4} its {} least {:?} {:.1} s",
        solver.iterations,
        least.map(|l| (l.ratio, l.place)),
        start.elapsed().as_secs_f64()
    );
    if let Err(f) = r {
        println!("   {}", f.to_string().chars().take(260).collect::<String>());
    }
}

#[test]
fn depths() {
    for (size, tall) in [
        (0.1, 1.0),
        (0.05, 1.0),
        (0.05, 3.0),
        (0.1, 2.0),
        (0.025, 1.0),
    ] {
        press("sphere", size, 0.2, tall, |_| {});
        press("punch", size, 0.2, tall, |_| {});
    }
    press("sphere", 0.05, 0.2, 1.0, |s| s.settings.iterations = 40);
    press("punch", 0.05, 0.2, 1.0, |s| s.settings.iterations = 40);
    press("punch", 0.05, 0.2, 1.0, |s| s.settings.whole_cells = true);
    press("sphere", 0.05, 0.2, 1.0, |s| s.settings.whole_cells = true);
}
