//! The question for the answers of a body over its load.

use super::{Asked, Question, Solutions, Unsolved, answer};
use crate::of_drawing::{SOLVER_VERSION, digits};
use crate::transduction::{ResponseFile, ResponseTable};

/// Raised whenever points, steps or outputs of the solution change.
const METHOD: u32 = 1;

/// A problem file and its mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyFiles {
    /// Text of the problem file, with the law files that it names.
    pub text: String,
    /// Bytes of its mesh.
    pub mesh: Vec<u8>,
    /// SHA-256 of what the text describes and of the mesh; none where they are not at hand.
    pub identity: Option<[String; 2]>,
}

/// A parameter of a load with its range.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyLoad {
    /// Its name in the problem.
    pub name: String,
    /// SI unit of its values.
    pub unit: &'static str,
    /// Least and largest value, SI.
    pub range: [f64; 2],
}

/// An output of a problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BodyOutput {
    /// A column of its table.
    Column {
        /// Its name.
        name: String,
        /// SI unit of its values.
        unit: &'static str,
    },
    /// The capacitance between two electrodes, or from one to all others and to ground.
    Capacitance(Vec<String>),
}

/// What is asked of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyDrawing {
    /// Name of the problem file.
    pub problem: String,
    /// Its text and its mesh.
    pub files: BodyFiles,
    /// The parameters that are the load.
    pub loads: Vec<BodyLoad>,
    /// Name of the one that presses.
    pub pressing: String,
    /// The force.
    pub force: BodyOutput,
    /// 1 or -1: what makes it positive.
    pub sign: f64,
    /// Names and outputs of the channels.
    pub channels: Vec<(String, BodyOutput)>,
    /// Largest error, as a share of the range of each output.
    pub tolerance: f64,
}

impl BodyOutput {
    fn words(&self) -> String {
        match self {
            Self::Column { name, .. } => name.clone(),
            Self::Capacitance(electrodes) => {
                format!("capacitance of {}", electrodes.join(" and "))
            }
        }
    }

    /// SI unit of its values.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Column { unit, .. } => unit,
            Self::Capacitance(_) => "F",
        }
    }
}

impl BodyDrawing {
    /// All that a table of it follows from, as `key = value`.
    pub fn lines(&self) -> Vec<String> {
        let [problem, mesh] = self.files.identity.clone().unwrap_or_default();
        let mut lines = vec![
            "solution = outputs of a body over its load".into(),
            format!("solver = taxel-fem {SOLVER_VERSION} method {METHOD}"),
            format!("{PROBLEM}{problem}"),
            format!("{MESH}{mesh}"),
        ];
        lines.extend(self.loads.iter().map(|load| {
            let [low, high] = load.range.map(digits);
            format!("load {} = {low} to {high} {}", load.name, load.unit)
        }));
        lines.push(format!("pressing = {}", self.pressing));
        lines.push(format!(
            "force = {} times {}",
            self.force.words(),
            self.sign
        ));
        let channels = self.channels.iter().enumerate();
        lines.extend(
            channels.map(|(number, (_, output))| format!("channel {number} = {}", output.words())),
        );
        lines
    }

    /// The first of the lines of a table that is not that of this body, in words; `None` if all are.
    pub fn differs(&self, table: &[String]) -> Option<String> {
        let here = self.lines();
        let skipped = |line: &String| {
            self.files.identity.is_none() && [PROBLEM, MESH].iter().any(|key| line.starts_with(key))
        };
        let none = || String::from("nothing");
        (0..here.len().max(table.len())).find_map(|at| {
            let (own, other) = (here.get(at), table.get(at));
            if own == other || own.is_some_and(skipped) {
                return None;
            }
            let [own, other] = [own, other].map(|line| line.cloned().unwrap_or_else(none));
            Some(format!(
                "it belongs to another body: there {other}, here {own}"
            ))
        })
    }

    /// The table of the body: what was kept, or what the solver finds.
    ///
    /// # Errors
    /// [`Unsolved`].
    pub fn answer(self, solutions: &mut dyn Solutions) -> Result<ResponseTable, Unsolved> {
        let question = self.question();
        let file: ResponseFile = answer(&question, solutions, |file: &ResponseFile| {
            ResponseTable::new(file.clone()).is_some()
        })?;
        // A file that is no table was refused.
        ResponseTable::new(file).ok_or_else(|| Unsolved::Failed("the solution is no table".into()))
    }

    /// The question for its table.
    pub fn question(self) -> Question {
        let tolerance = digits(self.tolerance);
        Question {
            what: format!("table of the body {}", self.problem),
            statement: format!("{}\ntolerance = {tolerance}\n", self.lines().join("\n")),
            of: Asked::Body(Box::new(self)),
        }
    }
}

const PROBLEM: &str = "problem = ";
const MESH: &str = "mesh = ";
