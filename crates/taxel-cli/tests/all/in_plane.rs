//! The in-plane sensor at the boundary of the program.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const SENSOR: &str = "in-plane-50um";

fn taxel(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(arguments)
        .output()
        .unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let output = taxel(arguments);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {output:?}"))
}

fn row(load: &str) -> Value {
    let answer = json(&["predict", SENSOR, "--load", load, "--format", "json"]);
    answer["rows"][0].clone()
}

#[test]
fn force_leads_to_a_capacitance_and_back() {
    let there = row("force_z=10 N");
    assert_eq!(there["state"], "ok");
    let change = there["change_mechanics_f"].as_f64().unwrap();
    assert!(change > 0.0);
    let back = row(&format!("dc={} fF", change * 1e15));
    let force = back["force_z_n"].as_f64().unwrap();
    // Printed and read with all digits; the change is known to 1e-14 of itself.
    assert!((force - 10.0).abs() < 1e-9, "{force}");
}

#[test]
fn beyond_the_models_there_is_a_state_and_no_number() {
    for (load, state) in [
        ("e=0.35", "beyond_capacitance"),
        ("e=0.5", "force_unverified"),
        ("fz=1000 N", "out_of_range"),
        ("dc=1 pF", "out_of_range"),
    ] {
        let answer = row(load);
        assert_eq!(answer["state"], state, "{answer}");
        assert_eq!(answer["capacitance_f"], Value::Null, "{answer}");
    }
}

#[test]
fn loads_without_meaning_are_refused_with_exit_code_2() {
    for (load, part) in [
        ("e=1", "outside 0 (included) to 1 (excluded)"),
        ("e=0.9", "outside 0 to 0.759"),
        ("e=0.9999", "outside 0 to 0.759"),
        ("u=1 mm", "outside 0 (included) to 1 (excluded)"),
        ("e=0.1, fz=1 N", "give exactly one"),
        ("fz=-1 N", "-1"),
    ] {
        let output = taxel(&["predict", SENSOR, "--load", load]);
        assert_eq!(output.status.code(), Some(2), "{load}");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn the_twin_and_its_recording_are_estimated_alike() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("in_plane");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let saved = folder.join("press.csv");
    let saved = saved.to_str().unwrap();
    let common = ["--headless", "--speed", "max", "--format", "json"];
    let live = |source: &str, more: &[&str]| {
        let first = ["live", SENSOR, "--source", source];
        json(&[&first[..], &common, more].concat())
    };
    let first = live("sim:press", &["--frames", "330", "--save", saved]);
    let force = first["last_force_n"][2].as_f64().unwrap();
    let deviation = first["last_force_deviation_n"][2].as_f64().unwrap();
    // 3.29 s: 10 N are held.
    assert!(
        (force - 10.0).abs() < 5.0 * deviation,
        "{force} {deviation}"
    );
    assert!(deviation < 0.05);
    let again = live(&format!("replay:{saved}"), &[]);
    assert_eq!(again["last_force_n"], first["last_force_n"]);
}

#[test]
fn check_draws_the_sensor() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("in_plane_drawing");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("drawing.svg");
    let path = path.to_str().unwrap();
    let output = taxel(&["check", SENSOR, "--plot", path]);
    assert_eq!(output.status.code(), Some(0));
    let drawing = fs::read_to_string(path).unwrap();
    for text in ["H 950 µm", "S 550 µm", "D 50 µm", "b 1 mm"] {
        assert!(drawing.contains(text), "{text}");
    }
}
