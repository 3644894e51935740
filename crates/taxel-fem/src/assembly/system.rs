//! All cells, loads and contacts together: the residual and its derivative.

use super::dofs::Unknowns;
use super::follow::{Followed, add_turning};
use super::friction::Slide;
use super::hardening::hardening;
use super::kernel::{
    CellInput, ELIMINATION_RATIO, Inverted, Kernel, MAX_NODES, MAX_PRESSURES, Points, eliminated,
};
use super::mixed::{Mixed, MixedParts};
use super::surfaces::PairTables;
use super::unsymmetric::{FreeEdge, Slot, Unsymmetric, free_edges};
use crate::assembly::state::State;
use crate::mesh::error::at;
use crate::mesh::{Facet, FacetShape};
use crate::problem::load::FacetTable;
use crate::problem::{Contact, Problem, ProblemError};
use crate::scalar::{Lanes, Scalar};

/// A cell that turned inside out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "cell {cell} of region {region:?} {} at {}: volume ratio {volume_ratio:.3e}",
    if *.undeformed { "is inside out in the mesh" } else { "turned inside out" }, at(.place)
)]
pub struct InvertedCell {
    /// Number of the cell.
    pub cell: usize,
    /// Name of its region.
    pub region: String,
    /// Undeformed place of its middle.
    pub place: [f64; 3],
    /// Volume ratio found.
    pub volume_ratio: f64,
    /// True when the mesh itself is wrong.
    pub undeformed: bool,
}

/// A problem with its unknowns numbered and its tables made.
pub struct System {
    /// Numbers of the unknowns.
    pub unknowns: Unknowns,
    kernels: Vec<Kernel>,
    kernel_of: Vec<u8>,
    places: Vec<u32>,
    first_place: Vec<u32>,
    facets: Vec<FacetTable>,
    /// What the components that are no unknowns follow.
    pub(super) followed: Followed,
    /// Places in the matrix of each contact point's nodes, contact by contact.
    pub(super) contact_places: Vec<Vec<Vec<u32>>>,
    /// Contact stiffness over the square of a multiplier, 1/(Pa m), of each contact.
    pub(super) hardening: Vec<f64>,
    /// Tables of each contact between surfaces; none of the others.
    pub(super) pairs: Vec<Option<PairTables>>,
    /// Places of the nodes of loaded facets, in the order pressures then cavities.
    facet_places: Vec<Vec<Vec<u32>>>,
    /// Free edges of loaded surfaces, in the same order.
    free_edges: Vec<Vec<FreeEdge>>,
    /// Values that nobody needs any more.
    spare: Vec<f64>,
    /// The tangent is assembled without elimination of the pressures.
    pub(crate) mixed: Option<Mixed>,
    /// Bulk over shear modulus of the elimination where a solid keeps its volume.
    pub(crate) elimination: f64,
}

/// Residual, tangent and what else the equations of the parameters need.
#[derive(Clone, Debug, Default)]
pub struct Assembled {
    /// Values of the tangent on the pattern of the unknowns.
    pub values: Vec<f64>,
    /// Forces out of balance on the unknowns.
    pub residual: Vec<f64>,
    /// Forces on all components, internal less external: reactions where held.
    pub forces: Vec<f64>,
    /// Change of the residual with each parameter.
    pub couplings: Vec<Vec<f64>>,
    /// Force along each parameter (work per change of it).
    pub along: Vec<f64>,
    /// Change of these forces with the parameters at fixed unknowns.
    pub cross: Vec<Vec<f64>>,
    /// The part of the tangent that is not symmetric.
    pub unsymmetric: Unsymmetric,
    /// True if surfaces touch for which the matrix has no place yet: their forces are in the
    /// residual, but not in the tangent.
    pub incomplete: bool,
    /// Contact points that slide, in the order of their contacts and numbers.
    pub(crate) slides: Vec<Slide>,
    /// Change of each force along a parameter with the unknowns, beyond its coupling.
    pub force_slopes: Vec<Vec<(usize, f64)>>,
    /// Volumes of the cavities.
    pub volumes: Vec<f64>,
    /// Change of each volume with the unknowns.
    pub volume_slopes: Vec<Vec<f64>>,
    /// Change of each volume with the parameters at fixed unknowns.
    pub volume_by_parameters: Vec<Vec<f64>>,
    /// Elimination of the pressures: shift, and rows over the nodes of each cell.
    pub pressure_shift: Vec<[f64; MAX_PRESSURES]>,
    recovery: Vec<Lanes>,
    /// What a tangent has beside its values where pressures are not eliminated.
    pub(crate) mixed: Option<MixedParts>,
    /// Energy of shape change and of contact, J (J/m in plane strain).
    pub energy: f64,
    /// Energy that rounding is worth, J (J/m in plane strain).
    pub rounding: f64,
}

