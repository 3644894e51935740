//! The commands of studies at the border of the process: stores, parts, signals, messages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::{Folder, done, refused, taxel};

/// A study of 24 x 12 designs.
const STUDY: &str = r#"
schema = 2
name = "store"
sensor = "in-plane-50um"
[set]
"element.in_plane_capacitor.layer.end_condition" = "free"
"element.in_plane_capacitor.electrodes.stiffness" = "as_layer"
"electronics.readout.charge_amplifier.feedback" = "4 pF"
[variables.gap]
key = "element.in_plane_capacitor.electrodes.gap"
range = ["20 um", "100 um"]
points = 24
[variables.thickness]
key = "element.in_plane_capacitor.layer.thickness"
range = ["300 um", "870 um"]
points = 12
[links]
"element.in_plane_capacitor.electrodes.height" = "thickness - 200 um"
[answers.resolution]
of = "estimate"
quantity = "deviation"
load = "fz=5 N"
[answers.range]
of = "predict"
quantity = "force_z"
load = "e=0.3"
[objectives]
minimise = ["resolution"]
"#;

fn study(folder: &Folder) -> String {
    let path = folder.path("study.toml");
    fs::write(&path, STUDY).unwrap();
    path
}

fn blocks(store: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for inner in fs::read_dir(store).unwrap() {
        let inner = inner.unwrap().path();
        if inner.is_dir() {
            found.extend(
                fs::read_dir(inner)
                    .unwrap()
                    .map(|entry| entry.unwrap().path()),
            );
        }
    }
    found.retain(|path| path.extension().is_some_and(|ending| ending == "json"));
    found.sort();
    found
}

#[test]
fn parts_in_any_order_merge_to_the_bytes_of_one_machine() {
    let folder = Folder::new("parts");
    let (study, store) = (study(&folder), folder.path("store"));
    let whole = done(&["sweep", &study]);
    // A third of the designs is refused: the deviation of the gap stays that of 50 um.
    assert!(whole.contains("refused") && whole.lines().count() == 289);
    for part in [3, 0, 6, 1, 5, 1] {
        done(&[
            "sweep",
            &study,
            "--store",
            &store,
            "--shard",
            &format!("{part}/7"),
        ]);
    }
    let status = taxel(&["sweep", &study, "--store", &store, "--status"]);
    assert_eq!(status.status.code(), Some(3));
    assert!(
        !String::from_utf8(status.stdout)
            .unwrap()
            .contains("missing 0\n")
    );
    let merged = taxel(&["sweep", &study, "--store", &store, "--merge"]);
    assert_eq!(merged.status.code(), Some(3));
    assert!(merged.stdout.len() < whole.len());
    for part in [2, 4] {
        done(&[
            "sweep",
            &study,
            "--store",
            &store,
            "--shard",
            &format!("{part}/7"),
        ]);
    }
    assert!(done(&["sweep", &study, "--store", &store, "--status"]).contains("missing 0\n"));
    assert_eq!(
        done(&["sweep", &study, "--store", &store, "--merge"]),
        whole
    );
    // A finer grid that shares designs finds them: nothing of the old ones is computed.
    let before = blocks(&store).len();
    done(&["sweep", &study, "--store", &store]);
    assert_eq!(blocks(&store).len(), before);
}

#[test]
fn damaged_blocks_are_computed_again() {
    let folder = Folder::new("damaged");
    let (study, store) = (study(&folder), folder.path("store"));
    let whole = done(&["sweep", &study, "--store", &store]);
    let blocks = blocks(&store);
    let mut bytes = fs::read(&blocks[0]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&blocks[0], &bytes).unwrap();
    let bytes = fs::read(&blocks[1]).unwrap();
    fs::write(&blocks[1], &bytes[..bytes.len() / 3]).unwrap();
    let again = taxel(&["sweep", &study, "--store", &store]);
    assert_eq!(again.status.code(), Some(0));
    assert!(
        String::from_utf8(again.stderr)
            .unwrap()
            .contains("2 damaged blocks")
    );
    assert_eq!(String::from_utf8(again.stdout).unwrap(), whole);
}

