//! Newton's method for one step, and steps that adapt themselves to it.

use taxel_numerics::dense::dot;

use super::drag::Drag;
use super::failure::{Failure, Reason};
use super::foreseen::Foreseen;
use super::iterative::{Iterations, MixedTangent, TwoLevels};
use super::neighbours::Neighbours;
use super::previous::Previous;
pub use super::settings::{Continue, Jump, Settings, Step};
use super::small::{axpy, solve_small};
use super::stop::Ear;
use crate::assembly::contact::ContactProbe;
pub use crate::assembly::contact::Multipliers;
use crate::assembly::follow::place_rigid_bodies;
use crate::assembly::friction::stick_where_turned;
use crate::assembly::state::State;
use crate::assembly::system::{Assembled, InvertedCell, System};
use crate::problem::{Problem, ProblemError, Rule};
use crate::solver::stress::{StressPoint, stress_points};
use crate::solver::unsymmetric;
use crate::solver::volume::{Lattice, LeastVolume, least_volume};
use crate::sparse::{Cholesky, Definiteness, Factorisation, LinearError, Pattern};

/// An iteration has reached its rounding floor at so many times the estimate of its energy, and
/// where it no longer falls at so many times more.
const FLOOR: [f64; 2] = [10.0, 1e4];

/// Share of its volume by which a cell may miss the volume that its solid asks for, over the
/// tolerance of the iteration.
const MISSED: f64 = 10.0;

/// Iterations without progress after which a volume is given up.
const MISSED_FOR: usize = 4;

/// An iteration whose energy has grown so many times over that of the step is lost.
const LOST: f64 = 10.0;

/// Least share of a change that is tried where the whole one turns a cell inside out.
const SHORTEST: f64 = 0.03;

/// A change overshoots if the forces along it grow to so many times those before it, of the
/// other sign.
const OVERSHOT: f64 = 2.0;

/// The same in an iteration that has found no less energy for [`WANDERS`] iterations.
const NEARER: f64 = 0.3;
const WANDERS: usize = 3;

/// Share of the forces along a change that may be left when a round of multipliers ends.
const ROUND: f64 = 0.1;

/// A problem being solved: the last accepted state and what is reused between steps.
pub struct Solver {
    pub(super) problem: Problem,
    pub(super) system: System,
    pub(super) factor: Cholesky,
    /// In place of the factor.
    pub(super) iterative: Option<TwoLevels>,
    pub(super) lattices: Vec<Lattice>,
    /// Settings of the search.
    pub settings: Settings,
    pub(super) state: State,
    /// Targets of the accepted state.
    pub(super) targets: Vec<f64>,
    pub(super) previous: Option<Previous>,
    pub(super) neighbours: Neighbours,
    /// On the way of a jump.
    pub(super) drag: Option<Drag>,
    pub(super) ear: Ear,
    /// Set where the present step is watched.
    pub(super) foreseen: Option<Foreseen>,
    /// Jumps of the present load.
    pub(super) jumps: usize,
    /// First energy of an iteration, carried over steps.
    pub(super) scale: f64,
    /// Newton iterations since the beginning.
    pub iterations: usize,
}

impl Solver {
    /// Numbers, orders and analyses a problem; the body is at rest.
    ///
    /// # Errors
    /// When the problem is not complete, or too large for the memory.
    pub fn new(problem: Problem) -> Result<Self, Failure> {
        Self::made(problem, None)
    }

