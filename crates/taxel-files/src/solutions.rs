//! The folder in which solutions of drawings are kept between runs.
//!
//! A file is named by the SHA-256 of all that its solution follows from. It carries that
//! statement and the SHA-256 of its own text, so that a damaged or foreign file is
//! recognised; it appears only when it is whole, so that any number of programs may
//! write at once.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use taxel::shown;
use taxel::solutions::{BodyFiles, Question, Solutions, Solver, shipped_table};
use taxel_bodies::FiniteElements;
use taxel_bodies::problem::ProblemFile;

use crate::Stop;
use crate::hash::sha256;
use crate::note;
use crate::outputs::{self, Existing};
use crate::problem::NamedProblem;
use crate::progress::Progress;

/// First line of a file; its number is that of the format.
const HEAD: &str = "taxel solution 1";
/// Largest file that is read, bytes.
const LARGEST: u64 = 1 << 24;
/// Solutions that take longer are told of, s.
const TOLD: f64 = 0.5;

/// Solutions in a folder.
pub struct Folder {
    /// None where the system names no place for what can be made again.
    path: Option<PathBuf>,
    /// The folder of the sensor file, to which names of tables are relative.
    beside: PathBuf,
    /// The solution under way.
    progress: Option<(Progress, Instant)>,
}

impl Folder {
    /// The folder of this user: `TAXEL_CACHE`, or `taxel` in that for what can be made
    /// again.
    pub fn of_user() -> Self {
        Self {
            path: of_user(&|name| env::var_os(name).map(PathBuf::from)),
            beside: PathBuf::new(),
            progress: None,
        }
    }

    /// The same for the sensor file `sensor`.
    pub fn beside(sensor: &Path) -> Self {
        Self {
            beside: sensor.parent().map_or_else(PathBuf::new, Path::to_owned),
            ..Self::of_user()
        }
    }

    fn file(&self, question: &Question) -> Option<PathBuf> {
        let name = sha256(question.statement.as_bytes());
        Some(self.path.as_ref()?.join(format!("{name}.solution")))
    }
}

fn of_user(variable: &dyn Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let named = |name: &str| variable(name).filter(|path| !path.as_os_str().is_empty());
    named("TAXEL_CACHE").or_else(|| under_home(&named, "XDG_CACHE_HOME", ".cache"))
}

/// The folder `taxel` in the one that `xdg` names, or else in `usual` of this user.
fn under_home(named: &dyn Fn(&str) -> Option<PathBuf>, xdg: &str, usual: &str) -> Option<PathBuf> {
    // The XDG specification: a relative path is to be ignored.
    let absolute = |name: &str| named(name).filter(|path| path.is_absolute());
    let folder = absolute(xdg)
        .or_else(|| Some(absolute("HOME")?.join(usual)))
        .or_else(|| absolute("LOCALAPPDATA"))?;
    Some(folder.join("taxel"))
}

/// The folder of what this user's runs leave to later ones: `TAXEL_STATE`, or `taxel` in
/// `$XDG_STATE_HOME` (`~/.local/state`). None where `TAXEL_STATE` is empty: nothing is kept.
pub fn state_folder() -> Option<PathBuf> {
    let variable = |name: &str| env::var_os(name).map(PathBuf::from);
    match variable("TAXEL_STATE") {
        Some(own) => Some(own).filter(|own| !own.as_os_str().is_empty()),
        None => under_home(&variable, "XDG_STATE_HOME", ".local/state"),
    }
}

/// The whole text of a file.
fn whole(statement: &str, solution: &str) -> String {
    let body = format!("{statement}\n{solution}\n");
    format!("{HEAD}\nsha256 {}\n{body}", sha256(body.as_bytes()))
}

/// The solution in the text of a file; none if anything is missing or not of this statement.
fn solution<'t>(statement: &str, text: &'t str) -> Option<&'t str> {
    let rest = text.strip_prefix(HEAD)?.strip_prefix("\nsha256 ")?;
    let (hash, body) = rest.split_once('\n')?;
    if sha256(body.as_bytes()) != hash {
        return None;
    }
    body.strip_prefix(statement)?
        .strip_prefix('\n')?
        .strip_suffix('\n')
}

fn read(path: &Path) -> std::io::Result<String> {
    let about = fs::metadata(path)?;
    if !about.is_file() || about.len() > LARGEST {
        return Ok(String::new());
    }
    Ok(String::from_utf8_lossy(&fs::read(path)?).into_owned())
}

