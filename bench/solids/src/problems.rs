//! The two problems that all programs solve, lengths and stresses as they state them.

use std::error::Error;

use taxel_fem::material::{Law, Material, Volumetric};
use taxel_fem::mesh::{Axis, Grading, Grid2, Grid3, Mesh};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::{Cavity, Motion, Pressure, Problem, Rule};
use taxel_fem::solver::newton::{Continue, Settings, Solver};

const RUBBER: Law = Law::MooneyRivlin {
    c10: 75.5,
    c01: 5.7,
};

/// Travel of the plate of the block, mm.
const TRAVEL: f64 = -0.1;

/// One of the problems.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Case {
    /// Half of a layer with an empty void under a follower pressure, plane strain:
    /// 300 x 500 um, void 200 x 40 um; squares of 20/k um.
    A,
    /// A block of 1 x 1 x 0.5 mm squeezed by 20 % between bonded plates: n x n x n/2 cubes.
    B,
}

impl Case {
    pub(crate) fn named(name: &str) -> Result<Self, String> {
        match name {
            "A" => Ok(Self::A),
            "B" => Ok(Self::B),
            _ => Err(format!("no problem {name:?}: A or B")),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// Division of the way to the load.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Steps {
    /// As in the other programs: 5 equal steps for A, 2 for B, each from the last state.
    Fixed,
    /// As the solver chooses.
    Own,
}

impl Steps {
    pub(crate) fn settings(self, case: Case) -> Settings {
        let size = match case {
            Case::A => 0.2,
            Case::B => 0.5,
        };
        match self {
            Self::Fixed => Settings {
                first_step: size,
                largest_step: size,
                extrapolate: false,
                ..Settings::default()
            },
            Self::Own => Settings::default(),
        }
    }
}

/// Result of a solution.
pub(crate) struct Solution {
    pub(crate) unknowns: usize,
    pub(crate) steps: usize,
    pub(crate) iterations: usize,
    /// Area ratio of the void, or force on the plate in mN.
    pub(crate) result: f64,
}

fn rubber() -> Material {
    let bulk = 1000.0 * RUBBER.shear_modulus();
    Material::new(RUBBER, Volumetric::Quadratic(bulk)).expect("its constants are positive")
}

/// Mesh of a problem.
pub(crate) fn mesh(case: Case, size: usize) -> Result<Mesh, Box<dyn Error>> {
    let axis = |places: &[f64], cells: &[usize]| {
        let gradings: Vec<Grading> = cells.iter().map(|&n| Grading::Uniform(n)).collect();
        Axis::new(places, &gradings)
    };
    Ok(match case {
        Case::A => Grid2::new(
            [
                axis(&[0.0, 200.0, 300.0], &[10 * size, 5 * size])?,
                axis(
                    &[0.0, 340.0, 380.0, 500.0],
                    &[17 * size, 2 * size, 6 * size],
                )?,
            ],
            "solid",
        )
        .void("void", [[0.0, 200.0], [340.0, 380.0]])
        .mesh()?,
        Case::B => Grid3::new(
            [
                axis(&[0.0, 1.0], &[size])?,
                axis(&[0.0, 1.0], &[size])?,
                axis(&[0.0, 0.5], &[size / 2])?,
            ],
            "solid",
        )
        .mesh()?,
    })
}

/// A problem on its mesh.
pub(crate) fn problem(case: Case, mesh: Mesh) -> Result<Problem, Box<dyn Error>> {
    let kinematics = match case {
        Case::A => Kinematics::PlaneStrain,
        Case::B => Kinematics::Solid,
    };
    let mut problem = Problem::new(mesh, kinematics)?;
    problem.materials.push(rubber());
    problem.clamp("bottom")?;
    match case {
        Case::A => {
            problem.support("left", 0, Motion::Fixed)?;
            problem.support("right", 0, Motion::Fixed)?;
            let outside = problem.parameter("pressure", Rule::Given);
            let inside = problem.parameter("inside", Rule::Given);
            problem.pressures.push(Pressure {
                surface: problem.surface("top")?,
                parameter: outside,
            });
            problem.cavities.push(Cavity {
                wall: problem.surface("void")?,
                axis: 0,
                origin: 0.0,
                pressure: inside,
            });
        }
        Case::B => {
            problem.support("top", 0, Motion::Fixed)?;
            problem.support("top", 1, Motion::Fixed)?;
            let travel = problem.parameter("travel", Rule::Given);
            problem.support("top", 2, Motion::Driven(travel, 1.0))?;
        }
    }
    Ok(problem)
}

/// Where the load leads: pressures in kPa, or the travel in mm.
pub(crate) fn targets(case: Case, pressure: f64) -> Vec<f64> {
    match case {
        Case::A => vec![pressure, 0.0],
        Case::B => vec![TRAVEL],
    }
}

/// Area of the void before any load, um^2.
pub(crate) const VOID: f64 = 8000.0;

/// Solves a problem from its mesh to the full load.
pub(crate) fn solve(
    case: Case,
    mesh: Mesh,
    steps: Steps,
    pressure: f64,
) -> Result<Solution, Box<dyn Error>> {
    let mut solver = Solver::new(problem(case, mesh)?)?;
    solver.settings = steps.settings(case);
    let mut count = 0;
    solver.load_to(&targets(case, pressure), |_, _| {
        count += 1;
        Continue::Yes
    })?;
    let end = solver.evaluate()?;
    Ok(Solution {
        unknowns: solver.unknowns(),
        steps: count,
        iterations: solver.iterations,
        result: match case {
            Case::A => end.volumes[0] / VOID,
            Case::B => end.along[0],
        },
    })
}
