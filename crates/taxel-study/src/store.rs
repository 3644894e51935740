//! Finished designs in a folder, by content: any number of programs may write at once, and a
//! run that was ended goes on where it stood.
//!
//! `manifest.json` says how many designs a block has; `ab/abcdef….json` is one block. A block
//! is written beside its place, flushed and renamed: a reader sees all of it or nothing. It
//! carries the SHA-256 of its designs, and its name is that of their keys; one that does not
//! agree is computed again.

use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use serde_json::{Value as Json, json};
use taxel::shown;

use crate::answers::Outcome;
use crate::study::{Status, sha256};

/// Version of the numbers that the library computes: raised when answers change. Results of
/// another version are not mixed.
pub const NUMERICS: u64 = 2;
/// Most designs of a block.
pub const MOST_IN_BLOCK: usize = 1000;
/// Files that are left unfinished longer than this are removed by a merge.
const LEFT_BEHIND: Duration = Duration::from_hours(24);

/// A result without its design.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// State.
    pub status: Status,
    /// Why it is not done.
    pub reason: String,
    /// Answers.
    pub answers: Vec<Outcome>,
}

/// Why a store cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// It cannot be read or written.
    #[error("{0}: {1}")]
    Io(String, io::Error),
    /// It is of another kind or version.
    #[error("{0}")]
    Other(String),
}

/// Finished designs in a folder.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    /// Designs of one block.
    pub block: usize,
    /// Blocks that were damaged when the store was opened.
    pub damaged: usize,
    /// True if its manifest was lost or cut and is written anew from the blocks that are there.
    pub rebuilt: bool,
    known: HashMap<String, Kept>,
    /// Designs of the largest block that was read.
    largest: usize,
}

static UNFINISHED: AtomicU64 = AtomicU64::new(0);

/// Key of a design by all that its result follows from.
pub fn key_of(content: &str) -> String {
    sha256(&format!("taxel design, numerics {NUMERICS}\n{content}"))
}

impl Store {
    /// Opens the store in `folder`, or makes one of `block` designs in each block for the
    /// study of the text `study`.
    ///
    /// # Errors
    /// [`StoreError`] for a folder that is something else, or results of another version.
    pub fn open(folder: &Path, block: usize, study: &str) -> Result<Self, StoreError> {
        let io = |path: &Path| {
            let path = shown::path(path);
            move |error| StoreError::Io(path, error)
        };
        let manifest = folder.join("manifest.json");
        let mut store = Self {
            folder: folder.to_owned(),
            block: block.clamp(1, MOST_IN_BLOCK),
            damaged: 0,
            rebuilt: false,
            known: HashMap::new(),
            largest: 0,
        };
        if !is_whole(&manifest) {
            let cut = manifest.exists();
            let occupied = fs::read_dir(folder).is_ok_and(|mut inside| {
                inside.any(|entry| {
                    // Another worker may be making the same store.
                    let shown = |name: &str| !name.starts_with('.') && name != "manifest.json";
                    entry.is_ok_and(|entry| shown(&entry.file_name().to_string_lossy()))
                })
            });
            if occupied {
                store.read_blocks().map_err(io(folder))?;
            }
            store.rebuilt = cut || store.largest > 0;
            if occupied && store.largest == 0 && !is_whole(&manifest) {
                let message = format!(
                    "--store {}: the folder is not empty and no store\nhelp: name an empty or a new folder",
                    shown::path(folder)
                );
                return Err(StoreError::Other(message));
            }
            fs::create_dir_all(folder).map_err(io(folder))?;
            // All blocks but the last of a run are full.
            let block = match store.largest {
                0 => store.block,
                largest => largest.min(MOST_IN_BLOCK),
            };
            let text = json!({
                "taxel_store": 1, "numerics": NUMERICS, "block": block, "study": study,
            });
            write_whole(&manifest, &format!("{text:#}\n")).map_err(io(&manifest))?;
        }
        let text = fs::read_to_string(&manifest).map_err(io(&manifest))?;
        let read: Json = serde_json::from_str(&text).unwrap_or(Json::Null);
        let number = |key: &str| read.get(key).and_then(Json::as_u64);
        let (Some(1), Some(numerics), Some(block @ 1..)) =
            (number("taxel_store"), number("numerics"), number("block"))
        else {
            let message = format!("{}: is no manifest of a store", shown::path(&manifest));
            return Err(StoreError::Other(message));
        };
        if numerics != NUMERICS {
            let message = format!(
                "--store {}: its results are of version {numerics} of the numbers, this program computes version \
                 {NUMERICS}; they are not mixed\nhelp: name a new folder",
                shown::path(folder)
            );
            return Err(StoreError::Other(message));
        }
        store.block = (block as usize).min(MOST_IN_BLOCK);
        store.read_blocks().map_err(io(folder))?;
        Ok(store)
    }

