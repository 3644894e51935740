//! B5 and B6: layers bonded to stiff plates, in large and in small compression.

use super::tools::{
    UNIT_RUBBER, body, eager, from_start, load_to, mapped, node_near, plane, towards_end,
};
use super::{Case, Effort};
use crate::material::{Material, Volumetric};
use crate::mesh::Axis;
use crate::problem::Kinematics;
use crate::problem::{Motion, Problem, Rule};
use crate::solver::failure::Failure;
use crate::solver::newton::Solver;

/// Compression over the thickness, and the stretch along the plane without shear.
const ROWS: [(f64, f64); 5] = [
    (0.01, 1.01518968),
    (0.02, 1.03076766),
    (0.05, 1.07997305),
    (0.10, 1.17117488),
    (0.15, 1.27590565),
];

/// A long strip of height one: bonded below, free of shear above, pressed by its top.
fn strip(half_length: f64, cells: usize) -> Result<Problem, Failure> {
    let size = 1.0 / cells as f64;
    let along = Axis::new(&[0.0, half_length], &[towards_end(size, 1.2, 2.0 * size)])?;
    let up = Axis::new(&[0.0, 1.0], &[from_start(0.5 * size, 1.2, size)])?;
    // The ends have a foot: a right angle would fold as the end bulges.
    let mesh = mapped(plane(along, up)?, |[x, y, _]| {
        [x * (1.0 + (1.0 - y) / half_length), y, 0.0]
    });
    let mut problem = body(mesh, Kinematics::PlaneStrain, UNIT_RUBBER)?;
    problem.clamp("bottom")?;
    problem.support("left", 0, Motion::Fixed)?;
    let travel = problem.parameter("compression", Rule::Given);
    problem.support("top", 1, Motion::Driven(travel, -1.0))?;
    Ok(problem)
}

pub(super) fn compressed(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    case.note = String::from(
        "The closed form holds away from the ends; what they disturb dies out within \
                 their distance over the thickness. The strip is four times as long as high to \
                 each side and the stretch is read half a height from its middle. The \
                 bonded ends lose their stability near a compression of 0.08: the row above it is \
                 an equilibrium that is not stable there. Beyond the rows the ends fold.",
    );
    let (cells, rows) = match effort {
        Effort::Full => (10, &ROWS[..4]),
        Effort::Short => (6, &ROWS[..3]),
    };
    let mut solver = Solver::new(strip(4.0, cells)?)?;
    case.sized(&solver);
    let mesh = &solver.problem().mesh;
    let node = node_near(mesh, [0.5, 1.0, 0.0]) as usize;
    let place = mesh.points[node][0];
    for (compression, stretch) in rows {
        // The ends lose their stability on the way to the last row; the middle is not
        // affected.
        solver.settings.stable = *compression < 0.08;
        load_to(&mut solver, &[*compression])?;
        let ours = 1.0 + solver.state().displacement[node][0] / place;
        let what = format!("stretch where no shear acts, compression {compression}");
        case.relative(what, *stretch, ours, 1e-4);
    }
    Ok(())
}

/// Modulus of a bonded block of half width (radius) one, in shear moduli. The shape
/// factor is loaded over free area.
fn modulus(
    case: &mut Case,
    kinematics: Kinematics,
    shape_factor: f64,
    volumetric: Volumetric,
    cells: usize,
) -> Result<f64, Failure> {
    let thickness = match kinematics {
        Kinematics::Axisymmetric => 1.0 / (2.0 * shape_factor),
        _ => 1.0 / shape_factor,
    };
    // The middle plane is one of symmetry.
    let (half, size) = (thickness / 2.0, thickness / 2.0 / cells as f64);
    let along = Axis::new(&[0.0, 1.0], &[towards_end(0.1 * size, 1.5, 0.05)])?;
    let up = Axis::new(&[0.0, half], &[towards_end(0.1 * size, 1.5, size)])?;
    let material = Material {
        volumetric,
        ..UNIT_RUBBER
    };
    let mut problem = body(plane(along, up)?, kinematics, material)?;
    problem.support("left", 0, Motion::Fixed)?;
    problem.support("bottom", 1, Motion::Fixed)?;
    problem.support("top", 0, Motion::Fixed)?;
    let travel = problem.parameter("travel", Rule::Given);
    problem.support("top", 1, Motion::Driven(travel, -1.0))?;
    let mut solver = eager(problem)?;
    case.sized(&solver);
    // Shear strains are this times the square of the shape factor: small, but well above
    // the rounding of thin cells. The force is in error by the square of the tolerance.
    let strain = 3e-3 / (shape_factor * shape_factor);
    solver.settings.tolerance = 3e-5;
    load_to(&mut solver, &[strain * half])?;
    let area = match kinematics {
        Kinematics::Axisymmetric => std::f64::consts::PI,
        _ => 1.0,
    };
    Ok(solver.evaluate()?.along[0] / area / strain)
}

/// Limit for a large shape factor `S` from the values at `S`, `2 S`, `4 S`, whose errors
/// are powers of `1/S`.
fn limit(values: [f64; 3]) -> f64 {
    let [a, b, c] = values;
    let (first, second) = (2.0 * b - a, 2.0 * c - b);
    (4.0 * second - first) / 3.0
}

pub(super) fn small(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let cells = if effort == Effort::Full { 8 } else { 4 };
    // Ratio to 4 G S^2 and 6 G S^2 at a bulk modulus of 1000 G: the shape factor it is
    // listed for, strip, disc.
    let table: &[(f64, f64, f64)] = match effort {
        Effort::Full => &[
            (5.0, 0.892992, 0.834169),
            (10.0, 0.676867, 0.560939),
            (20.0, 0.346773, 0.249925),
        ],
        Effort::Short => &[(10.0, 0.676867, 0.560939)],
    };
    let mut errors = Vec::new();
    for (name, kinematics, factor, column) in [
        ("strip", Kinematics::PlaneStrain, 4.0, 0),
        ("disc", Kinematics::Axisymmetric, 6.0, 1),
    ] {
        let shapes = [20.0, 40.0, 80.0];
        let mut found = [0.0; 3];
        for (found, s) in found.iter_mut().zip(shapes) {
            let e = modulus(case, kinematics, s, Volumetric::Incompressible, cells)?;
            *found = e / (factor * s * s);
        }
        let what = format!("{name} that keeps its volume: modulus over the formula, large S");
        case.relative(what, 1.0, limit(found), 1e-3);
        for &(listed, strip, disc) in table {
            let outside = [strip, disc][column];
            for (found, s) in found.iter_mut().zip(shapes) {
                // The pressure solution knows G S^2 / K alone.
                let bulk = 1000.0 * (s / listed) * (s / listed);
                let e = modulus(case, kinematics, s, Volumetric::Quadratic(bulk), cells)?;
                *found = e / (factor * s * s);
            }
            let what = format!("{name}, G S^2/K of S = {listed}, K = 1000 G: ratio, large S");
            case.relative(what, outside, limit(found), 1e-3);
            let bulk = Volumetric::Quadratic(1000.0);
            let e = modulus(case, kinematics, listed, bulk, cells)?;
            let off = 100.0 * (e / (factor * listed * listed) / outside - 1.0);
            errors.push(format!("{name} S = {listed}: {off:+.1} %"));
        }
    }
    case.note = format!(
        "The formulas are theories of thin blocks: they leave out the free edge and the \
         stretching of the block, of the order 1/S. Compared is the limit of solutions at S = 20, \
         40, 80. What the solution at S itself and K = 1000 G lies above the formula is the \
         theory's error: {}.",
        errors.join(", ")
    );
    Ok(())
}
