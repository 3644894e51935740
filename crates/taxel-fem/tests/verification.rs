//! Every case of verification, shortened.
#![allow(clippy::unwrap_used)]
// What is out of tolerance is judged by its numbers.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use taxel_fem::solver::newton::Continue;
use taxel_fem::verify::{Case, Effort, Event, run};

fn shown(case: &Case) {
    println!("{} {}: {:?}", case.id, case.title, case.mesh);
    for row in &case.quantities {
        let mark = if row.holds() { " " } else { "*" };
        println!(
            "{mark} {}: outside {:.9}, ours {:.9}, difference {:.2e} ({:?})",
            row.what,
            row.outside,
            row.ours,
            row.difference(),
            row.tolerance
        );
    }
    for refinement in &case.refinement {
        println!(
            "  {} {:?} {:?}",
            refinement.what,
            refinement.points,
            refinement.slope()
        );
    }
}

fn all_hold(effort: Effort, only: &[&str]) {
    let mut start = Instant::now();
    let outcomes = run(effort, only, &mut |event| {
        match event {
            Event::Begins { .. } => start = Instant::now(),
            Event::Ended(outcome) => {
                match &outcome.result {
                    Ok(case) => shown(case),
                    Err(failure) => println!("{}: {failure}", outcome.entry.id),
                }
                println!("  {:.2} s", start.elapsed().as_secs_f64());
            }
        }
        Continue::Yes
    });
    let outcomes = outcomes.unwrap();
    let failed: Vec<&str> = outcomes
        .iter()
        .filter(|outcome| !outcome.holds())
        .map(|outcome| outcome.entry.id)
        .collect();
    assert!(failed.is_empty(), "out of tolerance: {failed:?}");
}

/// Cases by their names (`CASES="B17 C"`), in full: `cargo test --locked -p taxel-fem --test
/// verification -- --ignored --nocapture chosen`.
#[test]
#[ignore = "for work on single cases"]
fn chosen_cases_hold_in_full() {
    let names = std::env::var("CASES").unwrap_or_default();
    all_hold(Effort::Full, &names.split_whitespace().collect::<Vec<_>>());
}

#[test]
fn all_cases_hold_in_short() {
    all_hold(Effort::Short, &[]);
}

#[test]
#[ignore = "minutes; name the cases in the variable CASES"]
fn all_cases_hold_in_full() {
    let names = std::env::var("CASES").unwrap_or_default();
    let only: Vec<&str> = names.split_whitespace().collect();
    all_hold(Effort::Full, &only);
}
