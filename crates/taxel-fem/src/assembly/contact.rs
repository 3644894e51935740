//! Contact in the equations: obstacles and surfaces with their friction, walls that meet.

use std::collections::{BTreeMap, BTreeSet};
use taxel_numerics::dense::dot3;

use super::friction::{Friction, Slide, friction};
use super::hardening::hardened;
use super::meeting::{Meeting, Nodal, each_meeting, rub_surface};
use super::points::{ContactPoint, each_point_of};
use super::surfaces::PairTables;
use super::system::{Assembled, System};
use super::unsymmetric::Slot;
use crate::assembly::state::State;
use crate::mesh::{Facet, FacetShape};
use crate::problem::contact::{Anchor, ContactState, Gap};
use crate::problem::{Contact, Obstacle, Pairing, Problem, SurfacePair, Walls};

/// Gap over the accepted overlap at which a point counts as touching.
const TOUCHING: f64 = 1e-6;

/// Where the multipliers of obstacles and surfaces stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multipliers {
    /// At each contact point as far as that goes, and from there on at the corners of facets
    /// (`Solver::multipliers` says which).
    Automatic,
    /// At each contact point. No point overlaps by more than is accepted, and pressures are the
    /// most accurate. Points are more than a facet has freedoms: under large pressures their
    /// multipliers pull against each other, and the iteration ends early.
    Points,
    /// At the corners of facets, linear between them: the overlap is accepted on the mean about a
    /// corner. Goes on under pressures of many shear moduli, in half as many iterations. A point
    /// may overlap by its pressure beyond the linear one, over the contact stiffness.
    Corners,
}

/// What a contact point moves with: factors of the displacements of its nodes in the distance
/// from what it touches.
struct Moves<'m> {
    nodes: &'m [u32],
    factors: &'m [f64],
    /// Places of the nodes in the matrix; none where it has none.
    places: Option<&'m [u32]>,
}

