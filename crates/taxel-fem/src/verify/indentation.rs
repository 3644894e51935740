//! C1 to C3: punch and sphere on a half space and on a bonded layer, without friction.

use super::tools::{body, eager, from_start, load_to, plane, towards_end, with_poisson};
use super::{Case, Effort};
use crate::mesh::{Axis, Grading, Mesh};
use crate::problem::Kinematics;
use crate::problem::{Contact, Motion, Obstacle, Rule, Shape};
use crate::solver::failure::Failure;

/// A round layer of thickness `height`, its top divided at the radius of contact.
struct Layer {
    contact: f64,
    height: f64,
    /// Radius of the layer.
    side: f64,
    poisson: f64,
}

/// Where the grading of a very deep layer begins anew.
const FAR: f64 = 50.0;

impl Layer {
    /// Depth and radius graded from the surface at height zero; `inner` divides the radius of contact.
    fn mesh(&self, inner: Grading, smallest: f64, largest: f64) -> Result<Mesh, Failure> {
        // Cells may grow where the field is smooth: with their distance.
        let near = from_start(smallest, 1.5, largest);
        let below = towards_end(smallest, 1.5, largest);
        let (radius, depth) = if self.height > 2.0 * FAR {
            let (away, deep) = (from_start(10.0, 1.5, 1e3), towards_end(10.0, 1.5, 1e3));
            (
                Axis::new(&[0.0, self.contact, FAR, self.side], &[inner, near, away])?,
                Axis::new(&[-self.height, -FAR, 0.0], &[deep, below])?,
            )
        } else {
            (
                Axis::new(&[0.0, self.contact, self.side], &[inner, near])?,
                Axis::new(&[-self.height, 0.0], &[below])?,
            )
        };
        let mut mesh = plane(radius, depth)?;
        let contact = self.contact;
        mesh.name_boundary("contact", |x| x[1] == 0.0 && x[0] <= contact);
        Ok(mesh)
    }
}

/// Force of a flat punch over `4 G a d / (1 - nu)`; the thickness is one.
fn punched(case: &mut Case, radius: f64, poisson: f64, smallest: f64) -> Result<f64, Failure> {
    let layer = Layer {
        contact: radius,
        height: 1.0,
        side: radius + 6.0,
        poisson,
    };
    let (smallest, largest) = (smallest * radius, 0.125);
    let mesh = layer.mesh(towards_end(smallest, 1.5, largest), smallest, largest)?;
    let mut problem = body(mesh, Kinematics::Axisymmetric, with_poisson(poisson))?;
    problem.clamp("bottom")?;
    problem.support("left", 0, Motion::Fixed)?;
    let depth = problem.parameter("depth", Rule::Given);
    problem.support("contact", 1, Motion::Driven(depth, -1.0))?;
    let mut solver = eager(problem)?;
    case.sized(&solver);
    // Small strain: the mean of pushing and pulling has no term of second order.
    let travel = 1e-4 * radius.min(1.0);
    load_to(&mut solver, &[travel])?;
    let pushed = solver.evaluate()?.along[0];
    load_to(&mut solver, &[-travel])?;
    let force = 0.5 * (pushed - solver.evaluate()?.along[0]);
    Ok(force * (1.0 - poisson) / (4.0 * radius * travel))
}

/// Poisson's ratio, and the factor at each radius over the thickness.
const PUNCH: [(f64, [f64; 6]); 5] = [
    (0.30, [1.2066, 1.4726, 2.1260, 2.4835, 4.3532, 6.2613]),
    (0.40, [1.2323, 1.5422, 2.3402, 2.7938, 5.2985, 7.9916]),
    (0.45, [1.2523, 1.5993, 2.5354, 3.0914, 6.4206, 10.3654]),
    (0.49, [1.2741, 1.6638, 2.7796, 3.4840, 8.3370, 15.4620]),
    (0.50, [1.2806, 1.6837, 2.8602, 3.6187, 9.1495, 18.1574]),
];
const RADII: [f64; 6] = [0.2, 0.4, 0.8, 1.0, 2.0, 3.0];

pub(super) fn punch(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    case.note = String::from(
        "The layer ends six thicknesses beyond the punch. The pressure under its rim is \
                 infinite: cells shrink towards it.",
    );
    for (poisson, factors) in PUNCH {
        for (radius, factor) in RADII.into_iter().zip(factors) {
            let few = radius == 1.0 && (poisson == 0.30 || poisson == 0.50);
            if effort == Effort::Short && !few {
                continue;
            }
            let ours = punched(case, radius, poisson, 4e-4)?;
            let what = format!("force factor, a/h = {radius}, Poisson's ratio {poisson}");
            case.relative(what, factor, ours, 1e-3);
        }
    }
    Ok(())
}

