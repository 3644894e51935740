//! A: homogeneous states of a cube of cells, for every law.

use super::tools::{body, drive, eager, load_to, unit_body};
use super::{Case, Effort};
use crate::material::homogeneous::Mode;
use crate::material::{Dual, EnergyFunction, Law, Material, OgdenTerm, Volumetric};
use crate::mesh::{CellShape, Mesh};
use crate::problem::Kinematics;
use crate::problem::{Motion, Problem, Rule};
use crate::solver::failure::Failure;
use crate::solver::stress::stress_points;

const fn term(modulus: f64, exponent: f64) -> OgdenTerm {
    OgdenTerm { modulus, exponent }
}

/// Each law with the stretch it is tried at. The last one is no law of large strain.
const LAWS: [(&str, Law, f64); 7] = [
    ("neo-Hookean", Law::MooneyRivlin { c10: 1.0, c01: 0.0 }, 1.5),
    (
        "Mooney-Rivlin",
        Law::MooneyRivlin { c10: 1.0, c01: 1.0 },
        1.5,
    ),
    (
        "Yeoh",
        Law::Yeoh {
            c10: 0.18229,
            c20: -0.002148,
            c30: 5.1e-5,
        },
        2.0,
    ),
    (
        "Ogden",
        Law::Ogden {
            terms: [
                term(0.63, 1.3),
                term(0.0012, 5.0),
                term(-0.01, -2.0),
                term(0.0, 1.0),
            ],
        },
        1.8,
    ),
    ("linear elastic", Law::LinearElastic { shear: 1.0 }, 1.2),
    (
        "Gent",
        Law::Gent {
            shear: 1.0,
            limit: GENT,
        },
        2.0,
    ),
    (
        "Gent, as a function",
        Law::Energy(EnergyFunction::new(gent)),
        2.0,
    ),
];

/// Where Gent's law stiffens without bound: `I1 - 3`.
const GENT: f64 = 30.0;

/// Gent's law (1996) of shear modulus one.
fn gent([first, _]: [Dual; 2]) -> Dual {
    -0.5 * GENT * (Dual::from(1.0) - (first - 3.0) * (1.0 / GENT)).ln()
}

/// Kirchhoff stress `l dW/dl` of a principal stretch, but for the pressure.
fn principal_stress(law: &Law, stretches: [f64; 3], axis: usize) -> f64 {
    let l = stretches[axis];
    let squares = stretches.map(|l| l * l);
    let first: f64 = squares.iter().sum();
    let invariants = |w1: f64, w2: f64| 2.0 * (w1 * l * l - w2 / (l * l));
    match *law {
        Law::MooneyRivlin { c10, c01 } => invariants(c10, c01),
        Law::Yeoh { c10, c20, c30 } => {
            let x = first - 3.0;
            invariants(c10 + 2.0 * c20 * x + 3.0 * c30 * x * x, 0.0)
        }
        Law::Ogden { terms } => terms.iter().map(|t| t.modulus * l.powf(t.exponent)).sum(),
        Law::LinearElastic { shear } => shear * l * l * (l * l - first / 3.0),
        Law::Gent { shear, limit } => {
            invariants(0.5 * shear * limit / (limit - (first - 3.0)), 0.0)
        }
        // Gent's is the only one.
        Law::Energy(_) => invariants(0.5 * GENT / (GENT - (first - 3.0)), 0.0),
    }
}

/// Nominal stress along the first axis, the third one free.
fn nominal_stress(law: &Law, mode: Mode, stretch: f64) -> f64 {
    let stretches = mode.stretches(stretch);
    let stress = |axis| principal_stress(law, stretches, axis);
    (stress(0) - stress(2)) / stretch
}

fn cube() -> Result<Mesh, Failure> {
    let mut mesh = unit_body(CellShape::Hex27, 1, |x| x)?;
    for (axis, [low, high]) in [["x0", "x1"], ["y0", "y1"], ["z0", "z1"]]
        .into_iter()
        .enumerate()
    {
        mesh.name_boundary(low, |x| x[axis] == 0.0);
        mesh.name_boundary(high, |x| x[axis] == 1.0);
    }
    Ok(mesh)
}

/// A cube on three planes of symmetry.
fn cornered(material: Material) -> Result<Problem, Failure> {
    let mut problem = body(cube()?, Kinematics::Solid, material)?;
    for (axis, side) in ["x0", "y0", "z0"].into_iter().enumerate() {
        problem.support(side, axis, Motion::Fixed)?;
    }
    Ok(problem)
}

