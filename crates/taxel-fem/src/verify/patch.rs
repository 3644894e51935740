//! B10: a constant stress at finite stretch on distorted meshes of every shape.

use super::tools::{SHAPES, body, drive, eager, kinematics, load_to, unit_body};
use super::{Case, Effort};
use crate::material::{Law, Material, Volumetric};
use crate::mesh::CellShape;
use crate::problem::load::traction;
use crate::problem::{DeadLoad, Motion, Problem, Rule, Support};
use crate::scalar::{Tensor, determinant, inverse};
use crate::solver::failure::Failure;
use crate::solver::newton::Solver;
use crate::solver::stress::stress_points;

/// Stretch and shear in the plane or in space, of volume ratio one or near it.
fn gradient(dimension: usize, isochoric: bool) -> Tensor<f64> {
    let mut f = if dimension == 2 {
        [[1.3, 0.25, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.0]]
    } else {
        [[1.3, 0.25, 0.1], [-0.1, 0.9, 0.15], [0.05, -0.2, 1.1]]
    };
    let aim = if isochoric { 1.0 } else { 1.05 };
    let factor = (aim / determinant(&f)).powf(1.0 / dimension as f64);
    for row in &mut f[..dimension] {
        for entry in &mut row[..dimension] {
            *entry *= factor;
        }
    }
    f
}

fn displacement(f: &Tensor<f64>, x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|k| f[i][k] * x[k]).sum::<f64>() - x[i])
}

/// First Piola-Kirchhoff stress of a mean stress and a law.
pub(super) fn nominal(material: &Material, f: &Tensor<f64>, pressure: f64) -> Tensor<f64> {
    let j = determinant(f);
    let back = inverse(f, j);
    let tau = material.law.response(f).stress;
    let entry = |i: usize, k: usize| {
        tau[crate::scalar::PLACE[i][k]] + if i == k { pressure * j } else { 0.0 }
    };
    std::array::from_fn(|i| std::array::from_fn(|k| (0..3).map(|m| entry(i, m) * back[k][m]).sum()))
}

/// Corners inside the body moved by up to a fifth of a cell; the outline stays.
fn distorted(x: [f64; 3], dimension: usize) -> [f64; 3] {
    let inside = x[..dimension].iter().all(|&x| x > 1e-9 && x < 1.0 - 1e-9);
    if !inside {
        return x;
    }
    let [a, b, c] = x;
    let shift = [
        (37.0 * a + 11.0 * b + 5.0 * c).sin(),
        (13.0 * a - 29.0 * b + 7.0 * c).sin(),
        (19.0 * a + 3.0 * b - 23.0 * c).sin(),
    ];
    std::array::from_fn(|d| x[d] + if d < dimension { shift[d] / 15.0 } else { 0.0 })
}

struct Patch {
    shape: CellShape,
    material: Material,
    gradient: Tensor<f64>,
    /// Cells along each side in space.
    cells: usize,
    /// Mean stress of the exact state.
    pressure: f64,
}

/// Greatest errors of displacement (of a body of size one) and nominal stress (of the
/// greatest stress).
fn errors(patch: &Patch, solver: &Solver) -> [f64; 2] {
    let (problem, state) = (solver.problem(), solver.state());
    let mut moved = 0.0_f64;
    for (x, u) in problem.mesh.points.iter().zip(&state.displacement) {
        let exact = displacement(&patch.gradient, *x);
        for d in 0..patch.shape.dimension() {
            moved = moved.max((u[d] - exact[d]).abs());
        }
    }
    let exact = nominal(&patch.material, &patch.gradient, patch.pressure);
    let size = exact.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
    let mut stressed = 0.0_f64;
    for point in stress_points(problem, state) {
        let ours = nominal(&patch.material, &point.gradient, point.pressure);
        for i in 0..3 {
            for k in 0..3 {
                stressed = stressed.max((ours[i][k] - exact[i][k]).abs() / size);
            }
        }
    }
    [moved, stressed]
}

