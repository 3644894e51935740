//! Volume ratio over whole cells, also between the points of integration.

use crate::assembly::state::State;
use crate::assembly::system::InvertedCell;
use crate::mesh::{CellShape, Shapes};
use crate::problem::{Kinematics, Problem};
use crate::scalar::determinant;

/// The least volume ratio `J` in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastVolume {
    /// `J`; zero or less where the cell is inside out.
    pub ratio: f64,
    /// Number of the cell.
    pub cell: usize,
    /// Undeformed place.
    pub place: [f64; 3],
}

/// Where the ratio of a shape of cells is looked at.
pub(super) struct Lattice {
    shape: CellShape,
    /// Corners and points within.
    coarse: Vec<Shapes>,
    /// Many points, for cells that have lost or gained much of their volume somewhere.
    fine: Vec<Shapes>,
}

/// Below this ratio at a coarse point a cell is looked at closely.
const CLOSELY: f64 = 0.5;
/// Intervals of the close look along an edge.
const INTERVALS: usize = 12;

impl Lattice {
    fn new(shape: CellShape) -> Self {
        // In space the nodes are enough: the usual points of integration lie between them.
        let coarse: Vec<[f64; 3]> = if shape.dimension() == 2 {
            let points = shape.closed_quadrature(false).into_iter();
            points.map(|point| point.at).collect()
        } else {
            (0..shape.node_count())
                .map(|node| shape.node_at(node))
                .collect()
        };
        let tables =
            |places: Vec<[f64; 3]>| places.into_iter().map(|at| shape.shapes(at)).collect();
        Self {
            shape,
            coarse: tables(coarse),
            fine: tables(closely(shape)),
        }
    }

    /// Lattices of all shapes of cells in a problem.
    pub(super) fn of(problem: &Problem) -> Vec<Self> {
        let mut lattices: Vec<Self> = Vec::new();
        for cell in 0..problem.mesh.cell_count() {
            let shape = problem.mesh.shape(cell);
            if lattices.iter().all(|known| known.shape != shape) {
                lattices.push(Self::new(shape));
            }
        }
        lattices
    }
}

/// All points that a cell can be integrated at, and an even lattice between them.
fn closely(shape: CellShape) -> Vec<[f64; 3]> {
    let simplex = matches!(shape, CellShape::Tri7 | CellShape::Tet15);
    let step = |k: usize| k as f64 / INTERVALS as f64;
    let place = |k: usize| {
        if simplex {
            step(k)
        } else {
            2.0 * step(k) - 1.0
        }
    };
    let depth = if shape.dimension() == 3 { INTERVALS } else { 0 };
    let finest = shape.closed_quadrature(true).into_iter();
    let mut places: Vec<[f64; 3]> = finest.map(|point| point.at).collect();
    for i in 0..=INTERVALS {
        for j in 0..=INTERVALS {
            for k in 0..=depth {
                let third = if depth == 0 { 0.0 } else { place(k) };
                if !simplex || i + j + k <= INTERVALS {
                    places.push([place(i), place(j), third]);
                }
            }
        }
    }
    places
}

/// The least ratio over all cells of a body; none without cells. `inverted` hears of the cells
/// that are inside out somewhere.
pub(super) fn least_volume(
    problem: &Problem,
    state: &State,
    lattices: &[Lattice],
    inverted: &mut Vec<usize>,
) -> Option<LeastVolume> {
    let mesh = &problem.mesh;
    let mut least: Option<LeastVolume> = None;
    let mut nodes = Vec::new();
    for cell in 0..mesh.cell_count() {
        let shape = mesh.shape(cell);
        let Some(lattice) = lattices.iter().find(|lattice| lattice.shape == shape) else {
            continue;
        };
        nodes.clear();
        nodes.extend(mesh.cell(cell).iter().map(|&node| {
            let (x, u) = (
                mesh.points[node as usize],
                state.displacement[node as usize],
            );
            (x, [x[0] + u[0], x[1] + u[1], x[2] + u[2]])
        }));
        let look = |points: &[Shapes]| {
            let ratio = |shapes| match problem.kinematics {
                Kinematics::Solid => in_space(&nodes, shapes),
                kinematics => in_plane(&nodes, shapes, kinematics),
            };
            let ratios = points.iter().map(ratio).enumerate();
            ratios.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let mut own = look(&lattice.coarse).map(|(at, ratio)| (&lattice.coarse[at], ratio));
        if own.is_some_and(|(_, ratio)| ratio < CLOSELY) {
            let closely = look(&lattice.fine).map(|(at, ratio)| (&lattice.fine[at], ratio));
            own = own
                .into_iter()
                .chain(closely)
                .min_by(|a, b| a.1.total_cmp(&b.1));
        }
        let Some((shapes, ratio)) = own else {
            continue;
        };
        if ratio <= 0.0 {
            inverted.push(cell);
        }
        if least.is_none_or(|least| ratio < least.ratio) {
            let place = std::array::from_fn(|d| {
                let parts = nodes.iter().zip(&shapes.values);
                parts.map(|((x, _), value)| value * x[d]).sum()
            });
            least = Some(LeastVolume { ratio, cell, place });
        }
    }
    least
}

/// Undeformed and present place of a node.
type Places = ([f64; 3], [f64; 3]);

fn in_plane(nodes: &[Places], shapes: &Shapes, kinematics: Kinematics) -> f64 {
    let (mut rest, mut now) = ([0.0; 4], [0.0; 4]);
    let mut radius = [0.0; 2];
    for ((x, y), (slope, value)) in nodes
        .iter()
        .zip(shapes.gradients.iter().zip(&shapes.values))
    {
        for i in 0..2 {
            for k in 0..2 {
                rest[2 * i + k] += slope[k] * x[i];
                now[2 * i + k] += slope[k] * y[i];
            }
        }
        radius[0] += value * x[0];
        radius[1] += value * y[0];
    }
    let area = |g: [f64; 4]| g[0] * g[3] - g[1] * g[2];
    let ratio = area(now) / area(rest);
    // On the axis the hoop stretches as the radius does.
    let widest = nodes
        .iter()
        .fold(0.0, |most: f64, (x, _)| most.max(x[0].abs()));
    if kinematics == Kinematics::Axisymmetric && radius[0].abs() > 1e-9 * widest {
        ratio * radius[1] / radius[0]
    } else {
        ratio
    }
}

fn in_space(nodes: &[Places], shapes: &Shapes) -> f64 {
    let (mut rest, mut now) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    for ((x, y), slope) in nodes.iter().zip(&shapes.gradients) {
        for i in 0..3 {
            for k in 0..3 {
                rest[i][k] += slope[k] * x[i];
                now[i][k] += slope[k] * y[i];
            }
        }
    }
    determinant(&now) / determinant(&rest)
}

impl LeastVolume {
    /// The error of a cell that is inside out.
    pub(super) fn inverted(&self, problem: &Problem) -> InvertedCell {
        let mesh = &problem.mesh;
        InvertedCell {
            cell: self.cell,
            region: mesh.regions[mesh.region_of(self.cell)].clone(),
            place: self.place,
            volume_ratio: self.ratio,
            undeformed: false,
        }
    }
}
