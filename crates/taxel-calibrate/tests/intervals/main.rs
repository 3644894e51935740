//! Intervals hold the truth as often as they say: every number that a command prints with an
//! interval, on synthetic benches of known truth.
//!
//! The whole table, some ten minutes:
//! `cargo test --release -p taxel-calibrate --test intervals -- --ignored --nocapture`
//! More benches of one kind settle whether a share is low by chance: `TAXEL_BENCHES=2000` and
//! `TAXEL_CASE="P3, lone"`, the beginning of its name; `TAXEL_CASE=rig` has the faults that a rig adds.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::print_stdout, reason = "the long form prints its table")]

mod benches;
mod positions;
#[path = "../tables/mod.rs"]
mod tables;
mod tally;
mod trained;

use tally::Case;

/// Benches of the long form.
const BENCHES: u64 = 400;
/// Benches of the short one: a number that is wrong in most of its intervals is found.
const FEW: u64 = 6;

fn cases() -> impl Iterator<Item = Case> {
    benches::all()
        .into_iter()
        .chain(benches::on_rigs())
        .chain(positions::all())
        .chain(trained::all())
}

/// The numbers of a case that hold the truth too rarely.
fn short_of(case: &Case, benches: u64, print: bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for (name, count) in case.counted(benches) {
        let row = format!(
            "| {} | {name} | {} of {} | {:.1} % |",
            case.name,
            count.held,
            count.printed,
            count.percent()
        );
        if print {
            println!("{row}");
        }
        if count.falls_short(benches, case.reached) {
            wrong.push(row);
        }
    }
    wrong
}

#[test]
#[ignore = "ten minutes: the documented long form"]
fn the_table_of_all_intervals() {
    let benches = std::env::var("TAXEL_BENCHES");
    let benches = benches.map_or(BENCHES, |count| count.parse().unwrap());
    let only = std::env::var("TAXEL_CASE").unwrap_or_default();
    println!("| bench | number | held | |\n|---|---|---|---|");
    let wrong: Vec<String> = cases()
        .filter(|case| case.name.starts_with(&only))
        .flat_map(|case| short_of(&case, benches, true))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_interval_is_far_off() {
    let short = cases().filter(|case| case.short);
    let wrong: Vec<String> = short.flat_map(|case| short_of(&case, FEW, false)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A normal sweep alone prints no stiffness along axes that no gauge read, and no `NaN`.
#[test]
fn a_normal_sweep_prints_only_what_was_read() {
    let text = benches::pressed_only();
    assert!(text.contains("stiffness_zz = "), "{text}");
    for other in ["stiffness_x", "stiffness_y", "stiffness_zx", "NaN", "inf"] {
        assert!(!text.contains(other), "{other}: {text}");
    }
}
