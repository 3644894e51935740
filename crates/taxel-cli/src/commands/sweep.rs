//! `taxel sweep`: many designs of a sensor.

use taxel::shown;

use taxel_files::study::beside;
use taxel_study::store::Store;
use taxel_study::study::{Row, Status};
use taxel_study::{figures, sweep};

use crate::arguments::{Format, Sweep};
use crate::commands::study;
use crate::outputs;
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Sweep) -> Result<Done, Stop> {
    let targets = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    let plot = arguments.plot.as_ref();
    let (read, text) = study::open(&arguments.study, &targets, plot, existing)?;
    let list = if read.sweep.is_list() {
        Some(files::text(&beside(&text.path, &read.sweep.plan))?)
    } else {
        None
    };
    let points = sweep::designs(&read, list.as_deref())?;
    let store = opened(arguments, &read, &text.text, points.len())?;
    let shard = match &arguments.shard {
        None => None,
        Some(shard) => Some(part(shard, arguments.shards)?),
    };
    let only_kept = arguments.merge || arguments.status;
    let wanted = |block: usize| match shard {
        _ if only_kept => false,
        Some([part, parts]) => block % parts == part,
        None => true,
    };
    let block = store.as_ref().map_or(1, |store| store.block);
    if arguments.merge
        && let Some(store) = &store
    {
        store.remove_left_behind();
    }
    let mine = |index: usize| wanted(index / block);
    let expected = match shard {
        Some(_) => (0..points.len()).filter(|index| mine(*index)).count(),
        None => points.len(),
    };
    let (found, stopped) = study::running(&read, "sweeping", expected, store, |runner| {
        let rows = runner.some_rows(&points, &wanted)?;
        Ok((rows, (runner.stop)()))
    })?;
    if let Some([part, parts]) = shard {
        let missing = (0..found.len())
            .filter(|index| mine(*index) && found[*index].is_none())
            .count();
        if missing > 0 {
            note!(
                "note: stopped; {missing} of {expected} designs of part {part}/{parts} are missing"
            );
            return Ok(Done::WithLosses);
        }
        return Ok(Done::Complete);
    }
    let asked = found.len();
    let rows: Vec<Row> = found.into_iter().flatten().collect();
    let missing = asked - rows.len();
    if arguments.status {
        let failed = rows.iter().filter(|row| row.status != Status::Done).count();
        outputs::print(&format!(
            "done {}\nfailed {failed}\nmissing {missing}\n",
            rows.len() - failed
        ))?;
        return Ok(if missing > 0 {
            Done::WithLosses
        } else {
            Done::Complete
        });
    }
    if rows.is_empty() {
        note!("note: none of {asked} designs is there; nothing was written");
        return Ok(Done::WithLosses);
    }
    let seed = read.sweep.seed;
    let answer = study::sweep_of(&read, arguments.format, seed, &rows);
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    study::plot(
        arguments.plot.as_ref(),
        existing,
        &read.name,
        || figures::sweep(&read, &rows),
        || study::sweep_of(&read, Format::Table, seed, &rows),
    )?;
    study::tell_ways(&read, &rows);
    study::tell_reasons(&rows);
    if missing > 0 {
        let why = if stopped { "stopped" } else { "incomplete" };
        note!("note: {why}: {missing} of {asked} designs are missing");
        return Ok(Done::WithLosses);
    }
    if rows.iter().all(|row| row.status != Status::Done) {
        return Err(Stop::Failed(format!("all {asked} designs failed")));
    }
    Ok(Done::Complete)
}

/// The store that is named, if one is.
fn opened(
    arguments: &Sweep,
    read: &taxel_study::study::Study,
    text: &str,
    designs: usize,
) -> Result<Option<Store>, Stop> {
    let Some(folder) = &arguments.store else {
        return Ok(None);
    };
    let only_kept = arguments.merge || arguments.status;
    if only_kept && !folder.join("manifest.json").exists() {
        let message = format!("--store {}: there is no store", shown::path(folder));
        return Err(Stop::WrongInput(message));
    }
    study::store(folder, read, text, designs).map(Some)
}

/// Part and number of parts of `--shard`.
fn part(text: &str, parts: Option<usize>) -> Result<[usize; 2], Stop> {
    let wrong = |message: String| {
        let help = "write such as --shard 3/16 (parts 0 to 15), or --shard auto in an array job";
        Err(Stop::WrongInput(format!(
            "--shard {text}: {message}\nhelp: {help}"
        )))
    };
    let of_environment =
        |name: &str| -> Option<usize> { std::env::var(name).ok()?.trim().parse().ok() };
    let found = if text == "auto" {
        let slurm = of_environment("SLURM_ARRAY_TASK_ID").map(|task| {
            // An array may begin at another number than zero.
            let first = of_environment("SLURM_ARRAY_TASK_MIN").unwrap_or(0);
            (
                task.checked_sub(first),
                of_environment("SLURM_ARRAY_TASK_COUNT"),
            )
        });
        let kubernetes = of_environment("JOB_COMPLETION_INDEX").map(|index| (Some(index), None));
        let pbs = of_environment("PBS_ARRAY_INDEX").map(|index| (Some(index), None));
        let Some((part, counted)) = slurm.or(kubernetes).or(pbs) else {
            return wrong(String::from("no array job is in the environment"));
        };
        (part, parts.or(counted))
    } else {
        let numbers = text.split_once('/');
        let read = |text: &str| text.trim().parse::<usize>().ok();
        numbers.map_or((None, None), |(part, parts)| (read(part), read(parts)))
    };
    match found {
        (Some(_), None) if text == "auto" => wrong(String::from(
            "the number of parts is not in the environment: give --shards N",
        )),
        (Some(part), Some(parts)) if part < parts => Ok([part, parts]),
        (Some(part), Some(parts)) => wrong(format!("part {part} is not below {parts}")),
        _ => wrong(String::from("is no part of N")),
    }
}
