//! Surfaces that touch and slide: the tangent beside differences of the residual, Newton's
//! convergence, a wavy pad, a soft block on a soft slab in space.
#![allow(clippy::unwrap_used)]

use taxel_fem::assembly::state::State;
use taxel_fem::assembly::system::System;
use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, CellShape, Grid2, Grid3, LowerCell, Mesh, gmsh};
use taxel_fem::problem::load::traction;
use taxel_fem::problem::{
    Contact, DeadLoad, Kinematics, Motion, Obstacle, Parameter, Problem, Rule, Shape, Support,
    SurfacePair,
};
use taxel_fem::solver::newton::{Continue, Solver, Step};

/// A box from `low` to `high`, cells along each axis.
fn block(low: [f64; 3], high: [f64; 3], cells: &[usize]) -> Mesh {
    let axis = |d: usize| Axis::uniform(low[d], high[d], cells[d]).unwrap();
    if cells.len() == 2 {
        Grid2::new([axis(0), axis(1)], "solid").mesh().unwrap()
    } else {
        Grid3::new([axis(0), axis(1), axis(2)], "solid")
            .mesh()
            .unwrap()
    }
}

/// The same in tetrahedra, six in each box.
fn tetrahedra(mesh: &Mesh) -> Mesh {
    const PARTS: [[usize; 4]; 6] = [
        [0, 1, 2, 6],
        [0, 2, 3, 6],
        [0, 3, 7, 6],
        [0, 7, 4, 6],
        [0, 4, 5, 6],
        [0, 5, 1, 6],
    ];
    let mut numbers = std::collections::BTreeMap::new();
    let mut points = Vec::new();
    let mut cells = Vec::new();
    for cell in 0..mesh.cell_count() {
        let corners: Vec<u32> = mesh.cell(cell)[..8]
            .iter()
            .map(|&node| {
                *numbers.entry(node).or_insert_with(|| {
                    points.push(mesh.points[node as usize]);
                    points.len() as u32 - 1
                })
            })
            .collect();
        cells.extend(PARTS.map(|part| LowerCell {
            shape: CellShape::Tet15,
            region: 0,
            nodes: part.map(|corner| corners[corner]).to_vec(),
        }));
    }
    let heights = mesh.points.iter().map(|x| x[2]);
    let low = heights.clone().fold(f64::INFINITY, f64::min);
    let high = heights.fold(f64::NEG_INFINITY, f64::max);
    let mut mesh = Mesh::from_lower_cells(points, &cells, &["solid"]).unwrap();
    mesh.name_boundary("bottom", |x| (x[2] - low).abs() < 1e-9);
    mesh.name_boundary("top", |x| (x[2] - high).abs() < 1e-9);
    mesh
}

/// An upper body on a lower one, rough, with parameters that press and draw its top along x.
fn resting(lower: &Mesh, upper: &Mesh, kinematics: Kinematics, friction: f64) -> Problem {
    let mesh = Mesh::joined(&[("lower", lower), ("upper", upper)], |_| false);
    let up = kinematics.components() - 1;
    let mut problem = Problem::new(mesh, kinematics).unwrap();
    let solid = Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(10.0)).unwrap();
    problem.materials = vec![solid; 2];
    problem.clamp("lower_bottom").unwrap();
    let press = problem.parameter("press", Rule::Given);
    let drag = problem.parameter("drag", Rule::Given);
    for d in 0..=up {
        let motion = match d {
            0 => Motion::Driven(drag, 1.0),
            d if d == up => Motion::Driven(press, -1.0),
            _ => Motion::Fixed,
        };
        problem.support("upper_top", d, motion).unwrap();
    }
    let surfaces = ["upper_bottom", "lower_top"].map(|name| problem.surface(name).unwrap());
    let mut pair = SurfacePair::new(&problem.mesh, surfaces, 1.0);
    pair.friction = friction;
    problem.contacts.push(Contact::Surfaces(pair));
    problem
}

/// Smooth numbers between -1 and 1 that repeat themselves in no simple way.
fn scattered(k: usize) -> f64 {
    (1.0 + 1.7 * k as f64 + 0.3 * (k * k % 97) as f64).sin()
}

/// Rounds the lower side of a body of this height that stands on the origin's plane.
fn rounded(mut mesh: Mesh, up: usize, height: f64) -> Mesh {
    for x in &mut mesh.points {
        let share = 1.0 - x[up] / height;
        let sag: f64 = (0..up).map(|d| 0.15 * (x[d] - 0.5).powi(2)).sum();
        x[up] += share * sag;
    }
    mesh
}

