//! Result of a calibration, for people (a page, a table) and programs.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use crate::outcome::{Outcome, Provenance, ResidualSummary};
use taxel::figure::escape;
use taxel::table::{self, Cell, Column, Format};
use taxel_numerics::least_squares::{Estimate, Parameter, Status};

impl Outcome {
    /// The parameters as a table, with what else there is to say below it.
    pub fn text(&self) -> String {
        let columns = [
            "parameter",
            "value",
            "sigma",
            "95 % interval",
            "unit",
            "status",
        ]
        .map(Column::plain);
        let rows: Vec<Vec<Cell>> = self.parameters.iter().map(row).collect();
        let mut text = String::new();
        // A device that was trained has none.
        if !rows.is_empty() {
            text = table::render(Format::Table, &Map::new(), &columns, &rows);
        }
        for derived in &self.derived {
            let value = derived.in_words(digits);
            let _ = writeln!(text, "{} = {value}, {}", derived.name, derived.about);
        }
        if !text.is_empty() {
            text.push('\n');
        }
        let _ = writeln!(text, "model     {}", self.model);
        let _ = writeln!(text, "noise     {}", self.noise);
        let _ = writeln!(text, "search    {}", self.search);
        for residual in &self.residuals {
            let _ = writeln!(text, "residual  {}", in_words(residual));
        }
        let _ = writeln!(text, "held out  {}", self.held_out);
        for residual in &self.hold_out {
            let _ = writeln!(text, "held out  {}", in_words(residual));
        }
        for model in &self.models {
            let hold_out = model.hold_out.map_or(String::new(), |error| {
                format!(", held out {}", percent(error))
            });
            let _ = writeln!(
                text,
                "models    {}: {} unknowns, residual {}{hold_out}",
                model.name,
                model.unknowns,
                percent(model.residual)
            );
        }
        for open in &self.open {
            let _ = writeln!(text, "not identifiable: {open}");
        }
        for remark in &self.remarks {
            let _ = writeln!(text, "remark    {remark}");
        }
        text
    }

    /// All of it, SI.
    pub fn json(&self, about: &Provenance<'_>) -> Value {
        let parameters: Vec<Value> = self
            .parameters
            .iter()
            .map(|(parameter, estimate)| {
                json!({
                    "name": parameter.name,
                    "unit": parameter.unit,
                    "value": estimate.value,
                    "deviation": estimate.deviation,
                    "interval": estimate.interval,
                    "status": estimate.status.name(),
                })
            })
            .collect();
        let remarks: Vec<String> = self.remarks.iter().map(ToString::to_string).collect();
        json!({
            "version": about.version,
            "date": about.date,
            "data": {"file": about.data, "sha256": about.data_hash},
            "element": self.element,
            "model": self.model,
            "sensors": self.sensors,
            "parameters": parameters,
            "covariance": self.covariance,
            "not_identifiable": self.open,
            "places": self.places.as_ref().map(|map| json!({
                "finder": map.finder,
                "gains": map.gains,
                "gain_deviation": map.gain_deviation,
                "presses": map.positions.len(),
            })),
            "derived": self.derived,
            "noise": self.noise,
            "search": self.search,
            "residuals": self.residuals,
            "held_out": self.held_out,
            "hold_out": self.hold_out,
            "models": self.models,
            "scope": self.scope,
            "remarks": remarks,
        })
    }

