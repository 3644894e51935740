//! The factor of one tangent by one thread and by several, in turns by the clock.

use std::error::Error;
use std::time::Instant;

use serde_json::json;
use taxel_fem::assembly::state::State;
use taxel_fem::assembly::system::System;
use taxel_fem::sparse::{Cholesky, Factorisation};

use crate::problems::{Case, mesh, problem};

/// Factorisations by each; the least time counts.
const ROUNDS: usize = 12;

/// Prints times and ratio.
pub(crate) fn run(case: &str, size: &str, threads: &str) -> Result<(), Box<dyn Error>> {
    let (case, size, threads) = (Case::named(case)?, size.parse()?, threads.parse()?);
    let problem = problem(case, mesh(case, size)?)?;
    let mut system = System::new(&problem)?;
    let tangent = system.assemble(&problem, &State::rest(&problem), true)?;
    let pattern = &system.unknowns.pattern;
    let mut factors = [
        (Cholesky::for_threads(pattern, 1)?, f64::INFINITY),
        (Cholesky::for_threads(pattern, threads)?, f64::INFINITY),
    ];
    for _ in 0..ROUNDS {
        for (factor, least) in &mut factors {
            let clock = Instant::now();
            factor.refactor(pattern, &tangent.values)?;
            *least = least.min(clock.elapsed().as_secs_f64());
        }
    }
    let [one, several] = factors.map(|(_, least)| least);
    let line = json!({
        "problem": case.name(),
        "size": size,
        "dof_u": pattern.size(),
        "one_thread_ms": one * 1e3,
        "threads": threads,
        "threads_ms": several * 1e3,
    });
    println!("{line}");
    println!("figure factor.{}{size} {:.4}", case.name(), one / several);
    Ok(())
}
