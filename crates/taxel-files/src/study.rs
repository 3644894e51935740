//! Study files with their sensors.

use std::path::{Path, PathBuf};

use taxel::sensor::Sensor;
use taxel::shown;
use taxel::solutions::Solutions;
use taxel_study::store::MOST_IN_BLOCK;
use taxel_study::study::{SensorText, Study, header};

use crate::solutions::Folder;
use crate::{Stop, files, reading};

/// A study file with its text.
pub struct StudyText {
    /// Name for messages.
    pub name: String,
    /// Text of the file.
    pub text: String,
    /// Where it is.
    pub path: PathBuf,
}

/// The file that a study names: names count from its own folder.
pub fn beside(study: &Path, named: &str) -> PathBuf {
    study.parent().unwrap_or(Path::new("")).join(named)
}

/// The sensor that a study names: a file, or else a shipped one.
pub fn sensor_path(study: &Path, named: &str) -> PathBuf {
    let file = beside(study, named);
    if Sensor::shipped_text(named).is_some() && !file.exists() {
        return PathBuf::from(named);
    }
    file
}

/// The text of a study file, or of a shipped one.
///
/// # Errors
/// A file that cannot be read.
pub fn text(path: &Path) -> Result<StudyText, Stop> {
    let name = shown::path(path);
    let text = match taxel_study::shipped_text(&name) {
        Some(text) if !path.exists() => text.to_owned(),
        _ => reading::text(path).map_err(|stop| {
            reading::with_shipped_names(stop, path, "study", taxel_study::shipped_names())
        })?,
    };
    Ok(StudyText {
        name,
        text,
        path: path.to_owned(),
    })
}

/// The study of a text with the sensor that it names; the sensor's path is an input, too.
///
/// # Errors
/// A mistake in the file, or a sensor that cannot be read.
pub fn read(study: &StudyText) -> Result<(Study, PathBuf), Stop> {
    let head = header(&study.name, &study.text)?;
    let path = sensor_path(&study.path, &head.sensor);
    let text = sensor_text(&study.name, &path)?;
    let sensor = SensorText {
        name: &head.sensor,
        text: &text,
    };
    let beside = path.clone();
    let solutions = Box::new(move || Box::new(Folder::beside(&beside)) as Box<dyn Solutions>);
    Ok((
        Study::parse(&study.name, &study.text, &sensor, solutions)?,
        path,
    ))
}

/// The text of the sensor that the study called `study` names.
///
/// # Errors
/// A file that cannot be read.
pub fn sensor_text(study: &str, sensor: &Path) -> Result<String, Stop> {
    let (_, text) = files::sensor_text(sensor).map_err(|stop| match stop {
        Stop::WrongInput(message) => Stop::WrongInput(format!("{study}: sensor: {message}")),
        stop @ Stop::Failed(_) => stop,
    })?;
    Ok(text)
}

/// True if one design of a study takes long.
pub fn slow(study: &Study, text: &str) -> bool {
    text.contains("\"fem\"") || text.contains("channel_section") || {
        // A sensor file may ask for finite elements itself.
        let (text, _) = study.text_of(&study.nominal());
        text.contains("mechanics = \"fem\"")
    }
}

/// Number of designs in a block of the store of `designs`: one of those that take long, else
/// so many that there are some 64 blocks and shards have work.
pub fn block(study: &Study, text: &str, designs: usize) -> usize {
    if slow(study, text) {
        1
    } else {
        designs.div_ceil(64).clamp(1, MOST_IN_BLOCK)
    }
}
