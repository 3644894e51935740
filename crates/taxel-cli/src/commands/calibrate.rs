//! `taxel calibrate`: calibration data to the constants of one device.

use std::cell::RefCell;

use taxel::sensor::Element;
use taxel::shown;
use taxel::table;
use taxel_calibrate::{
    CalibrateOptions, HoldOut, NamedSensor, Outcome, Provenance, ReadingTable, TrainedOutcome,
    calibrator, train_saying,
};
use taxel_files::{COMMIT, Progress, VERSION};

use crate::arguments::{Calibrate, CalibrateFormat};
use crate::{Done, Stop, files, outputs};

pub(crate) fn run(arguments: &Calibrate) -> Result<Done, Stop> {
    let inputs = arguments.data.iter().chain(&arguments.with);
    let inputs: Vec<_> = inputs.chain([&arguments.sensor]).collect();
    let outputs = [
        ("--output", arguments.output.as_ref()),
        ("--report", arguments.report.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    outputs::check(&outputs, &inputs, existing)?;
    let named = files::read_sensors(&arguments.sensor, &arguments.with)?;
    let sensors: Vec<_> = named.iter().map(files::NamedSensor::described).collect();
    let options = CalibrateOptions {
        hold_out: HoldOut::parse(&arguments.hold_out)
            .map_err(|message| Stop::WrongInput(format!("--hold-out: {message}")))?,
        model: arguments.model.clone(),
        profile: arguments.profile,
        robust: arguments.robust,
        rate: arguments.rate,
        scale_unit: arguments.scale_unit.map(Into::into),
    };
    let found = match sensors.as_slice() {
        [named] if matches!(named.sensor.element, Element::Trained(_)) => {
            trained(arguments, named, &options)?
        }
        _ => fitted(arguments, &sensors, &options)?,
    };
    let (version, date) = (format!("{VERSION} {COMMIT}"), files::today());
    let about = Provenance {
        version: &version,
        date: &date,
        data: &found.data,
        data_hash: &found.hash,
    };
    let outcome = &found.outcome;
    if let Some(path) = &arguments.output {
        let text = match &found.maps {
            Some(maps) => maps.to_toml(&about),
            None => outcome.to_toml(&about),
        };
        outputs::write(Some(path), existing, &text)?;
    }
    if let Some(path) = &arguments.report {
        outputs::write(Some(path), existing, &outcome.html(&about))?;
    }
    let result = match arguments.format {
        CalibrateFormat::Table => outcome.text(),
        CalibrateFormat::Json => table::json(&outcome.json(&about)),
    };
    outputs::print_beside(arguments.output.as_deref(), &result)
}

/// Result of a calibration, and the readings it is from.
struct Found {
    outcome: Outcome,
    /// The same with the maps of a device that was trained.
    maps: Option<TrainedOutcome>,
    data: String,
    hash: String,
}

/// Constants of a model from tables.
fn fitted(
    arguments: &Calibrate,
    sensors: &[NamedSensor<'_>],
    options: &CalibrateOptions,
) -> Result<Found, Stop> {
    let calibrator = calibrator(sensors).map_err(|error| Stop::WrongInput(error.to_string()))?;
    let (mut tables, mut names, mut texts) = (Vec::new(), Vec::new(), String::new());
    for path in &arguments.data {
        let (file, text) = (shown::path(path), files::text(path)?);
        let table = ReadingTable::parse(&file, &text, calibrator.columns(), calibrator.group())?;
        tables.push(table);
        names.push(file);
        texts.push_str(&text);
    }
    Ok(Found {
        outcome: calibrator.calibrate_all(&tables, options)?,
        maps: None,
        hash: files::sha256(texts.as_bytes()),
        data: names.join(", "),
    })
}

/// Maps from recordings.
fn trained(
    arguments: &Calibrate,
    named: &NamedSensor<'_>,
    options: &CalibrateOptions,
) -> Result<Found, Stop> {
    let groups = files::recordings(&arguments.data)?;
    let texts: Vec<&str> = groups
        .iter()
        .flatten()
        .map(|file| file.text.as_str())
        .collect();
    let names: Vec<_> = arguments
        .data
        .iter()
        .map(|path| shown::path(path))
        .collect();
    let step = RefCell::new(Progress::new("reading recordings"));
    let maps = train_saying(named, &groups, options, &|what| {
        step.replace(Progress::new(format!("learning {what}")));
    })?;
    Ok(Found {
        outcome: maps.outcome.clone(),
        hash: files::sha256(texts.concat().as_bytes()),
        data: names.join(", "),
        maps: Some(maps),
    })
}
