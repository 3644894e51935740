//! The commands that solve: what they print and write, and what they refuse.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{done as answered, refused_with as refused};
use serde_json::Value;
use taxel::sensor::Sensor;

/// An empty folder for a test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("solver")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_case_of_verification_is_printed_and_written() {
    let folder = folder("verify");
    let (json, html) = (folder.join("a.json"), folder.join("a.html"));
    let printed = answered(&["verify", "A", "--short", "-o", text(&json)]);
    assert!(printed.starts_with("A Homogeneous states"), "{printed}");
    assert!(!printed.contains("  NO "), "{printed}");
    let report: Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(report["complete"], true);
    assert_eq!(report["holds"], true);
    for key in ["version", "commit"] {
        assert!(report[key].is_string(), "{key}");
    }
    let case = &report["cases"][0];
    assert_eq!(case["id"], "A");
    assert_eq!(case["kind"], "exact");
    assert!(case["time_s"].is_number());
    let row = &case["quantities"][0];
    for key in ["outside", "ours", "difference", "tolerance"] {
        assert!(row[key].is_number(), "{key}: {row}");
    }
    for key in ["what", "unit", "tolerance_is"] {
        assert!(row[key].is_string(), "{key}: {row}");
    }
    assert_eq!(row["holds"], true);
    answered(&["verify", "a", "--short", "-o", text(&html)]);
    let page = fs::read_to_string(html).unwrap();
    assert!(page.contains("1 of 1 cases are within tolerance") && page.ends_with("</html>\n"));
    // The standard output has the report and nothing else.
    let printed = answered(&["verify", "A", "--short", "-o", "-"]);
    let report: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(report["cases"].as_array().unwrap().len(), 1);
}

#[test]
fn an_unknown_case_is_answered_with_those_there_are() {
    let folder = folder("unknown-case");
    let report = folder.join("report.html");
    let arguments = ["verify", "A", "Z9", "--short", "-o", text(&report)];
    refused(&arguments, &["\"Z9\"", "A, B1, B2", "D7"]);
    assert!(!report.exists());
    refused(&["verify", "A", "-o", "report.txt"], &[".html or .json"]);
}

#[test]
fn a_device_without_finite_elements_says_so() {
    let load = ["--mechanics", "fem", "--load", "fz=1 mN"];
    for (sensor, sentence) in [
        ("three-axis-8x8", "suspension.stiffness is typed in"),
        (
            "piezo-1.5mm",
            "this kind of device has no mechanics by finite elements",
        ),
    ] {
        let arguments = [&["predict", sensor], &load[..]].concat();
        refused(&arguments, &[sentence, "--mechanics closed-form"]);
    }
}

/// A stiffness from the drawing is solved; the answer is near that of the table.
#[test]
fn a_unit_of_the_drawing_is_solved() {
    let folder = folder("unit");
    let shipped = Sensor::shipped_text("three-axis-8x8").unwrap();
    let typed_in = ["stiffness", "tile_tilt", "bump_sinking"];
    let lines = shipped
        .lines()
        .filter(|line| !typed_in.iter().any(|key| line.starts_with(key)));
    let outline = "[element.three_axis_capacitor.outline]";
    let table = format!(
        "[element.three_axis_capacitor.suspension.from_drawing]\nmodulus = \"2.6 MPa\"\n\
         side_contact = \"top\"\ncavity = \"vented\"\n\n{outline}"
    );
    let drawn = lines
        .collect::<Vec<_>>()
        .join("\n")
        .replace(outline, &table);
    let path = folder.join("drawn.toml");
    fs::write(&path, drawn).unwrap();
    let closing = |mechanics: &str, files: &[&str]| {
        let load = [
            "--load",
            "fx=2 mN, fz=10 mN",
            "--mechanics",
            mechanics,
            "--format",
            "json",
        ];
        let answer = answered(&[&["predict", text(&path)], &load[..], files].concat());
        let answer: Value = serde_json::from_str(&answer).unwrap();
        answer["rows"][0]["displacement_z_m"].as_f64().unwrap()
    };
    let (bodies, plot) = (folder.join("bodies"), folder.join("plot.svg"));
    let files = ["--vtu", text(&bodies), "--plot", text(&plot)];
    let (table, solved) = (closing("closed-form", &[]), closing("fem", &files));
    let picture = fs::read_to_string(&plot).unwrap();
    for (file, load) in [("unit-normal-1", "fz = 10"), ("unit-side-2", "fx = 2")] {
        assert!(bodies.join(file).with_extension("vtu").exists(), "{file}");
        assert!(picture.contains(&format!("Deformed body ({load}.0000 mN)")));
    }
    // Half of the error that both state.
    assert!((solved / table - 1.0).abs() < 0.02, "{solved} {table}");
    assert!(solved.to_bits() != table.to_bits());
}

#[test]
fn no_load_needs_no_solution() {
    let load = [
        "--mechanics",
        "fem",
        "--load",
        "p=0 kPa",
        "--format",
        "json",
    ];
    let arguments = [&["predict", "liquid-metal-2x4"], &load[..]].concat();
    let answer: Value = serde_json::from_str(&answered(&arguments)).unwrap();
    assert_eq!(answer["rows"].as_array().map(Vec::len), Some(1), "{answer}");
}

