//! "Where do I add a kind of element" in `ARCHITECTURE.md`, kept true: which sources ask
//! what element a sensor has, and with how many arms.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Files outside the folder of one device that name a variant of `Element`, with how
/// often: a new kind of element adds arms to the first three, and none to the others,
/// which ask for one kind alone.
const NAMED: [(&str, usize); 10] = [
    // Two arms for each kind: its usual script, its key; and the three that are solved.
    ("taxel/src/sensor/mod.rs", 15),
    // Two for each kind: its device, its typed array.
    ("taxel/src/device/of_sensor.rs", 12),
    // Three for each kind: its calibrator, its constants, its uncertain columns; and
    // those that are calibrated alone.
    ("taxel-calibrate/src/devices.rs", 20),
    // Trained maps, and learned positions.
    ("taxel-calibrate/src/file.rs", 2),
    ("taxel-cli/src/commands/calibrate.rs", 1),
    ("taxel-cli/src/commands/live.rs", 1),
    // One for each kind: what it is made of.
    ("taxel-fabricate/src/plan.rs", 6),
    // The sweep of cross-sections.
    // As the command.
    ("taxel-python/src/calibration.rs", 1),
    // Axes of measured forces.
    ("taxel/src/sensor/checks.rs", 1),
];

const VARIANTS: [&str; 6] = [
    "ThreeAxisCapacitor",
    "InPlaneCapacitor",
    "Piezoelectric",
    "Microchannel",
    "Trained",
    "MeasuredForce",
];

/// Folders of a single device: what they say of their own element is no arm.
const OWN: [&str; 6] = [
    "three_axis_capacitor",
    "in_plane_capacitor",
    "piezoelectric",
    "microchannel",
    "trained",
    "measured_force",
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
    let mut found = BTreeMap::new();
    for file in files {
        let own = file
            .iter()
            .any(|part| OWN.iter().any(|device| part.to_str() == Some(device)));
        if own {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
        let named: usize = VARIANTS
            .iter()
            .flat_map(|variant| [format!("Element::{variant}("), format!("Self::{variant}(")])
            .map(|arm| code.matches(&arm).count())
            .sum();
        if named > 0 {
            let name = file.strip_prefix(crates).unwrap().to_str().unwrap();
            found.insert(name.replace('\\', "/"), named);
        }
    }
    let expected = NAMED.map(|(name, count)| (name.to_owned(), count));
    assert_eq!(found, BTreeMap::from(expected));
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
