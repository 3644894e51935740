//! Reading what the user names.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use taxel::InputError;
use taxel::device::Device;
use taxel::mechanics::Mechanics;
use taxel::predict::Predictor;
use taxel::sensor::{NoModel, Sensor};
use taxel::shown;
use taxel_calibrate::TrainingFile;

use crate::hash::sha256;
use crate::reading::{text, with_laws, with_shipped_names};
use crate::solutions::Folder;
use crate::{COMMIT, Stop, VERSION};

/// A sensor with what is said of it in files.
#[derive(Debug, Clone)]
pub struct NamedSensor {
    /// Name of the file, or of a shipped sensor.
    pub name: String,
    /// What the text describes.
    pub sensor: Sensor,
    /// SHA-256 of the text.
    pub hash: String,
    /// Text of the file.
    pub text: String,
}

impl NamedSensor {
    /// What heads a JSON document about it.
    pub fn about(&self) -> Map<String, Value> {
        [
            ("sensor", self.sensor.name.as_str()),
            ("sensor_hash", self.hash.as_str()),
            ("version", VERSION),
            ("commit", COMMIT),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), Value::from(value)))
        .collect()
    }

    /// What a file that is made of it says of where it comes from.
    pub fn origin(&self) -> String {
        format!("taxel {VERSION} {COMMIT}, sensor file sha256 {}", self.hash)
    }
}

/// Reads a sensor file, or a shipped one when no such file exists.
///
/// # Errors
/// A file that cannot be read, or its first mistake.
pub fn sensor(path: &Path) -> Result<NamedSensor, Stop> {
    let (name, text) = sensor_text(path)?;
    Ok(sensor_of_text(&name, text)?)
}

/// Name and text of a sensor file, or of a shipped one when no such file exists.
///
/// # Errors
/// A file that cannot be read, with the names of the shipped ones where it is not there.
pub fn sensor_text(path: &Path) -> Result<(String, String), Stop> {
    let name = shown::path(path);
    let text = match Sensor::shipped_text(&name) {
        Some(text) if !path.exists() => text.to_owned(),
        _ => text(path)
            .map_err(|stop| with_shipped_names(stop, path, "sensor", Sensor::shipped_names()))?,
    };
    let text = with_laws(path, &name, text)?;
    Ok((name, text))
}

/// The sensor that a text describes.
///
/// # Errors
/// The first mistake.
pub fn sensor_of_text(name: &str, text: String) -> Result<NamedSensor, InputError> {
    let sensor = Sensor::parse_with(name, &text, &mut Folder::beside(Path::new(name)))?;
    let hash = sha256(text.as_bytes());
    Ok(NamedSensor {
        name: name.to_owned(),
        sensor,
        hash,
        text,
    })
}

impl NamedSensor {
    /// The sensor as calibrations take it.
    pub fn described(&self) -> taxel_calibrate::NamedSensor<'_> {
        taxel_calibrate::NamedSensor {
            name: &self.name,
            text: &self.text,
            sensor: &self.sensor,
        }
    }
}

/// `sensor` by the mechanics that are `asked` for: by closed forms in the place of its table,
/// where those are; else as it is.
///
/// # Errors
/// A drawing for which the closed forms do not hold.
pub fn by_mechanics<'s>(
    sensor: &'s Sensor,
    asked: Option<&Mechanics>,
) -> Result<Cow<'s, Sensor>, Stop> {
    match (asked, &sensor.mechanics) {
        (Some(Mechanics::ClosedForm), Mechanics::Table(_)) => sensor
            .by_closed_forms(&mut Folder::of_user())
            .map(Cow::Owned)
            .map_err(Stop::WrongInput),
        _ => Ok(Cow::Borrowed(sensor)),
    }
}

/// The predictor by the mechanics that are `asked` for, or by those of the sensor file.
///
/// # Errors
/// An element without a model, or without one of these mechanics.
pub fn predictor(sensor: &Sensor, asked: Option<&Mechanics>) -> Result<Box<dyn Predictor>, Stop> {
    let sensor = by_mechanics(sensor, asked)?;
    let device = device(&sensor)?;
    match asked.unwrap_or(&sensor.mechanics) {
        Mechanics::ClosedForm | Mechanics::Table(_) => device.predictor().ok_or_else(|| {
            let element = sensor.element.key();
            Stop::WrongInput(NoModel { element }.to_string())
        }),
        Mechanics::Fem => taxel_bodies::field_predictor(&sensor)
            .map_err(|reason| Stop::WrongInput(reason.to_string())),
    }
}

/// The device that a sensor describes.
///
/// # Errors
/// A board that cannot read the element; never of a sensor that was parsed.
pub fn device(sensor: &Sensor) -> Result<Box<dyn Device + '_>, Stop> {
    sensor
        .device()
        .map_err(|unreadable| Stop::WrongInput(unreadable.to_string()))
}

/// The recordings below `paths`: the CSV files of each folder lie together, and
/// so do the files that are named themselves.
///
/// # Errors
/// A file that cannot be read, or none.
pub fn recordings(paths: &[PathBuf]) -> Result<Vec<Vec<TrainingFile>>, Stop> {
    let mut groups = Vec::new();
    let mut named = Vec::new();
    for path in paths {
        if path.is_dir() {
            folder(path, &mut groups)?;
        } else {
            named.push(recording(path)?);
        }
    }
    groups.push(named);
    groups.retain(|group| !group.is_empty());
    if groups.is_empty() {
        let names: Vec<_> = paths.iter().map(|path| shown::path(path)).collect();
        return Err(Stop::WrongInput(format!(
            "{}: there is no recording in it\nhelp: recordings are files that end in .csv",
            names.join(", ")
        )));
    }
    Ok(groups)
}

fn folder(path: &Path, groups: &mut Vec<Vec<TrainingFile>>) -> Result<(), Stop> {
    let wrong = |error: std::io::Error| {
        Stop::WrongInput(format!("{}: cannot be read: {error}", shown::path(path)))
    };
    let mut inside = std::fs::read_dir(path)
        .and_then(|entries| {
            entries
                .map(|entry| Ok(entry?.path()))
                .collect::<Result<Vec<_>, _>>()
        })
        .map_err(wrong)?;
    inside.sort();
    let is_table = |path: &&PathBuf| {
        path.is_file()
            && path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("csv"))
    };
    let files = inside.iter().filter(is_table).map(|path| recording(path));
    groups.push(files.collect::<Result<_, _>>()?);
    for path in inside.iter().filter(|path| path.is_dir()) {
        folder(path, groups)?;
    }
    Ok(())
}

fn recording(path: &Path) -> Result<TrainingFile, Stop> {
    Ok(TrainingFile {
        name: shown::path(path),
        text: text(path)?,
    })
}

/// True if a figure goes to a page (.html) and not to a picture (.svg).
///
/// # Errors
/// Another ending.
pub fn is_page(path: &Path) -> Result<bool, Stop> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => Ok(false),
        Some("html") => Ok(true),
        _ => Err(Stop::WrongInput(format!(
            "--plot {}: must end in .svg or .html",
            shown::path(path)
        ))),
    }
}