#[test]
fn a_sensor_file_names_its_mechanics() {
    let folder = folder("mechanics");
    let path = folder.join("sensor.toml");
    let with = |name: &str, mechanics: &str| {
        // Before the first table: a key of the whole file.
        let shipped = Sensor::shipped_text(name).unwrap();
        let line = format!("schema = 2\nmechanics = \"{mechanics}\"");
        fs::write(&path, shipped.replacen("schema = 2", &line, 1)).unwrap();
    };
    with("liquid-metal-2x4", "fem");
    answered(&["check", text(&path)]);
    // It is what answers, as long as the command line says nothing else.
    with("three-axis-8x8", "fem");
    let arguments = ["predict", text(&path), "--load", "fz=1 mN"];
    refused(&arguments, &["suspension.stiffness is typed in"]);
    answered(&[&arguments[..], &["--mechanics", "closed-form"]].concat());
    with("liquid-metal-2x4", "magic");
    let parts = ["mechanics", "magic", "closed_form", "fem"];
    refused(&["check", text(&path)], &parts);
}

#[test]
fn a_study_over_a_condition_gives_a_table_and_maps() {
    let folder = folder("sweep");
    let (csv, svg) = (folder.join("four.csv"), folder.join("four.svg"));
    let path = folder.join("study.toml");
    let shipped = taxel_study::shipped_text("p4-sections").unwrap();
    // Two heights, two covers, two pressures.
    let pressures = shipped.split_once("values = [").unwrap().1;
    let pressures = pressures.split_once(']').unwrap().0;
    let small = shipped
        .replace("points = 10", "points = 2")
        .replace(pressures, "\"5 kPa\", \"10 kPa\"");
    fs::write(&path, small).unwrap();
    let output = ["-o", text(&csv), "--plot", text(&svg)];
    answered(&[&["sweep", text(&path)], &output[..]].concat());
    let table = fs::read_to_string(csv).unwrap();
    let rows: Vec<&str> = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert_eq!(rows.len(), 1 + 8, "{table}");
    for column in ["height", "cover", "pressure", "area_ratio", "state"] {
        assert!(rows[0].contains(column), "{column}: {table}");
    }
    assert!(rows[1].contains("open"), "{table}");
    let map = fs::read_to_string(svg).unwrap();
    assert!(map.starts_with("<svg") && map.trim_end().ends_with("</svg>"));
    // A small map of every answer at each pressure.
    assert_eq!(map.matches("class=\"frame\"").count(), 8 * 2);
    for word in ["NaN", "inf"] {
        assert!(!map.contains(word) && !table.contains(word), "{word}");
    }
}

#[test]
fn an_unknown_study_is_answered_with_the_shipped_ones() {
    refused(
        &["sweep", "no-such-study"],
        &["no-such-study", "a shipped study: p1-resolution"],
    );
}

#[test]
fn solved_bodies_are_written_for_paraview_and_drawn() {
    let folder = folder("bodies");
    let (bodies, plot) = (folder.join("new/bodies"), folder.join("plot.svg"));
    let load = ["predict", "in-plane-50um", "--load", "e=0.02"];
    let vtu = ["--vtu", text(&bodies)];
    // Without finite elements there is no body.
    refused(&[&load[..], &vtu].concat(), &["--mechanics fem"]);
    fs::create_dir_all(folder.join("new")).unwrap();
    let fem = [&load[..], &["--mechanics", "fem"], &vtu].concat();
    answered(&[&fem[..], &["--plot", text(&plot)]].concat());
    let grid = fs::read_to_string(bodies.join("section.vtu")).unwrap();
    for field in ["displacement", "von_mises_pa", "mean_stress_pa"] {
        assert!(grid.contains(&format!("Name=\"{field}\"")), "{field}");
    }
    let picture = fs::read_to_string(&plot).unwrap();
    assert!(picture.contains("Deformed body (compressed by 0.0200"));
    refused(&fem, &["section.vtu", "--force"]);
}

#[test]
fn a_folder_with_grids_is_refused_before_anything_is_solved() {
    let folder = folder("grids");
    fs::write(folder.join("other.vtu"), "of another run").unwrap();
    // Half a minute of solving, which this test does not wait for.
    let load = ["predict", "liquid-metal-2x4", "--load", "p=25 kPa"];
    let fem = ["--mechanics", "fem", "--vtu", text(&folder)];
    refused(&[&load[..], &fem].concat(), &["other.vtu", "--force"]);
}

#[test]
fn what_finite_elements_do_not_solve_is_wrong_input() {
    let folder = folder("no_body");
    let refused = |name: &str, from: &str, to: &str, load: &str, parts: &[&str]| {
        let drawn = Sensor::shipped_text(name).unwrap();
        assert!(drawn.contains(from), "{from}");
        let path = folder.join(format!("{name}.toml"));
        fs::write(&path, drawn.replace(from, to)).unwrap();
        let asked = ["predict", text(&path), "--mechanics", "fem", "--load", load];
        refused(&asked, parts);
    };
    let (ends, given) = ("\"short_layer\"", "{ given = { chi = 0.9 } }");
    refused(
        "in-plane-50um",
        ends,
        given,
        "e=0.02",
        &["given", "short_layer"],
    );
    let liquid = "[element.microchannel.liquid.pressure.paper]\nexpansion = 0.2\n\
                  atmosphere = \"101.325 kPa\"";
    let (sealed, parts) = ("pressure = \"sealed\"", ["sealed liquid", "patch_x"]);
    refused("liquid-metal-2x4", liquid, sealed, "p=10 kPa", &parts);
}
