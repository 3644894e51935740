//! C6.7, C6.8: bodies that slide along each other over many facets.
//!
//! - C6.7 A smooth block is carried over a flat one that goes on without end (periodic). After
//!   each whole cell of the lower body the state is that before, and there as on half of the way
//!   no force acts along the surface, by symmetry.
//! - C6.8 Ironing (after Puso and Laursen, Comput. Methods Appl. Mech. Eng. 193, 4891, 2004): a
//!   round indenter is pressed into a slab without end and drawn along it. A rigid indenter with a
//!   mesh is the rigid cylinder of its radius, an obstacle without facets; a soft one has the
//!   same forces on finer cells.

use super::tools::{body, load_to, mapped, plane, with_poisson};
use super::{Case, Effort};
use crate::mesh::{Axis, Grading, Mesh};
use crate::problem::{
    Contact, Kinematics, Motion, Obstacle, Parameter, Problem, Rule, Shape, SurfacePair,
};
use crate::solver::failure::Failure;
use crate::solver::newton::{Multipliers, Solver};

/// A body over a flat one without end, from `left` on, held below.
struct Carriage {
    problem: Problem,
    press: Parameter,
    drag: Parameter,
}

impl Carriage {
    /// Joins the bodies; the upper one has still to be moved.
    fn new(slab: &Mesh, upper: Option<&Mesh>) -> Result<Self, Failure> {
        let mut parts = vec![("slab", slab)];
        parts.extend(upper.map(|upper| ("upper", upper)));
        let mesh = Mesh::joined(&parts, |_| false);
        let mut problem = body(mesh, Kinematics::PlaneStrain, with_poisson(0.45))?;
        let press = problem.parameter("press", Rule::Given);
        let drag = problem.parameter("drag", Rule::Given);
        problem.clamp("slab_bottom")?;
        problem.periodic(["slab_left", "slab_right"], &[])?;
        let held = problem.mesh.nodes_of("slab_bottom").unwrap_or_default();
        let constraints = &mut problem.constraints;
        constraints.retain(|constraint| !held.contains(&constraint.dependent.0));
        Ok(Self {
            problem,
            press,
            drag,
        })
    }

    /// Moves the top of the upper body.
    fn held_above(&mut self) -> Result<(), Failure> {
        let (press, drag) = (self.press, self.drag);
        let problem = &mut self.problem;
        problem.support("upper_top", 1, Motion::Driven(press, -1.0))?;
        problem.support("upper_top", 0, Motion::Driven(drag, 1.0))?;
        Ok(())
    }

    /// A pair of these surfaces, not yet part of the problem.
    fn pair(&self, surfaces: [&str; 2], friction: f64) -> Result<SurfacePair, Failure> {
        let [first, second] = surfaces;
        let facets = [self.problem.surface(first)?, self.problem.surface(second)?];
        let pair = SurfacePair::new(&self.problem.mesh, facets, 1.0);
        Ok(SurfacePair { friction, ..pair })
    }

    fn touches(&mut self, pair: SurfacePair) {
        self.problem.contacts.push(Contact::Surfaces(pair));
    }
}

pub(super) fn carried(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let cell = 0.25;
    let slab = plane(Axis::uniform(-2.0, 2.0, 16)?, Axis::uniform(-1.0, 0.0, 3)?)?;
    let upper = plane(Axis::uniform(-0.5, 0.5, 3)?, Axis::uniform(0.0, 0.5, 2)?)?;
    let mut carriage = Carriage::new(&slab, Some(&upper))?;
    carriage.held_above()?;
    // Rounds of multipliers depend on the way until the overlap is gone.
    let pair = carriage.pair(["upper_bottom", "slab_top"], 0.0)?;
    carriage.touches(SurfacePair {
        overlap_limit: 1e-9,
        ..pair
    });
    let mut solver = Solver::new(carriage.problem)?;
    solver.settings.multipliers = Multipliers::Corners;
    solver.settings.rounds = 20;
    case.sized(&solver);
    let press = 0.05;
    load_to(&mut solver, &[press, 0.0])?;
    let start = solver.evaluate()?.along;
    let halves = if effort == Effort::Full { 8 } else { 2 };
    let (mut pull, mut change, mut ripple) = (start[1].abs(), 0.0_f64, 0.0_f64);
    for half in 0..halves {
        let at = 0.5 * cell * f64::from(half);
        load_to(&mut solver, &[press, at + 0.25 * cell])?;
        ripple = ripple.max(solver.evaluate()?.along[1].abs());
        load_to(&mut solver, &[press, at + 0.5 * cell])?;
        let along = solver.evaluate()?.along;
        pull = pull.max(along[1].abs());
        if half % 2 == 1 {
            change = change.max((along[0] - start[0]).abs());
        }
    }
    let force = start[0];
    let what = "pull over press, at whole and half cells";
    case.absolute(what, 0.0, pull / force, 1e-6);
    case.absolute("the same, between them", 0.0, ripple / force, 1e-2);
    let what = "change of the force by whole cells, over it";
    case.absolute(what, 0.0, change / force, 1e-6);
    Ok(())
}

