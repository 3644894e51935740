//! `taxel tolerance`: what becomes of the answers of devices that are not made as drawn.

use taxel::table;
use taxel_study::figures;
use taxel_study::tolerance::{self, NoTolerance};

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
    let all = tolerance::devices(&read);
    let store = match &arguments.store {
        None => None,
        Some(folder) => Some(study::store(folder, &read, &text.text, all)?),
    };
    let (found, computed) = study::running(&read, "making devices", all, store, |runner| {
        let found = tolerance::tolerance_by(runner)?;
        Ok((found, runner.computed))
    })?;
    let found = match found {
        Ok(found) => found,
        Err(NoTolerance::Stopped) => {
            match &arguments.store {
                None => note!("note: stopped before the end; nothing was written"),
                Some(folder) => note!(
                    "note: stopped before the end; {computed} of {all} devices were computed and are kept in {}: \
                     the same command goes on from there",
                    taxel::shown::path(folder)
                ),
            }
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
    let (columns, rows) = tolerance::table(&read, &found);
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
    if let Some(computed) = read.tolerance.computed {
        note!(
            "note: {computed} devices were computed; quadratics through them answer for all others, with the surrogate_error of \
             each answer"
        );
        for one in &found.answers {
            if one
                .surrogate_error
                .is_some_and(|error| error > 0.1 * one.deviation)
            {
                let name = &read.answers[one.answer].name;
                note!(
                    "note: the quadratic of {name} is off by more than a tenth of its deviation: compute more devices"
                );
            }
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
