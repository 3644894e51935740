//! A rigid disc on an incompressible layer that is bonded to a rigid base, in small
//! deformation: stiffness and the pressure on the base.

use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Grading, Grid2, Growth, Mesh, MeshError};
use crate::problem::{Kinematics, Motion, Problem, ProblemError, Rule};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Solver};
use crate::solver::traction::Traction;

/// The disc and the layer. Lengths in thicknesses of the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedDisc {
    /// Radius of the disc.
    pub radius: f64,
    /// Layer beyond the disc, with a free surface; 0 for a layer that ends with it.
    pub beyond: f64,
    /// True if the layer sticks to the disc; otherwise it slides without friction.
    pub gripped: bool,
    /// Largest cell.
    pub largest: f64,
    /// Smallest cell, at the rim of the disc and at the base.
    pub smallest: f64,
}

/// What the disc meets.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscAnswer {
    /// Force over the area of the disc, its displacement over the thickness and Young's modulus.
    pub stiffness: f64,
    /// Distance from the axis over the radius of the disc, and pressure on the base over the
    /// mean pressure under the disc, at the nodes of the base outward: a corner of a cell and a
    /// middle of its side in turn, with a parabola through the three of each cell.
    pub pressure: Vec<[f64; 2]>,
}

/// Ratio of neighbouring cells.
const GROWTH: f64 = 1.3;
/// Displacement of the disc over the thickness: its square is lost in the answer.
const TRAVEL: f64 = 1e-5;

impl PressedDisc {
    /// The answer for small displacements.
    ///
    /// # Errors
    /// When the lengths make no layer, or the solution fails.
    pub fn solve(&self) -> Result<DiscAnswer, Failure> {
        let mesh = self
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let problem = self
            .pose(mesh)
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        let mut solver = Solver::new(problem)?;
        solver.settings.first_step = 1.0;
        solver.load_to(&[TRAVEL], |_, _| Continue::Yes)?;
        let force = solver.evaluate()?.along[0];
        let area = std::f64::consts::PI * self.radius * self.radius;
        let mean = force / area;
        Ok(DiscAnswer {
            // The shear modulus is one.
            stiffness: mean / (3.0 * TRAVEL),
            pressure: pressures(&mut solver)?
                .into_iter()
                .map(|[r, pressure]| [r / self.radius, pressure / mean])
                .collect(),
        })
    }

    fn mesh(&self) -> Result<Mesh, MeshError> {
        let growth = Growth {
            smallest: self.smallest,
            ratio: GROWTH,
            largest: self.largest,
        };
        let (mut ends, mut along) = (vec![0.0, self.radius], vec![Grading::FromEnd(growth)]);
        if self.beyond > 0.0 {
            ends.push(self.radius + self.beyond);
            along.push(Grading::FromStart(growth));
        }
        let up = [Grading::FromStart(growth), Grading::FromEnd(growth)];
        let axes = [Axis::new(&ends, &along)?, Axis::new(&[0.0, 0.5, 1.0], &up)?];
        let mut mesh = Grid2::new(axes, "layer").mesh()?;
        let top = mesh.nodes_of("top").unwrap_or_default();
        // A billionth of the length is the rounding of the places.
        let end = self.radius * (1.0 + 1e-9);
        let under = top
            .into_iter()
            .filter(|&node| mesh.points[node as usize][0] <= end)
            .collect();
        mesh.node_sets.insert("disc".to_owned(), under);
        Ok(mesh)
    }

    fn pose(&self, mesh: Mesh) -> Result<Problem, ProblemError> {
        let mut problem = Problem::new(mesh, Kinematics::Axisymmetric)?;
        problem.materials = vec![Material {
            law: Law::MooneyRivlin { c10: 0.5, c01: 0.0 },
            volumetric: Volumetric::Incompressible,
        }];
        problem.clamp("bottom")?;
        problem.support("left", 0, Motion::Fixed)?;
        let travel = problem.parameter("travel of the disc", Rule::Given);
        problem.support("disc", 1, Motion::Driven(travel, -1.0))?;
        if self.gripped {
            problem.support("disc", 0, Motion::Fixed)?;
        }
        Ok(problem)
    }
}

/// Distance from the axis and pressure at the nodes of the base, in their order.
fn pressures(solver: &mut Solver) -> Result<Vec<[f64; 2]>, Failure> {
    let forces = solver.evaluate()?.forces;
    let problem = solver.problem();
    let mesh = &problem.mesh;
    let surface = problem
        .surface("bottom")
        .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
    let force = |node: u32| [0.0, forces[2 * node as usize + 1], 0.0];
    let found = Traction::from_forces(mesh, problem.kinematics, &surface, force);
    let at = found
        .nodes
        .iter()
        .map(|&node| mesh.points[node as usize][0]);
    let values = found.values.iter().map(|value| value[1]);
    let mut pressures: Vec<[f64; 2]> = at.zip(values).map(|(r, p)| [r, p]).collect();
    pressures.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Ok(pressures)
}

impl DiscAnswer {
    /// Pressure on the base over the mean pressure under the disc, at a distance from the axis
    /// over the radius of the disc; 0 beyond the layer.
    pub fn pressure_at(&self, radius: f64) -> f64 {
        self.cells()
            .find(|cell| radius <= cell[2][0])
            .map_or(0.0, |cell| {
                let value = |i: usize| {
                    let [j, k] = [(i + 1) % 3, (i + 2) % 3];
                    let factor = |of: usize| (radius - cell[of][0]) / (cell[i][0] - cell[of][0]);
                    cell[i][1] * factor(j) * factor(k)
                };
                value(0) + value(1) + value(2)
            })
    }

    /// Force on the base over that of the disc: 1 up to rounding.
    pub fn carried(&self) -> f64 {
        // Simpson's rule is exact for the cubic r p.
        let ring = |[first, middle, last]: [[f64; 2]; 3]| {
            let product = |[r, p]: [f64; 2]| r * p;
            (last[0] - first[0]) / 6.0 * (product(first) + 4.0 * product(middle) + product(last))
        };
        2.0 * self.cells().map(ring).sum::<f64>()
    }

    /// Corner, middle and corner of each cell along the base.
    fn cells(&self) -> impl Iterator<Item = [[f64; 2]; 3]> {
        let ends = self.pressure.windows(3).step_by(2);
        ends.map(|nodes| [nodes[0], nodes[1], nodes[2]])
    }
}
