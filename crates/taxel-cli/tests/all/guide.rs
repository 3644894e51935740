//! The numbers of the guide to a first sensor file are those that the program prints.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::common::{Folder, done, refused};

/// The page, or what stands under one of its headings.
fn section(heading: &str) -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book/first-sensor-file.md");
    let text = fs::read_to_string(page).unwrap();
    let (_, behind) = text.split_once(&format!("\n## {heading}\n")).unwrap();
    let end = behind.find("\n## ").unwrap_or(behind.len());
    behind[..end].to_owned()
}

/// The listings of a section.
fn listings(section: &str) -> Vec<Vec<String>> {
    let parts = section.split("```text\n").skip(1);
    let lines = |part: &str| {
        part.lines()
            .take_while(|line| *line != "```")
            .map(str::to_owned)
            .collect()
    };
    parts.map(lines).collect()
}

/// Words of a line, whatever room is between them.
fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[track_caller]
fn has_lines(printed: &str, listing: &[String]) {
    let printed: Vec<String> = printed.lines().map(words).collect();
    for line in listing.iter().filter(|line| !line.starts_with('$')) {
        assert!(
            printed.contains(&words(line)),
            "{line}\nis not in\n{}",
            printed.join("\n")
        );
    }
}

/// The array of the guide, as its fourth section changes it.
fn mine() -> String {
    let shipped =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel/sensors/three-axis-8x8.toml");
    let mut text = fs::read_to_string(shipped).unwrap();
    for (from, to) in [
        (
            "name = \"three-axis capacitive array 8x8\"",
            "name = \"my array, 8 um gap\"",
        ),
        ("rows = 8", "rows = 4"),
        ("columns = 8", "columns = 4"),
        ("pitch = \"2 mm\"", "pitch = \"3 mm\""),
        ("air_gap = \"6 um\"", "air_gap = \"8 um\""),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    text
}

#[test]
fn the_lines_of_check_are_those_of_the_guide() {
    let of_shipped = &listings(&section("1. Copy and check"))[0];
    has_lines(&done(&["check", "three-axis-8x8"]), of_shipped);
    let folder = Folder::new("guide");
    let path = folder.path("mine.toml");
    fs::write(&path, mine()).unwrap();
    has_lines(
        &done(&["check", &path]),
        &listings(&section("4. Change it"))[0],
    );
}

#[test]
fn the_mistakes_are_those_of_the_guide() {
    let folder = Folder::new("guide");
    let path = folder.path("mine.toml");
    let changes = HashMap::from([
        (
            "\"uN\" is a unit of force",
            ("air_gap = \"8 um\"", "air_gap = \"8 uN\""),
        ),
        ("3 has no unit", ("pitch = \"3 mm\"", "pitch = 3")),
        (
            "unknown field",
            ("insulation = \"6 um\"", "insulaton = \"6 um\""),
        ),
        (
            "out of range",
            ("air_gap = \"8 um\"", "air_gap = \"-8 um\""),
        ),
        (
            "one scan takes",
            ("frame_rate = \"60 Hz\"", "frame_rate = \"200 Hz\""),
        ),
    ]);
    let listings = listings(&section("5. Mistakes"));
    assert_eq!(listings.len(), changes.len());
    for listing in listings {
        let expected = listing.join("\n");
        let found = changes.iter().find(|(part, _)| expected.contains(*part));
        let (_, (from, to)) = found.unwrap_or_else(|| panic!("{expected}"));
        let text = mine();
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replace(from, to)).unwrap();
        let message = refused(&["check", &path]).replace(&path, "mine.toml");
        assert_eq!(message.trim_end(), expected);
    }
}

#[test]
fn the_answers_of_predict_and_live_are_those_of_the_guide() {
    let folder = Folder::new("guide");
    let (path, loads) = (folder.path("mine.toml"), folder.path("loads.csv"));
    fs::write(&path, mine()).unwrap();
    let predicted = listings(&section("6. Predict"));
    fs::write(&loads, predicted[0].join("\n") + "\n").unwrap();
    let printed = done(&["predict", &path, "--loads", &loads, "--format", "csv"]);
    let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = printed.lines().map(fields).collect();
    let shown: Vec<Vec<String>> = predicted[1].iter().map(|line| fields(line)).collect();
    assert_eq!(rows.len(), shown.len());
    for (at, title) in shown[0].iter().enumerate() {
        let column = rows[0].iter().position(|name| name == title).unwrap();
        for (row, shown) in rows.iter().zip(&shown) {
            assert_eq!(row[column], shown[at], "{title}");
        }
    }
    let run = &listings(&section("7. Live on the twin"))[0];
    let frames = [
        "live",
        &path,
        "--headless",
        "--speed",
        "max",
        "--frames",
        "200",
    ];
    has_lines(&done(&frames), run);
}