impl System {
    /// Every contact point of a surface, in order, at the usual points of its facets.
    fn each_contact_point(
        &self,
        problem: &Problem,
        surface: &[Facet],
        places: &[[f64; 3]],
        hears: &mut dyn FnMut(&ContactPoint<'_>),
    ) {
        let table_of = |_, shape| self.facet_table(shape);
        each_point_of(problem, surface, (&table_of, places), hears);
    }

    /// Pressure of all contacts on the nodes of the surfaces that touch, Pa of present area, on the mean
    /// of the points about each; 0 elsewhere.
    pub(crate) fn contact_pressure(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
    ) -> Vec<f64> {
        // Each node has the points about it by the squares of its shape function, which are positive.
        let mut sums = vec![[0.0; 2]; problem.mesh.points.len()];
        let mut add = |nodes: &[u32], values: &[f64], area: f64, pressure: f64| {
            for (&node, value) in nodes.iter().zip(values) {
                let weight = area * value * value;
                sums[node as usize][0] += weight;
                sums[node as usize][1] += weight * pressure;
            }
        };
        for (number, contact) in problem.contacts.iter().enumerate() {
            let probe = self.contact(problem, state, places, number);
            let pressure = |at: usize| probe.pressures[at] / probe.stretches[at];
            match contact {
                Contact::Obstacle(obstacle) => {
                    self.each_contact_point(problem, &obstacle.surface, places, &mut |point| {
                        add(
                            point.nodes,
                            point.values,
                            point.area,
                            pressure(point.number),
                        );
                    });
                }
                Contact::Surfaces(pair) => {
                    let Some(tables) = &self.pairs[number] else {
                        continue;
                    };
                    let of = (&state.contacts[number], places);
                    each_meeting(problem, of, (tables, pair), &mut |point, meeting| {
                        add(
                            point.nodes,
                            point.values,
                            point.area,
                            pressure(point.number),
                        );
                        if let Some(meeting) = meeting {
                            let nodes = tables.second_nodes(meeting.facet);
                            let values = &meeting.foot.shapes.values;
                            add(nodes, values, point.area, pressure(point.number));
                        }
                    });
                }
                Contact::Walls(_) => {}
            }
        }
        let mean = |[weight, sum]: [f64; 2]| if weight > 0.0 { sum / weight } else { 0.0 };
        sums.into_iter().map(mean).collect()
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
        let shift = obstacle.shift(&state.parameters);
        let contact = &state.contacts[number];
        self.each_contact_point(problem, &obstacle.surface, places, &mut |point| {
            let gap = obstacle.shape.gap(point.place, shift);
            let multiplier = contact.multiplier(point.number);
            let stiffness = hardened(obstacle.stiffness, self.hardening[number], multiplier);
            let pressure = multiplier - stiffness * gap.distance;
            // A body that just touches is held there before it is pressed.
            let touching = TOUCHING * obstacle.stiffness * obstacle.overlap_limit;
            if pressure < -touching {
                return;
            }
            let pressure = pressure.max(0.0);
            let area = point.area;
            out.energy += 0.5 * pressure * pressure / stiffness * area;
            out.rounding += rounding(stiffness, area, point.place);
            let rubbing = rub(obstacle, contact, point, (&gap, shift), pressure);
            let moves = Moves {
                nodes: point.nodes,
                factors: point.values,
                places: Some(&self.contact_places[number][point.facet]),
            };
            // Friction turns with the surface that the point moves along: half of that has its
            // mirror image in the matrix, the other half is below.
            let n = gap.normal;
            let turn = gap.curvature.map(|row| -0.5 * dot3(row, rubbing.traction));
            let bend = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    area * (stiffness * n[i] * n[j] - pressure * gap.curvature[i][j]
                        + rubbing.tangent[i][j]
                        + n[i] * turn[j]
                        + turn[i] * n[j])
                })
            });
            let push = std::array::from_fn(|i| area * (rubbing.traction[i] - pressure * n[i]));
            self.push(&moves, &push, &bend, out);
            if let Some((direction, parameter)) = obstacle.travel {
                self.travel(point, direction, parameter.0, (&push, &bend), out);
            }
            let slots = |vector: [f64; 3]| {
                let mut slots = self.along(&moves, vector);
                if let Some((direction, parameter)) = obstacle.travel {
                    slots.push((Slot::Parameter(parameter.0), -dot3(vector, direction)));
                }
                slots
            };
            if turn != [0.0; 3] {
                let (across, turning) = (slots(n), slots(turn));
                out.add_unsymmetric(&slots(n.map(|x| area * x)), &turning);
                out.add_unsymmetric(&slots(turn.map(|x| -area * x)), &across);
            }
            if rubbing.sliding != [0.0; 3] {
                out.slides.push(Slide {
                    contact: number,
                    point: point.number,
                    direction: rubbing.sliding,
                });
                // The bound of a point that slides follows its pressure.
                let slope = obstacle.friction * stiffness;
                let forces = slots(rubbing.sliding.map(|d| area * d));
                out.add_unsymmetric(&forces, &slots(n.map(|n| -slope * n)));
            }
        });
    }

    /// A vector at a contact point over the nodes that move it.
    fn along(&self, moves: &Moves<'_>, vector: [f64; 3]) -> Vec<(Slot, f64)> {
        let mut slots = Vec::new();
        for (&node, factor) in moves.nodes.iter().zip(moves.factors) {
            for i in 0..self.unknowns.components() {
                let own = self.slots(node, i);
                slots.extend(own.map(|(slot, share)| (slot, share * factor * vector[i])));
            }
        }
        slots
    }

    /// Vectors of nodes over what moves these.
    fn slots_of(&self, nodes: &[u32], vectors: &[[f64; 3]]) -> Vec<(Slot, f64)> {
        let mut slots = Vec::new();
        for (&node, vector) in nodes.iter().zip(vectors) {
            for (i, &x) in vector.iter().enumerate().take(self.unknowns.components()) {
                if x != 0.0 {
                    slots.extend(self.slots(node, i).map(|(slot, share)| (slot, share * x)));
                }
            }
        }
        slots
    }

    /// Adds a force on a contact point with its derivative by the place.
    fn push(&self, moves: &Moves<'_>, push: &[f64; 3], bend: &[[f64; 3]; 3], out: &mut Assembled) {
        let factors = moves.factors;
        self.push_by(moves, push, out, |i, a, j, b| {
            factors[a] * factors[b] * bend[i][j]
        });
    }

    /// Adds a force on a contact point with its derivative by the nodes.
    fn push_by(
        &self,
        moves: &Moves<'_>,
        push: &[f64; 3],
        out: &mut Assembled,
        of: impl Fn(usize, usize, usize, usize) -> f64,
    ) {
        let components = self.unknowns.components();
        for (&node, factor) in moves.nodes.iter().zip(moves.factors) {
            for i in 0..components {
                out.forces[node as usize * components + i] += push[i] * factor;
            }
        }
        match moves.places {
            Some(places) => self
                .unknowns
                .scatter(moves.nodes, places, &mut out.values, &of),
            None => out.incomplete = true,
        }
        self.couple(moves.nodes, out, of);
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

    /// Adds surfaces that meet, by the number of their contact.
    pub(super) fn add_pair(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        (number, pair): (usize, &SurfacePair),
        out: &mut Assembled,
    ) {
        let (Some(tables), contact) = (&self.pairs[number], &state.contacts[number]) else {
            return;
        };
        // A body that just touches is held there before it is pressed.
        let touching = TOUCHING * pair.stiffness * pair.overlap_limit;
        let of = (contact, places);
        each_meeting(problem, of, (tables, pair), &mut |point, meeting| {
            let Some(meeting) = meeting.filter(|meeting| meeting.pressure >= -touching) else {
                return;
            };
            let pressure = meeting.pressure.max(0.0);
            let area = tables.share * point.area;
            out.energy += 0.5 * pressure * pressure / meeting.stiffness * area;
            out.rounding += rounding(meeting.stiffness, area, point.place);
            let pairing = (point.facet, meeting.facet);
            let (nodes, numbers) = (tables.nodes(pairing), tables.numbers(pairing));
            let factors = factors(&numbers, point.values, &meeting.foot.shapes.values);
            let moves = Moves {
                nodes: &nodes,
                factors: &factors,
                places: tables.places_of(pairing),
            };
            let normal = meeting.gap.normal;
            let changes = if pressure > 0.0 {
                meeting.changes(&numbers, point)
            } else {
                Vec::new()
            };
            let (stiff, half) = (area * meeting.stiffness, 0.5 * area * pressure);
            // Half of each change has its mirror image in the matrix, and the other half here.
            self.push_by(
                &moves,
                &normal.map(|n| -area * pressure * n),
                out,
                |i, a, j, b| {
                    let turned = changes.iter().map(|change| {
                        let (forces, motion) = (&change.forces, &change.motion);
                        forces[a][i] * motion[b][j] + motion[a][i] * forces[b][j]
                    });
                    stiff * factors[a] * factors[b] * normal[i] * normal[j]
                        + half * turned.sum::<f64>()
                },
            );
            for change in &changes {
                let forces = self.slots_of(&nodes, &change.forces);
                let motion = self.slots_of(&nodes, &change.motion);
                let scaled = |slots: &[(Slot, f64)], by: f64| -> Vec<(Slot, f64)> {
                    slots.iter().map(|&(slot, x)| (slot, by * x)).collect()
                };
                out.add_unsymmetric(&scaled(&forces, half), &motion);
                out.add_unsymmetric(&scaled(&motion, -half), &forces);
            }
            let incline = self.slots_of(&nodes, &meeting.incline(&numbers, point));
            out.add_unsymmetric(&self.along(&moves, normal.map(|n| stiff * n)), &incline);
            // It acts on the second surface where the point is, near to its anchor while it sticks.
            let Some(rubbing) = rub_surface((tables, pair), contact, point, &meeting, places)
            else {
                return;
            };
            let friction = &rubbing.friction;
            let bend = friction.tangent.map(|row| row.map(|entry| area * entry));
            self.push(&moves, &friction.traction.map(|t| area * t), &bend, out);
            for (d, row) in bend.iter().enumerate().take(self.unknowns.components()) {
                let parting = rubbing.parting(tables, &meeting);
                let motion = parting.flat_map(|(node, factor)| {
                    let slots = self.slots(node, d);
                    slots.map(move |(slot, share)| (slot, share * factor))
                });
                if *row != [0.0; 3] {
                    out.add_unsymmetric(&self.along(&moves, *row), &motion.collect::<Vec<_>>());
                }
            }
            if pressure > 0.0 {
                for change in meeting.friction_changes(&numbers, point, &rubbing) {
                    let forces: Nodal = change.forces.iter().map(|f| f.map(|x| area * x)).collect();
                    let forces = self.slots_of(&nodes, &forces);
                    out.add_unsymmetric(&forces, &self.slots_of(&nodes, &change.motion));
                }
            }
            if friction.sliding != [0.0; 3] {
                out.slides.push(Slide {
                    contact: number,
                    point: point.number,
                    direction: friction.sliding,
                });
                let slope = pair.friction * meeting.stiffness;
                let forces = self.along(&moves, friction.sliding.map(|d| -slope * area * d));
                let mut motion = self.along(&moves, normal);
                motion.extend(incline);
                out.add_unsymmetric(&forces, &motion);
            }
        });
    }

    /// Pairs of facets of each contact between surfaces that touch in a state or are near to it.
    pub(super) fn near_pairs(
        &self,
        problem: &Problem,
        state: &State,
    ) -> Vec<BTreeSet<(usize, usize)>> {
        let places = state.places(&problem.mesh);
        let contacts = problem.contacts.iter().enumerate();
        let each = contacts.map(|(number, contact)| {
            let mut near = BTreeSet::new();
            let (Contact::Surfaces(pair), Some(tables)) = (contact, &self.pairs[number]) else {
                return near;
            };
            let known = &state.contacts[number];
            let of = (known, places.as_slice());
            each_meeting(problem, of, (tables, pair), &mut |point, meeting| {
                let Some(meeting) = meeting else {
                    return;
                };
                if meeting.pressure > 0.0 || meeting.foot.distance <= tables.near() {
                    tables.add_near(point.facet, meeting.facet, &mut near);
                }
            });
            near
        });
        each.collect()
    }

    /// The contact whose surfaces have moved farther between two states than it looks, with that
    /// way and its reach, m.
    pub(crate) fn leapt(
        &self,
        problem: &Problem,
        before: &State,
        after: &State,
    ) -> Option<(usize, f64, f64)> {
        let mut contacts = problem.contacts.iter().zip(&self.pairs).enumerate();
        contacts.find_map(|(number, (contact, tables))| {
            let (Contact::Surfaces(pair), Some(tables)) = (contact, tables) else {
                return None;
            };
            let way = tables.greatest_way(&before.displacement, &after.displacement);
            (way > pair.reach).then_some((number, way, pair.reach))
        })
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
            if energy.pressure <= 0.0 && !point.is_bound() {
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
                    if point.is_bound() {
                        // A gap is as wrong as an overlap.
                        probe.note(-energy.gap.abs(), f64::INFINITY, rest, true);
                        probe.pressures[at] = energy.pressure;
                    } else {
                        probe.note(energy.gap, energy.pressure, rest, relieved);
                    }
                    probe.tractions.push([0.0; 3]);
                    probe.normals.push([0.0; 3]);
                    probe.areas.push(point.weight);
                    probe.stretches.push(1.0);
                }
            }
            Contact::Surfaces(pair) => {
                if let Some(tables) = &self.pairs[number] {
                    let of = (contact, places);
                    each_meeting(problem, of, (tables, pair), &mut |point, meeting| {
                        probe.note_meeting(
                            problem,
                            (tables, pair),
                            contact,
                            (point, meeting),
                            places,
                        );
                    });
                }
            }
            Contact::Obstacle(obstacle) => {
                let shift = obstacle.shift(&state.parameters);
                self.each_contact_point(problem, &obstacle.surface, places, &mut |point| {
                    let gap = obstacle.shape.gap(point.place, shift);
                    let distance = gap.distance;
                    let multiplier = contact.multiplier(point.number);
                    let stiffness =
                        hardened(obstacle.stiffness, self.hardening[number], multiplier);
                    let pressure = (multiplier - stiffness * distance).max(0.0);
                    let traction = if pressure > 0.0 {
                        rub(obstacle, contact, point, (&gap, shift), pressure).traction
                    } else {
                        [0.0; 3]
                    };
                    probe.note(distance, pressure, point.rest, true);
                    probe.tractions.push(traction.map(|t| -t));
                    probe.normals.push(gap.normal);
                    probe.areas.push(point.area);
                    probe.stretches.push(point.stretch(problem, places));
                });
            }
        }
        probe
    }

    /// The multipliers after a round: those that a contact has, and its pressures beyond them; none
    /// if these are not worth an overlap, or a lift, beyond what is accepted.
    ///
    /// At corners the round is linear between them, by means about each.
    pub(crate) fn renewed(
        &self,
        problem: &Problem,
        state: &State,
        places: &[[f64; 3]],
        (number, stand): (usize, Multipliers),
    ) -> Option<Vec<f64>> {
        let probe = self.contact(problem, state, places, number);
        let contact = &state.contacts[number];
        let (surface, stiffness) = match &problem.contacts[number] {
            Contact::Obstacle(obstacle) if stand == Multipliers::Corners => {
                (&obstacle.surface, obstacle.stiffness)
            }
            Contact::Surfaces(pair) if stand == Multipliers::Corners => {
                (&pair.first, pair.stiffness)
            }
            contact => {
                // A multiplier that holds a point off is as wrong as an overlap.
                let wrong = probe.overlap.max(probe.lifted) > contact.overlap_limit();
                return wrong.then_some(probe.pressures);
            }
        };
        let tables = self.pairs[number].as_ref();
        let table_of = |facet: usize, shape| match tables {
            Some(tables) => &tables.tables[facet],
            None => self.facet_table(shape),
        };
        let beyond = |point: usize| probe.pressures[point] - contact.multiplier(point);
        let overlap = |point: usize| {
            let hardening = self.hardening[number];
            beyond(point) / hardened(stiffness, hardening, contact.multiplier(point))
        };
        // Sums of the pressure beyond the multiplier, of its overlap, and of the area, about each
        // corner.
        let mut sums = BTreeMap::<u32, [f64; 3]>::new();
        let of = (&table_of as &dyn Fn(usize, FacetShape) -> _, places);
        each_point_of(problem, surface, of, &mut |point| {
            for (corner, share) in point.corners() {
                let [sum, overlaps, area] = sums.entry(corner).or_default();
                *sum += share * point.area * beyond(point.number);
                *overlaps += share * point.area * overlap(point.number);
                *area += share * point.area;
            }
        });
        // On an axis of revolution a corner has some area through the points beside it.
        let mean = |corner: &u32| sums[corner][0] / sums[corner][2];
        let most = sums
            .values()
            .map(|[_, overlaps, area]| (overlaps / area).abs());
        let most = most.fold(0.0, f64::max);
        if most <= problem.contacts[number].overlap_limit() {
            return None;
        }
        let mut multipliers = Vec::with_capacity(probe.pressures.len());
        each_point_of(problem, surface, of, &mut |point| {
            let corners = point.corners();
            let more: f64 = corners.map(|(corner, share)| share * mean(&corner)).sum();
            multipliers.push(contact.multiplier(point.number) + more);
        });
        Some(multipliers)
    }

    /// Notes where the points of a contact are after a step has converged: on rough obstacles and
    /// on surfaces. One that touches keeps the place where it would rest without traction; one
    /// that does not, where it is: should it come to touch in the next step, it rubs from there.
    pub(crate) fn anchor(&self, problem: &Problem, state: &mut State) {
        let places = state.places(&problem.mesh);
        for (number, contact) in problem.contacts.iter().enumerate() {
            let old = &state.contacts[number];
            let mut anchors = Vec::new();
            match contact {
                Contact::Obstacle(obstacle) if obstacle.friction > 0.0 => {
                    let shift = obstacle.shift(&state.parameters);
                    let surface = &obstacle.surface;
                    self.each_contact_point(problem, surface, &places, &mut |point| {
                        let gap = obstacle.shape.gap(point.place, shift);
                        let multiplier = old.multiplier(point.number);
                        let stiffness =
                            hardened(obstacle.stiffness, self.hardening[number], multiplier);
                        let pressure = multiplier - stiffness * gap.distance;
                        let here = std::array::from_fn(|d| point.place[d] - shift[d]);
                        let place = match old.anchor(point.number) {
                            Some(old) if pressure > 0.0 => {
                                let bound = obstacle.friction * pressure;
                                friction(&gap, here, old.place, obstacle.stiffness, bound).anchor
                            }
                            _ => here,
                        };
                        anchors.push(Some(Anchor { place, facet: None }));
                    });
                }
                Contact::Surfaces(pair) => {
                    let Some(tables) = &self.pairs[number] else {
                        continue;
                    };
                    let of = (old, places.as_slice());
                    each_meeting(problem, of, (tables, pair), &mut |point, meeting| {
                        anchors.push(meeting.map(|meeting| {
                            // A point that comes to touch rubs from where it was.
                            let rubbing = if meeting.pressure > 0.0 {
                                rub_surface((tables, pair), old, point, &meeting, &places)
                            } else {
                                None
                            };
                            match rubbing.map(|rubbing| rubbing.friction) {
                                // It sticks, or has slid to a new place.
                                Some(rubbing) if rubbing.sliding == [0.0; 3] => {
                                    old.anchor(point.number).unwrap_or_default()
                                }
                                Some(rubbing) => tables.anchor_at(
                                    (&meeting.foot, meeting.facet),
                                    (rubbing.anchor, meeting.gap.normal),
                                    &places,
                                ),
                                None => Anchor {
                                    place: meeting.foot.at,
                                    facet: Some(meeting.facet as u32),
                                },
                            }
                        }));
                    });
                }
                Contact::Obstacle(_) | Contact::Walls(_) => continue,
            }
            state.contacts[number].anchors = anchors;
        }
    }
}

