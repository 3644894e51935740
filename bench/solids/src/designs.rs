//! Many designs on one mesh: width, height and cover of the void of problem A.

use std::error::Error;

use serde_json::json;
use taxel_fem::assembly::state::State;
use taxel_fem::solver::newton::{Continue, Solver};

use crate::PRESSURE;
use crate::measure::{Meter, peak_megabytes};
use crate::problems::{Case, Steps, mesh, problem, targets};

/// Values of each of the three lengths.
const VALUES: usize = 10;
/// Largest change of a length, as a fraction of it.
const CHANGE: f64 = 0.05;
/// Every so many designs one is solved once more from rest.
const CHECKED: usize = 100;

/// Solves designs, each from the state of its neighbour.
pub(crate) fn run(count: &str) -> Result<(), Box<dyn Error>> {
    let count: usize = count.parse()?;
    let drawn = mesh(Case::A, 1)?;
    let points = drawn.points.clone();
    let mut solver = Solver::new(problem(Case::A, drawn)?)?;
    solver.settings = Steps::Own.settings(Case::A);
    let aim = targets(Case::A, PRESSURE);
    let meter = Meter::start();
    let (mut results, mut fresh) = (Vec::new(), 0);
    for number in 0..count {
        let lengths = lengths(number);
        let place = |node: usize| placed(points[node], lengths);
        if number == 0 {
            solver.place_nodes(place);
        }
        if number == 0 || solver.next_design(place).is_err() {
            from_rest(&mut solver, &aim)?;
            fresh += 1;
        }
        results.push(solver.evaluate()?.volumes[0]);
    }
    let (wall, cpu, iterations) = (meter.wall(), meter.cpu(), solver.iterations);
    let mut off = 0.0_f64;
    for number in (0..count).step_by(CHECKED) {
        let lengths = lengths(number);
        solver.place_nodes(|node| placed(points[node], lengths));
        from_rest(&mut solver, &aim)?;
        off = off.max((solver.evaluate()?.volumes[0] / results[number] - 1.0).abs());
    }
    let line = json!({
        "designs": count,
        "ms_each": (cpu / count as f64 * 1e6).round() / 1e3,
        "wall_s": wall,
        "cpu_s": cpu,
        "newton_each": iterations as f64 / count as f64,
        "from_rest": fresh,
        "largest_difference": off,
        "peak_mb": peak_megabytes(),
    });
    println!("{line}");
    println!("figure designs.each {:.4}", cpu / count as f64 * 1e3);
    Ok(())
}

fn from_rest(solver: &mut Solver, aim: &[f64]) -> Result<(), Box<dyn Error>> {
    let rest = State::rest(solver.problem());
    solver.restart(rest, vec![0.0; aim.len()]);
    Ok(solver.load_to(aim, |_, _| Continue::Yes)?)
}

/// Factors of the three lengths; neighbours differ in one of them, by one value.
fn lengths(number: usize) -> [f64; 3] {
    let mut rest = number;
    std::array::from_fn(|_| {
        let (round, place) = (rest / VALUES, rest % VALUES);
        rest = round;
        // There and back again.
        let place = if round % 2 == 0 {
            place
        } else {
            VALUES - 1 - place
        };
        let fraction = (place % VALUES) as f64 / (VALUES - 1) as f64;
        1.0 + CHANGE * (2.0 * fraction - 1.0)
    })
}

/// A node of the drawn body in a design.
fn placed([x, y, z]: [f64; 3], [width, height, cover]: [f64; 3]) -> [f64; 3] {
    let across = if x <= 200.0 {
        x * width
    } else {
        300.0 - (300.0 - x) * (300.0 - 200.0 * width) / 100.0
    };
    let (floor, roof) = (340.0, 340.0 + 40.0 * height);
    let up = if y <= 340.0 {
        y
    } else if y <= 380.0 {
        floor + (y - 340.0) * height
    } else {
        roof + (y - 380.0) * cover
    };
    [across, up, z]
}
