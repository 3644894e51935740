//! Solids with memory: what they carry from step to step.

use super::stress::stress_points;
use crate::assembly::state::State;
use crate::problem::Problem;

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
