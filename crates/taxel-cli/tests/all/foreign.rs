//! Files of other programs: listed, played and made into recordings.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use crate::common::{Folder, done, refused, taxel};

/// A command that is refused for this reason.
fn refused_for(arguments: &[&str], part: &str) {
    let message = refused(arguments);
    assert!(message.contains(part), "{message}");
}

/// A file that another program's library wrote.
fn file(name: &str) -> String {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../taxel-recording/tests/foreign/"
    );
    format!("{folder}{name}")
}

/// A run over a recording that must end well: its summary and its notes.
fn played(path: &str, more: &[&str]) -> (Value, String) {
    let source = format!("replay:{path}");
    let run = [
        "live",
        "--headless",
        "--speed",
        "max",
        "--format",
        "json",
        "--source",
        &source,
    ];
    let output = taxel(&[&run[..], more].concat());
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let notes = String::from_utf8(output.stderr).unwrap();
    (serde_json::from_slice(&output.stdout).unwrap(), notes)
}

#[test]
fn a_value_and_a_unix_time_are_not_taken_for_each_other() {
    let folder = Folder::new("foreign-unix");
    let path = folder.path("scale.csv");
    let rows = (0..2000).fold(String::new(), |mut rows, row| {
        // A quiet reading of one count more or less, every 20 ms.
        let _ = writeln!(
            rows,
            "{},{}.{:02}",
            300 + row * 7 % 3,
            1_700_000_000 + row / 50,
            row % 50 * 2
        );
        rows
    });
    fs::write(&path, rows).unwrap();
    let (summary, notes) = played(&path, &["--raw"]);
    assert_eq!(summary["frames"], 2000);
    for what in ["late", "lost", "duplicate"] {
        assert_eq!(summary[what], 0, "{what}: {summary}");
    }
    assert!(
        notes.contains("time: column 2 in s, by its numbers, Unix time"),
        "{notes}"
    );
    // The same as it is said, in ms that it is not.
    let (summary, notes) = played(&path, &["--columns", "time=2[ms],value=1"]);
    assert_eq!(summary["frames"], 2000);
    assert!(notes.contains("column 2 in ms, as said"), "{notes}");
    refused_for(
        &[
            "live",
            "--headless",
            "--source",
            &format!("replay:{path}"),
            "--columns",
            "time=2[ms],weight=1",
        ],
        "`weight` is no role",
    );
}

#[test]
fn a_bag_is_listed_played_and_imported() {
    let bag = file("bag_mcap");
    let listed = done(&["recording", "inspect", &bag]);
    assert!(
        listed.contains("/wrench: geometry_msgs/msg/WrenchStamped, 40 rows"),
        "{listed}"
    );
    let (summary, notes) = played(&bag, &["--topic", "/multi"]);
    assert_eq!(
        (&summary["frames"], &summary["rows"], &summary["columns"]),
        (&40.into(), &2.into(), &3.into())
    );
    assert!(notes.contains("when each message was recorded"), "{notes}");
    let folder = Folder::new("foreign-import");
    let [table, chunks] = ["w.csv", "w.mcap"].map(|name| folder.path(name));
    for output in [&table, &chunks] {
        let printed = done(&[
            "recording",
            "import",
            &bag,
            "--part",
            "/wrench",
            "-o",
            output,
        ]);
        assert!(printed.contains("40 frames"), "{printed}");
        let (summary, _) = played(output, &[]);
        assert_eq!(
            (&summary["frames"], &summary["channel_unit"]),
            (&40.into(), &"N".into())
        );
    }
    let again = fs::read_to_string(&table).unwrap();
    assert!(
        again.contains("# time: the stamp in the head of each message"),
        "{again}"
    );
    refused_for(
        &["recording", "import", &bag, "-o", &folder.path("x.csv")],
        "it holds several series",
    );
    refused_for(
        &["recording", "export", &bag, "-o", &folder.path("x.csv")],
        "is MCAP of another program",
    );
    refused_for(
        &[
            "recording",
            "inspect",
            &Folder::new("foreign-empty").path(""),
        ],
        "without the files of a bag",
    );
}

#[test]
fn a_cut_file_gives_what_is_whole() {
    let folder = Folder::new("foreign-cut");
    let whole = fs::read(file("lab.xdf")).unwrap();
    let path = folder.path("cut.xdf");
    fs::write(&path, &whole[..whole.len() - 400]).unwrap();
    let output = taxel(&[
        "recording",
        "import",
        &path,
        "--stream",
        "Force",
        "-o",
        &folder.path("cut.csv"),
    ]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("20 frames")
    );
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("ends inside a chunk")
    );
}
