//! From readings of a bench to a calibrated prediction and live touch, at the
//! boundary of the program.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{Folder, done, refused};

const SENSOR: &str = "in-plane-50um";

/// A folder of this test with readings and a calibration in it.
struct Bench(Folder);

impl Bench {
    fn new(name: &str) -> Self {
        let bench = Self(Folder::new(name));
        done(&[
            "twin",
            SENSOR,
            "--calibration-data",
            "-o",
            &bench.path("data.csv"),
            "--seed",
            "4",
        ]);
        bench
    }

    fn path(&self, name: &str) -> String {
        self.0.path(name)
    }

    fn calibrate(&self, more: &[&str]) -> Value {
        let data = self.path("data.csv");
        let mut arguments = vec!["calibrate", SENSOR, &data, "--format", "json"];
        arguments.extend(more);
        serde_json::from_str(&done(&arguments)).unwrap()
    }
}

#[test]
fn readings_become_a_calibration_that_predicts_and_feels() {
    let bench = Bench::new("calibrate");
    let (file, page) = (bench.path("c.toml"), bench.path("c.html"));
    let found = bench.calibrate(&["-o", &file, "--report", &page]);
    assert_eq!(found["parameters"][0]["name"], "youngs_modulus");
    assert!(
        fs::read_to_string(&page)
            .unwrap()
            .contains("What the readings do not identify")
    );
    // The readings are of the drawn device, so its prediction is the truth.
    let predict = |more: &[&str]| -> Value {
        let mut arguments = vec!["predict", SENSOR, "--load", "fz=20 N", "--format", "json"];
        arguments.extend(more);
        let whole: Value = serde_json::from_str(&done(&arguments)).unwrap();
        whole["rows"][0].clone()
    };
    let (drawn, calibrated) = (predict(&[]), predict(&["--calibration", &file]));
    let [drawn, value, deviation] = [
        &drawn["capacitance_f"],
        &calibrated["capacitance_f"],
        &calibrated["capacitance_deviation_f"],
    ]
    .map(|number| number.as_f64().unwrap());
    assert!(deviation > 0.0 && deviation < 0.005 * drawn, "{deviation}");
    // 1 % of noise on a change of half the capacitance; the published law is
    // not the mechanics of the drawing to the last per cent.
    assert!((value / drawn - 1.0).abs() < 0.02, "{drawn} {value}");
    let live = done(&[
        "live",
        SENSOR,
        "--calibration",
        &file,
        "--headless",
        "--speed",
        "max",
        "--frames",
        "60",
    ]);
    assert!(live.contains("last_force_n"), "{live}");
}

#[test]
fn the_shipped_readings_are_fitted_for_three_gaps_together() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../taxel-calibrate/data/in-plane-synthetic.csv");
    let text = done(&[
        "calibrate",
        "in-plane-20um",
        &data.to_string_lossy(),
        "--with",
        SENSOR,
        "--with",
        "in-plane-100um",
        "--format",
        "json",
    ]);
    let found: Value = serde_json::from_str(&text).unwrap();
    // Two that are shared, five of each gap, and the hysteresis of each: the
    // bench was made with 5 %.
    assert_eq!(
        found["parameters"].as_array().unwrap().len(),
        2 + 3 * (5 + 5)
    );
    // Their truth is the drawing, which therefore fits to within the noise of
    // 0.5 % and the drift of as much.
    let first = found["models"].as_array().unwrap().iter();
    let first = first
        .clone()
        .find(|model| model["name"] == "first-principles")
        .unwrap();
    assert!(
        first["relative_residual"].as_f64().unwrap() < 0.01,
        "{first}"
    );
    // The truth lies in the interval of what is called identified.
    for (name, truth) in [("youngs_modulus", 1.2e6), ("end_scale", 1.0)] {
        let mut parameters = found["parameters"].as_array().unwrap().iter();
        let found = parameters.find(|one| one["name"] == name).unwrap();
        let interval = [0, 1].map(|end| found["interval"][end].as_f64().unwrap());
        assert!((interval[0]..=interval[1]).contains(&truth), "{found}");
    }
}

