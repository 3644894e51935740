//! Reading what the user names.

use std::borrow::Cow;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use taxel::InputError;
use taxel::device::Device;
use taxel::mechanics::Mechanics;
use taxel::predict::Predictor;
use taxel::sensor::{NoModel, Sensor};
use taxel::shown;
use taxel::words::advice;
use taxel_calibrate::TrainingFile;

use crate::hash::sha256;
use crate::solutions::Folder;
use crate::{COMMIT, Stop, VERSION};

/// Largest description or table that is read, bytes.
const LARGEST: u64 = 1 << 28;

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

/// A description with the law files that it names; `path` is its own, from whose folder their names
/// count. A test of a law that is not as it was when the law was fitted is noted.
///
/// # Errors
/// A law file that cannot be read.
pub fn with_laws(path: &Path, name: &str, mut text: String) -> Result<String, Stop> {
    let folder = path.parent().unwrap_or(Path::new(""));
    for (file, key) in taxel_material::unread_files(&text) {
        let law_path = folder.join(&file);
        let law = self::text(&law_path).map_err(|stop| match stop {
            Stop::WrongInput(message) => {
                let key: Vec<&str> = key.iter().map(String::as_str).collect();
                let help = "the name counts from the folder of this file";
                taxel::toml_input::at_key(name, &text, &key, &message, help).into()
            }
            stop @ Stop::Failed(_) => stop,
        })?;
        law_file(&law_path, &law)?;
        text = taxel_material::with_file(&text, &file, &law);
    }
    Ok(text)
}

/// The material of a law file with this text; a test that is not as it was when the law was fitted is
/// noted.
///
/// # Errors
/// The first mistake of the file.
pub fn law_file(path: &Path, text: &str) -> Result<taxel_material::Material, Stop> {
    let name = shown::path(path);
    let material = taxel_material::Material::parse(&name, text)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for test in &material.tests {
        // A test that is not there says nothing against the law.
        if let Ok(text) = self::text(&folder.join(&test.file))
            && sha256(text.as_bytes()) != test.sha256
        {
            let test = shown::text(&test.file);
            crate::note!(
                "note: {name}: the test {test} has changed since the law was fitted: fit it again"
            );
        }
    }
    Ok(material)
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

/// Names what is shipped where a file is not there; `kind` is what its name stands for.
pub fn with_shipped_names<'n>(
    stop: Stop,
    path: &Path,
    kind: &str,
    names: impl Iterator<Item = &'n str>,
) -> Stop {
    match stop {
        Stop::WrongInput(message) if !path.exists() => {
            let names: Vec<_> = names.collect();
            let all = format!("give a file, or a shipped {kind}: {}", names.join(", "));
            let help = advice(&shown::path(path), names, &all);
            Stop::WrongInput(format!("{message}\nhelp: {help}"))
        }
        stop => stop,
    }
}

/// Reads a text file; `-` is the standard input.
///
/// # Errors
/// A file that cannot be read, or is no text.
pub fn text(path: &Path) -> Result<String, Stop> {
    taxel_ground::text_of(bytes(path)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let before = String::from_utf8_lossy(&error.as_bytes()[..at]).into_owned();
        let line = before.matches('\n').count() + 1;
        Stop::WrongInput(format!(
            "{}: line {line} is not UTF-8 text (byte {at})\nhelp: save the file as UTF-8",
            shown::path(path)
        ))
    })
}

/// Reads a file; `-` is the standard input.
///
/// # Errors
/// A file that cannot be read, or is too long.
pub fn bytes(path: &Path) -> Result<Vec<u8>, Stop> {
    let wrong = |message: String| Stop::WrongInput(format!("{}: {message}", shown::path(path)));
    let failed = |error: std::io::Error| wrong(format!("cannot be read: {error}"));
    let mut bytes = Vec::new();
    if path.as_os_str() == "-" {
        let mut input = std::io::stdin().lock().take(LARGEST + 1);
        input.read_to_end(&mut bytes).map_err(failed)?;
    } else {
        let about = std::fs::metadata(path).map_err(failed)?;
        if about.is_dir() {
            return Err(wrong("is a folder; a file is needed".into()));
        }
        if !about.is_file() && !is_handed_over(path) {
            let message =
                "is a device, pipe or socket; give an ordinary file, or - for the standard input";
            return Err(wrong(message.into()));
        }
        let file = std::fs::File::open(path).map_err(failed)?;
        file.take(LARGEST + 1)
            .read_to_end(&mut bytes)
            .map_err(failed)?;
    }
    if bytes.len() as u64 > LARGEST {
        let message = format!("has more than {LARGEST} bytes, which is the most that is read");
        return Err(wrong(message));
    }
    Ok(bytes)
}

/// True for what the shell hands over open: the standard input by its name, and
/// `<(command)`.
fn is_handed_over(path: &Path) -> bool {
    path == Path::new("/dev/stdin") || path.starts_with("/dev/fd")
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
