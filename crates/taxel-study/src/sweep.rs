//! Sweeps: the designs of a plan.

use taxel::InputError;
use taxel::table::{Cell, Column};

use crate::answers::{Outcome, WAY_COLUMN};
use crate::exponents::NONE;
use crate::keys::Form;
use crate::plans::{latin_hypercube, sobol};
use crate::study::{Row, Study, Values, exponents_of};

/// Most designs of a grid.
pub const MOST_DESIGNS: usize = 10_000_000;

/// The designs of the plan of a study, SI; `table` is the text of the list that the plan names.
///
/// # Errors
/// A study without variables, a grid that is too large, a mistake in the list.
pub fn designs(study: &Study, table: Option<&str>) -> Result<Vec<Vec<f64>>, InputError> {
    let plan = study.sweep.plan.as_str();
    let wrong = |message: &str, help: &str| Err(InputError::whole(&study.name, message).help(help));
    if study.variables.is_empty() {
        return wrong("the study varies nothing", "add [variables.NAME]");
    }
    let points = study.sweep.points;
    let count = study.variables.len();
    let seed = study.sweep.seed;
    let shares = match plan {
        "latin_hypercube" => latin_hypercube(count, points, seed),
        "sobol" => sobol(count, points, Some(seed)),
        "grid" => {
            let lists: Vec<Vec<f64>> = study
                .variables
                .iter()
                .map(|variable| match &variable.values {
                    Values::Drawn(_) => vec![variable.drawn.unwrap_or(f64::NAN)],
                    values => values.grid(variable.points),
                })
                .collect();
            let all = lists
                .iter()
                .try_fold(1usize, |all, list| all.checked_mul(list.len()));
            if all.is_none_or(|all| all > MOST_DESIGNS) {
                return wrong(
                    "the grid has more than ten million designs",
                    "give fewer points",
                );
            }
            return Ok(grid(&lists));
        }
        list => return listed(study, list, table.unwrap_or("")),
    };
    Ok(shares
        .iter()
        .map(|shares| point_of(study, shares))
        .collect())
}

/// The design at a share of the way of each variable.
pub fn point_of(study: &Study, shares: &[f64]) -> Vec<f64> {
    let variables = study.variables.iter().zip(shares);
    variables
        .map(|(variable, share)| match &variable.values {
            Values::Drawn(_) => variable.drawn.unwrap_or(f64::NAN),
            values => values.at(*share),
        })
        .collect()
}

/// All combinations, the last list changing first.
fn grid(lists: &[Vec<f64>]) -> Vec<Vec<f64>> {
    lists.iter().fold(vec![Vec::new()], |begun, list| {
        let longer = |start: &Vec<f64>| {
            let start = start.clone();
            list.iter()
                .map(move |value| [start.as_slice(), &[*value]].concat())
        };
        begun.iter().flat_map(longer).collect()
    })
}

/// Designs of a table: a column for each variable, with its unit in brackets.
fn listed(study: &Study, file: &str, text: &str) -> Result<Vec<Vec<f64>>, InputError> {
    let whole = |message: String| InputError::whole(file, message);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header = reader
        .headers()
        .map_err(|error| whole(error.to_string()))?
        .clone();
    let mut columns = Vec::new();
    for variable in &study.variables {
        let found = header.iter().enumerate().find_map(|(index, title)| {
            let (name, unit) = match title.split_once('[') {
                Some((name, unit)) => (name.trim(), unit.trim_end_matches(']').trim()),
                None => (title, ""),
            };
            (name == variable.name).then(|| (index, unit.to_owned()))
        });
        let Some((index, unit)) = found else {
            let help = "the header names each variable, with its unit in brackets";
            return Err(whole(format!("there is no column {}", variable.name)).help(help));
        };
        columns.push((index, unit));
    }
    let mut designs = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| whole(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut point = Vec::new();
        for (variable, (index, unit)) in study.variables.iter().zip(&columns) {
            let field = record.get(*index).unwrap_or("");
            let value = match &variable.values {
                Values::Words(words) => words
                    .iter()
                    .position(|word| {
                        word.as_str() == Some(field) || word.to_string().trim() == field
                    })
                    .map(|index| index as f64)
                    .ok_or_else(|| format!("\"{field}\" is none of its values")),
                values => match values.form() {
                    Some(Form::Quantity(dimension, _)) => {
                        dimension.parse(&format!("{field} {unit}"))
                    }
                    _ => field
                        .parse()
                        .map_err(|_| format!("\"{field}\" is not a number")),
                },
            };
            let value = value
                .map_err(|message| whole(format!("line {line}: {message}")).key(&variable.name))?;
            point.push(value);
        }
        designs.push(point);
    }
    if designs.is_empty() {
        return Err(whole(String::from("the table has no designs")));
    }
    Ok(designs)
}

