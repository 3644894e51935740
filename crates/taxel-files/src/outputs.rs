//! Where results go: whole or not at all, and never onto what belongs to someone else.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use taxel::shown;

use crate::Stop;

/// Name of the standard output.
const STANDARD: &str = "-";
/// The option that may name the standard output.
const OUTPUT: &str = "--output";

/// What happens to an output file that exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// It is left alone, with a message.
    Refused,
    /// It is replaced, as `--force` asks.
    Replaced,
}

/// True if `path` stands for the standard output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == STANDARD
}

/// The file behind the name of an output.
struct Place {
    /// Its own name, whatever links lead to it.
    file: PathBuf,
    /// `None` for a new file.
    about: Option<Metadata>,
}

impl Place {
    /// Follows links; refuses what is no ordinary file.
    fn new(path: &Path) -> Result<Self, String> {
        if fs::symlink_metadata(path).is_err() {
            return Self::fresh(path);
        }
        let file = path.canonicalize().map_err(|error| {
            format!("is a link that leads nowhere ({error}); name the file itself")
        })?;
        let about = fs::metadata(&file).map_err(|error| format!("cannot be written: {error}"))?;
        if about.is_dir() {
            return Err("is a folder; name a file".into());
        }
        if !about.is_file() {
            return Err("is a device, pipe or socket; name an ordinary file".into());
        }
        if about.permissions().readonly() {
            return Err("the file is read-only; name another one".into());
        }
        Ok(Self {
            file,
            about: Some(about),
        })
    }

    fn fresh(path: &Path) -> Result<Self, String> {
        let folder = folder_of(path);
        let Ok(folder) = folder.canonicalize() else {
            let folder = shown::path(folder);
            return Err(format!("there is no folder {folder}; make it first"));
        };
        let Some(name) = path.file_name() else {
            return Err("is a folder; name a file".into());
        };
        Ok(Self {
            file: folder.join(name),
            about: None,
        })
    }

    /// Refuses a file that exists, if it is not to be replaced.
    fn free(self, existing: Existing) -> Result<Self, String> {
        match (&self.about, existing) {
            (Some(_), Existing::Refused) => {
                Err("the file exists; name a new one, or give --force to replace it".into())
            }
            _ => Ok(self),
        }
    }

    /// True if `other` names the same file, also by a link.
    fn is(&self, other: &Path) -> bool {
        let Ok(name) = other.canonicalize() else {
            return false;
        };
        // A recording in a folder that is read is read.
        let inside = self.about.is_some() && name.is_dir() && self.file.starts_with(&name);
        inside || name == self.file || self.has_identity_of(&name)
    }

    #[cfg(unix)]
    fn has_identity_of(&self, other: &Path) -> bool {
        use std::os::unix::fs::MetadataExt as _;
        let identity = |about: &Metadata| (about.dev(), about.ino());
        let own = self.about.as_ref().map(identity);
        own.is_some() && own == fs::metadata(other).ok().as_ref().map(identity)
    }

    #[cfg(not(unix))]
    fn has_identity_of(&self, _: &Path) -> bool {
        false
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Refuses, before any work, outputs that cannot be written or would destroy something:
/// `outputs` with their options, and `inputs` that the command reads.
///
/// # Errors
/// The first output that cannot be written.
pub fn check(
    outputs: &[(&str, Option<&PathBuf>)],
    inputs: &[&PathBuf],
    existing: Existing,
) -> Result<(), Stop> {
    let mut known: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in outputs {
        let Some(path) = path else { continue };
        if is_standard(path) && *option == OUTPUT {
            continue;
        }
        let place = one(path, inputs, &known, existing).map_err(|message| {
            let path = shown::path(path);
            Stop::WrongInput(format!("{option} {path}: {message}"))
        })?;
        known.push((option, place.file));
    }
    Ok(())
}

fn one(
    path: &Path,
    inputs: &[&PathBuf],
    known: &[(&str, PathBuf)],
    existing: Existing,
) -> Result<Place, String> {
    if is_standard(path) {
        let message =
            "only -o can go to the standard output; name a file (./- is one of this name)";
        return Err(message.into());
    }
    let place = Place::new(path)?;
    if inputs.iter().any(|input| place.is(input)) {
        return Err("is read by this command and would be overwritten; name another file".into());
    }
    let other = known
        .iter()
        .find(|(_, other)| *other == place.file || place.is(other));
    if let Some((other, _)) = other {
        return Err(format!("is also the file of {other}; name another file"));
    }
    place.free(existing)
}

/// Writes `text` to a file, also in the place of another one: all of it or nothing.
///
/// # Errors
/// When it cannot be written.
pub fn replace(path: &Path, text: &str) -> Result<(), Stop> {
    write_file(path, Existing::Replaced, |file| {
        let written = file.write_all(text.as_bytes());
        written.map_err(|error| cannot_write(path, &error))
    })
}

/// The end of a command that could not write.
pub fn cannot_write(path: &Path, error: &std::io::Error) -> Stop {
    Stop::Failed(format!("{}: cannot be written: {error}", shown::path(path)))
}

/// Writes what `give` puts into a file, which appears only when it is whole: it is written
/// beside its place and then moved there.
///
/// # Errors
/// When it cannot be written, or what `give` answers.
pub fn write_file<T>(
    path: &Path,
    existing: Existing,
    give: impl FnOnce(&mut File) -> Result<T, Stop>,
) -> Result<T, Stop> {
    let failed = |error: std::io::Error| cannot_write(path, &error);
    // Something may have come in its place since the options were checked.
    let place = || {
        let place = Place::new(path).and_then(|place| place.free(existing));
        place.map_err(|message| Stop::WrongInput(format!("{}: {message}", shown::path(path))))
    };
    let (beside, mut file) = unfinished(&place()?.file).map_err(failed)?;
    let result = give(&mut file).and_then(|done| {
        let place = place()?;
        let taken = place.about.map_or(Ok(()), |about| take_over(&file, &about));
        taken
            .and_then(|()| fs::rename(&beside, &place.file))
            .map_err(failed)?;
        Ok(done)
    });
    if result.is_err() {
        // What is left of the attempt is of no use.
        let _ = fs::remove_file(&beside);
    }
    *UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner) = None;
    result
}

/// The file that is being written beside its place.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Removes what an interrupted run would leave.
pub fn remove_unfinished() {
    let left = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(path) = left.as_deref() {
        let _ = fs::remove_file(path);
    }
}

/// Names that are tried for a file beside its place.
const NAMES: u32 = 1000;

/// A new file of a name that nobody has, in the folder of `file`.
fn unfinished(file: &Path) -> std::io::Result<(PathBuf, File)> {
    let folder = folder_of(file);
    let mut tried = 0;
    loop {
        let path = folder.join(format!(".taxel-{}-{tried}.part", std::process::id()));
        let mut known = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => {
                *known = Some(path.clone());
                return Ok((path, file));
            }
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && tried < NAMES => {
                tried += 1;
            }
            Err(error) => return Err(error),
        }
    }
}

/// Gives the new file the owner, where the system allows it, and the mode of the one that
/// it replaces.
fn take_over(file: &File, about: &Metadata) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        let _ = fchown(file, Some(about.uid()), Some(about.gid()));
    }
    file.set_permissions(about.permissions())
}
