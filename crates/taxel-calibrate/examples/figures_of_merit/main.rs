//! Figures of merit: what estimation reaches on simulated devices, or what trained
//! maps reach on recordings of a pressed array, measured on blocks of time that
//! training did not see.
//!
//! `cargo run --release -p taxel-calibrate --example figures_of_merit [-- FOLDER [--figure FILE.html]]`
//!
//! FOLDER is searched for folders with `sensor.csv` and `states.csv`. Runs are
//! distinguished by their content: presses all over a plane are a position run,
//! a moving probe with a scale is a force run; force runs of the same number of
//! channels belong together.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod live;
mod report;
mod simulated;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use taxel_calibrate::training::{Series, Session};

/// A run with the path that names it.
struct Run {
    name: String,
    path: PathBuf,
    session: Session,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.as_slice() {
        [] => simulated::all().map_err(|error| error.to_string()),
        [folder] => run(Path::new(folder), None),
        [folder, flag, file] if flag == "--figure" => run(Path::new(folder), Some(file)),
        _ => Err(String::from(
            "usage: figures_of_merit [FOLDER [--figure FILE.html]]",
        )),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

fn run(folder: &Path, figure: Option<&str>) -> Result<(), String> {
    let mut runs = Vec::new();
    for path in folders(folder)? {
        runs.push(read(folder, &path)?);
    }
    if runs.is_empty() {
        return Err(format!(
            "{}: no folder with sensor.csv and states.csv in it",
            taxel::shown::path(folder)
        ));
    }
    let page = report::all(&runs)?;
    if let Some(file) = figure {
        fs::write(file, page.html()).map_err(|error| format!("{file}: {error}"))?;
    }
    Ok(())
}

/// Folders below `folder` that hold a recording, in the order of their names.
fn folders(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries =
        fs::read_dir(folder).map_err(|e| format!("{}: {e}", taxel::shown::path(folder)))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    paths.sort();
    let mut found = Vec::new();
    if folder.join("sensor.csv").is_file() && folder.join("states.csv").is_file() {
        found.push(folder.to_owned());
    }
    for path in paths.into_iter().filter(|path| path.is_dir()) {
        found.extend(folders(&path)?);
    }
    Ok(found)
}

fn read(root: &Path, path: &Path) -> Result<Run, String> {
    let series = |name: &str| {
        let file = path.join(name);
        let text =
            fs::read_to_string(&file).map_err(|e| format!("{}: {e}", taxel::shown::path(&file)))?;
        Series::parse(&taxel::shown::path(&file), &text).map_err(|error| error.to_string())
    };
    let (sensor, stage) = (series("sensor.csv")?, series("states.csv")?);
    let file = taxel::shown::path(&path.join("states.csv"));
    let name = path.strip_prefix(root).unwrap_or(path);
    Ok(Run {
        name: taxel::shown::path(name),
        path: path.to_owned(),
        session: Session::new(&file, sensor, &stage).map_err(|error| error.to_string())?,
    })
}
