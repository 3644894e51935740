//! Kinds of skins: trains on runs of each and judges what live says of a further one, beside plain regressions.
//!
//! `cargo run --release -p taxel-calibrate --example skins -- [--one-run] [--seeds 1,2] [--kinds few,strip] [FOLDER…]`
//!
//! Without a folder the kinds of `kinds.rs` (1024 channels with `--kinds huge` alone), three runs each, and further runs: alike, with a wider probe, and with
//! faster presses. A folder has `sensor.toml`, runs to train on in `runs/` and one more in `next/`, as
//! `--write FOLDER` writes them. `--one-run` trains on the first run alone. A row for each: of the force (N), of its
//! components and of the position (mm) the root mean square error over the further run of the best plain regression
//! (the one that turns out best on it) and of the program, and the share within the 95 % intervals; then what
//! training stated of held-out readings, frames in which a channel is called wrong, seconds, and the largest memory
//! of the process so far.

mod baseline;
mod kinds;
mod table;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{env, fs};

use baseline::Inputs;
use kinds::{Further, HUGE, KINDS, Kind, Skin};
use table::{REST, TARGETS, Table, live};
use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainingFile, train,
};

type Failed = Box<dyn std::error::Error>;

/// What is trained on, and what is judged.
struct Task {
    name: String,
    sensor: String,
    runs: Vec<TrainingFile>,
    further: Vec<(&'static str, String)>,
}

impl Task {
    fn of_folder(folder: &Path) -> Result<Self, Failed> {
        let files = |name: &str| -> Result<Vec<TrainingFile>, Failed> {
            let entries = fs::read_dir(folder.join(name))?.map(|entry| entry.map(|e| e.path()));
            let mut paths: Vec<PathBuf> = entries.collect::<Result<_, _>>()?;
            paths.sort();
            let file = |path: PathBuf| -> Result<TrainingFile, Failed> {
                let (text, name) = (
                    fs::read_to_string(&path)?,
                    path.to_string_lossy().into_owned(),
                );
                Ok(TrainingFile { text, name })
            };
            paths.into_iter().map(file).collect()
        };
        let further = files("next")?.into_iter().map(|file| ("alike", file.text));
        Ok(Self {
            name: folder
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            sensor: fs::read_to_string(folder.join("sensor.toml"))?,
            runs: files("runs")?,
            further: further.collect(),
        })
    }

    fn of_kind(skin: &Skin, seed: u64) -> Self {
        let run = |number: u64| TrainingFile {
            name: format!("run{number}.csv"),
            text: skin.run(number, Further::Alike),
        };
        Self {
            name: format!("{} {seed}", skin.kind.name),
            sensor: skin.sensor(),
            runs: (1..=3).map(run).collect(),
            further: vec![
                ("alike", skin.run(4, Further::Alike)),
                ("probe", skin.run(5, Further::Probe)),
                ("speed", skin.run(6, Further::Speed)),
            ],
        }
    }

    fn write(&self, folder: &Path) -> Result<(), Failed> {
        let folder = folder.join(self.name.replace(' ', "_"));
        for sub in ["runs", "next"] {
            fs::create_dir_all(folder.join(sub))?;
        }
        fs::write(folder.join("sensor.toml"), &self.sensor)?;
        for file in &self.runs {
            fs::write(folder.join("runs").join(&file.name), &file.text)?;
        }
        Ok(fs::write(
            folder.join("next/alike.csv"),
            &self.further[0].1,
        )?)
    }
}

/// Largest memory of this process so far, GB; zero where the system does not say.
fn memory() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) * 1024e-9
}

const PROVENANCE: Provenance<'static> = Provenance {
    version: "0",
    date: "2026-01-01",
    data: "runs",
    data_hash: "0",
};

