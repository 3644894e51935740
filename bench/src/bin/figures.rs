//! Runs every benchmark and prints each figure beside the one written in README.md.
//!
//! `figures [--only GROUP] [--peers FOLDER] [--write]`: `GROUP` is the first word of a
//! figure's name; `FOLDER` has the runners of other solvers of solids, without it those
//! figures are not run; `--write` puts the new figures into README.md.
//!
//! Builds are made here too, so run it from this folder as README.md says. Each program
//! of one thread is kept on one core where `taskset` exists.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// A figure as README.md has it: a row of the table below `HEADING`.
struct Row {
    /// As printed by a benchmark, `group.rest`.
    name: String,
    /// `times` (more is better) or a unit of time (less is better).
    unit: String,
    written: f64,
}

const HEADING: &str = "## All figures";
/// A figure that is worse than written by more than this share is marked.
const SCATTER: f64 = 0.1;

/// Benchmarks with the group of the figures that they print.
const PROGRAMS: [(&str, &[&str]); 8] = [
    ("compare", &["run", "--release", "--bin", "compare"]),
    ("calibrate", &["run", "--release", "--bin", "calibrate"]),
    ("chain", &["run", "--release", "--bin", "chain"]),
    (
        "predict",
        &[
            "run",
            "--release",
            "--bin",
            "predict",
            "--",
            "--rows",
            "100000",
        ],
    ),
    (
        "cells",
        &[
            "run",
            "--release",
            "-p",
            "taxel-bench-solids",
            "--",
            "cells",
        ],
    ),
    (
        "designs",
        &[
            "run",
            "--release",
            "-p",
            "taxel-bench-solids",
            "--",
            "designs",
            "1000",
        ],
    ),
    (
        "factor",
        &[
            "run",
            "--release",
            "-p",
            "taxel-bench-solids",
            "--",
            "factor",
            "B",
            "12",
            "2",
        ],
    ),
    ("live", &["run", "--release", "--bin", "live_load"]),
];
/// Groups whose programs take more than one core.
const SEVERAL_CORES: [&str; 2] = ["factor", "live"];
/// Names of a benchmark in Criterion and here.
type Names = &'static [(&'static str, &'static str)];
/// Benchmarks by Criterion, each with its names there and here.
const CRITERION: [(&str, &str, Names); 3] = [
    (
        "estimator",
        "estimator",
        &[
            ("frame 8x8, press with shear", "estimator.frame_pressed"),
            ("frame 8x8, at rest", "estimator.frame_at_rest"),
            (
                "frame 8x8 with edges, press with shear",
                "estimator.frame_with_edges",
            ),
            ("estimate_unit, pressed", "estimator.estimate_unit"),
            ("linearise, pressed", "estimator.linearise"),
            ("predict, pressed", "estimator.predict"),
            (
                "frame of 64 taxels, in-plane-50um, closed form",
                "estimator.in_plane",
            ),
            (
                "frame of 64 taxels, in-plane-50um, table",
                "estimator.in_plane_table",
            ),
            (
                "frame of 8 taxels, liquid-metal-2x4, table",
                "estimator.microchannel_table",
            ),
        ],
    ),
    (
        "observer",
        "observer",
        &[
            ("tracks, events, health of 64 taxels", "observer.tracks"),
            (
                "segmentation of 64 cells, with their sums",
                "observer.contacts",
            ),
        ],
    ),
    (
        "trained",
        "trained",
        &[
            ("15 channels to position", "trained.position"),
            (
                "15 channels to force, creep of three times",
                "trained.force",
            ),
            (
                "30 channels, whole frame: position, depth, force",
                "trained.frame_30",
            ),
        ],
    ),
];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let (mut only, mut peers, mut write) = (None, None, false);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--only" => only = words.next(),
            "--peers" => peers = words.next().map(std::fs::canonicalize).transpose()?,
            "--write" => write = true,
            _ => return Err("usage: figures [--only GROUP] [--peers FOLDER] [--write]".into()),
        }
    }
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let text = std::fs::read_to_string(&readme)?;
    let rows = rows(&text)?;
    let wanted = |group: &str| only.as_deref().is_none_or(|only| only == group);

    let mut found = BTreeMap::new();
    for (group, arguments) in PROGRAMS {
        if wanted(group) {
            found.extend(printed(&cargo(arguments, !SEVERAL_CORES.contains(&group))?));
        }
    }
    for (group, bench, names) in CRITERION {
        if wanted(group) {
            cargo(&["bench", "--bench", bench], true)?;
            for (theirs, ours) in names {
                found.insert((*ours).to_owned(), criterion(theirs)?);
            }
        }
    }
    if let Some(folder) = peers.filter(|_| wanted("solids")) {
        let folder = folder.to_string_lossy();
        let mut arguments = vec!["run", "--release", "-p", "taxel-bench-solids", "--"];
        arguments.extend(["compare", &folder, "2"]);
        found.extend(printed(&cargo(&arguments, true)?));
    }
    print(&rows, &found);
    let unknown: Vec<&String> = found
        .keys()
        .filter(|name| rows.iter().all(|row| row.name != **name))
        .collect();
    if !unknown.is_empty() {
        println!("not in README.md: {unknown:?}");
    }
    if write {
        std::fs::write(&readme, replaced(&text, &found))?;
    }
    Ok(())
}

