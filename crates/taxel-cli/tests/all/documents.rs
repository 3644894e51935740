//! Examples of the documents are what the program prints.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::done;

/// A command of a page, in its own words, with the lines that it shows of the answer.
struct Example {
    command: Vec<String>,
    shown: Vec<String>,
}

/// Words of a line, and what stands between quotation marks.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    let words = parts.flat_map(|(number, part)| match number % 2 {
        0 => part.split_whitespace().map(str::to_owned).collect(),
        _ => vec![part.to_owned()],
    });
    words.collect()
}

/// The examples of a page whose commands begin with `command`.
fn examples(page: &str, command: &str) -> Vec<Example> {
    let mut found: Vec<Example> = Vec::new();
    let (mut within, mut reading) = (false, false);
    for line in page.lines() {
        if line.starts_with("```") {
            (within, reading) = (!within, false);
        } else if let Some(typed) = line.strip_prefix("$ ").filter(|_| within) {
            reading = typed.starts_with(command);
            if reading {
                found.push(Example {
                    command: words(typed).split_off(1),
                    shown: Vec::new(),
                });
            }
        } else if reading && !line.trim().is_empty() {
            let shown = words(line).join(" ");
            found.last_mut().unwrap().shown.push(shown);
        }
    }
    found
}

#[test]
fn predictions_of_the_guide_are_what_the_program_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut all = Vec::new();
    for (page, command, least) in [
        ("commands.md", "taxel predict", 5),
        ("magnetic-skin.md", "taxel check", 1),
        ("magnetic-skin.md", "taxel predict", 1),
        ("body-sensor.md", "taxel check", 1),
        ("body-sensor.md", "taxel predict", 1),
    ] {
        let page = fs::read_to_string(root.join("docs/book").join(page)).unwrap();
        let found = examples(&page, command);
        assert!(found.len() >= least, "{command}: {} examples", found.len());
        all.extend(found);
    }
    for example in all {
        let command: Vec<&str> = example.command.iter().map(String::as_str).collect();
        let printed = done(&command);
        let printed: Vec<String> = printed.lines().map(|line| words(line).join(" ")).collect();
        assert!(!example.shown.is_empty(), "{command:?}");
        for line in &example.shown {
            assert!(printed.contains(line), "{command:?}: {line}: {printed:?}");
        }
    }
}

/// Pages below a folder.
fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            pages(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(path);
        }
    }
}

#[test]
fn no_page_has_the_marks_of_a_merge() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut all = ["README.md", "CHANGELOG.md", "ARCHITECTURE.md"]
        .map(|name| root.join(name))
        .to_vec();
    for folder in ["docs", "bench"] {
        pages(&root.join(folder), &mut all);
    }
    assert!(all.len() > 20);
    for page in all.iter().filter(|page| page.is_file()) {
        let text = fs::read_to_string(page).unwrap();
        let mark = text.lines().position(|line| {
            ["<<<<<<< ", ">>>>>>> "]
                .iter()
                .any(|mark| line.starts_with(mark))
        });
        assert_eq!(mark, None, "{page:?}, lines from 0");
    }
}
