//! The modules of every crate form no circle: computed from the sources.
//!
//! In each folder the modules beside each other are the nodes; an arrow goes from
//! one to another when any file below the first names a path into the second.
//! Test modules and comments are left out.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module as the names on the way to it from the root of its crate.
type Module = Vec<String>;

fn crates() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut crates: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("Cargo.toml").exists())
        .collect();
    crates.sort();
    crates
}

/// Code of each module below `folder`, without comments and test modules.
fn modules(folder: &Path, at: &Module, found: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let inner = || at.iter().cloned().chain([name.clone()]).collect::<Module>();
        if path.is_dir() {
            if name != "tests" && name != "bin" {
                modules(&path, &inner(), found);
            }
        } else if path.extension().is_some_and(|ending| ending == "rs") && name != "tests" {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
            let code: String = code
                .lines()
                .map(|line| line.split("//").next().unwrap())
                .collect::<Vec<_>>()
                .join("\n");
            let module = if ["mod", "lib", "main"].contains(&name.as_str()) {
                at.clone()
            } else {
                inner()
            };
            found.entry(module).or_default().push_str(&code);
        }
    }
}

/// Paths from the root of the crate that the code of `module` names with `crate::`
/// or `super::`, the members of one pair of braces one by one.
fn named(module: &Module, code: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
                continue;
            }
            let mut rest = &code[at..];
            let mut path: Module = if rest.starts_with("crate::") {
                rest = &rest["crate::".len()..];
                Vec::new()
            } else {
                let mut path = module.clone();
                while let Some(behind) = rest.strip_prefix("super::") {
                    path.pop();
                    rest = behind;
                }
                path
            };
            loop {
                let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_');
                let word = &rest[..end.unwrap_or(rest.len())];
                if word.is_empty() {
                    break;
                }
                path.push(word.to_owned());
                match rest[word.len()..].strip_prefix("::") {
                    Some(behind) => rest = behind,
                    None => break,
                }
            }
            match rest.strip_prefix('{') {
                Some(list) => {
                    for member in members(list) {
                        found.push(path.iter().cloned().chain([member]).collect());
                    }
                }
                None => found.push(path),
            }
        }
    }
    found
}

/// First words of the members of a list in braces, the opening one cut.
fn members(list: &str) -> Vec<String> {
    let (mut depth, mut words, mut word) = (0_usize, Vec::new(), String::new());
    for c in list.chars() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => words.push(std::mem::take(&mut word)),
            c if depth == 0 => word.push(c),
            _ => {}
        }
    }
    words.push(word);
    let first = |word: &String| word.trim().split("::").next().unwrap().trim().to_owned();
    words.iter().map(first).collect()
}

/// Arrows between the modules beside each other, by the module around them.
fn arrows(modules: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<[String; 2]>> {
    let mut arrows: BTreeMap<Module, BTreeSet<[String; 2]>> = BTreeMap::new();
    for (module, code) in modules {
        for mut path in named(module, code) {
            while !path.is_empty() && !modules.contains_key(&path) {
                path.pop();
            }
            let common = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
            if common < module.len() && common < path.len() {
                let arrow = [module[common].clone(), path[common].clone()];
                arrows
                    .entry(module[..common].to_vec())
                    .or_default()
                    .insert(arrow);
            }
        }
    }
    arrows
}

/// A circle among the arrows, if there is one.
fn circle(arrows: &BTreeSet<[String; 2]>) -> Option<Vec<String>> {
    let nodes: BTreeSet<&String> = arrows.iter().flatten().collect();
    // Modules that lead nowhere are taken away until none is left, or a circle.
    let mut left: BTreeSet<&String> = nodes;
    loop {
        let leads = |node: &String| arrows.iter().any(|[a, b]| a == node && left.contains(b));
        let kept: BTreeSet<&String> = left.iter().copied().filter(|node| leads(node)).collect();
        if kept.len() == left.len() {
            break;
        }
        left = kept;
    }
    let mut way = vec![(*left.first()?).clone()];
    loop {
        let last = way.last()?;
        let [_, next] = arrows.iter().find(|[a, b]| a == last && left.contains(b))?;
        let next = next.clone();
        if let Some(begin) = way.iter().position(|node| *node == next) {
            return Some(way.split_off(begin));
        }
        way.push(next);
    }
}

#[test]
fn the_modules_of_every_crate_form_no_circle() {
    let mut circles = Vec::new();
    for folder in crates() {
        let mut found = BTreeMap::new();
        modules(&folder.join("src"), &Vec::new(), &mut found);
        assert!(
            !found.is_empty(),
            "no sources in {}",
            folder.to_str().unwrap()
        );
        for (around, arrows) in arrows(&found) {
            if let Some(circle) = circle(&arrows) {
                let name = folder.file_name().unwrap().to_str().unwrap();
                circles.push(format!(
                    "{name} {}: {}",
                    around.join("::"),
                    circle.join(" -> ")
                ));
            }
        }
    }
    assert!(circles.is_empty(), "circles:\n{}", circles.join("\n"));
}

#[test]
fn a_circle_is_found_through_lists_and_parents() {
    let module =
        |names: &[&str]| -> Module { names.iter().map(|name| (*name).to_owned()).collect() };
    let code = [
        (vec![], "pub mod a; pub mod b; pub mod c;"),
        (vec!["a"], "use crate::{b::X, c};"),
        (vec!["b"], "mod inner;"),
        (vec!["b", "inner"], "use super::super::c::{Y, Z};"),
        (vec!["c"], "fn f() -> crate::a::W {}"),
    ];
    let modules = code.map(|(names, code)| (module(&names), code.to_owned()));
    let arrows = arrows(&modules.into_iter().collect());
    let at_root = &arrows[&Vec::new()];
    let expected = [["a", "b"], ["a", "c"], ["b", "c"], ["c", "a"]];
    let expected: BTreeSet<[String; 2]> = expected.map(|pair| pair.map(str::to_owned)).into();
    assert_eq!(*at_root, expected);
    assert!(circle(at_root).is_some_and(|way| way.contains(&"a".to_owned())));
    let straight: BTreeSet<[String; 2]> =
        at_root.iter().filter(|[a, _]| a != "c").cloned().collect();
    assert_eq!(circle(&straight), None);
}