#[test]
fn a_calibration_of_another_file_is_refused() {
    let bench = Bench::new("other");
    let file = bench.path("c.toml");
    bench.calibrate(&["-o", &file]);
    for command in ["predict", "live"] {
        let mut arguments = vec![command, "in-plane-100um", "--calibration", &file];
        arguments.extend(match command {
            "predict" => vec!["--load", "fz=1 N"],
            _ => vec!["--headless", "--frames", "2"],
        });
        let message = refused(&arguments);
        assert!(
            message.contains("electrodes.gap was 50 um, is 100 um"),
            "{message}"
        );
    }
    let text = fs::read_to_string(&file).unwrap();
    for (from, to, message) in [
        ("schema = 2", "schema = 9", "schema 9 is not known"),
        ("schema = 2", "schema = 1", "of an older taxel"),
        ("first = 0", "first = 1", "must begin with parameter 0"),
        (
            "name = \"youngs_modulus\"",
            "name = \"x\"",
            "youngs_modulus is missing",
        ),
    ] {
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let refusal = refused(&[
            "predict",
            SENSOR,
            "--load",
            "fz=1 N",
            "--calibration",
            &file,
        ]);
        assert!(refusal.contains(message), "{refusal}");
    }
}

/// Comments, order and units of a sensor file may change; its values may not.
#[test]
fn a_calibration_is_bound_to_the_values_of_the_sensor_file() {
    let bench = Bench::new("values");
    let (sensor, file) = (bench.path("mine.toml"), bench.path("c.toml"));
    let shipped = taxel::sensor::Sensor::shipped_text(SENSOR).unwrap();
    bench.calibrate(&["-o", &file]);
    let predict = [
        "predict",
        &sensor,
        "--load",
        "fz=1 N",
        "--calibration",
        &file,
    ];
    let spelled = shipped.replace("\"50 um\"", "\"0.05 mm\"");
    fs::write(&sensor, format!("# Mine.\n{spelled}")).unwrap();
    done(&predict);
    fs::write(&sensor, shipped.replace("\"50 um\"", "\"51 um\"")).unwrap();
    let message = refused(&predict);
    assert!(message.contains("gap was 50 um, is 51 um"), "{message}");
}

/// A model that cannot be fitted beside the asked one is a remark.
#[test]
fn few_readings_stop_no_model_that_they_determine() {
    let bench = Bench::new("few");
    let data = bench.path("data.csv");
    let text = fs::read_to_string(&data).unwrap();
    let mut rows = text.lines().filter(|line| !line.starts_with('#'));
    let mut few = format!("{},hold_out\n", rows.next().unwrap());
    // Of nine readings of loading three are fitted, six held out.
    for (row, line) in rows.take(50).step_by(5).take(9).enumerate() {
        writeln!(few, "{line},{}", u8::from(row % 3 > 0)).unwrap();
    }
    fs::write(&data, few).unwrap();
    let found = bench.calibrate(&["--model", "first-principles", "--hold-out", "column"]);
    let remarks = found["remarks"].to_string();
    assert!(remarks.contains("model-1 was not fitted"), "{remarks}");
    assert!(found["models"][0]["relative_hold_out"].is_number());
}

#[test]
fn what_cannot_be_fitted_writes_no_file() {
    let bench = Bench::new("wrong");
    let (data, file) = (bench.path("data.csv"), bench.path("c.toml"));
    let text = fs::read_to_string(&data).unwrap();
    let few: Vec<&str> = text.lines().take(8).collect();
    for (wrong, message) in [
        (text.replace("force_z [N]", "force_z [mN]"), "a thousandth"),
        (
            text.replace("force_z [N]", "force")
                .replace("displacement [um]", "way"),
            "neither a force nor a displacement",
        ),
        (few.join("\n"), "readings of loading"),
        (text.replace("50,", "20,"), "none of the sensors"),
    ] {
        fs::write(&data, wrong).unwrap();
        let refusal = refused(&["calibrate", SENSOR, &data, "-o", &file]);
        assert!(refusal.contains(message), "{message}: {refusal}");
        assert!(!Path::new(&file).exists());
    }
    for arguments in [
        vec!["calibrate", "three-axis-unit", &data],
        vec!["calibrate", SENSOR, "no-such-file.csv"],
        vec!["calibrate", SENSOR, &data, "--hold-out", "most"],
        vec!["calibrate", SENSOR, &data, "--model", "none"],
        vec!["twin", SENSOR],
        vec!["twin", SENSOR, "--calibration-data", "--noise", "2"],
    ] {
        refused(&arguments);
    }
}

