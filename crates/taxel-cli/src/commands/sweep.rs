//! `taxel sweep`: one question to many drawings.

use std::sync::Mutex;

use serde_json::{Map, Value};
use taxel::design::{self, Study};
use taxel::sensor::Element;
use taxel::table;

use crate::arguments::{COMMIT, Sweep, VERSION};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Sweep) -> Result<Done, Stop> {
    let outputs = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    files::check_outputs(&outputs, &[&arguments.study])?;
    let name = arguments.study.to_string_lossy().into_owned();
    let text = match Study::shipped_text(&name) {
        Some(text) if !arguments.study.exists() => text.to_owned(),
        _ => files::text(&arguments.study).map_err(with_shipped_names)?,
    };
    let study = Study::parse(&name, &text)?;
    let named = files::sensor(study.sensor.as_ref())?;
    let Element::Microchannel(element) = &named.sensor.element else {
        return Err(Stop::WrongInput(format!(
            "{name}: sensor = {:?} is a {}; microchannel_sections needs a microchannel",
            study.sensor,
            named.sensor.element.key()
        )));
    };
    let plot = arguments
        .plot
        .as_deref()
        .map(|path| Ok::<_, Stop>((path, files::is_page(path)?)));
    let plot = plot.transpose()?;
    let interrupt = Interrupt::listen();
    let progress = Mutex::new(Progress::new("sweeping"));
    let rows = design::sweep(
        &study.microchannel_sections,
        element,
        named.sensor.array.pitch[0],
        &|fraction| {
            if let Ok(mut progress) = progress.lock() {
                progress.at(fraction);
            }
            !interrupt.asked()
        },
    );
    if let Ok(mut progress) = progress.into_inner() {
        progress.end();
    }
    let mut about = Map::new();
    for (key, value) in [
        ("study", study.name.as_str()),
        ("sensor", named.sensor.name.as_str()),
        ("sensor_hash", named.hash.as_str()),
        ("version", VERSION),
        ("commit", COMMIT),
    ] {
        about.insert(key.into(), Value::from(value));
    }
    let answer = table::render(
        arguments.format.into(),
        &about,
        &design::columns(),
        &design::cells(&rows),
    );
    files::write(arguments.output.as_deref(), &answer)?;
    if let Some((path, page)) = plot {
        let map = design::heat_map(&study.name, &study.microchannel_sections, &rows);
        files::write(Some(path), &if page { map.html() } else { map.svg() })?;
    }
    let ended = rows.iter().filter(|row| row.ended.is_some()).count();
    if ended > 0 {
        eprintln!(
            "note: {ended} of {} designs end before the last pressure (state beyond_solution)",
            rows.len()
        );
    }
    let sections = &study.microchannel_sections;
    let asked = sections.heights.count * sections.covers.count;
    if rows.len() < asked {
        eprintln!("note: stopped after {} of {asked} designs", rows.len());
        return Ok(Done::WithLosses);
    }
    Ok(Done::Complete)
}

fn with_shipped_names(stop: Stop) -> Stop {
    match stop {
        Stop::WrongInput(message) => {
            let names: Vec<_> = Study::shipped_names().collect();
            Stop::WrongInput(format!(
                "{message}\nhelp: give a file, or a shipped study: {}",
                names.join(", ")
            ))
        }
        Stop::Failed(message) => Stop::Failed(message),
    }
}
