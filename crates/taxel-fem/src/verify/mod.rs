//! Cases with an answer from outside: closed forms, published numbers, other programs.
//!
//! Each case solves its problem with this library and puts what it finds beside what
//! is known. It reads no clock and no file: who runs the cases may measure them.

mod bonded;
mod cook;
mod fields;
mod friction;
mod homogeneous;
mod indentation;
mod inf_sup;
mod joints;
mod limits;
mod manufactured;
mod patch;
mod pressurised;
mod scaling;
mod sliding;
mod slit;
mod surfaces;
mod tools;
mod torsion;

use crate::mesh::MeshError;
use crate::problem::ProblemError;
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::Continue;

/// Where the answer of a case comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A closed form, or an equation solved to more digits than are compared.
    Exact,
    /// Numbers printed elsewhere.
    Published,
    /// Numbers of a program that shares no code with this one.
    IndependentProgram,
    /// Earlier result of this library: it shows changes, and proves nothing.
    OwnRegression,
}

impl Kind {
    /// All kinds, the strongest first.
    pub const ALL: [Self; 4] = [
        Self::Exact,
        Self::Published,
        Self::IndependentProgram,
        Self::OwnRegression,
    ];

    /// Name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact solution",
            Self::Published => "published number",
            Self::IndependentProgram => "independent program",
            Self::OwnRegression => "own earlier result",
        }
    }

    /// Name in files.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Published => "published",
            Self::IndependentProgram => "independent_program",
            Self::OwnRegression => "own_regression",
        }
    }
}

/// Effort of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Coarser meshes and fewer rows; every case is tried.
    Short,
    /// All rows, each to its own tolerance.
    Full,
}

/// Allowed difference of our number from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// Share of the outside number.
    Relative(f64),
    /// In the unit of the quantity.
    Absolute(f64),
}

/// A number from outside beside ours.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Quantity that is compared.
    pub what: String,
    /// The number from outside.
    pub outside: f64,
    /// The number found here.
    pub ours: f64,
    /// Allowed difference.
    pub tolerance: Tolerance,
    /// Unit of both numbers, SI; empty for a plain number.
    pub unit: &'static str,
}

impl Compared {
    /// Distance of ours from outside, in the sense of the tolerance.
    pub fn difference(&self) -> f64 {
        match self.tolerance {
            Tolerance::Relative(_) => self.ours / self.outside - 1.0,
            Tolerance::Absolute(_) => self.ours - self.outside,
        }
    }

    /// True if ours lies within the tolerance; what is not a number does not.
    pub fn holds(&self) -> bool {
        let (Tolerance::Relative(limit) | Tolerance::Absolute(limit)) = self.tolerance;
        self.difference().abs() <= limit
    }
}

/// Errors on a sequence of meshes.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// Quantity that is in error.
    pub what: String,
    /// Size of the cells (a share of the body) and error (a share of the answer).
    pub points: Vec<(f64, f64)>,
}

impl Refinement {
    /// Slope of the error over the size between the two finest meshes, in powers; none
    /// with fewer than two errors above zero.
    pub fn slope(&self) -> Option<f64> {
        let [.., coarse, fine] = self.points.as_slice() else {
            return None;
        };
        let slope = (coarse.1 / fine.1).ln() / (coarse.0 / fine.0).ln();
        slope.is_finite().then_some(slope)
    }
}

/// Result of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Short name, such as `B2`.
    pub id: &'static str,
    /// Problem that is solved.
    pub title: &'static str,
    /// Where the answer comes from.
    pub kind: Kind,
    /// Numbers side by side.
    pub quantities: Vec<Compared>,
    /// Cells and displacement unknowns of the finest mesh.
    pub mesh: (usize, usize),
    /// Errors on sequences of meshes.
    pub refinement: Vec<Refinement>,
    /// Remark that is needed to judge the numbers; may be empty.
    pub note: String,
    /// Time it took, for the caller to fill in.
    pub seconds: Option<f64>,
}

impl Case {
    fn new(entry: &Entry) -> Self {
        Self {
            id: entry.id,
            title: entry.title,
            kind: entry.kind,
            quantities: Vec::new(),
            mesh: (0, 0),
            refinement: Vec::new(),
            note: String::new(),
            seconds: None,
        }
    }

