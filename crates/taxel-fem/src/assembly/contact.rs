//! Contact in the equations: obstacles with their friction, walls that meet.

use super::friction::{Friction, friction};
use super::system::{Assembled, System};
use super::unsymmetric::Slot;
use crate::assembly::state::State;
use crate::mesh::Facet;
use crate::problem::contact::{Anchor, ContactState, Gap};
use crate::problem::{Contact, Obstacle, Pairing, Problem, Walls};

/// Gap over the accepted overlap at which a point counts as touching.
const TOUCHING: f64 = 1e-6;

/// A contact point of a surface against an obstacle.
struct ContactPoint<'p> {
    /// Number of the facet in its surface.
    facet: usize,
    /// Number of the point in its surface.
    number: usize,
    /// Nodes of the facet and their shape functions.
    nodes: &'p [u32],
    values: &'p [f64],
    /// Undeformed area that it stands for.
    area: f64,
    /// Undeformed and present place.
    rest: [f64; 3],
    place: [f64; 3],
}

impl System {
    /// Every contact point of a surface, in order.
    fn each_contact_point(
        &self,
        problem: &Problem,
        surface: &[Facet],
        places: &[[f64; 3]],
        hears: &mut dyn FnMut(&ContactPoint<'_>),
    ) {
        let mut number = 0;
        for (facet, &side) in surface.iter().enumerate() {
            let nodes: Vec<u32> = problem.mesh.facet_nodes(side).collect();
            let shape = problem.mesh.shape(side.cell as usize).facet_shape();
            let undeformed: Vec<[f64; 3]> = nodes
                .iter()
                .map(|&node| problem.mesh.points[node as usize])
                .collect();
            let table = self.facet_table(shape);
            for point in table.points(&undeformed, problem.kinematics) {
                let values = &point.shapes.values;
                let mut place = [0.0; 3];
                for (n, &node) in nodes.iter().enumerate() {
                    for d in 0..3 {
                        place[d] += values[n] * places[node as usize][d];
                    }
                }
                hears(&ContactPoint {
                    facet,
                    number,
                    nodes: &nodes,
                    values,
                    area: point.area(),
                    rest: point.place,
                    place,
                });
                number += 1;
            }
        }
    }

    /// Adds an obstacle, by the number of its contact.
    pub(super) fn add_obstacle(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        (number, obstacle): (usize, &Obstacle),
        out: &mut Assembled,
    ) {
        let shift = shift_of(obstacle, state);
        let contact = &state.contacts[number];
        self.each_contact_point(problem, &obstacle.surface, places, &mut |point| {
            let gap = obstacle.shape.gap(point.place, shift);
            let pressure = contact.multiplier(point.number) - obstacle.stiffness * gap.distance;
            // A body that just touches is held there before it is pressed.
            let touching = TOUCHING * obstacle.stiffness * obstacle.overlap_limit;
            if pressure < -touching {
                return;
            }
            let pressure = pressure.max(0.0);
            let area = point.area;
            out.energy += 0.5 * pressure * pressure / obstacle.stiffness * area;
            out.rounding += rounding(obstacle.stiffness, area, point.place);
            let rubbing = rub(obstacle, contact, point, (&gap, shift), pressure);
            let bend = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    area * (obstacle.stiffness * gap.normal[i] * gap.normal[j]
                        - pressure * gap.curvature[i][j]
                        + rubbing.tangent[i][j])
                })
            });
            let push =
                std::array::from_fn(|i| area * (rubbing.traction[i] - pressure * gap.normal[i]));
            let places = &self.contact_places[number][point.facet];
            self.push(point, places, &push, &bend, out);
            if let Some((direction, parameter)) = obstacle.travel {
                self.travel(point, direction, parameter.0, (&push, &bend), out);
            }
            if rubbing.sliding != [0.0; 3] {
                // The bound of a point that slides follows its pressure.
                let slope = obstacle.friction * obstacle.stiffness;
                let forces = self.along(obstacle, point, rubbing.sliding.map(|d| area * d));
                let motion = self.along(obstacle, point, gap.normal.map(|n| -slope * n));
                out.add_unsymmetric(&forces, &motion);
            }
        });
    }

    /// A vector at a contact point over the nodes of its facet and the travel of its obstacle.
    fn along(
        &self,
        obstacle: &Obstacle,
        point: &ContactPoint<'_>,
        vector: [f64; 3],
    ) -> Vec<(Slot, f64)> {
        let mut slots = Vec::new();
        for (&node, value) in point.nodes.iter().zip(point.values) {
            for i in 0..self.unknowns.components() {
                let slot = self.slot(node, i);
                slots.extend(slot.map(|(slot, factor)| (slot, factor * value * vector[i])));
            }
        }
        if let Some((direction, parameter)) = obstacle.travel {
            let travel: f64 = (0..3).map(|d| vector[d] * direction[d]).sum();
            slots.push((Slot::Parameter(parameter.0), -travel));
        }
        slots
    }

    /// Adds a force on a contact point with its derivative by the place.
    fn push(
        &self,
        point: &ContactPoint<'_>,
        places: &[u32],
        push: &[f64; 3],
        bend: &[[f64; 3]; 3],
        out: &mut Assembled,
    ) {
        let components = self.unknowns.components();
        for (&node, value) in point.nodes.iter().zip(point.values) {
            for i in 0..components {
                out.forces[node as usize * components + i] += push[i] * value;
            }
        }
        let of =
            |i: usize, a: usize, j: usize, b: usize| point.values[a] * point.values[b] * bend[i][j];
        self.unknowns
            .scatter(point.nodes, places, &mut out.values, of);
        self.couple(point.nodes, out, of);
    }

    /// Adds what the travel of the obstacle does to a force on a contact point.
    fn travel(
        &self,
        point: &ContactPoint<'_>,
        direction: [f64; 3],
        parameter: usize,
        (push, bend): (&[f64; 3], &[[f64; 3]; 3]),
        out: &mut Assembled,
    ) {
        for i in 0..3 {
            let change: f64 = (0..3).map(|j| bend[i][j] * direction[j]).sum();
            if i < self.unknowns.components() {
                for (&node, value) in point.nodes.iter().zip(point.values) {
                    self.couple_with(parameter, node, i, -change * value, out);
                }
            }
            out.along[parameter] -= push[i] * direction[i];
            out.cross[parameter][parameter] += direction[i] * change;
        }
    }

    /// Adds walls that meet, by the number of their contact.
    pub(super) fn add_walls(
        &self,
        state: &State,
        places: &[[f64; 3]],
        (number, walls): (usize, &Walls),
        out: &mut Assembled,
    ) {
        let components = self.unknowns.components();
        for (at, point) in walls.points.iter().enumerate() {
            let multiplier = state.contacts[number].multiplier(at);
            let energy = point.energy(places, walls.stiffness, multiplier);
            if energy.pressure <= 0.0 {
                continue;
            }
            out.rounding += rounding(
                walls.stiffness,
                point.weight,
                places[point.nodes[0] as usize],
            );
            for (n, &node) in point.nodes.iter().enumerate() {
                for i in 0..components {
                    out.forces[node as usize * components + i] += point.difference[n]
                        * energy.gradient[i]
                        + point.sum[n] * energy.gradient[3 + i];
                }
            }
            let of = |i: usize, a: usize, j: usize, b: usize| {
                let (da, sa) = (point.difference[a], point.sum[a]);
                let (db, sb) = (point.difference[b], point.sum[b]);
                let c = &energy.curvature;
                da * db * c[i][j]
                    + da * sb * c[i][3 + j]
                    + sa * db * c[3 + i][j]
                    + sa * sb * c[3 + i][3 + j]
            };
            self.unknowns.scatter(
                &point.nodes,
                &self.contact_places[number][at],
                &mut out.values,
                of,
            );
            self.couple(&point.nodes, out, of);
        }
    }

    /// Gaps and pressures of a contact.
    pub fn contact(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        number: usize,
    ) -> ContactProbe {
        let mut probe = ContactProbe::default();
        let contact = &state.contacts[number];
        match &problem.contacts[number] {
            Contact::Walls(walls) => {
                for (at, point) in walls.points.iter().enumerate() {
                    let energy = point.energy(places, walls.stiffness, contact.multiplier(at));
                    let relieved = matches!(point.pairing, Pairing::Opposite(_));
                    let rest = problem.mesh.points[point.nodes[0] as usize];
                    probe.note(energy.gap, energy.pressure, rest, relieved);
                    probe.tractions.push([0.0; 3]);
                    probe.normals.push([0.0; 3]);
                    probe.areas.push(point.weight);
                }
            }
            Contact::Obstacle(obstacle) => {
                let shift = shift_of(obstacle, state);
                self.each_contact_point(problem, &obstacle.surface, places, &mut |point| {
                    let gap = obstacle.shape.gap(point.place, shift);
                    let distance = gap.distance;
                    let pressure =
                        (contact.multiplier(point.number) - obstacle.stiffness * distance).max(0.0);
                    let traction = if pressure > 0.0 {
                        rub(obstacle, contact, point, (&gap, shift), pressure).traction
                    } else {
                        [0.0; 3]
                    };
                    probe.note(distance, pressure, point.rest, true);
                    probe.tractions.push(traction.map(|t| -t));
                    probe.normals.push(gap.normal);
                    probe.areas.push(point.area);
                });
            }
        }
        probe
    }

    /// Notes where the touching points of rough obstacles rest, after a step has converged.
    pub(crate) fn anchor(&self, problem: &Problem, state: &mut State) {
        let places = state.places(&problem.mesh);
        for (number, contact) in problem.contacts.iter().enumerate() {
            let Contact::Obstacle(obstacle) = contact else {
                continue;
            };
            if obstacle.friction <= 0.0 {
                continue;
            }
            let shift = shift_of(obstacle, state);
            let old = &state.contacts[number];
            let mut anchors = Vec::new();
            self.each_contact_point(problem, &obstacle.surface, &places, &mut |point| {
                let gap = obstacle.shape.gap(point.place, shift);
                let pressure = old.multiplier(point.number) - obstacle.stiffness * gap.distance;
                let here = std::array::from_fn(|d| point.place[d] - shift[d]);
                let bound = obstacle.friction * pressure;
                let anchor = || match old.anchor(point.number) {
                    Some(old) => friction(&gap, here, old, obstacle.stiffness, bound).anchor,
                    None => here,
                };
                anchors.push((pressure > 0.0).then(|| Anchor { place: anchor() }));
            });
            state.contacts[number].anchors = anchors;
        }
    }
}

