//! Steps that adapt themselves to Newton's iteration, and the rounds of multipliers in each.

use super::failure::{Failure, Reason};
use super::hop::Beyond;
use super::memory::{Times, held, remember};
use super::newton::{End, Solver};
use super::previous::Previous;
use super::settings::{Continue, Step};
use super::volume::least_volume;
use crate::assembly::contact::Multipliers;
use crate::assembly::follow::place_rigid_bodies;
use crate::assembly::kernel::MAX_PRESSURES;
use crate::assembly::state::State;
use crate::problem::contact::ContactState;
use crate::problem::{Contact, ProblemError};

impl Solver {
    /// Loads from the present targets to these in adaptive steps; `seen` is called after every
    /// accepted step and may stop the loading.
    ///
    /// # Errors
    /// When a step of the smallest size does not converge. The accepted steps stay.
    pub fn load_to(
        &mut self,
        targets: &[f64],
        seen: impl FnMut(&State, &Step) -> Continue,
    ) -> Result<(), Failure> {
        self.load_over(0.0, targets, seen)
    }

    /// The same at a constant rate over a duration in s, for viscoelastic solids;
    /// [`Self::load_to`] loads instantaneously.
    ///
    /// # Errors
    /// As [`Self::load_to`].
    pub fn load_over(
        &mut self,
        duration: f64,
        targets: &[f64],
        mut seen: impl FnMut(&State, &Step) -> Continue,
    ) -> Result<(), Failure> {
        self.check_targets(targets)?;
        self.jumps = 0;
        let duration = duration.max(0.0);
        let start = self.targets.clone();
        let times = Times::of(&self.problem).filter(|_| duration > 0.0);
        if times.is_some() && start == targets && self.wait(duration, &mut seen) {
            return Ok(());
        }
        let span = times.map_or(duration, |times| times.span(duration));
        let mut gone = 0.0;
        // A path that continues in the same direction keeps its step size.
        let pace = self
            .previous
            .as_ref()
            .and_then(|previous| previous.ratio(&start, targets))
            .map_or(self.settings.first_step, |ratio| 1.5 / ratio);
        let mut size = pace.min(self.settings.largest_step);
        let mut beyond = None;
        while gone < 1.0 {
            let left = 1.0 - gone;
            // Strain that creeps is not linear in time.
            let most = times.map_or(1.0, |times| times.step(gone * span) / span);
            let size_now = size.min(most);
            // No tiny last step.
            let mut fraction = if size_now > 0.99 * left {
                left
            } else if size_now > 0.5 * left {
                0.5 * left
            } else {
                size_now
            };
            let mut end = if fraction == left {
                1.0
            } else {
                gone + fraction
            };
            let target: Vec<f64> = start
                .iter()
                .zip(targets)
                .map(|(start, target)| {
                    if end == 1.0 {
                        *target
                    } else {
                        start + end * (target - start)
                    }
                })
                .collect();
            let last = end == 1.0 && duration > span;
            let elapsed = if last { duration } else { span * (end - gone) };
            // What relaxes goes its way without a load, too.
            self.foreseen = times.is_none().then(|| self.foresee(&target)).flatten();
            let tried = self.tried((&target, elapsed), [end, fraction], &mut beyond);
            let mut step = match tried {
                Ok(step) => step,
                Err(reason) => {
                    size = fraction / 3.0;
                    if size >= self.settings.smallest_step && !reason.is_final() {
                        continue;
                    }
                    if beyond.is_none() && !reason.is_final() && self.go_to_corners() {
                        size = self.settings.first_step;
                        continue;
                    }
                    // A jump takes no time, and what relaxes would.
                    let may = times.is_none();
                    let jumped = may.then(|| self.jump(&reason, &target)).flatten();
                    let found = match jumped {
                        Some(step) => Some((step, [end, fraction])),
                        None if reason.is_final() => None,
                        None => self.land(beyond.take()),
                    };
                    let Some((step, along)) = found else {
                        let reason = if self.ear.asked() {
                            Reason::Stopped
                        } else {
                            self.deeper(reason, targets)
                        };
                        return Err(Failure {
                            reason,
                            fraction: gone,
                            parameters: self.named_parameters(),
                        });
                    };
                    [end, fraction] = along;
                    step
                }
            };
            gone = end;
            self.jumps += usize::from(step.jump.is_some());
            beyond = beyond.filter(|beyond: &Beyond| beyond.along[0] > gone);
            step.fraction = gone;
            // Rounds of multipliers say nothing of the size of the step.
            if step.before_rounds <= self.settings.easy_iterations {
                size = (1.5 * fraction).min(self.settings.largest_step).max(size);
            } else if step.before_rounds > 2 * self.settings.easy_iterations {
                size = 0.6 * fraction;
            } else {
                size = size.min(1.2 * fraction);
            }
            if seen(&self.state, &step) == Continue::Stop {
                return Ok(());
            }
        }
        Ok(())
    }

    /// One finite target for each parameter.
    fn check_targets(&self, targets: &[f64]) -> Result<(), Failure> {
        let names: Vec<String> = self.named_parameters().into_iter().map(|p| p.0).collect();
        if targets.len() != names.len() {
            return Err(ProblemError::Targets {
                found: targets.len(),
                parameters: names,
            }
            .into());
        }
        match targets.iter().position(|target| !target.is_finite()) {
            Some(number) => Err(ProblemError::NotFinite {
                parameter: names[number].clone(),
                value: targets[number],
            }
            .into()),
            None => Ok(()),
        }
    }

