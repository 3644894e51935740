//! Solutions of drawings that no shipped table has: asked for by all that they follow
//! from, solved once, and kept by whoever can keep them.
//!
//! The library opens no file and solves nothing. [`Solutions`] is where solutions come from: the
//! command line keeps them in a folder, `taxel_bodies::Afresh` solves every time, and
//! [`TablesOnly`] has none, so that a drawing that no table has is refused. A [`Solver`] answers
//! what is not kept; that of `taxel-bodies` does so by finite elements.

mod body;
mod cell;
mod edges;
mod section;
mod stiffness;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::mechanics::{CellGeometry, UnitDrawing};
use crate::transduction::{EdgeDrawing, InPlaneModel};

pub use body::{BodyDrawing, BodyFiles, BodyLoad, BodyOutput};

pub use crate::of_drawing::{OfDrawing, SOLVER_VERSION};

/// What is to be solved.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The solution in words, such as "closing curve of the columns".
    pub what: String,
    /// All that the solution follows from, one `key = value` on each line: two drawings
    /// with the same statement have the same solution.
    pub statement: String,
    /// The drawing.
    pub of: Asked,
}

/// A drawing with what is asked of it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Asked {
    /// The closing curve of a plane-strain cell: a [`SolvedCell`](crate::mechanics::SolvedCell).
    Cell(CellGeometry),
    /// The closings of an elastic unit: a [`SolvedStiffness`](crate::mechanics::SolvedStiffness).
    Stiffness(UnitDrawing),
    /// The edges of the electrodes of a tile: [`SolvedEdges`](crate::transduction::SolvedEdges).
    Edges(EdgeDrawing),
    /// The cross-section of an in-plane sensor: a
    /// [`SolvedSection`](crate::transduction::SolvedSection).
    Section(Box<InPlaneModel>),
    /// The outputs of a body of a problem file over its load: a
    /// [`ResponseFile`](crate::transduction::ResponseFile).
    Body(Box<BodyDrawing>),
}

/// Solves questions.
pub trait Solver {
    /// The solution of a question as JSON, in the form of the type that its [`Asked`] names;
    /// `progress` hears the fraction.
    ///
    /// # Errors
    /// A sentence when there is none, with what to change.
    fn answer(&self, question: &Question, progress: &mut dyn FnMut(f64)) -> Result<String, String>;
}

/// Tables of shipped sensor files: name and text.
const SHIPPED_TABLES: &[(&str, &str)] = &[(
    "soft-dome.table",
    include_str!("../../sensors/soft-dome.table"),
)];

/// Text of the table of a shipped sensor file.
pub fn shipped_table(name: &str) -> Option<&'static str> {
    let mut tables = SHIPPED_TABLES.iter();
    tables
        .find(|(shipped, _)| *shipped == name)
        .map(|(_, text)| *text)
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

    /// The text of a table that a sensor file names; by default that of a shipped one.
    ///
    /// # Errors
    /// A sentence when there is none, or none can be opened here.
    fn table(&mut self, name: &str) -> Result<String, String> {
        shipped_table(name).map(str::to_owned).ok_or_else(|| {
            format!(
                "the table \"{name}\" cannot be opened here: use the command `taxel`, or Sensor::parse_with"
            )
        })
    }

    /// A problem file with its mesh; none where no such files can be opened, which is the default.
    ///
    /// # Errors
    /// A sentence when there is none, or it cannot be read.
    fn body(&mut self, _problem: &str) -> Result<Option<BodyFiles>, String> {
        Ok(None)
    }

    /// What solves the questions whose solutions are not kept; none where nothing may be solved,
    /// which is the default.
    fn solver(&self) -> Option<Box<dyn Solver>> {
        None
    }
}

/// Has nothing beside the shipped tables.
#[derive(Debug, Clone, Copy, Default)]
pub struct TablesOnly;

impl Solutions for TablesOnly {
    fn kept(&mut self, _question: &Question) -> Option<String> {
        None
    }

    fn keep(&mut self, _question: &Question, _solution: &str) {}
}

/// A question that has no solution, as it is kept: the same drawing fails for the same reason.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Failure {
    failed: String,
}

