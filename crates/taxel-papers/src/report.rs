//! The report as a page that needs nothing else, and as JSON.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use taxel::svg::escape;

use crate::ledger::{Entry, Ledger, PaperFigure};
use crate::notation;
use crate::paper::Paper;
use crate::table::Verdict;

/// Counts of verdicts over all `ledgers`, in the order of [`Verdict::ALL`].
fn counts(ledgers: &[Ledger]) -> [usize; Verdict::ALL.len()] {
    let mut sums = [0; Verdict::ALL.len()];
    for ledger in ledgers {
        for (sum, count) in sums.iter_mut().zip(ledger.counts()) {
            *sum += count;
        }
    }
    sums
}

/// The counts of `ledgers` as one line for people: `3 measured numbers predicted from the drawing,
/// 10 follow for a named input ...`.
pub(crate) fn line(ledgers: &[Ledger]) -> String {
    let parts: Vec<String> = Verdict::ALL
        .iter()
        .zip(counts(ledgers))
        .filter(|(verdict, count)| *count > 0 || **verdict == Verdict::Predicted)
        .map(|(verdict, count)| verdict.counted(count))
        .collect();
    parts.join(", ")
}

/// The counts as text: over all, then of each paper.
pub fn text(ledgers: &[Ledger]) -> String {
    let mut text = format!("{}\n", line(ledgers));
    for ledger in ledgers {
        let _ = writeln!(
            text,
            "{}: {}",
            ledger.paper.name(),
            line(std::slice::from_ref(ledger))
        );
    }
    text
}

/// The report as one HTML page with its figures inside. `about` is what made
/// it: pairs of a name and a value.
pub fn html(ledgers: &[Ledger], about: &[(&str, &str)]) -> String {
    let mut page = String::from(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Published numbers beside ours</title>\n<style>",
    );
    page += STYLE;
    page += "</style>\n</head>\n<body>\n";
    let _ = writeln!(page, "<p class=\"counts\">{}</p>", line(ledgers));
    page += "<h1>Published numbers beside ours</h1>\n<p>";
    for (name, value) in about {
        let _ = write!(page, "{} <code>{}</code> ", escape(name), escape(value));
    }
    page += "</p>\n<p>Every value of ours is computed when this report is made. Results of long runs come from \
             the tables of the papers; <code>docs/papers</code> names the command of each run. A printed number is \
             reproduced when ours rounds, or is cut off, to its digits; otherwise the note says why.</p>\n";
    for ledger in ledgers {
        section(ledger, &mut page);
    }
    page += "</body>\n</html>\n";
    page
}

fn section(ledger: &Ledger, page: &mut String) {
    let name = ledger.paper.name();
    let _ = writeln!(
        page,
        "<section id=\"{name}\">\n<h2>{name}: {}</h2>\n{}<p class=\"counts\">{}</p>\n<table>\n\
         <thead><tr><th>Place</th><th>What</th><th>Printed</th><th>Ours</th><th>Difference</th>\
         <th>Verdict</th></tr></thead>\n<tbody>",
        escape(ledger.paper.title()),
        source(ledger.paper),
        line(std::slice::from_ref(ledger))
    );
    for entry in &ledger.entries {
        row(entry, page);
    }
    page.push_str("</tbody>\n</table>\n");
    for figure in &ledger.figures {
        let _ = writeln!(
            page,
            "<figure>\n{}{}<figcaption><b>{}.</b> {}</figcaption>\n</figure>",
            scoped(&figure.figure.svg(), &figure_id(name, &figure.place)),
            pictures(&figure.pictures),
            escape(&figure.place),
            notation::html(&figure.figure.caption)
        );
    }
    page.push_str("</section>\n");
}

/// Where the paper stands, and its identifier as a link; nothing where neither is known.
fn source(paper: Paper) -> String {
    let table = paper.table();
    if table.source.is_empty() {
        return String::new();
    }
    let doi = escape(&table.doi);
    let link = if doi.is_empty() {
        String::new()
    } else {
        format!(". DOI <a href=\"https://doi.org/{doi}\">{doi}</a>")
    };
    format!("<p>{}{link}</p>\n", escape(&table.source))
}

/// Pictures of fields, each below its title.
fn pictures(pictures: &[(String, String)]) -> String {
    let picture = |(title, svg): &(String, String)| format!("<p>{}</p>\n{svg}", escape(title));
    pictures.iter().map(picture).collect()
}

fn figure_id(paper: &str, place: &str) -> String {
    let mut id: String = format!("{paper}-{place}").to_lowercase();
    id.retain(|c| c.is_ascii_alphanumeric() || c == '-');
    id
}

/// All figures share one style sheet, so that inlining them is harmless; only
/// the id is added, as a target of links.
fn scoped(svg: &str, id: &str) -> String {
    svg.replacen("<svg ", &format!("<svg id=\"{id}\" "), 1)
}

