//! A session file: several sensors and their sources in place of arguments.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use taxel::toml_input;

use crate::arguments::Live;
use crate::{Stop, files};

/// A source that is a file.
const REPLAY: &str = "replay:";

/// Sensors that run side by side, and one name for their recordings. Paths are relative to the folder
/// of the file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SessionFile {
    schema: u32,
    /// As `--record`.
    record: Option<PathBuf>,
    sensor: Vec<SessionSensor>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SessionSensor {
    /// Sensor file, or the name of a shipped one.
    file: PathBuf,
    /// As `--source`.
    source: String,
    /// As `--board`.
    board: Option<PathBuf>,
    /// As `--calibration`.
    calibration: Option<PathBuf>,
}

/// What is asked of each sensor of the session in the file at `path`; all else is as `arguments` say.
pub(super) fn each(path: &Path, arguments: &Live) -> Result<Vec<Live>, Stop> {
    let text = files::text(path)?;
    let name = taxel::shown::path(path);
    let session: SessionFile = toml_input::parse(&name, &text)?;
    let wrong = |key: &str, message: &str, help: &str| {
        Stop::from(toml_input::at_key(&name, &text, &[key], message, help))
    };
    if session.schema != 1 {
        let message = format!("schema {} is not known", session.schema);
        return Err(wrong("schema", &message, "write schema = 1"));
    }
    if session.sensor.is_empty() {
        return Err(wrong("sensor", "no sensor", "add a table [[sensor]]"));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    // A name without an extension is one of those that the program has.
    let beside = |path: PathBuf| match path.extension() {
        Some(_) => folder.join(path),
        None => path,
    };
    let record = session.record.map(|path| folder.join(path));
    let one = |sensor: SessionSensor| {
        let mut one = arguments.clone();
        one.named_sensor = Some(beside(sensor.file));
        one.source = match sensor.source.strip_prefix(REPLAY) {
            Some(file) => format!("{REPLAY}{}", folder.join(file).to_string_lossy()),
            None => sensor.source,
        };
        one.link.board = sensor.board.map(beside);
        one.calibration = sensor.calibration.map(beside);
        one.recording.record = one.recording.record.or_else(|| record.clone());
        one
    };
    Ok(session.sensor.into_iter().map(one).collect())
}