fn posed(patch: &Patch) -> Result<Problem, Failure> {
    let dimension = patch.shape.dimension();
    let count = if dimension == 2 { 4 } else { patch.cells };
    let mut mesh = unit_body(patch.shape, count, |x| distorted(x, dimension))?;
    mesh.name_boundary("outline", |_| true);
    body(mesh, kinematics(patch.shape), patch.material)
}

fn solved(case: &mut Case, problem: Problem, targets: &[f64]) -> Result<Solver, Failure> {
    let mut solver = eager(problem)?;
    // The volume ratio is rounded to 2e-16, and the pressure by as many shear moduli as
    // eliminate it: with few of them the iteration is slow, but ends closer.
    solver.settings.elimination = 1e2;
    // Slow is not difficult: steps stay large, so that rounding stays small beside them.
    solver.settings.iterations = 40;
    solver.settings.easy_iterations = 40;
    solver.settings.tolerance = 1e-13;
    solver.settings.extrapolate = false;
    solver.settings.first_step = 0.5;
    load_to(&mut solver, targets)?;
    case.sized(&solver);
    Ok(solver)
}

/// The outline follows the map; one side is loaded instead, so that the pressure has a
/// value where the solid keeps its volume.
fn led(case: &mut Case, patch: &Patch) -> Result<[f64; 2], Failure> {
    let mut problem = posed(patch)?;
    problem.mesh.name_boundary("end", |x| x[0] > 1.0 - 1e-9);
    let along = problem.parameter("way", Rule::Given);
    let mut nodes = Vec::new();
    for facet in problem.surface("outline")? {
        let on_end = problem.mesh.surfaces["end"].contains(&facet);
        nodes.extend(problem.mesh.facet_nodes(facet).filter(|_| !on_end));
    }
    nodes.sort_unstable();
    nodes.dedup();
    drive(&mut problem, &nodes, along, |x| {
        displacement(&patch.gradient, x)
    });
    load(&mut problem, patch, along, "end");
    Ok(errors(patch, &solved(case, problem, &[1.0])?))
}

/// The whole outline is loaded; only rigid motion is held.
fn loaded(case: &mut Case, patch: &Patch) -> Result<[f64; 2], Failure> {
    let mut problem = posed(patch)?;
    let along = problem.parameter("way", Rule::Given);
    load(&mut problem, patch, along, "outline");
    let dimension = patch.shape.dimension();
    // Corner, then what turns about it: all at their exact places.
    let holds: &[([f64; 3], usize)] = if dimension == 2 {
        &[([0.0; 3], 0), ([0.0; 3], 1), ([1.0, 0.0, 0.0], 1)]
    } else {
        &[
            ([0.0; 3], 0),
            ([0.0; 3], 1),
            ([0.0; 3], 2),
            ([1.0, 0.0, 0.0], 1),
            ([1.0, 0.0, 0.0], 2),
            ([0.0, 1.0, 0.0], 2),
        ]
    };
    for &(place, component) in holds {
        let node = super::tools::node_near(&problem.mesh, place);
        problem.supports.push(Support {
            nodes: vec![node],
            component,
            motion: Motion::Driven(along, displacement(&patch.gradient, place)[component]),
        });
    }
    Ok(errors(patch, &solved(case, problem, &[1.0])?))
}

/// Dead tractions of the constant stress.
fn load(problem: &mut Problem, patch: &Patch, along: crate::problem::Parameter, name: &str) {
    let stress = nominal(&patch.material, &patch.gradient, patch.pressure);
    let facets = problem.mesh.surfaces[name].clone();
    let mut forces = Vec::new();
    for axis in 0..patch.shape.dimension() {
        for (end, sign) in [(0.0, -1.0), (1.0, 1.0)] {
            let on_side = |facet: &&crate::mesh::Facet| {
                let mut nodes = problem.mesh.facet_nodes(**facet);
                nodes.all(|node| (problem.mesh.points[node as usize][axis] - end).abs() < 1e-9)
            };
            let side: Vec<_> = facets.iter().filter(on_side).copied().collect();
            let pull = std::array::from_fn(|i| sign * stress[i][axis]);
            forces.extend(traction(&problem.mesh, problem.kinematics, &side, |_| pull));
        }
    }
    problem.dead_loads.push(DeadLoad {
        forces,
        parameter: along,
    });
}

