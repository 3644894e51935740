//! One linear system of problem B, by the factor or by iterations.

use std::error::Error;

use serde_json::json;
use taxel_fem::problem::Parameter;
use taxel_fem::solver::iterative::Iterations;
use taxel_fem::solver::newton::Solver;

use crate::measure::{Meter, peak_megabytes};
use crate::problems::{Case, mesh, problem};

/// Prints the force per travel at rest, and what it took from the mesh on.
pub(crate) fn run(size: &str, way: &str) -> Result<(), Box<dyn Error>> {
    let mesh = mesh(Case::B, size.parse()?)?;
    let problem = problem(Case::B, mesh)?;
    let meter = Meter::start();
    let mut solver = match way {
        "factor" => Solver::new(problem)?,
        "iterations" => Solver::iterative(problem, Iterations::default())?,
        _ => return Err(format!("{way:?} is neither factor nor iterations").into()),
    };
    let (made, unknowns) = (meter.cpu(), solver.unknowns());
    let response = solver.linear_response(Parameter(0))?;
    let line = json!({
        "problem": "B",
        "size": size.parse::<usize>()?,
        "way": way,
        "dof_u": unknowns,
        "analysis_s": made,
        "cpu_s": meter.cpu(),
        "iterations": solver.linear_iterations(),
        "force_per_travel": response.forces[0],
        "peak_mb": peak_megabytes(),
    });
    println!("{line}");
    Ok(())
}
