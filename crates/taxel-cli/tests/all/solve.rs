//! `taxel solve`: what it prints and writes, and what it refuses.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{done as answered, refused_with as refused, taxel};
use crate::python::python;
use serde_json::Value;
use taxel_bodies::problem::ProblemFile;

/// An empty folder for a test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("solve")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A shipped problem with one text replaced, and its mesh, as files of a user.
fn own(folder: &Path, name: &str, from: &str, to: &str) -> PathBuf {
    let shipped = ProblemFile::shipped_text(name).unwrap();
    assert!(shipped.contains(from), "{name} has no {from}");
    let mesh = ProblemFile::shipped_mesh(name).unwrap();
    fs::write(folder.join(format!("{name}.msh")), mesh).unwrap();
    let path = folder.join("problem.toml");
    fs::write(&path, shipped.replacen(from, to, 1)).unwrap();
    path
}

const FIRST_TWO: &str = "values = [\"0.25 mm\", \"0.5 mm\"]";
const ALL: &str =
    "values = [\"0.25 mm\", \"0.5 mm\", \"0.75 mm\", \"1 mm\", \"1.25 mm\", \"1.5 mm\"]";

/// Bytes behind the offset of an array of a file of VTK, found by its name: base64 with the number
/// of bytes first.
fn appended(file: &str, name: &str) -> Vec<u8> {
    let value = |letter: u8| match letter {
        b'A'..=b'Z' => letter - b'A',
        b'a'..=b'z' => letter - b'a' + 26,
        b'0'..=b'9' => letter - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let decode = |text: &str| -> Vec<u8> {
        let mut bytes = Vec::new();
        for four in text.as_bytes().chunks(4) {
            let bits = four
                .iter()
                .fold(0_u32, |bits, &letter| bits << 6 | u32::from(value(letter)));
            let letters = four.iter().position(|&letter| letter == b'=').unwrap_or(4);
            bytes.extend(&bits.to_be_bytes()[1..letters]);
        }
        bytes
    };
    let tag = &file[file.find(&format!("Name=\"{name}\"")).unwrap()..];
    let offset = tag.split("offset=\"").nth(1).unwrap();
    let offset: usize = offset.split('"').next().unwrap().parse().unwrap();
    let data = &file[file.find("\n_").unwrap() + 2 + offset..];
    let length = u64::from_le_bytes(decode(&data[..12])[..8].try_into().unwrap()) as usize;
    decode(&data[..(8 + length).div_ceil(3) * 4])[8..].to_vec()
}

fn reals(bytes: &[u8]) -> Vec<f64> {
    let numbers = bytes.chunks_exact(8);
    numbers
        .map(|number| f64::from_le_bytes(number.try_into().unwrap()))
        .collect()
}

#[test]
fn a_problem_of_a_user_is_solved_and_written_in_all_ways() {
    let folder = folder("all");
    let problem = own(&folder, "dome", ALL, FIRST_TWO);
    let (csv, svg, vtu) = (
        folder.join("t.csv"),
        folder.join("d.svg"),
        folder.join("vtu"),
    );
    let arguments = [
        "solve",
        text(&problem),
        "--format",
        "csv",
        "-o",
        text(&csv),
        "--plot",
        text(&svg),
        "--vtu",
        text(&vtu),
    ];
    answered(&arguments);
    let table = fs::read_to_string(&csv).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    // Rest and two steps.
    assert_eq!(lines.len(), 4, "{table}");
    assert!(
        lines[0].starts_with("step,travel [mm],plate_force_y [mN],"),
        "{table}"
    );
    assert!(lines[3].starts_with("2,0.5,"), "{table}");
    let picture = fs::read_to_string(&svg).unwrap();
    assert!(picture.starts_with("<svg") && picture.ends_with("</svg>\n"));
    // The scale bar of a section 5 mm wide, in a unit that goes into it.
    assert!(picture.contains(">1 mm</text>"), "{picture}");
    let list = fs::read_to_string(vtu.join("steps.pvd")).unwrap();
    for step in 0..3 {
        assert!(
            list.contains(&format!("file=\"step-{step}.vtu\"")),
            "{list}"
        );
    }
    // By our own reader: the last tip moves by the way of the plate.
    let last = fs::read_to_string(vtu.join("step-2.vtu")).unwrap();
    let points = reals(&appended(&last, "Points"));
    let moved = reals(&appended(&last, "displacement"));
    let stress = reals(&appended(&last, "cauchy_stress_pa"));
    assert_eq!(points.len(), moved.len());
    assert_eq!(stress.len(), 2 * points.len());
    let tip = (0..points.len() / 3).find(|&n| points[3 * n] == 0.0 && points[3 * n + 1] == 5e-3);
    let tip = moved[3 * tip.unwrap() + 1];
    assert!((tip + 0.5e-3).abs() < 1e-5, "{tip}");
    // Nothing is replaced unasked.
    refused(&arguments, &["the file exists", "--force"]);
    let Some(python) = python(&["meshio"]) else {
        return;
    };
    let check = "import sys, meshio, numpy as np
import xml.etree.ElementTree as tree
folder = sys.argv[1]
files = [d.get('file') for d in tree.parse(folder + '/steps.pvd').iter('DataSet')]
assert files == ['step-0.vtu', 'step-1.vtu', 'step-2.vtu'], files
for step, name in enumerate(files):
    mesh = meshio.read(folder + '/' + name)
    assert {c.type for c in mesh.cells} == {'triangle6'}, mesh.cells
    moved, stress = mesh.point_data['displacement'], mesh.point_data['cauchy_stress_pa']
    assert moved.shape == (len(mesh.points), 3) and stress.shape == (len(mesh.points), 6)
    tip = np.argmin(np.hypot(mesh.points[:, 0], mesh.points[:, 1] - 5e-3))
    assert abs(moved[tip, 1] + 0.25e-3 * step) < 1e-5, moved[tip]
    assert np.isfinite(stress).all()
print('good')";
    let output = Command::new(python)
        .args(["-c", check, text(&vtu)])
        .output()
        .unwrap();
    assert!(output.stdout.ends_with(b"good\n"), "{output:?}");
}

#[test]
fn a_solution_goes_on_where_it_was_stopped() {
    let folder = folder("stopped");
    // Many small parts take long.
    let problem = own(
        &folder,
        "dome",
        "[output]",
        "[solver]\nlargest_part = 0.02\nfirst_part = 0.02\n\n[output]",
    );
    let state = folder.join("state.json");
    let child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args([
            "solve",
            text(&problem),
            "--format",
            "json",
            "--save",
            text(&state),
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // As soon as the first step is saved.
    let start = Instant::now();
    while !state.exists() && start.elapsed() < Duration::from_mins(1) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let id = child.id().to_string();
    Command::new("kill").args(["-INT", &id]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("note: stopped in step"), "{message}");
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["complete"], false);
    let rows = answer["rows"].as_array().unwrap().len();
    assert!((2..7).contains(&rows), "{rows}");
    // The other options of the search are no part of the state, but of the problem.
    let other = own(&folder, "dome", "friction = 0", "friction = 0.1");
    refused(
        &["solve", text(&other), "--resume", text(&state)],
        &["another problem"],
    );
    own(
        &folder,
        "dome",
        "[output]",
        "[solver]\nlargest_part = 0.02\nfirst_part = 0.02\n\n[output]",
    );
    let arguments = [
        "solve",
        text(&problem),
        "--format",
        "json",
        "--resume",
        text(&state),
        "--save",
        text(&state),
    ];
    let output = taxel(&arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(message.contains("going on after step"), "{message}");
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["complete"], true);
    assert_eq!(answer["rows"].as_array().unwrap().len(), 7);
}

/// A tube that slips while it is rolled over a plate: pressures at points do not go on there, and
/// its equilibrium ends.
#[test]
fn contacts_that_go_to_corners_and_bodies_that_jump_are_told() {
    let folder = folder("tube");
    let bodies = Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel-bodies/tests/bodies");
    fs::copy(bodies.join("tube.msh"), folder.join("tube.msh")).unwrap();
    let tube = fs::read_to_string(bodies.join("tube.toml")).unwrap();
    let solved = |friction: &str, multipliers: &str| {
        let text = tube.replacen("friction = 0.4", &format!("friction = {friction}"), 1);
        let path = folder.join("tube.toml");
        fs::write(
            &path,
            format!("{text}\n[solver]\nmultipliers = \"{multipliers}\"\n"),
        )
        .unwrap();
        let output = taxel(&["solve", self::text(&path)]);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{message}");
        message
    };
    let corners = "note: step 5: pressures of contacts at single points did not go on";
    let message = solved("0.6", "automatic");
    assert_eq!(message.matches(corners).count(), 1, "{message}");
    let jumped = "note: step 5: the body lost its equilibrium and jumped to another one, once; farthest by 0.4";
    assert_eq!(message.matches(jumped).count(), 1, "{message}");
    // Whoever chooses corners is not told that they were.
    let message = solved("0.6", "corners");
    assert!(!message.contains(corners), "{message}");
    // How much work it was.
    let line = message
        .lines()
        .find(|line| line.contains(" parts of steps, "))
        .unwrap();
    let numbers: Vec<f64> = line
        .split(|c: char| !c.is_ascii_digit() && c != '.')
        .filter_map(|word| word.parse().ok())
        .collect();
    let [parts, mean, most] = numbers[..] else {
        panic!("{line}");
    };
    assert!(parts >= 6.0 && mean >= 1.0 && most >= mean, "{line}");
}

#[test]
fn wrong_input_is_refused_before_anything_is_solved() {
    let folder = folder("wrong");
    let problem = own(
        &folder,
        "dome",
        "file = \"dome.msh\"",
        "file = \"none.msh\"",
    );
    refused(
        &["solve", text(&problem)],
        &[
            "problem.toml:9:8: mesh.file",
            "^^^^^^^^^^",
            "none.msh: cannot be read",
            "folder",
        ],
    );
    let problem = own(&folder, "dome", "on = \"axis\"", "on = \"axle\"");
    refused(
        &["solve", text(&problem)],
        &[
            "problem.toml:26:6: support.1.on",
            "^^^^^^",
            "\"axle\"",
            "help: give one of",
        ],
    );
    fs::write(
        folder.join("dome.msh"),
        "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n",
    )
    .unwrap();
    refused(
        &["solve", text(&problem)],
        &["dome.msh", "line 2", "version 4.0"],
    );
    // A single name in place of a list, and a unit that is not known.
    let problem = own(&folder, "dome", "held = [\"x\"]", "held = \"x\"");
    refused(
        &["solve", text(&problem)],
        &[
            "problem.toml:27:8: support.1.held",
            "\"x\" is no list",
            "help: write it in brackets: [\"x\"]",
        ],
    );
    let problem = own(&folder, "dome", "\"1.5 mm\"", "\"1.5 furlong\"");
    refused(
        &["solve", text(&problem)],
        &["\"furlong\" is no known unit", "a length: nm, um, mm"],
    );
    refused(&["solve", "no-such"], &["dome, channel, fingertip"]);
    refused(&["solve", "dome", "--plot", "a.html"], &[".svg"]);
    let mesh = folder.join("dome.msh");
    refused(&["solve", "dome", "--vtu", text(&mesh)], &["is a file"]);
    let state = folder.join("state.json");
    fs::write(&state, "{}").unwrap();
    refused(
        &["solve", "dome", "--resume", text(&state)],
        &["state.json", "no saved state"],
    );
    let printed = answered(&["solve", "dome", "--check"]);
    assert!(
        printed.contains("6 steps") && printed.contains("plate_force_y"),
        "{printed}"
    );
}

#[test]
fn a_failure_ends_with_its_cause_and_keeps_what_is_done() {
    let folder = folder("failure");
    let values = "\"10 kPa\", \"20 kPa\", \"30 kPa\", \"40 kPa\", \"50 kPa\"";
    let problem = own(&folder, "channel", values, "\"5 kPa\", \"10 MPa\"");
    let output = taxel(&["solve", text(&problem), "--format", "csv"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    for part in ["error: step 2: ", "% of the step was solved", "help: "] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
}

/// The guide shows the shipped dome, the example over the library, and what both print.
#[test]
fn the_guide_has_the_problem_and_the_program_as_they_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(root.join("docs/book/own-body.md")).unwrap();
    let problem = ProblemFile::shipped_text("dome").unwrap();
    assert!(page.contains(&format!("```toml\n{problem}```\n")));
    let example = root.join("crates/taxel-fem/examples/own_body.rs");
    let example = fs::read_to_string(example).unwrap();
    assert!(page.contains(&format!("```rust\n{example}```\n")));
    let answer = answered(&["solve", "dome", "--format", "json"]);
    let answer: Value = serde_json::from_str(&answer).unwrap();
    let start = page.find("step  travel [mm]").expect("the table is there");
    let lines = page[start..].lines().skip(1);
    let rows = answer["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 7);
    for (row, line) in rows.iter().zip(lines) {
        let shown: Vec<f64> = line
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect();
        let keys = [
            ("travel_m", 1e3),
            ("plate_force_y_n", 1e3),
            ("plate_contact_area_m2", 1e6),
            ("capacitance_upper_electrode_lower_electrode_f", 1e15),
            ("greatest_von_mises_pa", 1e-3),
        ];
        for ((key, unit), shown) in keys.into_iter().zip(&shown[1..]) {
            let value = unit * row[key].as_f64().unwrap();
            // Five decimals are shown; other processors round otherwise, within the tolerance.
            assert!(
                (value - shown).abs() < 1e-5 + 1e-5 * value.abs(),
                "{key}: {value} {line}"
            );
        }
    }
}
