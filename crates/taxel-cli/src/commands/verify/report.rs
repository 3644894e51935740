//! Cases of verification as text, as a page and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::table::number_or_null;
use taxel_fem::verify::{Case, Compared, Kind, Outcome, Tolerance};
use taxel_files::{COMMIT, VERSION};

/// A case for people: a line of its own, then one for each number.
pub(crate) fn text(outcome: &Outcome) -> String {
    let entry = outcome.entry;
    let mut text = format!("{} {} ({})", entry.id, entry.title, entry.kind.name());
    let case = match &outcome.result {
        Ok(case) => case,
        Err(failure) => {
            let _ = writeln!(text, ": not solved\n  {failure}");
            return text;
        }
    };
    let _ = writeln!(text, "\n  {}", size(case));
    let width = case.quantities.iter().map(|row| row.what.chars().count());
    let width = width.max().unwrap_or(0);
    for row in &case.quantities {
        let _ = writeln!(
            text,
            "  {} {:width$}  {:>13}  {:>13} {:2} {:>9}  (allowed {})",
            if row.holds() { "  " } else { "NO" },
            row.what,
            significant(row.outside),
            significant(row.ours),
            row.unit,
            difference(row),
            allowed(row),
        );
    }
    for refinement in &case.refinement {
        if let Some(slope) = refinement.slope() {
            let _ = writeln!(text, "     {}: slope {slope:.2}", refinement.what);
        }
    }
    if !case.note.is_empty() {
        let _ = writeln!(text, "     {}", case.note);
    }
    text
}

fn size(case: &Case) -> String {
    let (cells, unknowns) = case.mesh;
    let time = case
        .seconds
        .map_or(String::new(), |s| format!(", {s:.1} s"));
    format!("up to {cells} cells, {unknowns} unknowns{time}")
}

/// Seven significant digits.
fn significant(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.6e}");
    }
    let decimals = (6.0 - size.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

fn difference(row: &Compared) -> String {
    format!("{:+.1e}", row.difference())
}

fn allowed(row: &Compared) -> String {
    match row.tolerance {
        Tolerance::Relative(limit) => format!("{limit:.1e} of it"),
        Tolerance::Absolute(limit) if row.unit.is_empty() => format!("{limit:.1e}"),
        Tolerance::Absolute(limit) => format!("{limit:.1e} {}", row.unit),
    }
}

/// The report as data, SI; `asked` is how many cases the run was to solve.
pub(crate) fn json(outcomes: &[Outcome], asked: usize) -> Value {
    let cases: Vec<Value> = outcomes.iter().map(case_json).collect();
    json!({
        "version": VERSION,
        "commit": COMMIT,
        "complete": outcomes.len() == asked,
        "holds": outcomes.iter().all(Outcome::holds),
        "cases": cases,
    })
}

fn case_json(outcome: &Outcome) -> Value {
    let entry = outcome.entry;
    let case = match &outcome.result {
        Ok(case) => case,
        Err(failure) => {
            return json!({
                "id": entry.id, "title": entry.title, "kind": entry.kind.key(),
                "holds": false, "failure": failure.to_string(),
            });
        }
    };
    let quantities: Vec<Value> = case.quantities.iter().map(row_json).collect();
    let refinement = case.refinement.iter().map(|refinement| {
        json!({
            "what": refinement.what,
            "size_and_error": refinement.points,
            "slope": refinement.slope(),
        })
    });
    json!({
        "id": case.id, "title": case.title, "kind": case.kind.key(),
        "holds": case.holds(),
        "cells": case.mesh.0, "unknowns": case.mesh.1, "time_s": case.seconds,
        "quantities": quantities,
        "refinement": refinement.collect::<Vec<_>>(),
        "note": case.note,
    })
}

fn row_json(row: &Compared) -> Value {
    let (key, limit) = match row.tolerance {
        Tolerance::Relative(limit) => ("relative", limit),
        Tolerance::Absolute(limit) => ("absolute", limit),
    };
    json!({
        "what": row.what,
        "unit": row.unit,
        "outside": number_or_null(row.outside),
        "ours": number_or_null(row.ours),
        "difference": number_or_null(row.difference()),
        "tolerance": limit,
        "tolerance_is": key,
        "holds": row.holds(),
    })
}

/// The report as one page, the cases apart by where their answers come from.
pub(crate) fn html(outcomes: &[Outcome], asked: usize) -> String {
    let held = outcomes.iter().filter(|outcome| outcome.holds()).count();
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <title>Verification</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>Verification of the solver of soft solids</h1>\n\
         <p>version <code>{VERSION}</code> commit <code>{COMMIT}</code></p>\n\
         <p><b>{held} of {} cases are within tolerance.</b></p>\n",
        outcomes.len()
    );
    if outcomes.len() < asked {
        let _ = writeln!(
            page,
            "<p class=\"no\">Not finished: {} of {asked} cases were solved.</p>",
            outcomes.len()
        );
    }
    for kind in Kind::ALL {
        let of_kind: Vec<&Outcome> = outcomes.iter().filter(|o| o.entry.kind == kind).collect();
        if of_kind.is_empty() {
            continue;
        }
        let _ = writeln!(page, "<h2>Against: {}</h2>", kind.name());
        for outcome in of_kind {
            section(outcome, &mut page);
        }
    }
    page += "</body>\n</html>\n";
    page
}

