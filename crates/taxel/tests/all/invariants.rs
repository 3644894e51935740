//! The invariants of `ARCHITECTURE.md`, kept by reading the sources.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use taxel::acquisition::Stimulus;
use taxel::sensor::Sensor;

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

/// Rust sources below `folder` without their test modules, comments cut.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs")
                && !path.ends_with("tests.rs")
            {
                let text = fs::read_to_string(&path).unwrap();
                let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
                let lines = code.lines().map(|line| line.split("//").next().unwrap());
                found.push((path, lines.collect::<Vec<_>>().join("\n")));
            }
        }
    }
    assert!(
        !found.is_empty(),
        "no sources below {}",
        folder.to_str().unwrap()
    );
    found
}

#[track_caller]
fn must_not_name(folder: &str, words: &[&str]) {
    for (path, code) in sources(&crates().join(folder)) {
        for word in words {
            assert!(
                !code.contains(word),
                "{} names {word}",
                path.to_str().unwrap()
            );
        }
    }
}

#[test]
fn the_libraries_open_no_file_read_no_clock_and_print_nothing() {
    for library in ["taxel/src", "taxel-bodies/src"] {
        must_not_name(
            library,
            &[
                "std::fs",
                "std::thread",
                "std::net",
                "Instant",
                "SystemTime",
                "println!",
                "print!",
                "tokio",
                "axum",
            ],
        );
    }
}

#[test]
fn mechanics_knows_no_transduction() {
    must_not_name(
        "taxel/src/mechanics",
        &[
            "transduction",
            "electronics",
            "estimation",
            "sensor::",
            "calibration",
        ],
    );
}

#[test]
fn transduction_knows_no_electronics() {
    must_not_name(
        "taxel/src/transduction",
        &[
            "electronics",
            "estimation",
            "acquisition",
            "sensor::",
            "calibration",
        ],
    );
}

#[test]
fn what_comes_before_knows_no_calibration() {
    must_not_name(
        "taxel/src/sensor",
        &["calibration::", "estimation", "acquisition"],
    );
    must_not_name(
        "taxel/src/electronics",
        &["calibration", "estimation", "acquisition", "sensor::"],
    );
    must_not_name("taxel/src/acquisition", &["calibration", "estimation"]);
}

#[test]
fn estimation_inverts_what_a_calibration_carries() {
    must_not_name(
        "taxel/src/estimation",
        &[
            "electronics",
            "sensor::",
            "toml",
            "acquisition::Twin",
            "acquisition::Stimulus",
            "recording",
        ],
    );
}

#[test]
fn only_the_service_knows_http_and_messages() {
    must_not_name("taxel/src", &["http::", "WebSocket", "websocket"]);
    must_not_name("taxel-cli/src", &["axum", "tokio"]);
}

#[test]
fn the_service_decides_no_physics() {
    must_not_name(
        "taxel-serve/src",
        &[
            "taxel::mechanics",
            "taxel::transduction",
            "taxel::electronics",
        ],
    );
}

/// Manifests of the crates of the workspace, by their names.
fn manifests() -> BTreeMap<String, toml::Table> {
    let root = crates().parent().unwrap().to_owned();
    let read = |folder: &str| -> toml::Table {
        let text = fs::read_to_string(root.join(folder).join("Cargo.toml")).unwrap();
        text.parse().unwrap()
    };
    let workspace = read("");
    let members = workspace["workspace"]["members"].as_array().unwrap();
    let manifest = |member: &toml::Value| {
        let manifest = read(member.as_str().unwrap());
        let name = manifest["package"]["name"].as_str().unwrap().to_owned();
        (name, manifest)
    };
    members.iter().map(manifest).collect()
}

#[test]
fn no_unsafe_code_anywhere() {
    let manifest = fs::read_to_string(crates().parent().unwrap().join("Cargo.toml")).unwrap();
    assert!(manifest.contains("unsafe_code = \"forbid\""));
    for (name, manifest) in manifests() {
        let lints = &manifest["lints"];
        let taken = lints.get("workspace").and_then(toml::Value::as_bool) == Some(true);
        // The benchmarks have their own lints, which forbid it, too.
        let own = lints.get("rust").and_then(|rust| rust.get("unsafe_code"));
        assert!(
            taken || own.and_then(toml::Value::as_str) == Some("forbid"),
            "{name} does not forbid unsafe code"
        );
    }
}

/// Crates of the workspace that stand below `name`; its tests count, those of others do not.
fn below(name: &str, manifests: &BTreeMap<String, toml::Table>) -> BTreeSet<String> {
    let (mut found, mut left) = (BTreeSet::new(), vec![name.to_owned()]);
    while let Some(next) = left.pop() {
        let mut kinds = vec!["dependencies", "build-dependencies"];
        if next == name {
            kinds.push("dev-dependencies");
        }
        for kind in kinds {
            let named = manifests[&next].get(kind).and_then(toml::Value::as_table);
            for dependency in named.into_iter().flat_map(toml::Table::keys) {
                if manifests.contains_key(dependency) && found.insert(dependency.clone()) {
                    left.push(dependency.clone());
                }
            }
        }
    }
    found
}