/// Radius of the indenter.
const RADIUS: f64 = 1.0;
/// Length of the slab, and how deep and far the indenter goes.
const SLAB: f64 = 4.0;
const WAY: [f64; 2] = [0.2, 1.0];

/// The slab with this many cells per unit of length.
fn slab(fineness: usize) -> Result<Mesh, Failure> {
    let below = Axis::new(&[-1.5, 0.0], &[Grading::Uniform(3 * fineness / 2)])?;
    Ok(plane(
        Axis::uniform(-0.5 * SLAB, 0.5 * SLAB, SLAB as usize * fineness)?,
        below,
    )?)
}

/// The indenter with this many cells across, its lowest point at the origin.
fn indenter(cells: usize) -> Result<Mesh, Failure> {
    let mesh = plane(
        Axis::uniform(-0.8, 0.8, cells)?,
        Axis::uniform(0.0, 1.0, cells / 2)?,
    )?;
    Ok(mapped(mesh, |[x, y, z]| {
        let sag = RADIUS - (RADIUS * RADIUS - x * x).sqrt();
        [x, y + sag * (1.0 - y), z]
    }))
}

/// Mean of press and pull over the second half of the way.
fn ironed(case: &mut Case, carriage: Carriage) -> Result<[f64; 2], Failure> {
    let mut solver = Solver::new(carriage.problem)?;
    solver.settings.multipliers = Multipliers::Corners;
    case.sized(&solver);
    let [depth, way] = WAY;
    load_to(&mut solver, &[depth, 0.0])?;
    load_to(&mut solver, &[depth, 0.5 * way])?;
    let mut sum = [0.0; 2];
    let stops = 4;
    for stop in 1..=stops {
        let gone = 0.5 * way * (1.0 + f64::from(stop) / f64::from(stops));
        load_to(&mut solver, &[depth, gone])?;
        let along = solver.evaluate()?.along;
        for (sum, force) in sum.iter_mut().zip(&along) {
            *sum += force / f64::from(stops);
        }
    }
    Ok(sum)
}

pub(super) fn ironing(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let full = effort == Effort::Full;
    let fineness = if full { 8 } else { 4 };
    for friction in if full { &[0.0, 0.3][..] } else { &[0.3] } {
        let base = slab(fineness)?;
        // The rigid cylinder without facets.
        let mut cylinder = Carriage::new(&base, None)?;
        let (press, drag) = (cylinder.press, cylinder.drag);
        let top = cylinder.problem.surface("slab_top")?;
        let side = cylinder.problem.mesh.mean_side(&top);
        // One parameter moves an obstacle: pressed and drawn in the frame of the cylinder, the
        // slab is moved.
        cylinder.problem.supports.clear();
        cylinder
            .problem
            .support("slab_bottom", 1, Motion::Driven(press, 1.0))?;
        cylinder
            .problem
            .support("slab_bottom", 0, Motion::Driven(drag, -1.0))?;
        cylinder.problem.contacts.push(Contact::Obstacle(Obstacle {
            surface: top,
            shape: Shape::Sphere {
                centre: [0.0, RADIUS, 0.0],
                radius: RADIUS,
            },
            travel: None,
            stiffness: 50.0 / side,
            friction: *friction,
            overlap_limit: 1e-4 * side,
        }));
        let exact = ironed(case, cylinder)?;
        for (name, surfaces, limit) in [
            ("slab first", ["slab_top", "upper_bottom"], 5e-3),
            ("indenter first", ["upper_bottom", "slab_top"], 2e-2),
        ] {
            let upper = indenter(2 * fineness)?;
            let mut carriage = Carriage::new(&base, Some(&upper))?;
            let mut rigid = carriage.problem.rigid_body("upper_solid", None)?;
            rigid.travel[0] = Motion::Driven(carriage.drag, 1.0);
            rigid.travel[1] = Motion::Driven(carriage.press, -1.0);
            carriage.problem.rigid_bodies.push(rigid);
            carriage.touches(carriage.pair(surfaces, *friction)?);
            let found = ironed(case, carriage)?;
            let of = format!("rigid indenter, friction {friction}, {name}");
            case.relative(format!("press, {of}"), exact[0], found[0], limit);
            if *friction > 0.0 {
                case.relative(format!("pull, {of}"), exact[1], found[1], limit);
            }
        }
    }
    if !full {
        return Ok(());
    }
    let soft = |case: &mut Case, fineness: usize| -> Result<[f64; 2], Failure> {
        let (base, upper) = (slab(fineness)?, indenter(2 * fineness)?);
        let mut carriage = Carriage::new(&base, Some(&upper))?;
        carriage.held_above()?;
        carriage.touches(carriage.pair(["upper_bottom", "slab_top"], 0.3)?);
        ironed(case, carriage)
    };
    let (coarse, fine) = (soft(case, 4)?, soft(case, 8)?);
    case.relative(
        "press, soft indenter, half the cells",
        fine[0],
        coarse[0],
        1e-2,
    );
    case.relative(
        "pull, soft indenter, half the cells",
        fine[1],
        coarse[1],
        1e-2,
    );
    Ok(())
}
