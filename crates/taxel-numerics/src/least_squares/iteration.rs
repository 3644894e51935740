//! The search: steps of Levenberg and Marquardt inside bounds.

use super::dense::{Triangle, norm};
use super::{FitError, FitOptions, Loss, Parameter, Problem};

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The residuals are at right angles to all slopes, to 1e-12.
    Flat,
    /// The last step was below 1e-12 of the parameters.
    SmallStep,
    /// No step lowers the sum any more: rounding ends the search.
    NoDecrease,
    /// The iterations were used up: the values are not the best ones.
    Iterations,
}

impl Stop {
    /// A phrase for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "residuals at right angles to all slopes",
            Self::SmallStep => "last step below 1e-12",
            Self::NoDecrease => "no step lowers the sum of squares",
            Self::Iterations => "iterations used up before the minimum",
        }
    }

    /// True if a minimum was reached.
    pub fn converged(self) -> bool {
        self != Self::Iterations
    }
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    pub(super) at: Vec<f64>,
    pub(super) residuals: Vec<f64>,
    /// Slopes of the residuals, a column for each parameter.
    columns: Vec<Vec<f64>>,
    /// Loss over all readings and priors.
    pub(super) cost: f64,
    pub(super) stop: Stop,
    pub(super) iterations: usize,
    /// Loss that the weights of the residuals are made with.
    loss: Loss,
    noise: f64,
}

const FLAT: f64 = 1e-12;
const SMALL_STEP: f64 = 1e-12;
/// The first steps may be this many times as long as the way from zero.
const FIRST_RADIUS: f64 = 100.0;
/// A step that gains less than this share of what the slopes promise halves
/// the radius, one that gains more than [`GOOD`] doubles it.
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;
/// Sums that differ by less than this share are the same: near the minimum the
/// slopes know more than the sum.
const ROUNDING: f64 = 1e-14;
/// The radius ends the search below this share of the way from zero.
const LEAST_RADIUS: f64 = 1e-16;

/// Searches from `start`; residuals are divided by `noise`.
pub(super) fn minimise(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    start: &[f64],
    noise: f64,
) -> Result<Minimum, FitError> {
    let mut search = Search::new(problem, parameters, options, start, noise)?;
    let stop = (0..options.iterations).find_map(|_| search.advance());
    Ok(Minimum {
        stop: stop.unwrap_or(Stop::Iterations),
        ..search.minimum
    })
}

struct Search<'a> {
    problem: &'a dyn Problem,
    parameters: &'a [Parameter],
    minimum: Minimum,
    /// Where the next step leads, and its residuals.
    trial: Trial,
    /// Longest step, in sizes of the parameters; `None` before the first one.
    radius: Option<f64>,
}

struct Trial {
    at: Vec<f64>,
    residuals: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(
        problem: &'a dyn Problem,
        parameters: &'a [Parameter],
        options: &FitOptions,
        start: &[f64],
        noise: f64,
    ) -> Result<Self, FitError> {
        let at: Vec<f64> = parameters
            .iter()
            .zip(start)
            .map(|(p, start)| start.clamp(p.bounds[0], p.bounds[1]))
            .collect();
        let readings = problem.readings();
        let mut minimum = Minimum {
            residuals: vec![0.0; readings],
            columns: vec![vec![0.0; readings]; parameters.len()],
            cost: f64::NAN,
            stop: Stop::Iterations,
            iterations: 0,
            loss: options.loss,
            noise,
            at,
        };
        let there = problem.residuals(&minimum.at, &mut minimum.residuals)
            && problem.slopes(parameters, &minimum.at, &mut minimum.columns);
        minimum.cost = minimum.cost_of(parameters, &minimum.at, &minimum.residuals);
        if !there || !minimum.cost.is_finite() {
            return Err(FitError::NoStart {
                name: parameters.first().map_or(String::new(), |p| p.name.clone()),
                value: start.first().copied().unwrap_or(0.0),
            });
        }
        Ok(Self {
            problem,
            parameters,
            trial: Trial {
                at: minimum.at.clone(),
                residuals: vec![0.0; readings],
            },
            minimum,
            radius: None,
        })
    }

    /// One lower place; the reason when there is none.
    fn advance(&mut self) -> Option<Stop> {
        self.minimum.iterations += 1;
        let free = self.movable();
        let triangle = self
            .minimum
            .triangle(self.parameters, &free, self.minimum.noise, true);
        if triangle.reach() <= FLAT * self.minimum.cost.sqrt() {
            return Some(Stop::Flat);
        }
        loop {
            match self.attempt(&triangle, &free) {
                Attempt::Better => return None,
                Attempt::Last(stop) => return Some(stop),
                Attempt::Worse => {}
            }
        }
    }

