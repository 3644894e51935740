//! Nothing is silent for long: a command that is still at work after a second has said what it does.

use std::fs;
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use crate::common::Folder;
use taxel::sensor::Sensor;

/// The first word comes after 0.8 s; the rest is for a machine that does other work meanwhile.
const FIRST_WORD: Duration = Duration::from_secs(4);

/// Runs a command until it says something or ends; what it said on the standard error.
fn first_word(arguments: &[&str], cache: &str) -> String {
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_taxel"))
        .args(arguments)
        .env("TAXEL_CACHE", cache)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut errors = child.stderr.take().unwrap();
    let (said, heard) = mpsc::channel();
    std::thread::spawn(move || {
        let mut word = [0; 200];
        let read = errors.read(&mut word).unwrap_or(0);
        // The test may have given up.
        let _ = said.send(String::from_utf8_lossy(&word[..read]).into_owned());
    });
    let word = heard.recv_timeout(FIRST_WORD);
    let elapsed = start.elapsed();
    child.kill().unwrap();
    child.wait().unwrap();
    let word = word.unwrap_or_else(|_| panic!("{arguments:?}: silent for {elapsed:?}"));
    println!("{:.2} s, {}: {word}", elapsed.as_secs_f64(), arguments[0]);
    word
}

#[test]
fn what_takes_longer_than_a_second_says_so() {
    let folder = Folder::new("waits");
    let cache = folder.path("cache");
    let file = |name: &str, text: &str| {
        let path = folder.path(name);
        fs::write(&path, text).unwrap();
        path
    };
    let altered = |sensor: &str, name: &str, changes: &[[&str; 2]]| {
        let mut text = Sensor::shipped_text(sensor).unwrap().to_owned();
        for [from, to] in changes {
            assert!(text.contains(from), "{sensor}: {from}");
            text = text.replacen(from, to, 1);
        }
        file(name, &text)
    };
    let thin = altered(
        "piezo-2.3mm",
        "thin.toml",
        &[["thickness = \"2.3 mm\"", "thickness = \"0.3 mm\""]],
    );
    let soft = altered(
        "in-plane-50um",
        "soft.toml",
        &[
            ["thickness = \"950 um\"", "thickness = \"1.1 mm\""],
            [
                "youngs_modulus = \"1.2 MPa\"",
                "youngs_modulus = \"60 kPa\"",
            ],
        ],
    );
    // As much text of numbers as is looked at.
    let capture = file("capture.txt", &"512 977\n513 89\n".repeat(300_000));
    let output = |name: &str| folder.path(name);
    let forever = ["--headless", "--speed", "max", "--frames", "100000000"];
    for (arguments, what) in [
        (
            vec!["live", &thin, "--headless", "--frames", "10"],
            "profiles of the cover: ",
        ),
        (vec!["check", &soft], ": "),
        (
            vec!["tabulate", "liquid-metal-2x4", "-o", &output("table.csv")],
            "solving the load path: ",
        ),
        (
            [&["live", "three-axis-8x8"][..], &forever].concat(),
            "playing the frames: ",
        ),
        (vec!["listen", &capture], ": "),
    ] {
        let word = first_word(&arguments, &cache);
        assert!(word.contains(what), "{arguments:?}: {word:?}");
    }
}