    /// True if every number is within its tolerance, and there is one.
    pub fn holds(&self) -> bool {
        !self.quantities.is_empty() && self.quantities.iter().all(Compared::holds)
    }

    fn relative(&mut self, what: impl Into<String>, outside: f64, ours: f64, limit: f64) {
        self.compare(what, outside, ours, Tolerance::Relative(limit), "");
    }

    fn absolute(&mut self, what: impl Into<String>, outside: f64, ours: f64, limit: f64) {
        self.compare(what, outside, ours, Tolerance::Absolute(limit), "");
    }

    fn compare(
        &mut self,
        what: impl Into<String>,
        outside: f64,
        ours: f64,
        tolerance: Tolerance,
        unit: &'static str,
    ) {
        self.quantities.push(Compared {
            what: what.into(),
            outside,
            ours,
            tolerance,
            unit,
        });
    }

    /// Keeps the size of the largest mesh.
    fn sized(&mut self, solver: &crate::solver::newton::Solver) {
        self.mesh = self
            .mesh
            .max((solver.problem().mesh.cell_count(), solver.unknowns()));
    }
}

/// A case that can be run.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Short name, such as `B2`.
    pub id: &'static str,
    /// Problem that is solved.
    pub title: &'static str,
    /// Where the answer comes from.
    pub kind: Kind,
    /// Rough share of the time of a full run, for estimates.
    pub work: f64,
    solve: fn(&mut Case, Effort) -> Result<(), Failure>,
}

impl Entry {
    /// Solves the case.
    ///
    /// # Errors
    /// When a problem of the case has no solution here.
    pub fn run(&self, effort: Effort) -> Result<Case, Failure> {
        let mut case = Case::new(self);
        (self.solve)(&mut case, effort)?;
        Ok(case)
    }

    /// True if a name means this case: its own, that of its family (`B7` of `B7.1`), or
    /// the letter of its group.
    pub fn is_meant_by(&self, name: &str) -> bool {
        let name = name.to_ascii_uppercase();
        match self.id.strip_prefix(name.as_str()) {
            Some("") => true,
            Some(rest) => name.len() == 1 || rest.starts_with('.'),
            None => false,
        }
    }
}

macro_rules! entries {
    ($($id:literal, $kind:ident, $work:literal, $solve:path, $title:literal;)*) => {
        /// All cases in their order. A further group is a further line for each case.
        pub const ENTRIES: &[Entry] = &[$(Entry {
            id: $id,
            title: $title,
            kind: Kind::$kind,
            work: $work,
            solve: $solve,
        }),*];
    };
}

