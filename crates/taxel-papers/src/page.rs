//! The rows of a table as a part of a page of `docs/papers`.

use std::fmt::Write as _;

use crate::ledger::{Entry, Ledger};
use crate::report::{line, ours};
use crate::table::Run;

/// First line of the generated part, up to the name of the paper.
const START: &str = "<!-- ledger of ";
/// Last line of the generated part.
const END: &str = "<!-- end of the ledger -->";

/// `page` with the rows and runs of `ledger` between its two marks; the prose around them stays.
/// `None` if a mark is missing.
///
/// ```
/// use taxel_papers::{Paper, page};
///
/// let prose = "# P1\n<!-- ledger of P1 -->\n<!-- end of the ledger -->\nMore words.\n";
/// let written = page(prose, &Paper::P1.ledger()).expect("two marks");
/// assert!(written.starts_with("# P1\n") && written.ends_with("\nMore words.\n"));
/// assert!(written.contains("| 3 | layer thickness H | 950 um | 950.00 | input |"));
/// ```
pub fn page(page: &str, ledger: &Ledger) -> Option<String> {
    let start = format!("{START}{} ", ledger.paper.name());
    let (before, rest) = page.split_once(&start)?;
    let (mark, rest) = rest.split_once('\n')?;
    let (_, after) = rest.split_once(END)?;
    Some(format!(
        "{before}{start}{mark}\n{}{END}{after}",
        generated(ledger)
    ))
}

fn generated(ledger: &Ledger) -> String {
    let mut text = format!("\n{}.\n\n", line(std::slice::from_ref(ledger)));
    text += "| place | says | printed | ours | kind | verdict and words | from | test |\n\
             |---|---|---|---|---|---|---|---|\n";
    for entry in &ledger.entries {
        row(entry, &mut text);
    }
    let runs = &ledger.paper.table().runs;
    if !runs.is_empty() {
        text += "\nResults of long runs:\n\n| run | command | values | test |\n|---|---|---|---|\n";
        for run in runs {
            let _ = writeln!(
                text,
                "| {} | `{}` | {} | `{}` |",
                run.id,
                run.command,
                values(run),
                run.test
            );
        }
    }
    text.push('\n');
    text
}

fn row(entry: &Entry, text: &mut String) {
    let row = entry.row;
    let mut words = entry.verdict.key().replace('_', " ");
    for (stop, part) in [(": ", &entry.note), (". ", &row.remark)] {
        if !part.is_empty() {
            words += stop;
            words += part;
        }
    }
    let ours = ours(entry);
    let code = |name: &str| {
        if name.is_empty() {
            String::new()
        } else {
            format!("`{name}`")
        }
    };
    let from = if row.function.is_empty() {
        code(&row.key)
    } else {
        code(&row.function)
    };
    let cells = [
        row.place.clone(),
        row.what.clone(),
        row.printed.clone(),
        ours,
        row.kind.name().to_owned(),
        words,
        from,
        code(&row.test),
    ];
    let cells = cells.map(|cell| cell.replace('|', "\\|").replace('~', "\\~"));
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

/// Values of a run: by name, then its rows.
fn values(run: &Run) -> String {
    let named = run
        .values
        .iter()
        .map(|(name, value)| format!("{name} {value}"));
    let rows = run.rows.iter().map(|row| {
        let cells = run.columns.iter().zip(row);
        let cells = cells.map(|(name, value)| format!("{name} {value}"));
        cells.collect::<Vec<_>>().join(", ")
    });
    let named = named.collect::<Vec<_>>().join(", ");
    let parts = [named].into_iter().filter(|part| !part.is_empty());
    parts.chain(rows).collect::<Vec<_>>().join("<br>")
}
