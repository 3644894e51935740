//! Reading what the user names and writing results whole or not at all.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use taxel::device::Device;
use taxel::sensor::Sensor;
use taxel_calibrate::TrainingFile;

use crate::{Done, Stop};

/// Largest description or table that is read, bytes.
const LARGEST: u64 = 1 << 28;

/// A sensor with what is said of it in files.
#[derive(Clone)]
pub(crate) struct NamedSensor {
    /// Name of the file, or of a shipped sensor.
    pub(crate) name: String,
    pub(crate) sensor: Sensor,
    /// SHA-256 of the text.
    pub(crate) hash: String,
    pub(crate) text: String,
}

/// Reads a sensor file, or a shipped one when no such file exists.
pub(crate) fn sensor(path: &Path) -> Result<NamedSensor, Stop> {
    let name = path.to_string_lossy();
    let text = match Sensor::shipped_text(&name) {
        Some(text) if !path.exists() => text.to_owned(),
        _ => text(path).map_err(|stop| with_shipped_names(stop, path))?,
    };
    let sensor = Sensor::parse(&name, &text)?;
    let hash = sha256(text.as_bytes());
    Ok(NamedSensor {
        name: name.into_owned(),
        sensor,
        hash,
        text,
    })
}

impl NamedSensor {
    /// The sensor as calibrations take it.
    pub(crate) fn described(&self) -> taxel_calibrate::NamedSensor<'_> {
        taxel_calibrate::NamedSensor {
            name: &self.name,
            text: &self.text,
            sensor: &self.sensor,
        }
    }
}

/// The device that a sensor describes.
pub(crate) fn device(sensor: &Sensor) -> Result<Box<dyn Device + '_>, Stop> {
    sensor
        .device()
        .map_err(|unreadable| Stop::WrongInput(unreadable.to_string()))
}

fn with_shipped_names(stop: Stop, path: &Path) -> Stop {
    match stop {
        Stop::WrongInput(message) if !path.exists() => {
            let names: Vec<_> = Sensor::shipped_names().collect();
            Stop::WrongInput(format!(
                "{message}\nhelp: give a file, or a shipped sensor: {}",
                names.join(", ")
            ))
        }
        stop => stop,
    }
}

/// Reads a text file.
pub(crate) fn text(path: &Path) -> Result<String, Stop> {
    let wrong = |message: String| Stop::WrongInput(format!("{}: {message}", path.display()));
    let about =
        std::fs::metadata(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    if about.is_dir() {
        return Err(wrong("is a folder; a file is needed".into()));
    }
    if about.len() > LARGEST {
        return Err(wrong(format!(
            "has {} bytes; at most {LARGEST} are read",
            about.len()
        )));
    }
    let bytes = std::fs::read(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    taxel_recording::text_of(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let before = String::from_utf8_lossy(&error.as_bytes()[..at]).into_owned();
        let line = before.matches('\n').count() + 1;
        wrong(format!(
            "line {line} is not UTF-8 text (byte {at})\nhelp: save the file as UTF-8"
        ))
    })
}

/// The recordings below `paths`: the CSV files of each folder lie together, and
/// so do the files that are named themselves.
pub(crate) fn recordings(paths: &[PathBuf]) -> Result<Vec<Vec<TrainingFile>>, Stop> {
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
        let names: Vec<_> = paths.iter().map(|path| path.to_string_lossy()).collect();
        return Err(Stop::WrongInput(format!(
            "{}: there is no recording in it\nhelp: recordings are files that end in .csv",
            names.join(", ")
        )));
    }
    Ok(groups)
}

fn folder(path: &Path, groups: &mut Vec<Vec<TrainingFile>>) -> Result<(), Stop> {
    let wrong = |error: std::io::Error| {
        Stop::WrongInput(format!("{}: cannot be read: {error}", path.display()))
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
        name: path.to_string_lossy().into_owned(),
        text: text(path)?,
    })
}

/// True if a figure goes to a page (.html) and not to a picture (.svg).
pub(crate) fn is_page(path: &Path) -> Result<bool, Stop> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => Ok(false),
        Some("html") => Ok(true),
        _ => Err(Stop::WrongInput(format!(
            "--plot {}: must end in .svg or .html",
            path.display()
        ))),
    }
}

/// Refuses, before any work, outputs that cannot be written or would destroy something:
/// `outputs` with their options, and `inputs` that the command reads.
pub(crate) fn check_outputs(
    outputs: &[(&str, Option<&PathBuf>)],
    inputs: &[&PathBuf],
) -> Result<(), Stop> {
    let mut known: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs {
        let Some(path) = path else { continue };
        let wrong = |message: String| {
            let path = path.display();
            Err(Stop::WrongInput(format!("{option} {path}: {message}")))
        };
        if path.is_dir() {
            return wrong("is a folder; name a file".into());
        }
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let Ok(folder) = folder.canonicalize() else {
            let folder = folder.display();
            return wrong(format!("there is no folder {folder}; make it first"));
        };
        let whole = folder.join(path.file_name().unwrap_or_default());
        // An existing file by its own name, whatever links lead to it.
        let whole = whole.canonicalize().unwrap_or(whole);
        let same = |input: &&&PathBuf| input.canonicalize().is_ok_and(|input| input == whole);
        if inputs.iter().any(|input| same(&input)) {
            return wrong(
                "is read by this command and would be overwritten; name another file".into(),
            );
        }
        if let Some((other, _)) = known.iter().find(|(_, other)| *other == whole) {
            return wrong(format!("is also the file of {other}; name another file"));
        }
        known.push((option, whole));
    }
    Ok(())
}

/// SHA-256 in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
}

/// Writes a result to `output`, or to the standard output.
pub(crate) fn write(output: Option<&Path>, text: &str) -> Result<Done, Stop> {
    write_pieces(output, |sink| sink(text)).map(|()| Done::Complete)
}

/// Where pieces of a result go.
pub(crate) type Sink<'a> = &'a mut dyn FnMut(&str) -> Result<(), Stop>;

/// Writes the pieces of a result that `give` hands out to `output`, or to the
/// standard output.
///
/// A result appears only when it is whole: a file is written beside its place
/// and then moved there, and the standard output waits for the last piece.
pub(crate) fn write_pieces(
    output: Option<&Path>,
    give: impl FnOnce(Sink<'_>) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let Some(path) = output else {
        let mut whole = String::new();
        give(&mut |piece| {
            whole.push_str(piece);
            Ok(())
        })?;
        let written = std::io::stdout().lock().write_all(whole.as_bytes());
        // Whoever reads may stop early (`taxel ... | head`).
        return match written {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Stop::Failed(format!("cannot write the result: {error}")))
            }
            _ => Ok(()),
        };
    };
    let failed = |error: std::io::Error| {
        Stop::Failed(format!("{}: cannot be written: {error}", path.display()))
    };
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let result = std::fs::File::create(&beside)
        .map_err(failed)
        .and_then(|mut file| give(&mut |piece| file.write_all(piece.as_bytes()).map_err(failed)))
        .and_then(|()| std::fs::rename(&beside, path).map_err(failed));
    if result.is_err() {
        // What is left of the attempt is of no use.
        let _ = std::fs::remove_file(&beside);
    }
    result
}
