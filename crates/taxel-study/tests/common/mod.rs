//! Shared by the tests: reference tables and studies.
#![allow(
    clippy::unwrap_used,
    dead_code,
    reason = "a panic is how a test fails; not every test needs all"
)]

use std::path::Path;

use taxel::InputError;
use taxel::sensor::Sensor;
use taxel::solutions::TablesOnly;
use taxel_study::study::{SensorText, Study, header};

/// Rows of a reference table, each field by the name of its column.
pub(crate) fn reference(name: &str) -> Vec<Vec<(String, String)>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text
        .lines()
        .filter(|line| !line.starts_with('#') && !line.is_empty());
    let header: Vec<String> = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let row = |line: &str| {
        let fields = line.split(',').map(str::to_owned);
        header.iter().cloned().zip(fields).collect()
    };
    lines.map(row).collect()
}

pub(crate) fn number(row: &[(String, String)], name: &str) -> f64 {
    let (_, field) = row.iter().find(|(key, _)| key == name).unwrap();
    field.parse().unwrap()
}

/// The study of a text, or its first mistake.
pub(crate) fn read(text: &str) -> Result<Study, InputError> {
    let header = header("study.toml", text).unwrap();
    let sensor = SensorText {
        name: &header.sensor,
        text: Sensor::shipped_text(&header.sensor).unwrap(),
    };
    Study::parse(
        "study.toml",
        text,
        &sensor,
        Box::new(|| Box::new(TablesOnly)),
    )
}

#[track_caller]
pub(crate) fn study_of(text: &str) -> Study {
    read(text).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn shipped(name: &str) -> Study {
    study_of(taxel_study::shipped_text(name).unwrap())
}

#[track_caller]
pub(crate) fn near(found: f64, expected: f64, relative: f64, what: &str) {
    assert!(
        (found / expected - 1.0).abs() <= relative,
        "{what}: {found:e}, expected {expected:e}"
    );
}