    /// The same for bodies too large for a factor: linear systems are solved by iterations, which
    /// need a quarter of the memory and, from some hundred thousand unknowns in space on, less
    /// time. Tangents have to be symmetric and, at fixed pressures, positive definite; whether an
    /// equilibrium is stable is not found out.
    ///
    /// # Errors
    /// As [`Self::new`], and for rigid bodies and constraints between displacements.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::{Law, Material, Volumetric};
    /// use taxel_fem::mesh::{Axis, Grid3};
    /// use taxel_fem::problem::{Kinematics, Motion, Problem, Rule};
    /// use taxel_fem::solver::iterative::Iterations;
    /// use taxel_fem::solver::newton::{Continue, Solver};
    ///
    /// let axis = || Axis::uniform(0.0, 1.0, 3);
    /// let mesh = Grid3::new([axis()?, axis()?, axis()?], "rubber").mesh()?;
    /// let mut problem = Problem::new(mesh, Kinematics::Solid)?;
    /// problem.materials.push(Material::new(Law::neo_hookean(1e5), Volumetric::Quadratic(1e8))?);
    /// problem.clamp("bottom")?;
    /// let push = problem.parameter("push", Rule::Given);
    /// problem.support("top", 2, Motion::Driven(push, 1.0))?;
    /// let mut forces = Vec::new();
    /// for mut solver in [
    ///     Solver::new(problem.clone())?,
    ///     Solver::iterative(problem, Iterations::default())?,
    /// ] {
    ///     solver.load_to(&[-0.1], |_, _| Continue::Yes)?;
    ///     forces.push(solver.evaluate()?.along[0]);
    /// }
    /// assert!((forces[0] / forces[1] - 1.0).abs() < 1e-7);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn iterative(problem: Problem, iterations: Iterations) -> Result<Self, Failure> {
        Self::made(problem, Some(iterations))
    }

    fn made(problem: Problem, iterations: Option<Iterations>) -> Result<Self, Failure> {
        let mut system = System::new(&problem).map_err(|error| Failure::at_start(error.into()))?;
        let linear = |error: LinearError| Failure::at_start(error.into());
        let (factor, iterative) = match iterations {
            None => (
                Cholesky::analyse(&system.unknowns.pattern).map_err(linear)?,
                None,
            ),
            Some(_) if !(problem.rigid_bodies.is_empty() && problem.constraints.is_empty()) => {
                return Err(linear(LinearError::Constrained));
            }
            Some(iterations) => {
                let none = Pattern {
                    column_starts: vec![0],
                    rows: Vec::new(),
                };
                let levels = TwoLevels::new(system.separate(&problem), iterations);
                (
                    Cholesky::analyse(&none).map_err(linear)?,
                    Some(levels.map_err(linear)?),
                )
            }
        };
        let state = State::rest(&problem);
        let targets = vec![0.0; problem.rules().len()];
        let mut solver = Self {
            lattices: Lattice::of(&problem),
            problem,
            system,
            factor,
            iterative,
            settings: Settings::default(),
            state,
            targets,
            previous: None,
            neighbours: Neighbours::default(),
            drag: None,
            ear: Ear::default(),
            foreseen: None,
            jumps: 0,
            scale: 0.0,
            iterations: 0,
        };
        solver.targets = solver.targets_at_rest()?;
        Ok(solver)
    }

    /// Iterations of the last linear system; none where a factor solves them.
    pub fn linear_iterations(&self) -> Option<usize> {
        self.iterative.as_ref().map(|levels| levels.iterations)
    }

    /// Takes a new tangent to the linear solver.
    pub(super) fn renew(&mut self, assembled: &Assembled) -> Result<Definiteness, LinearError> {
        let tangent = tangent(&self.problem, &self.system, assembled);
        let (Some(levels), Some(tangent)) = (&mut self.iterative, tangent) else {
            let pattern = &self.system.unknowns.pattern;
            return self.factor.refactor(pattern, &assembled.values);
        };
        levels.renew(&tangent)?;
        Ok(Definiteness::Positive)
    }

    /// Solves with the tangent that was taken last.
    pub(super) fn solve(
        &mut self,
        assembled: &Assembled,
        right: &[f64],
    ) -> Result<Vec<f64>, LinearError> {
        let tangent = tangent(&self.problem, &self.system, assembled);
        let (Some(levels), Some(tangent)) = (&mut self.iterative, tangent) else {
            let pattern = &self.system.unknowns.pattern;
            let matrix = (pattern, assembled.values.as_slice(), &assembled.unsymmetric);
            return unsymmetric::solve(&mut self.factor, matrix, right);
        };
        if !assembled.unsymmetric.is_empty() {
            return Err(LinearError::NotPositive);
        }
        levels.solve(&tangent, right)
    }

    /// The problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The last accepted state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Where the multipliers of obstacles and surfaces stand now: at contact points or at corners.
    pub fn multipliers(&self) -> Multipliers {
        match self.settings.multipliers {
            Multipliers::Automatic if self.state.corners => Multipliers::Corners,
            Multipliers::Automatic => Multipliers::Points,
            chosen => chosen,
        }
    }

    /// Number of displacement unknowns.
    pub fn unknowns(&self) -> usize {
        self.system.unknowns.count()
    }

    /// Goes back to a state that was accepted before, with its targets.
    pub fn restart(&mut self, state: State, targets: Vec<f64>) {
        self.state = state;
        self.targets = targets;
        self.restart_here();
    }

    /// Forgets the way to the accepted state.
    pub(super) fn restart_here(&mut self) {
        self.previous = None;
        self.neighbours.clear();
        self.scale = 0.0;
    }

    /// Puts the nodes of the undeformed body elsewhere: another design on the same
    /// mesh. `place` gives the place of a node by its number, m. Numbering, analysis
    /// and tables stay; so does the accepted state, from which [`Self::settle`] finds
    /// the equilibrium of the new body if it is near. Contacts keep their points.
    pub fn place_nodes(&mut self, place: impl Fn(usize) -> [f64; 3]) {
        for (node, point) in self.problem.mesh.points.iter_mut().enumerate() {
            *point = place(node);
        }
        self.previous = None;
    }

    /// Finds the equilibrium at the present targets, in one step.
    ///
    /// # Errors
    /// When the iteration does not converge; the state stays as it was.
    pub fn settle(&mut self) -> Result<Step, Failure> {
        let targets = self.targets.clone();
        let mut step = self.step(&targets, 0.0).map_err(|reason| Failure {
            reason,
            fraction: 0.0,
            parameters: self.named_parameters(),
        })?;
        // Nothing was moved, so there is no straight line to follow.
        self.previous = None;
        step.fraction = 1.0;
        Ok(step)
    }

    /// From now on `asked` is called before every Newton iteration - also in those of steps that
    /// fail, of jumps and of the search for the reason of a failure - and ends what is being solved
    /// by true: with [`Reason::Stopped`], at the last accepted state.
    pub fn stop_when(&mut self, asked: impl Fn() -> bool + Send + Sync + 'static) {
        self.ear = Ear::new(asked);
    }

    /// Targets of the accepted state, in the order of the parameters.
    pub fn targets(&self) -> &[f64] {
        &self.targets
    }

    /// Changes the rule of a parameter between steps; its target becomes the present
    /// value of what the rule names.
    ///
    /// # Errors
    /// When the present state can't be evaluated.
    pub fn set_rule(
        &mut self,
        parameter: crate::problem::Parameter,
        rule: Rule,
    ) -> Result<(), Failure> {
        self.problem.set_rule(parameter, rule);
        self.targets = self.targets_at_rest()?;
        self.previous = None;
        Ok(())
    }

    /// Forces, volumes and couplings at the accepted state.
    ///
    /// # Errors
    /// When the state is not valid.
    pub fn evaluate(&mut self) -> Result<Assembled, Failure> {
        self.system
            .assemble(&self.problem, &self.state, false)
            .map_err(|error| Failure::at_start(error.into()))
    }

    /// Gaps and pressures of a contact, by its number, at the accepted state.
    pub fn contact(&self, number: usize) -> ContactProbe {
        let places = self.state.places(&self.problem.mesh);
        self.system
            .contact(&self.problem, &self.state, &places, number)
    }

    /// Pressure of contacts on each node, Pa of present area: the mean of the points about it, 0 of a
    /// node that nothing presses.
    pub fn contact_pressure(&self) -> Vec<f64> {
        let places = self.state.places(&self.problem.mesh);
        self.system
            .contact_pressure(&self.problem, &self.state, &places)
    }

    /// The point of the greatest von Mises stress at the accepted state.
    pub fn greatest_stress(&self) -> Option<StressPoint> {
        stress_points(&self.problem, &self.state).max_by(|a, b| a.von_mises.total_cmp(&b.von_mises))
    }

    /// The least volume ratio at the accepted state, over whole cells: at corners, nodes and
    /// (in the plane) points between them, beside the points of integration. A force is to be
    /// trusted where it is positive; none for a body without cells.
    pub fn least_volume_ratio(&self) -> Option<LeastVolume> {
        least_volume(&self.problem, &self.state, &self.lattices, &mut Vec::new())
    }

    /// Values of the quantities that the rules name at the present state.
    fn targets_at_rest(&mut self) -> Result<Vec<f64>, Failure> {
        let assembled = self.evaluate()?;
        let rules = self.problem.rules();
        Ok(rules
            .iter()
            .enumerate()
            .map(|(number, rule)| match rule {
                Rule::Given | Rule::Follows(..) => self.state.parameters[number],
                Rule::Prescribes(quantity) => {
                    self.quantity(quantity, number, &self.state, &assembled).0
                }
            })
            .collect())
    }

    /// Newton's iteration from a state to these targets.
    pub(super) fn iterate(
        &mut self,
        trial: &mut State,
        targets: &[f64],
        end: End,
    ) -> Result<Step, Reason> {
        let mut assembled = self.tangent_at(trial)?;
        let mut first = 0.0_f64;
        let mut energies = Vec::new();
        let mut missed = Missed::default();
        let mut last = trial.clone();
        for iteration in 1..=self.settings.iterations {
            if self.ear.asked() {
                return Err(Reason::Stopped);
            }
            if assembled.incomplete {
                assembled = self.extend(trial)?;
            }
            let definiteness = self.renew(&assembled)?;
            let change = self.change(trial, &assembled, targets)?;
            self.iterations += 1;
            if let Some(foreseen) = &mut self.foreseen
                && foreseen.ahead.is_empty()
            {
                foreseen.ahead.clone_from(&change.displacement);
            }
            let energy = change.energy.abs().sqrt();
            if !energy.is_finite() {
                return Err(Reason::NotANumber);
            }
            energies.push(energy);
            let lost = iteration > 3 && energy > LOST * first.max(self.scale);
            if lost || self.wanders(&energies) {
                break;
            }
            first = first.max(energy);
            // A good start has little to fall; it must not end before it has begun.
            let scale = first.max(0.03 * self.scale);
            let stuck = trial.contacts.iter().any(|known| !known.stuck.is_empty());
            for known in &mut trial.contacts {
                known.stuck.clear();
            }
            let goal = self.settings.tolerance * scale;
            let fallen = energy <= goal || at_floor(&energies, assembled.rounding);
            let settled = fallen && !stuck;
            let before = trial.clone();
            last.clone_from(&before);
            let length = if alternates(&energies) { 0.5 } else { 1.0 };
            missed.hear(self.apply(trial, &before, &assembled, &change, length));
            // A change that moves obstacles is not the last; what they meet is seen in the next.
            let seen = self.problem.contacts.is_empty()
                || iteration > 1
                || change.parameters.iter().all(|moved| *moved == 0.0);
            let done = settled && seen && missed.share <= MISSED * self.settings.tolerance;
            if settled && missed.rounds >= MISSED_FOR {
                return Err(self.impossible(&missed));
            }
            if done && end == End::Exact && self.may_hop(trial) {
                self.foresee_back(trial, &assembled);
            }
            let unstable = done && change.given_only && self.settings.stable && {
                let pattern = &self.system.unknowns.pattern;
                let matrix = (pattern, assembled.values.as_slice(), &assembled.unsymmetric);
                unsymmetric::diverges(&mut self.factor, matrix, definiteness)?
            };
            self.system.reuse(std::mem::take(&mut assembled.values));
            if unstable {
                return Err(Reason::Unstable { mode: None });
            }
            if done {
                self.scale = first.max(0.3 * self.scale);
                return Ok(converged(iteration, definiteness, &energies));
            }
            let may = end == End::Exact && length == 1.0 && assembled.unsymmetric.is_empty();
            if may
                && definiteness == Definiteness::Positive
                && let Some(step) = self.finish(trial, targets, &mut energies, goal)
            {
                if !self.may_hop(trial) {
                    self.scale = first.max(0.3 * self.scale);
                    return Ok(step);
                }
                assembled = self.tangent_at(trial)?;
                continue;
            }
            // An iteration that wanders between sets of touching points has to come nearer with
            // each change.
            let allowed = if since_least(&energies) >= WANDERS {
                NEARER
            } else {
                OVERSHOT
            };
            let bounds = (iteration, length, allowed);
            let start = dot(&assembled.residual, &change.unknowns);
            let slid = std::mem::take(&mut assembled.slides);
            assembled = self.search(trial, &before, &assembled, &change, bounds)?;
            let nearer = dot(&assembled.residual, &change.unknowns).abs() <= ROUND * start.abs();
            let turned = stick_where_turned(&slid, &assembled.slides, &mut trial.contacts);
            if end == End::Nearer && nearer && !turned && !assembled.incomplete {
                self.system.reuse(std::mem::take(&mut assembled.values));
                return Ok(converged(iteration, definiteness, &energies));
            }
            if turned {
                self.system.reuse(std::mem::take(&mut assembled.values));
                assembled = self.tangent_at(trial)?;
            }
        }
        Err(self.why_not(trial, &last, &energies))
    }

    /// Assembles at a state, with a place in the matrix for all that touches there.
    pub(super) fn assemble(&mut self, state: &State) -> Result<Assembled, Reason> {
        let assembled = self.tangent_at(state)?;
        if assembled.incomplete {
            return self.extend(state);
        }
        Ok(assembled)
    }

    /// Assembles forces and tangent at a state, with the drag of a jump.
    fn tangent_at(&mut self, state: &State) -> Result<Assembled, InvertedCell> {
        let mut assembled = self.system.assemble(&self.problem, state, true)?;
        if let Some(drag) = &self.drag {
            drag.add(&self.system, state, &mut assembled);
        }
        Ok(assembled)
    }

    /// Numbers the unknowns anew for the surfaces that touch in a state, and assembles.
    fn extend(&mut self, state: &State) -> Result<Assembled, Reason> {
        self.system.extend(&self.problem, state);
        match &mut self.iterative {
            Some(levels) => {
                let settings = levels.settings;
                *levels = TwoLevels::new(self.system.separate(&self.problem), settings)?;
            }
            None => self.factor = Cholesky::analyse(&self.system.unknowns.pattern)?,
        }
        Ok(self.tangent_at(state)?)
    }

    /// True if the iteration has stalled.
    fn wanders(&self, energies: &[f64]) -> bool {
        let (Some(allowed_iterations), [first, second, .., last]) =
            (self.settings.stall_iterations, energies)
        else {
            return false;
        };
        // A start on the last state has little energy before it moves.
        let allowed = if energies.len() < allowed_iterations {
            2.0
        } else {
            0.1
        };
        *last > allowed * first.max(*second) || since_least(&energies[1..]) > allowed_iterations / 2
    }

    /// Shortens a change that turns a cell inside out or overshoots, and assembles.
    fn search(
        &mut self,
        trial: &mut State,
        before: &State,
        assembled: &Assembled,
        change: &Change,
        (iteration, mut length, allowed): (usize, f64, f64),
    ) -> Result<Assembled, Reason> {
        loop {
            match self.tangent_at(trial) {
                Ok(next) => {
                    let start = dot(&assembled.residual, &change.unknowns);
                    let end = dot(&next.residual, &change.unknowns);
                    let overshot = iteration > 1
                        && length > 0.2
                        && change.given_only
                        && start < 0.0
                        && end > allowed * -start;
                    if !overshot {
                        return Ok(next);
                    }
                    self.system.reuse(next.values);
                    length *= (start / (start - end)).max(0.3);
                }
                Err(inverted) => {
                    length *= 0.5;
                    if length < SHORTEST {
                        return Err(inverted.into());
                    }
                }
            }
            self.apply(trial, before, assembled, change, length);
        }
    }

    /// The state after a part of a change, and the volume that it misses.
    pub(super) fn apply(
        &self,
        trial: &mut State,
        before: &State,
        assembled: &Assembled,
        change: &Change,
        length: f64,
    ) -> (f64, usize) {
        for (k, dz) in change.parameters.iter().enumerate() {
            trial.parameters[k] = before.parameters[k] + length * dz;
        }
        for (node, moved) in change.displacement.iter().enumerate() {
            for d in 0..3 {
                trial.displacement[node][d] = before.displacement[node][d] + length * moved[d];
            }
        }
        place_rigid_bodies(&self.problem, trial);
        trial.pressures.clone_from(&before.pressures);
        self.system.recover_pressures(
            &self.problem,
            assembled,
            &change.displacement,
            length,
            &mut trial.pressures,
        )
    }

    /// Newton's change of unknowns and parameters.
    pub(super) fn change(
        &mut self,
        trial: &State,
        assembled: &Assembled,
        targets: &[f64],
    ) -> Result<Change, Reason> {
        let rules = self.problem.rules();
        let mut parameters = vec![0.0; rules.len()];
        let mut right: Vec<f64> = assembled.residual.iter().map(|r| -r).collect();
        let mut free = Vec::new();
        for (k, rule) in rules.iter().enumerate() {
            if *rule == Rule::Given {
                parameters[k] = targets[k] - trial.parameters[k];
                if parameters[k] != 0.0 {
                    axpy(-parameters[k], &assembled.couplings[k], &mut right);
                }
            } else {
                free.push(k);
            }
        }
        let mut unknowns = self.solve(assembled, &right)?;
        let mut responses = Vec::new();
        for &k in &free {
            let load: Vec<f64> = assembled.couplings[k].iter().map(|c| -c).collect();
            responses.push(self.solve(assembled, &load)?);
        }
        let rules = self.problem.rules();
        // Small system of the free parameters.
        let size = free.len();
        let mut small = vec![vec![0.0; size]; size];
        let mut rest = vec![0.0; size];
        for (row, &k) in free.iter().enumerate() {
            let equation = self.equation(k, &rules[k], trial, assembled, targets[k]);
            let along = |v: &[f64]| equation.slope.along(v);
            let known: f64 = (0..rules.len())
                .map(|l| equation.by_parameters[l] * parameters[l])
                .sum();
            rest[row] = -equation.value - along(&unknowns) - known;
            for (column, &l) in free.iter().enumerate() {
                small[row][column] = along(&responses[column]) + equation.by_parameters[l];
            }
        }
        let found = solve_small(small, rest).ok_or(Reason::ControlLost)?;
        for (column, &k) in free.iter().enumerate() {
            parameters[k] = found[column];
            axpy(found[column], &responses[column], &mut unknowns);
            axpy(-found[column], &assembled.couplings[k], &mut right);
        }
        let mut displacement = vec![[0.0; 3]; trial.displacement.len()];
        self.system
            .displace(&mut displacement, &unknowns, &parameters);
        Ok(Change {
            displacement,
            // du' K du, all loads of the change on the right.
            energy: dot(&right, &unknowns),
            given_only: free.is_empty(),
            unknowns,
            parameters,
        })
    }
}