/// Rows of the table of a task, and for each row the errors of the force and of the position over the best plain ones.
fn judged(task: &Task, remarks: bool) -> Result<(String, Vec<f64>), Failed> {
    let start = Instant::now();
    let sensor = Sensor::parse("sensor.toml", &task.sensor)?;
    let named = NamedSensor {
        name: "sensor.toml",
        text: &task.sensor,
        sensor: &sensor,
    };
    let groups: Vec<Vec<TrainingFile>> = task.runs.iter().map(|file| vec![file.clone()]).collect();
    let outcome = train(&named, &groups, &CalibrateOptions::default())?;
    let seconds = start.elapsed().as_secs_f64();
    let memory = memory();
    let file = outcome.to_toml(&PROVENANCE);
    let calibrated = CalibrationFile::parse("c.toml", &file)?.apply("c.toml", &named)?;
    let array = calibrated.trained()?;
    let held_out = &outcome.outcome.hold_out;
    let held_out: Vec<String> = held_out
        .iter()
        .map(|one| format!("{:.3}", one.root_mean_square))
        .collect();
    let runs: Vec<Table> = task
        .runs
        .iter()
        .map(|file| Table::of(&file.text))
        .collect::<Result<_, _>>()?;
    let inputs: Vec<&Inputs> = runs.iter().map(|run| &run.inputs).collect();
    let (mut text, mut ratios) = (String::new(), Vec::new());
    if remarks {
        for remark in &outcome.outcome.remarks {
            writeln!(text, "  {remark}")?;
        }
    }
    for (further, table) in &task.further {
        let table = Table::of(table)?;
        let mut estimator = ArrayEstimator::new(calibrated.device()?.reader(&array.stream())?);
        estimator.begin_unasked_rest_capture(REST);
        let (found, wrong) = live(&mut estimator, &table)?;
        write!(text, "{:<18} {further:<6}", task.name)?;
        let plain = |name: &str| {
            let targets: Vec<Vec<f64>> = runs
                .iter()
                .filter_map(|run| run.target(name).cloned())
                .collect();
            baseline::estimates(&inputs, &targets, &table.inputs)
        };
        let values = |at: usize| {
            found[at]
                .iter()
                .map(|[value, _]| *value)
                .collect::<Vec<f64>>()
        };
        for (at, (name, _)) in TARGETS.iter().enumerate().take(3) {
            if table.target(name).is_none() {
                continue;
            }
            let (best, error) = baseline::best(&plain(name), |own| table.error(name, own));
            let own = table.error(name, &values(at));
            let held = table.held(name, &found[at]);
            write!(text, " | {name} {error:.3} ({best}) {own:.3} {held:.1} %")?;
            if *further == "alike" && at == 0 {
                ratios.push(own / error);
            }
        }
        if table
            .target("x")
            .is_some_and(|x| x.iter().any(|x| x.is_finite()))
        {
            let [xs, ys] = ["x", "y"].map(plain);
            let both: Vec<(&str, [Vec<f64>; 2])> = xs
                .into_iter()
                .zip(ys)
                .map(|((name, x), (_, y))| (name, [x, y]))
                .collect();
            let error = |[x, y]: &[Vec<f64>; 2]| table.error("x", x).hypot(table.error("y", y));
            let errors = both.iter().map(|(name, own)| (*name, error(own)));
            let (best, least) = errors
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or(("none", f64::NAN));
            let own = error(&[values(3), values(4)]);
            let held = 0.5 * (table.held("x", &found[3]) + table.held("y", &found[4]));
            write!(text, " | position {least:.2} ({best}) {own:.2} {held:.1} %")?;
            if *further == "alike" {
                ratios.push(own / least);
            }
        }
        let frames = table.frames.len();
        writeln!(
            text,
            " | {} N | stated {} | wrong {wrong} of {frames} | {seconds:.0} s {memory:.2} GB",
            (10.0 * table.top).round() / 10.0,
            held_out.join(" ")
        )?;
    }
    Ok((text, ratios))
}

#[allow(clippy::print_stdout, reason = "it is a program")]
fn main() -> Result<(), Failed> {
    let (mut seeds, mut names, mut one, mut remarks) = (vec![1], Vec::new(), false, false);
    let (mut write, mut folders) = (None, Vec::new());
    let mut arguments = env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--one-run" => one = true,
            "--remarks" => remarks = true,
            "--seeds" => {
                seeds = value()?
                    .split(',')
                    .map(str::parse)
                    .collect::<Result<Vec<u64>, _>>()?;
            }
            "--kinds" => names = value()?.split(',').map(str::to_owned).collect(),
            "--write" => write = Some(PathBuf::from(value()?)),
            folder => folders.push(PathBuf::from(folder)),
        }
    }
    let mut tasks: Vec<Task> = folders
        .iter()
        .map(|folder| Task::of_folder(folder))
        .collect::<Result<_, _>>()?;
    if folders.is_empty() {
        let named = |kind: &Kind| names.iter().any(|name| name == kind.name);
        let kinds = KINDS
            .into_iter()
            .filter(|kind| names.is_empty() || named(kind));
        for kind in kinds.chain(Some(HUGE).filter(named)) {
            tasks.extend(
                seeds
                    .iter()
                    .map(|seed| Task::of_kind(&Skin::new(kind, *seed), *seed)),
            );
        }
    }
    let mut all = Vec::new();
    for mut task in tasks {
        if let Some(folder) = &write {
            task.write(folder)?;
            continue;
        }
        if one {
            task.runs.truncate(1);
        }
        match judged(&task, remarks) {
            Ok((text, ratios)) => {
                print!("{text}");
                all.extend(ratios);
            }
            Err(error) => println!("{:<18} {error}", task.name),
        }
    }
    let mean = all.iter().map(|ratio: &f64| ratio.ln()).sum::<f64>() / all.len().max(1) as f64;
    let worse = all.iter().filter(|ratio| **ratio > 1.1).count();
    println!(
        "of {} forces and positions {worse} err by more than 1.1 of the best plain regression, in the geometric mean {:.3} of it",
        all.len(),
        mean.exp()
    );
    Ok(())
}
