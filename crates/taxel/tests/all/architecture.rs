//! "Where do I add a kind of element" in `ARCHITECTURE.md`, kept true: which sources ask
//! what element a sensor has.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Files outside the folder of one device that ask which element a sensor has. A chain of stages
/// adds no arm to them; a kind of element adds arms to the first four.
const NAMED: [&str; 10] = [
    // Its usual script, its key, and what is solved of it.
    "taxel/src/sensor/mod.rs",
    // Its device, its typed array.
    "taxel/src/device/of_sensor.rs",
    // What finite elements solve of it.
    "taxel-bodies/src/device/mod.rs",
    // Its calibrator, its constants, its uncertain columns.
    "taxel-calibrate/src/devices.rs",
    // What it is made of.
    "taxel-fabricate/src/plan.rs",
    // Trained maps, and learned positions.
    "taxel-calibrate/src/file.rs",
    "taxel-cli/src/commands/calibrate.rs",
    "taxel-cli/src/commands/live.rs",
    // As the command.
    "taxel-python/src/calibration.rs",
    // Axes of measured forces.
    "taxel/src/sensor/checks.rs",
];

const VARIANTS: [&str; 10] = [
    "ThreeAxisCapacitor",
    "InPlaneCapacitor",
    "Piezoelectric",
    "Microchannel",
    "Trained",
    "MeasuredForce",
    "Cells",
    "MagneticSkin",
    "Body",
    "Own",
];

/// Folders of a single device: what they say of their own element is no arm.
const OWN: [&str; 8] = [
    "three_axis_capacitor",
    "in_plane_capacitor",
    "piezoelectric",
    "microchannel",
    "trained",
    "measured_force",
    "cells",
    "chain",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn an_element_is_asked_for_where_the_architecture_says() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut files = Vec::new();
    for entry in fs::read_dir(crates).unwrap() {
        let source = entry.unwrap().path().join("src");
        if source.exists() {
            sources(&source, &mut files);
        }
    }
    let mut found = BTreeSet::new();
    for file in files {
        let own = file
            .iter()
            .any(|part| OWN.iter().any(|device| part.to_str() == Some(device)));
        if own {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
        let arms = VARIANTS
            .iter()
            .flat_map(|variant| [format!("Element::{variant}("), format!("Self::{variant}(")]);
        if arms.into_iter().any(|arm| code.contains(&arm)) {
            let name = file.strip_prefix(crates).unwrap().to_str().unwrap();
            found.insert(name.replace('\\', "/"));
        }
    }
    assert_eq!(found, BTreeSet::from(NAMED.map(str::to_owned)));
}

fn architecture() -> (PathBuf, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    (root, page)
}

#[test]
fn the_table_of_crates_has_every_crate() {
    let (root, page) = architecture();
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let row = format!("\n| [`{name}`](crates/{name}) |");
        assert!(page.contains(&row), "{name} is not in the table of crates");
    }
}

#[test]
fn every_path_and_module_that_the_architecture_names_exists() {
    let (root, page) = architecture();
    let quoted: Vec<&str> = page.split('`').skip(1).step_by(2).collect();
    let paths = quoted.iter().filter(|word| word.starts_with("crates/"));
    let mut missing: Vec<&str> = paths
        .copied()
        .filter(|path| !path.contains('*') && !root.join(path).exists())
        .collect();
    let (_, modules) = page.split_once("## The main modules of `taxel`").unwrap();
    let (modules, _) = modules.split_once("\n## ").unwrap();
    let names: Vec<&str> = modules
        .lines()
        .filter_map(|row| row.strip_prefix("| `")?.split(" |").next())
        .flat_map(|cell| cell.split(", ").map(|name| name.trim_matches('`')))
        .collect();
    assert!(names.len() > 15, "{names:?}");
    let source = |name: &str| {
        let folder = root.join("crates/taxel/src");
        folder.join(name).is_dir() || folder.join(format!("{name}.rs")).is_file()
    };
    missing.extend(names.iter().copied().filter(|name| !source(name)));
    assert!(missing.is_empty(), "{missing:?}");
}

/// `docs/examples.sh` writes the page; an example that changed without it is found here.
#[test]
fn the_page_of_examples_has_the_examples_as_they_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(root.join("docs/book/examples.md")).unwrap();
    let mut files = Vec::new();
    for folder in fs::read_dir(root.join("crates")).unwrap() {
        let examples = folder.unwrap().path().join("examples");
        if examples.is_dir() {
            sources(&examples, &mut files);
        }
    }
    let numbered = |path: &&PathBuf| {
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with("ex0"))
    };
    let numbered: Vec<&PathBuf> = files.iter().filter(numbered).collect();
    assert!(numbered.len() >= 8);
    for path in numbered {
        let text = fs::read_to_string(path).unwrap();
        let name = path.file_stem().unwrap().to_string_lossy();
        let advice = "run docs/examples.sh";
        assert!(
            page.contains(&format!("```rust\n{text}```\n")),
            "{name}: {advice}"
        );
        let picture = format!("images/{name}.svg");
        assert!(
            page.contains(&format!("](../{picture})")),
            "{name}: {advice}"
        );
        assert!(
            root.join("docs").join(&picture).is_file(),
            "{picture}: {advice}"
        );
    }
}
