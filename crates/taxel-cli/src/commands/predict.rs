//! `taxel predict`: loads in, electrical response out.

use std::path::Path;

use serde_json::{Map, Value};
use taxel::InputError;
use taxel::predict::{self, Given, Load, LoadRefused, LoadRow, Loads, Predictor};
use taxel::table::{self, Cell, Column};

use crate::arguments::{COMMIT, Predict, VERSION};
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Predict) -> Result<Done, Stop> {
    let named = files::sensor(&arguments.sensor)?;
    let device = files::device(&named.sensor)?;
    let predictor = device.predictor();
    let loads = loads(arguments, predictor.as_ref())?;
    let mut columns: Vec<Column> = loads.given.others.iter().map(Column::plain).collect();
    columns.extend(predictor.columns());
    let refused =
        |row: &LoadRow, refused: &LoadRefused| refusal(arguments, row, refused, predictor.as_ref());
    let mut rows = Vec::with_capacity(loads.rows.len());
    for load in &loads.rows {
        let mut row: Vec<Cell> = load.others.iter().cloned().map(Cell::from).collect();
        predictor
            .answer(&Load(&load.values), &mut row)
            .map_err(|error| refused(load, &error))?;
        rows.push(row);
    }
    let mut about = Map::new();
    for (key, value) in [
        ("sensor", named.sensor.name.as_str()),
        ("sensor_hash", named.hash.as_str()),
        ("version", VERSION),
        ("commit", COMMIT),
    ] {
        about.insert(key.into(), Value::from(value));
    }
    if let Some(path) = &arguments.plot {
        plot(path, &named.sensor.name, predictor.as_ref(), &loads)?;
    }
    let text = table::render(arguments.format.into(), &about, &columns, &rows);
    files::write(arguments.output.as_deref(), &text)
}

fn loads(arguments: &Predict, predictor: &dyn Predictor) -> Result<Loads, Stop> {
    let columns = predictor.load_columns();
    let (file, loads) = if let Some(spec) = &arguments.load {
        let (given, values) = predict::one_load(spec, columns)?;
        let row = LoadRow {
            line: 1,
            values,
            others: Vec::new(),
        };
        let rows = vec![row];
        (String::from("--load"), Loads { given, rows })
    } else {
        let path = arguments.loads.as_deref().unwrap_or_else(|| Path::new(""));
        let file = path.to_string_lossy().into_owned();
        let loads = Loads::parse(&file, &files::text(path)?, columns)?;
        (file, loads)
    };
    predictor
        .combination(&loads.given.columns)
        .map_err(|message| InputError::whole(&file, message))?;
    Ok(loads)
}

/// A load without meaning, at its place.
fn refusal(
    arguments: &Predict,
    row: &LoadRow,
    refused: &LoadRefused,
    predictor: &dyn Predictor,
) -> Stop {
    let key = predictor
        .load_columns()
        .get(refused.column)
        .map_or("", |column| column.name);
    let error = match &arguments.loads {
        Some(path) => InputError::on_line(
            &path.to_string_lossy(),
            row.line,
            "",
            1,
            1,
            &refused.message,
        ),
        None => InputError::whole("--load", &refused.message),
    };
    error.key(key).help(&refused.help).into()
}

fn plot(path: &Path, title: &str, predictor: &dyn Predictor, loads: &Loads) -> Result<(), Stop> {
    let html = match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => false,
        Some("html") => true,
        _ => {
            let message = format!("--plot {}: must end in .svg or .html", path.display());
            return Err(Stop::WrongInput(message));
        }
    };
    let given = Given {
        columns: loads.given.columns.clone(),
        others: Vec::new(),
    };
    let values: Vec<_> = loads.rows.iter().map(|row| row.values.clone()).collect();
    let figure = predict::figure(title, predictor, &given, &values)
        .map_err(|refused| Stop::WrongInput(format!("--plot: {}", refused.message)))?;
    let text = if html { figure.html() } else { figure.svg() };
    files::write(Some(path), &text).map(drop)
}