    fn read_blocks(&mut self) -> io::Result<()> {
        self.damaged = 0;
        for entry in fs::read_dir(&self.folder)? {
            let inner = entry?.path();
            if !inner.is_dir() {
                continue;
            }
            for entry in fs::read_dir(&inner)? {
                let path = entry?.path();
                let name = path
                    .file_name()
                    .map(|name| name.to_string_lossy().into_owned());
                let Some(name) = name.as_deref().and_then(|name| name.strip_suffix(".json")) else {
                    continue;
                };
                match fs::read(&path)
                    .ok()
                    .and_then(|bytes| block_of(name, &bytes))
                {
                    Some(designs) => {
                        self.largest = self.largest.max(designs.len());
                        self.known.extend(designs);
                    }
                    None => self.damaged += 1,
                }
            }
        }
        Ok(())
    }

    /// The result of a design.
    pub fn kept(&self, key: &str) -> Option<&Kept> {
        self.known.get(key)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Number of designs that are kept.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// True if nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Keeps the results of a block.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn keep(&mut self, designs: Vec<(String, Kept)>) -> Result<(), StoreError> {
        if designs.is_empty() {
            return Ok(());
        }
        let (name, text) = text_of(&designs);
        let folder = self.folder.join(&name[..2]);
        let path = folder.join(format!("{name}.json"));
        fs::create_dir_all(&folder)
            .and_then(|()| write_whole(&path, &text))
            .map_err(|error| StoreError::Io(shown::path(&path), error))?;
        self.known.extend(designs);
        Ok(())
    }

    /// Removes what was left unfinished for longer than a day.
    pub fn remove_left_behind(&self) {
        let mut folders = vec![self.folder.clone()];
        let inside = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        folders.extend(
            inside
                .map(|entry| entry.path())
                .filter(|path| path.is_dir()),
        );
        for entry in folders.iter().flat_map(fs::read_dir).flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let old = entry
                .metadata()
                .and_then(|about| about.modified())
                .is_ok_and(|time| {
                    SystemTime::now()
                        .duration_since(time)
                        .is_ok_and(|age| age > LEFT_BEHIND)
                });
            let unfinished = name.starts_with('.')
                && Path::new(&name)
                    .extension()
                    .is_some_and(|ending| ending == "part");
            if unfinished && old {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// True if a manifest is there whole, of whatever it is.
fn is_whole(manifest: &Path) -> bool {
    let text = fs::read_to_string(manifest);
    text.is_ok_and(|text| serde_json::from_str::<Json>(&text).is_ok())
}

/// Writes a file beside its place, flushes it, and moves it there.
fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let count = UNFINISHED.fetch_add(1, Ordering::Relaxed);
    let folder = path.parent().unwrap_or_else(|| Path::new("."));
    // Processes of several machines may share a folder: the name has the place, too.
    let own = sha256(&format!("{:p} {:?}", &raw const count, SystemTime::now()));
    let beside = folder.join(format!(
        ".{}-{count}-{}.part",
        std::process::id(),
        &own[..12]
    ));
    let written = File::create_new(&beside).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&beside, path)
    });
    if written.is_err() {
        let _ = fs::remove_file(&beside);
    }
    written
}

fn name_of<'k>(keys: impl Iterator<Item = &'k str>) -> String {
    sha256(&keys.collect::<Vec<_>>().join("\n"))
}

/// Name and text of a block.
fn text_of(designs: &[(String, Kept)]) -> (String, String) {
    let outcome = |outcome: &Outcome| match outcome {
        // A text: readers of JSON may round numbers.
        Outcome::Number(number) => json!(["number", format!("{number:e}")]),
        Outcome::Word(word) => json!(["word", word]),
        Outcome::Outside(why) => json!(["outside", why]),
        Outcome::Ended(why) => json!(["ended", why]),
        Outcome::None => json!(["none", ""]),
    };
    let list: Vec<Json> = designs
        .iter()
        .map(|(key, kept)| {
            let answers: Vec<Json> = kept.answers.iter().map(outcome).collect();
            json!({"key": key, "status": kept.status.name(), "reason": kept.reason, "answers": answers})
        })
        .collect();
    let body = Json::Array(list).to_string();
    let text = format!(
        "{{\"sha256\": \"{}\", \"designs\": {body}}}\n",
        sha256(&body)
    );
    (name_of(designs.iter().map(|(key, _)| key.as_str())), text)
}