/// Nominal stress of the cube along the first axis.
fn pulled(case: &mut Case, law: Law, mode: Mode, stretch: f64) -> Result<f64, Failure> {
    let mut problem = cornered(Material {
        law,
        volumetric: Volumetric::Incompressible,
    })?;
    let travel = problem.parameter("elongation", Rule::Given);
    problem.support("x1", 0, Motion::Driven(travel, 1.0))?;
    let faces = match mode {
        Mode::Uniaxial => 1.0,
        Mode::Equibiaxial => {
            problem.support("y1", 1, Motion::Driven(travel, 1.0))?;
            2.0
        }
        Mode::PureShear => {
            problem.support("y1", 1, Motion::Fixed)?;
            1.0
        }
    };
    let mut solver = eager(problem)?;
    solver.settings.tolerance = 1e-10;
    solver.settings.first_step = 0.25;
    load_to(&mut solver, &[stretch - 1.0])?;
    case.sized(&solver);
    Ok(solver.evaluate()?.along[0] / faces)
}

/// Shear stress and difference of normal stresses of simple shear.
fn sheared(law: Law, amount: f64) -> Result<[f64; 2], Failure> {
    let material = Material {
        law,
        volumetric: Volumetric::Incompressible,
    };
    let mut problem = body(cube()?, Kinematics::Solid, material)?;
    // The top stays free along its normal, else the pressure has no value.
    let shear = problem.parameter("shear", Rule::Given);
    for side in ["x0", "x1", "y0"] {
        let nodes = problem.mesh.nodes_of(side).unwrap_or_default();
        drive(&mut problem, &nodes, shear, |x| [amount * x[1], 0.0, 0.0]);
    }
    for side in ["z0", "z1"] {
        problem.support(side, 2, Motion::Fixed)?;
    }
    problem.support("y1", 0, Motion::Driven(shear, amount))?;
    let mut solver = eager(problem)?;
    solver.settings.tolerance = 1e-10;
    load_to(&mut solver, &[1.0])?;
    let points: Vec<_> = stress_points(solver.problem(), solver.state()).collect();
    let s = points[0].cauchy;
    Ok([s[3], s[0] - s[1]])
}

/// Mean stress of a cube that grows by a linear factor.
fn grown(volumetric: Volumetric, factor: f64) -> Result<f64, Failure> {
    let law = Law::MooneyRivlin { c10: 1.0, c01: 1.0 };
    let mut problem = cornered(Material { law, volumetric })?;
    let growth = problem.parameter("growth", Rule::Given);
    for (axis, side) in ["x1", "y1", "z1"].into_iter().enumerate() {
        problem.support(side, axis, Motion::Driven(growth, 1.0))?;
    }
    let mut solver = eager(problem)?;
    solver.settings.tolerance = 1e-10;
    load_to(&mut solver, &[factor - 1.0])?;
    Ok(solver.evaluate()?.along[0] / (3.0 * factor * factor))
}

pub(super) fn solve(case: &mut Case, _: Effort) -> Result<(), Failure> {
    // The pressure of a solid that keeps its volume is found with a stiffness of 1e5
    // shear moduli: rounding of the volume ratio weighs as much.
    let rounding = 1e-9;
    for (name, law, stretch) in LAWS {
        for mode in Mode::ALL {
            let what = format!("{name}, {mode} to {stretch}: nominal stress");
            let ours = pulled(case, law, mode, stretch)?;
            case.relative(what, nominal_stress(&law, mode, stretch), ours, rounding);
        }
    }
    let law = Law::MooneyRivlin { c10: 1.0, c01: 1.0 };
    let [shear, difference] = sheared(law, 0.5)?;
    case.relative("simple shear 0.5: shear stress", 2.0, shear, rounding);
    case.relative("simple shear 0.5: s11 - s22", 1.0, difference, rounding);
    let (factor, bulk) = (1.05_f64, 10.0);
    let j = factor.powi(3);
    for (name, volumetric, exact) in [
        ("quadratic", Volumetric::Quadratic(bulk), bulk * (j - 1.0)),
        (
            "logarithmic",
            Volumetric::Logarithmic(bulk),
            bulk / 2.0 * (j - 1.0 / j),
        ),
    ] {
        let what = format!("{name} volumetric law, growth by {factor}: mean stress");
        case.relative(what, exact, grown(volumetric, factor)?, rounding);
    }
    Ok(())
}
