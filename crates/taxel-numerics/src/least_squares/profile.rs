//! Questions that need further fits: profiles of the likelihood, and groups
//! left out.

use super::iteration::minimise;
use super::{Fit, FitError, FitOptions, Parameter, Problem, fit, quantile};

/// Where the 95 % interval of the parameter `index` ends by its profile: the
/// values at which the best fit of all others costs t² more. Unlike
/// [`super::Estimate::interval`] it needs no linear model; an end at a bound
/// means that there is none inside.
///
/// # Errors
/// Those of [`fit`].
pub fn profile_interval(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    found: &Fit,
    index: usize,
) -> Result<[f64; 2], FitError> {
    wide_profile_interval(problem, parameters, options, found, index, 1.0)
}

/// As [`profile_interval`], `width` times as wide for a linear model: where the best fit of
/// all others costs (width·t)² more. Of 2 it says how far a curved model reaches where an
/// interval of 95 % would have missed the truth.
///
/// # Errors
/// Those of [`fit`].
pub fn wide_profile_interval(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    found: &Fit,
    index: usize,
    width: f64,
) -> Result<[f64; 2], FitError> {
    let profile = Profile {
        problem,
        parameters,
        options,
        found,
        index,
        limit: width * quantile(found.scale, options.noise, found.freedom),
        least: minimise(problem, parameters, options, &found.values(), found.scale)?.cost,
    };
    Ok([profile.end(-1.0)?, profile.end(1.0)?])
}

struct Profile<'a> {
    problem: &'a dyn Problem,
    parameters: &'a [Parameter],
    options: &'a FitOptions,
    found: &'a Fit,
    index: usize,
    limit: f64,
    least: f64,
}

/// Fits for one end of an interval.
const MOST_FITS: usize = 60;
/// An end is known to this share of its distance.
const PRECISION: f64 = 1e-7;

impl Profile<'_> {
    /// The end on the side `sign`: the root of [`Self::misfit`], which grows
    /// along a straight line for a linear model.
    fn end(&self, sign: f64) -> Result<f64, FitError> {
        let estimate = &self.found.estimates[self.index];
        let [low, high] = self.parameters[self.index].bounds;
        let bound = if sign < 0.0 { low } else { high };
        let reach = (bound - estimate.value).abs();
        if reach == 0.0 {
            return Ok(bound);
        }
        let mut at = self.found.values();
        let mut inner = (0.0, -self.limit);
        let mut outer: Option<(f64, f64)> = None;
        let mut distance = (self.limit * estimate.deviation).min(reach);
        for _ in 0..MOST_FITS {
            let misfit = self.misfit(estimate.value + sign * distance, &mut at)?;
            if misfit < 0.0 {
                if distance >= reach {
                    return Ok(bound);
                }
                inner = (distance, misfit);
            } else {
                outer = Some((distance, misfit));
            }
            let next = match outer {
                None => (2.0 * distance).min(reach),
                Some(outer) => {
                    let secant = inner.0 - inner.1 * (outer.0 - inner.0) / (outer.1 - inner.1);
                    // Kept off the ends, so that both of them close in.
                    let width = outer.0 - inner.0;
                    secant.clamp(inner.0 + 1e-3 * width, outer.0 - 1e-3 * width)
                }
            };
            let settled = (next - distance).abs() <= PRECISION * distance;
            if misfit.abs() <= PRECISION * self.limit || settled {
                return Ok(estimate.value + sign * distance);
            }
            distance = next;
        }
        Ok(estimate.value + sign * outer.map_or(distance, |outer| outer.0))
    }

    /// Root of the cost above the least one, less the limit, with the
    /// parameter held at `value`; the others start at `at` and are left there.
    fn misfit(&self, value: f64, at: &mut Vec<f64>) -> Result<f64, FitError> {
        let mut parameters = self.parameters.to_vec();
        parameters[self.index].bounds = [value; 2];
        let scale = self.found.scale;
        let minimum = minimise(self.problem, &parameters, self.options, at, scale)?;
        // A held parameter's own prior is left out of the cost of the search.
        let prior = self.parameters[self.index].prior.map_or(0.0, |prior| {
            ((value - prior.value) / prior.deviation).powi(2)
        });
        at.clone_from(&minimum.at);
        Ok((minimum.cost + prior - self.least).max(0.0).sqrt() - self.limit)
    }
}

/// Residual of each reading from the fit without its whole group: exact, by
/// one fit for each of `groups` (the group of each reading, from 0).
///
/// # Errors
/// Those of [`fit`], for the first group whose absence leaves too little.
pub fn leave_groups_out(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    groups: &[usize],
) -> Result<Vec<f64>, FitError> {
    let mut left_out = vec![0.0; problem.readings()];
    let mut residuals = vec![0.0; problem.readings()];
    for group in 0..groups.iter().max().map_or(0, |last| last + 1) {
        let kept: Vec<bool> = groups.iter().map(|g| *g != group).collect();
        let found = fit(
            &Kept {
                problem,
                kept: &kept,
            },
            parameters,
            options,
        )?;
        problem.residuals(&found.values(), &mut residuals);
        for (i, kept) in kept.iter().enumerate() {
            if !kept {
                left_out[i] = residuals[i];
            }
        }
    }
    Ok(left_out)
}

/// A problem without some of its readings.
struct Kept<'a> {
    problem: &'a dyn Problem,
    kept: &'a [bool],
}

impl Kept<'_> {
    fn keep(&self, all: &[f64], some: &mut [f64]) {
        let kept = all.iter().zip(self.kept).filter(|(_, kept)| **kept);
        for (place, (value, _)) in some.iter_mut().zip(kept) {
            *place = *value;
        }
    }
}

impl Problem for Kept<'_> {
    fn readings(&self) -> usize {
        self.kept.iter().filter(|kept| **kept).count()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let mut all = vec![0.0; self.kept.len()];
        let there = self.problem.residuals(at, &mut all);
        self.keep(&all, residuals);
        there
    }

    fn slopes(&self, parameters: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let mut all = vec![vec![0.0; self.kept.len()]; columns.len()];
        let there = self.problem.slopes(parameters, at, &mut all);
        for (all, some) in all.iter().zip(columns) {
            self.keep(all, some);
        }
        there
    }
}