impl System {
    /// Numbers the unknowns of a problem and finds the places of all cells.
    ///
    /// # Errors
    /// When the problem is not complete.
    pub fn new(problem: &Problem) -> Result<Self, ProblemError> {
        problem.check()?;
        let mesh = &problem.mesh;
        let mut followed = Followed::new(problem)?;
        let unknowns = number(problem, &followed, &[]);
        followed.number(&unknowns);
        let mut system = Self {
            kernel_of: Vec::new(),
            places: Vec::new(),
            first_place: vec![0],
            facets: [FacetShape::Line3, FacetShape::Quad9, FacetShape::Tri7]
                .map(FacetTable::new)
                .into(),
            followed,
            contact_places: Vec::new(),
            hardening: Vec::new(),
            pairs: Vec::new(),
            facet_places: Vec::new(),
            free_edges: Vec::new(),
            kernels: Vec::new(),
            spare: Vec::new(),
            mixed: None,
            elimination: ELIMINATION_RATIO,
            unknowns,
        };
        for cell in 0..mesh.cell_count() {
            let number = system.kernel_for(problem, cell, Points::Usual);
            system.kernel_of.push(number);
        }
        let contacts = problem.contacts.iter();
        system.hardening = contacts.map(|one| hardening(problem, one)).collect();
        let contacts = problem.contacts.iter().zip(&system.hardening);
        system.pairs = contacts
            .map(|(contact, &hardening)| match contact {
                Contact::Surfaces(pair) => Some(PairTables::new(mesh, pair, hardening)),
                Contact::Obstacle(_) | Contact::Walls(_) => None,
            })
            .collect();
        let edges = pressed(problem).map(|surface| free_edges(mesh, surface));
        system.free_edges = edges.collect();
        system.find_places(problem);
        if system.pairs.iter().any(Option::is_some) {
            system.extend(problem, &State::rest(problem));
        }
        Ok(system)
    }

    /// Assembles tangents without elimination of the pressures from here on.
    pub(crate) fn separate(&mut self, problem: &Problem) -> &Mixed {
        let held = |node: u32, i: usize| self.unknowns.of(node, i).is_none();
        let mixed = Mixed::new(&problem.mesh, &self.unknowns, held);
        self.mixed.insert(mixed)
    }

    /// Numbers the unknowns anew, with a place in the matrix for the facets that touch in a state
    /// or are near to it.
    pub(crate) fn extend(&mut self, problem: &Problem, state: &State) {
        let near = self.near_pairs(problem, state);
        let groups: Vec<Vec<u32>> = self
            .pairs
            .iter()
            .zip(&near)
            .filter_map(|(tables, near)| Some((tables.as_ref()?, near)))
            .flat_map(|(tables, near)| near.iter().map(|&pair| tables.nodes(pair)))
            .collect();
        self.unknowns = number(problem, &self.followed, &groups);
        self.followed.number(&self.unknowns);
        self.find_places(problem);
        for (tables, near) in self.pairs.iter_mut().zip(&near) {
            if let Some(tables) = tables {
                tables.cover(near, &self.unknowns);
            }
        }
    }