fn print(rows: &[Row], found: &BTreeMap<String, f64>) {
    println!("\n{:<28} {:>10} {:>10}  unit", "figure", "written", "now");
    for row in rows {
        let Some(now) = found.get(&row.name) else {
            println!(
                "{:<28} {:>10} {:>10}  {}",
                row.name, row.written, "not run", row.unit
            );
            continue;
        };
        let better = if row.unit == "times" {
            now / row.written
        } else {
            row.written / now
        };
        let mark = if better < 1.0 - SCATTER {
            "  WORSE"
        } else {
            ""
        };
        println!(
            "{:<28} {:>10} {:>10}  {}{mark}",
            row.name,
            row.written,
            rounded(*now),
            row.unit
        );
    }
}

/// The rows of the table of all figures: `| name | what | written | unit |`.
fn rows(text: &str) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for line in table(text) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, name, _, written, unit, ..] = cells[..] else {
            return Err(format!("{line:?} has too few cells").into());
        };
        rows.push(Row {
            name: name.trim_matches('`').to_owned(),
            unit: unit.to_owned(),
            written: written
                .parse()
                .map_err(|_| format!("{line:?}: no number"))?,
        });
    }
    Ok(rows)
}

/// The lines of the table of all figures that have one.
fn table(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().skip_while(|line| *line != HEADING).skip(1);
    lines
        .take_while(|line| !line.starts_with("## "))
        .filter(|line| line.starts_with("| `"))
}

/// The text with the new figures in its table.
fn replaced(text: &str, found: &BTreeMap<String, f64>) -> String {
    let mut text = text.to_owned();
    for line in table(&text.clone()) {
        let cells: Vec<&str> = line.split('|').collect();
        let name = cells[1].trim().trim_matches('`');
        if let Some(now) = found.get(name) {
            let now = format!(" {} ", rounded(*now));
            let mut cells = cells.clone();
            cells[3] = &now;
            text = text.replace(line, &cells.join("|"));
        }
    }
    text
}

/// Three significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Standard output of Cargo in this folder, which it prints as well.
fn cargo(arguments: &[&str], one_core: bool) -> Result<String, Box<dyn Error>> {
    let folder = env!("CARGO_MANIFEST_DIR");
    // Built on all cores, run on one.
    let build: Vec<&str> = arguments
        .iter()
        .copied()
        .take_while(|word| *word != "--")
        .collect();
    let build = match build.split_first() {
        Some((&"bench", rest)) => [&["bench", "--no-run"], rest].concat(),
        Some((_, rest)) => [&["build"], rest].concat(),
        None => Vec::new(),
    };
    let built = Command::new("cargo")
        .args(build)
        .current_dir(folder)
        .status()?;
    if !built.success() {
        return Err("the build failed".into());
    }
    let mut command = if one_core && taskset() {
        let mut command = Command::new("taskset");
        command.args(["-c", "1", "cargo"]);
        command
    } else {
        Command::new("cargo")
    };
    let output = command
        .args(arguments)
        .current_dir(folder)
        .stderr(Stdio::inherit())
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    print!("{text}");
    if output.status.success() {
        Ok(text)
    } else {
        Err(format!("cargo {} failed", arguments.join(" ")).into())
    }
}

fn taskset() -> bool {
    let version = Command::new("taskset").arg("--version").output();
    version.is_ok_and(|output| output.status.success())
        && std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1)
}

/// The lines `figure NAME VALUE`.
fn printed(text: &str) -> Vec<(String, f64)> {
    let figure = |line: &str| {
        let mut words = line.strip_prefix("figure ")?.split_whitespace();
        Some((words.next()?.to_owned(), words.next()?.parse().ok()?))
    };
    text.lines().filter_map(figure).collect()
}

/// Median of a benchmark by Criterion, us.
fn criterion(name: &str) -> Result<f64, Box<dyn Error>> {
    let folder = name.replace(['/', '\\', '?', '"', '<', '>', ':', '*', '|'], "_");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"),
        PathBuf::from,
    );
    let file = target
        .join("criterion")
        .join(folder)
        .join("new/estimates.json");
    let text = std::fs::read_to_string(&file)
        .map_err(|e| format!("{}: {e}", taxel::shown::path(&file)))?;
    let estimates: serde_json::Value = serde_json::from_str(&text)?;
    let median = estimates["median"]["point_estimate"].as_f64();
    Ok(median.ok_or("no median")? * 1e-3)
}
