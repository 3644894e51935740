//! `taxel material`: tests to laws, the library, hardness.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use crate::common::{Folder, done, refused_with, taxel};

fn json(arguments: &[&str]) -> Value {
    let text = done(&[arguments, &["--format", "json"]].concat());
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_pull_becomes_a_law_with_an_interval_and_a_file() {
    let folder = Folder::new("material");
    let (test, law) = (folder.path("pull.csv"), folder.path("silicone.toml"));
    let mut text = String::from("strain [1],stress [kPa]\n");
    for n in 1..=30 {
        let l = 1.0 + f64::from(n) / 30.0;
        // Neo-Hookean of 100 kPa, with an error that changes its sign.
        let error = 1.0 + 0.002 * f64::from((n * 7) % 5 - 2);
        writeln!(text, "{},{}", l - 1.0, 100.0 * (l - l.powi(-2)) * error).unwrap();
    }
    fs::write(&test, text).unwrap();
    let answer = json(&["material", "fit", &test, "-o", &law]);
    let chosen = answer["chosen"].as_u64().unwrap() as usize;
    let shear = answer["candidates"][chosen]["shear_modulus_pa"]
        .as_f64()
        .unwrap();
    // The errors are at most 0.4 % of a stress.
    assert!((shear / 100e3 - 1.0).abs() < 4e-3, "{shear}");
    let interval = &answer["interval_pa"];
    assert!(interval[0].as_f64().unwrap() < shear && shear < interval[1].as_f64().unwrap());
    assert_eq!(answer["basis"], "one specimen");
    let written = fs::read_to_string(&law).unwrap();
    assert!(
        written.contains("law = { neo_hookean = { shear_modulus = \""),
        "{written}"
    );
    let again = json(&["material", "fit", &test]);
    assert_eq!(answer, again);
    refused_with(
        &["material", "fit", &test, "--law", "hooke"],
        &["neo_hookean", "all"],
    );
}

#[test]
fn laws_that_do_not_stand_end_with_exit_code_1() {
    let yeoh = "yeoh 92.285 11.477 -0.861 kPa";
    let output = taxel(&["material", "check", yeoh, "--service", "0.5..3"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("equibiaxial"));
    let stable = json(&["material", "check", yeoh, "--service", "0.5..2"]);
    assert_eq!(stable["stable"], true);
    let output = taxel(&["material", "check", "ogden -0.1659 -5.178 MPa"]);
    assert_eq!(output.status.code(), Some(1));
    refused_with(
        &["material", "check", "gent 100 3"],
        &["the unit is missing", "kPa"],
    );
}

#[test]
fn names_and_hardness_answer_with_source_and_interval() {
    let shown = json(&["material", "show", "rtv615"]);
    assert!(shown["source"].as_str().unwrap().contains("2020"));
    // Three times 345.03 kPa, of five digits.
    assert!((shown["youngs_modulus_pa"].as_f64().unwrap() / 1.0351e6 - 1.0).abs() < 5e-5);
    refused_with(
        &["material", "show", "ecoflex-31"],
        &["near names: ecoflex-00-10"],
    );
    assert_eq!(json(&["material", "list"]).as_array().unwrap().len(), 20);
    let soft = json(&["material", "hardness", "00-30"]);
    assert!((soft["youngs_modulus_pa"].as_f64().unwrap() / 66e3 - 1.0).abs() < 0.01);
    let hard = json(&["material", "hardness", "60 A"]);
    assert_eq!(hard["within_range"], false);
    assert!(hard["youngs_modulus_pa"].is_null());
    refused_with(
        &["material", "hardness", "30 D"],
        &["\"30 A\" or \"00-30\""],
    );
}