/// Change of the residual on each unknown along a motion of the nodes: by the tangent, and by
/// central differences at fixed pressures of the cells.
fn moved(problem: &Problem, state: &State, motion: &dyn Fn(usize, usize) -> f64) -> Vec<[f64; 2]> {
    let mut system = System::new(problem).unwrap();
    let here = system.assemble(problem, state, true).unwrap();
    assert!(!here.incomplete);
    let components = system.unknowns.components();
    let numbers: Vec<(usize, usize, usize)> = (0..problem.mesh.points.len())
        .flat_map(|node| (0..components).map(move |d| (node, d)))
        .filter_map(|(node, d)| Some((node, d, system.unknowns.of(node as u32, d)?)))
        .collect();
    let mut change = vec![0.0; numbers.len()];
    for &(node, d, number) in &numbers {
        change[number] = motion(node, d);
    }
    let mut product = system.unknowns.pattern.multiply(&here.values, &change);
    here.unsymmetric.add_product(&change, &mut product);
    let step = 2e-7;
    let mut residual = |sign: f64| {
        let mut there = state.clone();
        for &(node, d, _) in &numbers {
            there.displacement[node][d] += sign * step * motion(node, d);
        }
        let assembled = system.assemble(problem, &there, false);
        assembled.unwrap().residual
    };
    let (ahead, behind) = (residual(1.0), residual(-1.0));
    let each = numbers.iter();
    each.map(|&(_, _, k)| [product[k], (ahead[k] - behind[k]) / (2.0 * step)])
        .collect()
}

/// What the tangent of a contact of friction 0.4 is off from differences, over the greatest change
/// of a force: what the contact adds to the bodies without it, along a motion of all nodes. `seen`
/// counts its points that stick and slide.
fn off_differences(
    [problem, bare]: [&Problem; 2],
    state: &State,
    trial: usize,
    seen: &mut [usize; 2],
) -> f64 {
    let system = System::new(problem).unwrap();
    let probe = system.contact(problem, state, &state.places(&problem.mesh), 0);
    for (pressure, t) in probe.pressures.iter().zip(&probe.tractions) {
        let t = t.iter().map(|x| x * x).sum::<f64>().sqrt();
        if *pressure > 0.0 {
            seen[usize::from(t >= 0.4 * pressure * (1.0 - 1e-9))] += 1;
        }
    }
    let motion = |node: usize, d: usize| scattered(3 * node + 5 * d + trial);
    let [with, without] = [problem, bare].map(|body| moved(body, state, &motion));
    let (mut size, mut off) = (0.0_f64, 0.0_f64);
    for (with, without) in with.iter().zip(&without) {
        let [exact, found] = [0, 1].map(|k| with[k] - without[k]);
        size = size.max(exact.abs());
        off = off.max((exact - found).abs());
    }
    off / size
}

#[test]
fn the_tangent_between_rough_surfaces_is_that_of_differences() {
    let cubes =
        |low: f64, high: f64, cells: [usize; 3]| block([0.0, 0.0, low], [1.0, 1.0, high], &cells);
    let squares =
        |low: f64, high: f64, cells: [usize; 2]| block([0.0, low, 0.0], [1.0, high, 0.0], &cells);
    let solid = [cubes(-0.5, 0.0, [2, 2, 1]), cubes(0.0, 0.5, [3, 2, 1])];
    let cases = [
        (
            "plane strain",
            Kinematics::PlaneStrain,
            [squares(-0.5, 0.0, [4, 2]), squares(0.0, 0.5, [3, 2])],
        ),
        (
            "axisymmetric",
            Kinematics::Axisymmetric,
            [squares(-0.5, 0.0, [4, 2]), squares(0.0, 0.5, [3, 2])],
        ),
        ("hexahedra", Kinematics::Solid, solid.clone()),
        (
            "tetrahedra",
            Kinematics::Solid,
            solid.map(|mesh| tetrahedra(&mesh)),
        ),
    ];
    for (name, kinematics, [lower, upper]) in cases {
        let up = kinematics.components() - 1;
        let upper = rounded(upper, up, 0.5);
        let problem = resting(&lower, &upper, kinematics, 0.4);
        let mut bare = problem.clone();
        bare.contacts.clear();
        let mut solver = Solver::new(problem.clone()).unwrap();
        let across = if kinematics == Kinematics::Axisymmetric {
            0.0
        } else {
            0.004
        };
        solver.load_to(&[0.03, 0.0], |_, _| Continue::Yes).unwrap();
        solver
            .load_to(&[0.04, across], |_, _| Continue::Yes)
            .unwrap();
        let mut seen = [0; 2];
        for trial in 0..3 {
            let mut state = solver.state().clone();
            // Some points stick, some slide.
            for (node, u) in state.displacement.iter_mut().enumerate() {
                for (d, u) in u.iter_mut().enumerate().take(up + 1) {
                    *u += 2e-3 * scattered(7 * node + d + 1000 * trial);
                }
            }
            let off = off_differences([&problem, &bare], &state, trial, &mut seen);
            assert!(off < 1e-7, "{name} {trial}: {off:.1e}");
        }
        assert!(seen.iter().all(|count| *count > 0), "{name}: {seen:?}");
    }
}

