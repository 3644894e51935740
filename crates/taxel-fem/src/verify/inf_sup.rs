//! B10: the inf-sup constant of displacement and pressure, from the tangents of cells.
//!
//! `beta^2` is the smallest `(B A^-1 B' q, q) / (M q, q)` over pressures `q` of mean
//! zero: `M` is the mass of the pressures, `A` the stiffness of a solid whose bulk and
//! shear modulus agree (a norm of displacements), `B` the divergence, read off the
//! elimination of the pressure at a bulk modulus of 1e6 shear moduli. The outline is
//! held. A constant that falls with the cells means locking and pressures that swing.

use taxel_numerics::dense::dot;

use super::tools::{SHAPES, UNIT_RUBBER, body, kinematics, unit_body};
use super::{Case, Effort};
use crate::assembly::kernel::{ELIMINATION_RATIO, MAX_PRESSURES};
use crate::assembly::state::State;
use crate::assembly::system::System;
use crate::material::{Material, Volumetric};
use crate::mesh::{CellShape, Mesh};
use crate::problem::{Motion, Problem, Support};
use crate::scalar::determinant;
use crate::solver::failure::{Failure, Reason};
use crate::sparse::{Cholesky, Factorisation, solve_checked};

/// Bulk over shear modulus.
const RATIO: f64 = 1e6;

/// A vector of pressures of one cell: the cell, its first number, its values.
type Sparse = Vec<(usize, f64)>;

fn held(shape: CellShape, count: usize, bulk: f64) -> Result<Problem, Failure> {
    // Corners inside are moved: a regular mesh could be better than others.
    let wave = move |x: [f64; 3]| {
        let bump = |d: usize, e: usize| {
            let tau = std::f64::consts::TAU;
            0.04 * (tau * x[d]).sin() * (tau * x[e]).sin()
        };
        let moved = [x[0] + bump(0, 1), x[1] - bump(0, 1), x[2]];
        if count > 2 { moved } else { x }
    };
    let mut mesh = unit_body(shape, count, wave)?;
    mesh.name_boundary("outline", |_| true);
    let material = Material {
        volumetric: Volumetric::Quadratic(bulk),
        ..UNIT_RUBBER
    };
    let mut problem = body(mesh, kinematics(shape), material)?;
    let outline = problem.mesh.boundary();
    let mut nodes: Vec<u32> = outline
        .iter()
        .flat_map(|&facet| problem.mesh.facet_nodes(facet))
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    for component in 0..problem.kinematics.components() {
        problem.supports.push(Support {
            nodes: nodes.clone(),
            component,
            motion: Motion::Fixed,
        });
    }
    Ok(problem)
}

/// Mass of the pressure functions of a cell.
fn mass(mesh: &Mesh, cell: usize, size: usize) -> [[f64; MAX_PRESSURES]; MAX_PRESSURES] {
    let shape = mesh.shape(cell);
    let nodes = mesh.cell(cell);
    let centre = mesh.points[nodes[nodes.len() - 1] as usize];
    let reach = nodes[..shape.corner_count()]
        .iter()
        .flat_map(|&node| (0..3).map(move |d| (mesh.points[node as usize][d] - centre[d]).abs()))
        .fold(0.0, f64::max);
    let mut mass = [[0.0; MAX_PRESSURES]; MAX_PRESSURES];
    for point in shape.quadrature() {
        let place = super::tools::place_in(mesh, cell, point.at);
        let map = crate::mesh::quality::map(mesh, cell, &shape.shapes(point.at));
        let weight = determinant(&map) * point.weight;
        let function = |m: usize| {
            if m == 0 {
                1.0
            } else {
                (place[m - 1] - centre[m - 1]) / reach
            }
        };
        for m in 0..size {
            for n in 0..size {
                mass[m][n] += weight * function(m) * function(n);
            }
        }
    }
    mass
}

/// The rows of `B'`: for each unknown what it does to the pressures.
fn divergence(
    problem: &Problem,
    masses: &[[[f64; MAX_PRESSURES]; MAX_PRESSURES]],
) -> Result<Vec<Sparse>, Failure> {
    let at_start = |reason: Reason| Failure::at_start(reason);
    let mut system = System::new(problem).map_err(|error| at_start(error.into()))?;
    let state = State::rest(problem);
    let assembled = system
        .assemble(problem, &state, true)
        .map_err(|error| at_start(error.into()))?;
    let size = problem.kinematics.pressures();
    let mut rows = vec![Sparse::new(); system.unknowns.count()];
    let mut change = vec![[0.0; 3]; problem.mesh.points.len()];
    for node in 0..problem.mesh.points.len() {
        for component in 0..problem.kinematics.components() {
            let Some(unknown) = system.unknowns.of(node as u32, component) else {
                continue;
            };
            change[node][component] = 1.0;
            let mut pressures = vec![[0.0; MAX_PRESSURES]; problem.mesh.cell_count()];
            system.recover_pressures(problem, &assembled, &change, 1.0, &mut pressures);
            change[node][component] = 0.0;
            for (cell, p) in pressures.iter().enumerate() {
                for m in 0..size {
                    let value: f64 = (0..size).map(|n| masses[cell][m][n] * p[n]).sum();
                    if value != 0.0 {
                        rows[unknown].push((cell * size + m, value / RATIO.min(ELIMINATION_RATIO)));
                    }
                }
            }
        }
    }
    Ok(rows)
}