/// Where an iteration ends.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// At the tolerance.
    Exact,
    /// After a change that has taken most of the forces along it.
    Nearer,
}

pub(super) fn converged(iterations: usize, definiteness: Definiteness, energies: &[f64]) -> Step {
    Step {
        iterations,
        before_rounds: iterations,
        least_volume: None,
        definiteness,
        fraction: 0.0,
        jump: None,
        energies: match energies[..] {
            [.., first, second, third] => [first, second, third],
            _ => [0.0; 3],
        },
    }
}

/// The tangent in its mixed form; none where pressures are eliminated.
fn tangent<'a>(
    problem: &'a Problem,
    system: &'a System,
    assembled: &'a Assembled,
) -> Option<MixedTangent<'a>> {
    Some(MixedTangent {
        mesh: &problem.mesh,
        unknowns: &system.unknowns,
        values: &assembled.values,
        mixed: system.mixed.as_ref()?,
        parts: assembled.mixed.as_ref()?,
    })
}

/// True if the iteration has fallen to what rounding leaves of it; `rounding` is the energy that
/// rounding is worth.
pub(super) fn at_floor(energies: &[f64], rounding: f64) -> bool {
    let floor = rounding.sqrt();
    match energies {
        [.., before, last] => {
            *last <= FLOOR[0] * floor || (*last > 0.5 * before && *last <= FLOOR[1] * floor)
        }
        _ => false,
    }
}