    /// All of it as a page with its figures inside.
    pub fn html(&self, about: &Provenance<'_>) -> String {
        let names: Vec<&str> = self
            .sensors
            .iter()
            .map(|sensor| sensor.name.as_str())
            .collect();
        let title = format!("Calibration of {}", names.join(", "));
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{0}</h1>\n\
             <p>taxel {1}, {2}, readings <code>{3}</code> (SHA-256 <code>{4}</code>), model <b>{5}</b>.</p>\n",
            escape(&title),
            escape(about.version),
            escape(about.date),
            escape(about.data),
            escape(about.data_hash.get(..12).unwrap_or(about.data_hash)),
            self.model
        );
        if self.parameters.is_empty() {
            section(&mut page, "What it holds for", &self.holds_for());
        } else {
            self.parameter_section(&mut page);
            self.identifiability_section(&mut page);
        }
        // Presses at known places compare finders of places, and no models.
        if !self.models.is_empty() {
            self.model_section(&mut page);
        }
        self.residual_section(&mut page);
        let remarks: Vec<String> = self
            .remarks
            .iter()
            .map(|r| escape(&r.to_string()))
            .collect();
        section(
            &mut page,
            "What was noticed in the readings",
            &items(&remarks, "Nothing."),
        );
        for figure in &self.figures {
            let _ = writeln!(
                page,
                "<figure>\n{}<figcaption>{}</figcaption>\n</figure>",
                figure.svg(),
                escape(&figure.caption)
            );
        }
        page.push_str("</body>\n</html>\n");
        page
    }

    fn parameter_section(&self, page: &mut String) {
        let mut body = table_head(&[
            "Parameter",
            "Value",
            "Sigma",
            "95 % interval",
            "Unit",
            "Status",
        ]);
        for (parameter, estimate) in &self.parameters {
            let [value, deviation, interval, unit] = shown(estimate, parameter.unit);
            let _ = writeln!(
                body,
                "<tr class=\"{}\"><td><code>{}</code></td><td class=\"n\">{value}</td><td class=\"n\">{deviation}</td>\
                 <td class=\"n\">{interval}</td><td>{unit}</td><td>{}</td></tr>",
                estimate.status.name().replace(' ', "-"),
                escape(&parameter.name),
                estimate.status.name()
            );
        }
        body.push_str("</tbody>\n</table>\n");
        for derived in &self.derived {
            let (value, about) = (derived.in_words(digits), escape(&derived.about));
            let _ = writeln!(body, "<p>{} = {value}, {about}.</p>", derived.name);
        }
        body.push_str(
            "<p>A value that is not identifiable is one of many that fit as well; its interval is that of its bounds.</p>\n",
        );
        body.push_str(&self.holds_for());
        section(page, "Parameters", &body);
    }

    fn holds_for(&self) -> String {
        let scopes: Vec<String> = self
            .scope
            .iter()
            .map(|scope| {
                let (unit, size) = prefixed(largest(scope.range), scope.unit);
                let [low, high] = scope.range.map(|end| digits(end / size));
                format!("{} from {low} to {high} {unit}", scope.name)
            })
            .collect();
        format!(
            "<p>Holds for {}.</p>\n<p>Noise: {}. Search: {}.</p>\n",
            scopes.join(", "),
            escape(&self.noise),
            escape(&self.search)
        )
    }

    fn identifiability_section(&self, page: &mut String) {
        let open: Vec<String> = self.open.iter().map(|open| escape(open)).collect();
        section(
            page,
            "What the readings do not identify",
            &items(
                &open,
                "Every combination of the parameters is identified to within its typical size.",
            ),
        );
    }

    fn model_section(&self, page: &mut String) {
        let mut body = table_head(&["Model", "What it is", "Unknowns", "Residual", "Held out"]);
        for model in &self.models {
            let _ = writeln!(
                body,
                "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
                model.name,
                model.about,
                model.unknowns,
                percent(model.residual),
                model.hold_out.map_or(String::new(), percent)
            );
        }
        body.push_str(
            "</tbody>\n</table>\n<p>Root of the mean square over the range of the signal.</p>\n",
        );
        section(page, "Models beside one another", &body);
    }

    fn residual_section(&self, page: &mut String) {
        let mut body = table_head(&[
            "Readings",
            "Count",
            "Root mean square",
            "Largest",
            "Of the range",
        ]);
        let held = self
            .hold_out
            .iter()
            .map(|residual| (residual, " (held out)"));
        for (residual, note) in self
            .residuals
            .iter()
            .map(|residual| (residual, ""))
            .chain(held)
        {
            let (unit, [error, largest]) = errors(residual);
            let _ = writeln!(
                body,
                "<tr><td><code>{}</code>{note}</td><td class=\"n\">{}</td><td class=\"n\">{error} {unit}</td>\
                 <td class=\"n\">{largest} {unit}</td><td class=\"n\">{}</td></tr>",
                escape(&residual.name),
                residual.count,
                percent(residual.share()),
            );
        }
        let _ = writeln!(
            body,
            "</tbody>\n</table>\n<p>Held out: {}, predicted by a fit to the others.</p>",
            escape(&self.held_out)
        );
        section(page, "Residuals", &body);
    }
}

fn table_head(titles: &[&str]) -> String {
    let cells = titles.join("</th><th>");
    format!("<table>\n<thead><tr><th>{cells}</th></tr></thead>\n<tbody>\n")
}

fn section(page: &mut String, title: &str, body: &str) {
    let _ = writeln!(page, "<section>\n<h2>{title}</h2>\n{body}</section>");
}

fn items(items: &[String], none: &str) -> String {
    if items.is_empty() {
        return format!("<p>{none}</p>\n");
    }
    let items = items.join("</li>\n<li>");
    format!("<ul>\n<li>{items}</li>\n</ul>\n")
}

