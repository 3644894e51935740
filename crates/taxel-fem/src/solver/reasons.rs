//! Why a solution could not go on, found at its last state.

use super::failure::{Mode, Reason};
use super::newton::{Missed, Solver, since_least};
use super::small::{axpy, dot};
use crate::assembly::state::State;
use crate::material::stability::ellipticity;
use crate::mesh::quality::extreme_eigenvalues;
use crate::problem::{FreePart, Rule, free_part};
use crate::scalar::Tensor;
use crate::solver::stress::{StressPoint, stress_points};
use crate::sparse::LinearError;

/// Greatest principal stretch, or the inverse of the least where that is greater.
fn greatest_stretch(gradient: &Tensor<f64>) -> f64 {
    let square: Tensor<f64> = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..3).map(|k| gradient[k][i] * gradient[k][j]).sum())
    });
    let [least, most] = extreme_eigenvalues(&square);
    most.max(1.0 / least).sqrt()
}

/// Points of the greatest stress that are looked at after a failure.
const SUSPECTS: usize = 100;

/// Steps of the inverse iteration for the weakest mode: near a bifurcation one is enough.
const INVERSE_ITERATIONS: usize = 8;

/// Last iterations by which one is judged that did not end.
const ROUND: usize = 4;

/// A body that goes on so many times as fast as on the way so far is at a limit of its load.
const GIVES_WAY: f64 = 5.0;

impl Solver {
    /// A reason in the solid or in the load behind one of the iteration.
    pub(super) fn deeper(&mut self, reason: Reason, targets: &[f64]) -> Reason {
        if let Some(part) = self.not_held(&reason) {
            return Reason::HeldByContact(part);
        }
        if !matches!(
            reason,
            Reason::NotConverged { .. } | Reason::NotANumber | Reason::Unstable { .. }
        ) {
            return reason;
        }
        let mut points: Vec<StressPoint> = stress_points(&self.problem, &self.state).collect();
        points.sort_by(|a, b| b.von_mises.total_cmp(&a.von_mises));
        let mesh = &self.problem.mesh;
        let lost = points.iter().take(SUSPECTS).find(|point| {
            let material = &self.problem.materials[mesh.region_of(point.cell)];
            !ellipticity(material, &point.gradient, point.pressure).holds()
        });
        if let Some(point) = lost {
            return Reason::LostEllipticity {
                cell: point.cell,
                region: mesh.regions[mesh.region_of(point.cell)].clone(),
                place: point.place,
                stretch: greatest_stretch(&point.gradient),
            };
        }
        match self.gives_way(targets) {
            Some((times, place)) if times > GIVES_WAY => Reason::Limit { times, place },
            _ => match reason {
                Reason::Unstable { .. } => Reason::Unstable {
                    mode: self.weakest_mode(),
                },
                Reason::NotConverged { energies, .. } => Reason::NotConverged {
                    energies,
                    inside_out: self.least_volume_ratio().filter(|least| least.ratio <= 0.0),
                },
                other => other,
            },
        }
    }

    /// The part that nothing holds but contacts, if it explains why the iteration has failed: the
    /// matrix is singular, or no contact presses at the last state.
    fn not_held(&self, reason: &Reason) -> Option<FreePart> {
        let part = free_part(&self.problem)?;
        let places = self.state.places(&self.problem.mesh);
        let presses = (0..self.problem.contacts.len()).any(|number| {
            let probe = self
                .system
                .contact(&self.problem, &self.state, &places, number);
            probe.pressures.iter().any(|pressure| *pressure > 0.0)
        });
        let singular = matches!(
            reason,
            Reason::Linear(
                LinearError::Singular
                    | LinearError::Inaccurate { .. }
                    | LinearError::Unsymmetric { .. }
            )
        );
        let lost = matches!(
            reason,
            Reason::NotConverged { .. }
                | Reason::NotANumber
                | Reason::Unstable { .. }
                | Reason::Inverted(_)
                | Reason::Leapt { .. }
        );
        (singular || lost && !presses).then_some(part)
    }

    /// How many times as fast as on the way so far the body would go on with its given
    /// parameters, and where it would go fastest; none at rest, or where nothing is given.
    fn gives_way(&mut self, targets: &[f64]) -> Option<(f64, [f64; 3])> {
        let rules = self.problem.rules();
        let moving: Vec<(usize, f64)> = (0..rules.len())
            .map(|k| (k, targets[k] - self.targets[k]))
            .filter(|&(k, step)| rules[k] == Rule::Given && step != 0.0)
            .collect();
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
        let times = dot(&ahead, &ahead).sqrt() / next / (dot(&so_far, &so_far).sqrt() / gone);
        let mut moved = vec![[0.0; 3]; self.state.displacement.len()];
        let parameters = vec![0.0; self.problem.rules().len()];
        self.system.displace(&mut moved, &ahead, &parameters);
        let length = |u: &[f64; 3]| -> f64 { u.iter().map(|x| x * x).sum() };
        let fastest =
            (0..moved.len()).max_by(|&a, &b| length(&moved[a]).total_cmp(&length(&moved[b])));
        Some((times, self.problem.mesh.points[fastest?]))
    }

    /// The motion with the least stiffness at the accepted state, by inverse iteration.
    fn weakest_mode(&mut self) -> Option<Mode> {
        let assembled = self.assemble(&self.state.clone()).ok()?;
        self.renew(&assembled).ok()?;
        // Any start that is no motion of its own, and the same each time.
        let count = self.system.unknowns.count();
        let mut shape: Vec<f64> = (0..count)
            .map(|k| libm::sin(1.0 + 1.7 * k as f64))
            .collect();
        for _ in 0..INVERSE_ITERATIONS {
            shape = self.solve(&assembled, &shape).ok()?;
            let length = dot(&shape, &shape).sqrt();
            for x in &mut shape {
                *x /= length;
            }
        }
        let mut moved = vec![[0.0; 3]; self.state.displacement.len()];
        let parameters = vec![0.0; self.problem.rules().len()];
        self.system.displace(&mut moved, &shape, &parameters);
        let length = |u: &[f64; 3]| u.iter().map(|x| x * x).sum::<f64>().sqrt();
        let most =
            (0..moved.len()).max_by(|&a, &b| length(&moved[a]).total_cmp(&length(&moved[b])))?;
        let size = length(&moved[most]);
        (size > 0.0).then(|| Mode {
            place: self.problem.mesh.points[most],
            direction: moved[most].map(|x| x / size),
        })
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