#[test]
fn arrays_go_from_readings_to_predictions_and_live_touch() {
    let bench = Bench::new("arrays");
    let (data, file) = (bench.path("array.csv"), bench.path("array.toml"));
    for (sensor, load, column) in [
        (
            "three-axis-8x8",
            "fx=5 mN, fy=0 mN, fz=10 mN",
            "capacitance_11",
        ),
        ("piezo-1.5mm", "profile=step, x=10 um, ramp=10 ms", "a1"),
    ] {
        done(&[
            "twin",
            sensor,
            "--calibration-data",
            "--noise",
            "0.002",
            "--compression",
            "0.4",
            "-o",
            &data,
            "--force",
        ]);
        let json = ["--format", "json", "--force"];
        let found = done(&[&["calibrate", sensor, &data, "-o", &file], &json[..]].concat());
        let found: Value = serde_json::from_str(&found).unwrap();
        // Noise of 0.2 % of the largest change.
        let held_out = found["models"][0]["relative_hold_out"].as_f64().unwrap();
        assert!(held_out < 0.005, "{sensor}: {held_out}");
        let answer = done(&[
            "predict",
            sensor,
            "--calibration",
            &file,
            "--load",
            load,
            "--format",
            "csv",
        ]);
        assert!(answer.contains(&format!("{column}_deviation")), "{answer}");
        let live = done(&[
            "live",
            sensor,
            "--calibration",
            &file,
            "--headless",
            "--speed",
            "max",
            "--frames",
            "60",
        ]);
        assert!(live.contains("last_force_n"), "{live}");
    }
}

#[test]
fn presses_at_places_teach_where_a_contact_is() {
    let folder = Folder::new("presses");
    let [peaks, presses, file, page] =
        ["peaks.csv", "presses.csv", "c.toml", "c.html"].map(|name| folder.path(name));
    let sensor = "piezo-1.5mm";
    done(&[
        "twin",
        sensor,
        "--calibration-data",
        "--noise",
        "0.002",
        "--compression",
        "0.4",
        "-o",
        &peaks,
    ]);
    done(&[
        "twin",
        sensor,
        "--calibration-data",
        "--probe",
        "2.5",
        "--probe",
        "3.6",
        "-o",
        &presses,
    ]);
    let text = done(&[
        "calibrate",
        sensor,
        &peaks,
        &presses,
        "-o",
        &file,
        "--report",
        &page,
    ]);
    for word in [
        "charge_per_force",
        "place.kernel.radius_3.60mm:",
        "place.centroid.radius_2.50mm_not_trained:",
        "1. by held-out likelihood",
        "positions are found by",
    ] {
        assert!(text.contains(word), "{word}: {text}");
        let found = fs::read_to_string(&page).unwrap();
        assert!(found.contains(word.trim_end_matches(':')), "{word}");
    }
    let live = |more: &[&str]| {
        let mut arguments = vec![
            "live",
            sensor,
            "--headless",
            "--speed",
            "max",
            "--frames",
            "200",
        ];
        arguments.extend(more);
        done(&arguments)
    };
    assert!(live(&["--calibration", &file]).contains("last_force_n"));
    let alone = done(&["calibrate", sensor, &presses, "--format", "json"]);
    let alone: Value = serde_json::from_str(&alone).unwrap();
    assert_eq!(alone["parameters"][0]["status"], "fixed");
    let missing = fs::read_to_string(&file)
        .unwrap()
        .replace("gains = [", "gains = [1.0, ");
    fs::write(&file, missing).unwrap();
    let refusal = refused(&[
        "live",
        sensor,
        "--calibration",
        &file,
        "--headless",
        "--frames",
        "2",
    ]);
    assert!(refusal.contains("directions"), "{refusal}");
    let refusal = refused(&["calibrate", sensor, &presses, &presses]);
    assert!(refusal.contains("same kind"), "{refusal}");
    let refusal = refused(&[
        "twin",
        "three-axis-8x8",
        "--calibration-data",
        "--probe",
        "2",
    ]);
    assert!(refusal.contains("--probe"), "{refusal}");
    refused(&["twin", sensor, "--calibration-data", "--probe", "0"]);
}

