//! B1 to B3: hollow spheres and cylinders under internal pressure.

use std::f64::consts::FRAC_PI_2;

use super::tools::{UNIT_RUBBER, body, load_to, mapped, node_near, plane};
use super::{Case, Effort, Refinement};
use crate::material::{Law, Material};
use crate::mesh::Axis;
use crate::problem::Kinematics;
use crate::problem::{Cavity, Motion, Parameter, Problem, Quantity, Rule};
use crate::solver::failure::Failure;
use crate::solver::newton::{Continue, Solver};

/// A quarter of a ring between two radii: of a sphere about the axis, or of a cylinder.
struct Ring {
    kinematics: Kinematics,
    radii: [f64; 2],
    /// Cells across and around.
    counts: [usize; 2],
    material: Material,
}

impl Ring {
    fn posed(&self, rule: Rule) -> Result<(Problem, Parameter), Failure> {
        let [inner, outer] = self.radii;
        let across = Axis::uniform(0.0, 1.0, self.counts[0])?;
        let around = Axis::uniform(0.0, FRAC_PI_2, self.counts[1])?;
        let mesh = mapped(plane(across, around)?, |[share, angle, _]| {
            // Equal ratios of radii: the field varies most inside.
            let r = inner * (outer / inner).powf(share);
            [r * angle.cos(), r * angle.sin(), 0.0]
        });
        let mut problem = body(mesh, self.kinematics, self.material)?;
        problem.support("bottom", 1, Motion::Fixed)?;
        problem.support("top", 0, Motion::Fixed)?;
        let pressure = problem.parameter("pressure", rule);
        let wall = problem.surface("left")?;
        problem.cavities.push(Cavity {
            wall,
            axis: 1,
            origin: 0.0,
            pressure,
        });
        Ok((problem, pressure))
    }

    /// Power of the stretch that the volume follows.
    fn power(&self) -> i32 {
        if self.kinematics == Kinematics::Axisymmetric {
            3
        } else {
            2
        }
    }
}

/// Pressures over the shear modulus at these stretches of the inner wall.
fn pressures(case: &mut Case, ring: &Ring, stretches: &[f64]) -> Result<Vec<f64>, Failure> {
    let (problem, _) = ring.posed(Rule::Prescribes(Quantity::Volume(0)))?;
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 0.25;
    case.sized(&solver);
    let rest = solver.evaluate()?.volumes[0];
    let mut found = Vec::new();
    for stretch in stretches {
        load_to(&mut solver, &[rest * stretch.powi(ring.power())])?;
        found.push(solver.state().parameters[0]);
    }
    Ok(found)
}

/// Stretch of the outer wall for that of the inner one.
fn outer_stretch(ring: &Ring, inner: f64) -> f64 {
    let power = ring.power();
    let share = (ring.radii[0] / ring.radii[1]).powi(power);
    (1.0 + (inner.powi(power) - 1.0) * share).powf(1.0 / f64::from(power))
}

/// Exact pressure over the shear modulus.
fn exact(ring: &Ring, inner: f64) -> f64 {
    let outer = outer_stretch(ring, inner);
    if ring.kinematics == Kinematics::Axisymmetric {
        let f = |l: f64| 2.0 / l + 0.5 / l.powi(4);
        f(outer) - f(inner)
    } else {
        (inner / outer).ln() + 0.5 * (outer.powi(-2) - inner.powi(-2))
    }
}

const STRETCHES: [f64; 6] = [1.01, 1.1, 1.25, 1.5, 2.0, 3.0];

/// All rows, and the error under refinement at one of them.
fn rows(case: &mut Case, mut ring: Ring, table: &[f64; 6], effort: Effort) -> Result<(), Failure> {
    let stretches = match effort {
        Effort::Full => &STRETCHES[..],
        Effort::Short => &STRETCHES[..5],
    };
    let found = pressures(case, &ring, stretches)?;
    for ((stretch, table), ours) in stretches.iter().zip(table).zip(found) {
        case.relative(
            format!("p/G at an inner stretch of {stretch}"),
            *table,
            ours,
            1e-4,
        );
    }
    let mut points = Vec::new();
    let counts: &[usize] = match effort {
        Effort::Full => &[2, 4, 8, 16],
        Effort::Short => &[2, 4, 8],
    };
    for &count in counts {
        ring.counts = [count, count];
        let found = pressures(case, &ring, &[1.5])?;
        points.push((
            1.0 / count as f64,
            (found[0] / exact(&ring, 1.5) - 1.0).abs(),
        ));
    }
    case.refinement.push(Refinement {
        what: "pressure at an inner stretch of 1.5".to_owned(),
        points,
    });
    Ok(())
}