    /// Finds the places of all groups of nodes in the matrix.
    fn find_places(&mut self, problem: &Problem) {
        let mesh = &problem.mesh;
        self.places.clear();
        self.first_place = vec![0];
        for cell in 0..mesh.cell_count() {
            self.places
                .extend(self.unknowns.cell_places(mesh.cell(cell)));
            self.first_place.push(self.places.len() as u32);
        }
        self.contact_places = problem
            .contacts
            .iter()
            .map(|contact| match contact {
                Contact::Walls(walls) => walls
                    .points
                    .iter()
                    .map(|point| self.unknowns.places(&point.nodes))
                    .collect(),
                Contact::Obstacle(obstacle) => self.facet_places(problem, &obstacle.surface),
                // Theirs change.
                Contact::Surfaces(_) => Vec::new(),
            })
            .collect();
        let places = pressed(problem).map(|surface| self.facet_places(problem, surface));
        self.facet_places = places.collect();
    }

    /// Number of the kernel for a cell with these points of integration.
    fn kernel_for(&mut self, problem: &Problem, cell: usize, rule: Points) -> u8 {
        let shape = problem.mesh.shape(cell);
        let mut known = self.kernels.iter();
        let number = known
            .position(|kernel| kernel.is_of(shape, rule))
            .unwrap_or_else(|| {
                let kernel = Kernel::new(shape, problem.kinematics, rule);
                self.kernels.push(kernel);
                self.kernels.len() - 1
            });
        // Three for each of four shapes.
        number as u8
    }

    /// Gives cells more points of integration, those at their corners included; returns what
    /// [`Self::restore_points`] takes back. None, and nothing done, if all of them have the most
    /// already, or carry a memory at their points.
    pub(crate) fn refine_points(&mut self, problem: &Problem, cells: &[usize]) -> Option<Vec<u8>> {
        let before = self.kernel_of.clone();
        for &cell in cells {
            let region = problem.mesh.region_of(cell);
            if problem.relaxations.get(region).is_some_and(Option::is_some) {
                continue;
            }
            let rule = self.kernels[usize::from(self.kernel_of[cell])].rule();
            self.kernel_of[cell] = self.kernel_for(problem, cell, rule.finer());
        }
        (self.kernel_of != before).then_some(before)
    }

    /// Takes back [`Self::refine_points`].
    pub(crate) fn restore_points(&mut self, before: Vec<u8>) {
        self.kernel_of = before;
    }

    fn facet_places(&self, problem: &Problem, surface: &[Facet]) -> Vec<Vec<u32>> {
        surface
            .iter()
            .map(|&facet| {
                let nodes: Vec<u32> = problem.mesh.facet_nodes(facet).collect();
                self.unknowns.places(&nodes)
            })
            .collect()
    }

    /// Tables of a side.
    pub fn facet_table(&self, shape: FacetShape) -> &FacetTable {
        &self.facets[match shape {
            FacetShape::Line3 => 0,
            FacetShape::Quad9 => 1,
            FacetShape::Tri7 => 2,
        }]
    }

    /// Change of the displacements of all nodes by one of the unknowns and parameters; rigid
    /// bodies turn from where they were when the system was last assembled.
    pub fn displace(&self, displacement: &mut [[f64; 3]], unknowns: &[f64], parameters: &[f64]) {
        let components = self.unknowns.components();
        for (node, u) in displacement.iter_mut().enumerate() {
            for i in 0..components {
                if let Some(number) = self.unknowns.of(node as u32, i) {
                    u[i] = unknowns[number];
                } else if let Some(row) = self.followed.row(node as u32, i) {
                    let parts = row.iter().map(|&(slot, factor)| {
                        factor
                            * match slot {
                                Slot::Unknown(number) => unknowns[number],
                                Slot::Parameter(number) => parameters[number],
                            }
                    });
                    u[i] = parts.sum();
                }
            }
        }
    }

    /// The unknowns in these displacements.
    pub fn unknown_part(&self, displacement: &[[f64; 3]]) -> Vec<f64> {
        let mut unknowns = vec![0.0; self.unknowns.count()];
        for (node, u) in displacement.iter().enumerate() {
            for i in 0..self.unknowns.components() {
                if let Some(number) = self.unknowns.of(node as u32, i) {
                    unknowns[number] = u[i];
                }
            }
        }
        unknowns
    }