/// Friction at a point that touches; none before it has an anchor.
fn rub(
    obstacle: &Obstacle,
    contact: &ContactState,
    point: &ContactPoint<'_>,
    (gap, shift): (&Gap, [f64; 3]),
    pressure: f64,
) -> Friction {
    contact
        .anchor(point.number)
        .map_or_else(Friction::default, |anchor| {
            let here = std::array::from_fn(|d| point.place[d] - shift[d]);
            let bound = obstacle.friction * pressure;
            friction(gap, here, anchor, obstacle.stiffness, bound)
        })
}

/// Energy of the rounding of a place against a contact of this stiffness.
fn rounding(stiffness: f64, area: f64, place: [f64; 3]) -> f64 {
    let far = place.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    0.5 * stiffness * area * (far * f64::EPSILON).powi(2)
}

/// Travel of an obstacle so far.
fn shift_of(obstacle: &Obstacle, state: &State) -> [f64; 3] {
    match obstacle.travel {
        Some((direction, parameter)) => direction.map(|x| x * state.parameters[parameter.0]),
        None => [0.0; 3],
    }
}

/// A contact looked at in a state.
#[derive(Clone, Debug, Default)]
pub struct ContactProbe {
    /// Pressure at each contact point, Pa.
    pub pressures: Vec<f64>,
    /// Friction on the body at each contact point, Pa.
    pub tractions: Vec<[f64; 3]>,
    /// Unit normal out of the obstacle at each contact point; zero between walls.
    pub normals: Vec<[f64; 3]>,
    /// Undeformed area that each contact point stands for, m2 (m in plane strain).
    pub areas: Vec<f64>,
    /// Gap at each contact point, m.
    pub gaps: Vec<f64>,
    /// Undeformed place of each contact point.
    pub at: Vec<[f64; 3]>,
    /// Deepest overlap of points that a multiplier can relieve, m.
    pub overlap: f64,
    /// Widest gap at a point that is pressed by its multiplier, m.
    pub lifted: f64,
    /// Undeformed place of the point that hardly touches or hardly does not.
    pub doubtful: Option<[f64; 3]>,
}

impl ContactProbe {
    /// Force of the obstacle on the body, friction included, N (N/m in plane strain).
    pub fn force(&self) -> [f64; 3] {
        std::array::from_fn(|d| {
            let points = 0..self.pressures.len();
            let at = |k: usize| self.pressures[k] * self.normals[k][d] + self.tractions[k][d];
            points.map(|k| self.areas[k] * at(k)).sum()
        })
    }

    fn note(&mut self, gap: f64, pressure: f64, at: [f64; 3], relieved: bool) {
        self.gaps.push(gap);
        self.pressures.push(pressure);
        self.at.push(at);
        if relieved {
            self.overlap = self.overlap.max(-gap);
            if pressure > 0.0 {
                self.lifted = self.lifted.max(gap);
            }
        }
        let least = self.pressures.iter().copied().fold(0.0, f64::max) * 1e-6;
        if self.doubtful.is_none() && gap < 0.0 && pressure < least {
            self.doubtful = Some(at);
        }
    }
}