fn row((parameter, estimate): &(Parameter, Estimate)) -> Vec<Cell> {
    let [value, deviation, interval, unit] = shown(estimate, parameter.unit);
    let name = parameter.name.clone();
    let status = estimate.status.name().to_owned();
    [name, value, deviation, interval, unit, status]
        .map(Cell::from)
        .into()
}

/// Value, deviation, interval and their unit; none that would look confident
/// where nothing is identified.
fn shown(estimate: &Estimate, unit: &str) -> [String; 4] {
    let (unit, size) = prefixed(estimate.value, unit);
    let [value, deviation] = [estimate.value, estimate.deviation].map(|x| digits(x / size));
    let [low, high] = estimate.interval.map(|end| digits(end / size));
    let interval = format!("{low} to {high}");
    let none = || String::from("-");
    match estimate.status {
        Status::NotIdentifiable => [format!("({value})"), none(), interval, unit],
        Status::Fixed => [value, none(), none(), unit],
        _ => [value, deviation, interval, unit],
    }
}

fn in_words(residual: &ResidualSummary) -> String {
    let (unit, [error, largest]) = errors(residual);
    format!(
        "{}: {} readings, {error} {unit} root mean square ({} of the range), largest {largest} {unit}",
        residual.name,
        residual.count,
        percent(residual.share()),
    )
}

/// Root of the mean square and largest error with their unit.
fn errors(residual: &ResidualSummary) -> (String, [String; 2]) {
    let (unit, size) = prefixed(residual.largest, residual.unit);
    let errors = [residual.root_mean_square, residual.largest];
    (unit, errors.map(|error| digits(error / size)))
}

fn largest(range: [f64; 2]) -> f64 {
    range[0].abs().max(range[1].abs())
}

/// Prefixes, and what they stand for.
const PREFIXES: [(&str, f64); 9] = [
    ("f", 1e-15),
    ("p", 1e-12),
    ("n", 1e-9),
    ("u", 1e-6),
    ("m", 1e-3),
    ("", 1.0),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];
/// Units that take one; others are left as they are.
const UNITS: [&str; 7] = ["F", "m", "N", "Pa", "ohm", "V", "C"];

/// `unit` with the prefix that leaves one to three digits before the point of
/// `value`, if there is one so small or large, and what one of it is in SI.
fn prefixed(value: f64, unit: &str) -> (String, f64) {
    let symbol = unit.split(['/', ' ']).next().unwrap_or_default();
    if value == 0.0 || !value.is_finite() || !UNITS.contains(&symbol) {
        return (unit.to_owned(), 1.0);
    }
    let fits = |(_, size): &&(&str, f64)| value.abs() >= *size;
    let (prefix, size) = PREFIXES.iter().rfind(fits).unwrap_or(&PREFIXES[0]);
    (format!("{prefix}{unit}"), *size)
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Five significant digits.
fn digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{value:.4e}");
    }
    let decimals = (4 - size.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}

const STYLE: &str = "body{font-family:system-ui,sans-serif;max-width:900px;margin:1.5rem auto;padding:0 1rem;color:#111;background:#fff}\
    table{border-collapse:collapse;width:100%;font-size:.88rem}\
    th,td{border-bottom:1px solid #ddd;padding:.3rem .5rem;text-align:left;vertical-align:top}\
    th{border-bottom:2px solid #333}.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}\
    td:last-child{border-left:5px solid transparent}\
    tr.identified td:last-child{border-left-color:#009e73}tr.not-identifiable td:last-child{border-left-color:#d55e00}\
    tr.prior-only td:last-child{border-left-color:#cc79a7}tr.at-bound td:last-child{border-left-color:#8a6d00}\
    tr.fixed td:last-child{border-left-color:#999}\
    figure{margin:1.5rem 0;break-inside:avoid}figure svg{max-width:100%;height:auto}figcaption{font-size:.9rem}";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_take_the_prefix_of_the_value() {
        let of = |value, unit| {
            let (unit, size) = prefixed(value, unit);
            format!("{} {unit}", digits(value / size))
        };
        assert_eq!(of(1.876_71e-12, "F"), "1.8767 pF");
        assert_eq!(of(-9.62e-5, "m/N"), "-96.200 um/N");
        assert_eq!(of(2.76e8, "ohm"), "276.00 Mohm");
        assert_eq!(of(1.304_2e-16, "F"), "0.13042 fF");
        assert_eq!(of(0.0, "m"), "0 m");
        assert_eq!(of(25.0, ""), "25.000 ");
        // No kiloseconds, and no thousandths of nothing.
        assert_eq!(of(2e3, "s"), "2000.0 s");
        assert_eq!(of(f64::NAN, "N"), "NaN N");
    }
}
