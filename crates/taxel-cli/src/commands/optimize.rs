//! `taxel optimize`: the best design of a study, or the best places of elements.

use serde_json::{Map, Value};
use taxel::shown;
use taxel::table::{self, Cell, Column, Format as TableFormat};
use taxel_study::study::{Row, Study};
use taxel_study::{figures, optimise, place};

use crate::arguments::{Format, Optimize};
use crate::commands::study;
use crate::outputs;
use crate::{Done, Stop};

pub(crate) fn run(arguments: &Optimize) -> Result<Done, Stop> {
    let targets = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
        ("--best", arguments.best.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    let plot = arguments.plot.as_ref();
    let (mut read, text) = study::open(&arguments.study, &targets, plot, existing)?;
    if let Some(seed) = arguments.seed {
        read.optimize.seed = seed;
        if let Some(place) = &mut read.place {
            place.seed = Some(seed);
        }
    }
    if read.place.is_some() {
        return places(arguments, &read);
    }
    designs(arguments, &read, &text.text)
}

fn designs(arguments: &Optimize, read: &Study, text: &str) -> Result<Done, Stop> {
    optimise::possible(read, &shown::path(&arguments.study))?;
    let existing = arguments.overwrite.existing();
    let store = match &arguments.store {
        None => None,
        Some(folder) => Some(study::store(
            folder,
            read,
            text,
            read.optimize.population * 64,
        )?),
    };
    let expected = read.optimize.evaluations;
    let (found, checked) = study::running(read, "optimising", expected, store, |runner| {
        let found = optimise::optimise(runner)?;
        let checked = match arguments.check {
            Some(points) if !found.stopped => Some(optimise::check(runner, &found, points)?),
            _ => None,
        };
        Ok((found, checked))
    })?;
    let Some(best) = found.front.first() else {
        return none(read, &found);
    };
    let rows: Vec<Row> = found.front.iter().map(|one| one.row.clone()).collect();
    let seed = read.optimize.seed;
    let answer = study::table_of(read, arguments.format, seed, &rows);
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    study::plot(
        arguments.plot.as_ref(),
        existing,
        &read.name,
        || figures::optimum(read, &found),
        || study::table_of(read, Format::Table, seed, &rows),
    )?;
    if let Some(path) = &arguments.best {
        let (sensor, _) = read.text_of(&best.row.point);
        outputs::write(Some(path), existing, &sensor)?;
    }
    let several = read.objectives.len() > 1;
    if several {
        note!(
            "note: {} designs that no other one dominates, of {} evaluations; the best of {} is the first",
            rows.len(),
            found.evaluations,
            read.objectives[0].name
        );
    } else {
        note!("note: the best of {} evaluations", found.evaluations);
    }
    study::tell_ways(read, &rows);
    for one in optimise::active(read, best) {
        note!("note: {one}");
    }
    if let Some(checked) = checked {
        let points = arguments.check.unwrap_or(0);
        note!(
            "note: {} of {points} random designs fulfil the constraints; {} of them are better",
            checked.feasible,
            checked.lost_to
        );
        if checked.lost_to > 0 {
            return Err(Stop::Failed(String::from(
                "the optimisation lost against random designs\nhelp: raise evaluations or population in [optimize]",
            )));
        }
    }
    if found.stopped {
        note!(
            "note: stopped after {} of {expected} evaluations",
            found.evaluations
        );
        return Ok(Done::WithLosses);
    }
    Ok(Done::Complete)
}

/// No design fulfils all constraints: the one that violates least, and what it violates.
fn none(read: &Study, found: &optimise::Optimum) -> Result<Done, Stop> {
    let Some(nearest) = &found.nearest else {
        return Err(Stop::Failed(String::from(
            "stopped before the first design",
        )));
    };
    let mut lines = vec![String::from("no design fulfils all constraints")];
    if nearest.violation.is_finite() {
        let (columns, cells) = taxel_study::sweep::all(read, std::slice::from_ref(&nearest.row));
        let table = table::render(TableFormat::Table, &Map::new(), &columns, &cells);
        lines.push(format!(
            "the one that violates least:\n{}",
            table.trim_end()
        ));
        let violations = read.violations(&nearest.row);
        let names: Vec<String> = read
            .constraints
            .iter()
            .zip(violations)
            .filter(|(_, violation)| *violation > optimise::SLACK)
            .map(|((name, _), violation)| format!("{name} by {:.3} %", 100.0 * violation))
            .collect();
        lines.push(format!("it violates: {}", names.join(", ")));
        lines.push(String::from(
            "help: these exclude each other or the ranges; loosen one",
        ));
    } else {
        lines.push(String::from(
            "and none has all its answers; the commonest reasons:",
        ));
        let rows: Vec<Row> = found.dominated.iter().map(|one| one.row.clone()).collect();
        let rows = if rows.is_empty() {
            vec![nearest.row.clone()]
        } else {
            rows
        };
        for (count, reason) in taxel_study::sweep::reasons(&rows).into_iter().take(5) {
            lines.push(format!("{count} of {}: {reason}", rows.len()));
        }
    }
    Err(Stop::Failed(lines.join("\n")))
}

fn places(arguments: &Optimize, read: &Study) -> Result<Done, Stop> {
    if arguments.store.is_some() || arguments.best.is_some() || arguments.check.is_some() {
        return Err(Stop::WrongInput(String::from(
            "--store, --best and --check belong to designs; a study with [place] chooses places\nhelp: leave them out",
        )));
    }
    let existing = arguments.overwrite.existing();
    crate::interrupt::leave_nothing_unfinished();
    let found = place::place(read, arguments.exchange)?;
    if found.best.is_empty() {
        return Err(Stop::Failed(format!(
            "no_information: none of {} choices tells the place of a contact everywhere\nhelp: choose more elements, or a smaller pitch",
            found.tried
        )));
    }
    let columns = [
        Column::plain("rank"),
        Column::plain("places"),
        Column::new("place_rms", "mm", 1e-3, "m", 4),
        Column::new("place_worst", "mm", 1e-3, "m", 4),
        Column::new("mean_half_log_det", "", 1.0, "", 4),
    ];
    let rows: Vec<Vec<Cell>> = found
        .best
        .iter()
        .enumerate()
        .map(|(rank, choice)| {
            let names: Vec<String> = choice.chosen.iter().map(ToString::to_string).collect();
            vec![
                Cell::Whole(rank as u64 + 1),
                Cell::from(names.join(" ")),
                Cell::Number(choice.rms),
                Cell::Number(choice.worst),
                Cell::Number(choice.half_log_det),
            ]
        })
        .collect();
    let seed = read
        .place
        .as_ref()
        .and_then(|place| place.seed)
        .unwrap_or(1);
    let mut about = study::about(read, seed);
    about.insert("choices_tried".into(), Value::from(found.tried));
    let answer = table::render(arguments.format.into(), &about, &columns, &rows);
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    study::plot(
        arguments.plot.as_ref(),
        existing,
        &read.name,
        || figures::placing(read, &found),
        || table::render(TableFormat::Table, &about, &columns, &rows),
    )?;
    let how = if found.exhaustive {
        "all choices"
    } else {
        "by exchange from 20 random starts"
    };
    note!("note: {} choices compared, {how}", found.tried);
    Ok(Done::Complete)
}
