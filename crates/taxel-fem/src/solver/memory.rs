//! Solids with memory: what they carry from step to step.

use super::state::{Carried, State};
use super::stress::stress_points;
use crate::material::viscoelastic::History;
use crate::problem::Problem;

impl Carried {
    /// Memory of a body at rest; empty where no region relaxes.
    pub(crate) fn rest(problem: &Problem) -> Self {
        if problem.relaxations.iter().all(Option::is_none) {
            return Self::default();
        }
        let mesh = &problem.mesh;
        let histories = (0..mesh.cell_count()).map(|cell| {
            let relaxation = problem.relaxations.get(mesh.region_of(cell))?.as_ref()?;
            let points = mesh.shape(cell).quadrature().len();
            Some(History::new(relaxation, points))
        });
        Self {
            histories: histories.collect(),
            ..Self::default()
        }
    }

    /// Begins a step of a duration in s.
    pub(crate) fn begin(&mut self, duration: f64) {
        self.cells.clear();
        for history in &mut self.histories {
            let Some(history) = history else {
                self.cells.push((1.0, Vec::new()));
                continue;
            };
            // Durations are not negative: `go_in` refuses those that are.
            let factor = history.begin_step(duration).unwrap_or(1.0);
            let points = (0..history.points()).map(|point| *history.carried(point));
            self.cells.push((factor, points.collect()));
        }
    }
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
