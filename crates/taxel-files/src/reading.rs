//! Reading files: their bytes, their text, and the law files that descriptions name.

use std::io::Read as _;
use std::path::Path;

use taxel::shown;
use taxel::words::advice;

use crate::Stop;
use crate::hash::sha256;

/// Largest description or table that is read, bytes.
const LARGEST: u64 = 1 << 28;

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
