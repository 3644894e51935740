//! `taxel tabulate`, and what a sensor file with its table answers.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{Folder, done, refused, refused_with};
use serde_json::Value;

fn answer(arguments: &[&str], column: &str) -> f64 {
    let json = done(&[arguments, &["--format", "json"]].concat());
    let json: Value = serde_json::from_str(&json).unwrap();
    json["rows"][0][column].as_f64().unwrap()
}

#[test]
fn a_sensor_file_with_its_table_answers_as_finite_elements() {
    let folder = Folder::new("tabulate");
    let table = folder.path("path.json");
    let arguments = [
        "tabulate",
        "in-plane-50um",
        "-o",
        &table,
        "--tolerance",
        "1e-3",
    ];
    let summary = done(&arguments);
    assert!(summary.contains("mesh_error_of_change"), "{summary}");
    assert!(refused(&arguments).contains("--force"));

    let sensor = folder.path("mine.toml");
    let shipped = include_str!("../../taxel/sensors/in-plane-50um.toml");
    let key = "\nmechanics = { table = \"path.json\" }\n\n[array]";
    fs::write(&sensor, shipped.replacen("\n[array]", key, 1)).unwrap();
    let load = ["--load", "fz=10 N"];
    let predict = |more: &[&str]| {
        let arguments = [&["predict", &sensor][..], &load, more].concat();
        answer(&arguments, "change_mechanics_f")
    };
    let (by_table, by_elements) = (predict(&[]), predict(&["--mechanics", "fem"]));
    // The tolerance is a share of the whole change, some five times this one.
    assert!(
        (by_table / by_elements - 1.0).abs() < 5e-3,
        "{by_table} {by_elements}"
    );
    let by_form = predict(&["--mechanics", "closed-form"]);
    assert!(
        (by_form / by_table - 1.0).abs() > 0.05,
        "{by_form} {by_table}"
    );
    assert!(done(&["check", &sensor]).contains("table_interpolation_error"));

    // The twin presses and the estimator reads the same way.
    let live = [
        "live",
        &sensor,
        "--headless",
        "--speed",
        "max",
        "--frames",
        "100",
        "--format",
        "json",
    ];
    let summary: Value = serde_json::from_str(&done(&live)).unwrap();
    assert_eq!(summary["frames"], 100, "{summary}");
    a_store_knows_a_table_by_its_contents(&folder, &sensor, &table);

    // Another gap is another drawing.
    let other = folder.path("other.toml");
    let text = fs::read_to_string(&sensor).unwrap();
    fs::write(&other, text.replace("gap = \"50 um\"", "gap = \"49 um\"")).unwrap();
    refused_with(
        &["check", &other],
        &["mechanics.table", "another drawing", "gap_over_thickness"],
    );
    fs::write(&other, text.replace("path.json", "none.json")).unwrap();
    refused_with(&["check", &other], &["mechanics.table", "none.json"]);
}

/// Of another table the same designs are computed anew.
fn a_store_knows_a_table_by_its_contents(folder: &Folder, sensor: &str, table: &str) {
    let study = folder.path("study.toml");
    let text = format!(
        "schema = 2\nname = \"feedback\"\nsensor = \"{sensor}\"\n\
         [variables.feedback]\nkey = \"electronics.readout.charge_amplifier.feedback\"\n\
         range = [\"4 pF\", \"8 pF\"]\npoints = 2\n\
         [answers.change]\nof = \"predict\"\nquantity = \"change_mechanics\"\nload = \"fz=10 N\"\n"
    );
    fs::write(&study, text).unwrap();
    let store = folder.path("store");
    let blocks = || {
        done(&["sweep", &study, "--store", &store]);
        let folders = fs::read_dir(&store).unwrap().map(|one| one.unwrap().path());
        let folders = folders.filter(|path| path.is_dir());
        folders
            .map(|path| fs::read_dir(path).unwrap().count())
            .sum::<usize>()
    };
    let first = blocks();
    assert_eq!(blocks(), first);
    let text = fs::read_to_string(table).unwrap();
    fs::write(
        table,
        text.replacen("\"program\": \"", "\"program\": \"another ", 1),
    )
    .unwrap();
    assert_eq!(blocks(), 2 * first);
    fs::write(table, text).unwrap();
}

#[test]
fn devices_without_a_path_are_refused_and_nothing_is_written() {
    let folder = Folder::new("tabulate-none");
    let table = folder.path("path.json");
    for name in ["three-axis-8x8", "piezo-1.5mm", "liquid-metal-2x4"] {
        refused_with(&["tabulate", name, "-o", &table], &[name, "help: "]);
        assert!(!fs::exists(&table).unwrap());
    }
    refused_with(
        &[
            "tabulate",
            "in-plane-50um",
            "-o",
            &table,
            "--tolerance",
            "1",
        ],
        &["--tolerance", "0.1"],
    );
}