impl Solutions for Folder {
    fn kept(&mut self, question: &Question) -> Option<String> {
        let path = self.file(question)?;
        // Nothing kept, or nothing to be read: solved again, which is no error.
        let text = read(&path).ok()?;
        let found = solution(&question.statement, &text);
        if found.is_none() {
            note!(
                "note: {} is damaged: the {} is solved again",
                shown::path(&path),
                question.what
            );
        }
        found.map(str::to_owned)
    }

    fn table(&mut self, name: &str) -> Result<String, String> {
        let path = self.beside.join(name);
        if let Some(shipped) = shipped_table(name).filter(|_| !path.exists()) {
            return Ok(shipped.to_owned());
        }
        let failed =
            |error: std::io::Error| format!("{}: cannot be read: {error}", shown::path(&path));
        if fs::metadata(&path).map_err(failed)?.len() > LARGEST {
            let path = shown::path(&path);
            return Err(format!(
                "{path}: has more than {LARGEST} bytes, which no table has"
            ));
        }
        fs::read_to_string(&path).map_err(failed)
    }

    fn body(&mut self, problem: &str) -> Result<Option<BodyFiles>, String> {
        let path = self.beside.join(problem);
        let is_shipped = !path.exists() && ProblemFile::shipped_text(problem).is_some();
        let path = if is_shipped {
            PathBuf::from(problem)
        } else {
            path
        };
        let named = NamedProblem::read(&path).map_err(|stop| stop.to_string())?;
        Ok(Some(named.body_files()))
    }

    fn solver(&self) -> Option<Box<dyn Solver>> {
        Some(Box::new(FiniteElements))
    }

    fn unreadable(&mut self, question: &Question) {
        note!(
            "note: what was kept of the {} is no solution: it is solved again",
            question.what
        );
    }

    fn progress(&mut self, question: &Question, fraction: f64) {
        let (progress, start) = self.progress.get_or_insert_with(|| {
            (
                Progress::new(format!("solving the {}", question.what)),
                Instant::now(),
            )
        });
        progress.at(fraction);
        if fraction >= 1.0 {
            let seconds = start.elapsed().as_secs_f64();
            if seconds > TOLD {
                note!("note: the {} was solved in {seconds:.1} s", question.what);
            }
            self.progress = None;
        }
    }

    fn keep(&mut self, question: &Question, solution: &str) {
        let Some(path) = self.file(question) else {
            return;
        };
        let kept = path.parent().map_or(Ok(()), fs::create_dir_all);
        let failed = |error: std::io::Error| Stop::Failed(error.to_string());
        let kept = kept.map_err(failed).and_then(|()| {
            outputs::write_file(&path, Existing::Replaced, |file| {
                use std::io::Write as _;
                file.write_all(whole(&question.statement, solution).as_bytes())
                    .map_err(|error| Stop::Failed(error.to_string()))
            })
        });
        // A folder that cannot be written is no error: the next run solves again.
        if kept.is_err() {
            note!(
                "note: the {} cannot be kept in {}; the next run solves it again (TAXEL_CACHE names another folder)",
                question.what,
                shown::path(path.parent().unwrap_or(&path))
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATEMENT: &str = "a = 1\nb = 2\n";

    #[test]
    fn a_file_says_what_it_solves_and_shows_damage() {
        let text = whole(STATEMENT, "[1,2]");
        assert_eq!(solution(STATEMENT, &text), Some("[1,2]"));
        for end in 0..text.len() {
            assert_eq!(solution(STATEMENT, &text[..end]), None, "{end}");
        }
        for at in 0..text.len() {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1;
            let damaged = String::from_utf8_lossy(&bytes);
            assert_eq!(solution(STATEMENT, &damaged), None, "{at}");
        }
        assert_eq!(solution("a = 2\nb = 2\n", &text), None);
    }

    #[test]
    fn the_folder_is_that_of_the_user_or_the_one_named() {
        let of = |set: &[(&str, &str)]| {
            of_user(&|name| {
                let found = set.iter().find(|(key, _)| *key == name);
                found.map(|(_, value)| PathBuf::from(value))
            })
        };
        let path = |text: &str| Some(PathBuf::from(text));
        let home = ("HOME", "/home/one");
        assert_eq!(of(&[home]), path("/home/one/.cache/taxel"));
        assert_eq!(of(&[home, ("XDG_CACHE_HOME", "/c")]), path("/c/taxel"));
        assert_eq!(
            of(&[home, ("XDG_CACHE_HOME", "c")]),
            path("/home/one/.cache/taxel")
        );
        assert_eq!(of(&[home, ("TAXEL_CACHE", "mine")]), path("mine"));
        assert_eq!(
            of(&[home, ("TAXEL_CACHE", "")]),
            path("/home/one/.cache/taxel")
        );
        assert_eq!(of(&[]), None);
    }
}
