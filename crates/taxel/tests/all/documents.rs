//! What the documents name is there: pages and their headings, files, crates, modules, items.

use std::collections::HashSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All files and folders of the repository, relative to it, without what builds leave.
fn entries() -> Vec<String> {
    let (root, mut found) = (root(), Vec::new());
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root.join(&folder)).unwrap() {
            let name = entry.unwrap().file_name();
            let path = folder.join(&name);
            if ["target", "node_modules", ".git"]
                .iter()
                .any(|built| name == *built)
            {
                continue;
            }
            found.push(path.to_str().unwrap().to_owned());
            if root.join(&path).is_dir() {
                folders.push(path);
            }
        }
    }
    found
}

/// True if a file has one of these endings.
fn ends(name: &str, endings: &[&str]) -> bool {
    let ending = Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str());
    ending.is_some_and(|ending| endings.contains(&ending))
}

/// The pages that are checked: name and text.
fn pages(entries: &[String]) -> Vec<(&str, String)> {
    let top = [
        "ARCHITECTURE.md",
        "README.md",
        "CONTRIBUTING.md",
        "DESIGN.md",
    ];
    let is_page = |name: &&String| {
        top.contains(&name.as_str()) || (name.starts_with("docs/") && ends(name, &["md"]))
    };
    let pages = entries.iter().filter(is_page);
    let read = |name: &String| fs::read_to_string(root().join(name)).unwrap();
    let found: Vec<_> = pages.map(|name| (name.as_str(), read(name))).collect();
    assert!(found.len() > 30);
    found
}

/// A page without its blocks of code.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// What a page has between backticks.
fn quoted(prose: &str) -> impl Iterator<Item = &str> {
    prose
        .lines()
        .flat_map(|line| line.split('`').skip(1).step_by(2))
}

/// Targets of the links of a page.
fn links(prose: &str) -> impl Iterator<Item = &str> {
    let targets = prose
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://") && !target.contains(' '))
}

/// A path without `.` and `..`.
fn straight(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(out.pop()),
            Component::CurDir => {}
            other => out.push(other),
        }
    }
    out
}

/// Anchors of the headings of a page, as GitHub makes them.
fn anchors(text: &str) -> HashSet<String> {
    let headings = prose(text);
    let headings = headings.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| -> String {
        let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
        let title = heading.trim_start_matches('#').trim().to_lowercase();
        title
            .chars()
            .filter(kept)
            .collect::<String>()
            .replace(' ', "-")
    };
    headings.map(anchor).collect()
}

#[test]
fn every_link_leads_to_a_page_and_a_heading() {
    let entries = entries();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (page, text) in pages(&entries) {
        for link in links(&prose(&text)) {
            seen += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = Path::new(page).parent().unwrap();
            let target = if file.is_empty() {
                PathBuf::from(page)
            } else {
                straight(&folder.join(file))
            };
            let is_page = target.extension().is_some_and(|ending| ending == "md");
            let read = || fs::read_to_string(root().join(&target)).unwrap();
            let there = root().join(&target).exists()
                && (anchor.is_empty() || !is_page || anchors(&read()).contains(anchor));
            if !there {
                wrong.push(format!("{page}: {link}"));
            }
        }
    }
    assert!(seen > 200, "{seen}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Words of the sources, comments left out, and names of modules.
fn identifiers(entries: &[String]) -> HashSet<String> {
    let mut found = HashSet::new();
    for name in entries {
        if ends(name, &["rs", "pyi", "py"]) {
            let text = fs::read_to_string(root().join(name)).unwrap();
            let code = text.lines().map(|line| line.split("//").next().unwrap());
            let words =
                code.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_'));
            found.extend(words.map(str::to_owned));
        }
        // A module is named by its file.
        let stem = Path::new(name).file_stem().unwrap().to_str().unwrap();
        found.insert(stem.replace('-', "_"));
    }
    found
}

#[test]
fn every_file_crate_and_item_that_is_named_exists() {
    let entries = entries();
    let words = identifiers(&entries);
    let top: HashSet<&str> = entries
        .iter()
        .filter_map(|path| path.split('/').next())
        .collect();
    let sources = ["rs", "sh", "ts", "mjs", "geo", "msh"];
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (page, text) in pages(&entries) {
        let prose = prose(&text);
        for name in quoted(&prose) {
            let is_path = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
            let is_item = |c: char| c.is_ascii_alphanumeric() || "_:".contains(c);
            let begins = name.split('/').next().unwrap();
            let there = if name.chars().all(is_path)
                && (ends(name, &sources)
                    || (name.contains('/') && top.contains(begins)))
                // What a build leaves.
                && !name.starts_with("fuzz/target")
            {
                // Within its crate, or from the root.
                let name = name.trim_end_matches('/');
                let below = format!("/{name}");
                entries
                    .iter()
                    .any(|path| path == name || path.ends_with(&below))
            } else if let Some(rest) = name.strip_prefix("taxel-")
                && rest.chars().all(|c| c.is_ascii_lowercase())
            {
                top.contains("crates") && entries.contains(&format!("crates/{name}"))
            } else if name.contains("::") && name.chars().all(is_item) {
                name.split("::").all(|part| words.contains(part))
            } else {
                continue;
            };
            seen += 1;
            if !there {
                wrong.push(format!("{page}: {name}"));
            }
        }
    }
    assert!(seen > 300, "{seen}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// What the first cells of the table below a heading have between backticks.
fn first_cells(text: &str, heading: &str) -> HashSet<String> {
    let (_, below) = text.split_once(heading).unwrap();
    let rows = below.lines().skip_while(|line| !line.starts_with('|'));
    let rows = rows.take_while(|line| line.starts_with('|')).skip(2);
    let cells = rows.filter_map(|row| row.split('|').nth(1));
    cells.flat_map(quoted).map(str::to_owned).collect()
}

#[test]
fn the_tables_of_the_architecture_have_every_crate_and_only_modules_that_exist() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let crates: HashSet<String> = fs::read_dir(root().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(first_cells(&text, "## Crates"), crates);
    let modules = first_cells(&text, "## The main modules of `taxel`");
    assert!(modules.len() > 15);
    let source = root().join("crates/taxel/src");
    for module in modules {
        let file = source.join(format!("{module}.rs"));
        assert!(file.exists() || source.join(&module).is_dir(), "{module}");
    }
}

#[test]
fn sources_cite_only_pages_that_exist() {
    let entries = entries();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    let code = ["rs", "py", "pyi", "toml", "sh", "ts", "mjs"];
    for name in entries.iter().filter(|name| ends(name, &code)) {
        let text = fs::read_to_string(root().join(name)).unwrap();
        for (at, _) in text.match_indices("docs/") {
            let is_path = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
            let end = text[at..].find(|c| !is_path(c)).unwrap_or(text.len() - at);
            let cited = &text[at..at + end];
            if let Some(end) = cited.find(".md") {
                seen += 1;
                let page = &cited[..end + 3];
                if !entries.iter().any(|path| path == page) {
                    wrong.push(format!("{name}: {page}"));
                }
            }
        }
    }
    assert!(seen > 50, "{seen}");
    assert!(wrong.is_empty(), "{wrong:#?}");
}
