//! Steps that hop over a fold of the path.
//!
//! Newton's iteration of a long step may fall on an equilibrium beyond a limit of the load: a state
//! like any other, but no path leads there. It is told by the ways of the nodes: along a path a way
//! lies between those that the tangents at both ends foresee, unless the body gives way and stiffens
//! again in between. A step that goes much farther is divided until its way is foreseen; where even
//! the smallest goes so far, there is a jump.

use std::mem::{replace, take};

use super::failure::Reason;
use super::foreseen::Foreseen;
use super::newton::Solver;
use super::settings::{Jump, Step};
use crate::assembly::state::State;
use crate::assembly::system::Assembled;

/// A step hops if it misses the mean of its foreseen ways by more than so many times the greatest of
/// them.
const HOPS: f64 = 2.0;

/// An equilibrium beyond a fold.
pub(super) struct Beyond {
    pub(super) state: State,
    pub(super) targets: Vec<f64>,
    pub(super) step: Step,
    /// Share of the way at which it lies, and that of the step which led there.
    pub(super) along: [f64; 2],
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn greatest(ways: &[[f64; 3]]) -> f64 {
    ways.iter().fold(0.0, |most, way| most.max(length(*way)))
}

/// Ways of the nodes from one state to another, m.
fn ways(from: &State, to: &State) -> Vec<[f64; 3]> {
    let both = to.displacement.iter().zip(&from.displacement);
    both.map(|(new, old)| std::array::from_fn(|d| new[d] - old[d]))
        .collect()
}

/// Whether some way back, of any length, makes these ways a hop: it moves the mean by half of
/// itself, which is at most half of the greatest foreseen way.
fn leaves_room(ways: &[[f64; 3]], ahead: &[[f64; 3]]) -> bool {
    let most = (HOPS - 0.5) * greatest(ahead);
    let mut both = ways.iter().zip(ahead);
    both.any(|(way, ahead)| length(std::array::from_fn(|d| way[d] - 0.5 * ahead[d])) > most)
}

/// The greatest extent of some points along an axis.
fn extent(points: impl Iterator<Item = [f64; 3]>) -> f64 {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [low, high] = points.fold(none, |[low, high], x| {
        let with = |d: usize| (low[d].min(x[d]), high[d].max(x[d]));
        [
            std::array::from_fn(|d| with(d).0),
            std::array::from_fn(|d| with(d).1),
        ]
    });
    (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max)
}

impl Solver {
    /// What is known of a step to these targets before it is taken.
    pub(super) fn foresee(&self, targets: &[f64]) -> Option<Foreseen> {
        if self.iterative.is_some() || self.targets == targets {
            return None;
        }
        let straight = self.previous.as_ref().and_then(|previous| {
            let ratio = previous.ratio(&self.targets, targets)?;
            let ways = self.state.displacement.iter();
            let ways = ways.zip(&previous.state.displacement);
            let ways = ways.map(|(now, old)| std::array::from_fn(|d| ratio * (now[d] - old[d])));
            Some(ways.collect())
        });
        Some(Foreseen {
            ahead: straight.unwrap_or_default(),
            back: Vec::new(),
        })
    }

    /// True if a step to this state may be a hop, as far as is known without its end's tangent.
    pub(super) fn may_hop(&self, found: &State) -> bool {
        let ahead = self.foreseen.as_ref().map(|foreseen| &foreseen.ahead);
        ahead.is_some_and(|ahead| leaves_room(&ways(&self.state, found), ahead))
    }

    /// Keeps what the tangent at an equilibrium foresees of the way back.
    pub(super) fn foresee_back(&mut self, found: &State, assembled: &Assembled) {
        let back = self.change(found, assembled, &self.targets.clone());
        if let (Some(foreseen), Ok(back)) = (&mut self.foreseen, back) {
            foreseen.back = back.displacement;
        }
    }

    /// One step; refused where it hops over a fold, with what lies beyond. `along` is the share of
    /// the way at its end, and its own.
    pub(super) fn tried(
        &mut self,
        (targets, elapsed): (&[f64], f64),
        along: [f64; 2],
        beyond: &mut Option<Beyond>,
    ) -> Result<Step, Reason> {
        let step = self.step(targets, elapsed);
        let foreseen = self.foreseen.take();
        let mut step = step?;
        step.jump = foreseen.and_then(|foreseen| self.hop(&foreseen));
        let (Some(jump), Some(before)) = (step.jump, &mut self.previous) else {
            return Ok(step);
        };
        let (state, targets) = (take(&mut before.state), take(&mut before.targets));
        *beyond = Some(Beyond {
            state: replace(&mut self.state, state),
            targets: replace(&mut self.targets, targets),
            step,
            along,
        });
        self.restart_here();
        Err(Reason::Hopped {
            way: jump.way,
            place: jump.place,
        })
    }

    /// Accepts the equilibrium beyond a fold.
    pub(super) fn land(&mut self, beyond: Option<Beyond>) -> Option<(Step, [f64; 2])> {
        let settings = &self.settings;
        let may = settings.jump_steps > 0 && self.jumps < settings.jumps;
        let may = may && !self.ear.asked() && !self.slides();
        let beyond = beyond.filter(|_| may)?;
        self.restart(beyond.state, beyond.targets);
        Some((beyond.step, beyond.along))
    }

    /// The hop of the step that was just accepted, if it is one.
    fn hop(&self, Foreseen { ahead, back }: &Foreseen) -> Option<Jump> {
        let before = &self.previous.as_ref()?.state;
        if ahead.is_empty() || back.is_empty() {
            return None;
        }
        let ways = ways(before, &self.state);
        let missed = |node: usize| {
            let mean = |d: usize| 0.5 * (ahead[node][d] - back[node][d]);
            length(std::array::from_fn(|d| ways[node][d] - mean(d)))
        };
        let node = (0..ways.len()).max_by(|&a, &b| missed(a).total_cmp(&missed(b)))?;
        let foreseen = greatest(ahead).max(greatest(back));
        let way = length(ways[node]);
        let hops = missed(node) > HOPS * foreseen && way > self.cell_at(node);
        hops.then(|| Jump {
            way,
            place: self.problem.mesh.points[node],
        })
    }

    /// Extent of the smallest cell at a node, m: points that come to touch or to slide one after
    /// the other make shorter ways, which are those of the mesh.
    fn cell_at(&self, node: usize) -> f64 {
        let mesh = &self.problem.mesh;
        let cells = (0..mesh.cell_count()).map(|cell| mesh.cell(cell));
        let at = cells.filter(|nodes| nodes.contains(&(node as u32)));
        at.map(|nodes| extent(nodes.iter().map(|&node| mesh.points[node as usize])))
            .fold(f64::INFINITY, f64::min)
    }
}