#[test]
fn the_tangent_on_a_rough_ball_is_that_of_differences() {
    let squares = block([0.0, -0.5, 0.0], [1.0, 0.0, 0.0], &[6, 3]);
    let cubes = block([0.0, 0.0, -0.5], [1.0, 1.0, 0.0], &[2, 2, 1]);
    for (kinematics, mesh, middle) in [
        (Kinematics::PlaneStrain, &squares, 0.5),
        (Kinematics::Axisymmetric, &squares, 0.0),
        (Kinematics::Solid, &cubes, 0.5),
    ] {
        let up = kinematics.components() - 1;
        let mut problem = Problem::new(mesh.clone(), kinematics).unwrap();
        let solid = Material::new(Law::neo_hookean(1.0), Volumetric::Quadratic(10.0)).unwrap();
        problem.materials.push(solid);
        problem.clamp("bottom").unwrap();
        if kinematics == Kinematics::Axisymmetric {
            problem.support("left", 0, Motion::Fixed).unwrap();
        }
        let press = problem.parameter("press", Rule::Given);
        let (radius, mut centre, mut direction) = (0.6, [middle; 3], [0.0; 3]);
        centre[up] = radius;
        direction[up] = -1.0;
        if up == 1 {
            centre[2] = 0.0;
        }
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface: problem.surface("top").unwrap(),
            shape: Shape::Sphere { centre, radius },
            travel: Some((direction, press)),
            stiffness: 100.0,
            friction: 0.4,
            overlap_limit: 1e-4,
        }));
        let mut bare = problem.clone();
        bare.contacts.clear();
        let mut solver = Solver::new(problem.clone()).unwrap();
        solver.load_to(&[0.1], |_, _| Continue::Yes).unwrap();
        let mut seen = [0; 2];
        for trial in 0..3 {
            let mut state = solver.state().clone();
            for (node, u) in state.displacement.iter_mut().enumerate() {
                for (d, u) in u.iter_mut().enumerate().take(up + 1) {
                    *u += 6e-3 * scattered(7 * node + d + 1000 * trial);
                }
            }
            let off = off_differences([&problem, &bare], &state, trial, &mut seen);
            assert!(off < 1e-7, "{kinematics:?} {trial}: {off:.1e}");
        }
        assert!(
            seen.iter().all(|count| *count > 0),
            "{kinematics:?}: {seen:?}"
        );
    }
}

/// `cargo test --locked --release -p taxel-fem --test surfaces ball_is_pressed -- --ignored --nocapture`:
/// a ball of 2 mm in a bonded disc of 9 mm by 9 mm (mm and kPa).
#[test]
#[ignore = "minutes; prints how far a rough ball is pressed, and why it ends"]
#[allow(clippy::print_stdout)]
fn a_rough_ball_is_pressed_to_its_end() {
    let mesh = block([0.0, -9.0, 0.0], [9.0, 0.0, 0.0], &[24, 24]);
    let mut problem = Problem::new(mesh, Kinematics::Axisymmetric).unwrap();
    problem.materials = vec![Material::incompressible(Law::neo_hookean(10.0))];
    problem.clamp("bottom").unwrap();
    problem.support("left", 0, Motion::Fixed).unwrap();
    let press = problem.parameter("press", Rule::Given);
    let surface = problem.surface("top").unwrap();
    let side = problem.mesh.mean_side(&surface);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface,
        shape: Shape::Sphere {
            centre: [0.0, 2.0, 0.0],
            radius: 2.0,
        },
        travel: Some(([0.0, -1.0, 0.0], press)),
        stiffness: 500.0 / side,
        friction: 0.5,
        overlap_limit: 1e-4 * side,
    }));
    let mut solver = Solver::new(problem).unwrap();
    let (mut steps, mut jumps) = (0, 0);
    for way in 1..=9 {
        let before = (solver.iterations, steps);
        let mut hear = |_: &_, step: &Step| {
            steps += 1;
            jumps += usize::from(step.jump.is_some());
            Continue::Yes
        };
        let ended = solver.load_to(&[f64::from(way)], &mut hear);
        let depth = solver.state().parameters[0];
        let force = solver.evaluate().unwrap().along[0];
        println!(
            "{depth:.4} mm, {force:.4} mN: {} iterations in {} steps, {jumps} jumps so far, least volume ratio {:.3}",
            solver.iterations - before.0,
            steps - before.1,
            solver.least_volume_ratio().unwrap().ratio
        );
        if let Err(failure) = ended {
            println!("{failure}");
            break;
        }
    }
    println!("{} iterations in {steps} steps", solver.iterations);
    assert!(solver.state().parameters[0] > 5.0);
}

