//! `taxel predict`: loads in, electrical response out.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use taxel::InputError;
use taxel::mechanics::Mechanics;
use taxel::predict::{self, Answers, LoadRefused, Loads, Predictor, Refusal, SolvedBody};
use taxel::sensor::Sensor;
use taxel::shown;
use taxel_study::made::{DEVICES, MadeDevices};

use crate::arguments::Predict;
use crate::interrupt;
use crate::outputs::{self, Existing};
use crate::{Done, Stop, files};
use taxel_files::Progress;

/// Seed of the devices of `--spread`: the same answer each time.
const SEED: u64 = 1;

pub(crate) fn run(arguments: &Predict) -> Result<Done, Stop> {
    let tables = arguments.loads.iter().chain(&arguments.calibration);
    let inputs: Vec<_> = tables.chain([&arguments.sensor]).collect();
    let outputs = [
        ("--output", arguments.output.as_ref()),
        ("--plot", arguments.plot.as_ref()),
    ];
    let existing = arguments.overwrite.existing();
    outputs::check(&outputs, &inputs, existing)?;
    if let Some(path) = arguments
        .vtu
        .as_ref()
        .filter(|path| path.exists() && !path.is_dir())
    {
        let path = shown::path(path);
        return Err(Stop::WrongInput(format!(
            "--vtu {path}: is a file; name a folder"
        )));
    }
    if let Some(folder) = &arguments.vtu {
        no_grid_in(folder, existing)?;
    }
    let named = files::sensor(&arguments.sensor)?;
    let mut predictor = predictor(arguments, &named)?;
    let loads = loads(arguments, predictor.as_ref())?;
    prepare(predictor.as_mut(), &loads)?;
    let bodies = if arguments.vtu.is_some() || arguments.plot.is_some() {
        predictor.bodies().map_err(Stop::Failed)?
    } else {
        Vec::new()
    };
    let grids = match &arguments.vtu {
        Some(folder) => grids(folder, &bodies)?,
        None => Vec::new(),
    };
    let refused = |index: usize, refused: &LoadRefused| {
        refusal(arguments, loads.line(index), refused, predictor.as_ref())
    };
    let about = named.about();
    let figure = match &arguments.plot {
        Some(path) => Some((
            path,
            plot(
                path,
                &title(&named.sensor.name, arguments),
                predictor.as_ref(),
                &loads,
                &bodies,
            )?,
        )),
        None => None,
    };
    let answers = Answers::new(predictor.as_ref(), &loads);
    interrupt::leave_nothing_unfinished();
    outputs::write_pieces(arguments.output.as_deref(), existing, |sink| {
        answers
            .write(arguments.format.into(), &about, sink)
            .map_err(|refusal| match refusal {
                Refusal::Load(index, why) => refused(index, &why),
                Refusal::Sink(stop) => stop,
            })
    })?;
    if let Some((path, text)) = figure {
        outputs::write(Some(path), existing, &text)?;
    }
    if let Some(folder) = arguments.vtu.as_ref().filter(|_| !grids.is_empty()) {
        fs::create_dir_all(folder).map_err(|error| outputs::cannot_write(folder, &error))?;
    }
    for (path, text) in grids {
        outputs::write(Some(&path), existing, &text)?;
    }
    Ok(Done::Complete)
}

/// Refuses, before anything is solved, a folder that has grids already.
fn no_grid_in(folder: &Path, existing: Existing) -> Result<(), Stop> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) if existing != Existing::Replaced => entries,
        _ => return Ok(()),
    };
    let mut paths = entries.flatten().map(|entry| entry.path());
    match paths.find(|path| path.extension().is_some_and(|ending| ending == "vtu")) {
        None => Ok(()),
        Some(grid) => Err(Stop::WrongInput(format!(
            "--vtu {}: has {} already\nhelp: name another folder, or add --force",
            shown::path(folder),
            shown::path(&grid)
        ))),
    }
}

/// Files of the bodies that were solved.
fn grids(folder: &Path, bodies: &[Arc<dyn SolvedBody>]) -> Result<Vec<(PathBuf, String)>, Stop> {
    if bodies.is_empty() {
        let message = "--vtu: nothing was solved by finite elements: add --mechanics fem and a load, and name a sensor \
                       whose mechanics is solved that way (an in_plane_capacitor, a microchannel, or a three_axis_capacitor whose \
                       stiffness follows from its drawing)";
        return Err(Stop::WrongInput(message.into()));
    }
    let several = bodies.len() > 1;
    let file = |(number, body): (usize, &Arc<dyn SolvedBody>)| {
        let name = if several {
            format!("{}-{}.vtu", body.name(), number + 1)
        } else {
            format!("{}.vtu", body.name())
        };
        let text = body
            .vtu()
            .map_err(|error| Stop::Failed(format!("--vtu: {error}")))?;
        Ok((folder.join(name), text))
    };
    bodies.iter().enumerate().map(file).collect()
}

