//! A quarter of the block, solved for loads that its other side mirrors in one way.

use std::collections::BTreeMap;

use super::{BlockSides, BumpBlock, CAVITIES, STRIPS, strip_name};
use crate::material::Material;
use crate::mesh::Mesh;
use crate::problem::load::traction;
use crate::problem::{
    Cavity, CavityLaw, DeadLoad, Kinematics, Motion, Parameter, Problem, ProblemError, Rule,
};
use crate::solver::failure::{Failure, Reason};
use crate::solver::linear::LinearResponse;
use crate::solver::newton::{Continue, Solver};

/// What a load does on the other side of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mirror {
    /// The mirror image.
    Same,
    /// The opposite of the mirror image.
    Opposite,
}

/// Parameters of the loads, each 1 N on the whole block or 1 Pa.
#[derive(Clone, Copy)]
pub(super) struct Loads {
    pub(super) top: Parameter,
    /// Toward the axis and downward, half of it on each side.
    pub(super) strips: [[Parameter; 2]; STRIPS],
    pub(super) pressure: Parameter,
}

/// A quarter of the block with one mirror, solved.
pub(super) struct Half<'b> {
    block: &'b BumpBlock,
    pub(super) solver: Solver,
    pub(super) loads: Loads,
    /// In the order of the parameters.
    answers: Vec<LinearResponse>,
}

impl<'b> Half<'b> {
    pub(super) fn solve(
        block: &'b BumpBlock,
        mesh: Mesh,
        solids: [Material; 2],
        sides: BlockSides,
        mirror: Mirror,
    ) -> Result<Self, Failure> {
        let mut half = Self::at_rest(block, mesh, solids, sides, mirror)?;
        let all: Vec<_> = (0..=half.loads.pressure.0).map(Parameter).collect();
        half.answers = half.solver.linear_responses(&all)?;
        Ok(half)
    }

    /// The quarter without its answers.
    pub(super) fn at_rest(
        block: &'b BumpBlock,
        mesh: Mesh,
        solids: [Material; 2],
        sides: BlockSides,
        mirror: Mirror,
    ) -> Result<Self, Failure> {
        let (problem, loads) = pose(block, mesh, solids, sides, mirror)
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        Ok(Self {
            block,
            solver: Solver::new(problem)?,
            loads,
            answers: Vec::new(),
        })
    }

    pub(super) fn answer(&self, load: Parameter) -> &LinearResponse {
        &self.answers[load.0]
    }

    /// Each cavity keeps a gas of the pressure scale `scale`, Pa, whose pressure is an unknown.
    pub(super) fn seal(&mut self, scale: f64) -> Result<(), Failure> {
        let gas = CavityLaw::Gas {
            scale,
            rest: self.cavity(),
        };
        self.solver
            .set_rule(self.loads.pressure, Rule::Follows(0, gas))
    }

    /// Loads the top of the whole block with `force` newtons.
    pub(super) fn load(&mut self, force: f64) -> Result<(), Failure> {
        let mut targets = self.solver.targets().to_vec();
        targets[self.loads.top.0] = force;
        // Nearly linear: one step, which the solver cuts where it must.
        self.solver.settings.first_step = 1.0;
        self.solver.load_to(&targets, |_, _| Continue::Yes)
    }

    /// Closing between the plates, m, and pressure in the cavities, Pa, as they are.
    pub(super) fn now(&self) -> Result<[f64; 2], Failure> {
        let state = self.solver.state();
        let inside = state.parameters[self.loads.pressure.0];
        let loaded = LinearResponse {
            displacement: state.displacement.clone(),
            forces: Vec::new(),
            volumes: Vec::new(),
        };
        let closing = self.closing(0, &loaded);
        let closing = closing.map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        Ok([closing[0], inside])
    }

    /// Volume of the cavity at rest, m3.
    pub(super) fn cavity(&self) -> f64 {
        let problem = self.solver.problem();
        let mesh = &problem.mesh;
        problem.cavities[0].volume(mesh, problem.kinematics, &mesh.points)
    }

    /// Integral of `weight` times the rise of a surface, and of `weight`.
    fn over(
        &self,
        surface: &str,
        answer: &LinearResponse,
        weight: impl Fn([f64; 3]) -> f64,
    ) -> Result<[f64; 2], ProblemError> {
        let problem = self.solver.problem();
        let facets = problem.surface(surface)?;
        let up = |place| [0.0, 0.0, weight(place)];
        let weights = traction(&problem.mesh, problem.kinematics, &facets, up);
        let sums = weights
            .iter()
            .fold([0.0; 2], |[sum, whole], (node, weight)| {
                let rise = answer.displacement[*node as usize][2];
                [sum + weight[2] * rise, whole + weight[2]]
            });
        Ok(sums)
    }

    /// Mean rise of a strip of the flank.
    pub(super) fn rise(&self, strip: usize, answer: &LinearResponse) -> Result<f64, ProblemError> {
        let [sum, whole] = self.over(&strip_name(strip), answer, |_| 1.0)?;
        Ok(sum / whole)
    }