/// Factors of the nodes of a pair of facets in the distance of a point of the first from one of
/// the second, by the shape functions of both.
fn factors(numbers: &[[Option<usize>; 2]], first: &[f64], second: &[f64]) -> Vec<f64> {
    let value = |values: &[f64], number: Option<usize>| number.map_or(0.0, |k| values[k]);
    let factors = numbers.iter();
    factors
        .map(|&[own, other]| value(first, own) - value(second, other))
        .collect()
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
            let bound = contact.bound(point.number, obstacle.friction, pressure);
            friction(gap, here, anchor.place, obstacle.stiffness, bound)
        })
}

/// Energy of the rounding of a place against a contact of this stiffness.
fn rounding(stiffness: f64, area: f64, place: [f64; 3]) -> f64 {
    let far = place.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    0.5 * stiffness * area * (far * f64::EPSILON).powi(2)
}

/// A contact looked at in a state.
#[derive(Clone, Debug, Default)]
pub struct ContactProbe {
    /// Pressure at each contact point, Pa.
    pub pressures: Vec<f64>,
    /// Friction on the body at each contact point, Pa.
    pub tractions: Vec<[f64; 3]>,
    /// Unit normal out of the obstacle or the second surface at each contact point; zero between
    /// walls.
    pub normals: Vec<[f64; 3]>,
    /// Undeformed area that each contact point stands for, m2 (m in plane strain).
    pub areas: Vec<f64>,
    /// Present area over undeformed area at each contact point: `pressures` are per undeformed area.
    pub stretches: Vec<f64>,
    /// Gap at each contact point, m; infinite where a surface meets nothing within reach.
    pub gaps: Vec<f64>,
    /// Undeformed place of each contact point.
    pub at: Vec<[f64; 3]>,
    /// Deepest overlap of points that a multiplier can relieve, m.
    pub overlap: f64,
    /// Widest gap at a point that is pressed by its multiplier, m.
    pub lifted: f64,
}

