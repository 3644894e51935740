//! Recordings that a client begins while a run goes on.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{RecordFile, Recorder};

/// Longest name of a recording, characters.
const LONGEST_NAME: usize = 100;

/// Where recordings go that clients begin.
#[derive(Debug, Clone)]
pub struct RecordFolder {
    /// The folder.
    pub folder: PathBuf,
    /// What they are made with; its path is that of none of them.
    pub file: RecordFile,
}

impl RecordFolder {
    /// The recording of this name in the folder.
    ///
    /// # Errors
    /// In words, for what is no plain name of a file: a client names no other folder.
    pub(crate) fn named(&self, name: &str) -> Result<RecordFile, String> {
        let plain = |c: char| c.is_alphanumeric() || " -_.()+,=".contains(c);
        let name = name.trim();
        let name = name.strip_suffix(".mcap").unwrap_or(name);
        if name.is_empty()
            || name.chars().count() > LONGEST_NAME
            || name.starts_with('.')
            || !name.chars().all(plain)
        {
            return Err(format!(
                "\"{}\" is no name of a recording: use letters, digits, blanks and - _ . ( ) + , =, at most {LONGEST_NAME}, \
                 and no point at the beginning",
                name.chars().take(LONGEST_NAME).collect::<String>()
            ));
        }
        Ok(RecordFile {
            path: self.folder.join(format!("{name}.mcap")),
            ..self.file.clone()
        })
    }
}

/// A recording as the status has it.
#[derive(Debug, Serialize)]
pub(crate) struct RecordingNow {
    name: String,
    length_s: f64,
    bytes: u64,
    free_bytes: Option<u64>,
    lost: u64,
    failure: Option<String>,
}

impl Recorder {
    /// What the file has taken so far; `None` of a recorder without a file.
    pub(crate) fn now(&self) -> Option<RecordingNow> {
        let path = self.path();
        Some(RecordingNow {
            name: path.file_name()?.to_string_lossy().into_owned(),
            length_s: self.shared.since.elapsed().as_secs_f64(),
            bytes: std::fs::metadata(path).map_or(0, |about| about.len()),
            free_bytes: free_bytes(path),
            lost: self.lost(),
            failure: self.failure().map(str::to_owned),
        })
    }
}

/// What is free on the disk of a file, bytes, where the system says it.
fn free_bytes(path: &Path) -> Option<u64> {
    #[cfg(unix)]
    {
        let disk = rustix::fs::statvfs(path).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::WhenRecordingFails;
    use super::*;

    #[test]
    fn a_client_names_a_file_of_the_folder_and_no_other() {
        let folder = RecordFolder {
            folder: "runs".into(),
            file: RecordFile {
                path: PathBuf::new(),
                library: "test".into(),
                attachments: Vec::new(),
                metadata: Vec::new(),
                companion: None,
                when_failing: WhenRecordingFails::GoOn,
                told: |_| (),
            },
        };
        for (name, file) in [
            ("grasp 1", "runs/grasp 1.mcap"),
            (" a.mcap ", "runs/a.mcap"),
            ("Gr\u{fc}n-2", "runs/Gr\u{fc}n-2.mcap"),
        ] {
            assert_eq!(folder.named(name).unwrap().path, Path::new(file));
        }
        let long = "a".repeat(LONGEST_NAME + 1);
        for name in [
            "", " ", ".", "..", ".hidden", "../up", "a/b", "a\\b", "C:x", "a\nb", "a\0", &long,
        ] {
            assert!(folder.named(name).is_err(), "{name:?}");
        }
    }
}