    /// Waits at the present targets in one step, which is exact where the strain is held; false,
    /// and nothing done, where it creeps.
    fn wait(&mut self, duration: f64, seen: &mut impl FnMut(&State, &Step) -> Continue) -> bool {
        let before = self.state.clone();
        let targets = self.targets.clone();
        let Ok(mut step) = self.step(&targets, duration) else {
            return false;
        };
        if !held(&before, &self.state) {
            self.restart(before, targets);
            return false;
        }
        step.fraction = 1.0;
        seen(&self.state, &step);
        true
    }

    pub(super) fn named_parameters(&self) -> Vec<(String, f64)> {
        (0..self.state.parameters.len())
            .map(|k| {
                let name = self.problem.name(crate::problem::Parameter(k)).to_owned();
                (name, self.state.parameters[k])
            })
            .collect()
    }

    /// One step to these targets; the state changes only when it converges.
    pub(super) fn step(&mut self, targets: &[f64], duration: f64) -> Result<Step, Reason> {
        self.system.elimination = self.settings.elimination;
        let contacts = self.problem.contacts.iter().zip(&self.state.contacts);
        let at_rest = |(contact, known): (&Contact, &ContactState)| {
            contact.rubs_at_once() && known.anchors.is_empty()
        };
        if contacts.into_iter().any(at_rest) {
            self.system.anchor(&self.problem, &mut self.state);
        }
        let mut trial = self.start(targets);
        trial.memory.begin(duration);
        let mut outcome = self.iterate(&mut trial, targets, End::Exact);
        if outcome.is_err() && self.previous.take().is_some() {
            // The extrapolated start may be the cause.
            trial = self.state.clone();
            trial.memory.begin(duration);
            outcome = self.iterate(&mut trial, targets, End::Exact);
        }
        let mut step = outcome?;
        if let Some((contact, way, reach)) = self.system.leapt(&self.problem, &self.state, &trial) {
            return Err(Reason::Leapt {
                contact,
                way,
                reach,
            });
        }
        // Rounds of multipliers change little: they are measured by the step's own scale.
        let scale = self.scale;
        let mut rounds = 0;
        let mut left = false;
        loop {
            let renewed = rounds < self.settings.rounds && self.renew_multipliers(&mut trial);
            if !renewed && !left {
                break;
            }
            // Multipliers and equilibrium come nearer together; only the end has to be exact.
            let end = if renewed { End::Nearer } else { End::Exact };
            left = renewed;
            rounds += usize::from(renewed);
            let round = self.iterate(&mut trial, targets, end)?;
            step.iterations += round.iterations;
            self.scale = scale;
        }
        let mut inverted = Vec::new();
        let least = least_volume(&self.problem, &trial, &self.lattices, &mut inverted);
        step.least_volume = least;
        if let Some(least) = least.filter(|least| least.ratio <= 0.0)
            && self.settings.whole_cells
        {
            let Some(before) = self.system.refine_points(&self.problem, &inverted) else {
                return Err(least.inverted(&self.problem).into());
            };
            let step = self.step(targets, duration);
            if step.is_err() {
                // A smaller step may not need them yet.
                self.system.restore_points(before);
            }
            return step;
        }
        if let Some(reason) = self.crossed(&trial).or_else(|| self.overlapped(&trial)) {
            return Err(reason);
        }
        remember(&self.problem, &mut trial);
        self.system.anchor(&self.problem, &mut trial);
        let old = std::mem::replace(&mut self.state, trial);
        self.previous = Some(Previous {
            state: old,
            targets: std::mem::replace(&mut self.targets, targets.to_vec()),
        });
        Ok(step)
    }

    /// Where a step begins to iterate.
    fn start(&self, targets: &[f64]) -> State {
        let mut trial = self.state.clone();
        let Some(previous) = self.previous.as_ref().filter(|_| self.settings.extrapolate) else {
            return trial;
        };
        // Far beyond the last step the straight line means little.
        let ratio = previous.ratio(&self.targets, targets);
        let Some(ratio) = ratio.filter(|&ratio| ratio < 4.0) else {
            return trial;
        };
        let ratio = ratio * self.settings.reach;
        let old = &previous.state;
        for (new, old) in trial.displacement.iter_mut().zip(&old.displacement) {
            for d in 0..3 {
                new[d] += ratio * (new[d] - old[d]);
            }
        }
        for (new, old) in trial.pressures.iter_mut().zip(&old.pressures) {
            for m in 0..MAX_PRESSURES {
                new[m] += ratio * (new[m] - old[m]);
            }
        }
        for (new, old) in trial.parameters.iter_mut().zip(&old.parameters) {
            *new += ratio * (*new - old);
        }
        place_rigid_bodies(&self.problem, &mut trial);
        trial
    }

    /// Takes the multipliers from contact points to the corners of facets, if that is open; false
    /// if no contact presses.
    fn go_to_corners(&mut self) -> bool {
        if self.settings.multipliers != Multipliers::Automatic || self.state.corners {
            return false;
        }
        let mut contacts = self.problem.contacts.iter().zip(&self.state.contacts);
        self.state.corners = contacts.any(|(contact, state)| {
            !matches!(contact, Contact::Walls(_)) && state.multipliers.iter().any(|t| *t > 0.0)
        });
        if self.state.corners {
            self.previous = None;
            self.scale = 0.0;
        }
        self.state.corners
    }

    /// Takes the multipliers to the pressures found; false when no contact needs it.
    fn renew_multipliers(&self, trial: &mut State) -> bool {
        let places = trial.places(&self.problem.mesh);
        let mut renewed = false;
        for number in 0..self.problem.contacts.len() {
            let of = (number, self.multipliers());
            let next = self.system.renewed(&self.problem, trial, &places, of);
            if let Some(multipliers) = next {
                trial.contacts[number].multipliers = multipliers;
                renewed = true;
            }
        }
        renewed
    }
}
