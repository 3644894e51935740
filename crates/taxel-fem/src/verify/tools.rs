//! Meshes and problems that several cases share.

use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, CellShape, Grading, Grid2, Grid3, Growth, LowerCell, Mesh, MeshError};
use crate::problem::Kinematics;
use crate::problem::{Motion, Parameter, Problem, Support};
use crate::solver::failure::Failure;
use crate::solver::newton::{Continue, Solver};

/// A neo-Hookean solid of shear modulus one that keeps its volume.
pub(super) const UNIT_RUBBER: Material = Material {
    law: Law::MooneyRivlin { c10: 0.5, c01: 0.0 },
    volumetric: Volumetric::Incompressible,
};

/// A solid of shear modulus one and this Poisson's ratio.
pub(super) fn with_poisson(ratio: f64) -> Material {
    let volumetric = if ratio < 0.5 {
        Volumetric::Quadratic(2.0 * (1.0 + ratio) / (3.0 * (1.0 - 2.0 * ratio)))
    } else {
        Volumetric::Incompressible
    };
    Material {
        volumetric,
        ..UNIT_RUBBER
    }
}

/// Moves every node; what rounding left beside zero becomes zero.
pub(super) fn mapped(mut mesh: Mesh, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    for point in &mut mesh.points {
        *point = map(*point).map(|x| if x.abs() < 1e-14 { 0.0 } else { x });
    }
    mesh
}

/// A grid of two axes with its sides named.
pub(super) fn plane(x: Axis, y: Axis) -> Result<Mesh, MeshError> {
    Grid2::new([x, y], "solid").mesh()
}

/// Cells that grow away from the end of an interval.
pub(super) fn towards_end(smallest: f64, ratio: f64, largest: f64) -> Grading {
    Grading::FromEnd(growth(smallest, ratio, largest))
}

/// Cells that grow away from the start of an interval.
pub(super) fn from_start(smallest: f64, ratio: f64, largest: f64) -> Grading {
    Grading::FromStart(growth(smallest, ratio, largest))
}

fn growth(smallest: f64, ratio: f64, largest: f64) -> Growth {
    Growth {
        smallest,
        ratio,
        largest,
    }
}

/// Corners of the simplices that fill a cell with the diagonal of its nodes 0 and last.
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 2, 6],
    [0, 2, 3, 6],
    [0, 3, 7, 6],
    [0, 7, 4, 6],
    [0, 4, 5, 6],
    [0, 5, 1, 6],
];

/// The unit square or cube in `count` steps along each axis, corners moved by `map`.
/// All edges are straight.
pub(super) fn unit_body(
    shape: CellShape,
    count: usize,
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> Result<Mesh, MeshError> {
    let axis = || Axis::uniform(0.0, 1.0, count);
    let grid = if shape.dimension() == 2 {
        plane(axis()?, axis()?)?
    } else {
        Grid3::new([axis()?, axis()?, axis()?], "solid").mesh()?
    };
    let mut numbers = vec![u32::MAX; grid.points.len()];
    let mut points = Vec::new();
    let mut cells = Vec::new();
    for cell in 0..grid.cell_count() {
        let mut corners = Vec::new();
        for &node in &grid.cell(cell)[..grid.shape(cell).corner_count()] {
            let number = &mut numbers[node as usize];
            if *number == u32::MAX {
                *number = points.len() as u32;
                points.push(map(grid.points[node as usize]));
            }
            corners.push(*number);
        }
        let parts: Vec<&[usize]> = match shape {
            CellShape::Tri7 => TRIANGLES.iter().map(|part| &part[..]).collect(),
            CellShape::Tet15 => TETRAHEDRA.iter().map(|part| &part[..]).collect(),
            CellShape::Quad9 => vec![&[0, 1, 2, 3]],
            CellShape::Hex27 => vec![&[0, 1, 2, 3, 4, 5, 6, 7]],
        };
        cells.extend(parts.into_iter().map(|part| LowerCell {
            shape,
            region: 0,
            nodes: part.iter().map(|&corner| corners[corner]).collect(),
        }));
    }
    Mesh::from_lower_cells(points, &cells, &["solid"])
}

/// Kinematics of a body of such cells.
pub(super) fn kinematics(shape: CellShape) -> Kinematics {
    if shape.dimension() == 2 {
        Kinematics::PlaneStrain
    } else {
        Kinematics::Solid
    }
}

/// All shapes of cells.
pub(super) const SHAPES: [CellShape; 4] = [
    CellShape::Quad9,
    CellShape::Tri7,
    CellShape::Hex27,
    CellShape::Tet15,
];

/// A body of one solid.
pub(super) fn body(
    mesh: Mesh,
    kinematics: Kinematics,
    material: Material,
) -> Result<Problem, Failure> {
    let mut problem = Problem::new(mesh, kinematics)?;
    problem.materials = vec![material; problem.mesh.regions.len()];
    Ok(problem)
}

/// Drives all components of some nodes by a parameter, each by its displacement.
pub(super) fn drive(
    problem: &mut Problem,
    nodes: &[u32],
    parameter: Parameter,
    displacement: impl Fn([f64; 3]) -> [f64; 3],
) {
    for &node in nodes {
        let u = displacement(problem.mesh.points[node as usize]);
        for component in 0..problem.kinematics.components() {
            problem.supports.push(Support {
                nodes: vec![node],
                component,
                motion: Motion::Driven(parameter, u[component]),
            });
        }
    }
}

/// Goes to these targets.
pub(super) fn load_to(solver: &mut Solver, targets: &[f64]) -> Result<(), Failure> {
    solver.load_to(targets, |_, _| Continue::Yes)
}

/// A solver with a first step that takes the whole way when it can.
pub(super) fn eager(problem: Problem) -> Result<Solver, Failure> {
    let mut solver = Solver::new(problem)?;
    solver.settings.first_step = 1.0;
    Ok(solver)
}

/// The node nearest to a place.
pub(super) fn node_near(mesh: &Mesh, place: [f64; 3]) -> u32 {
    let distance =
        |point: &[f64; 3]| -> f64 { (0..3).map(|d| (point[d] - place[d]).powi(2)).sum() };
    let nearest = (0..mesh.points.len())
        .min_by(|&a, &b| distance(&mesh.points[a]).total_cmp(&distance(&mesh.points[b])));
    nearest.unwrap_or(0) as u32
}

/// A place in a cell, from reference coordinates.
pub(super) fn place_in(mesh: &Mesh, cell: usize, at: [f64; 3]) -> [f64; 3] {
    interpolated(mesh, cell, at, &mesh.points)
}

/// A field given by nodes at a place in a cell.
pub(super) fn interpolated(mesh: &Mesh, cell: usize, at: [f64; 3], field: &[[f64; 3]]) -> [f64; 3] {
    let shapes = mesh.shape(cell).shapes(at);
    let mut sum = [0.0; 3];
    for (&node, value) in mesh.cell(cell).iter().zip(&shapes.values) {
        for d in 0..3 {
            sum[d] += value * field[node as usize][d];
        }
    }
    sum
}
