//! Why a solution could not go on, found at its last state.

use taxel_numerics::dense::dot;

use super::failure::{Reason, UnstableMode};
use super::newton::{Missed, Solver, since_least};
use super::small::axpy;
use crate::assembly::state::State;
use crate::material::stability::ellipticity;
use crate::problem::load::traction;
use crate::problem::{Contact, FreePart, Hold, Parameter, Quantity, Rule, free_part};
use crate::solver::stress::{StressPoint, extreme_stretches, stress_points};
use crate::solver::volume::LeastVolume;
use crate::sparse::LinearError;

/// Points of the greatest stress that are looked at after a failure.
const SUSPECTS: usize = 100;

/// Steps of the inverse iteration for the weakest mode: near a bifurcation one is enough.
const INVERSE_ITERATIONS: usize = 8;

/// Last iterations by which one is judged that did not end.
const ROUND: usize = 4;

/// A body that goes on so many times as fast as on the way so far may be at a limit of its load.
const GIVES_WAY: f64 = 5.0;

/// Steps of arc length in which a load that has a limit has to turn, and the length of the first
/// as a share of the displacement so far.
const STEPS_TO_TURN: usize = 20;
const FIRST_ARC: f64 = 2e-3;

fn length(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// An equilibrium is none if a contact overlaps by more than it accepts and this share of the mean
/// side of its cells.
const OVERLAPPED: f64 = 0.1;

/// A contact slides as a whole if its friction is this share of the greatest.
const SLIDES: f64 = 0.98;

impl Solver {
    /// A reason in the solid or in the load behind one of the iteration.
    pub(super) fn deeper(&mut self, reason: Reason, targets: &[f64]) -> Reason {
        if let Some(part) = self.not_held(&reason) {
            return Reason::HeldByContact(part);
        }
        let inside_out = self.least_volume_ratio();
        let inside_out = inside_out.filter(|least| least.ratio <= 0.0);
        if self.jumps > 0 && self.jumps >= self.settings.jumps {
            return Reason::KeepsJumping {
                jumps: self.jumps,
                inside_out,
            };
        }
        if !matches!(
            reason,
            Reason::NotConverged { .. }
                | Reason::NotANumber
                | Reason::Unstable { .. }
                | Reason::Hopped { .. }
        ) {
            return match (reason, inside_out) {
                (
                    Reason::Linear(
                        error @ (LinearError::Inaccurate { .. } | LinearError::Unsymmetric { .. }),
                    ),
                    Some(least),
                ) => Reason::LinearInsideOut { error, least },
                (reason, _) => reason,
            };
        }
        let mut points: Vec<StressPoint> = stress_points(&self.problem, &self.state).collect();
        points.sort_by(|a, b| b.von_mises.total_cmp(&a.von_mises));
        let mesh = &self.problem.mesh;
        let lost = points.iter().take(SUSPECTS).find(|point| {
            let material = &self.problem.materials[mesh.region_of(point.cell)];
            !ellipticity(material, &point.gradient, point.pressure).holds()
        });
        if let Some(point) = lost {
            let [least, most] = extreme_stretches(&point.gradient);
            return Reason::LostEllipticity {
                cell: point.cell,
                region: mesh.regions[mesh.region_of(point.cell)].clone(),
                place: point.place,
                stretch: most.max(1.0 / least),
            };
        }
        let ahead = self.gives_way(targets);
        let ahead = ahead.filter(|(times, ahead)| *times > GIVES_WAY && self.turns(targets, ahead));
        let (found, motion) = match (ahead, reason) {
            (Some((times, ahead)), _) => {
                let motion = self.motion(&ahead);
                let place = self.mode(&motion).place;
                (Reason::Limit { times, place }, Some(motion))
            }
            (None, Reason::Unstable { .. }) => {
                let motion = self.weakest_motion();
                let mode = motion.as_ref().map(|motion| self.mode(motion));
                (Reason::Unstable { mode }, motion)
            }
            (None, Reason::NotConverged { energies, .. }) => {
                let reason = Reason::NotConverged {
                    energies,
                    inside_out,
                };
                (reason, None)
            }
            (None, other) => (other, None),
        };
        let place = motion.map(|motion| self.mode(&motion).place);
        // What moves in a cell that is inside out is no motion of the body.
        let mesh = &self.problem.mesh;
        let own = |least: &LeastVolume| {
            let mut nodes = mesh.cell(least.cell).iter();
            nodes.any(|&node| place == Some(mesh.points[node as usize]))
        };
        inside_out.filter(own).map_or(found, Reason::CellGivesWay)
    }

    /// The cavity that has no volume in a state: its walls have passed through each other. What
    /// contacts accept as an overlap is allowed for.
    pub(super) fn crossed(&self, state: &State) -> Option<Reason> {
        let problem = &self.problem;
        let (mesh, kinematics) = (&problem.mesh, problem.kinematics);
        if problem.cavities.is_empty() {
            return None;
        }
        let limits = problem.contacts.iter().map(Contact::overlap_limit);
        let overlap = limits.fold(0.0, f64::max);
        let places = state.places(mesh);
        let mut cavities = problem.cavities.iter().enumerate();
        cavities.find_map(|(cavity, own)| {
            let areas = traction(mesh, kinematics, &own.wall, |_| [1.0, 0.0, 0.0]);
            let area: f64 = areas.iter().map(|(_, area)| area[0]).sum();
            let rest = own.volume(mesh, kinematics, &mesh.points);
            let volume = own.volume(mesh, kinematics, &places);
            let crossed = rest > 0.0 && volume <= -overlap * area;
            crossed.then(|| Reason::CavityCrossed {
                cavity,
                share: volume / rest,
            })
        })
    }

    /// The part that nothing holds, as its contacts press at the last state, if it explains why the
    /// iteration has failed.
    fn not_held(&self, reason: &Reason) -> Option<FreePart> {
        let by_supports = free_part(&self.problem, &[])?;
        let holds = self.holds();
        let part = free_part(&self.problem, &holds);
        let presses = holds.iter().any(|hold| !hold.directions.is_empty());
        match reason {
            Reason::Linear(
                LinearError::Singular
                | LinearError::Inaccurate { .. }
                | LinearError::Unsymmetric { .. },
            ) => Some(part.unwrap_or(by_supports)),
            Reason::Hopped { .. } if self.is_smooth() => Some(part.unwrap_or(by_supports)),
            Reason::NotConverged { .. }
            | Reason::NotANumber
            | Reason::Unstable { .. }
            | Reason::Hopped { .. } => part,
            Reason::Inverted(_) | Reason::Leapt { .. } if !presses => part,
            _ => None,
        }
    }

    /// What each contact holds at the last state: where it sticks all motion of the points that
    /// press, where it slides that along their normals. The normals are those at rest, as a dent
    /// goes along with what slides.
    fn holds(&self) -> Vec<Hold> {
        let problem = &self.problem;
        let mesh = &problem.mesh;
        let now = self.state.places(mesh);
        let numbers = 0..problem.contacts.len();
        let holds = numbers.filter_map(|number| {
            let contact = &problem.contacts[number];
            let (surfaces, friction) = match contact {
                Contact::Obstacle(own) => (vec![&own.surface], own.friction),
                Contact::Surfaces(own) => (vec![&own.first, &own.second], own.friction),
                Contact::Walls(_) => return None,
            };
            let probe =
                |places: &[[f64; 3]]| self.system.contact(problem, &self.state, places, number);
            let (probe, rest) = (probe(&now), probe(&mesh.points));
            let least = contact.least_pressure();
            let pressed = (0..probe.pressures.len()).filter(|&k| probe.pressures[k] > least);
            let pressed: Vec<usize> = pressed.collect();
            let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
                pressed.iter().map(|&k| probe.areas[k] * of(k)).sum()
            };
            let rubs = sum(&|k| length(&probe.tractions[k]));
            let slides = rubs >= SLIDES * friction * sum(&|k| probe.pressures[k]);
            let mut directions = Vec::new();
            for &k in &pressed {
                let normal = [rest.normals[k], probe.normals[k]];
                let normal = normal.into_iter().find(|normal| length(normal) > 0.5)?;
                let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let held = if slides { vec![normal] } else { axes.to_vec() };
                directions.extend(held.into_iter().map(|direction| [probe.at[k], direction]));
            }
            let facets = surfaces.into_iter().flatten();
            Some(Hold {
                nodes: facets.flat_map(|&facet| mesh.facet_nodes(facet)).collect(),
                directions,
            })
        });
        holds.collect()
    }

    /// True if no contact has friction.
    fn is_smooth(&self) -> bool {
        let mut contacts = self.problem.contacts.iter();
        contacts.all(|contact| match contact {
            Contact::Obstacle(obstacle) => obstacle.friction == 0.0,
            Contact::Surfaces(pair) => pair.friction == 0.0,
            Contact::Walls(_) => true,
        })
    }

    /// True if a part may move as a whole and nothing but friction, of which there is none, could
    /// hold it.
    pub(super) fn slides(&self) -> bool {
        self.is_smooth() && free_part(&self.problem, &[]).is_some()
    }

    /// The contact whose multipliers do not part what touches: the surface is driven into the
    /// obstacle, or into the other surface.
    pub(super) fn overlapped(&self, state: &State) -> Option<Reason> {
        let problem = &self.problem;
        if problem.contacts.is_empty() {
            return None;
        }
        let places = state.places(&problem.mesh);
        let mut contacts = problem.contacts.iter().enumerate();
        contacts.find_map(|(contact, own)| {
            let surface = match own {
                Contact::Obstacle(obstacle) => &obstacle.surface,
                Contact::Surfaces(pair) => &pair.second,
                Contact::Walls(_) => return None,
            };
            let probe = self.system.contact(problem, state, &places, contact);
            let most = (OVERLAPPED * problem.mesh.mean_side(surface)).max(own.overlap_limit());
            let overlap = probe.overlap;
            (overlap > most).then_some(Reason::Overlapped { contact, overlap })
        })
    }

    /// The given parameters that move to these targets, with their ways.
    fn moving(&self, targets: &[f64]) -> Vec<(usize, f64)> {
        let rules = self.problem.rules().iter();
        let ways = rules.zip(targets).zip(&self.targets).enumerate();
        ways.map(|(k, ((rule, target), now))| (k, rule, target - now))
            .filter(|&(_, rule, way)| *rule == Rule::Given && way != 0.0)
            .map(|(k, _, way)| (k, way))
            .collect()
    }

    /// True if the load turns a little farther along the path that leads `ahead`: followed by arc
    /// length, the body goes on under less. Several parameters have no arc; there a body whose
    /// cells are whole is believed. The accepted state stays.
    fn turns(&mut self, targets: &[f64], ahead: &[f64]) -> bool {
        let [moving] = self.moving(targets)[..] else {
            let least = self.least_volume_ratio();
            return least.is_none_or(|least| least.ratio > 0.0);
        };
        let (state, kept) = (self.state.clone(), self.targets.clone());
        let turned = self.turns_by_arc(moving, ahead.to_vec());
        self.problem.set_rule(Parameter(moving.0), Rule::Given);
        self.restart(state, kept);
        turned
    }

    fn turns_by_arc(&mut self, (number, way): (usize, f64), mut ahead: Vec<f64>) -> bool {
        // The first step of an arc goes along its parameter, forward where the scale is positive.
        let scale = length(&ahead) / way;
        let arc = Rule::Prescribes(Quantity::Arc(scale));
        if self.set_rule(Parameter(number), arc).is_err() {
            return false;
        }
        let mut step = FIRST_ARC * length(&self.system.unknown_part(&self.state.displacement));
        for _ in 0..STEPS_TO_TURN {
            let (state, kept) = (self.state.clone(), self.targets.clone());
            let mut target = kept.clone();
            target[number] += step;
            let gone = self.step(&target, 0.0).is_ok();
            let mut moved = self.system.unknown_part(&self.state.displacement);
            axpy(
                -1.0,
                &self.system.unknown_part(&state.displacement),
                &mut moved,
            );
            // An arc meets the path ahead and behind.
            if !gone || dot(&moved, &ahead) <= 0.0 {
                self.restart(state, kept);
                step /= 3.0;
                continue;
            }
            if (self.state.parameters[number] - state.parameters[number]) * way < 0.0 {
                return true;
            }
            ahead = moved;
            step *= 1.5;
        }
        false
    }

    /// How many times as fast as on the way so far the body would go on with its given
    /// parameters, and that motion of its unknowns; none at rest, or where nothing is given.
    fn gives_way(&mut self, targets: &[f64]) -> Option<(f64, Vec<f64>)> {
        let moving = self.moving(targets);
        let size = |of: &dyn Fn(&(usize, f64)) -> f64| -> f64 {
            moving.iter().map(|k| of(k).powi(2)).sum::<f64>().sqrt()
        };
        let next = size(&|&(_, step)| step);
        let gone = size(&|&(k, _)| self.state.parameters[k]);
        if moving.is_empty() || gone == 0.0 {
            return None;
        }
        let assembled = self.assemble(&self.state.clone()).ok()?;
        let mut load = vec![0.0; self.system.unknowns.count()];
        for &(k, step) in &moving {
            axpy(-step, &assembled.couplings[k], &mut load);
        }
        self.renew(&assembled).ok()?;
        let ahead = self.solve(&assembled, &load).ok()?;
        let so_far = self.system.unknown_part(&self.state.displacement);
        let times = length(&ahead) / next / (length(&so_far) / gone);
        Some((times, ahead))
    }

    /// The motion with the least stiffness at the accepted state, by inverse iteration.
    fn weakest_motion(&mut self) -> Option<Vec<[f64; 3]>> {
        let assembled = self.assemble(&self.state.clone()).ok()?;
        self.renew(&assembled).ok()?;
        // Any start that is no motion of its own, and the same each time.
        let count = self.system.unknowns.count();
        let mut shape: Vec<f64> = (0..count)
            .map(|k| libm::sin(1.0 + 1.7 * k as f64))
            .collect();
        for _ in 0..INVERSE_ITERATIONS {
            shape = self.solve(&assembled, &shape).ok()?;
            let size = length(&shape);
            for x in &mut shape {
                *x /= size;
            }
        }
        let motion = self.motion(&shape);
        motion.iter().any(|u| length(u) > 0.0).then_some(motion)
    }

    /// The motion of all nodes with these unknowns, at fixed parameters.
    fn motion(&self, unknowns: &[f64]) -> Vec<[f64; 3]> {
        let mut moved = vec![[0.0; 3]; self.state.displacement.len()];
        let parameters = vec![0.0; self.problem.rules().len()];
        self.system.displace(&mut moved, unknowns, &parameters);
        moved
    }

    /// Where a motion is greatest, and its direction there.
    fn mode(&self, motion: &[[f64; 3]]) -> UnstableMode {
        let places = self.problem.mesh.points.iter().zip(motion);
        let first = (&[0.0; 3], &[0.0; 3]);
        let (place, most) = places.fold(first, |most, own| {
            if length(own.1) > length(most.1) {
                own
            } else {
                most
            }
        });
        UnstableMode {
            place: *place,
            direction: most.map(|x| x / length(most)),
        }
    }

    /// The reason of a volume that has no room.
    pub(super) fn impossible(&self, missed: &Missed) -> Reason {
        let mesh = &self.problem.mesh;
        let middle = mesh.cell(missed.cell)[mesh.cell(missed.cell).len() - 1];
        Reason::Volume {
            region: mesh.regions[mesh.region_of(missed.cell)].clone(),
            cell: missed.cell,
            place: mesh.points[middle as usize],
            missed: missed.share,
        }
    }

    /// Why the iteration did not end: it goes round between sets of touching points, or
    /// something else. `before` is the state before the last change.
    pub(super) fn why_not(&self, trial: &State, before: &State, energies: &[f64]) -> Reason {
        let rounds = &energies[energies.len().saturating_sub(ROUND)..];
        let most = rounds.iter().copied().fold(0.0, f64::max);
        // A start on the last state has little energy before it moves.
        let first = energies.iter().take(2).copied().fold(0.0, f64::max);
        // It neither runs away nor comes nearer.
        let stays = rounds.len() == ROUND && most <= first && since_least(rounds) > 0;
        let sets = [trial, before].map(|state| state.places(&self.problem.mesh));
        for number in 0..self.problem.contacts.len() {
            if !stays {
                break;
            }
            let probe = |state, places| self.system.contact(&self.problem, state, places, number);
            let (now, then) = (probe(trial, &sets[0]), probe(before, &sets[1]));
            let pressed = now.pressures.iter().zip(&then.pressures).enumerate();
            let changed = pressed.filter(|(_, (now, then))| (**now > 0.0) != (**then > 0.0));
            let most = changed.max_by(|(_, a), (_, b)| a.0.max(*a.1).total_cmp(&b.0.max(*b.1)));
            if let Some((point, _)) = most {
                return Reason::Chatter {
                    contact: number,
                    place: now.at[point],
                    energies: energies.to_vec(),
                };
            }
        }
        Reason::NotConverged {
            energies: energies.to_vec(),
            inside_out: None,
        }
    }
}