    /// Parameters that are neither fixed nor pressed against a bound.
    fn movable(&self) -> Vec<usize> {
        let minimum = &self.minimum;
        let slope = |j| minimum.slope_of_cost(self.parameters, j, minimum.noise);
        (0..self.parameters.len())
            .filter(|&j| {
                let [low, high] = self.parameters[j].bounds;
                let at = minimum.at[j];
                low < high && !(at <= low && slope(j) > 0.0 || at >= high && slope(j) < 0.0)
            })
            .collect()
    }

    fn attempt(&mut self, triangle: &Triangle, free: &[usize]) -> Attempt {
        let whole = self.whole_length();
        let radius = self.radius.unwrap_or(FIRST_RADIUS * whole);
        let step = self.step(triangle, free, radius);
        let length = norm(step.iter().copied());
        let small = self.take(free, &step);
        let expected = triangle.decrease(&step);
        // What is left to gain cannot be seen in the sum any more.
        let unseen = expected <= ROUNDING * self.minimum.cost;
        let there = self
            .problem
            .residuals(&self.trial.at, &mut self.trial.residuals);
        let cost = self
            .minimum
            .cost_of(self.parameters, &self.trial.at, &self.trial.residuals);
        let gain = (self.minimum.cost - cost) / expected.max(f64::MIN_POSITIVE);
        let better =
            there && (gain > 1e-4 || unseen && cost <= self.minimum.cost * (1.0 + ROUNDING));
        if better && self.accept(cost) {
            let radius = self.radius.unwrap_or(length).min(radius);
            self.radius = Some(if gain < POOR {
                0.5 * radius
            } else if gain > GOOD {
                radius.max(2.0 * length)
            } else {
                radius
            });
            return match (small, unseen) {
                (true, _) => Attempt::Last(Stop::SmallStep),
                (false, true) => Attempt::Last(Stop::NoDecrease),
                _ => Attempt::Better,
            };
        }
        if small || unseen || radius <= LEAST_RADIUS * whole {
            return Attempt::Last(Stop::NoDecrease);
        }
        self.radius = Some(shorter(gain) * radius.min(length));
        Attempt::Worse
    }

    /// Length of the way from zero to here, in sizes.
    fn whole_length(&self) -> f64 {
        let parts = self.minimum.at.iter().zip(self.parameters);
        let whole = norm(parts.map(|(at, p)| at / p.size));
        if whole > 0.0 { whole } else { 1.0 }
    }

    /// The best step no longer than `radius`. Where it meets bounds, those
    /// parameters go to them and the others do their best beside them.
    fn step(&self, triangle: &Triangle, free: &[usize], radius: f64) -> Vec<f64> {
        let (damping, mut step) = triangle.bounded_step(radius);
        let mut held: Vec<Option<f64>> = vec![None; free.len()];
        loop {
            let mut met = false;
            for (place, &j) in free.iter().enumerate() {
                let parameter = &self.parameters[j];
                let room = parameter
                    .bounds
                    .map(|bound| (self.minimum.at[j] - bound) / parameter.size);
                let within = step[place].clamp(room[1], room[0]);
                if held[place].is_none() && within != step[place] {
                    held[place] = Some(within);
                    met = true;
                }
            }
            if !met {
                return step;
            }
            step = triangle.step_beside(damping, &held);
        }
    }

    /// Moves the trial by `step`; whether that is no more than rounding.
    fn take(&mut self, free: &[usize], step: &[f64]) -> bool {
        let mut small = true;
        self.trial.at.clone_from(&self.minimum.at);
        for (&j, step) in free.iter().zip(step) {
            let parameter = &self.parameters[j];
            let here = self.minimum.at[j];
            let moved =
                (here - step * parameter.size).clamp(parameter.bounds[0], parameter.bounds[1]);
            small &= (moved - here).abs() <= SMALL_STEP * moved.abs().max(1e-3 * parameter.size);
            self.trial.at[j] = moved;
        }
        small
    }

