//! The search: steps of Levenberg and Marquardt inside bounds.

use super::dense::Triangle;
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

    /// Whether a minimum was reached.
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
    /// What the weights of the residuals are made with.
    loss: Loss,
    noise: f64,
}

const FLAT: f64 = 1e-12;
const SMALL_STEP: f64 = 1e-12;
const FIRST_DAMPING: f64 = 1e-3;
/// Sums that differ by less than this share are the same: near the minimum the
/// step knows more than the sum.
const ROUNDING: f64 = 1e-14;
/// So many steps may be taken on the word of the slopes alone.
const MOST_LEVEL: usize = 4;
const MOST_DAMPING: f64 = 1e16;

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
    damping: f64,
    growth: f64,
    /// Steps in a row that left the sum as it was.
    level: usize,
    /// Largest length of each column so far.
    lengths: Vec<f64>,
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
            minimum,
            damping: FIRST_DAMPING,
            growth: 2.0,
            level: 0,
            lengths: vec![0.0; parameters.len()],
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
        for (a, &j) in free.iter().enumerate() {
            let square: f64 = triangle.rows.iter().map(|row| row[a] * row[a]).sum();
            self.lengths[j] = self.lengths[j].max(square.sqrt());
        }
        loop {
            match self.attempt(&triangle, &free) {
                Attempt::Better { small: true } => return Some(Stop::SmallStep),
                Attempt::Better { small: false } if self.level >= MOST_LEVEL => {
                    return Some(Stop::NoDecrease);
                }
                Attempt::Better { small: false } => return None,
                Attempt::Worse { small: true } => return Some(Stop::NoDecrease),
                Attempt::Worse { small: false } => {
                    self.damping *= self.growth;
                    self.growth *= 2.0;
                    if self.damping > MOST_DAMPING {
                        return Some(Stop::NoDecrease);
                    }
                }
            }
        }
    }

    /// Parameters that are neither fixed nor pressed against a bound.
    fn movable(&self) -> Vec<usize> {
        let minimum = &self.minimum;
        (0..self.parameters.len())
            .filter(|&j| {
                let [low, high] = self.parameters[j].bounds;
                let slope = minimum.slope_of_cost(self.parameters, j);
                let at = minimum.at[j];
                low < high && !(at <= low && slope > 0.0 || at >= high && slope < 0.0)
            })
            .collect()
    }

    fn attempt(&mut self, triangle: &Triangle, free: &[usize]) -> Attempt {
        // A column without any slope must not make the damping vanish.
        let longest = self.lengths.iter().copied().fold(0.0, f64::max);
        let lengths: Vec<f64> = free
            .iter()
            .map(|&j| self.lengths[j].max(1e-8 * longest))
            .collect();
        let Some(step) = triangle.step(self.damping, &lengths) else {
            return Attempt::Worse { small: false };
        };
        let mut at = self.minimum.at.clone();
        let mut small = true;
        for (&j, step) in free.iter().zip(&step) {
            let parameter = &self.parameters[j];
            let moved = at[j] - step * parameter.size;
            at[j] = moved.clamp(parameter.bounds[0], parameter.bounds[1]);
            let change = (at[j] - self.minimum.at[j]).abs();
            small &= change <= SMALL_STEP * at[j].abs().max(1e-3 * parameter.size);
        }
        let mut residuals = vec![0.0; self.problem.readings()];
        let there = self.problem.residuals(&at, &mut residuals);
        let cost = self.minimum.cost_of(self.parameters, &at, &residuals);
        let better = there && cost <= self.minimum.cost * (1.0 + ROUNDING);
        let slopes = better
            && self
                .problem
                .slopes(self.parameters, &at, &mut self.minimum.columns);
        if !slopes {
            if better {
                // The columns were overwritten: bring them back.
                let here = self.minimum.at.clone();
                self.problem
                    .slopes(self.parameters, &here, &mut self.minimum.columns);
            }
            return Attempt::Worse { small };
        }
        let lower = cost < self.minimum.cost * (1.0 - ROUNDING);
        self.level = if lower { 0 } else { self.level + 1 };
        let expected = triangle.decrease(&step);
        let gain = (self.minimum.cost - cost) / expected.max(f64::MIN_POSITIVE);
        let less = 1.0 - (2.0 * gain.min(1.0) - 1.0).powi(3);
        self.damping = (self.damping * less.max(0.1)).max(1e-14);
        self.growth = 2.0;
        self.minimum.at = at;
        self.minimum.residuals = residuals;
        self.minimum.cost = cost;
        Attempt::Better { small }
    }
}

enum Attempt {
    Better { small: bool },
    Worse { small: bool },
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

    /// Half the slope of the cost along a parameter.
    fn slope_of_cost(&self, parameters: &[Parameter], j: usize) -> f64 {
        let readings: f64 = self
            .residuals
            .iter()
            .zip(&self.columns[j])
            .map(|(r, slope)| self.loss.weight(r / self.noise) * r * slope)
            .sum();
        let prior = parameters[j].prior.map_or(0.0, |prior| {
            (self.at[j] - prior.value) / prior.deviation.powi(2)
        });
        readings / (self.noise * self.noise) + prior
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
        let weights = self.weights(noise);
        let weighted = |values: &[f64], size: f64| -> Vec<f64> {
            let pairs = values.iter().zip(&weights);
            pairs.map(|(value, weight)| value * weight * size).collect()
        };
        let columns: Vec<Vec<f64>> = free
            .iter()
            .map(|&j| weighted(&self.columns[j], parameters[j].size))
            .collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let prior = |(place, &j): (usize, &usize)| {
            let prior = parameters[j].prior.filter(|_| with_priors)?;
            let misfit = (self.at[j] - prior.value) / prior.deviation;
            Some((place, parameters[j].size / prior.deviation, misfit))
        };
        let extra: Vec<_> = free.iter().enumerate().filter_map(prior).collect();
        Triangle::new(&columns, &weighted(&self.residuals, 1.0), &extra)
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
        let share = |i: usize| -> f64 {
            let along = |k: usize| -> f64 {
                let terms = free.iter().zip(inverse);
                terms
                    .map(|(&j, row)| self.columns[j][i] * parameters[j].size * row[k])
                    .sum()
            };
            let square: f64 = (0..free.len()).map(|k| along(k).powi(2)).sum();
            (square * weights[i] * weights[i]).clamp(0.0, 1.0)
        };
        (0..self.residuals.len()).map(share).collect()
    }
}