/// The solution of a question: what was kept, if it is `sound`, or else what the solver finds.
/// That there is none is kept as well.
///
/// # Errors
/// [`Unsolved`].
fn answer<A: DeserializeOwned>(
    question: &Question,
    solutions: &mut dyn Solutions,
    sound: impl Fn(&A) -> bool,
) -> Result<A, Unsolved> {
    // A new solution too: the first run has the digits of all later ones.
    let read = |text: &str| serde_json::from_str::<A>(text).ok().filter(&sound);
    if let Some(text) = solutions.kept(question) {
        match (read(&text), serde_json::from_str(&text)) {
            (Some(kept), _) => return Ok(kept),
            (None, Ok(Failure { failed })) => return Err(Unsolved::Failed(failed)),
            (None, Err(_)) => solutions.unreadable(question),
        }
    }
    let solver = solutions.solver().ok_or(Unsolved::TablesOnly)?;
    let solved = solver.answer(question, &mut |fraction| {
        solutions.progress(question, fraction);
    });
    solutions.progress(question, 1.0);
    let outcome = solved.and_then(|text| {
        let solved = read(&text).ok_or_else(|| String::from("the solution is no curve"))?;
        Ok((solved, text))
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

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::collections::HashMap;
    use std::rc::Rc;

    use super::*;
    use crate::mechanics::{MicrochannelSection, SectionShape};

    /// Answers every question with the same words, and counts them.
    #[derive(Clone)]
    struct Thirds(Rc<Cell<usize>>, Result<&'static str, &'static str>);

    impl Solver for Thirds {
        fn answer(
            &self,
            _question: &Question,
            progress: &mut dyn FnMut(f64),
        ) -> Result<String, String> {
            self.0.set(self.0.get() + 1);
            progress(0.5);
            self.1.map(str::to_owned).map_err(str::to_owned)
        }
    }

    struct Memory {
        solver: Thirds,
        texts: HashMap<String, String>,
        unreadable: usize,
    }

    impl Memory {
        fn with(answer: Result<&'static str, &'static str>) -> Self {
            Self {
                solver: Thirds(Rc::default(), answer),
                texts: HashMap::new(),
                unreadable: 0,
            }
        }

        fn solved(&self) -> usize {
            self.solver.0.get()
        }
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

        fn solver(&self) -> Option<Box<dyn Solver>> {
            Some(Box::new(self.solver.clone()))
        }
    }

    const THIRD: &str = "[0.3333333333333333]";

    fn question() -> Question {
        Question {
            what: String::from("a third"),
            statement: String::from("of = 1"),
            of: Asked::Cell(CellGeometry {
                section: MicrochannelSection {
                    width: 1.0,
                    height: 1.0,
                    shape: SectionShape::Rectangle,
                },
                roof: 1.0,
                thickness: 3.0,
                pitch: 2.0,
            }),
        }
    }

    fn ask(solutions: &mut dyn Solutions) -> Result<Vec<f64>, Unsolved> {
        answer(&question(), solutions, |numbers: &Vec<f64>| {
            numbers.len() == 1
        })
    }

    #[test]
    fn a_question_is_solved_once() {
        let mut memory = Memory::with(Ok(THIRD));
        let first = ask(&mut memory);
        assert_eq!(first, Ok(vec![1.0 / 3.0]));
        assert_eq!(first, ask(&mut memory));
        assert_eq!(memory.solved(), 1);
        assert_eq!(memory.texts["of = 1"], THIRD);
    }

    #[test]
    fn that_a_question_has_no_solution_is_kept() {
        let mut memory = Memory::with(Err("it folds over itself"));
        let failed = Err(Unsolved::Failed(String::from("it folds over itself")));
        assert_eq!(
            [ask(&mut memory), ask(&mut memory)],
            [failed.clone(), failed]
        );
        assert_eq!((memory.solved(), memory.unreadable), (1, 0));
    }

    #[test]
    fn what_is_no_solution_is_solved_anew() {
        let mut memory = Memory::with(Ok(THIRD));
        for text in ["", "[1.0,", "[]", "{}"] {
            memory.keep(&question(), text);
            assert_eq!(ask(&mut memory), Ok(vec![1.0 / 3.0]));
        }
        assert_eq!((memory.solved(), memory.unreadable), (4, 4));
    }

    #[test]
    fn an_answer_that_is_no_solution_is_none() {
        let mut memory = Memory::with(Ok("[]"));
        let refused = Unsolved::Failed(String::from("the solution is no curve"));
        assert_eq!(ask(&mut memory), Err(refused));
    }

    #[test]
    fn tables_alone_solve_nothing() {
        assert_eq!(ask(&mut TablesOnly), Err(Unsolved::TablesOnly));
    }
}