entries! {
    "A", Exact, 1.0, homogeneous::solve, "Homogeneous states of every law";
    "B1", Exact, 3.0, pressurised::balloon, "Thin spherical balloon past its limit point";
    "B2", Exact, 6.0, pressurised::sphere, "Thick sphere under internal pressure";
    "B3", Exact, 4.0, pressurised::cylinder, "Thick cylinder under internal pressure, plane strain";
    "B4", Exact, 6.0, torsion::solve, "Torsion of a solid cylinder";
    "B5", Exact, 4.0, bonded::compressed, "Bonded layer in large compression";
    "B6", Published, 6.0, bonded::small, "Bonded strips and discs at small strain";
    "B7.1", Published, 4.0, cook::compressible, "Cook's membrane, compressible";
    "B7.2", IndependentProgram, 8.0, cook::nearly_incompressible, "Cook's membrane, nearly incompressible";
    "B7.3", IndependentProgram, 4.0, cook::stiff, "Cook's membrane, the third set of data";
    "B9", Exact, 20.0, manufactured::solve, "Manufactured solutions: rates of convergence";
    "B10.1", Exact, 1.0, patch::solve, "Patch tests at finite stretch on distorted meshes";
    "B10.2", Exact, 10.0, inf_sup::solve, "Inf-sup constant under refinement";
    "B10.3", Exact, 2.0, patch::periodic, "Periodic cell at finite stretch on distorted meshes";
    "B11", Exact, 1.0, limits::light, "The lightest loads, and the linear response at rest";
    "B12", Exact, 1.0, limits::closed_mould, "Closed mould, with and without room for its volume";
    "B13", Exact, 1.0, limits::creep, "Creep under a held load in one call";
    "B14", IndependentProgram, 3.0, limits::free_ends, "Bonded layer with free ends";
    "B15", Exact, 1.0, limits::follower, "Pressure on a face that ends at a free one";
    "B16", IndependentProgram, 1.0, limits::strip, "Strip of pressure on a bonded layer";
    "B17", Exact, 3.0, joints::bending, "Strip bent by a torque on its rigid end";
    "B18", Exact, 4.0, joints::torsion, "Cylinder between rigid plates under a torque";
    "C1", Exact, 3.0, indentation::hertz, "Sphere on a half space (Hertz)";
    "C2", Exact, 10.0, indentation::punch, "Flat punch on a bonded layer";
    "C3", Exact, 10.0, indentation::sphere_on_layer, "Sphere on a bonded layer";
    "C4.1", Exact, 3.0, friction::cylinder, "Rough cylinder pulled along a half space (Cattaneo, Mindlin)";
    "C4.2", Exact, 40.0, friction::sphere, "Rough sphere pulled along a half space (Cattaneo, Mindlin)";
    "C4.3", Exact, 1.0, friction::dragged, "Block dragged over a rough plane";
    "C5", Exact, 2.0, slit::solve, "Slit under pressure";
    "C6.1", Exact, 2.0, surfaces::patch, "Contact patch test: meshes that do not match";
    "C6.2", Exact, 5.0, surfaces::hertz, "Two round bodies (Hertz)";
    "C6.3", Exact, 3.0, surfaces::mirror, "A body against its mirror image";
    "C6.4", Exact, 3.0, surfaces::slit, "Slit whose walls meet";
    "C6.5", Exact, 1.0, surfaces::dragged, "Block dragged over a rough block";
    "C6.6", Exact, 1.0, surfaces::tied, "Tied blocks whose meshes do not match";
    "C6.7", Exact, 1.0, sliding::carried, "Smooth block carried over a block without end";
    "C6.8", Exact, 10.0, sliding::ironing, "Ironing: a round indenter drawn along a slab";
    "D1", Exact, 3.0, fields::coplanar_strips, "Coplanar strips in an open space";
    "D2", Exact, 3.0, fields::opposed_strips, "Opposed strips in an open space";
    "D3", Exact, 3.0, fields::coaxial_discs, "Coaxial discs in an open space";
    "D4", Exact, 2.0, fields::isolated, "Isolated sphere and disc";
    "D5", Exact, 1.0, scaling::solve, "Capacitance and resistance of a homogeneously stretched body";
    "D6", Exact, 3.0, fields::ground_to_infinity, "Strip above a ground plane that reaches infinity";
    "D7", Exact, 1.0, fields::corner_square, "Corner square of a conductor";
}

/// Event while cases run.
#[derive(Debug)]
pub enum Event<'a> {
    /// A case begins.
    Begins {
        /// The case.
        entry: &'static Entry,
        /// Share of the work that is done, 0 to 1.
        done: f64,
    },
    /// A case has ended; its time may be filled in.
    Ended(&'a mut Outcome),
}

/// A case with what became of it.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The case.
    pub entry: &'static Entry,
    /// Result of the case.
    pub result: Result<Case, Failure>,
}

impl Outcome {
    /// True if the case was solved and all its numbers are within tolerance.
    pub fn holds(&self) -> bool {
        self.result.as_ref().is_ok_and(Case::holds)
    }
}

/// A name that means no case.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no case {name:?}; give a letter or one of {}", known())]
pub struct UnknownCase {
    /// The name.
    pub name: String,
}

fn known() -> String {
    let ids: Vec<&str> = ENTRIES.iter().map(|entry| entry.id).collect();
    ids.join(", ")
}