/// A patch of each shape, compressible and not, with its name.
fn patches(effort: Effort) -> Vec<(Patch, String)> {
    let cells = if effort == Effort::Full { 3 } else { 2 };
    let law = Law::MooneyRivlin { c10: 0.4, c01: 0.1 };
    let mut patches = Vec::new();
    for shape in SHAPES {
        for isochoric in [false, true] {
            let gradient = gradient(shape.dimension(), isochoric);
            let bulk = 5.0;
            let (volumetric, pressure, name) = if isochoric {
                (Volumetric::Incompressible, 0.3, "incompressible")
            } else {
                let pressure = bulk * (determinant(&gradient) - 1.0);
                (Volumetric::Quadratic(bulk), pressure, "compressible")
            };
            let patch = Patch {
                shape,
                material: Material { law, volumetric },
                gradient,
                cells,
                pressure,
            };
            patches.push((patch, format!("{shape:?}, {name}")));
        }
    }
    patches
}

fn compare(case: &mut Case, name: &str, [moved, stressed]: [f64; 2]) {
    case.absolute(format!("{name}: error of displacement"), 0.0, moved, 1e-12);
    case.absolute(format!("{name}: error of stress"), 0.0, stressed, 1e-12);
}

pub(super) fn solve(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (patch, name) in patches(effort) {
        for (kind, errors) in [
            ("outline led", led(case, &patch)?),
            ("outline loaded", loaded(case, &patch)?),
        ] {
            compare(case, &format!("{name}, {kind}"), errors);
        }
    }
    Ok(())
}

/// One cell of a body that repeats in all directions: opposite faces move alike but for the
/// stretch of the body, of which the last is left to follow from the force zero.
fn repeated(case: &mut Case, patch: &Patch) -> Result<[f64; 2], Failure> {
    let mut problem = posed(patch)?;
    let dimension = patch.shape.dimension();
    let way = problem.parameter("way", Rule::Given);
    let aside = problem.free_parameter("aside");
    for (axis, names) in [["x0", "x1"], ["y0", "y1"], ["z0", "z1"]][..dimension]
        .iter()
        .enumerate()
    {
        for (end, name) in names.iter().enumerate() {
            problem
                .mesh
                .name_boundary(name, |x| (x[axis] - end as f64).abs() < 1e-9);
        }
        let jump = |component: usize| {
            patch.gradient[component][axis] - f64::from(u8::from(component == axis))
        };
        let last = dimension - 1;
        let mut drive: Vec<_> = (0..dimension)
            .filter(|&component| (axis, component) != (last, last))
            .map(|component| (component, way, jump(component)))
            .collect();
        if axis == last {
            drive.push((last, aside, 1.0));
        }
        problem.periodic(*names, &drive)?;
    }
    let corner = super::tools::node_near(&problem.mesh, [0.0; 3]);
    for component in 0..dimension {
        problem.supports.push(Support {
            nodes: vec![corner],
            component,
            motion: Motion::Fixed,
        });
    }
    // A body that keeps its volume takes the pressure that leaves no force there.
    let stress = nominal(&patch.material, &patch.gradient, patch.pressure);
    let last = dimension - 1;
    let solver = solved(case, problem, &[1.0, stress[last][last]])?;
    Ok(errors(patch, &solver))
}

pub(super) fn periodic(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    for (patch, name) in patches(effort) {
        let errors = repeated(case, &patch)?;
        compare(case, &name, errors);
    }
    Ok(())
}