/// Force of a sphere over that of Hertz on a half space, `4/3 E* sqrt(R) d^1.5`.
///
/// `product` is that of depth and radius of the sphere, the square of `a` on a half space.
fn pressed(case: &mut Case, layer: &Layer, product: f64, cells: usize) -> Result<f64, Failure> {
    // Small strain, but well above the rounding of a distance from a far centre.
    let depth = 1e-4 * layer.contact.min(layer.height);
    let radius = product / depth;
    let smallest = layer.contact / cells as f64;
    let mesh = layer.mesh(
        Grading::Uniform(cells),
        smallest,
        if layer.height > 2.0 * FAR {
            f64::INFINITY
        } else {
            0.125
        },
    )?;
    let mut problem = body(mesh, Kinematics::Axisymmetric, with_poisson(layer.poisson))?;
    problem.clamp("bottom")?;
    problem.support("left", 0, Motion::Fixed)?;
    let travel = problem.parameter("depth", Rule::Given);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("contact")?,
        shape: Shape::Sphere {
            centre: [0.0, radius, 0.0],
            radius,
        },
        travel: Some(([0.0, -1.0, 0.0], travel)),
        stiffness: 20.0 / smallest,
        friction: 0.0,
        overlap_limit: 1e-4 * depth,
    }));
    let mut solver = eager(problem)?;
    solver.settings.first_step = 1.0;
    // Far positions are rounded, which strains flat cells there; the force is in error
    // by the square.
    solver.settings.tolerance = 3e-4;
    // Contact takes up to 4 % of the depth, on the thinnest layer; each round of
    // multipliers leaves that share of what is left.
    solver.settings.rounds = 2;
    solver.settings.iterations = 30;
    case.sized(&solver);
    load_to(&mut solver, &[depth])?;
    let force = solver.evaluate()?.along[0].abs();
    let modulus = 2.0 / (1.0 - layer.poisson);
    Ok(force / (4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5)))
}

pub(super) fn hertz(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    let cells = if effort == Effort::Full { 40 } else { 20 };
    let far = 1000.0;
    for (poisson, first) in [(0.3, 0.87653), (0.5, 1.12695)] {
        let layer = Layer {
            contact: 1.25,
            height: far,
            side: far,
            poisson,
        };
        // Contact of radius one, and what the far support adds at first order.
        let ours = pressed(case, &layer, 1.0, cells)? / (1.0 + first / far);
        let what = format!("force over Hertz's, Poisson's ratio {poisson}");
        case.relative(what, 1.0, ours, 1e-3);
    }
    case.note = String::from(
        "The body is 1000 radii of contact deep; the first term of what its support adds, \
                 0.1 %, is taken off.",
    );
    Ok(())
}

/// Poisson's ratio, a/h, sqrt(R d)/h and the force over Hertz's.
const SPHERE: [(f64, f64, f64, f64); 18] = [
    (0.50, 0.1, 0.09622, 1.12354),
    (0.50, 0.2, 0.18507, 1.26977),
    (0.50, 0.5, 0.41721, 1.85712),
    (0.50, 1.0, 0.74794, 3.37110),
    (0.50, 2.0, 1.34893, 8.46801),
    (0.50, 3.0, 1.91502, 16.76175),
    (0.30, 0.2, 0.18842, 1.20074),
    (0.30, 0.5, 0.43556, 1.59091),
    (0.30, 1.0, 0.80475, 2.41564),
    (0.30, 2.0, 1.51394, 4.33192),
    (0.45, 0.2, 0.18632, 1.24360),
    (0.45, 0.5, 0.42418, 1.75048),
    (0.45, 1.0, 0.77118, 2.94637),
    (0.45, 2.0, 1.42812, 6.25091),
    (0.49, 0.2, 0.18536, 1.26377),
    (0.49, 0.5, 0.41880, 1.83201),
    (0.49, 1.0, 0.75344, 3.26549),
    (0.49, 2.0, 1.36935, 7.84326),
];

pub(super) fn sphere_on_layer(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (poisson, ratio, chi, factor) in SPHERE {
        if effort == Effort::Short && ratio != 0.5 && ratio != 2.0 {
            continue;
        }
        let layer = Layer {
            contact: 1.2 * ratio,
            height: 1.0,
            side: ratio + 6.0,
            poisson,
        };
        let cells = if effort == Effort::Full { 40 } else { 20 };
        let ours = pressed(case, &layer, chi * chi, cells)?;
        let what = format!("force over Hertz's, a/h = {ratio}, Poisson's ratio {poisson}");
        case.relative(what, factor, ours, 2e-3);
    }
    Ok(())
}
