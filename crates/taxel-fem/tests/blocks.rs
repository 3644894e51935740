//! Two problems that independent programs solved: a layer with a void under pressure,
//! and a block squeezed between bonded plates.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "tests print what they find")]

use std::collections::HashMap;

use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{CellShape, Mesh};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::{Cavity, Motion, Pressure, Problem, Rule};
use taxel_fem::solver::newton::{Continue, Settings, Solver};
use taxel_fem::study::bump_block::{
    BlockDivision, BlockSides, BumpBlock, Pressed, PressedBlock, TopForce, large_strain, linear,
};

const MOONEY_RIVLIN: Law = Law::MooneyRivlin {
    c10: 75.5,
    c01: 5.7,
};

fn rubber() -> Material {
    let bulk = 1000.0 * MOONEY_RIVLIN.shear_modulus();
    Material::new(MOONEY_RIVLIN, Volumetric::Quadratic(bulk)).unwrap()
}

/// Cells of a grid of half steps, `counts` cells of size `size` along each axis.
fn grid(counts: [i32; 3], size: f64, keep: impl Fn([f64; 3]) -> bool) -> Mesh {
    let flat = counts[2] == 0;
    let shape = if flat {
        CellShape::Quad9
    } else {
        CellShape::Hex27
    };
    let mut mesh = Mesh::default();
    let region = mesh.region("rubber");
    let mut known = HashMap::new();
    for k in 0..counts[2].max(1) {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let middle = [i, j, k].map(|n| (f64::from(n) + 0.5) * size);
                if !keep(middle) {
                    continue;
                }
                let nodes: Vec<u32> = (0..shape.node_count())
                    .map(|n| {
                        let at = shape.node_at(n);
                        let key = [
                            2 * i + 1 + at[0] as i32,
                            2 * j + 1 + at[1] as i32,
                            if flat { 0 } else { 2 * k + 1 + at[2] as i32 },
                        ];
                        *known.entry(key).or_insert_with(|| {
                            mesh.points.push(key.map(|n| f64::from(n) * size / 2.0));
                            mesh.points.len() as u32 - 1
                        })
                    })
                    .collect();
                mesh.add_cell(shape, region, &nodes);
            }
        }
    }
    mesh
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

/// Half cell 300 x 500 um with a half void 200 x 40 um; area ratio of the void.
fn void_under_pressure(k: i32, pressure: f64, steps: usize) -> (f64, usize) {
    let mut mesh = grid([15 * k, 25 * k, 0], 20.0 / f64::from(k), |x| {
        !(x[0] < 200.0 && x[1] > 340.0 && x[1] < 380.0)
    });
    mesh.name_boundary("bottom", |x| near(x[1], 0.0));
    mesh.name_boundary("left", |x| near(x[0], 0.0));
    mesh.name_boundary("right", |x| near(x[0], 300.0));
    mesh.name_boundary("top", |x| near(x[1], 500.0));
    mesh.name_boundary("void", |x| {
        x[0] < 201.0 && x[1] > 339.0 && x[1] < 381.0 && !near(x[0], 0.0)
            || near(x[0], 0.0) && (near(x[1], 340.0) || near(x[1], 380.0))
    });
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).unwrap();
    problem.materials.push(rubber());
    problem.clamp("bottom").unwrap();
    problem.support("left", 0, Motion::Fixed).unwrap();
    problem.support("right", 0, Motion::Fixed).unwrap();
    let top = problem.parameter("pressure", Rule::Given);
    let inside = problem.parameter("inside", Rule::Given);
    problem.pressures.push(Pressure {
        surface: problem.surface("top").unwrap(),
        parameter: top,
    });
    problem.cavities.push(Cavity {
        wall: problem.surface("void").unwrap(),
        axis: 0,
        origin: 0.0,
        pressure: inside,
    });
    let mut solver = Solver::new(problem).unwrap();
    solver.settings = Settings {
        first_step: 1.0 / steps as f64,
        largest_step: 1.0 / steps as f64,
        extrapolate: false,
        ..Settings::default()
    };
    let rest = solver.evaluate().unwrap().volumes[0];
    assert!((rest - 8000.0).abs() < 1e-9, "{rest}");
    solver
        .load_to(&[pressure, 0.0], |_, _| Continue::Yes)
        .unwrap();
    (
        solver.evaluate().unwrap().volumes[0] / rest,
        solver.iterations,
    )
}

#[test]
fn the_void_closes_as_in_independent_programs() {
    // Q2 with discontinuous linear pressure, 5 kPa.
    let (coarse, _) = void_under_pressure(1, 5.0, 5);
    assert!((coarse - 0.66465).abs() < 1e-5, "{coarse}");
    let (fine, _) = void_under_pressure(3, 5.0, 5);
    assert!((fine - 0.664401).abs() < 1e-6, "{fine}");
}

