//! Two solids at large strain, timed alone or beside other programs; see README.md.

mod cells;
mod designs;
mod factor;
mod large;
mod measure;
mod peers;
mod problems;

use std::error::Error;
use std::process::ExitCode;

use measure::{Meter, peak_megabytes};
use problems::{Case, Steps};
use serde_json::json;

const USAGE: &str = "solids A|B SIZE [own]     one solution, as a line of JSON
solids all                each size in turn, in processes of their own
solids cells              tangents of the quadratic hexahedron per second
solids designs COUNT      so many designs on one mesh of problem A
solids factor A|B SIZE THREADS
                          the factor of a tangent by one thread and by so many
solids large SIZE factor|iterations
                          one linear system of problem B by either way
solids compare FOLDER [ROUNDS [NAME:A|B:SIZE[:SOLVER] ...]]
                          beside the programs peer_NAME.py of a folder";

/// Pressure on the layer, kPa.
pub(crate) const PRESSURE: f64 = 10.0;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    // All others are of one thread.
    let threads = rayon::ThreadPoolBuilder::new().num_threads(1);
    if let Err(error) = threads.build_global() {
        eprintln!("{error}");
        return ExitCode::FAILURE;
    }
    let done = match words.as_slice() {
        ["all"] => peers::all(),
        ["cells"] => cells::run(),
        ["factor", case, size, threads] => factor::run(case, size, threads),
        ["large", size, way] => large::run(size, way),
        ["designs", count] => designs::run(count),
        ["compare", folder, rest @ ..] => peers::compare(folder, rest),
        [case, size] => solution(case, size, Steps::Fixed),
        [case, size, "own"] => solution(case, size, Steps::Own),
        _ => Err(USAGE.into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Solves once and prints what it took.
fn solution(case: &str, size: &str, steps: Steps) -> Result<(), Box<dyn Error>> {
    let case = Case::named(case)?;
    let size: usize = size.parse()?;
    let pressure = match std::env::var("PTOP") {
        Ok(text) => text.parse()?,
        Err(_) => PRESSURE,
    };
    let mesh = problems::mesh(case, size)?;
    let (cells, nodes) = (mesh.cell_count(), mesh.points.len());
    let meter = Meter::start();
    let found = problems::solve(case, mesh, steps, pressure)?;
    let mut line = json!({
        "wall_s": rounded(meter.wall()),
        "cpu_s": rounded(meter.cpu()),
        "peak_mb": peak_megabytes(),
        "peer": "taxel-fem",
        "problem": case.name(),
        "size": size,
        "threads": 1,
        "elements": cells,
        "dof": nodes * if case == Case::A { 2 } else { 3 },
        "dof_u": found.unknowns,
        "steps": found.steps,
        "newton": found.iterations,
    });
    let name = match case {
        Case::A => "area_ratio",
        Case::B => "reaction",
    };
    line[name] = json!(found.result);
    println!("{line}");
    Ok(())
}

/// To the tenth of a millisecond.
fn rounded(seconds: f64) -> f64 {
    (seconds * 1e4).round() / 1e4
}
