//! `taxel tabulate`, and what a sensor file with its table answers.

use std::fmt::Write as _;
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

    runs_live(&sensor);
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

/// The twin presses and the estimator reads, both by the table.
fn runs_live(sensor: &str) {
    let live = [
        "live",
        sensor,
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
}

/// A sensor file beside the kept table of its layers of microchannels.
fn channels(folder: &Folder) -> String {
    let table = include_str!("../../../taxel-bodies/tests/tables/liquid-metal-2x4.json");
    fs::write(folder.path("path.json"), table).unwrap();
    let sensor = folder.path("mine.toml");
    let shipped = include_str!("../../../taxel/sensors/liquid-metal-2x4.toml");
    let key = "\nmechanics = { table = \"path.json\" }\n\n[array]";
    fs::write(&sensor, shipped.replacen("\n[array]", key, 1)).unwrap();
    sensor
}

#[test]
fn a_table_of_microchannels_is_read_by_every_command() {
    let folder = Folder::new("tabulate-channels");
    let sensor = channels(&folder);
    let facts = done(&["check", &sensor]);
    for name in [
        "table_mesh_error_of_row_change",
        "table_interpolation_error_of_column_change",
        "a table of finite elements",
    ] {
        assert!(facts.contains(name), "{facts}");
    }
    // Finite elements have 0.8936 (docs/book/finite-elements.md), the keys of the file 0.8657.
    let change = |more: &[&str]| {
        let arguments = [&["predict", &sensor, "--load", "p=25 kPa"][..], more].concat();
        answer(&arguments, "row_change")
    };
    assert!((change(&[]) - 0.8936).abs() < 1e-3, "{}", change(&[]));
    assert!((change(&["--mechanics", "closed-form"]) - 0.8657).abs() < 1e-4);

    runs_live(&sensor);

    // A sweep of the board, answered by the table; a drawing that varies is refused.
    let study = folder.path("study.toml");
    let text = |key: &str, range: &str| {
        format!(
            "schema = 2\nname = \"reference\"\nsensor = \"{sensor}\"\n\
             [variables.varied]\nkey = \"{key}\"\nrange = {range}\npoints = 2\n\
             [answers.change]\nof = \"predict\"\nquantity = \"row_change\"\nload = \"p=25 kPa\"\n"
        )
    };
    let reference = "electronics.readout.voltage_divider.reference";
    fs::write(&study, text(reference, "[\"5 ohm\", \"10 ohm\"]")).unwrap();
    assert_eq!(done(&["sweep", &study]).matches("0.89").count(), 2);
    let height = "element.microchannel.section.height";
    fs::write(&study, text(height, "[\"21 um\", \"22 um\"]")).unwrap();
    let refused = crate::common::taxel(&["sweep", &study]);
    let refused = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.contains("another drawing"), "{refused}");

    let text = fs::read_to_string(&sensor).unwrap();
    fs::write(
        &sensor,
        text.replace("height = \"20 um\"", "height = \"21 um\""),
    )
    .unwrap();
    refused_with(
        &["check", &sensor],
        &["mechanics.table", "another drawing", "height"],
    );
}

/// Of a row and a column that finite elements press on one taxel, `estimate` reads the pressure that
/// the elements had, within the errors that the table states and half a count.
#[test]
#[ignore = "a minute: cargo test -p taxel-cli --test all tabulate:: -- --ignored --nocapture"]
fn the_pressure_that_finite_elements_put_on_a_taxel_is_estimated_without_bias() {
    let folder = Folder::new("tabulate-channels-long");
    let sensor = channels(&folder);
    // 600 um of 91.92 mm; the first row lets the elements solve far enough.
    let share = 600.0 / 91_920.0;
    let pressures = [1.1, 2.3, 3.1, 3.9, 4.6];
    let mut loads = String::from("pressure [kPa],loaded_share\n30,1\n0,1\n");
    for pressure in pressures {
        writeln!(loads, "{pressure},{share}").unwrap();
    }
    let table = folder.path("loads.csv");
    fs::write(&table, loads).unwrap();
    let arguments = [
        "predict",
        &sensor,
        "--loads",
        &table,
        "--format",
        "json",
        "--mechanics",
        "fem",
    ];
    let json: Value = serde_json::from_str(&done(&arguments)).unwrap();
    let rows = &json["rows"].as_array().unwrap()[1..];
    let count = |row: usize, layer: &str| rows[row][format!("{layer}_counts")].as_f64().unwrap();
    let read = |more: f64| -> Vec<f64> {
        let recording = folder.path("readings.csv");
        let mut text = String::from("sequence,time [ns]");
        for channel in 0..6 {
            write!(text, ",r0c{channel} [counts]").unwrap();
        }
        for row in 0..rows.len() {
            let [pressed, column] =
                ["row", "column"].map(|layer| count(row, layer) + if row > 0 { more } else { 0.0 });
            let [still, quiet] = ["row", "column"].map(|layer| count(0, layer));
            write!(
                text,
                "\n{row},{},{still},{pressed},{quiet},{column},{quiet},{quiet}",
                row * 10_000_000
            )
            .unwrap();
        }
        fs::write(&recording, text + "\n").unwrap();
        let touch = folder.path("touch.csv");
        done(&[
            "estimate",
            &sensor,
            &recording,
            "--no-tare",
            "--force",
            "-o",
            &touch,
        ]);
        // Total force over the area of the one taxel that is pressed.
        let area = 600e-6 * 600e-6;
        column_of(&touch, "force_z [N]")
            .into_iter()
            .map(|force| force / area)
            .collect()
    };
    let [low, here, high] = [-1.0, 0.0, 1.0].map(read);
    let kept = fs::read_to_string(folder.path("path.json")).unwrap();
    let kept: Value = serde_json::from_str(&kept).unwrap();
    let of_layer = |layer: &str, row: usize| {
        let stated = &kept["interpolation"]["of_full_scale"][format!("{layer}_change")];
        let numbers = kept["numbers"].as_array().unwrap();
        let name = format!("{layer}_conductance_ratio");
        let place = numbers.iter().position(|number| *number == *name).unwrap();
        let end = kept["values"].as_array().unwrap().last().unwrap();
        let full = 1.0 / end[place].as_f64().unwrap() - 1.0;
        let change = rows[row][format!("{layer}_change")].as_f64().unwrap();
        let counts = (count(row, layer) - count(0, layer)) / change;
        counts * share * full * stated.as_f64().unwrap()
    };
    for (index, pressure) in pressures.iter().enumerate() {
        let row = index + 1;
        let by_table = of_layer("row", row).max(of_layer("column", row));
        let by_count = (high[row] - low[row]) / 2.0;
        let (error, allowed) = (here[row] - 1e3 * pressure, by_count * (0.5 + by_table));
        println!("{pressure} kPa: off by {error:.2} Pa of {allowed:.2} Pa");
        assert!(error.abs() <= allowed, "{pressure}: {error} {allowed}");
    }
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