/// Force in mN on a block of 1 x 1 x 0.5 mm squeezed by 20 %.
fn squeezed_block(n: i32) -> f64 {
    let mut mesh = grid([n, n, n / 2], 1.0 / f64::from(n), |_| true);
    mesh.name_boundary("bottom", |x| near(x[2], 0.0));
    mesh.name_boundary("top", |x| near(x[2], 0.5));
    let mut problem = Problem::new(mesh, Kinematics::Solid).unwrap();
    problem.materials.push(rubber());
    problem.clamp("bottom").unwrap();
    problem.support("top", 0, Motion::Fixed).unwrap();
    problem.support("top", 1, Motion::Fixed).unwrap();
    let travel = problem.parameter("travel", Rule::Given);
    problem
        .support("top", 2, Motion::Driven(travel, 1.0))
        .unwrap();
    let mut solver = Solver::new(problem).unwrap();
    solver.settings.first_step = 0.5;
    solver.settings.largest_step = 0.5;
    solver.settings.extrapolate = false;
    solver.load_to(&[-0.1], |_, _| Continue::Yes).unwrap();
    solver.evaluate().unwrap().along[0]
}

#[test]
fn the_block_resists_as_in_independent_programs() {
    let coarse = squeezed_block(4);
    assert!((coarse + 218.95002).abs() < 1e-4, "{coarse}");
}

#[test]
#[ignore = "longer; the fine mesh of the comparison with other programs"]
fn the_fine_block_resists_as_in_independent_programs() {
    let fine = squeezed_block(12);
    assert!((fine + 210.92153).abs() < 1e-4, "{fine}");
}

/// The elastic unit of P2: four cavities of 6 um under a bump, on a block of 2 mm.
fn unit() -> BumpBlock {
    BumpBlock {
        half: 1e-3,
        cavity: [50e-6, 650e-6],
        plate: [150e-6, 550e-6],
        plate_thickness: 20e-6,
        lower: 300e-6,
        insulation: 6e-6,
        air: 6e-6,
        upper: 400e-6,
        bump: 300e-6,
        bump_half: [350e-6, 137.9e-6],
        in_row: false,
    }
}

/// Rubber of 1 MPa, neo-Hookean, and copper.
fn unit_of(modulus: f64, division: BlockDivision) -> PressedBlock {
    PressedBlock {
        solids: [large_strain(modulus, 0.49), linear(117e9, 0.34)],
        sides: BlockSides::Free,
        division,
        permittivity: 2.7,
    }
}

/// Linear elasticity until the first touch, at a corner of a tile, then floor on roof: the closing
/// gains less with the force. On few cells.
#[test]
fn a_pressed_unit_touches_at_the_corner_next_to_the_walls() {
    let (modulus, division) = (3.04e6, BlockDivision::COARSE);
    let (block, of) = (unit(), unit_of(modulus, division));
    let solids = [linear(modulus, 0.49), of.solids[1]];
    let slope = block
        .solve(solids, BlockSides::Free, division)
        .unwrap()
        .normal;
    let (path, _) = block.press(&of, &[1e-4, 45e-3], |_| ()).unwrap();
    let [small, beyond] = path.states[..] else {
        panic!("{path:?}")
    };
    assert!((small.closing / (small.force * slope.closing) - 1.0).abs() < 1e-3);
    // The plates alone, parallel: 172.3 fF.
    assert!((small.capacitance / 172.3e-15 - 1.0).abs() < 2e-3);
    let touch = path.touch.unwrap();
    assert_eq!(touch.least_at.map(|x| (x * 1e6).round()), [150.0; 2]);
    assert!(touch.least_gap.abs() < 0.01 * block.air, "{touch:?}");
    let linear = block.air / (slope.closing * slope.hottest);
    println!("linear {:.3} mN, {:.3} mN", linear * 1e3, touch.force * 1e3);
    assert!((touch.force / linear - 1.0).abs() < 0.02, "{touch:?}");
    assert!(touch.touching < 1e-3 && small.least_gap > 0.9 * block.air);
    assert!(beyond.touching > 0.01 && beyond.least_gap > -0.05 * block.air);
    // What touches holds its part of the force.
    let gain = |a: &Pressed, b: &Pressed| (b.closing - a.closing) / (b.force - a.force);
    assert!(gain(&touch, &beyond) < 0.7 * gain(&small, &touch));
    assert!(beyond.capacitance > touch.capacitance);
}

/// The unit of P2, of 1 MPa: half lengths, m.
const UNIT: BumpBlock = BumpBlock {
    half: 1000e-6,
    cavity: [50e-6, 650e-6],
    plate: [150e-6, 550e-6],
    plate_thickness: 20e-6,
    lower: 300e-6,
    insulation: 6e-6,
    air: 6e-6,
    upper: 400e-6,
    bump: 300e-6,
    bump_half: [350e-6, 137.9e-6],
    in_row: false,
};