/// Designs of the block of this name; none if anything does not agree.
fn block_of(name: &str, bytes: &[u8]) -> Option<Vec<(String, Kept)>> {
    let text = std::str::from_utf8(bytes).ok()?;
    let rest = text.strip_prefix("{\"sha256\": \"")?;
    let (hash, rest) = rest.split_once("\", \"designs\": ")?;
    let body = rest.strip_suffix("}\n")?;
    if sha256(body) != hash {
        return None;
    }
    let list: Vec<Json> = serde_json::from_str(body).ok()?;
    let outcome = |json: &Json| -> Option<Outcome> {
        let text = json.get(1)?.as_str()?.to_owned();
        Some(match json.get(0)?.as_str()? {
            "number" => Outcome::Number(text.parse().ok()?),
            "word" => Outcome::Word(text),
            "outside" => Outcome::Outside(text),
            "ended" => Outcome::Ended(text),
            _ => Outcome::None,
        })
    };
    let design = |json: &Json| {
        let answers = json.get("answers")?.as_array()?;
        let kept = Kept {
            status: Status::of(json.get("status")?.as_str()?)?,
            reason: json.get("reason")?.as_str()?.to_owned(),
            answers: answers.iter().map(outcome).collect::<Option<_>>()?,
        };
        Some((json.get("key")?.as_str()?.to_owned(), kept))
    };
    let designs: Vec<(String, Kept)> = list.iter().map(design).collect::<Option<_>>()?;
    (name_of(designs.iter().map(|(key, _)| key.as_str())) == name).then_some(designs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_or_cut_manifest_is_rebuilt_from_the_blocks() {
        let folder = std::env::temp_dir().join(format!("taxel-manifest-{}", std::process::id()));
        let kept = |number: f64| Kept {
            status: Status::Done,
            reason: String::new(),
            answers: vec![Outcome::Number(number)],
        };
        let open = |block| Store::open(&folder, block, "study").map_err(|error| error.to_string());
        let mut store = open(3).unwrap_or_else(|error| panic!("{error}"));
        let designs = |range: std::ops::Range<u8>| {
            let design = |n: u8| (sha256(&n.to_string()), kept(f64::from(n)));
            range.map(design).collect::<Vec<_>>()
        };
        for range in [0..3, 3..6, 6..7] {
            assert!(store.keep(designs(range)).is_ok());
        }
        let manifest = folder.join("manifest.json");
        let whole = fs::read_to_string(&manifest).unwrap_or_default();
        for left in [
            None,
            Some(0),
            Some(1),
            Some(whole.len() / 2),
            Some(whole.len() - 3),
        ] {
            let _ = fs::remove_file(&manifest);
            if let Some(left) = left {
                assert!(fs::write(&manifest, &whole[..left]).is_ok());
            }
            let store = open(10).unwrap_or_else(|error| panic!("{left:?}: {error}"));
            assert_eq!(
                (store.len(), store.block, store.rebuilt),
                (7, 3, true),
                "{left:?}"
            );
            assert_eq!(store.kept(&sha256("6")), Some(&kept(6.0)));
            let again = fs::read_to_string(&manifest).unwrap_or_default();
            assert_eq!(again, whole, "{left:?}");
        }
        // What is whole and something else stays.
        assert!(fs::write(&manifest, "{}").is_ok());
        assert!(open(3).is_err());
        assert!(fs::remove_dir_all(&folder).is_ok());
    }

    #[test]
    fn a_block_with_any_flipped_byte_is_not_believed() {
        let kept = Kept {
            status: Status::Done,
            reason: String::new(),
            answers: vec![Outcome::Number(0.1 + 0.2), Outcome::Word("ok".into())],
        };
        let designs = vec![(sha256("a"), kept)];
        let (name, text) = text_of(&designs);
        assert_eq!(block_of(&name, text.as_bytes()), Some(designs));
        for at in 0..text.len() {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1;
            assert_eq!(block_of(&name, &bytes), None, "byte {at}");
            assert_eq!(block_of(&name, &text.as_bytes()[..at]), None);
        }
    }
}
