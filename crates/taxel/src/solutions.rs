//! Solutions of drawings that no shipped table has: asked for by all that they follow
//! from, solved once, and kept by whoever can keep them.
//!
//! The library opens no file. [`Solutions`] is the place where solutions come from: the
//! command line keeps them in a folder, [`Afresh`] solves every time, and [`TablesOnly`]
//! has none, so that a drawing beside the tables is refused.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What is to be solved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// The solution in words, such as "closing curve of the columns".
    pub what: String,
    /// All that the solution follows from, one `key = value` on each line: two drawings
    /// with the same statement have the same solution.
    pub statement: String,
}

/// Why there is no solution.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unsolved {
    /// Nothing may be solved here.
    #[error(
        "no shipped table has this drawing, and nothing may be solved here: use the command `taxel`, \
         or Sensor::parse_with"
    )]
    TablesOnly,
    /// The solver found none.
    #[error("{0}")]
    Failed(String),
}

/// Where solutions come from, and where they are kept.
pub trait Solutions {
    /// The text that was kept for a question; none where there is none that is whole.
    fn kept(&mut self, question: &Question) -> Option<String>;

    /// Keeps the text of a solution; a place that cannot keep it is no error.
    fn keep(&mut self, question: &Question, solution: &str);

    /// Hears that the text which was kept is none of this program; it is solved anew.
    fn unreadable(&mut self, _question: &Question) {}

    /// Hears the fraction of a solution under way, the last time 1.
    fn progress(&mut self, _question: &Question, _fraction: f64) {}

    /// The text of a table that a sensor file names.
    ///
    /// # Errors
    /// A sentence when there is none, or none can be opened here.
    fn table(&mut self, name: &str) -> Result<String, String> {
        Err(format!(
            "the table \"{name}\" cannot be opened here: use the command `taxel`, or Sensor::parse_with"
        ))
    }

    /// True if what is not kept may be solved.
    fn may_solve(&self) -> bool {
        true
    }
}

/// Solves every time and keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Afresh;

impl Solutions for Afresh {
    fn kept(&mut self, _question: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _question: &Question, _solution: &str) {}
}

/// Has nothing beside the shipped tables.
#[derive(Debug, Clone, Copy, Default)]
pub struct TablesOnly;

impl Solutions for TablesOnly {
    fn kept(&mut self, _question: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _question: &Question, _solution: &str) {}

    fn may_solve(&self) -> bool {
        false
    }
}

/// A question that has no solution, as it is kept: the same drawing fails for the same reason.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Failure {
    failed: String,
}

/// The solution of a question: what was kept, if it is `sound`, or else what `solve` finds. That
/// there is none is kept as well.
///
/// # Errors
/// [`Unsolved`].
pub(crate) fn answer<A: Serialize + DeserializeOwned>(
    question: &Question,
    solutions: &mut dyn Solutions,
    sound: impl Fn(&A) -> bool,
    solve: impl FnOnce(&mut dyn FnMut(f64)) -> Result<A, String>,
) -> Result<A, Unsolved> {
    let read = |text: &str| serde_json::from_str::<A>(text).ok().filter(&sound);
    if let Some(text) = solutions.kept(question) {
        match (read(&text), serde_json::from_str(&text)) {
            (Some(kept), _) => return Ok(kept),
            (None, Ok(Failure { failed })) => return Err(Unsolved::Failed(failed)),
            (None, Err(_)) => solutions.unreadable(question),
        }
    }
    if !solutions.may_solve() {
        return Err(Unsolved::TablesOnly);
    }
    let solved = solve(&mut |fraction| solutions.progress(question, fraction));
    solutions.progress(question, 1.0);
    // Through its text, so that the first run has the digits of all later ones.
    let outcome = solved.and_then(|solved| {
        let text = serde_json::to_string(&solved).ok();
        let pair = text.and_then(|text| Some((read(&text)?, text)));
        pair.ok_or_else(|| String::from("the solution is no curve"))
    });
    match outcome {
        Ok((solved, text)) => {
            solutions.keep(question, &text);
            Ok(solved)
        }
        Err(failed) => {
            if let Ok(text) = serde_json::to_string(&Failure {
                failed: failed.clone(),
            }) {
                solutions.keep(question, &text);
            }
            Err(Unsolved::Failed(failed))
        }
    }
}

/// What was solved of a drawing. It follows from the drawing and is no part of it: two
/// drawings are the same whether or not they are solved.
#[derive(Debug, Clone)]
pub struct OfDrawing<T>(pub Option<T>);

impl<T> Default for OfDrawing<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> PartialEq for OfDrawing<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A number of a statement: twelve digits, so that units do not matter.
pub(crate) fn digits(value: f64) -> String {
    format!("{value:.11e}")
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[derive(Default)]
    struct Memory {
        texts: HashMap<String, String>,
        unreadable: usize,
    }

    impl Solutions for Memory {
        fn kept(&mut self, question: &Question) -> Option<String> {
            self.texts.get(&question.statement).cloned()
        }

        fn keep(&mut self, question: &Question, solution: &str) {
            let key = question.statement.clone();
            self.texts.insert(key, solution.to_owned());
        }

        fn unreadable(&mut self, _question: &Question) {
            self.unreadable += 1;
        }
    }

    fn question() -> Question {
        Question {
            what: String::from("a third"),
            statement: String::from("of = 1"),
        }
    }

    fn ask(solutions: &mut dyn Solutions, count: &mut usize) -> Result<Vec<f64>, Unsolved> {
        let sound = |numbers: &Vec<f64>| numbers.len() == 1;
        answer(&question(), solutions, sound, |progress| {
            *count += 1;
            progress(0.5);
            Ok(vec![1.0 / 3.0])
        })
    }

    #[test]
    fn a_question_is_solved_once() {
        let (mut memory, mut count) = (Memory::default(), 0);
        let first = ask(&mut memory, &mut count);
        assert_eq!(first, ask(&mut memory, &mut count));
        assert_eq!(count, 1);
    }

    #[test]
    fn that_a_question_has_no_solution_is_kept() {
        let (mut memory, mut count) = (Memory::default(), 0);
        let mut ask = || {
            let any = |_: &Vec<f64>| true;
            answer(&question(), &mut memory, any, |_| {
                count += 1;
                Err(String::from("it folds over itself"))
            })
        };
        let failed = Err(Unsolved::Failed(String::from("it folds over itself")));
        assert_eq!([ask(), ask()], [failed.clone(), failed]);
        assert_eq!((count, memory.unreadable), (1, 0));
    }

    #[test]
    fn what_is_no_solution_is_solved_anew() {
        let (mut memory, mut count) = (Memory::default(), 0);
        for text in ["", "[1.0,", "[]", "{}"] {
            memory.keep(&question(), text);
            assert_eq!(ask(&mut memory, &mut count), Ok(vec![1.0 / 3.0]));
        }
        assert_eq!((count, memory.unreadable), (4, 4));
    }

    #[test]
    fn tables_alone_solve_nothing() {
        let mut count = 0;
        let refused = ask(&mut TablesOnly, &mut count);
        assert_eq!((refused, count), (Err(Unsolved::TablesOnly), 0));
    }
}
