//! A rectangular channel in space that is pressed beyond the first touch of its walls.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::print_stdout, reason = "prints what documents state")]

use taxel_fem::assembly::folds::folds;
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{Axis, CornerDivision, Grading, Grid3, Growth, Mesh, VoidCell};
use taxel_fem::problem::{
    Cavity, Contact, Kinematics, Motion, Pressure, Problem, Rule, SurfacePair,
};
use taxel_fem::solver::failure::Failure;
use taxel_fem::solver::newton::{Continue, Solver};

/// Shear modulus, kPa; lengths in um.
const SHEAR: f64 = 162.4;

/// Half of a channel of 400 x 40 um under a cover of 140 um, every 600 um; cells that grow from 2 um
/// at its edges, one along it.
fn slice() -> Mesh {
    let growth = Growth {
        smallest: 2.0,
        ratio: 1.5,
        largest: 60.0,
    };
    let (end, start) = (Grading::FromEnd(growth), Grading::FromStart(growth));
    let both = Grading::FromBoth(growth);
    let x = Axis::new(&[0.0, 200.0, 300.0], &[end, start]).unwrap();
    let y = Axis::uniform(0.0, 10.0, 1).unwrap();
    let z = Axis::new(&[0.0, 320.0, 360.0, 500.0], &[end, both, start]).unwrap();
    let void = [[0.0, 200.0], [0.0, 10.0], [320.0, 360.0]];
    let grid = Grid3::new([x, y, z], "solid").void("void", void);
    grid.mesh().unwrap()
}

/// Areas over that at rest under these pressures on the top, kPa.
fn pressed(pressures: &[f64], folding: bool) -> Result<Vec<f64>, Failure> {
    let mut problem = Problem::new(slice(), Kinematics::Solid).unwrap();
    problem.materials = vec![Material::incompressible(Law::neo_hookean(SHEAR))];
    problem.clamp("bottom").unwrap();
    for (side, component) in [("left", 0), ("right", 0), ("front", 1), ("back", 1)] {
        problem.support(side, component, Motion::Fixed).unwrap();
    }
    let top = problem.parameter("pressure on the top", Rule::Given);
    let inside = problem.parameter("pressure inside", Rule::Given);
    problem.pressures.push(Pressure {
        surface: problem.surface("top").unwrap(),
        parameter: top,
    });
    let wall = problem.surface("void").unwrap();
    let cavity = Cavity {
        wall: wall.clone(),
        axis: 2,
        origin: 0.0,
        pressure: inside,
    };
    let rest = cavity.volume(&problem.mesh, problem.kinematics, &problem.mesh.points);
    problem.cavities.push(cavity);
    if folding {
        let walls = folds(&problem, &wall, 100.0 * SHEAR);
        problem.contacts.push(Contact::Walls(walls));
    }
    let pair = SurfacePair::new(&problem.mesh, [wall.clone(), wall], SHEAR);
    problem.contacts.push(Contact::Surfaces(pair));
    let mut solver = Solver::new(problem)?;
    let mut area = |pressure: f64| {
        let mut targets = solver.targets().to_vec();
        targets[top.0] = pressure;
        solver.load_to(&targets, |_, _| Continue::Yes)?;
        Ok(solver.evaluate()?.volumes[0] / rest)
    };
    pressures.iter().map(|pressure| area(*pressure)).collect()
}

/// Net pressures (kPa) of the converged cell in the plane with its corners folded, by area ratio:
/// rows of `p4_net_pressure.csv` (independent finite elements).
const IN_THE_PLANE: [(f64, f64); 5] = [
    (0.8, 3.64221),
    (0.6, 7.22596),
    (0.4, 10.74698),
    (0.3, 12.48609),
    (0.26, 13.17841),
];

/// `cargo test --locked -p taxel-fem --test channel -- --nocapture`
#[test]
fn the_edges_of_a_channel_in_space_fold_as_in_the_plane() {
    // The last pressure is beyond the touch of roof and floor.
    let pressures = IN_THE_PLANE.iter().map(|row| row.1).chain([14.4]);
    let pressures: Vec<f64> = pressures.collect();
    let folded = pressed(&pressures, true).unwrap();
    let mut most = 0.0_f64;
    for ((ratio, pressure), found) in IN_THE_PLANE.into_iter().zip(&folded) {
        println!("{pressure} kPa: area {found:.5}, in the plane {ratio}");
        most = most.max((found / ratio - 1.0).abs());
    }
    println!("off by up to {most:.1e}");
    println!("14.4 kPa, roof on floor: area {:.5}", folded[5]);
    assert!(most < 2e-3, "{most:?}");
    assert!(folded[5] > 0.2 && folded[5] < 0.25, "{}", folded[5]);
}

/// `cargo test --locked --release -p taxel-fem --test channel without -- --ignored --nocapture`
#[test]
#[ignore = "half a minute of smaller and smaller steps"]
fn without_folding_the_walls_pass_through_each_other() {
    let failure = pressed(&[8.0, 14.4], false).unwrap_err();
    println!("{failure}");
    assert!(failure.parameters[0].1 < IN_THE_PLANE[4].1);
}

#[test]
fn rounded_corners_and_outer_edges_do_not_fold() {
    let cell = |fillet: f64| VoidCell {
        width: 400.0,
        height: 40.0,
        cover: 140.0,
        base: 320.0,
        pitch: 600.0,
        fillet,
        division: CornerDivision::default(),
    };
    let pairs = |fillet: f64, surface: &str| {
        let mesh = cell(fillet).mesh().unwrap();
        let problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
        folds(&problem, &problem.surface(surface).unwrap(), 1.0).points
    };
    assert_eq!(pairs(5.0, "void").len(), 0);
    assert_eq!(pairs(0.0, "top").len(), 0);
    // Both corners, along half of the side.
    let sharp = pairs(0.0, "void");
    let length: f64 = sharp.iter().map(|pair| pair.weight).sum();
    assert!((length - 40.0).abs() < 0.5, "{length}");
    // The whole outline of the slice turns outward but in the channel.
    let problem = Problem::new(slice(), Kinematics::Solid).unwrap();
    let outline = problem.mesh.boundary();
    let void = problem.surface("void").unwrap();
    let [all, own] = [&outline, &void].map(|of| folds(&problem, of, 1.0).points.len());
    assert_eq!(all, own);
}
