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
fn a_law_that_is_lost_within_the_test_is_said_to_hold_up_to_a_strain() {
    let folder = Folder::new("material-lost");
    // Drucker's criterion is lost at a stretch of 2.231 in equibiaxial tension.
    let yeoh = |l: f64| {
        let i = l * l + 2.0 / l - 3.0;
        2.0 * (l - l.powi(-2)) * (92.285 + 2.0 * 11.477 * i - 3.0 * 0.861 * i * i)
    };
    let mut text = String::from("strain [1],stress [kPa]\n");
    for n in 1..=40 {
        let e = f64::from(n) / 20.0;
        writeln!(text, "{e},{}", yeoh(1.0 + e)).unwrap();
    }
    let path = folder.path("lost.csv");
    fs::write(&path, text).unwrap();
    let report = folder.path("lost.html");
    let arguments = ["material", "fit", &path, "--law", "yeoh"];
    let output = taxel(&[&arguments[..], &["--report", &report]].concat());
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let (_, range) = said
        .split_once("--strain-range 0..")
        .unwrap_or_else(|| panic!("{said}"));
    let range: f64 = range.trim().parse().unwrap();
    // Tried are twentieths of the strain of 2.
    assert!((1.131..1.232).contains(&range), "{said}");
    let page = fs::read_to_string(&report).unwrap();
    assert!(
        page.contains("equibiaxial") && page.contains("2.23"),
        "{said}"
    );
    let shorter = format!("0..{range}");
    done(&[&arguments[..], &["--strain-range", &shorter]].concat());
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

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// The sensor file of P1 with another modulus of its layer.
fn layered(folder: &Folder, name: &str, modulus: &str) -> String {
    let shipped = include_str!("../../../taxel/sensors/in-plane-50um.toml");
    let drawn = "youngs_modulus = \"1.2 MPa\"";
    assert!(shipped.contains(drawn));
    let path = folder.path(name);
    // Electrodes that are as stiff as the layer, whatever it is made of.
    let stiff = "stiffness = { modulus = { youngs_modulus = \"2.1 MPa\" } }";
    assert!(shipped.contains(stiff));
    let text = shipped
        .replace(drawn, &format!("youngs_modulus = {modulus}"))
        .replace(stiff, "stiffness = \"as_layer\"");
    fs::write(&path, text).unwrap();
    path
}

/// A law file of RTV615 with an interval from half to twice of its modulus.
fn pour(folder: &Folder, sha256: &str) {
    let text = format!(
        "schema = 1\nname = \"pour 7\"\nlaw = {{ gent = {{ shear_modulus = \"345.03 kPa\", limit = 7.6579 }} }}\n\
         [valid]\nstretch = [0.5, 2.0]\nmodes = [\"uniaxial\", \"compression\"]\n\
         [uncertainty]\nbasis = \"three specimens\"\nshear_modulus = [\"172.515 kPa\", \"690.06 kPa\"]\n\
         [made]\ntests = [{{ file = \"pull.csv\", sha256 = \"{sha256}\" }}]\n"
    );
    fs::write(folder.path("pour.toml"), text).unwrap();
}

#[test]
fn a_sensor_file_names_its_silicone() {
    let folder = Folder::new("material-named");
    let named = layered(&folder, "named.toml", "{ material = \"rtv615\" }");
    let checked = json(&["check", &named]);
    // Of five digits, as the library prints it.
    assert!((number(&checked["material"]["youngs_modulus_pa"]) / 1.0351e6 - 1.0).abs() < 5e-5);
    assert!((number(&checked["mechanics"]["shear_modulus_pa"]) / 345.03e3 - 1.0).abs() < 1e-9);
    let warning = checked["material"]["warning"].as_str().unwrap();
    assert!(warning.contains("uniaxial only"), "{warning}");
    // A pull knows no press of any other sensor either.
    let chips = include_str!("../../../taxel/sensors/pressure-chips-1x8.toml");
    let drawn = "shear_modulus = \"0.2 MPa\"";
    assert!(chips.contains(drawn));
    let path = folder.path("chips.toml");
    let named_chips = chips.replace(drawn, "shear_modulus = { material = \"rtv615\" }");
    fs::write(&path, named_chips).unwrap();
    let warned = json(&["check", &path]);
    let warning = warned["material"]["warning"].as_str().unwrap();
    assert!(
        warning.contains("pressed, how far is not computed"),
        "{warning}"
    );
    let unknown = layered(&folder, "unknown.toml", "{ material = \"rtv 61\" }");
    refused_with(&["check", &unknown], &["19:31", "near names: rtv615"]);
    // A law file, from the folder of the sensor file; a test of it that has changed is noted.
    pour(&folder, "00");
    fs::write(folder.path("pull.csv"), "strain,stress\n").unwrap();
    let filed = layered(
        &folder,
        "filed.toml",
        "{ material = { file = \"pour.toml\" } }",
    );
    let output = taxel(&["check", &filed, "--format", "json"]);
    assert!(output.status.success());
    let noted = String::from_utf8_lossy(&output.stderr);
    assert!(noted.contains("pull.csv has changed"), "{noted}");
    let filed_facts: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(filed_facts["mechanics"], checked["mechanics"]);
    assert_eq!(filed_facts["material"]["warning"], Value::Null);
    let lost = layered(
        &folder,
        "lost.toml",
        "{ material = { file = \"lost-law.toml\" } }",
    );
    refused_with(&["check", &lost], &["lost-law.toml", "folder of this file"]);
    fs::write(folder.path("lost-law.toml"), "schema = 1\nname = 3\n").unwrap();
    refused_with(&["check", &lost], &["lost-law.toml:2:8"]);
}

#[test]
fn the_interval_of_a_law_goes_through_to_the_answers() {
    let folder = Folder::new("material-spread");
    pour(&folder, "00");
    let filed = layered(
        &folder,
        "filed.toml",
        "{ material = { file = \"pour.toml\" } }",
    );
    let study = folder.path("study.toml");
    let text = |variable: &str| {
        format!(
            "schema = 2\nname = \"silicones\"\nsensor = {filed:?}\n[variables]\nsilicone = {variable}\n\
             [answers]\nforce = {{ of = \"check\", quantity = \"largest_force\" }}\n[tolerance]\nsamples = 400\n"
        )
    };
    // The force at a compression is as the modulus.
    let arguments = ["predict", &filed, "--load", "e=0.1", "--spread"];
    let row = json(&arguments)["rows"][0].clone();
    let column = row
        .as_object()
        .unwrap()
        .keys()
        .find(|key| key.contains("force") && key.contains("quantile_5"))
        .unwrap_or_else(|| panic!("{row}"))
        .clone();
    let [low, high] =
        ["quantile_5", "quantile_95"].map(|q| number(&row[column.replace("quantile_5", q)]));
    // Two ends as 95 % of a log-normal distribution: 1.645 of its deviations, cut at three, on each
    // side; each quantile of 1000 devices has a standard error of 0.07 of a deviation, and four of
    // both together are 0.4.
    let deviation = 4.0_f64.ln() / (2.0 * 1.96);
    let found = (high / low).ln() / deviation;
    assert!((found - 2.0 * 1.6352).abs() < 0.4, "{found} {row}");
    // The same file twice gives the same answer.
    assert_eq!(json(&arguments)["rows"][0], row);
    // A tolerance analysis takes the interval where a variable gives no spread of its own.
    let key = "element.in_plane_capacitor.layer.youngs_modulus";
    fs::write(&study, text(&format!("{{ key = \"{key}\" }}"))).unwrap();
    let answered = done(&["tolerance", &study]);
    assert!(answered.contains("silicone"), "{answered}");
    // A sweep goes over names.
    let values = format!("{{ key = \"{key}\", values = [\"1 MPa\", \"2 MPa\"] }}");
    fs::write(&study, text(&values)).unwrap();
    done(&["sweep", &study]);
    let named = layered(&folder, "named.toml", "{ material = \"rtv615\" }");
    let names = format!("{{ key = \"{key}.material\", values = [\"rtv615\", \"ecoflex-00-30\"] }}");
    fs::write(
        &study,
        text(&names).replace(&format!("{filed:?}"), &format!("{named:?}")),
    )
    .unwrap();
    let swept = done(&["sweep", &study]);
    assert!(
        swept.contains("rtv615") && swept.contains("ecoflex-00-30"),
        "{swept}"
    );
}

#[test]
fn a_problem_file_names_its_silicone_and_relaxes() {
    let folder = Folder::new("material-problem");
    let shipped = include_str!("../../../taxel-bodies/problems/dome.toml");
    let mesh = include_bytes!("../../../taxel-bodies/problems/dome.msh");
    fs::write(folder.path("dome.msh"), mesh).unwrap();
    let law = "law = { neo_hookean = { shear_modulus = \"60 kPa\" } }\ncompressibility = \"incompressible\"\n";
    assert!(shipped.contains(law));
    let first =
        "values = [\"0.25 mm\", \"0.5 mm\", \"0.75 mm\", \"1 mm\", \"1.25 mm\", \"1.5 mm\"]";
    let problem = |name: &str, material: &str, values: &str, more: &str| {
        let text = shipped.replace(law, material).replace(first, values);
        let text = text.replace("[mesh]", &format!("{more}[mesh]"));
        let path = folder.path(name);
        fs::write(&path, text).unwrap();
        path
    };
    let one = "values = [\"0.25 mm\"]";
    let typed = "law = { gent = { shear_modulus = \"191.33 kPa\", limit = 6.9465 } }\ncompressibility = \"incompressible\"\n";
    let typed = problem("typed.toml", typed, one, "");
    let named = problem("named.toml", "material = \"dragon-skin-30\"\n", one, "");
    let rows = |path: &str| json(&["solve", path])["rows"].clone();
    assert_eq!(rows(&named), rows(&typed));
    let both = format!("material = \"dragon-skin-30\"\n{law}");
    let both = problem("both.toml", &both, one, "");
    refused_with(&["solve", &both], &["take `law` or `material` out"]);
    // A body of one solid that relaxes by a quarter: held at its travel, its force goes to three
    // quarters of that of a sudden press.
    let slow = format!("{law}relaxation = [{{ fraction = 0.25, time = \"1 s\" }}]\n");
    let held = "values = [\"0.25 mm\", \"0.25 mm\"]";
    let missing = problem("missing.toml", &slow, held, "");
    refused_with(
        &["solve", &missing],
        &["durations", "give each step its time"],
    );
    let relaxing = problem(
        "relaxing.toml",
        &slow,
        held,
        "durations = [\"0 s\", \"100 s\"]\n\n",
    );
    let rows = rows(&relaxing);
    let force = rows[1]
        .as_object()
        .unwrap()
        .keys()
        .find(|key| key.contains("plate") && key.contains("force_y"))
        .unwrap_or_else(|| panic!("{rows}"))
        .clone();
    // Row 0 is the body at rest.
    let times = [0, 1, 2].map(|step: usize| number(&rows[step]["time_s"]));
    assert_eq!(times, [0.0, 0.0, 100.0]);
    let [sudden, last] = [1, 2].map(|step: usize| number(&rows[step][&force]));
    // A hundred times the relaxation time; the contact settles to its own tolerance.
    assert!((last / sudden - 0.75).abs() < 1e-3, "{sudden} {last}");
}

#[test]
fn a_stress_that_is_held_becomes_a_series() {
    let folder = Folder::new("material-relaxation");
    let (held, pull, law) = (
        folder.path("held.csv"),
        folder.path("pull.csv"),
        folder.path("law.toml"),
    );
    let mut text = String::from("# stretch = \"1.2\"\n# ramp = \"0.5 s\"\ntime [s],stress [kPa]\n");
    for n in 0..60 {
        let time = 0.5 * 1.15_f64.powi(n);
        // A ramp of half a second to a stress of which 0.2 relaxes in 4 s.
        let left = 4.0 / 0.5 * ((0.5_f64 / 4.0).exp() - 1.0) * (-time / 4.0_f64).exp();
        writeln!(text, "{time},{}", 50.0 * (0.8 + 0.2 * left)).unwrap();
    }
    fs::write(&held, &text).unwrap();
    let answer = json(&["material", "fit", &held]);
    let term = &answer["relaxation"]["terms"][0];
    // The search ends at the rounding of the misfit: its root.
    assert!((number(&term["fraction"]) - 0.2).abs() < 1e-5, "{answer}");
    assert!((number(&term["time_s"]) - 4.0).abs() < 1e-4, "{answer}");
    assert!(
        (number(&answer["relaxation"]["sudden"]) / 50e3 - 1.0).abs() < 1e-5,
        "{answer}"
    );
    refused_with(&["material", "fit", &held, "-o", &law], &["loading test"]);
    let unknown = folder.path("unknown.csv");
    fs::write(&unknown, text.replace("# ramp = \"0.5 s\"\n", "")).unwrap();
    assert!(done(&["material", "fit", &unknown]).contains("no sudden value"));
    // A slow pull of the same silicone: the law that is written is that of a sudden load.
    let mut text = String::from("strain [1],stress [kPa]\n");
    for n in 1..=30 {
        let l = 1.0 + f64::from(n) / 30.0;
        let error = 1.0 + 0.002 * f64::from((n * 7) % 5 - 2);
        writeln!(text, "{},{}", l - 1.0, 80.0 * (l - l.powi(-2)) * error).unwrap();
    }
    fs::write(&pull, text).unwrap();
    let page = folder.path("fit.html");
    done(&[
        "material", "fit", &pull, &held, "-o", &law, "--report", &page,
    ]);
    let page = fs::read_to_string(page).unwrap();
    // One figure each for data, residuals, Mooney's plot, other loadings, profile and relaxation.
    assert_eq!(page.matches("<figure>").count(), 6, "{page}");
    assert!(page.contains("What relaxes") && !page.contains("NaN"));
    let checked = json(&["material", "check", &law]);
    // The errors of the pull are at most 0.4 %.
    assert!(
        (number(&checked["shear_modulus_pa"]) / 100e3 - 1.0).abs() < 4e-3,
        "{checked}"
    );
    let written = fs::read_to_string(&law).unwrap();
    assert!(written.contains("[relaxation]"), "{written}");
}

/// A pull of 30 points to a strain of one, by a stress in kPa.
fn pulled(folder: &Folder, name: &str, head: &str, stress: impl Fn(f64) -> f64) -> String {
    let path = folder.path(name);
    let mut text = format!("{head}strain [1],stress [kPa]\n");
    for n in 1..=30 {
        let e = f64::from(n) / 30.0;
        writeln!(text, "{e},{}", stress(e)).unwrap();
    }
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn mistakes_of_tests_are_answered_with_their_remedy() {
    let folder = Folder::new("material-mistakes");
    let neo = |l: f64| 100.0 * (l - l.powi(-2));
    let raw = |name: &str, text: &str| {
        let path = folder.path(name);
        fs::write(&path, text).unwrap();
        path
    };
    let fit = |path: &str, more: &[&str], said: &[&str]| {
        refused_with(&[&["material", "fit", path], more].concat(), said);
    };
    fit(
        &raw("unit.csv", "strain [1],force\n0.1,2\n"),
        &[],
        &["write `force [N]`"],
    );
    fit(
        &raw("length.csv", "extension [mm],stress [kPa]\n1,2\n"),
        &[],
        &["gauge_length"],
    );
    fit(
        &raw("area.csv", "strain [1],force [N]\n1,2\n"),
        &[],
        &["# width"],
    );
    fit(
        &raw("percent.csv", "strain,stress [kPa]\n5,2\n"),
        &[],
        &["write `strain [1]` or `strain [%]`"],
    );
    fit(
        &raw("few.csv", "strain [1],stress [kPa]\n0.1,1\n0.2,2\n"),
        &[],
        &["a law needs 8"],
    );
    let falling = pulled(&folder, "falling.csv", "", |e| {
        10.0 + (e - 0.1).min(0.0) - 1.5 * e
    });
    fit(&falling, &[], &["--cycle"]);
    let negative = pulled(&folder, "negative.csv", "", |e| -neo(1.0 + e));
    fit(&negative, &[], &["--mode compression"]);
    fit(
        &negative,
        &["--mode", "stretch"],
        &["--mode is one of", "relaxation"],
    );
    let clean = pulled(&folder, "clean.csv", "", |e| neo(1.0 + e));
    fit(&clean, &["--slack", "0.8mm"], &["gauge_length"]);
    fit(&clean, &["--slack", "0.5"], &["outside 0 to 0.1"]);
    fit(&clean, &["--cycle", "7"], &["there are 1"]);
    fit(&clean, &["--law", "ogden9"], &["ogden3"]);
    // A tenth of the length of slack is none.
    let loose = pulled(
        &folder,
        "loose.csv",
        "",
        |e| neo(((1.0 + e) / 1.2).max(1.0)),
    );
    let output = taxel(&["material", "fit", &loose, "--slack", "fit"]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("check the gauge length"), "{said}");
    let late = "# stretch = \"1.2\"\ntime [s],stress [kPa]\n";
    let late = (20..60).fold(String::from(late), |mut text, n| {
        writeln!(text, "{n},{}", 50.0 + (-f64::from(n)).exp()).unwrap();
        text
    });
    fit(&raw("late.csv", &late), &[], &["later than a tenth"]);
    // A length of slack, of a gauge length that is given.
    let head = "# gauge_length = \"40 mm\"\n";
    let known = pulled(&folder, "known.csv", head, |e| {
        neo(((1.0 + e) / 1.02).max(1.0))
    });
    let answer = json(&["material", "fit", &known, "--slack", "0.8mm"]);
    let chosen = answer["chosen"].as_u64().unwrap() as usize;
    // The file has all digits of the law.
    assert!((number(&answer["candidates"][chosen]["shear_modulus_pa"]) / 100e3 - 1.0).abs() < 1e-9);
    // Left in, slack makes a pull look soft: of 2.5 % by 18 % (the acceptance test of slack), of 2 % by less.
    let answer = json(&["material", "fit", &known]);
    let chosen = answer["chosen"].as_u64().unwrap() as usize;
    let with = number(&answer["candidates"][chosen]["modulus_with_slack_pa"]);
    assert!((81e3..95e3).contains(&with), "{with}");
    // True and engineering columns that contradict each other in a row.
    let both = (1..=30).fold(
        String::from("strain [1],stress [kPa],true strain [1],true stress [kPa]\n"),
        |mut text, n| {
            let e = f64::from(n) / 30.0;
            let wrong = if n == 20 { 1.1 } else { 1.0 };
            let p = neo(1.0 + e);
            writeln!(text, "{e},{p},{},{}", e.ln_1p(), wrong * p * (1.0 + e)).unwrap();
            text
        },
    );
    let answer = done(&["material", "fit", &raw("both.csv", &both)]);
    assert!(
        answer.contains("true and engineering columns disagree on line 21; the engineering ones"),
        "{answer}"
    );
    // The same bytes again: a fit has no random start, and one thread.
    let again = || done(&["material", "fit", &known]);
    assert_eq!(again(), again());
}