    /// Follows a part `length` of a change of displacement with the pressures of the
    /// cells. Gives the greatest share of its volume by which a cell then misses the volume
    /// that its solid asks for, in the linear equations, and that cell.
    pub fn recover_pressures(
        &self,
        problem: &Problem,
        assembled: &Assembled,
        change: &[[f64; 3]],
        length: f64,
        pressures: &mut [[f64; MAX_PRESSURES]],
    ) -> (f64, usize) {
        let mut missed = (0.0, 0);
        let mut rest = assembled.recovery.as_slice();
        for cell in 0..problem.mesh.cell_count() {
            let nodes = problem.mesh.cell(cell);
            let mut sums = assembled.pressure_shift[cell].map(Lanes::constant);
            for sum in &mut sums {
                sum.0[1..].fill(0.0);
            }
            for i in 0..self.unknowns.components() {
                for column in nodes.chunks(Lanes::COUNT) {
                    let mut moved = Lanes::constant(0.0);
                    for (moved, &node) in moved.0.iter_mut().zip(column) {
                        *moved = change[node as usize][i];
                    }
                    let (own, others) = rest.split_at(MAX_PRESSURES);
                    rest = others;
                    for m in 0..MAX_PRESSURES {
                        sums[m] = sums[m] + own[m] * moved;
                    }
                }
            }
            let material = &problem.materials[problem.mesh.region_of(cell)];
            let (_, slope) = material.volumetric.growth(pressures[cell][0]);
            let taken = eliminated(slope, material.law.shear_modulus(), self.elimination);
            let mut change = 0.0;
            for m in 0..MAX_PRESSURES {
                let step = sums[m].0.iter().sum::<f64>();
                pressures[cell][m] += length * step;
                change += step.abs();
            }
            // What the elimination lets go of, and the solid does not.
            let here = change * (taken - slope);
            if here > missed.0 {
                missed = (here, cell);
            }
        }
        missed
    }

    /// Takes back the values of a matrix, for the next one: fresh memory costs more
    /// than what is written to it.
    pub fn reuse(&mut self, values: Vec<f64>) {
        self.spare = values;
    }

    /// Assembles everything at a state.
    ///
    /// # Errors
    /// When a cell is inside out.
    pub fn assemble(
        &mut self,
        problem: &Problem,
        state: &State,
        tangent: bool,
    ) -> Result<Assembled, InvertedCell> {
        self.followed.turn(problem, &state.parameters);
        let places: Vec<[f64; 3]> = state.places(&problem.mesh);
        let parameters = problem.rules().len();
        let unknowns = self.unknowns.count();
        let components = self.unknowns.components();
        let mut values = Vec::new();
        if tangent || !problem.contacts.is_empty() {
            values = std::mem::take(&mut self.spare);
            values.clear();
            values.resize(self.unknowns.pattern.entries(), 0.0);
        }
        let mut out = Assembled {
            values,
            forces: vec![0.0; problem.mesh.points.len() * components],
            couplings: vec![vec![0.0; unknowns]; parameters],
            along: vec![0.0; parameters],
            cross: vec![vec![0.0; parameters]; parameters],
            force_slopes: vec![Vec::new(); parameters],
            pressure_shift: Vec::with_capacity(problem.mesh.cell_count()),
            ..Assembled::default()
        };
        self.cells(problem, state, tangent, &mut out)?;
        self.loads(problem, state, &places, tangent, &mut out);
        self.cavities(problem, state, &places, tangent, &mut out);
        for (number, contact) in problem.contacts.iter().enumerate() {
            match contact {
                Contact::Obstacle(obstacle) => {
                    self.add_obstacle(problem, state, &places, (number, obstacle), &mut out);
                }
                Contact::Surfaces(pair) => {
                    self.add_pair(problem, state, &places, (number, pair), &mut out);
                }
                Contact::Walls(walls) => self.add_walls(state, &places, (number, walls), &mut out),
            }
        }
        out.residual = vec![0.0; unknowns];
        for node in 0..problem.mesh.points.len() {
            for i in 0..components {
                let force = out.forces[node * components + i];
                if let Some(number) = self.unknowns.of(node as u32, i) {
                    out.residual[number] += force;
                } else if let Some(row) = self.followed.row(node as u32, i) {
                    for &(slot, factor) in row {
                        match slot {
                            Slot::Unknown(number) => out.residual[number] += factor * force,
                            Slot::Parameter(number) => out.along[number] += factor * force,
                        }
                    }
                }
            }
        }
        add_turning(problem, &state.parameters, &out.forces, &mut out.cross);
        Ok(out)
    }

