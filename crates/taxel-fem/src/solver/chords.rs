//! Newton's method with a tangent that is kept (chord method): the changes after the first cost a
//! residual and a substitution, a third of one with a new tangent in the plane, a fourth to a
//! seventh in space.

use taxel_numerics::dense::dot;

use super::newton::{Change, Solver, at_floor, converged};
use super::settings::Step;
use crate::assembly::state::State;
use crate::assembly::system::Assembled;
use crate::problem::Rule;
use crate::sparse::{Definiteness, Factorisation};

/// A factor is kept for at most so many more changes in the plane and in space; so many cost as
/// much as a new tangent.
const CHANGES: [f64; 2] = [3.0, 4.0];
/// The first change after a new tangent falls by Newton's method, the next ones by about so many
/// times less.
const SLOWER: f64 = 2.0;

/// An iteration keeps its tangent once its energy norm has fallen to this share in one change: in
/// the second change of a step, whose first follows the load, and in a later one.
const NEAR: [f64; 2] = [0.01, 0.1];

/// With a tangent that is kept it ends at this share of its tolerance: as near as the square of a
/// last change comes.
const CLOSER: f64 = 1e-4;

/// An equilibrium, and how it was found.
pub(super) struct Found {
    pub(super) state: State,
    /// Energy norms since the last new tangent, with the one before if that was kept.
    pub(super) energies: Vec<f64>,
    pub(super) iterations: usize,
    /// Iterations that made a new tangent.
    pub(super) tangents: usize,
}

/// True where the changes to come are foreseen to fall fast with the present tangent.
fn is_near(energies: &[f64]) -> bool {
    match energies {
        [first, second] => *second <= NEAR[0] * first,
        [.., before, last] => *last <= NEAR[1] * before,
        _ => false,
    }
}

impl Found {
    /// Iterations that Newton's method would have taken to this energy norm, were each fall the
    /// square of the one before.
    pub(super) fn like_newton(&self, goal: f64) -> usize {
        let [first, second, ..] = self.energies[..] else {
            return self.tangents;
        };
        let (mut energy, mut fall, mut iterations) = (second, second / first, self.tangents + 1);
        while energy > goal && fall < 1.0 {
            fall *= fall;
            energy *= fall;
            iterations += 1;
        }
        iterations
    }
}

impl Solver {
    /// True if a factor stands for all equations at a state near to these targets.
    pub(super) fn keeps_factor(&self, state: &State, targets: &[f64]) -> bool {
        self.iterative.is_none()
            && self.drag.is_none()
            && self.problem.contacts.is_empty()
            && self.problem.rigid_bodies.is_empty()
            && state.memory.histories.is_empty()
            && self.problem.rules().iter().all(|rule| *rule == Rule::Given)
            && state.parameters == targets
    }

    /// Ends an iteration of Newton's method that has come near, with the tangent of its last change,
    /// which was positive; none, and nothing done, where that does not converge. `goal` is the energy
    /// norm at which Newton's method ends.
    pub(super) fn finish(
        &mut self,
        trial: &mut State,
        targets: &[f64],
        energies: &mut Vec<f64>,
        goal: f64,
    ) -> Option<Step> {
        if !is_near(energies) || !self.keeps_factor(trial, targets) {
            return None;
        }
        let iteration = energies.len();
        let kept = energies.last().copied();
        let found = self.chords(trial.clone(), kept, CLOSER * goal)?;
        energies.truncate(iteration - usize::from(found.tangents == 0));
        energies.extend(&found.energies);
        let step = Step {
            iterations: iteration + found.iterations,
            before_rounds: iteration + found.like_newton(goal),
            ..converged(iteration, Definiteness::Positive, energies)
        };
        *trial = found.state;
        Some(step)
    }

    /// Iterates with a factor that is renewed only where convergence is slow, until less than `goal`
    /// is left of the energy norm. `kept` is the norm of the last change, if its factor is still
    /// there. None, and nothing done, where the iteration does not converge so.
    pub(super) fn chords(&mut self, start: State, kept: Option<f64>, goal: f64) -> Option<Found> {
        let mut renew = kept.is_none();
        let mut found = Found {
            state: start,
            energies: Vec::from_iter(kept),
            iterations: 0,
            tangents: 0,
        };
        while found.iterations < self.settings.iterations && !self.ear.asked() {
            found.iterations += 1;
            let assembled = self.system.assemble(&self.problem, &found.state, renew);
            let mut assembled = assembled.ok()?;
            let last = self.change_kept(&assembled, &mut found, &mut renew, goal);
            self.system.reuse(std::mem::take(&mut assembled.values));
            if last? {
                return Some(found);
            }
        }
        None
    }

    /// One change, which is not taken where a new tangent is due; true if it was the last, none
    /// where no factor stands for the tangent.
    fn change_kept(
        &mut self,
        assembled: &Assembled,
        found: &mut Found,
        renew: &mut bool,
        goal: f64,
    ) -> Option<bool> {
        if *renew {
            let pattern = &self.system.unknowns.pattern;
            let definiteness = self.factor.refactor(pattern, &assembled.values).ok()?;
            if definiteness != Definiteness::Positive || !assembled.unsymmetric.is_empty() {
                return None;
            }
            found.tangents += 1;
            found.energies.clear();
        }
        let mut unknowns: Vec<f64> = assembled.residual.iter().map(|r| -r).collect();
        self.factor.solve(&mut unknowns);
        self.iterations += 1;
        let energy = -dot(&assembled.residual, &unknowns);
        let last = energy.abs().sqrt();
        found.energies.push(last);
        let rate = match found.energies.as_slice() {
            [first, second] => SLOWER * second / first,
            [.., before, last] => last / before,
            _ => 0.0,
        };
        let changes = (goal / last).ln() / rate.ln();
        let allowed = CHANGES[self.system.unknowns.components() - 2];
        let second = found.energies.len() > 1;
        *renew = second && !(rate < 1.0 && changes <= allowed);
        if *renew {
            return Some(false);
        }
        // What the next changes would add.
        let left = last * rate / (1.0 - rate);
        let settled = second && left <= goal || at_floor(&found.energies, assembled.rounding);
        let parameters = vec![0.0; found.state.parameters.len()];
        let mut displacement = vec![[0.0; 3]; found.state.displacement.len()];
        self.system
            .displace(&mut displacement, &unknowns, &parameters);
        let change = Change {
            energy,
            given_only: true,
            parameters,
            displacement,
            unknowns,
        };
        let before = found.state.clone();
        let (missed, _) = self.apply(&mut found.state, &before, assembled, &change, 1.0);
        Some(settled && missed <= self.settings.tolerance)
    }
}
