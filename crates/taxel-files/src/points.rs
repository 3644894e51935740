//! Solved points of a table that is not done: each is on the disk before the next one counts.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use taxel_bodies::transduction::{PointAnswer, PointEnd, Points};

use crate::Stop;
use crate::hash::sha256;
use crate::outputs::cannot_write;

/// First words of a file; their number is that of the format.
const HEAD: &str = "taxel points 1";
/// Digits of the checksum of a line.
const CHECKSUM: usize = 16;

/// A file to which each solved point is appended with its checksum. Numbers are written bit by bit, so
/// that a table that goes on from it is the same to the last digit.
#[derive(Debug)]
pub struct PointFile {
    path: PathBuf,
    known: HashMap<Vec<u64>, PointAnswer>,
    file: Mutex<File>,
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn words(values: &[f64]) -> String {
    let words: Vec<String> = values
        .iter()
        .map(|value| format!("{:016x}", value.to_bits()))
        .collect();
    words.join(" ")
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split(' ').filter(|word| !word.is_empty());
    words
        .map(|word| Some(f64::from_bits(u64::from_str_radix(word, 16).ok()?)))
        .collect()
}

/// A point as a line, with its checksum.
fn line(at: &[f64], answer: &PointAnswer) -> String {
    let mut body = words(at);
    let _ = match answer {
        Ok(values) => write!(body, " = {}", words(values)),
        Err(end) => {
            let reached = words(&[end.reached]);
            // A JSON string is one line.
            write!(
                body,
                " ! {reached} {}",
                serde_json::Value::from(end.reason.as_str())
            )
        }
    };
    format!("{} {body}\n", &sha256(body.as_bytes())[..CHECKSUM])
}

/// The point of a line that is whole.
fn point(line: &str) -> Option<(Vec<u64>, PointAnswer)> {
    let (checksum, body) = line.split_once(' ')?;
    if checksum != &sha256(body.as_bytes())[..CHECKSUM] {
        return None;
    }
    // Reasons may have any sign in them, numbers none.
    let Some((at, end)) = body.split_once(" ! ") else {
        let (at, values) = body.split_once(" = ")?;
        return Some((bits(&numbers(at)?), Ok(numbers(values)?)));
    };
    let (reached, reason) = end.split_once(' ')?;
    let end = PointEnd {
        reached: *numbers(reached)?.first()?,
        reason: serde_json::from_str(reason).ok()?,
    };
    Some((bits(&numbers(at)?), Err(end)))
}

impl PointFile {
    /// The file at `path`, with what it has of the solution that `statement` names; points of another
    /// one and what follows a damaged line are dropped.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub fn open(path: &Path, statement: &str) -> Result<Self, Stop> {
        let failed = |error: std::io::Error| cannot_write(path, &error);
        let head = format!("{HEAD} {}\n", sha256(statement.as_bytes()));
        let text = match fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(failed(error)),
        };
        let mut known = HashMap::new();
        let mut kept = head.clone();
        if let Some(lines) = text.strip_prefix(&head) {
            for whole in lines.split_inclusive('\n') {
                let Some((at, answer)) = whole.strip_suffix('\n').and_then(point) else {
                    break;
                };
                known.insert(at, answer);
                kept.push_str(whole);
            }
        }
        if kept != text {
            fs::write(path, &kept).map_err(failed)?;
        }
        let file = OpenOptions::new().append(true).open(path).map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            known,
            file: Mutex::new(file),
        })
    }

    /// Number of points that it had.
    pub fn count(&self) -> usize {
        self.known.len()
    }

    /// Removes it: its table is done.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(self) -> Result<(), Stop> {
        fs::remove_file(&self.path).map_err(|error| cannot_write(&self.path, &error))
    }
}

impl Points for PointFile {
    fn known(&self, at: &[f64]) -> Option<PointAnswer> {
        self.known.get(&bits(at)).cloned()
    }

    fn keep(&self, at: &[f64], answer: &PointAnswer) {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        // A point that cannot be kept is solved again by a run that goes on.
        let kept = file.write_all(line(at, answer).as_bytes());
        let _ = kept.and_then(|()| file.sync_data());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_whole_line_comes_back_and_no_damaged_one() {
        let folder = std::env::temp_dir().join(format!("taxel-points-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("dome.table.points");
        let _ = fs::remove_file(&path);
        let answers: [(Vec<f64>, PointAnswer); 3] = [
            (vec![0.1, 1.0 / 3.0], Ok(vec![2.0_f64.sqrt(), -1e-300])),
            (
                vec![0.2, 0.0],
                Err(PointEnd {
                    reached: 1e-3,
                    reason: "it folds\nover \"itself\" ! = ".into(),
                }),
            ),
            (vec![0.3, 0.0], Ok(vec![])),
        ];
        let points = PointFile::open(&path, "a").unwrap();
        assert_eq!(points.count(), 0);
        for (at, answer) in &answers {
            points.keep(at, answer);
        }
        let text = fs::read_to_string(&path).unwrap();
        let first = text.find('\n').unwrap() + 1;
        for end in 0..=text.len() {
            fs::write(&path, &text[..end]).unwrap();
            let read = PointFile::open(&path, "a").unwrap();
            let whole = text[..end]
                .get(first..)
                .map_or(0, |lines| lines.matches('\n').count());
            assert_eq!(read.count(), whole, "{end}");
            for (at, answer) in &answers[..whole] {
                assert_eq!(read.known(at).as_ref(), Some(answer));
            }
            // What is left of a line is gone, and the file can go on.
            read.keep(&[9.0], &Ok(vec![1.0]));
            assert_eq!(PointFile::open(&path, "a").unwrap().count(), whole + 1);
        }
        assert_eq!(PointFile::open(&path, "b").unwrap().count(), 0);
        fs::remove_dir_all(&folder).unwrap();
    }
}
