//! Programs in Python that look at what the command writes.
#![allow(clippy::print_stdout, reason = "a test that is skipped says so")]

use std::process::{Command, Stdio};

/// A Python that has these modules, or a word that there is none.
pub(crate) fn python(modules: &[&str]) -> Option<String> {
    let named = std::env::var("TAXEL_TEST_PYTHON").ok();
    let import = format!("import {}", modules.join(", "));
    let candidates = named
        .into_iter()
        .chain(["/tmp/venv/bin/python".into(), "python3".into()]);
    let found = candidates.into_iter().find(|python| {
        let status = Command::new(python)
            .args(["-c", &import])
            .stderr(Stdio::null())
            .status();
        status.is_ok_and(|status| status.success())
    });
    if found.is_none() {
        println!(
            "skipped: no Python with {} (name one in TAXEL_TEST_PYTHON)",
            modules.join(", ")
        );
    }
    found
}
