//! `taxel verify`: the solver of soft solids beside what is known from outside.

mod report;

use std::path::Path;
use std::time::Instant;

use taxel::table;
use taxel_fem::solver::newton::Continue;
use taxel_fem::verify::{self, Effort, Event, Outcome};

use crate::arguments::{ReportFormat, Verify};
use crate::interrupt::Interrupt;
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Verify) -> Result<Done, Stop> {
    let format = arguments.output.as_deref().map(format).transpose()?;
    let effort = if arguments.short {
        Effort::Short
    } else {
        Effort::Full
    };
    let names: Vec<&str> = arguments.cases.iter().map(String::as_str).collect();
    let asked = verify::chosen(&names)
        .map_err(|unknown| Stop::WrongInput(unknown.to_string()))?
        .len();
    let interrupt = Interrupt::listen();
    let start = Instant::now();
    let mut begun = start;
    let mut finished: Vec<Outcome> = Vec::new();
    let mut trouble = Ok(Done::Complete);
    let outcomes = verify::run(effort, &names, &mut |event| {
        match event {
            Event::Begins { entry, done } => {
                begun = Instant::now();
                let left = left(start.elapsed().as_secs_f64(), done);
                eprintln!("{:3.0} %  {} {}{left}", 100.0 * done, entry.id, entry.title);
            }
            Event::Ended(outcome) => {
                if let Ok(case) = &mut outcome.result {
                    case.seconds = Some(begun.elapsed().as_secs_f64());
                }
                let shown = files::write(None, &report::text(outcome));
                finished.push(outcome.clone());
                let written = match (&arguments.output, format) {
                    (Some(path), Some(format)) => write(path, format, &finished, asked),
                    _ => Ok(Done::Complete),
                };
                trouble = shown.and(written);
            }
        }
        // Without a place for its report the rest would be solved for nothing.
        if interrupt.asked() || trouble.is_err() {
            Continue::Stop
        } else {
            Continue::Yes
        }
    });
    let outcomes = outcomes.map_err(|unknown| Stop::WrongInput(unknown.to_string()))?;
    trouble?;
    let stopped = outcomes.len() < asked;
    if stopped {
        eprintln!("note: stopped after {} of {asked} cases", outcomes.len());
    }
    let failed: Vec<&str> = outcomes
        .iter()
        .filter(|outcome| !outcome.holds())
        .map(|outcome| outcome.entry.id)
        .collect();
    if !failed.is_empty() {
        let message = format!("not within tolerance: {}", failed.join(", "));
        return Err(Stop::Failed(message));
    }
    Ok(if stopped {
        Done::WithLosses
    } else {
        Done::Complete
    })
}

/// Estimated time of the rest; empty as long as too little is done for an estimate.
fn left(elapsed: f64, done: f64) -> String {
    if done < 0.05 {
        return String::new();
    }
    format!("  (about {:.0} s left)", elapsed * (1.0 - done) / done)
}

fn write(
    path: &Path,
    format: ReportFormat,
    outcomes: &[Outcome],
    asked: usize,
) -> Result<Done, Stop> {
    let text = match format {
        ReportFormat::Html => report::html(outcomes, asked),
        ReportFormat::Json => table::json(&report::json(outcomes, asked)),
    };
    files::write(Some(path), &text)
}

fn format(path: &Path) -> Result<ReportFormat, Stop> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("html") => Ok(ReportFormat::Html),
        Some("json") => Ok(ReportFormat::Json),
        _ => {
            let place = path.display();
            let message = format!("--output {place}: must end in .html or .json");
            Err(Stop::WrongInput(message))
        }
    }
}
