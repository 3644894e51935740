//! Problem files: what is committed is current, what is shipped is valid.

use std::fs;
use std::path::Path;

use taxel_bodies::problem::ProblemFile;

#[test]
fn the_committed_schema_and_reference_of_problems_are_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (of, file, printed) in [
        (
            "problem",
            "crates/taxel-bodies/problems/problem.schema.json",
            ProblemFile::json_schema(),
        ),
        (
            "problem-reference",
            "docs/book/problem-file-reference.md",
            ProblemFile::reference(),
        ),
    ] {
        let committed = fs::read_to_string(root.join(file)).unwrap();
        assert!(
            committed.replace("\r\n", "\n") == printed,
            "{file} is stale: run `cargo run -- schema {of} > {file}`"
        );
    }
}
