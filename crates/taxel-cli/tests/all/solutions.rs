//! Solutions of drawings that no table has: kept between runs, and made again where
//! what was kept is of no use.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const SENSOR: &str = include_str!("../../../taxel/sensors/liquid-metal-2x4.toml");

/// A folder of its own for one test.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_string_lossy().into_owned()
    }
}

/// A drawing that no table has, in the folder of a test.
fn drawing(folder: &Folder) -> String {
    let text = SENSOR.replace("roof = \"140 um\"", "roof = \"150 um\"");
    assert_ne!(text, SENSOR);
    let path = folder.path("mine.toml");
    fs::write(&path, text).unwrap();
    path
}

fn command(cache: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taxel"));
    command.env("TAXEL_CACHE", cache).args(arguments);
    command
}

#[track_caller]
fn done(cache: &str, arguments: &[&str]) -> (String, String) {
    ended(&command(cache, arguments).output().unwrap())
}

#[track_caller]
fn ended(output: &Output) -> (String, String) {
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

fn kept(cache: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(cache).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn a_solution_is_kept_and_mended() {
    let folder = Folder::new("solutions");
    let (sensor, cache) = (drawing(&folder), folder.path("a/cache"));
    let predict = ["predict", &sensor, "--load", "p=25 kPa"];
    let (first, _) = done(&cache, &predict);
    let [file] = &kept(&cache)[..] else {
        panic!("one file");
    };
    let text = fs::read(file).unwrap();
    let (again, notes) = done(&cache, &predict);
    assert_eq!(first, again);
    assert!(
        !notes.contains("was solved") && !notes.contains("damaged"),
        "{notes}"
    );

    let mut flipped = text.clone();
    *flipped.last_mut().unwrap() ^= 1;
    let half = text[..text.len() / 2].to_vec();
    for damaged in [flipped, half, Vec::new(), vec![0xff; 100]] {
        fs::write(file, damaged).unwrap();
        let (mended, notes) = done(&cache, &predict);
        assert_eq!(first, mended);
        assert!(notes.contains("is damaged"), "{notes}");
        assert_eq!(fs::read(file).unwrap(), text);
    }
}

#[test]
fn programs_that_solve_at_once_do_not_disturb_each_other() {
    let folder = Folder::new("solutions-at-once");
    let (sensor, cache) = (drawing(&folder), folder.path("cache"));
    let start = || {
        command(&cache, &["check", &sensor])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let runs = [start(), start(), start()];
    let outputs = runs.map(|run| ended(&run.wait_with_output().unwrap()).0);
    assert!(outputs[0].contains("solved, kept"), "{}", outputs[0]);
    assert!(outputs.iter().all(|output| *output == outputs[0]));
    assert_eq!(kept(&cache).len(), 1);
}

#[test]
fn a_place_that_cannot_be_written_is_no_error() {
    let folder = Folder::new("solutions-no-place");
    let sensor = drawing(&folder);
    // A file in the place of the folder: not even root can write below it.
    let (_, notes) = done(&sensor, &["check", &sensor]);
    assert!(notes.contains("cannot be kept"), "{notes}");
}

#[test]
fn twin_and_live_read_the_kept_solution() {
    let folder = Folder::new("solutions-live");
    let (sensor, cache) = (drawing(&folder), folder.path("cache"));
    done(&cache, &["check", &sensor]);
    let live = [
        "live",
        &sensor,
        "--headless",
        "--speed",
        "max",
        "--frames",
        "50",
    ];
    let (_, notes) = done(&cache, &live);
    assert!(!notes.contains("solving"), "{notes}");
}
