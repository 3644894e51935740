//! The tables of the papers, the ledgers and the pages of `docs/papers` agree.
#![allow(clippy::unwrap_used)]

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use taxel_papers::{Kind, Ledger, Paper, Verdict, page};

/// Computed once for all tests.
static LEDGERS: LazyLock<[Ledger; 4]> = LazyLock::new(|| Paper::ALL.map(Paper::ledger));

fn root() -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    folder.parent().unwrap().parent().unwrap().to_owned()
}

#[test]
fn verdicts_follow_from_the_values() {
    let mut others = Vec::new();
    for Ledger { paper, entries, .. } in &*LEDGERS {
        for entry in entries {
            let what = format!("{} {}", paper.name(), entry.row.id);
            if entry.verdict != entry.row.verdict {
                others.push(format!("{what}: {:?}", entry.verdict));
            }
            assert!(entry.ours.is_none_or(f64::is_finite), "{what}");
            // What differs says why.
            let plain = matches!(
                entry.verdict,
                Verdict::Reproduced | Verdict::Arithmetic | Verdict::Input
            );
            assert!(plain || !entry.note.is_empty(), "{what}");
            assert!(
                entry.row.kind != Kind::None || entry.ours.is_none(),
                "{what} has a value and says that there is nothing to compute"
            );
        }
    }
    assert!(others.is_empty(), "other verdicts: {others:#?}");
}

/// A number that comes from a key of a sensor file, and not from a function, was typed in.
#[test]
fn a_number_of_a_sensor_file_is_an_input() {
    for Ledger { paper, entries, .. } in &*LEDGERS {
        for entry in entries {
            let typed = entry.row.function.is_empty() && !entry.row.key.is_empty();
            let same = entry.difference.is_some_and(|off| off.abs() < 1e-9);
            assert!(
                !(typed && same) || entry.row.kind == Kind::Input,
                "{} {}",
                paper.name(),
                entry.row.id
            );
        }
    }
}

#[test]
fn words_name_values_that_exist() {
    for Ledger { paper, entries, .. } in &*LEDGERS {
        for entry in entries {
            for (at, _) in entry.note.match_indices('{') {
                let rest = &entry.note[at + 1..];
                assert!(
                    rest.starts_with(' '),
                    "{} {}: {{{rest}",
                    paper.name(),
                    entry.row.id
                );
            }
        }
    }
}

#[test]
fn each_row_has_its_own_name_and_its_place() {
    for paper in Paper::ALL {
        let table = paper.table();
        let mut names = HashSet::new();
        let mut statements = HashSet::new();
        for row in &table.rows {
            assert!(names.insert(&row.id), "{} {}", paper.name(), row.id);
            let statement = (&row.place, &row.what, &row.printed);
            assert!(statements.insert(statement), "{} {}", paper.name(), row.id);
            assert!(!row.place.is_empty() && !row.printed.is_empty());
        }
    }
}

/// Numbers that follow from the slopes of table 2 are those of the slopes.
#[test]
fn quotients_of_table_2_follow_from_its_slopes() {
    let table = Paper::P3.table();
    let slope = |profile: &str, sample: &str| table.number(&format!("slope_{profile}_{sample}"), 0);
    let printed = |id: String| table.row(&id).unwrap().printed.clone();
    for sample in ["thin", "thick"] {
        for profile in ["impact", "cyclic"] {
            let ratio = slope(profile, sample) / slope("step", sample);
            let id = format!("over_step_{profile}_{sample}");
            assert_eq!(printed(id), format!("{ratio:.2}"));
        }
    }
    for profile in ["step", "impact", "cyclic"] {
        let ratio = slope(profile, "thin") / slope(profile, "thick");
        assert_eq!(
            printed(format!("over_thick_{profile}")),
            format!("{ratio:.2}")
        );
    }
}

/// Functions and tests that the tables name stand in the sources.
#[test]
fn named_functions_and_tests_exist() {
    let mut sources = String::new();
    let mut folders = vec![root().join("crates")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("node_modules") {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                sources += &fs::read_to_string(path).unwrap();
            }
        }
    }
    let starts = ["fn ", "const ", "struct ", "\n    "];
    let stands = |name: &str| {
        let mut owners = name.rsplit("::");
        let last = owners.next().unwrap();
        owners.all(|owner| sources.contains(owner))
            && starts.iter().any(|start| {
                ['(', '<', ':', ',', ' ']
                    .iter()
                    .any(|end| sources.contains(&format!("{start}{last}{end}")))
            })
    };
    for paper in Paper::ALL {
        let table = paper.table();
        let rows = table.rows.iter().flat_map(|row| [&row.function, &row.test]);
        let runs = table.runs.iter().map(|run| &run.test);
        for name in rows.chain(runs).filter(|name| !name.is_empty()) {
            assert!(stands(name), "{}: {name}", paper.name());
        }
    }
}

#[test]
fn pages_of_the_ledgers_are_current() {
    for ledger in &*LEDGERS {
        let name = format!("docs/papers/{}.md", ledger.paper.name().to_lowercase());
        let committed = fs::read_to_string(root().join(&name)).unwrap();
        let committed = committed.replace("\r\n", "\n");
        assert!(
            page(&committed, ledger).as_ref() == Some(&committed),
            "{name} is stale: run `cargo run -- reproduce --ledger docs/papers`"
        );
    }
}

#[test]
fn figures_are_drawn() {
    for Ledger { figures, .. } in &*LEDGERS {
        for figure in figures {
            assert!(!figure.figure.caption.is_empty(), "{}", figure.place);
            for series in figure.figure.charts.iter().flat_map(|chart| &chart.series) {
                assert!(series.points.len() > 1, "{}", series.name);
                let mut numbers = series.points.iter().flatten();
                assert!(numbers.all(|value| value.is_finite()), "{}", series.name);
            }
        }
    }
}