#[test]
fn the_lower_crates_stand_on_nothing_else() {
    let manifests = manifests();
    for (name, expected) in [
        ("taxel-ground", &[][..]),
        ("taxel-numerics", &[]),
        ("taxel-recording", &["taxel-ground"]),
        ("taxel-board", &["taxel-ground", "taxel-recording"]),
        ("taxel-fem", &["taxel-numerics"]),
        ("taxel-material", &["taxel-ground", "taxel-numerics"]),
        // A modulus in a sensor file may be the name of a material.
        (
            "taxel",
            &[
                "taxel-ground",
                "taxel-material",
                "taxel-numerics",
                "taxel-recording",
            ],
        ),
    ] {
        let expected = expected.iter().map(|name| (*name).to_owned()).collect();
        assert_eq!(below(name, &manifests), expected, "{name}");
    }
}

#[test]
fn no_body_of_a_device_is_built_where_there_is_no_solver() {
    must_not_name("taxel/src", &["taxel_fem", "Mesh"]);
}

#[test]
fn the_command_and_the_python_package_stand_beside_each_other() {
    let manifests = manifests();
    for (name, other) in [("taxel-python", "taxel-cli"), ("taxel-cli", "taxel-python")] {
        let below = below(name, &manifests);
        assert!(below.contains("taxel-files"), "{name}: {below:?}");
        assert!(!below.contains(other), "{name} stands on {other}");
    }
}

#[test]
fn committed_schemas_are_current() {
    let root = crates().parent().unwrap().to_owned();
    for (of, file, printed) in [
        (
            "sensor",
            "crates/taxel/sensors/sensor.schema.json",
            Sensor::json_schema(),
        ),
        (
            "stimulus",
            "crates/taxel/sensors/stimulus.schema.json",
            Stimulus::json_schema(),
        ),
        (
            "reference",
            "docs/book/sensor-file-reference.md",
            Sensor::reference(),
        ),
    ] {
        let committed = fs::read_to_string(root.join(file)).unwrap();
        assert!(
            committed.replace("\r\n", "\n") == printed,
            "{file} is stale: run `cargo run -- schema {of} > {file}`"
        );
    }
}

#[test]
fn every_shipped_file_is_valid() {
    for name in Sensor::shipped_names() {
        let text = Sensor::shipped_text(name).unwrap();
        assert_eq!(Sensor::parse(name, text).map(drop), Ok(()));
    }
    for name in Stimulus::shipped_names() {
        let text = Stimulus::shipped_text(name).unwrap();
        assert_eq!(Stimulus::parse(name, text).map(drop), Ok(()));
    }
}

#[test]
fn of_studies_only_the_store_opens_files() {
    for (path, code) in sources(&crates().join("taxel-study/src")) {
        for word in ["std::fs", "SystemTime", "Instant", "println!"] {
            let in_store = path.ends_with("store.rs") && word != "println!";
            assert!(
                in_store || !code.contains(word),
                "{} names {word}",
                path.to_str().unwrap()
            );
        }
    }
}

#[test]
fn the_ground_knows_no_sensor_and_opens_no_file() {
    must_not_name(
        "taxel-ground/src",
        &["Sensor", "std::fs", "std::thread", "SystemTime", "println!"],
    );
}

#[test]
fn the_field_solver_knows_no_sensor() {
    must_not_name(
        "taxel-fem/src",
        &[
            "sensor",
            "electrode",
            "channel",
            "liquid_metal",
            "capacitor",
            "std::fs",
            "std::thread",
            "Instant",
            "SystemTime",
            "println!",
        ],
    );
}

/// A file that is no module of `all/main.rs` would never run.
#[test]
fn every_file_of_tests_is_run() {
    for folder in [
        "taxel/tests/all",
        "taxel-bodies/tests/all",
        "taxel-cli/tests/all",
    ] {
        let main = fs::read_to_string(crates().join(folder).join("main.rs")).unwrap();
        for entry in fs::read_dir(crates().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            assert!(
                name == "main" || main.contains(&format!("mod {name};")),
                "{name} is not in {folder}/main.rs"
            );
        }
    }
}

#[test]
fn no_public_type_name_occurs_twice_in_a_crate() {
    let mut twice = Vec::new();
    for entry in fs::read_dir(crates()).unwrap() {
        let source = entry.unwrap().path().join("src");
        if !source.is_dir() {
            continue;
        }
        let mut known: BTreeMap<String, PathBuf> = BTreeMap::new();
        for (path, code) in sources(&source) {
            for line in code.lines() {
                let mut words = line.split_whitespace();
                let kinds = ["struct", "enum", "trait", "type", "union"];
                let is_type = words.next() == Some("pub")
                    && words.next().is_some_and(|word| kinds.contains(&word));
                let Some(name) = words.next().filter(|_| is_type) else {
                    continue;
                };
                let end = name.find(|c: char| !c.is_alphanumeric() && c != '_');
                let name = &name[..end.unwrap_or(name.len())];
                if let Some(first) = known.insert(name.to_owned(), path.clone()) {
                    twice.push(format!("{name}: {first:?} and {path:?}"));
                }
            }
        }
    }
    assert!(twice.is_empty(), "{twice:#?}");
}