    /// 1 over a plate, 0 beside it.
    fn on_plate(&self, [x, y, _]: [f64; 3]) -> f64 {
        let x = self.block.across_axis(x).0.abs();
        let plate = self.block.plate[0]..=self.block.plate[1];
        f64::from(u8::from(plate.contains(&x) && plate.contains(&y)))
    }

    /// Mean closing between the plates and largest closing in a cavity, m.
    pub(super) fn closing(
        &self,
        cavity: usize,
        answer: &LinearResponse,
    ) -> Result<[f64; 2], ProblemError> {
        let mesh = &self.solver.problem().mesh;
        let mut mean = 0.0;
        let mut columns = BTreeMap::<[i64; 2], f64>::new();
        for (face, sign) in [("floor", 1.0), ("roof", -1.0)] {
            let name = &format!("{}.{face}", CAVITIES[cavity]);
            let [sum, whole] = self.over(name, answer, |place| self.on_plate(place))?;
            mean += sign * sum / whole;
            for node in mesh.nodes_of(name).unwrap_or_default() {
                let [x, y, _] = mesh.points[node as usize];
                // Places of one column are equal up to rounding.
                let key = [x, y].map(|x| (x / self.block.half * 1e9).round() as i64);
                *columns.entry(key).or_default() += sign * answer.displacement[node as usize][2];
            }
        }
        let largest = columns.into_values().fold(f64::NEG_INFINITY, f64::max);
        Ok([mean, largest])
    }

    /// Slope of the closing over the plate along x and y.
    pub(super) fn slopes(&self, answer: &LinearResponse) -> Result<[f64; 2], ProblemError> {
        let [near, far] = self.block.plate;
        let middle = f64::midpoint(near, far);
        let square = (far - near).powi(2) / 12.0;
        let mut slopes = [0.0; 2];
        for (face, sign) in [("floor", 1.0), ("roof", -1.0)] {
            let name = &format!("{}.{face}", CAVITIES[0]);
            let [_, area] = self.over(name, answer, |place| self.on_plate(place))?;
            for (axis, slope) in slopes.iter_mut().enumerate() {
                let arm = |place: [f64; 3]| self.on_plate(place) * (place[axis] - middle);
                *slope += sign * self.over(name, answer, arm)?[0] / (area * square);
            }
        }
        Ok(slopes)
    }
}

pub(super) fn pose(
    block: &BumpBlock,
    mesh: Mesh,
    [soft, stiff]: [Material; 2],
    sides: BlockSides,
    mirror: Mirror,
) -> Result<(Problem, Loads), ProblemError> {
    let mut problem = Problem::new(mesh, Kinematics::Solid)?;
    let regions = problem.mesh.regions.iter();
    problem.materials = regions
        .map(|name| if name == "stiff" { stiff } else { soft })
        .collect();
    problem.clamp("bottom")?;
    problem.support("front", 1, Motion::Fixed)?;
    match mirror {
        Mirror::Same => problem.support("left", 0, Motion::Fixed)?,
        Mirror::Opposite => {
            problem.support("left", 1, Motion::Fixed)?;
            problem.support("left", 2, Motion::Fixed)?;
        }
    }
    if sides == BlockSides::Symmetric {
        problem.support("back", 1, Motion::Fixed)?;
        problem.support("right", 0, Motion::Fixed)?;
    }
    let down = [0.0, 0.0, -1.0];
    let top = match mirror {
        Mirror::Same => down,
        Mirror::Opposite => [1.0, 0.0, 0.0],
    };
    // A quarter of the block has a quarter of the top, and half of a flank.
    let top = push(&mut problem, "pressed", top, 0.25)?;
    let mut strips = [[top; 2]; STRIPS];
    for (number, loads) in strips.iter_mut().enumerate() {
        let name = strip_name(number);
        // Half of the load on each of the two flanks.
        for (load, along) in loads.iter_mut().zip([[-1.0, 0.0, 0.0], down]) {
            *load = push(&mut problem, &name, along, 0.25)?;
        }
    }
    let pressure = problem.parameter("pressure in the cavities", Rule::Given);
    let wall = problem.surface(CAVITIES[0])?;
    problem.cavities.push(Cavity {
        wall,
        axis: 2,
        origin: 0.5 * -block.air,
        pressure,
    });
    let loads = Loads {
        top,
        strips,
        pressure,
    };
    Ok((problem, loads))
}

/// A force of `size` newtons, uniform over a surface.
fn push(
    problem: &mut Problem,
    surface: &str,
    along: [f64; 3],
    size: f64,
) -> Result<Parameter, ProblemError> {
    let parameter = problem.parameter(&format!("force on {surface}"), Rule::Given);
    let facets = problem.surface(surface)?;
    let unit = |_| [1.0, 0.0, 0.0];
    let area: f64 = traction(&problem.mesh, problem.kinematics, &facets, unit)
        .iter()
        .map(|(_, force)| force[0])
        .sum();
    let pull = along.map(|along| along * size / area);
    problem.dead_loads.push(DeadLoad {
        forces: traction(&problem.mesh, problem.kinematics, &facets, |_| pull),
        parameter,
    });
    Ok(parameter)
}
