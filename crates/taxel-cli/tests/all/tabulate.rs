//! `taxel tabulate`, and what a sensor file with its table answers.

use std::fs;

use crate::common::{Folder, done, refused, refused_with};
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
    let shipped = include_str!("../../../taxel/sensors/in-plane-50um.toml");
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
    assert!(done(&["check", &sensor]).contains("table_interpolation_error_of_change"));

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
    live_reads_the_force_of_finite_elements(&folder, &sensor, &table);
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

/// Readings that finite elements predict are estimated as their force, within the errors that the
/// table states and half a count; by the closed form they are not.
fn live_reads_the_force_of_finite_elements(folder: &Folder, sensor: &str, table: &str) {
    let loads = folder.path("loads.csv");
    fs::write(&loads, "force_z [N]\n0\n3.3\n10\n21.7\n").unwrap();
    let rows = |more: &[&str]| -> Vec<Value> {
        let arguments = ["predict", sensor, "--loads", &loads, "--format", "json"];
        let json: Value = serde_json::from_str(&done(&[&arguments[..], more].concat())).unwrap();
        json["rows"].as_array().unwrap().clone()
    };
    let (solved, tabulated) = (rows(&["--mechanics", "fem"]), rows(&[]));
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap();

    // Each reading between those of one count less and more.
    let recording = folder.path("readings.csv");
    let readings = solved
        .iter()
        .flat_map(|row| [1.0, 0.0, -1.0].map(|more| number(row, "counts") + more));
    let line = |(frame, reading)| format!("{frame},{},{reading}\n", frame * 10_000_000);
    let lines: Vec<String> = readings.enumerate().map(line).collect();
    let text = ["sequence,time [ns],r0c0 [counts]\n", &lines.concat()].concat();
    fs::write(&recording, text).unwrap();
    let forces = |sensor: &str| -> Vec<f64> {
        let touch = folder.path("touch.csv");
        let arguments = ["estimate", sensor, &recording, "--no-tare", "--force"];
        done(&[&arguments[..], &["-o", &touch]].concat());
        column_of(&touch, "force_z [N]")
    };
    let found = forces(sensor);

    let json: Value = serde_json::from_str(&fs::read_to_string(table).unwrap()).unwrap();
    let stated = ["force", "change"].map(|what| {
        json["interpolation"]["of_full_scale"][what]
            .as_f64()
            .unwrap()
    });
    let rest = &solved[0];
    let allowed: Vec<f64> = (1..solved.len())
        .map(|index| {
            let row = &solved[index];
            let fall = number(rest, "capacitance_f") - number(row, "capacitance_f");
            let count = fall / (number(rest, "counts") - number(row, "counts"));
            let by_count = (found[3 * index + 2] - found[3 * index]) / 2.0;
            // The electrodes gone: no change is larger.
            let change = stated[1] * number(rest, "capacitance_f") / count;
            stated[0] * number(&tabulated[index], "largest_force_n") + by_count * (0.5 + change)
        })
        .collect();
    let errors = |found: &[f64]| -> Vec<f64> {
        let error = |index: usize| found[3 * index + 1] - number(&solved[index], "force_z_n");
        (1..solved.len()).map(error).collect()
    };
    let held = errors(&found);
    let within = held
        .iter()
        .zip(&allowed)
        .all(|(error, most)| error.abs() < *most);
    assert!(within, "{held:?} {allowed:?}");
    // 10 N by the closed form.
    assert!(
        errors(&forces("in-plane-50um"))[1].abs() > allowed[1],
        "{allowed:?}"
    );

    let source = format!("replay:{recording}");
    let arguments = [
        "live",
        sensor,
        "--source",
        &source,
        "--no-tare",
        "--headless",
    ];
    let arguments = [&arguments[..], &["--speed", "max", "--format", "json"]].concat();
    let last: Value = serde_json::from_str(&done(&arguments)).unwrap();
    assert_eq!(last["last_force_n"][2].as_f64(), found.last().copied());
}

/// Numbers of a column of a table of touches; NaN where there is none, such as below rest.
fn column_of(file: &str, title: &str) -> Vec<f64> {
    let touch = fs::read_to_string(file).unwrap();
    let mut lines = touch.lines().filter(|line| !line.starts_with('#'));
    let place = lines
        .next()
        .unwrap()
        .split(',')
        .position(|own| own == title);
    let place = place.unwrap();
    let number = |line: &str| line.split(',').nth(place).unwrap().parse();
    lines.map(|line| number(line).unwrap_or(f64::NAN)).collect()
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
    for name in ["three-axis-8x8", "piezo-1.5mm"] {
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