#[test]
fn newtons_method_converges_quadratically_between_sliding_surfaces() {
    let lower = block([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], &[10, 3]);
    let upper = rounded(block([0.0, 0.0, 0.0], [1.0, 0.5, 0.0], &[4, 2]), 1, 0.5);
    let problem = resting(&lower, &upper, Kinematics::PlaneStrain, 0.3);
    let mut solver = Solver::new(problem).unwrap();
    solver.load_to(&[0.06, 0.0], |_, _| Continue::Yes).unwrap();
    solver.settings.largest_step = 0.05;
    let mut shown = 0;
    let mut judge = |step: &Step| {
        let [_, second, third] = step.energies;
        // Below is rounding. A tangent that is off by 1e-3 has ratios of hundreds.
        if third > 1e-13 {
            shown += 1;
            let ratio = third / (second * second);
            assert!(ratio < 20.0, "{:?}: {ratio}", step.energies);
        }
    };
    solver
        .load_to(&[0.06, 0.2], |_, step| {
            judge(step);
            Continue::Yes
        })
        .unwrap();
    assert!(shown >= 4, "{shown}");
}

/// A half disc over a pad with waves, in mm and kPa, drawn in Gmsh by a stranger.
fn half_disc_on_waves() -> Solver {
    let mut mesh = gmsh::read(include_str!("wavy_pad.msh")).unwrap();
    for x in &mut mesh.points {
        *x = x.map(|x| 1e-3 * x);
    }
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    let ball = Law::MooneyRivlin {
        c10: 100.0,
        c01: 20.0,
    };
    let ball = Material::new(ball, Volumetric::Logarithmic(5000.0));
    let pad = Material::new(Law::neo_hookean(80.0), Volumetric::Quadratic(2000.0));
    let (ball, pad) = (ball.unwrap(), pad.unwrap());
    let regions = problem.mesh.regions.iter();
    let solids = regions.map(|region| if region == "ball" { ball } else { pad });
    problem.materials = solids.collect();
    problem.clamp("floor").unwrap();
    for (name, component, sign) in [("down", 1, -1.0), ("along", 0, 1.0)] {
        let parameter = problem.parameter(name, Rule::Given);
        let motion = Motion::Driven(parameter, sign);
        problem.support("grip", component, motion).unwrap();
    }
    let surfaces = ["round", "wavy"].map(|name| problem.surface(name).unwrap());
    let mut pair = SurfacePair::new(&problem.mesh, surfaces, 80.0);
    pair.friction = 0.4;
    problem.contacts.push(Contact::Surfaces(pair));
    Solver::new(problem).unwrap()
}

#[test]
fn a_half_disc_is_pressed_into_a_wavy_pad() {
    let mut solver = half_disc_on_waves();
    // Without them it ended at 0.191, with them at 0.193.
    solver.settings.rounds = 0;
    for down in [0.16, 0.2] {
        solver.load_to(&[down, 0.0], |_, _| Continue::Yes).unwrap();
    }
    assert!(solver.contact(0).force()[1] > 7.0);
}

/// `cargo test --locked -p taxel-fem --test surfaces along_the_waves -- --ignored --nocapture`
#[test]
#[ignore = "half a minute"]
#[allow(clippy::print_stdout)]
fn a_half_disc_is_drawn_along_the_waves() {
    let mut solver = half_disc_on_waves();
    for target in [[0.16, 0.0], [0.2, 0.0], [0.2, 0.1], [0.2, 0.3], [0.2, 0.5]] {
        solver.load_to(&target, |_, _| Continue::Yes).unwrap();
        println!("{target:?} mm: {:.5?} mN", solver.contact(0).force());
    }
}

