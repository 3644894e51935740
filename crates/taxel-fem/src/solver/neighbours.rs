//! States of the last designs of one topology, and where they lead.

use crate::assembly::kernel::MAX_PRESSURES;
use crate::assembly::state::State;

/// Steps of designs are equal to this share.
const EQUAL: f64 = 1e-6;

/// What is left of earlier designs.
#[derive(Clone, Debug, Default)]
pub(super) struct Neighbours {
    /// Places of the undeformed nodes, displacements and pressures; the last design first.
    designs: Vec<Design>,
}

#[derive(Clone, Debug)]
struct Design {
    points: Vec<[f64; 3]>,
    displacement: Vec<[f64; 3]>,
    pressures: Vec<[f64; MAX_PRESSURES]>,
}

impl Neighbours {
    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.designs.clear();
    }

    /// Weights of the last designs whose sum is the start of a design with these nodes.
    fn weights(&self, points: &[[f64; 3]]) -> &'static [f64] {
        let [last, before, ..] = self.designs.as_slice() else {
            return &[1.0];
        };
        if !follows(&before.points, &last.points, points) {
            return &[1.0];
        }
        match self.designs.get(2) {
            Some(first) if follows(&first.points, &before.points, &last.points) => {
                &[3.0, -3.0, 1.0]
            }
            _ => &[2.0, -1.0],
        }
    }

    /// Where the iteration for a design with these nodes begins.
    pub(super) fn start(&self, points: &[[f64; 3]], state: &State) -> State {
        let mut start = state.clone();
        let weights = self.weights(points);
        if weights.len() == 1 {
            return start;
        }
        for (node, u) in start.displacement.iter_mut().enumerate() {
            *u = sum(weights, |k| self.designs[k].displacement[node]);
        }
        for (cell, p) in start.pressures.iter_mut().enumerate() {
            *p = sum(weights, |k| self.designs[k].pressures[cell]);
        }
        start
    }

    pub(super) fn push(&mut self, points: &[[f64; 3]], state: &State) {
        // The memory of the oldest one is taken again.
        let mut design = if self.designs.len() < 3 {
            None
        } else {
            self.designs.pop()
        }
        .unwrap_or_else(|| Design {
            points: Vec::new(),
            displacement: Vec::new(),
            pressures: Vec::new(),
        });
        design.points.clear();
        design.points.extend_from_slice(points);
        design.displacement.clone_from(&state.displacement);
        design.pressures.clone_from(&state.pressures);
        self.designs.insert(0, design);
    }
}

fn sum<const N: usize>(weights: &[f64], of: impl Fn(usize) -> [f64; N]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (k, weight) in weights.iter().enumerate() {
        let own = of(k);
        for d in 0..N {
            sum[d] += weight * own[d];
        }
    }
    sum
}

/// True if the nodes move on as they did before.
fn follows(first: &[[f64; 3]], second: &[[f64; 3]], third: &[[f64; 3]]) -> bool {
    let (mut off, mut size) = (0.0, 0.0);
    for ((a, b), c) in first.iter().zip(second).zip(third) {
        for d in 0..3 {
            let (before, next) = (b[d] - a[d], c[d] - b[d]);
            off += (next - before) * (next - before);
            size += next * next;
        }
    }
    off <= EQUAL * EQUAL * size
}
