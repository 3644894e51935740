//! `taxel tolerance`: what becomes of the answers of devices that are not made as drawn.

use taxel::table::{self, Cell, Column};
use taxel_study::figures;
use taxel_study::study::Study;
use taxel_study::tolerance::{self, NoTolerance, Tolerance};

use crate::arguments::{Format, Tolerance as Arguments};
use crate::commands::study;
use crate::outputs;
use crate::{Done, Stop};

pub(crate) fn run(arguments: &Arguments) -> Result<Done, Stop> {
    let targets = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    let plot = arguments.plot.as_ref();
    let (mut read, text) = study::open(&arguments.study, &targets, plot, existing)?;
    if let Some(seed) = arguments.seed {
        read.tolerance.seed = seed;
    }
    if let Some(after) = arguments.after {
        read.tolerance.after = after.into();
    }
    let interrupt = crate::interrupt::Interrupt::listen();
    let progress = std::sync::Mutex::new(crate::progress::Progress::new("making devices"));
    let tell = |fraction: f64| {
        if let Ok(mut progress) = progress.try_lock() {
            progress.at(fraction);
        }
    };
    let found = tolerance::tolerance(&read, &|| interrupt.asked(), &tell);
    if let Ok(mut progress) = progress.lock() {
        progress.end();
    }
    let found = match found {
        Ok(found) => found,
        Err(NoTolerance::Stopped) => {
            note!("note: stopped before the end; nothing was written");
            return Ok(Done::WithLosses);
        }
        Err(error) => return Err(Stop::WrongInput(format!("{}: {error}", text.name))),
    };
    let seed = read.tolerance.seed;
    let mut about = study::about(&read, seed);
    let after = tolerance::after_name(read.tolerance.after);
    about.insert("after".into(), after.into());
    about.insert("devices".into(), found.devices.into());
    about.insert("failed".into(), found.failed.into());
    let (columns, rows) = table_of(&read, &found);
    let answer = table::render(arguments.format.into(), &about, &columns, &rows);
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    study::plot(
        arguments.plot.as_ref(),
        existing,
        &read.name,
        || figures::tolerance(&read, &found),
        || table::render(Format::Table.into(), &about, &columns, &rows),
    )?;
    for (name, cut) in &found.truncated {
        note!(
            "note: the range of {name} cuts off {:.3} % of its spread",
            100.0 * cut
        );
    }
    if found.failed > 0 {
        note!(
            "note: {} of {} devices failed: they count as bad, and variance shares are not defined",
            found.failed,
            found.devices
        );
        for (count, reason) in found.reasons.iter().take(5) {
            note!("note: {count} devices: {reason}");
        }
    }
    if found.correlated {
        note!("note: spreads are correlated: there are no variance shares");
    }
    if let Some(first) = found.tightened.first() {
        note!("note: tighten {} first", first.variable);
    }
    if found.failed == found.devices {
        return Err(Stop::Failed(String::from("every made device failed")));
    }
    Ok(Done::Complete)
}

/// One row for each number: of which answer, what, of which spread, with its interval.
fn table_of(read: &Study, found: &Tolerance) -> (Vec<Column>, Vec<Vec<Cell>>) {
    let number = |name: &str| Column::new(name, "", 1.0, "", 6);
    let columns = vec![
        Column::plain("answer"),
        Column::plain("quantity"),
        Column::plain("of"),
        number("value"),
        Column::plain("unit"),
        number("standard_error"),
        number("low_95"),
        number("high_95"),
    ];
    let mut rows = Vec::new();
    let none = || Cell::from("");
    let mut estimate = |answer: &str, what: &str, of: &str, found: &tolerance::Estimate| {
        rows.push(vec![
            Cell::from(answer.to_owned()),
            Cell::from(what.to_owned()),
            Cell::from(of.to_owned()),
            Cell::Number(found.value),
            none(),
            Cell::Number(found.error),
            Cell::Number(found.interval[0]),
            Cell::Number(found.interval[1]),
        ]);
    };
    if let Some(yields) = &found.yields {
        estimate("all limits", "yield", "", yields);
    }
    for one in &found.tightened {
        estimate(
            "all limits",
            "yield_with_spread_halved",
            &one.variable,
            &one.yields,
        );
    }
    for one in &found.answers {
        let name = &read.answers[one.answer].name;
        if let Some(yields) = &one.yields {
            estimate(name, "yield", "", yields);
        }
        for share in &one.shares {
            estimate(name, "first_order_share", &share.variable, &share.first);
            estimate(name, "total_share", &share.variable, &share.total);
        }
    }
    for one in &found.answers {
        let column = &read.answers[one.answer].column;
        let quantiles = [("quantile_5", 0), ("median", 1), ("quantile_95", 2)];
        let values = [
            ("nominal", one.nominal),
            ("mean", one.mean),
            ("deviation", one.deviation),
        ]
        .into_iter()
        .chain(quantiles.map(|(name, index)| (name, one.quantiles[index])));
        for (what, value) in values {
            rows.push(vec![
                Cell::from(column.name.clone()),
                Cell::from(what),
                none(),
                Cell::Number(value / column.scale),
                Cell::from(column.unit),
                none(),
                none(),
                none(),
            ]);
        }
    }
    (columns, rows)
}