/// Pull over friction times load of a block that is drawn over a slab in space, and the steps.
fn drawn(lower: &Mesh, upper: &Mesh, ways: &[f64]) -> (Vec<f64>, Vec<Step>) {
    let (friction, load, area) = (0.4, 0.01, 0.6);
    let mut problem = resting(lower, upper, Kinematics::Solid, friction);
    // A load presses in the place of a travel.
    let moved = |support: &Support| support.component == 2 && support.motion != Motion::Fixed;
    problem.supports.retain(|support| !moved(support));
    let top = problem.surface("upper_top").unwrap();
    let forces = traction(&problem.mesh, problem.kinematics, &top, |_| {
        [0.0, 0.0, -1.0]
    });
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: Parameter(0),
    });
    let mut solver = Solver::new(problem).unwrap();
    let mut steps = Vec::new();
    let mut load_to = |solver: &mut Solver, way: f64| {
        let hear = |_: &_, step: &Step| {
            steps.push(*step);
            Continue::Yes
        };
        solver.load_to(&[load, way], hear).unwrap();
    };
    load_to(&mut solver, 0.0);
    let pulls = ways.iter().map(|&way| {
        load_to(&mut solver, way);
        solver.evaluate().unwrap().along[1] / (friction * load * area)
    });
    let pulls = pulls.collect();
    (pulls, steps)
}

#[test]
fn a_soft_block_slides_over_a_soft_slab_in_space() {
    let lower = block([-0.5, -0.25, -0.5], [2.0, 0.85, 0.0], &[5, 2, 1]);
    let upper = block([0.0, 0.0, 0.0], [1.0, 0.6, 0.4], &[2, 1, 1]);
    for share in drawn(&lower, &upper, &[0.3]).0 {
        assert!((share - 1.0).abs() < 0.01, "{share}");
    }
}

/// `cargo test --locked -p taxel-fem --test surfaces far_in_space -- --ignored --nocapture`
#[test]
#[ignore = "half a minute"]
#[allow(clippy::print_stdout)]
fn a_soft_block_slides_far_in_space() {
    let lower = block([-0.5, -0.25, -0.5], [2.0, 0.85, 0.0], &[7, 3, 1]);
    let upper = block([0.0, 0.0, 0.0], [1.0, 0.6, 0.4], &[3, 2, 1]);
    let divided = [&lower, &upper].map(tetrahedra);
    for (name, [lower, upper]) in [
        ("hexahedra", [&lower, &upper]),
        ("tetrahedra", [&divided[0], &divided[1]]),
    ] {
        let (shares, steps) = drawn(lower, upper, &[0.1, 0.3, 0.6]);
        println!("{name}: pull over friction times load {shares:.6?}");
        let mean = |count: fn(&Step) -> usize| {
            steps.iter().map(count).sum::<usize>() as f64 / steps.len() as f64
        };
        println!(
            "{name}: {} steps, on the mean {:.1} iterations, {:.1} before the first round, at most {}",
            steps.len(),
            mean(|step| step.iterations),
            mean(|step| step.before_rounds),
            steps.iter().map(|step| step.iterations).max().unwrap_or(0)
        );
        for share in shares {
            assert!((share - 1.0).abs() < 0.01, "{name}: {share}");
        }
    }
}

/// Place and tangent of a line of three nodes at a reference coordinate.
fn along(nodes: &[u32], places: &[[f64; 3]], at: f64) -> [[f64; 2]; 2] {
    let values = [0.5 * at * (at - 1.0), 0.5 * at * (at + 1.0), 1.0 - at * at];
    let slopes = [at - 0.5, at + 0.5, -2.0 * at];
    [values, slopes].map(|factors| {
        std::array::from_fn(|d| {
            let nodes = nodes.iter().zip(factors);
            nodes
                .map(|(&n, factor)| factor * places[n as usize][d])
                .sum()
        })
    })
}

/// Slope and stretch of a surface at a place along x.
fn under(surface: &[Vec<u32>], places: [&[[f64; 3]]; 2], x: f64) -> Option<[f64; 2]> {
    let [rest, now] = places;
    surface.iter().find_map(|nodes| {
        let [from, to] = [0, 1].map(|k| now[nodes[k] as usize][0]);
        let mut at = 2.0 * (x - from) / (to - from) - 1.0;
        if at.abs() > 1.0 {
            return None;
        }
        for _ in 0..20 {
            let [place, tangent] = along(nodes, now, at);
            at -= (place[0] - x) / tangent[0];
        }
        let [[_, tangent], [_, before]] = [along(nodes, now, at), along(nodes, rest, at)];
        let length = |t: [f64; 2]| t[0].hypot(t[1]);
        Some([tangent[1] / tangent[0], length(tangent) / length(before)])
    })
}

