//! Solids with memory: what they carry from step to step.

use super::stress::stress_points;
use crate::assembly::state::State;
use crate::problem::Problem;

/// First step of a time over the shortest relaxation time, and the growth of the steps with the
/// time since the beginning: creep is then exact to about 1e-4.
const FIRST: f64 = 0.05;
const GROWTH: f64 = 0.1;
/// Share of the greatest elastic stress by which a held one may change.
const HELD: f64 = 1e-6;

/// Relaxation times of a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    shortest: f64,
    /// After so long nothing changes any more.
    rest: f64,
}

impl Times {
    /// Of all solids with memory; none without.
    pub(super) fn of(problem: &Problem) -> Option<Self> {
        let series = problem.relaxations.iter().flatten();
        let mut times: Option<Self> = None;
        for relaxation in series {
            for term in relaxation.terms().iter().filter(|term| term.fraction > 0.0) {
                // A strain that creeps takes longer than a stress that relaxes.
                let rest = 40.0 * term.time / relaxation.remaining(f64::INFINITY);
                let known = times.unwrap_or(Self {
                    shortest: term.time,
                    rest,
                });
                times = Some(Self {
                    shortest: known.shortest.min(term.time),
                    rest: known.rest.max(rest),
                });
            }
        }
        times
    }

    /// Time that is cut into steps, of a duration that may be infinite.
    pub(super) fn span(self, duration: f64) -> f64 {
        duration.min(self.rest)
    }

    /// Longest step that starts this long after the beginning.
    pub(super) fn step(self, gone: f64) -> f64 {
        FIRST * self.shortest + GROWTH * gone
    }
}

/// True if the elastic stress stayed as it was: then a step of any length is exact.
pub(super) fn held(before: &State, after: &State) -> bool {
    let (mut change, mut size) = (0.0_f64, 0.0_f64);
    let histories = before.memory.histories.iter().zip(&after.memory.histories);
    for (before, after) in histories {
        if let (Some(before), Some(after)) = (before, after) {
            let own = after.change_from(before);
            change = change.max(own.0);
            size = size.max(own.1);
        }
    }
    change <= HELD * size
}

/// Remembers a step that has converged.
pub(crate) fn remember(problem: &Problem, state: &mut State) {
    if state.memory.histories.is_empty() {
        return;
    }
    let mut memory = std::mem::take(&mut state.memory);
    let mut before = usize::MAX;
    let mut number = 0;
    for point in stress_points(problem, state) {
        number = if point.cell == before { number + 1 } else { 0 };
        before = point.cell;
        if let Some(history) = &mut memory.histories[point.cell] {
            let law = &problem.materials[problem.mesh.region_of(point.cell)].law;
            history.end_step(number, law, &point.gradient);
        }
    }
    state.memory = memory;
}
