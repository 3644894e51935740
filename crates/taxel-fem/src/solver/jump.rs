//! Jumps of bodies on rough contacts.
//!
//! On a path with friction an equilibrium can end: points begin to slide, or a fold gives way, and
//! there is none nearby at the next load. A real body then jumps to the next one. It is found as the
//! end of a slow creep against a drag on every node, in implicit steps of which each has less drag than
//! the one before (pseudo-transient continuation, Kelley and Keyes 1998): the body passes through states
//! that are in balance with the drag, so its friction has a history, and it leaves what is unstable.

use super::drag::Drag;
use super::failure::Reason;
use super::newton::Solver;
use super::settings::{Jump, Step};
use crate::problem::Contact;

/// Drag of an unknown over the mean of the diagonal of the tangent: the first, and the last one
/// before a step without.
const FIRST: f64 = 1e-4;
const LAST: f64 = 1e-9;

/// Drag of the next step over that of one that has easily found a state, and of one that has found
/// none.
const FALLS: f64 = 0.4;
const GROWS: f64 = 4.0;

impl Solver {
    /// The equilibrium at these targets to which the body jumps from its last state; none if it comes
    /// to none, or may not jump, and the state stays.
    pub(super) fn jump(&mut self, reason: &Reason, targets: &[f64]) -> Option<Step> {
        if !self.may_jump(reason) {
            return None;
        }
        let (state, now, iterations) = (self.state.clone(), self.targets.clone(), self.iterations);
        let found = self.creep(targets);
        self.drag = None;
        // The way to the last part of a jump has no direction to go on in.
        self.restart_here();
        let Some(mut step) = found else {
            self.restart(state, now);
            return None;
        };
        step.iterations = self.iterations - iterations;
        let ways = state.displacement.iter().zip(&self.state.displacement);
        let ways = ways.map(|(old, new)| {
            let squares = old.iter().zip(new).map(|(old, new)| (new - old).powi(2));
            squares.sum::<f64>().sqrt()
        });
        let farthest = ways.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        step.jump = farthest.map(|(node, way)| Jump {
            way,
            place: self.problem.mesh.points[node],
        });
        Some(step)
    }

    /// True if a reason is one of a lost equilibrium, on a rough contact, of a body whose unknowns
    /// are all displacements of nodes.
    fn may_jump(&self, reason: &Reason) -> bool {
        let lost = matches!(
            reason,
            Reason::NotConverged { .. }
                | Reason::Chatter { .. }
                | Reason::Unstable { .. }
                | Reason::Hopped { .. }
        );
        let problem = &self.problem;
        let mut contacts = problem.contacts.iter();
        let rough = contacts.any(|contact| match contact {
            Contact::Obstacle(obstacle) => obstacle.friction > 0.0,
            Contact::Surfaces(pair) => pair.friction > 0.0,
            Contact::Walls(_) => false,
        });
        let nodes_alone = problem.rigid_bodies.is_empty() && problem.constraints.is_empty();
        let may = nodes_alone && self.iterative.is_none();
        lost && rough && may && self.jumps < self.settings.jumps
    }

    fn creep(&mut self, targets: &[f64]) -> Option<Step> {
        let assembled = self.assemble(&self.state.clone()).ok()?;
        let pattern = &self.system.unknowns.pattern;
        let diagonal = (0..pattern.size()).map(|k| assembled.values[pattern.column(k).start]);
        let mean = diagonal.map(f64::abs).sum::<f64>() / pattern.size() as f64;
        let mut share = FIRST;
        for _ in 0..self.settings.jump_steps {
            self.drag = (share >= LAST).then(|| Drag {
                from: self.system.unknown_part(&self.state.displacement),
                stiffness: share * mean,
            });
            self.restart_here();
            share *= match self.step(targets, 0.0) {
                Ok(step) if self.drag.is_none() => return Some(step),
                Ok(step) if step.before_rounds > self.settings.easy_iterations => 1.0,
                Ok(_) => FALLS,
                Err(Reason::Stopped) => break,
                Err(_) => GROWS,
            };
            if share > 1.0 {
                break;
            }
        }
        None
    }
}