fn section(outcome: &Outcome, page: &mut String) {
    let entry = outcome.entry;
    let _ = writeln!(
        page,
        "<section id=\"{}\">\n<h3>{0}: {}</h3>",
        entry.id,
        escaped(entry.title)
    );
    let case = match &outcome.result {
        Ok(case) => case,
        Err(failure) => {
            let _ = writeln!(
                page,
                "<p class=\"no\">{}</p></section>",
                escaped(&failure.to_string())
            );
            return;
        }
    };
    let _ = writeln!(
        page,
        "<p>{}. {}</p>\n<table>\n<thead><tr><th>What</th><th>Outside</th><th>Ours</th><th>Unit</th>\
         <th>Difference</th><th>Allowed</th></tr></thead>\n<tbody>",
        size(case),
        escaped(&case.note)
    );
    for row in &case.quantities {
        let _ = writeln!(
            page,
            "<tr class=\"{}\"><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
            if row.holds() { "yes" } else { "no" },
            escaped(&row.what),
            significant(row.outside),
            significant(row.ours),
            row.unit,
            difference(row),
            allowed(row),
        );
    }
    page.push_str("</tbody>\n</table>\n");
    if !case.refinement.is_empty() {
        let _ = writeln!(page, "<figure>\n{}</figure>", convergence(case).svg());
    }
    page.push_str("</section>\n");
}

/// Errors over the size of the cells, with their slopes in the names.
fn convergence(case: &Case) -> Figure {
    let mut series = Vec::new();
    for refinement in &case.refinement {
        let slope = refinement.slope();
        let slope = slope.map_or(String::new(), |slope| format!(", slope {slope:.2}"));
        let points: Vec<[f64; 2]> = refinement.points.iter().map(|p| [p.0, p.1]).collect();
        let name = format!("{}{slope}", refinement.what);
        series.push(Series::new(name, points, Style::Line));
    }
    let chart = Chart {
        title: String::new(),
        x: Axis::logarithmic("size of the cells over that of the body", ""),
        y: Axis::logarithmic("value", ""),
        series,
    };
    Figure::of(format!("{}: refinement", case.id), chart, "")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

const STYLE: &str = "body{font-family:system-ui,sans-serif;max-width:1000px;margin:1.5rem auto;padding:0 1rem;color:#111;background:#fff}\
    table{border-collapse:collapse;width:100%;font-size:.86rem}\
    th,td{border-bottom:1px solid #ddd;padding:.3rem .5rem;text-align:left}\
    th{border-bottom:2px solid #333}.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}\
    td:first-child{border-left:5px solid transparent}tr.yes td:first-child{border-left-color:#009e73}\
    tr.no td:first-child,p.no{border-left:5px solid #d55e00}figure{margin:1rem 0}figure svg{max-width:100%;height:auto}\
    tr{break-inside:avoid}";