pub(super) fn sphere(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let ring = Ring {
        kinematics: Kinematics::Axisymmetric,
        radii: [1.0, 2.0],
        counts: [12, 12],
        material: UNIT_RUBBER,
    };
    let table = [
        0.03427911, 0.28715485, 0.55186854, 0.75543312, 0.80692660, 0.63450668,
    ];
    rows(case, ring, &table, effort)
}

pub(super) fn cylinder(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let ring = Ring {
        kinematics: Kinematics::PlaneStrain,
        radii: [1.0, 2.0],
        counts: [12, 12],
        material: Material {
            law: Law::MooneyRivlin { c10: 0.3, c01: 0.2 },
            ..UNIT_RUBBER
        },
    };
    let table = [
        0.01479616, 0.13156228, 0.27571154, 0.42822841, 0.57405357, 0.66041726,
    ];
    rows(case, ring, &table, effort)
}

/// A thousandth of the radius; the formula of the thin wall holds for its middle to the
/// square of that.
const THICKNESS: f64 = 1e-3;

/// Stretch of the middle of the wall for that of the inner face.
fn middle_stretch(inner: f64) -> f64 {
    let share = (1.0 - THICKNESS / 2.0).powi(3);
    (1.0 + (inner.powi(3) - 1.0) * share).cbrt()
}

/// Highest point of the parabola through three points.
fn top(points: &[[f64; 2]]) -> [f64; 2] {
    let highest = (1..points.len() - 1)
        .max_by(|&a, &b| points[a][1].total_cmp(&points[b][1]))
        .unwrap_or(1);
    let [a, b, c] = [highest - 1, highest, highest + 1].map(|n| points[n]);
    let left = (b[1] - a[1]) / (b[0] - a[0]);
    let right = (c[1] - b[1]) / (c[0] - b[0]);
    let bend = (right - left) / (c[0] - a[0]);
    let at = 0.5 * (a[0] + b[0]) - 0.5 * left / bend;
    [at, a[1] + (at - a[0]) * (left + bend * (at - b[0]))]
}

pub(super) fn balloon(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let ring = Ring {
        kinematics: Kinematics::Axisymmetric,
        radii: [1.0 - THICKNESS / 2.0, 1.0 + THICKNESS / 2.0],
        counts: match effort {
            Effort::Full => [1, 32],
            Effort::Short => [1, 16],
        },
        material: UNIT_RUBBER,
    };
    let (stretch, highest) = (7.0_f64.powf(1.0 / 6.0), 1.239_462_90);
    let inner = [1.05, 1.2, 1.375, 1.385, 1.395, 1.7, 2.2];
    let found = pressures(case, &ring, &inner)?;
    let points: Vec<[f64; 2]> = inner
        .iter()
        .zip(&found)
        .map(|(inner, p)| [middle_stretch(*inner), p / THICKNESS])
        .collect();
    for [l, p] in &points {
        let exact = 2.0 * (1.0 / l - l.powi(-7));
        case.relative(
            format!("p r/(G t) at a stretch of {l:.4}, volume given"),
            exact,
            *p,
            1e-4,
        );
    }
    // Points 1 % apart: the parabola misses the place by the square of that.
    let [at, value] = top(&points[2..5]);
    case.relative(
        "stretch at the limit point, volume given",
        stretch,
        at,
        1e-3,
    );
    case.relative("greatest p r/(G t), volume given", highest, value, 1e-4);
    let [at, value] = top(&along_the_arc(case, &ring)?);
    case.relative(
        "stretch at the limit point, arc length given",
        stretch,
        at,
        1e-3,
    );
    case.relative("greatest p r/(G t), arc length given", highest, value, 1e-4);
    Ok(())
}

/// Stretch of the middle and pressure along the path, by arc length.
fn along_the_arc(case: &mut Case, ring: &Ring) -> Result<Vec<[f64; 2]>, Failure> {
    let (problem, pressure) = ring.posed(Rule::Given)?;
    let inner = ring.radii[0];
    let node = node_near(&problem.mesh, [inner, 0.0, 0.0]) as usize;
    let count = problem.mesh.points.len() as f64;
    let mut solver = Solver::new(problem)?;
    case.sized(&solver);
    // A first step by the pressure shows the way; the length then leads past the limit.
    load_to(&mut solver, &[0.2 * THICKNESS])?;
    solver.set_rule(pressure, Rule::Prescribes(Quantity::Arc(1.0)))?;
    let target = solver.targets()[0] + count.sqrt();
    solver.settings.first_step = 0.01;
    solver.settings.largest_step = 0.01;
    let mut points = Vec::new();
    solver.load_to(&[target], |state, _| {
        let stretch = middle_stretch(1.0 + state.displacement[node][0] / inner);
        points.push([stretch, state.parameters[0] / THICKNESS]);
        if stretch > 1.6 {
            Continue::Stop
        } else {
            Continue::Yes
        }
    })?;
    Ok(points)
}
