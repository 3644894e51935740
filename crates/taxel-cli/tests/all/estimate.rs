//! `taxel estimate` at the boundary of the program: the same numbers as `taxel live`.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::common::{Folder, done, refused};

/// A table as its columns by name.
fn columns(text: &str) -> HashMap<String, Vec<String>> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: HashMap<String, Vec<String>> = HashMap::new();
    for line in lines {
        assert_eq!(line.split(',').count(), names.len(), "{line}");
        for (name, cell) in names.iter().zip(line.split(',')) {
            let column = columns.entry((*name).to_owned()).or_default();
            column.push(cell.to_owned());
        }
    }
    columns
}

/// Every device that has a twin: what is live is what is estimated later, digit for digit.
#[test]
fn the_table_has_the_numbers_of_live_for_every_device() {
    let folder = Folder::new("estimate-devices");
    for (sensor, frames) in [
        ("three-axis-8x8", "180"),
        ("in-plane-50um", "300"),
        ("piezo-1.5mm", "900"),
        ("liquid-metal-2x4", "300"),
    ] {
        let [saved, lines, table] =
            ["frames.csv", "live.csv", "touch.csv"].map(|name| folder.path(name));
        let out = format!("csv:{lines}");
        let live = ["live", sensor, "--headless", "--source"];
        // At a bounded speed the lines miss no frame.
        let more = ["--speed", "20", "--force", "--frames", frames];
        let first = [
            "sim:", "--speed", "max", "--frames", frames, "--force", "--save", &saved,
        ];
        done(&[&live[..], &first].concat());
        let source = format!("replay:{saved}");
        done(&[&live[..], &[&source, "--out", &out], &more].concat());
        let summary = done(&["estimate", sensor, &saved, "-o", &table, "--force"]);
        assert!(
            summary.contains(&format!("frames                   {frames}")),
            "{summary}"
        );
        let [live, later] =
            [&lines, &table].map(|file| columns(&fs::read_to_string(file).unwrap()));
        assert_eq!(live, later, "{sensor}");
        // Before the end of the rest capture nothing is a force.
        let known = later["zero_known"].iter().position(|known| known == "true");
        assert_eq!(known, Some(50), "{sensor}");
        assert!(later["contacts"][..50].iter().all(|count| count == "0"));
        // Something pressed, and its deviation is known where its force is.
        assert!(
            later["contacts"].iter().any(|count| count != "0"),
            "{sensor}"
        );
        let forces = later["force_z [N]"]
            .iter()
            .zip(&later["force_z_deviation [N]"]);
        for (force, deviation) in forces {
            assert_eq!(force.is_empty(), deviation.is_empty(), "{sensor}");
        }
    }
}

#[test]
fn nothing_of_the_user_is_overwritten() {
    let folder = Folder::new("estimate-files");
    let saved = folder.path("frames.csv");
    let first = [
        "live",
        "in-plane-50um",
        "--headless",
        "--speed",
        "max",
        "--frames",
        "20",
    ];
    done(&[&first[..], &["--save", &saved]].concat());
    let estimate = |output: &str| refused(&["estimate", "in-plane-50um", &saved, "-o", output]);
    assert!(estimate(&saved).contains("is read by this command"));
    let other = folder.path("notes.csv");
    fs::write(&other, "mine").unwrap();
    assert!(estimate(&other).contains("the file exists"));
    assert_eq!(fs::read_to_string(&other).unwrap(), "mine");
    let missing = folder.path("no.csv");
    let message = refused(&[
        "estimate",
        "in-plane-50um",
        &missing,
        "-o",
        &folder.path("t.csv"),
    ]);
    assert!(message.contains("no.csv"), "{message}");
    assert!(!Path::new(&folder.path("t.csv")).exists());
    // Without a file the table is the standard output, and nothing else is.
    let table = done(&["estimate", "in-plane-50um", &saved]);
    assert!(
        table.starts_with("sequence,time [s],force_x [N],"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 21);
}
