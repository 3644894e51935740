//! A rigid disc on an incompressible layer that is bonded to a rigid base, in small
//! deformation: stiffness and the pressure on the base.

use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Grading, Grid2, Growth, Mesh, MeshError};
use crate::problem::{Kinematics, Motion, Problem, ProblemError, Rule};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Solver};
use crate::solver::stress::stress_points;

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
    /// mean pressure under the disc.
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
            pressure: self
                .base(&solver)
                .into_iter()
                .map(|[r, stress]| [r / self.radius, -stress / mean])
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

    /// Distance from the axis and normal stress on the base, by the straight line through the
    /// two lowest points of each cell there.
    fn base(&self, solver: &Solver) -> Vec<[f64; 2]> {
        let points: Vec<_> = stress_points(solver.problem(), solver.state())
            .filter(|point| point.place[1] < self.smallest)
            .collect();
        let mut stresses: Vec<[f64; 2]> = Vec::new();
        for (index, low) in points.iter().enumerate() {
            let column = |point: &&crate::solver::stress::StressPoint| {
                point.cell == low.cell && (point.place[0] - low.place[0]).abs() < 1e-9
            };
            let mut others: Vec<_> = points.iter().filter(column).collect();
            others.sort_by(|a, b| a.place[1].total_cmp(&b.place[1]));
            let [first, second, ..] = others[..] else {
                continue;
            };
            if !std::ptr::eq(first, &raw const points[index]) {
                continue;
            }
            let slope = (second.cauchy[1] - first.cauchy[1]) / (second.place[1] - first.place[1]);
            stresses.push([first.place[0], first.cauchy[1] - slope * first.place[1]]);
        }
        stresses.sort_by(|a, b| a[0].total_cmp(&b[0]));
        stresses
    }
}
