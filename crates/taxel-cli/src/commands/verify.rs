//! `taxel verify`: the solver of soft solids beside what is known from outside.

mod report;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use taxel::shown;
use taxel::table;
use taxel_fem::solver::newton::Continue;
use taxel_fem::verify::{self, Effort, Event, Outcome};

use crate::arguments::{ReportFormat, Verify};
use crate::interrupt::Interrupt;
use crate::outputs::{self, Existing};
use crate::{Done, Stop};

pub(crate) fn run(arguments: &Verify) -> Result<Done, Stop> {
    let output = arguments.output.as_deref();
    let to_standard = output.is_some_and(outputs::is_standard);
    // The standard output takes one report, when all is done.
    let file = output.filter(|_| !to_standard);
    let format = file.map(format).transpose()?;
    let existing = arguments.overwrite.existing();
    outputs::check(&[("--output", arguments.output.as_ref())], &[], existing)?;
    let effort = if arguments.short {
        Effort::Short
    } else {
        Effort::Full
    };
    let names: Vec<&str> = arguments.cases.iter().map(String::as_str).collect();
    let asked = verify::chosen(&names)
        .map_err(|unknown| Stop::WrongInput(unknown.to_string()))?
        .len();
    let solved = Arc::new(AtomicUsize::new(0));
    end_when_asked(Arc::clone(&solved), asked);
    let start = Instant::now();
    let mut begun = start;
    let mut finished: Vec<Outcome> = Vec::new();
    let mut trouble = Ok(Done::Complete);
    let outcomes = verify::run(effort, &names, &mut |event| {
        match event {
            Event::Begins { entry, done } => {
                begun = Instant::now();
                let left = left(start.elapsed().as_secs_f64(), done);
                note!("{:3.0} %  {} {}{left}", 100.0 * done, entry.id, entry.title);
            }
            Event::Ended(outcome) => {
                if let Ok(case) = &mut outcome.result {
                    case.seconds = Some(begun.elapsed().as_secs_f64());
                }
                let shown = outputs::print_beside(output, &report::text(outcome));
                // The report of the case before is this run's own.
                let existing = match finished.as_slice() {
                    [] => existing,
                    _ => Existing::Replaced,
                };
                finished.push(outcome.clone());
                let written = match (file, format) {
                    (Some(path), Some(format)) => write(path, existing, format, &finished, asked),
                    _ => Ok(Done::Complete),
                };
                trouble = shown.and(written);
                solved.store(finished.len(), Ordering::Relaxed);
            }
        }
        // Without a place for its report the rest would be solved for nothing.
        if trouble.is_err() {
            Continue::Stop
        } else {
            Continue::Yes
        }
    });
    let outcomes = outcomes.map_err(|unknown| Stop::WrongInput(unknown.to_string()))?;
    trouble?;
    if to_standard {
        outputs::print(&json(&finished, asked))?;
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
    Ok(Done::Complete)
}

/// Ends the program at once when the user asks: a case may take minutes, and what is
/// done is written.
fn end_when_asked(solved: Arc<AtomicUsize>, asked: usize) {
    Interrupt::listen_with(move |_| {
        outputs::remove_unfinished();
        let done = solved.load(Ordering::Relaxed);
        note!("note: stopped after {done} of {asked} cases");
        std::process::exit(3);
    });
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
    existing: Existing,
    format: ReportFormat,
    outcomes: &[Outcome],
    asked: usize,
) -> Result<Done, Stop> {
    let text = match format {
        ReportFormat::Html => report::html(outcomes, asked),
        ReportFormat::Json => json(outcomes, asked),
    };
    outputs::write(Some(path), existing, &text)
}

fn json(outcomes: &[Outcome], asked: usize) -> String {
    table::json(&report::json(outcomes, asked))
}

fn format(path: &Path) -> Result<ReportFormat, Stop> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("html") => Ok(ReportFormat::Html),
        Some("json") => Ok(ReportFormat::Json),
        _ => {
            let place = shown::path(path);
            let message = format!("--output {place}: must end in .html or .json");
            Err(Stop::WrongInput(message))
        }
    }
}
