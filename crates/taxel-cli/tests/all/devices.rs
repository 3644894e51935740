//! Loads and files at the edge of what each device takes: one clear message
//! and exit code 2, or a state with its limit; never a number that is none.

use std::fs;
use std::path::Path;

use crate::common::{refused_with, taxel};
use serde_json::Value;
use taxel::sensor::Sensor;

/// The one row that answers `load`, as JSON; no output may say NaN.
#[track_caller]
fn row(sensor: &str, load: &str) -> Value {
    for format in ["table", "csv"] {
        let output = taxel(&["predict", sensor, "--load", load, "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let printed = String::from_utf8(output.stdout).unwrap();
        for word in ["NaN", "nan", "inf"] {
            assert!(!printed.contains(word), "{printed}");
        }
    }
    let output = taxel(&["predict", sensor, "--load", load, "--format", "json"]);
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    answer["rows"][0].clone()
}

/// A shipped sensor file with one text replaced, in a folder of its own.
fn changed(test: &str, name: &str, from: &str, to: &str) -> String {
    let shipped = Sensor::shipped_text(name).unwrap();
    assert!(shipped.contains(from), "{name} has no {from}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("devices");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(format!("{test}.toml"));
    fs::write(&path, shipped.replace(from, to)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_layer_cannot_be_pressed_to_nothing() {
    for load in ["compression=1.2", "e=1", "e=-0.1", "u=2 mm"] {
        let arguments = ["predict", "in-plane-50um", "--load", load];
        refused_with(&arguments, &["0", "1"]);
    }
}

#[test]
fn a_load_beyond_closure_has_a_state_and_bounds() {
    let answer = row("liquid-metal-2x4", "pressure=500 kPa");
    for layer in ["row", "column"] {
        assert_eq!(answer[format!("{layer}_state")], "beyond_curve", "{answer}");
        assert_eq!(answer[format!("{layer}_change")], Value::Null, "{answer}");
        // The bound, and where the curve ends.
        assert!(answer[format!("{layer}_area_ratio")].as_f64().unwrap() > 0.0);
        let number = |name: &str| answer[format!("{layer}_{name}_pa")].as_f64().unwrap();
        assert!(number("net_pressure") > number("curve_ends_at_net_pressure"));
    }
    assert_eq!(answer["closed_form_change"], "closed");
    assert!(answer["closed_form_ends_at_pressure_pa"].as_f64().unwrap() < 500e3);
    // Three-axis: every tile touches, and the row says which.
    let answer = row("three-axis-8x8", "fz=90 mN");
    assert_eq!(answer["state"], "closed", "{answer}");
    assert_eq!(answer["closed"], "11 12 21 22", "{answer}");
}

#[test]
fn a_capacitance_that_no_load_gives_names_the_limit() {
    let answer = row("in-plane-20um", "capacitance_change=900 fF");
    assert_eq!(answer["state"], "out_of_range");
    assert_eq!(answer["force_z_n"], Value::Null);
    // As `taxel check` prints it.
    let limit = answer["invertible_change_f"].as_f64().unwrap();
    assert_eq!(format!("{:.2} fF", limit * 1e15), "740.30 fF");

    // Under the published law the curve turns before.
    let law = ("law = \"mechanics\"", "law = \"published\"");
    let published = changed("published", "in-plane-20um", law.0, law.1);
    let answer = row(&published, "capacitance_change=900 fF");
    assert_eq!(answer["state"], "ambiguous");
    let limit = answer["invertible_change_f"].as_f64().unwrap();
    let row_at = |change: f64| row(&published, &format!("dc={change} fF"))["state"].clone();
    assert_eq!(row_at(0.99 * limit * 1e15), "ok");
    assert_eq!(row_at(1.01 * limit * 1e15), "ambiguous");
}

#[test]
fn a_force_beyond_the_layer_names_the_largest() {
    let answer = row("in-plane-50um", "fz=1000 N");
    assert_eq!(answer["state"], "out_of_range");
    assert_eq!(answer["compression"], Value::Null);
    let largest = answer["largest_force_n"].as_f64().unwrap();
    let within = row("in-plane-50um", &format!("fz={} N", 0.999 * largest));
    assert_ne!(within["compression"], Value::Null, "{within}");
}

#[test]
fn a_voltage_above_the_output_is_clipped_at_a_named_limit() {
    let answer = row("piezo-1.5mm", "profile=step, ramp=10 ms, fz=20 N");
    assert_eq!(answer["clipped"], "clipped beyond -3 to 3 V");
    assert_eq!(
        row("piezo-1.5mm", "profile=step, ramp=10 ms, fz=20 mN")["clipped"],
        ""
    );
}

#[test]
fn a_supply_above_what_the_board_takes_saturates() {
    // At 6 V the channels pass 1.97 V, from which they count as saturated.
    let higher = changed(
        "higher",
        "liquid-metal-2x4",
        "supply = \"2 V\"",
        "supply = \"6 V\"",
    );
    let answer = row(&higher, "pressure=25 kPa");
    for layer in ["row", "column"] {
        assert_eq!(answer[format!("{layer}_state")], "saturated", "{answer}");
        assert!(answer[format!("{layer}_voltage_v")].as_f64().unwrap() > 1.97);
    }
}

#[test]
fn a_file_that_cannot_work_is_refused_with_what_would() {
    let rate = ("frame_rate = \"1 kHz\"", "frame_rate = \"5 Hz\"");
    let preload = ("preload = \"2.68 N\"", "preload = \"8 N\"");
    let supply = ("saturation = \"1.97 V\"", "saturation = \"2.5 V\"");
    for (test, name, (from, to), parts) in [
        ("slow", "piezo-1.5mm", rate, ["corner", "at least 86.8"]),
        (
            "flat",
            "piezo-1.5mm",
            preload,
            ["no thickness", "below 8 N"],
        ),
        (
            "supply",
            "liquid-metal-2x4",
            supply,
            ["2.5 V", "the supply is 2 V"],
        ),
    ] {
        let file = changed(test, name, from, to);
        refused_with(&["check", &file], &parts);
        refused_with(&["live", &file, "--headless", "--frames", "1"], &parts);
    }
}

#[test]
fn a_load_word_of_another_device_is_answered_with_ours() {
    for (sensor, load, names) in [
        ("three-axis-unit", "p=1 kPa", "fx"),
        ("in-plane-50um", "fx=1 N", "dc (fall of the capacitance"),
        ("piezo-1.5mm", "p=1 kPa", "profile (how the load runs)"),
        ("liquid-metal-2x4", "e=0.1", "area (area under the force)"),
    ] {
        refused_with(&["predict", sensor, "--load", load], &["names:", names]);
    }
    let force = ["predict", "liquid-metal-2x4", "--load", "fz=10 N"];
    refused_with(&force, &["give the area too"]);
}

#[test]
fn the_reference_is_printed() {
    let output = taxel(&["schema", "reference"]);
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(output.stdout, Sensor::reference().into_bytes());
}

/// `taxel live` on 600 frames of a taxel that is pressed from the start to 4 s, as JSON.
fn pressed_at_the_start(folder: &str, force: &str, more: &[&str]) -> Value {
    let point = |time: &str, force: &str| {
        format!("{{ time = \"{time}\", force = [\"0 N\", \"0 N\", \"{force}\"] }}, ")
    };
    let path = [
        point("0 s", force),
        point("4 s", force),
        point("4.1 s", "0 N"),
    ]
    .concat();
    let script = format!("{folder}/{}.toml", force.replace(' ', "_"));
    let text = format!(
        "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [2, 5]\npath = [{path}]\n"
    );
    fs::write(&script, text).unwrap();
    let source = format!("sim:{script}");
    let run = [
        "live",
        "three-axis-8x8",
        "--source",
        &source,
        "--headless",
        "--speed",
        "max",
    ];
    let output = taxel(&[&run[..], &["--frames", "600", "--format", "json"], more].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_zero_is_where_the_operator_says() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rest");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let folder = folder.to_str().unwrap();
    let force = |summary: &Value| summary["last_force_n"][2].as_f64().unwrap();

    // Not under the press, but once it has gone, which is said.
    let summary = pressed_at_the_start(folder, "60 mN", &[]);
    assert_eq!(summary["tare"], "done");
    let notice = summary["notice"].as_str().unwrap();
    assert!(notice.contains("the zero was taken at"), "{summary}");
    assert!(force(&summary).abs() < 1e-3, "{summary}");

    for option in [&["--tare"][..], &["--tare", "--rest", "100"]] {
        let summary = pressed_at_the_start(folder, "5 mN", option);
        assert_eq!(summary["tare"], "done");
        assert_eq!(summary["below_zero"]["taxels"], 1, "{summary}");
        assert!((force(&summary) + 5e-3).abs() < 1e-3, "{summary}");
    }

    let rest = format!("{folder}/rest.csv");
    let run = [
        "live",
        "three-axis-8x8",
        "--headless",
        "--speed",
        "max",
        "--frames",
    ];
    for (frames, seed) in [("80", "7"), ("30", "8")] {
        let save = if frames == "80" {
            rest.clone()
        } else {
            format!("{folder}/short.csv")
        };
        let output = taxel(&[&run[..], &[frames, "--seed", seed, "--save", &save]].concat());
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    // Another seed is other noise of the same piece.
    let summary = pressed_at_the_start(folder, "5 mN", &["--rest", &rest, "--seed", "7"]);
    assert_eq!(summary["tare"], "loaded");
    assert_eq!(summary["below_zero"], Value::Null);
    assert!(force(&summary).abs() < 1e-3, "{summary}");

    let short = format!("{folder}/short.csv");
    let live = |rest: &str| {
        [
            "live",
            "--headless",
            "--speed",
            "max",
            "--frames",
            "9",
            "--rest",
            rest,
        ]
        .map(String::from)
    };
    for (rest, parts) in [
        (short.as_str(), &["--rest", "30 frames", "takes 50"][..]),
        ("nowhere.csv", &["--rest nowhere.csv", "cannot be opened"]),
        ("1", &["2 to 100000 frames, or a recording"]),
    ] {
        let arguments = live(rest);
        refused_with(&arguments.each_ref().map(String::as_str), parts);
    }
    let arguments = live(&rest);
    let arguments = arguments.each_ref().map(String::as_str);
    refused_with(&[&arguments[..], &["--no-tare"]].concat(), &["--no-tare"]);
    refused_with(
        &[
            "live",
            "in-plane-50um",
            "--headless",
            "--speed",
            "max",
            "--frames",
            "9",
            "--rest",
            &rest,
        ],
        &["--rest", "does not fit in-plane-50um", "256 channels"],
    );
}