/// Volume that the cells miss.
#[derive(Default)]
pub(super) struct Missed {
    /// Greatest share of its volume that a cell misses, and that cell.
    pub(super) share: f64,
    pub(super) cell: usize,
    /// Iterations in which it has hardly fallen.
    rounds: usize,
}

impl Missed {
    fn hear(&mut self, (share, cell): (f64, usize)) {
        let stays = share > 0.5 * self.share && share < 2.0 * self.share;
        self.rounds = if stays { self.rounds + 1 } else { 0 };
        (self.share, self.cell) = (share, cell);
    }
}

/// Iterations since that of the least energy.
pub(super) fn since_least(energies: &[f64]) -> usize {
    let numbered = energies.iter().rev().enumerate();
    let least = numbered.min_by(|a, b| a.1.total_cmp(b.1));
    least.map_or(0, |(since, _)| since)
}

/// True if an iteration goes to and fro, as it does between two sets of touching points:
/// neither side's tangent knows of the other. Half of a change ends that.
fn alternates(energies: &[f64]) -> bool {
    let [.., before, last, now] = energies else {
        return false;
    };
    let like = |other: &f64| (now / other - 1.0).abs();
    like(before) < 0.2 && like(last) < 0.5
}

pub(super) struct Change {
    pub(super) unknowns: Vec<f64>,
    /// Of all nodes.
    pub(super) displacement: Vec<[f64; 3]>,
    pub(super) parameters: Vec<f64>,
    pub(super) energy: f64,
    pub(super) given_only: bool,
}

impl From<ProblemError> for Reason {
    fn from(error: ProblemError) -> Self {
        Self::Problem(error)
    }
}

#[cfg(test)]
mod tests {
    use super::{alternates, since_least};

    #[test]
    fn an_iteration_that_finds_no_less_energy_is_reported() {
        // Under a punch beside the middle, with far too large a step.
        assert_eq!(since_least(&[9e4, 2e4, 4e2, 7e2, 1e3, 8e2]), 3);
        assert_eq!(since_least(&[9e4, 2e4, 4e2]), 0);
        assert_eq!(since_least(&[]), 0);
    }

    #[test]
    fn alternation_is_distinguished_from_slow_convergence() {
        // Between two sets of points under a punch; by a tangent that is not exact; and
        // one bad step on the way.
        assert!(alternates(&[8.0e-4, 4.3e-5, 4.6e-5, 4.5e-5]));
        assert!(!alternates(&[8.0e-4, 4.0e-4, 2.0e-4, 1.0e-4]));
        assert!(!alternates(&[8.0e-4, 4.0e-5, 9.0e-4, 4.1e-5]));
        assert!(!alternates(&[8.0e-4, 7.9e-4]));
    }
}
