//! Licences and bans of all dependencies, from `cargo metadata`.

use std::process::Command;

use serde_json::Value;

/// Licences that may be linked into a program under MIT or Apache-2.0.
const ALLOWED: [&str; 11] = [
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "ISC",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "CC0-1.0",
];

/// Crates under another licence that are linked unmodified, and why that is allowed.
const UNMODIFIED: [(&str, &str, &str); 2] = [
    (
        "serialport",
        "MPL-2.0",
        "the licence ends at the borders of its own files, which are published as they are",
    ),
    (
        "cobyla",
        "none stated",
        "its file LICENSE.md is the MIT licence, which its manifest names as a file",
    ),
];

/// Crates that must not be in the tree, and why.
const BANNED: [(&str, &str); 8] = [
    ("openssl-sys", "needs a system library"),
    ("nalgebra", "one linear algebra in the tree"),
    ("ndarray", "one linear algebra in the tree"),
    ("polars", "too heavy"),
    ("arrow", "too heavy"),
    ("plotters", "figures are our own"),
    ("uom", "units are our own"),
    ("anyhow", "errors have types"),
];

fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// True if an SPDX expression can be met with the allowed licences.
fn allowed(expression: &str) -> bool {
    let plain = expression.replace('/', " OR ").replace(['(', ')'], "");
    plain.split(" OR ").any(|choice| {
        choice
            .split(" AND ")
            .all(|licence| ALLOWED.contains(&licence.trim()))
    }) || expression.split(" AND ").all(|part| {
        let part = part.trim().trim_matches(['(', ')']);
        part.split(" OR ")
            .any(|licence| ALLOWED.contains(&licence.trim()))
    })
}

#[test]
fn licences_are_compatible() {
    for package in packages() {
        let name = package["name"].as_str().unwrap();
        let licence = package["license"].as_str().unwrap_or("none stated");
        let excepted = UNMODIFIED
            .iter()
            .any(|(known, under, _)| *known == name && *under == licence);
        assert!(allowed(licence) || excepted, "{name} is under {licence}");
    }
}

#[test]
fn the_licence_test_can_fail() {
    for refused in [
        "GPL-3.0",
        "MPL-2.0",
        "MIT AND GPL-3.0",
        "none stated",
        "LGPL-2.1 AND (MIT OR GPL-2.0)",
    ] {
        assert!(!allowed(refused), "{refused}");
    }
    assert!(allowed("(MIT OR Apache-2.0) AND Unicode-3.0") && allowed("Unlicense/MIT"));
}

#[test]
fn banned_crates_are_absent() {
    let packages = packages();
    for (banned, why) in BANNED {
        assert!(
            packages.iter().all(|package| package["name"] != banned),
            "{banned}: {why}"
        );
    }
    // Wrong results were reported with earlier versions.
    for package in packages
        .iter()
        .filter(|package| package["name"] == "private-gemm-x86")
    {
        let version: Vec<u32> = package["version"]
            .as_str()
            .unwrap()
            .split('.')
            .map(|part| part.parse().unwrap())
            .collect();
        assert!(
            version >= vec![0, 1, 22],
            "private-gemm-x86 {version:?} is known to be wrong"
        );
    }
}

#[test]
fn one_version_of_what_must_agree() {
    let packages = packages();
    for single in ["serde", "toml", "tokio", "axum", "faer", "rand_chacha_core"] {
        let versions = packages
            .iter()
            .filter(|package| package["name"] == single)
            .count();
        assert!(versions <= 1, "{single} is in the tree {versions} times");
    }
}