    fn cells(
        &mut self,
        problem: &Problem,
        state: &State,
        tangent: bool,
        out: &mut Assembled,
    ) -> Result<(), InvertedCell> {
        let mesh = &problem.mesh;
        let components = self.unknowns.components();
        let mut reference = [[0.0; 3]; MAX_NODES];
        let mut displacement = [[0.0; 3]; MAX_NODES];
        let rows: usize = (0..mesh.cell_count())
            .map(|c| mesh.cell(c).len().div_ceil(Lanes::COUNT))
            .sum();
        out.recovery.reserve(rows * components * MAX_PRESSURES);
        let mixed = self.mixed.as_ref().filter(|_| tangent);
        out.mixed = mixed.map(|mixed| MixedParts {
            corners: vec![0.0; mixed.corners.pattern.entries()],
            ..MixedParts::default()
        });
        for cell in 0..mesh.cell_count() {
            let nodes = mesh.cell(cell);
            for (n, &node) in nodes.iter().enumerate() {
                reference[n] = mesh.points[node as usize];
                displacement[n] = state.displacement[node as usize];
            }
            let kernel = &mut self.kernels[usize::from(self.kernel_of[cell])];
            let input = CellInput {
                reference: &reference[..nodes.len()],
                displacement: &displacement[..nodes.len()],
                pressure: state.pressures[cell],
                material: &problem.materials[mesh.region_of(cell)],
                memory: state.memory.of(cell),
                elimination: self.elimination,
            };
            kernel.condensed = mixed.is_none();
            kernel
                .evaluate(&input, tangent)
                .map_err(|inverted| inverted_cell(problem, cell, inverted))?;
            out.energy += kernel.energy;
            out.rounding += kernel.rounding;
            out.pressure_shift.push(kernel.pressure_shift);
            for (n, &node) in nodes.iter().enumerate() {
                for i in 0..components {
                    out.forces[node as usize * components + i] += kernel.force(i, n);
                }
            }
            out.recovery.extend_from_slice(kernel.recovery());
            if tangent {
                let first = self.first_place[cell] as usize;
                let own = &self.places[first..self.first_place[cell + 1] as usize];
                let kernel = &self.kernels[usize::from(self.kernel_of[cell])];
                let (values, blocks) = (&mut out.values, &kernel.node_blocks());
                if components == 2 {
                    self.unknowns.scatter_cell::<2>(nodes, own, values, blocks);
                } else {
                    self.unknowns.scatter_cell::<3>(nodes, own, values, blocks);
                }
                if let (Some(mixed), Some(parts)) = (mixed, &mut out.mixed) {
                    mixed.add((mesh, cell), kernel, &self.unknowns, parts);
                }
                self.couple(nodes, out, |i, a, j, b| {
                    kernel.condensed_tangent(i, a, j, b)
                });
            }
        }
        Ok(())
    }