/// `cargo test --locked -p taxel-fem --test surfaces sharp_block -- --ignored --nocapture`: the
/// block of case C6.5 under four times its load, and what its pull is made of; at last on the first
/// mesh under less.
#[test]
#[ignore = "minutes"]
#[allow(clippy::print_stdout)]
fn a_sharp_block_is_dragged() {
    let friction = 0.5;
    for (ends, cells, most, load) in [
        ([-1.0, 3.0], 13, 3, 0.02),
        ([-3.0, 5.0], 26, 3, 0.02),
        ([-1.0, 3.0], 13, 1, 0.01),
        ([-1.0, 3.0], 13, 1, 0.005),
    ] {
        for fine in 1..=most {
            let lower = block(
                [ends[0], -1.0, 0.0],
                [ends[1], 0.0, 0.0],
                &[cells * fine, 3 * fine],
            );
            let upper = block([0.0; 3], [1.0, 0.5, 0.0], &[4 * fine, 2 * fine]);
            let mut problem = resting(&lower, &upper, Kinematics::PlaneStrain, friction);
            problem.materials = vec![Material::incompressible(Law::neo_hookean(1.0)); 2];
            let moved =
                |support: &Support| support.component == 1 && support.motion != Motion::Fixed;
            problem.supports.retain(|support| !moved(support));
            let top = problem.surface("upper_top").unwrap();
            let forces = traction(&problem.mesh, problem.kinematics, &top, |_| {
                [0.0, -1.0, 0.0]
            });
            problem.dead_loads.push(DeadLoad {
                forces,
                parameter: Parameter(0),
            });
            let facets = |name: &str| -> Vec<Vec<u32>> {
                let facets = problem.surface(name).unwrap().into_iter();
                facets
                    .map(|facet| problem.mesh.facet_nodes(facet).collect())
                    .collect()
            };
            let [sole, table] = ["upper_bottom", "lower_top"].map(facets);
            let mut solver = Solver::new(problem).unwrap();
            solver.load_to(&[load, 0.0], |_, _| Continue::Yes).unwrap();
            for way in [0.3, 0.6, 0.9, 1.2] {
                solver.load_to(&[load, way], |_, _| Continue::Yes).unwrap();
                let evaluated = solver.evaluate().unwrap();
                let (pull, energy) = (evaluated.along[1], evaluated.energy);
                let probe = solver.contact(0);
                let rest = solver.problem().mesh.points.as_slice();
                let places = solver.state().places(&solver.problem().mesh);
                // Means by pressure of the slopes of both surfaces and of the slab's stretch.
                let mut means = [0.0; 3];
                for (k, x) in probe.at.iter().enumerate() {
                    let weight = probe.areas[k] * probe.pressures[k] / load;
                    let own = sole.iter().find_map(|nodes| {
                        let [from, to] = [0, 1].map(|k| rest[nodes[k] as usize][0]);
                        let at = 2.0 * (x[0] - from) / (to - from) - 1.0;
                        (at.abs() <= 1.0).then(|| along(nodes, &places, at))
                    });
                    let Some([place, tangent]) = own.filter(|_| weight > 0.0) else {
                        continue;
                    };
                    let met = place[0] - probe.gaps[k] * probe.normals[k][0];
                    let [slope, stretch] = under(&table, [rest, &places], met).unwrap();
                    for (mean, x) in means
                        .iter_mut()
                        .zip([tangent[1] / tangent[0], slope, stretch])
                    {
                        *mean += weight * x;
                    }
                }
                // The block alone, sliding all over: what its mean slope makes of its load.
                let by_slope = (1.0 + means[0] / friction) / (1.0 - friction * means[0]);
                let share = pull / (friction * load);
                println!(
                    "load {load}, slab {ends:?}, {fine} times as fine, way {way}: pull over friction times load {share:.5}, by the slope {by_slope:.5}, \
                     energy {energy:.5e}, mean slope of the block {:.5}, of the slab {:.5}, stretch {:.5}",
                    means[0], means[1], means[2]
                );
                assert!((share - by_slope).abs() < 1e-4, "{share} {by_slope}");
            }
        }
    }
}