    /// Goes to the trial, unless there are no slopes.
    fn accept(&mut self, cost: f64) -> bool {
        let minimum = &mut self.minimum;
        if !self
            .problem
            .slopes(self.parameters, &self.trial.at, &mut minimum.columns)
        {
            // The columns were overwritten: bring them back.
            self.problem
                .slopes(self.parameters, &minimum.at, &mut minimum.columns);
            return false;
        }
        std::mem::swap(&mut minimum.at, &mut self.trial.at);
        std::mem::swap(&mut minimum.residuals, &mut self.trial.residuals);
        minimum.cost = cost;
        true
    }
}

enum Attempt {
    Better,
    Worse,
    Last(Stop),
}

/// Factor on the next step after one that gained `gain` of what was promised: the least
/// of the parabola through both sums and the first slope.
fn shorter(gain: f64) -> f64 {
    if gain.is_finite() {
        (0.5 / (1.0 - 0.5 * gain.min(0.0))).clamp(0.1, 0.5)
    } else {
        0.1
    }
}

impl Minimum {
    fn cost_of(&self, parameters: &[Parameter], at: &[f64], residuals: &[f64]) -> f64 {
        let readings: f64 = residuals
            .iter()
            .map(|r| self.loss.cost(r / self.noise))
            .sum();
        let priors: f64 = parameters
            .iter()
            .zip(at)
            .filter_map(|(p, at)| Some((p, at, p.prior?)))
            .filter(|(p, ..)| p.is_free())
            .map(|(_, at, prior)| ((at - prior.value) / prior.deviation).powi(2))
            .sum();
        readings + priors
    }

    /// Σ residual² without any loss, priors included in the unit of `noise`.
    pub(super) fn square_sum(&self, parameters: &[Parameter], noise: f64) -> f64 {
        let plain = Self {
            loss: Loss::Square,
            noise: 1.0,
            ..self.clone()
        };
        let readings: f64 = self.residuals.iter().map(|r| r * r).sum();
        let all = plain.cost_of(parameters, &self.at, &self.residuals);
        readings + (all - readings) * noise * noise
    }

    /// Half the slope of the cost along a parameter, for residuals divided by
    /// `noise`.
    pub(super) fn slope_of_cost(&self, parameters: &[Parameter], j: usize, noise: f64) -> f64 {
        let readings: f64 = self
            .residuals
            .iter()
            .zip(&self.columns[j])
            .map(|(r, slope)| self.loss.weight(r / self.noise) * r * slope)
            .sum();
        let prior = parameters[j].prior.map_or(0.0, |prior| {
            (self.at[j] - prior.value) / prior.deviation.powi(2)
        });
        readings / (noise * noise) + prior
    }

    /// Slopes of the parameters `free` per size and residuals, weighted and
    /// divided by `noise`; with the priors as rows below them.
    pub(super) fn triangle(
        &self,
        parameters: &[Parameter],
        free: &[usize],
        noise: f64,
        with_priors: bool,
    ) -> Triangle {
        let columns: Vec<(&[f64], f64)> = free
            .iter()
            .map(|&j| (self.columns[j].as_slice(), parameters[j].size))
            .collect();
        let prior = |(place, &j): (usize, &usize)| {
            let prior = parameters[j].prior.filter(|_| with_priors)?;
            let misfit = (self.at[j] - prior.value) / prior.deviation;
            Some((place, parameters[j].size / prior.deviation, misfit))
        };
        let extra: Vec<_> = free.iter().enumerate().filter_map(prior).collect();
        Triangle::new(&columns, &self.residuals, &self.weights(noise), &extra)
    }

    fn weights(&self, noise: f64) -> Vec<f64> {
        let weight = |r: &f64| self.loss.weight(r / self.noise).sqrt() / noise;
        self.residuals.iter().map(weight).collect()
    }

    /// Share of each reading in its own fitted value; `inverse` as from
    /// [`Triangle::bounded_inverse`].
    pub(super) fn leverage(
        &self,
        parameters: &[Parameter],
        free: &[usize],
        noise: f64,
        inverse: &[Vec<f64>],
    ) -> Vec<f64> {
        let weights = self.weights(noise);
        let mut along = vec![0.0; free.len()];
        let share = |i: usize| -> f64 {
            along.fill(0.0);
            for (&j, row) in free.iter().zip(inverse) {
                let slope = self.columns[j][i] * parameters[j].size;
                // Most readings touch few parameters.
                if slope != 0.0 {
                    for (sum, part) in along.iter_mut().zip(row) {
                        *sum += slope * part;
                    }
                }
            }
            let square: f64 = along.iter().map(|x| x * x).sum();
            (square * weights[i] * weights[i]).clamp(0.0, 1.0)
        };
        (0..self.residuals.len()).map(share).collect()
    }
}