#[test]
fn loops_and_saturation_of_channels_are_found() {
    let folder = Folder::new("channels");
    let (data, file) = (folder.path("data.csv"), folder.path("c.toml"));
    let sensor = "liquid-metal-2x4";
    done(&[
        "twin",
        sensor,
        "--calibration-data",
        "-o",
        &data,
        "--noise",
        "0.0002",
        "--compression",
        "0.36",
        "--hysteresis",
        "0.1",
        "--saturation",
        "0.8",
    ]);
    let text = done(&["calibrate", sensor, &data, "-o", &file]);
    for word in [
        "channel_0.saturation_voltage",
        "hysteresis_1",
        "with it by",
        "saturated from",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let live = done(&[
        "live",
        sensor,
        "--calibration",
        &file,
        "--headless",
        "--speed",
        "max",
        "--frames",
        "60",
    ]);
    assert!(live.contains("last_"), "{live}");
}

/// The table with the last `columns` of each row taken from `rows` rows before.
fn later(text: &str, columns: usize, rows: usize) -> String {
    let table: Vec<Vec<&str>> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').collect())
        .collect();
    let mut lines = vec![table[0].join(",")];
    for row in 1 + rows..table.len() {
        let kept = table[row].len() - columns;
        let cells = [&table[row][..kept], &table[row - rows][kept..]].concat();
        lines.push(cells.join(","));
    }
    lines.join("\n") + "\n"
}

#[test]
fn signals_of_another_moment_than_their_loads_are_named() {
    let folder = Folder::new("clocks");
    let (data, file) = (folder.path("data.csv"), folder.path("c.toml"));
    for (sensor, columns) in [(SENSOR, 1), ("three-axis-8x8", 4), ("liquid-metal-2x4", 1)] {
        let bench = [
            "twin",
            sensor,
            "--calibration-data",
            "-o",
            &data,
            "--force",
            "--noise",
            "0.002",
        ];
        done(&[&bench[..], &["--hysteresis", "0.1"]].concat());
        let text = fs::read_to_string(&data).unwrap();
        done(&["calibrate", sensor, &data]);
        fs::write(&data, later(&text, columns, 4)).unwrap();
        let refusal = refused(&["calibrate", sensor, &data, "-o", &file]);
        assert!(
            refusal.contains("the signal comes about") && refusal.contains("clocks differ"),
            "{sensor}: {refusal}"
        );
        assert!(!Path::new(&file).exists());
    }
}

/// The table with each row's cells changed; row 0 is the header.
fn with_rows(text: &str, change: impl Fn(usize, &mut Vec<String>)) -> String {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let changed = lines.enumerate().map(|(row, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(row, &mut cells);
        cells.join(",") + "\n"
    });
    changed.collect()
}

#[test]
fn a_second_clock_is_looked_at_for_each_device() {
    let folder = Folder::new("two-clocks");
    let (data, file) = (folder.path("data.csv"), folder.path("c.toml"));
    for sensor in [SENSOR, "three-axis-unit", "liquid-metal-2x4", "piezo-1.5mm"] {
        done(&["twin", sensor, "--calibration-data", "-o", &data, "--force"]);
        let text = fs::read_to_string(&data).unwrap();
        let late = with_rows(&text, |row, cells| {
            let time = cells[0].parse::<f64>().map(|time| time + 3.0);
            cells.push(if row == 0 {
                "sensor_time [s]".into()
            } else {
                time.unwrap().to_string()
            });
        });
        fs::write(&data, late).unwrap();
        let refusal = refused(&["calibrate", sensor, &data, "-o", &file]);
        assert!(
            refusal.contains("sensor_time") && refusal.contains("the clocks differ by 3.0"),
            "{sensor}: {refusal}"
        );
        assert!(!Path::new(&file).exists());
    }
}

#[test]
fn a_force_that_hangs_is_named_and_a_missing_voltage_left_out() {
    let folder = Folder::new("hanging");
    let (data, file) = (folder.path("data.csv"), folder.path("c.toml"));
    let bench = |sensor: &str| {
        done(&["twin", sensor, "--calibration-data", "-o", &data, "--force"]);
        fs::read_to_string(&data).unwrap()
    };
    let text = bench("three-axis-unit");
    let hanging = with_rows(&text, |row, cells| {
        if row > 0 {
            cells[5] = "5".into();
        }
    });
    fs::write(&data, hanging).unwrap();
    let refusal = refused(&["calibrate", "three-axis-unit", &data, "-o", &file]);
    assert!(refusal.contains("force_z is constant"), "{refusal}");
    assert!(!Path::new(&file).exists());
    let text = bench("liquid-metal-2x4");
    let without = with_rows(&text, |row, cells| {
        if row == 10 {
            cells.last_mut().unwrap().clear();
        }
    });
    fs::write(&data, without).unwrap();
    let found = done(&["calibrate", "liquid-metal-2x4", &data]);
    assert!(
        found.contains("no load or no voltage; the row is left out"),
        "{found}"
    );
}

/// Four cells of a raw board, each with a curve of its own, one of them falling.
const MEASURED_CELLS: &str = r#"
schema = 2
name = "four cells that were measured"
array = { rows = 2, columns = 2, pitch = "10 mm", mount = "flat" }
[element.cells]
full_scale = "80 kPa"
cell.points = [
  { pressure = "0 kPa", reading = [100, 120, 90, 200] },
  { pressure = "10 kPa", reading = [400, 380, 300, 90] },
  { pressure = "30 kPa", reading = [900, 1000, 700, 40] },
  { pressure = "80 kPa", reading = [1800, 1500, 1600, 10] },
]
[electronics]
frame_rate = "50 Hz"
scan = "simultaneous"
readout.digital = { unit = "counts", noise = 1 }
"#;

/// One gain is fitted to the curves of all cells, from the rest of each.
#[test]
fn one_gain_is_fitted_to_the_curves_of_all_cells() {
    let folder = Folder::new("cell-gain");
    let [sensor, table, file] =
        ["cells.toml", "cells.csv", "gain.toml"].map(|name| folder.path(name));
    fs::write(&sensor, MEASURED_CELLS).unwrap();
    let (gain, pressures) = (1.07_f64, [0, 10, 30, 80]);
    let curves = [
        [100.0, 400.0, 900.0, 1800.0],
        [120.0, 380.0, 1000.0, 1500.0],
        [90.0, 300.0, 700.0, 1600.0],
        [200.0, 90.0, 40.0, 10.0],
    ];
    let mut rows = String::from("taxel,pressure [kPa],counts\n");
    // Three times, one count below, at and above the curve.
    for noise in [-1.0, 0.0, 1.0] {
        for (taxel, curve) in curves.iter().enumerate() {
            for (pressure, reading) in pressures.iter().zip(curve) {
                let counts = (curve[0] + gain * (reading - curve[0])).round() + noise;
                let _ = writeln!(rows, "{taxel},{pressure},{counts}");
            }
        }
    }
    fs::write(&table, rows).unwrap();
    done(&["calibrate", &sensor, &table, "-o", &file]);
    let text = fs::read_to_string(&file).unwrap();
    let (_, of_gain) = text.split_once("name = \"gain\"").unwrap();
    let (_, interval) = of_gain.split_once("interval = [").unwrap();
    let bounds = interval.split_once(']').unwrap().0.split(", ");
    let bounds: Vec<f64> = bounds.map(|bound| bound.parse().unwrap()).collect();
    assert!(bounds[0] < gain && gain < bounds[1], "{bounds:?}");
    // The largest change is 1700 counts: one of noise is less than a thousandth of it.
    assert!(bounds[1] - bounds[0] < 1e-3, "{bounds:?}");
}
