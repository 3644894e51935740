//! Shared by the tests of the program: running it, and a folder for its files.
#![allow(clippy::unwrap_used)]
#![allow(dead_code, reason = "not every test needs all")]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};

pub(crate) fn taxel(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Standard output of a run that ends well.
#[track_caller]
pub(crate) fn done(arguments: &[&str]) -> String {
    let output = taxel(arguments);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The message of a refusal with exit code 2.
#[track_caller]
pub(crate) fn refused(arguments: &[&str]) -> String {
    let output = taxel(arguments);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// A refusal with exit code 2, one message that has all `parts`, and no result.
#[track_caller]
pub(crate) fn refused_with(arguments: &[&str], parts: &[&str]) {
    let output = taxel(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(output.stdout.is_empty(), "something was written");
    assert_eq!(message.matches("error:").count(), 1, "{message}");
    for part in parts {
        assert!(message.contains(part), "{part}: {message}");
    }
}

/// A folder of one test, gone with it.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = format!("taxel-{name}-{}-{count}", std::process::id());
        let folder = std::env::temp_dir().join(folder);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    pub(crate) fn path(&self, name: &str) -> String {
        self.0.join(name).to_string_lossy().into_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