    /// Adds what the components of a group of nodes that are no unknowns do in its symmetric
    /// matrix: `of(i, a, j, b)` is the entry between component `i` of local node `a` and
    /// component `j` of local node `b`.
    pub(super) fn couple(
        &self,
        nodes: &[u32],
        out: &mut Assembled,
        of: impl Fn(usize, usize, usize, usize) -> f64,
    ) {
        let components = self.unknowns.components();
        for (b, &node) in nodes.iter().enumerate() {
            for j in 0..components {
                let Some(columns) = self.followed.row(node, j).filter(|row| !row.is_empty()) else {
                    continue;
                };
                for (a, &other) in nodes.iter().enumerate() {
                    for i in 0..components {
                        let value = of(i, a, j, b);
                        if let Some(number) = self.unknowns.of(other, i) {
                            for &(slot, factor) in columns {
                                match slot {
                                    Slot::Parameter(parameter) => {
                                        out.couplings[parameter][number] += value * factor;
                                    }
                                    // The pair stands in the matrix in both orders.
                                    Slot::Unknown(own) => {
                                        let twice = if own == number { 2.0 } else { 1.0 };
                                        self.add_entry(number, own, twice * value * factor, out);
                                    }
                                }
                            }
                        } else if let Some(rows) = self.followed.row(other, i) {
                            for &(row, also) in rows {
                                for &(column, factor) in columns {
                                    self.add_pair_of(row, column, value * factor * also, out);
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// Adds to one order of a pair of slots; the other order comes with its own call.
    fn add_pair_of(&self, row: Slot, column: Slot, value: f64, out: &mut Assembled) {
        match (row, column) {
            (Slot::Unknown(row), Slot::Unknown(column)) if row >= column => {
                self.add_entry(row, column, value, out);
            }
            (Slot::Unknown(number), Slot::Parameter(parameter)) => {
                out.couplings[parameter][number] += value;
            }
            (Slot::Parameter(second), Slot::Parameter(parameter)) => {
                out.cross[parameter][second] += value;
            }
            _ => {}
        }
    }

    fn add_entry(&self, row: usize, column: usize, value: f64, out: &mut Assembled) {
        match self.unknowns.entry(row, column) {
            Some(entry) => {
                // Without a tangent there are no values.
                if let Some(entry) = out.values.get_mut(entry) {
                    *entry += value;
                }
            }
            None => out.incomplete = true,
        }
    }

    /// A force on a component of a node that changes with a parameter.
    pub(super) fn couple_with(
        &self,
        parameter: usize,
        node: u32,
        component: usize,
        value: f64,
        out: &mut Assembled,
    ) {
        for (slot, factor) in self.slots(node, component) {
            match slot {
                Slot::Unknown(number) => out.couplings[parameter][number] += value * factor,
                Slot::Parameter(second) => {
                    out.cross[parameter][second] += value * factor;
                    if second != parameter {
                        out.cross[second][parameter] += value * factor;
                    }
                }
            }
        }
    }

    fn loads(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        tangent: bool,
        out: &mut Assembled,
    ) {
        let components = self.unknowns.components();
        for (number, load) in problem.pressures.iter().enumerate() {
            let pressed = Pressed {
                surface: &load.surface,
                places: &self.facet_places[number],
                parameter: load.parameter.0,
                value: state.parameters[load.parameter.0],
            };
            self.pressure(problem, places, &pressed, tangent, out, |_, _, _| {});
            if tangent {
                let edges = (self.free_edges[number].as_slice(), pressed.value);
                self.add_free_edges(problem.kinematics, places, edges, out);
            }
        }
        for load in &problem.dead_loads {
            let value = state.parameters[load.parameter.0];
            for &(node, force) in &load.forces {
                for i in 0..components {
                    out.forces[node as usize * components + i] -= value * force[i];
                    self.couple_with(load.parameter.0, node, i, -force[i], out);
                }
            }
        }
    }

    fn cavities(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        tangent: bool,
        out: &mut Assembled,
    ) {
        for (number, cavity) in problem.cavities.iter().enumerate() {
            let pressed = Pressed {
                surface: &cavity.wall,
                places: &self.facet_places[problem.pressures.len() + number],
                parameter: cavity.pressure.0,
                value: state.parameters[cavity.pressure.0],
            };
            let mut slopes = vec![0.0; self.unknowns.count()];
            let mut by_parameters = vec![0.0; problem.rules().len()];
            self.pressure(problem, places, &pressed, tangent, out, |node, i, share| {
                for (slot, factor) in self.slots(node, i) {
                    match slot {
                        Slot::Unknown(number) => slopes[number] -= factor * share,
                        Slot::Parameter(number) => by_parameters[number] -= factor * share,
                    }
                }
            });
            if tangent {
                let edges = &self.free_edges[problem.pressures.len() + number];
                let edges = (edges.as_slice(), pressed.value);
                self.add_free_edges(problem.kinematics, places, edges, out);
            }
            out.volume_slopes.push(slopes);
            out.volume_by_parameters.push(by_parameters);
            out.volumes
                .push(cavity.volume(&problem.mesh, problem.kinematics, places));
        }
    }

    /// A pressure on a surface; `each` hears of `int N n` for every node and component.
    fn pressure(
        &self,
        problem: &Problem,
        places: &[[f64; 3]],
        load: &Pressed<'_>,
        tangent: bool,
        out: &mut Assembled,
        mut each: impl FnMut(u32, usize, f64),
    ) {
        let components = self.unknowns.components();
        let kinematics = problem.kinematics;
        let mut around = Vec::new();
        for (number, &facet) in load.surface.iter().enumerate() {
            let nodes: Vec<u32> = problem.mesh.facet_nodes(facet).collect();
            let shape = problem.mesh.shape(facet.cell as usize).facet_shape();
            around.clear();
            around.extend(nodes.iter().map(|&node| places[node as usize]));
            let count = nodes.len() * components;
            let mut stiffness = vec![0.0; count * count];
            for point in self.facet_table(shape).points(&around, kinematics) {
                for (a, &node) in nodes.iter().enumerate() {
                    let value = point.shapes.values[a];
                    for i in 0..components {
                        let share = value * point.normal[i];
                        out.forces[node as usize * components + i] += load.value * share;
                        self.couple_with(load.parameter, node, i, share, out);
                        each(node, i, share);
                        if tangent {
                            for b in 0..nodes.len() {
                                for j in 0..components {
                                    stiffness[(a * components + i) * count + b * components + j] +=
                                        value * point.normal_slope(kinematics, i, b, j);
                                }
                            }
                        }
                    }
                }
            }
            if tangent {
                // The rest cancels between neighbours and on planes of symmetry; what is
                // left of it at free edges is added there.
                let of = |i: usize, a: usize, j: usize, b: usize| {
                    let (row, column) = (a * components + i, b * components + j);
                    0.5 * load.value
                        * (stiffness[row * count + column] + stiffness[column * count + row])
                };
                self.unknowns
                    .scatter(&nodes, &load.places[number], &mut out.values, of);
                self.couple(&nodes, out, of);
            }
        }
    }
}

/// Surfaces that carry a pressure: of pressures, then of cavities.
fn pressed(problem: &Problem) -> impl Iterator<Item = &Vec<Facet>> {
    let loads = problem.pressures.iter().map(|load| &load.surface);
    loads.chain(problem.cavities.iter().map(|cavity| &cavity.wall))
}

/// Numbers the unknowns; `beside` are groups of nodes that act on each other beside cells and
/// paired walls.
fn number(problem: &Problem, followed: &Followed, beside: &[Vec<u32>]) -> Unknowns {
    let (mesh, components) = (&problem.mesh, problem.kinematics.components());
    let walls = problem.contacts.iter().flat_map(|contact| match contact {
        Contact::Walls(walls) => walls.points.as_slice(),
        Contact::Obstacle(_) | Contact::Surfaces(_) => &[],
    });
    let groups = (0..mesh.cell_count())
        .map(|cell| mesh.cell(cell))
        .chain(walls.map(|point| point.nodes.as_slice()))
        .chain(beside.iter().map(Vec::as_slice));
    let with_leaders: Vec<Vec<u32>> = groups
        .clone()
        .filter_map(|nodes| followed.with_leaders(nodes))
        .collect();
    Unknowns::new(
        &mesh.points,
        components,
        |node, i| followed.has(node, i),
        groups.chain(with_leaders.iter().map(Vec::as_slice)),
    )
}

struct Pressed<'l> {
    surface: &'l [Facet],
    places: &'l [Vec<u32>],
    parameter: usize,
    value: f64,
}

fn inverted_cell(problem: &Problem, cell: usize, inverted: Inverted) -> InvertedCell {
    let mesh = &problem.mesh;
    let middle = mesh.cell(cell)[mesh.cell(cell).len() - 1];
    InvertedCell {
        cell,
        region: mesh.regions[mesh.region_of(cell)].clone(),
        place: mesh.points[middle as usize],
        volume_ratio: inverted.volume_ratio,
        undeformed: inverted.undeformed,
    }
}