fn row(entry: &Entry, page: &mut String) {
    let ours = ours(entry);
    let difference = entry.difference.map_or(String::new(), percent);
    let note = if entry.note.is_empty() {
        String::new()
    } else {
        format!("<br><small>{}</small>", notation::html(&entry.note))
    };
    let verdict = entry.verdict.name();
    let _ = writeln!(
        page,
        "<tr class=\"{}\"><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{ours}</td><td class=\"n\">{difference}</td>\
         <td>{}{note}</td></tr>",
        entry.verdict.key(),
        escape(&entry.row.place),
        notation::html(&entry.row.what),
        notation::html(&entry.row.printed),
        verdict
    );
}

/// Ours in the printed unit, with its interval.
pub(crate) fn ours(entry: &Entry) -> String {
    let value = entry.ours.map_or(String::new(), significant);
    let Some([least, greatest]) = entry.interval else {
        return value;
    };
    let interval = format!("{} to {}", significant(least), significant(greatest));
    if value.is_empty() {
        interval
    } else {
        format!("{value} ({interval})")
    }
}

/// Five significant digits.
pub(crate) fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-4..1e7).contains(&size) {
        return format!("{value:.4e}");
    }
    let decimals = (4 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

fn percent(difference: f64) -> String {
    let percent = 100.0 * difference;
    if percent.abs() >= 1000.0 {
        format!("{percent:+.1e} %")
    } else {
        format!("{percent:+.2} %")
    }
}

/// The report as JSON: the counts, then each paper with its entries and the
/// curves of its figures.
pub fn json(ledgers: &[Ledger], about: &[(&str, &str)]) -> Value {
    let keyed = |counts: [usize; Verdict::ALL.len()]| {
        let pairs = Verdict::ALL.iter().zip(counts);
        pairs
            .map(|(verdict, count)| (verdict.key().to_owned(), Value::from(count)))
            .collect::<Map<_, _>>()
    };
    let mut whole = Map::new();
    whole.insert("verdicts".into(), keyed(counts(ledgers)).into());
    for (name, value) in about {
        whole.insert((*name).to_owned(), Value::from(*value));
    }
    for ledger in ledgers {
        let entries: Vec<Value> = ledger.entries.iter().map(entry).collect();
        let figures: Vec<Value> = ledger.figures.iter().map(figure).collect();
        let paper = json!({
            "title": ledger.paper.title(),
            "source": ledger.paper.table().source,
            "doi": ledger.paper.table().doi,
            "verdicts": keyed(ledger.counts()),
            "entries": entries,
            "figures": figures,
        });
        whole.insert(ledger.paper.name().to_lowercase(), paper);
    }
    whole.into()
}

fn entry(entry: &Entry) -> Value {
    json!({
        "place": entry.row.place,
        "what": entry.row.what,
        "printed": entry.row.printed,
        "ours": entry.ours,
        "interval": entry.interval,
        "relative_difference": entry.difference,
        "verdict": entry.verdict.key(),
        "note": entry.note,
    })
}

fn figure(figure: &PaperFigure) -> Value {
    let charts = figure.figure.charts.iter().map(|chart| {
        let series: Vec<Value> = chart
            .series
            .iter()
            .map(|series| json!({ "name": series.name, "points": series.points }))
            .collect();
        json!({
            "title": chart.title,
            "x": chart.x.label, "x_unit": chart.x.unit,
            "y": chart.y.label, "y_unit": chart.y.unit,
            "series": series,
        })
    });
    json!({
        "place": figure.place,
        "title": figure.figure.title,
        "caption": figure.figure.caption,
        "charts": charts.collect::<Vec<_>>(),
    })
}

const STYLE: &str = "body{font-family:system-ui,sans-serif;max-width:1100px;margin:1.5rem auto;padding:0 1rem;color:#111;background:#fff}\
    .counts{font-weight:600}table{border-collapse:collapse;width:100%;font-size:.86rem}\
    th,td{border-bottom:1px solid #ddd;padding:.3rem .5rem;text-align:left;vertical-align:top}\
    th{border-bottom:2px solid #333}.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}\
    small{color:#444}td:last-child{border-left:5px solid transparent;min-width:15rem}\
    tr.reproduced td:last-child{border-left-color:#009e73}tr.arithmetic td:last-child{border-left-color:#56b4e9}\
    tr.predicted td:last-child{border-left-color:#0072b2}tr.follows td:last-child{border-left-color:#e69f00}\
    tr.contradicts td:last-child{border-left-color:#d55e00}tr.not_determined td:last-child{border-left-color:#999}\
    tr.input td:last-child,tr.fitted td:last-child{border-left-color:#cc79a7}tr.unexplained td:last-child{border-left-color:#000}\
    figure{margin:1.5rem 0;break-inside:avoid}figure svg{max-width:100%;height:auto}figcaption{max-width:720px;font-size:.9rem}\
    tr{break-inside:avoid}@media print{body{max-width:none;font-size:10pt}section+section{break-before:page}figure svg{max-height:21cm;width:auto}}";
