//! `taxel predict --spread`: the interval that the stated deviations leave.

use std::fs;

use crate::common::{Folder, done, refused_with};
use serde_json::Value;

fn row(arguments: &[&str]) -> Value {
    let json = done(&[arguments, &["--format", "json"]].concat());
    let json: Value = serde_json::from_str(&json).unwrap();
    json["rows"][0].clone()
}

fn number(row: &Value, column: &str) -> f64 {
    row[column]
        .as_f64()
        .unwrap_or_else(|| panic!("{column}: {row}"))
}

/// The 95 % quantile of a normal number that is cut at three deviations.
const QUANTILE: f64 = 1.6352;
/// Four standard errors of a quantile of 1000 normal numbers, in deviations.
const SLACK: f64 = 0.27;

#[test]
fn a_gap_that_scatters_leaves_the_answers_at_its_own_quantiles() {
    let folder = Folder::new("spread");
    let shipped = include_str!("../../../taxel/sensors/in-plane-50um.toml");
    let at = |gap: f64| {
        let file = folder.path(&format!("{gap}.toml"));
        fs::write(
            &file,
            shipped.replace("gap = \"50 um\"", &format!("gap = \"{gap} um\"")),
        )
        .unwrap();
        number(
            &row(&["predict", &file, "--load", "fz=10 N"]),
            "capacitance_f",
        )
    };
    let arguments = ["predict", "in-plane-50um", "--load", "fz=10 N"];
    let drawn = row(&arguments);
    let spread = row(&[&arguments[..], &["--spread"]].concat());
    // What was printed before is printed still.
    for (column, value) in drawn.as_object().unwrap() {
        assert_eq!(spread[column], *value, "{column}");
    }
    // A deviation of 1 um; a wider gap has less capacitance.
    let deviation = at(49.5) - at(50.5);
    let [low, high] =
        ["5", "95"].map(|share| number(&spread, &format!("capacitance_quantile_{share}_f")));
    assert!(
        (low - at(50.0 + QUANTILE)).abs() < SLACK * deviation,
        "{low}"
    );
    assert!(
        (high - at(50.0 - QUANTILE)).abs() < SLACK * deviation,
        "{high}"
    );
    let again = row(&[&arguments[..], &["--spread"]].concat());
    assert_eq!(again, spread);
}

#[test]
fn every_device_with_a_fabrication_has_intervals_about_its_answers() {
    for (name, load, column, wide) in [
        ("three-axis-8x8", "fz=8 mN", "capacitance_11", true),
        (
            "piezo-1.5mm",
            "profile=impact, fz=200 mN, ramp=10 ms, dwell=200 ms",
            "a1",
            true,
        ),
        ("liquid-metal-2x4", "p=15 kPa", "row_resistance", true),
        // Heights scatter, and closing curves stay.
        ("liquid-metal-2x4", "p=15 kPa", "row_area_ratio", false),
    ] {
        let row = row(&["predict", name, "--load", load, "--spread"]);
        let keys: Vec<&String> = row.as_object().unwrap().keys().collect();
        let find = |what: &str| {
            let key = keys
                .iter()
                .find(|key| key.starts_with(&format!("{column}{what}")));
            number(
                &row,
                key.unwrap_or_else(|| panic!("{column}{what}: {keys:?}")),
            )
        };
        let (drawn, low, high) = (find(""), find("_quantile_5"), find("_quantile_95"));
        if wide {
            assert!(low < drawn && drawn < high, "{name} {low} {drawn} {high}");
        } else {
            assert!(low == drawn && drawn == high, "{name} {low} {drawn} {high}");
        }
    }
}

#[test]
fn a_spread_of_nothing_is_refused() {
    refused_with(
        &["predict", "force-4x4", "--load", "fz=1 N", "--spread"],
        &["--spread", "measured_force"],
    );
    let elements = [
        "predict",
        "in-plane-50um",
        "--load",
        "fz=1 N",
        "--spread",
        "--mechanics",
        "fem",
    ];
    refused_with(&elements, &["--spread", "tabulate"]);
}