impl ContactProbe {
    /// Force of the obstacle on the body, or of the second surface on the first, friction included, N (N/m in plane strain).
    pub fn force(&self) -> [f64; 3] {
        std::array::from_fn(|d| {
            let points = 0..self.pressures.len();
            let at = |k: usize| self.pressures[k] * self.normals[k][d] + self.tractions[k][d];
            points.map(|k| self.areas[k] * at(k)).sum()
        })
    }

    /// Undeformed and present area that touches, m2 (m in plane strain), where pressures are above
    /// `least`, Pa.
    pub fn touching(&self, least: f64) -> [f64; 2] {
        let points = self
            .pressures
            .iter()
            .zip(self.areas.iter().zip(&self.stretches));
        let pressed = points.filter(|(pressure, _)| **pressure > least);
        pressed.fold([0.0; 2], |[rest, present], (_, (area, stretch))| {
            [rest + area, present + area * stretch]
        })
    }

    /// Greatest force over present area, Pa.
    pub fn greatest_pressure(&self) -> f64 {
        let points = self.pressures.iter().zip(&self.stretches);
        points.fold(0.0, |most: f64, (pressure, stretch)| {
            most.max(pressure / stretch)
        })
    }

    /// Pressure over the touching area, N (N/m in plane strain): for surfaces that meet
    /// themselves, on which [`Self::force`] adds up to nothing.
    pub fn force_size(&self) -> f64 {
        let points = self.pressures.iter().zip(&self.areas);
        points.map(|(pressure, area)| pressure * area).sum()
    }

    /// Notes a point of a surface, with what it meets.
    fn note_meeting(
        &mut self,
        problem: &Problem,
        (tables, pair): (&PairTables, &SurfacePair),
        contact: &ContactState,
        (point, meeting): (&ContactPoint<'_>, Option<Meeting>),
        places: &[[f64; 3]],
    ) {
        let (mut traction, mut normal) = ([0.0; 3], [0.0; 3]);
        let (mut gap, mut pressure) = (f64::INFINITY, 0.0);
        if let Some(meeting) = meeting {
            gap = meeting.gap.distance;
            pressure = meeting.pressure.max(0.0);
            normal = meeting.gap.normal;
            if pressure > 0.0
                && let Some(rubbing) = rub_surface((tables, pair), contact, point, &meeting, places)
            {
                traction = rubbing.friction.traction.map(|t| -t);
            }
        }
        self.note(gap, pressure, point.rest, true);
        self.tractions.push(traction);
        self.normals.push(normal);
        self.areas.push(tables.share * point.area);
        self.stretches.push(point.stretch(problem, places));
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
    }
}
