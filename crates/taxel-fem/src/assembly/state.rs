//! Where a solution stands.

use crate::assembly::kernel::{MAX_PRESSURES, Memory};
use crate::material::viscoelastic::History;
use crate::mesh::Mesh;
use crate::problem::Problem;
use crate::problem::contact::ContactState;
use crate::scalar::Symmetric;

/// Displacements, pressures, parameters and contacts: all that a restart needs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Displacement of each node, m.
    pub displacement: Vec<[f64; 3]>,
    /// Pressure unknowns of each cell (mean stress, tension positive), Pa.
    pub pressures: Vec<[f64; MAX_PRESSURES]>,
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// Multipliers of each contact.
    pub contacts: Vec<ContactState>,
    /// Multipliers have gone from contact points to the corners of facets, where
    /// `Settings::multipliers` leaves that open.
    pub corners: bool,
    /// History of the solids with memory.
    pub memory: Carried,
}

/// Stress carried over a time step, per cell and quadrature point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// Factor of the present stress and carried stresses of each cell; empty without
    /// memory.
    pub cells: Vec<(f64, Vec<Symmetric<f64>>)>,
    /// History of each cell that relaxes; empty without memory.
    pub histories: Vec<Option<History>>,
}

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
            // Durations are not negative: `load_over` refuses those that are.
            let factor = history.begin_step(duration).unwrap_or(1.0);
            let points = (0..history.points()).map(|point| *history.carried(point));
            self.cells.push((factor, points.collect()));
        }
    }

    /// Memory of a cell; none where the solid has none.
    pub fn of(&self, cell: usize) -> Option<Memory<'_>> {
        let (factor, carried) = self.cells.get(cell)?;
        (!carried.is_empty()).then_some(Memory {
            factor: *factor,
            carried,
        })
    }
}

impl State {
    /// The undeformed state.
    pub fn rest(problem: &Problem) -> Self {
        Self {
            displacement: vec![[0.0; 3]; problem.mesh.points.len()],
            pressures: vec![[0.0; MAX_PRESSURES]; problem.mesh.cell_count()],
            parameters: vec![0.0; problem.rules().len()],
            contacts: vec![ContactState::default(); problem.contacts.len()],
            corners: false,
            memory: Carried::rest(problem),
        }
    }

    /// Present places of the nodes.
    pub fn places(&self, mesh: &Mesh) -> Vec<[f64; 3]> {
        mesh.points
            .iter()
            .zip(&self.displacement)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1], x[2] + u[2]])
            .collect()
    }
}
