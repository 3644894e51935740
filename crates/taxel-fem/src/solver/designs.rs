//! Designs of one topology, one after the other: each begins with what its neighbours left.
//!
//! The start is the parabola, or the straight line, through the last states where the nodes moved
//! along a line in equal steps. From there it is found with tangents that are kept.

use super::newton::Solver;
use super::settings::Step;
use crate::assembly::state::State;
use crate::solver::failure::Failure;
use crate::solver::volume::least_volume;
use crate::sparse::Definiteness;

/// The iteration ends at this share of the tolerance of Newton's method: its last change is not the
/// square of the one before.
const CLOSER: f64 = 1e-2;

impl Solver {
    /// The next of many designs of one topology: puts the nodes elsewhere as
    /// [`Self::place_nodes`] does and finds the equilibrium at the present targets as
    /// [`Self::settle`] does, to 1e-9 of the energy norm of a load step. It begins where the last
    /// designs lead, and makes as few tangents as it can: one for most neighbours. Bodies with
    /// contacts, rigid bodies or memory, with loads that have no energy, or under rules other than
    /// given values, are settled as usual.
    ///
    /// # Errors
    /// When the iteration does not converge; the state stays as it was, the nodes do not.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::{Law, Material, Volumetric};
    /// use taxel_fem::mesh::{Axis, Grid2};
    /// use taxel_fem::problem::{Kinematics, Motion, Problem, Rule};
    /// use taxel_fem::solver::newton::{Continue, Solver};
    ///
    /// let axis = || Axis::uniform(0.0, 1.0, 3);
    /// let mesh = Grid2::new([axis()?, axis()?], "rubber").mesh()?;
    /// let drawn = mesh.points.clone();
    /// let mut problem = Problem::new(mesh, Kinematics::PlaneStrain)?;
    /// problem.materials.push(Material::new(Law::neo_hookean(1e5), Volumetric::Quadratic(1e8))?);
    /// problem.clamp("bottom")?;
    /// let push = problem.parameter("push", Rule::Given);
    /// problem.support("top", 1, Motion::Driven(push, 1.0))?;
    /// let mut solver = Solver::new(problem)?;
    /// solver.load_to(&[-0.1], |_, _| Continue::Yes)?;
    /// let mut forces = Vec::new();
    /// for width in [1.0, 1.01, 1.02, 1.03] {
    ///     solver.next_design(|node| [width * drawn[node][0], drawn[node][1], 0.0])?;
    ///     forces.push(solver.evaluate()?.along[0]);
    /// }
    /// // A wider block is stiffer.
    /// assert!(forces.windows(2).all(|pair| pair[1] < pair[0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn next_design(&mut self, place: impl Fn(usize) -> [f64; 3]) -> Result<Step, Failure> {
        let mut neighbours = std::mem::take(&mut self.neighbours);
        self.place_nodes(place);
        let start = neighbours.start(&self.problem.mesh.points, &self.state);
        let step = match self.neighbour(start) {
            Some(step) => step,
            None => self.settle()?,
        };
        neighbours.push(&self.problem.mesh.points, &self.state);
        self.neighbours = neighbours;
        Ok(step)
    }

    /// The equilibrium near to a start, with tangents that are kept; none, and nothing done, where
    /// Newton's method has to begin anew.
    fn neighbour(&mut self, start: State) -> Option<Step> {
        if !self.keeps_factor(&start, &self.targets) {
            return None;
        }
        let goal = CLOSER * 0.03 * self.settings.tolerance * self.scale;
        let found = self.chords(start, None, goal)?;
        let least = least_volume(&self.problem, &found.state, &self.lattices, &mut Vec::new());
        if self.settings.whole_cells && least.is_some_and(|least| least.ratio <= 0.0) {
            return None;
        }
        self.state = found.state;
        Some(Step {
            iterations: found.iterations,
            before_rounds: found.iterations,
            least_volume: least,
            definiteness: Definiteness::Positive,
            fraction: 1.0,
            jump: None,
            energies: [0.0; 3],
        })
    }
}