/// Starts a part and ends it with a signal after a while.
fn ended(study: &str, store: &str, signal: &str, wait: Duration) -> Option<i32> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(["sweep", study, "--store", store, "--shard", "0/1"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(wait);
    let id = child.id().to_string();
    let _ = Command::new("kill").args([signal, &id]).status();
    child.wait().unwrap().code()
}

/// Ends a run `times` times at moments that a generator chooses, then merges.
fn killed(times: u64) {
    let folder = Folder::new(&format!("killed-{times}"));
    let (study, store) = (study(&folder), folder.path("store"));
    let whole = done(&["sweep", &study]);
    let mut state = 7u64;
    for round in 0..times {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        let wait = Duration::from_millis((state >> 33) % 150);
        let signal = if round % 2 == 0 { "-KILL" } else { "-TERM" };
        let code = ended(&study, &store, signal, wait);
        // Killed, ended with losses, at once before it listened, or done before.
        assert!(matches!(code, None | Some(0 | 3)), "{code:?}");
    }
    assert_eq!(done(&["sweep", &study, "--store", &store]), whole);
    assert_eq!(
        done(&["sweep", &study, "--store", &store, "--merge"]),
        whole
    );
}

#[test]
fn runs_that_are_killed_go_on() {
    killed(8);
}

#[test]
#[ignore = "a minute: cargo test -p taxel-cli --test all studies:: -- --ignored"]
fn runs_that_are_killed_two_hundred_times_go_on() {
    killed(200);
}

#[test]
fn devices_of_a_tolerance_analysis_that_is_ended_are_kept() {
    let folder = Folder::new("tolerance-store");
    let (study, store) = (folder.path("study.toml"), folder.path("store"));
    let text = taxel_study::shipped_text("p2-after").unwrap();
    fs::write(&study, text.replace("samples = 4096", "samples = 512")).unwrap();
    let whole = done(&["tolerance", &study]);
    let kept = ["tolerance", &study, "--store", &store];
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(kept)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // As soon as a block is there.
    let blocks = || {
        let all = fs::read_dir(&store).into_iter().flatten().flatten();
        all.filter(|entry| entry.path().is_dir()).count()
    };
    while blocks() == 0 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let id = child.id().to_string();
    Command::new("kill").args(["-TERM", &id]).status().unwrap();
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(3), "{told}");
    assert!(told.contains("goes on from there"), "{told}");
    // What is there is not made again, and the end is the same.
    let before = blocks();
    assert!(before > 0);
    assert_eq!(done(&kept), whole);
    let after = blocks();
    assert_eq!(done(&kept), whole);
    assert_eq!(blocks(), after);
    // Devices after another correction are other ones.
    done(&[&kept[..], &["--after", "as_drawn"]].concat());
    assert!(blocks() > after);
}

/// An optimiser that is killed again and again, at other times of its way, ends with the bytes of an
/// undisturbed one.
fn replayed(kills: u64) {
    let folder = Folder::new(&format!("replay-{kills}"));
    let (study, store) = (study(&folder), folder.path("store"));
    let text = format!("{STUDY}[optimize]\nevaluations = 400\npopulation = 20\n");
    fs::write(&study, text).unwrap();
    let undisturbed = done(&["optimize", &study]);
    for kill in 0..kills {
        let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
            .args(["optimize", &study, "--store", &store])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(60 + 67 * kill % 150));
        let _ = child.kill();
        child.wait().unwrap();
    }
    assert_eq!(
        done(&["optimize", &study, "--store", &store]),
        undisturbed,
        "{} blocks",
        blocks(&store).len()
    );
}

#[test]
fn an_optimiser_goes_on_by_replay() {
    replayed(3);
}

#[test]
#[ignore = "seconds: cargo test -p taxel-cli --test all -- --ignored by_replay"]
fn an_optimiser_killed_ten_times_goes_on_by_replay() {
    replayed(10);
}