/// The cases that these names mean, in the order of [`ENTRIES`]; all without names.
///
/// # Errors
/// When a name means no case.
pub fn chosen(names: &[&str]) -> Result<Vec<&'static Entry>, UnknownCase> {
    let meant = |name: &str| ENTRIES.iter().any(|entry| entry.is_meant_by(name));
    if let Some(name) = names.iter().find(|name| !meant(name)) {
        let name = (*name).to_owned();
        return Err(UnknownCase { name });
    }
    let wanted =
        |entry: &&Entry| names.is_empty() || names.iter().any(|name| entry.is_meant_by(name));
    Ok(ENTRIES.iter().filter(wanted).collect())
}

/// Runs the cases that `only` means (all without names); `progress` hears of each and
/// may stop the run after a case that has ended. A case that fails does not end the run.
///
/// # Errors
/// When a name means no case.
///
/// # Example
/// ```
/// use taxel_fem::solver::newton::Continue;
/// use taxel_fem::verify::{Effort, Event, run};
/// let mut ended = 0;
/// let outcomes = run(Effort::Short, &["A"], &mut |event| {
///     ended += usize::from(matches!(event, Event::Ended(_)));
///     Continue::Yes
/// })?;
/// assert!(outcomes.len() == ended && outcomes[0].holds());
/// # Ok::<(), taxel_fem::verify::UnknownCase>(())
/// ```
pub fn run(
    effort: Effort,
    only: &[&str],
    progress: &mut dyn FnMut(Event<'_>) -> Continue,
) -> Result<Vec<Outcome>, UnknownCase> {
    let entries = chosen(only)?;
    let all: f64 = entries.iter().map(|entry| entry.work).sum();
    let mut done = 0.0;
    let mut outcomes = Vec::new();
    for entry in entries {
        progress(Event::Begins {
            entry,
            done: done / all,
        });
        let result = entry.run(effort);
        let mut outcome = Outcome { entry, result };
        let next = progress(Event::Ended(&mut outcome));
        outcomes.push(outcome);
        if next == Continue::Stop {
            break;
        }
        done += entry.work;
    }
    Ok(outcomes)
}

impl From<ProblemError> for Failure {
    fn from(error: ProblemError) -> Self {
        Self::at_start(error.into())
    }
}

impl From<MeshError> for Failure {
    fn from(error: MeshError) -> Self {
        Self::at_start(Reason::Mesh(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_means_itself_its_family_or_its_group() {
        let ids = |name| -> Vec<&str> {
            let entries = chosen(&[name]).unwrap_or_default();
            entries.iter().map(|entry| entry.id).collect()
        };
        assert_eq!(ids("B1"), ["B1"]);
        assert_eq!(ids("b7"), ["B7.1", "B7.2", "B7.3"]);
        let contact = ["C1", "C2", "C3", "C4.1", "C4.2", "C4.3", "C5"];
        assert_eq!(ids("C")[..7], contact);
        assert!(ids("C")[7..].iter().all(|id| id.starts_with("C6.")));
        assert!(chosen(&["B2", "Z"]).is_err() && chosen(&[""]).is_err());
    }

    #[test]
    fn a_run_that_is_stopped_keeps_what_has_ended() {
        let stop = &mut |event: Event<'_>| match event {
            Event::Begins { .. } => Continue::Yes,
            Event::Ended(_) => Continue::Stop,
        };
        let outcomes = run(Effort::Short, &["A", "B"], stop).unwrap_or_default();
        let ids: Vec<&str> = outcomes.iter().map(|outcome| outcome.entry.id).collect();
        assert_eq!(ids, ["A"]);
    }

    #[test]
    fn what_is_not_a_number_does_not_hold() {
        let mut case = Case::new(&ENTRIES[0]);
        assert!(!case.holds());
        case.relative("x", 1.0, f64::NAN, 1.0);
        assert!(!case.holds());
    }

    #[test]
    fn the_slope_is_that_of_the_two_finest_meshes() {
        let points = vec![(1.0, 5.0), (0.5, 0.4), (0.25, 0.05)];
        let refinement = Refinement {
            what: String::new(),
            points,
        };
        assert!((refinement.slope().unwrap_or(0.0) - 3.0).abs() < 1e-12);
    }
}
