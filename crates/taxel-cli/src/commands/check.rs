//! `taxel check`: what a sensor file or a board file says and what follows from it.

use serde_json::{Map, Value as Json};
use taxel::summary::{Fact, Value, fact, number, summary, text};

use taxel::table::{self, Cell, Column, Format};
use taxel_files::{COMMIT, VERSION};
use taxel_material::Used;

use crate::arguments::Check;
use crate::outputs::Existing;
use crate::{Done, Stop, boards, files, outputs};

pub(crate) fn run(arguments: &Check) -> Result<Done, Stop> {
    let outputs = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    if boards::is_board(&arguments.sensor)? {
        return board(arguments, existing);
    }
    let named = files::sensor(&arguments.sensor).map_err(|stop| match stop {
        Stop::WrongInput(message) if !arguments.sensor.exists() => {
            let boards = boards::shipped();
            Stop::WrongInput(format!("{message}; or a shipped board: {boards}"))
        }
        stop => stop,
    })?;
    let mut facts =
        summary(&named.sensor).map_err(|unreadable| Stop::WrongInput(unreadable.to_string()))?;
    let compression = files::device(&named.sensor)?.compression();
    for used in taxel_material::used(&named.name, &named.text)? {
        facts.extend(of_material(&used, compression));
    }
    let text = rendered(&facts, arguments, ("sensor_hash", &named.hash));
    if let Some(path) = &arguments.plot {
        let drawing = files::device(&named.sensor)?.drawing();
        outputs::write(Some(path), existing, &drawing.svg())?;
    }
    outputs::write(arguments.output.as_deref(), existing, &text)
}

/// What a material that the file names is, and where it does not know what it is asked.
fn of_material(used: &Used, compression: Option<f64>) -> Vec<Fact> {
    let material = &used.material;
    let modulus = material.law.youngs_modulus();
    let say = |name: &str, value, source: &str| fact("material", name, value, source.to_owned());
    let mut facts = vec![
        say("name", text(&material.name), &used.key),
        say("law", text(&material.law.to_string()), &material.source),
        say(
            "youngs_modulus",
            number(modulus, "pa", "MPa", 1e6),
            "3 mu at small strain",
        ),
    ];
    for (name, end) in ["youngs_modulus_lowest", "youngs_modulus_greatest"]
        .into_iter()
        .zip(material.interval.into_iter().flatten())
    {
        let basis = format!(
            "95 %: {}",
            if material.basis.is_empty() {
                &material.source
            } else {
                &material.basis
            }
        );
        facts.push(say(name, number(3.0 * end, "pa", "MPa", 1e6), &basis));
    }
    if !material.note.is_empty() {
        facts.push(say("note", text(&material.note), &material.source));
    }
    // What a tactile sensor is of is pressed.
    let beyond = material.beyond(compression.map(|most| [1.0 - most, 1.0]), true);
    facts.extend(beyond.map(|beyond| say("warning", text(&beyond), "range of the law")));
    facts
}

/// What follows from a board file.
fn board(arguments: &Check, existing: Existing) -> Result<Done, Stop> {
    if arguments.plot.is_some() {
        let message = "--plot: a board file has no drawing; give a sensor file";
        return Err(Stop::WrongInput(message.into()));
    }
    let named = boards::board(&arguments.sensor)?;
    let hash = files::sha256(named.text.as_bytes());
    let text = rendered(&named.board.facts(), arguments, ("board_hash", &hash));
    outputs::write(arguments.output.as_deref(), existing, &text)
}

fn rendered(facts: &[Fact], arguments: &Check, hash: (&str, &str)) -> String {
    let format = arguments.format.into();
    if format == Format::Json {
        return json(facts, hash);
    }
    let columns = ["group", "quantity", "value", "unit", "from"].map(Column::plain);
    let rows: Vec<Vec<Cell>> = facts.iter().map(row).collect();
    table::render(format, &Map::new(), &columns, &rows)
}

fn row(fact: &Fact) -> Vec<Cell> {
    let (value, unit) = match &fact.value {
        Value::Number {
            si, unit, scale, ..
        } => (significant(si / scale), *unit),
        Value::Text(text) => (text.clone(), ""),
    };
    [fact.group, &fact.name, &value, unit, &fact.source]
        .map(|text| Cell::from(text.to_owned()))
        .into()
}

/// Five significant digits, as a person would write them.
fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = (4 - value.abs().log10().floor() as i32).clamp(0, 12);
    format!("{value:.*}", decimals as usize)
}

fn json(facts: &[Fact], hash: (&str, &str)) -> String {
    let mut whole = Map::new();
    for (key, value) in [hash, ("version", VERSION), ("commit", COMMIT)] {
        whole.insert(key.into(), Json::from(value));
    }
    for fact in facts {
        let group = whole
            .entry(fact.group)
            .or_insert_with(|| Json::Object(Map::new()));
        let (key, value) = match &fact.value {
            Value::Number { si, key, .. } => {
                (format!("{}_{key}", fact.name), table::number_or_null(*si))
            }
            Value::Text(text) => (fact.name.clone(), Json::from(text.clone())),
        };
        if let Json::Object(group) = group {
            group.insert(key, value);
        }
    }
    table::json(&Json::Object(whole))
}
