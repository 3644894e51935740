//! `taxel predict`: loads in, electrical response out.

use serde_json::{Map, Value};
use taxel::loads::{Load, Loads};
use taxel::predict::{Prediction, Predictor};

use crate::arguments::{COMMIT, Predict, VERSION};
use crate::table::{Cell, Column};
use crate::{Done, Stop, files, table};

const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];

pub(crate) fn run(arguments: &Predict) -> Result<Done, Stop> {
    let named = files::sensor(&arguments.sensor)?;
    let loads = loads(arguments)?;
    let predictor = Predictor::new(&named.sensor);
    let mut columns = passed_on(&loads.header);
    columns.extend(answers());
    let rows: Vec<Vec<Cell>> = loads
        .rows
        .iter()
        .map(|load| {
            let passed = loads
                .header
                .iter()
                .zip(&load.fields)
                .filter(|(title, _)| !is_force(title));
            let passed = passed.map(|(_, field)| Cell::Text(field.clone()));
            passed.chain(row(&predictor.predict(load.force))).collect()
        })
        .collect();
    let mut about = Map::new();
    for (key, value) in [
        ("sensor", named.sensor.name.as_str()),
        ("sensor_hash", named.hash.as_str()),
        ("version", VERSION),
        ("commit", COMMIT),
    ] {
        about.insert(key.into(), Value::from(value));
    }
    let text = table::render(arguments.format, &about, &columns, &rows)?;
    files::write(arguments.output.as_deref(), &text)
}

fn loads(arguments: &Predict) -> Result<Loads, Stop> {
    if let Some(spec) = &arguments.load {
        let force = Loads::parse_one(spec)?;
        return Ok(Loads {
            header: Vec::new(),
            rows: vec![Load {
                fields: Vec::new(),
                force,
            }],
        });
    }
    let path = arguments
        .loads
        .as_deref()
        .unwrap_or_else(|| std::path::Path::new(""));
    Ok(Loads::parse(&path.to_string_lossy(), &files::text(path)?)?)
}

/// Columns of the load file that are not forces go through as they are.
fn passed_on(header: &[String]) -> Vec<Column> {
    header
        .iter()
        .filter(|title| !is_force(title))
        .map(Column::plain)
        .collect()
}

fn is_force(title: &str) -> bool {
    ["force_x", "force_y", "force_z"].contains(&title.split('[').next().unwrap_or("").trim())
}

fn answers() -> Vec<Column> {
    let axes = ["x", "y", "z"];
    let force =
        |name: &str| axes.map(|axis| Column::new(format!("{name}_{axis}"), "mN", 1e-3, "n", 3));
    let mut columns = Vec::from(force("force"));
    columns
        .extend(axes.map(|axis| Column::new(format!("displacement_{axis}"), "nm", 1e-9, "m", 2)));
    columns
        .extend(CAPACITORS.map(|c| Column::new(format!("capacitance_{c}"), "fF", 1e-15, "f", 3)));
    columns.push(Column::new("least_air_gap", "um", 1e-6, "m", 4));
    columns.extend(CAPACITORS.map(|c| Column::new(format!("voltage_{c}"), "mV", 1e-3, "v", 3)));
    columns.extend(CAPACITORS.map(|c| Column::plain(format!("counts_{c}"))));
    columns.extend(force("published_inverse"));
    columns.push(Column::plain("state"));
    columns.push(Column::plain("touching"));
    columns
}

fn row(answer: &Prediction) -> Vec<Cell> {
    let numbers = |values: &[f64]| {
        values
            .iter()
            .map(|value| Cell::Number(*value))
            .collect::<Vec<_>>()
    };
    let mut cells = numbers(&answer.force);
    cells.extend(numbers(&answer.deformation.displacement));
    cells.extend(numbers(&answer.response.capacitance()));
    cells.push(Cell::Number(answer.response.least_air_gap()));
    cells.extend(numbers(&answer.voltage));
    cells.extend(
        answer
            .code
            .iter()
            .map(|code| Cell::Whole(u64::from(code.counts))),
    );
    cells.extend(numbers(&answer.published_inverse));
    cells.push(Cell::Text(answer.state.name().into()));
    let touching = answer.response.touching();
    let names: Vec<_> = (0..4)
        .filter(|i| touching[*i])
        .map(|i| CAPACITORS[i])
        .collect();
    cells.push(Cell::Text(names.join(" ")));
    cells
}