/// How many of `rows` each way answered, the commonest first; none or one where a curve through
/// them is one curve.
pub fn ways(study: &Study, rows: &[Row]) -> Vec<(usize, String)> {
    let mut counted: Vec<(usize, String)> = Vec::new();
    for way in rows.iter().filter_map(|row| way_of(study, row)) {
        match counted.iter_mut().find(|(_, known)| known == way) {
            Some((count, _)) => *count += 1,
            None => counted.push((1, way.to_owned())),
        }
    }
    counted.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    counted
}

/// Which way answered a design; none of a device with one, and of a design without an answer.
pub(crate) fn way_of<'r>(study: &Study, row: &'r Row) -> Option<&'r str> {
    let way = study.answers.iter().position(|one| one.name == WAY_COLUMN);
    match row.answers.get(way?) {
        Some(Outcome::Word(way)) => Some(way),
        _ => None,
    }
}

/// All columns of a table of designs with its rows; which way answered only where it changes.
pub fn all(study: &Study, rows: &[Row]) -> (Vec<Column>, Vec<Vec<Cell>>) {
    let mut columns = columns(study);
    let mut cells: Vec<Vec<Cell>> = rows.iter().map(|row| cells(study, row)).collect();
    let way = columns.iter().position(|column| column.name == WAY_COLUMN);
    if let Some(way) = way.filter(|_| ways(study, rows).len() < 2) {
        columns.remove(way);
        for row in &mut cells {
            row.remove(way);
        }
    }
    (columns, cells)
}

/// The table of a sweep: the columns that the study names, or else all.
pub fn table(study: &Study, rows: &[Row]) -> (Vec<Column>, Vec<Vec<Cell>>) {
    let (all, rows) = all(study, rows);
    let Some(names) = &study.sweep.columns else {
        return (all, rows);
    };
    let place = |name: &String| all.iter().position(|column| column.name == *name);
    let places: Vec<usize> = names.iter().filter_map(place).collect();
    let chosen = |row: Vec<Cell>| places.iter().map(|place| row[*place].clone()).collect();
    let rows = rows.into_iter().map(chosen).collect();
    (
        places.iter().map(|place| all[*place].clone()).collect(),
        rows,
    )
}

/// Columns of a table of designs: variables, answers, state and reason.
fn columns(study: &Study) -> Vec<Column> {
    let variables = study.variables.iter().map(variable_column);
    let answers = study.answers.iter().map(|answer| answer.column.clone());
    let ends = ["status", "reason"].map(Column::plain);
    variables.chain(answers).chain(ends).collect()
}

/// Column of a variable, in the unit that the study writes.
pub fn variable_column(variable: &crate::study::Variable) -> Column {
    match variable.values.form() {
        Some(Form::Quantity(dimension, unit)) => {
            let scale = dimension.unit(unit).unwrap_or(1.0);
            let unit = dimension.entry(unit).map_or("", |(unit, _)| unit);
            Column::new(
                &variable.name,
                unit,
                scale,
                crate::answers::key_of(dimension),
                4,
            )
        }
        Some(form) if exponents_of(form) == NONE => Column::new(&variable.name, "", 1.0, "", 4),
        _ => Column::plain(&variable.name),
    }
}

/// Cells of one row, as [`columns`] has them.
fn cells(study: &Study, row: &Row) -> Vec<Cell> {
    let variables = study.variables.iter().zip(&row.point);
    let variables = variables.map(|(variable, value)| match &variable.values {
        Values::Words(words) => {
            let word = &words[(*value as usize).min(words.len() - 1)];
            let text = word
                .as_str()
                .map_or_else(|| word.to_string(), str::to_owned);
            Cell::from(text.trim().to_owned())
        }
        _ => Cell::Number(*value),
    });
    let answers = row.answers.iter().map(|outcome| match outcome {
        Outcome::Number(number) => Cell::Number(*number),
        Outcome::Word(word) => Cell::from(word.clone()),
        _ => Cell::Missing,
    });
    let ends = [
        Cell::from(row.status.name()),
        Cell::from(row.reason.clone()),
    ];
    variables.chain(answers).chain(ends).collect()
}

/// Reasons of the designs that failed with their numbers, the commonest first.
pub fn reasons(rows: &[Row]) -> Vec<(usize, String)> {
    let mut counted: Vec<(usize, String)> = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.status != crate::study::Status::Done)
    {
        // Numbers differ between designs: the words are counted.
        let reason = format!("{}: {}", row.status.name(), row.reason);
        let plain = |text: &str| {
            text.chars()
                .filter(|c| !c.is_ascii_digit() && *c != '.')
                .collect::<String>()
        };
        match counted
            .iter_mut()
            .find(|(_, known)| plain(known) == plain(&reason))
        {
            Some((count, _)) => *count += 1,
            None => counted.push((1, reason)),
        }
    }
    counted.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    counted
}