/// Lower triangle of the Cholesky factor of a dense matrix, row first.
fn factor(mut a: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for i in 0..a.len() {
        let (done, rest) = a.split_at_mut(i);
        let row = &mut rest[0];
        for (j, other) in done.iter().enumerate() {
            let product: f64 = row[..j].iter().zip(&other[..j]).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - product) / other[j];
        }
        let square: f64 = row[..i].iter().map(|a| a * a).sum();
        row[i] = (row[i] - square).sqrt();
    }
    a
}

fn solved(l: &[Vec<f64>], mut b: Vec<f64>) -> Vec<f64> {
    for i in 0..l.len() {
        let sum: f64 = l[i][..i].iter().zip(&b).map(|(a, b)| a * b).sum();
        b[i] = (b[i] - sum) / l[i][i];
    }
    for i in (0..l.len()).rev() {
        b[i] /= l[i][i];
        let value = b[i];
        for (j, entry) in l[i][..i].iter().enumerate() {
            b[j] -= entry * value;
        }
    }
    b
}

/// The constant on a mesh of so many cells along each side.
fn constant(case: &mut Case, shape: CellShape, count: usize) -> Result<f64, Failure> {
    let stiff = held(shape, count, RATIO)?;
    let size = stiff.kinematics.pressures();
    let masses: Vec<_> = (0..stiff.mesh.cell_count())
        .map(|cell| mass(&stiff.mesh, cell, size))
        .collect();
    let rows = divergence(&stiff, &masses)?;
    let norm = held(shape, count, 1.0)?;
    let mut system = System::new(&norm).map_err(|error| Failure::at_start(error.into()))?;
    let assembled = system
        .assemble(&norm, &State::rest(&norm), true)
        .map_err(|error| Failure::at_start(error.into()))?;
    case.mesh = case.mesh.max((norm.mesh.cell_count(), rows.len()));
    let pattern = &system.unknowns.pattern;
    let linear = |error: crate::sparse::LinearError| Failure::at_start(error.into());
    let mut cholesky = Cholesky::analyse(pattern).map_err(linear)?;
    cholesky
        .refactor(pattern, &assembled.values)
        .map_err(linear)?;
    let unknowns = size * masses.len();
    let mut columns = vec![vec![0.0; rows.len()]; unknowns];
    for (unknown, row) in rows.iter().enumerate() {
        for &(pressure, value) in row {
            columns[pressure][unknown] = value;
        }
    }
    let mut schur = vec![vec![0.0; unknowns]; unknowns];
    for (pressure, column) in columns.iter().enumerate() {
        let u = solve_checked(&mut cholesky, pattern, &assembled.values, column).map_err(linear)?;
        for (unknown, row) in rows.iter().enumerate() {
            for &(other, value) in row {
                schur[pressure][other] += value * u[unknown];
            }
        }
    }
    Ok(smallest(schur, &masses, size).sqrt())
}

/// Smallest eigenvalue of `S q = l M q` beside that of constant pressure, by inverse
/// iteration; the constant is lifted out of the way.
fn smallest(
    mut schur: Vec<Vec<f64>>,
    masses: &[[[f64; MAX_PRESSURES]; MAX_PRESSURES]],
    size: usize,
) -> f64 {
    let times_mass = |q: &[f64]| -> Vec<f64> {
        let row = |at: usize| {
            let (cell, m) = (at / size, at % size);
            (0..size)
                .map(|n| masses[cell][m][n] * q[cell * size + n])
                .sum()
        };
        (0..q.len()).map(row).collect()
    };
    let count = schur.len();
    let mut one = vec![0.0; count];
    one.iter_mut().step_by(size).for_each(|value| *value = 1.0);
    let lift = times_mass(&one);
    // Its own eigenvalue becomes the volume times this, far above those in question.
    for i in 0..count {
        for j in 0..count {
            schur[i][j] += 10.0 * lift[i] * lift[j];
        }
    }
    let l = factor(schur);
    let mut q: Vec<f64> = (0..count).map(|i| (1.0 + 7.3 * i as f64).sin()).collect();
    let mut value = 0.0;
    for _ in 0..200 {
        let right = times_mass(&q);
        let next = solved(&l, right.clone());
        let before = value;
        value = dot(&q, &right) / dot(&next, &right);
        let length = dot(&next, &times_mass(&next)).sqrt();
        q = next.into_iter().map(|x| x / length).collect();
        if (value - before).abs() < 1e-9 * value {
            break;
        }
    }
    value
}

pub(super) fn solve(case: &mut Case, effort: Effort) -> Result<(), Failure> {
    case.note = String::from(
        "The last number over the one before it must not fall below one by more than a \
                 tenth: a pair that is not stable loses half with every halving of the cells.",
    );
    for shape in SHAPES {
        let counts: &[usize] = match (shape.dimension(), effort) {
            (2, Effort::Full) => &[2, 4, 8, 16],
            (2, Effort::Short) => &[2, 3, 4, 6],
            (_, Effort::Full) => &[1, 2, 3, 4],
            (_, Effort::Short) => &[1, 2, 3],
        };
        let mut constants = Vec::new();
        for &count in counts {
            constants.push((1.0 / count as f64, constant(case, shape, count)?));
        }
        let [.., coarse, fine] = constants.as_slice() else {
            continue;
        };
        // Constants fall towards their limit; halving the cells may cost a tenth.
        let share = (fine.1 / coarse.1).min(1.0);
        case.absolute(
            format!("{shape:?}: last over last but one"),
            1.0,
            share,
            0.1,
        );
        case.refinement.push(super::Refinement {
            what: format!("{shape:?}: constant"),
            points: constants,
        });
    }
    Ok(())
}
