//! A stiff element in an incompressible layer that a rigid disc presses onto a rigid base, in
//! small deformation: the share of the force that it takes, and how it is pulled apart.

use super::bump_block::linear;
use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Grading, Grid2, Growth, Mesh, MeshError, Part};
use crate::problem::{Kinematics, Motion, Problem, ProblemError, Rule};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Solver};
use crate::solver::stress::stress_points;

/// A plate of a stiff solid: the element, or a sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffPlate {
    /// Thickness, m.
    pub thickness: f64,
    /// Young's modulus, Pa, and Poisson's ratio below 0.5.
    pub elastic: [f64; 2],
}

/// A round element in the layer under the middle of the disc. Lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeatedDisc {
    /// Radius of the disc.
    pub radius: f64,
    /// Thickness of the layer, the element included.
    pub thickness: f64,
    /// Radius of the layer, at least that of the disc.
    pub outer: f64,
    /// True if the layer sticks to the disc; otherwise it slides without friction.
    pub gripped: bool,
    /// Young's modulus of the layer, Pa; it keeps its volume.
    pub modulus: f64,
    /// The element; none for the layer alone, whose stress in the place of the element is asked.
    pub element: Option<StiffPlate>,
    /// Radius of the element.
    pub element_radius: f64,
    /// Lower and upper face of the element above the base.
    pub faces: [f64; 2],
    /// Width of an empty ring around the element; 0 without one.
    pub void: f64,
    /// Continuous sheets on both faces of the element, over the whole layer.
    pub sheets: Option<StiffPlate>,
    /// Largest and smallest cell; the smallest ones are at the rims and faces.
    pub cells: [f64; 2],
}

/// What the element meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeatedAnswer {
    /// Force of the disc over its displacement, N/m.
    pub stiffness: f64,
    /// Mean normal stress of the element over the mean pressure of the disc.
    pub share: f64,
    /// Mean of the two stresses in the plane of the element over its normal stress; negative where
    /// a pressed element is pulled apart.
    pub in_plane: f64,
    /// Number of unknowns.
    pub unknowns: usize,
}

impl SeatedAnswer {
    /// Charge per force of the disc over d33 times the ratio of the areas, for the constants d33
    /// and d31: share (1 + 2 s d31/d33).
    pub fn charge_factor(&self, [along, across]: [f64; 2]) -> f64 {
        self.share * (1.0 + 2.0 * self.in_plane * across / along)
    }
}

/// Ratio of neighbouring cells.
const GROWTH: f64 = 1.4;
/// Displacement of the disc over the thickness: its square is lost in the answer, and the strain of
/// an element that is a million times stiffer is well above rounding.
const TRAVEL: f64 = 1e-4;

impl SeatedDisc {
    /// The answer for small displacements.
    ///
    /// # Errors
    /// When the lengths make no layer, or the solution fails.
    pub fn solve(&self) -> Result<SeatedAnswer, Failure> {
        let mesh = self
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let problem = self
            .pose(mesh)
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        let mut solver = Solver::new(problem)?;
        solver.settings.first_step = 1.0;
        let travel = TRAVEL * self.thickness;
        solver.load_to(&[travel], |_, _| Continue::Yes)?;
        let force = solver.evaluate()?.along[0];
        let (mut volume, mut stress) = (0.0, [0.0; 3]);
        let (low, high) = (self.faces[0], self.faces[1]);
        for point in stress_points(solver.problem(), solver.state()) {
            let [r, z, _] = point.place;
            if r < self.element_radius && low < z && z < high {
                // Around the axis: the volume of a point has its radius.
                volume += point.volume;
                for (sum, component) in stress.iter_mut().zip(point.cauchy) {
                    *sum += point.volume * component;
                }
            }
        }
        let [radial, normal, around] = stress.map(|sum| sum / volume);
        let pressure = force / (std::f64::consts::PI * self.radius * self.radius);
        Ok(SeatedAnswer {
            stiffness: force / travel,
            share: -normal / pressure,
            in_plane: f64::midpoint(radial, around) / normal,
            unknowns: solver.unknowns(),
        })
    }

    fn mesh(&self) -> Result<Mesh, MeshError> {
        let [largest, smallest] = self.cells;
        let growth = Growth {
            smallest,
            ratio: GROWTH,
            largest,
        };
        let sheet = self.sheets.map_or(0.0, |sheet| sheet.thickness);
        let [low, high] = self.faces;
        let along = [
            0.0,
            self.element_radius,
            self.element_radius + self.void,
            self.radius,
            self.outer,
        ];
        let up = [0.0, low - sheet, low, high, high + sheet, self.thickness];
        let axis = |marks: &[f64]| {
            // A mark that is not farther from the last one than rounding is no mark.
            let mut ends: Vec<f64> = Vec::new();
            for mark in marks {
                if ends
                    .last()
                    .is_none_or(|last| mark - last > 1e-6 * self.thickness)
                {
                    ends.push(*mark);
                }
            }
            let gradings = vec![Grading::FromBoth(growth); ends.len() - 1];
            Axis::new(&ends, &gradings)
        };
        let within = |x: f64, [low, high]: [f64; 2]| low < x && x < high;
        let part = |[r, z, _]: [f64; 3]| {
            let beside = within(z, [low, high]);
            if beside && r < self.element_radius {
                Part::Region("element")
            } else if beside && r < self.element_radius + self.void {
                Part::Void("rim")
            } else if within(z, [low - sheet, low]) || within(z, [high, high + sheet]) {
                Part::Region("sheet")
            } else {
                Part::Region("layer")
            }
        };
        let mut mesh = Grid2::new([axis(&along)?, axis(&up)?], "layer").mesh_by(&part)?;
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
        let soft = Material {
            law: Law::neo_hookean(self.modulus / 3.0),
            volumetric: Volumetric::Incompressible,
        };
        let stiff = |plate: Option<StiffPlate>| {
            plate.map_or(soft, |StiffPlate { elastic, .. }| {
                linear(elastic[0], elastic[1])
            })
        };
        let regions = problem.mesh.regions.iter();
        problem.materials = regions
            .map(|name| match name.as_str() {
                "element" => stiff(self.element),
                "sheet" => stiff(self.sheets),
                _ => soft,
            })
            .collect();
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