/// The loaded quarter, which pictures show, has the largest closing that the answers say.
#[test]
fn the_loaded_quarter_closes_as_the_answers_say() {
    let solids = [linear(1e6, 0.49), linear(117e9, 0.34)];
    let division = BlockDivision::COARSE;
    let answer = UNIT.solve(solids, BlockSides::Free, division).unwrap();
    for (along, of) in [
        (TopForce::Normal, answer.normal),
        (TopForce::Side, answer.side),
    ] {
        let loaded = UNIT.loaded(solids, BlockSides::Free, division, (along, 1e-7), None);
        let solver = loaded.unwrap();
        let mesh = &solver.problem().mesh;
        // The hottest column of the cavity.
        let mut columns = std::collections::BTreeMap::<[i64; 2], f64>::new();
        for (face, sign) in [("gap.floor", 1.0), ("gap.roof", -1.0)] {
            for node in mesh.nodes_of(face).unwrap() {
                let [x, y, _] = mesh.points[node as usize];
                let key = [x, y].map(|x| (x * 1e12).round() as i64);
                let rise = solver.state().displacement[node as usize][2];
                *columns.entry(key).or_default() += sign * rise;
            }
        }
        let most = columns.into_values().fold(f64::NEG_INFINITY, f64::max);
        let expected = 1e-7 * of.hottest * of.closing;
        assert!(
            (most / expected - 1.0).abs() < 1e-5,
            "{along:?}: {most} {expected}"
        );
    }
}

/// Closings on cells that double away from the edges of plates, walls and the foot of the bump:
/// another way to the limit than equal cells. Printed are the compliances of 1 MPa in um/mN, the
/// downward force of a bar that sticks to the lowest strip, and k sealed at 2 MPa, kN/m.
#[test]
#[ignore = "long: cargo test --release -p taxel-fem --test blocks -- --ignored --nocapture graded"]
fn the_unit_of_p2_on_graded_cells() {
    let found = [40e-6, 20e-6, 10e-6, 5e-6].map(|smallest| graded(&UNIT, smallest));
    // Halving the smallest cell adds less each time.
    let steps: Vec<f64> = found
        .windows(2)
        .map(|pair| pair[1][0] - pair[0][0])
        .collect();
    assert!(steps.windows(2).all(|pair| pair[1] < pair[0]), "{found:?}");
}

/// The same with walls of 200 um, the row whose c_xx is furthest from the table's.
#[test]
#[ignore = "long: cargo test --release -p taxel-fem --test blocks -- --ignored --nocapture graded"]
fn thick_walls_on_graded_cells() {
    let walls = BumpBlock {
        cavity: [100e-6, 650e-6],
        ..UNIT
    };
    let [coarse, fine] = [40e-6, 20e-6].map(|smallest| graded(&walls, smallest));
    for number in 0..2 {
        assert!(
            (coarse[number] / fine[number] - 1.0).abs() < 6e-3,
            "{coarse:?} {fine:?}"
        );
    }
    // c_zz and c_xx of the table, whose error is 2 %.
    for (found, table) in fine.into_iter().zip([0.2248, 0.59672]) {
        println!(
            "{found:.4} for {table}: {:.2} %",
            100.0 * (found / table - 1.0)
        );
    }
}

/// c_zz and c_xx, um/mN, on cells from `smallest` on.
fn graded(unit: &BumpBlock, smallest: f64) -> [f64; 2] {
    let solids = [linear(1e6, 0.49), linear(117e9, 0.34)];
    let mesh = unit.graded_mesh(smallest).unwrap();
    let cells = mesh.cell_count();
    let answer = unit.solve_on(mesh, solids, BlockSides::Free).unwrap();
    let sealed = {
        let air = 101.3e3 / answer.cavity;
        let lost = 1e6 * answer.pressure.opening * 1e6 * answer.normal.volume * air;
        let kept = lost / (2e6 + 1e6 * answer.pressure.volume * air);
        2e6 / (1e6 * answer.normal.closing - kept)
    };
    let closings = [1e3 * answer.normal.closing, 2e3 * answer.side.closing];
    println!(
        "smallest {:.0} um, {cells} cells, {} unknowns: c_zz {:.4}, c_xx {:.4}, stick {:.4} {:.4} {:.4} {:.4}, \
         sealed {:.3} kN/m, hottest {:.3}",
        1e6 * smallest,
        answer.unknowns,
        closings[0],
        closings[1],
        -answer.strips[0].rise[0] / answer.strips[0].rise[1],
        -answer.strips[1].rise[0] / answer.strips[1].rise[1],
        -answer.strips[2].rise[0] / answer.strips[2].rise[1],
        -answer.strips[3].rise[0] / answer.strips[3].rise[1],
        1e-3 * sealed,
        answer.normal.hottest,
    );
    closings
}