/// The predictor by the mechanics asked for, on the command line or in the
/// file, of the sensor as drawn or as calibrated.
fn predictor(arguments: &Predict, named: &files::NamedSensor) -> Result<Box<dyn Predictor>, Stop> {
    let Some(path) = &arguments.calibration else {
        let text = (named.name.as_str(), named.text.as_str());
        return mechanics(arguments, &named.sensor, Some(text));
    };
    let of = |sensor: &Sensor| mechanics(arguments, sensor, None);
    let calibrated = files::applied(named.clone(), Some(path))?;
    files::propagated(of(&calibrated.sensor)?, named, path, of)
}

fn mechanics(
    arguments: &Predict,
    sensor: &Sensor,
    text: Option<(&str, &str)>,
) -> Result<Box<dyn Predictor>, Stop> {
    let asked = arguments.mechanics.map(Mechanics::from);
    let asked = asked.as_ref();
    if !arguments.spread {
        return files::predictor(sensor, asked);
    }
    if *asked.unwrap_or(&sensor.mechanics) == Mechanics::Fem {
        return Err(Stop::WrongInput(String::from(
            "--spread asks a thousand devices, and --mechanics fem takes seconds for each\nhelp: leave one of them out, \
             or tabulate the drawing: taxel tabulate",
        )));
    }
    let sensor = files::by_mechanics(sensor, asked)?;
    let drawn = files::predictor(&sensor, asked)?;
    spread(&sensor, text, drawn)
}

/// The same with the interval that the deviations of the sensor file and its materials leave.
fn spread(
    sensor: &Sensor,
    text: Option<(&str, &str)>,
    drawn: Box<dyn Predictor>,
) -> Result<Box<dyn Predictor>, Stop> {
    let made = MadeDevices::new(sensor, text, drawn, DEVICES, SEED)
        .map_err(|error| Stop::WrongInput(format!("--spread: {error}")))?;
    let made = made.ok_or_else(|| {
        Stop::WrongInput(format!(
            "--spread: a sensor of the element `{}` states no deviation of made devices\nhelp: leave it out",
            sensor.element.key()
        ))
    })?;
    Ok(Box::new(made))
}

/// Solves what takes long, with its progress on the standard error.
fn prepare(predictor: &mut dyn Predictor, loads: &Loads) -> Result<(), Stop> {
    let progress = Progress::new("solving");
    let remark = predictor
        .prepare(loads, &mut |fraction| progress.at(fraction))
        .map_err(Stop::Failed)?;
    drop(progress);
    if let Some(remark) = remark {
        note!("note: {remark}");
    }
    Ok(())
}

fn loads(arguments: &Predict, predictor: &dyn Predictor) -> Result<Loads, Stop> {
    let columns = predictor.load_columns();
    let (file, loads) = if let Some(spec) = &arguments.load {
        (String::from("--load"), Loads::one(spec, columns)?)
    } else {
        let path = arguments.loads.as_deref().unwrap_or_else(|| Path::new(""));
        let file = shown::path(path);
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
    line: usize,
    refused: &LoadRefused,
    predictor: &dyn Predictor,
) -> Stop {
    let columns = predictor.load_columns();
    let key = columns.get(refused.column).map_or("", |column| column.name);
    let (file, message) = match &arguments.loads {
        Some(path) => (
            shown::path(path),
            format!("line {line}: {}", refused.message),
        ),
        None => ("--load".into(), refused.message.clone()),
    };
    let error = InputError::whole(&file, message);
    error.key(key).help(&refused.help).into()
}

/// Title of a figure: what it is of, and what was loaded.
fn title(name: &str, arguments: &Predict) -> String {
    let load = match (&arguments.load, &arguments.loads) {
        (Some(load), _) => load.clone(),
        (None, Some(file)) => format!("the loads of {}", shown::path(file)),
        (None, None) => return name.to_owned(),
    };
    format!("{name}: {load}")
}

fn plot(
    path: &Path,
    title: &str,
    predictor: &dyn Predictor,
    loads: &Loads,
    bodies: &[Arc<dyn SolvedBody>],
) -> Result<String, Stop> {
    let html = files::is_page(path)?;
    let figure = predict::figure(title, predictor, loads).map_err(|refused| {
        Stop::WrongInput(format!(
            "--plot: {}\nhelp: {}",
            refused.message, refused.help
        ))
    })?;
    let solved = bodies
        .iter()
        .map(|body| {
            let title = format!("Deformed body ({})", body.load());
            Ok((title, body.picture()?))
        })
        .collect::<Result<Vec<_>, String>>()
        .map_err(|error| Stop::Failed(format!("--plot: {error}")))?;
    // Of a table of loads, the last one.
    let last = loads.len().checked_sub(1);
    let fields = last.map(|index| predictor.pictures(&loads.load(index)));
    let pictures: Vec<_> = solved
        .into_iter()
        .chain(fields.into_iter().flatten())
        .collect();
    Ok(if html {
        figure.html_with(&pictures)
    } else {
        figure.svg_with(&pictures)
    })
}
