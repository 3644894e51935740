//! `taxel reproduce`: published numbers beside ours.

use std::path::{Path, PathBuf};

use taxel::shown;
use taxel::table;
use taxel_files::{COMMIT, VERSION};
use taxel_papers::{self as reproduce, Ledger, Paper};

use crate::arguments::{PaperName, ReportFormat, Reproduce};
use crate::outputs::{self, Existing};
use crate::{Done, Stop, files};
use taxel_files::today;

pub(crate) fn run(arguments: &Reproduce) -> Result<Done, Stop> {
    let papers: Vec<Paper> = if arguments.papers.is_empty() {
        Paper::ALL.to_vec()
    } else {
        Paper::ALL
            .into_iter()
            .filter(|paper| arguments.papers.iter().any(|name| name.paper() == *paper))
            .collect()
    };
    let format = format(arguments)?;
    let existing = arguments.overwrite.existing();
    let pages = arguments.ledger.as_deref().map_or(Vec::new(), |folder| {
        papers.iter().map(|paper| page(folder, *paper)).collect()
    });
    if let Some(folder) = arguments.ledger.as_ref().filter(|folder| !folder.is_dir()) {
        return Err(Stop::WrongInput(format!(
            "--ledger {}: is no folder\nhelp: name the folder that has p1.md to p4.md, such as docs/papers",
            shown::path(folder)
        )));
    }
    let outputs = [("--output", arguments.output.as_ref())];
    outputs::check(&outputs, &pages.iter().collect::<Vec<_>>(), existing)?;
    let ledgers: Vec<Ledger> = papers.into_iter().map(Paper::ledger).collect();
    if let Some(folder) = &arguments.ledger {
        write_pages(folder, &ledgers)?;
    }
    let date = today();
    let about = [("version", VERSION), ("commit", COMMIT), ("date", &date)];
    let report = match format {
        Some(ReportFormat::Html) => reproduce::html(&ledgers, &about),
        Some(ReportFormat::Json) => table::json(&reproduce::json(&ledgers, &about)),
        None => reproduce::text(&ledgers),
    };
    let output = arguments.output.as_deref();
    outputs::write(output, existing, &report)?;
    if output.is_some() {
        // The report went elsewhere; its first line is for the reader here.
        outputs::print_beside(output, &reproduce::text(&ledgers))?;
    }
    Ok(Done::Complete)
}

/// Writes the rows of each ledger into its page of the folder; none if one of the pages is wrong.
fn write_pages(folder: &Path, ledgers: &[Ledger]) -> Result<(), Stop> {
    let page_of = |ledger: &Ledger| {
        let path = page(folder, ledger.paper);
        let prose = files::text(&path)?;
        let text = reproduce::page(&prose, ledger).ok_or_else(|| {
            Stop::WrongInput(format!("{}: no marks for the ledger", shown::path(&path)))
        })?;
        Ok((path, text))
    };
    let pages: Vec<_> = ledgers.iter().map(page_of).collect::<Result<_, Stop>>()?;
    for (path, text) in pages {
        // The page is made to be written anew.
        outputs::write(Some(&path), Existing::Replaced, &text)?;
    }
    Ok(())
}

/// The page of a paper in the folder of ledgers.
fn page(folder: &Path, paper: Paper) -> PathBuf {
    folder.join(format!("{}.md", paper.name().to_lowercase()))
}

/// Format by the option or by the name of the file; none for the counts.
fn format(arguments: &Reproduce) -> Result<Option<ReportFormat>, Stop> {
    let Some(path) = &arguments.output else {
        return Ok(arguments.format);
    };
    let ending = path.extension().and_then(|ending| ending.to_str());
    match (arguments.format, ending) {
        (Some(format), _) => Ok(Some(format)),
        (None, Some("html")) => Ok(Some(ReportFormat::Html)),
        (None, Some("json")) => Ok(Some(ReportFormat::Json)),
        (None, _) => {
            let message = format!(
                "--output {}: must end in .html or .json, or give --format",
                shown::path(path)
            );
            Err(Stop::WrongInput(message))
        }
    }
}

impl PaperName {
    fn paper(self) -> Paper {
        match self {
            Self::P1 => Paper::P1,
            Self::P2 => Paper::P2,
            Self::P3 => Paper::P3,
            Self::P4 => Paper::P4,
        }
    }
}
