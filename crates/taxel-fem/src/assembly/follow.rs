//! Components of displacement that are no unknowns: held, driven by parameters, following other
//! components, or part of a rigid body.
//!
//! Each has a row: the unknowns and parameters whose changes move it, with their factors. The
//! equations are those of the unknowns and parameters alone, `T' K T` of the rows `T`. The rows
//! of rigid bodies change with their rotation.

use super::dofs::Unknowns;
use super::state::State;
use super::unsymmetric::Slot;
use crate::problem::constraint::{Following, following};
use crate::problem::rigid_body::{RigidMotion, turned};
use crate::problem::{Motion, Parameter, Problem, ProblemError, RigidBody};

/// A component that is an unknown.
const UNKNOWN: u32 = u32::MAX;

/// Rows of all components that are no unknowns.
pub(super) struct Followed {
    components: usize,
    /// Number of the row of each component of each node.
    row: Vec<u32>,
    rows: Vec<Vec<(Slot, f64)>>,
    following: Following,
}

impl Followed {
    /// The rows of a problem, before its unknowns are numbered.
    pub(super) fn new(problem: &Problem) -> Result<Self, ProblemError> {
        let components = problem.kinematics.components();
        let following = following(problem)?;
        let mut followed = Self {
            components,
            row: vec![UNKNOWN; problem.mesh.points.len() * components],
            rows: Vec::new(),
            following: Following::new(),
        };
        for &(node, component) in following.keys() {
            followed.give_row(node, component);
        }
        for body in &problem.rigid_bodies {
            for &node in &body.nodes {
                for component in 0..components {
                    followed.give_row(node, component);
                }
            }
        }
        followed.following = following;
        Ok(followed)
    }

    fn give_row(&mut self, node: u32, component: usize) {
        let row = &mut self.row[node as usize * self.components + component];
        if *row == UNKNOWN {
            *row = self.rows.len() as u32;
            self.rows.push(Vec::new());
        }
    }

    /// True if a component is no unknown.
    pub(super) fn has(&self, node: u32, component: usize) -> bool {
        self.row[node as usize * self.components + component] != UNKNOWN
    }

    /// The row of a component; none of an unknown.
    #[inline]
    pub(super) fn row(&self, node: u32, component: usize) -> Option<&[(Slot, f64)]> {
        let row = self.row[node as usize * self.components + component];
        (row != UNKNOWN).then(|| self.rows[row as usize].as_slice())
    }

    /// The nodes of a group with those that its components follow; none where that is none.
    pub(super) fn with_leaders(&self, nodes: &[u32]) -> Option<Vec<u32>> {
        let mut all = nodes.to_vec();
        for &node in nodes {
            for component in 0..self.components {
                if let Some(leaders) = self.following.get(&(node, component)) {
                    all.extend(leaders.nodes.keys().map(|(leader, _)| *leader));
                }
            }
        }
        if all.len() == nodes.len() {
            return None;
        }
        all.sort_unstable();
        all.dedup();
        Some(all)
    }

    /// Writes the rows of supports and constraints by the numbers of the unknowns.
    pub(super) fn number(&mut self, unknowns: &Unknowns) {
        for (&(node, component), leaders) in &self.following {
            let row = self.row[node as usize * self.components + component];
            let on_nodes = leaders
                .nodes
                .iter()
                .filter_map(|(&(node, component), &factor)| {
                    let number = unknowns.of(node, component)?;
                    Some((Slot::Unknown(number), factor))
                });
            let by = leaders.parameters.iter();
            let by = by.map(|(&number, &factor)| (Slot::Parameter(number), factor));
            self.rows[row as usize] = on_nodes.chain(by).collect();
        }
    }

    /// Writes the rows of rigid bodies at these values of the parameters.
    pub(super) fn turn(&mut self, problem: &Problem, parameters: &[f64]) {
        for body in &problem.rigid_bodies {
            let motion = body.motion(parameters);
            for &node in &body.nodes {
                let slopes = turned(motion.turn, arm(problem, body, node)).slopes;
                for i in 0..self.components {
                    let row = self.row[node as usize * self.components + i];
                    let row = &mut self.rows[row as usize];
                    row.clear();
                    let mut hear = |motion: Motion, slope: f64| {
                        if let Motion::Driven(Parameter(number), factor) = motion {
                            row.push((Slot::Parameter(number), factor * slope));
                        }
                    };
                    hear(body.travel[i], 1.0);
                    for k in 0..3 {
                        hear(body.turn[k], slopes[k][i]);
                    }
                }
            }
        }
    }
}

fn arm(problem: &Problem, body: &RigidBody, node: u32) -> [f64; 3] {
    let x = problem.mesh.points[node as usize];
    std::array::from_fn(|d| x[d] - body.point[d])
}

/// Puts the nodes of rigid bodies where the parameters of a state say.
pub(crate) fn place_rigid_bodies(problem: &Problem, state: &mut State) {
    let components = problem.kinematics.components();
    for body in &problem.rigid_bodies {
        let RigidMotion { travel, turn } = body.motion(&state.parameters);
        for &node in &body.nodes {
            let moved = turned(turn, arm(problem, body, node)).moved;
            for i in 0..components {
                state.displacement[node as usize][i] = travel[i] + moved[i];
            }
        }
    }
}

/// Adds what the forces on rigid bodies change where their arms turn: to `cross`, the changes of
/// the forces along parameters by parameters, from the `forces` on all components.
pub(super) fn add_turning(
    problem: &Problem,
    parameters: &[f64],
    forces: &[f64],
    cross: &mut [Vec<f64>],
) {
    let components = problem.kinematics.components();
    for body in &problem.rigid_bodies {
        let turns = body.turn.map(|motion| match motion {
            Motion::Driven(Parameter(number), factor) => Some((number, factor)),
            Motion::Fixed => None,
        });
        if turns.iter().all(Option::is_none) {
            continue;
        }
        let motion = body.motion(parameters);
        let mut sums = [[0.0; 3]; 3];
        for &node in &body.nodes {
            let bends = turned(motion.turn, arm(problem, body, node)).bends;
            let forces = &forces[node as usize * components..][..components];
            for k in 0..3 {
                for l in 0..3 {
                    let bend = bends[k][l].iter().zip(forces);
                    sums[k][l] += bend.map(|(bend, force)| bend * force).sum::<f64>();
                }
            }
        }
        for k in 0..3 {
            for l in 0..3 {
                if let (Some((first, a)), Some((second, b))) = (turns[k], turns[l]) {
                    cross[first][second] += a * b * sums[k][l];
                }
            }
        }
    }
}
