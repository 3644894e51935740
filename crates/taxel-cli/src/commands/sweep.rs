//! `taxel sweep`: one question to many drawings.

use std::path::PathBuf;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use serde_json::{Map, Value};
use taxel::design::{self, MicrochannelSections, SectionRow, Study};
use taxel::sensor::{Element, Microchannel};
use taxel::shown;
use taxel::table;

use crate::arguments::{COMMIT, Sweep, VERSION};
use crate::interrupt::Interrupt;
use crate::outputs;
use crate::progress::Progress;
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Sweep) -> Result<Done, Stop> {
    let outputs = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    outputs::check(&outputs, &[&arguments.study], existing)?;
    let name = shown::path(&arguments.study);
    let text = match Study::shipped_text(&name) {
        Some(text) if !arguments.study.exists() => text.to_owned(),
        _ => files::text(&arguments.study).map_err(|stop| {
            files::with_shipped_names(stop, &arguments.study, "study", Study::shipped_names())
        })?,
    };
    let study = Study::parse(&name, &text)?;
    let sensor = PathBuf::from(&study.sensor);
    outputs::check(&outputs, &[&arguments.study, &sensor], existing)?;
    let named = files::sensor(&sensor)?;
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
    let rows = solved(
        &study.microchannel_sections,
        element,
        named.sensor.array.pitch[0],
    );
    let sections = &study.microchannel_sections;
    let asked = sections.heights.count * sections.covers.count;
    if rows.is_empty() {
        note!("note: stopped before the first of {asked} designs; nothing was written");
        return Ok(Done::WithLosses);
    }
    let answer = table::render(
        arguments.format.into(),
        &about(&study, &named),
        &design::columns(),
        &design::cells(&rows),
    );
    outputs::write(arguments.output.as_deref(), existing, &answer)?;
    if let Some((path, page)) = plot {
        let map = design::heat_map(&study.name, sections, &rows);
        let text = if page { map.html() } else { map.svg() };
        outputs::write(Some(path), existing, &text)?;
    }
    let ended = rows.iter().filter(|row| row.ended.is_some()).count();
    if ended > 0 {
        note!(
            "note: {ended} of {} designs end before the last pressure (state beyond_solution)",
            rows.len()
        );
    }
    if rows.len() < asked {
        note!("note: stopped after {} of {asked} designs", rows.len());
        return Ok(Done::WithLosses);
    }
    Ok(Done::Complete)
}

fn about(study: &Study, named: &files::NamedSensor) -> Map<String, Value> {
    [
        ("study", study.name.as_str()),
        ("sensor", named.sensor.name.as_str()),
        ("sensor_hash", named.hash.as_str()),
        ("version", VERSION),
        ("commit", COMMIT),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_owned(), Value::from(value)))
    .collect()
}

/// Pause between two looks at whether the user wants to stop.
const LOOK: Duration = Duration::from_millis(50);

/// The designs that are solved before the user stops, in the order of the study.
///
/// What is being solved then is given up: one design may take long.
fn solved(sections: &MicrochannelSections, element: &Microchannel, pitch: f64) -> Vec<SectionRow> {
    let interrupt = Interrupt::listen();
    let mut progress = Progress::new("sweeping");
    let (sender, done) = mpsc::channel();
    let (owned, element) = (sections.clone(), element.clone());
    std::thread::spawn(move || {
        design::sweep(&owned, &element, pitch, &|fraction, row| {
            sender.send((fraction, row.clone())).is_ok()
        });
    });
    let mut rows: Vec<SectionRow> = Vec::new();
    while !interrupt.asked() {
        match done.recv_timeout(LOOK) {
            Ok((fraction, row)) => {
                progress.at(fraction);
                rows.push(row);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    progress.end();
    rows.sort_by(|a, b| {
        let by_height = a.height.total_cmp(&b.height);
        by_height.then(a.cover.total_cmp(&b.cover))
    });
    rows
}