/// Output of a part whose number comes from the environment.
fn with(
    variables: &[(&str, &str)],
    study: &str,
    store: &str,
    more: &[&str],
) -> (Option<i32>, String) {
    let names = [
        "SLURM_ARRAY_TASK_ID",
        "SLURM_ARRAY_TASK_COUNT",
        "SLURM_ARRAY_TASK_MIN",
        "JOB_COMPLETION_INDEX",
        "PBS_ARRAY_INDEX",
    ];
    let mut command = Command::new(env!("CARGO_BIN_EXE_taxel"));
    for name in names {
        command.env_remove(name);
    }
    let output = command
        .args([&["sweep", study, "--store", store, "--shard", "auto"], more].concat())
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    (
        output.status.code(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

#[test]
fn array_jobs_say_their_part() {
    let folder = Folder::new("array");
    let study = study(&folder);
    let whole = done(&["sweep", &study]);
    let slurm = folder.path("slurm");
    for task in 1..=3 {
        let task = task.to_string();
        let variables = [
            ("SLURM_ARRAY_TASK_ID", task.as_str()),
            ("SLURM_ARRAY_TASK_COUNT", "3"),
            ("SLURM_ARRAY_TASK_MIN", "1"),
        ];
        assert_eq!(with(&variables, &study, &slurm, &[]).0, Some(0));
    }
    assert_eq!(
        done(&["sweep", &study, "--store", &slurm, "--merge"]),
        whole
    );
    let kubernetes = folder.path("kubernetes");
    for index in ["0", "1"] {
        assert_eq!(
            with(
                &[("JOB_COMPLETION_INDEX", index)],
                &study,
                &kubernetes,
                &["--shards", "2"]
            )
            .0,
            Some(0)
        );
    }
    assert_eq!(
        done(&["sweep", &study, "--store", &kubernetes, "--merge"]),
        whole
    );
    let (code, message) = with(&[], &study, &folder.path("none"), &[]);
    assert!(
        code == Some(2) && message.contains("no array job"),
        "{message}"
    );
    let (code, message) = with(
        &[("PBS_ARRAY_INDEX", "1")],
        &study,
        &folder.path("none"),
        &[],
    );
    assert!(
        code == Some(2) && message.contains("--shards N"),
        "{message}"
    );
    assert!(!Path::new(&folder.path("none")).join("ab").exists());
}

#[test]
fn the_script_for_one_machine_runs_and_merges() {
    let folder = Folder::new("parallel");
    let study = study(&folder);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cluster/parallel.sh");
    let (store, output) = (folder.path("store"), folder.path("all.csv"));
    let status = Command::new(script)
        .args([&study, &store, "5", &output])
        .env("TAXEL", env!("CARGO_BIN_EXE_taxel"))
        .status()
        .unwrap();
    assert!(status.success());
    assert_eq!(
        fs::read_to_string(output).unwrap(),
        done(&["sweep", &study])
    );
}

#[test]
fn mistakes_are_told_with_exit_code_2_and_nothing_is_written() {
    let folder = Folder::new("mistakes");
    let study = study(&folder);
    let csv = folder.path("out.csv");
    for (from, to, part) in [
        (
            "thickness - 200 um",
            "thickness - 200 kPa",
            "this is a stress; a length is needed here",
        ),
        ("electrodes.gap\"", "electrodes.gip\"", "unknown field"),
        (
            "minimise = [\"resolution\"]",
            "minimise = [\"rang\"]",
            "\"rang\" is no name here",
        ),
        (
            "sensor = \"in-plane-50um\"",
            "sensor = \"nowhere\"",
            "shipped sensor",
        ),
    ] {
        fs::write(&study, STUDY.replacen(from, to, 1)).unwrap();
        for command in ["sweep", "optimize"] {
            let message = refused(&[command, &study, "-o", &csv]);
            assert!(
                message.contains(part) && !Path::new(&csv).exists(),
                "{message}"
            );
        }
    }
    fs::write(&study, STUDY).unwrap();
    assert!(refused(&["tolerance", &study]).contains("no variable of the study has a spread"));
    assert!(refused(&["sweep", "no-such"]).contains("p1-resolution"));
    assert!(refused(&["sweep", &study, "--store", &csv, "--shard", "7/7"]).contains("not below 7"));
    fs::write(folder.path("mine.txt"), "mine").unwrap();
    let occupied = Path::new(&csv)
        .parent()
        .unwrap()
        .to_string_lossy()
        .into_owned();
    assert!(refused(&["sweep", &study, "--store", &occupied]).contains("no store"));
}

#[test]
fn figures_and_the_best_sensor_file_are_written() {
    let folder = Folder::new("figures");
    let study = study(&folder);
    let text = format!("{STUDY}[optimize]\nevaluations = 200\npopulation = 20\n");
    fs::write(&study, text).unwrap();
    let (svg, html, best) = (
        folder.path("a.svg"),
        folder.path("a.html"),
        folder.path("best.toml"),
    );
    done(&["sweep", &study, "--plot", &svg]);
    let output = taxel(&[
        "optimize", &study, "--plot", &html, "--best", &best, "--format", "json", "--check", "50",
    ]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(fs::read_to_string(&svg).unwrap().starts_with("<svg"));
    assert!(fs::read_to_string(&html).unwrap().contains("<pre>"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let row = &json["rows"][0];
    // The sensor file repeats the numbers of the table.
    let answer = done(&["predict", &best, "--load", "e=0.3", "--format", "json"]);
    let predicted: serde_json::Value = serde_json::from_str(&answer).unwrap();
    assert_eq!(predicted["rows"][0]["force_z_n"], row["range_n"]);
    assert!(json["study_hash"].as_str().unwrap().len() == 64);
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(
        notes.contains("note: the best of") && notes.contains("0 of them are better"),
        "{notes}"
    );
}

/// A study and the files that it names can be moved together, and run from anywhere.
#[test]
fn names_in_a_study_count_from_its_folder() {
    let folder = Folder::new("beside");
    let sensor = Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel/sensors/in-plane-50um.toml");
    fs::copy(sensor, folder.path("mine.toml")).unwrap();
    fs::write(
        folder.path("points.csv"),
        "gap [um],thickness [um]\n50,800\n60,800\n",
    )
    .unwrap();
    let path = folder.path("study.toml");
    let text = STUDY.replace("\"in-plane-50um\"", "\"mine.toml\"");
    fs::write(&path, text + "[sweep]\nplan = \"points.csv\"\n").unwrap();
    let rows = done(&["sweep", &path, "--format", "csv"]);
    assert_eq!(rows.lines().count(), 3, "{rows}");
    fs::remove_file(folder.path("mine.toml")).unwrap();
    let message = refused(&["sweep", &path]);
    assert!(message.contains(&folder.path("mine.toml")), "{message}");
}
