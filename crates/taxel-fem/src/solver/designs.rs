//! Designs of one topology, one after the other: each begins with what its neighbours left.
//!
//! The start is the parabola, or the straight line, through the last states where the nodes moved
//! along a line in equal steps. One tangent is made there, and kept as long as the iteration
//! converges fast with it (chord method): the changes after the first cost a residual and a
//! substitution, a third of one with a new tangent.

use super::newton::{Change, Solver, at_floor};
use super::settings::Step;
use super::small::dot;
use crate::assembly::state::State;
use crate::problem::Rule;
use crate::solver::failure::Failure;
use crate::solver::volume::least_volume;
use crate::sparse::{Definiteness, Factorisation};

/// A factor is kept for at most so many more changes; so many cost as much as a new tangent.
const CHANGES: f64 = 3.0;
/// The first change after a new tangent falls by Newton's method, the next ones by about so many
/// times less.
const SLOWER: f64 = 2.0;
/// An iteration ends at this share of the tolerance of Newton's method: its last change is not
/// the square of the one before.
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
        let step = match self.keeps_factor().then(|| self.chords(start)).flatten() {
            Some(step) => step,
            None => self.settle()?,
        };
        neighbours.push(&self.problem.mesh.points, &self.state);
        self.neighbours = neighbours;
        Ok(step)
    }

    /// True if a factor stands for all equations.
    fn keeps_factor(&self) -> bool {
        self.iterative.is_none()
            && self.problem.contacts.is_empty()
            && self.problem.rigid_bodies.is_empty()
            && self.state.memory.histories.is_empty()
            && self.problem.rules().iter().all(|rule| *rule == Rule::Given)
            && self.targets == self.state.parameters
    }

    /// Iterates with a factor that is renewed only where convergence is slow; none, and nothing
    /// done, where Newton's method has to begin anew.
    fn chords(&mut self, mut trial: State) -> Option<Step> {
        let goal = CLOSER * self.settings.tolerance * 0.03 * self.scale;
        let mut energies: Vec<f64> = Vec::new();
        let mut renew = true;
        for iteration in 1..=self.settings.iterations {
            let assembled = self.system.assemble(&self.problem, &trial, renew).ok()?;
            if renew {
                let pattern = &self.system.unknowns.pattern;
                let definiteness = self.factor.refactor(pattern, &assembled.values).ok()?;
                let symmetric = assembled.unsymmetric.is_empty();
                if definiteness != Definiteness::Positive || !symmetric {
                    return None;
                }
                energies.clear();
            }
            let mut unknowns: Vec<f64> = assembled.residual.iter().map(|r| -r).collect();
            self.factor.solve(&mut unknowns);
            self.iterations += 1;
            let energy = -dot(&assembled.residual, &unknowns);
            energies.push(energy.abs().sqrt());
            let rate = match energies.as_slice() {
                [first, second] => SLOWER * second / first,
                [.., before, last] => last / before,
                _ => 0.0,
            };
            let last = energy.abs().sqrt();
            let changes = (goal / last).ln() / rate.ln();
            renew = energies.len() > 1 && !(rate < 1.0 && changes <= CHANGES);
            if renew {
                self.system.reuse(assembled.values);
                continue;
            }
            // What the next changes would add.
            let left = last * rate / (1.0 - rate);
            let settled =
                energies.len() > 1 && left <= goal || at_floor(&energies, assembled.rounding);
            let parameters = vec![0.0; trial.parameters.len()];
            let mut displacement = vec![[0.0; 3]; trial.displacement.len()];
            self.system
                .displace(&mut displacement, &unknowns, &parameters);
            let change = Change {
                energy,
                given_only: true,
                parameters,
                displacement,
                unknowns,
            };
            let before = trial.clone();
            let (missed, _) = self.apply(&mut trial, &before, &assembled, &change, 1.0);
            self.system.reuse(assembled.values);
            if !settled || missed > self.settings.tolerance {
                continue;
            }
            let least = least_volume(&self.problem, &trial, &self.lattices, &mut Vec::new());
            if self.settings.whole_cells && least.is_some_and(|least| least.ratio <= 0.0) {
                return None;
            }
            self.state = trial;
            return Some(Step {
                iterations: iteration,
                before_rounds: iteration,
                least_volume: least,
                definiteness: Definiteness::Positive,
                fraction: 1.0,
                jump: None,
                energies: [0.0; 3],
            });
        }
        None
    }
}
